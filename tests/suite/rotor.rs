//! A rotor that can move.

use standstill_campaign::{ErrorSet, Record, Specimen};
use standstill_detect::{Decay, LineInductance};
use standstill_interface::{Command, Nanos, Phase, Sampling, Stage};
use standstill_inverter::{DcLink, OpenLeg};
use standstill_plant::Friction;
use standstill_sim::{NoProbe, RotorState, run};

use crate::bench::{Script, exact_case, ideal_inverter, paper_motor, scenario};

/// Largest movement in electrical degrees over 24 angles.
fn largest_move(decay: Decay, rotor: RotorState) -> f64 {
    let scenario = scenario(ErrorSet::Default, decay, rotor);
    (0..24_u32)
        .map(|k| {
            let case = scenario
                .case_at(f64::from(15 * k).to_radians(), Specimen { drive: k.into(), noise: k.into() });
            let mut detector = LineInductance::new(scenario.detector).expect("settings");
            Record { trial: 0, run: run(&case, &mut detector, false, &mut NoProbe) }.rotor_moved_deg()
        })
        .fold(0.0, f64::max)
}

#[test]
fn law_slow_decay_turns_a_free_rotor_and_fast_decay_does_not() {
    // The paper says that a free rotor stays. With slow decay it does not: the current persists for milliseconds.
    let slow = largest_move(Decay::Slow, RotorState::Free);
    assert!(slow > 10.0 && slow < 60.0, "{slow}°");
    let fast = largest_move(Decay::Fast, RotorState::Free);
    assert!(fast < 0.05, "{fast}°");
}

/// A rotor pulled by a constant current: a step of DC voltage across a-b and c, long after the electrical transient.
fn pull(friction: Friction) -> standstill_sim::Trace {
    let mut motor = paper_motor().linearised();
    motor.rotor.friction = friction;
    motor.rotor.inertia = 2.0;
    // A link of 10 V on leg a against b: 4.2 A, and a torque of 3/2 p ψ i_q as long as the rotor hardly moves.
    let mut inverter = ideal_inverter(OpenLeg::Open);
    inverter.link = DcLink::stiff(10.0);
    let mut case = exact_case(&motor, inverter, 60.0);
    case.rotor = RotorState::Free;
    let duration = Nanos::from_micros(200_000);
    let command = Command::hold(Stage::line(Phase::A, Phase::B, duration), Sampling::NONE);
    let mut trace = standstill_sim::Trace::new(1e-3);
    run(&case, &mut Script::new(vec![command]), false, &mut trace);
    trace
}

#[test]
fn analytic_a_pulled_rotor_accelerates_by_the_torque_that_friction_leaves() {
    for friction in [
        Friction::default(),
        Friction { stiction: 3.0, coulomb: 3.0, viscous: 0.0 },
        Friction { stiction: 5.0, coulomb: 2.0, viscous: 10.0 },
    ] {
        let trace = pull(friction);
        let (p, inertia) = (4.0, 2.0);
        for pair in trace.snapshots.windows(2) {
            let [a, b] = pair else { continue };
            let h = b.time - a.time;
            if h < 0.5e-3 || a.speed == 0.0 {
                continue;
            }
            // The step is short: means of both ends.
            let (torque, speed) = ((a.torque + b.torque) / 2.0, (a.speed + b.speed) / 2.0);
            let resisting = friction.coulomb * speed.signum() + friction.viscous * speed / p;
            let acceleration = p * (torque - resisting) / inertia;
            let got = (b.speed - a.speed) / h;
            assert!((got - acceleration).abs() < 1e-3 * acceleration.abs() + 1e-2, "{got} {acceleration}");
        }
        let end = trace.snapshots.last().expect("snapshots");
        assert!(end.speed.abs() > 0.1, "the rotor must have moved: {end:?}");
    }
}

#[test]
fn law_a_rotor_breaks_away_when_the_torque_exceeds_its_stiction() {
    let friction = Friction { stiction: 5.0, coulomb: 2.0, viscous: 0.0 };
    let trace = pull(friction);
    let before = trace.snapshots.iter().take_while(|s| s.speed == 0.0).last().expect("it rests at first");
    assert!((before.torque.abs() - 5.0).abs() < 0.01, "broke away at {} N m", before.torque);
    // With more stiction than there is torque it never moves.
    let held = pull(Friction { stiction: 50.0, ..friction });
    assert!(held.snapshots.iter().all(|s| s.speed == 0.0 && s.angle == held.snapshots[0].angle));
}

#[test]
fn law_a_locked_rotor_does_not_move() {
    assert_eq!(largest_move(Decay::Slow, RotorState::Locked), 0.0);
}
