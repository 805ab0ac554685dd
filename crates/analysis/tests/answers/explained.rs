//! Parts of errors where a converter rounds.

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use standstill_analysis::{Explained, Trials, Watch};
use standstill_scenario::{Document, Plan};

static NEVER: AtomicBool = AtomicBool::new(false);

/// Gains and offsets alone, with converters of so many bits; zero: none.
fn plan(bits: u32) -> Plan {
    let text = format!(
        "motor = \"paper-5k5\"\nerrors = \"none\"\ndetector.method = \"line-inductance-fast\"\n[sensors]\n\
         gain_error = \"0.5 %\"\noffset = \"30 mA\"\nbits = {bits}\nrange = \"20 A\"\n"
    );
    Plan::new(Document::parse(Path::new("test.toml"), &text).expect("TOML")).expect("a plan")
}

fn explained(plan: &Plan, trial: u64) -> Explained {
    Explained::of(&Trials::new(plan).expect("a scenario"), 1, trial, &NEVER).expect("runs")
}

#[test]
fn analytic_parts_are_those_without_a_converter_and_what_is_rounding_is_said_to_be() {
    let (coarse, exact) = (plan(12), plan(0));
    let (mut told, mut held, mut all, mut named, mut misled) = (0, 0, 0, 0, 0.0_f64);
    for trial in 0..25 {
        let (coarse, exact) = (explained(&coarse, trial), explained(&exact, trial));
        let rounding = coarse.rounding_deg.expect("a converter");
        assert!(rounding > 0.0 && rounding < 1.0, "{rounding}");
        assert!(exact.rounding_deg.is_none() && exact.causes.iter().all(|cause| !cause.within_rounding));
        // Without a converter the part is the error less what is left.
        let own = exact.record.axis_error_deg().expect("an axis");
        for cause in &exact.causes {
            let left = cause.without.axis_error_deg().expect("an axis");
            let part = cause.part_deg.expect("an axis").value;
            assert!((part - (own - left)).abs() < 1e-9, "{}: {part}, {own} and {left}", cause.name);
        }
        for cause in &coarse.causes {
            let without = |e: &Explained| e.causes.iter().find(|other| other.name == cause.name).cloned();
            let truth = without(&exact).and_then(|cause| cause.part_deg).expect("an axis").value;
            let part = cause.part_deg.expect("an axis");
            (all, held) = (all + 1, held + u32::from(part.low <= truth && truth <= part.high));
            if cause.key == "sensors.offset" {
                // The method takes offsets away: without a converter next to nothing is left of them.
                assert!(truth.abs() < 0.005, "{} {truth}", cause.name);
                told += u32::from(cause.within_rounding);
                let [with, without] =
                    [&coarse.record, &cause.without].map(|r| r.axis_error_deg().expect("an axis"));
                misled = misled.max((with - without).abs());
            } else if truth.abs() > 0.2 {
                named += 1;
                assert!(!cause.within_rounding, "{} of {truth}°: {part:?}", cause.name);
            }
        }
        // Those that can be told from rounding stand first.
        assert!(coarse.causes.is_sorted_by_key(|cause| cause.within_rounding));
    }
    // One look says that an offset turned the axis by a tenth of a degree.
    assert!(misled > 0.08, "{misled}");
    // 95 of 100; fewer than these in one of a thousand cases.
    assert!(told >= 64, "{told} of 75 offsets");
    assert!(held >= 132, "{held} of {all} parts");
    assert_eq!(all, 150);
    assert!(named > 20, "{named}");
}

/// Counts the trials that were run.
struct Counter(AtomicU64);

impl Watch for Counter {
    fn stopped(&self) -> bool {
        false
    }

    fn did(&self, trials: u64) {
        self.0.fetch_add(trials, Ordering::Relaxed);
    }
}

#[test]
fn regress_a_bar_for_an_explanation_is_as_long_as_the_explanation() {
    for bits in [12, 0] {
        let plan = plan(bits);
        let trials = Trials::new(&plan).expect("a scenario");
        let counter = Counter(AtomicU64::new(0));
        Explained::of(&trials, 1, 0, &counter).expect("runs");
        assert_eq!(counter.0.into_inner(), Explained::runs(&trials), "{bits} bits");
    }
}

#[test]
fn regress_codes_move_also_where_a_tolerance_makes_each_trial_s_scenario_anew() {
    let text = "motor = \"paper-5k5\"\nerrors = \"none\"\ndetector.method = \"line-inductance-fast\"\n\
                inverter.dead_time = \"2 us\"\nsensors.bits = 12\nsensors.range = \"20 A\"\n\
                tolerances.\"inverter.dead_time\" = { normal = \"1 %\" }\n";
    let plan = Plan::new(Document::parse(Path::new("test.toml"), text).expect("TOML")).expect("a plan");
    let told = explained(&plan, 0);
    assert!(told.rounding_deg.is_some_and(|deviation| deviation > 1e-3), "{:?}", told.rounding_deg);
}
