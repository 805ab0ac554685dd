mod axes;
mod drive;
mod files;

use std::path::Path;

use standstill_detect::{Kind, Method, MethodName, keys};
use standstill_interface::Nanos;
use standstill_plant::built_in;
use standstill_sim::{Arrangement, RotorState};

use super::{Document, Origin, Plan, ScenarioFile};
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
    // The drive knows the changed resistance.
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

#[test]
fn law_each_key_of_a_method_is_one_of_scenario_files_with_its_unit() {
    for key in keys::ALL {
        let name = format!("detector.{}", key.name);
        let (value, wanted) = match key.kind {
            Kind::Number { unit, whole, range: [low, high], .. } => {
                assert_eq!(super::unit(&name).as_deref(), Some(unit), "{name}");
                let small = 0.07 * high.min(0.1);
                let within = if small < low { low + 0.1 * (high - low) } else { small };
                // A sector has one of three widths.
                let within = if key.name == keys::SECTOR.name { 30.0 } else { within };
                (if whole { "5".to_owned() } else { format!("{within}") }, true)
            }
            Kind::Checks => ("[\"turning\"]".to_owned(), super::unit(&name).is_none()),
            // A value that is not the default of any method.
            Kind::Flag => ((key.name == keys::PAIRS.name).to_string(), super::unit(&name).is_none()),
        };
        assert!(wanted, "{name}");
        // The key sets its value in each method that has the setting, and is an error with other methods.
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
