//! Terminals with a capacitance: closed forms, the energy ledger, and the referee. Against ngspice: `tests/suite/spice.rs`.
#![allow(clippy::disallowed_methods, reason = "tests compare with the C library")]

use standstill_interface::{Command, Leg, Nanos, Reading, Sampling};
use standstill_inverter::{Bridge, DcLink, DeviceKind, Devices, GateTiming, Inverter, OpenLeg, Storage};
use standstill_plant::{Core, EddyBranch, Linear, MagneticCircuit, Motor, Winding, built_in};
use standstill_sim::{
    Case, Ended, NoProbe, RotorState, Run, RunError, SensorSettings, Sensors, Tolerance, Trace, referee, run,
};

mod late;
mod loads;
mod mosfets;
mod sensors;

use crate::script::*;
use Leg::{Duty, High, Low, Off};

fn hold(legs: [Leg<f64>; 3], micros: u64) -> Command<f64> {
    Command::hold(stage(legs, micros), Sampling::NONE)
}

/// A linear motor without saliency, of this inductance in H and resistance in Ω.
fn linear(inductance: f64, resistance: f64) -> Motor {
    let winding = Winding { mean_inductance: inductance / 1.5, saliency: 0.0, leakage: 0.0 };
    let core = Core::Linear(Linear::from_winding(&winding, 0.45));
    let magnetics = MagneticCircuit::new(core).expect("linear");
    Motor { resistance, winding, magnetics, ..built_in("paper-5k5").expect("built in") }
}

/// Ideal switches; usual ones with dead time; MOSFETs.
fn inverter(devices: Devices, open_leg: OpenLeg, capacitance: f64, link: f64) -> Inverter {
    let dead_time = Nanos::from_micros(u64::from(devices != Devices::default()) * 2);
    Inverter {
        bridge: Bridge { devices, open_leg, terminal_capacitance: capacitance, ..Bridge::default() },
        gates: [GateTiming { dead_time, ..GateTiming::default() }; 3],
        link: DcLink::stiff(link),
        carrier_period: Nanos::from_micros(100),
    }
}

const USUAL: Devices = Devices {
    kind: DeviceKind::Igbt,
    switch_drop: 0.9,
    switch_resistance: 50e-3,
    diode_drop: 1.0,
    diode_resistance: 30e-3,
};

const MOSFETS: Devices = Devices {
    kind: DeviceKind::Mosfet,
    switch_drop: 0.0,
    switch_resistance: 2e-3,
    diode_drop: 0.8,
    diode_resistance: 1e-3,
};

fn case(motor: &Motor, inverter: Inverter) -> Case<'_> {
    let flux = 1e-7 * motor.winding.mean_inductance * motor.rated_current;
    let tolerance = Tolerance { flux: flux.min(1e-9) };
    Case { start_angle: 0.35, tolerance, ..Case::new(motor, inverter) }
}

fn play(case: &Case, commands: &[Command<f64>]) -> (Run<f64>, Vec<Reading<f64>>) {
    let mut script = Script::new(commands);
    let run = run(case, &mut script, true, &mut NoProbe);
    (run, script.readings)
}

/// One terminal rings with the winding at 1/(2π √(1.5 L C)) about the rail of the two others.
#[test]
fn analytic_an_open_terminal_rings_with_the_winding() {
    for (inductance, capacitance, hertz) in
        [(13e-3, 1e-9, 36.0e3), (13e-3, 0.1e-9, 114.0e3), (13e-3, 10e-9, 11.4e3), (27e-6, 1e-9, 0.79e6)]
    {
        let motor = linear(inductance, 1e-6);
        let case = case(&motor, inverter(Devices::default(), OpenLeg::Open, capacitance, LINK));
        let mut trace = Trace::new(3e-7);
        run::<f64, _>(&case, &mut Script::new([hold([High, High, Off], 200)]), false, &mut trace);
        let angular = 1.0 / (1.5 * inductance * capacitance).sqrt();
        assert!((angular / std::f64::consts::TAU / hertz - 1.0).abs() < 0.01, "{angular}");
        assert!(trace.snapshots.len() > 600);
        for snapshot in &trace.snapshots[1..] {
            let angle = angular * snapshot.time;
            let potential = LINK - LINK / 2.0 * angle.cos();
            let current = -LINK / 2.0 * capacitance * angular * angle.sin();
            let [_, _, v] = snapshot.potential;
            let size = LINK * capacitance * angular;
            assert!((v - potential).abs() < 1e-5 * LINK, "{} s: {v} {potential}", snapshot.time);
            assert!((snapshot.current[2] - current).abs() < 1e-5 * size, "{} s: {current}", snapshot.time);
        }
    }
}

/// The same with a resistance: the swing decays by e^(−t R/(2 · 1.5 L)), also long after, within steps of many periods. What it has
/// stored turns into the winding's heat.
#[test]
fn analytic_what_rings_decays_with_the_resistance_that_it_meets() {
    // So many µs are twelve times the quality in periods.
    for (inductance, capacitance, quality, micros) in
        [(13e-3, 0.3e-9, 5.0, 920_u32), (13e-3, 10e-9, 2.0, 2200), (27e-6, 1e-9, 50.0, 760)]
    {
        let motor = linear(inductance, 1e-6);
        let (loops, least) = (1.5 * inductance, 1e-6);
        let resistance = f64::sqrt(loops / capacitance) / quality;
        let mut inverter = inverter(Devices::default(), OpenLeg::Open, capacitance, LINK);
        inverter.bridge.terminal_resistance = resistance;
        let case = case(&motor, inverter);
        let (decay, square) = (resistance / (2.0 * loops), 1.0 / (loops * capacitance));
        let angular = (square - decay * decay).sqrt();
        let long = f64::from(micros) * 1e-6;
        let mut trace = Trace::new(long / 997.0);
        let mut script = Script::new([hold([High, High, Off], u64::from(micros))]);
        let run = run::<f64, _>(&case, &mut script, true, &mut trace);
        assert!(trace.snapshots.len() > 200, "{}", trace.snapshots.len());
        for snapshot in &trace.snapshots[1..] {
            let (time, angle) = (snapshot.time, angular * snapshot.time);
            let swing = (-decay * time).exp();
            let potential = LINK - LINK / 2.0 * swing * (angle.cos() + decay / angular * angle.sin());
            let current = -LINK / 2.0 * capacitance * square / angular * swing * angle.sin();
            let [_, _, v] = snapshot.potential;
            assert!((v - potential).abs() < least * LINK, "{time} s: {v} {potential}");
            let size = LINK * capacitance * angular;
            assert!((snapshot.current[2] - current).abs() < least * size, "{time} s: {current}");
        }
        let ledger = run.ledger.expect("asked for");
        let swung = 0.5 * capacitance * (LINK / 2.0).powi(2) * (1.0 - (-2.0 * decay * long).exp());
        // A hair is lost as the terminals that are switched on are charged: that is the devices'.
        assert!((ledger.copper_loss / swung - 1.0).abs() < 1e-5, "{ledger:?} {swung}");
        // What is left are steps' errors: a millionth of what the rails give and take back.
        assert!((ledger.imbalance() / swung).abs() < 5e-5, "{ledger:?}");
    }
}

/// Two or three terminals that float ring in both directions of the winding. Three: with 1/√(L C) and the resistance of one phase
/// against the two others. Two: likewise across the third's axis; along it with 1/√(3 L C) and a third of the resistance.
#[test]
fn analytic_terminals_that_ring_together_each_meet_their_resistance() {
    let (inductance, capacitance) = (13e-3, 1e-9);
    let motor = linear(inductance, 1e-6);
    let resistance = f64::sqrt(1.5 * inductance / capacitance) / 5.0;
    let clarke = |[a, b, c]: [f64; 3]| [(2.0 * a - b - c) / 3.0, (b - c) / f64::sqrt(3.0)];
    for (legs, along, quality) in [([Off; 3], 1.0, 4.082_483), ([Low, Off, Off], 3.0, 7.071_068)] {
        let mut inverter = inverter(Devices::default(), OpenLeg::Open, capacitance, LINK);
        inverter.bridge.terminal_resistance = resistance;
        let case = case(&motor, inverter);
        let mut trace = Trace::new(3e-7);
        let mut script = Script::new([hold([Low, High, Off], 1), hold(legs, 600)]);
        let run = run::<f64, _>(&case, &mut script, true, &mut trace);
        let after: Vec<_> = trace.snapshots.iter().filter(|snapshot| snapshot.time >= 1e-6).collect();
        let [first, .., last] = after[..] else { panic!("no trace") };
        let [from, [_, rising]] = [first.current, first.potential].map(clarke);
        assert!(after.len() > 1900 && from[0].abs() > 0.02 && rising > 100.0, "{first:?}");
        for (axis, share) in [along, 1.0].into_iter().enumerate() {
            let decay = resistance / share / (2.0 * inductance);
            let square = 1.0 / (inductance * capacitance * share);
            let angular = (square - decay * decay).sqrt();
            if axis == 0 {
                assert!((square.sqrt() / (2.0 * decay) / quality - 1.0).abs() < 1e-6);
            }
            let [start, voltage] = [first.current, first.potential].map(|of| clarke(of)[axis]);
            for snapshot in &after {
                let time = snapshot.time - first.time;
                let (sin, cos) = (angular * time).sin_cos();
                let swing = (-decay * time).exp();
                let rise = voltage / inductance - decay * start;
                let fall = decay * voltage - start / (capacitance * share);
                let current = swing * (start * cos + rise / angular * sin);
                let potential = swing * (voltage * cos + fall / angular * sin);
                let [i, v] = [snapshot.current, snapshot.potential].map(|of| clarke(of)[axis]);
                assert!((v - potential).abs() < 1e-6 * LINK, "{legs:?} {time} s: {v} {potential}");
                let size = LINK * capacitance * square.sqrt();
                assert!((i - current).abs() < 1e-6 * size, "{legs:?} {time} s: {i} {current}");
            }
        }
        let stored = |snapshot: &standstill_sim::Snapshot| {
            let sum = |of: [f64; 3]| of.iter().map(|x| x * x).sum::<f64>() / 2.0;
            inductance * sum(snapshot.current) + capacitance * sum(snapshot.potential)
        };
        let (lost, ledger) = (stored(first) - stored(last), run.ledger.expect("asked for"));
        // Before, within the first microsecond, the winding has lost a little, too.
        assert!((ledger.copper_loss / lost - 1.0).abs() < 0.01, "{ledger:?} {lost}");
        assert!((ledger.imbalance() / lost).abs() < 3e-5, "{ledger:?}");
    }
}

/// A switch that comes on charges its terminal at once: what the rail gives is C U ΔU, and what does not stay is lost.
#[test]
fn analytic_hard_switching_loses_half_c_u_squared() {
    let capacitance = 1e-9;
    // So much resistance that nothing rings: in the end all terminals have the rail's potential.
    let motor = linear(13e-3, 30e3);
    let case = case(&motor, inverter(Devices::default(), OpenLeg::Diodes, capacitance, LINK));
    let (step, square) = (LINK / 2.0, capacitance * LINK * LINK);
    let at_once = play(&case, &[hold([High, Off, Off], 2000)]).0.ledger.expect("asked for");
    let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-6, "{a} {b}");
    close(at_once.device_loss, 0.5 * capacitance * step * step);
    close(at_once.source, 3.0 * capacitance * LINK * step);
    close(at_once.terminal_change, 3.0 * 0.5 * capacitance * (LINK * LINK - step * step));
    // What two terminals are charged with through a resistance loses as much again each.
    close(at_once.copper_loss, 2.0 * 0.5 * capacitance * step * step);
    // Down to the other rail: all that was stored is lost, and the source gives nothing.
    let commands = [hold([High, Off, Off], 2000), hold([Low, Off, Off], 2000)];
    let both = play(&case, &commands).0.ledger.expect("asked for");
    close(both.source, at_once.source);
    close(both.device_loss - at_once.device_loss, 0.5 * square);
    close(both.terminal_change, -3.0 * 0.5 * capacitance * step * step);
    // From a capacitor it comes out of that.
    let mut stored = case;
    stored.inverter.link.storage = Some(Storage { capacitance: 100e-6, source_resistance: 0.2 });
    let (run, _) = play(&stored, &commands);
    let ledger = run.ledger.expect("asked for");
    assert!((ledger.imbalance() / square).abs() < 1e-5, "{ledger:?}");
}

/// With all legs off nothing leaves the terminals together: the sum of their potentials stays until a diode conducts.
#[test]
fn law_the_star_point_follows_from_the_sum_of_currents() {
    let motor = built_in("paper-5k5").expect("built in");
    let case = case(&motor, inverter(Devices::default(), OpenLeg::Open, 1e-9, LINK));
    let mut trace = Trace::new(1e-6);
    run::<f64, _>(
        &case,
        &mut Script::new([hold([High, Low, Off], 20), hold([Off; 3], 300)]),
        false,
        &mut trace,
    );
    let after: Vec<_> = trace.snapshots.iter().filter(|snapshot| snapshot.time > 20.5e-6).collect();
    let sum = |v: [f64; 3]| v.iter().sum::<f64>();
    let (lowest, highest) =
        after.iter().map(|s| s.potential[0]).fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
    assert!(after.len() > 200 && highest - lowest > 300.0, "they ring: {lowest} to {highest} V");
    for snapshot in &after {
        assert!((sum(snapshot.potential) - sum(after[0].potential)).abs() < 1e-9 * LINK, "{snapshot:?}");
        assert!(sum(snapshot.current).abs() < 1e-12);
    }
}

/// Pulses of lines with either decay, vectors and PWM: on-times as a motor of this rated time constant needs them.
fn sequences(micros: u64) -> [(&'static str, Vec<Command<f64>>); 4] {
    let pulse = |legs, then, times| {
        sampled(Command::sequence(stage(legs, micros), stage(then, times * micros), Sampling::NONE), 10)
    };
    let pwm = |a, b, c| sampled(Command::hold(stage([Duty(a), Duty(b), Duty(c)], 1000), Sampling::NONE), 20);
    [
        ("fast", vec![pulse([High, Low, Off], [Off; 3], 19), pulse([Off, High, Low], [Off; 3], 19)]),
        (
            "slow",
            vec![pulse([Low, High, Off], [Low, Low, Off], 19), pulse([Low, Off, High], [Low, Off, Low], 19)],
        ),
        ("vector", vec![pulse([High, Low, Low], [Off; 3], 19), pulse([Low, High, High], [Low; 3], 9)]),
        ("pwm", vec![pwm(0.6, 0.45, 0.41), pwm(0.45, 0.52, 0.55)]),
    ]
}

#[test]
fn cross_the_referee_has_the_same_currents() {
    let mut motors: Vec<(Motor, Devices, u64, f64)> =
        ["paper-5k5", "pm-reluctance", "gearless-hoist", "slot-harmonics"]
            .map(|name| (built_in(name).expect("built in"), USUAL, 80, BOUND))
            .into();
    let eddy = EddyBranch { time_constant: 60e-6, d_depth: 0.25, q_depth: 0.15 };
    let paper = motors[0].0.clone();
    let magnetics = paper.magnetics.clone().with_eddy_currents(Some(eddy));
    // What lags behind is carried by cubics through all that rings.
    motors.push((Motor { magnetics, ..paper }, USUAL, 80, 2e-6));
    motors.extend(
        ["light-vehicle", "gimbal"].map(|name| (built_in(name).expect("built in"), MOSFETS, 10, 1e-6)),
    );
    for ((motor, devices, micros, bound), quality) in
        motors.into_iter().flat_map(|motor| [None, Some(5.0)].map(|quality| (motor.clone(), quality)))
    {
        // The referee is slow: rotors that move once with usual and once with low voltage.
        let moves = matches!(motor.name.as_str(), "paper-5k5" | "light-vehicle");
        for rotor in [RotorState::Locked, RotorState::Free].into_iter().take(1 + usize::from(moves)) {
            let link = motor.dc_link.unwrap_or(LINK);
            let mut case = case(&motor, inverter(devices, OpenLeg::Diodes, 0.3e-9, link));
            case.inverter.link.ripple = 0.002;
            case.rotor = rotor;
            if let Some(quality) = quality {
                let impedance = (1.5 * motor.winding.q_axis_inductance() / 0.3e-9).sqrt();
                case.inverter.bridge.terminal_resistance = impedance / quality;
            }
            for (name, commands) in sequences(micros) {
                let (ours, readings) = play(&case, &commands);
                let mut strict = case.clone();
                strict.tolerance = Tolerance { flux: 1e-4 * case.tolerance.flux };
                let mut script = Script::new(&commands);
                let theirs: Run<f64> = referee(&strict, &mut script, false, &mut NoProbe);
                for run in [&ours, &theirs] {
                    let fails = matches!(run.ended, Ended::Error(_));
                    assert!(!fails, "{} {rotor:?} {name}: {:?} {:?}", motor.name, run.ended, run.work);
                }
                let pairs = readings.iter().zip(&script.readings);
                let off = pairs.flat_map(|(a, b)| (0..3).map(|k| (a.current.0[k] - b.current.0[k]).abs()));
                let worst = off.fold(0.0, f64::max) / motor.rated_current;
                let ledger = ours.ledger.expect("asked for");
                let scale = ledger.copper_loss + ledger.device_loss + ledger.shaft_work.abs();
                let left = (ledger.imbalance() / scale).abs();
                println!(
                    "{} {rotor:?} {quality:?} {name}: {worst:.1e} of rated, {left:.1e}, {:?}",
                    motor.name, ours.work
                );
                assert!(readings.len() >= 20 && ours.work.events > 2);
                assert!(worst < bound, "{} {rotor:?} {name}: {worst:e} of rated", motor.name);
                assert!(left < 2e-5, "{} {rotor:?} {name}: {ledger:?}", motor.name);
            }
        }
    }
}

/// As a share of rated current.
const BOUND: f64 = 5e-7;

#[test]
fn law_a_run_has_the_same_bits_in_lanes_of_each_width() {
    let motor = built_in("paper-5k5").expect("built in");
    let mut low = case(&motor, inverter(USUAL, OpenLeg::Diodes, 0.3e-9, LINK));
    low.sensors = Sensors::nominal(SensorSettings { bandwidth: Some(200e3), ..SensorSettings::IDEAL });
    let cases: Vec<_> = (0..20)
        .map(|k| {
            let mut case = low.clone();
            case.start_angle = 0.3 * f64::from(k);
            case.inverter.bridge.terminal_capacitance = 1e-10 * f64::from(1 + k);
            let [(_, fast), (_, slow), _, _] = sequences(80);
            (case, Script::new(if k % 3 == 0 { &fast } else { &slow }))
        })
        .collect();
    same_bits_in_lanes(&cases);
}

/// A potential that the link takes along while no current flows neither ends nor begins a mode without end.
#[test]
fn regress_a_terminal_that_follows_the_link_does_not_chatter() {
    let motor = built_in("paper-5k5").expect("built in");
    for devices in [Devices::default(), USUAL] {
        let mut case = case(&motor, inverter(devices, OpenLeg::Diodes, 0.3e-9, LINK));
        case.inverter.link.ripple = 0.002;
        let pulse =
            Command::sequence(stage([High, Low, Off], 80), stage([Low, Low, Off], 920), Sampling::NONE);
        let (run, _) = play(&case, &[sampled(pulse, 1000), sampled(pulse, 1000)]);
        assert!(
            !matches!(run.ended, Ended::Error(RunError::Chatter(_))) && run.work.events < 200,
            "{:?}",
            run.work
        );
    }
}
