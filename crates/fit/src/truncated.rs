//! Multivariate normal distribution within bounds: weighted draws, and the probability of the bounds.
//!
//! The numbers are drawn one after the other, each given those before and within its bounds; the probability of those bounds is
//! the draw's weight (Geweke, Hajivassiliou and Keane). If the weights diverge, the draws are resampled and moved by Gibbs
//! sampling, so that many numbers do not leave all weight to a few draws (Ridgway, *Computation of Gaussian orthant probabilities
//! in high dimension*, 2016).

use std::f64::consts::TAU;

use nalgebra::{Cholesky, DMatrix, DVector};
use standstill_numeric::{exp, ln};
use standstill_sim::{Draws, Purpose, Streams};

use super::reading::between;

/// Number of draws.
const DRAWS: usize = 4000;

/// Number of rounds of Gibbs sampling after resampling.
const ROUNDS: usize = 3;

/// Weighted draws, and the probability of the bounds.
pub struct Drawn {
    /// Logarithm of the probability that all numbers are within their bounds.
    pub ln_probability: f64,
    /// Draws with their weights, which sum to 1.
    pub draws: Vec<(f64, DVector<f64>)>,
}

/// A draw whose numbers are not complete yet.
#[derive(Clone)]
struct Particle {
    weight: f64,
    /// Numbers drawn so far less their means, in the order of drawing.
    off: Vec<f64>,
    /// Numbers drawn so far, standardised by L⁻¹.
    standard: Vec<f64>,
}

/// Draws normal numbers with this mean and covariance, each within its bounds; none if the covariance is singular.
pub fn draw(mean: &DVector<f64>, covariance: &DMatrix<f64>, bounds: &[[f64; 2]]) -> Option<Drawn> {
    let n = mean.len();
    // Those that have the most to fear from their bounds first.
    let fear = |k: usize| {
        let [low, high] = bounds[k].map(|bound| (bound - mean[k]) / covariance[(k, k)].sqrt());
        low.max(-high)
    };
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|a, b| fear(*b).total_cmp(&fear(*a)).then(a.cmp(b)));
    let covariance = DMatrix::from_fn(n, n, |x, y| covariance[(order[x], order[y])]);
    let bounds: Vec<[f64; 2]> = order.iter().map(|k| bounds[*k].map(|bound| bound - mean[*k])).collect();
    let root = Cholesky::new(covariance.clone())?.l();
    let mut draws = Streams::new(0, 0).open(Purpose::Tolerance);
    let begin = Particle { weight: 1.0, off: Vec::with_capacity(n), standard: Vec::with_capacity(n) };
    let mut particles = vec![begin; DRAWS];
    let mut ln_probability = 0.0;
    for k in 0..n {
        for particle in &mut particles {
            let before: f64 = (0..k).map(|j| root[(k, j)] * particle.standard[j]).sum();
            let [low, high] = bounds[k].map(|bound| (bound - before) / root[(k, k)]);
            particle.weight *= between(low, high);
            let standard = within(&mut draws, low, high);
            particle.off.push((before + root[(k, k)] * standard).clamp(bounds[k][0], bounds[k][1]));
            particle.standard.push(standard);
        }
        let sum: f64 = particles.iter().map(|particle| particle.weight).sum();
        if sum.is_nan() || sum <= 0.0 {
            return Some(Drawn { ln_probability: f64::NEG_INFINITY, draws: Vec::new() });
        }
        ln_probability += ln(sum / DRAWS as f64);
        for particle in &mut particles {
            particle.weight *= DRAWS as f64 / sum;
        }
        let squares: f64 = particles.iter().map(|particle| particle.weight * particle.weight).sum();
        if squares > 2.0 * DRAWS as f64 {
            particles = anew(&particles, draws.uniform());
            stir(&mut particles, &mut draws, &covariance, &root, &bounds)?;
        }
    }
    let mut places = vec![0; n];
    for (place, k) in order.iter().enumerate() {
        places[*k] = place;
    }
    let draws = particles
        .iter()
        .map(|one| (one.weight / DRAWS as f64, DVector::from_fn(n, |k, _| mean[k] + one.off[places[k]])))
        .collect();
    Some(Drawn { ln_probability, draws })
}

/// Resamples the draws in proportion to their weights (systematic resampling).
fn anew(particles: &[Particle], start: f64) -> Vec<Particle> {
    let (mut sum, mut next) = (0.0, start);
    let mut all = Vec::with_capacity(particles.len());
    for particle in particles {
        sum += particle.weight;
        while next < sum && all.len() < particles.len() {
            all.push(Particle { weight: 1.0, ..particle.clone() });
            next += 1.0;
        }
    }
    // What rounding left out.
    while all.len() < particles.len() {
        all.push(Particle { weight: 1.0, ..particles[particles.len() - 1].clone() });
    }
    all
}

/// Moves the numbers drawn so far by Gibbs sampling.
fn stir(
    particles: &mut [Particle],
    draws: &mut Draws,
    covariance: &DMatrix<f64>,
    root: &DMatrix<f64>,
    bounds: &[[f64; 2]],
) -> Option<()> {
    let so_far = particles[0].off.len();
    let inverse = Cholesky::new(covariance.view((0, 0), (so_far, so_far)).into_owned())?.inverse();
    for particle in particles {
        let off = &mut particle.off;
        for k in (0..ROUNDS).flat_map(|_| 0..so_far) {
            let own = inverse[(k, k)];
            let others: f64 = (0..so_far).map(|j| inverse[(k, j)] * off[j]).sum::<f64>() - own * off[k];
            let (mean, deviation) = (-others / own, 1.0 / own.sqrt());
            let [low, high] = bounds[k];
            let standard = within(draws, (low - mean) / deviation, (high - mean) / deviation);
            off[k] = (mean + deviation * standard).clamp(low, high);
        }
        for k in 0..so_far {
            let before: f64 = (0..k).map(|j| root[(k, j)] * particle.standard[j]).sum();
            particle.standard[k] = (particle.off[k] - before) / root[(k, k)];
        }
    }
    Some(())
}

/// Draws a standard normal number within bounds, by rejection (Robert, *Simulation of truncated normal variables*, 1995).
fn within(draws: &mut Draws, low: f64, high: f64) -> f64 {
    if high < -low {
        return -within(draws, -high, -low);
    }
    // The upper bound is the further one.
    if low <= 0.0 {
        if high - low < TAU.sqrt() {
            return flat(draws, low, high, 0.0);
        }
        loop {
            let x = draws.normal();
            if (low..=high).contains(&x) {
                return x;
            }
        }
    }
    let rate = 0.5 * (low + (low * low + 4.0).sqrt());
    if (high - low) * rate < 1.0 {
        return flat(draws, low, high, low);
    }
    loop {
        let x = low - ln(1.0 - draws.uniform()) / rate;
        if x <= high && draws.uniform() <= exp(-0.5 * (x - rate) * (x - rate)) {
            return x;
        }
    }
}

/// Draws by rejection from a uniform distribution within the bounds; `peak` is the position of the largest density.
fn flat(draws: &mut Draws, low: f64, high: f64, peak: f64) -> f64 {
    loop {
        let x = low + (high - low) * draws.uniform();
        if draws.uniform() <= exp(0.5 * (peak * peak - x * x)) {
            return x;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_equally_correlated_numbers_are_all_positive_as_often_as_is_known() {
        // With correlation ½ the probability is 1/(n + 1): each number is one of n + 1 independent ones less the last, and
        // the last is the least of them as often as any other.
        for n in [1_u32, 3, 12, 60] {
            let size = n as usize;
            let covariance = DMatrix::from_fn(size, size, |x, y| if x == y { 1.0 } else { 0.5 });
            let drawn = draw(&DVector::zeros(size), &covariance, &vec![[0.0, f64::INFINITY]; size]);
            let drawn = drawn.expect("not singular");
            let probability = exp(drawn.ln_probability) * f64::from(n + 1);
            assert!((probability - 1.0).abs() < 0.15, "{n}: {probability}");
            assert!(drawn.draws.iter().all(|(_, draw)| draw.min() >= 0.0));
            let sum: f64 = drawn.draws.iter().map(|(weight, _)| weight).sum();
            assert!((sum - 1.0).abs() < 1e-9, "{sum}");
        }
    }

    #[test]
    fn analytic_one_number_within_bounds_has_the_mean_of_its_truncated_normal() {
        for [low, high] in [[-1.0, 0.3], [0.5, 9.0], [4.0, 4.1], [-9.0, -5.0], [-0.1, 8.0], [6.0, 40.0]] {
            let covariance = DMatrix::from_element(1, 1, 4.0);
            let bounds = [[1.0 + 2.0 * low, 1.0 + 2.0 * high]];
            let drawn = draw(&DVector::from_element(1, 1.0), &covariance, &bounds).expect("not singular");
            let density = |z: f64| exp(-0.5 * z * z) / TAU.sqrt();
            let expected = 1.0 + 2.0 * (density(low) - density(high)) / between(low, high);
            let mean: f64 = drawn.draws.iter().map(|(weight, draw)| weight * draw[0]).sum();
            let (off, width) = (mean - expected, 2.0 * (high - low).min(1.0));
            assert!(off.abs() < 0.02 * width, "{low} {high}: {mean}, not {expected}");
            assert!((drawn.ln_probability - ln(between(low, high))).abs() < 1e-9);
        }
    }
}
