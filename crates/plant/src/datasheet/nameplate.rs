//! `[nameplate]`: the numbers that an owner of a motor knows, in place of `[rating]`, `[winding]` and `[saturation]`.
//!
//! All numbers are checked at once, so that one message names all missing and wrong ones. The result is a data sheet
//! like any other. Missing numbers get defaults that are marked as assumed.

mod equal;
mod given;
mod numbers;
mod reader;
mod whole;

use standstill_files::sheet::{Entry, NameplateTable, SharesTable, Source, Sourced, Stated};
use standstill_quantity::unit::Share;

pub use self::equal::{ConvertibleKey, EqualNumber};
pub(super) use self::equal::{convertible_keys, equal_numbers, table};
pub(super) use self::given::stands_for;
pub use self::numbers::NameplateNumber;
pub(super) use self::reader::{known_keys, spelled_out};
use crate::{Algebraic, Core, Falls, Linear, Magnetics, Winding};

fn falls(shares: &SharesTable) -> Falls {
    Falls {
        d: shares.d.number(),
        minus_d: shares.minus_d.as_ref().map(Sourced::number),
        q: shares.q.as_ref().map_or(0.0, Sourced::number),
    }
}

/// Returns the core. Nothing is known of one whose saturation is not given: it is linear.
pub(super) fn core(nameplate: &NameplateTable, winding: &Winding, magnet_flux: f64) -> Option<Core> {
    let Some(saturation) = &nameplate.saturation else {
        return Some(Core::Linear(Linear::from_winding(winding, magnet_flux)));
    };
    let inductance = [nameplate.d_axis_inductance.number(), nameplate.q_axis_inductance.number()];
    let rated_current = nameplate.rated_current.number();
    Algebraic::falling(inductance, magnet_flux, rated_current, falls(saturation)).ok().map(Core::Algebraic)
}

/// Returns the default of the decrease of L_d at rated current along −d; none if it is given.
fn assumed_minus_d(nameplate: &NameplateTable) -> Option<f64> {
    let winding = Winding { mean_inductance: 0.0, saliency: 0.0, leakage: 0.0 };
    let core = core(nameplate, &winding, nameplate.magnet_flux.number())?;
    let at = standstill_interface::Dq::new(-nameplate.rated_current.number(), 0.0);
    let inductance = core.current_and_inverse_inductance(core.flux_at(at).ok()?).1.inverse().xx;
    Some(1.0 - inductance / nameplate.d_axis_inductance.number())
}

pub(super) fn entries(nameplate: &NameplateTable) -> Vec<Entry> {
    let NameplateTable { pole_pairs, resistance, d_axis_inductance, q_axis_inductance, .. } = nameplate;
    let NameplateTable { magnet_flux, rated_current, dc_link, power, .. } = nameplate;
    let NameplateTable { rated_speed, rated_torque, leakage, .. } = nameplate;
    let numbers: [(&str, &dyn Stated); 11] = [
        ("pole_pairs", pole_pairs),
        ("resistance", resistance),
        ("L_d", d_axis_inductance),
        ("L_q", q_axis_inductance),
        ("magnet_flux", magnet_flux),
        ("rated_current", rated_current),
        ("dc_link", dc_link),
        ("power", power),
        ("rated_speed", rated_speed),
        ("rated_torque", rated_torque),
        ("leakage", leakage),
    ];
    let mut entries: Vec<Entry> =
        numbers.into_iter().filter_map(|(key, number)| number.entry("nameplate", key)).collect();
    let percent = |key: &str, value: f64, source: Source, reason: &str| Entry {
        key: format!("nameplate.saturation.{key}"),
        value: format!("{} %", standstill_quantity::rounded((1e4 * value).round() * 1e-4, 2)),
        source,
        reason: reason.to_owned(),
    };
    let share =
        |key: &str, from: &Sourced<Share>| percent(key, from.number(), from.source, from.reason.trim());
    let Some(saturation) = &nameplate.saturation else {
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
        None => assumed_minus_d(nameplate).map(|fall| {
            let reason =
                "follows from d in iron that saturates alike either way, with the sixth power of its flux";
            percent("minus_d", fall, Source::Inferred, reason)
        }),
    });
    entries.extend(saturation.q.as_ref().map(|from| share("q", from)));
    entries
}
