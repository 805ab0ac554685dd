//! Parts of an image: the library and all libraries that it needs, except those of the C library, which exist once in
//! the program. The search is that of the loader, and all parts are read before any of their code runs.
//!
//! Each image has separate copies of all parts. The loader treats libraries of equal names as the same library, so
//! copies get unique names, which are written into their bytes.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::elf::Elf;
use crate::library::LoadError;

/// Reads a file that is part of a run.
pub type Read<'a> = &'a dyn Fn(&Path) -> io::Result<Arc<[u8]>>;

/// A library of an image.
#[derive(Clone, Debug)]
pub struct Part {
    /// Path of the file.
    pub path: PathBuf,
    pub bytes: Arc<[u8]>,
    pub elf: Elf,
    /// The name by which others need it; nothing for the detector's own.
    pub name: Option<String>,
    /// Whether it is part of the run's identity: not a compiler's, from a folder of the system.
    pub is_of_run: bool,
}

/// The C library and its companions, which exist once in the program.
#[rustfmt::skip]
const OF_PROGRAM: [&str; 16] = [
    "libc.so", "libm.so", "libgcc_s.so", "libpthread.so", "libdl.so", "librt.so", "libutil.so", "libmvec.so", "libresolv.so",
    "ld-linux", "linux-vdso",
    // What checks a whole program.
    "libasan.so", "libubsan.so", "liblsan.so", "libtsan.so", "libclang_rt.",
];

/// Runtime libraries of compilers.
const OF_COMPILER: [&str; 5] = ["libstdc++.so", "libc++.so", "libc++abi.so", "libatomic.so", "libgomp.so"];

/// Folders of the system's own libraries; those for one kind of processor are below them.
const SYSTEM: [&str; 4] = ["/lib", "/usr/lib", "/lib64", "/usr/lib64"];

/// Libraries of an image at most.
const MOST: usize = 200;

fn is_one_of(name: &str, list: &[&str]) -> bool {
    list.iter().any(|begin| name.starts_with(begin))
}

/// Returns whether there is one of this library in the program, for all images.
pub fn is_of_program(name: &str) -> bool {
    is_one_of(name, &OF_PROGRAM)
}

/// Returns all parts of an image of this library, each behind those that it needs.
///
/// # Errors
/// A library that is nowhere, and one of which no copy can be made.
pub fn of(path: &Path, bytes: &Arc<[u8]>, elf: Elf, read: Read) -> Result<Vec<Part>, LoadError> {
    let own = Part { path: path.to_owned(), bytes: Arc::clone(bytes), elf, name: None, is_of_run: true };
    let mut found = Found { copied: true, ..Found::new(read) };
    found.add(own, &[])?;
    if !found.absent.is_empty() {
        return Err(LoadError::new(
            format!("a library that is linked to {}, which cannot be loaded here", found.absent.join(", ")),
            "all libraries that it needs (ldd names them): install them, set LD_LIBRARY_PATH, or link what is yours into one file"
                .to_owned(),
        ));
    }
    Ok(found.parts)
}

/// Reads all files that a library needs that was loaded without copies.
///
/// # Errors
/// A file cannot be read.
pub fn read_all(path: &Path, bytes: &Arc<[u8]>, read: Read) -> Result<(), LoadError> {
    let elf = Elf::parse(bytes).map_err(LoadError::because)?;
    let own = Part { path: path.to_owned(), bytes: Arc::clone(bytes), elf, name: None, is_of_run: true };
    Found::new(read).add(own, &[])
}

struct Found<'a> {
    parts: Vec<Part>,
    under_way: Vec<String>,
    absent: Vec<String>,
    read: Read<'a>,
    /// Whether images are to have copies of them.
    copied: bool,
}

impl<'a> Found<'a> {
    fn new(read: Read<'a>) -> Self {
        Self { parts: Vec::new(), under_way: Vec::new(), absent: Vec::new(), read, copied: false }
    }

    /// Adds the libraries that a part needs, then the part. `inherited`: search folders of the libraries that need it.
    fn add(&mut self, part: Part, inherited: &[PathBuf]) -> Result<(), LoadError> {
        let own = part.elf.folders_of(&part.path);
        let mut first = if part.elf.folders_first { own.clone() } else { Vec::new() };
        first.extend_from_slice(inherited);
        let then = if part.elf.folders_first { &[][..] } else { &own };
        for name in &part.elf.needed {
            let known = |part: &Part| part.name.as_ref() == Some(name);
            if is_of_program(name) || self.parts.iter().any(known) || self.absent.contains(name) {
                continue;
            }
            if self.under_way.contains(name) || self.parts.len() + self.under_way.len() > MOST {
                return Err(LoadError::new(
                    format!("a library that needs {name}, which needs itself by others"),
                    "libraries that do not need each other in a circle: link them into one file".to_owned(),
                ));
            }
            let Some(other) = self.find(name, &first, then)? else {
                self.absent.push(name.clone());
                continue;
            };
            if self.copied {
                copies_of(name, &other.elf)?;
            }
            self.under_way.push(name.clone());
            self.add(other, &first)?;
            self.under_way.pop();
        }
        self.parts.push(part);
        Ok(())
    }

    /// Returns the library of a name, as the loader looks for it.
    fn find(&self, name: &str, first: &[PathBuf], then: &[PathBuf]) -> Result<Option<Part>, LoadError> {
        let given = std::env::var_os("LD_LIBRARY_PATH").unwrap_or_default();
        let given = given.to_string_lossy();
        let given = given.split([':', ';']).filter(|folder| !folder.is_empty()).map(PathBuf::from);
        let folders = first.iter().cloned().chain(given).chain(then.iter().cloned()).chain(of_system());
        let candidates: Vec<PathBuf> = if name.contains('/') {
            vec![PathBuf::from(name)]
        } else {
            folders.map(|folder| folder.join(name)).collect()
        };
        for path in candidates.into_iter().filter(|path| path.is_file()) {
            let is_of_run = !(is_one_of(name, &OF_COMPILER) && is_of_system(&path));
            let bytes = if is_of_run { (self.read)(&path) } else { std::fs::read(&path).map(Into::into) };
            let bytes: Arc<[u8]> = bytes.map_err(|error| {
                let found =
                    format!("a library that is linked to {}, which cannot be read: {error}", path.display());
                LoadError::new(found, "files that can be read".to_owned())
            })?;
            // The loader passes over what is for another processor.
            if let Ok(elf) = Elf::parse(&bytes) {
                return Ok(Some(Part { path, bytes, elf, name: Some(name.to_owned()), is_of_run }));
            }
        }
        Ok(None)
    }
}

/// Checks that copies of a library can be distinguished.
fn copies_of(name: &str, elf: &Elf) -> Result<(), LoadError> {
    if elf.thread_local > 0 && !is_one_of(name, &OF_COMPILER) {
        return Err(LoadError::new(
            format!("a library that is linked to {name}, which has thread-local memory"),
            "plain variables, which are set back before each trial".to_owned(),
        ));
    }
    if name.len() < NAME || elf.places.own_name.or(elf.places.runs.first().copied()).is_none() {
        let found = format!("a library that is linked to {name}, of which no copies can be told apart");
        return Err(LoadError::new(
            found,
            format!(
                "a name of at least {NAME} letters and a SONAME (cc -shared -Wl,-soname,{name} …), or one file"
            ),
        ));
    }
    Ok(())
}

/// Returns whether a file is the system's.
fn is_of_system(path: &Path) -> bool {
    let real = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    SYSTEM.iter().any(|folder| real.starts_with(folder))
}

/// Folders in which the loader looks last: those of its configuration and the system's own.
fn of_system() -> Vec<PathBuf> {
    let mut folders = Vec::new();
    configured(Path::new("/etc/ld.so.conf"), &mut folders, 0);
    for folder in SYSTEM {
        let arch = std::env::consts::ARCH;
        folders.push(Path::new(folder).join(format!("{arch}-linux-gnu")));
        folders.push(folder.into());
    }
    folders
}

/// Appends the folders in a configuration file of the loader. The file has one folder per line, and `include` with a
/// pattern of further files.
fn configured(file: &Path, folders: &mut Vec<PathBuf>, depth: u32) {
    let text = std::fs::read_to_string(file).unwrap_or_default();
    for line in text.lines().map(|line| line.split('#').next().unwrap_or_default().trim()) {
        let Some(pattern) = line.strip_prefix("include ").map(|pattern| Path::new(pattern.trim())) else {
            if line.starts_with('/') {
                folders.push(line.into());
            }
            continue;
        };
        let (Some(folder), Some(last)) = (pattern.parent(), pattern.file_name()) else { continue };
        let last = last.to_string_lossy();
        let (begin, end) = last.split_once('*').unwrap_or((&last, ""));
        let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
            .into_iter()
            .flatten()
            .filter_map(|entry| Some(entry.ok()?.path()))
            .collect();
        files.retain(|path| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            name.starts_with(begin) && name.ends_with(end)
        });
        files.sort_unstable();
        if depth < 4 {
            for file in files {
                configured(&file, folders, depth + 1);
            }
        }
    }
}

/// Letters of a copy's name.
const NAME: usize = 6;

/// Returns a name that no copy had before, as it stands in a file: at most eight bytes with the zero at its end.
fn new_name() -> [u8; NAME + 1] {
    const LETTERS: &[u8; 62] = b"0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ";
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let mut count = COUNT.fetch_add(1, Ordering::Relaxed) as usize;
    let mut name = *b"~00000\0";
    for letter in name[1..NAME].iter_mut().rev() {
        *letter = LETTERS[count % LETTERS.len()];
        count /= LETTERS.len();
    }
    name
}

/// Tag of the entry of a dynamic section with the own name.
const SONAME: u64 = 14;
/// Tag of an entry that no loader knows.
const UNKNOWN: u64 = 0x6000_000f;

/// Offset of the ELF header's field with the position of the sections, which no loader reads.
const SPARE: usize = 40;

/// `STB_GLOBAL`, in the upper half of a symbol's byte.
const GLOBAL: u8 = 1 << 4;

/// Returns the files of another image in loading order. Each copy has a unique name, needs the copies of the same
/// image, runs no functions when it is loaded, and has its own variables, even those that are normally unique in a
/// program.
///
/// # Errors
/// Names overlap in a file.
pub fn copies(parts: &[Part]) -> Result<Vec<Vec<u8>>, LoadError> {
    let names: BTreeMap<&str, [u8; NAME + 1]> =
        parts.iter().filter_map(|part| Some((part.name.as_deref()?, new_name()))).collect();
    let copy = |part: &Part| {
        let mut bytes = part.bytes.to_vec();
        let places = &part.elf.places;
        for at in &places.unique {
            if let Some(byte) = bytes.get_mut(*at) {
                *byte = GLOBAL | (*byte & 0xf);
            }
        }
        for at in &places.runs {
            put(&mut bytes, *at, &UNKNOWN.to_le_bytes());
        }
        let mut seen: Vec<usize> = Vec::new();
        for (at, name) in &places.names {
            let Some(new) = names.get(name.as_str()).filter(|_| !seen.contains(at)) else { continue };
            if bytes.get(*at..at + name.len()) != Some(name.as_bytes()) {
                return Err(LoadError::because(format!("one in which the name {name} is part of another")));
            }
            put(&mut bytes, *at, new);
            seen.push(*at);
        }
        if let Some(name) = part.name.as_deref() {
            let entry = places.own_name.or(places.runs.first().copied()).unwrap_or_default();
            put(&mut bytes, SPARE, &names[name]);
            put(&mut bytes, entry, &SONAME.to_le_bytes());
            // Names are counted from the table of strings; the header is at the begin of what is loaded.
            put(&mut bytes, entry + 8, &(SPARE as u64).wrapping_sub(places.strings).to_le_bytes());
        }
        Ok(bytes)
    };
    parts.iter().map(copy).collect()
}

fn put(bytes: &mut [u8], at: usize, new: &[u8]) {
    if let Some(place) = bytes.get_mut(at..at + new.len()) {
        place.copy_from_slice(new);
    }
}
