//! Writing of single files: each appears complete or not at all.

use std::fs;
use std::path::Path;

use super::{Output, remove_stale};
use crate::error::Error;

/// Writes a whole file at once, so that an incomplete file never exists under this name. Replaces an existing file.
///
/// # Errors
/// The file cannot be written.
pub fn replace(path: &Path, content: &[u8]) -> Result<(), Error> {
    // A pipe or a device (/dev/stdout) gets the bytes as they come.
    if path.metadata().is_ok_and(|there| !there.is_file()) {
        return fs::write(path, content).map_err(Error::writing(path));
    }
    // The target of a link is replaced, and the link stays.
    let link = path.is_symlink().then(|| path.canonicalize().ok()).flatten();
    let (mut output, name) = beside(link.as_deref().unwrap_or(path))?;
    output.file(&name, content)?;
    if let Ok(there) = path.metadata() {
        fs::set_permissions(output.staged(&name), there.permissions()).map_err(Error::writing(path))?;
    }
    output.place().map(|_| ())
}

/// Writes a whole new file at once, so that an incomplete file never exists under this name.
///
/// # Errors
/// A file of this name exists, or the file cannot be written.
pub fn create_new(path: &Path, content: &[u8]) -> Result<(), Error> {
    let there = || Error::InTheWay { path: path.to_owned(), is: "there already", needed: "a new file" };
    remove_stale(folder_of(path));
    if path.symlink_metadata().is_ok() {
        return Err(there());
    }
    let (mut output, name) = beside(path)?;
    output.file(&name, content)?;
    // Unlike a rename, a hard link never replaces a file that another process has created meanwhile. Not every system
    // has hard links.
    match fs::hard_link(output.staged(&name), path) {
        Ok(()) => Ok(()),
        Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => Err(there()),
        Err(_) => output.place().map(|_| ()),
    }
}

/// Returns the folder of a file.
pub fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Returns an output in the folder of a file, and the file's name. The folder must exist.
///
/// # Errors
/// The folder does not exist or cannot be written, or the file's name is that of a folder.
pub fn beside(path: &Path) -> Result<(Output, String), Error> {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let folder = folder_of(path);
    if let Err(error) = folder.metadata() {
        return Err(Error::Write(path.to_owned(), error));
    }
    let output = Output::create(folder, &[&name]).map_err(|error| match error {
        // The message names the requested file, not its folder.
        Error::Write(_, error) => Error::Write(path.to_owned(), error),
        error => error,
    })?;
    Ok((output, name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_a_single_file_appears_whole_and_a_new_one_replaces_none() {
        let root = tempfile::tempdir().expect("a folder");
        let at = |name: &str| root.path().join(name);
        create_new(&at("new.toml"), b"1").expect("written");
        let refused = create_new(&at("new.toml"), b"2").expect_err("it is there").to_string();
        assert!(refused.contains("is there already"), "{refused}");
        replace(&at("new.toml"), b"3").expect("written");
        assert_eq!(fs::read(at("new.toml")).expect("there"), b"3");
        assert_eq!(fs::read_dir(root.path()).expect("a folder").count(), 1);
        let nowhere = replace(&at("nowhere/a"), b"1").expect_err("no folder").to_string();
        assert!(nowhere.contains("cannot write") && !at("nowhere").exists(), "{nowhere}");
        #[cfg(unix)]
        {
            // The file has the permissions of a user's other files, not those of a temporary file, which nobody else
            // may read.
            use std::os::unix::fs::PermissionsExt as _;
            fs::write(at("plain"), "").expect("written");
            let mode = |name: &str| fs::metadata(at(name)).expect("there").permissions().mode();
            assert_eq!(mode("new.toml"), mode("plain"));
            // A file that nobody else may read stays so.
            fs::set_permissions(at("new.toml"), fs::Permissions::from_mode(0o600)).expect("set");
            replace(&at("new.toml"), b"3").expect("written");
            assert_eq!(mode("new.toml") & 0o777, 0o600);
            // A link stays one, and a device is written and not replaced.
            std::os::unix::fs::symlink(at("plain"), at("link")).expect("linked");
            replace(&at("link"), b"4").expect("written");
            assert_eq!(fs::read(at("plain")).expect("there"), b"4");
            assert!(at("link").is_symlink());
            std::os::unix::fs::symlink("/dev/null", at("null")).expect("linked");
            replace(&at("null"), b"5").expect("written");
            assert!(!Path::new("/dev/null").metadata().expect("there").is_file() && at("null").is_symlink());
        }
    }
}
