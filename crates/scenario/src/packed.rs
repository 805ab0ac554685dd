//! A scenario together with the files that it needs, for programs that carry a scenario with them, such as FMUs.

use std::path::Path;
use std::sync::Arc;

use super::document::{Document, FileError};
use super::motor::map_of;

/// The text of a scenario with the files that the text names. Text and files must be written to the same folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Packed {
    /// Text of the scenario, which contains the motor's whole data sheet.
    pub text: String,
    /// Names and contents of the files: the motor's flux map, if there is one.
    pub files: Vec<(String, Arc<[u8]>)>,
}

impl Document {
    /// Packs motor, drive, sensors and rotor of a document into one text, together with the files that this text names. The detector is
    /// left out.
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
    /// The motor cannot be read, or TOML cannot write a value.
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
