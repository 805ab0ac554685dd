//! Six pulses in closed loop: the figures that the method is for, on motors of its world.
#![allow(clippy::disallowed_methods, reason = "tests compare with the C library")]

use std::f64::consts::PI;
use std::path::Path;

use standstill_detect::{Method, Settings as _};
use standstill_interface::{AlphaBeta, Angle, Detector, Outcome, Reading, Step};
use standstill_scenario::{Document, FileError, Origin, Plan, Scenario};
use standstill_sim::{Ended, NoProbe, RunError, run};

const FAN: &str = include_str!("../../../examples/scenarios/six-pulse-fan.toml");
const OUTRUNNER: &str = include_str!("../../../examples/scenarios/six-pulse-outrunner.toml");
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
}

/// A detector, and what its drive captured for it.
struct Watched<D>(D, AlphaBeta<f64>, u32);

impl<D: Detector<f64>> Detector<f64> for Watched<D> {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        for reading in readings {
            let (sin, cos) = (f64::from(self.2) * PI / 3.0).sin_cos();
            let slope = reading.capture.map_or(0.0, |capture| 1.0 / f64::from(capture.ticks));
            self.1 = self.1 + AlphaBeta::new(cos, sin) * slope;
            self.2 += 1;
        }
        self.0.step(readings)
    }
}

fn ends(scenario: &Scenario<Method<f64>>, trials: u64) -> Ends {
    let mut ends = Ends::default();
    for trial in 0..trials {
        let detector = scenario.detector.detector().expect("settings");
        let mut watched = Watched(detector, AlphaBeta::new(0.0, 0.0), 0);
        let run = run(&scenario.case(trial), &mut watched, false, &mut NoProbe);
        let Ended::Outcome(outcome) = run.ended else { panic!("{:?}", run.ended) };
        let north = Angle::from_radians(run.end_angle);
        let (sin, cos) = run.end_angle.sin_cos();
        ends.plainly_wrong += u32::from(watched.1.dot(AlphaBeta::new(cos, sin)) < 0.0);
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
    let ends = ends(&scenario(FAN, &["sensors.timer=2.56 us", "detector.threshold=0.6 A"]), 400);
    assert_eq!(ends.found, 0, "{ends:?}");
    assert!(ends.plainly_wrong > 120, "{ends:?}");
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
fn law_what_a_drive_lacks_is_refused_by_its_key() {
    let refused =
        |keys: &[&str]| try_scenario("errors = \"default\"", keys).expect_err("refused").to_string();
    let method = "detector.method=six-pulse";
    let timed = refused(&[method, "detector.timed=true"]);
    assert!(timed.contains("detector.timed") && timed.contains("sensors.timer"), "{timed}");
    for key in ["sensors.comparator_offset=1 A", "sensors.blanking=1 us", "sensors.comparators=per-leg"] {
        let message = refused(&[key]);
        assert!(message.contains("sensors.timer") && message.contains("sensors.trip"), "{message}");
    }
    let message = refused(&["sensors.trip=10 A", "sensors.threshold_bits=8"]);
    assert!(message.contains("sensors.timer"), "{message}");
    let once = refused(&[method, "sensors.timer=1 us", "detector.timed=false"]);
    assert!(once.contains("detector.rounds") && once.contains("2 where `timed` is false"), "{once}");
    let exact = try_scenario("errors = \"none\"", &["sensors.timer=1 us", "sensors.threshold_bits=8"]);
    assert!(exact.expect_err("no range").to_string().contains("sensors.threshold_range"));
    let sector = refused(&[method, "detector.sector=45 deg"]);
    assert!(sector.contains("0, 30 or 60"), "{sector}");
}

#[test]
fn law_an_overcurrent_is_a_record_with_its_reason() {
    let scenario = scenario("errors = \"default\"", &["detector.method=bipolar", "sensors.trip=3 A"]);
    let record = scenario.trial(0).expect("settings");
    let Ended::Error(error @ RunError::Overcurrent { current_ma }) = record.run.ended else {
        panic!("{:?}", record.run.ended)
    };
    assert!((current_ma - 3000).abs() < 200 && error.to_string().starts_with("overcurrent"), "{error}");
    // Above what flows it changes nothing.
    let [with, without] = ["sensors.trip=30 A", "sensors.trip=0 A"].map(|trip| {
        let scenario = self::scenario("errors = \"field\"", &["detector.method=bipolar", trip]);
        scenario.trial(3).expect("settings").run.ended
    });
    assert_eq!(format!("{with:?}"), format!("{without:?}"));
}

/// A timer alone does not sample: what pulses need follows from their settings, not from the method's name.
#[test]
fn law_sampled_pulses_are_refused_on_a_drive_without_phase_currents() {
    for arrangement in ["none", "dc-link-shunt"] {
        let text = |timed: &str| {
            format!(
                "sensors.arrangement = \"{arrangement}\"\nsensors.timer = 1e-6\ndetector.method = \"six-pulse\"\n{timed}"
            )
        };
        let load = |timed| {
            let document = Document::parse(Path::new("s.toml"), &text(timed)).expect("TOML");
            Plan::new(document)
                .and_then(|plan| plan.scenario(0))
                .map(|_| ())
                .map_err(|error| error.to_string())
        };
        assert_eq!(load(""), Ok(()), "{arrangement}");
        let error = load("detector.timed = false\ndetector.rounds = 2").expect_err("no currents of phases");
        assert!(error.contains("the currents of the phases") && error.contains("three-in-line"), "{error}");
    }
}

/// A motor that does not saturate has no pole to find. Shunts below the legs read both directions of a phase by other shunts, and the
/// difference of their gains must not be taken for one.
#[test]
fn law_gains_of_shunts_below_the_legs_are_not_taken_for_a_pole() {
    let text = "errors = \"none\"\n[sensors]\narrangement = \"low-side-shunts\"\ngain_error = \"1 %\"\n[detector]\nmethod = \"six-pulse\"\n";
    let mut scenario = scenario(text, &[]);
    scenario.motor = scenario.motor.linearised();
    let ends = ends(&scenario, 200);
    assert!(ends.open > 150 && ends.found == 0, "{ends:?}");
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

#[test]
fn law_a_threshold_that_the_converter_cannot_set_is_refused() {
    let beyond = ["sensors.threshold_bits=8", "sensors.threshold_range=10 A", "detector.threshold=12 A"];
    let message = try_scenario(PAPER, &beyond).expect_err("beyond the range").to_string();
    assert!(message.contains("threshold") && message.contains("sensors.threshold_range"), "{message}");
    assert!(try_scenario(PAPER, &[beyond[0], beyond[1], "detector.threshold=9.9 A"]).is_ok());
    let message = try_scenario(PAPER, &[beyond[1]]).expect_err("a range of nothing").to_string();
    assert!(message.contains("sensors.threshold_bits"), "{message}");
}
