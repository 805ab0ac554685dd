//! `standstill init` and `standstill schema`: to write scenario files with.

use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};

use standstill_campaign::file;

use crate::Report;
use crate::arguments::Init;
use crate::error::Error;

/// An example with every key.
pub const SCENARIO: &str = include_str!("init/scenario.toml");

pub fn run(options: &Init) -> Result<Report, Error> {
    let path = &options.file;
    let file = OpenOptions::new().write(true).create_new(true).open(path);
    let mut file = file.map_err(|error| match error.kind() {
        ErrorKind::AlreadyExists => {
            Error::InTheWay { path: path.clone(), is: "there already", needed: "a new file" }
        }
        _ => Error::Write(path.clone(), error),
    })?;
    file.write_all(SCENARIO.as_bytes()).map_err(|error| {
        // A file that is not whole would be in the way of the next try.
        let _ = std::fs::remove_file(path);
        Error::Write(path.clone(), error)
    })?;
    let path = path.display();
    Ok(Report { text: format!("{path} is written. Run it with\n  standstill run {path}\n"), code: 0 })
}

pub fn schema() -> Report {
    Report { text: format!("{:#}\n", file::schema()), code: 0 }
}
