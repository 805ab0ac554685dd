//! Evidence for a pole, in standard deviations, from a pointer along the magnet.

use super::*;
use crate::testing::mean_and_deviation;

/// Evidence for the pole at the test's axis, found or not, of so many trials.
fn towards_axis(settings: PolaritySettings<f64>, effect: f64, sensor: f64) -> Vec<f64> {
    let of = |trial: u64| {
        let (pole, test) = Motor::of(trial + 1, effect, sensor, 0.0).decide(settings);
        let outcome = pole.outcome(Findings::default());
        assert_eq!(outcome.findings().pole_evidence, pole.evidence);
        let (north, south) = (outcome.evidence_for(test.axis), outcome.evidence_for(test.axis.opposite()));
        assert_eq!(north, south.map(|south| -south));
        north.expect("measured")
    };
    (0..4000_u64).map(of).collect()
}

#[test]
fn analytic_two_vectors_have_students_distribution() {
    let two = PolaritySettings { rule: PolarityRule::TwoVectors, ..settings(LOOSE) };
    // The noise is known from three waits of three phases: nine degrees of freedom, whose distribution is wider than
    // the normal one.
    let expected = (9.0_f64 / 7.0).sqrt();
    let (mean, deviation) = mean_and_deviation(&towards_axis(two, 0.0, 0.05));
    assert!(mean.abs() < 0.06 && (deviation / expected - 1.0).abs() < 0.05, "{mean} {deviation}");
    // A difference of two standard deviations: √(4/3) of a reading's noise and, by the mean offset of three waits, 2/3 more in square;
    // Student's mean is 1.094 times as large.
    let effect = 2.0 * 0.05 * (4.0 / 3.0 * 5.0 / 3.0_f64).sqrt() / CURRENT;
    let (mean, _) = mean_and_deviation(&towards_axis(two, effect, 0.05));
    assert!((mean / 2.0 / 1.094 - 1.0).abs() < 0.05, "{mean}");
}

#[test]
fn analytic_pairs_have_one_standard_deviation() {
    // All 40 pairs, whatever their evidence.
    let all = SequentialSettings { error: 1e-30, floor: 1e-9, ..LOOSE };
    for effect in [0.0, 0.01, -0.01] {
        let (mean, deviation) = mean_and_deviation(&towards_axis(settings(all), effect, 0.1));
        // Each pair's difference has √(8/3) of a reading's relative noise.
        let expected = effect * 40.0_f64.sqrt() / ((8.0 / 3.0_f64).sqrt() * 0.1 / CURRENT);
        // The variance is never taken for less than the noise makes it.
        assert!((0.88..1.02).contains(&deviation), "{effect}: {deviation}");
        assert!((0.9 * expected.abs()..=expected.abs() + 0.06).contains(&mean.abs()), "{mean} {expected}");
        assert!(mean * effect >= 0.0);
    }
    // What repetition does not reveal counts as much as noise does.
    let floor = SequentialSettings { floor: 0.01, ..all };
    let (_, deviation) = mean_and_deviation(&towards_axis(settings(floor), 0.0, 0.1));
    let noise = (8.0 / 3.0_f64).sqrt() * 0.1 / CURRENT / 40.0_f64.sqrt();
    assert!((deviation / (noise / noise.hypot(0.01)) - 1.0).abs() < 0.08, "{deviation}");
}

#[test]
fn law_a_pole_is_named_exactly_where_the_evidence_is_enough() {
    let near = |k: u32, limit: f64| limit * (0.9 + 0.2 * f64::from(k) / 400.0);
    let mut named = 0;
    let mut check = |pole: &Pole<f64>, axis: Angle<f64>, more: f64, signature: Signature| {
        let evidence = pole.evidence.expect("a signature");
        assert_eq!(evidence.is_enough(), pole.undetermined.is_none(), "{pole:?}");
        let enough = evidence.deviations.abs() >= evidence.needed;
        assert_eq!(enough, pole.undetermined.is_none(), "{pole:?}");
        let normal = if signature == Signature::Normal { more } else { -more };
        let found = pole.undetermined.is_none();
        // A pole that is named is the one spoken for; otherwise the sign refers to the axis as it is.
        assert!(
            if found { evidence.deviations > 0.0 } else { evidence.deviations * normal > 0.0 },
            "{pole:?}"
        );
        assert_eq!(pole.angle == axis, !found || normal > 0.0, "{pole:?}");
        named += u32::from(found);
    };
    let axis = Angle::from_degrees(50.0);
    for k in 0..400 {
        for (signature, side) in
            [(Signature::Normal, 1.0), (Signature::Normal, -1.0), (Signature::Inverted, 1.0)]
        {
            let rule = PolarityRule::TwoVectors;
            let two = PolaritySettings { signature, rule, least_margin: 0.5, ..settings(LOOSE) };
            let effect = side * near(k, 0.05);
            check(&Motor::of(1, effect, 1e-3, 0.0).decide(two).0, axis, effect, signature);
            check(&Motor::of(1, effect, 0.0, 0.0).decide(two).0, axis, effect, signature);
            let sequential = PolaritySettings { signature, ..settings(LOOSE) };
            let effect = side * near(k, 0.01);
            check(&Motor::of(1, effect, 0.05, 0.0).decide(sequential).0, axis, effect, signature);
            // On the axis, and 45° off.
            for (direction, length) in [(50.0, near(k, 5.1)), (near(k, 95.0), 9.0)] {
                let (sin, cos) = f64::to_radians(direction).sin_cos();
                let pointer =
                    Pointer { direction: AlphaBeta::new(cos, sin) * (side * length), deviation: 1.0 };
                check(&pointer.read(axis, signature, 1e-6), axis, side, signature);
            }
        }
    }
    assert!((2000..4500).contains(&named), "{named}");
}

#[test]
fn law_without_a_signature_nothing_speaks_for_a_pole() {
    let none = PolaritySettings { signature: Signature::None, ..settings(LOOSE) };
    assert_eq!(Motor::of(1, 0.1, 1e-3, 0.0).decide(none).0.evidence, None);
    let pointer = Pointer { direction: AlphaBeta::new(1.0, 0.0), deviation: 0.01 };
    let pole = pointer.read(Angle::from_radians(0.1), Signature::None, 1e-6);
    assert_eq!((pole.evidence, pole.undetermined), (None, Some(Undetermined::NoSignature)));
}

#[test]
fn analytic_the_tail_is_as_probable_as_asked_for() {
    for probability in [0.49, 1e-3, 1e-6, 1e-30_f64] {
        let beyond = tail_beyond(probability);
        assert!((tail(beyond * beyond) / probability - 1.0).abs() < 1e-10, "{probability}");
    }
    assert!((tail_beyond(1e-6_f32) - 5.1228).abs() < 1e-3);
}

#[test]
fn analytic_walds_rule_and_the_tail_need_what_their_probabilities_say() {
    let mut decided_by_wald = 0;
    for effect in [1e-3, 0.02, 0.3] {
        for deviation in [0.003, 0.02, 0.1] {
            let rule = SequentialSettings { error: 1e-6_f64, effect, floor: 0.003, most_pairs: 8 };
            let needed = rule.evidence(1.0, deviation * deviation).needed;
            decided_by_wald += u32::from(needed > 1.001 * tail_beyond(1e-6));
            for (share, enough) in [(1.0 - 1e-6, false), (1.0 + 1e-6, true)] {
                for sign in [1.0, -1.0] {
                    let mean = sign * share * needed * deviation;
                    let evidence = rule.evidence(mean, deviation * deviation);
                    assert_eq!(evidence.is_enough(), enough, "{effect} {deviation}");
                    assert_eq!(
                        rule.error_of(mean, deviation * deviation) <= 1e-6,
                        enough,
                        "{effect} {deviation}"
                    );
                    assert!((evidence.deviations - mean / deviation).abs() < 1e-9 * needed);
                }
            }
        }
    }
    assert!((2..8).contains(&decided_by_wald), "{decided_by_wald}");
}

#[test]
fn law_no_rule_names_a_pole_that_both_ways_of_a_linear_motor_may_differ_by() {
    for rule in [PolarityRule::TwoVectors, PolarityRule::Sequential(LOOSE)] {
        let of = |uneven| {
            let settings = PolaritySettings { uneven, rule, ..settings(LOOSE) };
            Motor::of(1, 0.05, 1e-4, 0.0).decide(settings).0
        };
        assert_eq!(of(0.0).undetermined, None);
        let open = of(0.05);
        assert!(open.undetermined.is_some() && open.evidence.is_some_and(|of| !of.is_enough()), "{open:?}");
    }
}
