//! `[nameplate]`: a motor as its owner has it, in place of `[rating]`, `[winding]` and `[saturation]`.
//!
//! What stands there is checked at once, so that all that is missing or wrong is named together, and becomes a data sheet
//! like any other: what was left out has a default that says that it is assumed.

mod reader;
mod whole;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use standstill_quantity::Quantity;
use standstill_quantity::unit::{Ampere, Henry, Ohm, One, Share, Volt, Watt, Weber};

pub(super) use self::reader::spelled_out;
use super::{Entry, Source, Sourced, entry};
use crate::{Algebraic, Core, Falls, Linear, Magnetics, Winding};

/// What a motor's owner knows of it. Currents are peak values of a phase, resistance and inductances those of one phase
/// (half of what is measured between two terminals), the magnet's flux the peak of a phase's voltage over the electrical
/// speed in rad/s. Plain values will do.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct NameplateTable {
    pole_pairs: Sourced<One>,
    resistance: Sourced<Ohm>,
    /// Without current, along the magnet.
    #[serde(rename = "L_d")]
    d_axis_inductance: Sourced<Henry>,
    /// Without current, across it.
    #[serde(rename = "L_q")]
    q_axis_inductance: Sourced<Henry>,
    magnet_flux: Sourced<Weber>,
    rated_current: Sourced<Ampere>,
    dc_link: Sourced<Volt>,
    power: Option<Sourced<Watt>>,
    leakage: Option<Sourced<Henry>>,
    #[schemars(schema_with = "shares_schema")]
    saturation: Option<SharesTable>,
}

/// By what share the inductances fall at rated current.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct SharesTable {
    /// L_d with a current along the magnet.
    d: Sourced<Share>,
    /// L_d with a current against it.
    minus_d: Option<Sourced<Share>>,
    /// L_q with a current across it.
    q: Option<Sourced<Share>>,
}

/// A plain share is that of d.
fn shares_schema(generator: &mut SchemaGenerator) -> Schema {
    let (plain, table) = (Quantity::<Share>::json_schema(generator), SharesTable::json_schema(generator));
    json_schema!({ "anyOf": [plain, table] })
}

impl SharesTable {
    fn falls(&self) -> Falls {
        Falls {
            d: self.d.value.value(),
            minus_d: self.minus_d.as_ref().map(|share| share.value.value()),
            q: self.q.as_ref().map_or(0.0, |share| share.value.value()),
        }
    }
}

impl NameplateTable {
    /// The core. Nothing is known of one whose saturation is not given: it is linear.
    pub(super) fn core(&self, winding: &Winding, magnet_flux: f64) -> Option<Core> {
        let Some(saturation) = &self.saturation else {
            return Some(Core::Linear(Linear::from_winding(winding, magnet_flux)));
        };
        let inductance = [self.d_axis_inductance.value.value(), self.q_axis_inductance.value.value()];
        let rated_current = self.rated_current.value.value();
        Algebraic::falling(inductance, magnet_flux, rated_current, saturation.falls())
            .ok()
            .map(Core::Algebraic)
    }

    /// L_d's fall at rated current along −d, where it is not given.
    fn assumed_minus_d(&self) -> Option<f64> {
        let winding = Winding { mean_inductance: 0.0, saliency: 0.0, leakage: 0.0 };
        let core = self.core(&winding, self.magnet_flux.value.value())?;
        let at = standstill_interface::Dq::new(-self.rated_current.value.value(), 0.0);
        let inductance = core.current_and_inverse_inductance(core.flux_at(at).ok()?).1.inverse().xx;
        Some(1.0 - inductance / self.d_axis_inductance.value.value())
    }

    pub(super) fn entries(&self) -> Vec<Entry> {
        let table = "nameplate";
        let mut entries = vec![
            entry(table, "pole_pairs", &self.pole_pairs),
            entry(table, "resistance", &self.resistance),
            entry(table, "L_d", &self.d_axis_inductance),
            entry(table, "L_q", &self.q_axis_inductance),
            entry(table, "magnet_flux", &self.magnet_flux),
            entry(table, "rated_current", &self.rated_current),
            entry(table, "dc_link", &self.dc_link),
        ];
        entries.extend(self.power.as_ref().map(|from| entry(table, "power", from)));
        entries.extend(self.leakage.as_ref().map(|from| entry(table, "leakage", from)));
        let percent = |key: &str, value: f64, source: Source, reason: &str| Entry {
            key: format!("nameplate.saturation.{key}"),
            value: format!("{} %", standstill_quantity::rounded((1e4 * value).round() * 1e-4, 2)),
            source,
            reason: reason.to_owned(),
        };
        let share = |key: &str, from: &Sourced<Share>| {
            percent(key, from.value.value(), from.source, from.reason.trim())
        };
        let Some(saturation) = &self.saturation else {
            entries.push(Entry {
                key: "nameplate.saturation".to_owned(),
                value: "not given".to_owned(),
                source: Source::Assumed,
                reason: "none: without it the pole cannot be judged".to_owned(),
            });
            return entries;
        };
        entries.push(share("d", &saturation.d));
        entries.extend(match &saturation.minus_d {
            Some(from) => Some(share("minus_d", from)),
            None => self.assumed_minus_d().map(|fall| {
                let reason = "follows from d in iron that saturates alike either way, with the sixth power of its flux";
                percent("minus_d", fall, Source::Assumed, reason)
            }),
        });
        entries.extend(saturation.q.as_ref().map(|from| share("q", from)));
        entries
    }
}
