//! One detection, step by step: what the detector orders, what it reads back, what it concludes.
//!
//! ```text
//!   LineInductance ──command──► inverter ─► motor (rotor at 123.4°)
//!         ▲                                  │
//!         └──────────readings── sensors ◄────┘
//! ```
//!
//! Run with `cargo run --release --example step_by_step`.

use standstill_detect::{Decay, LineInductance};
use standstill_interface::{Abc, Command, Detector, Leg, Outcome, Reading, Step};
use standstill_plant::built_in;
use standstill_scenario::{ErrorSet, Record, Scenario, Specimen};
use standstill_sim::{NoProbe, RotorState, run};

/// Lets another detector work and tells what passes by.
struct Telling<D> {
    inner: D,
    commands: u32,
}

fn legs(legs: Abc<Leg<f64>>) -> String {
    let name = |leg| match leg {
        Leg::Off => "off ".to_owned(),
        Leg::Low => "low ".to_owned(),
        Leg::High => "high".to_owned(),
        Leg::Duty(duty) => format!("{duty:.2}"),
        Leg::Rise(at) => format!("low, from {} ns on high", at.0),
        Leg::Fall(at) => format!("high, from {} ns on low", at.0),
    };
    legs.0.map(name).join(" ")
}

fn tell(number: u32, command: &Command<f64>) {
    let micros = |nanos: u64| nanos as f64 / 1e3;
    print!("{number:3}  {} for {:6.1} µs", legs(command.stage.legs), micros(command.stage.duration.0));
    if let Some(then) = command.then {
        print!(", then {} for {:6.1} µs", legs(then.legs), micros(then.duration.0));
    }
    println!();
}

impl<D: Detector<f64>> Detector<f64> for Telling<D> {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        for reading in readings {
            let [a, b, c] = reading.current.0;
            let at = reading.at.0 as f64 / 1e3;
            println!("       {at:6.1} µs: i = {a:+.3} {b:+.3} {c:+.3} A, U_dc = {:.1} V", reading.dc_link);
        }
        let step = self.inner.step(readings);
        if let Step::Drive(command) = &step {
            self.commands += 1;
            tell(self.commands, command);
        }
        step
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let motor = built_in("paper-5k5").ok_or("no such motor")?;
    let scenario = Scenario::paper(motor, ErrorSet::Default, Decay::Fast, RotorState::Free, 1);
    let case = scenario.case_at(123.4_f64.to_radians(), Specimen { drive: 0, noise: 0 });

    let mut detector = Telling { inner: LineInductance::new(scenario.detector)?, commands: 0 };
    let run = run(&case, &mut detector, false, &mut NoProbe);

    let record = Record { trial: 0, run };
    if let standstill_sim::Ended::Outcome(Outcome::Found { findings, .. }) = run.ended {
        let millihenry = |l: Option<f64>| l.map_or(f64::NAN, |l| l * 1e3);
        println!(
            "\nL_A = {:.2} mH, L_B = {:.2} mH",
            millihenry(findings.mean_inductance),
            millihenry(findings.saliency)
        );
        if let Some(polarity) = findings.polarity {
            println!("i_d = {:.2} A along, {:.2} A against", polarity.along, polarity.against);
        }
    }
    println!(
        "found {:.2}°, true {:.2}°, error {:+.2}°, rotor moved {:.4}°",
        record.estimated_angle_deg().unwrap_or(f64::NAN),
        record.true_angle_deg(),
        record.error_deg().unwrap_or(f64::NAN),
        record.rotor_moved_deg()
    );
    Ok(())
}
