//! Equal pulses of a train's rounds.

use super::*;
use crate::checks::Checks;
use crate::testing::Noise;

/// Detects with these checks; see [`run`].
fn with(
    checks: Checks,
    motor: &mut LineMotor,
    between: impl FnMut(&mut LineMotor),
    breaks: impl Fn(usize, &mut Reading<f64>),
) -> (Outcome<f64>, MaximumLikelihood<f64>) {
    let mut settings = MaximumLikelihoodSettings::<f64>::suited(&nameplate());
    settings.pulses.plausibility.checks = checks;
    run(settings, motor, between, breaks)
}

/// A slope from n readings at 1 … n has the variance σ² / Σ n², by each of two sensors; stated is that of one sensor, 3 σ² / n³, and the sum of
/// both ways has half of it.
#[test]
fn law_the_slopes_of_equal_pulses_scatter_as_stated() {
    let (mut squares, mut stated, mut count) = (0.0, 0.0, 0.0);
    for trial in 0..60_u32 {
        let mut motor = LineMotor { deviation: 0.05, ..LineMotor::at(6.0 * f64::from(trial)) };
        motor.noise = Noise::new(u64::from(trial) + 1);
        let (_, detector) = with(Checks::ALL, &mut motor, |_| (), |_, _| ());
        let peak = motor.pulses.iter().map(|pulse| pulse.1).sum::<f64>() / motor.pulses.len() as f64;
        let alike = detector.alike(peak, 0.2);
        for spread in detector.rounds.spreads() {
            squares += spread * spread;
            stated += alike.deviation * alike.deviation;
            count += 1.0;
        }
    }
    // The range w of three normal numbers has E[w²] = (2 + 3√3/π) σ² (Harter, Order Statistics, 1970).
    let range = 2.0 + 3.0 * 3.0_f64.sqrt() / core::f64::consts::PI;
    let ratio = (squares / stated / range).sqrt();
    assert!(count == 180.0 && (0.4..0.7).contains(&ratio), "{ratio}");
}

/// Whole parts: a link that sags by a tenth, sensors of other gains and offsets, a contact, and a rotor that coasts.
#[test]
fn law_rounds_of_whole_parts_agree() {
    for degrees in [0.0, 77.0, 200.0, 311.0] {
        let mut motor = LineMotor {
            deviation: 0.02,
            offset: [0.1, -0.1, 0.05],
            gain: [1.005, 0.995, 1.0],
            ..LineMotor::at(degrees)
        };
        let sags = |motor: &mut LineMotor| {
            motor.dc_link = 540.0 * (1.0 - 0.1 * motor.pulses.len() as f64 / 18.0);
        };
        let (outcome, _) = with(Checks::ALL, &mut motor, sags, |_, _| ());
        assert!(matches!(outcome, Outcome::Found { .. }), "{degrees}: {outcome:?}");
        // What turns is none of a sensor: five degrees from the first pulse to the last.
        let coasts = |motor: &mut LineMotor| {
            motor.angle = (degrees + 5.0 * motor.pulses.len() as f64 / 18.0).to_radians();
        };
        let mut motor = LineMotor { deviation: 0.02, ..LineMotor::at(degrees) };
        let (outcome, _) = with(Checks::ALL, &mut motor, coasts, |_, _| ());
        let fault = |fault: &Fault<f64>| {
            matches!(fault, Fault::SensorsDisagree { .. } | Fault::DcLinkOutOfRange { .. })
        };
        let failed =
            |outcome: &Outcome<f64>| matches!(outcome, Outcome::Failed { fault: of, .. } if fault(of));
        assert!(!failed(&outcome), "{degrees}: {outcome:?}");
        // The second pulse of each line finds a light rotor moving, which the first has pushed: in even rounds the one back, in odd ones the
        // other.
        let pushed = |pulse: usize, reading: &mut Reading<f64>| {
            if pulse % 2 == 1 {
                reading.current = reading.current.map(|current| current * 1.05);
            }
        };
        let mut motor = LineMotor { deviation: 0.02, ..LineMotor::at(degrees) };
        let (outcome, _) = with(Checks::ALL, &mut motor, |_| (), pushed);
        assert!(!failed(&outcome), "{degrees}: {outcome:?}");
    }
}

#[test]
fn law_a_link_that_no_current_follows_is_a_wrong_reading() {
    let wrong = |checks: Checks, from: usize, gain: f64| {
        let mut motor = LineMotor { deviation: 0.01, ..LineMotor::at(77.0) };
        let breaks = |pulse: usize, reading: &mut Reading<f64>| {
            if pulse >= from {
                reading.dc_link *= gain;
            }
        };
        let (outcome, _) = with(checks, &mut motor, |_| (), breaks);
        let wrong = match outcome {
            Outcome::Found { angle, .. } => motor.error(angle).abs() > 90.0,
            _ => false,
        };
        (outcome, wrong)
    };
    let mut poles = 0;
    for from in 0..18 {
        for gain in [0.7, 0.8, 0.9, 1.1, 1.2, 1.3] {
            let (outcome, is_wrong) = wrong(Checks::ALL, from, gain);
            let noticed = matches!(outcome, Outcome::Failed { fault: Fault::DcLinkOutOfRange { .. }, .. });
            assert!(!is_wrong && noticed == (from > 0), "{from}, {gain}: {outcome:?}");
            poles +=
                usize::from(wrong(Checks::ALL.without(Check::Link).without(Check::Sensors), from, gain).1);
        }
    }
    assert!(poles > 0, "{poles}");
}

#[test]
fn law_a_pulse_that_differs_from_its_equals_is_a_fault() {
    for (pulse, share) in [(0, 0.8), (7, 0.75), (17, 1.1)] {
        let outcome = |checks: Checks| {
            let mut motor = LineMotor { deviation: 0.01, ..LineMotor::at(77.0) };
            let breaks = |number: usize, reading: &mut Reading<f64>| {
                if number == pulse {
                    reading.current = reading.current.map(|current| current * share);
                }
            };
            with(checks, &mut motor, |_| (), breaks).0
        };
        let found = outcome(Checks::ALL);
        let Outcome::Failed { fault: Fault::SensorsDisagree { apart, allowed }, .. } = found else {
            panic!("{found:?}")
        };
        // As a current: so much of the pulse's, beside noise.
        let of = apart / allowed;
        assert!(of > 1.0 && apart < 0.3 * 7.0, "{apart} of {allowed}");
        let without = outcome(Checks::ALL.without(Check::Sensors));
        let same = matches!(without, Outcome::Failed { fault: Fault::SensorsDisagree { .. }, .. });
        assert!(!same, "{without:?}");
    }
}

#[test]
fn law_a_rotor_that_moves_between_rounds_is_a_fault_where_it_is_looked_for() {
    let mut settings = MaximumLikelihoodSettings::<f64>::suited(&nameplate());
    let all = settings.pulses.plausibility.checks;
    for (checks, moves) in [(all, true), (all.without(Check::Turning), false)] {
        settings.pulses.plausibility.checks = checks;
        let mut motor = LineMotor { deviation: 1e-3, ..LineMotor::at(77.0) };
        let outcome = detect(settings, &mut motor, |motor| {
            let turned = if motor.pulses.len() < 6 { 77.0_f64 } else { 117.0 };
            motor.angle = turned.to_radians();
        });
        let found = matches!(outcome, Outcome::Failed { fault: Fault::RotorMoves { .. }, .. });
        assert_eq!(found, moves, "{outcome:?}");
    }
}
