//! `standstill budget`.

use std::fs;

use super::answers::{SCENARIO, answer, has, number};
use super::{folder, names, standstill};

#[test]
fn law_a_budget_has_its_keys_and_writes_its_files() {
    let folder = folder();
    fs::write(folder.path().join("s.toml"), SCENARIO).expect("written");
    let arguments = ["budget", "s.toml", "--pairs", "200", "--json", "--out", "b"];
    let budget = answer(&arguments, 0, folder.path());
    assert!((0.6..1.1).contains(&number(&budget, "rms_deg")));
    let sources = budget["sources"].as_array().expect("a list");
    let share: f64 = sources.iter().map(|source| number(source, "share")).sum();
    assert!((share - 1.0).abs() < 1e-9, "{share}");
    // The page says of what it is, and how to make it again.
    let page = fs::read_to_string(folder.path().join("b/budget.html")).expect("a page");
    for part in [
        "paper-5k5",
        "inverter.dead_time",
        "winding.resistance",
        "standstill budget scenario.toml --pairs 200",
    ] {
        assert!(page.contains(part), "{part}");
    }
    for name in ["method", "sensors.noise", "sensors.gain_error", "sensors.bits", "interaction"] {
        let source = sources.iter().find(|source| source["source"] == name).expect(name);
        has(
            source,
            &["source", "alone_rms_deg", "without_rms_deg", "share", "share_low", "share_high", "total"],
        );
        assert!(number(source, "share_low") <= number(source, "share_high"));
        let end = |of: &str, end: &str| source[format!("{of}_{end}_deg")].as_f64();
        let wide = |of: &str| end(of, "low") < end(of, "high");
        assert!(name == "interaction" || wide("alone_rms") && wide("without_rms"), "{source}");
    }
    let expected = [
        "budget.csv",
        "budget.html",
        "budget.json",
        "budget.png",
        "budget.svg",
        "over_angle.png",
        "over_angle.svg",
    ];
    assert_eq!(names(&folder.path().join("b")), expected);
}

#[test]
fn regress_a_budget_without_a_source_of_error_says_so_and_what_to_do() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), "trials = 5\n[detector]\nmethod = \"bipolar\"\n").expect("written");
    for json in [&[][..], &["--json"]] {
        let budget = ["budget", "s.toml", "--pairs", "100", "-s", "errors=none"];
        let message = super::mistake(&[&budget[..], json].concat(), path);
        for part in ["s.toml: found no error", "\"none\"", "standstill run s.toml", "-s errors=default"] {
            assert!(message.contains(part), "{part} in {message}");
        }
    }
    assert_eq!(names(path), ["s.toml"]);
    // Of a run without errors nothing is to be explained by them.
    for arguments in
        [&["run", "s.toml", "-s", "errors=none", "--out", "r"][..], &["explain", "r", "--worst", "1"]]
    {
        let output = standstill(arguments, path);
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success() && !text.contains("one at a time"), "{text}");
        assert!(arguments[0] == "run" || text.contains("the method's own at this angle"), "{text}");
    }
}

/// A part of the turn, or all of it, without an axis is a gap or a message, and no panic.
#[test]
fn regress_a_budget_of_starts_without_an_axis_says_so() {
    let folder = super::folder();
    let path = folder.path();
    std::fs::write(path.join("s.toml"), format!("{SCENARIO}errors = \"default\"\n")).expect("written");
    let none = standstill(&["budget", "s.toml", "--pairs", "100", "-s", "detector.least_saliency=0.9"], path);
    let said = String::from_utf8_lossy(&none.stdout);
    assert_eq!(none.status.code(), Some(3), "{said}");
    assert!(said.contains("of 100 pairs of starts 0 have an axis"), "{said}");
    assert!(said.contains("none of 1000 plain starts has an axis: no saliency found"), "{said}");
    // Settings that are given are not searched.
    assert!(said.ends_with("    standstill check s.toml\n"), "{said}");
    let some = ["-s", "sensors.noise=1 mA", "-s", "errors=none", "-s", "detector.least_saliency=0.23"];
    let output = standstill(&[&["budget", "s.toml", "--pairs", "360", "--force"][..], &some].concat(), path);
    assert!(!String::from_utf8_lossy(&output.stderr).contains("panicked"), "{output:?}");
    // Most samples are left out: the shares of the rest are doubtful.
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.contains("doubtful, of ") && said.contains("standstill budget s.toml"), "{said}");
    assert!(
        said.contains("enough samples that have an axis\n    standstill budget ")
            && said.contains(" --pairs ")
            && !said.contains("standstill compare"),
        "{said}"
    );
}
