//! What a part must do: the largest or smallest value of a key with which limits hold.

mod needed;

use rayon::prelude::*;
use standstill_campaign::Estimate;
use standstill_detect::{Kind, keys};
use standstill_quantity::si_value;
use standstill_scenario::{Document, FileError, Origin, Plan, Record, seed_value};
use toml::Value;

pub use self::needed::{Seen, trials_needed};
use crate::bracket::Verdict;
use crate::limit::{Limits, Tally};
use crate::system::kept;
use crate::{Halt, Watch};

/// A scenario whose key is to be judged. All values have the same random numbers: those of the scenario's seed.
#[derive(Debug)]
pub struct Bench<'a> {
    /// The scenario.
    pub document: &'a Document,
    /// The limits.
    pub limits: &'a Limits,
    /// Whether the keys' values are whole numbers, key by key.
    pub keys: Vec<(String, bool)>,
}

/// What trials of a value show.
#[derive(Clone, Debug, PartialEq)]
pub struct Judgement {
    /// The measures, limit by limit.
    pub measures: Vec<Estimate>,
    /// Whether the limits hold.
    pub verdict: Verdict,
    /// The share of starts without an answer, where the root mean square is limited.
    pub without_answer: Option<Estimate>,
}

/// Trials that a thread runs at a time.
const AT_ONCE: u64 = 256;

impl<'a> Bench<'a> {
    /// Of keys whose values are numbers.
    ///
    /// # Errors
    /// A key that does not exist, or has no numbers.
    pub fn new(document: &'a Document, limits: &'a Limits, keys: &[String]) -> Result<Self, FileError> {
        let mut bench = Self { document, limits, keys: Vec::new() };
        for key in keys {
            // A value that cannot be is told when it is tried; a key that does not exist, now.
            let whole = is_whole(document, key)?;
            bench.keys.push((key.clone(), whole));
        }
        Ok(bench)
    }

    /// The plan with these values.
    ///
    /// # Errors
    /// A value that cannot be.
    pub fn plan(&self, values: &[f64]) -> Result<Plan, FileError> {
        self.plan_of(self.document.clone(), values)
    }

    fn plan_of(&self, mut document: Document, values: &[f64]) -> Result<Plan, FileError> {
        for ((key, whole), value) in self.keys.iter().zip(values) {
            document.set_value(key, number(*value, *whole), Origin::CommandLine)?;
        }
        Plan::new(document)
    }

    /// What trials with these values show. None where the values cannot be.
    ///
    /// # Errors
    /// A trial that cannot be run; that it was stopped.
    pub fn judge(
        &self,
        values: &[f64],
        trials: u64,
        watch: &dyn Watch,
    ) -> Result<Option<Judgement>, Halt<FileError>> {
        let tally = self.tally(values, self.document.load()?.seed, trials, watch)?;
        Ok(tally.map(|tally| Judgement {
            measures: tally.estimates(),
            verdict: tally.verdict(),
            without_answer: tally.without_answer(),
        }))
    }

    /// What the first trials of a seed contribute with these values. None where the values cannot be.
    ///
    /// # Errors
    /// A trial that cannot be run; that it was stopped.
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
        let key = self.key(values, seed, trials);
        let values = kept(watch, &key, |_| trials, || self.values(&plan, trials, watch))?;
        Ok(Some(Tally::of(self.limits, values)))
    }

    /// What a tally depends on but for the scenario.
    fn key(&self, values: &[f64], seed: u64, trials: u64) -> String {
        let settings = self.keys.iter().zip(values).map(|((key, _), value)| format!("{key}={value:?}"));
        let settings: Vec<String> = settings.collect();
        let measures: Vec<String> = self.limits.0.iter().map(|limit| limit.measure.to_string()).collect();
        format!("{trials} trials of seed {seed} with [{}]: {}", settings.join(", "), measures.join(", "))
    }

    /// What each start contributes to each limit.
    fn values(&self, plan: &Plan, trials: u64, watch: &dyn Watch) -> Result<Vec<Vec<f64>>, Halt<FileError>> {
        let scenario = plan.scenario(0)?;
        let mut tally = Tally::new(self.limits);
        let parts = (0..trials.div_ceil(AT_ONCE)).into_par_iter().map(|part| {
            if watch.stopped() {
                return Err(Halt::Stopped);
            }
            let mut numbers = part * AT_ONCE..trials.min((part + 1) * AT_ONCE);
            let mut records: Vec<Record> = Vec::new();
            plan.trials(0, &scenario, &mut numbers, &mut |record| records.push(record))
                .map_err(|error| Halt::Failed(error.error))?;
            records.sort_by_key(|record| record.trial);
            watch.did(records.len() as u64);
            Ok(records)
        });
        for records in parts.collect::<Result<Vec<_>, _>>()? {
            for record in &records {
                tally.add(record);
            }
        }
        Ok(tally.into_values())
    }

    /// The value of a key in the scenario, in SI; none where it says nothing of it.
    pub fn nominal(&self, number: usize) -> Option<f64> {
        let key = &self.keys[number].0;
        let value = match self.document.get(key) {
            Some(Value::Float(value)) => Some(*value),
            #[allow(clippy::cast_precision_loss, reason = "settings are small")]
            Some(Value::Integer(value)) => Some(*value as f64),
            Some(Value::String(text)) => si_value(text),
            _ => None,
        };
        value.or_else(|| self.resolved(key))
    }

    /// What the error set, or what suits the motor, makes of it.
    fn resolved(&self, key: &str) -> Option<f64> {
        let plan = Plan::new(self.document.clone()).ok()?;
        let scenario = plan.scenario(0).ok()?;
        let (sensors, drive) = (&scenario.sensors, &scenario.drive);
        let devices = drive.bridge.devices;
        if let Some(name) = key.strip_prefix("detector.") {
            let setting = keys::ALL.iter().find(|setting| setting.name == name)?;
            return scenario.detector.get(setting).map(standstill_detect::Value::number);
        }
        Some(match key {
            "sensors.noise" => sensors.noise,
            "sensors.gain_error" => sensors.gain_error,
            "sensors.offset" => sensors.offset,
            "sensors.jitter" => sensors.jitter.seconds(),
            "sensors.sample_delay" => sensors.sample_delay.seconds(),
            "sensors.bits" => f64::from(sensors.adc?.bits),
            "sensors.range" => sensors.adc?.high,
            "sensors.dc_link_gain_error" => sensors.dc_link.gain_error,
            "sensors.dc_link_offset" => sensors.dc_link.offset,
            "sensors.dc_link_noise" => sensors.dc_link.noise,
            "inverter.dc_link" => drive.link.voltage,
            "inverter.ripple" => drive.link.ripple,
            "inverter.dead_time" => drive.dead_time.seconds(),
            "inverter.delay_mismatch" => drive.delay_mismatch,
            "inverter.switch_drop" => devices.switch_drop,
            "inverter.switch_resistance" => devices.switch_resistance,
            "inverter.diode_drop" => devices.diode_drop,
            "inverter.diode_resistance" => devices.diode_resistance,
            _ => return None,
        })
        .filter(|value| *value > 0.0)
    }
}

fn number(value: f64, whole: bool) -> Value {
    if whole {
        // Settings that are counts.
        #[allow(clippy::cast_possible_truncation)]
        let value = value.round() as i64;
        Value::Integer(value)
    } else {
        Value::Float(value)
    }
}

/// The error of a key that takes no number of those tried.
fn no_number(error: FileError) -> FileError {
    let FileError::Key { place, key, message } = error else { return error };
    let message = if standstill_scenario::has_numbers(&key) == Some(false) {
        "its values are no numbers; needed a key whose values are, such as `sensors.noise`, `detector.pulse` or `motor.winding.resistance`".to_owned()
    } else {
        message
    };
    FileError::Key { place, key, message }
}

/// Whether a key takes whole numbers alone.
fn is_whole(document: &Document, key: &str) -> Result<bool, FileError> {
    let accepts = |value: Value| {
        let mut document = document.clone();
        document.set_value(key, value, Origin::CommandLine)?;
        document.load().map(|_| ())
    };
    // Which settings of methods are whole numbers, their descriptions say.
    let setting =
        key.strip_prefix("detector.").and_then(|name| keys::ALL.iter().find(|key| key.name == name));
    if let Some(Kind::Number { whole, .. }) = setting.map(|setting| setting.kind) {
        return Ok(whole);
    }
    // What is no number of the key's fails both ways, and the second says why.
    match accepts(Value::Float(4.5)) {
        Ok(()) => Ok(["sensors.bits", "sensors.dc_link_bits"].contains(&key)),
        Err(_) => accepts(Value::Integer(4)).map(|()| true).or_else(|error| {
            // A number that is out of the key's range is a number.
            if accepts(Value::Float(1e-6)).is_ok() { Ok(false) } else { Err(no_number(error)) }
        }),
    }
}
