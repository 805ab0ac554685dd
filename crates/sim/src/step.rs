//! One step with all that is asked of it, of one machine or of several side by side.

use standstill_plant::Lane;

use crate::flow::{Evaluation, Machine, Operating};
use crate::integrator::Attempt;

/// A step that was tried.
#[derive(Clone, Copy, Debug)]
pub struct Trial<const N: usize, T = f64> {
    /// The step.
    pub attempt: Attempt<N, T>,
    /// Its error relative to the tolerance: at most 1 to be accepted.
    pub error: T,
    /// The machine at its end.
    pub end: Evaluation<N, T>,
    /// The machine in its middle.
    pub middle: Middle<T>,
    /// The state there.
    pub middle_state: [T; N],
}

/// What is known of a step's middle.
#[derive(Clone, Copy, Debug)]
pub struct Middle<T = f64> {
    /// The machine.
    pub operating: Operating<T>,
    /// Terminal potentials in V; of an idle bridge, but for what they have in common.
    pub potentials: [T; 3],
}

/// Tries a step of `h` seconds from the state `start` with the derivative `slope` at `time` in s.
#[inline(always)]
pub fn step<const N: usize, T: Lane>(
    machine: &Machine<T>,
    time: T,
    start: &[T; N],
    slope: &[T; N],
    h: T,
    tolerance: &[f64; N],
) -> Trial<N, T> {
    let attempt = Attempt::new(|t, y| machine.evaluate(t, y).slope, time, start, slope, h);
    let end = machine.evaluate(time + h, &attempt.end);
    let attempt = attempt.with_end_slope(end.slope);
    let middle_state = attempt.dense(0.5);
    let operating = machine.operating(time + h * 0.5, &middle_state);
    let potentials = machine.legs.potentials(&operating.port);
    let middle = Middle { operating, potentials };
    Trial { attempt, error: attempt.error(tolerance), end, middle, middle_state }
}
