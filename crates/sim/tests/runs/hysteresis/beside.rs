//! Iron that remembers beside all else: what is shown within steps, terminals that ring, maps that end.

use standstill_interface::Leg::{High, Low, Off};
use standstill_interface::{Command, Sampling};
use standstill_inverter::{Devices, OpenLeg};
use standstill_plant::{Core, FluxMap, Hysteresis, MagneticCircuit, MapPoint, MapSamples, Motor, Place};
use standstill_sim::{Ended, NoProbe, Probe, Run, RunError, Snapshot, Tolerance, referee, run};

use super::bench::*;
use crate::script::*;

/// Snapshots at most so many s apart: times and torques.
struct Torques(f64, Vec<[f64; 2]>);

impl Probe for Torques {
    fn resolution(&self) -> Option<f64> {
        Some(self.0)
    }

    fn snapshot(&mut self, snapshot: &Snapshot) {
        self.1.push([snapshot.time, snapshot.torque]);
    }

    fn event(&mut self, _: f64, _: standstill_sim::Event) {}
}

/// What is shown of a torque within long steps is as exact as the steps: where cells turn on a path that bends, a step's error
/// estimate keeps it so short that a chord in place of the path would be off by 1e-9 N m.
#[test]
fn law_the_torque_within_a_step_is_as_exact_as_the_step() {
    let motor = Motor {
        // So much that the flux's path bends.
        resistance: 60.0,
        ..linear(Hysteresis { coercive_current: 0.5, depth: 0.3, cells: 3 })
    };
    let commands = [([High, Low, Low], 80), ([Low, High, Low], 80), ([Low; 3], 200)]
        .map(|(legs, micros)| Command::hold(stage(legs, micros), Sampling::NONE));
    let torques = |flux: f64, resolution: f64| {
        let mut case = case(&motor, inverter(Devices::default(), OpenLeg::Diodes));
        case.tolerance = Tolerance { flux };
        let mut probe = Torques(resolution, Vec::new());
        let end = run::<f64, _>(&case, &mut Script::new(commands), false, &mut probe);
        (probe.1, end.work.steps)
    };
    let ((exact, many), (usual, few)) = (torques(1e-13, 1e-8), torques(1e-8, 5e-7));
    let mut peak = 0.0_f64;
    let off = |[time, torque]: &[f64; 2]| {
        let after = exact.partition_point(|known| known[0] < *time).clamp(1, exact.len() - 1);
        let ([t0, m0], [t1, m1]) = (exact[after - 1], exact[after]);
        let there = if t1 > t0 { m0 + (m1 - m0) * (time - t0) / (t1 - t0) } else { m1 };
        peak = peak.max(there.abs());
        (torque - there).abs()
    };
    let worst = usual.iter().map(off).fold(0.0, f64::max);
    println!("{many} steps and {few}, {} snapshots: {worst:e} of {peak} N m", usual.len());
    assert!(usual.len() > 700 && 5 * few < many && peak > 1.0);
    assert!(worst < 2e-6 * peak, "{worst:e} of {peak} N m");
}

/// Where terminals ring, cells slide and stick with every swing: the referee has the same currents, and energy goes where the
/// ledger says.
#[test]
fn cross_iron_remembers_beside_terminals_that_ring() {
    for (motor, memory, capacitance) in [
        (of("paper-5k5", 0.01, 3), Some(1.0), 1e-9),
        (of("paper-5k5", 0.001, 3), None, 0.3e-9),
        (of("surface-magnet", 0.002, 2), Some(4.0), 3e-9),
    ] {
        let mut case = case(&motor, inverter(USUAL, OpenLeg::Diodes));
        case.inverter.bridge.terminal_capacitance = capacitance;
        (case.memory, case.tolerance) = (memory, Tolerance { flux: 1e-9 });
        let wait = |micros| sampled(Command::hold(stage([Off; 3], micros), Sampling::NONE), 7);
        for commands in [
            vec![pulse([High, Low, Off], [Off; 3], 60), wait(200)],
            vec![pulse([High, Low, Low], [Low; 3], 40), pulse([Low, High, High], [Off; 3], 40)],
        ] {
            let (ours, readings) = play(&case, &commands);
            let mut strict = case.clone();
            strict.tolerance = Tolerance { flux: 1e-12 };
            let mut script = Script::new(&commands);
            let theirs: Run<f64> = referee(&strict, &mut script, true, &mut NoProbe);
            assert!(!matches!(theirs.ended, Ended::Error(_)), "{:?}", theirs.ended);
            let pairs = readings.iter().zip(&script.readings);
            let off = pairs.flat_map(|(a, b)| (0..3).map(|k| (a.current.0[k] - b.current.0[k]).abs()));
            let worst = off.fold(0.0, f64::max) / motor.rated_current;
            println!(
                "{} {capacitance:e}: {worst:.1e} of rated, {:?} {:?}",
                motor.name, ours.work, theirs.work
            );
            assert_eq!(readings.len(), script.readings.len());
            assert!(worst < 5e-7, "{}: {worst:e} of rated", motor.name);
            for ledger in [ours.ledger, theirs.ledger].map(|ledger| ledger.expect("asked for")) {
                let scale = ledger.copper_loss + ledger.device_loss;
                let left = (ledger.imbalance() / scale).abs();
                assert!(left < 1e-6 && ledger.hysteresis_loss > 0.0, "{}: {left:e} {ledger:?}", motor.name);
            }
        }
    }
}

/// A map that does not know the current that the iron is left with: the run says so instead of beginning elsewhere.
#[test]
fn regress_iron_that_is_left_beyond_the_map_is_no_start() {
    let motor = linear(Hysteresis { coercive_current: 2.0, depth: 0.05, cells: 3 });
    let axis = |k: u8| 1.5 * (f64::from(k) / 5.0 - 1.0);
    let point = |d: usize, q: usize, [i_d, i_q]: [f64; 2]| MapPoint {
        i_d,
        i_q,
        psi_d: 0.45 + 10e-3 * i_d,
        psi_q: 10e-3 * i_q,
        place: Place::Cell(d, q),
    };
    let pairs = (0..11).flat_map(|d| (0..11).map(move |q| (d, q)));
    let points =
        pairs.map(|(d, q)| point(usize::from(d) + 1, usize::from(q) + 1, [axis(d), axis(q)])).collect();
    let samples = MapSamples { file: "linear".to_owned(), points, pole_pairs: None, resistance: None };
    let (map, _) = FluxMap::new(&samples).expect("a map");
    let circuit = |coercive_current| {
        let hysteresis = Hysteresis { coercive_current, depth: 0.05, cells: 3 };
        MagneticCircuit::new(Core::Map(map.clone())).expect("convex").with_hysteresis(Some(hysteresis))
    };
    let commands = [Command::hold(stage([Off; 3], 50), Sampling::NONE)];
    for (coercive, beyond) in [(1.0, false), (2.0, true)] {
        let motor = Motor { magnetics: circuit(coercive), ..motor.clone() };
        let mut case = case(&motor, inverter(USUAL, OpenLeg::Diodes));
        case.memory = Some(0.35);
        let run: Run<f64> = run(&case, &mut Script::new(commands), false, &mut NoProbe);
        let left = Ended::Error(RunError::LeftMap { current_ma: [-2000, 0] });
        assert_eq!(run.ended == left, beyond, "{:?}", run.ended);
    }
}

/// A leg that ceases to conduct moves the flux by next to nothing at once; cells that were next to their ends go on all the same.
#[test]
fn regress_a_cell_near_its_end_where_a_leg_is_blocked() {
    let motor = of("paper-5k5", 0.01, 3);
    let mut failed = Vec::new();
    for number in 0..1500_u32 {
        let mut case = case(&motor, inverter(USUAL, OpenLeg::Diodes));
        case.start_angle = 0.7 * f64::from(number);
        case.memory = Some(1.9 * f64::from(number));
        case.tolerance = Tolerance { flux: 8.5e-10 };
        let [(_, fast), ..] = sequences(80);
        let run: Run<f64> = run(&case, &mut Script::new(&fast), false, &mut NoProbe);
        if matches!(run.ended, Ended::Error(_)) {
            failed.push((number, run.duration.0));
        }
    }
    assert!(failed.is_empty(), "{} {failed:?}", failed.len());
}

/// The same where PWM takes a leg's current through zero and a cell turns back.
#[test]
fn regress_a_cell_that_turns_back_where_a_leg_is_blocked() {
    let motor = of("paper-5k5", 0.01, 3);
    let mut failed = Vec::new();
    for number in 0..400_u32 {
        let mut case = case(&motor, inverter(USUAL, OpenLeg::Diodes));
        case.start_angle = 0.7 * f64::from(number);
        case.memory = Some(1.9 * f64::from(number));
        case.tolerance = Tolerance { flux: 8.5e-10 };
        let around = |turn: f64| {
            let duty = |phase: f64| {
                standstill_interface::Leg::Duty(0.5 + 0.1 * (turn * 0.314 - phase * 2.0944).cos())
            };
            Command::hold(stage([duty(0.0), duty(1.0), duty(2.0)], 100), Sampling::NONE)
        };
        let commands: Vec<_> = (0..100).map(|n| around(f64::from(n))).collect();
        let run: Run<f64> = run(&case, &mut Script::new(&commands), false, &mut NoProbe);
        if matches!(run.ended, Ended::Error(_)) {
            failed.push((number, run.duration.0));
        }
    }
    assert!(failed.is_empty(), "{} {failed:?}", failed.len());
}
