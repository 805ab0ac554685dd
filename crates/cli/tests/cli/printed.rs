//! Pages whose commands are run as they are printed.
//!
//! In a block whose first line begins with `$ standstill` stand a command and what it prints; a block of `toml` whose first
//! line is a comment with a name is the file of that name. With `STANDSTILL_WRITE=1` the tests write the pages.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use standstill_detect::MethodName;

use super::{folder, standstill};

/// The page with what its commands say, but for those that begin with one of `left_out`; `files` of `examples/` lie beside it.
fn as_printed(page: &str, files: &[&str], left_out: &[&str]) -> String {
    let folder = folder();
    for file in files {
        let from = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples")).join(file);
        fs::copy(&from, folder.path().join(from.file_name().expect("a name"))).expect("copied");
    }
    let mut out = String::new();
    let mut blocks = page.split("```");
    out += blocks.next().unwrap_or_default();
    while let Some(block) = blocks.next() {
        let (kind, body) = block.split_once('\n').expect("a block has lines");
        out += "```";
        if let (true, Some(rest)) = (kind == "toml", body.strip_prefix("# ")) {
            let name = rest.lines().next().expect("a name").trim();
            fs::write(folder.path().join(name), body).expect("written");
        }
        match body.strip_prefix("$ standstill ").and_then(|rest| rest.lines().next()) {
            Some(words) if !left_out.iter().any(|begin| words.starts_with(begin)) => {
                let arguments: Vec<&str> = words.split_whitespace().collect();
                let output = standstill(&arguments, folder.path());
                let stderr = String::from_utf8(output.stderr).expect("text");
                let told = stderr.split_inclusive('\n').filter(|line| !is_progress(line));
                let said = told.collect::<String>() + &String::from_utf8(output.stdout).expect("text");
                let lines: Vec<&str> = said.trim_end().lines().map(str::trim_end).collect();
                let _ = write!(out, "{kind}\n$ standstill {words}\n{}\n", lines.join("\n"));
            }
            _ => out += block,
        }
        out += "```";
        out += blocks.next().expect("each block ends");
    }
    out
}

/// Whether a line is progress: how far long work has come, which depends on the machine, or what `check` knows of a method before its answer.
pub fn is_progress(line: &str) -> bool {
    let of_method = |method: &MethodName| line.starts_with(&format!("standstill: {}: ", method.name()));
    [" %) after ", " steps after ", " step after "].iter().any(|part| line.contains(part))
        || MethodName::ALL.iter().any(of_method)
}

/// That a page of `docs/` says what the program says, but for the commands that begin with one of `left_out`.
fn holds(name: &str, files: &[&str], left_out: &[&str]) {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs")).join(name);
    let page = fs::read_to_string(&path).expect("the page");
    let writes = std::env::var_os("STANDSTILL_WRITE").is_some();
    let printed = as_printed(&page, files, if writes { &[] } else { left_out });
    assert!(page.contains("\n$ standstill "), "the page shows commands");
    if writes {
        fs::write(path, printed).expect("writable");
        return;
    }
    for (k, (is, should)) in page.lines().zip(printed.lines()).enumerate() {
        assert_eq!(is, should, "docs/{name}, line {}", k + 1);
    }
    assert_eq!(page.lines().count(), printed.lines().count());
}

/// The pages on own motors: files of `examples/` beside them, and searches for settings of motors after the first, which take 3 to 10 s each.
const OWN_MOTORS: [(&str, &[&str], &[&str]); 3] = [
    ("own-motor.md", &[], &["check no-saturation.toml -s detector.method=bipolar"]),
    (
        "own-motor-map.md",
        &["maps/both_sides.csv", "maps/one_side.csv", "maps/measured.csv"],
        &["check motor.toml", "check half.toml -s motor.map.beyond=fitted", "check measured.toml"],
    ),
    ("own-motor-traces.md", &["traces/six_vectors.csv"], &["check six/motor.toml"]),
];

#[test]
fn golden_the_pages_of_own_motors_say_what_the_program_says() {
    for (name, files, searches) in OWN_MOTORS {
        let page = format!("{}/../../docs/{name}", env!("CARGO_MANIFEST_DIR"));
        let page = fs::read_to_string(page).expect("the page");
        for search in searches {
            assert!(
                page.contains(&format!("\n$ standstill {search}\n")),
                "{search}: left out, and not there"
            );
        }
        holds(name, files, searches);
    }
}

#[test]
#[ignore = "long searches; the first of each page runs by default: scripts/test-all.sh long"]
fn golden_the_whole_pages_of_own_motors_say_what_the_program_says() {
    for (name, files, _) in OWN_MOTORS {
        holds(name, files, &[]);
    }
}

#[test]
fn golden_the_guide_says_what_the_program_says() {
    holds("guide/data-sheet.md", &[], &[]);
}

#[test]
fn golden_the_tutorial_says_what_the_program_says() {
    holds("tutorial.md", &[], &[]);
    // Its tables fit a terminal.
    let page =
        fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/tutorial.md")).expect("the page");
    let printed = page.split("```").skip(1).step_by(2).flat_map(|block| block.split("\n\n"));
    for line in printed.filter(|part| part.contains("──")).flat_map(str::lines) {
        assert!(line.chars().count() <= 80, "{line}");
    }
}
