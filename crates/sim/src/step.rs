//! Integration methods for one time step of several machines side by side.

pub mod dense;
pub mod dormand_prince;
pub mod ends;
pub mod error;
pub mod hermite;
pub mod referee;
pub mod two_derivative;
