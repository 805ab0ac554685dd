//! Moves of a state: preconditioned Crank–Nicolson steps, x' = √(1 − s²) x + s ξ.

use standstill_sim::{Draws, Purpose, Strip, Tape};

/// Draws that a move changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    All,
    /// Draws that a specimen of motor and drive keeps, and its angle.
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

/// Step length of each kind of move.
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
        /// Best acceptance rate for moves of one draw (Roberts and Rosenthal 2001); for moves of many draws the optimum is flat.
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

/// Spread of each draw of the specimen among seeds, strip by strip.
#[derive(Debug)]
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
        let deviation = |[count, sum, squares]: [f64; 3]| {
            // A few say nothing of a spread.
            if count < 10.0 {
                return 1.0;
            }
            let mean = sum / count;
            (squares / count - mean * mean).max(1e-6).sqrt()
        };
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

fn is_of(strip: &Strip, purpose: Purpose, name: &str) -> bool {
    strip.purpose == purpose && strip.name == name
}

/// Proposes a move by changing a tape; returns true if the tape had a draw to change.
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
