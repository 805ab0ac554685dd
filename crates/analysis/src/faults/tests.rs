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
