//! What rests on chance: drawn numbers, odds of an event whose probability is known, and the error of tests that stop early.

use std::convert::Infallible;
use std::sync::atomic::AtomicBool;

use standstill_campaign::binomial_interval;
use standstill_numeric::{exp, ln, log10};
use standstill_sim::{Purpose, Streams, Tape};

use super::Witness;
use crate::qualify::sequential::Share;
use crate::subset::{Effort, Settings};
use crate::{Odds, System};

/// The mean of sixteen normals beyond a bound: a normal of a sixteenth of the variance.
struct MeanBeyond(f64);

const DRAWS: usize = 16;

impl System for MeanBeyond {
    type Error = Infallible;

    fn values(&self, tapes: &[Tape]) -> Result<Vec<f64>, Infallible> {
        let value = |tape| {
            let mut draws = Streams::taped(tape).open(Purpose::CurrentNoise);
            (0..DRAWS).map(|_| draws.normal()).sum::<f64>() / (DRAWS as f64).sqrt() - self.0
        };
        Ok(tapes.iter().map(value).collect())
    }
}

/// Number of standard deviations beyond which a normal lies once in a million.
const MILLIONTH: f64 = 4.753_424_308_822_9;

/// Decades by which odds may be off: their interval at 99.9 % has some ± 0.1.
const DECADES: f64 = 0.15;

/// Subset simulation of an event of probability 1e-6.
fn odds() -> Witness {
    let settings = Settings { states: Effort::Quick.states(), ..Settings::default() };
    let found = Odds::of(&MeanBeyond(MILLIONTH), &settings, &AtomicBool::new(false), |_| {});
    let here = found.map_or(f64::NAN, |odds| log10(odds.probability.value));
    Witness::number(
        "logarithm of the odds of an event of one in a million",
        "closed form",
        [-6.0, here],
        DECADES,
        "",
    )
}

/// Draws that are normal: the share beyond one standard deviation, within four of its own.
fn normals() -> Witness {
    const COUNT: u32 = 100_000;
    let known = 0.317_310_507_863;
    let mut draws = Streams::new(11, 0).open(Purpose::CurrentNoise);
    let beyond = (0..COUNT).filter(|_| draws.normal().abs() > 1.0).count() as f64 / f64::from(COUNT);
    let deviation = (known * (1.0 - known) / f64::from(COUNT)).sqrt();
    Witness::number(
        "share of drawn normals beyond one standard deviation",
        "closed form",
        [known, beyond],
        4.0 * deviation,
        "",
    )
}

/// The exact interval of none in a thousand ends at 1 − 0.025^(1/1000).
fn exact_interval() -> Witness {
    let known = 1.0 - exp(ln(0.025) / 1000.0);
    let here = binomial_interval(0, 1000).high;
    Witness::number(
        "upper end of the exact interval of none in 1,000",
        "closed form",
        [known, here],
        1e-12,
        "",
    )
}

/// Tests that are looked at again and again, of a probability that is at its limit: at most one in ten may ever decide wrongly, and few
/// come near it in so many looks.
fn early_stops() -> Witness {
    const SEQUENCES: u64 = 400;
    const TRIALS: usize = 2000;
    let share = Share { most: 0.1, alpha: 0.1 };
    let wrong = (0..SEQUENCES).filter(|number| {
        let mut draws = Streams::new(12, *number).open(Purpose::CurrentNoise);
        let (mut cases, mut look, mut decided) = (0, 16, false);
        for trial in 1..=TRIALS {
            cases += u64::from(draws.uniform() < share.most);
            if trial == look {
                decided |= share.shown(cases, trial as u64).is_some();
                look += look / 4;
            }
        }
        decided
    });
    let here = wrong.count() as f64 / SEQUENCES as f64;
    let claim = "share of tests that stop early and decide wrongly, at their limit, where 10 % are allowed";
    Witness::number(claim, "Ville's inequality", [0.05, here], 0.05, "")
}

pub(super) fn all() -> Vec<Witness> {
    vec![normals(), exact_interval(), odds(), early_stops()]
}
