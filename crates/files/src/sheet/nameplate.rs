//! `[nameplate]`: a motor as its owner has it.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use standstill_quantity::Quantity;
use standstill_quantity::unit::{Ampere, Henry, Ohm, One, Share, Volt, Watt, Weber};
use toml::{Table, Value};

use super::Sourced;
use crate::table::{TableError, read_keyed};

/// What a motor's owner knows of it. Currents are peak values of a phase, resistance and inductances those of one phase
/// (half of what is measured between two terminals), the magnet's flux the peak of a phase's voltage over the electrical
/// speed in rad/s. Plain values will do.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NameplateTable {
    pub pole_pairs: Sourced<One>,
    pub resistance: Sourced<Ohm>,
    /// Without current, along the magnet.
    #[serde(rename = "L_d")]
    pub d_axis_inductance: Sourced<Henry>,
    /// Without current, across it.
    #[serde(rename = "L_q")]
    pub q_axis_inductance: Sourced<Henry>,
    pub magnet_flux: Sourced<Weber>,
    pub rated_current: Sourced<Ampere>,
    pub dc_link: Sourced<Volt>,
    pub power: Option<Sourced<Watt>>,
    pub leakage: Option<Sourced<Henry>>,
    #[schemars(schema_with = "shares_schema")]
    pub saturation: Option<SharesTable>,
}

/// By what share the inductances fall at rated current.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SharesTable {
    /// L_d with a current along the magnet.
    pub d: Sourced<Share>,
    /// L_d with a current against it.
    pub minus_d: Option<Sourced<Share>>,
    /// L_q with a current across it.
    pub q: Option<Sourced<Share>>,
}

/// A plain share is that of d.
fn shares_schema(generator: &mut SchemaGenerator) -> Schema {
    let (plain, table) = (Quantity::<Share>::json_schema(generator), SharesTable::json_schema(generator));
    json_schema!({ "anyOf": [plain, table] })
}

impl SharesTable {
    /// From a table of TOML.
    ///
    /// # Errors
    /// The key that is wrong, and what was found and is needed there.
    pub fn read(table: Table) -> Result<Self, TableError> {
        read_keyed(Value::Table(table))
    }
}
