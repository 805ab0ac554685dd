//! Files that a run reads: however they are named, the run is another one when they change.

use std::fs;
use std::path::Path;

use crate::maps::{write_map, write_sheet};
use crate::{folder, mistake, standstill};

/// A scenario, what the command line sets besides, and the files that it reads beside itself.
struct Way {
    scenario: &'static str,
    set: &'static [&'static str],
    files: &'static [&'static str],
}

/// The ways in which a scenario can name a file. `own.toml` has `map.csv` for its core; `low.toml` is the same motor with
/// another name.
const WAYS: [Way; 8] = [
    Way { scenario: "motor = \"motors/own.toml\"", set: &[], files: &["motors/own.toml", "motors/map.csv"] },
    Way {
        scenario: "[motor]\nbase = \"motors/own.toml\"\nmap.file = \"other.csv\"",
        set: &[],
        files: &["motors/own.toml", "motors/other.csv"],
    },
    Way {
        scenario: "motor = \"motors/own.toml\"",
        set: &["-s", "motor.map.file=other.csv"],
        files: &["motors/own.toml", "motors/other.csv"],
    },
    Way {
        scenario: "",
        set: &["-s", "motor=motors/own.toml"],
        files: &["motors/own.toml", "motors/map.csv"],
    },
    Way {
        scenario: "motor = \"motors/own.toml\"\n[axes]\n\"motor.map.file\" = [\"map.csv\", \"other.csv\"]",
        set: &[],
        files: &["motors/own.toml", "motors/map.csv", "motors/other.csv"],
    },
    Way {
        scenario: "[axes]\nmotor = [\"paper-5k5\", { base = \"motors/own.toml\", map = { file = \"other.csv\" } }]",
        set: &[],
        files: &["motors/own.toml", "motors/other.csv"],
    },
    Way {
        scenario: "[axes]\n\"motor.base\" = [\"motors/low.toml\", \"motors/own.toml\"]",
        set: &[],
        files: &["motors/low.toml", "motors/own.toml", "motors/map.csv"],
    },
    Way {
        scenario: "motor = \"motors/own.toml\"\n[tolerances]\n\"motor.winding.resistance\" = { normal = \"3 %\" }",
        set: &["-s", "motor.map.file=other.csv"],
        files: &["motors/own.toml", "motors/other.csv"],
    },
];

/// The arguments of a shard of a run.
fn run<'a>(way: &Way, shard: &'a str, out: &'a str) -> Vec<&'a str> {
    let arguments = ["run", "s.toml", "--resume", "--shard", shard, "--out", out];
    arguments.into_iter().chain(way.set.iter().copied()).collect()
}

fn succeed(arguments: &[&str], at: &Path) {
    let output = standstill(arguments, at);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

/// promise: other-runs-refused
#[test]
fn regress_a_file_that_changed_or_is_gone_is_named_however_it_was_named() {
    // A motor, a file set by a key, a list of files, a motor in a list, a motor of each trial.
    changed_or_gone(&[0, 2, 4, 6, 7]);
}

#[test]
#[ignore = "all ways of naming a file: scripts/test-all.sh long"]
fn regress_a_file_that_changed_or_is_gone_is_named_in_all_ways() {
    changed_or_gone(&[0, 1, 2, 3, 4, 5, 6, 7]);
}

fn changed_or_gone(ways: &[usize]) {
    let folder = folder();
    let at = folder.path();
    fs::create_dir(at.join("motors")).expect("made");
    write_map(&at.join("motors/map.csv"), 6);
    write_map(&at.join("motors/other.csv"), 6);
    write_sheet(&at.join("motors"));
    fs::copy(at.join("motors/own.toml"), at.join("motors/low.toml")).expect("copied");
    for (number, way) in ways.iter().map(|number| (*number, &WAYS[*number])) {
        fs::write(at.join("s.toml"), format!("trials = 2\n{}\n", way.scenario)).expect("written");
        let out = |what: &str, of: &str| format!("{number}-{what}-{}", of.replace('/', "-"));
        let [first, whole] = ["first", "whole"].map(|what| out(what, ""));
        // A shard that is done, and a run that is finished: of the latter one way tells all.
        let done = [run(way, "1/2", &first), run(way, "1/1", &whole)];
        let done = if number == 0 { &done[..] } else { &done[..1] };
        for arguments in done {
            succeed(arguments, at);
        }
        for name in way.files {
            let path = at.join(name);
            let text = fs::read_to_string(&path).expect("readable");
            fs::write(&path, format!("{text}\n")).expect("written");
            for arguments in done {
                let message = mistake(arguments, at);
                assert!(message.contains(name), "{arguments:?} after {name} changed: {message}");
            }
            // Shards are compared by what one run in two parts is compared by: as files of a motor, of a list, of a trial of its own.
            if [0, 4, 7].contains(&number) {
                let second = out("second", name);
                succeed(&run(way, "2/2", &second), at);
                let message = mistake(&["merge", &first, &second, "--out", "merged"], at);
                assert!(message.contains(name), "merge after {name} changed, way {number}: {message}");
            }
            fs::remove_file(&path).expect("removed");
            for arguments in done {
                let message = mistake(arguments, at);
                assert!(message.contains(name), "{arguments:?} without {name}: {message}");
            }
            fs::write(&path, text).expect("written");
        }
        // As all of them were, it is the same run again.
        succeed(&run(way, "1/2", &first), at);
        let second = out("second", "");
        succeed(&run(way, "2/2", &second), at);
        succeed(&["merge", &first, &second, "--out", &out("merged", "")], at);
        assert!(!at.join("merged").exists(), "nothing half-written stays");
    }
}

#[test]
fn law_an_unwritable_folder_is_named() {
    let folder = folder();
    // Not even root can make folders in /proc.
    if Path::new("/proc/self").exists() {
        let message =
            mistake(&["reproduce", "--trials", "1", "--out", "/proc/standstill/out"], folder.path());
        assert!(message.contains("cannot write /proc/standstill/out"), "{message}");
    }
}
