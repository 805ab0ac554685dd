//! Simulation of one deterministic run of motor, inverter, sensors and detector.
//!
//! ```text
//!   command → gate edges → conduction → voltage → flux → current → reading → detector → command
//! ```
//!
//! Time is divided at instants: gate edges and ADC triggers at whole nanoseconds, changes of conduction and of the
//! rotor's motion at any time. Between two neighbouring instants the solution is smooth, and two-derivative steps
//! integrate it, for one machine ([`run`]) or for several side by side ([`run_side_by_side`]). A run is a pure function
//! of its [`Case`]: nothing in it depends on the clock, and every random draw has a purpose and a number ([`Streams`]).
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the C library"))]
#![allow(
    clippy::needless_range_loop,
    reason = "legs and machines are walked by number: iterators are closures, which are not compiled for wide registers"
)]

/// Expands to `[f(0), f(1)]` without a closure. The closure of an array's `map` would be a separate function, compiled without
/// wide-register instructions, so that each operation in it would be a call.
macro_rules! pair {
    ($k:ident => $of:expr) => {{
        let first = {
            let $k: usize = 0;
            $of
        };
        let second = {
            let $k: usize = 1;
            $of
        };
        [first, second]
    }};
}

/// Expands to the `map` of an option without a closure, for the same reason as [`pair`].
macro_rules! some {
    ($of:expr, $value:pat => $to:expr) => {
        match $of {
            Some($value) => Some($to),
            None => None,
        }
    };
}

/// Expands to `[f(0), f(1), f(2)]` without a closure, for the same reason as [`pair`].
macro_rules! three {
    ($k:ident => $of:expr) => {{
        let [first, second] = pair!($k => $of);
        let third = {
            let $k: usize = 2;
            $of
        };
        [first, second, third]
    }};
}

mod case;
mod control;
mod effect;
mod faults;
mod guard;
mod lanes;
mod ledger;
mod physics;
mod sensing;
mod step;
mod streams;
mod trace;

pub use case::{Case, Ended, Place, Play, RotorState, Run, RunError, RunOf, Tolerance, Work};
pub use faults::{Broken, Fault, Faults, MOST_FAULTS, Misreading, Short};
pub use lanes::driven::Driven;
pub use lanes::{referee, run, run_side_by_side};
pub use ledger::Ledger;
pub use physics::motion::Motion;
pub use sensing::{
    Adc, Arrangement, Comparator, ComparatorSettings, Comparators, PickUp, Resolver, SensorSettings, Sensors,
    TerminalSensor, VoltageSensor,
};
pub use streams::{Draws, Purpose, Streams, Tape};
pub use trace::{ComparatorState, Event, Health, NoProbe, Own, Probe, Snapshot, Trace};

// Items for the other crates of this workspace only.
#[doc(hidden)]
pub use lanes::run_side_by_side_in;
#[doc(hidden)]
pub use standstill_numeric::{MOST_LANES, Width};
#[doc(hidden)]
pub use streams::Strip;

/// Runs the examples of the README as tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
