//! Analyses of a scenario that are computed from many trials. A trial is one simulated start: a detection at a drawn rotor angle, with
//! drawn errors of drive and sensors.
//!
//! ```text
//!   odds     P(event) down to one in a billion:  tape of standard normals ─► subset simulation, several runs ─► Odds
//!   budget   where the error comes from:         tapes that share draws   ─► Sobol' indices               ─► Budget
//!   require  what a part must do:                a key, a limit           ─► bracketing on common draws   ─► Requirement
//!   tune     which settings are best:            keys, a measure, limits  ─► search on common draws       ─► Tuned
//!   explain  why a trial ended as it did:       its tape, one draw at its mean              ─► Explained
//!   faults   what each failure mode leads to:    a fault in each trial        ─► faults::Counts
//!   qualify  whether requirements are met:     sequential tests, odds          ─► Qualification
//!   compare  methods side by side:              the same drives and angles    ─► Entry, with its Bound
//!   check    whether a motor is suited:         candidates, what is demanded  ─► Suitability, with settings
//! ```
//! [`Bounds`] computes the Cramér–Rao limit: no unbiased method has a smaller error with the same excitation. [`paper`] has the tables of
//! the paper from which this project started, audits them and simulates them.
//!
//! All analyses rest on one fact: a trial is a pure function of its random draws. A [`Tape`] holds the draws of one trial as standard
//! normal numbers, so that an analysis can choose them. The mathematics ([`mod@subset`], [`sobol`], [`bracket`]) is independent of motors:
//! [`mod@subset`] works on any [`System`], which is a function of a vector of standard normal numbers. [`Trials`] makes such a system from
//! a scenario.
//!
//! [`Tape`]: standstill_sim::Tape
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the C library"))]

mod anatomy;
mod answers;
mod bound;
pub mod bracket;
mod budget;
mod compare;
mod event;
mod explain;
pub mod faults;
pub mod limit;
pub mod paper;
pub mod qualify;
pub mod require;
pub mod sobol;
mod suitability;
mod trials;
pub mod tune;
pub mod witness;

pub use anatomy::{Anatomy, Draw, Sector};
pub use answers::Answers;
pub use bound::{Bound, BoundError, Bounds, Counted, Unknown};
pub use budget::{AngleRange, Budget, Item, Own, PAIRS, Source, TooFew, trials as trials_of_budget};
pub use compare::{Entry, informative, mean_energy};
pub use event::{Event, EventError};
pub use explain::{Cause, Explained};
pub use standstill_odds::{Alarm, Estimator, Function, GIVEN_UP, Halt, Odds, RUNS, System, Watch, subset};
pub use suitability::{
    Advice, Alternative, CANDIDATES, COUNTED, Candidate, Condition, Confirmed, Demand, Demands, Effort,
    Margins, Progress, Setting, Suitability, SuitabilityError, Suited, TurningSpeeds, Wanting, Way,
    most_work, standing,
};
pub use trials::Trials;
