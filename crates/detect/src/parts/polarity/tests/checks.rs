//! Checks of the vectors.

use super::*;
use crate::checks::Check;
use crate::nameplate::Nameplate;

/// A leg whose duty cycle is limited shortens the vectors of one direction: the difference has a part across the axis,
/// unlike that of a saturating magnet. Up to 45° off the axis, and as far as noise turns the difference, it counts as
/// the magnet's.
#[test]
fn analytic_a_difference_that_points_across_the_axis_names_no_pole() {
    let ended = |rule, effect: f64, across: f64| {
        let mut motor = Motor { across, ..Motor::of(1, effect, 1e-4, 0.0) };
        motor.decide(PolaritySettings { rule, ..settings(LOOSE) }).0.undetermined
    };
    let reason = |effect, across| ended(PolarityRule::Sequential(LOOSE), effect, across);
    for sign in [1.0, -1.0] {
        // The currents differ by `effect` along the axis and by twice `across` across it.
        assert_eq!(reason(sign * 0.1, 0.045), None);
        assert_eq!(reason(0.1, sign * 0.045), None);
        for (effect, across) in [(sign * 0.1, 0.055), (0.1, sign * 0.055)] {
            let Some(Undetermined::OffAxis { angle, allowed }) = reason(effect, across) else {
                panic!("{:?}", reason(effect, across));
            };
            assert!((angle.tan() - 1.1).abs() < 0.01, "{angle}");
            assert!(allowed > core::f64::consts::FRAC_PI_4 && allowed < 0.83, "{allowed}");
        }
    }
    // Without enough evidence for a pole, that is the reason.
    assert!(matches!(reason(0.0, 0.055), Some(Undetermined::NotDecided { .. })));
    // A single pair cannot distinguish it from a rotor that moves.
    assert_eq!(ended(PolarityRule::TwoVectors, 0.1, 0.055), None);
}

#[test]
fn law_vectors_that_differ_by_more_than_the_poles_make_them_are_a_fault() {
    for rule in [PolarityRule::Sequential(LOOSE), PolarityRule::TwoVectors] {
        let settings = PolaritySettings { rule, both_ways: 0.3, ..settings(LOOSE) };
        let ended = |checks, effect| {
            Motor::of(1, effect, 1e-4, 0.0).shorted(PolaritySettings { checks, ..settings }, |_| {}).map(drop)
        };
        for sign in [1.0, -1.0] {
            assert_eq!(ended(Checks::ALL, sign * 0.29), Ok(()));
            let Err(Fault::DirectionsDiffer { phase: None, apart, allowed: 0.3 }) =
                ended(Checks::ALL, sign * 0.31)
            else {
                panic!("{rule:?}");
            };
            assert!((apart - 0.31).abs() < 1e-3, "{apart}");
            assert_eq!(ended(Checks::ALL.without(Check::BothWays), sign * 0.31), Ok(()));
        }
    }
}

/// If duty cycles are limited to one half, vectors raise half of their current.
#[test]
fn law_vectors_that_raise_half_of_their_current_are_a_fault() {
    for rule in [PolarityRule::Sequential(LOOSE), PolarityRule::TwoVectors] {
        let ended = |checks, least_share| {
            let settings = PolaritySettings { rule, checks, least_share, ..settings(LOOSE) };
            Motor::of(1, 0.1, 1e-4, 0.0).shorted(settings, |_| {}).map(drop)
        };
        assert_eq!(ended(Checks::ALL, 0.999), Ok(()));
        let (share, needed) = (1.001, CURRENT * 1.001);
        assert!(
            matches!(ended(Checks::ALL, share), Err(Fault::NoCurrent { peak, needed: n }) if n == needed && (peak / CURRENT - 1.0).abs() < 1e-4)
        );
        assert_eq!(ended(Checks::ALL.without(Check::BothWays), share), Ok(()));
    }
    // Half the time constant: x = R t / L_d = 1/2 takes (1/x + 1/2) (1 − e⁻ˣ) of it, half of which is needed.
    let plate = crate::testing::PLATE;
    let resistance = plate.d_axis_inductance / 1e-3;
    let rule = PolarityRule::TwoVectors;
    let made = |resistance, polarity_difference| {
        let plate = Nameplate { resistance, polarity_difference, ..plate };
        PolaritySettings::near_rated_current(&plate, Signature::Normal, rule)
    };
    let settings = made(resistance, 0.1);
    assert_eq!(settings.duration(), Nanos::from_micros(500));
    assert_eq!(made(resistance / 4.0, 0.1).duration(), Nanos::from_micros(1000));
    let strong = Nameplate { resistance: resistance * 1e3, dc_link: plate.dc_link * 10.0, ..plate };
    let shortest = PolaritySettings::near_rated_current(&strong, Signature::Normal, rule);
    assert_eq!(shortest.duration(), plate.carrier_period);
    // A carrier period of 1/20 of a time constant is short enough; one of two time constants may differ both ways by 7 %. Through the link's
    // shunt a vector of 0.1 ms may differ by as much as 1 µs of jitter makes of it.
    assert_eq!(settings.uneven, 0.0);
    let constant = plate.carrier_period.seconds() / (plate.d_axis_inductance / (resistance * 1e3));
    assert!((shortest.uneven / (0.018 * constant * constant) - 1.0).abs() < 1e-12, "{}", shortest.uneven);
    let link = crate::nameplate::Sensing { place: Place::InLink, ..plate.sensing };
    let in_link =
        PolaritySettings::near_rated_current(&Nameplate { sensing: link, ..strong }, Signature::Normal, rule);
    assert!((in_link.uneven - shortest.uneven - 0.074).abs() < 1e-9, "{}", in_link.uneven);
    assert!(in_link.needed_margin(0.0) >= 4.0 * in_link.uneven * in_link.current);
    let reached = 2.5 * (1.0 - (-0.5_f64).exp());
    assert!((settings.least_share / (reached / 2.0) - 1.0).abs() < 1e-12, "{}", settings.least_share);
    let without = made(0.0, -0.1);
    assert!((without.least_share / 0.5 - 1.0).abs() < 1e-3, "{}", without.least_share);
    // Poles that differ by more may halve a current.
    assert_eq!((made(0.0, 0.2).least_share, made(0.0, -0.2).least_share), (0.0, 0.0));
    // 10 % of the drive and twice the poles'; a sheet without a difference limits none.
    assert!((made(0.0, -0.1).both_ways - 0.3).abs() < 1e-12);
    assert_eq!(made(0.0, 0.0).both_ways, 2.0);
}
