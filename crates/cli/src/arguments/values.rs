//! Parsers of the values of options, and options that several commands share.

use std::ffi::OsStr;
use std::ops::RangeInclusive;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::error::ErrorKind;
use clap::{Arg, Args, Command};
use standstill_analysis::paper::Paper;
use standstill_interface::Choice;
use standstill_plant::MapValues;
use standstill_quantity::count;
use standstill_scenario::FaultMode;

/// Folder of all default output folders.
pub const FOLDERS: &str = "standstill-out";

/// Placeholder for the default output folder. The folder is named after the scenario file or the motor, and after the command.
pub const OUT: &str = "standstill-out/SCENARIO-COMMAND";

/// Whether existing results may be replaced.
#[derive(Clone, Copy, Debug, Args)]
pub struct Force {
    /// Replace the results of another run in that folder. Without it they stay: the default folder gets a number, and a folder of --out is refused
    #[arg(long)]
    pub force: bool,
}

pub fn map_values(text: &str) -> Result<MapValues, String> {
    MapValues::named(text).ok_or_else(|| format!("not one of {}", MapValues::NAMES.join(", ")))
}

/// Parses an angle in degrees. It must be between −360° and 360°, because a larger angle is probably a mistake.
pub fn degrees(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(angle) if angle.abs() <= 360.0 => Ok(angle.rem_euclid(360.0)),
        _ => Err("needed a number of degrees from -360 to 360".to_owned()),
    }
}

/// Largest number of trials for which a run keeps rows, on disk or in memory.
pub const MOST_ROWS: u64 = 100_000_000;

/// Parses a whole number in a range. The error message names the upper limit unless this is `u64::MAX`.
pub fn whole<T: TryFrom<u64> + Clone + Send + Sync + 'static>(
    range: RangeInclusive<u64>,
) -> impl TypedValueParser<Value = T> {
    move |text: &str| {
        let number = text.trim().parse().ok().filter(|number| range.contains(number));
        number.and_then(|number| T::try_from(number).ok()).ok_or_else(|| match (range.start(), range.end()) {
            (low, &u64::MAX) => format!("needed a whole number from {}", count(*low)),
            (low, high) => format!("needed a whole number from {} to {}", count(*low), count(*high)),
        })
    }
}

/// Parses the name of a paper.
pub fn papers() -> PossibleValuesParser {
    PossibleValuesParser::new(Paper::ALL.map(|paper| paper.name))
}

/// Parses the name of a choice's value.
pub fn choice<T: Choice>() -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(T::NAMES).try_map(|name| T::named(&name).ok_or("no such choice"))
}

/// Parses the name of a failure mode. If the mode is not simulated, refuses it and states the reason.
#[derive(Clone)]
pub struct Mode;

impl TypedValueParser for Mode {
    type Value = FaultMode;

    fn parse_ref(
        &self,
        command: &Command,
        of: Option<&Arg>,
        value: &OsStr,
    ) -> Result<FaultMode, clap::Error> {
        match value.to_str().and_then(|name| Some((name, FaultMode::refused(name)?))) {
            Some((name, why)) => {
                let option = of.map_or_else(String::new, |of| format!("{of}: "));
                let message = format!("{option}{name} is not simulated: {why}\n");
                Err(clap::Error::raw(ErrorKind::ValueValidation, message).with_cmd(command))
            }
            None => choice::<FaultMode>().parse_ref(command, of, value),
        }
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        let all: Vec<PossibleValue> = choice::<FaultMode>().possible_values()?.collect();
        Some(Box::new(all.into_iter()))
    }
}

/// Parses the number of a trial, from 0 to 2⁶⁰ − 1. For larger numbers there is no stream of random numbers.
pub fn trial() -> impl TypedValueParser<Value = u64> {
    whole::<u64>(0..=(1 << 60) - 1)
}

pub fn seed(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| format!("needed a whole number from 0 to {}", u64::MAX))
}

/// Parses a number in a range.
fn number(range: RangeInclusive<f64>, wrong: &'static str) -> impl TypedValueParser<Value = f64> {
    move |text: &str| {
        let number = text.trim().parse().ok().filter(|number| range.contains(number));
        number.ok_or_else(|| wrong.to_owned())
    }
}

pub fn tolerance() -> impl TypedValueParser<Value = f64> {
    number(0.001..=90.0, "not a number of degrees from 0.001 to 90")
}

pub fn milliseconds() -> impl TypedValueParser<Value = f64> {
    number(0.1..=20_000.0, "not a number of milliseconds from 0.1 to 20,000")
}

pub fn amperes() -> impl TypedValueParser<Value = f64> {
    number(1e-6..=1e5, "not a number of amperes from 1e-6 to 100,000")
}

pub fn ohms() -> impl TypedValueParser<Value = f64> {
    number(1e-9..=1e6, "not a positive number of ohms, from 1e-9 to 1e6")
}

pub fn newton_metres() -> impl TypedValueParser<Value = f64> {
    number(-1e6..=1e6, "not a number of newton metres from -1000000 to 1000000")
}

pub fn celsius() -> impl TypedValueParser<Value = f64> {
    number(-60.0..=300.0, "not a temperature from -60 to 300 °C")
}
