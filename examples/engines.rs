//! How fast is the engine that is to take over, against the present one?
//!
//! Blocks of detections by turns, each engine at its best of many: the ratios hold on a machine that is busy with something
//! else. Detections only, no rows written.
//!
//! Run with `cargo run --release --example engines [METHOD …]`.

use std::hint::black_box;
use std::time::Instant;

use standstill_campaign::{ErrorSet, Scenario};
use standstill_detect::{Method, MethodName, Settings};
use standstill_plant::built_in;
use standstill_sim::reference::run_side_by_side;
use standstill_sim::{RotorState, lockstep};

const METHODS: [(MethodName, u64, RotorState); 6] = [
    (MethodName::LineInductanceFast, 256, RotorState::Locked),
    (MethodName::LineInductance, 128, RotorState::Locked),
    (MethodName::Bipolar, 128, RotorState::Locked),
    (MethodName::MaximumLikelihood, 64, RotorState::Locked),
    (MethodName::HfiRotating, 32, RotorState::Locked),
    (MethodName::LineInductanceFast, 256, RotorState::Free),
];

/// The least time in µs that a task takes, of so many turns.
fn best(best: &mut f64, per: u64, task: impl FnOnce()) {
    let begin = Instant::now();
    task();
    *best = best.min(begin.elapsed().as_secs_f64() * 1e6 / per as f64);
}

fn main() {
    let motor = built_in("paper-5k5").expect("built in");
    println!("method                          present  lockstep   ratio   per second and core");
    for (method, trials, rotor) in METHODS {
        let name = format!("{method}");
        if std::env::args().len() > 1 && !std::env::args().any(|wanted| wanted == name) {
            continue;
        }
        let scenario: Scenario<Method<f64>> =
            Scenario::of_method(method, motor.clone(), ErrorSet::Default, rotor, 1);
        let cases =
            || (0..trials).filter_map(|k| Some((scenario.case(k), scenario.detector.detector().ok()?)));
        let mut times = [f64::INFINITY; 2];
        let start = Instant::now();
        while start.elapsed().as_secs_f64() < 3.0 {
            best(&mut times[0], trials, || {
                run_side_by_side(&scenario.motor, &scenario.drive.link, cases(), |_, run| _ = black_box(run));
            });
            for _ in 0..if std::env::var_os("ONLY").is_some() { 60 } else { 2 } {
                best(&mut times[1], trials, || {
                    lockstep::run_side_by_side(cases(), |_, run| _ = black_box(run));
                });
            }
        }
        let [present, lockstep] = times;
        let state = if rotor == RotorState::Free { "free" } else { "locked" };
        println!(
            "{name:22} {state:6} {present:8.1} µs {lockstep:6.1} µs {:6.2} {:9.0}",
            present / lockstep,
            1e6 / lockstep
        );
    }
}
