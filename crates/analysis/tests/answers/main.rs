//! Answers of whole scenarios against closed forms, plain trials and one another. One program, which is compiled and linked once.

mod anatomy;
mod arrangements;
mod explained;
mod failures;
mod instant;
mod motor;
mod shares;
mod simulated;
mod turning;
