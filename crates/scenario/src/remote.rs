//! Trials that another process runs: the interface to this process, and a record as a line of text.

use std::fmt::{self, Write as _};
use std::sync::Arc;

use standstill_detect::Method;
use standstill_foreign::kept;
use standstill_interface::{Angle, Fault, Findings, Nanos, Outcome, Own, PoleEvidence, Undetermined};
use standstill_sim::{Case, Ended, Run, RunError, Work};

use crate::{FileError, Plan, Record, Scenario, TrialError};

/// Runner of trials in another process.
pub trait Remote: fmt::Debug + Send + Sync {
    /// Runs a trial at a point, or returns the reason why there is no record.
    fn trial(&self, point: usize, trial: u64) -> Result<Record, Lost>;
}

/// Reason why there is no record of a trial.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Lost {
    /// The trial ended the process that ran it; with the reason.
    Trial(String),
    /// No process can run the detector; with the reason.
    All(String),
}

/// Fault code of a trial that was lost; a library's codes begin at 0.
const LOST: u32 = u32::MAX - 2;

impl Plan {
    /// Returns this plan with its trials run in other processes.
    #[must_use]
    pub fn with_remote(mut self, remote: Arc<dyn Remote>) -> Self {
        self.remote = Some(remote);
        self
    }

    /// Runs trials in another process, one after the other.
    pub(super) fn remote_trials(
        &self,
        remote: &dyn Remote,
        (point, scenario): (usize, &Scenario<Method<f64>>),
        trials: &mut dyn Iterator<Item = u64>,
        done: &mut dyn FnMut(Record),
    ) -> Result<(), TrialError<FileError>> {
        for trial in trials {
            let failed = |error| TrialError { trial, error };
            done(match remote.trial(point, trial) {
                Ok(record) => record,
                Err(Lost::Trial(reason)) => self.lost(point, scenario, trial, &reason).map_err(failed)?,
                Err(Lost::All(reason)) => {
                    let error = FileError::key("detector.library", &reason, "a worker process that runs it");
                    return Err(failed(self.document.locate(error)));
                }
            });
        }
        Ok(())
    }

    /// Makes the record of a trial that ended its process.
    fn lost(
        &self,
        point: usize,
        scenario: &Scenario<Method<f64>>,
        trial: u64,
        reason: &str,
    ) -> Result<Record, FileError> {
        let drawn =
            if self.has_tolerances() { Some(self.drawn(point, Some(scenario), trial)?) } else { None };
        let case: Case = drawn.as_ref().unwrap_or(scenario).case(trial);
        let fault = Fault::Own(Own { code: LOST, text: kept(reason) });
        let run = Run {
            ended: Ended::Outcome(Outcome::Failed { fault, findings: Findings::default() }),
            duration: Nanos::ZERO,
            start_angle: case.start_angle,
            end_angle: case.start_angle,
            has_pole: case.motor.has_magnet(),
            resolver_angle: case.start_angle + case.sensors.resolver_error,
            moved: 0.0,
            peak_current: 0.0,
            ledger: None,
            work: Work::default(),
        };
        Ok(Record { trial, run })
    }
}

impl Record {
    /// Writes a record of a library's trial as a line of text, each number by its bits. Findings that only built-in methods
    /// measure are left out.
    pub fn to_line(&self) -> String {
        let run = &self.run;
        let bits = [run.start_angle, run.end_angle, run.resolver_angle, run.moved, run.peak_current]
            .map(f64::to_bits);
        let work = [run.work.derivatives, run.work.steps, run.work.segments, run.work.events];
        let numbers = [&[self.trial, run.duration.0, run.has_pole.into()][..], &bits, &work].concat();
        let mut line = String::new();
        for number in numbers {
            let _ = write!(line, "{number:x} ");
        }
        let ended = match run.ended {
            Ended::Outcome(Outcome::Found { angle, findings }) => {
                format!("found {}", answered(Some(angle), &findings))
            }
            Ended::Outcome(Outcome::Axis { angle, reason, findings }) => {
                let own = match reason {
                    Undetermined::Own(own) => own,
                    other => Own { code: 0, text: kept(&other.to_string()) },
                };
                format!("axis {} {:x} {}", answered(Some(angle), &findings), own.code, own.text)
            }
            Ended::Outcome(Outcome::Failed { fault, findings }) => {
                let own = match fault {
                    Fault::Own(own) => own,
                    other => Own { code: 0, text: kept(&other.to_string()) },
                };
                format!("failed {} {:x} {}", answered(None, &findings), own.code, own.text)
            }
            Ended::Error(error) => match error {
                RunError::BadCommand => "error 0 0 0".to_owned(),
                RunError::BadDuty => "error 1 0 0".to_owned(),
                RunError::TimeLimit(limit) => format!("error 2 {} 0", limit.0),
                RunError::Chatter => "error 3 0 0".to_owned(),
                RunError::NotFinite => "error 4 0 0".to_owned(),
                RunError::Stuck => "error 6 0 0".to_owned(),
                RunError::NoComparator => "error 7 0 0".to_owned(),
                RunError::Overcurrent { current_ma } => format!("error 8 {current_ma} 0"),
                RunError::LeftMap { current_ma: [d, q] } => format!("error 5 {d} {q}"),
            },
        };
        line + &ended
    }

    /// Reads a record from such a line; none if the line is invalid.
    pub fn from_line(line: &str) -> Option<Self> {
        let mut words = line.splitn(13, ' ');
        let mut number = || u64::from_str_radix(words.next()?, 16).ok();
        let [trial, duration, has_pole] = [number()?, number()?, number()?];
        let mut real = || number().map(f64::from_bits);
        let [start_angle, end_angle, resolver_angle] = [real()?, real()?, real()?];
        let [moved, peak_current] = [real()?, real()?];
        let work = Work { derivatives: number()?, steps: number()?, segments: number()?, events: number()? };
        let run = Run {
            ended: ended(words.next()?)?,
            duration: Nanos(duration),
            start_angle,
            end_angle,
            has_pole: has_pole == 1,
            resolver_angle,
            moved,
            peak_current,
            ledger: None,
            work,
        };
        Some(Self { trial, run })
    }
}

/// Writes an angle with a library's findings as a line of text.
fn answered(angle: Option<Angle<f64>>, findings: &Findings<f64>) -> String {
    let evidence = findings.pole_evidence;
    let all = [
        angle.map(Angle::radians),
        findings.angle_deviation,
        evidence.map(|evidence| evidence.deviations),
        evidence.map(|evidence| evidence.needed),
    ];
    all.map(|value| value.map_or_else(|| "-".to_owned(), |value| format!("{:x}", value.to_bits()))).join(" ")
}

fn ended(text: &str) -> Option<Ended<f64>> {
    let (kind, rest) = text.split_once(' ')?;
    if kind == "error" {
        let mut words = rest.split(' ').map(str::parse::<i64>);
        let [kind, a, b] = [words.next()?.ok()?, words.next()?.ok()?, words.next()?.ok()?];
        return Some(Ended::Error(match kind {
            0 => RunError::BadCommand,
            1 => RunError::BadDuty,
            2 => RunError::TimeLimit(Nanos(a.unsigned_abs())),
            3 => RunError::Chatter,
            4 => RunError::NotFinite,
            6 => RunError::Stuck,
            7 => RunError::NoComparator,
            8 => RunError::Overcurrent { current_ma: a },
            5 => RunError::LeftMap { current_ma: [a, b] },
            _ => return None,
        }));
    }
    let mut words = rest.splitn(6, ' ');
    let mut value = || match words.next()? {
        "-" => Some(None),
        bits => u64::from_str_radix(bits, 16).ok().map(|bits| Some(f64::from_bits(bits))),
    };
    let [angle, deviation, evidence, needed] = [value()?, value()?, value()?, value()?];
    let pole_evidence = evidence.zip(needed).map(|(deviations, needed)| PoleEvidence { deviations, needed });
    let findings = Findings { angle_deviation: deviation, pole_evidence, ..Findings::default() };
    let angle = angle.map(Angle::from_radians);
    if kind == "found" {
        return Some(Ended::Outcome(Outcome::Found { angle: angle?, findings }));
    }
    let code = u32::from_str_radix(words.next()?, 16).ok()?;
    let own = Own { code, text: kept(words.next()?) };
    Some(Ended::Outcome(match kind {
        "axis" => Outcome::Axis { angle: angle?, reason: Undetermined::Own(own), findings },
        "failed" => Outcome::Failed { fault: Fault::Own(own), findings },
        _ => return None,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_a_record_survives_as_a_line() {
        let evidence = PoleEvidence { deviations: -2.5, needed: f64::INFINITY };
        let findings =
            Findings { angle_deviation: Some(0.01), pole_evidence: Some(evidence), ..Findings::default() };
        let own = Own { code: 7, text: "the hall sensors disagree, 3 of 4" };
        let angle = Angle::from_radians(1.0 / 3.0);
        let outcomes = [
            Ended::Outcome(Outcome::Found { angle, findings }),
            Ended::Outcome(Outcome::Axis {
                angle,
                reason: Undetermined::Own(own),
                findings: Findings::default(),
            }),
            Ended::Outcome(Outcome::Failed { fault: Fault::Own(own), findings }),
            Ended::Error(RunError::Chatter),
            Ended::Error(RunError::Stuck),
            Ended::Error(RunError::NoComparator),
            Ended::Error(RunError::Overcurrent { current_ma: 12_345 }),
            Ended::Error(RunError::LeftMap { current_ma: [-1234, 5] }),
            Ended::Error(RunError::Chatter),
        ];
        for ended in outcomes {
            let run = Run {
                ended,
                duration: Nanos(123_456),
                start_angle: 0.1,
                end_angle: 0.2,
                has_pole: true,
                resolver_angle: 1.0 / 7.0,
                moved: -0.0,
                peak_current: 1e-9,
                ledger: None,
                work: Work { derivatives: 1, steps: 2, segments: 3, events: 4 },
            };
            let record = Record { trial: 99, run };
            assert_eq!(Record::from_line(&record.to_line()), Some(record), "{}", record.to_line());
        }
        assert_eq!(Record::from_line("1 2 3"), None);
    }
}
