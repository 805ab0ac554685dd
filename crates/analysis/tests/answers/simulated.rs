//! Odds of simulated starts against closed forms and plain trials.
#![allow(clippy::disallowed_methods, reason = "tests compare with the C library")]

use std::sync::atomic::AtomicBool;

use standstill_analysis::subset::Settings;
use standstill_analysis::{Alarm, Anatomy, Estimator, Event, Odds, Trials};
use standstill_interface::{Fault, Outcome};
use standstill_scenario::{Record, Verdict};
use standstill_sim::{Ended, Tape};

use crate::motor;

static NEVER: AtomicBool = AtomicBool::new(false);

/// Plain trials, and the share of them with the event.
fn plainly(trials: &Trials<'_>, event: Event, count: u64) -> (Vec<Record>, f64) {
    let tapes: Vec<Tape> = (0..count).map(|k| Tape::new(77, k)).collect();
    let records = trials.all_records(tapes, &NEVER).expect("trials");
    let share = records.iter().filter(|record| event.value(record) > 0.0).count() as f64 / count as f64;
    (records, share)
}

/// Odds by levels of an eighth of the states, for time.
fn by_levels(trials: &Trials<'_>, event: Event) -> Odds {
    let settings = Settings { states: 500, ..Settings::default() };
    trials.odds(event, &settings, &NEVER, |_| {}).expect("runs")
}

#[test]
fn analytic_wrong_evidence_of_the_simulated_motor_has_its_closed_form() {
    wrong_evidence(0.028, 1e-7..1e-4);
}

#[test]
#[ignore = "a rarer event, of more levels: scripts/test-all.sh long"]
fn analytic_wrong_evidence_that_is_rarer_has_its_closed_form() {
    wrong_evidence(0.020, 1e-11..1e-8);
}

/// Noise of this many A alone decides, and makes a probability of this order.
fn wrong_evidence(noise: f64, order: std::ops::Range<f64>) {
    let (current, angle) = (5.0, None);
    let truth = motor::closed_form(current, noise, angle);
    assert!(order.contains(&truth), "{truth:e}");
    let plan = motor::noisy(current, noise, angle);
    let trials = Trials::new(&plan).expect("a scenario");
    let odds = by_levels(&trials, Event::WrongEvidence);
    assert_eq!(odds.estimator, Estimator::Subset);
    let ratio = odds.probability.value / truth;
    assert!((0.65..1.5).contains(&ratio), "{:?} where {truth:e} is right", odds.probability);
}

#[test]
fn analytic_the_inductance_that_was_read_adds_its_noise_to_the_difference_of_the_poles() {
    difference_of_the_poles(8_000);
}

#[test]
#[ignore = "twice the plain trials of the tests that run by default: scripts/test-all.sh long"]
fn cross_twice_the_plain_trials_say_the_same() {
    difference_of_the_poles(20_000);
    counts_as_plain_trials_do(20_000);
    levels_of_the_fault_margin(40_000);
    levels_reach_an_offset(20_000);
}

fn difference_of_the_poles(count: u64) {
    // Δ grows with the square of the vectors' voltage, which follows from an inductance that was read with a per cent of noise.
    let (current, noise) = (5.0, 0.020);
    let of_two_readings = (4.0 / 3.0 * (1.0 + 2.0 / 12.0_f64)).sqrt() * noise;
    let (margin, deviation) = motor::first_order(current, noise, 10.0);
    let ratio = deviation / of_two_readings;
    assert!((1.003..1.01).contains(&ratio), "{ratio}");
    // And so it scatters: of 8,000 trials a standard deviation is known to 0.8 %.
    let plan = motor::noisy(current, noise, Some(10.0));
    let tapes: Vec<Tape> = (0..count).map(|k| Tape::new(5, k)).collect();
    let records = Trials::new(&plan).expect("a scenario").all_records(tapes, &NEVER).expect("trials");
    let margins: Vec<f64> = records
        .iter()
        .filter_map(|record| {
            let Ended::Outcome(outcome) = record.run.ended else { return None };
            outcome.findings().polarity.map(|pole| pole.along - pole.against)
        })
        .collect();
    assert!(margins.len() as u64 > count - count / 200);
    let n = margins.len() as f64;
    let mean = margins.iter().sum::<f64>() / n;
    let scatter = (margins.iter().map(|each| (each - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    assert!((mean.abs() / margin - 1.0).abs() < 5e-3, "{mean} where {margin} is without noise");
    assert!((scatter / deviation - 1.0).abs() < 0.02, "{scatter} where {deviation} follows");
}

#[test]
fn cross_subset_simulation_counts_as_plain_trials_do() {
    counts_as_plain_trials_do(10_000);
}

fn counts_as_plain_trials_do(count: u64) {
    let plan = motor::plan("errors = \"default\"\ndetector.method = \"line-inductance-fast\"");
    let trials = Trials::new(&plan).expect("a scenario");
    let event = Event::Error(2.2);
    let (_, plain) = plainly(&trials, event, count);
    // Some 75 in 10,000.
    assert!((0.004..0.015).contains(&plain), "{plain}");
    let odds = by_levels(&trials, event);
    let ratio = odds.probability.value / plain;
    // Twelve per cent of the plain trials' own, and eight of the runs'.
    assert!((0.75..1.33).contains(&ratio), "{ratio}");

    // A gain of b too large turns the axis between 30 and 45° forwards, between 135 and 150° backwards.
    let anatomy = Anatomy::of(&trials, event, &odds.failures, &NEVER).expect("runs");
    let gain = |from: f64, positive: bool| {
        let sector = anatomy.sectors.iter().find(|s| s.angles_deg.0 == from && s.positive == Some(positive));
        let draws = sector.map(|sector| sector.draws.as_slice()).unwrap_or_default();
        draws.iter().find(|draw| draw.name == "gain of b").map_or(0.0, |draw| draw.mean)
    };
    let gains = [30.0, 135.0].map(|from| [gain(from, true), gain(from, false)]);
    let [[early_forwards, early_backwards], [late_forwards, late_backwards]] = gains;
    assert!(early_forwards > 0.5 && early_backwards < -0.5, "{gains:?}");
    assert!(late_forwards < -0.5 && late_backwards > 0.5, "{gains:?}");
    assert!(
        anatomy.typical.is_some_and(|tape| event.value(&trials.records(&[tape]).expect("runs")[0]) > 0.0)
    );
}

#[test]
fn law_a_locked_rotor_never_moves_and_that_is_said_at_once() {
    let plan = motor::plan("detector.method = \"line-inductance-fast\"\ndetector.signature = \"none\"");
    let trials = Trials::new(&plan).expect("a scenario");
    let settings = Settings { states: 200, ..Settings::default() };
    let odds = trials.odds(Event::Moved(1.0), &settings, &NEVER, |_| {}).expect("runs");
    assert_eq!(odds.alarms, [Alarm::Constant]);
    assert_eq!((odds.probability.value, odds.trials), (0.0, 200));
    assert!(Alarm::Constant.to_string().contains("plain trials"), "{}", Alarm::Constant);
}

#[test]
fn cross_levels_of_the_fault_margin_count_failed_starts_as_plain_trials_do() {
    levels_of_the_fault_margin(20_000);
}

fn levels_of_the_fault_margin(count: u64) {
    // The paper's motor has a saliency of 0.23: noise, gains and drive seldom make less than this of it.
    let plan = motor::plan(
        "errors = \"default\"\n[detector]\nmethod = \"line-inductance-fast\"\nleast_saliency = 0.2085",
    );
    let trials = Trials::new(&plan).expect("a scenario");
    let (records, plain) = plainly(&trials, Event::Failed, count);
    assert!((7e-4..2.5e-3).contains(&plain), "{plain}");
    // The margin is the saliency's, as its fault says, and that of the others too: none is flat.
    for record in &records {
        let margin = record.findings().fault_margin.expect("checks with limits");
        assert_eq!(margin < 0.0, record.verdict() == Verdict::Failed, "{margin}");
        if let Ended::Outcome(Outcome::Failed { fault: Fault::NoSaliency { ratio, needed }, .. }) =
            record.run.ended
        {
            assert_eq!(margin, ratio / needed - 1.0);
        }
    }
    let odds = by_levels(&trials, Event::Failed);
    assert_eq!(odds.estimator, Estimator::Subset);
    assert!(odds.levels > 2 && !odds.alarms.iter().any(|alarm| matches!(alarm, Alarm::Unled(_))));
    let ratio = odds.probability.value / plain;
    // A fifth of the plain trials' own, and sixteen per cent of the runs'.
    assert!((0.6..1.6).contains(&ratio), "{ratio}");
}

#[test]
#[ignore = "levels of another margin than the one that runs by default: scripts/test-all.sh long"]
fn cross_levels_reach_an_offset_that_looks_like_a_current_that_stays() {
    levels_reach_an_offset(10_000);
}

fn levels_reach_an_offset(count: u64) {
    // One of six readings, three phases of either sign, beyond 0.22 A: 6 Q(0.22/0.07) is some 5e-3.
    let plan = motor::plan(
        "errors = \"default\"\nsensors.offset = \"70 mA\"\ndetector.method = \"line-inductance-fast\"",
    );
    let trials = Trials::new(&plan).expect("a scenario");
    let (records, plain) = plainly(&trials, Event::Failed, count);
    let failed = |record: &&Record| Event::Failed.value(record) > 0.0;
    assert!((1e-3..1e-2).contains(&plain), "{plain}");
    let persists = |record: &Record| {
        let Ended::Outcome(outcome) = record.run.ended else { return false };
        matches!(outcome, Outcome::Failed { fault: Fault::CurrentPersists(_), .. })
    };
    assert!(records.iter().filter(failed).all(persists), "no other check decides");
    let odds = by_levels(&trials, Event::Failed);
    let ratio = odds.probability.value / plain;
    // Fourteen per cent of the plain trials' own, and ten of the runs'.
    assert!((0.7..1.4).contains(&ratio), "{plain} plain, {:?}", odds.probability);
}

#[test]
fn law_a_fault_without_a_margin_is_said_to_be_one() {
    // A converter that ends where the vectors' current lies: what is clipped has no margin.
    let plan = motor::plan(
        "errors = \"default\"\nsensors.range = 8.4\n[detector]\nmethod = \"line-inductance-fast\"",
    );
    let trials = Trials::new(&plan).expect("a scenario");
    let odds = by_levels(&trials, Event::Failed);
    assert!(odds.alarms.iter().any(|alarm| matches!(alarm, Alarm::Unled(share) if *share > 0.9)), "{odds:?}");
}
