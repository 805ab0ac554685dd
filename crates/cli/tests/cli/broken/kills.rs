//! Commands that are killed.

use std::os::unix::process::ExitStatusExt as _;
use std::time::{Duration, Instant};

use super::{ALL, Bench, CASES, Case, Random};

/// Kills a command at calls of all kinds, `most` of them, by chance; returns how often.
fn killed(bench: &Bench, case: &Case, replaces: bool, most: u64, random: &mut Random) -> u64 {
    let ready = bench.ready(case, replaces);
    let calls = ready.calls(ALL);
    assert!(calls > 0, "{}: no call is seen: is the program linked statically?", case.name);
    let mut kills = 0;
    for _ in 0..most {
        let at = random.up_to(calls).to_string();
        let of = format!(
            "{}{}, killed at call {at} of {}",
            case.name,
            if replaces { " --force" } else { "" },
            calls
        );
        bench.restore(ready.before.as_ref());
        let faults = [("FAULT_CALLS", ALL), ("FAULT_AT", &at), ("FAULT_DO", "kill")];
        let output = bench.run(&ready.words, &faults);
        // How often a run synchronises its journal depends on the clock: a call that comes late may not come at all.
        let is_killed = output.status.signal() == Some(9);
        assert!(is_killed || output.status.success() || output.status.code() == Some(1), "{of}: {output:?}");
        kills += u64::from(is_killed);
        bench.looked_at(&ready, &of);
    }
    kills
}

/// promise: killed-anywhere
#[test]
fn law_a_command_killed_at_any_call_leaves_whole_files_and_is_made_good_by_the_next() {
    let (bench, mut random) = (Bench::new(), Random(40));
    let quick = CASES.iter().filter(|case| case.quick);
    let (mut kills, mut tries) = (0, 0);
    for (k, case) in quick.enumerate() {
        kills += killed(&bench, case, k % 2 == 0 && case.other.is_some(), 1, &mut random);
        tries += 1;
    }
    assert!(4 * kills >= 3 * tries, "{kills} of {tries}");
}

/// promise: killed-anywhere
#[test]
#[ignore = "two hundred kills; some run by default: scripts/test-all.sh faults"]
fn law_each_command_killed_at_many_calls_leaves_whole_files() {
    let (bench, mut random, mut kills) = (Bench::new(), Random(41), 0);
    for case in CASES {
        kills += killed(&bench, case, false, 5, &mut random);
        if case.other.is_some() {
            kills += killed(&bench, case, true, 4, &mut random);
        }
    }
    assert!(kills >= 190);
    println!("killed at {kills} calls: all files whole, and made good by the next try");
}

/// promise: killed-anywhere
#[test]
#[ignore = "two kills of each command by the clock: scripts/test-all.sh faults"]
fn law_each_command_killed_at_random_moments_leaves_whole_files() {
    let (bench, mut random, mut kills) = (Bench::new(), Random(42), 0);
    for case in CASES {
        let ready = bench.ready(case, false);
        bench.restore(ready.before.as_ref());
        let begun = Instant::now();
        bench.well(&ready.words);
        let takes = u64::try_from(begun.elapsed().as_micros()).unwrap_or(u64::MAX);
        for _ in 0..2 {
            let moment = random.up_to(takes);
            bench.restore(ready.before.as_ref());
            let mut child =
                bench.command(&ready.words, &[]).stdout(std::process::Stdio::null()).spawn().expect("starts");
            std::thread::sleep(Duration::from_micros(moment));
            child.kill().expect("SIGKILL");
            // It may have ended before.
            kills += u32::from(child.wait().expect("ended").signal() == Some(9));
            bench.looked_at(&ready, &format!("{}, killed after {moment} µs", case.name));
        }
    }
    println!("killed {kills} times by the clock: all files whole, and made good by the next try");
}
