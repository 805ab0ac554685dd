//! How wide lines are and which words have colours: on terminals, and where there is none.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use super::answers::SCENARIO;
use super::terminal::{columns, said, tables, with};
use super::{folder, standstill};

const TRACE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/traces/six_vectors.csv");

/// What questions and answers begin with: a scenario, two runs, and some of the shards of a third.
fn prepared(at: &Path) {
    fs::write(at.join("s.toml"), format!("trials = 30\n{SCENARIO}")).expect("written");
    fs::write(
        at.join("t.toml"),
        format!("trials = 30\n{SCENARIO}").replace("line-inductance-fast", "bipolar"),
    )
    .expect("written");
    for (scenario, out) in [("s.toml", "r"), ("t.toml", "u")] {
        said(&["run", scenario, "--out", out, "--force"], at);
    }
    fs::copy(TRACE, at.join("trace.csv")).expect("copied");
    for shard in ["2/5", "4/5"] {
        said(&["run", "s.toml", "--shard", shard, "--out", "shards", "--force"], at);
    }
}

/// Verdicts of one method: a search among all of them prints no other kind of line, in three times the time.
pub const CHECK: &[&str] = &["check", "paper-5k5", "-s", "detector.method=bipolar"];

/// Commands that print a page; those of `TABULATE` answer with a table.
const PRINT: [&[&str]; 8] = [
    &["motors"],
    &["motors", "light-vehicle"],
    &["magnetics", "paper-5k5"],
    &["trace", "--out", "t", "--force"],
    &["run", "paper-5k5", "--trials", "20", "--out", "p", "--force"],
    &["explain", "r", "--worst", "1"],
    &["report", "r"],
    &["status", "shards"],
];

/// Questions that take a second or more each.
const DEAR: [&[&str]; 4] = [
    &["fit", "trace.csv", "--motor", "paper-5k5", "--out", "f", "--force"],
    &["odds", "s.toml", "--event", "|e| > 1 deg", "--effort", "quick", "--out", "o", "--force"],
    &[
        "require",
        "s.toml",
        "--key",
        "sensors.noise",
        "--between",
        "10 mA:20 mA",
        "--limit",
        "rms <= 1 deg",
        "--most",
        "100",
        "--out",
        "q",
        "--force",
    ],
    &[
        "tune",
        "s.toml",
        "--vary",
        "detector.rounds=2:3",
        "--minimise",
        "rms",
        "--trials",
        "1000",
        "--starts",
        "1",
        "--out",
        "n",
        "--force",
    ],
];

/// Answers with a table; those of 80 columns of the first three are held by `tables_fit_eighty_columns` in terminal.rs.
const TABULATE: [&[&str]; 5] = [
    CHECK,
    &["bounds", "paper-5k5", "--angles", "4"],
    &["compare", "--method", "bipolar", "--trials", "5", "--no-limit", "--out", "c", "--force"],
    &["reproduce", "--trials", "20", "--out", "reproduced", "--force"],
    &["report", "r", "u", "--out", "both"],
];

#[test]
fn law_no_line_is_wider_than_the_terminal() {
    let folder = folder();
    let at = folder.path();
    prepared(at);
    for width in [60, 80] {
        // Text wraps at 80 columns as at 60; tables leave out other columns.
        let pages = if width == 60 { [&PRINT[..], &DEAR[..]].concat() } else { Vec::new() };
        let pages = pages.iter().map(|of| (of, false));
        let tables_here = if width == 60 { &TABULATE[..] } else { &TABULATE[3..] };
        for (arguments, tabulates) in pages.chain(tables_here.iter().map(|of| (of, true))) {
            let output = with(&[("COLUMNS", &width.to_string())], arguments, at);
            let errors = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.code() < Some(2), "{arguments:?}: {errors}");
            let text = String::from_utf8(output.stdout).expect("text");
            // Where there is little room, a row is a block.
            assert!(
                !tabulates || width < 80 || tables(&text).next().is_some(),
                "{arguments:?} shows a table:\n{text}"
            );
            for line in text.lines() {
                assert!(line.chars().count() <= width, "{width}: {arguments:?}: {line}");
            }
        }
    }
    // What is for a program keeps its lines, and so does a pipe of which nothing is known.
    let script = with(&[("COLUMNS", "30")], &["completions", "bash"], at);
    assert!(columns(&String::from_utf8_lossy(&script.stdout)) > 60);
    let json = with(&[("COLUMNS", "30")], &["run", "paper-5k5", "--trials", "20", "--json", "--force"], at);
    assert!(serde_json::from_slice::<serde_json::Value>(&json.stdout).is_ok());
    let bounds = said(&["bounds", "paper-5k5", "--angles", "4"], at);
    assert!(bounds.lines().any(|line| line.chars().count() > 100), "{bounds}");
}

/// What stands on a terminal of so many columns, of both streams or of standard output alone.
fn shown(
    width: usize,
    variables: &[(&str, &str)],
    arguments: &[&str],
    errors: bool,
    folder: &Path,
) -> String {
    let program = env!("CARGO_BIN_EXE_standstill");
    let errors = if errors { "" } else { "2>/dev/null" };
    let line = format!("stty cols {width} rows 40 && '{program}' {} {errors}", arguments.join(" "));
    let mut command = Command::new("script");
    for name in ["COLUMNS", "NO_COLOR", "CLICOLOR", "CLICOLOR_FORCE"] {
        command.env_remove(name);
    }
    let command = command.args(["--quiet", "--return", "--command", &line, "/dev/null"]);
    let command = command.env("TERM", "xterm").env("SHELL", "/bin/sh").envs(variables.iter().copied());
    let output = command.stdin(Stdio::null()).current_dir(folder).output().expect("a terminal by script(1)");
    assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stdout));
    String::from_utf8(output.stdout).expect("text").replace('\r', "")
}

#[test]
#[cfg(target_os = "linux")]
fn law_verdicts_are_coloured_on_terminals_that_want_it() {
    let folder = folder();
    let at = folder.path();
    // One function decides for all commands; this one takes the least time.
    let command: &[&str] = &["run", "paper-5k5", "--trials", "20", "--out", "p", "--force"];
    let on_terminal = |variables: &[(&str, &str)]| shown(80, variables, command, false, at);
    let coloured = on_terminal(&[]);
    assert!(coloured.contains("\u{1b}[32m"), "{coloured}");
    let mut stripped = coloured;
    for code in ["\u{1b}[32m", "\u{1b}[31m", "\u{1b}[33m", "\u{1b}[1m", "\u{1b}[0m"] {
        stripped = stripped.replace(code, "");
    }
    for variable in [("NO_COLOR", "1"), ("CLICOLOR", "0"), ("TERM", "dumb")] {
        assert_eq!(
            on_terminal(&[variable]),
            stripped,
            "{variable:?}: no colours, and those that there were move no column"
        );
    }
    // Where there is no terminal there are none, unless they are asked for.
    let piped = |variables: &[(&str, &str)], command: &[&str]| {
        let output = with(&[&[("COLUMNS", "80")], variables].concat(), command, at);
        String::from_utf8(output.stdout).expect("text")
    };
    assert_eq!(piped(&[], command), stripped);
    assert!(piped(&[("CLICOLOR_FORCE", "1")], CHECK).contains("\u{1b}[32msuited\u{1b}[0m"));
}

#[test]
#[cfg(target_os = "linux")]
fn law_lines_are_as_wide_as_the_terminal_whatever_a_variable_says() {
    let folder = folder();
    let at = folder.path();
    for width in [60, 100] {
        let text = shown(width, &[("COLUMNS", "200")], &["motors", "light-vehicle"], false, at);
        let longest = text.lines().map(|line| line.chars().count()).max().unwrap_or_default();
        assert!(longest <= width && longest > width - 20, "{longest} of {width}:\n{text}");
        // Notes too, which a pipe gets in one line.
        let arguments = ["run", "paper-5k5", "--trials", "2", "--out", "r", "--force"];
        let text = shown(width, &[], &arguments, true, at);
        assert!(text.contains("is a motor, not a"), "{text}");
        for line in text.lines().filter(|line| !line.contains('\u{1b}')) {
            assert!(line.chars().count() <= width, "{width}: {line}");
        }
    }
    let piped = standstill(&["run", "paper-5k5", "--trials", "2", "--out", "r", "--force"], at);
    assert_eq!(String::from_utf8_lossy(&piped.stderr).lines().count(), 1);
}
