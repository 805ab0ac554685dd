//! Steps of several machines at once.
//!
//! What they compute is what a single machine's step computes, written once ([`Machine`], [`step`]) and here compiled
//! for arrays of numbers and the widest registers that the processor at hand has. Multiplication and addition are not
//! fused: each lane has the bits of the machine alone. A campaign does not use them yet; docs/performance.md says why.

use multiversion::multiversion;
use standstill_inverter::Legs;
use standstill_plant::{Heading, Pack};

use crate::flow::Machine;
use crate::step::{Trial, step};

/// Machines side by side: one register of the widest kind, two or four of others.
pub const LANES: usize = 8;

/// A number of each.
pub type Lanes = Pack<LANES>;

impl<'a> Machine<'a, Lanes> {
    /// Machines side by side, of which all have the motor and the kind of link of the first and all move or none does.
    pub fn side_by_side(machines: &[Machine<'a>; LANES]) -> Self {
        let of = |number: fn(&Machine<'a>) -> f64| Pack(machines.each_ref().map(number));
        let leg = |number: fn(&Legs) -> &[f64; 3]| {
            [0, 1, 2].map(|k| Pack(machines.each_ref().map(|machine| number(&machine.legs)[k])))
        };
        Self {
            motor: machines[0].motor,
            link: machines[0].link,
            ripple_phase: of(|machine| machine.ripple_phase),
            legs: Legs {
                rail: leg(|legs| &legs.rail),
                offset: leg(|legs| &legs.offset),
                resistance: leg(|legs| &legs.resistance),
                blocked: leg(|legs| &legs.blocked),
                idle: of(|machine| machine.legs.idle),
            },
            moves: machines[0].moves,
            dry_friction: of(|machine| machine.dry_friction),
            load_torque: of(|machine| machine.load_torque),
            angle: of(|machine| machine.angle),
            heading: Heading {
                sin: of(|machine| machine.heading.sin),
                cos: of(|machine| machine.heading.cos),
            },
        }
    }
}

/// The right-hand side of each; time in s.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+avx2+bmi2", "x86_64+avx2+bmi2"))]
pub fn slopes_of_lanes<const N: usize>(
    machines: &Machine<Lanes>,
    time: &Lanes,
    state: &[Lanes; N],
    slope: &mut [Lanes; N],
) {
    *slope = machines.evaluate(*time, state).slope;
}

/// A step of each: see [`step`].
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+avx2+bmi2", "x86_64+avx2+bmi2"))]
pub fn step_of_lanes<const N: usize>(
    machines: &Machine<Lanes>,
    time: &Lanes,
    start: &[Lanes; N],
    slope: &[Lanes; N],
    h: &Lanes,
    tolerance: &[f64; N],
) -> Trial<N, Lanes> {
    step(machines, *time, start, slope, *h, tolerance)
}
