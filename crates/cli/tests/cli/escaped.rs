//! Names that a browser would run, on all pages and in all figures.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use super::{folder, standstill};

/// What a text may be that somebody else wrote.
const TEXT: &str = "</script><script>alert(1)</script></text><img src=x onerror=alert(1)><!-- \"'&\u{1b}]0;x\u{7}\u{1b}[2J\u{85}";
/// The library of charts, which has control characters in its own texts.
const CHARTS: &str = include_str!("../../../report/assets/plotly-cartesian.min.js");
/// What the name of a file or a folder may be.
const NAME: &str = "<script>alert(1)<img src=x onerror=alert(1)><!-- \"'&";

/// The names of all tags of a page or a figure; how often letters are drawn depends on the texts, how often scripts begin does not.
fn tags(text: &str) -> (BTreeSet<&str>, usize) {
    let ends = |c: char| !c.is_ascii_alphanumeric() && !"/!-".contains(c);
    let names = text.split('<').skip(1).map(|rest| rest.split(ends).next().unwrap_or_default());
    (names.collect(), text.matches("<script").count())
}

/// All pages and figures below a folder, by their paths.
fn drawn(at: &Path, below: &str, found: &mut Vec<(String, String)>) {
    let mut entries: Vec<_> = fs::read_dir(at.join(below)).expect("a folder").flatten().collect();
    entries.sort_by_key(std::fs::DirEntry::file_name);
    for entry in entries {
        let name = format!("{below}/{}", entry.file_name().to_string_lossy());
        let kind =
            entry.path().extension().map(|kind| kind.to_string_lossy().into_owned()).unwrap_or_default();
        if entry.path().is_dir() {
            drawn(at, &name, found);
        } else if ["html", "svg", "xml"].contains(&kind.as_str()) {
            found.push((name, fs::read_to_string(entry.path()).expect("text")));
        }
    }
}

/// Whether a text has characters that drive a terminal, beside line ends and tabs.
fn is_driven(text: &str) -> bool {
    text.chars().any(|c| c.is_control() && !matches!(c, '\n' | '\t' | '\r'))
}

/// The same commands about files with harmless names and texts and about hostile ones: their pages and figures have tags of the same names.
#[test]
fn law_hostile_names_add_no_tag_to_any_page_or_figure() {
    let folder = folder();
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    let sheet =
        fs::read_to_string(format!("{root}/crates/plant/motors/paper-5k5.toml")).expect("the data sheet");
    let of = |place: &str, name: &str, text: &str| -> Vec<(String, String)> {
        let at = folder.path().join(place);
        fs::create_dir(&at).expect("made");
        let quoted = toml::Value::from(text).to_string();
        let title = sheet.lines().find(|line| line.starts_with("title = ")).expect("a title");
        let [motor, scenario, run] = ["motor.toml", "scenario.toml", "run"].map(|end| format!("{name}{end}"));
        fs::write(at.join(&motor), sheet.replace(title, &format!("title = {quoted}"))).expect("written");
        let of_motor = format!(
            "motor = {}\ntrials = 60\ndetector.method = \"bipolar\"\n",
            toml::Value::from(motor.as_str())
        );
        fs::write(at.join(&scenario), of_motor).expect("written");
        let visible: String = text.chars().filter(|c| !c.is_control()).collect();
        let id = toml::Value::from(visible);
        let list = format!(
            "odds = \"off\"\ntrials = 100\n[[requirement]]\nid = {id}\ntext = {quoted}\nlimit = \"rms <= 6 deg\"\n"
        );
        fs::write(at.join("r.toml"), list).expect("written");
        let trace = format!("{root}/examples/traces/six_vectors.csv");
        let compare = [
            "--method",
            "bipolar",
            "--rotor",
            "locked",
            "--errors",
            "default",
            "--trials",
            "5",
            "--no-limit",
        ];
        for words in [
            &["motors", &motor][..],
            &["run", &scenario, "--out", &run],
            &["sweep", &scenario, "--vary", "errors=default,harsh", "--out", "b"],
            &["report", &run, "--out", "report-a"],
            &["report", "b", "--out", "report-b"],
            &["report", &run, &run, "--out", "two"],
            &["explain", &run, "--trial", "1", "--out", "explain"],
            &["trace", &scenario, "--angle", "20", "--out", "trace"],
            &["trace", &scenario, "-s", "errors=[default, harsh]", "--out", "overlay"],
            &["magnetics", &motor, "--out", "magnetics"],
            &["qualify", &scenario, "r.toml", "--no-witness", "--out", "qualify"],
            &["faults", &scenario, "--trials", "20", "--mode", "phase-open", "--out", "faults"],
            &["budget", &scenario, "--pairs", "100", "--out", "budget"],
            &["reproduce", "--motor", &motor, "--trials", "20", "--out", "reproduce"],
            &["fit", &trace, "--motor", &motor, "--out", "fit"],
            &[&["compare", &scenario, "--out", "compare"][..], &compare].concat(),
        ] {
            let output = standstill(words, &at);
            let said = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.code().is_some_and(|code| code != 2), "{words:?}: {said}");
            let said = String::from_utf8_lossy(&output.stdout);
            assert!(!is_driven(&said), "{words:?} sends control characters: {said:?}");
        }
        let mut found = Vec::new();
        drawn(&at, ".", &mut found);
        found
    };
    let (plain, hostile) = (of("plain", "", "a harmless text"), of("hostile", NAME, TEXT));
    let (mut pages, mut named) = (0, 0);
    assert_eq!(plain.len(), hostile.len());
    for ((name, plain), (other, hostile)) in plain.iter().zip(&hostile) {
        assert_eq!(name, other);
        assert!(tags(plain) == tags(hostile), "{name} has other tags");
        assert!(!is_driven(&hostile.replace(CHARTS, "")), "{name} has control characters");
        assert!(!hostile.contains("<img") && !hostile.contains("<script>alert"), "{name}");
        pages += 1;
        named += usize::from(hostile.contains("alert(1)"));
    }
    assert!(pages >= 30 && named >= 14, "{pages} pages and figures, {named} with the name");
}
