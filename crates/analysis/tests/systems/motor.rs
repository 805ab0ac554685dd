//! The two-vector test on the simulated motor, with noise alone.

use std::path::Path;

use standstill_analysis::Trials;
use standstill_interface::Angle;
use standstill_numeric::erfc;
use standstill_scenario::{Document, Plan};
use standstill_sim::{Ended, Tape};

/// A plan of these lines.
pub fn plan(text: &str) -> Plan {
    let document = Document::parse(Path::new("test.toml"), text).expect("TOML");
    Plan::new(document).expect("a plan")
}

/// The paper's method with vectors of this current in A, at angles of all directions or one, with noise of this many A.
pub fn noisy(current: f64, noise: f64, angle: Option<f64>) -> Plan {
    let angle = angle.map_or_else(String::new, |angle| format!("rotor.angle = {angle}\n"));
    plan(&format!(
        "motor = \"paper-5k5\"\nerrors = \"noise\"\n{angle}sensors.noise = {noise}\n\
         [detector]\nmethod = \"line-inductance-fast\"\npolarity = \"two-vectors\"\nvector_current = {current}\n"
    ))
}

/// The probability that two readings of these currents order the poles wrongly: the currents i_d without noise differ by
/// Δ, and each i_d has √(2/3) of a reading's noise. Mean over the angles of these trials.
pub fn closed_form(current: f64, noise: f64, angle: Option<f64>) -> f64 {
    let plan = noisy(current, 0.0, angle);
    let trials = Trials::new(&plan).expect("a scenario");
    let tapes: Vec<Tape> = (0..if angle.is_some() { 1 } else { 400 }).map(|k| Tape::new(1, k)).collect();
    let records = trials.records(&tapes).expect("trials");
    let wrong = |record: &standstill_scenario::Record| {
        let Ended::Outcome(outcome) = record.run.ended else { panic!("it runs") };
        assert!(outcome.evidence_for(Angle::from_radians(record.run.end_angle)).expect("evidence") > 0.0);
        let margin = outcome.findings().polarity.expect("two vectors").margin();
        let deviation = (4.0 / 3.0_f64).sqrt() * noise;
        0.5 * erfc(margin / deviation / 2.0_f64.sqrt())
    };
    records.iter().map(wrong).sum::<f64>() / records.len() as f64
}
