//! `[nameplate]`: a motor as its owner has it.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use standstill_quantity::Quantity;
use standstill_quantity::unit::{
    Ampere, Henry, NewtonMetre, NewtonMetrePerAmpere, Ohm, One, RevolutionsPerMinute,
    RevolutionsPerMinuteVolt, Share, Volt, VoltPerThousandRevolutionsPerMinute, Watt, Weber,
};
use toml::{Table, Value};

use super::Sourced;
use crate::table::{TableError, read_keyed};

/// Numbers of a motor that its owner knows. Currents are peak values of a phase. Resistance and inductances are those
/// of one phase, half of the values between two terminals. The magnet's flux is the peak voltage of a phase over the
/// electrical speed in rad/s. Values may be plain numbers.
#[derive(Clone, Debug, Deserialize)]
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
    pub rated_speed: Option<Sourced<RevolutionsPerMinute>>,
    pub rated_torque: Option<Sourced<NewtonMetre>>,
    pub leakage: Option<Sourced<Henry>>,
    pub saturation: Option<SharesTable>,
}

/// The keys that may be written into a `[nameplate]`: resistance, inductances, flux and current each in one of the ways that data
/// sheets and controllers give them.
#[derive(Clone, Debug, JsonSchema)]
#[schemars(deny_unknown_fields)]
#[allow(dead_code, non_snake_case, reason = "the schema of a table that is read key by key")]
pub struct WrittenNameplate {
    pole_pairs: Sourced<One>,
    resistance: Option<Sourced<Ohm>>,
    resistance_line_to_line: Option<Sourced<Ohm>>,
    resistance_delta: Option<Sourced<Ohm>>,
    vesc_R: Option<Sourced<Ohm>>,
    L_d: Option<Sourced<Henry>>,
    L_q: Option<Sourced<Henry>>,
    L_line_to_line: Option<Sourced<Henry>>,
    L_line_to_line_min: Option<Sourced<Henry>>,
    L_line_to_line_max: Option<Sourced<Henry>>,
    L_delta: Option<Sourced<Henry>>,
    vesc_L: Option<Sourced<Henry>>,
    vesc_ld_lq_diff: Option<Sourced<Henry>>,
    magnet_flux: Option<Sourced<Weber>>,
    Kv: Option<Sourced<RevolutionsPerMinuteVolt>>,
    Ke_line_peak: Option<Sourced<VoltPerThousandRevolutionsPerMinute>>,
    Ke_line_rms: Option<Sourced<VoltPerThousandRevolutionsPerMinute>>,
    Ke_phase_peak: Option<Sourced<VoltPerThousandRevolutionsPerMinute>>,
    Ke_phase_rms: Option<Sourced<VoltPerThousandRevolutionsPerMinute>>,
    Kt_peak: Option<Sourced<NewtonMetrePerAmpere>>,
    Kt_rms: Option<Sourced<NewtonMetrePerAmpere>>,
    vesc_lambda: Option<Sourced<Weber>>,
    rated_current: Option<Sourced<Ampere>>,
    rated_current_rms: Option<Sourced<Ampere>>,
    rated_current_delta: Option<Sourced<Ampere>>,
    dc_link: Sourced<Volt>,
    power: Option<Sourced<Watt>>,
    rated_speed: Option<Sourced<RevolutionsPerMinute>>,
    rated_torque: Option<Sourced<NewtonMetre>>,
    leakage: Option<Sourced<Henry>>,
    #[schemars(schema_with = "shares_schema")]
    saturation: Option<SharesTable>,
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

/// Returns the schema of the shares: a table, or a plain share for d.
fn shares_schema(generator: &mut SchemaGenerator) -> Schema {
    let (plain, table) = (Quantity::<Share>::json_schema(generator), SharesTable::json_schema(generator));
    json_schema!({ "anyOf": [plain, table] })
}

impl SharesTable {
    /// Reads the nameplate from a table of TOML.
    ///
    /// # Errors
    /// A key is wrong; the error names it, its value and the requirement.
    pub fn read(table: Table) -> Result<Self, TableError> {
        read_keyed(Value::Table(table))
    }
}
