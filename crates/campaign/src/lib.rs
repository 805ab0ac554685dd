//! Many runs: from a scenario to cases, from cases to records, from records to statistics.
//!
//! ```text
//!   Scenario ──(trial number)──► Case ──► run ──► Record ──► Statistics, files
//! ```
//! A trial is a pure function of the scenario and its number, so a campaign gives the same records in the same
//! order on any number of threads ([`Campaign`]). A failed trial is a record like any other.
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the C library"))]

mod campaign;
mod engine;
mod numerics;
mod pace;
mod parallel;
mod plan;
mod statistics;
pub mod store;

pub use campaign::{Campaign, CampaignError};
pub use numerics::{NUMERICS, digests};
pub use parallel::in_parallel;
pub use plan::Glance;
pub use statistics::{
    Apart, Estimate, Judgement, Occurrence, Sectors, Statistics, Summary, binomial_interval,
    correlated_difference, independent_difference, one_sided_bounds, paired_difference, paired_rms,
    quantile_ranks, student, student_beyond,
};

/// The examples of the README run too.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
