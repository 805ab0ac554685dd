//! Trials of a scenario as functions of their draws.

use std::sync::atomic::{AtomicU64, Ordering};

use standstill_campaign::in_parallel;
use standstill_detect::Method;
use standstill_scenario::{FileError, Plan, Record, Scenario, Verdict};
use standstill_sim::{Adc, Arrangement, Tape};

use crate::subset::{Run, Settings};
use crate::{Alarm, Estimator, Event, Halt, Odds, System, Watch};

/// Trials of a scenario at one point of its plan. Values of keys with a tolerance are drawn at random for each trial.
#[derive(Clone, Debug)]
pub struct Trials<'a> {
    plan: &'a Plan,
    point: usize,
    scenario: Scenario<Method<f64>>,
    codes: Codes,
}

/// Quantization of all A/D converters in a trial.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Codes {
    /// The thresholds between the codes are shifted up by this share of one LSB, relative to the scenario.
    Moved(f64),
    /// Readings are not rounded. They are exact up to the ends of the converter's range.
    Exact,
}

impl Codes {
    fn set(self, scenario: &mut Scenario<Method<f64>>) {
        let sensors = &mut scenario.sensors;
        let terminal = sensors.terminal.as_mut().map(|of| &mut of.adc);
        for adc in [&mut sensors.adc, &mut sensors.dc_link.adc].into_iter().chain(terminal) {
            match (self, adc.as_mut()) {
                (Self::Exact, Some(adc)) => adc.bits = 0,
                (Self::Moved(share), Some(adc)) => {
                    let by = share * adc.step();
                    (adc.low, adc.high) = (adc.low + by, adc.high + by);
                }
                (_, None) => {}
            }
        }
    }
}

impl<'a> Trials<'a> {
    /// Returns the trials of a plan's first point.
    ///
    /// # Errors
    /// The values at this point make no valid scenario.
    pub fn new(plan: &'a Plan) -> Result<Self, FileError> {
        Self::at(plan, 0)
    }

    /// Returns the trials of one point of a plan.
    ///
    /// # Errors
    /// The values at this point make no valid scenario.
    ///
    /// # Panics
    /// If the plan has no such point.
    pub fn at(plan: &'a Plan, point: usize) -> Result<Self, FileError> {
        Ok(Self { plan, point, scenario: plan.scenario(point)?, codes: Codes::Moved(0.0) })
    }

    /// Returns a copy of these trials that differs only in the quantization of the converters.
    pub(crate) fn with_codes(&self, codes: Codes) -> Self {
        Self { codes, ..self.clone() }
    }

    /// Returns the A/D converters of the currents, of the terminal voltages and of the DC-link voltage. None for a quantity that the drive
    /// does not measure with a converter.
    pub(crate) fn converters(&self) -> [Option<Adc>; 3] {
        let sensors = &self.scenario.sensors;
        let currents = sensors.adc.filter(|_| sensors.arrangement != Arrangement::None);
        [currents, sensors.terminal.and_then(|of| of.adc), sensors.dc_link.adc]
    }

    /// Returns true if a converter of the drive rounds its readings.
    pub(crate) fn have_converters(&self) -> bool {
        self.converters().into_iter().flatten().any(Adc::rounds)
    }

    /// Returns the scenario before the random values of a trial are drawn. It is the same for all trials.
    pub fn scenario(&self) -> &Scenario<Method<f64>> {
        &self.scenario
    }

    /// Returns the plan to which the trials belong.
    pub fn plan(&self) -> &Plan {
        self.plan
    }

    /// Runs one trial for each tape of random draws in this thread. Returns the records in the order of the tapes.
    ///
    /// # Errors
    /// A drawn value is invalid.
    pub fn records(&self, tapes: &[Tape]) -> Result<Vec<Record>, FileError> {
        let mut records: Vec<Option<Record>> = vec![None; tapes.len()];
        let set = |scenario: &mut Scenario<Method<f64>>| self.codes.set(scenario);
        self.plan.trials_taped(self.point, &self.scenario, tapes, &set, &mut |place, record| {
            records[place] = Some(record);
        })?;
        Ok(records.into_iter().flatten().collect())
    }

    /// Runs one trial for each tape of random draws, in all threads. Returns the records in the order of the tapes.
    ///
    /// # Errors
    /// A drawn value is invalid, or the computation was interrupted.
    pub fn all_records(&self, tapes: Vec<Tape>, watch: &dyn Watch) -> Result<Vec<Record>, Halt<FileError>> {
        Ok(self.all_with_tapes(tapes, watch)?.0)
    }

    /// Runs one trial for each tape of random draws, in all threads. Returns the records and the tapes in the order of the tapes. The
    /// trials have added to each tape the draws that it lacked.
    ///
    /// # Errors
    /// A drawn value is invalid, or the computation was interrupted.
    pub fn all_with_tapes(
        &self,
        tapes: Vec<Tape>,
        watch: &dyn Watch,
    ) -> Result<(Vec<Record>, Vec<Tape>), Halt<FileError>> {
        let mut parts: Vec<Vec<Tape>> = Vec::new();
        for tape in tapes {
            match parts.last_mut() {
                Some(part) if part.len() < AT_ONCE => part.push(tape),
                _ => parts.push(vec![tape]),
            }
        }
        let parts = in_parallel(parts, &|part| {
            if watch.stopped() {
                return Err(Halt::Stopped);
            }
            let records = self.records(&part)?;
            watch.did(records.len() as u64);
            Ok((records, part))
        })?;
        let (records, tapes): (Vec<_>, Vec<_>) = parts.into_iter().unzip();
        Ok((records.into_iter().flatten().collect(), tapes.into_iter().flatten().collect()))
    }

    /// Returns a function that computes the order parameter of an event from the random draws. Subset simulation uses it.
    pub fn towards(&self, event: Event) -> Towards<'_> {
        Towards { trials: self, event, errors: AtomicU64::new(0) }
    }

    /// Computes the probability of an event by subset simulation, or by counting if no order parameter leads to the event. `done` is called
    /// with each finished run.
    ///
    /// # Errors
    /// A drawn value is invalid, or the computation was interrupted.
    pub fn odds(
        &self,
        event: Event,
        settings: &Settings,
        watch: &dyn Watch,
        done: impl FnMut(&Run),
    ) -> Result<Odds, Halt<FileError>> {
        /// Axis error in degrees above which the found axis is nearer to the perpendicular axis than to the true one.
        const LOST: f64 = 45.0;
        let towards = self.towards(event);
        let mut odds = Odds::of_event(&towards, &event.to_string(), settings, watch, done)?;
        let lost = |record: &Record| record.axis_error_deg().is_some_and(|error| error.abs() > LOST);
        let unled = |record: &Record| record.findings().fault_margin.is_none_or(|margin| margin >= 0.0);
        let (share, aside): (_, fn(f64) -> Alarm) = match (event, odds.estimator) {
            (Event::WrongPole, _) => (self.share(&odds, lost, watch)?, Alarm::WrongAxes),
            (Event::Failed, Estimator::Subset | Estimator::Mixture { .. }) => {
                (self.share(&odds, unled, watch)?, Alarm::Unled)
            }
            _ => {
                odds.doubt();
                return Ok(odds);
            }
        };
        odds.tell(share, aside);
        odds.doubt();
        Ok(odds)
    }

    /// Returns the share of the event's probability that belongs to starts whose records are of the kind `kind`.
    fn share(
        &self,
        odds: &Odds,
        kind: impl Fn(&Record) -> bool,
        watch: &dyn Watch,
    ) -> Result<f64, Halt<FileError>> {
        let tapes = odds.failures.iter().map(|(_, tape)| tape.clone()).collect();
        let records = self.all_records(tapes, watch)?;
        let of_kind = odds.failures.iter().zip(&records).filter(|(_, record)| kind(record));
        Ok(of_kind.map(|((weight, _), _)| weight).sum())
    }
}

/// Number of tapes that a thread runs at a time.
const AT_ONCE: usize = 128;

/// Function that computes the order parameter of an event from the random draws.
#[derive(Debug)]
pub struct Towards<'a> {
    trials: &'a Trials<'a>,
    event: Event,
    /// Number of simulations that could not be continued.
    errors: AtomicU64,
}

impl System for Towards<'_> {
    type Error = FileError;

    fn values(&self, tapes: &[Tape]) -> Result<Vec<f64>, FileError> {
        let records = self.trials.records(tapes)?;
        let errors = records.iter().filter(|record| record.verdict() == Verdict::Error).count();
        self.errors.fetch_add(errors as u64, Ordering::Relaxed);
        Ok(records.iter().map(|record| self.event.value(record)).collect())
    }

    fn lost(&self) -> u64 {
        self.errors.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use standstill_scenario::Document;

    use super::*;

    #[test]
    fn regress_what_is_not_rounded_still_has_its_range() {
        // Pulses of some 8 A: readings beyond the range are clipped, whether the converter rounds or not.
        let found = |range: &str, codes: Codes| {
            let text = format!(
                "errors = \"none\"\ndetector.method = \"bipolar\"\nsensors.bits = 12\nsensors.range = \"{range}\"\n"
            );
            let document = Document::parse(Path::new("test.toml"), &text).expect("TOML");
            let plan = Plan::new(document).expect("a plan");
            let trials = Trials::new(&plan).expect("a scenario").with_codes(codes);
            trials.records(&[Tape::new(1, 0)]).expect("runs")[0].verdict() == Verdict::Found
        };
        for codes in [Codes::Moved(0.0), Codes::Exact] {
            assert!(found("20 A", codes) && !found("3 A", codes), "{codes:?}");
        }
    }
}
