//! A row of the answer of `faults`, and its values for files.

use standstill_analysis::faults::{Begins, Counts, Entry, reasons_that_name};
use standstill_campaign::Estimate;
use standstill_detect::MethodName;

use crate::answer::Record;
use crate::shell::command_line::{quoted, set_pair};

/// Effect of a fault that the starts do not show.
pub const LATENT: &str = "none (latent)";

/// Effect of a fault of a current sensor on a method without such a sensor.
const UNREAD: &str = "none: the method reads no current";

/// A row of the answer: one fault with one method.
pub struct Row {
    pub entry: Entry,
    pub method: String,
    /// The method if `--method` names it. None for the scenario's own method.
    pub by_name: Option<MethodName>,
    pub counts: Counts,
    /// True if the method has checks that can be switched off.
    pub has_checks: bool,
    /// True if the method reads a current. Faults of current sensors do not reach the others.
    pub reads_current: bool,
    /// True if the method answers with sectors. An error is then the angle between the rotor and the border of the sector, for a rotor
    /// outside the sector.
    pub in_sectors: bool,
}

impl Row {
    /// Returns the fault and its onset in words.
    pub fn fault(&self) -> String {
        let name = self.name();
        match self.entry.begins {
            Begins::Before => name,
            Begins::During => format!("{name}, during"),
            Begins::Briefly => format!("{name}, 50 µs"),
        }
    }

    fn name(&self) -> String {
        self.entry.name().unwrap_or_else(|| "as it is".to_owned())
    }

    /// Returns the most frequent reason why starts have no answer. None if all starts have an answer.
    pub fn reason(&self) -> Option<String> {
        let most = self.counts.unanswered.iter().max_by_key(|(_, count)| **count);
        most.map(|(reason, _)| reason.clone())
    }

    /// Returns true if the fault cannot reach the method: all its parts are current sensors, and the method reads no current.
    pub fn is_unread(&self) -> bool {
        let modes = &self.entry.modes;
        !self.reads_current && !modes.is_empty() && modes.iter().all(|mode| mode.is_of_current_sensor())
    }

    /// Returns the number of starts without an answer whose reason names the faulty part. None if there is no reason that names this part.
    pub fn rightly(&self) -> Option<u64> {
        let named: Vec<&str> =
            self.entry.modes.iter().flat_map(|mode| reasons_that_name(*mode)).copied().collect();
        (!named.is_empty()).then(|| self.counts.ended_by(&named))
    }

    /// Returns the command that shows the worst start. `asked` is the scenario with its keys. None if no answer is dangerous.
    pub fn worst_command(&self, asked: &str) -> Option<String> {
        let worst = self.counts.worst?;
        let keys: String = self.entry.arguments().iter().map(|pair| set_pair(pair)).collect();
        // The scenario may set fewer trials than were studied.
        let trials = set_pair(&format!("trials={}", self.counts.trials));
        let folder = quoted(&format!("trace-{}-{}", self.fault().replace(' ', "-"), worst.trial));
        let method = with(self.by_name);
        Some(format!("standstill trace {asked}{method}{keys}{trials} --trial {} --out {folder}", worst.trial))
    }

    pub fn record(&self, rate: Option<f64>, asked: &str) -> Record {
        let of = &self.counts;
        let coverage = of.coverage().unwrap_or(Estimate::UNKNOWN);
        Record::default()
            .with("method", &self.method)
            .with("failure_mode", self.name())
            .with("begins", self.entry.name().map(|_| self.entry.begins.name()))
            .with("settings", self.entry.arguments().join(" "))
            .with("effect", self.effect())
            .with("trials", of.trials)
            .with("right", of.right)
            .with("wrong_pole", of.wrong_pole)
            .with("wrong_pole_at_most", of.wrong_pole_bound())
            .with("right_pole_beyond_limit", of.beyond)
            .with("undetected_at_most", of.undetected_bound())
            .with("moved", of.moved)
            .with("overcurrent", of.overcurrent)
            .with("detected", of.detected())
            .with("undetermined", of.undetermined)
            .with("errors", of.errors)
            .with("detected_by", self.reason())
            .with("detected_rightly", self.rightly())
            .with("mean_reaction_s", of.reactions.mean())
            .with("longest_reaction_s", of.reactions.worst())
            .with("detected_without_checks", self.has_checks.then_some(of.refused_without))
            .with("refused_share", of.refused_share().map(|of| of.value))
            .with("refused_share_at_least", of.refused_share().map(|of| of.low))
            .with("dangerous_without_checks", self.has_checks.then_some(of.dangerous))
            .with("dangerous_and_detected", self.has_checks.then_some(of.caught))
            .with("coverage", coverage.value)
            .with("coverage_at_least", coverage.low)
            .with("worst_error_deg", of.worst.map(|worst| worst.error_deg))
            .with("worst_trial", of.worst.map(|worst| worst.trial))
            .with("worst_command", self.worst_command(asked))
            .with("reasons", &of.unanswered)
            .with("rate", rate)
            .with("wrong_pole_rate_at_most", rate.map(|rate| rate * of.wrong_pole_bound()))
    }

    /// Returns the effect of the fault in the sense of a failure-mode and effects analysis. None for the drive without a fault.
    pub fn effect(&self) -> Option<String> {
        self.entry.name()?;
        if self.is_unread() {
            return Some(UNREAD.to_owned());
        }
        let of = &self.counts;
        let answers = if of.wrong_pole > 0 {
            Some("wrong pole")
        } else if of.beyond > 0 {
            Some(if self.in_sectors {
                "angle beyond the limit and the sector"
            } else {
                "angle beyond the limit"
            })
        } else if of.detected() == of.trials {
            Some("no start")
        } else if of.detected() > 0 {
            Some("no start in some")
        } else {
            None
        };
        let moved = (of.moved > 0).then_some("movement beyond the limit");
        let current = (of.overcurrent > 0).then_some("current beyond the limit");
        let all: Vec<&str> = [answers, moved, current].into_iter().flatten().collect();
        Some(if all.is_empty() { LATENT.to_owned() } else { all.join("; ") })
    }
}

/// Formats `count` / `total` in per cent: two decimals below 10 %, one decimal from 10 % on.
pub fn percent(count: u64, total: u64) -> String {
    match (count, 100.0 * count as f64 / total.max(1) as f64) {
        (0, _) => "0".to_owned(),
        (_, share) if share < 10.0 => format!("{share:.2}"),
        (_, share) => format!("{share:.1}"),
    }
}

/// Returns the command-line option that sets the method of a row. Empty for the scenario's own method.
pub fn with(method: Option<MethodName>) -> String {
    method.map_or(String::new(), |method| format!(" -s detector.method={}", method.name()))
}
