//! Sources of error: draws of a start, grouped by the keys that set their spread.

use std::ops::Range;

use standstill_scenario::{FaultSettings, keys};
use standstill_sim::{Purpose, Tape};

use crate::Trials;
use crate::subset::{SAMPLED, of_samples};
use crate::trials::Codes;

/// A source of error: a key of the scenario, and the random draws whose spread this key sets.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    /// Path of the key, such as `sensors.noise`.
    pub key: String,
    of: Of,
}

#[derive(Clone, Debug, PartialEq, Eq)]
/// The random inputs of a simulated motor start that belong to a source.
enum Of {
    /// Random draws of a trial: their purpose, name and indices.
    Draws {
        purpose: Purpose,
        /// Key whose value the draws vary within its tolerance. Empty for draws that are no tolerances.
        name: String,
        /// Indices of the draws within their purpose.
        range: Range<usize>,
    },
    /// Rounding by converters. Each start draws an offset of the codes, since no data sheet states offsets below one LSB.
    Codes,
}

/// All random inputs of a simulated motor start.
#[derive(Clone, Debug)]
pub(super) struct Start {
    pub tape: Tape,
    pub codes: Codes,
}

/// Largest number of draws that a trial read, for each purpose of [`SAMPLED`].
pub(crate) type Lengths = [usize; SAMPLED.len()];

/// Returns, for each purpose of [`SAMPLED`], the largest number of draws that a trial read from one of these tapes.
pub(crate) fn lengths<'t>(tapes: impl Iterator<Item = &'t mut Tape>) -> Lengths {
    let mut most = [0; SAMPLED.len()];
    for tape in tapes {
        for strip in tape.strips().iter() {
            if let Some(place) = SAMPLED.iter().position(|purpose| *purpose == strip.purpose) {
                most[place] = most[place].max(strip.read);
            }
        }
    }
    most
}

impl Source {
    /// Lists all sources of error of a scenario: random draws and the converters' rounding. Rounding is left out if the detector comes from
    /// a library, because such a detector knows the offset of the codes.
    pub fn all(trials: &Trials<'_>) -> Vec<Self> {
        let mut sources = Self::drawn(trials);
        let scenario = trials.scenario();
        if trials.have_converters() && scenario.foreign.is_none() {
            let key = match trials.converters() {
                [Some(adc), ..] if adc.rounds() => "sensors.bits",
                [_, Some(adc), _] if adc.rounds() => "sensors.terminal_bits",
                _ => "sensors.dc_link_bits",
            };
            sources.push(Self { key: key.to_owned(), of: Of::Codes });
        }
        sources
    }

    /// Returns true for the rounding of converters.
    pub fn is_rounding(&self) -> bool {
        self.of == Of::Codes
    }

    /// Lists the sources that are random draws with a spread above zero: errors of sensors, drive and brake, faults, and the motor's
    /// tolerances. The resolver's error is left out, because a detection does not depend on it.
    pub(crate) fn drawn(trials: &Trials<'_>) -> Vec<Self> {
        let scenario = trials.scenario();
        let source = |key: &str, purpose, name: &str, range| Self {
            key: key.to_owned(),
            of: Of::Draws { purpose, name: name.to_owned(), range },
        };
        let drawn = keys().filter(|key| key.is_drawn(scenario));
        let mut sources: Vec<Self> = drawn
            .filter_map(|key| key.draws.clone().map(|(purpose, range)| source(key.path, purpose, "", range)))
            .collect();
        let mut next = 0;
        sources.extend(scenario.faults.iter().enumerate().map(|(k, fault)| {
            let from = next;
            next += fault.draws().count();
            source(&format!("faults.{k}"), Purpose::Fault, "", from..next)
        }));
        let tolerances = trials.plan().file().tolerances.keys();
        sources.extend(tolerances.map(|key| source(key, Purpose::Tolerance, key, 0..1)));
        sources
    }

    /// Returns the parts of the source, each with its name in words. Each draw is a part of its own, with three exceptions that form one
    /// part each: the errors of all samples, the draws of the ripple's phase, and the draws of the remanence. `faults` are the scenario's
    /// faults.
    pub(crate) fn parts(&self, faults: &[FaultSettings]) -> Vec<(String, Self)> {
        let Of::Draws { purpose, name, range } = &self.of else { return Vec::new() };
        let together = of_samples(*purpose) || matches!(purpose, Purpose::Ripple | Purpose::Memory);
        if together {
            let of = match purpose {
                Purpose::CurrentNoise => "noise of all current samples",
                Purpose::LinkNoise => "noise of all samples of the DC link",
                Purpose::TerminalNoise => "noise of all samples of the terminals",
                Purpose::ComparatorNoise => "noise of all thresholds",
                Purpose::Jitter => "jitter of all samples",
                Purpose::Memory => "direction in which the iron was last magnetised",
                _ => "phase of the DC link's ripple",
            };
            return vec![(of.to_owned(), self.clone())];
        }
        let part = |draw: usize| {
            let words = crate::anatomy::name(*purpose, name, draw, faults);
            let of = Of::Draws { purpose: *purpose, name: name.clone(), range: draw..draw + 1 };
            (words, Self { key: self.key.clone(), of })
        };
        range.clone().map(part).collect()
    }

    /// Returns the draw of a source that has only one draw, in standard deviations. None if the source has several draws.
    pub(crate) fn draw(&self, tape: &mut Tape) -> Option<f64> {
        let Of::Draws { purpose, name, range } = &self.of else { return None };
        (range.len() == 1).then(|| tape.normals_named(*purpose, name).get(range.start).copied())?
    }

    /// Returns start `a` with this source's draws taken from start `b`. Draws that `b` does not have are drawn anew when the trial reads
    /// them.
    pub(super) fn mixed(&self, a: &Start, b: &Start) -> Start {
        let mut mixed = a.clone();
        let Of::Draws { purpose, name, range } = &self.of else { return Start { codes: b.codes, ..mixed } };
        let mut other = b.tape.clone();
        let from = other.normals_named(*purpose, name);
        let into = mixed.tape.normals_named(*purpose, name);
        if range.end == usize::MAX {
            into.clone_from(from);
        } else if from.len() >= range.end && into.len() >= range.end {
            into[range.clone()].copy_from_slice(&from[range.clone()]);
        }
        mixed
    }

    /// Returns the start without this source. The source's draws are set to their means, or its rounding is removed.
    pub(super) fn removed(&self, start: &Start, longest: &Lengths) -> Start {
        let mut start = start.clone();
        self.remove(&mut start, longest);
        start
    }

    /// Returns the start with this source as its only error. All other sources in `all` are removed.
    pub(super) fn alone(&self, start: &Start, all: &[Self], longest: &Lengths) -> Start {
        let mut start = start.clone();
        for other in all.iter().filter(|other| *other != self) {
            other.remove(&mut start, longest);
        }
        start
    }

    fn remove(&self, start: &mut Start, longest: &Lengths) {
        match &self.of {
            Of::Draws { .. } => self.silence(&mut start.tape, longest),
            Of::Codes => start.codes = Codes::Exact,
        }
    }

    /// Returns the tape with this source's draws set to their means.
    pub(crate) fn without(&self, tape: &Tape, longest: &Lengths) -> Tape {
        let mut tape = tape.clone();
        self.silence(&mut tape, longest);
        tape
    }

    fn silence(&self, tape: &mut Tape, longest: &Lengths) {
        let Of::Draws { purpose, name, range } = &self.of else { return };
        let draws = if of_samples(*purpose) {
            // Without its noise a detector may sample more often, but never four times as often.
            let place = SAMPLED.iter().position(|sampled| sampled == purpose).unwrap_or(0);
            0..4 * longest[place]
        } else {
            range.clone()
        };
        tape.strip_named(*purpose, name).silence(draws);
    }
}
