//! What `odds`, `budget`, `require` and `tune` do with answers that are there, and with what never happens.

use std::fs;

use super::answers::{SCENARIO, answer, number};
use super::{folder, mistake};

/// A rotor that may move, and does not: rated current makes 21.7 N m in it.
const STUCK: &[&str] = &["-s", "rotor.state=free", "-s", "motor.rotor.stiction=21 N m"];

#[test]
fn regress_what_never_happens_has_the_limit_of_plain_trials_alone() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SCENARIO).expect("written");
    // The rotor sticks: nothing moves, whatever is drawn.
    let asked = [&["odds", "s.toml", "--event", "moved > 0.1 deg", "--json", "--out", "k"], STUCK].concat();
    let still = answer(&asked, 0, path);
    assert_eq!((number(&still, "probability"), number(&still, "trials")), (0.0, 4000.0));
    // None in 4,000: 1 − 0.025^(1/4000).
    assert!((number(&still, "high") / 9.217_947_494_8e-4 - 1.0).abs() < 1e-6, "{still}");
    assert!(still["alarms"][0].as_str().is_some_and(|alarm| alarm.contains("equally far")), "{still}");
    let page = fs::read_to_string(path.join("k/odds.html")).expect("a page");
    assert!(!page.contains("What it looks like"), "an empty section");
}

/// promise: answers-stay
#[test]
fn regress_an_answer_is_not_replaced_by_that_to_another_question() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SCENARIO).expect("written");
    let odds: &[&str] = &[&["odds", "s.toml", "--json", "--out", "k"], STUCK, &["--event"]].concat();
    let budget: &[&str] = &["budget", "s.toml", "--json", "--out", "k", "--pairs"];
    let require: &[&str] = &[
        "require",
        "s.toml",
        "--key",
        "sensors.noise",
        "--between",
        "5 mA:20 mA",
        "--most",
        "100",
        "--json",
        "--out",
        "k",
        "--limit",
    ];
    let tune: &[&str] =
        &["tune", "s.toml", "--vary", "detector.rounds=2:3", "--trials", "1000", "--starts", "1"];
    let tune = &[tune, &["--json", "--out", "k", "--minimise"]].concat();
    let questions = [
        // 4,000 trials bound the movement of a rotor that sticks.
        (
            odds,
            "moved > 1 deg",
            "moved > 1.5 deg",
            "--event is `moved > 1 deg` there and `moved > 1.5 deg` here",
        ),
        (budget, "100", "150", "--pairs is `100` there and `150` here"),
        (
            require,
            "rms <= 60 deg",
            "rms <= 50 deg",
            "--limit is `rms <= 60 deg` there and `rms <= 50 deg` here",
        ),
        (tune, "rms", "p95", "--minimise is `rms` there and `p95` here"),
    ];
    for (arguments, first, other, difference) in questions {
        let asked = |what: &'static str, more: &[&'static str]| [arguments, &[what], more].concat();
        let name = arguments[0];
        let code = i32::from(name == "require");
        let file = path.join(format!("k/{name}.json"));
        let kept = || fs::read(&file).expect("an answer");
        let found = answer(&asked(first, &[]), code, path);
        let before = kept();
        for more in [&[][..], &["--resume"]] {
            let message = mistake(&asked(other, more), path);
            let expected = format!(
                "k/{name}.json: found the results of another question: {difference}, needed another --out, or --force"
            );
            assert!(message.contains(&expected), "{message}");
            let message = mistake(&asked(first, &[more, &["--seed", "2"]].concat()), path);
            assert!(message.contains("another question: the seed is 1 there and 2 here"), "{message}");
            // All that differs is named: a key of the scenario, the seed and the command's own option.
            let several = ["--seed", "2", "-s", "sensors.noise=12 mA"];
            let message = mistake(&asked(other, &[more, &several].concat()), path);
            for part in ["the seed is 1 there and 2 here", "`sensors.noise` is not set there", difference] {
                assert!(message.contains(part), "{part} in {message}");
            }
        }
        assert_eq!(kept(), before, "{name}: nothing was touched");
        // The same question may be asked again, another one with leave: one guard for all, tried by the two that are answered first.
        if ["budget", "require"].contains(&name) {
            assert_eq!(answer(&asked(first, &["--threads", "1"]), code, path), found);
            assert_ne!(answer(&asked(other, &["--force", "--resume"]), code, path), found);
            assert_ne!(kept(), before);
        }
    }
    fs::write(path.join("k/odds.json"), "{}").expect("written");
    assert!(mistake(&[odds, &["moved > 1 deg"]].concat(), path).contains("this file does not say which"));
}

/// A question that is finished is not computed again by `--resume`: the answer that is there is printed, with its code and its next commands.
#[test]
fn regress_resume_prints_an_answer_that_is_finished() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SCENARIO).expect("written");
    let asked = [
        "require",
        "s.toml",
        "--key",
        "sensors.noise",
        "--between",
        "5 mA:20 mA",
        "--most",
        "100",
        "--limit",
        "rms <= 0.001 deg",
    ];
    let ask = |more: &[&str]| {
        let output = super::standstill(&[&asked[..], more].concat(), path);
        (output.status.code(), String::from_utf8(output.stdout).expect("text"))
    };
    let (code, first) = ask(&[]);
    let file = path.join("standstill-out/s-require/require.html");
    let written = || fs::metadata(&file).and_then(|file| file.modified()).expect("a page");
    let before = written();
    let (again, text) = ask(&["--resume"]);
    assert_eq!((code, again), (Some(1), Some(1)), "{text}");
    assert!(text.contains("This is the finished answer; nothing was computed again."), "{text}");
    assert_eq!(written(), before, "the page was written again");
    for line in first.lines() {
        assert!(text.contains(line), "{line} is missing: {text}");
    }
    // As JSON it is the file.
    let (_, json) = ask(&["--resume", "--json", "--out", "standstill-out/s-require"]);
    assert_eq!(json, fs::read_to_string(file.with_extension("json")).expect("JSON"));
    // Without its page it is made anew.
    fs::remove_file(&file).expect("removed");
    let (_, text) = ask(&["--resume"]);
    assert!(!text.contains("This is the finished answer") && file.exists(), "{text}");
}
