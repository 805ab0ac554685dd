//! A library: checked once, then loaded as often as detections run at the same time.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use crate::elf::Elf;
use crate::image::{Image, Moment, Site};
use crate::parts::{self, Part, Read};
use crate::shared;
use serde::{Deserialize, Serialize};
use standstill_interface::abi;
use thiserror::Error;

/// Why a library cannot be the detector.
#[derive(Clone, Debug, PartialEq, Eq, Error, Serialize, Deserialize)]
#[error("found {found}, needed {needed}")]
pub struct LoadError {
    /// The file or library that was found.
    pub found: String,
    /// The file or library that is needed.
    pub needed: String,
}

impl LoadError {
    /// Makes an error of these words.
    pub fn new(found: String, needed: String) -> Self {
        Self { found, needed }
    }

    pub(crate) fn because(found: String) -> Self {
        Self::new(found, "a shared library that exports sts_entry, see standstill.h".to_owned())
    }

    pub(crate) fn elsewhere() -> Self {
        let (found, needed) = if cfg!(target_env = "musl") {
            (
                "a program that is linked statically (musl), which loads no libraries",
                concat!(
                    "that for glibc, of the archive standstill-",
                    env!("CARGO_PKG_VERSION"),
                    "-…-unknown-linux-gnu.tar.gz"
                ),
            )
        } else {
            ("another system", "Linux: so far libraries are loaded there only")
        };
        Self::new(found.to_owned(), needed.to_owned())
    }

    pub(crate) fn no_entry() -> Self {
        Self::because("a library without sts_entry".to_owned())
    }
}

/// Times at which an interrupt runs and at which its output takes effect.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    /// Frequency of the PWM in Hz.
    pub pwm_hz: u32,
    /// Whether it runs twice a period.
    pub twice: bool,
    /// When the converters sample, as a share of the time between two updates.
    pub sample_at: f32,
    /// After how many updates legs take effect.
    pub update_delay: u32,
    /// Samples between two updates.
    pub samples: u32,
    /// Time between two samples, as a share of the time between two updates.
    pub sample_every: f32,
    /// Period of the task beside the interrupt in ns; none for a library without task.
    pub task_ns: Option<u64>,
}

/// Properties of a library that are known once it is loaded, before any trial.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Description {
    /// Name by which the library identifies itself.
    pub name: String,
    /// Level at which the library is called.
    pub level: Level,
    /// Libraries that it loads itself while it is loaded.
    pub loads: Vec<PathBuf>,
}

/// Level at which a library is called.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Level {
    /// `step()`: from readings to a command.
    Command,
    /// `isr()`: from a sample to the legs.
    Interrupt(Timing),
}

/// A library that can be a detector.
pub struct Library {
    /// Path of the file.
    pub path: PathBuf,
    /// The path as messages have it: a crash may name it at any time.
    pub(crate) label: &'static String,
    /// Properties that are known without a detection.
    pub description: Description,
    /// The files of an image; the library itself is the last.
    parts: Vec<Part>,
    /// Images that no detection uses now; nothing if it is loaded in other processes only.
    images: Option<Mutex<Vec<Image>>>,
}

impl fmt::Debug for Library {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())
    }
}

/// Libraries of this program: each is checked and loaded once, however many scenarios name it.
static KNOWN: Mutex<Vec<Arc<Library>>> = Mutex::new(Vec::new());

/// Loads the library at a path in another process and describes it.
type Inspect = Box<dyn Fn(&Path) -> Result<Description, LoadError> + Send + Sync>;

/// Who loads libraries in place of this process.
static ELSEWHERE: OnceLock<Inspect> = OnceLock::new();

/// Makes this process load no library from now on; `inspect` inspects libraries in another process instead. For a
/// program in which only workers run detectors.
pub fn load_elsewhere(inspect: impl Fn(&Path) -> Result<Description, LoadError> + Send + Sync + 'static) {
    // Who was there first stays.
    let _ = ELSEWHERE.set(Box::new(inspect));
}

impl Library {
    /// Makes a library from these bytes, which were read from `path`. `read` returns the content of further files:
    /// libraries to which it is linked, except those of the system, and libraries that it loads itself.
    ///
    /// # Errors
    /// The file is not a library with `sts_entry` of this ABI for this machine, or a required library is missing.
    pub fn of(path: &Path, bytes: &Arc<[u8]>, read: Read) -> Result<Arc<Self>, LoadError> {
        let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(library) = known.iter().find(|library| library.is(path, bytes, read)) {
            for path in &library.description.loads {
                read_further(path, read)?;
            }
            return Ok(Arc::clone(library));
        }
        let library = Arc::new(Self::load(path, bytes, read)?);
        known.push(Arc::clone(&library));
        Ok(library)
    }

    /// Returns whether it was read from there, and all of it has the same bytes.
    fn is(&self, path: &Path, bytes: &Arc<[u8]>, read: Read) -> bool {
        let Some((own, others)) = self.parts.split_last() else { return false };
        let same = |one: &Arc<[u8]>, other: &Arc<[u8]>| Arc::ptr_eq(one, other) || one == other;
        self.path == path
            && same(&own.bytes, bytes)
            && others
                .iter()
                .filter(|part| part.is_of_run)
                .all(|part| read(&part.path).is_ok_and(|bytes| same(&part.bytes, &bytes)))
    }

    fn load(path: &Path, bytes: &Arc<[u8]>, read: Read) -> Result<Self, LoadError> {
        if !cfg!(all(target_os = "linux", target_env = "gnu")) {
            return Err(LoadError::elsewhere());
        }
        let elf = Elf::parse(bytes).map_err(LoadError::because)?;
        if elf.thread_local > 0 {
            return Err(LoadError::new(
                format!("a library with {} bytes of thread-local memory", elf.thread_local),
                "plain variables, which are set back before each trial".to_owned(),
            ));
        }
        if !elf.has_entry {
            return Err(LoadError::no_entry());
        }
        let parts = parts::of(path, bytes, elf, read)?;
        shared::check(&parts)?;
        let label = &*Box::leak(Box::new(path.display().to_string()));
        let (description, images) = if let Some(inspect) = ELSEWHERE.get() {
            (inspect(path)?, None)
        } else {
            let image = Image::load(&parts, Site::new(label, Moment::Load))?;
            let level = level(image.table(), image.has())?;
            let file = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
            let name = Some(image.name()).filter(|name| !name.is_empty()).unwrap_or(file);
            (Description { name, level, loads: image.loads.clone() }, Some(Mutex::new(vec![image])))
        };
        for path in &description.loads {
            read_further(path, read)?;
        }
        Ok(Self { path: path.to_owned(), label, description, parts, images })
    }

    /// Returns whether this process has loaded it, so that it can make detectors.
    pub fn is_here(&self) -> bool {
        self.images.is_some()
    }

    /// Returns the remark on state in the C library or other libraries that all copies share and that is not restored
    /// between trials; none if there is no such state.
    pub fn shared_note(&self) -> Option<String> {
        shared::note(&self.parts, &self.description.loads)
    }

    /// Returns an image with its memory as after loading: one that no detection uses, or a new one.
    pub(crate) fn image(&self) -> Result<Image, LoadError> {
        let Some(images) = &self.images else {
            let found = "a library that only other processes load";
            return Err(LoadError::new(found.to_owned(), "a trial in one of these".to_owned()));
        };
        let free = images.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let load = || Image::load(&self.parts, Site::new(self.label, Moment::Load));
        let mut image = free.map_or_else(load, Ok)?;
        image.set_back();
        Ok(image)
    }

    /// Takes an image back.
    pub(crate) fn give_back(&self, image: Image) {
        if let Some(images) = &self.images {
            images.lock().unwrap_or_else(PoisonError::into_inner).push(image);
        }
    }
}

/// Reads a library that another one has loaded, and those that it needs: they are part of the run.
fn read_further(path: &Path, read: Read) -> Result<(), LoadError> {
    let failed = |error: std::io::Error| {
        let found = format!("a library that loads {}, which cannot be read: {error}", path.display());
        LoadError::new(found, "one that it is linked to".to_owned())
    };
    let bytes = read(path).map_err(failed)?;
    parts::read_all(path, &bytes, read)
}

/// Returns the level at which a table is called, from which of `step` and `isr` it has.
fn level(table: &abi::Table, [step, isr]: [bool; 2]) -> Result<Level, LoadError> {
    let lacks = |function: &str| {
        LoadError::new(format!("a table without {function}"), format!("`{function}` in sts_detector"))
    };
    if table.create.is_none() {
        return Err(lacks("create"));
    }
    let known = abi::INTERRUPT | abi::DOUBLE_UPDATE | abi::REENTRANT;
    if table.flags & !known != 0 {
        return Err(LoadError::new(format!("flags {:#x}", table.flags), format!("those of {known:#x}")));
    }
    if table.flags & abi::INTERRUPT == 0 {
        if table.task.is_some() {
            let needed = "STS_INTERRUPT in flags: at command level nothing runs beside a command".to_owned();
            return Err(LoadError::new("a task at command level".to_owned(), needed));
        }
        return if step { Ok(Level::Command) } else { Err(lacks("step")) };
    }
    if !isr {
        return Err(lacks("isr"));
    }
    if !(10..=1_000_000).contains(&table.pwm_hz) {
        return Err(LoadError::new(format!("pwm_hz {}", table.pwm_hz), "from 10 to 1000000".to_owned()));
    }
    if !(0.0..=1.0).contains(&table.sample_at) {
        return Err(LoadError::new(
            format!("sample_at {}", table.sample_at),
            "a share from 0 to 1".to_owned(),
        ));
    }
    if !(1..=4).contains(&table.update_delay) {
        return Err(LoadError::new(format!("update_delay {}", table.update_delay), "from 1 to 4".to_owned()));
    }
    let timing = Timing {
        pwm_hz: table.pwm_hz,
        twice: table.flags & abi::DOUBLE_UPDATE != 0,
        sample_at: table.sample_at,
        update_delay: table.update_delay,
        samples: table.samples.max(1),
        sample_every: table.sample_every,
        task_ns: table.task.map(|_| table.task_ns),
    };
    timing.check()?;
    Ok(Level::Interrupt(timing))
}

impl Timing {
    /// Checks the sampling times and the period of the task.
    fn check(&self) -> Result<(), LoadError> {
        if self.samples > abi::MOST_TRIGGERS {
            let needed = format!("from 1 to {}", abi::MOST_TRIGGERS);
            return Err(LoadError::new(format!("samples {}", self.samples), needed));
        }
        if let Err(found) = self.within(self.sample_at, self.sample_every) {
            return Err(LoadError::new(found, "the last one before the next update".to_owned()));
        }
        match self.task_ns {
            Some(period) if !(1000..=10_000_000_000).contains(&period) => {
                Err(LoadError::new(format!("task_ns {period}"), "from 1000 to 10000000000".to_owned()))
            }
            _ => Ok(()),
        }
    }

    /// Checks that all samples lie between two updates: the first at `at`, further ones at intervals of `every`, both
    /// as shares of the time between updates.
    ///
    /// # Errors
    /// A description of samples that do not.
    pub(crate) fn within(&self, at: f32, every: f32) -> Result<(), String> {
        let last = f64::from(at) + f64::from(every) * f64::from(self.samples - 1);
        // Shares in single precision do not add up exactly.
        if (0.0..=1.0).contains(&at) && (self.samples == 1 || every > 0.0 && last <= 1.0 + 1e-6) {
            return Ok(());
        }
        Err(format!(
            "{} samples from {at} on, one each {every} of the time between two updates",
            self.samples
        ))
    }
}
