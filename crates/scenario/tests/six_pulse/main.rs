//! Six pulses in closed loop: the figures that the method is for, on motors of its world.
#![allow(clippy::disallowed_methods, reason = "tests compare with the C library")]

mod refusals;
mod sampled;

use std::f64::consts::PI;
use std::path::Path;

use standstill_detect::{Method, Settings as _};
use standstill_interface::{
    AlphaBeta, Angle, Command, Detector, Fault, Leg, Nanos, Outcome, Reading, Sampling, Step,
};
use standstill_scenario::{Document, FileError, Origin, Plan, Scenario};
use standstill_sim::{Ended, NoProbe, RunError, run};

const FAN: &str = include_str!("../../../../examples/scenarios/six-pulse-fan.toml");
const OUTRUNNER: &str = include_str!("../../../../examples/scenarios/six-pulse-outrunner.toml");
const PAPER: &str = "errors = \"none\"\n[sensors]\ntimer = \"0.32 us\"\n[detector]\nmethod = \"six-pulse\"\n";

/// A scenario with these keys changed.
fn try_scenario(text: &str, keys: &[&str]) -> Result<Scenario<Method<f64>>, FileError> {
    let mut document = Document::parse(Path::new("s.toml"), text)?;
    for key in keys {
        let (key, value) = key.split_once('=').expect("a value");
        document.set(key, value, Origin::CommandLine)?;
    }
    Plan::new(document)?.scenario(0)
}

fn scenario(text: &str, keys: &[&str]) -> Scenario<Method<f64>> {
    try_scenario(text, keys).unwrap_or_else(|error| panic!("{error}"))
}

/// How trials end.
#[derive(Clone, Copy, Debug, Default)]
struct Ends {
    found: u32,
    open: u32,
    failed: u32,
    /// Poles that were named and are wrong.
    wrong: u32,
    /// Poles that a rule without a limit would name wrongly: the sign of Σ e^{jφ}/t, φ the vectors' directions, along the true axis.
    plainly_wrong: u32,
    /// Answers, named or leaned to, in the right one of six sectors around the vectors.
    sector: u32,
    /// Error of the axis in degrees.
    rms: f64,
    /// Mean of the largest current of a phase when a pulse begins after another, in A.
    residual: f64,
}

/// A detector, and what its drive captured for it.
struct Watched<D> {
    detector: D,
    /// Σ e^{jφ}/t in one over ticks.
    sum: AlphaBeta<f64>,
    /// Direction of the vector under way.
    direction: AlphaBeta<f64>,
    /// Sum of the currents in A that pulses left, and their number.
    left: (f64, f64),
    /// Whether the command under way has a sample at its end for what is left.
    has_sample: bool,
}

impl<D: Detector<f64>> Watched<D> {
    const fn of(detector: D) -> Self {
        let none = AlphaBeta::new(0.0, 0.0);
        Self { detector, sum: none, direction: none, left: (0.0, 0.0), has_sample: false }
    }

    /// Notes the vector's direction, and asks for a sample at the end of the pause behind the one of the trip.
    fn watch(&mut self, command: &mut Command<f64>) {
        let axes = [0.0, 2.0, 4.0].map(|turn: f64| (turn * PI / 3.0).sin_cos());
        let is_high = |leg: &usize| command.stage.legs.0[*leg] == Leg::High;
        let along = (0..3)
            .filter(is_high)
            .fold((0.0, 0.0), |sum: (f64, f64), leg| (sum.0 + axes[leg].0, sum.1 + axes[leg].1));
        let number = (along.0.atan2(along.1) / (PI / 3.0)).round().rem_euclid(6.0);
        let (sin, cos) = (number * PI / 3.0).sin_cos();
        self.direction = AlphaBeta::new(cos, sin);
        self.has_sample = command.threshold.is_some() && command.sampling.count == 1;
        if let (true, Some(pause)) = (self.has_sample, command.then) {
            command.sampling = Sampling::twice(Nanos::ZERO, pause.duration);
        }
    }
}

impl<D: Detector<f64>> Detector<f64> for Watched<D> {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        let own = if let ([own @ .., last], true) = (readings, self.has_sample) {
            let largest = last.current.0.into_iter().fold(0.0, |most: f64, current| most.max(current.abs()));
            self.left = (self.left.0 + largest, self.left.1 + 1.0);
            own
        } else {
            readings
        };
        for reading in own {
            let slope = reading.capture.map_or(0.0, |capture| 1.0 / f64::from(capture.ticks));
            self.sum = self.sum + self.direction * slope;
        }
        let mut step = self.detector.step(own);
        if let Step::Drive(command) = &mut step {
            self.watch(command);
        }
        step
    }
}

fn ends(scenario: &Scenario<Method<f64>>, trials: u64) -> Ends {
    let mut ends = Ends::default();
    for trial in 0..trials {
        let detector = scenario.detector.detector().expect("settings");
        let mut watched = Watched::of(detector);
        let run = run(&scenario.case(trial), &mut watched, false, &mut NoProbe);
        let Ended::Outcome(outcome) = run.ended else { panic!("{:?}", run.ended) };
        let north = Angle::from_radians(run.end_angle);
        let (sin, cos) = run.end_angle.sin_cos();
        ends.plainly_wrong += u32::from(watched.sum.dot(AlphaBeta::new(cos, sin)) < 0.0);
        ends.residual += watched.left.0 / watched.left.1.max(1.0) / trials as f64;
        let (Outcome::Found { angle, .. } | Outcome::Axis { angle, .. }) = outcome else {
            ends.failed += 1;
            continue;
        };
        let right = outcome.evidence_for(north).expect("evidence") > 0.0;
        let found = matches!(outcome, Outcome::Found { .. });
        ends.found += u32::from(found);
        ends.open += u32::from(!found);
        ends.wrong += u32::from(found && !right);
        let off = (angle.difference(north).to_degrees() + 90.0).rem_euclid(180.0) - 90.0;
        ends.rms += off * off;
        let sector = |degrees: f64| (degrees / 60.0).round().rem_euclid(6.0);
        let same = (sector(north.degrees() + off) - sector(north.degrees())).abs() < 0.5;
        ends.sector += u32::from(right && same);
    }
    ends.rms = (ends.rms / f64::from(ends.found + ends.open)).sqrt();
    ends
}

/// Prints the figures of `docs/methods.md`: `cargo test -p standstill-scenario --test six_pulse -- --ignored --nocapture`.
#[test]
#[ignore = "for the tables of the documentation"]
fn measured() {
    let motors = [("paper-5k5", PAPER, 8.0), ("12 V outrunner", OUTRUNNER, 20.0), ("24 V fan", FAN, 1.2)];
    for (name, text, rated) in motors {
        let say =
            |what: &str, keys: &[&str]| println!("{name}, {what}: {:?}", ends(&scenario(text, keys), 2000));
        let at = |share: f64| format!("detector.threshold={} A", share * rated);
        say("1 ns", &["sensors.timer=1 ns"]);
        say("0.32 us", &[]);
        say("2.56 us", &["sensors.timer=2.56 us"]);
        say("0.32 us, half the current", &[&at(0.5)]);
        say("2.56 us, half the current", &["sensors.timer=2.56 us", &at(0.5)]);
        let offset = format!("sensors.comparator_offset={} A", 0.0025 * rated);
        for comparators in ["common", "per-leg"] {
            let own = format!("sensors.comparators={comparators}");
            say(&format!("{comparators}, 1 % of a quarter of the current"), &[&at(0.25), &own, &offset]);
            say(&format!("default, {comparators}"), &["errors=default", &own]);
            say(&format!("field, {comparators}"), &["errors=field", &own]);
        }
        say("currents, default", &["errors=default", "detector.timed=false", "detector.rounds=4"]);
        say("currents, field", &["errors=field", "detector.timed=false", "detector.rounds=4"]);
    }
}

/// Prints the tables of `docs/notes/realism.md`: own comparators, and currents that pulses leave, by the order of the vectors:
/// `cargo test --release -p standstill-scenario --test six_pulse -- --ignored --nocapture tables`.
#[test]
#[ignore = "for the tables of the notes"]
fn tables() {
    let motors = [("paper-5k5", PAPER, 8.0), ("12 V outrunner", OUTRUNNER, 20.0), ("24 V fan", FAN, 1.2)];
    let line = |cells: [String; 4], ends: &Ends, threshold: f64| {
        let Ends { found, open, failed, wrong, plainly_wrong, sector, rms, residual } = *ends;
        let percent = |count: u32| format!("{:.2}", f64::from(count) / 20.0);
        println!(
            "| {} | {:.2} | {rms:.2} | {} | {} | {} | {} | {} | {} |",
            cells.join(" | "),
            100.0 * residual / threshold,
            percent(sector),
            percent(found),
            percent(open),
            percent(failed),
            percent(wrong),
            percent(plainly_wrong),
        );
    };
    for (name, text, rated) in motors {
        for share in [0.25, 0.5, 1.0] {
            for off in [0.002, 0.005, 0.01, 0.03] {
                for comparators in ["common", "per-leg"] {
                    let keys = [
                        format!("detector.threshold={} A", share * rated),
                        format!("sensors.comparators={comparators}"),
                        format!("sensors.comparator_offset={} A", off * share * rated),
                    ];
                    let ends = ends(&scenario(text, &keys.each_ref().map(String::as_str)), 2000);
                    let cells = [
                        name.to_owned(),
                        format!("{share}"),
                        comparators.to_owned(),
                        format!("{:.1} %", 100.0 * off),
                    ];
                    line(cells, &ends, share * rated);
                }
            }
        }
    }
    for (name, text, rated) in motors {
        for share in [0.25, 1.0] {
            for pause in [160, 60, 56, 54, 52, 50, 45, 40] {
                for pairs in [false, true] {
                    let keys = [
                        format!("detector.threshold={} A", share * rated),
                        format!("detector.pause={pause} %"),
                        format!("detector.pairs={pairs}"),
                    ];
                    let ends = ends(&scenario(text, &keys.each_ref().map(String::as_str)), 2000);
                    let order = if pairs { "pairs" } else { "circle" };
                    let cells = [name.to_owned(), format!("{share}"), order.to_owned(), format!("{pause} %")];
                    line(cells, &ends, share * rated);
                }
            }
        }
    }
}

/// A current that a pulse leaves shifts the next time: around the circle more alike than in opposite pairs, where one pulse of each pair
/// begins against what the other left.
#[test]
fn law_a_current_that_is_left_turns_more_poles_in_opposite_pairs_than_around_the_circle() {
    let of =
        |pause: &str, pairs: &str| ends(&scenario(PAPER, &["detector.threshold=2 A", pause, pairs]), 400);
    // After a whole rest the order does not matter.
    let whole =
        ["detector.pairs=false", "detector.pairs=true"].map(|order| of("detector.pause=160 %", order));
    for ends in &whole {
        assert!(ends.residual < 1e-3 && ends.wrong == 0 && ends.plainly_wrong == 0, "{ends:?}");
        assert!((ends.rms / whole[0].rms - 1.0).abs() < 0.05, "{whole:?}");
    }
    // At a quarter of its current the paper's motor has poles that are worth little beside 8 % of current left.
    let [circle, pairs] =
        ["detector.pairs=false", "detector.pairs=true"].map(|order| of("detector.pause=50 %", order));
    assert!(circle.residual > 0.1 && pairs.residual > 0.1, "{circle:?} {pairs:?}");
    assert!(
        pairs.plainly_wrong > 3 * circle.plainly_wrong / 2 && circle.plainly_wrong > 40,
        "{circle:?} {pairs:?}"
    );
    assert!(pairs.found == 0 && circle.rms > 10.0 * whole[0].rms, "{circle:?} {pairs:?}");
}

#[test]
fn golden_times_to_the_rated_current_find_the_rotor() {
    for (text, rms, sector) in [(PAPER, 0.15, 0.995), (OUTRUNNER, 0.4, 0.99), (FAN, 1.3, 0.98)] {
        let ends = ends(&scenario(text, &[]), 400);
        assert!(ends.rms < rms && ends.wrong == 0 && ends.failed == 0, "{ends:?}");
        assert!(f64::from(ends.sector) >= sector * 400.0, "{ends:?}");
    }
}

#[test]
fn law_a_timer_that_is_too_coarse_names_no_pole() {
    let coarse = scenario(FAN, &["sensors.timer=2.56 us", "detector.threshold=0.6 A"]);
    let ends = ends(&coarse, 400);
    assert_eq!(ends.found, 0, "{ends:?}");
    assert!(ends.plainly_wrong > 120, "{ends:?}");
    // Where no axis is found either, the tick is named, and the one that would do: with it nearly all have an axis.
    let mut ticks: Vec<f64> = (0..100)
        .filter_map(|trial| {
            let record = coarse.trial(trial).expect("settings");
            let Ended::Outcome(Outcome::Failed { fault, .. }) = record.run.ended else { return None };
            let Fault::CoarseTimer { ratio, needed, tick, allowed } = fault else { panic!("{fault}") };
            // Of the data sheet's 3 % the tick leaves nothing to see; one that is as much finer as is lacking shows it.
            assert!((ratio - 0.03).abs() < 2e-3 && needed > ratio && tick == 2.56e-6, "{fault}");
            assert!(allowed < tick && fault.to_string().contains("tick of 2.560 us"), "{fault}");
            Some(allowed)
        })
        .collect();
    ticks.sort_by(f64::total_cmp);
    assert!(ticks.len() > 60, "{ticks:?}");
    let finer = format!("sensors.timer={} s", ticks[0]);
    let finer = self::ends(&scenario(FAN, &[&finer, "detector.threshold=0.6 A"]), 100);
    assert!(finer.failed <= 2, "{finer:?}");
}

/// The pause in which the diodes take the current away, from resistance, inductances and drops, against what flows when the next pulse
/// begins.
#[test]
fn analytic_the_shortest_pause_leaves_no_current() {
    for (text, rated) in [(PAPER, 8.0), (OUTRUNNER, 20.0), (FAN, 1.2)] {
        for (share, delay) in [(0.25, 0.0), (1.0, 0.0), (0.5, 2e-6)] {
            let threshold = share * rated;
            let keys =
                [format!("detector.threshold={threshold} A"), format!("sensors.comparator_delay={delay} s")];
            let scenario = scenario(text, &keys.each_ref().map(String::as_str));
            let Method::SixPulse(six) = &scenario.detector else { panic!("another method") };
            let least = six.least_pause(&scenario.nameplate());
            let left = |pause: f64| {
                let pause = format!("detector.pause={pause}");
                let keys = [keys[0].as_str(), &keys[1], &pause];
                ends(&self::scenario(text, &keys), 60).residual / threshold
            };
            let (there, before) = (left(least), left(0.75 * least));
            assert!(there < 2e-3 && before > 5e-3, "{text} {share} {least}: {there} {before}");
        }
    }
}

#[test]
fn law_offsets_of_own_comparators_look_like_a_pole_and_that_of_one_does_not() {
    let offset = "sensors.comparator_offset=20 mA";
    let of = |comparators| ends(&scenario(PAPER, &["detector.threshold=2 A", offset, comparators]), 400);
    let (common, own) = (of("sensors.comparators=common"), of("sensors.comparators=per-leg"));
    // 1 % of a quarter of the rated current: a fifth of the poles.
    assert!((60..110).contains(&own.plainly_wrong) && own.found == 0, "{own:?}");
    assert!(common.plainly_wrong < 4 && common.wrong == 0, "{common:?}");
}

#[test]
fn law_errors_of_drives_leave_poles_open_and_none_wrong() {
    for errors in ["errors=default", "errors=field", "errors=harsh"] {
        for text in [PAPER, OUTRUNNER, FAN] {
            for comparators in ["sensors.comparators=common", "sensors.comparators=per-leg"] {
                let ends = ends(&scenario(text, &[errors, comparators]), 100);
                assert_eq!(ends.wrong, 0, "{errors} {comparators}: {ends:?}");
            }
        }
    }
}

#[test]
fn law_sampled_currents_find_it_too() {
    let ends = ends(&scenario(PAPER, &["errors=default", "detector.timed=false", "detector.rounds=4"]), 200);
    assert!(ends.rms < 0.7 && ends.wrong == 0 && ends.failed == 0 && ends.found > 150, "{ends:?}");
}

#[test]
fn law_an_answer_in_sectors_is_the_middle_of_one() {
    let ends = ends(&scenario(PAPER, &["detector.sector=60 deg"]), 100);
    // Evenly distributed within ±30°.
    assert!((ends.rms - 30.0 / 3.0_f64.sqrt()).abs() < 2.0 && ends.sector >= 99, "{ends:?}");
}

#[test]
fn law_an_overcurrent_is_a_record_with_its_reason() {
    let scenario = scenario("errors = \"default\"", &["detector.method=bipolar", "sensors.trip=3 A"]);
    let record = scenario.trial(0).expect("settings");
    let Ended::Error(error @ RunError::Overcurrent { current_ma }) = record.run.ended else {
        panic!("{:?}", record.run.ended)
    };
    assert!((current_ma - 3000).abs() < 200 && error.to_string().starts_with("overcurrent"), "{error}");
    // Starts that trip at other currents have one reason, each with its own current.
    let named = (0..4).map(|trial| scenario.trial(trial).expect("settings").reason_name());
    assert!(
        named
            .collect::<Vec<_>>()
            .iter()
            .all(|name| name.as_deref() == Some("overcurrent: a comparator tripped"))
    );
    assert!(record.reason().contains(" A"), "{}", record.reason());
    // Above what flows it changes nothing.
    let [with, without] = ["sensors.trip=30 A", "sensors.trip=0 A"].map(|trip| {
        let scenario = self::scenario("errors = \"field\"", &["detector.method=bipolar", trip]);
        scenario.trial(3).expect("settings").run.ended
    });
    assert_eq!(format!("{with:?}"), format!("{without:?}"));
}

#[test]
fn law_pulses_that_reach_the_threshold_within_the_blanking_are_not_timed() {
    // 1.5 L 20 A / 12 V = 50 to 68 us: comparators that are blind for 80 us trip as soon as they wake, in each direction alike; after 60 us
    // in some directions alone, whose times would turn the axis.
    for blanking in ["sensors.blanking=80 us", "sensors.blanking=60 us"] {
        let scenario = scenario(OUTRUNNER, &[blanking]);
        for trial in 0..20 {
            let record = scenario.trial(trial).expect("settings");
            assert!(record.reason().starts_with("tripped too early"), "{blanking}: {}", record.reason());
        }
    }
    let seen = ends(&scenario(OUTRUNNER, &["sensors.blanking=2 us"]), 20);
    assert_eq!((seen.failed, seen.wrong), (0, 0), "{seen:?}");
}
