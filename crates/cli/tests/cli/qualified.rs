//! `standstill qualify`: lists of requirements, with their evidence.

use std::fs;
use std::path::Path;

use serde_json::Value;

use super::answers::{answer, has, number};
use super::{folder, mistake, names, standstill};

const BIPOLAR: &str = "seed = 3\nrotor.state = \"free\"\ndetector.method = \"bipolar\"\n";

/// Ten requirements: one fails, one is not shown, and an id is hostile to XML and HTML.
const LIST: &str = r#"
confidence = "90 %"
trials = 700
odds = "off"

[[requirement]]
id = "POLE-1"
text = "The motor does not start backwards."
limit = "P(wrong_pole) <= 2 %"

[[requirement]]
id = "POLE-2"
text = "It does not do so once in a million starts either."
limit = "P(wrong_pole) <= 1e-6"

[[requirement]]
id = "ANSWER <&\"'>"
text = "It starts. </td><script>"
limit = "P(undetermined) <= 3 %"

[[requirement]]
id = "ANGLE-1"
text = "Most angles are good, with the sensors of a bench too."
limit = "p95 <= 3 deg"
errors = ["default", "field"]

[[requirement]]
id = "ANGLE-2"
text = "The angle is good."
limit = "rms <= 9 deg"

[[requirement]]
id = "ANGLE-3"
text = "No start is far off."
limit = "P(|e| > 5 deg) <= 2 %"

[[requirement]]
id = "MOVE"
text = "The rotor stays."
limit = "moved <= 2 deg"

[[requirement]]
id = "CURRENT"
text = "The inverter bears it."
limit = "current <= 1.5 rated"

[[requirement]]
id = "TIME"
text = "It is quick."
limit = "time <= 2 ms"

[[requirement]]
id = "SENSOR"
text = "A dead sensor is noticed."
limit = "faults.current-dead: coverage >= 90 %"
trials = 200
"#;

fn write(path: &Path, list: &str) {
    fs::write(path.join("s.toml"), BIPOLAR).expect("written");
    fs::write(path.join("r.toml"), list).expect("written");
}

fn requirement<'a>(found: &'a Value, id: &str) -> &'a Value {
    let all = found["requirements"].as_array().expect("a list");
    all.iter().find(|requirement| requirement["id"] == id).expect(id)
}

#[test]
fn law_ten_requirements_are_passed_but_one_that_fails_and_one_that_is_not_shown() {
    let folder = folder();
    let path = folder.path();
    write(path, LIST);
    let asked = ["qualify", "s.toml", "r.toml", "--no-witness", "--json", "--out", "q"];
    let found = answer(&asked, 1, path);
    let hostile = "ANSWER <&\"'>";
    for (id, verdict) in [
        ("POLE-1", "passed"),
        ("POLE-2", "not shown"),
        (hostile, "passed"),
        ("ANGLE-1", "passed"),
        ("ANGLE-2", "passed"),
        ("ANGLE-3", "passed"),
        ("MOVE", "passed"),
        ("CURRENT", "passed"),
        ("TIME", "failed"),
        ("SENSOR", "passed"),
    ] {
        assert_eq!(requirement(&found, id)["verdict"], verdict, "{}", requirement(&found, id));
    }
    assert_eq!(found["verdict"], "failed");
    // Both wrong-pole limits are guarded by the share of answers, and one requirement has two cases.
    assert_eq!(number(&found, "claims"), 13.0);
    for requirement in found["requirements"].as_array().expect("a list") {
        for claim in requirement["claims"].as_array().expect("a list") {
            has(claim, &["case", "low", "high", "trials", "of", "error_probability"]);
            assert!((number(claim, "error_probability") - 0.1 / 13.0).abs() < 1e-15);
            let (high, most) = (number(claim, "high"), number(claim, "at_most"));
            assert_eq!(claim["verdict"] == "passed", high <= most, "{claim}");
        }
    }
    // What to do next: how many trials would do; a start that fails; each command runs as it is printed.
    let next = requirement(&found, "POLE-2")["next"].as_str().expect("text");
    let shows = "some 6,200,000 would show it if they go on so: set trials = 7400000 for it in r.toml";
    assert!(next.contains("POLE-2 is not shown by 700 trials") && next.contains(shows), "{next}");
    let command = requirement(&found, "TIME")["next_command"].as_str().expect("text");
    assert!(command.starts_with("standstill trace s.toml --trial 0 --out trace-TIME"), "{command}");
    let words: Vec<&str> = command.split(' ').skip(1).collect();
    assert!(standstill(&words, path).status.success(), "{command}");
    let repeats = requirement(&found, "ANGLE-2")["repeats"].as_str().expect("text");
    assert_eq!(repeats, "standstill qualify s.toml r.toml --only ANGLE-2 --no-witness --out qualify-ANGLE-2");
    let words: Vec<&str> = repeats.split(' ').skip(1).chain(["--json"]).collect();
    let again = answer(&words, 0, path);
    assert_eq!(requirement(&again, "ANGLE-2"), requirement(&found, "ANGLE-2"), "alone as in the list");
    files(path, &found);
}

/// Checks the files beside the answer.
fn files(path: &Path, found: &Value) {
    let expected = ["qualify-junit.xml", "qualify-sign.html", "qualify.csv", "qualify.html", "qualify.json"];
    assert_eq!(names(&path.join("q")), expected);
    let manifest = &found["manifest"];
    for digest in
        [&manifest["program"]["digest"], &manifest["scenario"]["digest"], &manifest["requirements"]["digest"]]
    {
        assert!(digest.as_str().is_some_and(|text| text.contains("CRC-32")), "{manifest}");
    }
    assert_eq!(manifest["seed"], 3);
    assert!(manifest["machine"]["processor"].as_str().is_some_and(|name| !name.is_empty()));
    let annex = &found["annex"];
    assert!(annex["not_modelled"].as_array().is_some_and(|list| list.len() > 5));
    let assumed = annex["assumed"].as_array().expect("a list");
    assert!(assumed.iter().all(|row| row["motor"] == "paper-5k5") && !assumed.is_empty());
    let xml = fs::read_to_string(path.join("q/qualify-junit.xml")).expect("a file");
    let xml = roxmltree::Document::parse(&xml).expect("XML");
    let suite = xml.root_element();
    let attribute = |name: &str| suite.attribute(name).expect("an attribute");
    assert_eq!((attribute("tests"), attribute("failures"), attribute("errors")), ("10", "1", "1"));
    let case = |name: &str| xml.descendants().find(|node| node.attribute("name") == Some(name)).expect(name);
    assert!(case("ANSWER <&\"'>").children().all(|node| !node.has_tag_name("failure")));
    assert!(case("TIME").children().any(|node| node.has_tag_name("failure")));
    assert!(case("POLE-2").children().any(|node| node.has_tag_name("error")));
    let sign = fs::read_to_string(path.join("q/qualify-sign.html")).expect("a file");
    assert!(sign.contains("&lt;script&gt;") && !sign.contains("<script"), "as it is written");
    for part in ["Name", "Date", "Signature", "not shown", "CRC-32", "not heard"] {
        assert!(sign.contains(part), "{part}");
    }
    let csv = fs::read_to_string(path.join("q/qualify.csv")).expect("a file");
    assert_eq!(csv.lines().count(), 14);
}

/// promise: qualify-exit-codes
#[test]
fn law_exit_codes_say_whether_all_passed() {
    let folder = folder();
    let path = folder.path();
    let list = |limit: &str| {
        format!(
            "odds = \"off\"\ntrials = 100\n[[requirement]]\nid = \"A\"\ntext = \"…\"\nlimit = \"{limit}\"\n"
        )
    };
    for (limit, code, part) in [
        ("P(undetermined) <= 20 %", 0, "1 of 1 requirements passed"),
        ("time <= 1 ms", 1, "1 failed"),
        ("P(undetermined) <= 0.1 %", 3, "1 not shown"),
        ("faults.phase-open: coverage >= 90 %", 3, "faults.phase-open: P(wrong_pole) <= 0.1 %"),
    ] {
        write(path, &list(limit));
        let output =
            standstill(&["qualify", "s.toml", "r.toml", "--no-witness", "--force", "--out", "q"], path);
        let text = String::from_utf8(output.stdout).expect("text");
        assert_eq!(output.status.code(), Some(code), "{limit}: {text}");
        assert!(text.contains(part), "{text}");
    }
}

/// Odds whose interval has the limit inside decide nothing; those of four times as many states have half of it.
#[test]
fn regress_odds_that_decide_nothing_name_their_next_effort() {
    let folder = folder();
    let path = folder.path();
    // 1.4 % of the starts draw more.
    let list = "odds = \"quick\"\ntrials = 64\n[[requirement]]\nid = \"A\"\ntext = \"…\"\nlimit = \"P(current > 5.15 A) <= 1.2 %\"\n";
    write(path, list);
    let found = answer(&["qualify", "s.toml", "r.toml", "--no-witness", "--json", "--out", "q"], 3, path);
    let of = requirement(&found, "A");
    assert_eq!(of["verdict"], "not shown", "{of}");
    let (next, command) = (of["next"].as_str().expect("text"), of["next_command"].as_str().expect("text"));
    assert!(next.contains("with more effort (odds = \"normal\" in r.toml judges by them)"), "{next}");
    assert_eq!(command, "standstill odds s.toml --event 'peak_current > 5.15 A' --effort normal");
    // The annex has the conditions in which the event happens: at some angles, and with draws away from their mean.
    let triggers = found["annex"]["triggering_conditions"].as_array().expect("a list");
    assert!(!triggers.is_empty());
    let page = fs::read_to_string(path.join("q/qualify.html")).expect("a page");
    for trigger in triggers {
        assert_eq!(trigger["event"], "peak_current > 5.15 A");
        let [angles, draws] = ["angles", "draws"].map(|part| trigger[part].as_str().expect("text"));
        assert!(angles.contains("° to ") && page.contains(angles), "{angles}");
        assert!(draws.contains(" σ") && page.contains(draws), "{draws}");
    }
}

/// Noise of 60 mA fails by more than 10 mA, whichever is named first; of one requirement alone no command repeats what was just run.
#[test]
fn regress_a_row_has_the_worst_of_its_cases_and_their_number() {
    let folder = folder();
    let path = folder.path();
    let list = "odds = \"off\"\n[[requirement]]\nid = \"A\"\ntext = \"…\"\nlimit = \"p95 <= 1 deg\"\n\
                over.\"sensors.noise\" = [\"45 mA\", \"60 mA\", \"1 mA\"]\n\
                [[requirement]]\nid = \"B\"\ntext = \"…\"\nlimit = \"time <= 1 s\"\n";
    write(path, list);
    let said = |more: &[&str], out: &str| {
        let asked = ["qualify", "s.toml", "r.toml", "--no-witness", "--out", out];
        let output = standstill(&[&asked[..], more].concat(), path);
        assert_eq!(output.status.code(), Some(1));
        String::from_utf8(output.stdout).expect("text").split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let text = said(&[], "q");
    assert!(text.contains("2 of 3 cases failed, the worst:"), "{text}");
    assert!(text.contains("sensors.noise=60 mA") && !text.contains("sensors.noise=45 mA"), "{text}");
    assert!(text.contains("--only A --no-witness"), "the one that failed: {text}");
    assert!(!said(&["--only", "A"], "one").contains("--only A --no-witness"));
}

/// The motor's saturation is not known, so its poles are open; the printed command finds its file.
#[test]
fn regress_the_command_about_open_poles_finds_the_motors_file() {
    let folder = folder();
    let path = folder.path();
    let sheet =
        super::nameplates::sheet(["4", "69 mΩ", "1.6 mH", "3.5 mH", "0.155 Wb", "100 A", "500 V", ""]);
    fs::create_dir(path.join("sub")).expect("a folder");
    fs::write(path.join("sub/open.toml"), sheet).expect("written");
    fs::write(path.join("sub/s.toml"), "motor = \"open.toml\"\ndetector.method = \"bipolar\"\n")
        .expect("written");
    let one = "odds = \"off\"\ntrials = 64\n[[requirement]]\nid = \"A\"\ntext = \"…\"\nlimit = \"faults.phase-open: P(wrong_pole) <= 20 %\"\n";
    fs::write(path.join("r.toml"), one).expect("written");
    let found = answer(&["qualify", "sub/s.toml", "r.toml", "--no-witness", "--json", "--out", "a"], 3, path);
    let command = requirement(&found, "A")["next_command"].as_str().expect("a command");
    assert_eq!(command, "standstill magnetics sub/open.toml");
    let words: Vec<&str> = command.split(' ').skip(1).collect();
    assert!(standstill(&words, path).status.success(), "{command}");
    // Nor has such an event odds.
    let refused = mistake(&["odds", "sub/s.toml", "--event", "wrong-pole"], path);
    assert!(refused.contains("--event wrong-pole") && refused.contains("leave its poles open"), "{refused}");
}

/// promise: qualify-exit-codes
#[test]
fn regress_lists_with_mistakes_are_refused_by_line() {
    let folder = folder();
    let path = folder.path();
    let one = |limit: &str, more: &str| {
        format!("[[requirement]]\nid = \"A\"\ntext = \"…\"\nlimit = \"{limit}\"\n{more}\n")
    };
    let asked = ["qualify", "s.toml", "r.toml", "--no-witness"];
    for (list, parts) in [
        (
            one("rms < 1 deg", ""),
            &["r.toml: line 4", "requirement[0].limit", "found `rms < 1 deg`", "rms <= 1 deg"][..],
        ),
        (
            one("rms <= 1 deg", "motor = [\"gimbal\"]"),
            &["r.toml: line 5", "requirement[0].motor", "did you mean `motors`"],
        ),
        (
            one("rms <= 1 deg", "motors = [\"gimbl\"]"),
            &["r.toml: line 5", "requirement[0].motors", "gimbl", "gimbal"],
        ),
        (
            one("faults.phase-opn: coverage >= 9 %", ""),
            &["r.toml: line 4", "phase-opn", "did you mean `phase-open`"],
        ),
        (
            one("rms <= 1 deg", "") + &one("rms <= 1 deg", ""),
            &["r.toml: line 7", "requirement[1].id", "which requirement 1 has"],
        ),
        ("[[requirement]\n".to_owned(), &["r.toml: line 1"]),
    ] {
        write(path, &list);
        let message = mistake(&asked, path);
        assert!(parts.iter().all(|part| message.contains(part)), "{message}");
    }
    write(path, &one("rms <= 1 deg", ""));
    let message = mistake(&[&asked[..], &["--only", "B"]].concat(), path);
    assert!(message.contains("--only: found `B`, needed an id of r.toml: A"), "{message}");
    assert!(mistake(&["qualify", "s.toml", "none.toml"], path).contains("cannot read none.toml"));
    assert!(!path.join("standstill-out").exists(), "nothing is written");
}
