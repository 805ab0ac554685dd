//! Conversion of a `[nameplate]` to the tables of a data sheet.

use standstill_files::sheet::PLAIN;
use standstill_quantity::significant;
use toml::{Table, Value};

/// Tables that may stand beside a `[nameplate]`.
pub(super) const BESIDE: [&str; 5] = ["rotor", "harmonics", "eddy", "hysteresis", "thermal"];

/// Returns a number as a table with its source and reason.
pub(super) fn sourced(value: impl Into<Value>, source: &str, reason: &str) -> Value {
    let pairs = [("value", value.into()), ("source", source.into()), ("reason", reason.into())];
    Value::Table(pairs.into_iter().map(|(key, value)| (key.to_owned(), value)).collect())
}

/// Returns a number of a file with its source, which it may have already.
pub(super) fn with_source(value: &Value) -> Value {
    match value {
        Value::Table(_) => value.clone(),
        plain => sourced(plain.clone(), "given", PLAIN),
    }
}

/// The numbers of a nameplate that are right.
pub(super) struct Nameplate {
    pub(super) numbers: Table,
    pub(super) resistance: f64,
    pub(super) leakage: f64,
    pub(super) strength: Strength,
}

/// Returns the L_A and L_B in H that give this L_d and L_q with this leakage.
pub(super) fn winding([l_d, l_q]: [f64; 2], leakage: f64) -> [f64; 2] {
    [(l_d + l_q - 2.0 * leakage) / 3.0, (l_d - l_q) / 3.0]
}

/// Quantities that assumed inertia and friction follow from, in SI.
#[derive(Clone, Copy, Debug)]
pub(super) struct Strength {
    pub(super) inductance: [f64; 2],
    pub(super) magnet_flux: f64,
    pub(super) rated_current: f64,
    pub(super) dc_link: f64,
    pub(super) pole_pairs: f64,
}

impl Strength {
    /// Returns the default inertia in kg m² and sliding friction in N m, to two digits. They are in the proportions of
    /// the paper's motor: rated torque T brings the rotor in 0.16 s to the speed that its DC link allows, and friction
    /// is 1.4 % of T.
    pub(super) fn inertia_and_friction(&self) -> [f64; 2] {
        let [l_d, l_q] = self.inductance;
        // Reluctance makes torque too; and there is always a rotor.
        let flux = self.magnet_flux.max((l_d - l_q).abs() * self.rated_current / 2.0);
        let flux = flux.max(0.1 * l_d * self.rated_current);
        let torque = 1.5 * self.pole_pairs * flux * self.rated_current;
        let speed = self.dc_link / (3.0_f64.sqrt() * flux * self.pole_pairs);
        [0.16 * torque / speed, 0.014 * torque].map(|value| significant(value, 2))
    }
}

impl Nameplate {
    /// Returns the whole data sheet, with the tables that follow from the nameplate.
    pub(super) fn sheet(self, file: &str, stated: &Table) -> Table {
        let mut sheet = Table::new();
        let stem = std::path::Path::new(file).file_stem().map_or_else(String::new, |stem| {
            let fits = |c: char| if c.is_ascii_alphanumeric() || "-_. ".contains(c) { c } else { '-' };
            stem.to_string_lossy().chars().take(60).map(fits).collect()
        });
        let name = if stem.is_empty() { "motor".to_owned() } else { stem };
        for (key, default) in [("name", name.as_str()), ("title", "A motor by its nameplate"), ("notes", "")]
        {
            sheet.insert(key.to_owned(), stated.get(key).cloned().unwrap_or_else(|| default.into()));
        }
        let number = |key: &str| self.numbers.get(key).cloned();
        let table = |pairs: Vec<(&str, Option<Value>)>| {
            let pairs = pairs.into_iter().filter_map(|(key, value)| Some((key.to_owned(), value?)));
            Value::Table(pairs.collect())
        };
        let rating = vec![
            ("current", number("rated_current")),
            ("dc_link", number("dc_link")),
            ("power", number("power")),
            ("speed", number("rated_speed")),
            ("torque", number("rated_torque")),
        ];
        sheet.insert("rating".to_owned(), table(rating));
        let [mean, saliency] = winding(self.strength.inductance, self.leakage);
        let inferred = |value: f64| Some(sourced(value, "inferred", "from L_d, L_q and the leakage"));
        let winding = vec![
            ("pole_pairs", number("pole_pairs")),
            ("resistance", number("resistance")),
            ("mean_inductance", inferred(mean)),
            ("saliency", inferred(saliency)),
            ("leakage", number("leakage")),
            ("magnet_flux", number("magnet_flux")),
        ];
        sheet.insert("winding".to_owned(), table(winding));
        for key in BESIDE {
            if let Some(Value::Table(own)) = stated.get(key) {
                let own = own.iter().map(|(key, value)| (key.clone(), with_source(value))).collect();
                sheet.insert(key.to_owned(), Value::Table(own));
            }
        }
        let rotor = sheet.entry("rotor").or_insert_with(|| Value::Table(Table::new()));
        if let Value::Table(rotor) = rotor {
            self.fill_rotor(rotor);
        }
        sheet.insert("nameplate".to_owned(), Value::Table(self.numbers));
        sheet
    }

    /// Adds default inertia and friction if they are not given.
    fn fill_rotor(&self, rotor: &mut Table) {
        let [inertia, rubbing] = self.strength.inertia_and_friction();
        let friction = "1.4 % of the torque at rated current: bearings and seals";
        let stiction = rotor.get("coulomb").cloned();
        let defaults = [
            ("inertia", sourced(inertia, "assumed", "such that rated torque takes 0.16 s to full speed")),
            ("stiction", stiction.unwrap_or_else(|| sourced(rubbing, "assumed", friction))),
            ("coulomb", sourced(rubbing, "assumed", friction)),
            ("viscous", sourced(0.0, "assumed", "negligible at the speeds of a detection")),
        ];
        for (key, value) in defaults {
            let stiction = rotor.get("stiction").cloned().filter(|_| key == "coulomb");
            rotor.entry(key).or_insert_with(|| stiction.unwrap_or(value));
        }
    }
}
