//! Checks of random quantities: random numbers, the odds of an event with a known probability, and sequential tests.

use std::convert::Infallible;
use std::sync::atomic::AtomicBool;

use standstill_campaign::binomial_interval;
use standstill_numeric::{exp, ln, log10};
use standstill_sim::{Purpose, Streams, Tape};

use super::Witness;
use crate::qualify::sequential::Share;
use crate::subset::{Effort, Settings};
use crate::{Odds, System};

/// Event with a known probability. The mean of sixteen standard normal numbers, divided by its standard deviation of 1/4, exceeds this
/// bound.
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

/// Number of standard deviations that a normal number exceeds with a probability of one in a million.
const MILLIONTH: f64 = 4.753_424_308_822_9;

/// Allowed error of the computed probability, in decades. The 99.9 % interval of this probability is about ± 0.1 decades.
const DECADES: f64 = 0.15;

/// Checks subset simulation on an event with a probability of one in a million.
fn odds() -> Witness {
    let settings = Settings::of(Effort::Quick, 1);
    let found = Odds::of(&MeanBeyond(MILLIONTH), &settings, &AtomicBool::new(false), |_| {});
    let here = found.map_or(f64::NAN, |odds| log10(odds.probability.value));
    Witness::closed("logarithm of the odds of an event of one in a million", [-6.0, here], DECADES, "")
}

/// Checks that random draws are normally distributed. The share of draws beyond one standard deviation must be within four of its own
/// standard deviations of the known share.
fn normals() -> Witness {
    const COUNT: u32 = 100_000;
    let known = 0.317_310_507_863;
    let mut draws = Streams::new(11, 0).open(Purpose::CurrentNoise);
    let beyond = (0..COUNT).filter(|_| draws.normal().abs() > 1.0).count() as f64 / f64::from(COUNT);
    let deviation = (known * (1.0 - known) / f64::from(COUNT)).sqrt();
    Witness::closed(
        "share of drawn normals beyond one standard deviation",
        [known, beyond],
        4.0 * deviation,
        "",
    )
}

/// Checks the exact binomial interval for an event that did not happen in a thousand trials. The upper end is 1 − 0.025^(1/1000).
fn exact_interval() -> Witness {
    let known = 1.0 - exp(ln(0.025) / 1000.0);
    let here = binomial_interval(0, 1000).high;
    Witness::closed("upper end of the exact interval of none in 1,000", [known, here], 1e-12, "")
}

/// Checks the sequential interval of a share after one trial in which the event did not happen. The upper end is the q for which b/(a +
/// b)/(1 − q) = 1/α, with a = 1/2, b = 2 for a limit of 0.2, and α = 0.3.
fn sequential_interval() -> Witness {
    let known = 1.0 - 0.3 * 2.0 / 2.5;
    let here = Share { most: 0.2, alpha: 0.3 }.interval(0, 1)[1];
    let claim = "upper end of the interval that holds at all looks, of none of one start, at 70 %";
    Witness::closed(claim, [known, here], 1e-12, "")
}

pub(super) fn all() -> Vec<Witness> {
    vec![normals(), exact_interval(), odds(), sequential_interval()]
}
