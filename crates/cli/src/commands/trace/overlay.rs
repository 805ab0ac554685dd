//! One trial with several settings, drawn in one figure.

use std::collections::BTreeMap;

use standstill_report::page::{Block, Column, Table, Tone};

use super::{plan, trial_of};
use crate::answer::{Answer, Made, verdict};
use crate::arguments::{Keys, Source, Trace as Options};
use crate::commands::question::Identity;
use crate::error::Error;
use crate::figures;
use crate::shell::Report;
use crate::shell::asked::NotedQuestion;
use crate::shell::command_line::typed_of;
use crate::shell::setup::{Setup, conditions};
use standstill_scenario::Verdict;
use standstill_table::Format;

/// Largest number of settings that a reader can distinguish in one picture.
const MOST: usize = 6;

/// A setting: a name that distinguishes it, such as `b = 2`, and all its keys with their values.
pub type Setting = (String, Vec<(String, String)>);

/// Returns all combinations of values of those keys that have a list. If no key has a list, returns a single setting without a name.
pub fn settings(keys: &Keys) -> Result<Vec<Setting>, Error> {
    let mut all: Vec<Setting> = vec![(String::new(), Vec::new())];
    for (key, value) in &keys.set {
        let list = if is_a_list(key) { None } else { list(value) };
        let several = list.is_some();
        let found = match list.as_deref() {
            Some([]) => Some("an empty list"),
            Some([_]) => Some("a list of one value"),
            _ => None,
        };
        if let Some(found) = found {
            return Err(Error::Arguments(format!(
                "-s {key}={value}: found {found}, needed a value, or a list of two or more, which are laid over one another"
            )));
        }
        let values = list.unwrap_or_else(|| vec![value.clone()]);
        let longer = |(name, set): &Setting, value: &String| {
            let gap = if name.is_empty() { "" } else { ", " };
            let name = if several { format!("{name}{gap}{key} = {value}") } else { name.clone() };
            (name, [&set[..], &[(key.clone(), value.clone())]].concat())
        };
        all = all
            .iter()
            .flat_map(|known| values.iter().map(|value| longer(known, value)).collect::<Vec<_>>())
            .collect();
    }
    Ok(all)
}

/// Returns true if the value of this key is itself a list: the values of a sweep axis, the range of a fault's parameter, or the names of
/// checks.
fn is_a_list(key: &str) -> bool {
    let ranges = ["magnitude", "resistance", "coupling", "command", "onset"];
    let of_fault =
        key.starts_with("faults.") && key.rsplit('.').next().is_some_and(|name| ranges.contains(&name));
    key.starts_with("axes.") || of_fault || key == "detector.checks"
}

/// Formats a value with its unit for tables and figures; the prefix `u` becomes µ.
fn shown(value: &str) -> String {
    let (digits, unit) = value
        .split_at(value.find(|c: char| !c.is_ascii_digit() && !".+-eE".contains(c)).unwrap_or(value.len()));
    match unit.trim_start().strip_prefix('u') {
        Some(unit) if digits.parse::<f64>().is_ok() && !unit.is_empty() => format!("{digits} µ{unit}"),
        _ => value.to_owned(),
    }
}

/// Formats a setting's name for tables and figures.
fn for_reading(name: &str) -> String {
    let part = |part: &str| match part.split_once(" = ") {
        Some((key, value)) => format!("{key} = {}", shown(value)),
        None => part.to_owned(),
    };
    name.split(", ").map(part).collect::<Vec<_>>().join(", ")
}

/// Parses the members of a list `[a, b]`, with or without quotes; none if the text is not a list.
fn list(text: &str) -> Option<Vec<String>> {
    let inside = text.trim().strip_prefix('[')?.strip_suffix(']')?;
    let members = inside.split(',').map(|member| member.trim().trim_matches('"').to_owned());
    Some(members.filter(|member| !member.is_empty()).collect())
}

/// Refuses settings that one figure cannot show: too many settings, equal settings, or several settings with an option that allows only
/// one.
fn check(options: &Options, settings: &[Setting]) -> Result<(), Error> {
    if settings.len() > MOST {
        return Err(Error::Arguments(format!(
            "-s with lists: {} settings, needed at most {MOST}, which one picture can tell apart",
            settings.len()
        )));
    }
    if let Some((twice, _)) = settings
        .iter()
        .enumerate()
        .find_map(|(k, one)| settings[..k].iter().any(|other| other.1 == one.1).then_some(one))
    {
        return Err(Error::Arguments(format!("-s with lists: {twice} is there twice")));
    }
    if options.format != Format::Csv {
        return Err(Error::Arguments(
            "--format: needed a single setting, not lists, which are laid over one another without tables"
                .to_owned(),
        ));
    }
    if options.verify {
        return Err(Error::Arguments("--verify: needed a single setting, not lists".to_owned()));
    }
    Ok(())
}

pub fn run(options: &Options, settings: &[Setting]) -> Result<Report, Error> {
    check(options, settings)?;
    let keys = varied(settings);
    // Conditions that all settings have in common, for figure and page.
    let (mut singles, mut spoken, mut identities) = (Vec::new(), None, Vec::new());
    // All settings are checked before the first one is simulated.
    for (name, set) in settings {
        let source = Source {
            scenario: options.source.scenario.clone(),
            keys: Keys { set: set.clone(), detector: options.source.keys.detector.clone() },
        };
        let plan = plan(options, &source)?;
        let single = plan.single(options.point, options.trial)?;
        let known = || conditions(plan.file(), |key| keys.iter().any(|varied| varied == key));
        spoken.get_or_insert_with(known);
        identities.push(Identity::new(&plan, [])?);
        singles.push((name, single, plan.file_at(options.point)?, plan.text()?));
    }
    let spoken = spoken.unwrap_or_default();
    let said = format!("{spoken}, {} with several values of {}", trial_of(options), keys.join(" and "));
    let asked =
        NotedQuestion::new("trace", said, &(identities, options.point, options.trial), options.force.force);
    let (mut traces, mut rows, mut results) = (Vec::new(), Vec::new(), Vec::new());
    let mut code = 0;
    for (name, single, file, text) in &singles {
        let (record, observed, trace) = single.scenario.traced(&single.case(), false, f64::INFINITY)?;
        code = code.max(u8::from(record.verdict() == Verdict::Error));
        rows.push(vec![
            for_reading(name),
            record.in_words(3),
            format!("{:.2}", record.run.duration.seconds() * 1e3),
            format!("{:.2}", record.run.peak_current),
            format!("{:.3}", record.rotor_moved_deg()),
        ]);
        let mut result = super::answer::result(file, &single.scenario, &record, &observed);
        result["setting"] = name.as_str().into();
        result["scenario"] = text.as_str().into();
        results.push(result);
        traces.push((for_reading(name), trace));
    }
    let title = format!("Trial {} with several values of {}", options.trial, keys.join(" and "));
    let figure = figures::overlaid(&traces, &title, &spoken);
    let columns = [
        Column::prose("setting"),
        Column::prose("it ended"),
        Column::number("time").unit("ms"),
        Column::number("peak").unit("A"),
        Column::number("moved").unit("°"),
    ];
    let table = Block::Table(Table::new(columns).rows(rows));
    let place = options.source.scenario.clone().unwrap_or_default().with_file_name("scenario");
    let others = singles[1..].iter().map(|(.., text)| text.as_str()).collect();
    // No digests to compare: the files have just been read.
    let files = BTreeMap::new();
    let setup = Setup { others, ..Setup::of(&place, &singles[0].3, &files, keys) };
    let command = typed_of(options.source.scenario.as_deref());
    let made = Made { setup: Some(setup), command, asked: Some(asked), ..Made::default() };
    let headline = format!("trial {}", options.trial);
    let verdict = verdict(Tone::Neutral, headline, Vec::new());
    let answer = Answer::new("overlay", title, String::new(), verdict, vec![table]).with(
        "overlay",
        figure,
        "Drag to zoom.",
    );
    let result = format!("{:#}\n", serde_json::Value::from(results)).into_bytes();
    let answer = Answer { files: vec![("result.json", result)], code, ..answer };
    answer.report(Some(options.out.clone()), false, &made)
}

/// Returns the keys whose values differ between settings.
fn varied(settings: &[Setting]) -> Vec<String> {
    let is_varied = |key: &&String| {
        let mut values = settings.iter().map(|(_, set)| set.iter().find(|(known, _)| known == *key));
        let first = values.next();
        values.any(|value| Some(value) != first)
    };
    settings[0].1.iter().map(|(key, _)| key).filter(is_varied).cloned().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_lists_make_all_combinations_in_order() {
        let set = |pairs: &[(&str, &str)]| {
            let pairs = pairs.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned()));
            settings(&Keys { set: pairs.collect(), detector: None }).unwrap()
        };
        let names = |all: Vec<Setting>| all.into_iter().map(|(name, _)| name).collect::<Vec<_>>();
        let all = set(&[("a", "[1, 2]"), ("b", "x"), ("c", "[\"20 us\",y]")]);
        assert_eq!(
            all[2].1,
            [("a", "2"), ("b", "x"), ("c", "20 us")].map(|(k, v)| (k.to_owned(), v.to_owned()))
        );
        assert_eq!(names(all), ["a = 1, c = 20 us", "a = 1, c = y", "a = 2, c = 20 us", "a = 2, c = y"]);
        assert_eq!(for_reading("a = 1, c = 20 us"), "a = 1, c = 20 µs");
        assert_eq!(for_reading("m = unit, c = 20us"), "m = unit, c = 20 µs");
        assert_eq!(names(set(&[("axes.\"x\"", "[1, 2]"), ("b", "x")])), [""]);
        assert_eq!(set(&[]).len(), 1);
        for (value, found) in [("[]", "an empty list"), ("[40 us]", "a list of one value")] {
            let set = vec![("detector.pulse".to_owned(), value.to_owned())];
            let error = settings(&Keys { set, detector: None }).unwrap_err().to_string();
            assert!(error.contains(&format!("-s detector.pulse={value}: found {found}, needed")), "{error}");
        }
    }
}
