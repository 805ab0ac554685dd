//! Requirement on a part of the drive: the largest or smallest value of a key with which given limits hold.

use std::collections::HashMap;
use std::ops::Range;

use standstill_campaign::Estimate;
use standstill_quantity::si_value;
use standstill_scenario::{Document, FileError, Origin, Plan, seed_value};
use toml::Value;

use crate::bracket::{Found, Look};
use crate::faults::in_blocks;
use crate::limit::{Limits, Tally};
use crate::{Halt, Watch};
use standstill_odds::kept;

/// A scenario in which the values of some keys are varied. The trials at all values use the same random numbers, those of the scenario's
/// seed.
#[derive(Debug)]
pub struct Bench<'a> {
    /// The scenario whose keys are varied.
    pub document: &'a Document,
    /// Limits that the results of the trials must keep.
    pub limits: &'a Limits,
    /// Paths of the varied keys, each with a flag. The flag is true if the key takes whole numbers only.
    pub keys: Vec<(String, bool)>,
}

/// Result of the trials at one value of a key.
#[derive(Clone, Debug, PartialEq)]
pub struct Judged {
    /// The value of the key, in SI.
    pub value: f64,
    /// Number of trials at the value.
    pub trials: u64,
    /// True if the trials so far decided the comparison with the limits, so that the remaining trials were not run.
    pub clear: bool,
    /// Estimate of each limited measure in its unit, in the order of the limits.
    pub measures: Vec<Estimate>,
    /// Share of simulated motor starts that end without an answer. None if the rms error is not limited.
    pub without_answer: Option<Estimate>,
}

/// Text of [`Point::answer`] if the limits hold for all values of the second key.
pub const EVERYWHERE: &str = "every value meets it";

/// A point of a curve over two keys. It consists of a value of the first key and the range of values of the second key for which the limits
/// hold at this value.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Point {
    /// Value of the first key, in SI.
    pub first: f64,
    /// Limit of the range of the second key, in SI. It is the upper limit if the range has two.
    pub second: Option<f64>,
    /// Lower end of the confidence interval of `second`. None if this end is not known.
    pub low: Option<f64>,
    /// Upper end of the confidence interval of `second`. None if this end is not known.
    pub high: Option<f64>,
    /// Lower limit of the range of the second key, in SI. None if the range has only one limit.
    pub from: Option<f64>,
    /// Lower end of the confidence interval of `from`. None if this end is not known.
    pub from_low: Option<f64>,
    /// Upper end of the confidence interval of `from`. None if this end is not known.
    pub from_high: Option<f64>,
    /// `edge` if the range has one limit, `between` if it has two. Else the reason why it has none.
    pub answer: &'static str,
}

impl Point {
    /// Makes the point at the value `first` of the first key. `found` is the result of the search over the second key.
    pub fn of(first: f64, found: &Found) -> Self {
        let none = |answer| Self { first, answer, ..Self::default() };
        match found {
            Found::Nowhere => none("no value meets it"),
            Found::Everywhere => none(EVERYWHERE),
            Found::Stretch(stretch) => {
                let mut point = none("edge");
                if let [from, _] = &stretch.edges[..] {
                    point.answer = "between";
                    (point.from, [point.from_low, point.from_high]) = (Some(from.value), from.interval);
                }
                if let Some(last) = stretch.last() {
                    (point.second, [point.low, point.high]) = (Some(last.value), last.interval);
                }
                point
            }
        }
    }
}

/// Largest number of trials that a thread runs at a time.
const AT_ONCE: u64 = 256;
/// Smallest number of trials that a thread runs at a time.
const LEAST_AT_ONCE: u64 = 32;

/// Number of trials before the first comparison with the limits. If the comparison is clear, no more trials are run.
const FIRST: u64 = 64;
/// Factor by which the number of trials grows from one comparison to the next.
const MORE: u64 = 4;

/// Largest number of contributions to measures that [`Taken`] stores. They occupy a few hundred megabytes.
const NUMBERS: u64 = 30_000_000;

/// Results of the trials so far, stored for each combination of the keys' values. Further trials with the same values are added to the
/// stored results.
#[derive(Debug, Default)]
pub struct Taken(HashMap<Vec<u64>, Tally>);

impl Taken {
    fn place(values: &[f64]) -> Vec<u64> {
        values.iter().map(|value| value.to_bits()).collect()
    }

    fn remove(&mut self, values: &[f64]) -> Option<Tally> {
        self.0.remove(&Self::place(values))
    }

    fn insert(&mut self, values: &[f64], tally: Tally) {
        let numbers = |tally: &Tally| tally.count() * tally.values().len() as u64;
        if self.0.values().map(numbers).sum::<u64>() + numbers(&tally) > NUMBERS {
            self.0.clear();
        }
        self.0.insert(Self::place(values), tally);
    }
}

impl<'a> Bench<'a> {
    /// Makes a bench for keys whose values are numbers.
    ///
    /// # Errors
    /// A key does not exist, or its values are not numbers.
    pub fn new(document: &'a Document, limits: &'a Limits, keys: &[String]) -> Result<Self, FileError> {
        let mut bench = Self { document, limits, keys: Vec::new() };
        for key in keys {
            // A key that does not exist is reported now, an invalid value when it is tried.
            let whole = is_whole(document, key)?;
            bench.keys.push((key.clone(), whole));
        }
        Ok(bench)
    }

    /// Makes the plan of the scenario in which the keys have these values, in SI.
    ///
    /// # Errors
    /// A value is invalid.
    pub fn plan(&self, values: &[f64]) -> Result<Plan, FileError> {
        self.plan_of(self.document.clone(), values)
    }

    fn plan_of(&self, mut document: Document, values: &[f64]) -> Result<Plan, FileError> {
        for ((key, whole), value) in self.keys.iter().zip(values) {
            document.set_value(key, number(*value, *whole), Origin::CommandLine)?;
        }
        let plan = Plan::new(document)?;
        // Settings that the detector refuses show only now.
        plan.scenario(0)?;
        Ok(plan)
    }

    /// Compares the results of trials at these values of the keys, in SI, with the limits. Runs at most `trials` trials, and fewer if the
    /// comparison is clear earlier. Returns the estimates and the comparison. The inner error is the reason why the values are invalid.
    ///
    /// # Errors
    /// A trial cannot be run, or the computation was interrupted.
    pub fn judge(
        &self,
        values: &[f64],
        trials: u64,
        taken: &mut Taken,
        watch: &dyn Watch,
    ) -> Result<Result<(Judged, Look), FileError>, Halt<FileError>> {
        let plan = match self.plan(values) {
            Ok(plan) => plan,
            Err(error) => return Ok(Err(error)),
        };
        let seed = plan.file().seed;
        let mut tally = taken.remove(values).unwrap_or_else(|| Tally::new(self.limits));
        loop {
            let done = tally.count();
            if done > 0 {
                let look = tally.look();
                if done >= trials || look.clear.is_some() {
                    let (measures, without_answer) = (tally.estimates(), tally.without_answer());
                    taken.insert(values, tally);
                    let (value, trials) = (values.last().copied().unwrap_or(f64::NAN), look.trials);
                    let judged =
                        Judged { value, trials, clear: look.clear.is_some(), measures, without_answer };
                    return Ok(Ok((judged, look)));
                }
            }
            let next = (done * MORE).clamp(FIRST, trials.max(FIRST));
            // If at most as many trials remain as this check has, run all of them now.
            let next = if 2 * next >= trials { trials } else { next };
            tally.extend(self.part(&plan, values, seed, done..next, watch)?);
        }
    }

    /// Runs trials 0 to `trials` − 1 with this seed and these values of the keys, in SI. Returns their contributions to the measures. None
    /// if the values are invalid.
    ///
    /// # Errors
    /// A trial cannot be run, or the computation was interrupted.
    pub fn tally(
        &self,
        values: &[f64],
        seed: u64,
        trials: u64,
        watch: &dyn Watch,
    ) -> Result<Option<Tally>, Halt<FileError>> {
        let mut document = self.document.clone();
        document.set_value("seed", seed_value(seed), Origin::CommandLine)?;
        let Ok(plan) = self.plan_of(document, values) else { return Ok(None) };
        Ok(Some(Tally::of(self.limits, self.part(&plan, values, seed, 0..trials, watch)?)))
    }

    /// Returns the contributions of these trials to the measures. If an interrupted computation has stored them, they are read, else the
    /// trials are run.
    fn part(
        &self,
        plan: &Plan,
        values: &[f64],
        seed: u64,
        trials: Range<u64>,
        watch: &dyn Watch,
    ) -> Result<Vec<Vec<f64>>, Halt<FileError>> {
        let key = self.key(values, seed, &trials);
        let count = trials.end - trials.start;
        kept(watch, &key, |_| count, || self.values(plan, trials, watch))
    }

    /// Returns the key under which the contributions of these trials are stored.
    fn key(&self, values: &[f64], seed: u64, trials: &Range<u64>) -> String {
        let settings = self.keys.iter().zip(values).map(|((key, _), value)| format!("{key}={value:?}"));
        let settings: Vec<String> = settings.collect();
        let measures: Vec<String> = self.limits.0.iter().map(|limit| limit.measure.to_string()).collect();
        format!("trials {trials:?} of seed {seed} with [{}]: {}", settings.join(", "), measures.join(", "))
    }

    /// Runs trials and returns their contributions to the measures: for each limit, one number per trial.
    fn values(
        &self,
        plan: &Plan,
        trials: Range<u64>,
        watch: &dyn Watch,
    ) -> Result<Vec<Vec<f64>>, Halt<FileError>> {
        // Small blocks, so that even few trials keep several threads busy.
        let at_once = (trials.end - trials.start).div_ceil(4).clamp(LEAST_AT_ONCE, AT_ONCE);
        let parts = in_blocks((plan, None), trials, at_once, watch, |records, _| records)?;
        let mut tally = Tally::new(self.limits);
        for record in parts.iter().flatten() {
            tally.add(record);
        }
        Ok(tally.into_values())
    }

    /// Returns the nominal value, in SI, of the key with this index. It is the value in the scenario, or else the default value of the
    /// error set or of the motor. None if none of them gives a value.
    pub fn nominal(&self, number: usize) -> Option<f64> {
        let key = &self.keys[number].0;
        let value = match self.document.get(key) {
            Some(Value::Float(value)) => Some(*value),
            #[allow(clippy::cast_precision_loss, reason = "settings are small")]
            Some(Value::Integer(value)) => Some(*value as f64),
            Some(Value::String(text)) => si_value(text),
            _ => None,
        };
        // If the scenario does not set the key: the number that the error set gives or that suits the motor.
        let resolved = || Plan::new(self.document.clone()).ok()?.scenario(0).ok()?.value(key)?.as_float();
        value.or_else(|| resolved().filter(|value| *value > 0.0))
    }
}

fn number(value: f64, whole: bool) -> Value {
    if whole {
        // The setting is a count.
        #[allow(clippy::cast_possible_truncation)]
        let value = value.round() as i64;
        Value::Integer(value)
    } else {
        Value::Float(value)
    }
}

/// Replaces the message of an error if the key of the error does not take numbers.
fn no_number(error: FileError) -> FileError {
    let FileError::Key { place, key, message } = error else { return error };
    let message = if standstill_scenario::has_numbers(&key) == Some(false) {
        "its values are no numbers; needed a key whose values are, such as `sensors.noise`, `detector.pulse` or `motor.winding.resistance`".to_owned()
    } else {
        message
    };
    FileError::Key { place, key, message }
}

/// Returns true if a key accepts whole numbers only.
fn is_whole(document: &Document, key: &str) -> Result<bool, FileError> {
    let accepts = |value: Value| {
        let mut document = document.clone();
        document.set_value(key, value, Origin::CommandLine)?;
        document.load().map(|_| ())
    };
    if let Some(range) = standstill_scenario::key(key).and_then(|key| key.range) {
        return Ok(range.whole);
    }
    // A key without numbers refuses both values; the second error says why.
    match accepts(Value::Float(4.5)) {
        Ok(()) => Ok(false),
        Err(_) => accepts(Value::Integer(4)).map(|()| true).or_else(|error| {
            // A number that is out of the key's range is a number.
            if accepts(Value::Float(1e-6)).is_ok() { Ok(false) } else { Err(no_number(error)) }
        }),
    }
}
