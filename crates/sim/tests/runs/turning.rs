//! A rotor that turns at the start: closed forms of what its magnet drives, friction, and the energy ledger.
#![allow(clippy::disallowed_methods, reason = "tests compare with the C library")]

use super::script::{LINK, Script, same_bits_in_lanes, stage};
use Leg::{High, Low, Off};
use standstill_interface::{
    Angle, Command, Detector, Findings, Leg, Nanos, Outcome, Reading, Sampling, Step,
};
use standstill_inverter::{Bridge, DcLink, Devices, GateTiming, Inverter, OpenLeg};
use standstill_plant::{Friction, Motor, built_in};
use standstill_sim::{Case, Ended, NoProbe, RotorState, Run, Trace, run};

const DROP: f64 = 1.0;

fn motor() -> Motor {
    built_in("paper-5k5").expect("built in").linearised()
}

/// Ideal switches and diodes that drop a volt; the speed in rad/s electrical.
fn case(motor: &Motor, rotor: RotorState, start_speed: f64) -> Case<'_> {
    let devices = Devices { diode_drop: DROP, ..Devices::default() };
    let bridge = Bridge { devices, open_leg: OpenLeg::Diodes, ..Bridge::default() };
    let gates = [GateTiming::default(); 3];
    let inverter =
        Inverter { bridge, gates, link: DcLink::stiff(LINK), carrier_period: Nanos::from_micros(100) };
    Case { start_angle: 0.7, rotor, start_speed, ..Case::new(motor, inverter) }
}

/// The same with ideal diodes, too.
fn ideal(motor: &Motor, start_speed: f64) -> Case<'_> {
    let mut case = case(motor, RotorState::Driven, start_speed);
    case.inverter.bridge.devices = Devices::default();
    case
}

fn hold(legs: [Leg<f64>; 3], micros: u64) -> Command<f64> {
    Command::hold(stage(legs, micros), Sampling::once(Nanos::from_micros(micros)))
}

fn play(case: &Case<'_>, commands: &[Command<f64>]) -> (Vec<Reading<f64>>, Run<f64>) {
    let mut script = Script::new(commands);
    let run = run(case, &mut script, true, &mut NoProbe);
    assert!(matches!(run.ended, Ended::Outcome(_)), "{:?}", run.ended);
    let ledger = run.ledger.expect("asked for");
    let scale = ledger.shaft_work.abs().max(ledger.source.abs()).max(1e-6);
    assert!(ledger.imbalance().abs() < 1e-6 * scale, "{ledger:?}");
    let kinetic = ledger.friction_loss.abs().max(ledger.load_work.abs()).max(scale);
    assert!(ledger.mechanical_imbalance().abs() < 1e-6 * kinetic, "{ledger:?}");
    (script.readings, run)
}

/// Phase currents in A after a time in s with all terminals on one rail: `ψ̇ = −R i` in the stator, as equations of d and q at constant
/// speed, by steps of a nanosecond's order.
fn shorted(motor: &Motor, angle: f64, speed: f64, time: f64) -> [f64; 3] {
    let (d, q) = (motor.winding.d_axis_inductance(), motor.winding.q_axis_inductance());
    let slope = |[i, j]: [f64; 2]| {
        [
            (-motor.resistance * i + speed * q * j) / d,
            (-motor.resistance * j - speed * (d * i + motor.magnet_flux)) / q,
        ]
    };
    let (mut i, steps) = ([0.0, 0.0], 4000);
    let h = time / f64::from(steps);
    for _ in 0..steps {
        let at = |of: [f64; 2], by: [f64; 2], share: f64| [of[0] + by[0] * share, of[1] + by[1] * share];
        let a = slope(i);
        let b = slope(at(i, a, h / 2.0));
        let c = slope(at(i, b, h / 2.0));
        let e = slope(at(i, c, h));
        i = std::array::from_fn(|k| i[k] + h / 6.0 * (a[k] + 2.0 * b[k] + 2.0 * c[k] + e[k]));
    }
    let end = angle + speed * time;
    [0.0, 1.0, 2.0].map(|k: f64| {
        let phase = end - k * std::f64::consts::TAU / 3.0;
        i[0] * phase.cos() - i[1] * phase.sin()
    })
}

#[test]
fn analytic_a_short_lets_the_magnet_drive_currents() {
    let motor = motor();
    for speed in [-300.0, 3.0, 60.0] {
        let (read, run) = play(&ideal(&motor, speed), &[hold([Low; 3], 800)]);
        for (read, expected) in read[0].current.0.into_iter().zip(shorted(&motor, 0.7, speed, 8e-4)) {
            assert!(
                (read - expected).abs() < 2e-6 * expected.abs().max(1.0),
                "{speed}: {read}, not {expected}"
            );
        }
        assert!((run.end_angle - 0.7 - speed * 8e-4).abs() < 1e-9, "what drives it keeps its speed");
    }
    // At first i_q = −ω ψ T / L_q: 2.6 mA per rad/s after 100 µs with the paper's motor.
    let (read, _) = play(&ideal(&motor, 1.0), &[hold([Low; 3], 100)]);
    let space = read[0].current.0.iter().map(|i| i * i).sum::<f64>() * (2.0 / 3.0);
    let expected = motor.magnet_flux * 1e-4 / motor.winding.q_axis_inductance();
    assert!((space.sqrt() / expected - 1.0).abs() < 0.01, "{} {expected}", space.sqrt());
}

#[test]
fn analytic_diodes_rectify_what_the_magnet_induces_above_the_link() {
    let motor = motor();
    // √3 ω ψ = U + 2 V_f.
    let limit = (LINK + 2.0 * DROP) / (3.0_f64.sqrt() * motor.magnet_flux);
    for (speed, flows) in
        [(0.99 * limit, false), (-0.99 * limit, false), (1.03 * limit, true), (-1.03 * limit, true)]
    {
        let (_, run) = play(&case(&motor, RotorState::Driven, speed), &[hold([Off; 3], 20_000)]);
        assert_eq!(run.peak_current > 1e-6, flows, "{speed}: {} A", run.peak_current);
        let source = run.ledger.expect("asked for").source;
        assert!(if flows { source < 0.0 } else { source == 0.0 }, "the link is charged: {source} J");
    }
}

#[test]
fn analytic_a_free_rotor_coasts_until_its_friction_has_stopped_it() {
    let mut motor = motor();
    motor.rotor.friction = Friction { stiction: 0.2, coulomb: 0.15, viscous: 0.0 };
    motor.rotor.cogging = None;
    let pole_pairs = f64::from(motor.pole_pairs);
    let slows = 0.15 * pole_pairs / motor.rotor.inertia;
    for speed in [2.0, -2.0] {
        let (_, run) = play(&case(&motor, RotorState::Free, speed), &[hold([Off; 3], 10_000)]);
        let way = speed * 0.01 - speed.signum() * slows * 1e-4 / 2.0;
        assert!((run.end_angle - 0.7 - way).abs() < 1e-9, "{}", run.end_angle - 0.7);
        // Until it stands: v² / 2 a.
        let until = Nanos::from_seconds(2.0 / slows * 1.5).0 / 1000;
        let (_, run) = play(&case(&motor, RotorState::Free, speed), &[hold([Off; 3], until)]);
        let way = speed.signum() * 4.0 / (2.0 * slows);
        assert!((run.end_angle - 0.7 - way).abs() < 1e-6 * way.abs(), "{}", run.end_angle - 0.7);
    }
}

/// Without resistance a short holds the stator's flux, which the rotor leaves behind as it turns: `i_d = ψ (cos Δ − 1) / L_d`,
/// `i_q = −ψ sin Δ / L_q`, whatever its motion was.
#[test]
fn analytic_a_prescribed_acceleration_turns_the_rotor_by_a_polynomial_of_time() {
    let mut motor = motor();
    motor.resistance = 0.0;
    motor.rotor.friction = Friction { stiction: 0.2, coulomb: 0.15, viscous: 0.01 };
    let time: f64 = 2e-3;
    // From rest, faster and faster backwards, and one that turns round on the way.
    for (speed, acceleration) in [(0.0, 2e4), (-100.0, -5e4), (60.0, -9e4)] {
        let case = Case { acceleration, ..ideal(&motor, speed) };
        let (read, run) = play(&case, &[hold([Low; 3], 2000)]);
        let turned = speed * time + acceleration * time * time / 2.0;
        assert!((run.end_angle - 0.7 - turned).abs() < 1e-9, "{}: {turned}", run.end_angle - 0.7);
        let d = motor.magnet_flux * (turned.cos() - 1.0) / motor.winding.d_axis_inductance();
        let q = -motor.magnet_flux * turned.sin() / motor.winding.q_axis_inductance();
        for (k, read) in read[0].current.0.into_iter().enumerate() {
            let phase = 0.7 + turned - k as f64 * std::f64::consts::TAU / 3.0;
            let expected = d * phase.cos() - q * phase.sin();
            assert!(
                (read - expected).abs() < 2e-6 * d.hypot(q),
                "{speed} {acceleration}: {read}, not {expected}"
            );
        }
    }
    // A rotor that nothing drives has no such acceleration.
    let free = Case { acceleration: 1e4, ..case(&motor, RotorState::Locked, 0.0) };
    assert_eq!(play(&free, &[hold([Off; 3], 1000)]).1.end_angle, 0.7);
}

#[test]
fn law_lanes_have_the_bits_of_a_run_alone() {
    let motor = built_in("paper-5k5").expect("built in");
    let commands =
        [hold([High, Low, Off], 100), hold([Off; 3], 300), hold([Low; 3], 200), hold([Off; 3], 300)];
    let of = |rotor, speed| {
        let acceleration = if rotor == RotorState::Driven { 40.0 * speed } else { 0.0 };
        (Case { acceleration, ..case(&motor, rotor, speed) }, Script::new(commands))
    };
    same_bits_in_lanes(
        &[0.0, 5.0, -40.0, 900.0, 0.3]
            .map(|speed| [of(RotorState::Driven, speed), of(RotorState::Free, speed)])
            .concat(),
    );
}

/// Plays a script and then finds the angle 0, which holds for an instant so long before the end.
#[derive(Clone)]
struct Aged(Script, f64);

impl Detector<f64> for Aged {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        match self.0.step(readings) {
            Step::Done(_) => {
                let findings = Findings { age: Some(self.1), ..Findings::default() };
                Step::Done(Outcome::Found { angle: Angle::from_radians(0.0), findings })
            }
            drive @ Step::Drive(_) => drive,
        }
    }
}

/// The run has the rotor's angle at the instant that the detector states: a driven one by `ω t + α t²/2` to the last digits, a free one, which
/// pulses push either way, as its snapshots show it, and one that is held where it is.
#[test]
fn analytic_a_run_has_the_angle_at_the_instant_that_is_stated() {
    let motor = built_in("low-inertia").expect("built in");
    let commands: Vec<_> = (0..6)
        .map(|k| {
            let legs = if k % 2 == 0 { [High, Low, Off] } else { [Low, Off, High] };
            Command::sequence(stage(legs, 200), stage([Off; 3], 300), Sampling::NONE)
        })
        .collect();
    let end = 3e-3_f64;
    for age in [0.0, 0.4e-3, 1.3e-3, 2.95e-3, 3e-3] {
        let at = end - age;
        let told = |rotor, speed: f64, acceleration: f64| {
            let case = Case { acceleration, ..case(&motor, rotor, speed) };
            let mut trace = Trace::new(1e-6);
            let run = run(&case, &mut Aged(Script::new(&commands), age), false, &mut trace);
            let next =
                trace.snapshots.iter().position(|snapshot| snapshot.time >= at).expect("until the end");
            (run.instant_angle.expect("stated"), trace.snapshots[next].angle, run)
        };
        let (angle, _, _) = told(RotorState::Driven, 40.0, -9e3);
        assert!((angle - 0.7 - 40.0 * at + 4.5e3 * at * at).abs() < 1e-12, "{age}: {angle}");
        let (angle, shown, run) = told(RotorState::Free, 20.0, 0.0);
        assert!(run.moved > 0.02, "{run:?}");
        assert!((angle - shown).abs() < 0.02 * run.moved, "{age}: {angle}, not {shown} of {}", run.moved);
        let (angle, _, run) = told(RotorState::Locked, 0.0, 0.0);
        assert_eq!(angle, run.end_angle);
    }
    // Before the run, and after its end, there was nothing that a detector could have measured.
    for age in [3.001e-3, 1.0, f64::INFINITY, f64::NAN, -1e-9] {
        let mut aged = Aged(Script::new(&commands), age);
        let run = run(&case(&motor, RotorState::Driven, 40.0), &mut aged, false, &mut NoProbe);
        assert_eq!(run.instant_angle, None, "{age}");
    }
}
