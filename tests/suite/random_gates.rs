//! Random gate sequences: every leg state, at any time, on every motor. Whatever the legs do, energy is conserved,
//! nothing chatters, and from rest on a dead link nothing ever flows.

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use standstill_interface::{Abc, Command, Leg, Nanos, Sampling, Stage};
use standstill_inverter::{Bridge, DcLink, DeviceKind, Devices, GateTiming, Inverter, OpenLeg, Storage};
use standstill_plant::Motor;
use standstill_sim::{Ended, NoProbe, Play, RotorState, Run, Tolerance, run};

use crate::bench::{Script, all_kinds_of_motors, exact_case, ideal_inverter};

fn random_leg(rng: &mut impl Rng) -> Leg<f64> {
    match rng.random_range(0..4) {
        0 => Leg::Off,
        1 => Leg::Low,
        2 => Leg::High,
        _ => Leg::Duty(rng.random_range(0.0..1.0)),
    }
}

/// A quarter of a dozen to a dozen commands of 1 µs to 0.4 ms.
fn random_commands(rng: &mut impl Rng) -> Vec<Command<f64>> {
    let count = rng.random_range(3..12);
    (0..count)
        .map(|_| {
            let legs = Abc::new(random_leg(rng), random_leg(rng), random_leg(rng));
            let duration = Nanos(rng.random_range(1_000..400_000));
            Command::hold(Stage { legs, duration }, Sampling::once(duration))
        })
        .collect()
}

fn random_inverter(rng: &mut impl Rng) -> Inverter {
    let real = Devices {
        kind: DeviceKind::Igbt,
        switch_drop: 0.9,
        switch_resistance: 0.05,
        diode_drop: 1.0,
        diode_resistance: 0.03,
    };
    let devices = if rng.random_bool(0.3) { Devices::default() } else { real };
    let mosfets = Devices { kind: DeviceKind::Mosfet, switch_drop: 0.0, ..devices };
    let devices = if rng.random_bool(0.4) { mosfets } else { devices };
    let timing = |dead: u64, rng: &mut dyn FnMut() -> u64| GateTiming {
        turn_off_delay: Nanos(rng()),
        turn_on_delay: Nanos(rng()),
        dead_time: Nanos(dead),
    };
    let dead = if rng.random_bool(0.5) { 2000 } else { 0 };
    let mut delay = || rng.random_range(0..300);
    let gates = [timing(dead, &mut delay), timing(dead, &mut delay), timing(dead, &mut delay)];
    let storage = rng.random_bool(0.3).then_some(Storage { capacitance: 300e-6, source_resistance: 0.3 });
    Inverter {
        bridge: Bridge { devices, open_leg: OpenLeg::Diodes, ..Bridge::default() },
        gates,
        link: DcLink { ripple: 0.01, storage, ..DcLink::stiff(550.0) },
        carrier_period: Nanos::from_micros(100),
    }
}

fn play(
    motor: &Motor,
    inverter: Inverter,
    commands: Vec<Command<f64>>,
    load_torque: f64,
    rng: &mut impl Rng,
) -> Run<f64> {
    let mut case = exact_case(motor, inverter, rng.random_range(0.0..360.0));
    case.inverter.link.voltage = suited_link(motor, case.inverter.link.voltage);
    case.rotor = match rng.random_range(0..3) {
        0 => RotorState::Free,
        1 => RotorState::Locked,
        _ => RotorState::Braked(Play {
            below: rng.random_range(0.0..1e-3),
            above: rng.random_range(0.0..1e-3),
        }),
    };
    case.load_torque = load_torque;
    case.tolerance = Tolerance { flux: 1e-14 };
    run(&case, &mut Script::new(commands), true, &mut NoProbe)
}

/// Motors of 12 V do not run on 550 V: this voltage in V, or one that makes rated current in 20 µs.
fn suited_link(motor: &Motor, voltage: f64) -> f64 {
    voltage.min(5e4 * motor.winding.mean_inductance * motor.rated_current)
}

/// promise: energy-balance
#[test]
fn law_energy_is_conserved_over_random_gate_sequences() {
    energy_is_conserved(400);
}

/// promise: energy-balance
#[test]
#[ignore = "more sequences: scripts/test-all.sh long"]
fn law_energy_is_conserved_over_a_thousand_random_gate_sequences() {
    energy_is_conserved(1000);
}

fn energy_is_conserved(sequences: usize) {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let motors = all_kinds_of_motors();
    let mut seen = [0.0; 5];
    for sequence in 0..sequences {
        let motor = &motors[sequence % motors.len()];
        let (inverter, commands) = (random_inverter(&mut rng), random_commands(&mut rng));
        let load_torque = if sequence % 5 == 0 { rng.random_range(-3.0..3.0) } else { 0.0 };
        let run = play(motor, inverter.clone(), commands.clone(), load_torque, &mut rng);
        assert!(matches!(run.ended, Ended::Outcome(_)), "{sequence}: {:?} {commands:?}", run.ended);
        let ledger = run.ledger.expect("asked for");
        // A sequence in which next to nothing flowed has nothing to be relative to.
        let scale = ledger.copper_loss
            + ledger.device_loss
            + ledger.field_change.abs()
            + ledger.link_change.abs()
            + 1e-3;
        let relative = ledger.imbalance() / scale;
        let mechanical = ledger.mechanical_imbalance() / scale;
        assert!(
            relative.abs() < 2e-8 && mechanical.abs() < 2e-8,
            "{sequence}, {}: {relative:e}\n{ledger:?}\n{inverter:?}\n{commands:?}",
            motor.name
        );
        let losses = [
            ledger.copper_loss,
            ledger.device_loss,
            ledger.eddy_loss,
            ledger.friction_loss,
            ledger.impact_loss,
        ];
        assert!(losses.iter().all(|loss| *loss >= 0.0), "{ledger:?}");
        seen = std::array::from_fn(|k| seen[k] + losses[k]);
    }
    assert!(seen.iter().all(|loss| *loss > 0.0), "each kind of loss must occur: {seen:?}");
}

#[test]
fn law_on_a_dead_link_nothing_flows_whatever_the_gates_do() {
    // Links of 0 V and a rotor at rest: nothing may ever flow.
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    for motor in all_kinds_of_motors() {
        for _ in 0..20 {
            let mut inverter = ideal_inverter(OpenLeg::Diodes);
            inverter.link = DcLink::stiff(0.0);
            let commands = random_commands(&mut rng);
            let mut motor = motor.clone();
            motor.rotor.cogging = None;
            let run = play(&motor, inverter, commands, 0.0, &mut rng);
            // What rounding leaves of the current at rest turns a free rotor by next to nothing.
            assert!(run.peak_current < 1e-13 * motor.rated_current && run.moved < 1e-15, "{run:?}");
        }
    }
}

/// Plays commands on a free rotor of this motor and gives the currents sampled.
fn currents(motor: &Motor, commands: Vec<Command<f64>>, angle: f64) -> Vec<[f64; 3]> {
    let mut case = exact_case(motor, ideal_inverter(OpenLeg::Diodes), angle);
    case.inverter.link.voltage = suited_link(motor, case.inverter.link.voltage);
    case.rotor = RotorState::Free;
    case.tolerance = Tolerance { flux: 1e-12 };
    let mut script = Script::new(commands);
    let end = run(&case, &mut script, false, &mut NoProbe).ended;
    assert!(matches!(end, Ended::Outcome(_)), "{end:?}");
    script.readings.iter().map(|reading| reading.current.0).collect()
}

/// The commands with the legs' roles changed: leg k takes that of leg `from[k]`.
fn exchanged(commands: &[Command<f64>], from: [usize; 3]) -> Vec<Command<f64>> {
    let exchange = |command: &Command<f64>| {
        let Abc(legs) = command.stage.legs;
        let stage = Stage { legs: Abc(from.map(|k| legs[k])), ..command.stage };
        Command { stage, ..*command }
    };
    commands.iter().map(exchange).collect()
}

fn same(motor: &Motor, first: &[[f64; 3]], second: &[[f64; 3]], from: [usize; 3]) {
    assert!(first.len() >= 3 && first.len() == second.len());
    for (x, y) in first.iter().zip(second) {
        let expected = from.map(|k| x[k]);
        let difference = (0..3).map(|k| (expected[k] - y[k]).abs()).fold(0.0, f64::max);
        let size = x.iter().fold(1.0_f64, |size, i| size.max(i.abs()));
        assert!(difference < 1e-6 * size, "{}: {expected:?} {y:?}", motor.name);
    }
}

#[test]
fn law_currents_turn_with_the_rotor_by_a_phase() {
    // 120° further and the legs' roles moved on by one: the same currents, one phase on.
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let from = [2, 0, 1];
    for motor in all_kinds_of_motors() {
        for _ in 0..5 {
            let commands = random_commands(&mut rng);
            let angle = rng.random_range(0.0..360.0);
            let turned = currents(&motor, exchanged(&commands, from), angle + 120.0);
            same(&motor, &currents(&motor, commands, angle), &turned, from);
        }
    }
}

#[test]
fn law_currents_are_mirrored_with_the_rotor() {
    // The rotor at −θ and legs b and c exchanged: the motor seen in a mirror, with the currents of b and c exchanged.
    let mut rng = ChaCha8Rng::seed_from_u64(10);
    let from = [0, 2, 1];
    for motor in all_kinds_of_motors() {
        for _ in 0..5 {
            let commands = random_commands(&mut rng);
            let angle = rng.random_range(0.0..360.0);
            let mirrored = currents(&motor, exchanged(&commands, from), -angle);
            same(&motor, &currents(&motor, commands, angle), &mirrored, from);
        }
    }
}
