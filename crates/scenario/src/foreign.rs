//! A detector from a shared library: the keys `detector.library` and `detector.config`.

use std::fmt::Write as _;
use std::sync::Arc;
use std::time::Duration;

use standstill_detect::Nameplate;
use standstill_foreign::{Foreign, Level, Library, Maker, Scale, Watched};
use standstill_interface::{Detector, Nanos, Outcome, Reading, Step};
use standstill_plant::Files;
use standstill_sim::{Adc, Event, Own, SensorSettings, Trace};
use toml::Value;

use super::document::FileError;
use super::keys::{DetectorTable, check};
use crate::DriveSettings;

/// The detector of a trial. The scenario's method, a user's library or the running program provides the detector.
// The size of the variants does not matter: one detector is made per trial.
#[allow(clippy::large_enum_variant)]
pub enum Made<D> {
    /// Detector of the scenario's method.
    Own(Box<D>),
    /// Detector of the scenario's library.
    Foreign(Foreign),
    /// Detector of the running program.
    Hosted(Box<dyn Detector<f64>>),
}

impl<D> Made<D> {
    /// Turns on the recording of channels and log if the detector belongs to a library. Other detectors are not changed.
    pub(crate) fn watch(&mut self) {
        if let Self::Foreign(detector) = self {
            detector.watch();
        }
    }

    /// Ends the detector and returns the channels and the log that the detector recorded. The times come from the commands in `trace`.
    /// `end` is the end of the run in s.
    pub(crate) fn shown(&mut self, trace: &Trace, end: f64) -> Own {
        let Self::Foreign(detector) = self else { return Own::default() };
        // The detector is called when a command has ended, which is when the next command begins.
        let is_command = |(time, event): &(f64, Event)| matches!(event, Event::Command).then_some(*time);
        let commands: Vec<f64> = trace.events.iter().filter_map(is_command).collect();
        let Watched { names, rows, log } = detector.watched();
        let time = |call: u64, time: Option<Nanos>| match time {
            Some(time) => time.seconds(),
            None if call == 0 => 0.0,
            None => {
                let begun = usize::try_from(call - 1).ok().and_then(|call| commands.get(call));
                begun.copied().unwrap_or(end)
            }
        };
        Own {
            names,
            rows: rows.into_iter().map(|row| (time(row.call, row.time), row.what)).collect(),
            log: log.into_iter().map(|line| (time(line.call, line.time), line.what)).collect(),
        }
    }
}

impl<D: Detector<f64>> Detector<f64> for Made<D> {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        match self {
            Self::Own(detector) => detector.step(readings),
            Self::Foreign(detector) => detector.step(readings),
            Self::Hosted(detector) => detector.step(readings),
        }
    }

    fn overdue(&mut self, limit: Nanos) -> Option<Outcome<f64>> {
        match self {
            Self::Own(detector) => detector.overdue(limit),
            Self::Foreign(detector) => detector.overdue(limit),
            Self::Hosted(detector) => detector.overdue(limit),
        }
    }
}

impl DetectorTable {
    /// Loads and checks the library that `detector.library` names; none if the key is not set.
    pub(super) fn load_library(&self, files: &Files) -> Result<Option<Arc<Library>>, FileError> {
        const KEY: &str = "detector.library";
        let Some(library) = &self.library else {
            return match self.config().next().filter(|_| self.python.is_none()) {
                Some((key, _)) => Err(FileError::key(
                    &format!("detector.config.{key}"),
                    "a setting of a library",
                    "`detector.library` beside it",
                )),
                None => Ok(None),
            };
        };
        if let Some(key) = self.foreign_to_library() {
            let key = format!("detector.{key}");
            return Err(FileError::key(&key, "a method's, beside `detector.library`", "one of both"));
        }
        let path = files.folder().join(library);
        let found = |what: &dyn std::fmt::Display| format!("\"{library}\", {what}");
        let bytes = files.read(&path).map_err(|error| {
            let needed = "a shared library that exports sts_entry, see standstill.h";
            FileError::key(KEY, &found(&format!("which cannot be read: {error}")), needed)
        })?;
        let loaded = Library::of(&path, &bytes, &|path| files.read(path));
        loaded.map(Some).map_err(|error| FileError::key(KEY, &found(&error.found), &error.needed))
    }

    /// Returns the longest real time that one call of the library may take.
    ///
    /// # Errors
    /// The time is outside the key's range.
    pub fn call_limit(&self) -> Result<Duration, FileError> {
        let Some(limit) = self.call_timeout else { return Ok(Duration::from_secs(1)) };
        check("detector.call_timeout", &limit)?;
        Ok(Duration::from_secs_f64(limit.value()))
    }

    /// Sets the drive's carrier period to that of a library whose code runs in the PWM interrupt.
    ///
    /// # Errors
    /// The scenario sets another carrier frequency.
    pub(super) fn adopt_pwm(
        library: &Library,
        drive: &mut DriveSettings,
        carrier_is_set: bool,
    ) -> Result<(), FileError> {
        let Level::Interrupt(timing) = library.description.level else { return Ok(()) };
        let period = Nanos::from_seconds(1.0 / f64::from(timing.pwm_hz));
        if carrier_is_set && period != drive.carrier_period {
            let own = 1e9 / drive.carrier_period.0 as f64;
            let found = format!("a library whose interrupt runs in a PWM of {} Hz", timing.pwm_hz);
            let needed = format!("that of `inverter.carrier`, {own:.0} Hz, or no such key");
            return Err(FileError::key("detector.library", &found, &needed));
        }
        drive.carrier_period = period;
        Ok(())
    }

    /// Returns the factory that makes one detector of the library for each trial. `knows` is the nameplate that the detector receives.
    ///
    /// # Errors
    /// A setting in `detector.config` cannot be written as a line KEY=VALUE.
    pub(super) fn maker(
        &self,
        library: Arc<Library>,
        knows: &Nameplate<f64>,
        sensors: &SensorSettings,
    ) -> Result<Maker, FileError> {
        // The code of a reading is the sum of the codes of a sample's conversions.
        let conversions = f64::from(sensors.oversampling.max(1));
        let scale =
            |adc: Adc| Scale { bits: adc.bits, per_count: adc.step() / conversions, at_zero: adc.low };
        let mut lines = String::new();
        for (key, value) in self.config() {
            let text = match value {
                Value::String(text) => text.clone(),
                Value::Integer(_) | Value::Float(_) | Value::Boolean(_) => value.to_string(),
                other => return Err(not_a_line(key, other.type_str())),
            };
            if text.contains(['\n', '\0']) || key.contains(['=', '\n', '\0']) {
                return Err(not_a_line(key, "several lines, or a key with `=`"));
            }
            let _ = writeln!(lines, "{key}={text}");
        }
        // A converter that does not round has no counts.
        let terminal = sensors.terminal.and_then(|dividers| dividers.adc);
        let converters =
            [sensors.adc, sensors.dc_link.adc, terminal].map(|adc| adc.filter(|adc| adc.rounds()).map(scale));
        Ok(Maker::new(library, knows, converters, &lines))
    }
}

fn not_a_line(key: &str, found: &str) -> FileError {
    let needed = "a text, a number, true or false: it is handed over as a line KEY=VALUE";
    FileError::key(&format!("detector.config.{key}"), found, needed)
}
