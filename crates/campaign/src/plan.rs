//! The trials of a plan, at each point of its axes.

use standstill_detect::Method;
use standstill_scenario::{FileError, Plan, Record, Scenario, TrialError};

use crate::engine::Trials;

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
