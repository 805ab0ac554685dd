//! Measures the time of a segment, of a detection and of a block of trials, alone and side by side: `cargo bench --features bench`,
//! or `cargo bench --features bench -- --quick`.

use std::hint::black_box;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use standstill_campaign::{Campaign, CampaignError};
use standstill_detect::{Method, MethodName};
use standstill_interface::{
    Command, Detector, Fault, Findings, Nanos, Outcome, Phase, Reading, Sampling, Stage, Step,
};
use standstill_plant::{Motor, built_in};
use standstill_scenario::{ErrorSet, Scenario};
use standstill_sim::{NoProbe, RotorState, run, run_side_by_side};

/// Trials side by side: several times the lanes, so that those which stay empty at the end count little.
const BLOCK: u64 = 64;

fn motor() -> Motor {
    built_in("paper-5k5").unwrap_or_else(|| unreachable!("a built-in motor"))
}

fn scenario(method: MethodName, errors: ErrorSet, rotor: RotorState) -> Scenario<Method<f64>> {
    Scenario::of_method(method, motor(), errors, rotor, 1)
}

/// One line pulse and no more.
#[derive(Clone, Default)]
struct Pulse(bool);

impl Detector<f64> for Pulse {
    fn step(&mut self, _: &[Reading<f64>]) -> Step<f64> {
        if std::mem::replace(&mut self.0, true) {
            return Step::Done(Outcome::Failed {
                fault: Fault::UnexpectedReadings,
                findings: Findings::default(),
            });
        }
        let stage = Stage::line(Phase::A, Phase::B, Nanos::from_micros(80));
        Step::Drive(Command::hold(stage, Sampling::NONE))
    }
}

/// From rest to the end of a pulse of 80 µs, without anything on the way.
fn one_segment(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("one segment");
    for (name, rotor) in [("locked", RotorState::Locked), ("free", RotorState::Free)] {
        // An ideal drive: its gates switch when they are told, and once.
        let scenario = scenario(MethodName::LineInductance, ErrorSet::None, rotor);
        let cases: Vec<_> = (0..BLOCK).map(|trial| (scenario.case(trial), Pulse::default())).collect();
        let segments = |case| run(case, &mut Pulse::default(), false, &mut NoProbe).work.segments;
        assert!(cases.iter().all(|(case, _)| segments(case) == 1), "nothing on the way");
        group.throughput(Throughput::Elements(1));
        let mut turn = cases.iter().cycle();
        group.bench_function(format!("{name}, alone"), |bencher| {
            bencher.iter(|| turn.next().map(|(case, _)| segments(black_box(case))));
        });
        group.throughput(Throughput::Elements(BLOCK));
        group.bench_function(format!("{name}, in lanes"), |bencher| {
            bencher.iter(|| {
                run_side_by_side(cases.iter().cloned(), |_, run| _ = black_box(run));
            });
        });
    }
    group.finish();
}

fn one_detection(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("one detection");
    // Some take a tenth of a second, and a block of them several.
    group.sample_size(10).measurement_time(Duration::from_secs(3));
    let locked = MethodName::ALL.map(|method| (method, RotorState::Locked, "locked"));
    let free = [MethodName::LineInductanceFast, MethodName::MaximumLikelihood]
        .map(|method| (method, RotorState::Free, "free"));
    for (method, rotor, state) in locked.into_iter().chain(free) {
        let scenario = scenario(method, ErrorSet::Default, rotor);
        let mut trials = (0..BLOCK).cycle();
        group.throughput(Throughput::Elements(1));
        group.bench_function(format!("{method}, {state}, alone"), |bencher| {
            bencher.iter(|| trials.next().map(|trial| scenario.trial(trial)));
        });
        // Of seconds of PWM, fewer.
        let block = if method == MethodName::DcAlignment { 16 } else { BLOCK };
        group.throughput(Throughput::Elements(block));
        group.bench_function(format!("{method}, {state}, in lanes"), |bencher| {
            bencher.iter(|| scenario.trials(0..block, |record| _ = black_box(record)));
        });
    }
    group.finish();
}

fn campaign(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("campaign");
    let trials = 4096;
    group.throughput(Throughput::Elements(trials));
    group.sample_size(10);
    let scenario = scenario(MethodName::LineInductanceFast, ErrorSet::Default, RotorState::Locked);
    for (name, threads) in [("one thread", Some(1)), ("all threads", None)] {
        let campaign = Campaign { scenario: &scenario, trials, threads };
        group.bench_function(name, |bencher| {
            bencher.iter(|| campaign.run(&AtomicBool::new(false), |_| Ok::<(), CampaignError>(())));
        });
    }
    group.finish();
}

criterion_group!(benches, one_segment, one_detection, campaign);
criterion_main!(benches);
