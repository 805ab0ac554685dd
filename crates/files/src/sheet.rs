//! What a motor's data sheet says, table by table: its keys and their kinds, and nothing of what a motor must be.
#![allow(missing_docs, reason = "fields are the keys of the files; docs/reference.md says what each is")]

mod map;
mod nameplate;
mod sourced;

use schemars::JsonSchema;
use serde::Deserialize;
use standstill_quantity::unit::{
    Ampere, Celsius, Degree, Henry, KilogramSquareMetre, NewtonMetre, NewtonMetreSecond, Ohm, One, PerKelvin,
    RevolutionsPerMinute, Second, Share, Volt, Watt, Weber,
};
use toml::{Table, Value};

pub use self::map::{Beyond, MapTable, SourcedFile};
pub use self::nameplate::{NameplateTable, SharesTable, WrittenNameplate};
pub use self::sourced::{PLAIN, Source, Sourced};
use crate::table::{TableError, lacking, read_keyed};

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RatingTable {
    pub power: Option<Sourced<Watt>>,
    pub speed: Option<Sourced<RevolutionsPerMinute>>,
    pub torque: Option<Sourced<NewtonMetre>>,
    pub current: Sourced<Ampere>,
    pub dc_link: Option<Sourced<Volt>>,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WindingTable {
    pub pole_pairs: Sourced<One>,
    pub resistance: Sourced<Ohm>,
    pub mean_inductance: Option<Sourced<Henry>>,
    pub saliency: Option<Sourced<Henry>>,
    pub leakage: Option<Sourced<Henry>>,
    pub magnet_flux: Option<Sourced<Weber>>,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SaturationTable {
    pub a_d0: Sourced<One>,
    pub a_dd: Sourced<One>,
    pub s: Sourced<One>,
    pub a_q0: Sourced<One>,
    pub a_qq: Sourced<One>,
    pub t: Sourced<One>,
    pub a_dq: Sourced<One>,
    pub u: Sourced<One>,
    pub v: Sourced<One>,
    pub i_f: Sourced<Ampere>,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BridgeTable {
    pub a_b: Sourced<One>,
    pub a_bp: Sourced<One>,
    pub k_q: Sourced<One>,
    pub psi_n: Sourced<Weber>,
    pub w: Sourced<One>,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RotorTable {
    pub inertia: Sourced<KilogramSquareMetre>,
    pub stiction: Sourced<NewtonMetre>,
    pub coulomb: Sourced<NewtonMetre>,
    pub viscous: Sourced<NewtonMetreSecond>,
    pub brake_backlash: Option<Sourced<Degree>>,
    pub cogging_torque: Option<Sourced<NewtonMetre>>,
    pub cogging_periods: Option<Sourced<One>>,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HarmonicsTable {
    pub inductance_4: Option<Sourced<Henry>>,
    pub asymmetry: Option<Sourced<Henry>>,
    pub flux_5: Option<Sourced<Weber>>,
    pub flux_7: Option<Sourced<Weber>>,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EddyTable {
    pub time_constant: Sourced<Second>,
    pub d_depth: Sourced<One>,
    pub q_depth: Sourced<One>,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ThermalTable {
    pub reference: Sourced<Celsius>,
    pub winding_coefficient: Sourced<PerKelvin>,
    pub magnet_coefficient: Sourced<PerKelvin>,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HysteresisTable {
    pub coercive_current: Sourced<Ampere>,
    pub depth: Sourced<Share>,
    pub cells: Sourced<One>,
}

/// A motor as its file states it. Without a `[saturation]` table the core is linear; a `[bridge]` table adds the
/// iron bridges of a magnet-assisted reluctance rotor to it; a `[map]` is a core by itself, from which `[winding]` may take
/// all inductances. A `[nameplate]` takes the place of `[rating]`, `[winding]` and the core, and of the rotor where there is
/// none. `[harmonics]`, `[eddy]`, `[hysteresis]` and `[thermal]` may be left out. Currents and fluxes are peak values of
/// a phase.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sheet {
    pub name: String,
    #[serde(default = "untitled")]
    pub title: String,
    #[serde(default)]
    pub notes: String,
    pub rating: RatingTable,
    pub winding: WindingTable,
    #[schemars(with = "Option<WrittenNameplate>")]
    pub nameplate: Option<NameplateTable>,
    pub saturation: Option<SaturationTable>,
    pub bridge: Option<BridgeTable>,
    pub map: Option<MapTable>,
    pub harmonics: Option<HarmonicsTable>,
    pub eddy: Option<EddyTable>,
    pub hysteresis: Option<HysteresisTable>,
    pub thermal: Option<ThermalTable>,
    pub rotor: RotorTable,
}

fn untitled() -> String {
    "A motor by its data sheet".to_owned()
}

impl Sheet {
    /// The one place where a data sheet is read from a table. Keys that one table lacks are named all at once.
    ///
    /// # Errors
    /// The key that is wrong, and what was found and is needed there.
    pub fn read(table: Table) -> Result<Self, TableError> {
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
}
