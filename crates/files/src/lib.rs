//! Input files of a run: the only way to read files, flux maps of every format, and tables of TOML as typed values.
//!
//! This crate does not judge motors: `standstill-plant` makes motors from these tables and maps.
//!
//! * [`Files`]: the files of a run. Each file is read once and noted with its [`Digest`].
//! * [`MapSamples`]: a flux map as in its file (CSV, NumPy, MATLAB).
//! * [`sheet`]: the tables of a motor's data sheet, each number with its source.
//! * [`read_keyed`]: a table as a typed value; an error names the key that is wrong.
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the C library"))]

mod files;
mod import;
pub mod sheet;
mod table;

pub use files::{Digest, Files, MOST_BYTES, open, open_as, read_at_most, read_text, remedy};
pub use import::{MapError, MapLayout, MapPoint, MapSamples, MapValues, Place};
pub use table::{TableError, in_words, key_span, line_of, quoted, read_keyed, syntax};

/// The examples of the README run too.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
