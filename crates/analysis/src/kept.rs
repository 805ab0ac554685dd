//! Storage of finished runs of subset simulation, draw by draw, so that an interrupted computation can be continued.

use serde::{Deserialize, Serialize};
use standstill_sim::{Purpose, Tape};

use crate::subset::{End, Run};

/// A finished run of subset simulation in the form in which it is stored.
#[derive(Serialize, Deserialize)]
pub(crate) struct KeptRun {
    end: u8,
    probability: f64,
    variation: f64,
    levels: u32,
    curve: Vec<(f64, f64)>,
    pub trials: u64,
    acceptance: f64,
    ancestors: u32,
    unread: [f64; 8],
    failures: KeptTapes,
    plain_hits: u32,
}

/// A stored strip of a tape: purpose, name, draws, and the number of draws that were read.
type KeptStrip = (u8, String, Vec<f64>, usize);

/// Stored tapes: number and strips of each tape.
#[derive(Serialize, Deserialize)]
pub(crate) struct KeptTapes(Vec<(u64, Vec<KeptStrip>)>);

/// All purposes that a tape may have; their indices here are what is stored.
const PURPOSES: [Purpose; 23] = [
    Purpose::Angle,
    Purpose::GateDelay,
    Purpose::Ripple,
    Purpose::Backlash,
    Purpose::CurrentGain,
    Purpose::CurrentOffset,
    Purpose::LinkError,
    Purpose::Resolver,
    Purpose::CurrentNoise,
    Purpose::LinkNoise,
    Purpose::Jitter,
    Purpose::Bandwidth,
    Purpose::Tolerance,
    Purpose::Design,
    Purpose::Detector,
    Purpose::Memory,
    Purpose::TerminalGain,
    Purpose::TerminalOffset,
    Purpose::TerminalNoise,
    Purpose::ComparatorOffset,
    Purpose::ComparatorDelay,
    Purpose::CaptureTimer,
    Purpose::ComparatorNoise,
];

const ENDS: [End; 4] = [End::Reached, End::Flat, End::TooRare, End::Constant];

#[allow(clippy::cast_possible_truncation, reason = "a short list")]
fn place<T: PartialEq>(all: &[T], one: &T) -> u8 {
    all.iter().position(|other| other == one).unwrap_or(usize::from(u8::MAX)) as u8
}

impl KeptTapes {
    pub fn of(tapes: &mut [Tape]) -> Self {
        let tape = |tape: &mut Tape| {
            let number = tape.index();
            let strips = tape.strips().iter();
            let strip = strips.map(|strip| {
                (place(&PURPOSES, &strip.purpose), strip.name.clone(), strip.normals.clone(), strip.read)
            });
            (number, strip.collect())
        };
        Self(tapes.iter_mut().map(tape).collect())
    }

    /// Restores the tapes, whose further draws come from this seed; none if a stored purpose is unknown.
    pub fn tapes(self, seed: u64) -> Option<Vec<Tape>> {
        let tape = |(number, strips): (u64, Vec<KeptStrip>)| {
            let mut tape = Tape::new(seed, number);
            for (purpose, name, normals, read) in strips {
                *tape.normals_named(*PURPOSES.get(usize::from(purpose))?, &name) = normals;
                tape.strips().last_mut()?.read = read;
            }
            Some(tape)
        };
        self.0.into_iter().map(tape).collect()
    }
}

impl KeptRun {
    pub fn of(run: &Run) -> Self {
        let Run { probability, variation, levels, trials, acceptance, ancestors, unread, plain_hits, .. } =
            *run;
        Self {
            end: place(&ENDS, &run.end),
            probability,
            variation,
            levels,
            curve: run.curve.clone(),
            trials,
            acceptance,
            ancestors,
            unread,
            failures: KeptTapes::of(&mut run.failures.clone()),
            plain_hits,
        }
    }

    pub fn run(self, seed: u64) -> Option<Run> {
        let Self { probability, variation, levels, curve, trials, acceptance, ancestors, unread, .. } = self;
        Some(Run {
            end: *ENDS.get(usize::from(self.end))?,
            probability,
            variation,
            levels,
            curve,
            trials,
            acceptance,
            ancestors,
            unread,
            failures: self.failures.tapes(seed)?,
            plain_hits: self.plain_hits,
        })
    }
}

#[cfg(test)]
mod tests {
    use standstill_sim::Streams;

    use super::*;

    #[test]
    fn law_tapes_survive_as_they_were() {
        let tape = |number| {
            let mut tape = Tape::new(7, number);
            let mut draws = Streams::taped(&tape).open_named(Purpose::Tolerance, "motor.winding.resistance");
            let _ = draws.normal();
            let _ = Streams::taped(&tape).open(Purpose::CurrentNoise).normal();
            *tape.normals(Purpose::CurrentGain) = vec![-1.5, 0.25];
            *tape.normals(Purpose::Memory) = vec![0.5, 2.0];
            tape
        };
        let all: Vec<Tape> = (0..3).map(tape).collect();
        let bytes = postcard::to_stdvec(&KeptTapes::of(&mut all.clone())).expect("bytes");
        let again: KeptTapes = postcard::from_bytes(&bytes).expect("tapes");
        assert_eq!(again.tapes(7), Some(all));
        // Each purpose has a place of its own, that of its number.
        for (number, purpose) in PURPOSES.iter().enumerate() {
            assert_eq!((*purpose as usize, usize::from(place(&PURPOSES, purpose))), (number, number));
        }
    }
}
