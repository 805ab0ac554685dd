//! Whole detections side by side against each alone.

use standstill_detect::{Method, MethodName};
use standstill_inverter::{Sag, Storage};
use standstill_plant::{Cogging, EddyBranch, Motor, built_in};
use standstill_scenario::{ErrorSet, Record, Scenario};
use standstill_sim::{Arrangement, Play, RotorState};

use crate::bench::{mapped, paper_motor};

/// How many trials at a time: fewer than lanes, as many, one more, and so many that lanes are taken again and again.
const COUNTS: [u64; 5] = [7, 8, 9, 30, 1];

/// The trials of a scenario in lanes are those that come one by one, in all that is kept of them.
fn compare(scenario: &Scenario<Method<f64>>, trials: u64, label: &str) -> Vec<Record> {
    // Not from zero, and not each: numbers are names.
    let numbers = || (0..trials).map(|k| 3 * k + 5);
    let mut records = Vec::new();
    scenario.trials(numbers(), |record| records.push(record)).expect("settings");
    records.sort_by_key(|record| record.trial);
    let alone: Vec<Record> = numbers().map(|number| scenario.trial(number).expect("settings")).collect();
    assert_eq!(records.len(), alone.len(), "{label}");
    for (lane, alone) in records.iter().zip(&alone) {
        assert_eq!(format!("{lane:?}"), format!("{alone:?}"), "{label}");
        assert_eq!(lane, alone, "{label}");
    }
    records
}

fn motor(name: &str) -> Motor {
    built_in(name).expect("built in")
}

/// Saturated, with a map, with harmonics and cogging, light, without a magnet, with eddy currents.
fn motors() -> [Motor; 6] {
    let paper = paper_motor();
    let (mut map, _) = mapped(&paper, 1.6 * paper.rated_current);
    "mapped".clone_into(&mut map.name);
    let mut slotted = motor("slot-harmonics");
    slotted.rotor.cogging = Some(Cogging { torque: 0.05, periods: 6 });
    let branch = EddyBranch { time_constant: 60e-6, d_depth: 0.25, q_depth: 0.15 };
    let magnetics = paper.magnetics.clone().with_eddy_currents(Some(branch));
    let eddy = Motor { magnetics, name: "with eddy currents".to_owned(), ..paper.clone() };
    [paper, map, slotted, motor("low-inertia"), motor("reluctance-6k7"), eddy]
}

/// Locked, free, and in a brake that lets it play.
fn rotors(motor: &Motor) -> [RotorState; 3] {
    let play = Play::of(motor);
    let play = if play.below + play.above > 0.0 { play } else { Play { below: 2e-3, above: 2e-3 } };
    [RotorState::Locked, RotorState::Free, RotorState::Braked(play)]
}

#[test]
fn law_detections_in_lanes_are_those_alone() {
    detections(false);
}

#[test]
#[ignore = "all motors with both error sets: scripts/test-all.sh long"]
fn law_detections_of_all_motors_with_all_errors_in_lanes_are_those_alone() {
    detections(true);
}

/// All methods on all motors and rotors: one of them with two error sets, the others with one or with both.
fn detections(both: bool) {
    let mut counts = COUNTS.into_iter().cycle();
    let own = paper_motor().name;
    let mut moved = 0;
    for motor in motors() {
        for method in MethodName::ALL {
            // Thousands of PWM periods; it has its own test.
            if method == MethodName::DcAlignment {
                continue;
            }
            for errors in [ErrorSet::Default, ErrorSet::Harsh] {
                for rotor in rotors(&motor) {
                    let mut trials = counts.next().expect("endless");
                    let injects = method.name().starts_with("hfi");
                    if !both && !injects && motor.name != own && errors == ErrorSet::Default {
                        continue;
                    }
                    let mut scenario = Scenario::of_method(method, motor.clone(), errors, rotor, 1);
                    if scenario.check().is_err() {
                        continue;
                    }
                    if rotor != RotorState::Locked {
                        scenario.load_torque = 0.1 * motor.rotor.friction.stiction;
                    }
                    if injects {
                        // Injections take long: on one motor more trials than lanes, on others a few of one kind.
                        if motor.name != own && errors == ErrorSet::Harsh {
                            continue;
                        }
                        trials = trials.min(if motor.name == own { 9 } else { 2 });
                    }
                    let label = format!("{}, {method}, {}, {rotor:?}", motor.name, errors.name());
                    let records = compare(&scenario, trials, &label);
                    moved += records.iter().filter(|record| record.run.moved > 0.0).count();
                }
            }
        }
    }
    assert!(moved > if both { 200 } else { 100 }, "{moved} rotors moved");
}

#[test]
fn law_alignments_in_lanes_are_those_alone() {
    for rotor in [RotorState::Locked, RotorState::Free] {
        let method = MethodName::DcAlignment;
        let scenario = Scenario::of_method(method, motor("low-inertia"), ErrorSet::Default, rotor, 1);
        compare(&scenario, 3, &format!("{method}, {rotor:?}"));
    }
}

/// A change of drive or sensors.
type Change = fn(&mut Scenario<Method<f64>>);

#[test]
fn law_filters_shunts_and_weak_links_make_no_difference_between_lanes_and_alone() {
    changed_drives(1);
}

#[test]
#[ignore = "both motors of each change and method: scripts/test-all.sh long"]
fn law_filters_shunts_and_weak_links_on_two_motors_make_no_difference() {
    changed_drives(2);
}

/// Changes of drive and sensors with three methods, on one of two motors by turns or on both.
fn changed_drives(motors: usize) {
    let changes: [(&str, Change); 6] = [
        ("filters", |scenario| {
            scenario.sensors.bandwidth = Some(40e3);
            scenario.sensors.dc_link.bandwidth = Some(5e3);
        }),
        ("shunts", |scenario| scenario.sensors.arrangement = Arrangement::LowSideShunts),
        ("filtered shunts", |scenario| {
            scenario.sensors.arrangement = Arrangement::LowSideShunts;
            scenario.sensors.bandwidth = Some(80e3);
        }),
        ("sag", |scenario| {
            scenario.drive.link.sag = Some(Sag { depth: 0.2, start: 0.8e-3, duration: 1.5e-3 });
        }),
        ("storage", |scenario| {
            scenario.drive.link.storage = Some(Storage { capacitance: 200e-6, source_resistance: 0.3 });
        }),
        ("all of it", |scenario| {
            scenario.sensors.bandwidth = Some(40e3);
            scenario.drive.link.sag = Some(Sag { depth: 0.2, start: 0.8e-3, duration: 1.5e-3 });
            scenario.drive.link.storage = Some(Storage { capacitance: 200e-6, source_resistance: 0.3 });
            scenario.load_torque = 0.5;
        }),
    ];
    let mut counts = COUNTS.into_iter().cycle();
    for (number, (name, change)) in changes.into_iter().enumerate() {
        let methods =
            [MethodName::LineInductance, MethodName::Bipolar, MethodName::MaximumLikelihoodAdaptive];
        for (turn, method) in methods.into_iter().enumerate() {
            let all = [paper_motor(), motor("low-inertia")];
            for motor in all.iter().cycle().skip(number + turn).take(motors) {
                for rotor in rotors(motor) {
                    let mut scenario = Scenario::of_method(method, motor.clone(), ErrorSet::Harsh, rotor, 2);
                    change(&mut scenario);
                    let label = format!("{name}: {}, {method}, {rotor:?}", motor.name);
                    compare(&scenario, counts.next().expect("endless"), &label);
                }
            }
        }
    }
}
