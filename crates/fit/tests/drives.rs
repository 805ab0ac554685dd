//! Records as drives make them, one pulse in each file: a rotor that moved between two of them.
#![allow(clippy::disallowed_methods, reason = "tests compare with the C library")]

#[allow(dead_code, reason = "of the scope, only what these records need")]
mod scope;

use scope::Scope;
use standstill_fit::record::Record;
use standstill_fit::{Fit, Misfit, fit};

const LOW: [&str; 3] = ["low"; 3];
const VECTORS: [[&str; 3]; 6] = [
    ["high", "low", "low"],
    ["low", "high", "high"],
    ["low", "high", "low"],
    ["high", "low", "high"],
    ["low", "low", "high"],
    ["high", "high", "low"],
];

/// A file for each vector, with the rotor at this angle in degrees in each.
fn records(angle_in: impl Fn(usize) -> f64) -> Vec<Record> {
    let record = |(k, vector): (usize, &[&'static str; 3])| {
        let stages = [(50e-6, LOW), (200e-6, *vector), (300e-6, LOW)];
        let text = scope::ideal(angle_in(k), 0.0, &stages)
            .text(&Scope { gain: [1.0; 3], delay: 0.0, ..Scope::of(12.0) }, 7);
        Record::parse(&format!("{k}.csv"), &text).expect("a record")
    };
    VECTORS.iter().enumerate().map(record).collect()
}

fn fitted(records: &[Record]) -> Fit {
    fit(records, &scope::start(None, 1), &|| false).expect("a motor")
}

/// The rotor jumps by 60° before the fourth file and back after it.
#[test]
fn law_a_file_with_the_rotor_elsewhere_is_named() {
    let moved = fitted(&records(|k| if k == 3 { 95.0 } else { 35.0 }));
    let found = moved.misfit();
    assert!(matches!(found, Some(Misfit::OneFile { record: 3, ratio }) if ratio > 2.0), "{found:?}");
    assert!(moved.residual_rms > 0.05 * moved.current_rms, "{} {}", moved.residual_rms, moved.current_rms);
    let still = fitted(&records(|_| 35.0));
    assert!(
        still.misfit().is_none() && still.residual_rms < 0.02 * still.current_rms,
        "{:?}",
        still.misfit()
    );
}
