//! Content of the lab's folder: scenarios, finished runs and unfinished runs.

use std::collections::HashMap;
use std::fs;
use std::path::{Component, Path, PathBuf};
use std::sync::Mutex;
use std::time::SystemTime;

use serde_json::{Value, json};
use standstill_campaign::store::Rows;
use standstill_campaign::{Statistics, Summary};
use standstill_quantity::Quantity;
use standstill_scenario::Document;

use crate::bench::{LIBRARY, lock, names_library};
use crate::error::LabError;
use crate::in_words::in_words;

/// Largest depth of folders that are searched for runs.
const DEPTH: usize = 3;
/// Largest number of listed entries.
const MOST: usize = 200;

/// A journal that another process may be writing: the content read so far, and the position at which reading continues.
/// Its lock is never taken.
struct Followed {
    rows: Rows,
    statistics: Statistics,
    /// Point of the last row.
    point: usize,
    /// Bytes that the file had. One that has fewer now is another run's.
    length: u64,
}

/// A folder, with the content of its journals read so far.
pub struct Folder {
    path: PathBuf,
    followed: Mutex<HashMap<PathBuf, Followed>>,
}

impl Folder {
    /// Returns a folder that is there.
    ///
    /// # Errors
    /// Those of the operating system.
    pub fn open(path: &Path) -> std::io::Result<Self> {
        let path = path.canonicalize()?;
        if !path.is_dir() {
            return Err(std::io::Error::new(std::io::ErrorKind::NotADirectory, "not a folder"));
        }
        Ok(Self { path, followed: Mutex::default() })
    }

    /// Returns the path without symbolic links.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns a path of something in it, wherever symbolic links lead.
    ///
    /// # Errors
    /// A path that leads elsewhere, or nowhere: one error for both.
    pub fn inside(&self, name: &str) -> Result<PathBuf, LabError> {
        let missing = || LabError::of(format!("there is no {name:?} in {}", self.path.display()));
        let relative = Path::new(name);
        let plain =
            relative.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
        let path = self.path.join(relative).canonicalize().ok().filter(|_| plain).ok_or_else(missing)?;
        if path.starts_with(&self.path) { Ok(path) } else { Err(missing()) }
    }

    /// Returns the folder of a run in it, whose files are files: a link may lead elsewhere, and a pipe never ends.
    ///
    /// # Errors
    /// Those of [`Folder::inside`], for both.
    #[cfg(feature = "server")]
    pub(crate) fn run(&self, name: &str) -> Result<PathBuf, LabError> {
        let path = self.inside(name)?;
        let own = |name: &str| {
            path.join(name)
                .symlink_metadata()
                .map_or_else(|error| error.kind() == std::io::ErrorKind::NotFound, |of| of.is_file())
        };
        if ["summary.json", "trials.csv", "trials.parquet"].into_iter().all(own) {
            Ok(path)
        } else {
            Err(LabError::of(format!("the results in {name:?} are no plain files")))
        }
    }

    /// Returns a scenario of the folder, which reads no file elsewhere.
    pub(crate) fn document(&self, name: &str) -> Result<Document, LabError> {
        let path = self.inside(name)?;
        if path.extension().is_none_or(|extension| extension != "toml") {
            return Err(LabError::of(format!("{name} is no scenario (.toml)")));
        }
        if !path.is_file() {
            return Err(LabError::of(format!("{name} is no file")));
        }
        let mut document = Document::read(&path)?;
        if names_library(&document) {
            return Err(LabError::of(LIBRARY));
        }
        document.fence(Some(&self.path))?;
        Ok(document)
    }

    /// Returns the scenarios that can be opened, by their paths.
    pub(crate) fn scenarios(&self) -> Vec<String> {
        let entries = self.entries();
        let scenarios = entries.iter().filter(|entry| entry["kind"] == "scenario");
        scenarios.filter_map(|entry| entry["path"].as_str().map(str::to_owned)).collect()
    }

    /// Scenarios and runs, by their paths.
    pub(crate) fn entries(&self) -> Vec<Value> {
        let mut found = Vec::new();
        self.look(&self.path, DEPTH, &mut found);
        found
    }

    fn look(&self, folder: &Path, depth: usize, found: &mut Vec<Value>) {
        let name = |path: &Path| path.strip_prefix(&self.path).unwrap_or(path).display().to_string();
        let journals = journals(folder);
        let finished = folder.join("summary.json").is_file();
        if finished || !journals.is_empty() {
            let changed = journals.iter().filter_map(|path| seconds_ago(path)).min_by(f64::total_cmp);
            let kind = if finished { "run" } else { "journal" };
            found.push(json!({ "kind": kind, "path": name(folder), "changed": changed }));
        }
        let mut entries: Vec<PathBuf> =
            fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect();
        entries.sort();
        for path in entries {
            let hidden = path.file_name().is_none_or(|name| name.to_string_lossy().starts_with('.'));
            // What a link leads to may lie elsewhere.
            if hidden || found.len() >= MOST || path.is_symlink() {
                continue;
            }
            if path.is_dir() && depth > 0 {
                self.look(&path, depth - 1, found);
            } else if path.is_file()
                && path.extension().is_some_and(|extension| extension == "toml")
                && is_scenario(&path)
            {
                found.push(json!({ "kind": "scenario", "path": name(&path) }));
            }
        }
    }

    /// Returns the progress of a run and its results so far, from its journals.
    pub(crate) fn progress(&self, name: &str) -> Result<Value, LabError> {
        let folder = self.inside(name)?;
        let mut parts = Vec::new();
        let mut scenario = None;
        for path in journals(&folder) {
            let mut followed = lock(&self.followed);
            let length = fs::metadata(&path).map_or(0, |of| of.len());
            let mut known = match followed.remove(&path).filter(|known| known.length <= length) {
                Some(known) => known,
                None => follow(&path)?,
            };
            known.length = length;
            known.read()?;
            let identity = known.rows.identity();
            let all = identity.shard.range(identity.rows());
            scenario = Some(identity.scenario.clone());
            let summary: Summary = known.statistics.summary();
            parts.push(json!({
                "name": path.file_name().map(|name| name.to_string_lossy().into_owned()),
                "done": summary.trials,
                "all": all.end - all.start,
                "left": known.rows.walk().left(),
                "finished": known.rows.walk().is_done(),
                "points": identity.points,
                "point": known.point,
                "changed": seconds_ago(&path),
                // Points were chosen: what they say together depends on the choice.
                "summary": (identity.points == 1).then_some(&summary),
                "in_words": (identity.points == 1).then(|| in_words(&summary)),
            }));
            followed.insert(path, known);
        }
        Ok(json!({ "path": name, "journals": parts, "scenario": scenario }))
    }
}

impl Followed {
    /// Reads the rows that have come since.
    fn read(&mut self) -> Result<(), LabError> {
        while let Some(block) = self.rows.block().map_err(LabError::of)? {
            for (point, row) in &block {
                self.statistics.add_row(row);
                self.point = *point;
            }
        }
        Ok(())
    }
}

/// Returns a journal from its beginning.
fn follow(path: &Path) -> Result<Followed, LabError> {
    let rows = Rows::open(path).map_err(LabError::of)?;
    let file = Document::parse(Path::new("scenario"), &rows.identity().scenario)?.load()?;
    let limit = file.limit.map_or(Statistics::LIMIT_DEG, Quantity::value);
    Ok(Followed { rows, statistics: Statistics::with_limit(limit), point: 0, length: 0 })
}

/// Returns the journals in a folder.
fn journals(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut paths: Vec<PathBuf> = entries
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "journal"))
        // Neither a link, which may lead elsewhere, nor a pipe, at which reading would wait for ever.
        .filter(|path| path.symlink_metadata().is_ok_and(|of| of.is_file()))
        .collect();
    paths.sort();
    paths
}

/// Returns the time in s since a file changed.
fn seconds_ago(path: &Path) -> Option<f64> {
    let changed = fs::metadata(path).ok()?.modified().ok()?;
    Some(SystemTime::now().duration_since(changed).map_or(0.0, |time| time.as_secs_f64()))
}

/// Returns whether a file is a scenario and not a data sheet or something else in TOML.
fn is_scenario(path: &Path) -> bool {
    Document::read(path).is_ok_and(|document| document.load().is_ok())
}
