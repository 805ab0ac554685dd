//! Error budget: Sobol' indices of a scenario's sources of error, computed per rotor angle.
//!
//! A gain error turns the axis one way at one angle and the other way at another: over all angles the effect averages to zero,
//! and a first-order index over all angles would state that the gain does not matter. So indices are computed per angle, and then
//! averaged.

mod sources;

use std::f64::consts::TAU;

use standstill_campaign::{Estimate, in_parallel};
use standstill_numeric::sin_cos;
use standstill_scenario::{FileError, Record};
use standstill_sim::{Purpose, Streams, Tape};

pub use sources::Source;
use sources::Start;
pub(crate) use sources::lengths;

use crate::sobol::{Shares, Squares, Tuple, ratio};
use crate::trials::Codes;
use crate::{Halt, Trials, Watch};
use standstill_odds::kept;

/// Default number of pairs of simulated motor starts. The two starts of a pair come from two samples. They have the same rotor angle and no
/// other random draws in common.
pub const PAIRS: u64 = 8000;

/// Least number of pairs in which all starts have an axis. With fewer such pairs, no shares are computed.
const FEWEST: usize = 10;

/// Numbers of parts into which a turn of the rotor is divided, so that contributions can be computed over the angle. The parts are 15°, 30°
/// or 60° wide. The narrowest parts with enough pairs are used.
const PARTS: [usize; 3] = [24, 12, 6];

/// Least number of pairs per part.
const IN_PART: usize = 150;

/// Number of trials that are computed and stored together. An interruption loses at most this number of trials.
const AT_ONCE: usize = 2048;

/// Number of different offsets of the converters' codes that a start may draw. They divide one LSB evenly.
const PLACES: u64 = 16;

/// Contribution of each source of error to the mean square error.
#[derive(Clone, Debug, PartialEq)]
pub struct Budget {
    /// Rms error of all starts with an axis, in degrees.
    pub rms_deg: Estimate,
    /// Contribution of each source, in the order in which the sources were given.
    pub items: Vec<Item>,
    /// Contribution of the method itself.
    pub method: Own,
    /// Share of the mean square error that sources cause only by their interaction.
    pub interaction: Estimate,
    /// Number of pairs of starts, see [`PAIRS`].
    pub pairs: u64,
    /// Number of pairs that were left out because a start had no axis.
    pub dropped: u64,
    /// Number of trials in all.
    pub trials: u64,
    /// Contributions in each of several ranges of the rotor angle, which have equal widths.
    pub over_angle: Vec<AngleRange>,
}

/// The method's own error. At each rotor angle, it is the mean of the error over all random draws.
#[derive(Clone, Debug, PartialEq)]
pub struct Own {
    /// Rms in degrees of the method's own error alone.
    pub alone_deg: Estimate,
    /// Rms in degrees of the rest of the error, which is the error minus its mean at each angle.
    pub without_deg: Estimate,
    /// The method's own error as a share of the mean square error.
    pub share: Estimate,
}

/// Contribution of one source of error.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// The source of error.
    pub source: Source,
    /// Rms error in degrees if only this source acts and all other sources are at their means.
    pub alone_deg: Estimate,
    /// Rms error in degrees without this source.
    pub without_deg: Estimate,
    /// First-order index: the share of the mean square error that the source causes by itself.
    pub share: Estimate,
    /// Total index: the share of the mean square error that the source causes by itself and by all its interactions.
    pub total: Estimate,
}

/// Contributions in one range of rotor angles.
#[derive(Clone, Debug, PartialEq)]
pub struct AngleRange {
    /// Middle of the range in electrical degrees.
    pub angle_deg: f64,
    /// Mean squares in degrees² of the whole error, of the method's own error, and of the error that each source causes by itself.
    pub squares: Squares,
}

/// Error of a budget: too few pairs have an axis in all their starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooFew {
    /// Number of pairs of starts.
    pub pairs: u64,
    /// Number of pairs in which all starts have an axis.
    pub whole: u64,
    /// Least number of pairs in which all starts must have an axis.
    pub needed: u64,
}

/// Returns the number of trials of a budget with this number of pairs and sources.
pub const fn trials(pairs: u64, sources: usize) -> u64 {
    pairs * (2 + 3 * sources as u64)
}

/// Errors in degrees of the starts of a sample, in the order of the starts. None for a start without an axis.
type Errors = Vec<Option<f64>>;

impl Budget {
    /// Divides the mean square error among the scenario's sources of error. Rotor angles are spread evenly over the turn, unless the
    /// scenario sets an angle. The inner result is an error if too few pairs have an axis in all their starts. The computation then ends as
    /// soon as this shows.
    ///
    /// # Errors
    /// A drawn value is invalid, or the computation was interrupted.
    pub fn of(
        trials: &Trials<'_>,
        sources: &[Source],
        pairs: u64,
        watch: &dyn Watch,
    ) -> Result<Result<Self, TooFew>, Halt<FileError>> {
        let bench = Bench { trials, watch, rounds: sources.iter().any(Source::is_rounding) };
        let too_few = |all: &[&Errors]| {
            let whole = (0..all[0].len()).filter(|k| all.iter().all(|errors| errors[*k].is_some())).count();
            (whole < FEWEST).then_some(TooFew { pairs, whole: whole as u64, needed: FEWEST as u64 })
        };
        let (a, mut starts_a) = bench.sample(pairs, 0)?;
        if let Some(few) = too_few(&[&a]) {
            return Ok(Err(few));
        }
        let (b, starts_b) = bench.sample(pairs, 1)?;
        let longest = lengths(starts_a.iter_mut().map(|start| &mut start.tape));
        let key = |source: &Source, what: &str| {
            format!("budget: {} {what} of {} in {pairs} pairs", source.key, sources.len())
        };
        // The mixed starts, which every pair needs, come first, so that too few pairs show early.
        let mut mixed: Vec<Errors> = Vec::new();
        for source in sources {
            let mix = |k: usize| source.mixed(&starts_a[k], &starts_b[k]);
            mixed.push(bench.errors(&key(source, "mixed"), starts_a.len(), mix)?);
            let all: Vec<&Errors> = [&a, &b].into_iter().chain(&mixed).collect();
            if let Some(few) = too_few(&all) {
                return Ok(Err(few));
            }
        }
        let mut alone_and_without = Vec::new();
        for source in sources {
            let only = |k: usize| source.alone(&starts_a[k], sources, &longest);
            let alone = bench.errors(&key(source, "alone"), starts_a.len(), only)?;
            let none = |k: usize| source.removed(&starts_a[k], &longest);
            let without = bench.errors(&key(source, "without"), starts_a.len(), none)?;
            alone_and_without.push([rms(&alone), rms(&without)]);
        }
        let tuple = |k: usize| {
            let mixed: Option<Vec<f64>> = mixed.iter().map(|errors: &Errors| errors[k]).collect();
            Some(Tuple { a: a[k]?, b: b[k]?, mixed: mixed? })
        };
        let tuples: Vec<Option<Tuple>> = (0..a.len()).map(tuple).collect();
        let whole: Vec<Tuple> = tuples.iter().flatten().cloned().collect();
        let shares = Shares::of(&whole, sources.len());
        let squares = Squares::of(&whole, sources.len());
        let items = sources.iter().zip(alone_and_without).enumerate();
        let items = items.map(|(k, (source, [alone_deg, without_deg]))| Item {
            source: source.clone(),
            alone_deg,
            without_deg,
            share: shares.first[k],
            total: shares.total[k],
        });
        let alone_deg = root(squares.common);
        Ok(Ok(Self {
            rms_deg: root(shares.mean_square),
            items: items.collect(),
            method: Own { alone_deg, without_deg: root(squares.rest), share: shares.common },
            interaction: shares.interaction,
            pairs,
            dropped: pairs - whole.len() as u64,
            trials: self::trials(pairs, sources.len()),
            over_angle: over_angle(&tuples, sources.len()),
        }))
    }
}

/// Returns the mean squares for each part of the turn. Pair k of n pairs, counted from 0, has the rotor angle 360° (k + 1/2)/n.
fn over_angle(tuples: &[Option<Tuple>], sources: usize) -> Vec<AngleRange> {
    let has_enough = |parts: &usize| tuples.len() >= IN_PART * parts;
    let parts = PARTS.into_iter().find(has_enough).unwrap_or(PARTS[PARTS.len() - 1]);
    let part = |number: usize| {
        let [from, to] = [number, number + 1].map(|edge| edge * tuples.len() / parts);
        let whole: Vec<Tuple> = tuples[from..to].iter().flatten().cloned().collect();
        AngleRange {
            angle_deg: 360.0 * (number as f64 + 0.5) / parts as f64,
            squares: Squares::of(&whole, sources),
        }
    };
    (0..parts).map(part).collect()
}

fn rms(errors: &Errors) -> Estimate {
    root(ratio(errors.iter().flatten().map(|error| (error * error, 1.0))))
}

fn root(square: Estimate) -> Estimate {
    square.map(|x| x.max(0.0).sqrt())
}

struct Bench<'a> {
    trials: &'a Trials<'a>,
    watch: &'a dyn Watch,
    /// True if each start draws an offset of the converters' codes.
    rounds: bool,
}

impl Bench<'_> {
    /// Returns the errors and starts of one of the two samples. Both samples have the same rotor angles, but no other random draws in
    /// common.
    fn sample(&self, pairs: u64, sample: u64) -> Result<(Errors, Vec<Start>), Halt<FileError>> {
        let seed = self.trials.scenario().seed;
        let start = |k: u64| {
            // The highest bits keep these trial numbers apart from those of plain trials and of `odds`.
            let number = 3 << 62 | sample << 40 | k;
            let mut tape = Tape::new(seed, number);
            let (sin, cos) = sin_cos(TAU * (k as f64 + 0.5) / pairs as f64);
            *tape.normals(Purpose::Angle) = vec![cos, sin];
            let mut draws = Streams::new(seed, number).open_named(Purpose::Design, "codes");
            let place = if self.rounds { draws.integer(PLACES - 1) } else { 0 };
            Start { tape, codes: Codes::Moved(place as f64 / PLACES as f64) }
        };
        self.run((0..pairs).map(start).collect())
    }

    /// Returns the errors of starts. They are computed in blocks, so an interruption loses at most one block.
    fn errors(
        &self,
        key: &str,
        starts: usize,
        start: impl Fn(usize) -> Start,
    ) -> Result<Errors, Halt<FileError>> {
        let mut all = Errors::new();
        for first in (0..starts).step_by(AT_ONCE) {
            let block = first..starts.min(first + AT_ONCE);
            let count = |errors: &Errors| errors.len() as u64;
            let run = || self.run(block.map(&start).collect()).map(|(errors, _)| errors);
            all.extend(kept(self.watch, &format!("{key} from {first}"), count, run)?);
        }
        Ok(all)
    }

    /// Runs the starts, and returns their errors and the starts with the draws that the trials read. Starts with the same code offset run
    /// side by side.
    fn run(&self, mut starts: Vec<Start>) -> Result<(Errors, Vec<Start>), Halt<FileError>> {
        let mut groups: Vec<(Codes, Vec<usize>, Vec<Tape>)> = Vec::new();
        for (k, start) in starts.iter_mut().enumerate() {
            let tape = std::mem::replace(&mut start.tape, Tape::new(0, 0));
            match groups.iter_mut().find(|(codes, ..)| *codes == start.codes) {
                Some((_, numbers, tapes)) => {
                    numbers.push(k);
                    tapes.push(tape);
                }
                None => groups.push((start.codes, vec![k], vec![tape])),
            }
        }
        let done = in_parallel(groups, &|(codes, numbers, tapes)| {
            let (records, tapes) = self.trials.with_codes(codes).all_with_tapes(tapes, self.watch)?;
            Ok::<_, Halt<FileError>>((numbers, records, tapes))
        })?;
        let mut errors = vec![None; starts.len()];
        for (numbers, records, tapes) in done {
            for ((k, record), tape) in numbers.into_iter().zip(&records).zip(tapes) {
                errors[k] = Record::axis_error_deg(record);
                starts[k].tape = tape;
            }
        }
        Ok((errors, starts))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_parts_over_the_angle_have_pairs_enough_and_use_all() {
        // A method's own error with two periods in a turn, and nothing else.
        let tuples = |pairs: usize| -> Vec<Option<Tuple>> {
            let error = |k: usize| 2.0 * sin_cos(2.0 * TAU * (k as f64 + 0.5) / pairs as f64).0;
            (0..pairs).map(|k| Some(Tuple { a: error(k), b: error(k), mixed: vec![error(k)] })).collect()
        };
        let counts = [3600, 3599, 1800, 1799, 100].map(|pairs| over_angle(&tuples(pairs), 1).len());
        assert_eq!(counts, [24, 12, 12, 6, 6]);
        for pairs in [3600, 1801] {
            let parts = over_angle(&tuples(pairs), 1);
            let width = 360.0 / parts.len() as f64;
            for part in &parts {
                // The mean of 4 sin² 2θ over a part.
                let half = (2.0 * width).to_radians();
                let truth = 2.0 - 2.0 * (4.0 * part.angle_deg).to_radians().cos() * half.sin() / half;
                for found in [part.squares.all, part.squares.common] {
                    assert!((found.value - truth).abs() < 0.03, "{pairs}, {}: {found:?}", part.angle_deg);
                }
                assert_eq!(part.squares.first[0].value, 0.0);
            }
        }
    }
}
