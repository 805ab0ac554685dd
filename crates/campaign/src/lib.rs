//! Many runs: from a scenario to cases, from cases to records, from records to statistics.
//!
//! ```text
//!   Scenario ──(trial number)──► Case ──► run ──► Record ──► Statistics, files
//! ```
//! A trial is a pure function of the scenario and its number, so a campaign gives the same records in the same
//! order on any number of threads ([`Campaign`]). A failed trial is a record like any other. What no method can do better
//! with the same excitation is told by [`Bounds`].
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the C library"))]

mod bound;
mod campaign;
mod compare;
mod engine;
mod numerics;
mod pace;
pub mod paper;
mod plan;
mod statistics;
pub mod store;
mod suitability;

pub use bound::{Bound, BoundError, Bounds, Counted, Unknown};
pub use campaign::{Campaign, CampaignError};
pub use numerics::NUMERICS;
pub use plan::Glance;
pub use statistics::{
    Estimate, Occurrence, Statistics, Summary, binomial_interval, correlated_difference,
    independent_difference, paired_difference, paired_rms, quantile_ranks, student,
};
pub use suitability::{CANDIDATES, Candidate, Demands, Suitability, SuitabilityError};

// What the sister crates need of each other.
#[doc(hidden)]
pub use compare::{Entry, mean_energy, told};

/// The examples of the README run too.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
