//! What a right-hand side, a detection and a block of trials cost: `cargo bench`, or `cargo bench -- --quick`.

use std::hint::black_box;
use std::sync::atomic::AtomicBool;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use standstill_campaign::{Campaign, CampaignError, ErrorSet, Scenario};
use standstill_detect::{Decay, MethodName};
use standstill_interface::{AlphaBeta, Dq};
use standstill_inverter::{Conduction, Gate};
use standstill_plant::{
    Core, FluxMap, MagneticCircuit, Magnetics, MapPoint, MapSamples, Motor, Pack, Place, built_in,
};
use standstill_sim::{CORE, Flow, LANES, Machine, Motion, PLANE, RotorState, step, step_of_lanes};

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

fn scenario(decay: Decay, rotor: RotorState) -> Scenario {
    Scenario::paper(motor(), ErrorSet::Default, decay, rotor, 1)
}

fn right_hand_side(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("right-hand side");
    group.throughput(Throughput::Elements(1));
    let drive = ErrorSet::Default.drive(8.0, 550.0);
    let saturated = motor();
    let slotted = built_in("slot-harmonics").unwrap_or_else(|| unreachable!("a built-in motor"));
    let kinds = [
        ("saturated", saturated.clone()),
        ("linear", saturated.linearised()),
        ("saturated with harmonics", slotted),
        ("map", mapped(&saturated)),
    ];
    for (name, motor) in kinds {
        for (state, motion) in [("locked", Motion::Held), ("moving", Motion::Forward)] {
            let mut flow = Flow::new(&motor, &drive.bridge, &drive.link, motion);
            flow.turn(motion, 0.75);
            flow.gates = [Gate::High, Gate::Low, Gate::Off];
            flow.conduct([Conduction::UpperSwitch, Conduction::LowerSwitch, Conduction::Blocked]);
            let AlphaBeta { alpha, beta } = motor.open_circuit_flux(0.75);
            let y: [f64; CORE] = [alpha + 0.01, beta, 0.75, 1.0, 550.0];
            group.bench_function(format!("{name}, {state}"), |bencher| {
                bencher.iter(|| flow.derivative(black_box(1e-3), black_box(&y)));
            });
        }
    }
    group.finish();
}

fn one_step(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("one step");
    let drive = ErrorSet::Default.drive(8.0, 550.0);
    let motor = motor();
    let mut flow = Flow::new(&motor, &drive.bridge, &drive.link, Motion::Held);
    flow.turn(Motion::Held, 0.75);
    flow.conduct([Conduction::UpperSwitch, Conduction::LowerSwitch, Conduction::Blocked]);
    let AlphaBeta { alpha, beta } = motor.open_circuit_flux(0.75);
    let (start, slope, tolerance) = ([alpha + 0.01, beta], [100.0, -20.0], [1e-9; PLANE]);
    group.throughput(Throughput::Elements(1));
    group.bench_function("alone", |bencher| {
        bencher.iter(|| step(&flow.machine, black_box(1e-3), &start, black_box(&slope), 2e-5, &tolerance));
    });
    let machines = Machine::side_by_side(&[flow.machine; LANES]);
    let wide = |y: [f64; PLANE]| y.map(|value| Pack([value; LANES]));
    let (start, slope, time, h) = (wide(start), wide(slope), Pack([1e-3; LANES]), Pack([2e-5; LANES]));
    group.throughput(Throughput::Elements(LANES as u64));
    group.bench_function("in lanes", |bencher| {
        bencher
            .iter(|| step_of_lanes(black_box(&machines), &time, &start, black_box(&slope), &h, &tolerance));
    });
    group.finish();
}

fn one_detection(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("one detection");
    group.throughput(Throughput::Elements(1));
    for (name, decay, rotor) in [
        ("slow decay, locked", Decay::Slow, RotorState::Locked),
        ("fast decay, locked", Decay::Fast, RotorState::Locked),
        ("fast decay, free", Decay::Fast, RotorState::Free),
    ] {
        let scenario = scenario(decay, rotor);
        let mut trial = 0;
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                trial += 1;
                scenario.trial(black_box(trial))
            });
        });
    }
    for method in MethodName::ALL {
        // A second and more of PWM: its right-hand sides are those of the injections.
        if method == MethodName::DcAlignment {
            continue;
        }
        let scenario = Scenario::of_method(method, motor(), ErrorSet::Default, RotorState::Locked, 1);
        let mut trial = 0;
        group.bench_function(method.name(), |bencher| {
            bencher.iter(|| {
                trial += 1;
                scenario.trial(black_box(trial))
            });
        });
    }
    group.finish();
}

fn block_of_trials(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("block of trials");
    let trials = 512;
    group.throughput(Throughput::Elements(trials));
    group.sample_size(10);
    let scenario = scenario(Decay::Fast, RotorState::Locked);
    for threads in [1, 2] {
        let campaign = Campaign { scenario: &scenario, trials, threads: Some(threads) };
        group.bench_function(format!("{threads} threads"), |bencher| {
            bencher.iter(|| campaign.run(&AtomicBool::new(false), |_| Ok::<(), CampaignError>(())));
        });
    }
    group.finish();
}

criterion_group!(benches, right_hand_side, one_step, one_detection, block_of_trials);
criterion_main!(benches);
