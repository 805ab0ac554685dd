//! Probabilities of rare events of any [`System`], a function of a vector of standard normals that grows as it is read;
//! [`Function`] is one of a fixed number.
//!
//! [`subset`] walks chains from level to level; [`Odds`] has the answer of several such runs, with its interval and its alarms.
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the C library"))]

mod alarm;
mod function;
mod odds;
pub mod subset;
mod system;

pub use alarm::Alarm;
pub use function::Function;
pub use odds::{Estimator, GIVEN_UP, Odds, RUNS};
pub use system::{Halt, System, Watch, kept};
