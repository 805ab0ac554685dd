//! What a right-hand side, a step, a segment, a detection and a block of trials cost, alone and side by side: `cargo bench`,
//! or `cargo bench -- --quick`.

use std::hint::black_box;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use standstill_campaign::{Campaign, CampaignError, ErrorSet, Scenario};
use standstill_detect::{Method, MethodName, Settings};
use standstill_interface::{
    AlphaBeta, Command, Detector, Dq, Fault, Findings, Nanos, Outcome, Phase, Reading, Sampling, Stage, Step,
};
use standstill_inverter::{Conduction, Gate};
use standstill_plant::{
    Core, FluxMap, MagneticCircuit, Magnetics, MapPoint, MapSamples, Motor, Place, built_in,
};
use standstill_sim::reference::run_side_by_side;
use standstill_sim::{Ask, Bank, CORE, Flow, LANES, Motion, NoProbe, PLANE, RotorState, lockstep, run};

/// Trials side by side: several times the lanes, so that those which stay empty at the end count little.
const BLOCK: u64 = 64;

const TOLERANCE: [f64; CORE] = [1e-9; CORE];

fn motor() -> Motor {
    built_in("paper-5k5").unwrap_or_else(|| unreachable!("a built-in motor"))
}

/// The motor with a map of its core, 31 × 31 points.
fn mapped(motor: &Motor) -> Motor {
    let axis = |k: u8| 1.5 * motor.rated_current * (f64::from(k) / 15.0 - 1.0);
    let points = (0..31).flat_map(|d| (0..31).map(move |q| (d, q))).filter_map(|(d, q)| {
        let (i_d, i_q) = (axis(d), axis(q));
        let flux = motor.magnetics.core().flux_at(Dq::new(i_d, i_q)).ok()?;
        Some(MapPoint { i_d, i_q, psi_d: flux.d, psi_q: flux.q, place: Place::Cell(d.into(), q.into()) })
    });
    let samples =
        MapSamples { file: String::new(), points: points.collect(), pole_pairs: None, resistance: None };
    let (map, _) = FluxMap::new(&samples).unwrap_or_else(|error| unreachable!("{error}"));
    let magnetics = MagneticCircuit::new(Core::Map(map)).unwrap_or_else(|error| unreachable!("{error}"));
    Motor { magnetics, ..motor.clone() }
}

fn scenario(method: MethodName, errors: ErrorSet, rotor: RotorState) -> Scenario<Method<f64>> {
    Scenario::of_method(method, motor(), errors, rotor, 1)
}

/// A machine during a line pulse.
fn pulsed<'a>(motor: &'a Motor, drive: &'a Scenario<Method<f64>>, motion: Motion) -> (Flow<'a>, [f64; CORE]) {
    let mut flow = Flow::new(motor, &drive.drive.bridge, &drive.drive.link, motion);
    flow.turn(motion, 0.75);
    flow.gates = [Gate::High, Gate::Low, Gate::Off];
    flow.conduct([Conduction::UpperSwitch, Conduction::LowerSwitch, Conduction::Blocked]);
    let AlphaBeta { alpha, beta } = motor.open_circuit_flux(0.75);
    (flow, [alpha + 0.01, beta, 0.75, 1.0, 550.0])
}

fn ask<'a, const N: usize>(flow: &'a Flow, state: &[f64; CORE]) -> Ask<'a, N> {
    let start = std::array::from_fn(|n| state[n]);
    Ask { machine: &flow.machine, limits: &flow.limits, time: 1e-3, start, h: 2e-5 }
}

/// The same machine in each lane.
fn bank<'a>(flow: &Flow<'a>) -> Bank<'a> {
    let mut bank = Bank::new(flow.machine.motor, flow.machine.link, TOLERANCE);
    (0..LANES).for_each(|lane| bank.seat(lane, &flow.machine, &flow.limits));
    bank
}

/// Right-hand sides and steps of one machine, with a state of `N` numbers.
fn kernels<const N: usize>(criterion: &mut Criterion, name: &str, flow: &Flow, state: &[f64; CORE]) {
    let tolerance: [f64; N] = std::array::from_fn(|n| TOLERANCE[n]);
    let put = |bank: &mut Bank| (0..LANES).for_each(|lane| bank.put(lane, &black_box(ask::<N>(flow, state))));

    let mut group = criterion.benchmark_group("right-hand side");
    group.throughput(Throughput::Elements(1));
    let (terminals, ask_alone) = (flow.machine.terminals(), ask::<N>(flow, state));
    group.bench_function(format!("{name}, alone"), |bencher| {
        bencher.iter(|| {
            flow.machine.evaluate(&terminals, black_box(ask_alone.time), black_box(&ask_alone.start)).slope
        });
    });
    let mut lanes = bank(flow);
    put(&mut lanes);
    group.throughput(Throughput::Elements(LANES as u64));
    group.bench_function(format!("{name}, in lanes"), |bencher| {
        bencher.iter(|| black_box(&mut lanes).slopes::<N>(flow.machine.moves));
    });
    group.finish();

    let mut group = criterion.benchmark_group("one step");
    group.throughput(Throughput::Elements(1));
    group.bench_function(format!("{name}, alone"), |bencher| {
        bencher.iter(|| black_box(ask_alone).stride(&tolerance));
    });
    group.throughput(Throughput::Elements(LANES as u64));
    group.bench_function(format!("{name}, in lanes"), |bencher| {
        // With all that machines put into their lanes and take out of them.
        bencher.iter(|| {
            put(&mut lanes);
            lanes.step();
            (0..LANES).for_each(|lane| _ = black_box(lanes.take::<N>(lane)));
        });
    });
    group.finish();
}

fn machines(criterion: &mut Criterion) {
    let drive = scenario(MethodName::LineInductance, ErrorSet::Default, RotorState::Locked);
    let saturated = motor();
    let slotted = built_in("slot-harmonics").unwrap_or_else(|| unreachable!("a built-in motor"));
    let kinds = [
        ("saturated", saturated.clone()),
        ("linear", saturated.linearised()),
        ("saturated with harmonics", slotted),
        ("map", mapped(&saturated)),
    ];
    for (name, motor) in kinds {
        let (held, state) = pulsed(&motor, &drive, Motion::Held);
        kernels::<PLANE>(criterion, &format!("{name}, locked"), &held, &state);
        let (moving, state) = pulsed(&motor, &drive, Motion::Forward);
        kernels::<CORE>(criterion, &format!("{name}, moving"), &moving, &state);
    }
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
                let (motor, link) = (&scenario.motor, &scenario.drive.link);
                run_side_by_side(motor, link, cases.iter().cloned(), |_, run| _ = black_box(run));
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

/// Blocks of detections in the lanes of the present engine and of the one that is to take over.
fn engines(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("engines");
    group.sample_size(10).measurement_time(Duration::from_secs(3)).throughput(Throughput::Elements(BLOCK));
    let free = (MethodName::LineInductanceFast, RotorState::Free, "free");
    let locked = [
        MethodName::LineInductance,
        MethodName::LineInductanceFast,
        MethodName::Bipolar,
        MethodName::MaximumLikelihood,
        MethodName::HfiRotating,
    ]
    .map(|method| (method, RotorState::Locked, "locked"));
    for (method, rotor, state) in locked.into_iter().chain([free]) {
        let scenario = scenario(method, ErrorSet::Default, rotor);
        let cases =
            || (0..BLOCK).filter_map(|k| Some((scenario.case(k), scenario.detector.detector().ok()?)));
        group.bench_function(format!("{method}, {state}, present"), |bencher| {
            bencher.iter(|| {
                run_side_by_side(&scenario.motor, &scenario.drive.link, cases(), |_, run| _ = black_box(run));
            });
        });
        group.bench_function(format!("{method}, {state}, lockstep"), |bencher| {
            bencher.iter(|| lockstep::run_side_by_side(cases(), |_, run| _ = black_box(run)));
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

criterion_group!(benches, machines, one_segment, one_detection, engines, campaign);
criterion_main!(benches);
