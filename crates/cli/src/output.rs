//! The folder of results: complete files or none.
//!
//! Files are written into a hidden folder inside the target and renamed into place when all are complete, so
//! that a failure half way leaves what was there before.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use crate::error::Error;

/// A folder in the making.
pub struct Output {
    target: PathBuf,
    staging: TempDir,
    /// The topmost folder that had to be made; removed again if nothing comes of it.
    made: Option<PathBuf>,
    names: Vec<String>,
    done: bool,
}

impl Output {
    /// Makes the folder if need be and checks that files of these names can be put into it.
    pub fn create(target: &Path, names: &[&str]) -> Result<Self, Error> {
        // The nearest thing that exists must be a folder: whatever is made below it can be removed again.
        let nearest = target.ancestors().find(|path| path.symlink_metadata().is_ok());
        if let Some(nearest) = nearest
            && !nearest.is_dir()
        {
            return Err(Error::InTheWay { path: nearest.to_owned(), is: "a file", needed: "a folder" });
        }
        for name in names {
            let path = target.join(name);
            if path.is_dir() {
                return Err(Error::InTheWay { path, is: "a folder", needed: "free for a file" });
            }
        }
        let made = target
            .ancestors()
            .take_while(|path| !path.as_os_str().is_empty() && !path.exists())
            .last()
            .map(Path::to_owned);
        let prepare = || {
            fs::create_dir_all(target)?;
            tempfile::Builder::new().prefix(".standstill-").tempdir_in(target)
        };
        match prepare() {
            Ok(staging) => {
                Ok(Self { target: target.to_owned(), staging, made, names: Vec::new(), done: false })
            }
            Err(error) => {
                if let Some(made) = made {
                    let _ = fs::remove_dir_all(made);
                }
                Err(Error::Write(target.to_owned(), error))
            }
        }
    }

    /// Begins a file; it must be closed with [`Output::close`].
    pub fn begin(&mut self, name: &str) -> Result<BufWriter<File>, Error> {
        let file =
            File::create(self.staging.path().join(name)).map_err(Error::writing(&self.target.join(name)))?;
        self.names.push(name.to_owned());
        Ok(BufWriter::new(file))
    }

    /// Ends a file: only here does a full disk show.
    pub fn close(&self, name: &str, mut file: BufWriter<File>) -> Result<(), Error> {
        file.flush().map_err(Error::writing(&self.target.join(name)))
    }

    /// A whole file at once.
    pub fn file(&mut self, name: &str, content: &[u8]) -> Result<(), Error> {
        let mut file = self.begin(name)?;
        file.write_all(content).map_err(Error::writing(&self.target.join(name)))?;
        self.close(name, file)
    }

    /// Moves all files into place; returns their names.
    pub fn finish(mut self) -> Result<Vec<String>, Error> {
        for name in &self.names {
            let path = self.target.join(name);
            fs::rename(self.staging.path().join(name), &path).map_err(Error::writing(&path))?;
        }
        self.done = true;
        Ok(std::mem::take(&mut self.names))
    }
}

impl Drop for Output {
    fn drop(&mut self) {
        if let Some(made) = self.made.take().filter(|_| !self.done) {
            let _ = fs::remove_dir_all(made);
        }
    }
}
