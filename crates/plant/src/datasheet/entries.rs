//! A data sheet's numbers, ready to print.

use standstill_files::sheet::{Sheet, Source, Sourced};
use standstill_quantity::Unit;

use super::{DataSheet, nameplate};

/// One number of a data sheet, ready to print.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Its key in the file.
    pub key: String,
    /// Value with unit.
    pub value: String,
    /// Where it comes from.
    pub source: Source,
    /// Why it is what it is.
    pub reason: String,
}

pub(super) fn entry<U: Unit>(table: &str, key: &str, from: &Sourced<U>) -> Entry {
    Entry {
        key: format!("{table}.{key}"),
        value: from.value.to_string(),
        source: from.source,
        reason: from.reason.trim().to_owned(),
    }
}

impl DataSheet {
    /// Each number with its source, in the order of the file.
    pub fn entries(&self) -> Vec<Entry> {
        let sheet = &self.tables;
        let r = &sheet.rotor;
        let mut entries = sheet.nameplate.as_ref().map_or_else(Vec::new, nameplate::entries);
        if sheet.nameplate.is_none() {
            self.winding_entries(&mut entries);
        }
        entries.extend(sheet.map.as_ref().map(|map| {
            let (source, reason) = map.file.source();
            Entry {
                key: "map.file".to_owned(),
                value: map.file.name().to_owned(),
                source,
                reason: reason.to_owned(),
            }
        }));
        if let Some(s) = &sheet.saturation {
            let exponents = [("s", &s.s), ("t", &s.t), ("u", &s.u), ("v", &s.v)];
            let factors = [
                ("a_d0", &s.a_d0),
                ("a_dd", &s.a_dd),
                ("a_q0", &s.a_q0),
                ("a_qq", &s.a_qq),
                ("a_dq", &s.a_dq),
            ];
            entries
                .extend(factors.iter().chain(&exponents).map(|(key, from)| entry("saturation", key, from)));
            entries.push(entry("saturation", "i_f", &s.i_f));
        }
        if let Some(b) = &sheet.bridge {
            let factors = [("a_b", &b.a_b), ("a_bp", &b.a_bp), ("k_q", &b.k_q), ("w", &b.w)];
            entries.extend(factors.iter().map(|(key, from)| entry("bridge", key, from)));
            entries.push(entry("bridge", "psi_n", &b.psi_n));
        }
        entries.extend([
            entry("rotor", "inertia", &r.inertia),
            entry("rotor", "stiction", &r.stiction),
            entry("rotor", "coulomb", &r.coulomb),
            entry("rotor", "viscous", &r.viscous),
        ]);
        entries.extend(r.brake_backlash.as_ref().map(|from| entry("rotor", "brake_backlash", from)));
        entries.extend(r.cogging_torque.as_ref().map(|from| entry("rotor", "cogging_torque", from)));
        entries.extend(r.cogging_periods.as_ref().map(|from| entry("rotor", "cogging_periods", from)));
        if let Some(h) = &sheet.harmonics {
            entries.extend(h.inductance_4.as_ref().map(|from| entry("harmonics", "inductance_4", from)));
            entries.extend(h.asymmetry.as_ref().map(|from| entry("harmonics", "asymmetry", from)));
            entries.extend(h.flux_5.as_ref().map(|from| entry("harmonics", "flux_5", from)));
            entries.extend(h.flux_7.as_ref().map(|from| entry("harmonics", "flux_7", from)));
        }
        if let Some(e) = &sheet.eddy {
            entries.push(entry("eddy", "time_constant", &e.time_constant));
            entries.push(entry("eddy", "d_depth", &e.d_depth));
            entries.push(entry("eddy", "q_depth", &e.q_depth));
        }
        if let Some(h) = &sheet.hysteresis {
            entries.push(entry("hysteresis", "coercive_current", &h.coercive_current));
            entries.push(entry("hysteresis", "depth", &h.depth));
            entries.push(entry("hysteresis", "cells", &h.cells));
        }
        if let Some(t) = &sheet.thermal {
            entries.push(entry("thermal", "reference", &t.reference));
            entries.push(entry("thermal", "winding_coefficient", &t.winding_coefficient));
            entries.push(entry("thermal", "magnet_coefficient", &t.magnet_coefficient));
        }
        entries
    }

    /// Those of `[rating]` and `[winding]`.
    fn winding_entries(&self, entries: &mut Vec<Entry>) {
        let Sheet { rating, winding: w, .. } = &self.tables;
        entries.extend(rating.power.as_ref().map(|power| entry("rating", "power", power)));
        entries.extend(rating.speed.as_ref().map(|speed| entry("rating", "speed", speed)));
        entries.extend(rating.torque.as_ref().map(|torque| entry("rating", "torque", torque)));
        entries.push(entry("rating", "current", &rating.current));
        entries.extend(rating.dc_link.as_ref().map(|dc_link| entry("rating", "dc_link", dc_link)));
        entries.extend([
            entry("winding", "pole_pairs", &w.pole_pairs),
            entry("winding", "resistance", &w.resistance),
        ]);
        entries.extend(w.mean_inductance.as_ref().map(|from| entry("winding", "mean_inductance", from)));
        entries.extend(w.saliency.as_ref().map(|from| entry("winding", "saliency", from)));
        entries.extend(w.leakage.as_ref().map(|from| entry("winding", "leakage", from)));
        entries.extend(w.magnet_flux.as_ref().map(|from| entry("winding", "magnet_flux", from)));
    }
}
