use standstill_campaign::one_sided_bounds;
use standstill_sim::{Purpose, Streams};

use super::*;

/// Looks after these numbers of trials, which grow by a quarter.
fn looks(most: u64) -> Vec<u64> {
    let mut all = vec![16_u64];
    while let Some(last) = all.last().copied().filter(|last| *last < most) {
        all.push((last + last / 4).min(most));
    }
    all
}

/// Returns the draws of a generator: a new one for each number.
fn uniform(number: u64, count: u64) -> Vec<f64> {
    let mut draws = Streams::new(9, number).open(Purpose::Design);
    (0..count).map(|_| draws.uniform()).collect()
}

#[test]
fn analytic_trials_without_a_case_show_a_limit_by_the_closed_form() {
    // Without a case the product is B(a, b + n)/B(a, b)/(1 − q)^n; of one trial it is b/(a + b)/(1 − q), so that q ends at 1 − α b/(a + b).
    let [low, high] = Share { most: 0.2, alpha: 0.3 }.interval(0, 1);
    assert!(low == 0.0 && (high - (1.0 - 0.3 * 0.8)).abs() < 1e-12, "{high}");
    // Stopping early costs less than half as many trials again as the one look that was fixed before.
    for most in [1e-2, 1e-3, 1e-6] {
        let share = Share { most, alpha: 0.005 };
        let needed = share.trials_needed(0.0).expect("a rate of zero is below it");
        let fixed = ln(0.005) / ln_1p(-most);
        let ratio = needed as f64 / fixed;
        assert!(ratio > 1.0 && ratio < 1.5, "{most}: {needed} against {fixed}");
        assert_eq!(share.shown(0, needed + needed / 500), Some(true));
        assert_eq!(share.shown(0, needed - needed / 100), None);
    }
}

#[test]
fn law_an_interval_for_all_times_contains_that_for_one_time() {
    for (cases, trials) in [(0, 50), (3, 50), (50, 50), (7, 3000), (1500, 3000), (1, 1_000_000)] {
        for most in [1e-4, 0.01, 0.5] {
            let [low, high] = Share { most, alpha: 0.05 }.interval(cases, trials);
            let [least, largest] = one_sided_bounds(cases, trials);
            assert!(low <= least && largest <= high, "{cases} of {trials}: {low} {high} {least} {largest}");
        }
    }
    assert_eq!(Share { most: 0.1, alpha: 0.05 }.interval(0, 0), [0.0, 1.0]);
}

/// Asserts that at most a share of `alpha` of so many sequences is decided wrongly, by the exact lower bound of that share.
fn at_most(wrong: u64, of: u64, alpha: f64, what: &str) {
    let [least, _] = one_sided_bounds(wrong, of);
    assert!(least <= alpha, "{what}: {wrong} of {of} decided wrongly");
}

/// promise: stop-at-any-time
#[test]
fn law_a_probability_at_its_limit_is_seldom_decided_whenever_one_stops() {
    const SEQUENCES: u64 = 1500;
    let alpha = 0.1;
    for most in [0.3, 0.02] {
        let share = Share { most, alpha };
        let mut decided = [0, 0];
        for number in 0..SEQUENCES {
            let draws = uniform(number, 3000);
            // At the limit itself both verdicts are as near to being wrong as they can be.
            let shown = looks(3000).into_iter().find_map(|trials| {
                let of = usize::try_from(trials).expect("few");
                share.shown(draws[..of].iter().filter(|x| **x < most).count() as u64, trials)
            });
            if let Some(holds) = shown {
                decided[usize::from(holds)] += 1;
            }
        }
        at_most(decided[0] + decided[1], SEQUENCES, alpha, "at the limit");
        // A bound that is never reached would not be tested: some wrong decisions must occur.
        assert!(decided[0] + decided[1] > SEQUENCES / 200, "{most}: {decided:?}");
    }
}

/// promise: stop-at-any-time
#[test]
fn law_a_mean_at_its_limit_is_seldom_decided_whenever_one_stops() {
    const SEQUENCES: u64 = 400;
    let alpha = 0.1;
    let seldom: fn(f64) -> f64 = |u| if u < 0.01 { 1.0 } else { 0.0 };
    for (what, of, most) in [("seldom and large", seldom, 0.01), ("spread", |u| 0.04 * u * u, 0.04 / 3.0)] {
        let mean = Mean { most, alpha };
        let mut decided = 0;
        for number in 0..SEQUENCES {
            let values: Vec<f64> = uniform(number, 1500).into_iter().map(of).collect();
            let shown = looks(1500)
                .into_iter()
                .find_map(|trials| mean.shown(&values[..usize::try_from(trials).expect("few")]));
            decided += u64::from(shown.is_some());
        }
        at_most(decided, SEQUENCES, alpha, what);
    }
}

#[test]
fn law_what_is_away_from_its_limit_is_decided_rightly() {
    let share = Share { most: 0.02, alpha: 0.01 };
    let mean = Mean { most: 1e-3, alpha: 0.01 };
    for number in 0..5 {
        let draws = uniform(number, 20_000);
        let cases = |p: f64| draws.iter().filter(|x| **x < p).count() as u64;
        assert_eq!(share.shown(cases(0.01), 20_000), Some(true));
        assert_eq!(share.shown(cases(0.03), 20_000), Some(false));
        let scaled = |of: f64| draws.iter().map(|u| of * u * u).collect::<Vec<f64>>();
        // Means of u² are a third.
        let (small, large) = (scaled(1e-3), scaled(6e-3));
        assert_eq!((mean.shown(&small), mean.shown(&large)), (Some(true), Some(false)));
        for (values, truth) in [(&small, 1e-3 / 3.0), (&large, 2e-3)] {
            let [low, high] = mean.interval(values);
            assert!(low < truth && truth < high && high < 20.0 * truth, "{low} {truth} {high}");
        }
        let needed = mean.trials_needed(&small).expect("below the limit");
        assert!((3000..20_000).contains(&needed), "{needed}");
        assert_eq!(mean.trials_needed(&large), None);
    }
    // Nothing but zeros: each multiplies the largest stake, 0.7, by 1 + m, which decides at 2/α.
    let alone = (ln(2.0 / (0.7 * 0.01)) / ln_1p(1e-3)).ceil();
    let needed = mean.trials_needed(&[]).expect("some");
    assert!((needed as f64 / alone - 1.0).abs() < 2e-3, "{needed} {alone}");
    // Rounding does not make the smallest allowed limit count as shown.
    let tiny = Share { most: 1e-12, alpha: 0.003 };
    assert!([64, 10_000, 10_000_000].into_iter().all(|trials| tiny.shown(0, trials).is_none()));
    let zeros = vec![0.0; usize::try_from(needed).expect("few")];
    assert_eq!(mean.shown(&zeros), Some(true));
    assert_eq!(mean.shown(&zeros[..zeros.len() * 9 / 10]), None);
    assert_eq!(mean.interval(&[]), [0.0, 1.0]);
}
