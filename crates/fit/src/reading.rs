//! Likelihood of a reading given the current of the plant: Gaussian noise, then quantization.
//!
//! A converter with steps of q shows only that the current with its noise was between r − q/2 and r + q/2:
//! ```text
//!   P(r) = Φ((r + q/2 − μ)/σ) − Φ((r − q/2 − μ)/σ)
//! ```
//! With noise below one step, least squares would be wrong: neighbouring errors are alike, and a current at rest, read as the
//! same code a thousand times, is still known only to within that code. The derivative of ln P is the score, its variance the
//! information of a reading (Kay, *Fundamentals of Statistical Signal Processing: Estimation Theory*, 1993, section 3.7; of
//! quantised readings, Wang, Yin, Zhang, Zhao, *System Identification with Quantized Observations*, 2010, chapter 3).

use std::f64::consts::{FRAC_1_SQRT_2, TAU};

use standstill_numeric::{erfc, exp, ln, whole};

/// Least noise that is assumed, as a share of the converter's step. With less, a reading at the edge between two codes would
/// weigh more than all others, and any error of the model is larger. For readings with less noise the intervals of gains are too
/// narrow: a current that stays within a code for many rows shows the wrong noise in each of them.
const LEAST_NOISE: f64 = 0.1;

/// Noise in steps that readings rarely have less of: noise is first searched for above this value.
const LITTLE_NOISE: f64 = 0.15;

/// Number of positions within a step at which the information is tabulated.
const PLACES: usize = 64;

/// Noise in steps above which quantization is treated as additional white noise of variance q²/12.
const MANY_STEPS: f64 = 2.0;

/// Noise and quantization of one channel.
#[derive(Clone, Debug)]
pub struct Scatter {
    /// Step q in A; none: the readings are as fine as their noise.
    pub step: Option<f64>,
    /// Standard deviation σ of the noise in A, before quantization.
    pub noise: f64,
    /// Ends of the channel's range in A, where readings were clipped; infinite if none were.
    pub clip: [f64; 2],
    /// Least noise in A that is assumed for readings without steps.
    pub least: f64,
    /// Information of a reading in 1/A², tabulated over the position of the current between two codes.
    information: Vec<f64>,
}

/// Range for channels without clipped readings.
pub const NO_CLIP: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// Terms of a reading's likelihood.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terms {
    /// Logarithm of the probability, ln P.
    pub likelihood: f64,
    /// Score ∂ln P/∂μ in 1/A.
    pub score: f64,
    /// Variance of the score in 1/A².
    pub information: f64,
}

fn density(z: f64) -> f64 {
    exp(-0.5 * z * z) / TAU.sqrt()
}

/// Computes Φ(b) − Φ(a), exact in the tails.
pub fn between(a: f64, b: f64) -> f64 {
    let tail = |z: f64| 0.5 * erfc(z * FRAC_1_SQRT_2);
    if a >= 0.0 {
        tail(a) - tail(b)
    } else if b <= 0.0 {
        tail(-b) - tail(-a)
    } else {
        1.0 - tail(-a) - tail(b)
    }
}

impl Scatter {
    /// Returns the rms in A of noise and quantization.
    pub fn rms(&self) -> f64 {
        (self.noise * self.noise + self.step.map_or(0.0, |q| q * q / 12.0)).sqrt()
    }

    /// Makes a channel with this step and noise, both in A.
    pub fn new(step: Option<f64>, noise: f64) -> Self {
        let mut scatter = Self { step, noise, clip: NO_CLIP, least: 1e-12, information: Vec::new() };
        let Some(q) = step.filter(|q| noise < MANY_STEPS * q) else { return scatter };
        // The codes about a current that noise can reach.
        let reach = (6.0 * noise / q).ceil() + 1.0;
        let table = (0..=PLACES).map(|place| {
            let at = place as f64 / PLACES as f64;
            let mut code = -reach;
            let mut sum = 0.0;
            while code <= reach {
                let [a, b] = [code - 0.5 - at, code + 0.5 - at].map(|edge| edge * q / noise);
                let p = between(a, b);
                if p > 1e-200 {
                    let slope = density(a) - density(b);
                    sum += slope * slope / p;
                }
                code += 1.0;
            }
            sum / (noise * noise)
        });
        scatter.information = table.collect();
        scatter
    }

    /// Returns this channel with readings clipped at the ends of this range in A.
    pub fn clipped(self, clip: [f64; 2]) -> Self {
        Self { clip, ..self }
    }

    /// Returns this channel with this least noise in A.
    pub fn at_least(self, least: f64) -> Self {
        Self { least, ..self }
    }

    /// Returns true if a reading was clipped.
    pub fn is_clipped(&self, reading: f64) -> bool {
        reading <= self.clip[0] || reading >= self.clip[1]
    }

    /// Returns the terms of a clipped reading: the current is at the end of the range or beyond, on the side of `sign`.
    fn beyond(&self, off: f64, sign: f64) -> Terms {
        // From the current to the edge of the last code, in deviations.
        let z = (sign * off - 0.5 * self.step.unwrap_or(0.0)) / self.noise;
        let p = 0.5 * erfc(z * FRAC_1_SQRT_2);
        // φ/P, in the tail by its asymptote.
        let hazard = if z < 30.0 { density(z) / p } else { z + 1.0 / z };
        let likelihood = if z < 30.0 { ln(p) } else { -0.5 * z * z - ln(z * TAU.sqrt()) };
        Terms {
            likelihood,
            score: sign * hazard / self.noise,
            information: (hazard * (hazard - z)).max(0.0) / (self.noise * self.noise),
        }
    }

    /// Returns the likelihood terms of a reading r for a current μ, both in A.
    pub fn terms(&self, reading: f64, current: f64) -> Terms {
        let off = reading - current;
        if self.is_clipped(reading) {
            return self.beyond(off, if reading >= self.clip[1] { 1.0 } else { -1.0 });
        }
        let white = |q: f64| {
            let variance = self.noise * self.noise + q * q / 12.0;
            Terms {
                likelihood: -0.5 * (off * off / variance + ln(TAU * variance))
                    + if q > 0.0 { ln(q) } else { 0.0 },
                score: off / variance,
                information: 1.0 / variance,
            }
        };
        let Some(q) = self.step else { return white(0.0) };
        if self.information.is_empty() {
            return white(q);
        }
        let [a, b] = [off - q / 2.0, off + q / 2.0].map(|edge| edge / self.noise);
        let p = between(a, b);
        let place = (-off / q - (-off / q).floor()) * PLACES as f64;
        let before = whole::<usize>(place).min(PLACES - 1);
        let share = place - before as f64;
        let information = self.information[before] * (1.0 - share) + self.information[before + 1] * share;
        if p < 1e-250 {
            // So far away that the probability is no number: as the tail goes on.
            let beyond = off.abs() - q / 2.0;
            let z = beyond / self.noise;
            let likelihood = -0.5 * z * z - ln(z.max(1.0) * TAU.sqrt());
            return Terms {
                likelihood,
                score: beyond.copysign(off) / (self.noise * self.noise),
                information,
            };
        }
        Terms { likelihood: ln(p), score: (density(a) - density(b)) / (self.noise * p), information }
    }

    /// Returns this channel with the noise that makes these residuals (reading less current, in A) the most likely.
    pub fn fitted(&self, residuals: &[f64]) -> Self {
        let n = residuals.len().max(1) as f64;
        let square = residuals.iter().map(|r| r * r).sum::<f64>() / n;
        let Some(q) = self.step else {
            return Self { noise: square.sqrt().max(self.least), ..self.clone() };
        };
        let white = (square - q * q / 12.0).max(0.0).sqrt();
        if white > MANY_STEPS * q {
            return Self::new(self.step, white).clipped(self.clip);
        }
        let bins = binned(residuals, q / PLACES as f64);
        let likelihood = |log: f64| {
            let noise = exp(log);
            let information = vec![0.0; PLACES + 1];
            let scatter = Self { step: Some(q), noise, clip: NO_CLIP, least: self.least, information };
            bins.iter().map(|[mean, count]| count * scatter.terms(*mean, 0.0).likelihood).sum::<f64>()
        };
        let [least, little, much] = [LEAST_NOISE, LITTLE_NOISE, 2.0 * MANY_STEPS].map(|share| ln(share * q));
        let mut best = most_likely(little, much, likelihood);
        if best < little + 0.02 {
            best = most_likely(least, little, likelihood);
        }
        Self::new(self.step, exp(best)).clipped(self.clip)
    }
}

/// Returns the mean and the number of the residuals in each bin of this width: thousands of residuals have a few hundred bins, and
/// within a bin that is narrow against the noise their likelihoods lie on a straight line.
fn binned(residuals: &[f64], width: f64) -> Vec<[f64; 2]> {
    let mut sorted = residuals.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let bins = sorted.chunk_by(|a, b| (a / width).floor() == (b / width).floor());
    bins.map(|bin| [bin.iter().sum::<f64>() / bin.len() as f64, bin.len() as f64]).collect()
}

/// Returns the position, to a hundredth, of the single maximum of a likelihood between two numbers, by golden-section search.
fn most_likely(mut low: f64, mut high: f64, likelihood: impl Fn(f64) -> f64) -> f64 {
    let golden = (5.0_f64.sqrt() - 1.0) / 2.0;
    let inner = |low: f64, high: f64| [high - golden * (high - low), low + golden * (high - low)];
    let [mut left, mut right] = inner(low, high);
    let (mut at_left, mut at_right) = (likelihood(left), likelihood(right));
    while high - low > 0.01 {
        if at_left > at_right {
            (high, right, at_right) = (right, left, at_left);
            left = inner(low, high)[0];
            at_left = likelihood(left);
        } else {
            (low, left, at_left) = (left, right, at_right);
            right = inner(low, high)[1];
            at_right = likelihood(right);
        }
    }
    (low + high) / 2.0
}

/// Returns the ends of a channel's range in A if readings were clipped there: far from rest, and read many times more often than
/// values just inside.
pub fn clip_of(readings: &[f64], step: Option<f64>, rest: f64) -> [f64; 2] {
    let low = readings.iter().copied().fold(f64::INFINITY, f64::min);
    let high = readings.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let reach = (high - rest).max(rest - low);
    let end = |end: f64| {
        let within = step.unwrap_or(1e-3 * reach);
        let there = readings.iter().filter(|r| (*r - end).abs() < 0.5 * within).count();
        let near = readings.iter().filter(|r| (*r - end).abs() < 4.5 * within).count() - there;
        (end - rest).abs() > 0.5 * reach && there >= 4 && there > near
    };
    [if end(low) { low } else { f64::NEG_INFINITY }, if end(high) { high } else { f64::INFINITY }]
}

/// Returns the steps of channels with these readings. A channel that reads only one or two codes gets the largest step of the
/// others, because it does not show its own.
pub fn steps_of<const N: usize>(readings: &[Vec<f64>; N]) -> [Option<f64>; N] {
    let own = readings.each_ref().map(|readings| step_of(readings));
    let largest = own.iter().flatten().copied().reduce(f64::max);
    std::array::from_fn(|k| {
        let first = readings[k].first();
        let second = readings[k].iter().find(|r| Some(*r) != first);
        let few = readings[k].iter().all(|r| Some(r) == first || Some(r) == second);
        if few { largest } else { own[k] }
    })
}

/// Returns the step of the converter with these readings: all readings differ by multiples of it, within the rounding of their
/// text. None if there are too many different readings for a converter.
pub fn step_of(readings: &[f64]) -> Option<f64> {
    const MOST_CODES: usize = 70_000;
    let mut codes: Vec<f64> = readings.to_vec();
    codes.sort_unstable_by(f64::total_cmp);
    let span = codes.last()? - codes.first()?;
    codes.dedup_by(|a, b| (*a - *b).abs() <= 1e-9 * span);
    // Values that hardly ever repeat are no codes.
    if codes.len() < 3 || codes.len() > MOST_CODES || codes.len() * 2 > readings.len() {
        return None;
    }
    let least = codes.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    // From one code to the next, the step ever more exact the further away it is.
    let (mut q, mut worst) = (least, 0.0_f64);
    for code in &codes[1..] {
        let way = code - codes[0];
        let count = (way / q).round().max(1.0);
        worst = worst.max((way / count - q).abs() * count / q);
        q = way / count;
    }
    (worst < 0.3).then_some(q)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_score_is_the_slope_and_information_its_variance() {
        for (q, noise) in [(0.1, 0.02), (0.1, 0.05), (0.1, 0.15), (0.1, 0.3)] {
            let scatter = Scatter::new(Some(q), noise);
            for current in [0.0, 0.013, 0.05, 0.081] {
                let h = 1e-6;
                let (mut total, mut mean, mut variance) = (0.0, 0.0, 0.0);
                for code in -40..=40 {
                    let reading = f64::from(code) * q;
                    let terms = scatter.terms(reading, current);
                    let p = exp(terms.likelihood);
                    if p < 1e-12 {
                        continue;
                    }
                    let slope = (scatter.terms(reading, current + h).likelihood
                        - scatter.terms(reading, current - h).likelihood)
                        / (2.0 * h);
                    assert!((slope - terms.score).abs() < 1e-5 * (1.0 + slope.abs()), "{slope} {terms:?}");
                    total += p;
                    mean += p * terms.score;
                    variance += p * terms.score * terms.score;
                }
                let terms = scatter.terms(0.0, current);
                let white = noise >= MANY_STEPS * q;
                assert!((total - 1.0).abs() < if white { 1e-2 } else { 1e-9 }, "{total}");
                assert!(mean.abs() < 1e-3 / noise, "{mean}");
                assert!((variance / terms.information - 1.0).abs() < 2e-2, "{variance} {terms:?}");
            }
        }
        // Far from any edge a code that does not change says nothing.
        let quiet = Scatter::new(Some(1.0), 0.05).terms(0.0, 0.0);
        assert!(quiet.information < 1e-15 && quiet.score == 0.0, "{quiet:?}");
    }

    #[test]
    fn analytic_a_reading_at_the_end_of_the_range_says_only_how_far_at_least() {
        let scatter = Scatter::new(Some(0.1), 0.05).clipped([-1.0, 2.0]);
        for (reading, current) in [(2.0, 1.9), (2.0, 2.05), (2.0, 3.0), (-1.0, -0.95), (2.0, 0.2)] {
            let at = |h: f64| scatter.terms(reading, current + h);
            let (terms, h) = (at(0.0), 1e-5);
            let slope = (at(h).likelihood - at(-h).likelihood) / (2.0 * h);
            let bend = (at(h).score - at(-h).score) / (2.0 * h);
            assert!((slope - terms.score).abs() < 1e-4 * slope.abs() + 1e-6, "{slope} {terms:?}");
            assert!((bend + terms.information).abs() < 5e-3 * bend.abs() + 1e-6, "{bend} {terms:?}");
        }
        assert!(scatter.terms(2.0, 5.0).score < 1e-9, "further beyond is as good");
        // A triangle, cut off at 0.8 or whole.
        let triangle = |cut: f64| -> Vec<f64> {
            (0..400)
                .map(|k| ((f64::from(k % 200) / 100.0 - 1.0).abs().min(cut) * 100.0).round() / 100.0)
                .collect()
        };
        assert_eq!(clip_of(&triangle(0.8), Some(0.01), 0.0), [f64::NEG_INFINITY, 0.8]);
        assert_eq!(clip_of(&triangle(2.0), Some(0.01), 0.0), NO_CLIP);
    }

    #[test]
    fn analytic_steps_are_found_through_rounded_texts() {
        let q = 0.015_625_3;
        let readings: Vec<f64> =
            (0..4000).map(|k| ((f64::from(k % 230) * q - 1.7) * 1000.0).round() / 1000.0).collect();
        let found = step_of(&readings).expect("codes");
        assert!((found / q - 1.0).abs() < 1e-3, "{found}");
        let fine: Vec<f64> = (0..4000).map(|k| (f64::from(k) * 0.37).sin()).collect();
        assert_eq!(step_of(&fine), None);
    }

    #[test]
    fn law_a_channel_that_reads_one_code_is_not_infinitely_exact() {
        let wave = |step: f64| -> Vec<f64> { (0..400).map(|k| f64::from(k % 40) * step).collect() };
        let still = vec![0.25; 400];
        assert_eq!(steps_of(&[wave(0.25), still.clone(), wave(0.5)])[1], Some(0.5));
        let smooth: Vec<f64> = (0..400).map(|k| (f64::from(k) * 0.37).sin()).collect();
        assert_eq!(steps_of(&[smooth.clone(), still, smooth])[1], None);
        assert!(Scatter::new(None, 1.0).at_least(1e-6).fitted(&[0.0; 50]).noise >= 1e-6);
    }

    #[test]
    fn analytic_noise_is_found_below_a_step() {
        for share in [0.12, 0.3, 0.6, 1.5] {
            // Currents at all places of a step, noise by quantiles: no draw.
            let (n, m) = (97, 101);
            let mut residuals = Vec::new();
            for k in 0..n {
                let current = f64::from(k) / f64::from(n);
                for j in 0..m {
                    let p = (f64::from(j) + 0.5) / f64::from(m);
                    let reading = (current + share * quantile(p)).round();
                    residuals.push(reading - current);
                }
            }
            let fitted = Scatter::new(Some(1.0), 1.0).fitted(&residuals);
            assert!((fitted.noise / share - 1.0).abs() < 0.03, "{share}: {}", fitted.noise);
        }
    }

    /// Returns Φ⁻¹(p) by bisection.
    fn quantile(p: f64) -> f64 {
        let (mut low, mut high) = (-8.0, 8.0);
        for _ in 0..60 {
            let middle: f64 = (low + high) / 2.0;
            if between(-40.0, middle) < p { low = middle } else { high = middle }
        }
        low
    }
}
