//! Draws of a start, by the keys that set their spread.

use std::ops::Range;

use standstill_scenario::keys;
use standstill_sim::{Adc, Purpose, Tape};

use crate::Trials;
use crate::subset::of_samples;
use crate::trials::Codes;

/// A source of error: a key, and what it spreads.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    /// The key, such as `sensors.noise`.
    pub key: String,
    of: Of,
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Of {
    /// Draws of a trial.
    Draws {
        purpose: Purpose,
        /// Names the key that a tolerance is of.
        name: String,
        /// Numbers of the purpose's draws.
        range: Range<usize>,
    },
    /// Rounding by converters. Each start draws where the codes lie, since no data sheet states an offset of less than a code.
    Codes,
}

/// Everything that a start depends on.
#[derive(Clone, Debug)]
pub(super) struct Start {
    pub tape: Tape,
    pub codes: Codes,
}

/// Largest number of draws of each sample that a trial reads, of noise, of the link's noise, and of the jitter.
pub(crate) type Lengths = [usize; 3];

const SAMPLED: [Purpose; 3] = [Purpose::CurrentNoise, Purpose::LinkNoise, Purpose::Jitter];

/// The most that any of these tapes was read.
pub(crate) fn lengths<'t>(tapes: impl Iterator<Item = &'t mut Tape>) -> Lengths {
    let mut most = [0; 3];
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
    /// All error sources of a scenario: random draws and rounding of converters. Rounding is left out with a detector from a library, which gets the
    /// place of its codes.
    pub fn all(trials: &Trials<'_>) -> Vec<Self> {
        let mut sources = Self::drawn(trials);
        let scenario = trials.scenario();
        if trials.have_converters() && scenario.foreign.is_none() {
            let key = if scenario.sensors.adc.is_some_and(Adc::rounds) {
                "sensors.bits"
            } else {
                "sensors.dc_link_bits"
            };
            sources.push(Self { key: key.to_owned(), of: Of::Codes });
        }
        sources
    }

    /// True for the rounding of converters.
    pub fn is_rounding(&self) -> bool {
        self.of == Of::Codes
    }

    /// Lists the errors that trials draw with a spread above zero: of sensors, drive and brake, and the motor's tolerances. The
    /// resolver's error is left out, because a detection does not depend on it.
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
        let tolerances = trials.plan().file().tolerances.keys();
        sources.extend(tolerances.map(|key| source(key, Purpose::Tolerance, key, 0..1)));
        sources
    }

    /// Its parts, each with its name: draw by draw, but the draws of all samples, and of a phase, together.
    pub(crate) fn parts(&self) -> Vec<(String, Self)> {
        let Of::Draws { purpose, name, range } = &self.of else { return Vec::new() };
        let together = of_samples(*purpose) || matches!(purpose, Purpose::Ripple | Purpose::Memory);
        if together {
            let of = match purpose {
                Purpose::CurrentNoise => "noise of all current samples",
                Purpose::LinkNoise => "noise of all samples of the DC link",
                Purpose::Jitter => "jitter of all samples",
                Purpose::Memory => "direction in which the iron was last magnetised",
                _ => "phase of the DC link's ripple",
            };
            return vec![(of.to_owned(), self.clone())];
        }
        let part = |draw: usize| {
            let words = crate::anatomy::name(*purpose, name, draw);
            let of = Of::Draws { purpose: *purpose, name: name.clone(), range: draw..draw + 1 };
            (words, Self { key: self.key.clone(), of })
        };
        range.clone().map(part).collect()
    }

    /// Its only draw on a tape, in standard deviations; none of many draws, or of a phase, which has no mean.
    pub(crate) fn draw(&self, tape: &mut Tape) -> Option<f64> {
        let Of::Draws { purpose, name, range } = &self.of else { return None };
        (range.len() == 1).then(|| tape.normals_named(*purpose, name).get(range.start).copied())?
    }

    /// `a` with this source as `b` has it. Draws that `b` did not need are new where `a` needs them.
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

    /// This start without this source: its draws at their means, or nothing rounded.
    pub(super) fn removed(&self, start: &Start, longest: &Lengths) -> Start {
        let mut start = start.clone();
        self.remove(&mut start, longest);
        start
    }

    /// This start without any of these sources but this one.
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

    /// These draws with this source at its mean.
    pub(crate) fn without(&self, tape: &Tape, longest: &Lengths) -> Tape {
        let mut tape = tape.clone();
        self.silence(&mut tape, longest);
        tape
    }

    fn silence(&self, tape: &mut Tape, longest: &Lengths) {
        let Of::Draws { purpose, name, range } = &self.of else { return };
        let draws = if of_samples(*purpose) {
            // Without it a detector may look more often; four times as often is more than any does.
            let place = SAMPLED.iter().position(|sampled| sampled == purpose).unwrap_or(0);
            0..4 * longest[place]
        } else {
            range.clone()
        };
        tape.strip_named(*purpose, name).silence(draws);
    }
}
