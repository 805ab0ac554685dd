//! A library: checked once, then loaded as often as detections run at the same time.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use crate::abi;
use crate::elf::Elf;
use crate::image::Image;

/// Why a library cannot be the detector.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LoadError {
    /// What it is instead.
    pub found: String,
    /// What would be right.
    pub needed: String,
}

impl LoadError {
    pub(crate) fn new(found: String, needed: String) -> Self {
        Self { found, needed }
    }

    pub(crate) fn because(found: String) -> Self {
        Self::new(found, "a shared library that exports sts_entry, see standstill.h".to_owned())
    }

    pub(crate) fn elsewhere() -> Self {
        Self::new("another system".to_owned(), "Linux: so far libraries are loaded there only".to_owned())
    }

    pub(crate) fn no_entry() -> Self {
        Self::because("a library without sts_entry".to_owned())
    }
}

impl fmt::Display for LoadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "found {}, needed {}", self.found, self.needed)
    }
}

impl std::error::Error for LoadError {}

/// When an interrupt runs and when what it orders takes effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timing {
    /// Frequency of the PWM in Hz.
    pub pwm_hz: u32,
    /// Whether it runs twice a period.
    pub twice: bool,
    /// When the converters sample, as a share of the time between two updates.
    pub sample_at: f32,
    /// After how many updates legs take effect.
    pub update_delay: u32,
}

/// How a library is called.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Level {
    /// `step()`: from readings to a command.
    Command,
    /// `isr()`: from a sample to the legs.
    Interrupt(Timing),
}

/// A library that can be a detector.
pub struct Library {
    path: PathBuf,
    bytes: Arc<[u8]>,
    name: String,
    level: Level,
    elf: Elf,
    /// Images that no detection uses now.
    images: Mutex<Vec<Image>>,
}

impl fmt::Debug for Library {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())
    }
}

/// Libraries of this program: each is checked and loaded once, however many scenarios name it.
static KNOWN: Mutex<Vec<Arc<Library>>> = Mutex::new(Vec::new());

impl Library {
    /// The library with these bytes, which were read from `path`.
    ///
    /// # Errors
    /// What is not a library that exports `sts_entry` of this ABI, on this machine, with all that it needs.
    pub fn of(path: &Path, bytes: &Arc<[u8]>) -> Result<Arc<Self>, LoadError> {
        let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        let same = |library: &&Arc<Self>| {
            library.path == path && (Arc::ptr_eq(&library.bytes, bytes) || library.bytes == *bytes)
        };
        if let Some(library) = known.iter().find(same) {
            return Ok(Arc::clone(library));
        }
        let library = Arc::new(Self::load(path, bytes)?);
        known.push(Arc::clone(&library));
        Ok(library)
    }

    fn load(path: &Path, bytes: &Arc<[u8]>) -> Result<Self, LoadError> {
        if !cfg!(target_os = "linux") {
            return Err(LoadError::elsewhere());
        }
        let elf = Elf::parse(bytes).map_err(LoadError::because)?;
        if elf.thread_local > 0 {
            return Err(LoadError::new(
                format!("a library with {} bytes of thread-local memory", elf.thread_local),
                "plain variables, which are set back before each trial".to_owned(),
            ));
        }
        if let Some(name) = elf.unique.first() {
            return Err(LoadError::new(
                format!("a library with a variable of which there is one in all its copies ({name})"),
                "one compiled with -fno-gnu-unique".to_owned(),
            ));
        }
        if elf.entry.is_none() {
            return Err(LoadError::no_entry());
        }
        let image = Image::load(bytes, &elf)?;
        let table = image.table();
        let level = level(table)?;
        let file = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        let name = Some(image.name()).filter(|name| !name.is_empty()).unwrap_or(file);
        let images = Mutex::new(vec![image]);
        Ok(Self { path: path.to_owned(), bytes: Arc::clone(bytes), name, level, elf, images })
    }

    /// What it calls itself.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Where it was read from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// How it is called.
    pub fn level(&self) -> Level {
        self.level
    }

    /// An image with its memory as after loading: one that no detection uses, or a new one.
    pub(crate) fn image(&self) -> Result<Image, LoadError> {
        let free = self.images.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut image = free.map_or_else(|| Image::load(&self.bytes, &self.elf), Ok)?;
        image.set_back();
        Ok(image)
    }

    /// Takes an image back.
    pub(crate) fn give_back(&self, image: Image) {
        self.images.lock().unwrap_or_else(PoisonError::into_inner).push(image);
    }
}

/// How a table wants to be called.
fn level(table: &abi::Table) -> Result<Level, LoadError> {
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
        return if table.step.is_some() { Ok(Level::Command) } else { Err(lacks("step")) };
    }
    if table.isr.is_none() {
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
    Ok(Level::Interrupt(Timing {
        pwm_hz: table.pwm_hz,
        twice: table.flags & abi::DOUBLE_UPDATE != 0,
        sample_at: table.sample_at,
        update_delay: table.update_delay,
    }))
}
