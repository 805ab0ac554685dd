//! One step of several machines side by side.

mod corrections;
pub mod dense;
pub mod dormand_prince;
pub mod ends;
mod error;
pub mod hermite;
pub mod referee;
pub mod ringing;
mod stumpff;
pub mod two_derivative;
