//! Draws that are given from outside.

use std::cell::RefCell;
use std::ops::Range;

use super::{Draws, Purpose, Source};

/// The draws of one trial as standard normals, purpose by purpose. Rare-event simulation and sensitivity analysis give
/// them; a tape that is empty at first holds afterwards what the trial drew.
///
/// A uniform number is read from a normal as Φ(z), an angle as the direction of two normals. Draws that nobody reads
/// stay as they are. Where a trial reads beyond the end, the tape grows by the draws that its own seed and number have
/// there: new standard normals, independent of all others.
#[derive(Debug, PartialEq)]
pub struct Tape {
    source: Source,
    strips: RefCell<Vec<Strip>>,
}

// Not derived, which would be compiled wherever tapes are copied: thousands of draws, in crates that are not optimised.
impl Clone for Tape {
    fn clone(&self) -> Self {
        Self { source: self.source, strips: self.strips.clone() }
    }
}

/// The draws of one purpose.
#[derive(Clone, Debug, PartialEq)]
pub struct Strip {
    /// Purpose of the draws.
    pub purpose: Purpose,
    /// Their name, where a purpose has several.
    pub name: String,
    /// The draws.
    pub normals: Vec<f64>,
    /// How many of them have been read at most since the tape was made or [`Tape::rewind`] was called.
    pub read: usize,
}

impl Strip {
    /// Moves each draw x to √(1 − s²) x + s ξ with a draw ξ of its own: again a standard normal. The step s is `width` times the
    /// draw's deviation, or `width` where none is given, and at most 1. Whether any draw was there to be moved.
    pub fn step(&mut self, width: f64, deviations: &[f64], draws: &mut Draws) -> bool {
        for (k, x) in self.normals.iter_mut().enumerate() {
            let step = (width * deviations.get(k).copied().unwrap_or(1.0)).min(1.0);
            *x = (1.0 - step * step).sqrt() * *x + step * draws.normal();
        }
        !self.normals.is_empty()
    }

    /// Puts these draws, which are there afterwards, to their mean.
    pub fn silence(&mut self, draws: Range<usize>) {
        self.normals.resize(self.normals.len().max(draws.end), 0.0);
        self.normals[draws].fill(0.0);
    }
}

impl Tape {
    /// A tape without draws. What it grows by are the draws of trial `index` under `seed`.
    pub fn new(seed: u64, index: u64) -> Self {
        Self { source: Source::new(seed, index), strips: RefCell::default() }
    }

    /// Lets the tape grow by the draws of another trial from now on.
    pub fn grow_from(&mut self, seed: u64, index: u64) {
        self.source = Source::new(seed, index);
    }

    /// Number of the trial whose draws it grows by.
    pub fn index(&self) -> u64 {
        self.source.index
    }

    /// The draws of one purpose, to be read, given or changed.
    pub fn normals(&mut self, purpose: Purpose) -> &mut Vec<f64> {
        self.normals_named(purpose, "")
    }

    /// The draws of one purpose that have a name.
    pub fn normals_named(&mut self, purpose: Purpose, name: &str) -> &mut Vec<f64> {
        &mut self.strip_named(purpose, name).normals
    }

    /// The draws of one purpose and name, with how many of them were read.
    pub fn strip_named(&mut self, purpose: Purpose, name: &str) -> &mut Strip {
        let number = self.strip(purpose, name);
        &mut self.strips.get_mut()[number]
    }

    /// All draws, to be changed. They stand in the order in which they were first asked for.
    pub fn strips(&mut self) -> &mut [Strip] {
        self.strips.get_mut()
    }

    /// Sets the counts of draws that were read to zero, before the next trial.
    pub fn rewind(&mut self) {
        for strip in self.strips.get_mut() {
            strip.read = 0;
        }
    }

    pub(super) fn source(&self) -> Source {
        self.source
    }

    /// The number of a strip, which is made if there is none.
    pub(super) fn strip(&self, purpose: Purpose, name: &str) -> usize {
        let mut strips = self.strips.borrow_mut();
        let found = strips.iter().position(|strip| strip.purpose == purpose && strip.name == name);
        found.unwrap_or_else(|| {
            strips.push(Strip { purpose, name: name.to_owned(), normals: Vec::new(), read: 0 });
            strips.len() - 1
        })
    }

    /// A draw of a strip, which grows up to there by what `seeded` gives for each number.
    pub(super) fn read(&self, strip: usize, number: usize, mut seeded: impl FnMut(u64) -> f64) -> f64 {
        let strip = &mut self.strips.borrow_mut()[strip];
        for missing in strip.normals.len()..=number {
            strip.normals.push(seeded(missing as u64));
        }
        strip.read = strip.read.max(number + 1);
        strip.normals[number]
    }
}
