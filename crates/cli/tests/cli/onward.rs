//! Answers that led to a refusal, to a question without an answer, or nowhere: each says what is off, and the command that it prints runs.

use std::fs;

use super::nexts::{carried_out, commands};
use super::{folder, mistake, standstill};

/// 7 pole pairs, 48 V, 60 A. Pulses of 41 µs draw rated current, those of 20 µs leave the pole open in three of four starts.
const MOTOR: &str = "[nameplate]\npole_pairs = 7\nresistance = \"21 mΩ\"\nL_d = \"16 uH\"\nL_q = \"20 uH\"\nrated_current = \"60 A\"\nmagnet_flux = \"5.2 mWb\"\ndc_link = \"48 V\"\nsaturation = \"5 %\"\n";

fn said(arguments: &[&str], code: i32, at: &std::path::Path) -> String {
    let output = standstill(arguments, at);
    let heard = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {heard}");
    String::from_utf8(output.stdout).expect("text")
}

/// Returns a text with single spaces.
fn flat(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn regress_a_cause_of_starts_without_an_answer_is_a_question_only_if_its_removal_answers_them_all() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("m.toml"), MOTOR).expect("written");
    let weak = ["-s", "detector.method=bipolar", "-s", "detector.pulse=20 us"];
    said(&[&["run", "m.toml", "--trials", "60", "--out", "weak"][..], &weak].concat(), 0, at);
    let next = commands(&said(&["explain", "weak", "--unanswered"], 0, at));
    assert!(next.len() == 1 && next[0].starts_with("check m.toml"), "{next:?}");
    let answer = carried_out(&next[0], at);
    assert!(answer.contains("suited to detection"), "{answer}");
    // A start with an answer has a next question, too: the source of most of its error.
    let next = commands(&said(&["explain", "weak", "--worst", "1"], 0, at));
    assert!(!next.is_empty(), "{next:?}");
}

#[test]
fn regress_a_report_says_what_draws_more_than_rated_current_and_what_comes_after_demands_that_are_met() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("m.toml"), MOTOR).expect("written");
    // 50 µs draw some 70 A.
    let strong = ["-s", "detector.method=bipolar", "-s", "detector.pulse=50 us"];
    said(&[&["run", "m.toml", "--trials", "40", "--out", "strong"][..], &strong].concat(), 0, at);
    let text = flat(&said(&["report", "strong"], 0, at));
    let refused = text.split("Not met: ").nth(1).unwrap_or_else(|| panic!("{text}"));
    assert!(refused.starts_with('7') && refused.contains("A flowed at most (60 A allowed"), "{text}");
    assert!(text.contains("Settings that do: `standstill check m.toml"), "{text}");
    // Enough starts to show all demands.
    let right = ["-s", "detector.method=bipolar", "-s", "detector.pulse=40 us"];
    said(&[&["run", "m.toml", "--trials", "37000", "--out", "right"][..], &right].concat(), 0, at);
    let text = said(&["report", "right"], 0, at);
    assert!(flat(&text).starts_with("Demands met: ") && text.contains(" A flowed at most"), "{text}");
    let next = commands(&text);
    assert!(
        next.len() == 2 && next[0].starts_with("odds m.toml") && next[1].starts_with("budget"),
        "{next:?}"
    );
    for command in &next {
        carried_out(command, at);
    }
    // A sheet that is no longer the one of the run tells no current.
    fs::write(at.join("m.toml"), MOTOR.replace("60 A", "50 A")).expect("written");
    assert!(!said(&["report", "right"], 0, at).contains(" A flowed at most"));
}

#[test]
fn regress_a_report_of_a_sweep_goes_on_at_its_best_point() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("m.toml"), MOTOR).expect("written");
    let axis = ["--vary", "detector.pulse=10us,40us", "-s", "detector.method=bipolar"];
    said(&[&["sweep", "m.toml", "--trials", "20", "--out", "s"][..], &axis].concat(), 0, at);
    let next = commands(&said(&["report", "s"], 0, at));
    assert!(next[0].starts_with("run m.toml") && next[0].contains("detector.pulse=40us"), "{next:?}");
    // Twenty starts of the same seed would be those of the sweep.
    assert!(next[0].ends_with("--trials 200"), "{next:?}");
    assert!(next[1] == "explain s", "{next:?}");
    for command in &next {
        carried_out(command, at);
    }
    // A run without rows, and one that is there already, go on too.
    let none = ["run", "m.toml", "--trials", "20", "--rows", "none", "--out", "none"];
    let text = said(&none, 0, at);
    let budget = text.lines().rev().find_map(|line| line.strip_prefix("  standstill "));
    assert!(budget.is_some_and(|budget| budget == "budget m.toml"), "{text}");
    let run = ["run", "m.toml", "--trials", "20", "--out", "all"];
    said(&run, 0, at);
    assert!(said(&run, 0, at).ends_with("standstill report all\n"));
}

#[test]
fn regress_settings_that_draw_more_than_rated_current_are_named_where_they_are_tuned() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("m.toml"), MOTOR).expect("written");
    let vary =
        ["--vary", "detector.pulse=39us:60us", "--minimise", "rms", "--trials", "1000", "--starts", "1"];
    let given = [&["tune", "m.toml", "-s", "detector.method=bipolar"][..], &vary].concat();
    let output = standstill(&given, at);
    let text = String::from_utf8(output.stdout).expect("text");
    assert!(flat(&text).contains("A, more than the rated 60 A"), "{text}");
    let next = commands(&text);
    let again = next.iter().find(|command| command.starts_with("tune m.toml")).expect("a search");
    assert!(again.contains("--subject-to 'peak_current <= 60 A'"), "{again}");
    let kept = flat(&carried_out(again, at));
    assert!(!kept.contains("more than the rated"), "{kept}");
}

#[test]
fn regress_a_load_without_a_state_is_judged_and_a_nameplate_beside_tables_is_one_mistake() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("m.toml"), MOTOR).expect("written");
    fs::write(at.join("s.toml"), "motor = \"m.toml\"\nrotor.load = \"0.01 N m\"\n").expect("written");
    let quick = ["--effort", "quick", "-s", "detector.method=bipolar"];
    let text = said(&[&["check", "s.toml"][..], &quick].concat(), 0, at);
    assert!(text.contains("rotor locked and free"), "{text}");
    carried_out("run check-s.toml", at);
    let held = mistake(&["check", "s.toml", "-s", "rotor.state=locked"], at);
    assert!(held.contains("a load on a locked rotor"), "{held}");
    let message = mistake(&["check", "paper-5k5", "-s", "motor.nameplate.L_d=16uH"], at);
    assert!(message.contains("beside [rating], [winding]") && !message.contains("is missing"), "{message}");
}
