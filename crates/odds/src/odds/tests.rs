//! Estimates by all runs together.

use standstill_sim::{Purpose, Streams};

use super::*;
use crate::mixture::Sampled;

/// A run with this end and probability, whose own estimate of its coefficient of variation is 0.1.
fn run(probability: f64, end: End) -> Run {
    Run {
        probability,
        end,
        variation: 0.1,
        levels: 5,
        curve: Vec::new(),
        trials: 50_000,
        acceptance: 0.4,
        ancestors: 50,
        unread: [0.0; 8],
        failures: Vec::new(),
        plain_hits: 0,
    }
}

#[test]
fn analytic_runs_make_their_mean_the_interval_of_their_spread_and_weights_by_their_probabilities() {
    let settings = Settings::default();
    let of = |probability: f64, end: End, failures: usize| Run {
        variation: 0.2,
        failures: (0..failures).map(|k| Tape::new(1, k as u64)).collect(),
        ..run(probability, end)
    };
    let odds = Odds::of_runs(
        &settings,
        vec![of(1e-6, End::Reached, 4), of(3e-6, End::Reached, 2), of(9e-7, End::TooRare, 0)],
    );
    // The run that gave up counts as zero. Of 1, 3 and 0 the mean is 4/3 and the standard deviation √(7/3).
    let (mean, deviation) = (4.0 / 3.0, (7.0_f64 / 3.0).sqrt());
    // Student's t of two degrees of freedom: 4.303.
    let factor = (4.302_653 * deviation / (mean * 3.0_f64.sqrt())).exp();
    let Estimate { value, low, high } = odds.probability;
    for (found, truth) in [(value, mean), (low, mean / factor), (high, mean * factor)] {
        assert!((1e6 * found / truth - 1.0).abs() < 1e-6, "{found} where {truth} is right");
    }
    let weights: Vec<f64> = odds.failures.iter().map(|(weight, _)| *weight).collect();
    let expected = [1.0 / 16.0, 1.0 / 16.0, 1.0 / 16.0, 1.0 / 16.0, 3.0 / 8.0, 3.0 / 8.0];
    assert!(weights.len() == 6 && weights.iter().zip(expected).all(|(w, e)| (w - e).abs() < 1e-12));
    assert!(odds.alarms.contains(&Alarm::Missed { runs: 1, of: 3 }), "{:?}", odds.alarms);
}

#[test]
fn analytic_an_event_that_no_run_reached_lies_within_the_levels_at_which_they_gave_up() {
    // Levels of 1 and 3e-16: mean 2e-16, standard deviation √2 e-16; Student's t of one degree of freedom: 12.706.
    let odds = Odds::of_runs(&Settings::default(), vec![run(1e-16, End::TooRare), run(3e-16, End::TooRare)]);
    let [Alarm::TooRare { level, at_most }] = odds.alarms[..] else { panic!("{:?}", odds.alarms) };
    let factor = (12.706_2 * 2.0_f64.sqrt() / 2.0 / 2.0_f64.sqrt()).exp();
    assert!(level == 3e-16 && (at_most / (2e-16 * factor) - 1.0).abs() < 1e-4, "{at_most}");
    // Without further assumptions only the plain trials bound the probability: no hit in 8,000.
    assert!((odds.probability.high / 4.610e-4 - 1.0).abs() < 1e-3, "{:?}", odds.probability);
}

#[test]
fn law_an_alarm_widens_the_interval() {
    let settings = Settings::default();
    let told = |all: &[f64]| {
        let runs = all.iter().map(|p| run(*p, if *p > 0.0 { End::Reached } else { End::TooRare })).collect();
        let mut odds = Odds::of_runs(&settings, runs);
        let before = odds.probability;
        odds.doubt();
        (before, odds.probability, odds.widened)
    };
    // Runs that agree keep their interval.
    let (before, after, widened) = told(&[1.0e-6, 1.1e-6, 0.9e-6, 1.05e-6, 0.95e-6, 1.0e-6, 1.1e-6, 0.9e-6]);
    assert!(before == after && !widened);
    // One of eight runs found a part ten times as likely: the others may have missed that part.
    let (before, after, widened) = told(&[1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-5]);
    assert!(
        widened && after.high >= 1.2e-5 && after.low <= 1e-6 / 1.2 && after.high > before.high,
        "{after:?}"
    );
    // A run that did not reach the event sets no lower limit.
    let (_, after, widened) = told(&[1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 0.0]);
    assert!(widened && after.low == 0.0, "{after:?}");
    // Failures that no margin announces may be as probable as plain trials allow: no hit in 4,000, twice.
    let mut odds = Odds::of_runs(&settings, vec![run(1e-6, End::Reached), run(1.1e-6, End::Reached)]);
    odds.alarms = vec![Alarm::Unled(0.5)];
    odds.doubt();
    assert!(odds.widened && (odds.probability.high / 4.610e-4 - 1.0).abs() < 1e-3, "{:?}", odds.probability);
}

#[test]
fn law_a_part_that_nothing_leads_to_is_told_and_a_large_one_is_an_alarm() {
    let of = |share: f64| {
        let mut odds = Odds::of_runs(&Settings::default(), Vec::new());
        odds.alarms.clear();
        odds.tell(share, Alarm::Unled);
        (odds.alarms, odds.remarks)
    };
    assert_eq!(of(0.005), (Vec::new(), Vec::new()));
    assert_eq!(of(0.05), (Vec::new(), vec![Alarm::Unled(0.05)]));
    assert_eq!(of(0.5), (vec![Alarm::Unled(0.5)], Vec::new()));
}

/// Eight runs, each with an estimated coefficient of variation of 0.1. An agreement to 0.01 is chance, and widened; a
/// scatter of less than twice the estimate raises no alarm, because levels of one run are correlated.
#[test]
fn analytic_runs_that_agree_by_chance_have_the_interval_that_they_expect_of_themselves() {
    let of = |spread: f64| {
        let alternate = |k: u32| 1e-6 * (1.0 + if k.is_multiple_of(2) { spread } else { -spread });
        Odds::of_runs(&Settings::default(), (0..8).map(|k| run(alternate(k), End::Reached)).collect())
    };
    // t of seven degrees of freedom: 2.365. The standard deviation of ±x is x √(8/7).
    let factor = |variation: f64| (2.364_624 * variation / 8.0_f64.sqrt()).exp();
    let high = |odds: &Odds| odds.probability.high / odds.probability.value;
    let (agreeing, scattering) = (of(0.01), of(0.17));
    assert!((high(&agreeing) / factor(0.08) - 1.0).abs() < 1e-6, "{:?}", agreeing.probability);
    let own = 0.17 * (8.0_f64 / 7.0).sqrt();
    assert!((high(&scattering) / factor(own) - 1.0).abs() < 1e-6, "{:?}", scattering.probability);
    assert!(agreeing.alarms.is_empty() && scattering.alarms.is_empty(), "{:?}", scattering.alarms);
    assert!(matches!(of(0.2).alarms[..], [Alarm::Disagree { .. }]));
}

#[test]
fn law_a_run_that_is_kept_goes_on_as_it_was() {
    let tape = |number| {
        let mut tape = Tape::new(7, number);
        let mut draws = Streams::taped(&tape).open_named(Purpose::Tolerance, "motor.winding.resistance");
        let _ = draws.normal();
        let _ = Streams::taped(&tape).open(Purpose::CurrentNoise).normal();
        *tape.normals(Purpose::CurrentGain) = vec![-1.5, 0.25];
        tape
    };
    let run = Run { failures: (0..3).map(tape).collect(), ..run(1e-6, End::TooRare) };
    let bytes = postcard::to_stdvec(&run).expect("bytes");
    let again: Run = postcard::from_bytes(&bytes).expect("a run");
    assert_eq!(again, run);
    // Draws beyond the end of a tape come from the tape's own random stream.
    let next = |tape: &Tape| Streams::taped(tape).open(Purpose::Resolver).normal();
    assert_eq!(
        again.failures.iter().map(next).collect::<Vec<_>>(),
        run.failures.iter().map(next).collect::<Vec<_>>()
    );
}

/// Answers of importance sampling: those of eight runs of 1e-6, of which some may scatter.
#[test]
fn law_importance_sampling_is_taken_where_it_is_better_or_has_found_more() {
    // Of `draws` draws `hits` have the event, all with one weight: the effective number is that of the hits.
    let of = |p: f64, scatter: f64, [hits, lone]: [u32; 2]| {
        let one = |k: u32| 1e-6 * (1.0 + if k.is_multiple_of(2) { scatter } else { -scatter });
        let odds = Odds::of_runs(&Settings::default(), (0..8).map(|k| run(one(k), End::Reached)).collect());
        odds.with(Sampled::of_equal(p, 100_000, hits, lone))
    };
    let by_runs = |odds: &Odds| odds.estimator == Estimator::Subset && odds.probability.value == 1e-6;
    // Too few effective draws; enough of them, with the smaller error; an error larger than that of the runs.
    assert!(by_runs(&of(1.05e-6, 0.1, [199, 0])));
    let taken = of(1.05e-6, 0.3, [1000, 0]);
    assert_eq!(taken.estimator, Estimator::Mixture { parts: 2, effective: 1000, searched: true });
    assert!(by_runs(&of(1.05e-6, 0.01, [400, 0])), "runs err by 0.028, 400 draws by 0.05");
    // The interval is that of 1,000 hits of 100,000: a deviation of √(0.001 − 0.00001), and Student's 1.962.
    let factor = (1.9623 * (1.0_f64 / 1000.0 - 1e-5).sqrt()).exp();
    let Estimate { value, low, high } = taken.probability;
    assert!((high / value / factor - 1.0).abs() < 1e-5 && (value / low / factor - 1.0).abs() < 1e-5);
    // Runs that disagree: their alarm becomes a remark, unless the probability is that of a part of one run.
    assert!(taken.alarms.is_empty() && matches!(taken.remarks[..], [Alarm::Disagree { .. }]));
    let lone = of(1.05e-6, 0.3, [1000, 200]);
    assert!(
        lone.remarks.is_empty() && matches!(lone.alarms[..], [Alarm::Disagree { .. }]),
        "{:?}",
        lone.alarms
    );
    // More than the runs found is taken even from fewer draws; less may be a part that the mixture has missed.
    assert_eq!(of(3e-6, 0.01, [400, 0]).probability.value, 3e-6);
    let less = of(0.3e-6, 0.1, [1000, 0]);
    assert!(by_runs(&less) && matches!(less.alarms[..], [Alarm::Apart { .. }]), "{:?}", less.alarms);
    assert!(of(0.95e-6, 0.1, [1000, 0]).alarms.is_empty());
}

#[test]
fn regress_what_no_run_reached_is_answered_where_the_search_found_it() {
    let odds = Odds::of_runs(&Settings::default(), vec![run(1e-13, End::TooRare); 3]);
    let found = odds.with(Sampled::of_equal(3e-6, 100_000, 1000, 0));
    assert_eq!((found.probability.value, &found.alarms), (3e-6, &Vec::new()));
    assert!(matches!(found.remarks[..], [Alarm::TooRare { .. }]));
}
