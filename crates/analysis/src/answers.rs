//! Counts the starts of a scenario with and without an answer, and the reasons of those without.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use standstill_odds::kept;
use standstill_scenario::{FileError, Plan, Record, Verdict};

use crate::faults::in_blocks;
use crate::{Halt, Watch};

/// Number of simulated motor starts that a thread runs at a time.
const AT_ONCE: u64 = 64;

/// Numbers of simulated motor starts with and without an answer. The trials are those that `standstill run` runs with the scenario's seed.
/// A probability, an error or a requirement is reported with these numbers, because a method that never names a pole never names a wrong
/// one either.
/// ```
/// use std::path::Path;
/// use std::sync::atomic::AtomicBool;
/// use standstill_analysis::Answers;
/// use standstill_scenario::{Document, Plan};
///
/// let text = "motor = \"paper-5k5\"\nerrors = \"default\"\ndetector.method = \"bipolar\"\n";
/// let plan = Plan::new(Document::parse(Path::new("scenario"), text)?)?;
/// let answers = Answers::of(&plan, 40, &AtomicBool::new(false)).expect("nothing stops it");
/// assert_eq!((answers.starts, answers.with_axis(), answers.with_angle()), (40, 40, 40));
/// # Ok::<(), standstill_scenario::FileError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Answers {
    /// Number of starts.
    pub starts: u64,
    /// Number of starts without an axis, for each reason.
    pub without_axis: BTreeMap<String, u64>,
    /// Number of starts with an axis but no pole, for each reason.
    pub without_pole: BTreeMap<String, u64>,
}

impl Answers {
    /// Runs trials 0 to `starts` − 1 at the first point of a plan, and counts the starts with and without an answer.
    ///
    /// # Errors
    /// A trial cannot be run, or the computation was interrupted.
    pub fn of(plan: &Plan, starts: u64, watch: &dyn Watch) -> Result<Self, Halt<FileError>> {
        let run = || {
            let parts = in_blocks((plan, None), 0..starts, AT_ONCE, watch, |records, _| records)?;
            let mut all = Self::default();
            parts.iter().flatten().for_each(|record| all.add(record));
            Ok(all)
        };
        kept(watch, &format!("answers of {starts} plain starts"), |_| starts, run)
    }

    fn add(&mut self, record: &Record) {
        self.starts += 1;
        let reasons = match record.verdict() {
            Verdict::Found => return,
            Verdict::Undetermined => &mut self.without_pole,
            Verdict::Failed | Verdict::Error => &mut self.without_axis,
        };
        *reasons.entry(record.reason_name().unwrap_or_default()).or_default() += 1;
    }

    /// Returns the number of starts with an axis, with or without a pole.
    pub fn with_axis(&self) -> u64 {
        self.starts - self.without_axis.values().sum::<u64>()
    }

    /// Returns the number of starts with a rotor angle. For a motor with a magnet this is an axis with a pole, for a motor without a magnet
    /// the axis alone.
    pub fn with_angle(&self) -> u64 {
        self.with_axis() - self.without_pole.values().sum::<u64>()
    }
}
