//! `docs/mistakes.md`: typical mistakes and what the program says to each, as it says it.
//!
//! The page is what this test prints. Where the program says something else than the page, the test fails; with
//! `STANDSTILL_WRITE=1` it writes the page.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use super::{folder, mistake, names, standstill};

/// A mistake: what went wrong, the scenario if it is not the one of `init`, and the words of the command line.
type Case = (&'static str, &'static str, &'static [&'static str]);

const KEYS: &[Case] = &[
    ("A misspelt key", "[sensors]\nnoize = \"20 mA\"", &["run", "s.toml"]),
    ("A key in the wrong table", "[inverter]\nnoise = \"20 mA\"", &["run", "s.toml"]),
    ("A misspelt choice", "[detector]\nmethod = \"bipolr\"", &["run", "s.toml"]),
    ("Another dimension", "[sensors]\nnoise = \"20 mV\"", &["run", "s.toml"]),
    ("A unit that is none", "[inverter]\ndead_time = \"2 usec\"", &["run", "s.toml"]),
    ("A decimal comma", "[sensors]\nnoise = \"0,02 A\"", &["run", "s.toml"]),
    ("A value that cannot be", "[inverter]\ncarrier = \"10 MHz\"", &["run", "s.toml"]),
    ("A text without quotes", "[sensors]\nnoise = 20 mA", &["run", "s.toml"]),
    ("A count in quotes", "trials = \"2000\"", &["run", "s.toml"]),
    (
        "A setting that the method does not have",
        "[detector]\nmethod = \"hfi-rotating\"\npulse = \"80 us\"",
        &["run", "s.toml"],
    ),
    (
        "A check that the method does not have",
        "[detector]\nmethod = \"hfi-rotating\"\nchecks = [\"turning\", \"contact\"]",
        &["run", "s.toml"],
    ),
    ("A capacitor that nothing feeds", "[inverter]\ncapacitance = \"500 uF\"", &["run", "s.toml"]),
    ("A sag without an end", "[inverter]\nsag_depth = \"20 %\"\nsag_start = \"2 ms\"", &["run", "s.toml"]),
    ("A load on a locked rotor", "[rotor]\nload = \"3 N m\"", &["run", "s.toml"]),
    (
        "An acceleration of a rotor that is free",
        "[rotor]\nstate = \"free\"\nacceleration = \"60 rpm/s\"",
        &["run", "s.toml"],
    ),
    (
        "Comparators of each leg without sensors of each leg",
        "[sensors]\narrangement = \"dc-link-shunt\"\ntimer = \"0.3 us\"\ncomparators = \"per-leg\"",
        &["run", "s.toml"],
    ),
    (
        "Six pulses on a drive that reads neither times nor currents",
        "[sensors]\narrangement = \"none\"\nterminals = true\n[detector]\nmethod = \"six-pulse\"",
        &["run", "s.toml"],
    ),
    ("An angle beyond a turn", "[rotor]\nangle = \"400 deg\"", &["run", "s.toml"]),
    ("A brake without play", "[rotor]\nstate = \"brake\"", &["run", "s.toml"]),
];

const MOTORS: &[Case] = &[
    ("A data sheet that is none yet", "name = \"pump\"", &["check", "s.toml"]),
    ("A motor that is not built in", "motor = \"paper\"", &["run", "s.toml"]),
    ("A data sheet that is not there", "motor = \"motors/mine.toml\"", &["run", "s.toml"]),
    (
        "A misspelt key of a motor",
        "[motor]\nbase = \"paper-5k5\"\nwinding.resistence = \"1.3 Ω\"",
        &["run", "s.toml"],
    ),
    (
        "The wrong dimension in a motor",
        "[motor]\nbase = \"paper-5k5\"\nwinding.resistance = \"1.3 mH\"",
        &["run", "s.toml"],
    ),
    (
        "A remanence that no soft iron has",
        "[motor]\nbase = \"paper-5k5\"\n[motor.hysteresis]\ncoercive_current = \"2 A\"\ndepth = \"5 %\"\ncells = 3",
        &["run", "s.toml"],
    ),
    (
        "A table that lacks keys",
        "[motor]\nbase = \"paper-5k5\"\n[motor.hysteresis]\ndepth = \"5 %\"",
        &["run", "s.toml"],
    ),
    (
        "A count in quotes",
        "[motor]\nbase = \"paper-5k5\"\n[motor.hysteresis]\ncoercive_current = \"80 mA\"\ndepth = \"5 %\"\ncells = \"3\"",
        &["run", "s.toml"],
    ),
];

const AXES: &[Case] = &[
    (
        "Ends in two units",
        "[axes]\n\"sensors.noise\" = { from = \"1 mA\", to = \"0.1 V\", points = 5 }",
        &["run", "s.toml"],
    ),
    ("A logarithmic axis from zero", "", &["sweep", "s.toml", "--vary", "sensors.noise=0 mA:50 mA:6:log"]),
    ("An axis without a number of points", "", &["sweep", "s.toml", "--vary", "sensors.noise=0 mA:50 mA"]),
    (
        "An axis that is there twice",
        "",
        &["sweep", "s.toml", "--vary", "sensors.noise=5 mA,9 mA", "--vary", "sensors.noise=1 mA,2 mA"],
    ),
    (
        "A key that is set twice",
        "",
        &["run", "s.toml", "-s", "sensors.noise=5 mA", "-s", "sensors.noise=9 mA"],
    ),
    ("A key that is there twice", "seed = 1\nseed = 2", &["run", "s.toml"]),
    ("An option of other commands", "", &["run", "s.toml", "--errors", "field"]),
    ("A prefix in the wrong case", "", &["run", "s.toml", "-s", "sensors.noise=5 ma"]),
    ("An rms value under a key of a peak value", "", &["run", "s.toml", "-s", "sensors.noise=5 mArms"]),
    (
        "A dead time as long as a pulse",
        "",
        &["run", "s.toml", "-s", "detector.method=bipolar", "-s", "inverter.dead_time=200 us"],
    ),
    ("An axis whose key is misspelt", "", &["sweep", "s.toml", "--vary", "sensors.noize=0 mA:50 mA:6"]),
    (
        "An axis that leaves what is possible",
        "",
        &["sweep", "s.toml", "--vary", "inverter.carrier=1 kHz:2 MHz:3"],
    ),
    ("A sweep over nothing", "", &["sweep", "s.toml"]),
    (
        "A design without a number of points",
        "",
        &["sweep", "s.toml", "--vary", "sensors.noise=0 mA:50 mA:6", "--design", "sobol"],
    ),
    ("The number of trials as an axis", "", &["sweep", "s.toml", "--vary", "trials=100,1000"]),
    (
        "A tolerance about nothing",
        "[tolerances]\n\"inverter.dead_time\" = { normal = \"5 %\" }",
        &["run", "s.toml"],
    ),
    (
        "A tolerance of an axis",
        "[axes]\n\"sensors.noise\" = [\"1 mA\", \"2 mA\"]\n[tolerances]\n\"sensors.noise\" = { normal = \"5 %\", mean = \"1 mA\" }",
        &["run", "s.toml"],
    ),
];

const LINES: &[Case] = &[
    ("A scenario that is not there", "", &["run", "scenarios/s.toml"]),
    ("An override without a value", "", &["run", "s.toml", "-s", "sensors.noise"]),
    ("An override of the wrong dimension", "", &["run", "s.toml", "-s", "sensors.noise=20 mV"]),
    ("No trials", "", &["run", "s.toml", "--trials", "0"]),
    ("A shard that is none", "", &["run", "s.toml", "--shard", "0/4"]),
    ("A precision of what has none", "", &["run", "s.toml", "--stop-at", "mean=1%"]),
    ("A format that is none", "", &["run", "s.toml", "--format", "xlsx"]),
    (
        "A point that the axes do not have",
        "",
        &["trace", "s.toml", "--vary", "sensors.noise=1 mA,9 mA", "--point", "2", "--out", "t"],
    ),
    ("A bound without its unit", "", &["odds", "s.toml", "--event", "peak_current > 8"]),
    (
        "A limit on what is not measured",
        "",
        &["require", "s.toml", "--key", "sensors.noise", "--limit", "rmse <= 1 deg"],
    ),
    (
        "A trial that the campaign does not have",
        "trials = 50",
        &["trace", "s.toml", "--trial", "50", "--out", "t"],
    ),
    ("A motor that an option misspells", "", &["compare", "s.toml", "--motor", "papr"]),
    (
        "A comparison of what has axes",
        "[axes]\n\"sensors.noise\" = [\"1 mA\", \"2 mA\"]",
        &["compare", "s.toml"],
    ),
    ("Results where a file is", "", &["run", "s.toml", "--out", "s.toml"]),
];

const QUESTIONS: &[Case] = &[
    (
        "A requirement of what is no number",
        "",
        &["require", "s.toml", "--key", "detector.method", "--limit", "rms <= 1 deg"],
    ),
    (
        "Values without their unit",
        "",
        &["tune", "s.toml", "--vary", "detector.pulse=50:400", "--minimise", "rms"],
    ),
    (
        "A stretch without its unit",
        "",
        &["require", "s.toml", "--key", "detector.pulse", "--limit", "rms <= 1 deg", "--between", "50:400"],
    ),
];

const SECTIONS: [(&str, &[Case]); 5] = [
    ("In a scenario file", KEYS),
    ("Of a motor", MOTORS),
    ("Of axes and tolerances", AXES),
    ("On the command line", LINES),
    ("Of questions", QUESTIONS),
];

fn quoted(word: &str) -> String {
    if word.contains(' ') { format!("\"{word}\"") } else { word.to_owned() }
}

fn said(page: &mut String, folder: &Path, arguments: &[&str]) {
    let before = names(folder);
    let message = mistake(arguments, folder);
    assert_eq!(names(folder), before, "{arguments:?} leaves nothing behind");
    let words: Vec<String> = arguments.iter().map(|word| quoted(word)).collect();
    let _ = writeln!(page, "```text\n$ standstill {}\n{}\n```\n", words.join(" "), message.trim_end());
}

fn page() -> String {
    let mut page = "# Typical mistakes, and what the program says\n\n\
        Generated by running each (`STANDSTILL_WRITE=1 cargo test -p standstill --test cli mistakes`). Every mistake ends\n\
        the program with code 2 before the first trial, and leaves no file behind.\n"
        .to_owned();
    for (heading, cases) in SECTIONS {
        let _ = write!(page, "\n## {heading}\n");
        for (title, text, arguments) in cases {
            let folder = folder();
            let _ = write!(page, "\n**{title}**\n\n");
            fs::write(folder.path().join("s.toml"), text).expect("written");
            if !text.is_empty() {
                let _ = write!(page, "```toml\n{text}\n```\n\n");
            }
            said(&mut page, folder.path(), arguments);
            page.truncate(page.trim_end().len());
            page.push('\n');
        }
    }
    page + "\n## With results that are there\n\n" + &results()
}

/// Mistakes with what an earlier run left.
fn results() -> String {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), "").expect("written");
    let run = |arguments: &[&str]| {
        let output = standstill(arguments, path);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    for k in ["1/3", "2/3"] {
        let out = format!("part{}", &k[..1]);
        run(&["run", "s.toml", "--trials", "12", "--shard", k, "--out", &out]);
    }
    run(&["run", "s.toml", "--trials", "12", "--shard", "2/3", "--out", "copy"]);
    run(&["run", "s.toml", "--trials", "12", "--seed", "2", "--shard", "3/3", "--out", "other"]);
    run(&["run", "s.toml", "--trials", "12", "--out", "done"]);
    run(&["budget", "s.toml", "--pairs", "100", "--out", "answer"]);
    let mut page = String::new();
    let cases: [Case; 9] = [
        (
            "A run that was not finished, begun again",
            "",
            &["run", "s.toml", "--trials", "12", "--shard", "1/3", "--out", "part1"],
        ),
        (
            "Going on with another seed",
            "",
            &[
                "run", "s.toml", "--trials", "12", "--seed", "7", "--shard", "1/3", "--resume", "--out",
                "part1",
            ],
        ),
        (
            "Going on with another scenario",
            "",
            &["run", "s.toml", "--trials", "12", "-s", "errors=harsh", "--resume", "--out", "done"],
        ),
        ("A missing shard", "", &["merge", "part1", "part2", "--out", "all"]),
        ("A shard twice", "", &["merge", "part1", "part2", "copy", "--out", "all"]),
        ("A shard of another run", "", &["merge", "part1", "part2", "other", "--out", "all"]),
        ("A folder without shards", "", &["merge", "done", "--out", "all"]),
        ("A report of an answer", "", &["report", "answer"]),
        ("A report of a folder that is not there", "", &["report", "don"]),
    ];
    for (title, _, arguments) in cases {
        let _ = write!(page, "**{title}**\n\n");
        said(&mut page, path, arguments);
    }
    page.truncate(page.trim_end().len());
    page + "\n"
}

#[test]
fn regress_the_page_of_mistakes_is_what_the_program_says() {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/mistakes.md"));
    let page = page();
    if std::env::var_os("STANDSTILL_WRITE").is_some() {
        fs::write(path, &page).expect("docs/ is writable");
    }
    let written = fs::read_to_string(path).unwrap_or_default();
    if let Some((line, (said, written))) =
        page.lines().zip(written.lines()).enumerate().find(|(_, (said, written))| said != written)
    {
        panic!("docs/mistakes.md, line {}:\n{written}\nbut the program says\n{said}", line + 1);
    }
    assert_eq!(page.lines().count(), written.lines().count());
}
