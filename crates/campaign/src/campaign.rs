//! A number of trials of one scenario.

use std::sync::atomic::{AtomicBool, Ordering};

use standstill_detect::{LineInductanceSettings, Settings, SettingsError};

use crate::engine::{Engine, Trials};
use crate::statistics::{Statistics, Summary};
use standstill_scenario::{Record, Scenario, TrialError};
use thiserror::Error;

/// A number of trials of a scenario.
///
/// ```
/// use standstill_campaign::Campaign;
/// use standstill_detect::Decay;
/// use standstill_plant::built_in;
/// use standstill_scenario::{ErrorSet, Scenario};
/// use standstill_sim::RotorState;
///
/// let motor = built_in("paper-5k5").ok_or("not built in")?;
/// let scenario = Scenario::paper(motor, ErrorSet::Default, Decay::Fast, RotorState::Locked, 1);
/// let summary = Campaign { scenario: &scenario, trials: 100, threads: None }.summary()?;
/// assert_eq!((summary.trials, summary.wrong_poles), (100, 0));
/// assert!(summary.rms_deg.low < summary.rms_deg.value && summary.rms_deg.value < summary.rms_deg.high);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Campaign<'a, S = LineInductanceSettings<f64>> {
    /// The scenario of each trial.
    pub scenario: &'a Scenario<S>,
    /// Number of trials.
    pub trials: u64,
    /// Threads; none: as many as there are cores. The records do not depend on it.
    pub threads: Option<usize>,
}

/// A campaign that could not run.
#[derive(Debug, Error)]
pub enum CampaignError {
    /// The detector's settings cannot work.
    #[error(transparent)]
    Settings(SettingsError),
    /// The operating system gave no threads.
    #[error("no worker threads: {0}")]
    Threads(rayon::ThreadPoolBuildError),
}

impl<S: Settings<f64> + Sync> Trials for Scenario<S> {
    /// The scenario itself is its only one.
    type Point = ();
    type Error = SettingsError;

    fn point(&self, _: usize) -> Result<(), SettingsError> {
        Ok(())
    }

    fn run(
        &self,
        (): &(),
        _: usize,
        trials: &mut dyn Iterator<Item = u64>,
        done: &mut dyn FnMut(Record),
    ) -> Result<(), TrialError<SettingsError>> {
        self.trials(trials, done)
    }
}

impl<S: Settings<f64> + Sync> Campaign<'_, S> {
    /// Runs all trials and returns their summary.
    ///
    /// # Errors
    /// A trial cannot be run.
    pub fn summary(&self) -> Result<Summary, CampaignError> {
        let mut statistics = Statistics::default();
        self.run(&AtomicBool::new(false), |record| {
            statistics.add(record);
            Ok::<(), CampaignError>(())
        })?;
        Ok(statistics.summary())
    }

    /// Runs the trials and hands each record to `sink`, in the order of their numbers. Stops early
    /// once `stop` is set; returns the number of trials done.
    ///
    /// # Errors
    /// A trial that cannot be run, once the records before it are handed over; those of `sink`.
    pub fn run<E: From<CampaignError>>(
        &self,
        stop: &AtomicBool,
        mut sink: impl FnMut(&Record) -> Result<(), E>,
    ) -> Result<u64, E> {
        self.scenario.check().map_err(CampaignError::Settings)?;
        let mut engine = Engine::new(self.scenario, self.threads).map_err(CampaignError::Threads)?;
        let mut done = 0;
        while done < self.trials && !stop.load(Ordering::Relaxed) {
            let end = (done + engine.size()).min(self.trials);
            let block: Vec<(usize, u64)> = (done..end).map(|trial| (0, trial)).collect();
            let (records, outcome) = engine.block(&block, stop);
            for record in &records {
                sink(record)?;
                done += 1;
            }
            outcome.map_err(CampaignError::Settings)?;
        }
        Ok(done)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicU64;

    use standstill_detect::{Decay, LineInductance, Settings};
    use standstill_interface::Nanos;
    use standstill_plant::built_in;
    use standstill_sim::RotorState;

    use super::*;
    use standstill_scenario::ErrorSet;

    /// The paper's settings, of which a detector can be made any number of times but one.
    struct Once {
        settings: LineInductanceSettings<f64>,
        made: AtomicU64,
        fails: u64,
    }

    impl Settings<f64> for Once {
        type Detector = LineInductance<f64>;

        fn detector(&self) -> Result<Self::Detector, SettingsError> {
            if self.made.fetch_add(1, Ordering::Relaxed) == self.fails {
                return Err(SettingsError { setting: "once", needed: "made another time" });
            }
            self.settings.detector()
        }

        fn carrier_period(&self) -> Option<Nanos> {
            self.settings.carrier_period()
        }
    }

    #[test]
    fn regress_a_detector_that_cannot_be_made_in_the_middle_ends_the_run_with_its_error() {
        let motor = built_in("paper-5k5").expect("built in");
        let paper = Scenario::paper(motor.clone(), ErrorSet::Default, Decay::Fast, RotorState::Locked, 1);
        // One is made beforehand, to check the settings.
        for fails in [1, 2, 30] {
            let once = Once { settings: paper.detector, made: AtomicU64::new(0), fails };
            let scenario = Scenario::new(motor.clone(), ErrorSet::Default, RotorState::Locked, 1, |_| once);
            let mut records = Vec::new();
            let campaign = Campaign { scenario: &scenario, trials: 100, threads: Some(1) };
            let outcome = campaign.run(&AtomicBool::new(false), |record| {
                records.push(*record);
                Ok::<(), CampaignError>(())
            });
            let message = outcome.expect_err("it ends there").to_string();
            assert!(message.contains("`once`"), "{message}");
            // All trials before the failing one are there, and none after it.
            let expected: Vec<Record> =
                (0..fails - 1).map(|trial| paper.trial(trial).expect("settings")).collect();
            assert_eq!(records, expected);
        }
    }
}
