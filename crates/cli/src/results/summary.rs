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

impl SummaryFile {
    /// Returns in words the number of starts with the wrong pole. Returns none if there are no such starts or if poles are not judged.
    pub fn wrong_poles(&self) -> Option<String> {
        let wrong: u64 = self.each().map(|s| s.wrong_poles).sum();
        let is_judged = wrong > 0 && !self.run.pole_is_open;
        is_judged.then(|| {
            let starts = if wrong == 1 { "start names" } else { "starts name" };
            format!("{} of {} {starts} the wrong pole.", count(wrong), count(self.trials()))
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
