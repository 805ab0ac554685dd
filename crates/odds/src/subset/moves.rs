//! Moves of a state: preconditioned Crank–Nicolson steps, x' = √(1 − s²) x + s ξ.

use standstill_sim::{Draws, Purpose, Strip, Tape};

/// Kind of a move: the draws that it changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    All,
    /// Draws of the specimen, which are constant during a start, and of the rotor's angle.
    Specimen,
    /// Draws of each sample.
    Samples,
}

impl Kind {
    /// Moves that make one state, in their order.
    pub const TURNS: [Self; 3] = [Self::All, Self::Specimen, Self::Samples];

    fn changes(self, purpose: Purpose) -> bool {
        match self {
            Self::All => true,
            Self::Specimen => !of_samples(purpose),
            Self::Samples => of_samples(purpose),
        }
    }
}

/// Purposes that are drawn for each sample or pulse, and not for the specimen.
pub const SAMPLED: [Purpose; 5] = [
    Purpose::CurrentNoise,
    Purpose::LinkNoise,
    Purpose::Jitter,
    Purpose::TerminalNoise,
    Purpose::ComparatorNoise,
];

/// Returns true if draws of this purpose are drawn for each sample, and not for the specimen.
pub fn of_samples(purpose: Purpose) -> bool {
    SAMPLED.contains(&purpose)
}

/// Numbers of moves of each kind that were tried and accepted in a level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Work {
    pub tried: [u64; 3],
    pub taken: [u64; 3],
}

/// Step length s of each kind of move, in the order of [`Kind`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Widths([f64; 3]);

impl Default for Widths {
    fn default() -> Self {
        Self([0.5, 0.5, 0.6])
    }
}

impl Widths {
    /// Adapts the step lengths after a level: longer if more than 44 % of the moves were accepted, shorter if fewer were.
    pub fn learn(&mut self, work: &Work) {
        /// Best acceptance rate for moves of one draw (Roberts and Rosenthal 2001); for moves of many draws the optimum
        /// is broad.
        const BEST: f64 = 0.44;
        /// Gain of the adaptation: an acceptance rate a tenth higher makes the steps a fifth longer.
        const PACE: f64 = 2.0;
        for (width, (taken, tried)) in self.0.iter_mut().zip(work.taken.iter().zip(work.tried)) {
            if tried > 0 {
                let share = *taken as f64 / tried as f64;
                *width = (*width * standstill_numeric::exp(PACE * (share - BEST))).clamp(0.003, 2.0);
            }
        }
    }
}

/// Standard deviation of each draw of the specimen among the seeds, by the draw's strip (purpose and name).
#[derive(Debug, PartialEq)]
pub(super) struct Spread(Vec<(Purpose, String, Vec<f64>)>);

impl Spread {
    pub fn of<'t>(tapes: impl Iterator<Item = &'t mut Tape>) -> Self {
        let mut sums: Vec<(Purpose, String, Vec<[f64; 3]>)> = Vec::new();
        for tape in tapes {
            for strip in tape.strips().iter().filter(|strip| !of_samples(strip.purpose)) {
                let found = sums.iter().position(|(purpose, name, _)| is_of(strip, *purpose, name));
                let place = found.unwrap_or_else(|| {
                    sums.push((strip.purpose, strip.name.clone(), Vec::new()));
                    sums.len() - 1
                });
                let sums = &mut sums[place].2;
                sums.resize(sums.len().max(strip.normals.len()), [0.0; 3]);
                for (sum, x) in sums.iter_mut().zip(&strip.normals) {
                    *sum = [sum[0] + 1.0, sum[1] + x, sum[2] + x * x];
                }
            }
        }
        let variance = |[count, sum, squares]: [f64; 3]| {
            let mean = sum / count;
            (squares / count - mean * mean).max(1e-6)
        };
        let known = |count: f64| count >= FEWEST;
        let shrinking = Shrinking::of(
            sums.iter()
                .flat_map(|(.., sums)| sums)
                .filter(|[count, ..]| known(*count))
                .map(|sum| (variance(*sum), sum[0])),
        );
        let deviation =
            |sum: [f64; 3]| if known(sum[0]) { shrinking.of_variance(variance(sum)).sqrt() } else { 1.0 };
        let deviations = |(purpose, name, sums): (_, _, Vec<_>)| {
            (purpose, name, sums.into_iter().map(deviation).collect())
        };
        Self(sums.into_iter().map(deviations).collect())
    }

    fn strip(&self, strip: &Strip) -> &[f64] {
        let found = self.0.iter().find(|(purpose, name, _)| is_of(strip, *purpose, name));
        found.map_or(&[], |(_, _, deviations)| deviations)
    }
}

/// Least number of seeds from which a draw's spread is estimated.
const FEWEST: f64 = 10.0;

/// Shrinks the logarithms of the draws' variances towards their mean, by the share of their differences that is chance.
///
/// Steps in proportion to the seeds' own spread favour seeds far from the mean: the bias is of the order of
/// draws/seeds, a tenth for 100 draws of equal spread with 100 seeds; with the spread of the other half of the seeds,
/// which has common ancestors with them, it is 3 %. After shrinking, draws whose spreads differ only by chance have one
/// common spread, which hardly depends on any single seed.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Shrinking {
    mean: f64,
    /// Share of the variances' differences that chance does not explain, and that is kept.
    kept: f64,
}

impl Shrinking {
    /// Makes the shrinking from pairs of a variance and its number of seeds.
    fn of(variances: impl Iterator<Item = (f64, f64)>) -> Self {
        /// Neighbours in a chain are correlated: each seed counts as half an independent one.
        const ALIKE: f64 = 2.0;
        let (mut count, mut sum, mut squares, mut chance) = (0.0, 0.0, 0.0, 0.0);
        for (variance, seeds) in variances {
            let log = standstill_numeric::ln(variance);
            count += 1.0;
            sum += log;
            squares += log * log;
            // 2 / (n − 1) is the variance of the logarithm of a normal sample's variance.
            chance += ALIKE * 2.0 / (seeds - 1.0);
        }
        let mean = if count > 0.0 { sum / count } else { 0.0 };
        let found = squares - count * mean * mean;
        let expected = chance * (1.0 - 1.0 / f64::max(count, 1.0));
        Self { mean, kept: if found > expected { 1.0 - expected / found } else { 0.0 } }
    }

    fn of_variance(self, variance: f64) -> f64 {
        standstill_numeric::exp(self.mean + self.kept * (standstill_numeric::ln(variance) - self.mean))
    }
}

fn is_of(strip: &Strip, purpose: Purpose, name: &str) -> bool {
    strip.purpose == purpose && strip.name == name
}

/// Proposes a move by changing the tape's draws of this kind. Returns true if the tape has such draws.
pub(super) fn propose(
    tape: &mut Tape,
    kind: Kind,
    widths: &Widths,
    spread: &Spread,
    draws: &mut Draws,
) -> bool {
    let width = widths.0[kind as usize];
    let mut any = false;
    for strip in tape.strips().iter_mut().filter(|strip| kind.changes(strip.purpose)) {
        any |= strip.step(width, spread.strip(strip), draws);
    }
    any
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_spreads_that_differ_by_chance_alone_become_one() {
        // Variances of 101 seeds, which count as 50: their logarithms have a variance of 0.04.
        let of = |logs: &[f64]| Shrinking::of(logs.iter().map(|log| (standstill_numeric::exp(*log), 101.0)));
        // Four logarithms at ±0.2: a sum of squares of 4 × 0.04 found, 3 × 0.04 expected by chance.
        assert!((of(&[-1.2, -0.8, -1.2, -0.8]).kept - 0.25).abs() < 1e-9);
        let alike = of(&[-1.1, -0.9, -1.1, -0.9]);
        assert!(alike.kept == 0.0 && (standstill_numeric::ln(alike.of_variance(0.5)) + 1.0).abs() < 1e-9);
        let apart = of(&[0.0, -4.0]);
        assert!((apart.kept - 0.995).abs() < 1e-9 && (apart.mean + 2.0).abs() < 1e-9, "{apart:?}");
        assert!((standstill_numeric::ln(apart.of_variance(1.0)) + 0.01).abs() < 1e-9);
        assert_eq!(of(&[-3.0]).of_variance(standstill_numeric::exp(-3.0)), standstill_numeric::exp(-3.0));
    }
}
