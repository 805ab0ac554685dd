//! A run as a value: what happens at its instants, and what it wants next.

mod conduction;
mod course;
mod expected;
mod gates;
mod ledger;
mod motion;
mod place;
mod requests;
mod run;
mod samples;
mod terminals;
mod watch;

pub use motion::can_move;
pub use run::{Control, Want};
