//! One step of several machines side by side.

pub mod corrections;
pub mod dense;
pub mod dormand_prince;
pub mod ends;
pub mod error;
pub mod floating;
pub mod hermite;
pub mod modes;
pub mod referee;
pub mod ringing;
mod stumpff;
pub mod swing;
pub mod two_derivative;
