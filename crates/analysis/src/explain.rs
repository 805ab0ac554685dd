//! Why a trial ended as it did: the same trial with one of its errors at its mean.

use standstill_scenario::{FileError, Record};
use standstill_sim::Tape;

use crate::budget::{Source, lengths};
use crate::{Halt, Trials, Watch};

/// An error that a trial drew, and the trial without it.
#[derive(Clone, Debug, PartialEq)]
pub struct Cause {
    /// Its name, such as `gain of b`.
    pub name: String,
    /// The key that says how much of it there is.
    pub key: String,
    /// The value drawn, in standard deviations of its distribution. None where the cause is many draws together, or a phase.
    pub drawn: Option<f64>,
    /// The same trial with it at its mean and all else as it was.
    pub without: Record,
}

/// A trial and what made it.
#[derive(Clone, Debug, PartialEq)]
pub struct Explained {
    /// As it ended.
    pub record: Record,
    /// The errors that it drew, those first without which it would have ended most differently.
    pub causes: Vec<Cause>,
    /// The same trial with all of them at their means: the method's own error at this angle.
    pub without_all: Record,
    /// All its draws.
    pub tape: Tape,
}

impl Explained {
    /// Explains the trial of this number.
    ///
    /// # Errors
    /// A value drawn that cannot be; that it was stopped.
    pub fn of(
        trials: &Trials<'_>,
        seed: u64,
        trial: u64,
        watch: &dyn Watch,
    ) -> Result<Self, Halt<FileError>> {
        let (mut records, mut tapes) = trials.all_with_tapes(vec![Tape::new(seed, trial)], watch)?;
        let (Some(record), Some(mut tape)) = (records.pop(), tapes.pop()) else { return Err(Halt::Stopped) };
        let longest = lengths(std::slice::from_mut(&mut tape));
        let sources = Source::all(trials);
        let parts: Vec<(String, Source)> = sources.iter().flat_map(Source::parts).collect();
        let mut without: Vec<Tape> = parts.iter().map(|(_, part)| part.without(&tape, &longest)).collect();
        without.push(sources.iter().fold(tape.clone(), |tape, source| source.without(&tape, &longest)));
        let mut records = trials.all_records(without, watch)?;
        let Some(without_all) = records.pop() else { return Err(Halt::Stopped) };
        let mut causes: Vec<Cause> = parts
            .into_iter()
            .zip(records)
            .map(|((name, part), without)| {
                let drawn = part.draw(&mut tape);
                Cause { name, key: part.key, drawn, without }
            })
            .collect();
        let far = |cause: &Cause| apart(&record, &cause.without);
        causes.sort_by(|a, b| far(b).total_cmp(&far(a)));
        Ok(Self { record, causes, without_all, tape })
    }
}

/// How differently two trials ended: by the whole error, and more than any error if one has none.
fn apart(a: &Record, b: &Record) -> f64 {
    if a.verdict() != b.verdict() {
        return 1000.0;
    }
    let of = |record: &Record| record.error_deg().or(record.axis_error_deg()).unwrap_or(0.0);
    (of(a) - of(b)).abs()
}
