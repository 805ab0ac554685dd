//! Detectors from libraries, built here with the system's compiler.
#![cfg(target_os = "linux")]
#![allow(clippy::disallowed_methods, reason = "tests compare with the C library")]

mod abi;
mod examples;
mod libraries;
mod six_vectors;
mod states;

use std::path::{Path, PathBuf};
use std::process::Command;

use standstill_scenario::{Document, FileError, Plan, Record};
use tempfile::TempDir;

/// A folder with a library, built from a C source with these options.
fn built(source: &Path, options: &[&str]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let library = folder.path().join("mine.so");
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let output = Command::new("cc")
        .args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-O2", "-ffp-contract=off", "-shared", "-fPIC"])
        .args(options)
        .arg("-I")
        .arg(root.join("../foreign/include"))
        .arg("-o")
        .args([&library, source])
        .arg("-lm")
        .output()
        .expect("a C compiler");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    (folder, library)
}

/// The library that does what a test asks for.
fn probe(options: &[&str]) -> (TempDir, PathBuf) {
    built(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/foreign/probe.c"), options)
}

/// One of the examples.
fn example(name: &str) -> (TempDir, PathBuf) {
    built(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/c").join(name), &[])
}

/// The plan of a scenario in a folder.
fn plan(folder: &TempDir, text: &str) -> Result<Plan, FileError> {
    Plan::new(Document::parse(&folder.path().join("s.toml"), text)?)
}

/// Trials of a plan's first point, side by side, in their order.
fn records(plan: &Plan, trials: std::ops::Range<u64>) -> Vec<Record> {
    let scenario = plan.scenario(0).expect("valid");
    let mut records = Vec::new();
    plan.trials(0, &scenario, &mut trials.into_iter(), &mut |record| records.push(record)).expect("runs");
    records.sort_unstable_by_key(|record| record.trial);
    records
}
