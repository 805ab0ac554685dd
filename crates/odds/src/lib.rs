//! Probabilities of rare events of a [`System`]: a function whose value above zero is the event, and whose arguments
//! are standard normal numbers, as many as the function reads. [`Function`] is a system with a fixed number of
//! arguments.
//!
//! [`subset`] is one run of subset simulation; [`Odds`] takes several runs, and importance sampling around the states
//! that they found in the event, to a probability with its interval and alarms.
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the C library"))]

mod alarm;
mod function;
mod mixture;
mod odds;
pub mod subset;
mod system;

pub use alarm::Alarm;
pub use function::Function;
pub use odds::{Estimator, GIVEN_UP, Odds, RUNS};
pub use system::{Halt, System, Watch, kept};
