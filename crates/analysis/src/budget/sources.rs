//! What a start draws, by the keys that say how much of it.

use std::ops::Range;

use standstill_sim::{Purpose, RotorState, Tape};

use crate::Trials;
use crate::subset::of_samples;

/// A source of error: a key, and the draws whose spread it is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    /// The key, such as `sensors.noise`.
    pub key: String,
    purpose: Purpose,
    /// Of a tolerance its key.
    name: String,
    /// Which of the purpose's draws.
    draws: Range<usize>,
}

/// How many draws of each sample a trial reads at most, of noise, of the link's noise, and of the jitter.
pub(crate) type Lengths = [usize; 3];

const SAMPLED: [Purpose; 3] = [Purpose::CurrentNoise, Purpose::LinkNoise, Purpose::Jitter];

/// The most that any of these tapes was read.
pub(crate) fn lengths(tapes: &mut [Tape]) -> Lengths {
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
    /// Those of a scenario whose spread is not zero: sensors, drive, brake, tolerances of the motor. The error of the
    /// resolver is none of a detection.
    pub fn all(trials: &Trials<'_>) -> Vec<Self> {
        let scenario = trials.scenario();
        let (sensors, drive) = (&scenario.sensors, &scenario.drive);
        let (whole, filters) = (0..usize::MAX, sensors.bandwidth.is_some());
        let known = [
            ("sensors.noise", Purpose::CurrentNoise, whole.clone(), sensors.noise > 0.0),
            ("sensors.gain_error", Purpose::CurrentGain, 0..3, sensors.gain_error > 0.0),
            ("sensors.offset", Purpose::CurrentOffset, 0..3, sensors.offset > 0.0),
            (
                "sensors.bandwidth_tolerance",
                Purpose::Bandwidth,
                0..1,
                filters && sensors.bandwidth_tolerance > 0.0,
            ),
            (
                "sensors.bandwidth_mismatch",
                Purpose::Bandwidth,
                1..4,
                filters && sensors.bandwidth_mismatch > 0.0,
            ),
            ("sensors.jitter", Purpose::Jitter, whole.clone(), sensors.jitter.0 > 0),
            ("sensors.dc_link_gain_error", Purpose::LinkError, 0..1, sensors.dc_link.gain_error > 0.0),
            ("sensors.dc_link_offset", Purpose::LinkError, 1..2, sensors.dc_link.offset > 0.0),
            ("sensors.dc_link_noise", Purpose::LinkNoise, whole, sensors.dc_link.noise > 0.0),
            ("inverter.delay_mismatch", Purpose::GateDelay, 0..6, drive.delay_mismatch > 0.0),
            ("inverter.ripple", Purpose::Ripple, 0..2, drive.link.ripple > 0.0),
            ("rotor.memory", Purpose::Memory, 0..2, scenario.memory),
            ("rotor.state", Purpose::Backlash, 0..1, matches!(scenario.rotor, RotorState::Braked(_))),
        ];
        let source = |key: &str, purpose, name: &str, draws| Self {
            key: key.to_owned(),
            purpose,
            name: name.to_owned(),
            draws,
        };
        let mut sources: Vec<Self> = known
            .into_iter()
            .filter(|(.., draws)| *draws)
            .map(|(key, purpose, draws, _)| source(key, purpose, "", draws))
            .collect();
        let tolerances = trials.plan().file().tolerances.keys();
        sources.extend(tolerances.map(|key| source(key, Purpose::Tolerance, key, 0..1)));
        sources
    }

    /// Its parts, each with its name: draw by draw, but the draws of all samples, and of a phase, together.
    pub(crate) fn parts(&self) -> Vec<(String, Self)> {
        let together = of_samples(self.purpose) || matches!(self.purpose, Purpose::Ripple | Purpose::Memory);
        if together {
            let of = match self.purpose {
                Purpose::CurrentNoise => "noise of all current samples",
                Purpose::LinkNoise => "noise of all samples of the DC link",
                Purpose::Jitter => "jitter of all samples",
                Purpose::Memory => "direction in which the iron was last magnetised",
                _ => "phase of the DC link's ripple",
            };
            return vec![(of.to_owned(), self.clone())];
        }
        let part = |draw: usize| {
            let words = crate::anatomy::name(self.purpose, &self.name, draw);
            (words, Self { draws: draw..draw + 1, ..self.clone() })
        };
        self.draws.clone().map(part).collect()
    }

    /// Its only draw on a tape, in standard deviations; none of many draws, or of a phase, which has no mean.
    pub(crate) fn draw(&self, tape: &mut Tape) -> Option<f64> {
        (self.draws.len() == 1)
            .then(|| tape.normals_named(self.purpose, &self.name).get(self.draws.start).copied())?
    }

    /// The draws of `a` with this source's of `b`. What `b` did not need is new where `a` needs it.
    pub(super) fn mixed(&self, a: &Tape, b: &Tape) -> Tape {
        let (mut mixed, mut b) = (a.clone(), b.clone());
        let from = b.normals_named(self.purpose, &self.name);
        let into = mixed.normals_named(self.purpose, &self.name);
        if self.draws.end == usize::MAX {
            into.clone_from(from);
        } else if from.len() >= self.draws.end && into.len() >= self.draws.end {
            into[self.draws.clone()].copy_from_slice(&from[self.draws.clone()]);
        }
        mixed
    }

    /// The same draws with this source at its mean.
    pub(crate) fn without(&self, tape: &Tape, longest: &Lengths) -> Tape {
        let mut tape = tape.clone();
        self.silence(&mut tape, longest);
        tape
    }

    /// The same draws with all others of these sources at their means.
    pub(super) fn alone(&self, tape: &Tape, all: &[Self], longest: &Lengths) -> Tape {
        let mut tape = tape.clone();
        for other in all.iter().filter(|other| *other != self) {
            other.silence(&mut tape, longest);
        }
        tape
    }

    fn silence(&self, tape: &mut Tape, longest: &Lengths) {
        let normals = tape.normals_named(self.purpose, &self.name);
        let draws = if of_samples(self.purpose) {
            // Without it a detector may look more often; four times as often is more than any does.
            let place = SAMPLED.iter().position(|purpose| *purpose == self.purpose).unwrap_or(0);
            0..4 * longest[place]
        } else {
            self.draws.clone()
        };
        normals.resize(normals.len().max(draws.end), 0.0);
        normals[draws].fill(0.0);
    }
}
