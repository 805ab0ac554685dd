//! Identity of runs and of their shards.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::ops::Range;

use serde::{Deserialize, Serialize};

use standstill_quantity::Quantity;
use standstill_scenario::StopTable;

/// A part of a run: of all rows, or, if points may end early, of all points, in equal parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// Index of the part, from 1.
    pub index: u64,
    /// Number of parts.
    pub count: u64,
}

impl Shard {
    /// All of it.
    pub const WHOLE: Self = Self { index: 1, count: 1 };

    /// Returns the shard's range of `all`.
    pub fn range(&self, all: u64) -> Range<u64> {
        // In 128 bits, because a product of two counts may not fit in 64.
        let end = |index: u64| {
            u64::try_from(u128::from(all) * u128::from(index) / u128::from(self.count)).unwrap_or(all)
        };
        end(self.index - 1)..end(self.index)
    }

    /// Returns the name of its journal.
    pub fn file_name(&self) -> String {
        if *self == Self::WHOLE {
            "run.journal".to_owned()
        } else {
            format!("shard-{}-of-{}.journal", self.index, self.count)
        }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

/// Identity of a run: two runs are the same if it is equal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identity {
    /// Version of the program.
    pub version: String,
    /// Version of its numerical results, see [`crate::NUMERICS`].
    #[serde(default)]
    pub numerics: u32,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Points of the axes.
    pub points: u64,
    /// Trials at each, or at most at each.
    pub trials: u64,
    /// When a point ends before.
    #[serde(skip_serializing_if = "StopTable::is_empty", default)]
    pub stop_at: StopTable,
    /// The part that this is.
    pub shard: Shard,
    /// The scenario with all overrides, as text of a file.
    pub scenario: String,
    /// Caveat for wrong poles, if the motor's data do not show which pole draws more current, or if no motor has poles.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub pole_note: Option<String>,
    /// Whether they are not judged for that.
    #[serde(skip_serializing_if = "std::ops::Not::not", default)]
    pub pole_is_open: bool,
    /// Caveat for all results: a motor's map is too coarse.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub map_note: Option<String>,
    /// Caveat for all results, if numbers of a motor are probably mistakes.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub motor_note: Option<String>,
    /// Caveat for a detector from a library that stores something outside its own memory.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub library_note: Option<String>,
    /// Digests of the files that it names, by their paths from its folder.
    #[serde(skip_serializing_if = "BTreeMap::is_empty", default)]
    pub files: BTreeMap<String, String>,
}

impl Identity {
    /// Returns the rows of all shards together, at most.
    pub fn rows(&self) -> u64 {
        self.points.saturating_mul(self.trials)
    }

    /// Returns the whole run of which it is a part.
    #[must_use]
    pub fn whole(&self) -> Self {
        Self { shard: Shard::WHOLE, ..self.clone() }
    }

    /// Returns the metadata of the file of trials, by name.
    pub fn metadata(&self) -> Vec<(String, String)> {
        let files: Vec<String> =
            self.files.iter().map(|(path, digest)| format!("{path}: {digest}")).collect();
        let files = (!files.is_empty()).then(|| ("files", files.join("\n")));
        let all = [
            ("version", self.version.clone()),
            ("numerics", self.numerics.to_string()),
            ("seed", self.seed.to_string()),
            ("scenario", self.scenario.clone()),
        ];
        all.into_iter().chain(files).map(|(key, value)| (key.to_owned(), value)).collect()
    }

    /// Returns whether its trials are the first ones of `longer`: the same run except for fewer trials, or for a rule
    /// that ends points earlier.
    pub fn begins(&self, longer: &Self) -> bool {
        let apart = |run: &Self| Self {
            trials: 0,
            stop_at: StopTable::default(),
            scenario: without_length(&run.scenario),
            ..run.clone()
        };
        let more = self.trials < longer.trials || self.stop_at != longer.stop_at;
        let later = ends_later(self.stop_at, longer.stop_at);
        more && later && self.trials <= longer.trials && apart(self) == apart(longer)
    }

    /// Returns all differences from another run, in words; none: they are the same.
    pub fn difference(&self, other: &Self) -> Option<String> {
        let mut all: Vec<String> = Vec::new();
        let mut differ = |what: &str, own: &dyn fmt::Display, other: &dyn fmt::Display| {
            let [own, other] = [own, other].map(ToString::to_string);
            if own != other {
                all.push(format!("{what} is {own} there and {other} here"));
            }
        };
        differ("the program's version", &self.version, &other.version);
        differ("the number of the program's numerics", &self.numerics, &other.numerics);
        differ("the seed", &self.seed, &other.seed);
        differ("the number of trials", &self.trials, &other.trials);
        differ("the shard", &self.shard, &other.shard);
        let [own, others] = [self, other].map(|run| values(&run.scenario));
        // What was named above is not named again.
        let named = |key: &String| match key.as_str() {
            "seed" => self.seed != other.seed,
            "trials" => self.trials != other.trials,
            _ => false,
        };
        let keys: BTreeSet<&String> = own.keys().chain(others.keys()).filter(|key| !named(key)).collect();
        let set = |values: &BTreeMap<String, toml::Value>, key: &String| {
            values.get(key).map_or_else(|| "not set".to_owned(), ToString::to_string)
        };
        for key in keys {
            differ(&format!("`{key}`"), &set(&own, key), &set(&others, key));
        }
        let read = |files: &BTreeMap<String, String>, path: &String| {
            files.get(path).map_or_else(|| "not read".to_owned(), |digest| format!("of {digest}"))
        };
        let paths: BTreeSet<&String> = self.files.keys().chain(other.files.keys()).collect();
        for path in paths {
            differ(&format!("the file {path}"), &read(&self.files, path), &read(&other.files, path));
        }
        let note = |note: &Option<String>| {
            note.as_ref().map_or_else(|| "absent".to_owned(), |note| format!("\"{note}\""))
        };
        differ("the note on poles", &note(&self.pole_note), &note(&other.pole_note));
        differ("the note on the map", &note(&self.map_note), &note(&other.map_note));
        differ("the note on the motor", &note(&self.motor_note), &note(&other.motor_note));
        differ("the note on the library", &note(&self.library_note), &note(&other.library_note));
        if all.is_empty() && self != other {
            let written = if self.scenario == other.scenario {
                "the points are others"
            } else {
                "the scenarios are written in another way"
            };
            all.push(written.to_owned());
        }
        (!all.is_empty()).then(|| all.join("; "))
    }
}

/// Returns whether a rule ends no point after `later` does: each of its limits is there too, and is as narrow at
/// least; or nothing ends a point early any more.
fn ends_later(rule: StopTable, later: StopTable) -> bool {
    let narrower = |before: Option<f64>, after: Option<f64>| match (before, after) {
        (Some(before), Some(after)) => after <= before,
        (before, _) => before.is_none(),
    };
    let value = |of: StopTable| [of.rms.map(Quantity::value), of.wrong_poles.map(Quantity::value)];
    let ([rms, poles], [rms_later, poles_later]) = (value(rule), value(later));
    rule == later
        || later.is_empty()
        || !rule.is_empty() && narrower(rms, rms_later) && narrower(poles, poles_later)
}

/// Returns the values that a scenario's text sets, by full key such as `detector.pulse`.
pub fn values(scenario: &str) -> BTreeMap<String, toml::Value> {
    fn flatten(before: &str, value: toml::Value, into: &mut BTreeMap<String, toml::Value>) {
        let toml::Value::Table(table) = value else {
            into.insert(before.to_owned(), value);
            return;
        };
        for (key, value) in table {
            let key = if before.is_empty() { key } else { format!("{before}.{key}") };
            flatten(&key, value, into);
        }
    }
    let mut all = BTreeMap::new();
    flatten("", toml::Value::Table(toml::from_str(scenario).unwrap_or_default()), &mut all);
    all
}

/// Returns a scenario's text without its number of trials, which stands before all tables, and the rule that ends
/// points early.
fn without_length(scenario: &str) -> String {
    let mut table = "";
    let mut kept = String::new();
    for line in scenario.lines() {
        if line.starts_with('[') {
            table = line;
        }
        let trials = table.is_empty() && line.starts_with("trials = ");
        if !trials && table != "[stop_at]" && !line.is_empty() {
            kept += line;
            kept.push('\n');
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::super::walk::tests::identity;
    use super::*;

    #[test]
    fn law_a_run_begins_another_if_only_the_number_of_trials_is_smaller() {
        let of = |trials: u64, seed: u64, more: &str| Identity {
            trials,
            seed,
            scenario: format!("motor = \"x\"\ntrials = {trials}\nseed = {seed}\n[rotor]\n{more}"),
            ..identity("{}", Shard::WHOLE)
        };
        let short = of(8000, 1, "");
        assert!(short.begins(&of(9000, 1, "")));
        for other in [of(8000, 1, ""), of(7000, 1, ""), of(9000, 2, ""), of(9000, 1, "trials = 3")] {
            assert!(!short.begins(&other), "{other:?}");
        }
        let shard = Shard { index: 1, count: 2 };
        assert!(!short.begins(&Identity { shard, ..of(9000, 1, "") }));
    }

    #[test]
    fn law_a_run_that_a_rule_ended_is_extended_by_a_narrower_one_or_none() {
        let of = |trials: u64, stop: &str| {
            let rule = if stop.is_empty() { String::new() } else { format!("\n[stop_at]\n{stop}\n") };
            Identity {
                stop_at: toml::from_str(stop).expect("a rule"),
                trials,
                scenario: format!("trials = {trials}\n{rule}\n[rotor]\nstate = \"free\"\n"),
                ..identity("{}", Shard::WHOLE)
            }
        };
        let short = of(8000, "rms = \"5 %\"");
        for longer in [of(8000, "rms = \"2 %\""), of(8000, ""), of(9000, "rms = \"5 %\""), of(9000, "")] {
            assert!(short.begins(&longer), "{longer:?}");
        }
        // A wider rule, another one, one where there was none, and fewer trials might end before the rows that are there.
        for other in [of(9000, "rms = \"6 %\""), of(9000, "wrong_poles = \"1 %\""), of(7000, "rms = \"2 %\"")]
        {
            assert!(!short.begins(&other), "{other:?}");
        }
        assert!(!of(8000, "").begins(&of(9000, "rms = \"5 %\"")));
        let both = of(8000, "rms = \"2 %\"\nwrong_poles = \"1 %\"");
        assert!(short.begins(&both) && !both.begins(&of(9000, "rms = \"1 %\"")));
    }

    /// promise: other-runs-refused
    #[test]
    fn regress_a_refusal_names_all_that_differs() {
        let of = |trials: u64, noise: &str, digest: &str| Identity {
            trials,
            scenario: format!("trials = {trials}\n[sensors]\nnoise = \"{noise}\"\n"),
            files: BTreeMap::from([("m.toml".to_owned(), digest.to_owned())]),
            ..identity("{}", Shard::WHOLE)
        };
        let run = of(8000, "5 mA", "1");
        assert_eq!(run.difference(&run), None);
        assert_eq!(
            run.difference(&of(9000, "8 mA", "2")).as_deref(),
            Some(
                "the number of trials is 8000 there and 9000 here; `sensors.noise` is \"5 mA\" there and \"8 mA\" here; the file m.toml is of 1 there and of 2 here"
            )
        );
        let noted = Identity { library_note: Some("it calls time".to_owned()), ..run.clone() };
        assert_eq!(
            noted.difference(&run).as_deref(),
            Some("the note on the library is \"it calls time\" there and absent here")
        );
    }

    #[test]
    fn law_shards_are_all_rows_once() {
        for all in [0, 1, 7, 1000, u64::MAX / 2] {
            for count in [1, 2, 3, 10] {
                let mut next = 0;
                for index in 1..=count {
                    let range = Shard { index, count }.range(all);
                    assert_eq!(range.start, next);
                    next = range.end;
                }
                assert_eq!(next, all);
            }
        }
    }
}
