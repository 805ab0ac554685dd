//! Detectors written in Python, as the drive sees them.

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::Arc;

use numpy::{PyArray2, ndarray::Array2};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use standstill_campaign::store::Row;
use standstill_cli::{Hosted, Stopped};
use standstill_detect::Method;
use standstill_foreign::Guard;
use standstill_interface::{
    Abc, Angle, Command, Detector, Fault, Findings, Leg, Nanos, Outcome, PoleEvidence, Reading, Sampling,
    Sensed, Stage, Step, Undetermined,
};
use standstill_scenario::{Record, Scenario};
use standstill_sim::{Ended, NoProbe, run as simulate};

use crate::Error;
use crate::command::{beside, host};
use crate::table::Table;

/// Columns of the readings.
const COLUMNS: usize = 13;

/// The largest angle that a detector may name, either way.
const MOST_DEGREES: f64 = 1e6;

/// The classes of what a step returns.
struct Classes {
    drive: Py<PyAny>,
    found: Py<PyAny>,
    axis: Py<PyAny>,
    failed: Py<PyAny>,
}

impl Classes {
    fn new(py: Python<'_>) -> PyResult<Self> {
        let module = py.import("standstill._detector")?;
        let class = |name: &str| module.getattr(name).map(Bound::unbind);
        Ok(Self {
            drive: class("Drive")?,
            found: class("Found")?,
            axis: class("Axis")?,
            failed: class("Failed")?,
        })
    }
}

/// A Python object as a detector. It holds the interpreter only while it computes a step.
struct FromPython<'a> {
    object: Py<PyAny>,
    classes: &'a Classes,
    /// The exception that it raised.
    raised: Option<PyErr>,
    /// Why it has no angle, in its words.
    reason: Option<String>,
    guard: Guard,
}

/// The end of a detection that raised: nobody reads it.
fn raised() -> Step<f64> {
    Step::Done(Outcome::Failed { fault: Fault::UnexpectedReadings, findings: Findings::default() })
}

impl Detector<f64> for FromPython<'_> {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        self.guard.lasted(readings);
        let step = Python::attach(|py| {
            self.ask(py, readings).unwrap_or_else(|error| {
                self.raised = Some(error);
                raised()
            })
        });
        let Step::Drive(command) = &step else { return step };
        match self.guard.pass(command, false) {
            Ok(()) => step,
            Err(fault) => Step::Done(Outcome::Failed { fault, findings: Findings::default() }),
        }
    }

    fn overdue(&mut self, limit: Nanos) -> Option<Outcome<f64>> {
        Some(Guard::overdue(limit))
    }
}

impl FromPython<'_> {
    fn ask(&mut self, py: Python<'_>, readings: &[Reading<f64>]) -> PyResult<Step<f64>> {
        let step = pyo3::intern!(py, "step");
        let answer = self.object.bind(py).call_method1(step, (array(py, readings)?,))?;
        let class = answer.get_type();
        let is = |known: &Py<PyAny>| class.is(known.bind(py));
        if is(&self.classes.drive) {
            return command(py, &answer).map(Step::Drive);
        }
        let angle = |answer: &Bound<'_, PyAny>| {
            let angle: f64 = answer.getattr(pyo3::intern!(py, "angle"))?.extract()?;
            // Beyond, what a turn leaves of it is rounding.
            if angle.abs() <= MOST_DEGREES {
                Ok(Angle::from_degrees(angle))
            } else {
                let needed = format!("needed a number of degrees from -{MOST_DEGREES} to {MOST_DEGREES}");
                Err(PyValueError::new_err(format!("an angle of {angle}: {needed}")))
            }
        };
        let reason =
            |answer: &Bound<'_, PyAny>| answer.getattr(pyo3::intern!(py, "reason"))?.extract::<String>();
        let findings =
            |answer| Ok::<_, PyErr>(Findings { pole_evidence: evidence(answer)?, ..Findings::default() });
        let outcome = if is(&self.classes.found) {
            Outcome::Found { angle: angle(&answer)?, findings: findings(&answer)? }
        } else if is(&self.classes.axis) {
            self.reason = Some(reason(&answer)?);
            Outcome::Axis {
                angle: angle(&answer)?,
                reason: Undetermined::NoSignature,
                findings: findings(&answer)?,
            }
        } else if is(&self.classes.failed) {
            self.reason = Some(reason(&answer)?);
            Outcome::Failed { fault: Fault::UnexpectedReadings, findings: Findings::default() }
        } else {
            let text = answer.repr()?;
            return Err(PyTypeError::new_err(format!(
                "step returned {text}: needed Drive, Found, Axis or Failed"
            )));
        };
        Ok(Step::Done(outcome))
    }
}

/// Returns the evidence for the pole: both numbers or neither. Without the threshold, any evidence would look sufficient.
fn evidence(answer: &Bound<'_, PyAny>) -> PyResult<Option<PoleEvidence<f64>>> {
    let number = |name: &Bound<'_, pyo3::types::PyString>| answer.getattr(name)?.extract::<Option<f64>>();
    let py = answer.py();
    match (number(pyo3::intern!(py, "evidence"))?, number(pyo3::intern!(py, "needed"))?) {
        (None, None) => Ok(None),
        (Some(deviations), Some(needed)) if !deviations.is_nan() && needed >= 0.0 => {
            Ok(Some(PoleEvidence { deviations, needed }))
        }
        (evidence, needed) => {
            let told = |number: Option<f64>| number.map_or("None".to_owned(), |number| number.to_string());
            Err(PyValueError::new_err(format!(
                "evidence of {} with needed of {}: needed both, a number and one of zero or more, or neither",
                told(evidence),
                told(needed)
            )))
        }
    }
}

/// A row for each reading: time, three currents, DC link, whether one of these or the link's current was clipped, the current of the DC
/// link, three terminals, the timer's ticks of a trip, the number of its comparator, whether a terminal was clipped; NaN for what is not seen or has not tripped.
fn array<'py>(py: Python<'py>, readings: &[Reading<f64>]) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let mut cells = Vec::with_capacity(readings.len() * COLUMNS);
    for reading in readings {
        let of = |value: f64, sensed: Sensed| if sensed == Sensed::Hidden { f64::NAN } else { value };
        let seen = |k: usize| of(reading.current.0[k], reading.sensed.0[k]);
        let terminal = |k: usize| of(reading.terminal.0[k], reading.terminal_sensed.0[k]);
        let clips = |of: Sensed| of == Sensed::Clipped;
        let clipped =
            reading.dc_link_clipped || reading.sensed.0.into_iter().chain([reading.link_sensed]).any(clips);
        // A terminal at the lower rail is the first code of its converter: no reason to doubt the currents.
        let terminals_clipped = reading.terminal_sensed.0.into_iter().any(clips);
        let capture = reading.capture;
        cells.extend([
            reading.at.seconds(),
            seen(0),
            seen(1),
            seen(2),
            reading.dc_link,
            f64::from(u8::from(clipped)),
            of(reading.link_current, reading.link_sensed),
            terminal(0),
            terminal(1),
            terminal(2),
            capture.map_or(f64::NAN, |capture| capture.ticks.into()),
            capture.map_or(f64::NAN, |capture| f64::from(capture.comparator as u8)),
            f64::from(u8::from(terminals_clipped)),
        ]);
    }
    let cells = Array2::from_shape_vec((readings.len(), COLUMNS), cells);
    Ok(PyArray2::from_owned_array(py, cells.map_err(|error| PyValueError::new_err(error.to_string()))?))
}

fn nanos(what: &str, seconds: &Bound<'_, PyAny>) -> PyResult<Nanos> {
    let seconds: f64 = seconds.extract()?;
    if seconds.is_finite() && seconds >= 0.0 {
        Ok(Nanos::from_seconds(seconds))
    } else {
        Err(PyValueError::new_err(format!(
            "{what} of {seconds} s: needed a finite time that is not negative"
        )))
    }
}

fn leg(value: &Bound<'_, PyAny>) -> PyResult<Leg<f64>> {
    if let Ok(name) = value.extract::<&str>() {
        match name {
            "off" => return Ok(Leg::Off),
            "low" => return Ok(Leg::Low),
            "high" => return Ok(Leg::High),
            _ => {}
        }
    } else if let Ok(share) = value.extract::<f64>()
        && (0.0..=1.0).contains(&share)
    {
        return Ok(Leg::Duty(share));
    }
    let text = value.repr()?;
    Err(PyValueError::new_err(format!(
        "a leg of {text}: needed \"off\", \"low\", \"high\" or a share from 0 to 1"
    )))
}

fn stage(py: Python<'_>, stage: &Bound<'_, PyAny>) -> PyResult<Stage<f64>> {
    let legs = stage.getattr(pyo3::intern!(py, "legs"))?;
    let legs: [Bound<'_, PyAny>; 3] = legs.extract()?;
    let [a, b, c] = [leg(&legs[0])?, leg(&legs[1])?, leg(&legs[2])?];
    let mut of = Stage::off(nanos("a duration", &stage.getattr(pyo3::intern!(py, "duration"))?)?);
    of.legs = Abc::new(a, b, c);
    Ok(of)
}

fn command(py: Python<'_>, drive: &Bound<'_, PyAny>) -> PyResult<Command<f64>> {
    let stages = drive.getattr(pyo3::intern!(py, "stages"))?;
    let stages: Vec<Bound<'_, PyAny>> = stages.try_iter()?.collect::<PyResult<_>>()?;
    let [first, rest @ ..] = &stages[..] else {
        return Err(PyValueError::new_err("a command without a stage: needed one or two"));
    };
    let then = match rest {
        [] => None,
        [then] => Some(stage(py, then)?),
        _ => {
            return Err(PyValueError::new_err(format!(
                "a command of {} stages: needed one or two",
                stages.len()
            )));
        }
    };
    let time = |what: &str, name: &Bound<'_, pyo3::types::PyString>| nanos(what, &drive.getattr(name)?);
    let sampling = Sampling {
        first: time("a first sample", pyo3::intern!(py, "first"))?,
        interval: time("an interval", pyo3::intern!(py, "interval"))?,
        count: drive.getattr(pyo3::intern!(py, "count"))?.extract()?,
    };
    let threshold: Option<f64> = drive.getattr(pyo3::intern!(py, "until"))?.extract()?;
    let command = Command { stage: stage(py, first)?, then, sampling, threshold };
    Guard::possible(&command).map_err(PyValueError::new_err)?;
    Ok(command)
}

/// One trial.
fn trial(
    make: &Py<PyAny>,
    classes: &Classes,
    scenario: &Scenario<Method<f64>>,
    number: u64,
) -> PyResult<Hosted> {
    let object = Python::attach(|py| make.call0(py))?;
    let guard = Guard::new(scenario.sensors.comparator.timer);
    let mut detector = FromPython { object, classes, raised: None, reason: None, guard };
    let run = simulate(&scenario.case(number), &mut detector, false, &mut NoProbe);
    let FromPython { object, raised, reason, .. } = detector;
    Python::attach(|_| drop(object));
    if let Some(error) = raised {
        return Err(error);
    }
    let evidence = match &run.ended {
        Ended::Outcome(outcome) => outcome.findings().pole_evidence,
        Ended::Error(_) => None,
    };
    let mut row = Row::from(&Record { trial: number, run });
    if let (Some(reason), false) = (reason, row.reason.is_empty()) {
        row.kind.clone_from(&reason);
        row.reason = reason;
    }
    Ok(Hosted { row, evidence })
}

/// A scenario's trials with detectors that `make` makes, one for each. `detector` names them in the record.
#[pyfunction]
#[pyo3(signature = (words, scenario, make, detector, progress=None))]
pub fn detect(
    py: Python<'_>,
    words: Vec<OsString>,
    scenario: Option<(PathBuf, String)>,
    make: Py<PyAny>,
    detector: String,
    progress: Option<Py<PyAny>>,
) -> PyResult<(String, Table)> {
    let host = host(scenario, false, progress.as_ref());
    let own = Arc::clone(&host);
    let classes = Classes::new(py)?;
    let done = beside(py, &host, progress, move || {
        own.trials(words, &detector, &|scenario, number| trial(&make, &classes, scenario, number))
    })?;
    let text = done.map_err(|stopped| match stopped {
        Stopped::Wrong(line) => Error::new_err(line),
        Stopped::Trial(number, error) => in_trial(py, error, number),
        Stopped::Asked => Error::new_err("interrupted"),
    })?;
    let table = host.tables().into_iter().next().ok_or_else(|| Error::new_err("no rows"))?;
    Ok((text, Table::new(table.1)))
}

/// Returns the exception with the number of the trial in which it was raised.
fn in_trial(py: Python<'_>, error: PyErr, number: u64) -> PyErr {
    let value = error.value(py);
    // Of a class that takes no attributes, only the note tells.
    let _ = value.setattr("trial", number);
    // From Python 3.11 on.
    let note = PyTuple::new(py, [format!("in trial {number}")]);
    if let Ok(note) = note {
        let _ = value.call_method1("add_note", note);
    }
    error
}
