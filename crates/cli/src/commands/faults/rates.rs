//! Failure rates of the failure modes, read from a file. The rates are the weights with which outcomes are summed.

use std::path::Path;

use standstill_interface::Choice as _;
use standstill_scenario::{Document, FaultMode};
use toml::Value;

use super::row::Row;
use crate::error::Error;

/// Rates of failure modes, all in the same unit, such as failures in 10⁹ h.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rates(Vec<(FaultMode, f64)>);

/// Failure rates for one method, summed over the modes.
#[derive(Clone, Debug, PartialEq)]
pub struct Weighted {
    pub method: String,
    /// Sum of the rates of the modes that were studied.
    pub total: f64,
    /// Part of `total` that leads to wrong poles. The first number is the estimate, the second is the sum of the 95 % upper bounds of all
    /// modes.
    pub wrong_pole: [f64; 2],
    /// Part of `total` that leads to an angle error beyond the limit.
    pub beyond: f64,
    /// Part of `total` that leads to no answer.
    pub detected: f64,
}

impl Rates {
    /// Reads a TOML file with lines `mode = rate`. Fails if a mode is unknown, if a rate is negative or not a number, or if no rate is
    /// above zero.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = standstill_files::read_text(path).map_err(|error| Error::Read(path.to_owned(), error))?;
        let document = Document::parse(path, &text)?;
        // Cannot fail: `Document::parse` has just read the text as TOML.
        let table: toml::Table = text.parse().unwrap_or_default();
        let rate = |(name, value): (&String, &Value)| {
            let Some(mode) = FaultMode::named(name) else {
                let needed = format!("a failure mode: {}", FaultMode::NAMES.join(", "));
                return Err(document.refuse(name, "no failure mode of that name", &needed).into());
            };
            let number = value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64));
            let rate = number.filter(|rate| rate.is_finite() && *rate >= 0.0);
            let needed = "a failure rate: a number, zero or more, in the same unit for all modes";
            rate.map(|rate| (mode, rate))
                .ok_or_else(|| document.refuse(name, &value.to_string(), needed).into())
        };
        let rates: Vec<_> = table.iter().map(rate).collect::<Result<_, Error>>()?;
        if rates.iter().all(|(_, rate)| *rate == 0.0) {
            let needed = "at least one failure mode with a rate above zero, such as `phase-open = 20`";
            return Err(document.refuse("phase-open", "no rates", needed).into());
        }
        Ok(Self(rates))
    }

    /// Returns the rate of a failure mode. None if `mode` is none or the file has no rate for it.
    pub fn of(&self, mode: Option<FaultMode>) -> Option<f64> {
        self.0.iter().find(|(of, _)| Some(*of) == mode).map(|(_, rate)| *rate)
    }

    /// Sums the outcomes of each method's rows, weighted by the rates. Only rows with a single fault that exists before the detection
    /// count, so that each rate counts once.
    pub fn weighted(&self, rows: &[Row]) -> Vec<Weighted> {
        let mut all: Vec<Weighted> = Vec::new();
        for row in rows {
            let Some(rate) = self.of(row.entry.weighed()) else { continue };
            let place = all.iter().position(|of| of.method == row.method).unwrap_or_else(|| {
                let method = row.method.clone();
                all.push(Weighted { method, total: 0.0, wrong_pole: [0.0; 2], beyond: 0.0, detected: 0.0 });
                all.len() - 1
            });
            let (sum, of) = (&mut all[place], &row.counts);
            let share = |count: u64| rate * count as f64 / of.trials as f64;
            sum.total += rate;
            sum.wrong_pole[0] += share(of.wrong_pole);
            sum.wrong_pole[1] += rate * of.wrong_pole_bound();
            sum.beyond += share(of.beyond);
            sum.detected += share(of.detected());
        }
        all
    }

    /// Returns two lists of mode names: modes with a rate but without a row, and modes with a row but without a rate.
    pub fn missing(&self, rows: &[Row]) -> [Vec<&'static str>; 2] {
        let studied = |mode: FaultMode| rows.iter().any(|row| row.entry.single() == Some(mode));
        let unstudied = self.0.iter().filter(|(mode, _)| !studied(*mode)).map(|(mode, _)| mode.name());
        let without =
            FaultMode::ALL.into_iter().filter(|mode| studied(*mode) && self.of(Some(*mode)).is_none());
        [unstudied.collect(), without.map(FaultMode::name).collect()]
    }
}

impl Weighted {
    /// Returns a sentence with the sums.
    pub fn said(&self) -> String {
        let [wrong, most] = self.wrong_pole.map(rounded);
        let [total, beyond, detected] = [self.total, self.beyond, self.detected].map(rounded);
        format!(
            "weighted, {}: of {total}, {wrong} lead to a wrong pole (at most {most}, the sum of the 95 % bounds), {beyond} to an angle beyond the limit, {detected} to no answer",
            self.method
        )
    }
}

/// Formats a sum of rates in three significant digits: rates are seldom known better.
fn rounded(rate: f64) -> String {
    standstill_quantity::short(standstill_quantity::significant(rate, 3))
}
