//! Counts of plain starts by whether they have an answer, and why the others have none.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use standstill_odds::kept;
use standstill_scenario::{FileError, Plan, Record, Verdict};

use crate::faults::in_blocks;
use crate::{Halt, Watch};

/// Number of starts that a thread runs at a time.
const AT_ONCE: u64 = 64;

/// How many of a scenario's plain starts have an answer. Beside a probability, an error or a requirement this says whether the starts
/// answer at all: a wrong pole is as rare as can be where no start names one.
///
/// The starts are those of `standstill run` with the scenario's seed.
///
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
    /// Reasons of the starts without an axis, each with the number of its starts.
    pub without_axis: BTreeMap<String, u64>,
    /// Reasons of the starts with an axis but no pole, each with the number of its starts.
    pub without_pole: BTreeMap<String, u64>,
}

impl Answers {
    /// Runs the first starts at the first point of a plan.
    ///
    /// # Errors
    /// A start cannot be made from its draws, or the computation was interrupted.
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

    /// Returns the number of starts with an angle: an axis with a pole, or an axis alone of a motor without a magnet.
    pub fn with_angle(&self) -> u64 {
        self.with_axis() - self.without_pole.values().sum::<u64>()
    }
}
