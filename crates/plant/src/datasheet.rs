//! Motor data sheets: TOML in which each number states its source.

mod check;
mod entries;
mod error;
mod extras;
mod nameplate;

use std::path::Path;
use std::sync::Arc;

pub use standstill_files::sheet::Entry;
use standstill_files::sheet::{Beyond, Sheet};
use standstill_files::{Files, MapError, MapLayout, MapSamples, TableError, line_of, syntax};
use toml::{Table, Value};

pub use self::error::MotorError;
use self::error::{of_file, wrong};
pub use self::nameplate::{ConvertibleKey, EqualNumber, NameplateNumber};
use crate::{FluxMap, MapReport};

/// A motor as described by its file. Without a `[saturation]` table the core is linear. A `[bridge]` table adds the
/// iron bridges of a magnet-assisted reluctance rotor to the core. A `[map]` is a core by itself, from which
/// `[winding]` may take all inductances. A `[nameplate]` replaces `[rating]`, `[winding]` and the core, and also the
/// rotor if no rotor is given.
#[derive(Clone, Debug)]
pub struct DataSheet {
    /// The file, or the built-in's name.
    file: String,
    /// The file's text, for line numbers; empty of a sheet that is none.
    text: Arc<str>,
    /// Through which its map is read.
    files: Files,
    /// Numbers that a nameplate left out, as assumed.
    assumed: Vec<Entry>,
    /// The tables of the file.
    tables: Sheet,
}

impl DataSheet {
    /// Converts numbers of a `[nameplate]`, such as `Kv` and `pole_pairs`, to all ways in which data sheets and
    /// controllers give them.
    ///
    /// # Errors
    /// An unknown key, a value that is not a valid number, a number given twice, or a constant per turn of the shaft
    /// without pole pairs; one message names all mistakes.
    ///
    /// ```
    /// use standstill_plant::DataSheet;
    ///
    /// let all = DataSheet::equal_numbers([("pole_pairs", "7"), ("Kv", "900 rpm/V")])?;
    /// let flux = all.iter().find(|number| number.key == Some("magnet_flux")).ok_or("a flux")?;
    /// assert!((flux.value - 0.875e-3).abs() < 1e-6);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn equal_numbers<'a>(
        given: impl IntoIterator<Item = (&'a str, &'a str)>,
    ) -> Result<Vec<EqualNumber>, MotorError> {
        nameplate::equal_numbers(&nameplate::table(given))
    }

    /// The keys that [`DataSheet::equal_numbers`] takes, `pole_pairs` first, then those of each quantity together.
    ///
    /// ```
    /// use standstill_plant::DataSheet;
    ///
    /// let keys = DataSheet::convertible_keys();
    /// let way = |key: &str| keys.iter().find(|of| of.key == key).map(|of| of.way);
    /// assert_eq!(way("L_d"), way("L_q"));
    /// assert_ne!(way("Kv"), way("Ke_line_rms"));
    /// ```
    pub fn convertible_keys() -> Vec<ConvertibleKey> {
        nameplate::convertible_keys()
    }

    /// The keys of a `[nameplate]`, those that say a number in another way included.
    ///
    /// ```
    /// assert!(standstill_plant::DataSheet::nameplate_keys().contains(&"Ke_line_rms"));
    /// ```
    pub fn nameplate_keys() -> Vec<&'static str> {
        nameplate::known_keys()
    }

    /// Returns the key by which a sheet's table gives a number of its `[nameplate]` in another way; none if it does not.
    ///
    /// ```
    /// use standstill_plant::DataSheet;
    ///
    /// let sheet = toml::from_str("nameplate = { resistance_line_to_line = \"1.8 Ω\" }")?;
    /// let other = DataSheet::given_instead("nameplate.resistance", &sheet);
    /// assert_eq!(other, Some("resistance_line_to_line"));
    /// assert_eq!(DataSheet::given_instead("nameplate.L_d", &sheet), None);
    /// # Ok::<(), toml::de::Error>(())
    /// ```
    pub fn given_instead(key: &str, sheet: &Table) -> Option<&'static str> {
        nameplate::stands_for(key, sheet)
    }

    /// Reads a data sheet from the text of a file; `file`: its name for error messages.
    ///
    /// ```
    /// use standstill_plant::DataSheet;
    ///
    /// let sheet = DataSheet::parse(
    ///     "pump.toml",
    ///     r#"
    ///     name = "pump"
    ///     [nameplate]
    ///     pole_pairs = 3
    ///     resistance = "0.9 Ω"
    ///     L_d = "9 mH"
    ///     L_q = "12 mH"
    ///     magnet_flux = "0.3 Wb"
    ///     rated_current = "8 A"
    ///     dc_link = "550 V"
    ///     saturation = "6 %"
    ///     "#,
    /// )?;
    /// let motor = sheet.motor()?;
    /// assert!((motor.winding.d_axis_inductance() - 9e-3).abs() < 1e-9);
    /// // What the nameplate does not say is assumed, and named.
    /// assert!(sheet.assumed().iter().any(|entry| entry.key.contains("inertia")));
    /// // What cannot be is refused with its file and key.
    /// let error = DataSheet::parse("pump.toml", "[nameplate]\nresistance = \"9 mH\"").unwrap_err().to_string();
    /// assert!(error.contains("pump.toml") && error.contains("resistance"), "{error}");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn parse(file: &str, text: &str) -> Result<Self, MotorError> {
        let format = |message| MotorError::Format { file: file.to_owned(), message };
        let table = text.parse::<Table>().map_err(|error| {
            let line = error.span().map(|span| format!("line {}: ", line_of(text, span.start)));
            format(line.unwrap_or_default() + &syntax(text, &error))
        })?;
        if table.contains_key("nameplate") {
            return Self::of_nameplate(file, &table, Some(text));
        }
        Self::of_tables(Sheet::read(table).map_err(|error| of_file(&error, file, text))?, file, text)
    }

    /// Reads a data sheet from the table of a file or scenario. `file`: its path, for messages and as the base of the
    /// path of a flux map.
    pub fn read(file: &str, from: Table) -> Result<Result<Self, MotorError>, TableError> {
        Ok(Self::of_tables(Sheet::read(from)?, file, ""))
    }

    /// Reads a data sheet from a table with a `[nameplate]`; the error names all missing and wrong keys. `text`: text
    /// of the file, for line numbers.
    pub fn of_nameplate(file: &str, table: &Table, text: Option<&str>) -> Result<Self, MotorError> {
        let whole = nameplate::spelled_out(file, table, text)?;
        let text = text.unwrap_or_default();
        let tables = Sheet::read(whole).map_err(|error| of_file(&error, file, text))?;
        let sheet = Self::of_tables(tables, file, text)?;
        // A plain number stands for all that could stand below it.
        let stated = |key: &str| {
            let mut place = Some(&Value::Table(table.clone()));
            let stood_for = nameplate::stands_for(key, table);
            stood_for.is_some()
                || key.split('.').all(|part| match place {
                    Some(Value::Table(below)) => {
                        place = below.get(part);
                        place.is_some()
                    }
                    _ => true,
                })
        };
        // A saturation of one number is that of d.
        let saturation = table.get("nameplate").and_then(|of| of.get("saturation"));
        let is_one =
            saturation.is_some_and(|of| of.as_table().is_none_or(|shares| shares.contains_key("value")));
        let stated = |key: &str| match key.strip_prefix("nameplate.saturation.").filter(|_| is_one) {
            Some(share) => share == "d",
            None => stated(key),
        };
        // Saturation that is not given is not assumed either: nothing is known of it.
        let missing = |key: &str| !stated(key) && key != "nameplate.saturation";
        let assumed = sheet.entries().into_iter().filter(|entry| missing(&entry.key)).collect();
        Ok(Self { assumed, ..sheet })
    }

    /// Returns the numbers that a nameplate left out, with the values assumed for them.
    pub fn assumed(&self) -> &[Entry] {
        &self.assumed
    }

    fn of_tables(tables: Sheet, file: &str, text: &str) -> Result<Self, MotorError> {
        let printable = |c: char| c.is_ascii_alphanumeric() || "-_. ".contains(c);
        if tables.name.is_empty() || tables.name.len() > 60 || !tables.name.chars().all(printable) {
            let found = format!("{:?}", tables.name.chars().take(60).collect::<String>());
            let needed = "1 to 60 letters, digits, spaces, dots, dashes or underscores".to_owned();
            return Err(wrong((file, text), "name", found, needed));
        }
        let (file, text) = (file.to_owned(), text.into());
        Ok(Self { file, text, files: Files::default(), assumed: Vec::new(), tables })
    }

    /// Sets the door through which the map is read.
    #[must_use]
    pub fn with_files(self, files: &Files) -> Self {
        Self { files: files.clone(), ..self }
    }

    /// Returns the name of the motor.
    pub fn name(&self) -> &str {
        &self.tables.name
    }

    /// Returns the tables of the file, to be changed; [`Self::motor`] judges them.
    pub const fn tables_mut(&mut self) -> &mut Sheet {
        &mut self.tables
    }

    /// Returns the rated current of a phase in A, peak, as the data sheet states it; [`Self::motor`] judges it.
    ///
    /// ```
    /// let sheet = standstill_plant::DataSheet::built_in("paper-5k5").expect("built in");
    /// assert_eq!(sheet.rated_current(), 8.0);
    /// ```
    pub fn rated_current(&self) -> f64 {
        self.tables.rating.current.number()
    }

    /// Returns the description of the motor, in a line.
    pub fn title(&self) -> &str {
        &self.tables.title
    }

    /// Returns the notes for the motor's user.
    pub fn notes(&self) -> &str {
        &self.tables.notes
    }

    /// Returns the motor's flux map, if it has one, and the report of its check. Its path is relative to the data
    /// sheet.
    pub fn map(&self) -> Result<Option<(FluxMap, MapReport)>, MapError> {
        let Some(table) = &self.tables.map else { return Ok(None) };
        let folder = Path::new(&self.file).parent().unwrap_or_else(|| Path::new(""));
        let layout = MapLayout { values: table.values, columns: table.columns.clone() };
        let samples = MapSamples::read_as(&folder.join(table.file.name()), &self.files, &layout)?;
        match table.beyond {
            Some(Beyond::Fitted) => FluxMap::continued(&samples),
            None => FluxMap::new(&samples),
        }
        .map(Some)
    }
}
