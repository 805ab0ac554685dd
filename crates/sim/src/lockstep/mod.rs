//! The engine that is to take over: steps of a method with two derivatives, runs as values.
//!
//! The present engine ([`crate::run`]) evaluates the core eight times a step and keeps its control in `async` functions. Here
//! a step evaluates it once (`step`), each machine steps to its own next instant, machines may have motors, links and drives
//! of their own, still and moving ones share a step, and control is a value that is told what became of a step and says what
//! it wants next (`control`). Until every test that holds the present engine holds this one, the present one computes all
//! results, and is the reference of this one's tests (`tests/suite/lockstep.rs`). `docs/performance.md` says what is missing.

#![allow(
    clippy::needless_range_loop,
    reason = "legs and machines are walked by number: iterators are closures"
)]

mod control;
mod lanes;
mod physics;
mod step;

pub use lanes::{run, run_side_by_side, run_side_by_side_in};
