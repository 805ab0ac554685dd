//! Whether the rounds of a train agree: the rotor is where it was in the first one, and equal pulses show equal currents.
//!
//! The fit sums the samples of all rounds. A rotor that turns on from round to round leaves sums of which the fit may by chance make an axis
//! and a pole. So does a fault that begins between two rounds: what it takes from pulses one way looks like saturation.
//!
//! A pulse of one line and way raises the current `i = U t / L` again in each round, per volt of the link. Without a fault two rounds differ by
//! noise, by jitter of the edges, and by the angle Δ that the rotor has turned: `L_A (1 + r cos 2x)` of a line has the relative slope
//! `2 r / √(1 − r²)` at most. Saturation, gains, delays and resistance are the same in each round. The link may sag from round to round as it
//! likes: the current follows it. Where it does not, the reading of the link is wrong.
//!
//! A rotor that nothing holds is set in motion by the first pulse of a line and stopped by the second, which it shows more or less current. In a
//! round of the other order that is the other way. So one way is compared with its equals in rounds of the same order, and the sum of both ways in
//! all rounds.

use standstill_interface::{Abc, Angle, Fault, Real};

use super::MaximumLikelihood;

use crate::checks::Check;
use crate::parts::lines::{Saliency, SaliencySign};
use crate::parts::margin::Margin;
use crate::parts::polarity::Pointer;
use crate::parts::significance;
use crate::parts::train::Slot;
use crate::parts::turning::DEGREE;

/// Angle in rad, 30°, by which the axes of two rounds may differ beside noise: jitter of the edges, of which a drive knows nothing.
const MOST_TURNED: f64 = 30.0 * DEGREE;

/// Six standard deviations of the difference of two axes: each has 0.408 ε/(|L_B|/L_A), with a variance ε² of a line that is a half of the
/// one of a pulse's sample.
const BY_ROUNDS: f64 = 6.0 * 0.408;

/// Six standard deviations of the difference of two pulses.
const BY_PULSES: f64 = 6.0 * core::f64::consts::SQRT_2;

/// Share by which equal pulses of two rounds may differ beside that: the iron's memory, a link that sags while a core saturates.
const ALIKE: f64 = 0.02;

/// The smallest and the largest of some numbers, and their sum.
#[derive(Clone, Copy, Debug)]
struct Extent<T> {
    low: T,
    high: T,
    sum: T,
    count: T,
}

impl<T: Real> Extent<T> {
    fn new() -> Self {
        Self { low: T::infinity(), high: T::neg_infinity(), sum: T::zero(), count: T::zero() }
    }

    fn add(&mut self, value: T) {
        self.low = self.low.min(value);
        self.high = self.high.max(value);
        self.sum = self.sum + value;
        self.count = self.count + T::one();
    }

    fn mean(&self) -> T {
        self.sum / self.count
    }

    /// Returns the difference between the largest and the smallest as a share of the mean.
    fn spread(&self) -> T {
        (self.high - self.low) / self.mean()
    }
}

/// A pulse of a train, as its rounds are compared by.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shown<T> {
    /// Current in A at the end of the pulse, and the slope in A per sample of the straight line from zero that fits best; both per the link of
    /// the train's first pulse.
    pub end: T,
    pub slope: T,
    /// Mean of the link's readings in V, and as a multiple of the train's first pulse.
    pub volts: T,
    pub times: T,
}

/// Differences of two equal pulses that are none of a fault.
#[derive(Clone, Copy, Debug)]
pub(super) struct Alike<T> {
    /// Standard deviation of a pulse's slope by noise, as a share of it.
    pub deviation: T,
    /// |L_B|/L_A of the motor.
    pub saliency: T,
    /// Current in A at the end of a pulse.
    pub peak: T,
}

impl<T: Real> Alike<T> {
    /// Returns the share by which equal pulses of a rotor that stands may differ.
    fn scatter(&self) -> T {
        T::of(ALIKE) + T::of(BY_PULSES) * self.deviation
    }
}

/// What the rounds of a train show: axes, by the currents at the ends of their pulses, and the pulses themselves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rounds<T> {
    /// Sums in A over both ways, by line: of the first round, and of the present one.
    first: [T; 3],
    now: [T; 3],
    /// The largest angle in rad between the axes of the first and of a later round.
    turned: T,
    /// Slopes by line, backward and forward in rounds of the first one's order, and of both ways in all: per volt of the link, and as read.
    pulses: [[[Extent<T>; 2]; 3]; 3],
    /// Sums of both ways in the present round, by line.
    both: [[T; 2]; 3],
    /// Number of rounds that have ended.
    ended: u8,
    /// The link in V.
    link: Extent<T>,
}

impl<T: Real> Rounds<T> {
    pub fn new() -> Self {
        let (zero, none) = (T::zero(), Extent::new());
        Self {
            first: [zero; 3],
            now: [zero; 3],
            turned: zero,
            pulses: [[[none; 2]; 3]; 3],
            both: [[zero; 2]; 3],
            ended: 0,
            link: none,
        }
    }

    /// Adds a pulse.
    pub fn add(&mut self, slot: Slot, shown: Shown<T>) {
        self.now[slot.line] = self.now[slot.line] + shown.end;
        let slopes = [shown.slope, shown.slope * shown.times];
        for (n, slope) in slopes.into_iter().enumerate() {
            self.both[slot.line][n] = self.both[slot.line][n] + slope;
            if self.ended.is_multiple_of(2) {
                self.pulses[slot.line][usize::from(slot.forward)][n].add(slope);
            }
        }
        self.link.add(shown.volts);
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
        for (line, both) in self.pulses.iter_mut().zip(&mut self.both) {
            for (extent, sum) in line[2].iter_mut().zip(both) {
                extent.add(*sum);
                *sum = T::zero();
            }
        }
        self.ended = self.ended.wrapping_add(1);
    }

    /// Checks that no round saw an axis elsewhere; `scatter`: noise of a reading as a share of its current, over |L_B|/L_A.
    pub fn check(&self, margin: &mut Margin<T>, scatter: T) -> Result<(), Fault<T>> {
        let (angle, allowed) = (self.turned, T::of(MOST_TURNED) + T::of(BY_ROUNDS) * scatter);
        margin.at_most(angle, allowed);
        if angle > allowed { Err(Fault::RotorMoves { angle, allowed }) } else { Ok(()) }
    }

    /// Iterates over the lines' spreads of both ways' sums, per volt of the link.
    #[cfg(test)]
    pub fn spreads(&self) -> impl Iterator<Item = T> {
        self.pulses.iter().map(|[_, _, [by_volts, _]]| by_volts.spread())
    }

    /// Checks that the currents of equal pulses follow the link as it is read. A rotor that turns changes them alike, as read and per volt.
    pub fn check_link(&self, margin: &mut Margin<T>, alike: &Alike<T>) -> Result<(), Fault<T>> {
        let allowed = alike.scatter();
        for [by_volts, as_read] in self.pulses.as_flattened() {
            // Currents that agree as they are read, better than per volt, do not follow the link.
            let unlike = by_volts.spread() - as_read.spread();
            margin.at_most(unlike, allowed);
            if unlike > allowed {
                let (low, high, mean) = (self.link.low, self.link.high, self.link.mean());
                let found = if high - mean > mean - low { high } else { low };
                let two = T::of(2.0);
                let [below, above] = [-allowed, allowed].map(|apart| mean * (T::one() + apart / two));
                return Err(Fault::DcLinkOutOfRange { found, allowed: [below, above] });
            }
        }
        Ok(())
    }

    /// Returns whether the pulses of a line agree as those of a rotor that stands. A rotor that turns far changes all three lines; a sensor that
    /// breaks on the way leaves the line that it does not read, and a single wrong pulse leaves two.
    pub fn has_steady_line(&self, alike: &Alike<T>) -> bool {
        let allowed = alike.scatter();
        self.pulses.iter().any(|line| line.iter().all(|[by_volts, _]| by_volts.spread() <= allowed))
    }

    /// Checks that equal pulses of all rounds show equal currents, per volt of the link.
    pub fn check_pulses(&self, margin: &mut Margin<T>, alike: &Alike<T>) -> Result<(), Fault<T>> {
        let r = alike.saliency.min(T::of(0.9));
        let by_turning = T::of(2.0) * r / (T::one() - r * r).sqrt() * self.turned;
        let allowed = alike.scatter() + by_turning;
        for [by_volts, _] in self.pulses.as_flattened() {
            let apart = by_volts.spread();
            margin.at_most(apart, allowed);
            if apart > allowed {
                let [apart, allowed] = [apart, allowed].map(|share| share * alike.peak);
                return Err(Fault::SensorsDisagree { apart, allowed });
            }
        }
        Ok(())
    }
}

impl<T: Real> MaximumLikelihood<T> {
    /// Checks that the rounds agree, and that both ways of the lines are those of a rotor that stands. `peak`: current in A at the end of a pulse;
    /// `saliency`: |L_B|/L_A; the other arguments: see [`BothWaysSettings::check_standing`].
    pub(super) fn check_rounds(
        &mut self,
        (peak, saliency): (T, T),
        volts: (f64, T),
        pointer: &Pointer<T>,
        axis: (Angle<T>, T),
    ) -> Result<(), Fault<T>> {
        let (settings, alike) = (&self.settings.pulses, self.alike(peak, saliency));
        let (checks, margin) = (settings.plausibility.checks, &mut self.train.margin);
        // A rotor that turns leaves the link as it is, and no line: what it changes else may be of a part that breaks on the way, which is rarer.
        if checks.has(Check::Link) {
            self.rounds.check_link(margin, &alike)?;
        }
        let pulses =
            if checks.has(Check::Sensors) { self.rounds.check_pulses(margin, &alike) } else { Ok(()) };
        if self.rounds.has_steady_line(&alike) {
            pulses?;
        }
        settings.check_standing(margin, volts, pointer, axis)?;
        if checks.has(Check::Turning) {
            let scatter = self.train.noise.sqrt() / (peak * saliency);
            self.rounds.check(margin, scatter)?;
        }
        pulses
    }

    /// Returns by how much equal pulses may differ; `peak`: current in A at their end, `saliency`: |L_B|/L_A.
    pub(super) fn alike(&self, peak: T, saliency: T) -> Alike<T> {
        let (train, sensing) = (&self.train.settings, &self.settings.pulses.sensing);
        // A straight line from zero through n readings at 1 … n has σ/√(Σ n²) ≈ σ √(3/n³), its end n times that.
        let on = T::of(train.samples_on() as f64);
        let reading = T::of(3.0) / on * self.train.noise / (peak * peak);
        let link = sensing.link_noise / self.dc_link;
        let [dead, pulse] = [train.dead_time, train.pulse].map(|time| T::of(time.seconds()));
        let edges = significance::of_timing(dead, pulse);
        Alike { deviation: (reading + link * link / on + edges).sqrt(), saliency, peak }
    }
}
