//! What `check` says where no settings suffice, and whether the commands that it prints are accepted.

use std::fs;
use std::path::Path;
use std::process::Output;

use serde_json::Value;

use super::nameplates::sheet;
use super::{folder, standstill};

/// 7 pole pairs at 48 V, whose pole takes rated current.
const M48: [&str; 8] = ["7", "21 mΩ", "16 uH", "20 uH", "5.2 mWb", "60 A", "48 V", "5 %"];
const BIPOLAR: [&str; 2] = ["-s", "detector.method=bipolar"];

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).split_whitespace().collect::<Vec<_>>().join(" ")
}

fn answer(arguments: &[&str], at: &Path) -> Value {
    let output = standstill(&[arguments, &["--json"]].concat(), at);
    serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|error| panic!("{error}: {}", String::from_utf8_lossy(&output.stderr)))
}

/// The words of a printed command behind the program's name; quotes are those of a shell.
fn words(command: &str) -> Vec<String> {
    let (mut words, mut quoted) = (vec![String::new()], false);
    for c in command.chars() {
        match c {
            '\'' => quoted = !quoted,
            ' ' if !quoted => words.push(String::new()),
            c => words.last_mut().expect("a word").push(c),
        }
    }
    assert_eq!(words.remove(0), "standstill", "{command}");
    words
}

/// Words behind a command.
type More = fn(&str) -> &'static [&'static str];

/// Runs each command that an answer names with more words; none is refused.
fn accepted(answer: &Value, at: &Path, more: More) -> Vec<(String, Output)> {
    let next = answer["next"].as_array().expect("a list");
    assert!(!next.is_empty(), "{answer}");
    let run = |command: &Value| {
        let command = command.as_str().expect("a command");
        let mut words = words(command);
        words.extend(more(command).iter().map(|word| (*word).to_owned()));
        if words[0] == "run" {
            words.extend(["--trials", "8", "--out", "went-on", "--force"].map(str::to_owned));
        }
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let output = standstill(&words, at);
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(matches!(output.status.code(), Some(0 | 1)), "{command}: {stderr}");
        (command.to_owned(), output)
    };
    next.iter().map(run).collect()
}

#[test]
fn regress_each_printed_command_of_an_unsuited_motor_is_accepted() {
    // Settings that are given leave nothing to search. The command that gives them back to the search is read and not carried out.
    fn read(command: &str) -> &'static [&'static str] {
        if command.contains("detector.pulse") { &[] } else { &["--help"] }
    }
    printed_commands_suffice(&[(&GIVEN, "rotor.state=locked")], read);
}

const GIVEN: [&str; 6] = ["--movement", "0.002", "-s", "detector.rounds=3", "-s", "detector.pulse=34us"];

#[test]
#[ignore = "two motors more on drives that do not suffice: scripts/test-all.sh long"]
fn regress_each_printed_command_of_more_unsuited_motors_is_accepted() {
    let cases: [(&[&str], &str); 3] = [
        (&GIVEN, "rotor.state=locked"),
        (&["--current", "27"], "--current 60"),
        (&["-s", "sensors.bits=5", "-s", "rotor.state=free"], "sensors.bits=16"),
    ];
    printed_commands_suffice(&cases, |_| &[]);
}

/// Each command that `check` prints of a motor with these options is accepted, and suffices if it says so; one of them contains a text.
fn printed_commands_suffice(cases: &[(&[&str], &str)], further: More) {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("m48.toml"), sheet(M48)).expect("written");
    let mut held = Vec::new();
    for (more, expected) in cases {
        let asked = [&["check", "m48.toml"][..], &BIPOLAR, *more].concat();
        let answer = answer(&asked, at);
        assert_eq!(
            (&answer["suited"], &answer["verdict"]),
            (&false.into(), &"not-suited".into()),
            "{answer}"
        );
        let commands = accepted(&answer, at, further);
        assert!(commands.iter().any(|(command, _)| command.contains(expected)), "{commands:?}");
        for (command, output) in &commands {
            // No option and no key stands twice.
            for name in ["--current", "--movement", "--tolerance", "rotor.state=", "sensors.bits="] {
                assert!(command.matches(name).count() < 2, "{command}");
            }
            // Each change that is said to suffice does suffice. The last command gives fixed settings back to the search.
            let is_freed = more.contains(&"detector.rounds=3") && !command.contains("detector.rounds");
            assert!(!is_freed || command == &commands[commands.len() - 1].0, "{commands:?}");
            held.push((is_freed || output.status.code() == Some(0), command.clone()));
        }
    }
    assert!(held.iter().all(|(held, _)| *held), "{held:?}");
}

#[test]
fn law_no_verdict_ends_without_a_next_step() {
    // A search that a command begins takes seconds: the command is read and not carried out.
    no_verdict_ends(&["-s", "detector.rounds=3", "-s", "detector.pulse=34us"], |command| {
        if command.starts_with("standstill check ") { &["--help"] } else { &[] }
    });
}

#[test]
#[ignore = "searches that the printed commands begin: scripts/test-all.sh long"]
fn law_commands_behind_a_verdict_are_carried_out() {
    no_verdict_ends(&[], |_| &[]);
}

/// Verdicts of three motors, one of which is asked about with these settings; their commands with more words.
fn no_verdict_ends(given: &[&str], more: More) {
    let folder = folder();
    let at = folder.path();
    let motors = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/motors"));
    fs::copy(motors.join("servo-2310.toml"), at.join("servo.toml")).expect("copied");
    let linear = ["7", "21 mΩ", "16 uH", "20 uH", "5.2 mWb", "60 A", "48 V", "0 %"];
    fs::write(at.join("linear.toml"), sheet(linear)).expect("written");
    // One inductance for both axes.
    let asked = [&["check", "servo.toml"][..], &BIPOLAR].concat();
    let one = answer(&asked, at);
    assert_eq!((&one["suited"], &one["verdict"]), (&false.into(), &"cannot-be-judged".into()), "{one}");
    let commands = accepted(&one, at, more);
    assert!(commands[0].0.contains("-s 'motor.nameplate.L_q="), "{commands:?}");
    let text = said(&standstill(&asked, at));
    let head = "servo-2310: detection of the rotor's axis at standstill cannot be judged: the data sheet gives one inductance";
    assert!(text.starts_with(head) && text.contains("Measure L_d and L_q"), "{text}");
    // Poles that draw the same current: the axis alone, or a rotor that is turned.
    let asked = [&["check", "linear.toml"][..], &BIPOLAR].concat();
    let alike = answer(&[&asked, given].concat(), at);
    assert_eq!((&alike["suited"], &alike["verdict"]), (&false.into(), &"not-suited".into()), "{alike}");
    let ways: Vec<&Value> =
        alike["alternatives"].as_array().expect("a list").iter().map(|of| &of["way"]).collect();
    assert!(ways.contains(&&"axis-alone".into()), "{alike}");
    accepted(&alike, at, more);
    let output = standstill(&[&asked, &["-s", "detector.pulse=20us"][..]].concat(), at);
    let text = said(&output);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.starts_with("linear: NOT suited to detection of the rotor position"), "{text}");
    assert!(text.contains("Hall sensor") && !text.contains("were tried. Nor"), "{text}");
    // A sixteenth of rated current shows no pole: rated current does.
    let weak = ["check", "paper-5k5", "--current", "0.5", "-s", "detector.rounds=3"];
    let weak = answer(&[&weak[..], &BIPOLAR].concat(), at);
    let next = weak["next"].as_array().expect("a list");
    assert!(next.iter().any(|of| of.as_str().is_some_and(|of| of.ends_with("--current 8"))), "{weak}");
}

#[test]
fn regress_what_one_number_of_saturation_implies_is_not_laid_at_the_sheets_door() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("m48.toml"), sheet(M48)).expect("written");
    let given = ["-s", "detector.rounds=3", "-s", "detector.pulse=34us"];
    let text = said(&standstill(&[&["check", "m48.toml"][..], &BIPOLAR, &given].concat(), at));
    assert!(!text.contains("as the data sheet itself says"), "{text}");
    let inferred = "along −d L_d grows by 2.24 % at rated current, inferred from its fall along +d by iron that saturates alike either way; the fall of L_q is not given: it is taken as unchanged";
    assert!(text.contains(inferred), "{text}");
}

/// The states of the rotor that `check` judges are its own: a file in which something drives the rotor is judged all the same.
#[test]
fn regress_a_driven_rotor_is_no_reason_to_refuse() {
    let folder = folder();
    let at = folder.path();
    fs::write(
        at.join("driven.toml"),
        "motor = \"paper-5k5\"\n[rotor]\nstate = \"driven\"\nspeed = \"1 rpm\"\nacceleration = \"60 rpm/s\"\n",
    )
    .expect("written");
    let few = ["-s", "detector.pulse=200us", "-s", "detector.rounds=3"];
    let asked = [&["check", "driven.toml"][..], &BIPOLAR, &few].concat();
    assert_eq!(answer(&asked, at)["verdict"], "suited");
    let text = said(&standstill(&asked, at));
    assert!(text.contains("Speed: the scenario's rotor.speed, 1 rpm, is left out"), "{text}");
    // A brake is judged without that speed, too, and the scenario's own motion if it is asked for.
    let held = [&asked[..], &["-s", "rotor.state=locked", "--effort", "quick"]].concat();
    assert_eq!(answer(&held, at)["verdict"], "suited");
    let own = [&asked[..], &["-s", "rotor.state=driven", "--effort", "quick"]].concat();
    assert!(!said(&standstill(&own, at)).contains("is left out"));
}

#[test]
fn regress_a_given_pulse_is_left_to_the_search_by_one_command() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("m48.toml"), sheet(M48)).expect("written");
    let given = [&["check", "m48.toml"][..], &BIPOLAR, &["-s", "detector.pulse=12us"]].concat();
    let found = answer(&given, at);
    assert_eq!(
        found["next"],
        serde_json::json!(["standstill check m48.toml -s detector.method=bipolar"]),
        "{found}"
    );
    assert_eq!(found["advice"][0]["frees"], serde_json::json!(["pulse"]), "{found}");
    let text = said(&standstill(&given, at));
    assert!(
        text.contains("`detector.pulse` was as given") && text.contains("the given pulse binds"),
        "{text}"
    );
}

#[test]
fn regress_a_signature_that_contradicts_the_motor_is_named() {
    let folder = folder();
    let few = ["-s", "detector.pulse=200us", "-s", "detector.rounds=3", "--effort", "quick"];
    let wrong = ["-s", "detector.signature=inverted"];
    let output = standstill(&[&["check", "paper-5k5"][..], &BIPOLAR, &few, &wrong].concat(), folder.path());
    let text = said(&output);
    assert!(text.contains("Signature: detector.signature is \"inverted\""), "{text}");
    let warned = String::from_utf8_lossy(&output.stderr);
    assert!(warned.contains("without this key the signature is the motor's"), "{warned}");
}

/// A check that only `bipolar` has.
const CONTACT: [&str; 2] = ["-s", "detector.checks=[\"contact\"]"];

#[test]
fn regress_methods_without_a_setting_are_named_where_they_are_left_out() {
    let folder = folder();
    let at = folder.path();
    let few = ["-s", "detector.pulse=200us", "-s", "detector.rounds=3", "--effort", "quick"];
    let asked = [&["check", "paper-5k5"][..], &CONTACT, &few].concat();
    let found = answer(&asked, at);
    let left: Vec<(&str, &str)> = found["left_out"]
        .as_array()
        .expect("a list")
        .iter()
        .map(|of| (of["method"].as_str().expect("a name"), of["lacks"].as_str().expect("text")))
        .collect();
    // Those that find no readings on this drive, whatever is checked, are not named.
    let names: Vec<&str> = left.iter().map(|(method, _)| *method).collect();
    let others =
        ["maximum-likelihood", "maximum-likelihood-adaptive", "line-inductance-fast", "hfi-rotating"];
    assert_eq!(names, others, "{found}");
    assert!(left.contains(&("maximum-likelihood", "the check \"contact\" of `detector.checks`")), "{left:?}");
    let text = said(&standstill(&asked, at));
    let sentence =
        "Left out, as methods without the check \"contact\" of `detector.checks`: maximum-likelihood";
    assert!(text.contains(sentence), "{text}");
    // A comparison names them below its table, and on standard error beside its JSON.
    let asked =
        ["compare", "--trials", "4", "--rotor", "locked", "--errors", "none", "--no-limit", "--out", "c"];
    let text = said(&standstill(&[&asked[..], &CONTACT].concat(), at));
    let sentence =
        "Left out, as methods without the check \"contact\" of `detector.checks`: line-inductance,";
    assert!(
        text.contains(sentence) && text.contains("Without it, those that lack no other setting are tried."),
        "{text}"
    );
    let output = standstill(&[&asked[..8], &CONTACT, &["--json"]].concat(), at);
    let rows: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert!(rows.as_array().expect("rows").iter().all(|row| row["method"] == "bipolar"), "{rows}");
    let told = String::from_utf8_lossy(&output.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(told.contains(sentence), "{told}");
    // Where nothing is set, nothing is left out.
    let output = standstill(&[&asked[..], &["--method", "bipolar", "--force"]].concat(), at);
    assert!(!said(&output).contains("Left out"), "{}", said(&output));
}

/// In a third of its starts a motor of little saliency has no angle by this method as it is set.
#[test]
fn regress_a_run_whose_starts_have_no_answer_says_what_to_do_next() {
    let folder = folder();
    let at = folder.path();
    let asked = ["run", "drone-u8", "--trials", "60", "-s", "detector.method=bipolar", "-s", "seed=1"];
    let text = said(&standstill(&asked, at));
    let next = "of 60 starts have no answer (no saliency";
    assert!(text.contains(next), "{text}");
    assert!(text.ends_with("Whether other settings answer: standstill check drone-u8 -s seed=1"), "{text}");
    // With a fault the answer lies in the starts themselves.
    let broken = [&asked[..], &["-s", "faults.0.mode=phase-open", "--out", "broken"]].concat();
    let text = said(&standstill(&broken, at));
    assert!(
        text.contains(
            "60 of 60 starts have no answer (too little current). Why: standstill explain broken --unanswered"
        ),
        "{text}"
    );
    let explained = said(&standstill(&["explain", "broken", "--unanswered", "--worst", "1"], at));
    assert!(
        explained.contains("failed: too little current")
            && explained.contains("standstill trace drone-u8 -s"),
        "{explained}"
    );
    // A page on these starts becomes older than its run as others do.
    let longer = ["--trials", "62", "--resume"];
    let text = said(&standstill(&[&broken[..2], &broken[4..], &longer].concat(), at));
    assert!(
        text.contains("explain/unanswered-1/explain.html, which is older")
            && text.contains("standstill explain broken --unanswered --worst 1 --force"),
        "{text}"
    );
    // One that answers has nothing to look for.
    let text =
        said(&standstill(&["run", "paper-5k5", "--trials", "60", "-s", "detector.method=bipolar"], at));
    assert!(!text.contains("no answer"), "{text}");
}

/// A flux in Wb for mWb: the doubt stands on standard error before the search, and among what `check` says of the motor.
#[test]
fn regress_check_names_a_doubtful_number_in_its_answer_and_before_it() {
    let folder = folder();
    let at = folder.path();
    let sheet = super::nameplates::sheet(["7", "21 mΩ", "16 uH", "20 uH", "5.2 Wb", "60 A", "48 V", "5 %"]);
    fs::write(at.join("m.toml"), sheet).expect("written");
    let output = standstill(&["check", "m.toml", "-s", "detector.method=bipolar", "--effort", "quick"], at);
    let heard = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(heard.contains("warning: ") && heard.contains("did you mean magnet_flux 5.2 mWb?"), "{heard}");
    let text = said(&output);
    assert!(
        text.contains("Doubtful numbers") && text.contains("did you mean magnet_flux 5.2 mWb?"),
        "{text}"
    );
}

#[test]
fn law_where_the_link_drives_no_more_current_a_higher_link_is_tried() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("m48.toml"), sheet(M48)).expect("written");
    // At 1.5 V two phases of 21 mΩ in series have 36 A at most, of 60 A.
    let weak = [&["check", "m48.toml", "-s", "inverter.dc_link=1.5 V"][..], &BIPOLAR].concat();
    let found = answer(&weak, at);
    let changes: Vec<&str> =
        found["advice"].as_array().expect("a list").iter().filter_map(|of| of["change"].as_str()).collect();
    assert!(changes.iter().any(|change| change.starts_with("a DC link of ")), "{changes:?}");
    assert!(changes.contains(&"the data sheet's DC link of 48 V"), "{changes:?}");
    assert!(!changes.iter().any(|change| change.contains("times the current")), "{changes:?}");
    let peak = |rotor: &str| found["candidates"][0][rotor]["peak_current_a"].as_f64().expect("amperes");
    assert!(peak("locked") > 10.0 && peak("locked") < 36.0, "{found}");
    // A free rotor, which such long pulses turn, adds its own voltage.
    let most = format!("tried, up to {:.1} A", peak("locked").max(peak("free")));
    assert!(said(&standstill(&weak, at)).contains(&most), "{most}");
}

#[test]
fn regress_exchanged_inductances_are_a_doubt_and_the_other_way_round_is_the_next_command() {
    let folder = folder();
    let at = folder.path();
    let exchanged = M48.map(|number| match number {
        "16 uH" => "20 uH",
        "20 uH" => "16 uH",
        other => other,
    });
    fs::write(at.join("m48.toml"), sheet(exchanged)).expect("written");
    let asked = [&["check", "m48.toml", "--effort", "quick"][..], &BIPOLAR].concat();
    let found = answer(&asked, at);
    assert!(found["doubts"].as_str().is_some_and(|doubt| doubt.contains("above L_q")), "{found}");
    assert!(said(&standstill(&asked, at)).contains("if its numbers are meant: L_d is 20 µH, above L_q"));
    let next = found["next"][0].as_str().expect("a command");
    let meant = "-s 'motor.nameplate.L_d=16 µH' -s 'motor.nameplate.L_q=20 µH'";
    assert!(next.starts_with("standstill check m48.toml") && next.contains(meant), "{next}");
    let words = words(next);
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let mended = answer(&words, at);
    assert_eq!((&mended["doubts"], &mended["verdict"]), (&Value::Null, &"suited".into()), "{mended}");
}
