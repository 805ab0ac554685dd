//! The simulated setup in reports: motor, drive and sensors, with the values of the scenario.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use indexmap::IndexMap;
use standstill_quantity::{listed, number};
use standstill_report::page::{Block, Column, Section, Table};
use standstill_scenario::{Document, ErrorSet, FileError, Key, Plan, Point, ScenarioFile, Values, keys};

use crate::shell::values::each_once;

/// Returns one line with the motor, the method and the conditions of a scenario. Omits items that the scenario's sweep axes vary.
pub fn setting(file: &ScenarioFile) -> String {
    conditions(file, |key| file.axes.contains_key(key))
}

/// Returns one line with the motor, the method and the conditions of a scenario. Omits items whose keys are varied.
pub fn conditions(file: &ScenarioFile, is_varied: impl Fn(&str) -> bool) -> String {
    let fixed = |key: &str, text: String| (!is_varied(key)).then_some(text);
    let parts = [
        fixed("motor", file.motor.name()),
        fixed("detector.method", file.detector.name().to_owned()),
        fixed("errors", in_words(file.errors.0)),
        fixed("rotor.state", format!("rotor {}", file.rotor.state().name())),
        fixed("seed", format!("seed {}", file.seed)),
    ];
    parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
}

/// A scenario as it was stored with its results.
pub struct Setup<'a> {
    /// Path of the scenario. Files that the scenario names are searched in the same folder.
    pub place: &'a Path,
    pub text: &'a str,
    /// Files that the scenario read, with the digest of each, by path.
    pub files: &'a BTreeMap<String, String>,
    /// The only folder whose files the scenario may read; none: no restriction.
    pub fence: Option<&'a Path>,
    /// Keys that are varied. The page shows `varied` instead of their values.
    pub varied: Vec<String>,
    /// Texts of the scenario with other values of the varied keys. Used only if the varied keys are not the scenario's sweep axes.
    pub others: Vec<&'a str>,
}

/// Largest number of sweep points for which the facts of all points are compared. If a sweep has more points, only the first and the last
/// point of each value of each axis are compared, for at most this many values of an axis.
const COMPARED: usize = 256;

/// Largest number of different values of a fact that are listed.
const LISTED: usize = 6;

impl<'a> Setup<'a> {
    /// Makes the setup of one scenario, which may read files in any folder.
    pub fn of(
        place: &'a Path,
        text: &'a str,
        files: &'a BTreeMap<String, String>,
        varied: Vec<String>,
    ) -> Self {
        Self { place, text, files, fence: None, varied, others: Vec::new() }
    }

    fn document(&self, text: &str) -> Result<Document, FileError> {
        let mut document = Document::parse(self.place, text)?;
        if let Some(fence) = self.fence {
            document.fence(Some(fence))?;
        }
        Ok(document)
    }

    fn is_varied(&self, key: &str) -> bool {
        self.varied.iter().any(|varied| varied == key)
    }

    /// Returns motor, method, errors and rotor. Returns none if the scenario cannot be loaded.
    pub fn heading(&self) -> Option<Vec<(String, String)>> {
        let file = self.document(self.text).and_then(|document| document.load()).ok()?;
        let fact = |name: &str, key: &str, text: &str| {
            (name.to_owned(), if self.is_varied(key) { "varied" } else { text }.to_owned())
        };
        Some(vec![
            fact("Motor", "motor", &file.motor.name()),
            fact("Method", "detector.method", file.detector.name()),
            fact("Errors of drive and sensors", "errors", file.errors.0.name()),
            fact("Rotor", "rotor.state", file.rotor.state().name()),
        ])
    }

    /// Returns the section with the facts of drive and sensors. Each fact has its values at the compared points. If there is only one
    /// motor, the section also contains the motor's data sheet.
    pub fn section(&self) -> Section {
        Section::new("Motor, drive and sensors", self.blocks())
    }

    fn blocks(&self) -> Vec<Block> {
        let found = self.document(self.text).and_then(|document| {
            let sheet = document.data_sheet()?;
            let others = self.others.iter().map(|text| self.document(text).and_then(Plan::new));
            Ok((sheet, std::iter::once(Plan::new(document)).chain(others).collect::<Result<Vec<_>, _>>()?))
        });
        let (sheet, plans) = match found {
            Ok(found) => found,
            // A data sheet of the user's may be elsewhere, or changed by now.
            Err(error) => {
                return vec![Block::Text(format!(
                    "Not shown, because the scenario's files are not here: {error}"
                ))];
            }
        };
        if let Some(other) = plans.first().and_then(|plan| self.other_file(plan)) {
            return vec![Block::Text(format!("Not shown, because files have changed since: {other}"))];
        }
        let mut facts = together(
            plans.iter().flat_map(|plan| compared(plan.points()).into_iter().map(|point| facts(plan, point))),
        );
        for (key, value) in &mut facts {
            if self.is_varied(key) {
                "varied".clone_into(value);
            }
        }
        let mut blocks = vec![Block::Facts(facts)];
        if !self.is_varied("motor") {
            let rows = sheet.entries().into_iter();
            let caption = format!(
                "Data sheet {}: {}; rms values, where any, say so",
                sheet.name(),
                sheet.title().trim_end_matches('.')
            );
            let columns = ["key", "value", "source", "reason"].map(Column::word);
            let rows = rows.map(|entry| vec![entry.key, entry.value, entry.source.to_string(), entry.reason]);
            blocks.push(Block::Table(Table::new(columns).captioned(caption).rows(rows)));
        }
        blocks
    }

    /// Returns a message about a file that was changed after the results were made. Returns none if all files are unchanged.
    fn other_file(&self, plan: &Plan) -> Option<String> {
        let here = plan.files();
        self.files.iter().find_map(|(path, there)| {
            let here =
                here.get(path).map_or_else(|| "is not read".to_owned(), |digest| format!("is {digest}"));
            (here != format!("is {there}")).then(|| format!("{path} was {there}, and here it {here}"))
        })
    }

    /// Returns the section with the scenario and the commands that reproduce the results.
    pub fn reproduce(&self, commands: &str) -> Section {
        let files =
            if self.files.is_empty() { "" } else { ", with the motor's own files where it names them" };
        let said = format!(
            "The same program version writes the same bytes on any machine and any number of threads. Save the scenario as scenario.toml{files}."
        );
        let code =
            |caption: &str, text: &str| Block::Code { caption: caption.to_owned(), text: text.to_owned() };
        let blocks = [Block::Text(said), code("Commands", commands), code("scenario.toml", self.text)];
        Section::new("How to reproduce it", blocks)
    }
}

/// Returns the points whose facts are compared. For each value of an axis, these are the first and the last point with this value. At the
/// first point of a grid all other axes have their first value, and at the last point their last value, so a change caused by the axis is
/// visible at one of the two.
fn compared(points: &[Point]) -> BTreeSet<usize> {
    if points.len() <= COMPARED {
        return (0..points.len()).collect();
    }
    let mut axes: IndexMap<&str, IndexMap<String, [usize; 2]>> = IndexMap::new();
    for (number, point) in points.iter().enumerate() {
        for (key, value) in &point.values {
            let values = axes.entry(key).or_default();
            values.entry(value.to_string()).or_insert([number; 2])[1] = number;
        }
    }
    let some = axes.values().flat_map(|values| {
        let step = values.len().div_ceil(COMPARED).max(1);
        values.values().step_by(step).flatten()
    });
    some.copied().collect()
}

/// Merges the facts of several scenarios. A common value is listed once, and different values are listed in the order of the scenarios.
fn together(all: impl Iterator<Item = Vec<(String, String)>>) -> Vec<(String, String)> {
    let mut values: IndexMap<String, Vec<String>> = IndexMap::new();
    let mut scenarios = 0;
    for facts in all.filter(|facts| !facts.is_empty()) {
        scenarios += 1;
        for (key, value) in facts {
            values.entry(key).or_default().push(value);
        }
    }
    let one = |(key, mut values): (String, Vec<String>)| {
        // One scenario may lack a value that others have, such as the bits of a converter.
        if values.len() < scenarios {
            values.push("none".to_owned());
        }
        let seen = each_once(values);
        (key, if seen.len() > LISTED { "varied".to_owned() } else { seen.join(", ") })
    };
    values.into_iter().map(one).collect()
}

/// Returns the facts of drive and sensors at a point of a scenario: pairs of key and value as text.
fn facts(plan: &Plan, point: usize) -> Vec<(String, String)> {
    let Ok(scenario) = plan.scenario(point) else { return Vec::new() };
    let fact = |key: &Key| {
        let Values::Number { unit, share } = key.values() else { return None };
        let varied = plan.file().axes.contains_key(key.path);
        let value = scenario.value(key.path)?.as_float().filter(|value| varied || *value > 0.0)?;
        let text = if share {
            format!("{} %", number(3, 100.0 * value))
        } else {
            listed(&[value], unit).trim_end().to_owned()
        };
        Some((key.path.to_owned(), text))
    };
    let of_drive = |key: &&Key| ["inverter.", "sensors."].iter().any(|table| key.path.starts_with(table));
    keys().filter(of_drive).filter_map(fact).collect()
}

/// Returns an error set in words, such as "default errors".
pub fn in_words(set: ErrorSet) -> String {
    match set {
        ErrorSet::None => "no errors".to_owned(),
        ErrorSet::Noise => "noise alone".to_owned(),
        ErrorSet::Default | ErrorSet::Harsh | ErrorSet::Field => format!("{} errors", set.name()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_facts_of_several_scenarios_are_all_there_once() {
        let facts = |pairs: &[(&str, &str)]| {
            pairs.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect::<Vec<_>>()
        };
        let first = facts(&[("dc_link", "540 V"), ("ripple", "1 %"), ("bits", "12")]);
        let second = facts(&[("dc_link", "48 V"), ("ripple", "1 %")]);
        let expected = facts(&[("dc_link", "540 V, 48 V"), ("ripple", "1 %"), ("bits", "12, none")]);
        assert_eq!(together([first.clone(), second, first].into_iter()), expected);
        let many = (0..9).map(|k| facts(&[("noise", &format!("{k} mA"))]));
        assert_eq!(together(many), facts(&[("noise", "varied")]));
    }

    /// Regression: of 512 points only every second one was compared, and all of those had the first of two sets of
    /// errors.
    #[test]
    fn regress_what_the_fastest_axis_of_a_large_sweep_changes_shows() {
        let list =
            |step: f64| (1..=16).map(|k| (f64::from(k) * step).to_string()).collect::<Vec<_>>().join(", ");
        let text = format!(
            "[axes]\n\"inverter.dc_link\" = [{}]\n\"rotor.angle\" = [{}]\nerrors = [\"default\", \"harsh\"]",
            list(20.0),
            list(10.0)
        );
        let document = Document::parse(Path::new("s.toml"), &text).unwrap();
        let plan = Plan::new(document).unwrap();
        assert_eq!(plan.points().len(), 512);
        let looked_at = compared(plan.points());
        assert!(looked_at.len() <= 2 * (16 + 16 + 2), "{}", looked_at.len());
        let facts = together(looked_at.into_iter().map(|point| facts(&plan, point)));
        let of = |name: &str| facts.iter().find(|(key, _)| key == name).unwrap().1.clone();
        let of_all = together((0..512).map(|point| super::facts(&plan, point)));
        assert_eq!(facts, of_all);
        assert_eq!(of("inverter.ripple").split(", ").count(), 2, "{}", of("inverter.ripple"));
    }
}
