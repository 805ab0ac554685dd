//! The trials of a plan, at each point of its axes.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use standstill_detect::Method;
use standstill_scenario::{FileError, Plan, Record, Scenario, TrialError};

use crate::engine::{Engine, Trials};
use crate::store::SweepError;

impl Trials for Plan {
    type Point = Scenario<Method<f64>>;
    type Error = FileError;

    fn point(&self, number: usize) -> Result<Self::Point, FileError> {
        self.scenario(number)
    }

    fn run(
        &self,
        point: &Self::Point,
        number: usize,
        trials: &mut dyn Iterator<Item = u64>,
        done: &mut dyn FnMut(Record),
    ) -> Result<(), TrialError<FileError>> {
        self.trials(number, point, trials, done)
    }
}

/// Trials of a plan at one of its points, which are looked at and not stored.
#[derive(Clone, Debug)]
pub struct Glance<'a> {
    /// The scenario of each trial.
    pub plan: &'a Plan,
    /// The point.
    pub point: usize,
    /// Their numbers.
    pub trials: Range<u64>,
    /// Threads; none: as many as there are cores. The records do not depend on it.
    pub threads: Option<usize>,
}

impl Glance<'_> {
    /// Passes the records to `sink`, block by block in the order of their numbers, until all are done, `stop` is set,
    /// or `sink` returns false because no more records are wanted. Returns true if all are done.
    ///
    /// # Errors
    /// A trial cannot be run; the records before it have been passed on.
    ///
    /// ```
    /// use standstill_campaign::Glance;
    /// use standstill_scenario::{Document, Plan};
    ///
    /// let plan = Plan::new(Document::parse("s.toml".as_ref(), "")?)?;
    /// let mut worst = 0.0_f64;
    /// Glance { plan: &plan, point: 0, trials: 0..50, threads: None }.run(&false.into(), |records| {
    ///     for record in records {
    ///         worst = worst.max(record.axis_error_deg().unwrap_or(0.0).abs());
    ///     }
    ///     true
    /// })?;
    /// assert!(worst > 0.1 && worst < 10.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn run(
        &self,
        stop: &AtomicBool,
        mut sink: impl FnMut(&[Record]) -> bool,
    ) -> Result<bool, SweepError> {
        let mut engine = Engine::new(self.plan, self.threads).map_err(SweepError::Threads)?;
        let Range { start: mut next, end } = self.trials;
        while next < end && !stop.load(Ordering::Relaxed) {
            let block: Vec<(usize, u64)> =
                (next..end.min(next + engine.size())).map(|trial| (self.point, trial)).collect();
            let (records, outcome) = engine.block(&block, stop);
            next += records.len() as u64;
            if !sink(&records) {
                return Ok(false);
            }
            outcome?;
        }
        Ok(next >= end)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use standstill_scenario::Document;

    use super::*;
    use crate::store::Row;

    fn plan(text: &str) -> Plan {
        Plan::new(Document::parse(Path::new("s.toml"), text).expect("valid")).expect("valid")
    }

    #[test]
    fn law_a_glance_shows_the_campaigns_trials_in_order_and_stops_when_nobody_looks() {
        let plan = plan("[axes]\n\"sensors.noise\" = [\"1 mA\", \"40 mA\"]");
        let glance = |threads| {
            let mut seen = Vec::new();
            let glance = Glance { plan: &plan, point: 1, trials: 5..205, threads };
            assert!(
                glance
                    .run(&AtomicBool::new(false), |records| {
                        seen.extend_from_slice(records);
                        true
                    })
                    .expect("runs")
            );
            seen
        };
        let two = glance(Some(2));
        assert_eq!(two, glance(Some(1)));
        assert!(two.iter().zip(5..).all(|(record, trial)| record.trial == trial) && two.len() == 200);
        let scenario = plan.scenario(1).expect("valid");
        assert_eq!(Row::from(&two[100]), Row::from(&scenario.trial(105).expect("runs")));
        let glance = Glance { plan: &plan, point: 0, trials: 0..1_000_000, threads: Some(1) };
        let mut blocks = 0;
        assert!(
            !glance
                .run(&AtomicBool::new(false), |_| {
                    blocks += 1;
                    false
                })
                .expect("runs")
        );
        assert_eq!(blocks, 1);
    }

    /// promise: any-trial-again
    #[test]
    fn law_a_trial_alone_is_that_of_the_campaign() {
        let with = plan(
            r#"
            trials = 150
            [rotor]
            state = "free"
            [axes]
            "detector.method" = ["bipolar", "line-inductance-fast"]
            "sensors.noise" = ["1 mA", "40 mA"]
            [tolerances]
            "motor.winding.resistance" = { normal = "5 %" }
            "#,
        );
        let without = plan("rotor.state = \"free\"\ndetector.method = \"bipolar\"");
        for (plan, point) in [(&with, 0), (&with, 3), (&without, 0)] {
            let scenario = plan.scenario(point).expect("valid");
            let mut records = Vec::new();
            plan.run(&scenario, point, &mut (0..150), &mut |record| records.push(record)).expect("runs");
            assert_eq!(records.len(), 150);
            records.sort_unstable_by_key(|record| record.trial);
            for trial in [0, 7, 63, 64, 149] {
                let single = plan.single(point, trial).expect("valid");
                let record = single.scenario.trial(single.trial).expect("runs");
                let expected = records[usize::try_from(trial).expect("small")];
                assert_eq!(Row::from(&record), Row::from(&expected));
                assert_eq!(single.drawn.len(), usize::from(plan.has_tolerances()));
            }
        }
        let [a, b] = [3, 4].map(|trial| with.single(2, trial).expect("valid").drawn);
        assert_ne!(a, b);
    }
}
