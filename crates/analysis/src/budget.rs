//! Where the error comes from: Sobol' indices of a scenario's sources of error, with the rotor's angle held common.
//!
//! An error of gains turns the axis one way at one angle and the other way at another: over all angles it averages to
//! nothing, and a naive share of first order says that it does not matter. So indices are per angle, and then averaged.

mod sources;

use std::f64::consts::TAU;

use standstill_campaign::Estimate;
use standstill_numeric::sin_cos;
use standstill_scenario::FileError;
use standstill_scenario::Record;
use standstill_sim::{Purpose, Tape};

pub use sources::Source;
pub(crate) use sources::lengths;

use crate::sobol::{Shares, Tuple, ratio};
use crate::system::kept;
use crate::{Halt, Trials, Watch};

/// Pairs of samples where nobody asks for another number.
pub const PAIRS: u64 = 8000;

/// Parts of the picture over the angle.
pub const PARTS: usize = 24;

/// What each source contributes.
#[derive(Clone, Debug, PartialEq)]
pub struct Budget {
    /// Of all starts with an axis, in degrees.
    pub rms_deg: Estimate,
    /// The sources.
    pub items: Vec<Item>,
    /// The method's own: what it gets wrong at each angle on average over all draws. Rms in degrees, and share.
    pub method: (f64, Estimate),
    /// Share of what sources make only together.
    pub interaction: Estimate,
    /// Pairs of samples.
    pub pairs: u64,
    /// Of these, how many were left out because some start had no axis.
    pub dropped: u64,
    /// Trials in all.
    pub trials: u64,
    /// The contributions over the angle.
    pub over_angle: Vec<Part>,
}

/// A source.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// Which.
    pub source: Source,
    /// Rms in degrees with this source alone, all others at their means.
    pub alone_deg: Estimate,
    /// Rms in degrees without it.
    pub without_deg: Estimate,
    /// Its share of the mean square by itself.
    pub share: Estimate,
    /// Its share together with all in which it has a part.
    pub total: Estimate,
}

/// Contributions at a range of angles.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// The middle of the angles, in degrees.
    pub angle_deg: f64,
    /// Rms in degrees of all errors.
    pub rms_deg: f64,
    /// Rms in degrees of the method's own.
    pub method_deg: f64,
    /// Of each source by itself.
    pub sources_deg: Vec<f64>,
}

/// Trials of a budget of so many pairs and sources.
pub const fn trials(pairs: u64, sources: usize) -> u64 {
    pairs * (2 + 3 * sources as u64)
}

/// Errors in degrees of samples in the same order; none without an axis.
type Errors = Vec<Option<f64>>;

impl Budget {
    /// Of the scenario's sources. Angles are spread evenly over the turn, unless the scenario has one.
    ///
    /// # Errors
    /// A value drawn that cannot be; that it was stopped.
    pub fn of(
        trials: &Trials<'_>,
        sources: &[Source],
        pairs: u64,
        watch: &dyn Watch,
    ) -> Result<Self, Halt<FileError>> {
        let bench = Bench { trials, watch };
        let [(a, mut tapes_a), (b, tapes_b)] = [bench.sample(pairs, 0)?, bench.sample(pairs, 1)?];
        let longest = sources::lengths(&mut tapes_a);
        let mut mixed = Vec::new();
        let (mut alone, mut without) = (Vec::new(), Vec::new());
        for source in sources {
            let mix = |(a, b): (&Tape, &Tape)| source.mixed(a, b);
            let key =
                |what: &str| format!("budget: {} {what} of {} in {pairs} pairs", source.key, sources.len());
            mixed.push(bench.errors(&key("mixed"), || tapes_a.iter().zip(&tapes_b).map(mix).collect())?);
            let only = |tape: &Tape| source.alone(tape, sources, &longest);
            alone.push(bench.errors(&key("alone"), || tapes_a.iter().map(only).collect())?);
            let none = |tape: &Tape| source.without(tape, &longest);
            without.push(bench.errors(&key("without"), || tapes_a.iter().map(none).collect())?);
        }
        let tuple = |k: usize| {
            let mixed: Option<Vec<f64>> = mixed.iter().map(|errors: &Errors| errors[k]).collect();
            Some(Tuple { a: a[k]?, b: b[k]?, mixed: mixed? })
        };
        let tuples: Vec<Option<Tuple>> = (0..a.len()).map(tuple).collect();
        let whole: Vec<Tuple> = tuples.iter().flatten().cloned().collect();
        let shares = Shares::of(&whole);
        let items = sources.iter().enumerate().map(|(k, source)| Item {
            source: source.clone(),
            alone_deg: rms(&alone[k]),
            without_deg: rms(&without[k]),
            share: shares.first[k],
            total: shares.total[k],
        });
        Ok(Self {
            rms_deg: root(shares.mean_square),
            items: items.collect(),
            method: ((shares.common.value.max(0.0) * shares.mean_square.value).sqrt(), shares.common),
            interaction: shares.interaction,
            pairs,
            dropped: pairs - whole.len() as u64,
            trials: self::trials(pairs, sources.len()),
            over_angle: over_angle(&tuples),
        })
    }
}

/// Shares in parts of the turn. Sample k of n stands at the k-th of n angles.
fn over_angle(tuples: &[Option<Tuple>]) -> Vec<Part> {
    let size = tuples.len().div_ceil(PARTS).max(1);
    let part = |(number, part): (usize, &[Option<Tuple>])| {
        let whole: Vec<Tuple> = part.iter().flatten().cloned().collect();
        let shares = Shares::of(&whole);
        let rms = |share: f64| (share.max(0.0) * shares.mean_square.value).sqrt();
        let middle = (number * size) as f64 + part.len() as f64 / 2.0;
        Part {
            angle_deg: 360.0 * middle / tuples.len() as f64,
            rms_deg: rms(1.0),
            method_deg: rms(shares.common.value),
            sources_deg: shares.first.iter().map(|share| rms(share.value)).collect(),
        }
    };
    tuples.chunks(size).enumerate().map(part).collect()
}

fn rms(errors: &Errors) -> Estimate {
    root(ratio(errors.iter().flatten().map(|error| (error * error, 1.0))))
}

fn root(square: Estimate) -> Estimate {
    let root = |x: f64| x.max(0.0).sqrt();
    Estimate { value: root(square.value), low: root(square.low), high: root(square.high) }
}

struct Bench<'a> {
    trials: &'a Trials<'a>,
    watch: &'a dyn Watch,
}

impl Bench<'_> {
    /// Errors and tapes of one sample. Both samples have the same angles, and no other draws in common.
    fn sample(&self, pairs: u64, sample: u64) -> Result<(Errors, Vec<Tape>), Halt<FileError>> {
        let seed = self.trials.scenario().seed;
        let tape = |k: u64| {
            // The highest bits keep them apart from plain trials and from those of odds.
            let mut tape = Tape::new(seed, 3 << 62 | sample << 40 | k);
            let (sin, cos) = sin_cos(TAU * (k as f64 + 0.5) / pairs as f64);
            *tape.normals(Purpose::Angle) = vec![cos, sin];
            tape
        };
        self.run((0..pairs).map(tape).collect())
    }

    fn errors(&self, key: &str, tapes: impl FnOnce() -> Vec<Tape>) -> Result<Errors, Halt<FileError>> {
        let count = |errors: &Errors| errors.len() as u64;
        kept(self.watch, key, count, || Ok(self.run(tapes())?.0))
    }

    /// Errors, and the tapes as they are after the trials.
    fn run(&self, tapes: Vec<Tape>) -> Result<(Errors, Vec<Tape>), Halt<FileError>> {
        let (records, tapes) = self.trials.all_with_tapes(tapes, self.watch)?;
        Ok((records.iter().map(Record::axis_error_deg).collect(), tapes))
    }
}
