//! Mean of several trains, each weighted by its information.

use standstill_interface::{Abc, AlphaBeta, Angle, Fault, Real};

use crate::parts::lines::{Saliency, SaliencySign};
use crate::parts::margin::Margin;
use crate::parts::polarity::Pointer;
use crate::parts::train::GainComparison;

#[cfg(test)]
mod tests;

/// Angle in rad, 0.6°, by which the axes that trains of different length see may differ: saturation turns them a little.
const MOST_MOVEMENT: f64 = 0.01;

/// Standard deviation in rad, and relative of a gain, that no train goes below: without noise a weight would be infinite.
const LEAST_DEVIATION: f64 = 1e-6;

/// Estimates from one train.
#[derive(Clone, Copy, Debug)]
pub(super) struct Said<T> {
    /// Line inductances in H, and the variance in rad² that they give the axis.
    pub lines: [T; 3],
    pub variance: T,
    /// Covariance of the lines by noise, in H².
    pub covariance: [[T; 3]; 3],
    /// The rest of it in H, the standard deviation that a specimen's own lag gives each line: the same in all trains.
    pub shift: [T; 3],
    /// r of each line, see [`GainComparison`], and the variance that noise gives it.
    pub ratios: [T; 3],
    pub ratio_noise: [T; 3],
    /// D in H/A; the fields after it are the variance of each component by noise, and the standard deviation of errors
    /// that repetition does not reveal.
    pub direction: AlphaBeta<T>,
    pub noise: T,
    pub floor: T,
    /// Mean instants in s at which the lines were measured.
    pub instants: [T; 3],
}

/// Weighted means over all trains so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Combined<T> {
    /// Number of trains.
    pub trains: u8,
    /// Weighted means.
    pub lines: [T; 3],
    /// Instants in s for which these lines hold.
    pub instants: [T; 3],
    covariance: [[T; 3]; 3],
    shift: [T; 3],
    ratios: [T; 3],
    /// Inverse variances.
    weight: T,
    ratio_weights: [T; 3],
    pointer: Weighted<T>,
}

/// Moves a weighted mean towards another value; the share that the value has in it.
fn approach<T: Real>(mean: &mut T, weight: &mut T, value: T, its: T) {
    *weight = *weight + its;
    *mean = *mean + (value - *mean) * (its / *weight);
}

impl<T: Real> Combined<T> {
    pub fn new() -> Self {
        let zero = T::zero();
        Self {
            trains: 0,
            lines: [zero; 3],
            instants: [zero; 3],
            covariance: [[zero; 3]; 3],
            shift: [zero; 3],
            ratios: [zero; 3],
            weight: zero,
            ratio_weights: [zero; 3],
            pointer: Weighted::new(),
        }
    }

    pub fn add(&mut self, said: &Said<T>) {
        let least = T::of(LEAST_DEVIATION * LEAST_DEVIATION);
        let its = said.variance.max(least).recip();
        let before = self.weight;
        let share = its / (before + its);
        let rest = T::one() - share;
        for k in 0..3 {
            let mut weight = before;
            approach(&mut self.lines[k], &mut weight, said.lines[k], its);
            self.instants[k] = self.instants[k] * rest + said.instants[k] * share;
            // Of independent means the variances add up with the squares of the weights, of what is common the deviations.
            self.shift[k] = self.shift[k] * rest + said.shift[k] * share;
            for l in 0..3 {
                self.covariance[k][l] =
                    self.covariance[k][l] * (rest * rest) + said.covariance[k][l] * (share * share);
            }
            let noise = said.ratio_noise[k].max(least).recip();
            // Sensors that showed nothing have no weight.
            if noise > T::zero() {
                approach(&mut self.ratios[k], &mut self.ratio_weights[k], said.ratios[k], noise);
            }
        }
        self.weight = before + its;
        self.pointer.add(said.direction, said.noise, said.floor);
        self.trains = self.trains.saturating_add(1);
    }

    /// Returns the covariance of the lines in H²: noise, which averages out, plus the specimen's lag, which does not.
    pub fn covariance(&self) -> [[T; 3]; 3] {
        let mut all = self.covariance;
        for (k, shift) in self.shift.into_iter().enumerate() {
            all[k][k] = all[k][k] + shift * shift;
        }
        all
    }

    /// Returns r of each line and its variance, if the gains themselves are known with this standard deviation. This
    /// prior knowledge counts once, not once per train.
    pub fn ratios(&self, tolerance: T) -> ([T; 3], [T; 3]) {
        GainComparison::known(self.ratios, self.ratio_weights.map(T::recip), tolerance)
    }

    /// Returns D over all trains.
    pub fn pointer(&self) -> Pointer<T> {
        self.pointer.pointer()
    }

    /// Checks that a train sees the same axis as the trains before it; `variance`: variance of its axis in rad².
    pub fn check_movement(
        &self,
        margin: &mut Margin<T>,
        axis: Angle<T>,
        variance: T,
        sign: SaliencySign,
    ) -> Result<(), Fault<T>> {
        if self.trains == 0 {
            return Ok(());
        }
        let before = Saliency::from_lines(Abc(self.lines), sign);
        let two = T::of(2.0);
        let twice = |angle: Angle<T>| Angle::from_radians(two * angle.radians());
        let angle = (twice(axis).difference(twice(before.axis)) / two).abs();
        let allowed = T::of(MOST_MOVEMENT)
            + T::of(4.0) * (variance + before.axis_variance(&self.covariance(), sign)).sqrt();
        margin.at_most(angle, allowed);
        if angle <= allowed { Ok(()) } else { Err(Fault::RotorMoves { angle, allowed }) }
    }
}

/// D in H/A of several trains, each weighted by the inverse of its variance. Noise averages out over the trains; the
/// errors that the floor stands for do not.
#[derive(Clone, Copy, Debug)]
struct Weighted<T> {
    mean: AlphaBeta<T>,
    weight: T,
    /// Sum of weight times squared deviation of a train from the mean.
    chi_square: T,
    trains: T,
    /// Sum of weight² times the variance by noise.
    noise: T,
    /// Sum of weight times the floor.
    floor: T,
}

impl<T: Real> Weighted<T> {
    fn new() -> Self {
        let zero = T::zero();
        Self {
            mean: AlphaBeta::new(zero, zero),
            weight: zero,
            chi_square: zero,
            trains: zero,
            noise: zero,
            floor: zero,
        }
    }

    fn add(&mut self, direction: AlphaBeta<T>, noise: T, floor: T) {
        let weight = (noise + floor * floor).recip();
        let before = self.weight;
        self.weight = before + weight;
        let share = weight / self.weight;
        let apart = direction - self.mean;
        self.mean = self.mean + apart * share;
        // A difference of sums of squares would be lost in single precision where the pole is certain.
        self.chi_square = self.chi_square + apart.dot(apart) * (share * before);
        self.trains = self.trains + T::one();
        // In this order: weight² leaves the range of single precision where inductances are small and currents large.
        self.noise = self.noise + weight * (weight * noise);
        self.floor = self.floor + weight * floor;
    }

    fn pointer(&self) -> Pointer<T> {
        let one = T::one();
        // Trains that contradict each other are all less certain than they say (Birge's ratio).
        let scale = (self.chi_square / (T::of(2.0) * (self.trains - one)).max(one)).max(one);
        let deviation = self.noise.sqrt().hypot(self.floor) * scale.sqrt() / self.weight;
        Pointer { direction: self.mean, deviation }
    }
}
