//! Trials that run in blocks, side by side.

use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use standstill_scenario::{Document, Plan};

use super::*;

#[derive(Default)]
struct Counting(AtomicU64);

impl Watch for Counting {
    fn stopped(&self) -> bool {
        false
    }

    fn did(&self, trials: u64) {
        self.0.fetch_add(trials, Ordering::Relaxed);
    }
}

#[test]
fn law_each_trial_runs_once_with_and_without_checks_whatever_the_blocks() {
    let plan = |checks: &str| {
        let text = format!("trials = 40\n[detector]\nmethod = \"bipolar\"\n{checks}");
        Plan::new(Document::parse(Path::new("s.toml"), &text).expect("TOML")).expect("a plan")
    };
    let (with, without) = (plan(""), plan("checks = false"));
    for at_once in [1, 7, 8, 100] {
        let watch = Counting::default();
        let numbers = |records: Vec<Record>| records.iter().map(|record| record.trial).collect::<Vec<_>>();
        let blocks = in_blocks((&with, Some(&without)), 3..19, at_once, &watch, |with, alone| {
            (numbers(with), numbers(alone))
        });
        let Ok(blocks) = blocks else { panic!("does not run") };
        let all: Vec<u64> = blocks.iter().flat_map(|(with, _)| with.clone()).collect();
        assert_eq!(all, (3..19).collect::<Vec<_>>(), "{at_once} at once");
        assert!(blocks.iter().all(|(with, alone)| with == alone && with.len() as u64 <= at_once));
        assert_eq!(watch.0.into_inner(), 16);
    }
    let alone =
        in_blocks((&with, None), 0..3, 2, &Counting::default(), |with, alone| (with.len(), alone.len()));
    assert!(alone.is_ok_and(|alone| alone == [(2, 0), (1, 0)]));
}

/// A fault harms four starts, and three of them end without an answer. The share does not count right answers.
#[test]
fn analytic_the_share_of_refused_starts_leaves_out_right_answers() {
    let reasons = [("too little current", 2), ("the rotor turns", 1)];
    let unanswered = reasons.map(|(reason, count)| (reason.to_owned(), count)).into_iter().collect();
    let counts = Counts { trials: 11, right: 7, beyond: 1, unanswered, ..Counts::default() };
    let share = counts.refused_share().expect("harmed starts");
    assert_eq!((share.value, share.high), (0.75, 1.0));
    // At the lower end p, three or four of four have a probability of 5 %: 4 p³ − 3 p⁴.
    let p = share.low;
    assert!((p * p * p * (4.0 - 3.0 * p) - 0.05).abs() < 1e-9, "{p}");
    assert_eq!(counts.ended_by(&["too little current", "current sensors disagree"]), 2);
    assert_eq!(Counts { trials: 5, right: 5, ..Counts::default() }.refused_share(), None);
}

/// The first pulse of `bipolar` goes through leg a, and a wire that opens during its first half leaves no current at its end. So the start
/// ends at the same time T as with a wire that was open before. With an onset that is uniform from 0 to w, the reaction takes T − w/2 in
/// the mean and at most T.
#[test]
fn analytic_the_reaction_counts_from_the_onset() {
    let counts = |faults: &str, trials: u64| {
        let text =
            format!("trials = {trials}\nerrors = \"none\"\n[detector]\nmethod = \"bipolar\"\n{faults}");
        let plan = Plan::new(Document::parse(Path::new("s.toml"), &text).expect("TOML")).expect("a plan");
        let scenario = plan.scenario(0).expect("a scenario");
        let allowed = Allowed::of(plan.file(), &scenario);
        let Ok(counts) = study("of this test", (&plan, None), trials, allowed, &Counting::default()) else {
            panic!("does not run")
        };
        (counts, scenario)
    };
    let open = "[[faults]]\nmode = \"phase-open\"\nat = \"a\"\n";
    let (before, scenario) = counts(open, 20);
    let end = before.reactions.longest;
    assert_eq!((before.detected(), before.reactions.starts), (20, 20));
    assert!((before.reactions.mean().expect("starts") - end).abs() < 1e-12);
    let w = 3e-5;
    let (during, _) = counts(&format!("{open}onset = [0.0, {w}]\n"), 200);
    assert_eq!((during.detected(), during.reactions.starts), (200, 200));
    // The standard deviation of the mean of 200 uniform onsets is w/49. The runs are on whole ticks of the timer.
    let mean = during.reactions.mean().expect("starts");
    assert!((mean - (end - w / 2.0)).abs() < 4.0 * w / 49.0, "{mean} {end}");
    let longest = during.reactions.longest;
    assert!(longest <= end && longest > end - w / 20.0, "{longest} {end}");
    // The wire opens only after another fault has ended the start. An onset within a command is not known.
    let wrong = "[[faults]]\nmode = \"sheet-inductance\"\nmagnitude = 3.0\n";
    for late in ["onset = \"1 s\"", "command = 2\nonset = \"1 us\""] {
        let (late, _) = counts(&format!("{wrong}{open}{late}\n"), 5);
        assert_eq!((late.detected(), late.reactions.mean(), late.reactions.worst()), (5, None, None));
    }
    assert_eq!(onset(&scenario, 3), Some(0.0));
}
