//! Tapes: random draws given by the caller instead of computed from a seed.

use std::cell::RefCell;
use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::{Draws, Purpose, Source};

/// The draws of one trial as standard normals, in one strip for each purpose. Callers use a tape to choose the draws themselves, in
/// rare-event simulation and sensitivity analysis. A trial that starts with an empty tape fills the tape with its draws.
///
/// A uniform number is Φ(z) of a normal z on the tape. An angle is the direction of two normals. Draws that are not read remain
/// unchanged. If a trial reads beyond the end of the tape, draws from the tape's own seed and trial number are appended. They are new
/// standard normals, independent of all others.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub struct Tape {
    source: Source,
    strips: RefCell<Vec<Strip>>,
}

// Written by hand: a derived `clone` is compiled in each crate that copies tapes, and some of these crates are not optimised.
impl Clone for Tape {
    fn clone(&self) -> Self {
        Self { source: self.source, strips: self.strips.clone() }
    }
}

/// A strip of a tape. It contains the draws of one purpose and name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Strip {
    /// Purpose of the draws.
    pub purpose: Purpose,
    /// Name of the draws. It distinguishes the strips of a purpose with several strips.
    pub name: String,
    /// The draws.
    pub normals: Vec<f64>,
    /// Number of draws that have been read since the tape was made or [`Tape::rewind`] was called.
    pub read: usize,
}

impl Strip {
    /// Replaces each draw x by √(1 − s²) x + s ξ with a new draw ξ. The result is again a standard normal. The step size s is `width`
    /// times the draw's entry in `deviations`, and at most 1. A draw without an entry counts as one with the entry 1. Returns whether
    /// there was any draw to replace.
    pub fn step(&mut self, width: f64, deviations: &[f64], draws: &mut Draws) -> bool {
        for (k, x) in self.normals.iter_mut().enumerate() {
            let step = (width * deviations.get(k).copied().unwrap_or(1.0)).min(1.0);
            *x = (1.0 - step * step).sqrt() * *x + step * draws.normal();
        }
        !self.normals.is_empty()
    }

    /// Sets the draws with these numbers to zero, their mean. Missing draws are appended.
    pub fn silence(&mut self, draws: Range<usize>) {
        self.normals.resize(self.normals.len().max(draws.end), 0.0);
        self.normals[draws].fill(0.0);
    }
}

impl Tape {
    /// Makes an empty tape. When a missing draw is read, it is taken from trial `index` of `seed` and appended.
    pub fn new(seed: u64, index: u64) -> Self {
        Self { source: Source::new(seed, index), strips: RefCell::default() }
    }

    /// Sets the seed and the number of the trial from which missing draws are taken from now on.
    pub fn grow_from(&mut self, seed: u64, index: u64) {
        self.source = Source::new(seed, index);
    }

    /// Returns the number of the trial from which missing draws are taken.
    pub fn index(&self) -> u64 {
        self.source.index
    }

    /// Returns the draws (standard normals) of one purpose. The caller may change them.
    pub fn normals(&mut self, purpose: Purpose) -> &mut Vec<f64> {
        self.normals_named(purpose, "")
    }

    /// Returns the draws (standard normals) of one purpose and name. The caller may change them.
    pub fn normals_named(&mut self, purpose: Purpose, name: &str) -> &mut Vec<f64> {
        &mut self.strip_named(purpose, name).normals
    }

    /// Returns the strip of one purpose and name. The caller may change it.
    pub fn strip_named(&mut self, purpose: Purpose, name: &str) -> &mut Strip {
        let number = self.strip(purpose, name);
        &mut self.strips.get_mut()[number]
    }

    /// Returns all strips, in the order in which they were first requested. The caller may change them.
    pub fn strips(&mut self) -> &mut [Strip] {
        self.strips.get_mut()
    }

    /// Sets the numbers of read draws of all strips to zero. Call it before the next trial.
    pub fn rewind(&mut self) {
        for strip in self.strips.get_mut() {
            strip.read = 0;
        }
    }

    pub(super) fn source(&self) -> Source {
        self.source
    }

    /// Returns the number of a strip. Makes the strip if it does not exist.
    pub(super) fn strip(&self, purpose: Purpose, name: &str) -> usize {
        let mut strips = self.strips.borrow_mut();
        let found = strips.iter().position(|strip| strip.purpose == purpose && strip.name == name);
        found.unwrap_or_else(|| {
            strips.push(Strip { purpose, name: name.to_owned(), normals: Vec::new(), read: 0 });
            strips.len() - 1
        })
    }

    /// Returns draw `number` of a strip. If the strip is too short, missing draws are appended. `seeded` returns the draw with a number.
    pub(super) fn read(&self, strip: usize, number: usize, mut seeded: impl FnMut(u64) -> f64) -> f64 {
        let strip = &mut self.strips.borrow_mut()[strip];
        for missing in strip.normals.len()..=number {
            strip.normals.push(seeded(missing as u64));
        }
        strip.read = strip.read.max(number + 1);
        strip.normals[number]
    }
}
