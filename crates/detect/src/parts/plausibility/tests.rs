use standstill_interface::{Abc, Nanos, Sensed};

use super::*;
use crate::parts::lines::{Saliency, SaliencySign};
use crate::parts::train::Slot;
use crate::testing::PLATE;

fn limits() -> PlausibilitySettings<f64> {
    PlausibilitySettings::suited(&PLATE)
}

/// Checks currents in A at the end of a pulse from a to b, on a link of this voltage in V.
fn pulse(
    limits: &PlausibilitySettings<f64>,
    current: [f64; 3],
    link: f64,
    sensed: [Sensed; 3],
) -> Result<(), Fault<f64>> {
    let reading = Reading { sensed: Abc(sensed), ..Reading::measured(Nanos::ZERO, current, link) };
    let [a, b, c] = current;
    let mut margin = Margin::new();
    limits.link(&mut margin, &reading)?;
    limits.sum(&mut margin, &reading, (a, -b), c, 0.175 + limits.sensors * a.abs().max(b.abs()))
}

#[test]
fn law_currents_that_sum_to_zero_are_those_of_whole_sensors() {
    let limits = limits();
    let three = [Sensed::Measured; 3];
    let two = [Sensed::Measured, Sensed::Measured, Sensed::Derived];
    assert_eq!(pulse(&limits, [3.5, -3.5, 0.0], 540.0, three), Ok(()));
    // Gains apart by three deviations each way, and noise.
    assert_eq!(pulse(&limits, [3.55, -3.45, 0.02], 540.0, three), Ok(()));
    // A dead sensor, a reversed one, two exchanged, one that shows a current where none can flow.
    for wrong in [[3.5, 0.0, 0.0], [3.5, 3.5, 0.0], [3.5, 0.0, -3.5], [3.5, -3.5, 2.0]] {
        assert!(
            matches!(pulse(&limits, wrong, 540.0, three), Err(Fault::SensorsDisagree { .. })),
            "{wrong:?}"
        );
    }
    // What is derived from two sensors cannot disagree with them.
    assert_eq!(pulse(&limits, [3.5, -3.5, 2.0], 540.0, two), Ok(()));
    // With a large saliency diodes of the third leg may carry a part: the sum counts alone.
    let salient = PlausibilitySettings::suited(&Nameplate { q_axis_inductance: 30e-3, ..PLATE });
    assert_eq!(pulse(&salient, [3.5, -3.0, -0.5], 540.0, three), Ok(()));
    assert!(pulse(&limits, [3.5, -3.0, -0.5], 540.0, three).is_err());
    assert!(pulse(&salient, [3.5, -3.0, 0.0], 540.0, three).is_err());
}

#[test]
fn law_a_link_beyond_its_data_sheet_is_one_of_a_wrong_sensor() {
    for (link, holds) in [(540.0, true), (400.0, true), (340.0, false), (700.0, true), (740.0, false)] {
        let found = pulse(&limits(), [3.5, -3.5, 0.0], link, [Sensed::Measured; 3]);
        assert_eq!(found.is_ok(), holds, "{link} V: {found:?}");
        assert!(holds || matches!(found, Err(Fault::DcLinkOutOfRange { .. })));
    }
}

#[test]
fn law_lines_are_those_of_the_data_sheet_within_a_third() {
    let (limits, train) = (limits(), PulseTrainSettings::suited(&PLATE, Nanos::from_micros(50)));
    let check = |lines| {
        limits.inductances(&mut Margin::new(), lines, train.pulse, train.resistance)?;
        limits.directions(&mut Margin::new(), lines, &train)
    };
    // L_d + L_q = 28 mH, and its ends, 20 and 36 mH.
    assert_eq!(check([[28e-3; 2], [20e-3; 2], [36e-3; 2]]), Ok(()));
    // A data sheet that is ten per cent off.
    assert_eq!(check([[18e-3; 2], [39.6e-3; 2], [28e-3; 2]]), Ok(()));
    for wrong in [10e-3, 60e-3, -1e-3, f64::NAN] {
        let found = check([[28e-3; 2], [wrong; 2], [28e-3; 2]]);
        let of_line = matches!(found, Err(Fault::InductanceOutOfRange { phase: Phase::B, .. }));
        assert!(of_line, "{wrong}: {found:?}");
    }
    // The poles may differ by a tenth and twice their difference at rated current, 30 %.
    assert_eq!(check([[24.5e-3, 31.5e-3], [28e-3; 2], [28e-3; 2]]), Ok(()));
    let found = check([[23e-3, 33e-3], [28e-3; 2], [28e-3; 2]]);
    assert!(matches!(found, Err(Fault::DirectionsDiffer { phase: Some(Phase::A), .. })), "{found:?}");
}

/// |L_B|/L_A of lines in H.
fn ratio(lines: [f64; 3]) -> f64 {
    Saliency::from_lines(Abc(lines), SaliencySign::Negative).ratio()
}

/// Lines in H of a motor with these inductances in H, at an angle in rad.
fn lines(d: f64, q: f64, at: f64) -> [f64; 3] {
    [-120.0_f64, 0.0, 120.0].map(|turn| d + q + (q - d) * (2.0 * at + turn.to_radians()).cos())
}

#[test]
fn analytic_a_sheet_off_by_a_tenth_in_each_inductance_has_a_saliency_in_range() {
    let limits = limits();
    let check = |lines: [f64; 3]| {
        limits.saliency(&mut Margin::new(), (ratio(lines), 0.0), Nanos::from_micros(100), 0.0)
    };
    // L_d = 10 mH and L_q = 18 mH on the data sheet: (z ± 0.1)/(1 ± 0.1 z).
    let z = 8.0 / 28.0;
    let [low, high] = limits.saliencies(1e-4, 0.0);
    assert!(
        (low - (z - 0.1) / (1.0 - 0.1 * z)).abs() < 1e-12
            && (high - (z + 0.1) / (1.0 + 0.1 * z)).abs() < 1e-12
    );
    for at in [0.0, 0.5, 1.3] {
        for (d, q) in [(10e-3, 18e-3), (9.01e-3, 19.79e-3), (10.99e-3, 16.21e-3), (9e-3, 16.2e-3)] {
            assert_eq!(check(lines(d, q, at)), Ok(()), "{d} {q} {at}");
        }
        for (d, q) in [(8.98e-3, 19.82e-3), (11.02e-3, 16.18e-3)] {
            assert!(matches!(check(lines(d, q, at)), Err(Fault::SaliencyOutOfRange { .. })), "{d} {q} {at}");
        }
    }
    // Errors of the measurement widen the range by a deviation and a half of those that make a saliency significant.
    let most = ratio(lines(8.9e-3, 19.9e-3, 0.3));
    let with = |square: f64| limits.saliency(&mut Margin::new(), (most, square), Nanos(100_000), 0.0);
    let apart = (most - high) / 1.5;
    assert!(with((0.99 * apart).powi(2)).is_err() && with((1.01 * apart).powi(2)).is_ok());
}

#[test]
fn law_what_saturation_leaves_widens_the_range_of_the_saliency() {
    // 77 % are left at rated current: L_d may be 7.7 mH, or L_q 13.9 mH, besides the tenth.
    let saturating =
        PlausibilitySettings::suited(&Nameplate { rated_pulse: Nanos::from_micros(200), ..PLATE });
    let [low, high] = saturating.saliencies(2e-4, 0.0);
    let left = saturating.saturates;
    let of = |d: f64, q: f64| (q - d) / (q + d);
    assert!((high - of(10.0 * left * 0.9, 18.0 * 1.1)).abs() < 1e-12, "{high}");
    assert!((low - of(11.0, 18.0 * 0.9 * left)).abs() < 1e-12, "{low}");
    // A resistance adds R t of two phases, halved, to each line: 30 mH of lines become 31.
    let [bent, same] = saturating.saliencies(2e-4, 5.0);
    assert!(bent < low * 0.96 && same == high, "{bent} {low}");
    // A motor without a saliency has an upper limit alone.
    let round = PlausibilitySettings::suited(&Nameplate { q_axis_inductance: 10e-3, ..PLATE });
    assert_eq!(round.saliencies(1e-4, 0.0)[0], 0.0);
}

#[test]
fn law_shorted_turns_have_a_saliency_of_their_own() {
    // Phase a, of which a short takes a share of its inductance: lines ab and ca have less, bc has not.
    let whole = lines(10e-3, 18e-3, 0.6);
    let check = |limits: &PlausibilitySettings<f64>, lost: f64| {
        let lines = [whole[0] - lost, whole[1], whole[2] - lost];
        limits.saliency(&mut Margin::new(), (ratio(lines), 0.0), Nanos(100_000), 0.0)
    };
    assert_eq!(check(&limits(), 0.0), Ok(()));
    assert!(matches!(check(&limits(), 8e-3), Err(Fault::SaliencyOutOfRange { .. })));
    let off = PlausibilitySettings { checks: Checks::ALL.without(Check::Saliency), ..limits() };
    assert_eq!(check(&off, 8e-3), Ok(()));
    // Where diodes of the third leg conduct, lines are not those of two phases.
    let open = PlausibilitySettings { idle_is_blocked: false, ..limits() };
    assert_eq!(check(&open, 8e-3), Ok(()));
}

#[test]
fn law_a_factor_between_two_sensors_is_no_step_of_a_code() {
    let settings = PulseTrainSettings::suited(&PLATE, Nanos::from_micros(50));
    let mut train = Train::new(settings);
    // 20 mA rms in each.
    train.noise = 4e-4;
    let mut noise = crate::testing::Noise::new(5);
    let mut check = |gain: f64, bit: f64| {
        let mut gains = GainComparison::new();
        for n in 0..72_u16 {
            let slot = Slot::of(n / 4);
            let current = 0.875 * f64::from(n % 4 + 1);
            // A bit that is always set is missing in half of the codes.
            let stuck = if (current / bit).floor() % 2.0 == 0.0 { bit } else { 0.0 };
            let first = current + 0.02 * noise.gauss();
            let second = current * gain + stuck + 0.02 * noise.gauss();
            gains.add(slot, if slot.forward { (first, second) } else { (second, first) });
        }
        limits().codes(&mut Margin::new(), &gains, &train)
    };
    for gain in [0.98, 1.0, 1.02] {
        assert_eq!(check(gain, 1e-9), Ok(()), "{gain}");
    }
    let found = check(1.0, 0.4);
    assert!(matches!(found, Err(Fault::SensorsDisagree { .. })), "{found:?}");
    // A gain of a sensor that follows another has no codes of its own.
    train.derived = Derived::One(Phase::C);
    let mut gains = GainComparison::new();
    for n in 0..6 {
        gains.add(Slot::of(n), (3.0, 1.0 + f64::from(n)));
    }
    assert_eq!(limits().codes(&mut Margin::new(), &gains, &train), Ok(()));
    train.derived = Derived::None;
    assert!(limits().codes(&mut Margin::new(), &gains, &train).is_err());
}

#[test]
fn analytic_what_is_no_factor_is_the_smaller_eigenvalue() {
    let mut gains = GainComparison::new();
    // (x, y) = t (1, 2)/√5 ± e (−2, 1)/√5 with t = 5 and e = 0.1.
    for n in 0..4_u16 {
        let (t, e) = (5.0, if n % 2 == 0 { 0.1 } else { -0.1 });
        let root = 5.0_f64.sqrt();
        gains.add(Slot { line: 1, forward: true }, ((t - 2.0 * e) / root, (2.0 * t + e) / root));
    }
    let [none, (apart, current), _] = gains.residuals();
    // 4 · 0.01 over three degrees of freedom; half of 4 · 25.01.
    assert!((apart - (0.04_f64 / 3.0).sqrt()).abs() < 1e-9, "{apart}");
    assert!((current - (50.02_f64 / 3.0).sqrt()).abs() < 1e-9, "{current}");
    assert_eq!(none, (0.0, 0.0));
}

#[test]
fn analytic_limits_follow_the_pulse() {
    // 2 · 10 mH · 7 A / 540 V = 259 µs of a linear motor: the rated pulse of 300 µs saturates nothing; one of 200 µs takes 22.9 %.
    let saturating = Nameplate { rated_pulse: Nanos::from_micros(200), ..PLATE };
    let limits = PlausibilitySettings::suited(&saturating);
    let share = 200.0 / (20e-3 * 7.0 / 540.0 * 1e6);
    let of = |micros: f64| limits.of_pulse(micros * 1e-6);
    let close = |found: f64, wanted: f64| assert!((found / wanted - 1.0).abs() < 1e-9, "{found} {wanted}");
    for (micros, saturates, times) in
        [(100.0, share, 1.0), (200.0, share, 1.0), (300.0, 1.5 * share - 0.5, 1.5), (1000.0, 0.2, 5.0)]
    {
        let ([low, high], both) = of(micros);
        close(low, 20e-3 * 0.65 * saturates);
        close(high, 36e-3 * 1.35);
        // The poles differ by a tenth at rated current.
        close(both, 0.1 + 0.2 * times);
    }
}
