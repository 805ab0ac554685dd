//! Motor data sheets: TOML in which each number says where it comes from.

mod check;
mod entries;
mod error;
mod extras;
mod keyed;
mod lacking;
mod map;
mod nameplate;
mod place;
mod sourced;
mod wording;

use std::fmt;
use std::path::Path;
use std::sync::Arc;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer};
use standstill_quantity::unit::{
    Ampere, Celsius, Degree, Henry, KilogramSquareMetre, NewtonMetre, NewtonMetreSecond, Ohm, One, PerKelvin,
    Second, Volt, Watt, Weber,
};
use standstill_quantity::{Number, Quantity, Unit};
use toml::{Table, Value};

pub use self::entries::Entry;
use self::entries::entry;
pub use self::error::MotorError;
use self::error::wrong;
use self::extras::HysteresisTable;
pub use self::keyed::{TableError, read_keyed};
use self::map::{Beyond, MapTable};
use self::nameplate::NameplateTable;
pub use self::place::{key_span, line_of, quoted};
use crate::{Files, FluxMap, MapError, MapLayout, MapReport, MapSamples};

/// Where a number comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Source {
    /// Printed in the source that the data sheet names.
    Given,
    /// Estimated from a measurement, as `standstill fit` does.
    Measured,
    /// Computed from what is printed there.
    Inferred,
    /// Neither: chosen, for the reason stated.
    Assumed,
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Given => "given",
            Self::Measured => "measured",
            Self::Inferred => "inferred",
            Self::Assumed => "assumed",
        })
    }
}

/// One number of a data sheet.
#[derive(Clone, Debug)]
pub struct Sourced<U> {
    value: Quantity<U>,
    source: Source,
    reason: String,
}

impl<'de, U: Unit> Deserialize<'de> for Sourced<U> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let (value, source, reason) = sourced::read(Number(U::DIMENSION), deserializer)?;
        Ok(Self { value: Quantity::si(value), source, reason })
    }
}

impl<U: Unit> JsonSchema for Sourced<U> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        format!("Number in {}", U::SYMBOL).into()
    }

    /// A scenario may leave the source out.
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let quantity = Quantity::<U>::json_schema(generator);
        let source = Source::json_schema(generator);
        json_schema!({
            "anyOf": [quantity, {
                "type": "object",
                "properties": { "value": quantity, "source": source, "reason": { "type": "string" } },
                "required": ["value", "source", "reason"],
                "additionalProperties": false
            }]
        })
    }
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct RatingTable {
    power: Option<Sourced<Watt>>,
    current: Sourced<Ampere>,
    dc_link: Option<Sourced<Volt>>,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct WindingTable {
    pole_pairs: Sourced<One>,
    resistance: Sourced<Ohm>,
    mean_inductance: Option<Sourced<Henry>>,
    saliency: Option<Sourced<Henry>>,
    leakage: Option<Sourced<Henry>>,
    magnet_flux: Option<Sourced<Weber>>,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct SaturationTable {
    a_d0: Sourced<One>,
    a_dd: Sourced<One>,
    s: Sourced<One>,
    a_q0: Sourced<One>,
    a_qq: Sourced<One>,
    t: Sourced<One>,
    a_dq: Sourced<One>,
    u: Sourced<One>,
    v: Sourced<One>,
    i_f: Sourced<Ampere>,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct BridgeTable {
    a_b: Sourced<One>,
    a_bp: Sourced<One>,
    k_q: Sourced<One>,
    psi_n: Sourced<Weber>,
    w: Sourced<One>,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct RotorTable {
    inertia: Sourced<KilogramSquareMetre>,
    stiction: Sourced<NewtonMetre>,
    coulomb: Sourced<NewtonMetre>,
    viscous: Sourced<NewtonMetreSecond>,
    brake_backlash: Option<Sourced<Degree>>,
    cogging_torque: Option<Sourced<NewtonMetre>>,
    cogging_periods: Option<Sourced<One>>,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct HarmonicsTable {
    inductance_4: Option<Sourced<Henry>>,
    asymmetry: Option<Sourced<Henry>>,
    flux_5: Option<Sourced<Weber>>,
    flux_7: Option<Sourced<Weber>>,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct EddyTable {
    time_constant: Sourced<Second>,
    d_depth: Sourced<One>,
    q_depth: Sourced<One>,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct ThermalTable {
    reference: Sourced<Celsius>,
    winding_coefficient: Sourced<PerKelvin>,
    magnet_coefficient: Sourced<PerKelvin>,
}

/// A motor as its file states it. Without a `[saturation]` table the core is linear; a `[bridge]` table adds the
/// iron bridges of a magnet-assisted reluctance rotor to it; a `[map]` is a core by itself, from which `[winding]` may take
/// all inductances. A `[nameplate]` takes the place of `[rating]`, `[winding]` and the core, and of the rotor where there is
/// none. `[harmonics]`, `[eddy]`, `[hysteresis]` and `[thermal]` may be left out. Currents and fluxes are peak values of
/// a phase.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DataSheet {
    /// The file, or the built-in's name.
    #[serde(skip)]
    file: String,
    /// The file's text, for line numbers; empty of a sheet that is none.
    #[serde(skip)]
    text: Arc<str>,
    /// Through which its map is read.
    #[serde(skip)]
    files: Files,
    /// What a nameplate left out.
    #[serde(skip)]
    assumed: Vec<Entry>,
    name: String,
    #[serde(default = "untitled")]
    title: String,
    #[serde(default)]
    notes: String,
    rating: RatingTable,
    winding: WindingTable,
    nameplate: Option<NameplateTable>,
    saturation: Option<SaturationTable>,
    bridge: Option<BridgeTable>,
    map: Option<MapTable>,
    harmonics: Option<HarmonicsTable>,
    eddy: Option<EddyTable>,
    hysteresis: Option<HysteresisTable>,
    thermal: Option<ThermalTable>,
    rotor: RotorTable,
}

fn untitled() -> String {
    "A motor by its data sheet".to_owned()
}

impl DataSheet {
    /// From the text of a file; `file` is its name for error messages.
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
            format(line.unwrap_or_default() + &error.message().replace('\n', " "))
        })?;
        if table.contains_key("nameplate") {
            return Self::of_nameplate(file, &table, Some(text));
        }
        let sheet = Self::of_table(table).map_err(|error| error.of_file(file, text))?;
        sheet.of_file(file, text)
    }

    /// From what a file or a scenario says; `file` is where it is said, and beside which its map is looked for.
    pub fn read(file: &str, from: Table) -> Result<Result<Self, MotorError>, TableError> {
        Ok(Self::of_table(from)?.of_file(file, ""))
    }

    /// The one place where a data sheet is read from a table. Keys that one table lacks are named all at once.
    fn of_table(table: Table) -> Result<Self, TableError> {
        Self::of_values(&table).map_err(|error| match error.lacks() {
            Some(_) => lacking::all(&error, table, |tried| Self::of_values(tried).err()),
            None => error,
        })
    }

    fn of_values(table: &Table) -> Result<Self, TableError> {
        read_keyed(Value::Table(table.clone())).map_err(|TableError { key, message }| {
            // A plain number is its own value.
            TableError { key: key.strip_suffix(".value").unwrap_or(&key).to_owned(), message }
        })
    }

    /// From a table with a `[nameplate]`, whose missing and wrong keys are named all at once; `text` is that of its file,
    /// for line numbers.
    pub fn of_nameplate(file: &str, table: &Table, text: Option<&str>) -> Result<Self, MotorError> {
        let whole = nameplate::spelled_out(file, table, text)?;
        let text = text.unwrap_or_default();
        let sheet = Self::of_table(whole).map_err(|error| error.of_file(file, text))?;
        // A plain number stands for all that could stand below it.
        let stated = |key: &str| {
            let mut place = Some(&Value::Table(table.clone()));
            key.split('.').all(|part| match place {
                Some(Value::Table(below)) => {
                    place = below.get(part);
                    place.is_some()
                }
                _ => true,
            })
        };
        // Saturation that is not given is not assumed either: nothing is known of it.
        let missing = |key: &str| !stated(key) && key != "nameplate.saturation";
        let assumed = sheet.entries().into_iter().filter(|entry| missing(&entry.key)).collect();
        Self { assumed, ..sheet }.of_file(file, text)
    }

    /// What a nameplate left out, and what was assumed in its place.
    pub fn assumed(&self) -> &[Entry] {
        &self.assumed
    }

    fn of_file(self, file: &str, text: &str) -> Result<Self, MotorError> {
        let printable = |c: char| c.is_ascii_alphanumeric() || "-_. ".contains(c);
        if self.name.is_empty() || self.name.len() > 60 || !self.name.chars().all(printable) {
            let found = format!("{:?}", self.name.chars().take(60).collect::<String>());
            let needed = "1 to 60 letters, digits, spaces, dots, dashes or underscores".to_owned();
            return Err(wrong((file, text), "name", found, needed));
        }
        Ok(Self { file: file.to_owned(), text: text.into(), ..self })
    }

    /// The same sheet, whose map is read through this door.
    #[must_use]
    pub fn with_files(self, files: &Files) -> Self {
        Self { files: files.clone(), ..self }
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What the motor is.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// What its user should know.
    pub fn notes(&self) -> &str {
        &self.notes
    }

    /// The motor's flux map and what was found out about it, if it has one. Its file is looked for beside the data sheet.
    pub fn map(&self) -> Result<Option<(FluxMap, MapReport)>, MapError> {
        let Some(table) = &self.map else { return Ok(None) };
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
