//! Each answer ends with a command that goes on, and the command is accepted.

use std::fs;
use std::path::Path;

use super::guides::words;
use super::{folder, standstill};

#[test]
fn law_each_answer_ends_with_a_command_that_is_accepted() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("s.toml"), "detector.method = \"line-inductance-fast\"\n").expect("written");
    let scenario = ["s.toml", "-s", "sensors.noise=30 mA", "--seed", "4"];
    let asked: [(&str, &[&str], &str); 8] = [
        ("budget", &["--pairs", "100"], "standstill require"),
        (
            "require",
            &["--key", "sensors.noise", "--limit", "rms <= 3 deg", "--most", "100"],
            "standstill run",
        ),
        (
            "require",
            &["--key", "sensors.noise", "--limit", "rms <= 0.001 deg", "--most", "100", "--force"],
            "standstill budget",
        ),
        (
            "tune",
            &["--vary", "detector.rounds=2:3", "--minimise", "rms", "--trials", "1000", "--starts", "1"],
            "-s detector.rounds=",
        ),
        ("odds", &["--event", "|e| > 1 deg", "--effort", "quick"], "standstill run"),
        ("faults", &["--mode", "current-gain", "--trials", "20"], "standstill odds"),
        (
            "compare",
            &[
                "--method",
                "line-inductance-fast",
                "--trials",
                "20",
                "--no-limit",
                "--errors",
                "default",
                "--rotor",
                "locked",
            ],
            "standstill trace",
        ),
        ("bounds", &["--angles", "1"], "standstill compare"),
    ];
    for (question, options, expected) in asked {
        let output = standstill(&[&[question], &scenario[..], options].concat(), at);
        let text = String::from_utf8(output.stdout).expect("text");
        let next = text.split("What next:\n").nth(1);
        let next =
            next.unwrap_or_else(|| panic!("{question}: {text}{}", String::from_utf8_lossy(&output.stderr)));
        assert!(next.contains(expected), "{question}: {next}");
        let commands: Vec<&str> =
            next.lines().filter_map(|line| line.strip_prefix("    standstill ")).collect();
        assert!(!commands.is_empty(), "{question}: {next}");
        // Help is no step.
        assert!(!next.contains("--help"), "{question}: {next}");
        if expected == "standstill budget" {
            // What no value meets comes with the nearest value, and with the command that looks for other settings.
            assert!(text.contains("smallest rms: ") && next.contains("standstill check s.toml"), "{text}");
        }
        for command in commands {
            assert!(
                command.contains("s.toml") && command.contains(" -s 'sensors.noise="),
                "{question}: {command}"
            );
            carried_out(command, at);
        }
    }
    // A page has them, too.
    let page = fs::read_to_string(at.join("standstill-out/s-budget/budget.html")).expect("a page");
    assert!(page.contains("What next") && page.contains("standstill require s.toml"));
    let text = String::from_utf8(standstill(&["magnetics", "paper-5k5"], at).stdout).expect("text");
    assert!(text.contains("What next:\n") && text.contains("standstill check paper-5k5"), "{text}");
}

/// A start in a million or so is not looked for among plain starts: ten of them took 7.4 million starts with a row each. The answer says how
/// many those would be, and proposes something of minutes.
#[test]
fn regress_no_command_of_hours_is_proposed_without_its_cost() {
    let folder = folder();
    let at = folder.path();
    fs::copy(concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/motors/ipm-2k2.toml"), at.join("m.toml"))
        .expect("copied");
    let asked = ["odds", "m.toml", "--event", "|e| > 5 deg", "--effort", "quick", "--seed", "1"];
    let output = standstill(&asked, at);
    let text = String::from_utf8(output.stdout).expect("text");
    let next = text.split("What next:\n").nth(1).unwrap_or_else(|| panic!("{text}"));
    for run in next.lines().filter(|line| line.contains("standstill run")) {
        let trials = run.split("--trials ").nth(1).and_then(|rest| rest.split(' ').next());
        let trials: u64 = trials.and_then(|trials| trials.parse().ok()).expect("a number");
        assert!(trials <= 100_000 || next.contains("times as many trials as here"), "{next}");
    }
    assert!(
        next.contains("million plain trials, ") && next.contains("    standstill budget m.toml"),
        "{text}"
    );
}

#[test]
fn regress_what_goes_on_from_a_trace_or_a_comparison_has_its_motor_its_errors_and_its_method() {
    let folder = folder();
    let at = folder.path();
    let next = |words: &[&str]| {
        let text = String::from_utf8(standstill(words, at).stdout).expect("text");
        text.split("What next:\n").nth(1).unwrap_or_else(|| panic!("{words:?}: {text}")).to_owned()
    };
    let of_motor = next(&[
        "trace",
        "--motor",
        "light-vehicle",
        "--errors",
        "none",
        "--method",
        "bipolar",
        "--rotor",
        "free",
        "--angle",
        "40",
        "--out",
        "a",
    ]);
    let expected =
        "standstill run light-vehicle -s errors=none -s rotor.state=free -s detector.method=bipolar\n";
    assert!(of_motor.ends_with(expected), "{of_motor}");
    // The paper's method is that of a trace without a scenario, and not of a run without one.
    let shipped = next(&["trace", "--angle", "40", "--out", "b"]);
    assert!(shipped.ends_with("standstill run paper-5k5 -s detector.method=line-inductance\n"), "{shipped}");
    fs::write(at.join("s.toml"), "detector.method = \"bipolar\"\n").expect("written");
    let of_scenario = next(&["trace", "s.toml", "--errors", "none", "--seed", "4", "--out", "c"]);
    assert!(of_scenario.ends_with("standstill run s.toml -s errors=none -s seed=4\n"), "{of_scenario}");
    let compared = next(&[
        "compare",
        "s.toml",
        "--method",
        "bipolar",
        "--errors",
        "none",
        "--rotor",
        "free",
        "--trials",
        "4",
        "--no-limit",
        "--out",
        "d",
    ]);
    assert!(compared.contains("-s detector.method=bipolar -s errors=none -s rotor.state=free"), "{compared}");
}

/// Carries out a printed command with as little work as its options allow. It is not refused: its code is 0, 1, or, if nothing can be shown,
/// 3. Returns what it prints.
pub fn carried_out(command: &str, at: &Path) -> String {
    let mut given = words(command);
    let least: &[(&str, &str)] = match given[0].as_str() {
        "run" | "faults" => &[("--trials", "20")],
        "sweep" => &[("--trials", "4")],
        "require" => &[("--most", "100")],
        "budget" => &[("--pairs", "100")],
        "odds" | "check" => &[("--effort", "quick")],
        "tune" => &[("--trials", "1000"), ("--starts", "1")],
        "compare" => &[("--trials", "4"), ("--method", "bipolar"), ("--rotor", "locked")],
        "bounds" => &[("--angles", "1")],
        _ => &[],
    };
    for (option, value) in least {
        match given.iter().position(|word| word == option) {
            // More trials than an earlier run has are kept: an extension needs them.
            Some(place) if *option == "--trials" && given.iter().all(|word| word != "--resume") => {
                (*value).clone_into(&mut given[place + 1]);
            }
            Some(_) => {}
            None => given.extend([(*option).to_owned(), (*value).to_owned()]),
        }
    }
    let given: Vec<&str> = given.iter().map(String::as_str).collect();
    let output = standstill(&given, at);
    let heard = String::from_utf8_lossy(&output.stderr);
    assert!(matches!(output.status.code(), Some(0 | 1 | 3)), "{command} as {given:?}: {heard}");
    String::from_utf8(output.stdout).expect("text")
}

/// Returns the commands that stand below "What next:" in a text, without the program's name.
pub fn commands(text: &str) -> Vec<String> {
    let next = text.split("What next:\n").nth(1).unwrap_or_default();
    next.lines().filter_map(|line| line.strip_prefix("    standstill ")).map(str::to_owned).collect()
}

/// Motors whose sheets give one inductance for both axes: no start has an answer, whatever is asked. Each answer says so with the reason, ends
/// with code 3 or, where no value meets a limit, 1, and the commands that it prints are carried out.
#[test]
fn law_where_no_start_answers_each_question_says_why_and_what_it_prints_runs() {
    let folder = folder();
    let at = folder.path();
    for motor in ["drone-5010", "servo-2310"] {
        let sheet = format!("{motor}.toml");
        let examples = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/motors/");
        fs::copy(format!("{examples}{sheet}"), at.join(&sheet)).expect("copied");
        let asked: [(&[&str], i32); 8] = [
            (&["odds", &sheet, "--event", "|e| > 3 deg", "--effort", "quick"], 3),
            (&["budget", &sheet, "--pairs", "100"], 3),
            (&["bounds", &sheet, "--angles", "2"], 3),
            (&["faults", &sheet, "--mode", "current-gain", "--trials", "20"], 3),
            (&["require", &sheet, "--key", "sensors.noise", "--limit", "rms <= 1 deg", "--most", "100"], 1),
            (
                &[
                    "require",
                    &sheet,
                    "--key",
                    "sensors.noise",
                    "--key",
                    "sensors.jitter",
                    "--limit",
                    "rms <= 1 deg",
                    "--most",
                    "100",
                    "--force",
                ],
                1,
            ),
            (
                &[
                    "tune",
                    &sheet,
                    "--vary",
                    "detector.rounds=2:3",
                    "--minimise",
                    "rms",
                    "--trials",
                    "1000",
                    "--starts",
                    "1",
                ],
                3,
            ),
            (
                &[
                    "compare",
                    &sheet,
                    "--trials",
                    "4",
                    "--no-limit",
                    "--errors",
                    "default",
                    "--rotor",
                    "locked",
                ],
                0,
            ),
        ];
        let mut next = std::collections::BTreeSet::new();
        for (words, code) in asked {
            let output = standstill(words, at);
            let text = String::from_utf8(output.stdout).expect("text");
            let heard = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(code), "{words:?}: {text}{heard}");
            assert!(text.contains("no saliency found"), "{words:?}: {text}");
            let commands = commands(&text);
            let check = format!("check {sheet}");
            assert!(
                commands.first().is_some_and(|first| first.starts_with(&check)),
                "{words:?}: {commands:?}"
            );
            next.extend(commands);
        }
        for command in next {
            carried_out(&command, at);
        }
    }
}
