//! Whether the rotor is where it was in the first round of a train.
//!
//! The fit sums the samples of all rounds. A rotor that turns on from round to round leaves sums of which the fit may by chance make an axis
//! and a pole.

use standstill_interface::{Abc, Angle, Fault, Real};

use crate::parts::lines::{Saliency, SaliencySign};
use crate::parts::margin::Margin;
use crate::parts::turning::DEGREE;

/// Angle in rad, 30°, by which the axes of two rounds may differ beside noise: jitter of the edges, of which a drive knows nothing.
const MOST_TURNED: f64 = 30.0 * DEGREE;

/// Six standard deviations of the difference of two axes: each has 0.408 ε/(|L_B|/L_A), with a variance ε² of a line that is a half of the
/// one of a pulse's sample.
const BY_ROUNDS: f64 = 6.0 * 0.408;

/// The axes of a train's rounds, by the currents at the ends of their pulses.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rounds<T> {
    /// Sums in A over both ways, by line: of the first round, and of the present one.
    first: [T; 3],
    now: [T; 3],
    /// The largest angle in rad between the axes of the first and of a later round.
    turned: T,
}

impl<T: Real> Rounds<T> {
    pub fn new() -> Self {
        let zero = T::zero();
        Self { first: [zero; 3], now: [zero; 3], turned: zero }
    }

    /// Adds the current in A at the end of a pulse.
    pub fn add(&mut self, line: usize, current: T) {
        self.now[line] = self.now[line] + current;
    }

    /// Ends a round.
    pub fn end(&mut self, sign: SaliencySign) {
        let twice = |ends: [T; 3]| {
            let axis = Saliency::from_lines(Abc(ends.map(T::recip)), sign).axis;
            Angle::from_radians(axis.radians() * T::of(2.0))
        };
        if self.first[0] > T::zero() {
            let apart = twice(self.now).difference(twice(self.first)).abs() / T::of(2.0);
            self.turned = self.turned.max(apart);
        } else {
            self.first = self.now;
        }
        self.now = [T::zero(); 3];
    }

    /// Checks that no round saw an axis elsewhere; `scatter`: noise of a reading as a share of its current, over |L_B|/L_A.
    pub fn check(&self, margin: &mut Margin<T>, scatter: T) -> Result<(), Fault<T>> {
        let (angle, allowed) = (self.turned, T::of(MOST_TURNED) + T::of(BY_ROUNDS) * scatter);
        margin.at_most(angle, allowed);
        if angle > allowed { Err(Fault::RotorMoves { angle, allowed }) } else { Ok(()) }
    }
}
