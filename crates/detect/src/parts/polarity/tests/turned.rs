//! A rotor that turns on after its axis was measured.

use super::*;

/// Current in A that a volt drives across the magnet, and the magnet's flux in Wb, of `settings`: 100 µs, 1 mH.
const BY_VOLT: f64 = 0.1;
const FLUX: f64 = 0.1;

/// Time in s that a test of two vectors takes: three waits and the vectors.
const TEST: f64 = 203e-6;

/// Two vectors without any check that can be switched off.
fn unchecked(signature: Signature) -> PolaritySettings<f64> {
    PolaritySettings { rule: PolarityRule::TwoVectors, signature, checks: Checks::NONE, ..settings(LOOSE) }
}

/// A motor whose poles differ by 5 %, so many rad/s fast, seen from an axis that was measured at one of its ends `since` before.
fn turning(speed: f64, since: f64, signature: Signature) -> Pole<f64> {
    let (sin, cos) = (speed * since).sin_cos();
    let poles = if signature == Signature::Inverted { -0.05 } else { 0.05 };
    // −ωψ/L_q across the magnet in both vectors: twice of it in their difference, relative.
    let induced = -2.0 * speed * FLUX * BY_VOLT / CURRENT;
    let (along, across) = (poles * cos - induced * sin, poles * sin + induced * cos);
    let since = Nanos::from_seconds(since - TEST);
    let mut motor = Motor { across: across / 2.0, since, ..Motor::of(1, along, 1e-5, 0.0) };
    motor.decide(unchecked(signature)).0
}

#[test]
fn law_what_a_turning_magnet_induces_names_no_wrong_pole() {
    let (mut named, mut open) = (0, 0);
    for signature in [Signature::Normal, Signature::Inverted] {
        for since in [3e-3, 10e-3, 40e-3, 150e-3] {
            for turned in -45..=45 {
                let speed = f64::from(turned).to_radians() / since;
                let pole = turning(speed, since, signature);
                let Some(reason) = pole.undetermined else {
                    // North was at the axis, and is less than a right angle ahead.
                    assert!(
                        pole.angle.difference(Angle::from_degrees(50.0)).abs() < 1e-9,
                        "{signature:?} {since} {turned}"
                    );
                    named += 1;
                    continue;
                };
                assert!(turned != 0, "{reason:?}");
                open += 1;
            }
        }
    }
    assert!(named > 200 && open > 200, "{named} {open}");
}

#[test]
fn analytic_a_rotor_that_turned_by_45_degrees_has_no_pole() {
    // 55 rad/s: 0.55 A in each of two vectors.
    let ended = |degrees: f64, signature| {
        let since = Nanos::from_seconds(degrees.to_radians() / 55.0 - TEST);
        let mut motor = Motor { across: 0.055, since, ..Motor::of(1, 0.1, 1e-5, 0.0) };
        motor.decide(unchecked(signature)).0
    };
    assert_eq!(ended(44.9, Signature::Normal).undetermined, None);
    let pole = ended(46.0, Signature::Normal);
    let Some(Undetermined::MayHaveTurned { angle, allowed }) = pole.undetermined else { panic!("{pole:?}") };
    assert!((angle.to_degrees() - 46.0).abs() < 0.2, "{angle}");
    assert!((allowed.to_degrees() - 45.0).abs() < 1e-9, "{allowed}");
    assert_eq!(pole.evidence.map(|evidence| evidence.is_enough()), Some(false));
    // Where south draws more, at most half of the difference along the axis may be induced: 0.11 of sin 27.04°.
    assert_eq!(ended(26.8, Signature::Inverted).undetermined, None);
    assert!(ended(27.3, Signature::Inverted).undetermined.is_some());
}

/// A short does not show less than 10 rad/s here: 50 ms later the rotor may be 30° from its axis, and 90 ms later 54°.
#[test]
fn law_a_speed_that_a_short_does_not_show_leaves_the_pole_open() {
    let ended = |millis: u64, checks| {
        let mut motor = Motor { since: Nanos::from_micros(1000 * millis), ..Motor::of(1, 0.1, 1e-5, 0.0) };
        let settings =
            PolaritySettings { rule: PolarityRule::TwoVectors, checks, lost: 0.69, ..settings(LOOSE) };
        motor.decide(settings).0.undetermined
    };
    assert_eq!(ended(50, Checks::ALL), None);
    let Some(Undetermined::MayHaveTurned { angle, .. }) = ended(90, Checks::ALL) else { panic!("open") };
    // 0.54 V of the link and 0.46 V of the devices, over 0.1 Wb.
    assert!((angle.to_degrees() / 51.6 - 1.0).abs() < 0.05, "{}", angle.to_degrees());
    assert_eq!(ended(90, Checks::NONE), None);
}
