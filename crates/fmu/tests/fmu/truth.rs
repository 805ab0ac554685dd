//! What the description says of each variable, and what the instance gives.

use std::path::Path;

use roxmltree::Document as Xml;
use standstill_fmu::{Kind, Part, Role, Version};
use standstill_interface::{Command, Nanos, Sampling, Stage};
use standstill_scenario::{Document, Plan};
use standstill_sim::run;

use super::importer::{Slave, Unpacked, unpacked};
use super::{FIELD, PERIOD, Script, set_legs};

const STORING: &str = "motor = \"paper-5k5\"\nerrors = \"harsh\"\nrotor = { state = \"free\", angle = -30, load = 0.1, winding_temperature = 60, magnet_temperature = 50 }
inverter = { carrier = 12500.0, capacitance = \"1 mF\", source_resistance = \"1 ohm\", sag_depth = 0.1, sag_start = \"50 us\", sag_duration = \"1 ms\", terminal_capacitance = \"0.5 nF\" }";

/// What there is after some steps.
fn outcome(slave: &Slave, unpacked: &Unpacked) -> Vec<(String, f64)> {
    for n in 0..6 {
        if unpacked.model.part == Part::Drive {
            set_legs(slave, n);
        } else {
            for (name, volts) in [("u_a", 20.0), ("u_b", -15.0), ("u_c", -5.0)] {
                assert_eq!(slave.set(name, volts), 0);
            }
        }
        let period = PERIOD.seconds();
        assert_eq!(slave.step(f64::from(n) * period, period), 0, "{}", slave.said());
    }
    let outputs = unpacked.model.variables.iter().filter(|of| of.is_output() && of.kind == Kind::Real);
    outputs.map(|of| (of.name.clone(), slave.get(&of.name))).collect()
}

/// A parameter that is set beside its start by a part in 10⁹, in the unit that the description says, changes nothing that could be
/// seen. A start that is not what the machine has, or that is in another unit, would.
#[test]
fn law_each_start_is_what_the_instance_has() {
    let mut tried = 0;
    for (text, part) in [(FIELD, Part::Drive), (STORING, Part::Drive), (STORING, Part::Motor)] {
        let unpacked = unpacked(text, part);
        let slave = Slave::ready(&unpacked, &[]);
        let should = outcome(&slave, &unpacked);
        assert!(should.iter().any(|(_, value)| value.abs() > 0.3), "{should:?}");
        let begun = Slave::begun(&unpacked, &[]);
        let before = Slave::made(&unpacked);
        for variable in unpacked.model.variables.iter().filter(|of| of.is_parameter() || of.is_input()) {
            if variable.kind == Kind::Clock {
                continue;
            }
            let (name, start) = (&variable.name, variable.start.expect("a start"));
            assert_eq!((before.get(name), begun.get(name)), (start, start), "{name}");
            if !variable.is_parameter() || variable.kind != Kind::Real || start == 0.0 {
                continue;
            }
            // Some are at an end of what is allowed, or at another key.
            let other = [1.0 + 1e-9, 1.0 - 1e-9].into_iter().find(|share| {
                assert_eq!(slave.call("fmi2Reset"), 0);
                let mode = ["fmi2EnterInitializationMode", "fmi2ExitInitializationMode"];
                slave.set(name, start * share) == 0 && mode.into_iter().all(|mode| slave.call(mode) == 0)
            });
            assert!(other.is_some(), "{name}: {}", slave.said());
            let found = outcome(&slave, &unpacked);
            for ((output, found), (_, should)) in found.iter().zip(&should) {
                let near = if output.starts_with("sampled") { 0.02 } else { 3e-4 } * (1.0 + should.abs());
                assert!((found - should).abs() < near, "{name}: {output} is {found}, not {should}");
            }
            tried += 1;
        }
    }
    assert!(tried > 60, "{tried}");
}

/// Units are the description's: what two variables say of one thing is the same number.
#[test]
fn law_what_two_variables_say_of_one_thing_is_one_number() {
    for (text, part) in
        [(FIELD, Part::Drive), (STORING, Part::Drive), (FIELD, Part::Motor), (STORING, Part::Motor)]
    {
        let unpacked = unpacked(text, part);
        let slave = Slave::begun(&unpacked, &[]);
        let of = |name: &str| {
            slave.get(&if part == Part::Drive { format!("actual.{name}") } else { name.to_owned() })
        };
        assert!((slave.get("rotor.angle") - of("angle")).abs() < 1e-12, "{}", slave.get("rotor.angle"));
        assert_eq!([of("i_a"), of("i_b"), of("i_c"), of("speed")], [0.0; 4]);
        if part == Part::Drive {
            let [set, there, seen] = [slave.get("inverter.dc_link"), of("u_dc"), slave.get("sampled.u_dc")];
            assert!(
                (set - there).abs() < 0.03 * set && (seen - there).abs() < 0.05 * there,
                "{set} {there} {seen}"
            );
        }
        for version in [Version::Two, Version::Three] {
            let text = unpacked.model.description(version);
            let xml = Xml::parse(&text).expect("XML");
            let with = |name: &str| {
                let nodes = xml.descendants().filter(move |node| node.has_attribute(name));
                nodes.map(|node| node.attribute(name).expect("one").to_owned()).collect::<Vec<_>>()
            };
            assert!(!with("unit").contains(&"deg".to_owned()), "degrees beside radians");
            assert!(with("unit").contains(&"rad".to_owned()));
            let shown = xml.descendants().find(|node| node.has_tag_name("DisplayUnit")).expect("degrees");
            let factor: f64 = shown.attribute("factor").expect("one").parse().expect("a number");
            assert_eq!((shown.attribute("name"), std::f64::consts::PI * factor), (Some("deg"), 180.0));
            assert!(with("displayUnit").iter().all(|name| name == "deg") && with("displayUnit").len() == 2);
            for about in with("description") {
                // Each stands alone, and nothing is left out of an FMU or detected in it.
                for word in [
                    "Without it",
                    "Default: ",
                    "detection",
                    "Its ",
                    " its slope",
                    "of its converter,",
                    " with that ",
                    "it begins",
                ] {
                    assert!(!about.contains(word), "{about}");
                }
            }
        }
    }
}

/// `sampled.u_dc` and `count.u_dc` were zero before the first step, and currents had no offset.
#[test]
fn regress_samples_before_the_first_step_are_those_of_a_drive_at_rest() {
    let unpacked = unpacked(FIELD, Part::Drive);
    let plan = Plan::new(Document::parse(Path::new("s.toml"), FIELD).expect("TOML")).expect("valid");
    let scenario = plan.scenario(0).expect("valid");
    let look = Command::hold(Stage::off(Nanos(PERIOD.0 / 2)), Sampling::once(Nanos::ZERO));
    let mut script = Script(vec![look], Vec::new());
    run(&scenario.case(0), &mut script, false, &mut standstill_sim::NoProbe);
    let reading = script.1[0];
    for slave in [Slave::begun(&unpacked, &[]), Slave::ready(&unpacked, &[])] {
        assert_eq!(slave.get("sampled.u_dc"), reading.dc_link);
        assert_eq!(slave.get("count.u_dc"), f64::from(reading.counts.dc_link));
        assert!(reading.counts.dc_link > 100, "{reading:?}");
        for (k, phase) in ["a", "b", "c"].iter().enumerate() {
            assert_eq!(slave.get(&format!("sampled.i_{phase}")), reading.current.0[k]);
            assert_eq!(slave.get(&format!("count.i_{phase}")), f64::from(reading.counts.current.0[k]));
        }
    }
}

/// It was ignored as long as `rotor.draw_angle` was true, as it is unless somebody knows of it.
#[test]
fn regress_an_angle_that_is_set_is_where_the_rotor_stands() {
    let unpacked = unpacked("motor = \"paper-5k5\"\nseed = 7", Part::Drive);
    let of = |parameters: &[(&str, f64)]| {
        let slave = Slave::begun(&unpacked, parameters);
        [slave.get("actual.angle"), slave.get("rotor.angle"), slave.get("rotor.draw_angle")]
    };
    let [drawn, start, _] = of(&[]);
    assert_eq!(of(&[]), [start, start, 1.0]);
    // Whatever the order, for importers have one of their own.
    for parameters in [
        &[("rotor.angle", 1.0)][..],
        &[("rotor.angle", 1.0), ("rotor.draw_angle", 1.0)],
        &[("rotor.draw_angle", 1.0), ("rotor.angle", 1.0)],
        &[("trial", 5.0), ("rotor.angle", 1.0)],
    ] {
        let [there, set, draws] = of(parameters);
        assert!(
            (there - 1.0).abs() < 1e-12 && set == 1.0 && draws == 0.0,
            "{parameters:?}: {there} {set} {draws}"
        );
    }
    assert!(of(&[("rotor.angle", 0.0)])[0].abs() < 1e-12);
    // Who sets all to what it is changes nothing; another trial still draws its own.
    let all: Vec<(&str, f64)> = unpacked
        .model
        .variables
        .iter()
        .filter(|of| of.is_parameter())
        .map(|of| (of.name.as_str(), of.start.expect("one")))
        .collect();
    assert_eq!(of(&all), [drawn, start, 1.0]);
    let other: Vec<_> =
        all.iter().map(|(name, value)| (*name, if *name == "trial" { 5.0 } else { *value })).collect();
    let [there, set, draws] = of(&other);
    assert!(there == set && (there - drawn).abs() > 0.01 && draws == 1.0, "{there} {set}");
    // Where it is set and stays, and what its start is beside another trial.
    let [there, set, draws] = of(&[("trial", 5.0), ("rotor.draw_angle", 0.0)]);
    assert!((there - drawn).abs() < 1e-12 && set == start && draws == 0.0, "{there} {set}");
    let slave = Slave::made(&unpacked);
    assert_eq!(slave.set("rotor.angle", 30.0), 3);
    assert!(slave.said().contains("`rotor.angle`: found 30 rad, needed from -6.2832 to 6.2832 rad, a turn either way: 1° is 0.017453 rad"), "{}", slave.said());
}

/// The program printed "81 µs" for 81.004 µs, and the FMU refused 81 µs.
#[test]
fn regress_a_step_as_it_is_printed_is_one_that_the_drive_takes() {
    for carrier in [12_345.0, 7_777.0, 16_001.0, 123_456.7, 1_000.1] {
        let text = format!("motor = \"paper-5k5\"\ninverter = {{ carrier = {carrier:?}, dead_time = 0 }}");
        let unpacked = unpacked(&text, Part::Drive);
        let printed = unpacked.model.period_text();
        let (number, unit) = printed.split_once(' ').expect("a number and its unit");
        let unit = match unit {
            "µs" => 1e-6,
            "ms" => 1e-3,
            _ => panic!("{printed}"),
        };
        let step = number.parse::<f64>().expect("a number") * unit;
        let slave = Slave::ready(&unpacked, &[]);
        for n in 0..3 {
            assert_eq!(slave.step(f64::from(n) * step, step), 0, "{printed}: {}", slave.said());
        }
        // Half of it, too, where a period is an odd number of nanoseconds.
        for n in 6..8 {
            assert_eq!(slave.step(f64::from(n) * step / 2.0, step / 2.0), 0, "{printed}: {}", slave.said());
        }
        for version in [Version::Two, Version::Three] {
            let text = unpacked.model.description(version);
            let xml = Xml::parse(&text).expect("XML");
            let experiment =
                xml.descendants().find(|node| node.has_tag_name("DefaultExperiment")).expect("one");
            let of = |name: &str| experiment.attribute(name).expect("one").parse::<f64>().expect("a number");
            let steps = of("stopTime") / of("stepSize");
            assert!(
                (of("stepSize") - step).abs() < 1e-12 && (steps - steps.round()).abs() < 1e-9,
                "{steps} steps"
            );
        }
    }
}

/// What the FMU lists does something: a locked rotor has no inertia.
#[test]
fn law_a_rotor_that_is_locked_has_no_parameters_of_its_motion() {
    for (state, has) in [("locked", false), ("free", true)] {
        let unpacked = unpacked(&format!("motor = \"paper-5k5\"\nrotor.state = \"{state}\""), Part::Motor);
        let of_motion = |of: &&standstill_fmu::Variable| matches!(&of.role, Role::Key(key) if key.starts_with("motor.rotor."));
        assert_eq!(unpacked.model.variables.iter().any(|of| of_motion(&of)), has, "{state}");
    }
}

/// A tolerance makes steps finer and never coarser: most importers pass one that is meant for models of seconds.
#[test]
fn law_a_tolerance_makes_a_simulation_finer_and_never_coarser() {
    let unpacked = unpacked(FIELD, Part::Drive);
    let with = |tolerance: Option<f64>| {
        let slave = Slave::made(&unpacked);
        assert_eq!(slave.set_up(tolerance, 0.0), 0, "{}", slave.said());
        assert_eq!(
            (slave.call("fmi2EnterInitializationMode"), slave.call("fmi2ExitInitializationMode")),
            (0, 0)
        );
        outcome(&slave, &unpacked)
    };
    let should = with(None);
    assert!(should.iter().any(|(name, value)| name == "actual.i_a" && value.abs() > 0.3), "{should:?}");
    for coarse in [0.0, 1e-3, 1e-6] {
        assert_eq!(with(Some(coarse)), should, "{coarse}");
    }
    let fine = with(Some(1e-10));
    assert_ne!(fine, should);
    let off = fine.iter().zip(&should).filter(|((name, _), _)| name.starts_with("actual.i_"));
    let off = off.map(|((_, fine), (_, should))| (fine - should).abs()).fold(0.0, f64::max);
    // 1e-9 Wb over 9 mH is 0.1 µA a step.
    assert!(off > 0.0 && off < 1e-5, "{off} A");
    for wrong in [-1e-6, 1.0, f64::NAN] {
        let slave = Slave::made(&unpacked);
        assert_eq!(slave.set_up(Some(wrong), 0.0), 3);
        assert!(
            slave.said().contains("needed a share from 0 to 1 of the flux at rated current"),
            "{}",
            slave.said()
        );
    }
    let text = unpacked.model.description(Version::Two);
    let xml = Xml::parse(&text).expect("XML");
    let experiment = xml.descendants().find(|node| node.has_tag_name("DefaultExperiment")).expect("one");
    let own: f64 = experiment.attribute("tolerance").expect("one").parse().expect("a number");
    assert!(own > 1e-10 && own <= 1.0001e-8, "{own}");
}
