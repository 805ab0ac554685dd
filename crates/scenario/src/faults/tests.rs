mod values;

use std::path::Path;

use standstill_detect::MethodName;
use standstill_sim::{Broken, Misreading, Purpose, Tape};

use super::*;
use crate::{Document, ErrorSet, Origin, Plan};

fn plan(text: &str) -> Result<Plan, FileError> {
    Plan::new(Document::parse(Path::new("s.toml"), text)?)
}

fn scenario(text: &str) -> Scenario<Method<f64>> {
    plan(text).and_then(|plan| plan.scenario(0)).expect(text)
}

/// Returns a drive with the parts that faults concern: with current sensors if `currents` is true, else with
/// comparators.
fn whole(currents: bool) -> &'static str {
    if currents {
        "errors = \"field\"\n[inverter]\ncapacitance = \"500 uF\"\nsource_resistance = \"0.2 ohm\"\n[detector]\nmethod = \"bipolar\"\n"
    } else {
        "errors = \"field\"\n[sensors]\narrangement = \"none\"\ntimer = \"0.1 us\"\n[detector]\nmethod = \"six-pulse\"\n"
    }
}

fn with(mode: FaultMode) -> (Scenario<Method<f64>>, Scenario<Method<f64>>) {
    let base = whole(!matches!(mode, FaultMode::ComparatorStuck | FaultMode::TimerOff));
    let whole = scenario(base);
    let size = mode.size().map_or(String::new(), |size| {
        let [low, high] = (size.typical)(&whole);
        if mode.is_fixed() {
            format!("magnitude = {high}\n")
        } else {
            format!("magnitude = [{low}, {high}]\n")
        }
    });
    let broken = scenario(&format!("{base}[[faults]]\nmode = \"{}\"\n{size}", mode.name()));
    (whole, broken)
}

#[test]
fn law_each_fault_changes_what_its_part_is_in() {
    for mode in FaultMode::ALL {
        let (whole, broken) = with(mode);
        assert_eq!(mode.lacks(&whole), None, "{mode:?}");
        let [a, b] = [&whole, &broken].map(|of| of.case(3));
        let differs = a.inverter != b.inverter
            || a.sensors != b.sensors
            || a.faults != b.faults
            || whole.motor != broken.motor
            || whole.detector != broken.detector;
        assert!(differs, "{mode:?} changes nothing");
        // Everything else, such as the errors of the drive, is the same as without the fault.
        assert_eq!(
            (a.start_angle, a.sensors.gain, a.sensors.offset),
            (b.start_angle, b.sensors.gain, b.sensors.offset)
        );
        let kept = [FaultMode::TerminalsSwapped, FaultMode::TerminalsTurned, FaultMode::CommandLate];
        assert_eq!(b.faults.is_empty(), !mode.may_begin() && !kept.contains(&mode), "{mode:?}");
        // The fault can be simulated: a trial ends with any outcome.
        broken.trial(3).expect("settings that work");
    }
}

#[test]
fn law_trials_draw_place_size_sign_and_onset() {
    let text = "[[faults]]\nmode = \"current-offset\"\nmagnitude = [\"1 A\", \"3 A\"]\nonset = [\"1 ms\", \"2 ms\"]\nlasts = \"500 us\"\n";
    let scenario = scenario(text);
    let (mut places, mut positive, mut sum) = ([0; 3], 0, 0.0);
    for trial in 0..600 {
        let faults = scenario.case(trial).faults;
        let fault = faults.iter().next().expect("one");
        let Broken::Sensor(k, Misreading::Offset(offset)) = fault.broken else { panic!("{fault:?}") };
        places[k] += 1;
        positive += u32::from(offset > 0.0);
        sum += offset.abs();
        assert!((1.0..=3.0).contains(&offset.abs()) && (1_000_000..=2_000_000).contains(&fault.from.0));
        assert_eq!(fault.until.0 - fault.from.0, 500_000);
    }
    // Five standard deviations of 600 draws.
    assert!(
        places.iter().all(|n| (142..258).contains(n)) && (238..362).contains(&positive),
        "{places:?} {positive}"
    );
    assert!((sum / 600.0 - 2.0).abs() < 0.12);
    // A tape contains the draws of faults.
    let tape = Tape::new(scenario.seed, 7);
    assert_eq!(scenario.trial_taped(&tape), scenario.trial(7));
    *tape.clone().normals(Purpose::Fault) = vec![0.0; 4];
    let mut tape = tape;
    *tape.normals(Purpose::Fault) = vec![-3.0, 0.0, -3.0, 0.0];
    let fault = scenario.case_taped(&tape).faults.iter().next().expect("one");
    assert!(
        matches!(fault.broken, Broken::Sensor(0, Misreading::Offset(of)) if (of - 2.0).abs() < 1e-9),
        "{fault}"
    );
}

#[test]
fn law_a_fault_may_wait_for_a_command_that_each_trial_draws() {
    let text = "[[faults]]\nmode = \"phase-open\"\ncommand = [3, 6]\nonset = \"20 us\"\nlasts = \"50 us\"\n";
    let scenario = scenario(text);
    let mut counts = [0; 4];
    for trial in 0..400 {
        let faults = scenario.case(trial).faults;
        let fault = faults.iter().next().expect("one");
        counts[fault.command.expect("waits") as usize - 3] += 1;
        assert_eq!((fault.from, fault.until), (Nanos(20_000), Nanos(70_000)));
    }
    // Five standard deviations of 400 draws among four: 43.
    assert!(counts.iter().all(|count| (57..143).contains(count)), "{counts:?}");
    for (line, needed) in [
        ("command = 0", "from 1 to 1000000"),
        ("command = [4, 3]", "the smaller one first"),
        ("command = \"3\"", "whole number"),
    ] {
        let error =
            plan(&text.replace("command = [3, 6]", line)).and_then(|plan| plan.scenario(0)).expect_err(line);
        let error = error.to_string();
        assert!(error.contains("faults[0].command") && error.contains(needed), "{error}");
    }
    let early = "[[faults]]\nmode = \"terminals-swapped\"\ncommand = 2\n";
    let error = plan(early).and_then(|plan| plan.scenario(0)).expect_err("there before").to_string();
    assert!(error.contains("no such key"), "{error}");
}

#[test]
fn law_a_fault_is_a_key() {
    let mut document = Document::parse(Path::new("s.toml"), "").expect("empty");
    for (key, value) in [
        ("faults.0.mode", "contact-resistance"),
        ("faults.0.magnitude", "2 Ω"),
        ("faults.0.at", "b"),
        ("faults.1.mode", "phase-open"),
    ] {
        document.set(key, value, Origin::CommandLine).expect(key);
    }
    let plan = Plan::new(document.clone()).expect("two faults");
    let faults = plan.scenario(0).expect("two faults").faults;
    assert_eq!(
        (faults[0].size, faults[0].at, faults[1].mode),
        ([2.0; 2], FaultPlace::B, FaultMode::PhaseOpen)
    );
    // The written text gives the same faults.
    let again = self::plan(&plan.text().expect("text")).expect("its own text");
    assert_eq!(again.scenario(0).expect("again").faults, faults);
    let wrong =
        document.set("faults.3.mode", "phase-open", Origin::CommandLine).expect_err("no third").to_string();
    assert!(wrong.contains("a number from 0 to 2"), "{wrong}");
    // As an axis, and as a tolerance.
    let text = "axes = { \"faults.0.magnitude\" = [\"1 Ω\", \"2 Ω\"] }\n[[faults]]\nmode = \"contact-resistance\"\nmagnitude = \"3 Ω\"\n";
    let plan = self::plan(text).expect("an axis");
    assert_eq!([0, 1].map(|point| plan.scenario(point).expect("a point").faults[0].size[0]), [1.0, 2.0]);
    let text = "tolerances = { \"faults.0.magnitude\" = { normal = \"10 %\" } }\n[[faults]]\nmode = \"sheet-inductance\"\nmagnitude = 2\n";
    self::plan(text).expect("a tolerance");
}

#[test]
fn regress_impossible_faults_are_refused_by_line() {
    let fault = |mode: &str, rest: &str| {
        format!(
            "[detector]\nmethod = \"bipolar\"\n[[faults]]\nmode = \"phase-open\"\n[[faults]]\nmode = \"{mode}\"\n{rest}\n"
        )
    };
    for (mode, rest, line, words) in [
        ("phase-opn", "", 6, "phase-open"),
        ("contact-resistance", "", 5, "a resistance from 0 to 10 kΩ"),
        ("contact-resistance", "magnitude = \"2 V\"", 7, "a resistance"),
        ("contact-resistance", "magnitude = [\"2 Ω\", \"1 Ω\"]", 7, "the smaller one first"),
        ("contact-resistance", "magnitude = \"-1 Ω\"", 7, "from 0"),
        ("turns-shorted", "magnitude = \"0 %\"", 7, "from 0.1 to 100 %"),
        ("turns-shorted", "magnitude = \"5 %\"\ncoupling = 1", 8, "from 0.1 to 0.99"),
        (
            "turns-shorted",
            "magnitude = \"1 %\"\nresistance = \"10 Ω\"",
            7,
            "the engine's steps follow it: a `resistance` of at most ",
        ),
        (
            "turns-shorted",
            "magnitude = [\"5 %\", \"50 %\"]\ncoupling = [0.7, 0.95]",
            7,
            "at most 49 %, the square",
        ),
        ("turns-shorted", "magnitude = \"82 %\"", 7, "at most 81 %, the square"),
        ("turns-shorted", "magnitude = \"5 %\"\nresistance = \"1 A\"", 8, "a resistance"),
        ("turns-shorted", "magnitude = \"5 %\"\nlasts = \"1 ms\"", 8, "does not pass"),
        (
            "turns-shorted",
            "magnitude = 0.1\n[[faults]]\nmode = \"turns-shorted\"\nmagnitude = 0.1",
            9,
            "one short",
        ),
        ("contact-resistance", "magnitude = 1\nresistance = 1", 8, "turns-shorted"),
        ("phase-open", "magnitude = 1", 7, "has no size"),
        ("phase-open", "at = \"d\"", 7, "any"),
        ("phase-open", "onset = \"30 s\"", 7, "from 0 to 20 s"),
        ("phase-open", "lasts = \"0 s\"", 7, "from 1 ns"),
        ("phase-open", "onse = \"1 s\"", 7, "onset"),
        ("sample-lost", "at = \"a\"", 7, "at no phase"),
        ("magnet-weak", "magnitude = \"20 %\"\nonset = \"1 ms\"", 8, "before the detection"),
        ("sheet-inductance", "magnitude = [1, 2]", 7, "one value"),
        ("current-bit", "magnitude = 3\n[sensors]\nbits = 0", 6, "sensors.bits"),
        ("comparator-stuck", "", 6, "comparators"),
        ("current-bit", "magnitude = 12", 7, "from 0 to 11"),
        ("current-bit", "magnitude = 2.5", 7, "whole numbers"),
        ("current-dead", "at = \"c\"\n[sensors]\narrangement = \"two-in-line\"", 7, "\"a\" or \"b\""),
        ("contact-resistance", "magnitude = \"1 MΩ\"", 7, "10 kΩ"),
        (
            "link-capacitor-aged",
            "magnitude = \"20 %\"\n[inverter]\ncapacitance = 0",
            6,
            "inverter.capacitance",
        ),
    ] {
        let error = plan(&fault(mode, rest)).expect_err(rest).to_string();
        assert!(
            error.starts_with(&format!("s.toml: line {line}:")) && error.contains(words),
            "{mode} {rest}: {error}"
        );
    }
    let five = "[[faults]]\nmode = \"phase-open\"\n".repeat(5);
    assert!(plan(&five).expect_err("five").to_string().contains("at most 4"));
    let ideal = Scenario::of_method(
        MethodName::Bipolar,
        standstill_plant::built_in("paper-5k5").expect("built in"),
        ErrorSet::None,
        standstill_sim::RotorState::Locked,
        1,
    );
    assert!(
        ideal.sensors.arrangement == Arrangement::ThreeInLine
            && FaultMode::CurrentSlow.lacks(&ideal).is_some()
    );
}

/// No detection at standstill can find this fault: with exchanged wires the motor is mirrored.
#[test]
fn law_exchanged_wires_mirror_the_answer() {
    let base = "errors = \"none\"\nmotor = \"paper-5k5\"\n[rotor]\nangle = \"40 deg\"\n[detector]\nmethod = \"bipolar\"\n";
    for (mode, at, expected) in [
        ("terminals-swapped", "at = \"a\"", vec![-40.0]),
        ("terminals-turned", "", vec![40.0 - 120.0, 40.0 + 120.0]),
    ] {
        let scenario = scenario(&format!("{base}[[faults]]\nmode = \"{mode}\"\n{at}\n"));
        for trial in 0..3 {
            let found = scenario.trial(trial).expect("works").run.found().expect("found").to_degrees();
            let near = |expected: &f64| ((found - expected + 180.0).rem_euclid(360.0) - 180.0).abs() < 0.1;
            assert!(expected.iter().any(near), "{mode}: {found}");
        }
    }
}

/// The page has a row for each mode, with the tests of its physics, which exist, and names what is refused.
#[test]
fn law_the_page_on_faults_lists_all_modes() {
    let page = include_str!("../../../../docs/faults.md");
    let tests = [
        include_str!("tests.rs"),
        include_str!("tests/values.rs"),
        include_str!("../../../sim/tests/runs/dividers.rs"),
        include_str!("../../../sim/tests/runs/faults.rs"),
        include_str!("../../../sim/tests/runs/faults/software.rs"),
        include_str!("../../../sim/tests/runs/shorted.rs"),
        include_str!("../../../sim/tests/runs/supply.rs"),
    ];
    let (_, table) = page.split_once("| mode | what is broken | size |").expect("a table of modes");
    let rows: Vec<Vec<&str>> = table
        .lines()
        .skip(2)
        .take_while(|line| line.starts_with('|'))
        .map(|line| line.split('|').collect())
        .collect();
    let quoted = |cell: &str| cell.split('`').skip(1).step_by(2).map(str::to_owned).collect::<Vec<_>>();
    let listed: Vec<String> = rows.iter().flat_map(|row| quoted(row[1])).collect();
    for mode in FaultMode::ALL {
        assert_eq!(listed.iter().filter(|name| *name == mode.name()).count(), 1, "{}", mode.name());
    }
    for row in &rows {
        let witnesses = quoted(row[4]);
        assert!(!witnesses.is_empty(), "{}", row[1]);
        for name in witnesses {
            let is_there = tests.iter().any(|file| file.contains(&format!("\n#[test]\nfn {name}()")));
            assert!(is_there, "{}: no test {name}", row[1]);
        }
    }
    for (name, _) in super::mode::REFUSED {
        assert!(page.contains(&format!("`{name}`")), "{name}");
    }
}

#[test]
fn law_the_largest_resistance_of_a_short_is_the_printed_one() {
    let text = |resistance: &str| {
        format!("[[faults]]\nmode = \"turns-shorted\"\nmagnitude = \"1 %\"\nresistance = \"{resistance}\"\n")
    };
    let error = plan(&text("10 Ω")).expect_err("settles fast").to_string();
    let (_, most) = error.split_once("of at most ").expect("a resistance");
    let most: f64 = most.split(' ').next().and_then(|number| number.parse().ok()).expect("a number");
    scenario(&text(&format!("{} Ω", 0.998 * most)));
    plan(&text(&format!("{} Ω", 1.002 * most))).expect_err("more than the printed one");
    // The largest share that the coupling allows is valid: 0.9² with the default coupling.
    scenario("[[faults]]\nmode = \"turns-shorted\"\nmagnitude = \"81 %\"\n");
}

#[test]
fn law_draws_are_named_in_the_order_of_the_tape() {
    let scenario = scenario(
        "[[faults]]\nmode = \"turns-shorted\"\nmagnitude = [\"10 %\", \"20 %\"]\nresistance = [0, 1]\ncoupling = [0.7, 0.8]\ncommand = [1, 100]\n\
         [[faults]]\nmode = \"contact-resistance\"\nmagnitude = [1, 2]\n",
    );
    let names = scenario.faults.iter().map(|fault| fault.draws().map(FaultDraw::name).collect::<Vec<_>>());
    let four = ["place", "size", "sign", "onset"];
    let names: Vec<_> = names.collect();
    assert_eq!(names, [[&four[..], &["command", "resistance", "coupling"]].concat(), four.to_vec()]);
    // Each draw changes the quantity of its name and nothing else.
    let case = |moved: Option<usize>| {
        let mut tape = Tape::new(scenario.seed, 1);
        *tape.normals(Purpose::Fault) = (0..11).map(|n| if Some(n) == moved { 1.0 } else { -0.2 }).collect();
        let faults: Vec<_> = scenario.case_taped(&tape).faults.iter().collect();
        let [short, contact] = faults[..] else { panic!("{faults:?}") };
        let (Broken::Shorted(k, of), Broken::Contact(at, ohms)) = (short.broken, contact.broken) else {
            panic!("{faults:?}")
        };
        let command = f64::from(short.command.expect("waits"));
        [k as f64, of.share, command, of.resistance, of.coupling, at as f64, ohms]
    };
    let still = case(None);
    // Signs and onsets of these two faults change nothing.
    let expected = [Some(0), Some(1), None, None, Some(2), Some(3), Some(4), Some(5), Some(6), None, None];
    for (n, of) in expected.into_iter().enumerate() {
        let moved = case(Some(n));
        for value in 0..still.len() {
            assert_eq!(moved[value] != still[value], Some(value) == of, "draw {n}: {still:?} {moved:?}");
        }
    }
}
