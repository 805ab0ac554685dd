//! The scenarios of the lab, and the data computed from them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::Deserialize;
use serde_json::{Value, json};
use standstill_detect::Method;
use standstill_plant::DataSheet;
use standstill_scenario::{Document, FileError, Origin, Plan, Scenario, Single};

use crate::advice::{Adviser, Find};
use crate::cloud::{self, CloudRequest, Clouds, Pair};
use crate::commands::Written;
use crate::detection::{self, DetectionRequest};
use crate::error::LabError;
use crate::folder::Folder;
use crate::setting::Setting;
use crate::{controls, convert, values};

/// The scenario that the lab is started with.
#[derive(Clone, Debug)]
pub struct Given {
    /// The scenario.
    pub document: Document,
    /// File of the scenario as on the command line; none for a scenario without file.
    pub file: Option<PathBuf>,
    /// Keys from the command line; the document has them already.
    pub keys: Vec<(String, String)>,
}

impl Given {
    /// Makes a scenario without any keys.
    pub fn nothing() -> Result<Self, FileError> {
        Ok(Self { document: Document::parse(Path::new("scenario"), "")?, file: None, keys: Vec::new() })
    }
}

/// A scenario of the lab, ready to run.
pub(crate) struct Ready {
    pub plan: Plan,
    pub point: usize,
    /// Scenario at its point, without the random draws of trials.
    pub scenario: Scenario<Method<f64>>,
    /// The document without the resolved values of the plan.
    pub document: Document,
    /// The trial that was looked at last.
    single: Mutex<Option<Arc<Single>>>,
}

impl Ready {
    /// Returns a trial with its random draws.
    pub fn single(&self, trial: u64) -> Result<Arc<Single>, LabError> {
        let mut last = lock(&self.single);
        if let Some(single) = last.as_ref().filter(|single| single.trial == trial) {
            return Ok(Arc::clone(single));
        }
        let single = Arc::new(self.plan.single(self.point, trial)?);
        *last = Some(Arc::clone(&single));
        Ok(single)
    }
}

/// Returns whether a scenario, at any of its points, has a detector from a library.
pub(crate) fn names_library(document: &Document) -> bool {
    let of = |key: &String| key == "detector" || key.starts_with("detector.library");
    let varied = |table: &str| {
        let keys = document.get(table).and_then(toml::Value::as_table);
        keys.is_some_and(|keys| keys.keys().any(of))
    };
    document.get("detector.library").is_some() || varied("axes") || varied("tolerances")
}

/// Refusal of scenarios that name a library.
pub(crate) const LIBRARY: &str =
    "a detector from a library is run where the lab is started with its scenario, and not at the page's word";

/// Scenarios that are kept ready, so that going back and forth costs nothing.
const KEPT: usize = 48;

/// Most points of a scenario whose settings are kept: at 300 bytes a point and axis all kept ones together take 150 MB an axis, and each is
/// planned in a second or two, unless each point has a flux map of its own: see [`PATIENCE`].
const MOST_POINTS: usize = 10_000;

/// Longest time that the check of a setting's points may take. A page waits for it, and no request ends it.
#[cfg(feature = "server")]
const PATIENCE: std::time::Duration = std::time::Duration::from_secs(10);

/// Makes the plan of a document. The motor is copied from the plan `known` if it is the same. Gives up after [`PATIENCE`]; in a browser,
/// which has no clock here, never.
fn planned(document: &Document, known: Option<&Plan>) -> Result<Plan, FileError> {
    #[cfg(feature = "server")]
    let begun = std::time::Instant::now();
    Plan::watched(document.clone(), known, &mut |checked, all| {
        #[cfg(feature = "server")]
        if begun.elapsed() > PATIENCE {
            let found = format!("{all} points, of which {checked} were checked in {} s", PATIENCE.as_secs());
            let needed = "fewer points in the lab, which looks at one of them; `standstill sweep` runs all";
            return Err(document.refuse("axes", &found, needed));
        }
        let _ = (checked, all);
        Ok(())
    })
}

/// Refuses a scenario of more than [`MOST_POINTS`] points, before they are made.
fn few_points(document: &Document) -> Result<(), LabError> {
    let points = document.load()?.point_count().map_err(|error| document.locate(error))?;
    if points <= MOST_POINTS {
        return Ok(());
    }
    let needed =
        format!("at most {MOST_POINTS} in the lab, which looks at one of them; `standstill sweep` runs all");
    Err(document.refuse("axes", &format!("{points} points"), &needed).into())
}

/// State of the lab: see the crate's documentation.
pub struct Bench {
    given: Given,
    folder: Option<Folder>,
    adviser: Option<Adviser>,
    /// Settings that are ready to run, in order of their last use.
    ready: Mutex<Vec<(String, Arc<Ready>)>>,
    pub(crate) clouds: Mutex<Clouds>,
}

/// Returns a thread that panicked has either put something whole in or nothing.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns a request by its name, with its body in JSON.
fn body<'a, T: Deserialize<'a>>(text: &'a str) -> Result<T, LabError> {
    serde_json::from_str(text).map_err(LabError::request)
}

impl Bench {
    /// Makes a lab of this scenario. Files that the page names must be in the folder; without a folder they are
    /// refused.
    ///
    /// # Errors
    /// The scenario cannot be run.
    pub fn new(mut given: Given, folder: Option<Folder>) -> Result<Self, LabError> {
        // What the scenario itself names is read here, wherever it lies.
        few_points(&given.document)?;
        let plan = planned(&given.document, None)?;
        given.document.fence(folder.as_ref().map(Folder::path))?;
        let bench = Self { given, folder, adviser: None, ready: Mutex::default(), clouds: Mutex::default() };
        let name = Setting::default().name();
        let ready = bench.made(plan, bench.given.document.clone(), 0)?;
        lock(&bench.ready).push((name, Arc::new(ready)));
        Ok(bench)
    }

    /// Adds the function that finds the detector for a scenario.
    #[must_use]
    pub fn advised(mut self, find: Find) -> Self {
        self.adviser = Some(Adviser::new(find));
        self
    }

    /// Returns the folder, if there is one.
    pub fn folder(&self) -> Option<&Folder> {
        self.folder.as_ref()
    }

    /// The answer to a request in JSON: `start`, `setting`, `advice`, `convert`, `pair`, `folder`, `progress`; `detection` has one in bytes.
    ///
    /// # Errors
    /// Requests that no page makes, and scenarios that cannot be.
    pub fn answer(&self, request: &str, text: &str) -> Result<Vec<u8>, LabError> {
        let answer = match request {
            "start" => self.start(),
            "setting" => values::answer(self, &body(text)?)?,
            "advice" => {
                let adviser = self.adviser.as_ref().ok_or_else(|| LabError::of("the lab has no adviser"))?;
                adviser.answer(self, &body(text)?)?
            }
            "convert" => convert::answer(&body(text)?)?,
            "pair" => cloud::pair(self, &body::<Pair>(text)?),
            "folder" => json!({ "entries": self.folder.as_ref().map(Folder::entries) }),
            "progress" => {
                let path: BTreeMap<String, String> = body(text)?;
                let folder = self.folder.as_ref().ok_or_else(|| LabError::of("the lab has no folder"))?;
                folder.progress(path.get("path").map_or("", String::as_str))?
            }
            "detection" => return detection::answer(self, &body::<DetectionRequest>(text)?),
            _ => return Err(LabError::request(request)),
        };
        serde_json::to_vec(&answer).map_err(LabError::of)
    }

    /// Runs the detections of a [`CloudRequest`]; `sink` receives frames of bytes and returns false if the page is
    /// closed.
    ///
    /// # Errors
    /// The scenario cannot be run.
    pub fn cloud(
        &self,
        request: &CloudRequest,
        stop: &std::sync::atomic::AtomicBool,
        sink: &mut dyn FnMut(&[u8]) -> bool,
    ) -> Result<(), LabError> {
        cloud::run(self, request, stop, sink)
    }

    /// Returns the data that a page requests once, when it opens.
    fn start(&self) -> Value {
        json!({
            "version": env!("CARGO_PKG_VERSION"),
            "motors": standstill_plant::built_in_names().collect::<Vec<_>>(),
            "controls": controls::controls(),
            "convertible": DataSheet::convertible_keys(),
            "has_method": self.given.document.get("detector").is_some(),
            "scenario": self.given.file.as_ref().map(|file| file.display().to_string()),
            "folder": self.folder.as_ref().map(|folder| folder.path().display().to_string()),
            "scenarios": self.folder.as_ref().map(Folder::scenarios),
        })
    }

    /// Returns how a command line names the scenario of a setting.
    pub(crate) fn written(&self, setting: &Setting) -> Written {
        let other = || self.folder.as_ref().map(|folder| folder.path().join(&setting.scenario));
        if setting.scenario.is_empty() {
            Written { file: self.given.file.clone(), keys: self.given.keys.clone() }
        } else {
            Written { file: other(), keys: Vec::new() }
        }
    }

    /// Returns the scenario of a setting.
    pub(crate) fn ready(&self, setting: &Setting) -> Result<Arc<Ready>, LabError> {
        if !setting.is_sensible() {
            return Err(LabError::request("too much is set"));
        }
        let name = setting.name();
        if let Some(known) = self.known(&name) {
            return Ok(known);
        }
        let mut document = self.document(&setting.scenario)?;
        for (key, value) in setting.in_order() {
            document.set(key, value, Origin::Option("the lab"))?;
        }
        // A link must not be able to have a program of somebody else's run.
        let given = &self.given.document;
        let same = |key: &str| document.get(key) == given.get(key);
        if names_library(&document)
            && !(setting.scenario.is_empty()
                && same("detector.library")
                && same("axes")
                && same("tolerances"))
        {
            return Err(LabError::of(LIBRARY));
        }
        few_points(&document)?;
        let like = {
            let ready = lock(&self.ready);
            let motor = document.get("motor");
            let same = ready.iter().rev().find(|(_, ready)| {
                ready.document.files().folder() == document.files().folder()
                    && ready.document.get("motor") == motor
            });
            same.map(|(_, ready)| Arc::clone(ready))
        };
        let plan = planned(&document, like.as_ref().map(|like| &like.plan))?;
        let ready = Arc::new(self.made(plan, document, setting.point)?);
        let mut all = lock(&self.ready);
        if all.len() >= KEPT {
            all.remove(0);
        }
        all.push((name, Arc::clone(&ready)));
        Ok(ready)
    }

    /// Returns a setting that is ready, and marks it as the last used one.
    fn known(&self, name: &str) -> Option<Arc<Ready>> {
        let mut ready = lock(&self.ready);
        let place = ready.iter().position(|(known, _)| known == name)?;
        let found = ready.remove(place);
        ready.push(found);
        ready.last().map(|(_, ready)| Arc::clone(ready))
    }

    /// Returns the document of a scenario by its name in the lab.
    fn document(&self, name: &str) -> Result<Document, LabError> {
        match (name, &self.folder) {
            ("", _) => Ok(self.given.document.clone()),
            (_, Some(folder)) => folder.document(name),
            (_, None) => Err(LabError::of("the lab has no folder to take scenarios from")),
        }
    }

    #[expect(clippy::unused_self, reason = "a scenario is one of a lab")]
    fn made(&self, plan: Plan, document: Document, point: usize) -> Result<Ready, LabError> {
        if point >= plan.points().len() {
            return Err(LabError::of(format!("point {point} of {}: there is none", plan.points().len())));
        }
        let scenario = plan.scenario(point)?;
        Ok(Ready { plan, point, scenario, document, single: Mutex::default() })
    }
}
