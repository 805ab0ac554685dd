//! Importance sampling after the last level: when it is taken in place of the levels.

use standstill_campaign::{Estimate, student};
use standstill_numeric::{exp, hypot, ln, whole};

use super::{Counting, ESTIMATOR, Estimator, Odds};
use crate::alarm::Alarm;
use crate::mixture::{Sampled, sample};
use crate::subset::{End, Run, Settings};
use crate::{Halt, System};

/// Least number of effective draws of importance sampling: fewer may have missed the largest weights.
const EFFECTIVE: f64 = 200.0;

impl Odds {
    /// Samples the event by importance after the last level, unless it is not rare, and takes that answer where it is the
    /// better one. `numbers`: the runs of the states in the event.
    pub(super) fn sampled<S: System>(
        self,
        counting: &mut Counting<'_, S>,
        name: &str,
        settings: &Settings,
        numbers: &[usize],
    ) -> Result<Self, Halt<S::Error>> {
        if self.levels <= 1 {
            return Ok(self);
        }
        let (system, watch) = (counting.system, counting.watch);
        let key = format!("{name}: mixture of estimator {ESTIMATOR} with tapes of {settings:?}");
        // The mean of n independent draws has a variance of 1/n.
        let reached = self.runs.iter().filter(|run| run.end == End::Reached);
        let squares: Vec<f64> = reached.flat_map(|run| run.unread).map(|mean| mean * mean).collect();
        let each =
            self.failures.len() as f64 * self.runs[0].unread.len() as f64 / squares.len().max(1) as f64;
        let alike = (each * squares.iter().sum::<f64>() / squares.len().max(1) as f64).max(1.0);
        let states =
            || numbers.iter().zip(&self.failures).map(|(run, (_, tape))| (*run, tape.clone())).collect();
        let compute = || sample(system, settings, states(), alike, EFFECTIVE, watch);
        let sampled = counting.kept(&key, |sampled: &Sampled| sampled.trials, compute)?;
        Ok(self.with(sampled))
    }

    /// Takes the answer of importance sampling if its effective number of draws is large enough, and if either its error
    /// is smaller than that of the runs, or it found more than they did. If it found less, beyond chance, one of both
    /// is wrong.
    pub(super) fn with(mut self, sampled: Sampled) -> Self {
        /// Bound of chance in standard deviations, of which that of the runs has seven degrees of freedom: 4 is exceeded to
        /// one side in 3 of 1,000 cases.
        const CHANCE: f64 = 4.0;
        /// Largest share in parts of one run alone where alarms become remarks.
        const LONE: f64 = 0.1;
        self.trials += sampled.trials;
        let (effective, value) = (sampled.effective(), sampled.probability());
        if effective < EFFECTIVE {
            return self;
        }
        let error = sampled.variation();
        if self.runs.iter().any(|run| run.end == End::Reached) {
            let levels = self.probability;
            let own = ln(levels.value / levels.low) / student(self.runs.len() as f64 - 1.0);
            let apart = ln(value / levels.value) / hypot(own, error);
            if apart < -CHANCE {
                self.alarms.push(Alarm::Apart { levels: levels.value, mixture: value });
                return self;
            }
            if apart < CHANCE && own < error {
                return self;
            }
        }
        let factor = exp(student(effective - 1.0) * error);
        self.probability = Estimate { value, low: value / factor, high: (value * factor).min(1.0) };
        self.estimator = Estimator::Mixture {
            parts: sampled.parts,
            effective: whole(effective),
            searched: sampled.searched,
        };
        // They say that runs miss parts or have few states in them: the mixture has the parts of all runs, and weights that
        // do not depend on how many states each has.
        if sampled.lone() <= LONE {
            // Without a search, only runs can have found a part that some of them miss.
            let stays = |alarm: &Alarm| {
                !sampled.searched && matches!(alarm, Alarm::Missed { .. } | Alarm::TooRare { .. })
            };
            let (alarms, mut remarks) = std::mem::take(&mut self.alarms).into_iter().partition(stays);
            self.alarms = alarms;
            self.remarks.append(&mut remarks);
        }
        self.failures = sampled.failures;
        self
    }
}

/// Returns the number of the run of each state in the event, of the states of all runs in their order.
pub(super) fn numbers_of(runs: &[Run]) -> Vec<usize> {
    runs.iter().enumerate().flat_map(|(number, run)| vec![number; run.failures.len()]).collect()
}
