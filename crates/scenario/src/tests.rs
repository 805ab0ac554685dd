mod drive;
mod files;

use std::path::Path;

use standstill_detect::{Kind, Method, MethodName, keys};
use standstill_interface::Nanos;
use standstill_plant::built_in;
use standstill_sim::{Arrangement, Purpose, RotorState, Tape};

use super::{AxisSpec, Document, Origin, Plan, ScenarioFile};
use crate::{ErrorSet, Scenario};

pub(super) fn document(text: &str) -> Document {
    Document::parse(Path::new("s.toml"), text).expect("TOML")
}

pub(super) fn scenario_of(document: &Document) -> Result<Scenario<Method<f64>>, String> {
    let file: ScenarioFile = document.load().map_err(|error| error.to_string())?;
    file.scenario(document.files()).map_err(|error| document.locate(error).to_string())
}

pub(super) fn scenario(text: &str) -> Scenario<Method<f64>> {
    scenario_of(&document(text)).unwrap_or_else(|error| panic!("{error}"))
}

pub(super) fn error(text: &str) -> String {
    match Document::parse(Path::new("s.toml"), text) {
        Ok(document) => scenario_of(&document).expect_err("must be refused"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn law_what_a_file_leaves_out_is_as_without_a_file() {
    let of = |method, motor: &str, errors, rotor| {
        Scenario::of_method(method, built_in(motor).expect("built in"), errors, rotor, 1)
    };
    let plain = of(MethodName::LineInductanceFast, "paper-5k5", ErrorSet::Default, RotorState::Locked);
    assert_eq!(scenario(""), plain);
    let other = scenario(
        "motor = \"pm-reluctance\"\nerrors = \"harsh\"\nseed = 7\nrotor.state = \"free\"\ndetector.method = \"bipolar\"",
    );
    let own = of(MethodName::Bipolar, "pm-reluctance", ErrorSet::Harsh, RotorState::Free);
    assert_eq!(other, Scenario { seed: 7, ..own });
}

#[test]
fn analytic_each_key_is_where_it_belongs() {
    let s = scenario(
        r#"
        [rotor]
        angle = "43.2 deg"
        [inverter]
        dc_link = "540 V"
        ripple = "1 %"
        dead_time = "1.5 us"
        carrier = "8 kHz"
        [sensors]
        arrangement = "two-in-line"
        gain_error = "0.5 %"
        noise = "12 mA"
        range = 25
        jitter = 1e-7
        [detector]
        method = "maximum-likelihood"
        pulse = "180 us"
        rounds = 4
        signature = "inverted"
        pole_error = 1e-4
        "#,
    );
    assert_eq!(s.start_angle, Some(43.2_f64.to_radians()));
    assert_eq!((s.drive.link.voltage, s.drive.link.ripple), (540.0, 0.01));
    assert_eq!((s.drive.dead_time, s.drive.carrier_period), (Nanos(1500), Nanos(125_000)));
    assert_eq!((s.sensors.arrangement, s.sensors.gain_error), (Arrangement::TwoInLine, 0.005));
    let adc = s.sensors.adc.expect("a converter");
    assert_eq!((s.sensors.noise, adc.bits, adc.low, adc.high), (12e-3, 12, -25.0, 25.0));
    assert_eq!(s.sensors.jitter, Nanos(100));
    let Method::MaximumLikelihood(detector) = s.detector else { panic!("another method") };
    assert_eq!((detector.pulses.train.pulse, detector.pulses.train.rounds), (Nanos(180_000), 4));
    // The detector knows the drive of the file.
    assert_eq!((detector.pulses.train.dead_time, detector.pulses.pole_error), (Nanos(1500), 1e-4));
}

#[test]
fn law_a_motor_in_place_differs_from_its_base_in_what_is_said() {
    let base = built_in("paper-5k5").expect("built in");
    let s = scenario("[motor]\nbase = \"paper-5k5\"\n[motor.winding]\nresistance = \"1.4 Ω\"");
    assert_eq!(s.motor.resistance, 1.4);
    assert_eq!(s.motor.winding, base.winding);
    // The drive knows it.
    assert_eq!(s.nameplate().resistance, 1.4);
    let mut by_key = document("");
    by_key.set("motor.winding.resistance", "1.4 Ω", Origin::CommandLine).expect("a key");
    assert_eq!(scenario_of(&by_key).expect("valid"), s);
    let mut named = document("motor = \"paper-5k5\"");
    named.set("motor.winding.resistance", "1.4", Origin::Axis).expect("a key");
    assert_eq!(scenario_of(&named).expect("valid"), s);
}

#[test]
fn regress_mistakes_are_named_with_line_key_and_what_is_near() {
    let cases: [(&str, &[&str]); 16] = [
        (
            "trials = 10\n[sensors]\nnoize = \"10 mA\"",
            &["s.toml: line 3", "`sensors.noize`", "did you mean `noise`"],
        ),
        ("[sensors]\n\nnoise = \"10 mV\"", &["s.toml: line 3", "`sensors.noise`", "10 mV", "in A"]),
        ("errors = \"hash\"", &["line 1", "`errors`", "did you mean `harsh`"]),
        ("[detector]\nmethod = \"bipolr\"", &["line 2", "`detector.method`", "did you mean `bipolar`"]),
        ("motor = \"paper\"", &["line 1", "`motor`", "paper-5k5"]),
        ("motor = \"none.toml\"", &["line 1", "`motor`", "none.toml", "No such file"]),
        (
            "[motor]\nbase = \"paper-5k5\"\n[motor.winding]\nresistence = 1",
            &["line 4", "`motor.winding.resistence`", "did you mean `resistance`"],
        ),
        ("[motor]\nbase = \"paper-5k5\"\nwinding.resistance = \"1 H\"", &["line 3", "1 H", "Ω"]),
        ("rotor.load = \"3 N m\"", &["line 1", "`rotor.load`", "locked"]),
        ("[inverter]\ncarrier = \"1 Hz\"", &["line 2", "`inverter.carrier`", "10 Hz to 1 MHz"]),
        (
            "[detector]\nmethod = \"hfi-rotating\"\npulse = \"100 us\"",
            &["line 3", "`detector.pulse`", "hfi-rotating"],
        ),
        ("detector.least_saliency = 2", &["found 2, needed a share from 0 to 1"]),
        ("detector.rest = 0.5", &["found 50 %, needed from 100.1 %"]),
        (
            "[detector]\nmethod = \"bipolar\"\nrounds = 1",
            &["line 3: `detector.rounds`: found 1, needed at least 2"],
        ),
        ("trials = 0", &["line 1", "`trials`", "at least 1"]),
        ("trials = = 3", &["s.toml: line 1"]),
    ];
    for (text, parts) in cases {
        let message = error(text);
        for part in parts {
            assert!(message.contains(part), "{text:?} says: {message}");
        }
        assert!(!message.contains('\n'), "{message}");
    }
    let mut document = document("");
    document.set("sensors.noise", "-3 mA", Origin::CommandLine).expect("a key");
    let message = scenario_of(&document).expect_err("negative");
    assert!(message.contains("set on the command line") && message.contains("`sensors.noise`"), "{message}");
    document.set("sensors.noise", "3 mA", Origin::CommandLine).expect("a key");
    scenario_of(&document).expect("mended");
    assert!(document.set("sensors..noise", "1", Origin::CommandLine).is_err());
}

#[test]
fn law_a_written_scenario_is_the_one_that_was_read() {
    let text = "motor = \"low-inertia\"\nerrors = \"harsh\"\n[sensors]\nnoise = \"12 mA\"\n[rotor]\nstate = \"free\"";
    let file: ScenarioFile = document(text).load().expect("valid");
    let written = file.text().expect("serialisable");
    assert_eq!(scenario(&written), scenario(text));
}

#[test]
fn regress_a_written_scenario_has_its_axes_in_their_order() {
    let text = r#"
        [axes]
        "sensors.noise" = { from = "1 mA", to = "100 mA", points = 3, log = true }
        "detector.method" = ["bipolar", "line-inductance-fast"]
        "rotor.angle" = { from = "0 deg", to = "90 deg", points = 2 }
        "errors" = ["default", "harsh"]
        [tolerances]
        "motor.winding.resistance" = { normal = "5 %", truncated = 3 }
        "#;
    let first = plan(text);
    let second = plan(&first.text().expect("serialisable"));
    assert_eq!(first.points(), second.points());
    assert_eq!(first.points()[1].values[3].1, "harsh".into());
    assert_eq!(first.text(), second.text());
}

pub(super) fn plan(text: &str) -> Plan {
    Plan::new(document(text)).unwrap_or_else(|error| panic!("{error}"))
}

fn values(plan: &Plan) -> Vec<Vec<String>> {
    let text =
        |(_, value): &(String, toml::Value)| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
    plan.points().iter().map(|point| point.values.iter().map(text).collect()).collect()
}

#[test]
fn analytic_a_grid_is_all_combinations_the_last_axis_first() {
    let plan = plan(
        r#"
        [axes]
        "sensors.noise" = { from = "0 mA", to = "20 mA", points = 3 }
        "detector.method" = ["bipolar", "maximum-likelihood"]
        "inverter.dead_time" = { from = "1 us", to = "4 us", points = 3, log = true }
        "#,
    );
    let all = values(&plan);
    assert_eq!(all.len(), 18);
    assert_eq!(all[0], ["0 mA", "bipolar", "1 us"]);
    assert_eq!(all[1], ["0 mA", "bipolar", "2 us"]);
    assert_eq!(all[3], ["0 mA", "maximum-likelihood", "1 us"]);
    assert_eq!(all[17], ["20 mA", "maximum-likelihood", "4 us"]);
    let last = plan.scenario(17).expect("valid");
    assert_eq!((last.sensors.noise, last.drive.dead_time), (20e-3, Nanos(4000)));
}

#[test]
fn law_points_of_a_design_fill_each_axis_evenly() {
    for kind in ["latin-hypercube", "sobol"] {
        let axes = "[axes]\n\"sensors.noise\" = { from = 0, to = 1 }\n\"sensors.gain_error\" = { from = 0.0, to = 0.5 }";
        let text = format!("{axes}\n[design]\nkind = \"{kind}\"\npoints = 64");
        let plan = plan(&text);
        for axis in 0..2 {
            let mut bins = [0; 16];
            for point in plan.points() {
                let value = &point.values[axis].1;
                let number = value.as_float().or(value.as_integer().map(|x| x as f64)).expect("a number");
                let share = number / [1.0, 0.5][axis];
                // A share of sixteen is an index.
                #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
                let bin = ((share * 16.0) as usize).min(15);
                bins[bin] += 1;
            }
            assert_eq!(bins, [4; 16], "{kind}, axis {axis}");
        }
        // Another seed gives other points, the same seed the same.
        assert_eq!(values(&plan), values(&self::plan(&text)));
        assert_ne!(values(&plan), values(&self::plan(&format!("seed = 2\n{text}"))));
    }
}

#[test]
fn law_tolerances_have_the_spread_that_is_stated() {
    let plan = plan(
        r#"
        [tolerances]
        "motor.winding.resistance" = { normal = "5 %" }
        "sensors.noise" = { uniform = "4 mA", mean = "10 mA" }
        "inverter.dead_time" = { normal = "200 ns", mean = "2000 ns", truncated = 1 }
        "#,
    );
    let drawn: Vec<_> = (0..2000).map(|trial| plan.drawn(0, None, trial).expect("valid")).collect();
    let moments = |value: &dyn Fn(&Scenario<Method<f64>>) -> f64| {
        let n = drawn.len() as f64;
        let mean = drawn.iter().map(value).sum::<f64>() / n;
        (mean, (drawn.iter().map(|s| (value(s) - mean).powi(2)).sum::<f64>() / n).sqrt())
    };
    let (mean, deviation) = moments(&|s| s.motor.resistance);
    assert!((mean / 1.2 - 1.0).abs() < 0.005 && (deviation / 0.06 - 1.0).abs() < 0.06, "{mean} {deviation}");
    let (mean, deviation) = moments(&|s| s.sensors.noise);
    let expected = 4e-3 / 3.0_f64.sqrt();
    assert!((mean / 10e-3 - 1.0).abs() < 0.02 && (deviation / expected - 1.0).abs() < 0.05);
    assert!(drawn.iter().all(|s| s.drive.dead_time >= Nanos(1800) && s.drive.dead_time <= Nanos(2200)));
    // The motor is another one, which the drive does not know.
    let nominal = plan.scenario(0).expect("valid");
    assert!(drawn.iter().all(|s| s.detector == nominal.detector));
    let one = plan.trial(0, &nominal, 3).expect("valid");
    assert_eq!(one, drawn[3].trial(3).expect("settings"));
    // A tape has them too, each under its key.
    let taped = |tape: &Tape| {
        let drawn = plan.scenario_taped(0, &nominal, tape).expect("valid");
        drawn.trial_taped(tape).expect("settings")
    };
    let mut tape = Tape::new(1, 3);
    assert_eq!(taped(&tape), one);
    assert_eq!(tape.normals_named(Purpose::Tolerance, "motor.winding.resistance").len(), 1);
    tape.grow_from(2, 3);
    assert_eq!(taped(&tape), one);
    tape.normals_named(Purpose::Tolerance, "motor.winding.resistance")[0] += 1.0;
    assert_ne!(taped(&tape), one);
    // A further tolerance shifts none of the others.
    let other = self::plan(
        "[tolerances]\n\"sensors.offset\" = { normal = \"1 mA\", mean = \"9 mA\" }\n\"motor.winding.resistance\" = { normal = \"5 %\" }",
    );
    assert_eq!(other.drawn(0, None, 7).expect("valid").motor.resistance, drawn[7].motor.resistance);
}

#[test]
fn regress_a_motor_comes_before_what_is_changed_of_it() {
    let axes = |first: &str, second: &str| plan(&format!("[axes]\n{first}\n{second}"));
    let motor = "motor = [\"paper-5k5\", \"surface-magnet\"]";
    let resistance = "\"motor.winding.resistance\" = [0.5, 5]";
    let changed = axes(resistance, motor);
    let resistances: Vec<f64> =
        (0..4).map(|k| changed.scenario(k).expect("valid").motor.resistance).collect();
    assert_eq!(resistances, [0.5, 0.5, 5.0, 5.0]);
    assert_eq!(changed.scenario(3).expect("valid"), axes(motor, resistance).scenario(3).expect("valid"));
}

#[test]
fn law_a_width_may_have_another_prefix_than_its_mean() {
    let of = |width: &str| {
        let text =
            format!("[tolerances]\n\"inverter.dead_time\" = {{ uniform = \"{width}\", mean = \"2 us\" }}");
        plan(&text).drawn(0, None, 5).expect("valid").drive.dead_time
    };
    assert_eq!(of("200 ns"), of("0.2 us"));
    assert_eq!(of("200 ns"), of("10 %"));
}

#[test]
fn regress_mistakes_of_axes_and_tolerances_are_named() {
    let cases: [(&str, &[&str]); 16] = [
        (
            "[axes]\n\"sensors.noize\" = [1, 2]",
            &["s.toml: line 2, set as an axis", "`sensors.noize`", "did you mean `noise`"],
        ),
        (
            "[axes]\n\"sensors.noise\" = { from = \"0 mA\", to = \"1 V\", points = 3 }",
            &["line 2", "0 mA", "same unit"],
        ),
        (
            "[axes]\n\"sensors.noise\" = { from = \"0 A\", to = \"1 A\", points = 3, log = true }",
            &["line 2", "positive"],
        ),
        ("[axes]\n\"sensors.noise\" = { from = \"0 A\", to = \"1 A\" }", &["line 2", "points"]),
        ("[axes]\n\"sensors.noise\" = []", &["line 2", "empty list"]),
        (
            "[axes]\n\"sensors.noise\" = { from = \"1 V\", to = \"2 V\", points = 2 }",
            &["set as an axis", "`sensors.noise`", "1 V"],
        ),
        ("[design]\nkind = \"sobol\"", &["design.points", "from 1 to"]),
        ("[tolerances]\n\"sensors.noise\" = { normal = \"5 %\" }", &["line 2", "`mean`"]),
        (
            "[tolerances]\n\"sensors.noise\" = { mean = \"1 A\", normal = \"5 V\" }",
            &["line 2", "same dimension"],
        ),
        ("[tolerances]\n\"sensors.noise\" = { mean = \"1 A\" }", &["line 2", "`normal` and `uniform`"]),
        (
            "[tolerances]\n\"sensors.noise\" = { norml = \"5 %\" }",
            &["line 2", "norml", "did you mean `normal`"],
        ),
        // 1000 draws go three deviations far.
        (
            "[tolerances]\n\"sensors.noise\" = { mean = \"10 mA\", normal = \"40 %\" }",
            &["`sensors.noise`", "drawn as a tolerance", "zero or more"],
        ),
        ("[axes]\n\"sensors.noise\" = [\"1 mA\", \"2 mA\", \"1 mA\"]", &["line 2", "twice"]),
        ("[axes]\n\"sensors.noise\" = { from = 1, to = 1, points = 3 }", &["line 2", "both ends"]),
        ("[design]\nkind = \"sobol\"\npoints = 4", &["line 3", "no axes"]),
        (
            "[axes]\nmotor = [\"paper-5k5\", \"surface-magnet\"]\n[tolerances]\n\"motor.winding.resistance\" = { normal = \"5 %\" }",
            &["line 4", "`mean`"],
        ),
    ];
    for (text, parts) in cases {
        let message = Plan::new(document(text)).expect_err("must be refused").to_string();
        for part in parts {
            assert!(message.contains(part), "{text:?} says: {message}");
        }
    }
}

#[test]
fn analytic_axes_of_the_command_line() {
    let mut document = document("[axes]\n\"sensors.noise\" = [1]");
    let axis = AxisSpec::parse("0 mA:50 mA:6").expect("a range");
    document.vary("sensors.noise", &axis).expect("an axis");
    document
        .vary("detector.method", &AxisSpec::parse("bipolar,line-inductance").expect("a list"))
        .expect("an axis");
    let plan = Plan::new(document.clone()).expect("valid");
    assert_eq!(plan.points().len(), 12);
    // A plain number is in SI, and prefixes may differ.
    for text in ["0:0.05 A:6", "0 mA:0.05 A:6", "0:50 mA:6"] {
        document.vary("sensors.noise", &AxisSpec::parse(text).expect("a range")).expect("an axis");
        let same = Plan::new(document.clone()).expect("valid");
        assert_eq!(same.scenario(3).expect("valid"), plan.scenario(3).expect("valid"), "{text}");
    }
    assert_eq!(values(&plan)[3], ["10 mA", "line-inductance"]);
    for text in ["0:1", "0:1:x", "0:1:3:lin"] {
        assert!(AxisSpec::parse(text).is_err(), "{text}");
    }
}

#[test]
fn law_each_key_of_a_method_is_one_of_scenario_files_with_its_unit() {
    for key in keys::ALL {
        let name = format!("detector.{}", key.name);
        let (value, wanted) = match key.kind {
            Kind::Number { unit, whole, range: [low, high], .. } => {
                assert_eq!(super::unit(&name).as_deref(), Some(unit), "{name}");
                let small = 0.07 * high.min(0.1);
                let within = if small < low { low + 0.1 * (high - low) } else { small };
                // Of three widths of a sector one.
                let within = if key.name == keys::SECTOR.name { 30.0 } else { within };
                (if whole { "5".to_owned() } else { format!("{within}") }, true)
            }
            Kind::Flag => ("false".to_owned(), super::unit(&name).is_none()),
        };
        assert!(wanted, "{name}");
        // Set by name it reaches the method that has it, and is an error of one that has not.
        for method in MethodName::ALL {
            // Six pulses are timed where there is a timer.
            let mut document = document("[sensors]\ntimer = \"1 us\"");
            document.set("detector.method", method.name(), Origin::CommandLine).expect("a key");
            document.set("sensors.terminals", "true", Origin::CommandLine).expect("a key");
            if (key.name, method) == (keys::TIMED.name, MethodName::SixPulse) {
                document.set("detector.rounds", "2", Origin::CommandLine).expect("a key");
            }
            let plain = scenario_of(&document).expect("valid").detector;
            document.set(&name, &value, Origin::CommandLine).expect("a key");
            match (plain.get(key), scenario_of(&document)) {
                (Some(_), Ok(set)) => assert_ne!(plain.get(key), set.detector.get(key), "{method} {name}"),
                (None, Err(error)) => {
                    assert!(error.contains("a method that has such a setting"), "{error}");
                }
                (before, after) => panic!("{method} {name} = {value}: {before:?} {:?}", after.err()),
            }
        }
    }
}
