//! Commands that are played one after the other, on a link of a voltage.

mod player;

use standstill_interface::{Abc, Command, Leg, Nanos, Sampling, Stage};
use standstill_sim::Case;
use standstill_sim::{NoProbe, Run, Width, run, run_side_by_side_in};

pub use player::Script;

pub const LINK: f64 = 550.0;

pub fn stage(legs: [Leg<f64>; 3], micros: u64) -> Stage<f64> {
    Stage { legs: Abc(legs), duration: Nanos::from_micros(micros) }
}

/// Some samples of a command of one or two stages.
pub fn sampled(command: Command<f64>, count: u32) -> Command<f64> {
    let interval = Nanos(command.duration().0 / u64::from(count));
    Command { sampling: Sampling { first: interval, interval, count }, ..command }
}

/// A run in a lane has the bits of the run alone, whatever the width.
pub fn same_bits_in_lanes(cases: &[(Case<'_>, Script)]) {
    let told = |run: &Run<f64>| format!("{run:?}");
    let alone: Vec<_> = cases
        .iter()
        .map(|(case, script)| told(&run(case, &mut script.clone(), false, &mut NoProbe)))
        .collect();
    for width in Width::available() {
        let mut together = vec![String::new(); cases.len()];
        run_side_by_side_in(width, cases.iter().cloned(), |number, run| together[number] = told(&run));
        assert!(alone == together, "{width:?}");
    }
}
