//! Flux maps as files give them.

mod arrays;
mod columns;
mod csv;
mod mat;
mod npz;
mod polar;
mod wide;

use std::fmt;
use std::path::Path;

use crate::Files;

pub use columns::MapValues;

/// A point of a map as in its file: peak values, amplitude-invariant.
#[derive(Clone, Debug, PartialEq)]
pub struct MapPoint {
    /// i_d in A.
    pub i_d: f64,
    /// i_q in A.
    pub i_q: f64,
    /// ψ_d in Wb.
    pub psi_d: f64,
    /// ψ_q in Wb.
    pub psi_q: f64,
    /// Position in the file.
    pub place: Place,
}

/// Position of a point in its file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// Line of a text, from 1.
    Line(usize),
    /// Row and column of a matrix, from 1.
    Cell(usize, usize),
    /// Element of a vector, from 1.
    Element(usize),
    /// Nowhere: the map was continued there.
    Continued,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Cell(row, column) => write!(f, "row {row}, column {column}"),
            Self::Element(element) => write!(f, "element {element}"),
            Self::Continued => f.write_str("where the map was continued"),
        }
    }
}

/// Points of a file, in its own order and its own axes.
#[derive(Clone, Debug, PartialEq)]
pub struct MapSamples {
    /// The file.
    pub file: String,
    /// Points of the map.
    pub points: Vec<MapPoint>,
    /// Number of pole pairs, if the file states it.
    pub pole_pairs: Option<u32>,
    /// R in Ω, if the file states it.
    pub resistance: Option<f64>,
}

/// Layout of a file as its user states it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MapLayout {
    /// Whether currents and fluxes are peak or rms values; without it they are peak values.
    pub values: Option<MapValues>,
    /// The columns of a text in place of its header, such as `i_d_A,i_q_A,-,psi_d_mWb,psi_q_mWb`.
    pub columns: Option<String>,
}

/// Why a file is not a flux map. Where nothing but another file can help, `needed` is empty.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MapError {
    file: String,
    place: Option<String>,
    found: String,
    needed: String,
}

impl MapError {
    /// Makes the error that names the file, the place in it, the wrong content, and the requirement.
    pub fn new(
        file: &str,
        place: Option<&dyn fmt::Display>,
        found: impl Into<String>,
        needed: impl Into<String>,
    ) -> Self {
        let (found, needed) = (found.into(), needed.into());
        Self { file: file.to_owned(), place: place.map(ToString::to_string), found, needed }
    }
}

impl fmt::Display for MapError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file, place, found, needed } = self;
        match place {
            _ if needed.is_empty() => write!(f, "{file}: {found}"),
            Some(place) => write!(f, "{file}: {place}: found {found}; needed: {needed}"),
            None => write!(f, "{file}: found {found}; needed: {needed}"),
        }
    }
}

impl std::error::Error for MapError {}

impl MapSamples {
    /// Endings of the files that can be read.
    pub const EXTENSIONS: [&str; 5] = ["csv", "txt", "tsv", "npz", "mat"];

    /// Reads a file, by its ending.
    pub fn read(path: &Path, files: &Files) -> Result<Self, MapError> {
        Self::read_as(path, files, &MapLayout::default())
    }

    /// Reads a file, by its ending, with the layout that its user states.
    pub fn read_as(path: &Path, files: &Files, layout: &MapLayout) -> Result<Self, MapError> {
        let file = path.display().to_string();
        let wrong = |found: String, needed: &str| MapError::new(&file, None, found, needed);
        let extension =
            path.extension().and_then(|extension| extension.to_str()).unwrap_or_default().to_lowercase();
        if !Self::EXTENSIONS.contains(&extension.as_str()) {
            let needed = format!("one of {}", Self::EXTENSIONS.join(", "));
            return Err(wrong(format!("a file ending in `{extension}`"), &needed));
        }
        let arrays = ["npz", "mat"].contains(&extension.as_str());
        if layout.columns.is_some() && arrays {
            let needed = "a text: the arrays of other files have names";
            return Err(wrong("columns for a file of arrays".to_owned(), needed));
        }
        let bytes = files.read(path).map_err(|error| wrong(format!("cannot be read: {error}"), ""))?;
        if bytes.is_empty() && arrays {
            let needed = format!("a flux map as `{extension}` file, with its currents and fluxes");
            return Err(wrong("an empty file".to_owned(), &needed));
        }
        let samples = match extension.as_str() {
            "npz" => npz::read(&file, &bytes),
            "mat" => mat::read(&file, bytes.to_vec()),
            _ => csv::read(&file, &bytes, layout),
        }?;
        Ok(if layout.values == Some(MapValues::Rms) {
            samples.times(std::f64::consts::SQRT_2)
        } else {
            samples
        })
    }

    /// Multiplies all currents and fluxes by a factor.
    fn times(mut self, share: f64) -> Self {
        for MapPoint { i_d, i_q, psi_d, psi_q, .. } in &mut self.points {
            for value in [i_d, i_q, psi_d, psi_q] {
                *value *= share;
            }
        }
        self
    }
}
