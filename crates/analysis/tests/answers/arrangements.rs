//! Questions about drives without current sensors: their draws are sources, their odds those of plain trials.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use standstill_analysis::limit::{Limit, Limits, Measure};
use standstill_analysis::subset::Settings;
use standstill_analysis::tune::{Effort, Goal, Judged, Question, Range};
use standstill_analysis::{Estimator, Event, Explained, Trials};
use standstill_scenario::{Document, Origin, Plan, Record};
use standstill_sim::Tape;

static NEVER: AtomicBool = AtomicBool::new(false);

fn plan(text: &str) -> Plan {
    Plan::new(Document::parse(Path::new("test.toml"), text).expect("TOML")).expect("a plan")
}

/// Times to a threshold, with comparators of 10 mA of offset each.
const SIX_PULSE: &str = "motor = \"paper-5k5\"\nerrors = \"none\"\ndetector.method = \"six-pulse\"\ndetector.threshold = \"2 A\"\n\
    [sensors]\ntimer = \"0.1 us\"\ncomparators = \"per-leg\"\ncomparator_offset = \"10 mA\"\ncomparator_noise = \"2 mA\"\n";

/// The floating terminal in pulses that are short for the pole.
const OPEN_TERMINAL: &str = "motor = \"paper-5k5\"\nerrors = \"default\"\ndetector.method = \"open-terminal\"\ndetector.pulse = \"60 us\"\n\
    [sensors]\narrangement = \"none\"\nterminals = true\n";

#[test]
fn cross_odds_of_wrong_evidence_are_those_of_plain_trials() {
    wrong_evidence_as_plainly(&[("six-pulse", SIX_PULSE)]);
}

#[test]
#[ignore = "a second method: scripts/test-all.sh long"]
fn cross_odds_of_wrong_evidence_of_an_open_terminal_are_those_of_plain_trials() {
    wrong_evidence_as_plainly(&[("open-terminal", OPEN_TERMINAL)]);
}

fn wrong_evidence_as_plainly(methods: &[(&str, &str)]) {
    for &(name, text) in methods {
        let plan = plan(text);
        let trials = Trials::new(&plan).expect("a scenario");
        let count = 6000;
        let tapes: Vec<Tape> = (0..count).map(|k| Tape::new(77, k)).collect();
        let records = trials.all_records(tapes, &NEVER).expect("trials");
        let wrong = records.iter().filter(|record| Event::WrongEvidence.value(record) > 0.0).count();
        let share = wrong as f64 / count as f64;
        // A wrong pole that was named has evidence for the wrong one.
        assert!(records.iter().all(|record| {
            Event::WrongPole.value(record) <= 0.0 || Event::WrongEvidence.value(record) > 0.0
        }));
        let settings = Settings { states: 1000, ..Settings::default() };
        let odds = trials.odds(Event::WrongEvidence, &settings, &NEVER, |_| {}).expect("runs");
        assert!(odds.estimator != Estimator::Plain && odds.alarms.is_empty(), "{name}: {odds:?}");
        // The intervals of both have a part in common, and the share is one that plain trials know to a fifth.
        let plain = standstill_campaign::binomial_interval(wrong as u64, count);
        let odds = odds.probability;
        assert!(plain.low < odds.high && odds.low < plain.high, "{name}: {plain:?} {odds:?}");
        assert!((0.003..0.06).contains(&share), "{name}: {share}");
    }
}

/// The sources that a budget asks, and the single draws that an explanation takes back.
#[test]
fn law_errors_of_comparators_and_dividers_explain_a_start() {
    let text = format!("{SIX_PULSE}comparator_delay = \"200 ns\"\ncomparator_delay_spread = \"20 ns\"\n");
    let named: [(&str, String, &[&str]); 2] = [
        (
            "six-pulse",
            text,
            &[
                "sensors.timer",
                "sensors.comparator_offset",
                "sensors.comparator_delay_spread",
                "sensors.comparator_noise",
            ],
        ),
        (
            "open-terminal",
            OPEN_TERMINAL.to_owned(),
            &["sensors.terminal_gain_error", "sensors.terminal_offset", "sensors.terminal_noise"],
        ),
    ];
    for (name, text, keys) in named {
        let plan = plan(&text);
        let trials = Trials::new(&plan).expect("a scenario");
        // A tick of the timer hides small errors of one start, but not those of four.
        let all: Vec<_> =
            (0..4).map(|trial| Explained::of(&trials, 1, trial, &NEVER).expect("runs")).collect();
        let error = |record: &Record| record.axis_error_deg().expect("an axis");
        for key in keys {
            let mut moved = false;
            for explained in &all {
                let of_key: Vec<_> = explained.causes.iter().filter(|cause| cause.key == *key).collect();
                assert!(!of_key.is_empty(), "{name}: {key}");
                let own = error(&explained.record);
                moved |= of_key.iter().any(|cause| (error(&cause.without) - own).abs() > 1e-9);
            }
            assert!(moved, "{name}: {key} moves nothing");
        }
        let causes = || all.iter().flat_map(|explained| &explained.causes);
        let thresholds = causes().filter(|cause| cause.name == "noise of all thresholds").count();
        assert_eq!(thresholds, if name == "six-pulse" { 4 } else { 0 });
        // Without all errors only that of the method itself is left.
        for explained in &all {
            let [left, own] = [&explained.without_all, &explained.record].map(error);
            assert!(left.abs() < 0.35 && (left - own).abs() > 1e-6, "{name}: {own} {left}");
        }
    }
}

/// Where no start has an answer, whatever counts starts without one is alike at all settings: the search goes by how far they are from one.
#[test]
fn regress_tune_leaves_a_plateau_on_which_all_starts_are_open() {
    let fan = include_str!("../../../../examples/scenarios/six-pulse-fan.toml");
    let mut document = Document::parse(Path::new("fan.toml"), fan).expect("TOML");
    for (key, value) in [("detector.threshold", "0.35 A"), ("sensors.timer", "4 us")] {
        document.set(key, value, Origin::CommandLine).expect("a key");
    }
    let range = |key: &str, low, high| Range { key: key.to_owned(), low, high, whole: false };
    let question = Question {
        document: &document,
        ranges: vec![range("detector.threshold", 0.3, 1.2), range("sensors.timer", 0.08e-6, 5e-6)],
        goal: Goal { minimise: Measure::Unanswered, limits: Limits(Vec::new()) },
        relative: Vec::new(),
        against: Measure::Duration,
        // From the scenario's own settings alone: no other start leads off the plateau.
        effort: Effort { starts: 1, coarse: 60, fine: 100, last: 300 },
        seed: 1,
    };
    let tuned = question.tune(&NEVER, &mut |_| {}).unwrap_or_else(|_| panic!("runs"));
    let open = |judged: &Judged| judged.measured.get(Measure::Unanswered).value;
    let shares = [&tuned.start, &tuned.best].map(open);
    assert_eq!(shares[0], 1.0);
    assert!(shares[1] < 0.2, "{shares:?}: {:?}", tuned.best.values);
    let first = tuned
        .looks
        .iter()
        .take(3)
        .map(|look| look.measured.as_ref().map(|of| of.get(Measure::Unanswered).value));
    assert!(first.clone().all(|share| share == Some(1.0)), "{:?}", first.collect::<Vec<_>>());
}

/// The fan of the examples begins with half its rated current and a coarse clock, which name no pole. More current and a finer clock do:
/// its pole is worth some ticks of 0.3 µs at rated current, and grows with the square of the current.
#[test]
fn law_tune_finds_threshold_and_clock_of_the_fan() {
    let fan = include_str!("../../../../examples/scenarios/six-pulse-fan.toml");
    let mut document = Document::parse(Path::new("fan.toml"), fan).expect("TOML");
    for (key, value) in [("detector.threshold", "0.6 A"), ("sensors.timer", "2.56 us")] {
        document.set(key, value, Origin::CommandLine).expect("a key");
    }
    let range = |key: &str, low, high| Range { key: key.to_owned(), low, high, whole: false };
    let question = Question {
        document: &document,
        ranges: vec![range("detector.threshold", 0.3, 1.2), range("sensors.timer", 0.08e-6, 5e-6)],
        goal: Goal {
            minimise: Measure::Unanswered,
            limits: Limits(vec![Limit { measure: Measure::PeakCurrent, most: 1.25 }]),
        },
        relative: Vec::new(),
        against: Measure::Duration,
        effort: Effort { starts: 4, coarse: 60, fine: 100, last: 300 },
        seed: 1,
    };
    let tuned = question.tune(&NEVER, &mut |_| {}).unwrap_or_else(|_| panic!("runs"));
    let open = |judged: &Judged| judged.measured.get(Measure::Unanswered).value;
    let [threshold, tick] = tuned.best.values[..] else { panic!("{:?}", tuned.best) };
    let shares = [&tuned.start, &tuned.best].map(open);
    assert!(shares[0] > 0.95 && shares[1] < 0.1, "{shares:?}: {threshold} A, {tick} s");
    assert!(threshold > 0.9 && tick < 0.7e-6, "{threshold} A, {tick} s");
}
