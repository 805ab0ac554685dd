//! One step with all that is asked of it, of one machine or of several side by side.

use standstill_inverter::{Port, Terminals};
use standstill_numeric::Lane;

use crate::integrator::{Attempt, STAGES};
use crate::limits::{Limits, MARGINS};
use crate::machine::Machine;

/// A step that is wanted.
#[derive(Clone, Copy, Debug)]
pub struct Ask<'a, const N: usize, T = f64> {
    /// The machine.
    pub machine: &'a Machine<'a, T>,
    /// What would end it.
    pub limits: &'a Limits<T>,
    /// Time in s since the start of the run.
    pub time: T,
    /// Where the step begins.
    pub start: [T; N],
    /// Its length in s.
    pub h: T,
}

/// A step that was tried.
#[derive(Clone, Copy, Debug)]
pub struct Stride<const N: usize, T = f64> {
    /// Its error relative to the tolerance: at most 1 to be accepted; not a number if anything was none.
    pub error: T,
    /// The smallest of the margins in its middle and at its end: negative if something ended within it.
    pub margin: T,
    /// The state at its end, with the currents of blocked legs at zero.
    pub end: [T; N],
    /// The machine there.
    pub port: Port<T>,
    /// What tells the currents within it.
    pub crossing: Crossing<T>,
}

/// What tells the currents within a step.
#[derive(Clone, Copy, Debug, Default)]
pub struct Crossing<T = f64> {
    /// The smallest margin but for the currents of conducting legs.
    pub other_margin: T,
    /// Phase currents in A in the step's middle.
    pub middle_current: [T; 3],
    /// How fast they rise in A/s at its beginning and at its end.
    pub rise: [[T; 3]; 2],
}

/// The polynomial of order four over 0 to 1 that has these values at the beginning, in the middle and at the end, and these
/// slopes at both ends.
pub fn quartic([begin, middle, end]: [f64; 3], [first, last]: [f64; 2]) -> impl Fn(f64) -> f64 {
    let cubic = move |x: f64| {
        let y = 1.0 - x;
        begin * y * y * (1.0 + 2.0 * x) + first * x * y * y + end * x * x * (1.0 + 2.0 * y) - last * x * x * y
    };
    // What the cubic misses in the middle goes on top; it changes neither values nor slopes at the ends.
    let missing = 16.0 * (middle - cubic(0.5));
    move |x| cubic(x) + missing * (x * (1.0 - x)) * (x * (1.0 - x))
}

/// The lower of a margin's values in the middle and at the end; −1 where they are positive and the parabola through them and
/// the beginning is not all the way.
#[inline(always)]
fn lowest<T: Lane>(begin: T, middle: T, end: T) -> T {
    let lower = middle.least(end);
    // m(x) = begin + slope x + bend x², lowest at −slope / 2 bend.
    let (slope, bend) = (middle * 4.0 - begin * 3.0 - end, (begin + end - middle * 2.0) * 2.0);
    let zero = T::of(0.0);
    let inside = T::choose(zero.above(slope), bend * 2.0 + slope, -T::of(1.0));
    let below = slope * slope - bend * begin * 4.0;
    let dips = T::choose(inside.above(zero), below, zero).above(zero);
    T::choose(dips, lower.least(-T::of(1.0)), lower)
}

/// Where the parabola through a margin's values at the beginning, in the middle and at the end is lowest, as a share of the step;
/// none if that is at an end.
pub fn lowest_at(begin: f64, middle: f64, end: f64) -> Option<f64> {
    let (slope, bend) = (4.0 * middle - 3.0 * begin - end, 2.0 * (begin + end - 2.0 * middle));
    let share = -slope / (2.0 * bend);
    (bend > 0.0 && share > 0.0 && share < 1.0).then_some(share)
}

impl<const N: usize, T: Lane> Ask<'_, N, T> {
    /// The step alone.
    #[inline(always)]
    pub fn attempt(&self, terminals: &Terminals<T>) -> Attempt<N, T> {
        let Self { machine, time, start, h, .. } = self;
        Attempt::new(*start, *h).take(|t, y| machine.evaluate(terminals, t, y).slope, *time)
    }

    /// The step, its error, whether anything ends within it, and its end.
    ///
    /// The margins are looked at in the middle, at the end, and where the parabola through these and the beginning dips below
    /// zero in between.
    #[inline(always)]
    pub fn stride(&self, tolerance: &[f64; N]) -> Stride<N, T> {
        let Self { machine, limits, time, start, h } = self;
        let terminals = machine.terminals();
        let mut attempt = Attempt::new(*start, *h);
        let beyond = T::of(f64::INFINITY);
        let (mut margin, mut other_margin) = (beyond, beyond);
        let (mut at_begin, mut at_end) = ([beyond; MARGINS], [beyond; MARGINS]);
        let (mut middle_current, mut rise, mut end) = ([beyond; 3], [[beyond; 3]; 2], None);
        // One call of the right-hand side, so that it can be part of the loop.
        for stage in 0..=STAGES {
            let (share, y) = attempt.wants(stage);
            let there = machine.evaluate(&terminals, *time + *h * share, &y);
            attempt.knows(stage, &y, there.slope);
            if stage > 0 && stage + 1 < STAGES {
                continue;
            }
            let margins = limits.margins(machine, &y, &there);
            if stage == 0 {
                at_begin = margins;
                rise[0] = machine.rise(&there);
            } else if stage + 1 == STAGES {
                at_end = margins;
                rise[1] = machine.rise(&there);
                end = Some(there.operating);
            } else {
                middle_current = machine.phases(&there.operating);
                for which in 0..MARGINS {
                    let one = lowest(at_begin[which], margins[which], at_end[which]);
                    margin = margin.least(one);
                    if which < 3 {
                        let conducts = machine.legs.leg[which].direction.abs().above(T::of(0.0));
                        other_margin = other_margin.least(T::choose(conducts, beyond, one));
                    } else {
                        other_margin = other_margin.least(one);
                    }
                }
            }
        }
        let (mut state, mut at) = (attempt.end, end.unwrap_or_else(|| unreachable!("every step ends")));
        machine.settle(&terminals, &mut state, &mut at);
        Stride {
            error: attempt.error(tolerance),
            margin,
            end: state,
            port: machine.port(&at),
            crossing: Crossing { other_margin, middle_current, rise },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_a_margin_that_dips_and_returns_is_seen() {
        let margin = |low: f64, at: f64| move |x: f64| low + 3.0 * (x - at) * (x - at);
        for at in [0.1, 0.3, 0.49, 0.6, 0.9] {
            for (low, dips) in [(-1e-3, true), (1e-3, false)] {
                let m = margin(low, at);
                let [begin, middle, end] = [m(0.0), m(0.5), m(1.0)];
                assert!((lowest_at(begin, middle, end).expect("inside") - at).abs() < 1e-12);
                assert_eq!(lowest(begin, middle, end) < 0.0, dips, "{at} {low}");
            }
        }
        // Lowest at an end, straight, upside down, or infinitely far.
        let outside = margin(-0.001, 1.1);
        assert_eq!(lowest(outside(0.0), outside(0.5), outside(1.0)), outside(1.0));
        assert_eq!(lowest(0.0, 1.0, 2.0), 1.0);
        assert_eq!(lowest(1.0, 2.0, 1.0), 1.0);
        assert_eq!(lowest(f64::INFINITY, f64::INFINITY, f64::INFINITY), f64::INFINITY);
        assert_eq!(lowest_at(1.0, 2.0, 1.0), None);
    }

    #[test]
    fn analytic_a_quartic_is_found_from_three_values_and_two_slopes() {
        let exact = |x: f64| 0.3 - 1.2 * x + 0.7 * x * x + 2.0 * x.powi(3) - 1.1 * x.powi(4);
        let slope = |x: f64| -1.2 + 1.4 * x + 6.0 * x * x - 4.4 * x.powi(3);
        let found = quartic([exact(0.0), exact(0.5), exact(1.0)], [slope(0.0), slope(1.0)]);
        for k in 0..=20 {
            let x = f64::from(k) / 20.0;
            assert!((found(x) - exact(x)).abs() < 1e-15, "{x}");
        }
    }

    #[test]
    fn analytic_a_current_within_a_step_is_of_order_five() {
        // A current that decays; half the step leaves a thirty-second of the error.
        let error = |h: f64| {
            let at = |x: f64| (-h * x).exp();
            let found = quartic([at(0.0), at(0.5), at(1.0)], [-h, -h * at(1.0)]);
            (0..=40).map(|k| f64::from(k) / 40.0).map(|x| (found(x) - at(x)).abs()).fold(0.0, f64::max)
        };
        let order = (error(0.4) / error(0.2)).log2();
        assert!((order - 5.0).abs() < 0.2, "{order}");
    }
}
