//! Statistics of what is known.

use super::*;

/// promise: exact-counts
#[test]
fn analytic_one_sided_bounds_leave_five_in_a_hundred_on_their_side() {
    // None of n: at most 1 − 0.05^(1/n), 0.1 % of 3,000; all of n: at least 0.05^(1/n).
    for n in [10, 3000] {
        let end = 0.05_f64.powf(1.0 / n as f64);
        let ([low, high], [all, one]) = (one_sided_bounds(0, n), one_sided_bounds(n, n));
        assert!(low == 0.0 && one == 1.0 && (high - (1.0 - end)).abs() < 1e-9 && (all - end).abs() < 1e-9);
    }
    // A binomial of that share gives at most 5 of 100 in one case of twenty.
    let share = one_sided_bounds(5, 100)[1];
    let mut term = (1.0 - share).powi(100);
    let mut sum = term;
    for k in 1..=5_u32 {
        term *= share / (1.0 - share) * f64::from(101 - k) / f64::from(k);
        sum += term;
    }
    assert!((sum - 0.05).abs() < 1e-9, "{sum}");
}

#[test]
fn analytic_clopper_pearson() {
    // Known values: 0 of n has the upper end 1 − 0.025^(1/n); 5 of 100 gives 1.643 % to 11.284 %.
    let none = binomial_interval(0, 10_000);
    assert_eq!(none.low, 0.0);
    assert!((none.high - (1.0 - 0.025_f64.powf(1e-4))).abs() < 1e-9);
    let five = binomial_interval(5, 100);
    assert!((five.low - 0.016_432).abs() < 1e-5 && (five.high - 0.112_835).abs() < 1e-5, "{five:?}");
    assert_eq!(binomial_interval(7, 7).high, 1.0);
}

#[test]
fn law_intervals_of_paired_shares_hold_the_difference_as_often_as_they_say() {
    // 95 ± 0.7 %; of 2,000 pairs, whose draws are the dear ones, 95 ± 1.5 %.
    paired_intervals_hold([1000, 200], &[0.92..=0.98, 0.91..=0.99]);
}

#[test]
#[ignore = "four times the intervals of the test that runs by default: scripts/test-all.sh long"]
fn law_four_times_the_intervals_of_paired_shares_hold_as_often() {
    // 95 ± 0.35 %.
    paired_intervals_hold([4000; 2], &[0.93..=0.97, 0.93..=0.97]);
}

/// Draws so many differences of each pair of shares, of 200 and of 2,000 pairs.
fn paired_intervals_hold(often: [u64; 2], expected: &[std::ops::RangeInclusive<f64>; 2]) {
    use standstill_sim::{Purpose, Streams};

    for (first, second) in [(0.45, 0.45), (0.3, 0.3), (0.4, 0.1), (0.1, 0.1), (0.01, 0.02)] {
        for (pairs, (often, expected)) in [200, 2000].into_iter().zip(often.into_iter().zip(expected)) {
            let mut known: BTreeMap<[u64; 2], Estimate> = BTreeMap::new();
            let mut held = 0;
            for number in 0..often {
                let mut draws = Streams::new(pairs, number).open(Purpose::Design);
                let mut alone = [0, 0];
                for _ in 0..pairs {
                    let draw = draws.uniform();
                    alone[0] += u64::from(draw < first);
                    alone[1] += u64::from((first..first + second).contains(&draw));
                }
                let found = known.entry(alone).or_insert_with(|| paired_difference(alone, pairs));
                held += u64::from((found.low..=found.high).contains(&(second - first)));
            }
            let share = held as f64 / often as f64;
            assert!(expected.contains(&share), "{first} {second} of {pairs}: {share}");
        }
    }
}

#[test]
fn law_paired_shares_at_their_ends_are_numbers() {
    // Of none in n up to 3.69/n either way; of all, at most the whole.
    let none = paired_difference([0, 0], 1000);
    assert!(none.value == 0.0 && (none.high * 1000.0 - 3.68).abs() < 0.01 && none.low == -none.high);
    let all = paired_difference([0, 50], 50);
    assert!(all.value == 1.0 && all.high == 1.0 && all.low > 0.85, "{all:?}");
    let each = paired_difference([1, 1], 2);
    assert!(each.low >= -1.5 && each.high.is_finite() && each.low == -each.high, "{each:?}");
}

#[test]
fn regress_a_difference_of_what_has_no_interval_has_none() {
    let unknown = Estimate { value: 7.0, low: 3.0, high: f64::NAN };
    let known = Estimate { value: 10.0, low: 9.0, high: 11.0 };
    let [first, second] = [[unknown, known], [known, unknown]].map(|both| correlated_difference(both, 0.9));
    assert!(first.value == 3.0 && first.low.is_nan() && first.high.is_finite(), "{first:?}");
    assert!(second.value == -3.0 && second.high.is_nan() && second.low.is_finite(), "{second:?}");
}

fn ramp(count: u32) -> Magnitudes {
    let mut ramp = Magnitudes::default();
    (0..count).for_each(|value| ramp.add(f64::from(value)));
    ramp
}

#[test]
fn analytic_quantile_of_a_ramp() {
    let ramp = ramp(1000);
    let q = quantile(&ramp, 0.95);
    // 950 of the thousand values from 0 are at most 949.
    assert_eq!(q.value, 949.0);
    // Normal approximation of the ranks: 950 ± 1.96 √(1000 · 0.95 · 0.05) = 950 ± 13.5.
    assert!((q.low - 936.0).abs() <= 1.0 && (q.high - 963.0).abs() <= 1.0, "{q:?}");
}

#[test]
fn law_small_samples_have_no_bounds_that_they_cannot_give() {
    // Of 20 values the largest is below the 95 % quantile with a probability of 0.95^20 = 36 %.
    assert!(quantile(&ramp(20), 0.95).high.is_nan());
    assert!(quantile(&ramp(1), 0.95).low.is_nan());
    // From 73 values on, the largest is an upper bound: 0.95^73 < 2.5 %.
    assert_eq!(quantile(&ramp(74), 0.95).high, 73.0);
}

#[test]
fn regress_a_summary_of_ten_million_errors() {
    // The sums of that many errors of ±1° and of one of 3°, without adding them one by one.
    let powers = [3.0, 1e7 + 8.0, 1e7 + 80.0, 1e7 + 728.0].map(|sum| [sum].into_iter().collect());
    let mut statistics = Statistics { trials: 10_000_000, powers, ..Statistics::default() };
    for k in 0..200_000 {
        statistics.magnitudes.add(1.0 + f64::from(k) * 1e-9);
    }
    let summary = statistics.summary();
    assert!((summary.wrong_pole_probability.high * 1e7 - 3.688_879).abs() < 1e-5);
}

#[test]
fn law_no_trials_is_not_a_number_and_not_a_panic() {
    let summary = Statistics::default().summary();
    assert!(summary.rms_deg.value.is_nan() && summary.p95_deg.value.is_nan());
    let text = serde_json::to_string(&summary).expect("serialisable");
    let read: Summary = serde_json::from_str(&text).expect("readable");
    assert!(read.rms_deg.low.is_nan() && read.trials == 0);
}

/// promise: statistics-add-up
#[test]
fn law_parts_in_any_order_are_the_whole_also_where_values_are_counted_in_bins() {
    let row = |trial: u64| crate::store::test_row(trial, (trial as f64 * 0.7).sin() * 10.0);
    // Up to 100,000 values are kept as they are: a part of the second is in bins at one cut, two parts of the last are.
    for count in [1_000, 130_000, 260_000] {
        let of = |trials: std::ops::Range<u64>| {
            let mut statistics = Statistics::default();
            trials.for_each(|trial| statistics.add_row(&row(trial)));
            statistics
        };
        let whole = of(0..count).summary();
        let cuts = [[count * 2 / 5, count * 9 / 10], [count / 3, count / 2], [1, count - 1]];
        for cuts in &cuts[..if count < 200_000 { 3 } else { 1 }] {
            let mut parts = of(cuts[1]..count);
            parts.merge(&of(0..cuts[0]));
            parts.merge(&of(cuts[0]..cuts[1]));
            assert_eq!(format!("{:?}", parts.summary()), format!("{whole:?}"), "{count} at {cuts:?}");
        }
    }
}

#[test]
fn analytic_a_sector_is_judged_by_what_is_beyond_it() {
    use crate::store::test_row as row;
    // Rotors evenly distributed over sectors of 60°, and one start in ten that names the next one, 1.5° beyond its border.
    let mut statistics = Statistics::default();
    for trial in 0..1000_u64 {
        let error = if trial % 10 == 9 { 31.5 } else { trial as f64 * 0.06 - 30.0 };
        let named = Row {
            error_deg: Some(error),
            verdict: Verdict::Found,
            pole_correct: Some(true),
            half_sector_deg: Some(30.0),
            ..row(trial, error)
        };
        statistics.add_row(&named);
    }
    let summary = statistics.summary();
    let sectors = summary.sectors.expect("sectors");
    assert_eq!((sectors.named, sectors.right, sectors.at_border, sectors.next), (1000, 900, 100, 0));
    // 1.5° in a tenth of all: rms 1.5 √0.1, and nothing beyond the limit of 2°.
    assert!((summary.rms_deg.value - 1.5 * 0.1_f64.sqrt()).abs() < 1e-12, "{summary:?}");
    assert_eq!((summary.p50_deg.value, summary.p95_deg.value), (0.0, 1.5));
    assert_eq!(summary.beyond_limit.value, 0.0);
    // Without sectors the file is as before.
    let plain = serde_json::to_string(&Statistics::default().summary()).expect("JSON");
    assert!(!plain.contains("sector"), "{plain}");
}
