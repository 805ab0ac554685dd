//! Explains the end of a trial: the trial is repeated once for each of its errors, with that error at its mean.
//!
//! Every change moves all readings slightly, so that a converter rounds many of them to another code. That alone turns
//! the axis, as if the changed error were the cause. So each trial is run with the converters' codes shifted by
//! fractions of an LSB. The effect of an error is the mean difference over these runs; the scatter of the runs is the
//! effect of rounding.

use standstill_campaign::{Estimate, student};
use standstill_numeric::{atan2, cos, sin};
use standstill_scenario::{FileError, Record, Verdict};
use standstill_sim::Tape;

use crate::budget::{Source, lengths};
use crate::trials::Codes;
use crate::{Halt, Trials, Watch};

/// A random error of a trial, and the result of the same trial without this error.
#[derive(Clone, Debug, PartialEq)]
pub struct Cause {
    /// Name of the error, such as `gain of b`.
    pub name: String,
    /// Key that sets the spread of the error.
    pub key: String,
    /// Drawn value of the error, in standard deviations of its distribution. None for an error that has several draws.
    pub drawn: Option<f64>,
    /// Record of the trial with this error at its mean and all other draws as before.
    pub without: Record,
    /// Increase of the axis error in degrees due to this error, with its 95 % interval. It is averaged over the converter's rounding. None
    /// if one of the trials has no axis.
    pub part_deg: Option<Estimate>,
    /// True if the converter's rounding may explain the increase.
    pub within_rounding: bool,
}

/// A trial, and the random errors that explain its result.
#[derive(Clone, Debug, PartialEq)]
pub struct Explained {
    /// Record of the trial.
    pub record: Record,
    /// Standard deviation in degrees of the trial's axis error, caused by the converter's rounding: it is taken over different offsets of
    /// the codes. None without a converter.
    pub rounding_deg: Option<f64>,
    /// Random errors of the trial, sorted by their effect on the result, the largest effect first.
    pub causes: Vec<Cause>,
    /// Record of the trial with all errors at their means. It shows the method's own error at this angle.
    pub without_all: Record,
    /// All random draws of the trial.
    pub tape: Tape,
}

/// Returns all sources of error, and all parts of these sources with their names. A part is a single error, which can be set to its mean.
fn parts(trials: &Trials<'_>) -> (Vec<Source>, Vec<(String, Source)>) {
    let sources = Source::drawn(trials);
    let parts = sources.iter().flat_map(|source| source.parts(&trials.scenario().faults)).collect();
    (sources, parts)
}

impl Explained {
    /// Returns the number of trials that an explanation takes. One is the trial itself. For each offset of the codes, further trials are
    /// run: the trial unchanged, the trial without each of its errors, and the trial without any error.
    pub fn runs(trials: &Trials<'_>) -> u64 {
        let places = if trials.have_converters() { u64::from(PLACES) } else { 1 };
        1 + places * (parts(trials).1.len() as u64 + 2)
    }

    /// Explains the trial with the number `trial` and the seed `seed`.
    ///
    /// # Errors
    /// A drawn value is invalid, or the computation was interrupted.
    pub fn of(
        trials: &Trials<'_>,
        seed: u64,
        trial: u64,
        watch: &dyn Watch,
    ) -> Result<Self, Halt<FileError>> {
        let (mut records, mut tapes) = trials.all_with_tapes(vec![Tape::new(seed, trial)], watch)?;
        let (Some(record), Some(mut tape)) = (records.pop(), tapes.pop()) else { return Err(Halt::Stopped) };
        let longest = lengths(std::iter::once(&mut tape));
        let (sources, parts) = parts(trials);
        let mut without: Vec<Tape> = parts.iter().map(|(_, part)| part.without(&tape, &longest)).collect();
        without.push(sources.iter().fold(tape.clone(), |tape, source| source.without(&tape, &longest)));
        without.push(tape.clone());
        let shifted = shifted(trials, &without, watch)?;
        let own = shifted.last().cloned().unwrap_or_default();
        let mut records = trials.all_records(without, watch)?;
        records.pop();
        let Some(without_all) = records.pop() else { return Err(Halt::Stopped) };
        let mut causes: Vec<Cause> = parts
            .into_iter()
            .zip(records)
            .zip(&shifted)
            .map(|(((name, part), without), shifted)| {
                let drawn = part.draw(&mut tape);
                let (part_deg, within_rounding) = compared([&record, &without], [&own, shifted]);
                Cause { name, key: part.key, drawn, without, part_deg, within_rounding }
            })
            .collect();
        let far = |cause: &Cause| if cause.within_rounding { -1.0 } else { apart(&record, cause) };
        causes.sort_by(|a, b| far(b).total_cmp(&far(a)));
        let rounding_deg = scatter(&own);
        Ok(Self { record, rounding_deg, causes, without_all, tape })
    }
}

/// Number of offsets of the codes that are tried. They are a sixteenth of an LSB apart.
const PLACES: u32 = 16;

/// Returns the records of each tape with the codes shifted by each offset except zero. There are no records for a scenario without
/// converters.
fn shifted(
    trials: &Trials<'_>,
    tapes: &[Tape],
    watch: &dyn Watch,
) -> Result<Vec<Vec<Record>>, Halt<FileError>> {
    let mut all = vec![Vec::new(); tapes.len()];
    let places = if trials.have_converters() { 1..PLACES } else { 1..1 };
    for place in places {
        let moved = trials.with_codes(Codes::Moved(f64::from(place) / f64::from(PLACES)));
        let records = moved.all_records(tapes.to_vec(), watch)?;
        for (all, record) in all.iter_mut().zip(records) {
            all.push(record);
        }
    }
    Ok(all)
}

/// Returns how a trial ended: its verdict, and whether the pole that it named was right. A trial without a pole has no second value.
fn end(record: &Record) -> (Verdict, Option<bool>) {
    (record.verdict(), record.pole_correct())
}

/// Returns the difference between the axis errors of a trial with and without one of its errors, and true if rounding may explain this
/// difference. The records `as_it_was` have the original codes, the records `shifted` have shifted codes.
fn compared(as_it_was: [&Record; 2], shifted: [&[Record]; 2]) -> (Option<Estimate>, bool) {
    let pairs = || std::iter::once(as_it_was).chain(shifted[0].iter().zip(shifted[1]).map(|(a, b)| [a, b]));
    let count = 1 + shifted[0].len();
    let differ = |[a, b]: [&Record; 2]| end(a) != end(b);
    let differing = pairs().filter(|pair| differ(*pair)).count();
    let turns = pairs().filter_map(|[a, b]| Some(turn(a.axis_error_deg()?, b.axis_error_deg()?)));
    let turns: Vec<f64> = turns.collect();
    let part = (turns.len() == count).then(|| mean(&turns));
    // If an error changes the end at most offsets of the codes, the error is the cause, whatever the axis does.
    let within = 2 * differing <= count
        && count > 1
        && part.map_or(differ(as_it_was), |part| part.low <= 0.0 && 0.0 <= part.high);
    (part, within)
}

/// Returns the angle in degrees from axis `from` to axis `to`, in the range (−90, 90]°.
fn turn(to: f64, from: f64) -> f64 {
    let turn = (to - from).rem_euclid(180.0);
    if turn > 90.0 { turn - 180.0 } else { turn }
}

/// Returns the mean of the turns in degrees, in the range (−90, 90]°, with its 95 % interval. The ends of the interval may lie outside this
/// range. The interval of a single turn has no width.
fn mean(turns: &[f64]) -> Estimate {
    let (value, deviation) = spread(turns);
    let count = turns.len() as f64;
    let half = if turns.len() > 1 { student(count - 1.0) * deviation / count.sqrt() } else { 0.0 };
    Estimate { value, low: value - half, high: value + half }
}

/// Returns the mean and the standard deviation of turns of an axis in degrees. Deviations are counted from the circular mean, because turns
/// just below 90° and just above −90° are neighbours.
fn spread(turns: &[f64]) -> (f64, f64) {
    let count = turns.len() as f64;
    let sum = |of: fn(f64) -> f64| turns.iter().map(|turn| of((2.0 * turn).to_radians())).sum::<f64>();
    let middle = atan2(sum(sin), sum(cos)).to_degrees() / 2.0;
    let away: Vec<f64> = turns.iter().map(|to| turn(*to, middle)).collect();
    let mean = away.iter().sum::<f64>() / count;
    let squares: f64 = away.iter().map(|x| (x - mean) * (x - mean)).sum();
    (turn(middle + mean, 0.0), (squares / (count - 1.0)).sqrt())
}

/// Returns the standard deviation of the axis errors in degrees. None for fewer than two axis errors.
fn scatter(records: &[Record]) -> Option<f64> {
    let errors: Vec<f64> = records.iter().filter_map(Record::axis_error_deg).collect();
    (errors.len() > 1).then(|| spread(&errors).1)
}

/// Returns the effect of a cause on the trial's result, by which causes are sorted. It is the difference of the axis errors in degrees. If
/// the trial ends in another way without the cause, it is 1000, which is above any axis error.
fn apart(record: &Record, cause: &Cause) -> f64 {
    if end(record) != end(&cause.without) {
        return 1000.0;
    }
    cause.part_deg.map_or(0.0, |part| part.value.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the record of a start with a detector that requires at least this saliency.
    fn ended(least_saliency: f64) -> Record {
        let text = format!(
            "motor = \"paper-5k5\"\nerrors = \"none\"\n[detector]\nmethod = \"line-inductance-fast\"\n\
             least_saliency = {least_saliency}\n"
        );
        let document = standstill_scenario::Document::parse(std::path::Path::new("test.toml"), &text);
        let plan = standstill_scenario::Plan::new(document.expect("TOML")).expect("a plan");
        let never = std::sync::atomic::AtomicBool::new(false);
        let trials = Trials::new(&plan).expect("a scenario");
        trials.all_records(vec![Tape::new(1, 0)], &never).expect("runs").remove(0)
    }

    #[test]
    fn law_an_end_that_most_places_of_the_codes_change_is_the_doing_of_the_error() {
        let (found, failed) = (ended(0.01), ended(0.9));
        assert_ne!(end(&found), end(&failed));
        let places = |changed: usize| -> Vec<Record> {
            (0..15).map(|k| if k < changed { failed } else { found }).collect()
        };
        let other = vec![found; 15];
        // If nine of sixteen places change the end, the error does it; if five do, the converter's rounding does.
        assert_eq!(compared([&found, &failed], [&other, &places(8)]), (None, false));
        assert_eq!(compared([&found, &failed], [&other, &places(4)]), (None, true));
        let (part, within) = compared([&found, &found], [&other, &other]);
        assert!(within && part.is_some_and(|part| part.value == 0.0), "{part:?}");
    }

    #[test]
    fn regress_turns_on_both_sides_of_90_degrees_are_neighbours() {
        // 88° and −88° are 4° apart, and their middle is 90°, not zero.
        let (mean_deg, deviation) = spread(&[88.0, -88.0, 89.0, -89.0]);
        assert!((mean_deg.abs() - 90.0).abs() < 1e-9, "{mean_deg}");
        // Squares of 2, 2, 1 and 1 over 3.
        assert!((deviation - (10.0_f64 / 3.0).sqrt()).abs() < 1e-9, "{deviation}");
        let part = mean(&[88.0, -88.0, 89.0, -89.0]);
        assert!(part.high - part.low < 10.0 && !(part.low..=part.high).contains(&0.0), "{part:?}");
        // Elsewhere it is the mean, and Student's interval of it.
        let part = mean(&[1.0, 2.0, 3.0]);
        let half = student(2.0) / 3.0_f64.sqrt();
        for (found, truth) in [(part.value, 2.0), (part.low, 2.0 - half), (part.high, 2.0 + half)] {
            assert!((found - truth).abs() < 1e-9, "{part:?}");
        }
        let alone = mean(&[-4.0]);
        assert!((alone.value + 4.0).abs() < 1e-9 && alone.low == alone.high, "{alone:?}");
    }
}
