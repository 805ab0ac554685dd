//! ngspice on the same circuits: `tests/cross/spice/cases.csv` is the plan of both.

use std::fs;
use std::path::Path;

use standstill_interface::{Abc, Command, Leg, Nanos, Sampling, Stage};
use standstill_inverter::{Bridge, Devices, GateTiming, Inverter, OpenLeg};
use standstill_plant::{Motor, Winding};
use standstill_sim::{Ended, NoProbe, Tolerance, run};

use crate::bench::{Script, exact_case, ideal_inverter, reference_motor};

/// A row of the plan.
struct Case {
    name: String,
    angle_deg: f64,
    motor: Motor,
    inverter: Inverter,
    commands: Vec<Command<f64>>,
}

/// Between two samples.
const INTERVAL: Nanos = Nanos::from_micros(20);

/// What the near-ideal diodes of the netlists drop at about an ampere, in V: n V_T ln(i/I_S).
const NEAR_IDEAL: f64 = 7.1e-3;

fn folder() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cross/spice")
}

fn leg(word: &str) -> Leg<f64> {
    match word {
        "off" => Leg::Off,
        "low" => Leg::Low,
        "high" => Leg::High,
        duty => Leg::Duty(duty.parse().expect("a duty")),
    }
}

/// `3 x (80 high low off; 2320 low low off)`: durations in µs and legs.
fn commands(plan: &str) -> Vec<Command<f64>> {
    let (count, steps) = match plan.split_once(" x (") {
        Some((count, steps)) => (count.parse().expect("a count"), steps.trim_end_matches(')')),
        None => (1, plan),
    };
    let one = steps.split(';').map(|step| {
        let words: Vec<&str> = step.split_whitespace().collect();
        let micros: u64 = words[0].parse().expect("whole microseconds");
        let stage = Stage {
            legs: Abc::new(leg(words[1]), leg(words[2]), leg(words[3])),
            duration: Nanos::from_micros(micros),
        };
        let count = u32::try_from(micros / 20).expect("few");
        Command::hold(stage, Sampling { first: Nanos::ZERO, interval: INTERVAL, count })
    });
    let one: Vec<_> = one.collect();
    one.repeat(count)
}

fn cases() -> Vec<Case> {
    let text = fs::read_to_string(folder().join("cases.csv")).expect("the plan");
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let rows = reader.deserialize::<(String, f64, f64, f64, String, u64, String)>();
    rows.map(|row| {
        let (name, angle_deg, l_a, l_b, devices, dead_time, plan) = row.expect("a row of the plan");
        let winding = Winding { mean_inductance: l_a * 1e-3, saliency: l_b * 1e-3, leakage: 1e-6 };
        let devices = match devices.as_str() {
            "ideal" => Devices {
                switch_drop: NEAR_IDEAL,
                switch_resistance: 0.01,
                diode_drop: NEAR_IDEAL,
                diode_resistance: 0.01,
            },
            "drops" => Devices {
                switch_drop: 0.9 + NEAR_IDEAL,
                switch_resistance: 0.05,
                diode_drop: 1.0 + NEAR_IDEAL,
                diode_resistance: 0.03,
            },
            other => panic!("devices `{other}`"),
        };
        let timing = GateTiming { dead_time: Nanos::from_micros(dead_time), ..GateTiming::default() };
        let open_leg = OpenLeg::Diodes;
        Case {
            name,
            angle_deg,
            motor: Motor { winding, ..reference_motor() }.linearised(),
            inverter: Inverter {
                bridge: Bridge { devices, open_leg },
                gates: [timing; 3],
                ..ideal_inverter(open_leg)
            },
            commands: commands(&plan),
        }
    })
    .collect()
}

/// Currents of ngspice and of the simulation, row by row.
fn both(case: &Case) -> Vec<([f64; 3], [f64; 3])> {
    let golden = fs::read_to_string(folder().join(format!("{}.csv", case.name))).expect("golden");
    let mut reader = csv::Reader::from_reader(golden.as_bytes());
    let rows: Vec<[f64; 4]> = reader.deserialize().map(|row| row.expect("golden row")).collect();
    let mut spice = exact_case(&case.motor, case.inverter.clone(), case.angle_deg);
    spice.tolerance = Tolerance { flux: 1e-11 };
    let mut script = Script::new(case.commands.clone());
    let end = run(&spice, &mut script, false, &mut NoProbe).ended;
    assert!(matches!(end, Ended::Outcome(_)), "{}: {end:?}", case.name);
    // The last row of ngspice is the end itself, where no sample is taken.
    assert!(rows.len() == script.readings.len() + 1 && rows.len() > 150, "{}: {}", case.name, rows.len());
    rows.iter()
        .map(|[_, a, b, c]| [*a, *b, *c])
        .zip(script.readings.iter().map(|reading| reading.current.0))
        .collect()
}

#[test]
fn cross_currents_against_ngspice_within_a_ten_thousandth_of_full_scale() {
    let cases = cases();
    assert!(cases.len() >= 13);
    for case in cases {
        let rows = both(&case);
        let largest = |pick: fn(&([f64; 3], [f64; 3])) -> f64| rows.iter().map(pick).fold(0.0, f64::max);
        let full_scale = largest(|(theirs, _)| theirs.iter().fold(0.0, |peak, i| peak.max(i.abs())));
        let worst = largest(|(theirs, ours)| (0..3).map(|k| (theirs[k] - ours[k]).abs()).fold(0.0, f64::max));
        println!("{}: {worst:.2e} of {full_scale:.3} A, {:.1e}", case.name, worst / full_scale);
        assert!(full_scale > 0.8, "{}: {full_scale}", case.name);
        assert!(worst < 1e-4 * full_scale, "{}: {worst} of {full_scale} A", case.name);
    }
}

#[test]
fn cross_what_is_compared_with_ngspice_is_what_matters() {
    let mut conducting = 0;
    for case in cases() {
        let rows = both(&case);
        // The idle leg of a pulse is the one that is off throughout.
        let idle = (0..3).find(|k| case.commands.iter().all(|c| matches!(c.stage.legs.0[*k], Leg::Off)));
        match (case.name.split('_').next(), idle) {
            // Whether it conducts depends on the angle and on the drops of its diode.
            (Some("slow"), Some(idle)) => {
                conducting += rows.iter().filter(|(theirs, _)| theirs[idle].abs() > 20e-3).count();
            }
            (Some("fast"), Some(_)) => {
                let zero = rows.iter().filter(|(_, ours)| ours.iter().all(|i| i.abs() < 1e-9)).count();
                assert!(zero > 200, "{}: no current in {zero} rows", case.name);
            }
            (Some("pwm"), None) => {
                let both_ways = (0..3).filter(|k| {
                    let count = |sign: f64| rows.iter().filter(|(theirs, _)| sign * theirs[*k] > 0.1).count();
                    count(1.0) > 5 && count(-1.0) > 5
                });
                assert!(both_ways.count() >= 2, "{}: currents must change their sign", case.name);
            }
            other => panic!("{}: {other:?}", case.name),
        }
    }
    assert!(conducting > 300, "idle legs conduct in {conducting} rows");
}

#[test]
fn cross_peaks_of_an_earlier_ngspice_run() {
    // Near-ideal devices of another netlist of the circuit of `slow_ab_43`: peaks in A.
    let expected = [1.336_48, 2.488_85, 3.484_52];
    let case = cases().into_iter().find(|case| case.name == "slow_ab_43").expect("in the plan");
    let rows = both(&case);
    for (pulse, expected) in expected.into_iter().enumerate() {
        for peak in [rows[120 * pulse + 4].0[0], rows[120 * pulse + 4].1[0]] {
            assert!((peak / expected - 1.0).abs() < 2e-3, "{peak} against {expected}");
        }
    }
}
