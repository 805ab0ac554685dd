//! One step of several machines side by side.

pub mod dense;
pub mod ends;
pub mod hermite;
pub mod two_derivative;
