//! Tables of a motor's data sheet: keys and their units. Whether the numbers make a motor is judged elsewhere.
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
pub use self::sourced::{PLAIN, Source, Sourced, Stated};
use crate::table::{TableError, lacking, read_keyed};

/// A number of a data sheet for printing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Key in the file.
    pub key: String,
    /// Value with unit.
    pub value: String,
    /// Kind of source of the number.
    pub source: Source,
    /// Reason for the value.
    pub reason: String,
}

/// Tables of numbers: a struct of each, and its numbers as entries in the order of the fields.
macro_rules! tables {
    ($($name:ident { $($key:ident: $kind:ty),* $(,)? })*) => {$(
        #[derive(Clone, Debug, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            $(pub $key: $kind),*
        }

        impl $name {
            /// Returns the numbers that are given; `table` is the name of the table in the file.
            pub fn entries(&self, table: &str) -> Vec<Entry> {
                [$(self.$key.entry(table, stringify!($key))),*].into_iter().flatten().collect()
            }
        }
    )*};
}

tables! {
    RatingTable {
        power: Option<Sourced<Watt>>,
        speed: Option<Sourced<RevolutionsPerMinute>>,
        torque: Option<Sourced<NewtonMetre>>,
        current: Sourced<Ampere>,
        dc_link: Option<Sourced<Volt>>,
    }
    WindingTable {
        pole_pairs: Sourced<One>,
        resistance: Sourced<Ohm>,
        mean_inductance: Option<Sourced<Henry>>,
        saliency: Option<Sourced<Henry>>,
        leakage: Option<Sourced<Henry>>,
        magnet_flux: Option<Sourced<Weber>>,
    }
    SaturationTable {
        a_d0: Sourced<One>,
        a_dd: Sourced<One>,
        a_q0: Sourced<One>,
        a_qq: Sourced<One>,
        a_dq: Sourced<One>,
        s: Sourced<One>,
        t: Sourced<One>,
        u: Sourced<One>,
        v: Sourced<One>,
        i_f: Sourced<Ampere>,
    }
    BridgeTable {
        a_b: Sourced<One>,
        a_bp: Sourced<One>,
        k_q: Sourced<One>,
        w: Sourced<One>,
        psi_n: Sourced<Weber>,
    }
    RotorTable {
        inertia: Sourced<KilogramSquareMetre>,
        stiction: Sourced<NewtonMetre>,
        coulomb: Sourced<NewtonMetre>,
        viscous: Sourced<NewtonMetreSecond>,
        brake_backlash: Option<Sourced<Degree>>,
        cogging_torque: Option<Sourced<NewtonMetre>>,
        cogging_periods: Option<Sourced<One>>,
    }
    HarmonicsTable {
        inductance_4: Option<Sourced<Henry>>,
        asymmetry: Option<Sourced<Henry>>,
        flux_5: Option<Sourced<Weber>>,
        flux_7: Option<Sourced<Weber>>,
    }
    EddyTable {
        time_constant: Sourced<Second>,
        d_depth: Sourced<One>,
        q_depth: Sourced<One>,
    }
    ThermalTable {
        reference: Sourced<Celsius>,
        winding_coefficient: Sourced<PerKelvin>,
        magnet_coefficient: Sourced<PerKelvin>,
    }
    HysteresisTable {
        coercive_current: Sourced<Ampere>,
        depth: Sourced<Share>,
        cells: Sourced<One>,
    }
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
    /// Reads a data sheet from a table; all data sheets are read here. One error names all missing keys of a table.
    ///
    /// # Errors
    /// A key is wrong; the error names it, its value and the requirement.
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
