//! The content of `summary.json`.

use std::path::Path;

use indexmap::IndexMap;
use serde::{Deserialize, Serialize};
use standstill_campaign::store::Identity;
use standstill_campaign::{Estimate, Summary};
use standstill_files::read_text;
use standstill_quantity::{Quantity, count};
use standstill_scenario::StopTable;

use super::intact;
use super::names::SUMMARY;
use super::tables::Tables;
use crate::error::Error;

/// Content of `summary.json`.
#[derive(Debug, Serialize, Deserialize)]
pub struct SummaryFile {
    /// Identity of the run: everything on which the results depend.
    pub run: Identity,
    /// Summary of all trials. None for a sweep, because a mean over sweep points would depend on the choice of the points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub summary: Option<Summary>,
    /// The points of the sweep.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<PointSummary>,
    /// Digests of the tables in the summary's folder. None if an older version without digests wrote the summary.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tables: Option<Tables>,
    /// Digest of this file without white space and without this member, as [`intact`] describes. None if an older version without digests
    /// wrote the file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub digest: Option<String>,
}

/// One point of a sweep.
#[derive(Debug, Serialize, Deserialize)]
pub struct PointSummary {
    /// Values of the point, by the keys of the sweep axes; numbers in SI units, angles in degrees.
    pub values: IndexMap<String, serde_json::Value>,
    /// Summary of the point's trials.
    pub summary: Summary,
}

impl SummaryFile {
    /// Reads the summary in a folder of results.
    pub fn read(folder: &Path) -> Result<Self, Error> {
        let path = folder.join(SUMMARY);
        let text = read_text(&path).map_err(|error| Error::Read(path.clone(), error))?;
        let needed = "the summary of a run, as `standstill run` writes it";
        let error = |found: String| Error::results(&path, found, needed);
        if intact::is_changed(&text) {
            return Err(intact::changed(&path));
        }
        let file: Self = serde_json::from_str(&text).map_err(|e| error(e.to_string()))?;
        if file.points.is_empty() && file.summary.is_none() {
            return Err(error("neither a summary nor points".to_owned()));
        }
        Ok(file)
    }

    /// Computes the digest and returns the content of the file, including the digest, as JSON.
    ///
    /// # Errors
    /// JSON cannot represent a number.
    pub fn sealed(&mut self) -> serde_json::Result<String> {
        self.digest = None;
        self.digest = Some(intact::digest(&serde_json::to_string_pretty(self)?));
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }

    /// Refuses a table of this run that was changed after it was written.
    ///
    /// # Errors
    /// Errors of [`Tables::check`].
    pub fn check(&self, table: &Path) -> Result<(), Error> {
        Tables::check(self.tables.as_ref(), table)
    }

    /// Returns the summary of a run without axes.
    pub fn whole(&self) -> Option<&Summary> {
        self.summary.as_ref().filter(|_| self.points.is_empty())
    }

    /// Returns the summary of each point; for a run without axes, the summary of the run.
    pub fn each(&self) -> impl Iterator<Item = &Summary> {
        self.whole().into_iter().chain(self.points.iter().map(|point| &point.summary))
    }

    /// Returns the total number of trials.
    pub fn trials(&self) -> u64 {
        self.each().map(|s| s.trials).sum()
    }

    /// Returns the number of trials that could not be simulated.
    pub fn errors(&self) -> u64 {
        self.each().map(|s| s.errors).sum()
    }
}

/// Root mean square in degrees of the axis errors of random answers, which are uniform within ± 90°: 180°/√12.
const RANDOM_AXIS: f64 = 51.961_524;

/// Least number of answers for a judgement: the interval of the share of wrong poles among fewer answers is wider than ± 22 %.
const ENOUGH: u64 = 20;

/// Returns a sentence if the axes or the poles of these trials are no better than random ones: the interval of the axis errors' root mean
/// square reaches that of random axes, or the share of wrong poles is within 1.96 standard deviations of one half.
fn guess(s: &Summary) -> Option<&'static str> {
    if s.sectors.is_none() && s.axes >= ENOUGH && s.rms_deg.high >= RANDOM_AXIS {
        return Some("Random axes have 52° rms and half of the poles wrong: the detector sees no axis.");
    }
    let (found, wrong) = (s.found as f64, s.wrong_poles as f64);
    let excess = 2.0 * wrong - found;
    let is_half = excess * excess <= 1.96 * 1.96 * found;
    (s.found >= ENOUGH && is_half)
        .then_some("Of random poles half are wrong, too: what the detector measures does not tell the pole.")
}

impl SummaryFile {
    /// Returns in words the number of starts with the wrong pole. Returns none if there are no such starts or if poles are not judged.
    pub fn wrong_poles(&self) -> Option<String> {
        let wrong: u64 = self.each().map(|s| s.wrong_poles).sum();
        let is_judged = wrong > 0 && !self.run.pole_is_open;
        is_judged.then(|| {
            let starts = if wrong == 1 { "start names" } else { "starts name" };
            let said = format!("{} of {} {starts} the wrong pole.", count(wrong), count(self.trials()));
            match self.whole().and_then(guess) {
                Some(guess) => format!("{said} {guess}"),
                None => said,
            }
        })
    }

    /// Returns a sentence if the run ended after its last trial without reaching the stop condition. Returns none otherwise.
    pub fn unreached(&self) -> Option<String> {
        let StopTable { rms, wrong_poles } = self.run.stop_at;
        let half = |e: &Estimate| (e.high - e.low) / 2.0;
        // An interval that is not a number does not count as narrow.
        let narrow = |half: f64, most: Option<f64>| most.is_none_or(|most| half <= most);
        let met = |s: &Summary| {
            narrow(half(&s.rms_deg) / s.rms_deg.value, rms.map(Quantity::value))
                && narrow(half(&s.wrong_pole_probability), wrong_poles.map(Quantity::value))
        };
        let (all, missed) = (self.each().count(), self.each().filter(|s| !met(s)).count());
        let of = if all == 1 { String::new() } else { format!(" at {missed} of {all} points") };
        (missed > 0).then(|| {
            format!(
                "stop_at was not reached{of} in {} trials: the intervals are wider than was asked for",
                self.run.trials
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use standstill_campaign::Statistics;

    use super::*;

    #[test]
    fn law_answers_that_are_no_better_than_random_ones_are_said_to_be() {
        let none = Statistics::default().summary();
        let of = |rms: f64, wrong: u64| {
            let rms_deg = Estimate { value: rms, low: 0.95 * rms, high: 1.05 * rms };
            Summary { trials: 800, found: 800, axes: 800, wrong_poles: wrong, rms_deg, ..none.clone() }
        };
        // 800 coins: 400 ± 28 by 1.96 standard deviations of 14.1.
        for (wrong, is_guess) in
            [(400, true), (427, true), (373, true), (429, false), (371, false), (1, false)]
        {
            assert_eq!(guess(&of(1.0, wrong)).is_some(), is_guess, "{wrong}");
        }
        assert!(guess(&of(57.0, 560)).is_some_and(|said| said.contains("no axis")));
        assert!(guess(&of(49.0, 560)).is_none());
        // Three starts are no evidence.
        assert!(guess(&Summary { found: 3, axes: 3, wrong_poles: 1, ..of(1.0, 1) }).is_none());
    }
}
