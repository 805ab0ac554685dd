//! Detectors written in Python, as the drive sees them.

use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

use numpy::{PyArray2, ndarray::Array2};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use standstill_foreign::{Guard, kept};
use standstill_interface::{
    Abc, Angle, Command, Detector, Fault, Findings, Leg, Nanos, Outcome, Own, PoleEvidence, Reading,
    Sampling, Sensed, Stage, Step, Undetermined,
};
use standstill_scenario::{Given, Provider, gave_up};

use crate::given::{self, Takes};

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

/// A class of Python whose objects are the detectors of a run.
pub struct Class {
    make: Py<PyAny>,
    takes: Takes,
    classes: Classes,
    /// The exception that was raised in the trial with the lowest number, and that number.
    raised: Mutex<Option<(u64, PyErr)>>,
}

impl fmt::Debug for Class {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a class of Python")
    }
}

impl Class {
    /// Makes a class of what makes its objects.
    pub fn new(py: Python<'_>, make: Py<PyAny>, takes: Takes) -> PyResult<Self> {
        Ok(Self { make, takes, classes: Classes::new(py)?, raised: Mutex::new(None) })
    }

    /// Returns the exception that ended the command, with the number of its trial in its attribute `trial`.
    pub fn raised(&self, py: Python<'_>) -> Option<PyErr> {
        let raised = self.raised.lock().unwrap_or_else(PoisonError::into_inner).take();
        raised.map(|(trial, error)| in_trial(py, error, trial))
    }

    /// Keeps an exception; that of the trial with the lowest number stays.
    fn ends(&self, trial: u64, error: PyErr) {
        let mut raised = self.raised.lock().unwrap_or_else(PoisonError::into_inner);
        if raised.as_ref().is_none_or(|(first, _)| trial < *first) {
            *raised = Some((trial, error));
        }
    }

    /// Returns whether an exception was raised in a trial with a lower number. Then nobody reads what this one finds.
    fn is_over(&self, trial: u64) -> bool {
        let raised = self.raised.lock().unwrap_or_else(PoisonError::into_inner);
        raised.as_ref().is_some_and(|(first, _)| *first < trial)
    }
}

/// The class as what makes the detectors of trials.
#[derive(Debug)]
pub struct Maker(pub Arc<Class>);

impl Provider for Maker {
    fn detector(&self, given: &Arc<Given>, seed: u64, trial: u64) -> Box<dyn Detector<f64>> {
        let class = Arc::clone(&self.0);
        let make = |py: Python<'_>| {
            let keywords = PyDict::new(py);
            given::give(py, given, seed, &class.takes, &keywords)?;
            class.make.call(py, (), Some(&keywords))
        };
        let object = if class.is_over(trial) {
            None
        } else {
            Python::attach(make).map_err(|error| class.ends(trial, error)).ok()
        };
        let guard = Guard::new(given.sensors.comparator.timer);
        Box::new(FromPython { object, class, trial, guard })
    }
}

/// A Python object as a detector. It holds the interpreter only while it computes a step.
struct FromPython {
    /// None if it could not be made.
    object: Option<Py<PyAny>>,
    class: Arc<Class>,
    trial: u64,
    guard: Guard,
}

impl Drop for FromPython {
    fn drop(&mut self) {
        let object = self.object.take();
        Python::attach(|_| drop(object));
    }
}

impl Detector<f64> for FromPython {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        let Some(object) = self.object.as_ref().filter(|_| !self.class.is_over(self.trial)) else {
            return gave_up();
        };
        self.guard.lasted(readings);
        let step = Python::attach(|py| {
            self.class.ask(py, object, readings).unwrap_or_else(|error| {
                self.class.ends(self.trial, error);
                gave_up()
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

impl Class {
    fn ask(&self, py: Python<'_>, object: &Py<PyAny>, readings: &[Reading<f64>]) -> PyResult<Step<f64>> {
        let step = pyo3::intern!(py, "step");
        let answer = object.bind(py).call_method1(step, (array(py, readings)?,))?;
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
        let own = |answer: &Bound<'_, PyAny>| {
            let reason: String = answer.getattr(pyo3::intern!(py, "reason"))?.extract()?;
            Ok::<_, PyErr>(Own { code: 0, text: kept(&reason) })
        };
        let findings = |answer| {
            let (pole_evidence, age) = (evidence(answer)?, age(answer)?);
            Ok::<_, PyErr>(Findings { pole_evidence, age, ..Findings::default() })
        };
        let outcome = if is(&self.classes.found) {
            Outcome::Found { angle: angle(&answer)?, findings: findings(&answer)? }
        } else if is(&self.classes.axis) {
            Outcome::Axis {
                angle: angle(&answer)?,
                reason: Undetermined::Own(own(&answer)?),
                findings: findings(&answer)?,
            }
        } else if is(&self.classes.failed) {
            Outcome::Failed { fault: Fault::Own(own(&answer)?), findings: Findings::default() }
        } else {
            let text = answer.repr()?;
            return Err(PyTypeError::new_err(format!(
                "step returned {text}: needed Drive, Found, Axis or Failed"
            )));
        };
        Ok(Step::Done(outcome))
    }
}

/// Returns the time in s from the instant for which the angle holds to the end of the detection, if it is known.
fn age(answer: &Bound<'_, PyAny>) -> PyResult<Option<f64>> {
    let age: Option<f64> = answer.getattr(pyo3::intern!(answer.py(), "age"))?.extract()?;
    match age {
        Some(age) if !(0.0..f64::INFINITY).contains(&age) => {
            Err(PyValueError::new_err(format!("an age of {age} s: needed a time of zero or more")))
        }
        age => Ok(age),
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
