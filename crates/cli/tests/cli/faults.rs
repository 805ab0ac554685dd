//! `standstill faults`, and scenarios with faults.

use std::fs;

use serde_json::Value;

use super::answers::{answer, has, number};
use super::{folder, names, standstill};

mod methods;

const BIPOLAR: &str = "seed = 3\nrotor = { state = \"free\" }\n[detector]\nmethod = \"bipolar\"\n";

/// What a command says, which succeeds.
fn said(arguments: &[&str], folder: &std::path::Path) -> String {
    let output = standstill(arguments, folder);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

/// The words behind the program's name of a command line in which single quotes hold blanks together.
fn words(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    for (number, part) in line.split('\'').enumerate() {
        let mut pieces = if number % 2 == 1 { vec![part] } else { part.split(' ').collect() }.into_iter();
        *words.last_mut().expect("a word") += pieces.next().unwrap_or_default();
        words.extend(pieces.map(str::to_owned));
    }
    words.into_iter().skip(1).filter(|word| !word.is_empty()).collect()
}

/// The row of a fault.
fn row<'a>(answer: &'a Value, fault: &str) -> &'a Value {
    beginning(answer, fault, "before")
}

/// The row of a fault that begins so.
fn beginning<'a>(answer: &'a Value, fault: &str, begins: &str) -> &'a Value {
    let rows = answer["rows"].as_array().expect("rows");
    let is =
        |row: &&Value| row["failure_mode"] == fault && (row["begins"].is_null() || row["begins"] == begins);
    rows.iter().find(is).expect(fault)
}

#[test]
fn law_each_start_of_a_fault_is_counted_once_and_the_worst_can_be_seen() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), BIPOLAR).expect("written");
    let modes = ["phase-open", "terminals-swapped", "current-dead", "current-sign", "lower-switch-open"];
    let modes = modes.iter().flat_map(|mode| ["--mode", mode]);
    let asked = ["faults", "s.toml", "--trials", "60", "--json", "--out", "f"];
    let asked: Vec<&str> = asked.into_iter().chain(modes).collect();
    let found = answer(&asked, 0, path);
    // Three of them may begin on the way, an open wire for 50 µs, too; two wires that are exchanged are so before.
    assert_eq!(found["rows"].as_array().expect("rows").len(), 1 + 5 + 4 + 1);
    for row in found["rows"].as_array().expect("rows") {
        has(row, &["method", "failure_mode", "effect", "wrong_pole_at_most", "coverage", "reasons"]);
        let of = |name: &str| number(row, name);
        assert_eq!(
            of("right") + of("wrong_pole") + of("right_pole_beyond_limit") + of("detected"),
            60.0,
            "{row}"
        );
        assert!(of("dangerous_and_detected") <= of("dangerous_without_checks"));
        assert!(of("wrong_pole_at_most") >= of("wrong_pole") / 60.0);
    }
    // The physics: a whole drive answers; behind an open wire, or a switch that stays open, pulses carry nothing.
    assert!(number(row(&found, "as it is"), "right") >= 58.0);
    for fault in ["phase-open", "lower-switch-open"] {
        let row = row(&found, fault);
        assert_eq!(
            (number(row, "detected"), row["detected_by"].as_str()),
            (60.0, Some("too little current"))
        );
    }
    // Refused whether checks are on or off: coverage has no number, the share of refused starts has: none of 60 is at least 0.05^(1/60).
    let open = row(&found, "phase-open");
    assert_eq!([number(open, "detected_rightly"), number(open, "detected_without_checks")], [60.0; 2]);
    assert!(open["coverage"].is_null() && number(open, "refused_share") == 1.0, "{open}");
    assert!((number(open, "refused_share_at_least") - 0.9513).abs() < 1e-3, "{open}");
    let dead = row(&found, "current-dead");
    assert!(number(dead, "detected_without_checks") < 60.0 && dead["worst_command"].is_null(), "{dead}");
    for of in [open, dead] {
        let [mean, longest] = ["mean_reaction_s", "longest_reaction_s"].map(|name| number(of, name));
        assert!(mean <= longest && longest < 0.1, "{of}");
    }
    // Exchanged wires mirror the angle: standstill cannot tell. The sensors can be told apart from a dead one.
    let swapped = row(&found, "terminals-swapped");
    assert!(number(swapped, "detected") <= 5.0 && number(swapped, "right") <= 5.0, "{swapped}");
    assert!(swapped["detected_rightly"].is_null() && number(swapped, "refused_share_at_least") < 0.1);
    // Each row has the command that shows its worst start, with that error.
    let command = swapped["worst_command"].as_str().expect("a command");
    let shown = said(&words(command).iter().map(String::as_str).collect::<Vec<_>>(), path);
    let shown = shown.split("error ").nth(1).and_then(|rest| rest.split('°').next()).expect("an error");
    let worst = number(swapped, "worst_error_deg");
    assert!((shown.parse::<f64>().expect("a number") - worst).abs() < 0.06, "{shown} {worst}");
    for fault in ["current-dead", "current-sign"] {
        let row = row(&found, fault);
        assert_eq!(number(row, "detected"), 60.0, "{row}");
    }
    // A wire that opens on the way ends with the current of the next pulse through it; one that opened after the last of them is harmless.
    let later = beginning(&found, "phase-open", "during");
    assert!(number(later, "detected") >= 50.0 && number(later, "wrong_pole") == 0.0, "{later}");
    assert!(later["settings"].as_str().expect("keys").contains("faults.0.onset=[0.0, 0.00"), "{later}");
    let briefly = beginning(&found, "phase-open", "50 us");
    assert!(number(briefly, "detected") < number(later, "detected"), "{briefly}");
    assert!(briefly["settings"].as_str().expect("keys").ends_with("faults.0.lasts=0.00005"), "{briefly}");
    assert_eq!(names(&path.join("f")), ["faults.csv", "faults.html", "faults.json"]);
    // The command that shows the worst start runs as it is printed.
    let text =
        said(&["faults", "s.toml", "--trials", "20", "--mode", "terminals-swapped", "--out", "g"], path);
    let line =
        text.lines().find(|line| line.trim().starts_with("standstill trace")).expect("a command").trim();
    let trace = said(&words(line).iter().map(String::as_str).collect::<Vec<_>>(), path);
    assert!(trace.contains("fault"), "{trace}");
    // The command of a fault with a drawn size runs, too, and traces the named start. With all checks no short of these is dangerous.
    let asked = "faults s.toml --trials 60 --mode turns-shorted --begins before --out h -s detector.checks=[\"link\"]";
    let text = said(&asked.split(' ').collect::<Vec<_>>(), path);
    let worst =
        text.split("turns-shorted, ").nth(1).and_then(|rest| rest.split('°').next()).expect("a worst start");
    let line =
        text.lines().find(|line| line.trim().starts_with("standstill trace")).expect("a command").trim();
    let words = [words(line), vec!["--force".to_owned()]].concat();
    let trace = said(&words.iter().map(String::as_str).collect::<Vec<_>>(), path);
    let shown = trace.split("error ").nth(1).and_then(|rest| rest.split('°').next()).expect("an error");
    let [worst, shown] = [worst, shown].map(|degrees| degrees.parse::<f64>().expect("degrees"));
    assert!(line.contains("faults.0.magnitude=[") && (worst - shown).abs() < 0.06, "{line}: {worst} {trace}");
}

/// The scenario's own method is `bipolar`: what is said is about the methods that were asked for, and goes on with one of them.
#[test]
fn regress_methods_of_an_option_stand_in_the_heading_and_in_what_goes_on() {
    let folder = folder();
    let path = folder.path();
    fs::write(
        path.join("pump.toml"),
        super::nameplates::sheet(["5", "0.12 Ω", "180 uH", "260 uH", "12 mWb", "20 A", "48 V", "20 %"]),
    )
    .expect("written");
    let asked = ["faults", "pump.toml", "-s", "detector.method=bipolar", "--method", "maximum-likelihood"];
    let output = standstill(&[&asked[..], &["--mode", "current-gain", "--trials", "6"]].concat(), path);
    let text = String::from_utf8(output.stdout).expect("text");
    assert!(text.starts_with("pump, maximum-likelihood, default errors"), "{text}");
    let next = "standstill odds pump.toml -s detector.method=maximum-likelihood --event wrong-pole";
    assert!(text.contains(next), "{text}");
    // One file, one note.
    let notes = String::from_utf8(output.stderr).expect("text");
    assert_eq!(notes.matches("is a motor, not a scenario").count(), 1, "{notes}");
}

#[test]
fn regress_faults_that_cannot_be_are_refused() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), BIPOLAR).expect("written");
    let wrong = super::mistake(&["faults", "s.toml", "--mode", "phase-opn"], path);
    assert!(wrong.contains("phase-opn") && wrong.contains("phase-open"), "{wrong}");
    // A drive without a capacitor in its link cannot have an aged one, which is said with what it would need.
    // What is not simulated is refused with the reason, and none that only sounds alike is proposed.
    for asked in [
        &["faults", "s.toml", "--mode", "switch-shorted"][..],
        &["run", "s.toml", "-s", "faults.0.mode=switch-shorted"],
    ] {
        let wrong = super::mistake(asked, path);
        let said = wrong.contains("not simulated") && wrong.contains("shorts the DC link");
        assert!(said && !wrong.contains("did you mean") && !wrong.contains("similar"), "{wrong}");
    }
    let asked = ["faults", "s.toml", "--trials", "5", "--mode", "link-capacitor-aged"];
    let found = answer(&[&asked[..], &["--json", "--mode", "phase-open"]].concat(), 0, path);
    assert_eq!(found["not_studied"][0]["mode"], "link-capacitor-aged");
    assert!(found["not_studied"][0]["needed"].as_str().expect("text").contains("inverter.capacitance"));
    // Exchanged wires are so before the detection.
    let asked_later = ["faults", "s.toml", "--mode", "terminals-swapped", "--begins", "during"];
    let wrong = super::mistake(&asked_later, path);
    assert!(wrong.contains("--begins: found during with terminals-swapped"), "{wrong}");
    // Pairs are of faults that are there before: none begins on the way.
    let pairs =
        ["faults", "s.toml", "--mode", "phase-open", "--mode", "link-gain", "--pairs", "--begins", "during"];
    let wrong = super::mistake(&pairs, path);
    assert!(wrong.contains("--pairs: found --begins during, needed before"), "{wrong}");
    // Without a fault that it can have, a pair or a rate there is no answer.
    let wrong = super::mistake(&asked, path);
    assert!(
        wrong.contains("--mode: found link-capacitor-aged") && wrong.contains("inverter.capacitance"),
        "{wrong}"
    );
    for modes in [&["--mode", "phase-open"][..], &["--mode", "phase-open", "--mode", "link-capacitor-aged"]] {
        let wrong = super::mistake(&[&["faults", "s.toml", "--pairs"], modes].concat(), path);
        assert!(wrong.contains("--pairs: found phase-open alone") && wrong.contains("needed two"), "{wrong}");
    }
    fs::write(path.join("rates.toml"), "current-slow = 10\nphase-open = 0\n").expect("written");
    let wrong = super::mistake(&["faults", "s.toml", "--mode", "phase-open", "--rates", "rates.toml"], path);
    assert!(wrong.contains("--rates: found no rate above zero") && wrong.contains("phase-open"), "{wrong}");
    let wrong = super::mistake(&["run", "s.toml", "-s", "faults.0.mode=contact-resistance"], path);
    assert!(wrong.contains("faults[0].magnitude") && wrong.contains("a resistance"), "{wrong}");
}

/// A motor without a magnet has no pole that could be wrong. With exchanged terminals its axis is mirrored, so nearly all answers are
/// wrong; an open wire carries no current and is noticed.
#[test]
fn regress_the_headline_counts_all_dangerous_answers_and_no_poles_where_there_are_none() {
    let folder = folder();
    let path = folder.path();
    let text = |motor: &str, mode: &str, trials: &str, out: &str| {
        said(&["faults", motor, "--mode", mode, "--begins", "before", "--trials", trials, "--out", out], path)
    };
    let swapped = text("reluctance-6k7", "terminals-swapped", "60", "a");
    let rest = swapped.split("Of the one fault 1 has dangerous answers, up to ").nth(1).expect(&swapped);
    let share: f64 = rest.split(" %").next().and_then(|share| share.parse().ok()).expect(&swapped);
    // Of all angles 2° around each of the four mirrored ones are within 2° of their image: 98 %, in sixty starts 94 % or more.
    assert!(share > 90.0 && !swapped.contains("wrong poles") && swapped.contains("no poles"), "{swapped}");
    assert!(swapped.contains("--event '|e| > 2 deg'"), "{swapped}");
    // A fault that the scenario has is none that the study adds.
    let own = ["faults", "paper-5k5", "-s", "faults.0.mode=terminals-swapped", "--mode", "phase-open"];
    let own = said(&[&own[..], &["--trials", "40", "--out", "own"]].concat(), path);
    let alone = "with the scenario's own faults alone";
    assert!(own.matches(alone).count() == 2 && !own.contains("without a fault"), "{own}");
    // None in n shows at most 1 − 0.05^(1/n): 0.1 % from 2,995 on.
    let open = text("paper-5k5", "phase-open", "100", "b");
    for part in [
        "Of the one fault none has a dangerous answer; 1 cannot",
        "--trials 2995 shows",
        "wrong poles: seen with 0 of",
    ] {
        assert!(open.contains(part), "{part}: {open}");
    }
}

/// The threshold of a trip is at rated current by default, and each start goes beyond it: that is so without a fault, too, and no effect
/// of one.
#[test]
fn regress_the_drive_without_a_fault_has_no_effect_and_a_check_has_one_reason() {
    let folder = folder();
    let path = folder.path();
    let turning = "rotor = { state = \"driven\", speed = \"20 rpm\" }\n[detector]\nmethod = \"bipolar\"\n";
    fs::write(path.join("s.toml"), turning).expect("written");
    let asked = ["faults", "s.toml", "--mode", "sheet-inductance", "--trials", "40", "--out", "f"];
    // No start answers: nothing can be said of faults.
    let found = answer(&[&asked[..], &["--json"]].concat(), 3, path);
    let whole = row(&found, "as it is");
    assert!(whole["effect"].is_null() && number(whole, "moved") > 0.0, "{whole}");
    // Forward and backward are one check.
    let turns: Vec<&String> = whole["reasons"]
        .as_object()
        .expect("reasons")
        .keys()
        .filter(|reason| reason.contains("turns"))
        .collect();
    assert_eq!(turns, ["the rotor turns"], "{whole}");
    let effect = row(&found, "sheet-inductance")["effect"].as_str().expect("text");
    assert!(effect.contains("; movement beyond the limit"), "{effect}");
    let output = standstill(&[&asked[..], &["--force"]].concat(), path);
    let text = String::from_utf8(output.stdout).expect("text");
    assert!(text.contains("moved: by more than 1°; current: more than 8 A"), "{text}");
    assert!(
        text.contains("\nNothing to be said of faults, for without a fault no start has an answer\n"),
        "{text}"
    );
}

/// A drive has four faults at once: two of the scenario leave room for pairs, three for single modes, four for none.
#[test]
fn regress_faults_without_room_beside_those_of_the_scenario_are_refused_by_their_keys() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), BIPOLAR).expect("written");
    let own = ["magnet-weak", "sheet-signature", "dead-time-long", "terminals-swapped"];
    let sizes = ["20 %", "", "1.5", ""];
    let keys = |count: usize| -> Vec<String> {
        let key = |k: usize| {
            let size = (!sizes[k].is_empty()).then(|| format!("faults.{k}.magnitude={}", sizes[k]));
            [Some(format!("faults.{k}.mode={}", own[k])), size].into_iter().flatten()
        };
        (0..count).flat_map(key).flat_map(|pair| ["-s".to_owned(), pair]).collect()
    };
    let asked = |count: usize, more: &[&'static str]| -> Vec<String> {
        let modes =
            ["faults", "s.toml", "--mode", "current-sign", "--mode", "currents-swapped", "--trials", "4"];
        let modes = [&modes[..], &["--begins", "before"]].concat();
        modes.iter().chain(more).map(|word| (*word).to_owned()).chain(keys(count)).collect()
    };
    let refused = |count: usize, more: &[&'static str]| {
        let all = asked(count, more);
        super::mistake(&all.iter().map(String::as_str).collect::<Vec<_>>(), path)
    };
    let three = refused(3, &["--pairs"]);
    for part in [
        "3 of the scenario",
        "faults.2.mode = dead-time-long",
        "two more by --pairs",
        "4 at most",
        "take out 1",
        "without --pairs",
    ] {
        assert!(three.contains(part), "{part}: {three}");
    }
    let four = refused(4, &[]);
    assert!(
        four.contains("4 of the scenario") && four.contains("one more") && !four.contains("--pairs"),
        "{four}"
    );
    for (count, more, rows) in
        [(2, &["--pairs", "--json", "--out", "two"][..], 4), (3, &["--json", "--out", "three"], 3)]
    {
        let all = asked(count, more);
        let found = answer(&all.iter().map(String::as_str).collect::<Vec<_>>(), 0, path);
        assert_eq!(found["rows"].as_array().expect("rows").len(), rows, "{found}");
    }
}

#[test]
fn law_pairs_of_faults_are_studied_on_request() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), BIPOLAR).expect("written");
    fs::write(path.join("rates.toml"), "phase-open = 30\ncurrent-sign = 5\n").expect("written");
    let modes = ["--mode", "terminals-swapped", "--mode", "sheet-signature", "--mode", "current-sign"];
    let asked =
        ["faults", "s.toml", "--trials", "40", "--pairs", "--rates", "rates.toml", "--json", "--out", "f"];
    let asked: Vec<&str> = asked.into_iter().chain(["--begins", "before"]).chain(modes).collect();
    let found = answer(&asked, 0, path);
    let named: Vec<&str> = found["rows"]
        .as_array()
        .expect("rows")
        .iter()
        .filter_map(|row| row["failure_mode"].as_str())
        .collect();
    let pairs = [
        "terminals-swapped + sheet-signature",
        "terminals-swapped + current-sign",
        "sheet-signature + current-sign",
    ];
    assert_eq!(
        named,
        [&["as it is", "terminals-swapped", "sheet-signature", "current-sign"], &pairs[..]].concat()
    );
    // The physics: exchanged wires mirror the angle, and the wrong signature turns each answer by half a turn, so it takes those of the
    // mirrored angle that are right for wrong and the others for right.
    let [swapped, both] = [named[1], pairs[0]].map(|fault| row(&found, fault));
    let answered = |row: &Value| 40.0 - number(row, "detected");
    let wrong = |row: &Value| number(row, "wrong_pole");
    assert!((wrong(swapped) + wrong(both) - answered(both)).abs() <= 2.0, "{swapped} {both}");
    assert!(wrong(swapped) > 8.0 && wrong(both) > 8.0, "{swapped} {both}");
    // A sensor of the wrong sign is noticed, whatever else is wrong.
    for fault in &pairs[1..] {
        assert_eq!(number(row(&found, fault), "detected"), 40.0, "{fault}");
    }
    // Rates are those of single faults: how often two come together no rate of one tells.
    assert!(row(&found, pairs[1])["rate"].is_null() && number(row(&found, "current-sign"), "rate") == 5.0);
    let keys = row(&found, pairs[1])["settings"].as_str().expect("keys");
    assert_eq!(keys, "faults.0.mode=terminals-swapped faults.1.mode=current-sign");
}

#[test]
fn law_failure_rates_weigh_what_modes_lead_to() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), BIPOLAR).expect("written");
    fs::write(path.join("rates.toml"), "phase-open = 30\n\"terminals-swapped\" = 10.0\ncurrent-dead = 5\n")
        .expect("written");
    let modes = ["--mode", "phase-open", "--mode", "terminals-swapped", "--mode", "current-sign"];
    let asked = ["faults", "s.toml", "--trials", "40", "--rates", "rates.toml", "--json", "--out", "f"];
    let asked: Vec<&str> = asked.into_iter().chain(modes).collect();
    let found = answer(&asked, 0, path);
    let swapped = row(&found, "terminals-swapped");
    assert_eq!(number(swapped, "rate"), 10.0);
    let bound = number(swapped, "wrong_pole_rate_at_most");
    assert!((bound - 10.0 * number(swapped, "wrong_pole_at_most")).abs() < 1e-12, "{swapped}");
    assert!(row(&found, "as it is")["rate"].is_null() && row(&found, "current-sign")["rate"].is_null());
    let text: Vec<&str> = asked.iter().copied().filter(|word| *word != "--json").collect();
    let text = said(&text[..text.len()], path);
    // No sum has more than three digits: rates are seldom known better.
    let sums =
        text.split("weighted, bipolar: ").nth(1).and_then(|rest| rest.split('\n').next()).expect(&text);
    let digits = |word: &str| {
        word.chars().filter(char::is_ascii_digit).collect::<String>().trim_start_matches('0').len()
    };
    assert!(sums.split(' ').all(|word| word == "95" || digits(word) <= 3), "{sums}");
    // All starts behind an open wire, and none with exchanged ones but by chance, end without an answer: 30 to 40 of 40.
    assert!(
        text.contains("weighted, bipolar: of 40, ") && text.contains("the sum of the 95 % bounds"),
        "{text}"
    );
    assert!(text.contains("not studied, left out of the sums: current-dead"), "{text}");
    assert!(text.contains("modes without a rate, left out of the sums: current-sign"), "{text}");
    for (rates, key) in
        [("phase-opn = 3\n", "phase-opn"), ("\nphase-open = -3\n", "phase-open"), ("", "phase-open")]
    {
        fs::write(path.join("wrong.toml"), rates).expect("written");
        let wrong = super::mistake(&["faults", "s.toml", "--rates", "wrong.toml"], path);
        assert!(wrong.contains("wrong.toml") && wrong.contains(key) && wrong.contains("needed"), "{wrong}");
        let line = if rates.starts_with('\n') { "line 2" } else { "" };
        assert!(wrong.contains(line), "{wrong}");
    }
}
