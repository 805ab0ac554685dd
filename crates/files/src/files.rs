//! The one door through which a run reads files.

use std::collections::BTreeMap;
use std::fmt;
use std::fs::OpenOptions;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf, absolute};
use std::sync::{Arc, Mutex, PoisonError};

/// Files that a run reads, by their paths from one folder. Each file is read once. Later requests return the same
/// bytes, even if the file has changed since. Clones share the content.
///
/// ```
/// use standstill_files::Files;
///
/// let folder = tempfile::tempdir()?;
/// std::fs::write(folder.path().join("map.csv"), "i_d_A,i_q_A")?;
/// let files = Files::of(folder.path());
/// assert_eq!(files.text(&folder.path().join("map.csv"))?, "i_d_A,i_q_A");
/// assert_eq!(files.digests()["map.csv"].bytes, 11);
/// # Ok::<(), std::io::Error>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Files {
    folder: PathBuf,
    read: Arc<Mutex<BTreeMap<PathBuf, Arc<[u8]>>>>,
    sealed: bool,
    /// Folder, without symbolic links, to which further reading is restricted; none for no restriction.
    fence: Option<PathBuf>,
}

/// Digest of a file's content: its length and checksum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Digest {
    /// Length in bytes.
    pub bytes: u64,
    /// Checksum of the content.
    pub crc32: u32,
}

impl Digest {
    /// Makes the digest of these bytes, the content of a file.
    pub fn of(bytes: &[u8]) -> Self {
        Self { bytes: bytes.len() as u64, crc32: crc32fast::hash(bytes) }
    }

    /// Returns the digest of a file of any length, which is read piece by piece: tables of results have gigabytes.
    ///
    /// # Errors
    /// As [`open`].
    pub fn of_file(path: &Path) -> io::Result<Self> {
        let (mut file, mut piece) = (open(path)?, vec![0; 1 << 16]);
        let (mut hasher, mut bytes) = (crc32fast::Hasher::new(), 0);
        loop {
            let count = file.read(&mut piece)?;
            if count == 0 {
                return Ok(Self { bytes, crc32: hasher.finalize() });
            }
            hasher.update(&piece[..count]);
            bytes += count as u64;
        }
    }
}

impl fmt::Display for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} bytes, CRC-32 {:08x}", self.bytes, self.crc32)
    }
}

/// Most bytes of a file: a map of 1,024 × 1,024 points as text has some 80 MB. In memory it takes a few times that.
pub const MOST_BYTES: u64 = 128 << 20;

/// Most bytes of a data sheet or a scenario: a parser takes a hundred times as much memory.
const MOST_TEXT: usize = 4 << 20;

/// Returns the content of a file of at most `most` bytes. Devices such as `/dev/zero` and pipes are refused, because
/// reading them might never end.
///
/// # Errors
/// Those of the operating system; the path is not a regular file, or the file is larger.
pub fn read_at_most(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let file = open(path)?;
    let length = file.metadata()?.len();
    if length > most {
        return Err(too_large(length, most));
    }
    let mut bytes = Vec::new();
    // It may grow meanwhile, and files of the system (such as those of /proc) do not say how long they are.
    file.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most { Err(too_large(bytes.len() as u64, most)) } else { Ok(bytes) }
}

/// Returns the text of a file that a program wrote, such as the results of an earlier run: of at most 128 MiB.
///
/// # Errors
/// As [`read_at_most`]; the bytes are not UTF-8.
pub fn read_text(path: &Path) -> io::Result<String> {
    as_text(&read_at_most(path, MOST_BYTES)?).map(str::to_owned)
}

/// Opens a regular file, to be read piece by piece. A pipe is refused unopened, because opening one waits for its
/// writer.
///
/// # Errors
/// Those of the operating system; the path is not a regular file.
pub fn open(path: &Path) -> io::Result<std::fs::File> {
    open_as(path, OpenOptions::new().read(true))
}

/// Returns a file with an end, opened with these options: to write it or to make one that is not there.
///
/// # Errors
/// As [`open`].
pub fn open_as(path: &Path, how: &OpenOptions) -> io::Result<std::fs::File> {
    match std::fs::metadata(path) {
        Ok(kind) if kind.is_dir() => Err(io::Error::other("it is a folder; needed: a file")),
        Ok(kind) if !kind.is_file() => {
            Err(io::Error::other("it is a pipe or a device, which may have no end; needed: a file"))
        }
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        Ok(_) | Err(_) => how.open(path),
    }
}

/// Returns what to do about an error of the operating system, to be put behind the error; empty where the error says all.
pub fn remedy(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "; make room there, or write to another place"
        }
        io::ErrorKind::ReadOnlyFilesystem | io::ErrorKind::PermissionDenied => {
            "; write to another place, or allow it there"
        }
        // EIO, as Unix numbers it.
        _ if cfg!(unix) && error.raw_os_error() == Some(5) => {
            "; the disk or its connection fails: write to another place"
        }
        // Of the process (EMFILE) and of the system (ENFILE), as Unix numbers them.
        _ if cfg!(unix) && matches!(error.raw_os_error(), Some(23 | 24)) => {
            "; allow the process more open files (`ulimit -n`)"
        }
        _ => "",
    }
}

fn as_text(bytes: &[u8]) -> io::Result<&str> {
    str::from_utf8(bytes).map_err(|error| {
        let byte = error.valid_up_to() + 1;
        let found = format!("found no text (byte {byte} is not UTF-8), needed one");
        io::Error::new(io::ErrorKind::InvalidData, found)
    })
}

fn too_large(bytes: u64, most: u64) -> io::Error {
    let (unit, name) = if most < 1 << 20 { (1_u32 << 10, "KiB") } else { (1 << 20, "MiB") };
    let (bytes, most) = (bytes as f64 / f64::from(unit), most / u64::from(unit));
    io::Error::other(format!("it has {bytes:.1} {name}; needed: at most {most} {name}"))
}

impl Files {
    /// Makes an empty collection of files with paths relative to `folder`.
    pub fn of(folder: &Path) -> Self {
        Self { folder: folder.to_owned(), ..Self::default() }
    }

    /// Returns the folder from which they are named.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Returns the content of a file.
    ///
    /// # Errors
    /// Those of the operating system and of [`Files::sealed`]; a folder, a device or a pipe; and a file of more than
    /// 128 MiB.
    pub fn read(&self, path: &Path) -> io::Result<Arc<[u8]>> {
        let path = absolute(path)?;
        // A thread that panicked has either put a whole file in or none.
        let mut read = self.read.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(bytes) = read.get(&path) {
            return Ok(Arc::clone(bytes));
        }
        if self.sealed {
            return Err(io::Error::other("it was not read when the run began"));
        }
        // Whether a file elsewhere exists is nobody's business either: one message for both.
        let within = |fence: &PathBuf| path.canonicalize().is_ok_and(|path| path.starts_with(fence));
        if let Some(fence) = self.fence.as_ref().filter(|fence| !within(fence)) {
            return Err(io::Error::other(format!("there is no such file in {}", fence.display())));
        }
        let bytes: Arc<[u8]> = read_at_most(&path, MOST_BYTES)?.into();
        read.insert(path, Arc::clone(&bytes));
        Ok(bytes)
    }

    /// Returns the content of a file as text.
    ///
    /// # Errors
    /// As [`Files::read`], a text that is too long, and bytes that are not UTF-8.
    pub fn text(&self, path: &Path) -> io::Result<String> {
        let bytes = self.read(path)?;
        if bytes.len() > MOST_TEXT {
            return Err(too_large(bytes.len() as u64, MOST_TEXT as u64));
        }
        as_text(&bytes).map(str::to_owned)
    }

    /// Seals the files read so far: asking for another is an error. So the digests of a run that has begun are
    /// those of all that it reads.
    #[must_use]
    pub fn sealed(&self) -> Self {
        let read = self.read.lock().unwrap_or_else(PoisonError::into_inner).clone();
        Self { folder: self.folder.clone(), read: Arc::new(Mutex::new(read)), sealed: true, fence: None }
    }

    /// Restricts further files to those below this folder, wherever symbolic links lead: for whoever takes paths
    /// from others.
    ///
    /// # Errors
    /// A folder that is none.
    pub fn fenced(&self, folder: &Path) -> io::Result<Self> {
        Ok(Self { fence: Some(folder.canonicalize()?), ..self.clone() })
    }

    /// Digests of the files read so far, by path.
    ///
    /// ```
    /// use standstill_files::Files;
    ///
    /// let folder = tempfile::tempdir()?;
    /// let sheet = folder.path().join("motor.toml");
    /// std::fs::write(&sheet, "name = \"mine\"")?;
    /// let files = Files::of(folder.path());
    /// files.text(&sheet)?;
    /// // What a run has read is noted: with another content it would be another run.
    /// assert_eq!(files.digests().len(), 1);
    /// # Ok::<(), std::io::Error>(())
    /// ```
    pub fn digests(&self) -> BTreeMap<String, Digest> {
        let read = self.read.lock().unwrap_or_else(PoisonError::into_inner);
        let folder = absolute(&self.folder).or_else(|_| std::env::current_dir()).unwrap_or_default();
        read.iter()
            .map(|(path, bytes)| {
                let name = path.strip_prefix(&folder).unwrap_or(path).display().to_string();
                (name, Digest::of(bytes))
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_what_has_no_end_is_not_read() {
        let root = tempfile::tempdir().expect("a folder");
        let error = |path: &Path| Files::default().text(path).expect_err("must be refused").to_string();
        assert!(error(root.path()).contains("a folder"));
        if cfg!(unix) {
            assert!(error(Path::new("/dev/zero")).contains("a pipe or a device"));
        }
        let path = root.path().join("large.toml");
        let file = std::fs::File::create(&path).expect("made");
        file.set_len(5 << 20).expect("room");
        assert!(error(&path).contains("5.0 MiB; needed: at most 4 MiB"), "{}", error(&path));
        assert!(Files::default().read(&path).is_ok());
        assert_eq!(Digest::of_file(&path).expect("a file"), Digest::of(&vec![0; 5 << 20]));
        file.set_len(3 << 30).expect("room");
        let error = Files::default().read(&path).expect_err("must be refused").to_string();
        assert!(error.contains("3072.0 MiB; needed: at most 128 MiB"), "{error}");
    }

    #[test]
    fn law_a_fence_lets_nothing_in_that_lies_outside() {
        let root = tempfile::tempdir().expect("a folder");
        let inside = root.path().join("in");
        std::fs::create_dir(&inside).expect("made");
        for (path, text) in [("in/a.toml", "a"), ("secret.toml", "s"), ("known.toml", "k")] {
            std::fs::write(root.path().join(path), text).expect("written");
        }
        let files = Files::of(&inside);
        assert_eq!(files.text(&root.path().join("known.toml")).expect("there"), "k");
        let fenced = files.fenced(&inside).expect("a folder");
        assert_eq!(fenced.text(&inside.join("a.toml")).expect("inside"), "a");
        assert_eq!(fenced.text(&root.path().join("known.toml")).expect("read before"), "k");
        let refused = |path: PathBuf| fenced.text(&path).expect_err("outside").to_string();
        let there = refused(inside.join("../secret.toml"));
        assert_eq!(there, refused(root.path().join("missing.toml")), "nothing told of what exists");
        assert!(there.contains("no such file in"), "{there}");
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(root.path().join("secret.toml"), inside.join("link.toml"))
                .expect("made");
            assert!(refused(inside.join("link.toml")).contains("no such file in"));
        }
    }

    #[test]
    fn law_a_file_is_read_once_and_none_after_the_seal() {
        let root = tempfile::tempdir().expect("a folder");
        let path = root.path().join("a/map.csv");
        std::fs::create_dir(root.path().join("a")).expect("made");
        std::fs::write(&path, "first").expect("written");
        let files = Files::of(root.path());
        assert!(files.digests().is_empty());
        assert_eq!(files.text(&path).expect("there"), "first");
        std::fs::write(&path, "other").expect("written");
        // The same to everybody, however the path is written.
        let again = root.path().join("./a/map.csv");
        assert_eq!(files.clone().text(&again).expect("there"), "first");
        let names: Vec<String> = files.digests().into_keys().collect();
        assert_eq!(names, ["a/map.csv"]);
        // Of five bytes each, they differ in the checksum.
        let other = Files::of(root.path());
        other.read(&path).expect("there");
        let [first, second] = [&files, &other].map(|files| files.digests()["a/map.csv"]);
        assert!(first.bytes == second.bytes && first != second, "{first} {second}");
        let sealed = files.sealed();
        assert_eq!(sealed.text(&path).expect("known"), "first");
        std::fs::write(root.path().join("late"), "").expect("written");
        assert!(sealed.read(&root.path().join("late")).is_err());
        assert_eq!(files.text(&root.path().join("late")).expect("there"), "");
        assert_eq!(sealed.digests().len(), 1);
        // From beside the folder, a path leads there.
        let beside = Files::of(&root.path().join("b"));
        beside.read(&root.path().join("b/../a/map.csv")).expect_err("no folder b");
        std::fs::create_dir(root.path().join("b")).expect("made");
        beside.read(&root.path().join("b/../a/map.csv")).expect("there");
        assert!(beside.digests().contains_key("../a/map.csv"), "{:?}", beside.digests());
    }
}
