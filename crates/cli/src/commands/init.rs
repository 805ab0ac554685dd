//! `standstill init` and `standstill schema`: templates and schema of scenario files and data sheets.

mod vesc;

use std::borrow::Cow;
use std::ffi::OsStr;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use standstill_plant::{Files, MapPoint, MapSamples};
use standstill_quantity::unit::Ampere;
use standstill_quantity::{Unit as _, significant};
use standstill_scenario as file;
use toml::Value;

use crate::arguments::Init;
use crate::error::Error;
use crate::shell::Report;
use crate::shell::output::create_new;

/// The first part of the example file, with the keys that belong to no table. The registry of keys supplies the keys of the tables.
const SCENARIO: &str = include_str!("init/scenario.toml");

/// Returns the example file with every key. For each key of a table it has an example value and the first sentence of the description.
pub fn scenario() -> String {
    let mut text = String::new();
    for line in SCENARIO.lines() {
        match line.strip_prefix("#keys ") {
            Some(table) => {
                let keys = file::keys().filter(|key| !key.example.is_empty());
                for key in keys {
                    if let Some(name) = key.path.strip_prefix(table).and_then(|path| path.strip_prefix('.')) {
                        let set = format!("# {name} = {}", key.example);
                        let _ = writeln!(text, "{set:<32}# {}", remark(key));
                    }
                }
            }
            None => {
                let _ = writeln!(text, "{line}");
            }
        }
    }
    text
}

/// Returns the first sentence of a key's description. If the key is a choice, the names of its values follow.
fn remark(key: &file::Key) -> String {
    let about = key.about.split_whitespace().collect::<Vec<_>>().join(" ");
    // The colon in `0: none` does not end the sentence.
    let ends = about.match_indices([':', '.']).map(|(at, _)| at);
    let mut ends = ends.filter(|at| about[at + 1..].starts_with(' ') && !about[..*at].ends_with('0'));
    let first = ends.next().map_or(about.trim_end_matches('.'), |end| &about[..end]);
    let names = match key.values() {
        file::Values::Choice(names) => names,
        _ => Vec::new(),
    };
    let names: Vec<String> = names.iter().map(|(name, _)| format!("\"{name}\"")).collect();
    if names.is_empty() { first.to_owned() } else { format!("{first}: {}", names.join(", ")) }
}

/// Template of a data sheet.
pub const MOTOR: &str = include_str!("init/motor.toml");

/// Template of a data sheet that names a flux map.
const MAPPED: &str = include_str!("init/mapped.toml");

/// Returns true if the file is an unchanged template of a data sheet.
pub fn is_template(path: &str) -> bool {
    // `init` itself fills in name, map and current of the template for a flux map, so these lines are not compared.
    let but_the_map = |text: &str| -> Vec<String> {
        let is_name = |line: &&str| ["file", "name", "current"].iter().any(|key| line.starts_with(key));
        text.lines().filter(|line| !is_name(line)).map(str::to_owned).collect()
    };
    let text = Files::default().text(Path::new(path));
    text.is_ok_and(|text| *text == *MOTOR || but_the_map(&text) == but_the_map(MAPPED))
}

/// Returns a data sheet that names a flux map. A sheet names its map relative to its own folder.
fn mapped(sheet: &Path, map: &Path) -> Result<String, Error> {
    let samples = MapSamples::read(map, &Files::default()).map_err(Error::Map)?;
    // Rated current of the template: what the map allows, in two digits.
    let most = |of: fn(&MapPoint) -> f64| samples.points.iter().map(of).fold(0.0, f64::max);
    let reach = most(|at| at.i_d).min(most(|at| -at.i_d)).min(most(|at| at.i_q.abs()));
    let current = significant(reach / 1.1, 2);
    let current = if current > 0.0 { Ampere::DIMENSION.text(current) } else { "30 A".to_owned() };
    let beside = sheet.parent() == map.parent();
    let file = match map.file_name() {
        Some(name) if beside => PathBuf::from(name),
        _ => std::path::absolute(map).map_err(|error| Error::Read(map.to_owned(), error))?,
    };
    let quoted = |text: &OsStr| Value::String(text.to_string_lossy().into_owned()).to_string();
    let name = quoted(sheet.file_stem().unwrap_or_default());
    let sheet = MAPPED.replace("\"30 A\"", &format!("\"{current}\"")).replace("\"NAME\"", &name);
    Ok(sheet.replace("\"MAP\"", &quoted(file.as_os_str())))
}

pub fn run(options: &Init) -> Result<Report, Error> {
    let mut said = String::new();
    let (path, text) = match &options.motor {
        Some(path) if path.extension().is_none_or(|extension| extension != "toml") => {
            return Err(Error::InTheWay {
                path: path.clone(),
                is: "no data sheet's name",
                needed: "a file's that ends in .toml",
            });
        }
        Some(path) => (
            path,
            match (&options.vesc, &options.map) {
                (Some(xml), _) => {
                    let (text, more) = vesc::sheet(xml)?;
                    said = more;
                    Cow::Owned(text)
                }
                (None, Some(map)) => mapped(path, map)?.into(),
                (None, None) => MOTOR.into(),
            },
        ),
        None => (&options.file, scenario().into()),
    };
    create_new(path, text.as_bytes())?;
    let path = path.display();
    let text = if options.vesc.is_some() {
        format!(
            "{path} is written.\n{said}See all of it, and judge the motor, with\n  standstill motors {path}\n  standstill check {path}\n"
        )
    } else if options.motor.is_some() {
        format!(
            "{path} is written. Fill in your motor's numbers, then\n  standstill motors {path}\n  standstill check {path}\n"
        )
    } else {
        format!("{path} is written. Run it with\n  standstill run {path}\n")
    };
    Ok(Report { text, code: 0 })
}

pub fn schema() -> Report {
    Report { text: format!("{:#}\n", file::schema()), code: 0 }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::path::Path;

    use standstill_scenario::{Document, Plan};
    use toml::Table;

    use super::*;

    #[test]
    fn law_a_template_that_nobody_filled_in_is_known() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("mine.toml");
        let is_known = |text: &str| {
            std::fs::write(&path, text).expect("written");
            is_template(path.to_str().expect("UTF-8"))
        };
        let named = MAPPED.replace("MAP", "my.csv");
        assert!(is_known(MOTOR) && is_known(&named));
        for text in [MOTOR, &named] {
            assert!(!is_known(&text.replacen("pole_pairs = 4", "pole_pairs = 5", 1)));
        }
        // A nameplate has no saturation: an example value would stay in the user's sheet and change the verdict.
        assert!(!MOTOR.lines().any(|line| line.starts_with("saturation")));
    }

    /// Uncomments the lines that contain a key or a table. Comments in prose stay.
    fn with_comments(text: &str) -> String {
        let is_key = |word: &str| word.chars().all(|c| c.is_ascii_alphanumeric() || "_.\"-".contains(c));
        let given = |line: &str| {
            line.split_once(" = ").is_some_and(|(word, _)| is_key(word))
                || (line.starts_with('[') && line.ends_with(']'))
        };
        let lines =
            text.lines().map(|line| line.strip_prefix("# ").filter(|rest| given(rest)).unwrap_or(line));
        lines.collect::<Vec<_>>().join("\n")
    }

    /// Returns the example scenario with all keys uncommented. The part that describes a motor is left out.
    fn everything() -> String {
        with_comments(scenario().split("# A motor that differs").next().unwrap_or_default())
    }

    #[test]
    fn law_the_data_sheet_is_valid_as_it_is_and_with_all_that_is_commented_out() {
        use standstill_plant::DataSheet;
        let motor = |text: &str| {
            DataSheet::parse("own.toml", text)
                .and_then(|sheet| sheet.motor())
                .unwrap_or_else(|error| panic!("{error}"))
        };
        assert!(!motor(MOTOR).saturation_is_known());
        let (head, tail) = MOTOR.split_once("\n[nameplate]").expect("the table");
        let all = format!("{head}\n[nameplate]{}", with_comments(tail));
        let everything = motor(&all);
        assert_eq!((everything.rotor.inertia, everything.rotor.friction.stiction), (4e-4, 0.04));
        // The template has the keys of the schema, and no others.
        let table: Table = all.parse().expect("TOML");
        let keys =
            table["nameplate"].as_table().expect("a table").keys().cloned().collect::<BTreeSet<String>>();
        let schema = file::schema();
        let sheet = &schema["$defs"]["Motor"]["anyOf"][2]["properties"]["nameplate"];
        let place = sheet.to_string();
        let reference =
            place.split("#/").nth(1).and_then(|rest| rest.split('"').next()).expect("a reference");
        let known = properties(&schema, &format!("/{reference}"));
        assert!(keys.is_subset(&known), "{keys:?}");
        for key in known {
            assert!(MOTOR.contains(&key), "{key} is not in the sheet");
        }
        assert_eq!(motor(&all).doubtful(), None);
    }

    fn properties(schema: &serde_json::Value, path: &str) -> BTreeSet<String> {
        let place = schema.pointer(path).unwrap_or_else(|| panic!("no {path}"));
        place["properties"].as_object().into_iter().flatten().map(|(key, _)| key.clone()).collect()
    }

    #[test]
    fn law_the_example_has_every_key_of_the_schema_and_no_other() {
        let text = everything();
        let document = Document::parse(Path::new("scenario.toml"), &text).expect("TOML");
        document.load().unwrap_or_else(|error| panic!("{error}"));
        let table: Table = text.parse().expect("TOML");
        let schema = file::schema();
        let keys = |table: &Table| table.keys().cloned().collect::<BTreeSet<String>>();
        assert_eq!(keys(&table), properties(&schema, ""));
        for key in ["rotor", "inverter", "sensors", "detector", "stop_at", "design"] {
            let reference = schema["properties"][key]["$ref"].as_str().expect("a table of its own");
            let Value::Table(below) = &table[key] else { panic!("{key} is no table") };
            let mut known = properties(&schema, reference.trim_start_matches('#'));
            // The library for Python writes this key into the records of its runs; a file never has it.
            known.remove("python");
            assert_eq!(keys(below), known, "{key}");
        }
    }

    #[test]
    fn law_the_example_is_valid_as_it_is() {
        let document = Document::parse(Path::new("scenario.toml"), &scenario()).expect("TOML");
        assert_eq!(Plan::new(document).expect("valid").points().len(), 1);
        let (_, motor) = SCENARIO.split_once("# [motor]").expect("the motor in place");
        let motor: Vec<&str> = motor.lines().filter_map(|line| line.strip_prefix("# ")).collect();
        let text = format!("[motor]\n{}\n", motor.join("\n"));
        let document = Document::parse(Path::new("scenario.toml"), &text).expect("TOML");
        Plan::new(document).expect("valid");
    }
}
