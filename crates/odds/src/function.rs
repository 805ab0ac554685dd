//! Functions of a fixed number of standard normals.

use std::convert::Infallible;

use standstill_sim::{Purpose, Streams, Tape};

use crate::System;

/// A function of a fixed number of independent standard normal numbers; the event is that its value is above zero.
///
/// ```
/// use std::sync::atomic::AtomicBool;
/// use standstill_odds::{Function, Odds};
/// use standstill_odds::subset::{Effort, Settings};
///
/// // A load of 2 ± 1 exceeds a resistance of 7 ± 1: Q(5/√2) = 2.035e-4.
/// let fails = Function::new(2, |z| (2.0 + z[0]) - (7.0 + z[1]));
/// let odds = Odds::of(&fails, &Settings::of(Effort::Quick, 1), &AtomicBool::new(false), |_| {})?;
/// assert!(odds.probability.low < 2.035e-4 && 2.035e-4 < odds.probability.high);
/// assert!(odds.alarms.is_empty() && odds.trials < 100_000);
/// # Ok::<(), standstill_odds::Halt<std::convert::Infallible>>(())
/// ```
///
/// Numbers of other distributions are functions of normals z: Φ(z) is uniform in 0 to 1, −ln Φ(−z) exponential.
#[derive(Clone, Copy, Debug)]
pub struct Function<F> {
    draws: usize,
    purpose: Purpose,
    of: F,
}

impl<F: Fn(&[f64]) -> f64 + Sync> Function<F> {
    /// Makes a system of a function `of` and its number of draws. The draws are treated as those of a specimen (gains,
    /// offsets): the chains adapt the step length of each.
    pub const fn new(draws: usize, of: F) -> Self {
        Self { draws, purpose: Purpose::CurrentGain, of }
    }

    /// Treats the draws as those of samples (noise), which have one common step length: for hundreds of draws.
    #[must_use]
    pub fn of_samples(self) -> Self {
        Self { purpose: Purpose::CurrentNoise, ..self }
    }
}

impl<F: Fn(&[f64]) -> f64 + Sync> System for Function<F> {
    type Error = Infallible;

    fn values(&self, tapes: &[Tape]) -> Result<Vec<f64>, Infallible> {
        let mut z = vec![0.0; self.draws];
        let value = |tape| {
            let mut draws = Streams::taped(tape).open(self.purpose);
            for z in &mut z {
                *z = draws.normal();
            }
            (self.of)(&z)
        };
        Ok(tapes.iter().map(value).collect())
    }
}
