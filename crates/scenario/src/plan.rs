//! The plan of a scenario file: the points of its sweep, and the scenario at each point.

mod points;
mod trials;

use std::collections::{BTreeMap, BTreeSet};
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

/// Subject of a remark on results, see [`Plan::note`].
#[derive(Clone, Copy, Debug)]
pub enum Note {
    /// Poles of answers may be wrong, because a motor's data do not show which pole draws more current.
    Poles,
    /// The flux map of a motor is too coarse.
    Maps,
    /// Numbers in a motor's data are implausible and probably mistakes.
    Numbers,
    /// A detector library keeps state in other libraries. This state is not restored between trials.
    Libraries,
}

/// A checked scenario file. It contains the points of the sweep, and all data from which the scenario of a point or a trial is made.
#[derive(Clone, Debug)]
pub struct Plan {
    pub(super) document: Document,
    /// The document from which all scenarios are made. It contains a copy of the motor's whole data sheet, so that the file of the data
    /// sheet is not read again. It contains no copy if an axis changes the motor's base or its flux map.
    resolved: Document,
    /// The motor, if no axis and no tolerance changes it.
    motor: Option<Motor>,
    file: ScenarioFile,
    points: Vec<Point>,
    pub(super) tolerances: Vec<Drawn>,
    /// True if the data of at least one motor do not show which pole draws more current.
    pole_is_open: bool,
    /// True if at least one motor has a magnet, and therefore poles.
    has_poles: bool,
    /// Remarks on each subject, in the order of [`Note`]; equal remarks are kept once.
    notes: [BTreeSet<String>; 4],
    /// Functions that write the drawn values of a trial into a scenario without reading the document. None if the resulting scenarios would
    /// differ from those of the document.
    pub(super) typed: Option<Typed>,
    /// Runs the trials in another process. None if the trials run in this process.
    pub(super) remote: Option<Arc<dyn Remote>>,
}

/// Function that is called while the points of a plan are checked, with the number of checked points and the number of all points. An error
/// ends the check.
pub type WatchPoints<'a> = &'a mut dyn FnMut(usize, usize) -> Result<(), FileError>;

/// Largest number of points for which the setters are compared with the document. A plan with more points has no setters, and reads the
/// document for each trial.
const MOST_TYPED: usize = 200;

/// Largest number of trials whose drawn tolerances are checked before the first trial.
const MOST_TRIED: u64 = 10_000_000;

/// Tables and keys that apply to the whole campaign. They can be neither axes nor tolerances.
const FIXED: [&str; 6] = ["trials", "stop_at", "limit", "axes", "design", "tolerances"];

impl Plan {
    /// Makes the plan of a document and checks all its points. An error at any point is therefore reported before the first trial.
    ///
    /// # Errors
    /// A key is unknown, or its value is invalid at a point.
    pub fn new(document: Document) -> Result<Self, FileError> {
        Self::watched(document, None, &mut |_, _| Ok(()))
    }

    /// Makes the plan of a changed document. If the motor is unchanged, it is copied from this plan.
    ///
    /// # Errors
    /// The same as for [`Plan::new`].
    pub fn changed(&self, document: Document) -> Result<Self, FileError> {
        Self::watched(document, Some(self), &mut |_, _| Ok(()))
    }

    /// Makes the plan of a document like [`Plan::new`], and calls `watch` again and again while the points are checked. A point takes some
    /// 0.1 ms, with a flux map that an axis changes some 0.4 s. If the motor is that of the plan `known`, it is copied from there, because
    /// fitting a flux map takes seconds.
    ///
    /// # Errors
    /// The same as for [`Plan::new`], and an error of `watch`.
    ///
    /// ```
    /// use std::path::Path;
    /// use standstill_scenario::{Document, Plan};
    ///
    /// let text = "axes = { \"sensors.noise\" = { from = 0.01, to = 0.03, points = 200 } }";
    /// let document = Document::parse(Path::new("s.toml"), text)?;
    /// let mut seen = Vec::new();
    /// Plan::watched(document, None, &mut |checked, all| Ok(seen.push((checked, all))))?;
    /// assert_eq!(seen, [(0, 200), (64, 200), (128, 200), (192, 200)]);
    /// # Ok::<(), standstill_scenario::FileError>(())
    /// ```
    pub fn watched(
        document: Document,
        known: Option<&Self>,
        watch: WatchPoints<'_>,
    ) -> Result<Self, FileError> {
        let known = known.filter(|known| known.document.get("motor") == document.get("motor"));
        let file = document.load()?;
        let keys = file.axes.keys().map(|key| ("axes", key));
        for (table, key) in keys.chain(file.tolerances.keys().map(|key| ("tolerances", key))) {
            let first = key.split('.').next().unwrap_or_default();
            let drawn =
                ["seed", "detector", "detector.library"].contains(&key.as_str()) && table == "tolerances";
            // A run has one Python class, whose name is part of the run's record.
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
        // If an axis changes the motor's base or its flux map, the data sheet must be read by its name at each point.
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
        let (typed, remote) = (None, None);
        let mut plan = Self {
            document,
            resolved,
            motor,
            file,
            points,
            tolerances,
            pole_is_open: false,
            has_poles: false,
            notes: Default::default(),
            typed,
            remote,
        };
        plan.check_points(watch)?;
        let tried = plan.check_draws()?;
        plan.typed = plan.setters(tried)?;
        plan.document.seal();
        plan.resolved.seal();
        Ok(plan)
    }

    /// Tables of the scenario file.
    pub fn file(&self) -> &ScenarioFile {
        &self.file
    }

    /// Points of the sweep axes.
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// Returns the text of the scenario file with all overrides.
    pub fn text(&self) -> Result<String, FileError> {
        self.file.text()
    }

    /// Returns the digests of all files that the trials read, by their paths relative to the scenario's folder.
    pub fn files(&self) -> BTreeMap<String, Digest> {
        self.document.files().digests()
    }

    /// Returns the remarks on a subject. Returns none if there are no remarks.
    pub fn note(&self, on: Note) -> Option<String> {
        let notes: Vec<&str> = self.notes[on as usize].iter().map(String::as_str).collect();
        (!notes.is_empty()).then(|| notes.join("; "))
    }

    /// Returns true if the data of at least one motor do not show which pole draws more current.
    pub const fn pole_is_open(&self) -> bool {
        self.pole_is_open
    }

    /// Returns true if at least one motor has a magnet, and therefore poles that a detection must distinguish.
    ///
    /// ```
    /// use std::path::Path;
    /// use standstill_scenario::{Document, Plan};
    ///
    /// let has_poles = |text: &str| {
    ///     let document = Document::parse(Path::new("s.toml"), text).expect("TOML");
    ///     Plan::new(document).expect("a scenario").has_poles()
    /// };
    /// assert!(has_poles("motor = \"pm-reluctance\"") && !has_poles("motor = \"reluctance-6k7\""));
    /// ```
    pub const fn has_poles(&self) -> bool {
        self.has_poles
    }

    /// Returns true if the scenario has tolerances, so that each trial draws values of keys.
    pub fn has_tolerances(&self) -> bool {
        !self.tolerances.is_empty()
    }

    /// Makes the scenario at a point, with all toleranced keys at their nominal values.
    pub fn scenario(&self, point: usize) -> Result<Scenario<Method<f64>>, FileError> {
        self.at(point, &[])
    }

    /// Makes the scenario of one trial at a point, with the values that the trial draws. `nominal` is the scenario at this point with
    /// nominal values, if this scenario exists already.
    pub(super) fn drawn(
        &self,
        point: usize,
        nominal: Option<&Scenario<Method<f64>>>,
        trial: u64,
    ) -> Result<Scenario<Method<f64>>, FileError> {
        self.drawer(point, nominal).draw(Streams::new(self.file.seed, trial))
    }

    /// Returns a [`Drawer`] for the trials at a point. `nominal` has the same meaning as in [`Self::drawn`].
    fn drawer<'a>(&'a self, point: usize, nominal: Option<&'a Scenario<Method<f64>>>) -> Drawer<'a> {
        let typed = self.typed.as_ref().zip(nominal).map(|(typed, nominal)| (typed.at(point), nominal));
        Drawer { plan: self, point, nominal, typed }
    }

    /// Returns setters for all tolerances. Returns none if, at any point, their scenarios differ from those of the document. `tried`
    /// contains, for each tolerance, the smallest and the largest number for which the document was checked.
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

    /// Returns the tables, the data sheet and the motor at a point. From these, setters make the motor of a trial.
    fn base(&self, point: usize) -> Result<Base, FileError> {
        let document = self.document_at(&self.resolved, point)?;
        let file = document.load()?;
        let sheet = file.motor.sheet(document.files())?;
        let motor = self.motor.clone().map_or_else(|| file.motor(document.files()), Ok)?;
        Ok(Base { file, sheet, motor })
    }

    /// Draws the values of a trial's toleranced keys, and returns each key with its value.
    pub(super) fn draws(&self, streams: Streams) -> Vec<(String, Value)> {
        let draw = |drawn: &Drawn| (drawn.key().to_owned(), drawn.draw(streams));
        self.tolerances.iter().map(draw).collect()
    }

    /// Makes the scenario with the drawn values. The detector keeps the settings that follow from the nominal values, because it does not
    /// know the drawn values of motor, drive and rotor. Drawn values of the detector's own keys change its settings.
    pub(super) fn with_drawn(
        &self,
        point: usize,
        nominal: Option<&Scenario<Method<f64>>>,
        drawn: &[(String, Value)],
    ) -> Result<Scenario<Method<f64>>, FileError> {
        let of_detector: Vec<(String, Value)> =
            drawn.iter().filter(|(key, _)| key.starts_with("detector.")).cloned().collect();
        let (detector, foreign, hosted) = match nominal {
            Some(nominal) if of_detector.is_empty() => {
                (nominal.detector, nominal.foreign.clone(), nominal.hosted.clone())
            }
            _ => {
                let nominal = self.at(point, &of_detector)?;
                (nominal.detector, nominal.foreign, nominal.hosted)
            }
        };
        Ok(Scenario { detector, foreign, hosted, ..self.at(point, drawn)? })
    }

    /// Checks, for each key, the smallest and the largest value that the trials will draw. An invalid value is therefore reported before
    /// the first trial. Returns the smallest and the largest number of each key.
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

    /// Loads the tables of the file with the values of a point.
    ///
    /// # Errors
    /// A value is invalid.
    pub fn file_at(&self, point: usize) -> Result<ScenarioFile, FileError> {
        self.document_at(&self.document, point)?.load()
    }

    /// Sets the values of a point in a copy of a document.
    fn document_at(&self, document: &Document, point: usize) -> Result<Document, FileError> {
        let mut document = document.clone();
        // The motor is set first, then the keys that change it.
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

/// Returns the value of a key from the document. If the document does not set a key of the motor, returns the value from the motor's data
/// sheet. Returns none if neither contains the key.
fn nominal(document: &Document, file: &ScenarioFile, key: &str) -> Result<Option<Value>, FileError> {
    match (document.get(key), key.strip_prefix("motor.")) {
        (Some(value), _) => Ok(Some(value.clone())),
        (None, Some(key)) => file.motor.nominal(key, document.files()),
        (None, None) => Ok(None),
    }
}

/// Makes the scenarios of trials at one point.
struct Drawer<'a> {
    plan: &'a Plan,
    point: usize,
    nominal: Option<&'a Scenario<Method<f64>>>,
    /// Setters that write a trial's numbers into the point's scenario without reading the document.
    typed: Option<(typed::Drawer<'a>, &'a Scenario<Method<f64>>)>,
}

impl Drawer<'_> {
    /// Makes the scenario of a trial, with values drawn from the trial's random numbers.
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
