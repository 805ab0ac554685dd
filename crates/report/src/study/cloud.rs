//! Errors of single trials in bounded memory.

use standstill_numeric::{rank, whole};

/// Angle bins of 5°.
pub(super) const BINS: usize = 72;
/// Errors kept for the quantiles of one bin: the 5 % quantile of half as many is uncertain by 0.7 % of probability.
const PER_BIN: usize = 2048;
/// Smallest number of errors in a bin for 5 and 95 % quantiles: two errors lie beyond each.
const ENOUGH: u64 = 40;
/// Errors kept for the histogram.
const SIGNED: usize = 20_000;
/// Trials kept for the cloud of points.
const CLOUD: usize = 4000;
/// Wrong poles kept for their marks.
const WRONG: usize = 1000;

/// A sample of a stream: every 2^k-th value. When there are too many, half of them are dropped and k grows by one. The
/// choice depends only on the order of the values.
#[derive(Clone, Debug, PartialEq)]
pub struct Thinned<T> {
    kept: Vec<T>,
    most: usize,
    every: u64,
    seen: u64,
}

impl<T: Copy> Thinned<T> {
    /// Keeps up to `most` values, at least 2.
    pub fn new(most: usize) -> Self {
        Self { kept: Vec::new(), most: most.max(2), every: 1, seen: 0 }
    }

    /// Adds the next value of the stream.
    pub fn push(&mut self, value: T) {
        if self.seen.is_multiple_of(self.every) {
            if self.kept.len() == self.most {
                let mut index = 0;
                self.kept.retain(|_| {
                    index += 1;
                    index % 2 == 1
                });
                self.every *= 2;
            }
            if self.seen.is_multiple_of(self.every) {
                self.kept.push(value);
            }
        }
        self.seen += 1;
    }

    /// Returns the values kept, in the order of the stream.
    pub fn kept(&self) -> &[T] {
        &self.kept
    }

    /// Returns 2^k: one in so many values is kept.
    pub fn every(&self) -> u64 {
        self.every
    }

    /// Returns the number of values in the stream.
    pub fn seen(&self) -> u64 {
        self.seen
    }
}

/// Steps per factor of two of the magnitudes: 0.8 % and less.
const STEPS: usize = 128;
/// Number of octaves, from 2^-16 degrees to 2^8.
const OCTAVES: usize = 24;
/// Lowest edge in degrees, 2^-16.
const LEAST: f64 = 1.0 / 65_536.0;

/// Counts of magnitudes between fixed edges.
#[derive(Clone, Debug, PartialEq)]
struct Magnitudes {
    counts: Vec<u64>,
    largest: f64,
}

impl Magnitudes {
    fn push(&mut self, magnitude: f64) {
        let place = (magnitude / LEAST).log2() * STEPS as f64;
        let index: usize = whole((place.floor() + 1.0).clamp(0.0, (OCTAVES * STEPS) as f64));
        self.counts[index] += 1;
        self.largest = self.largest.max(magnitude);
    }

    /// Returns the upper edge of a cell; that of the last one filled is the largest magnitude.
    fn edge(&self, index: usize) -> f64 {
        (LEAST * (index as f64 / STEPS as f64).exp2()).min(self.largest)
    }

    /// Returns each magnitude with the number of larger values.
    fn larger(&self) -> impl Iterator<Item = (f64, u64)> {
        let mut left: u64 = self.counts.iter().sum();
        let filled = self.counts.iter().enumerate().filter(|(_, count)| **count > 0);
        filled.map(move |(index, count)| {
            left -= count;
            (self.edge(index), left)
        })
    }
}

/// The errors of any number of trials, in about 2 MB at most.
///
/// Sums and counts are of all trials. Quantiles over the angle and the histogram are of every 2^k-th trial once there are
/// too many to keep; exceedances are of all, to 0.8 % of the error, for errors above 0.000 02°.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorCloud {
    trials: u64,
    bins: Vec<Thinned<f64>>,
    signed: Thinned<f64>,
    magnitudes: Magnitudes,
    points: Thinned<(f64, f64)>,
    wrong: Thinned<f64>,
}

impl Default for ErrorCloud {
    /// Makes a cloud without trials.
    fn default() -> Self {
        Self {
            trials: 0,
            bins: vec![Thinned::new(PER_BIN); BINS],
            signed: Thinned::new(SIGNED),
            magnitudes: Magnitudes { counts: vec![0; OCTAVES * STEPS + 1], largest: 0.0 },
            points: Thinned::new(CLOUD),
            wrong: Thinned::new(WRONG),
        }
    }
}

impl ErrorCloud {
    /// Adds a trial: the rotor's angle, the error of the axis in (−90, 90]° if an axis was found, and the whole error
    /// in (−180, 180]° if a pole was found. A whole error beyond 90° is a wrong pole. Errors that are not finite count
    /// as not found.
    pub fn add(&mut self, true_angle_deg: f64, axis_error_deg: Option<f64>, error_deg: Option<f64>) {
        self.trials += 1;
        let angle = true_angle_deg.rem_euclid(360.0);
        if !angle.is_finite() {
            return;
        }
        if error_deg.is_some_and(|error| error.abs() > 90.0) {
            self.wrong.push(angle);
        }
        let Some(error) = axis_error_deg.filter(|error| error.is_finite()) else { return };
        let bin = whole::<usize>(angle / 360.0 * BINS as f64).min(BINS - 1);
        self.bins[bin].push(error);
        self.signed.push(error);
        self.magnitudes.push(error.abs());
        self.points.push((angle, error));
    }

    /// Trials in all.
    pub fn trials(&self) -> u64 {
        self.trials
    }

    /// Trials with an axis.
    pub fn axes(&self) -> u64 {
        self.signed.seen()
    }

    /// Trials that named the wrong pole.
    pub fn wrong_poles(&self) -> u64 {
        self.wrong.seen()
    }

    /// Returns the largest magnitude of an axis error in degrees; 0 without any.
    pub fn max_deg(&self) -> f64 {
        self.magnitudes.largest
    }

    /// Returns `(magnitude in degrees, share of the axis errors that exceed it)`, by increasing magnitude.
    pub fn exceedance(&self) -> Vec<(f64, f64)> {
        let n = self.axes() as f64;
        self.magnitudes.larger().map(|(edge, larger)| (edge, larger as f64 / n)).collect()
    }

    /// Returns `(middle of the bin in degrees, [quantile for each share])` of angle bins. The width is 5° or 10°, such
    /// that each bin has enough errors for its quantiles; the result is empty if bins of 10° have too few. Wider bins
    /// would blur errors with a period of 60°, such as those of methods with six steps: a mean over 10° keeps 95 % of
    /// their amplitude, a mean over 30° only 64 %.
    pub fn angle_quantiles<const N: usize>(&self, shares: [f64; N]) -> Vec<(f64, [f64; N])> {
        let enough = |count: usize| {
            self.bins.chunks(count).all(|bins| bins.iter().map(Thinned::seen).sum::<u64>() >= ENOUGH)
        };
        let Some(together) = [1, 2].into_iter().find(|count| enough(*count)) else {
            return Vec::new();
        };
        let width = 360.0 / BINS as f64 * together as f64;
        let bins = self.bins.chunks(together).enumerate();
        bins.map(|(index, bins)| {
            let mut errors: Vec<f64> = bins.iter().flat_map(|bin| bin.kept().iter().copied()).collect();
            ((index as f64 + 0.5) * width, shares.map(|p| quantile(&mut errors, p)))
        })
        .collect()
    }

    /// Returns the axis errors that are kept, in degrees.
    pub fn signed(&self) -> &Thinned<f64> {
        &self.signed
    }

    /// Returns `(true angle, axis error)` in degrees of the trials in the sample.
    pub fn points(&self) -> &Thinned<(f64, f64)> {
        &self.points
    }

    /// Returns the true angles of the wrong poles that are kept, in degrees.
    pub fn wrong(&self) -> &Thinned<f64> {
        &self.wrong
    }
}

/// Returns the least value that the share `p` does not exceed, from values in any order.
pub(super) fn quantile(values: &mut [f64], p: f64) -> f64 {
    let place = rank(p, values.len() as u64).and_then(|rank| usize::try_from(rank).ok());
    place.map_or(f64::NAN, |place| *values.select_nth_unstable_by(place, f64::total_cmp).1)
}
