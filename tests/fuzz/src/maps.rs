//! Flux maps as texts, NumPy archives and MATLAB files.

use std::fmt::Write as _;

use standstill_files::{Files, MapSamples};
use standstill_plant::FluxMap;

use crate::{file, refused};

/// A map as text.
pub fn csv(bytes: &[u8]) {
    read("given.csv", bytes);
}

/// A map as a NumPy archive.
pub fn npz(bytes: &[u8]) {
    read("given.npz", bytes);
}

/// A map as a MATLAB file of version 5 to 7.3.
pub fn mat(bytes: &[u8]) {
    read("given.mat", bytes);
}

/// Points of which a map is made: a larger one takes seconds, and its file was read all the same.
const MOST_POINTS: usize = 64;

fn read(name: &str, bytes: &[u8]) {
    let samples = match MapSamples::read(&file(name, bytes), &Files::default()) {
        Err(error) => return refused(error, name),
        Ok(samples) => samples,
    };
    let finite = |values: &[f64; 4]| values.iter().all(|value| value.is_finite());
    let values = |samples: &MapSamples| -> Vec<[f64; 4]> {
        samples.points.iter().map(|point| [point.i_d, point.i_q, point.psi_d, point.psi_q]).collect()
    };
    let all = values(&samples);
    assert!(!all.is_empty() && all.iter().all(finite), "{all:?}");
    assert!(samples.resistance.is_none_or(f64::is_finite));
    // The program's own layout, which numbers pass through without a change.
    let mut written = String::from("i_d_A,i_q_A,psi_d_Wb,psi_q_Wb\n");
    for [i_d, i_q, psi_d, psi_q] in &all {
        writeln!(written, "{i_d:e},{i_q:e},{psi_d:e},{psi_q:e}").expect("a text");
    }
    let again = MapSamples::read(&file("again.csv", written.as_bytes()), &Files::default());
    assert_eq!(values(&again.unwrap_or_else(|error| panic!("{error}"))), all);
    if all.len() <= MOST_POINTS
        && let Err(error) = FluxMap::new(&samples)
    {
        refused(error, name);
    }
}
