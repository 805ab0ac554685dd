//! The plan of a scenario file: its points, and a scenario at each.

mod trials;

use std::collections::BTreeMap;
use std::sync::Arc;

use standstill_detect::Method;
use standstill_plant::{Digest, Motor};
use standstill_sim::Streams;
use toml::Value;

use super::axes::{Point, check_typed};
use super::document::{Document, FileError, Origin};
use super::tables::ScenarioFile;
use super::tolerances::{Drawn, Tolerance};
use super::typed::{self, Base, Typed};
use crate::{Remote, Scenario};

/// A scenario file, checked: the points of its sweep and the way to make each point's scenario.
#[derive(Clone, Debug)]
pub struct Plan {
    pub(super) document: Document,
    /// The document with the whole motor in it, unless an axis changes the motor's base: each trial with tolerances is made of it.
    resolved: Document,
    /// The motor, if it is the same at all points and in all trials.
    motor: Option<Motor>,
    file: ScenarioFile,
    points: Vec<Point>,
    pub(super) tolerances: Vec<Drawn>,
    /// Remark about poles that the motors' data leave open.
    pole_notes: Vec<&'static str>,
    /// True if the data of some motor are too few to judge its pole.
    pole_is_open: bool,
    map_notes: Vec<String>,
    /// Remark about libraries that share something with their copies.
    library_notes: Vec<String>,
    /// Setters for them without the document, if these make equal scenarios.
    pub(super) typed: Option<Typed>,
    /// Who runs its trials in place of this process.
    pub(super) remote: Option<Arc<dyn Remote>>,
}

/// Points at which setters are compared with the document; with more, each trial reads the document.
const MOST_TYPED: usize = 200;

/// Trials whose draws are looked at beforehand.
const MOST_TRIED: u64 = 10_000_000;

/// Keys that are of the run, not of what a trial is.
const FIXED: [&str; 6] = ["trials", "stop_at", "limit", "axes", "design", "tolerances"];

impl Plan {
    /// The plan of a document. Every point is checked: what is wrong with one shows before the first trial.
    pub fn new(document: Document) -> Result<Self, FileError> {
        Self::with_motor_of(document, None)
    }

    /// The plan of a changed document. Where it has the same motor, that is not made again: to fit a flux map takes seconds.
    ///
    /// # Errors
    /// As [`Plan::new`].
    pub fn changed(&self, document: Document) -> Result<Self, FileError> {
        let same = self.document.get("motor") == document.get("motor");
        Self::with_motor_of(document, same.then_some(self))
    }

    fn with_motor_of(document: Document, known: Option<&Self>) -> Result<Self, FileError> {
        let file = document.load()?;
        let keys = file.axes.keys().map(|key| ("axes", key));
        for (table, key) in keys.chain(file.tolerances.keys().map(|key| ("tolerances", key))) {
            let first = key.split('.').next().unwrap_or_default();
            let drawn =
                ["seed", "detector", "detector.library"].contains(&key.as_str()) && table == "tolerances";
            // A run has one class, whose name is its record.
            if FIXED.contains(&first) || drawn || key == "detector.python" {
                let needed = "a key of the motor, the drive, the rotor or the detector";
                let error = FileError::key(&format!("{table}.{key}"), "a key of the run itself", needed);
                return Err(document.locate(error));
            }
        }
        check_typed(&document, file.axes.keys())?;
        let points = file.points().map_err(|error| document.locate(error))?;
        let tolerances = file
            .tolerances
            .iter()
            .map(|(key, tolerance)| Drawn::new(key, tolerance, nominal(&document, &file, key)?.as_ref()))
            .collect::<Result<Vec<_>, _>>()
            .map_err(|error| document.locate(error))?;
        if let Some(drawn) = tolerances.iter().find(|drawn| file.axes.contains_key(drawn.key())) {
            let key = format!("tolerances.{}", drawn.key());
            return Err(document.locate(FileError::key(&key, "an axis too", "one of both")));
        }
        let mut resolved = document.clone();
        // What an axis puts beneath the sheet, or beside it, must find the sheet by its name.
        if !file.axes.keys().any(|key| key == "motor.base" || key.starts_with("motor.map")) {
            let sheet = file.motor.resolved(document.files()).map_err(|error| document.locate(error))?;
            resolved.resolve_motor(sheet);
        }
        let mut keys = file.axes.keys().chain(file.tolerances.keys());
        let motor = if keys.any(|key| key == "motor" || key.starts_with("motor.")) {
            None
        } else if let Some(motor) = known.and_then(|known| known.motor.clone()) {
            Some(motor)
        } else {
            Some(file.motor(document.files()).map_err(|error| document.locate(error))?)
        };
        let motors = file.axes.contains_key("motor") || file.axes.contains_key("motor.base");
        let relative =
            |(key, tolerance): &(&String, &Tolerance)| key.starts_with("motor.") && tolerance.mean.is_none();
        if let Some((key, _)) = file.tolerances.iter().find(relative).filter(|_| motors) {
            let needed = "`mean`, because motors that are an axis have several values of it";
            let error = FileError::key(&format!("tolerances.{key}"), "none", needed);
            return Err(document.locate(error));
        }
        let (pole_notes, map_notes, library_notes) = (Vec::new(), Vec::new(), Vec::new());
        let (typed, remote) = (None, None);
        let mut plan = Self {
            document,
            resolved,
            motor,
            file,
            points,
            tolerances,
            pole_notes,
            pole_is_open: false,
            map_notes,
            library_notes,
            typed,
            remote,
        };
        for number in 0..plan.points.len() {
            let Scenario { motor, foreign, .. } = plan.scenario(number)?;
            plan.library_notes.extend(foreign.and_then(|foreign| foreign.library().shared_note()));
            // One motor for all points is looked at once.
            if number == 0 || plan.motor.is_none() {
                plan.map_notes.extend(motor.map_note());
                if motor.has_magnet() {
                    let known = motor.pole_knowledge();
                    plan.pole_notes.extend(known.note());
                    plan.pole_is_open |= known.is_open();
                }
            }
        }
        plan.pole_notes.sort_unstable();
        plan.pole_notes.dedup();
        plan.map_notes.sort_unstable();
        plan.map_notes.dedup();
        plan.library_notes.sort_unstable();
        plan.library_notes.dedup();
        let tried = plan.check_draws()?;
        plan.typed = plan.setters(tried)?;
        plan.document.seal();
        plan.resolved.seal();
        Ok(plan)
    }

    /// The tables of the file.
    pub fn file(&self) -> &ScenarioFile {
        &self.file
    }

    /// The points of the axes.
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// The file with all overrides, as it would be written.
    pub fn text(&self) -> Result<String, FileError> {
        self.file.text()
    }

    /// All files that its trials read, by their paths from the scenario's folder.
    pub fn files(&self) -> BTreeMap<String, Digest> {
        self.document.files().digests()
    }

    /// Remark about wrong poles where the motors' data do not say which pole draws more current.
    pub fn pole_note(&self) -> Option<String> {
        (!self.pole_notes.is_empty()).then(|| self.pole_notes.join("; "))
    }

    /// True if the data of some motor are too few to judge its pole.
    pub const fn pole_is_open(&self) -> bool {
        self.pole_is_open
    }

    /// Remark about results where a motor's map is too coarse.
    pub fn map_note(&self) -> Option<String> {
        (!self.map_notes.is_empty()).then(|| self.map_notes.join("; "))
    }

    /// Remark about results where a library keeps something outside of its own memory.
    pub fn library_note(&self) -> Option<String> {
        (!self.library_notes.is_empty()).then(|| self.library_notes.join("; "))
    }

    /// True if each trial draws values of its own.
    pub fn has_tolerances(&self) -> bool {
        !self.tolerances.is_empty()
    }

    /// The scenario at a point, without what its trials draw.
    pub fn scenario(&self, point: usize) -> Result<Scenario<Method<f64>>, FileError> {
        self.at(point, &[])
    }

    /// The scenario of one trial at a point, with what it draws.
    pub(super) fn drawn(
        &self,
        point: usize,
        nominal: Option<&Scenario<Method<f64>>>,
        trial: u64,
    ) -> Result<Scenario<Method<f64>>, FileError> {
        self.drawer(point, nominal).draw(Streams::new(self.file.seed, trial))
    }

    /// Maker of one trial after the other at a point.
    fn drawer<'a>(&'a self, point: usize, nominal: Option<&'a Scenario<Method<f64>>>) -> Drawer<'a> {
        let typed = self.typed.as_ref().zip(nominal).map(|(typed, nominal)| (typed.at(point), nominal));
        Drawer { plan: self, point, nominal, typed }
    }

    /// Setters of all tolerances, if they make at every point what the document makes.
    fn setters(&self, tried: Vec<[f64; 2]>) -> Result<Option<Typed>, FileError> {
        if !self.has_tolerances() || self.points.len() > MOST_TYPED {
            return Ok(None);
        }
        let bases = (0..self.points.len()).map(|point| self.base(point));
        let Some(typed) = Typed::new(&self.tolerances, tried, bases)? else { return Ok(None) };
        for point in 0..self.points.len() {
            let nominal = self.scenario(point)?;
            let document = |streams: Streams| self.with_drawn(point, Some(&nominal), &self.draws(streams));
            if !typed.agrees(&self.tolerances, (point, &nominal), document) {
                return Ok(None);
            }
        }
        Ok(Some(typed))
    }

    /// Tables and data sheet at a point, from which setters make a trial's motor.
    fn base(&self, point: usize) -> Result<Base, FileError> {
        let document = self.document_at(&self.resolved, point)?;
        let file = document.load()?;
        let sheet = file.motor.sheet(document.files())?;
        let motor = self.motor.clone().map_or_else(|| file.motor(document.files()), Ok)?;
        Ok(Base { file, sheet, motor })
    }

    /// Keys and values that a trial draws.
    pub(super) fn draws(&self, streams: Streams) -> Vec<(String, Value)> {
        let draw = |drawn: &Drawn| (drawn.key().to_owned(), drawn.draw(streams));
        self.tolerances.iter().map(draw).collect()
    }

    /// Motor, drive and rotor with what was drawn; the detector knows the values of the scenario, unless a setting of its own
    /// was drawn.
    pub(super) fn with_drawn(
        &self,
        point: usize,
        nominal: Option<&Scenario<Method<f64>>>,
        drawn: &[(String, Value)],
    ) -> Result<Scenario<Method<f64>>, FileError> {
        let of_detector: Vec<(String, Value)> =
            drawn.iter().filter(|(key, _)| key.starts_with("detector.")).cloned().collect();
        let (detector, foreign) = match nominal {
            Some(nominal) if of_detector.is_empty() => (nominal.detector, nominal.foreign.clone()),
            _ => {
                let nominal = self.at(point, &of_detector)?;
                (nominal.detector, nominal.foreign)
            }
        };
        Ok(Scenario { detector, foreign, ..self.at(point, drawn)? })
    }

    /// Tries the extremes of what the trials will draw of each key: a value that cannot be shows before the first trial.
    fn check_draws(&self) -> Result<Vec<[f64; 2]>, FileError> {
        let mut tried = Vec::new();
        for drawn in &self.tolerances {
            let draws = (0..self.file.trials.min(MOST_TRIED))
                .map(|trial| drawn.number(Streams::new(self.file.seed, trial)));
            let (low, high) =
                draws.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
            for value in [low, high] {
                let value = (drawn.key().to_owned(), drawn.value(value));
                self.with_drawn(0, None, &[value])?;
            }
            tried.push([low, high]);
        }
        Ok(tried)
    }

    /// The tables of the file with the values of a point.
    ///
    /// # Errors
    /// Values that cannot be.
    pub fn file_at(&self, point: usize) -> Result<ScenarioFile, FileError> {
        self.document_at(&self.document, point)?.load()
    }

    /// A document with the values of a point.
    fn document_at(&self, document: &Document, point: usize) -> Result<Document, FileError> {
        let mut document = document.clone();
        // A motor comes before what is changed of it.
        let (motors, others): (Vec<_>, Vec<_>) = self.points[point]
            .values
            .iter()
            .partition(|(key, _)| ["motor", "motor.base"].contains(&key.as_str()));
        for (key, value) in motors.into_iter().chain(others) {
            document.set_value(key, value.clone(), Origin::Axis)?;
        }
        Ok(document)
    }

    fn at(&self, point: usize, drawn: &[(String, Value)]) -> Result<Scenario<Method<f64>>, FileError> {
        let mut document = self.document_at(&self.resolved, point)?;
        for (key, value) in drawn {
            document.set_value(key, value.clone(), Origin::Tolerance)?;
        }
        let file = document.load()?;
        let scenario = match &self.motor {
            Some(motor) => file.scenario_of(motor, document.files()),
            None => file.scenario(document.files()),
        };
        scenario.map_err(|error| document.locate(error))
    }
}

/// The value of a key: of the scenario, or for a motor's that of its data sheet.
fn nominal(document: &Document, file: &ScenarioFile, key: &str) -> Result<Option<Value>, FileError> {
    match (document.get(key), key.strip_prefix("motor.")) {
        (Some(value), _) => Ok(Some(value.clone())),
        (None, Some(key)) => file.motor.nominal(key, document.files()),
        (None, None) => Ok(None),
    }
}

/// One trial's scenario after the other, at a point.
struct Drawer<'a> {
    plan: &'a Plan,
    point: usize,
    nominal: Option<&'a Scenario<Method<f64>>>,
    /// Setters that put its numbers into the scenario at the point without the document.
    typed: Option<(typed::Drawer<'a>, &'a Scenario<Method<f64>>)>,
}

impl Drawer<'_> {
    /// The scenario with what these streams draw.
    fn draw(&mut self, streams: Streams) -> Result<Scenario<Method<f64>>, FileError> {
        let Self { plan, point, nominal, typed } = self;
        let set =
            |(typed, nominal): &mut (typed::Drawer, &_)| typed.drawn(&plan.tolerances, nominal, streams);
        match typed.as_mut().and_then(set) {
            Some(scenario) => Ok(scenario),
            None => plan.with_drawn(*point, *nominal, &plan.draws(streams)),
        }
    }
}
