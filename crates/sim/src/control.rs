//! Control of one run: carries out all that is due at an instant and returns the run's next need (a step or a command).

mod comparators;
mod conduction;
mod course;
mod dividers;
mod due;
mod expected;
mod faults;
mod gates;
mod ledger;
mod motion;
mod past;
mod place;
mod requests;
mod run;
mod samples;
mod terminals;
mod watch;

pub use motion::can_move;
pub use past::Past;
pub use run::{Control, Want};
pub use samples::Room;
pub use terminals::{Joined, Settled};
