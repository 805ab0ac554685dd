//! A scenario that needs no file elsewhere: for programs that carry one with them.

use std::path::Path;
use std::sync::Arc;

use super::document::{Document, FileError};
use super::motor::map_of;

/// A scenario's text and the files that it names, which go into one folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Packed {
    /// The scenario, with the motor's whole data sheet in place.
    pub text: String,
    /// Names and contents of the files: the motor's flux map, if it has one.
    pub files: Vec<(String, Arc<[u8]>)>,
}

impl Document {
    /// Motor, drive, sensors and rotor of a document, in one text with the files that it names; its detector stays behind.
    ///
    /// ```
    /// use standstill_scenario::Document;
    ///
    /// let text = "motor = \"low-inertia\"\ninverter.dead_time = \"1 us\"\ndetector.method = \"bipolar\"";
    /// let packed = Document::parse("s.toml".as_ref(), text)?.packed()?;
    /// assert!(packed.text.contains("[motor.winding") && !packed.text.contains("bipolar"));
    /// assert!(packed.files.is_empty());
    /// # Ok::<(), standstill_scenario::FileError>(())
    /// ```
    ///
    /// # Errors
    /// A motor that cannot be read, and values that a text cannot have.
    pub fn packed(&self) -> Result<Packed, FileError> {
        let mut document = self.clone();
        document.remove("detector");
        let file = document.load_single()?;
        let mut sheet = file.motor.resolved(self.files()).map_err(|error| self.locate(error))?;
        let mut files = Vec::new();
        if let Some(map) = map_of(&mut sheet) {
            let path = Path::new(map.as_str());
            let read = self
                .files()
                .read(path)
                .map_err(|error| FileError::Read { file: path.to_owned(), error: error.to_string() })?;
            let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
            let name = extension.map_or_else(|| "map".to_owned(), |extension| format!("map.{extension}"));
            files.push((name.clone(), read));
            *map = name;
        }
        document.resolve_motor(sheet);
        let text = toml::to_string(&document.table)
            .map_err(|error| FileError::key("scenario", &error.to_string(), "values that TOML has"))?;
        Ok(Packed { text, files })
    }
}
