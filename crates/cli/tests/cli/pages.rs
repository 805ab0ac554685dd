//! README.md and docs/: what they print is what the program says, what they name exists.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use super::{folder, standstill};

pub const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

fn said(arguments: &[&str], folder: &Path) -> String {
    let output = standstill(arguments, folder);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

#[test]
fn law_the_version_says_what_a_run_and_a_library_must_fit() {
    let said = said(&["--version"], folder().path());
    let expected = format!(
        "standstill {} (numerics {}, ABI of detectors {})\n",
        env!("CARGO_PKG_VERSION"),
        standstill_campaign::NUMERICS,
        standstill_foreign::ABI
    );
    assert_eq!(said, expected);
    let changes = fs::read_to_string(Path::new(ROOT).join("CHANGELOG.md")).expect("the changelog");
    assert!(changes.contains(env!("CARGO_PKG_VERSION")), "CHANGELOG.md does not have this version");
}

/// With `STANDSTILL_WRITE=1` it writes the page.
#[test]
fn golden_the_reference_is_what_help_says() {
    let folder = folder();
    let help = said(&["--help"], folder.path());
    // Commands stand in groups, each of which has a title.
    let lines = help.lines().skip_while(|line| !line.starts_with("Usage:")).skip(1);
    let lines = lines.take_while(|line| *line != "Options:");
    let commands: Vec<&str> = lines
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help")
        .collect();
    assert!(commands.len() > 15, "{help}");
    let mut page = "# Reference\n\nThe options of every command, as `standstill COMMAND --help` prints them\n\
         (`STANDSTILL_WRITE=1 cargo test -p standstill --test cli reference` writes this page), and the [keys of scenario\n\
         files](#keys-of-a-scenario), which stand in the file that `standstill init` writes, too. The keys of methods are explained in\n\
         [methods.md](methods.md); what is written where, in [files.md](files.md).\n"
        .to_owned();
    for command in commands {
        let help = said(&[command, "--help"], folder.path());
        let lines: Vec<&str> = help.trim_end().lines().map(str::trim_end).collect();
        let _ = write!(page, "\n## {command}\n\n```text\n{}\n```\n", lines.join("\n"));
    }
    page += "\n## Keys of a scenario\n\nNumbers are texts with a unit, or plain numbers in the unit of the table. `standstill schema` has them for editors.\n\n\
             | key | values | the reason for the range | meaning |\n|---|---|---|---|\n";
    for key in standstill_scenario::keys() {
        let _ = writeln!(page, "{}", row(key));
    }
    let path = Path::new(ROOT).join("docs/reference.md");
    if std::env::var_os("STANDSTILL_WRITE").is_some() {
        fs::write(path, page).expect("writable");
        return;
    }
    let written = fs::read_to_string(path).expect("the page");
    for (k, (is, should)) in written.lines().zip(page.lines()).enumerate() {
        assert_eq!(is, should, "docs/reference.md, line {}", k + 1);
    }
    assert_eq!(written.lines().count(), page.lines().count());
}

/// The row of a key in the table of the reference.
fn row(key: &standstill_scenario::Key) -> String {
    use standstill_scenario::Values;
    let values = match key.values() {
        Values::Number { unit, share } => {
            let unit = if share {
                "share"
            } else if unit.is_empty() {
                "number"
            } else {
                unit
            };
            let allowed = key.allowed().unwrap_or_default();
            let allowed = allowed.strip_prefix("a share ").unwrap_or(allowed);
            format!("{unit}, {allowed}")
        }
        Values::Choice(names) => {
            names.iter().map(|(name, _)| format!("`{name}`")).collect::<Vec<_>>().join(", ")
        }
        Values::Flag => "true or false".to_owned(),
        Values::List(names) => {
            let names: Vec<String> = names.iter().map(|(name, _)| format!("`{name}`")).collect();
            format!("true, false or a list of {}", names.join(", "))
        }
        Values::Whole => key.allowed().unwrap_or_default().to_owned(),
        Values::Text => "text or table".to_owned(),
    };
    let reason = key.range.map_or("", |range| range.reason);
    let about = key.about.split_whitespace().collect::<Vec<_>>().join(" ");
    format!("| `{}` | {values} | {reason} | {} |", key.path, about.replace('|', "\\|"))
}

#[test]
fn golden_the_five_minutes_of_the_readme_run_as_they_are_printed() {
    let folder = folder();
    let readme = fs::read_to_string(Path::new(ROOT).join("README.md")).expect("the page");
    let section =
        readme.split("## Five minutes").nth(1).and_then(|rest| rest.split("```").nth(1)).expect("a block");
    let commands =
        section.lines().filter_map(|line| line.split('#').next()?.trim().strip_prefix("standstill "));
    let mut run = 0;
    for command in commands.filter(|command| *command != "lab") {
        said(&command.split_whitespace().collect::<Vec<_>>(), folder.path());
        run += 1;
    }
    assert_eq!(run, 5);
    for file in ["trace/waveform.png", "scenario.toml", "standstill-out/scenario-run/report/report.html"] {
        assert!(folder.path().join(file).exists(), "{file}");
    }
}

/// Pages in a folder of the root.
pub fn pages_in(folder: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(Path::new(ROOT).join(folder)).expect("a folder");
    let entries = entries.map(|entry| Path::new(folder).join(entry.expect("an entry").file_name()));
    let mut pages: Vec<PathBuf> =
        entries.filter(|page| page.extension().is_some_and(|end| end == "md")).collect();
    pages.sort();
    pages
}

/// Pages for people, by their places from the root.
fn pages() -> Vec<PathBuf> {
    let mut pages: Vec<PathBuf> =
        ["docs", "docs/guide", "docs/notes"].into_iter().flat_map(pages_in).collect();
    // The contents of the site, where the pages of the root stand beside them: another test reads them.
    pages.retain(|page| !page.ends_with("SUMMARY.md"));
    pages.extend(
        ["README.md", "ARCHITECTURE.md", "benches/tools/README.md", "tests/cross/README.md"]
            .map(PathBuf::from),
    );
    pages
}

#[test]
fn law_what_pages_link_to_exists() {
    let (mut links, mut anchors) = (0, 0);
    for page in pages() {
        let text = fs::read_to_string(Path::new(ROOT).join(&page)).expect("readable");
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            if link.starts_with("http") || link.contains(' ') {
                continue;
            }
            let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
            let folder = Path::new(ROOT).join(page.parent().expect("a file has a folder"));
            let target = if file.is_empty() { Path::new(ROOT).join(&page) } else { folder.join(file) };
            assert!(target.exists(), "{} links to {link}", page.display());
            if !anchor.is_empty() {
                let text = fs::read_to_string(&target).expect("readable");
                let is_there = text.lines().any(|line| line.starts_with('#') && slug(line) == anchor);
                assert!(is_there, "{} links to {link}, which has no such heading", page.display());
                anchors += 1;
            }
            links += 1;
        }
    }
    assert!(links > 40 && anchors > 20, "{links} {anchors}");
}

/// Returns the anchor of a heading, as the site and code hosts make it.
fn slug(heading: &str) -> String {
    let text = heading.trim_start_matches('#').trim().to_lowercase();
    let kept = text.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

/// Splits a list at commas that stand in no brackets.
fn split_outside(list: &str) -> Vec<String> {
    let (mut parts, mut depth) = (vec![String::new()], 0);
    for c in list.chars() {
        depth += i32::from(c == '(') - i32::from(c == ')');
        if c == ',' && depth == 0 {
            parts.push(String::new());
        } else {
            parts.last_mut().expect("a part").push(c);
        }
    }
    parts.iter().map(|part| part.trim().to_owned()).collect()
}

#[test]
fn law_the_glossary_explains_each_number_of_a_run_and_each_measure_of_a_limit() {
    let folder = folder();
    said(&["run", "outrunner", "--trials", "20", "--out", "run"], folder.path());
    let summary = fs::read_to_string(folder.path().join("run/summary.json")).expect("a summary");
    let summary: serde_json::Value = serde_json::from_str(&summary).expect("JSON");
    let help = said(&["require", "--help"], folder.path());
    let measures = help.split("unanswered <= 0.1 %`: ").nth(1).and_then(|rest| rest.split(". Starts").next());
    let measures =
        measures.expect("the measures of a limit").split_whitespace().collect::<Vec<_>>().join(" ");
    // A remark in brackets follows a name; the brackets of `P(|e| > X)` belong to the name.
    let without = |name: &str| name.split(" (").next().unwrap_or_default().to_owned();
    let names = summary["summary"].as_object().expect("a table").keys().cloned();
    let names: Vec<String> = names.chain(split_outside(&measures).iter().map(|name| without(name))).collect();
    assert!(names.len() > 30, "{names:?}");
    let glossary = fs::read_to_string(Path::new(ROOT).join("docs/glossary.md")).expect("the glossary");
    for name in names {
        assert!(glossary.contains(&format!("`{name}`")), "docs/glossary.md does not explain {name}");
    }
}
