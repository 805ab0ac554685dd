//! Trials in another process: the interface to that process, and the text format of a record.

use std::fmt;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use standstill_detect::Method;
use standstill_foreign::kept;
use standstill_interface::{Angle, Fault, Findings, Nanos, Outcome, Own, PoleEvidence, Undetermined};
use standstill_inverter::Conduction;
use standstill_sim::{Case, Ended, Place, Run, RunError, Work};

use crate::{FileError, Plan, Record, Scenario, TrialError};

/// Runs trials in another process.
pub trait Remote: fmt::Debug + Send + Sync {
    /// Runs a trial at a point.
    ///
    /// # Errors
    /// The trial has no record. The error contains the reason.
    fn trial(&self, point: usize, trial: u64) -> Result<Record, Lost>;
}

/// Reason why a trial has no record.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Lost {
    /// The process ended while it ran the trial. The field contains the reason.
    Trial(String),
    /// No process can run the detector. The field contains the reason.
    All(String),
}

/// Fault code of a trial during which the process ended. The codes of libraries count up from 0.
const LOST: u32 = u32::MAX - 2;

impl Plan {
    /// Returns this plan with a runner that runs the trials in other processes.
    #[must_use]
    pub fn with_remote(mut self, remote: Arc<dyn Remote>) -> Self {
        self.remote = Some(remote);
        self
    }

    /// Runs trials in another process, one after the other. If the process ends during a trial, the trial's record is the record of a
    /// failed detection.
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

    /// Makes the record of a trial during which the process ended. The trial counts as failed.
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
            instant_angle: None,
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

/// The end of a trial with a library's detector, in the form in which a line of JSON contains it.
#[derive(Serialize, Deserialize)]
enum End {
    Found(Measured),
    /// The detector found an axis without a pole. The fields are the findings, and the code and the text of the reason.
    Axis(Measured, u32, String),
    Failed(Measured, u32, String),
    /// A run error. The field is the index of the error in [`ERRORS`].
    Error(usize),
    TimeLimit(u64),
    LeftMap([i64; 2]),
    Overcurrent(i64),
    /// A run error with a place. The fields are the index of the error in [`BROKEN`], the time in ns, the indices of the conduction modes,
    /// and the bits of the currents.
    Broken(usize, u64, [usize; 3], [u32; 3]),
}

/// Run errors without further data.
const ERRORS: [RunError; 3] = [RunError::BadCommand, RunError::BadDuty, RunError::NoComparator];

/// Run errors with a [`Place`]. A place contains the time, the conduction modes and the currents at which the run failed.
const BROKEN: [fn(Place) -> RunError; 4] =
    [RunError::Chatter, RunError::NotFinite, RunError::Stuck, RunError::NoStep];

/// Returns the end of a run that failed at a place. `which` is the index of the run error in [`BROKEN`].
fn broken(which: usize, Place { time, modes, current }: Place) -> End {
    let modes =
        modes.map(|mode| Conduction::ALL.iter().position(|of| *of == mode).unwrap_or(Conduction::ALL.len()));
    End::Broken(which, time.0, modes, current)
}

/// Bit patterns (`f64::to_bits`) of five results of a library's detector: the angle and its standard deviation in rad, the evidence for the
/// pole and the evidence needed, both in standard deviations, and the age of the angle in s. A number that the detector does not give is none.
type Measured = [Option<u64>; 5];

/// Content of a line: number of the trial, duration in ns, true if the motor has a magnet, bits of five numbers of the run (angle at its
/// start, at its end and as the resolver shows it, movement, largest current), bits of the angle at the instant for which the found angle
/// holds, four counts of work, and the end.
type Line = (u64, u64, bool, [u64; 5], Option<u64>, [u64; 4], End);

impl Record {
    /// Returns the record of a trial with a library's detector as a line of JSON. Floating-point numbers are written as their bits.
    /// Findings that only built-in methods measure are left out.
    pub fn to_line(&self) -> String {
        let Self { trial, run } = self;
        let bits = [run.start_angle, run.end_angle, run.resolver_angle, run.moved, run.peak_current];
        let work = [run.work.derivatives, run.work.steps, run.work.segments, run.work.events];
        let end = match run.ended {
            Ended::Outcome(Outcome::Found { angle, findings }) => {
                End::Found(measured(Some(angle), &findings))
            }
            Ended::Outcome(Outcome::Axis { angle, reason, findings }) => {
                let code = if let Undetermined::Own(own) = reason { own.code } else { 0 };
                End::Axis(measured(Some(angle), &findings), code, reason.to_string())
            }
            Ended::Outcome(Outcome::Failed { fault, findings }) => {
                let code = if let Fault::Own(own) = fault { own.code } else { 0 };
                End::Failed(measured(None, &findings), code, fault.to_string())
            }
            Ended::Error(RunError::TimeLimit(limit)) => End::TimeLimit(limit.0),
            Ended::Error(RunError::LeftMap { current_ma }) => End::LeftMap(current_ma),
            Ended::Error(RunError::Overcurrent { current_ma }) => End::Overcurrent(current_ma),
            Ended::Error(RunError::Chatter(place)) => broken(0, place),
            Ended::Error(RunError::NotFinite(place)) => broken(1, place),
            Ended::Error(RunError::Stuck(place)) => broken(2, place),
            Ended::Error(RunError::NoStep(place)) => broken(3, place),
            Ended::Error(error) => {
                End::Error(ERRORS.iter().position(|known| *known == error).unwrap_or(ERRORS.len()))
            }
        };
        let instant = run.instant_angle.map(f64::to_bits);
        let line: Line = (*trial, run.duration.0, run.has_pole, bits.map(f64::to_bits), instant, work, end);
        serde_json::json!(line).to_string()
    }

    /// Reads a record from a line that [`Self::to_line`] wrote. Returns none if the line is invalid.
    pub fn from_line(line: &str) -> Option<Self> {
        let (trial, duration, has_pole, bits, instant, work, end): Line = serde_json::from_str(line).ok()?;
        let [start_angle, end_angle, resolver_angle, moved, peak_current] = bits.map(f64::from_bits);
        let [derivatives, steps, segments, events] = work;
        let own = |code, text: String| Own { code, text: kept(&text) };
        let ended = match end {
            End::Found(of) => Ended::Outcome(Outcome::Found { angle: angle(of)?, findings: findings(of) }),
            End::Axis(of, code, text) => {
                let (angle, reason) = (angle(of)?, Undetermined::Own(own(code, text)));
                Ended::Outcome(Outcome::Axis { angle, reason, findings: findings(of) })
            }
            End::Failed(of, code, text) => {
                Ended::Outcome(Outcome::Failed { fault: Fault::Own(own(code, text)), findings: findings(of) })
            }
            End::Error(index) => Ended::Error(*ERRORS.get(index)?),
            End::Broken(which, time, modes, current) => {
                let [a, b, c] = modes.map(|mode| Conduction::ALL.get(mode).copied());
                let place = Place { time: Nanos(time), modes: [a?, b?, c?], current };
                Ended::Error(BROKEN.get(which)?(place))
            }
            End::TimeLimit(limit) => Ended::Error(RunError::TimeLimit(Nanos(limit))),
            End::LeftMap(current_ma) => Ended::Error(RunError::LeftMap { current_ma }),
            End::Overcurrent(current_ma) => Ended::Error(RunError::Overcurrent { current_ma }),
        };
        let run = Run {
            ended,
            duration: Nanos(duration),
            start_angle,
            end_angle,
            instant_angle: instant.map(f64::from_bits),
            has_pole,
            resolver_angle,
            moved,
            peak_current,
            ledger: None,
            work: Work { derivatives, steps, segments, events },
        };
        Some(Self { trial, run })
    }
}

fn measured(angle: Option<Angle<f64>>, findings: &Findings<f64>) -> Measured {
    let evidence = findings.pole_evidence;
    let [deviations, needed] = [evidence.map(|of| of.deviations), evidence.map(|of| of.needed)];
    let known = [angle.map(Angle::radians), findings.angle_deviation, deviations, needed, findings.age];
    known.map(|x| x.map(f64::to_bits))
}

fn angle([angle, ..]: Measured) -> Option<Angle<f64>> {
    angle.map(|bits| Angle::from_radians(f64::from_bits(bits)))
}

fn findings(of: Measured) -> Findings<f64> {
    let [_, angle_deviation, deviations, needed, age] = of.map(|bits| bits.map(f64::from_bits));
    let pole_evidence =
        deviations.zip(needed).map(|(deviations, needed)| PoleEvidence { deviations, needed });
    Findings { angle_deviation, pole_evidence, age, ..Findings::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_a_record_survives_as_a_line() {
        let evidence = PoleEvidence { deviations: -2.5, needed: f64::INFINITY };
        let findings = Findings {
            angle_deviation: Some(0.01),
            pole_evidence: Some(evidence),
            age: Some(0.003),
            ..Findings::default()
        };
        let own = Own { code: 7, text: "the hall sensors disagree, 3 of 4" };
        let angle = Angle::from_radians(1.0 / 3.0);
        let modes = [Conduction::Blocked, Conduction::UpperSwitch, Conduction::LowerReverse];
        let place = Place { time: Nanos(77), modes, current: [-1.5_f32, f32::NAN, 2.0].map(f32::to_bits) };
        let outcomes = [
            Ended::Outcome(Outcome::Found { angle, findings }),
            Ended::Outcome(Outcome::Axis {
                angle,
                reason: Undetermined::Own(own),
                findings: Findings::default(),
            }),
            Ended::Outcome(Outcome::Failed { fault: Fault::Own(own), findings }),
            Ended::Error(RunError::Chatter(place)),
            Ended::Error(RunError::NotFinite(place)),
            Ended::Error(RunError::NoComparator),
            Ended::Error(RunError::Overcurrent { current_ma: 12_345 }),
            Ended::Error(RunError::LeftMap { current_ma: [-1234, 5] }),
            Ended::Error(RunError::Stuck(place)),
            Ended::Error(RunError::NoStep(place)),
        ];
        for ended in outcomes {
            let run = Run {
                ended,
                duration: Nanos(123_456),
                start_angle: 0.1,
                end_angle: 0.2,
                instant_angle: Some(0.3),
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
