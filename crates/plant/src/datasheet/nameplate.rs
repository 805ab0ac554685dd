//! `[nameplate]`: a motor as its owner has it, in place of `[rating]`, `[winding]` and `[saturation]`.
//!
//! What stands there is checked at once, so that all that is missing or wrong is named together, and becomes a data sheet
//! like any other: what was left out has a default that says that it is assumed.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use standstill_quantity::unit::{Ampere, Henry, Ohm, One, Share, Volt, Watt, Weber};
use standstill_quantity::{Quantity, Unit};
use toml::{Table, Value};

use super::{Entry, MotorError, Source, Sourced, entry};
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

/// Tables that a sheet with a `[nameplate]` may have beside it.
const BESIDE: [&str; 4] = ["rotor", "harmonics", "eddy", "thermal"];
/// Those whose place it takes.
const REPLACED: [&str; 5] = ["rating", "winding", "saturation", "bridge", "map"];
const KEYS: [&str; 10] = [
    "pole_pairs",
    "resistance",
    "L_d",
    "L_q",
    "magnet_flux",
    "rated_current",
    "dc_link",
    "power",
    "leakage",
    "saturation",
];

/// The data sheet, like any other, that a sheet with a `[nameplate]` amounts to. `text` is its file's, for line numbers.
pub(super) fn spelled_out(file: &str, sheet: &Table, text: Option<&str>) -> Result<Table, MotorError> {
    let empty = Table::new();
    let table = sheet.get("nameplate").and_then(Value::as_table).unwrap_or(&empty);
    let mut reader = Reader { table, text, problems: Vec::new() };
    for key in sheet.keys() {
        if REPLACED.contains(&key.as_str()) {
            reader.problems.push(format!("[{key}] stands beside [nameplate], which takes its place"));
        } else if !BESIDE.contains(&key.as_str())
            && !["name", "title", "notes", "nameplate"].contains(&key.as_str())
        {
            let known = BESIDE.join(", ");
            reader.problems.push(format!("`{key}` is not known beside [nameplate]; known are {known}"));
        }
    }
    let unknown: Vec<&str> = table.keys().map(String::as_str).filter(|key| !KEYS.contains(key)).collect();
    for key in unknown {
        let place = reader.place(key);
        reader.problems.push(format!("{place}is no key of [nameplate], which are {}", KEYS.join(", ")));
    }
    let nameplate = reader.nameplate();
    if let (Some(nameplate), true) = (nameplate, reader.problems.is_empty()) {
        return Ok(nameplate.sheet(file, sheet));
    }
    let message = format!("[nameplate]: {}", reader.problems.join("; "));
    Err(MotorError::Format { file: file.to_owned(), message })
}

/// A number as it goes on: with its source.
fn sourced(value: impl Into<Value>, source: &str, reason: &str) -> Value {
    let pairs = [("value", value.into()), ("source", source.into()), ("reason", reason.into())];
    Value::Table(pairs.into_iter().map(|(key, value)| (key.to_owned(), value)).collect())
}

/// The same of what a file says, which may have a source already.
fn with_source(value: &Value) -> Value {
    match value {
        Value::Table(_) => value.clone(),
        plain => sourced(plain.clone(), "given", "in the data sheet, without a reason"),
    }
}

/// What must be right, in the order of the file.
struct Reader<'a> {
    table: &'a Table,
    text: Option<&'a str>,
    problems: Vec<String>,
}

/// The numbers of a nameplate that are right.
struct Nameplate {
    numbers: Table,
    resistance: f64,
    inductance: [f64; 2],
    leakage: f64,
    magnet_flux: f64,
    rated_current: f64,
    dc_link: f64,
    pole_pairs: f64,
}

impl Reader<'_> {
    /// Where a key stands, in words that a message begins with.
    fn place(&self, key: &str) -> String {
        let begins = |line: &str| {
            let rest = line.trim_start().strip_prefix(key);
            rest.is_some_and(|rest| rest.trim_start().starts_with(['=', '.']))
        };
        let line = self.text.and_then(|text| {
            let table = text.lines().position(|line| line.trim_start().starts_with("[nameplate]"))?;
            Some(table + 2 + text.lines().skip(table + 1).position(begins)?)
        });
        line.map_or_else(|| format!("`{key}` "), |line| format!("line {line}, `{key}`: "))
    }

    /// A number by its key; `needed` says what it must be, which `fits` knows.
    fn number<U: Unit>(
        &mut self,
        key: &'static str,
        value: Option<&Value>,
        needed: &str,
        fits: impl Fn(f64) -> bool,
    ) -> Option<f64> {
        let Some(value) = value else {
            self.problems.push(format!("`{key}` is missing: {needed}"));
            return None;
        };
        let place = self.place(key.split('.').next().unwrap_or(key));
        match Sourced::<U>::deserialize(with_source(value)) {
            Ok(found) if fits(found.value.value()) => Some(found.value.value()),
            Ok(found) => {
                self.problems.push(format!("{place}{key} is {}, but must be {needed}", found.value));
                None
            }
            Err(error) => {
                self.problems.push(format!("{place}{}", error.message().trim().replace('\n', " ")));
                None
            }
        }
    }

    fn nameplate(&mut self) -> Option<Nameplate> {
        let table = self.table;
        let get = |key: &str| table.get(key);
        // Larger or smaller numbers are typing errors of any motor, and would end in infinities.
        let positive = |value: f64| (1e-15..=1e12).contains(&value);
        let pole_pairs = self.number::<One>(
            "pole_pairs",
            get("pole_pairs"),
            "a whole number from 1 to 200, half the number of poles",
            |p| (1.0..=200.0).contains(&p) && p.fract() == 0.0,
        );
        let resistance = self.number::<Ohm>(
            "resistance",
            get("resistance"),
            "the positive resistance of one phase, half of that between two terminals, such as \"50 mΩ\"",
            positive,
        );
        let [l_d, l_q] = [("L_d", "along the magnet"), ("L_q", "across the magnet")].map(|(key, where_to)| {
            let needed = format!(
                "the positive inductance of one phase {where_to} without current, half of the one between two terminals there, such as \"2.1 mH\""
            );
            self.number::<Henry>(key, get(key), &needed, positive)
        });
        let magnet_flux = self.number::<Weber>(
            "magnet_flux",
            get("magnet_flux"),
            "zero or more, the peak voltage of a phase over the electrical speed in rad/s, such as \"90 mWb\"",
            |flux| flux == 0.0 || positive(flux),
        );
        let rated_current = self.number::<Ampere>(
            "rated_current",
            get("rated_current"),
            "the positive peak current of a phase, the rms value times 1.414, such as \"10 A\"",
            positive,
        );
        let dc_link = self.number::<Volt>(
            "dc_link",
            get("dc_link"),
            "the positive voltage of the drive's DC link, such as \"48 V\"",
            positive,
        );
        if let Some(power) = get("power") {
            self.number::<Watt>("power", Some(power), "positive, such as \"5 kW\"", positive);
        }
        let leakage = match get("leakage") {
            None => Some(0.0),
            leakage => {
                let least = l_d.into_iter().chain(l_q).fold(f64::INFINITY, f64::min);
                let needed = "zero or more, and less than L_d and L_q, which contain it";
                self.number::<Henry>("leakage", leakage, needed, |l| (0.0..least).contains(&l))
            }
        };
        let shares = get("saturation").map(|value| self.shares(value));
        let numbers = Nameplate {
            numbers: self.numbers(shares.flatten()),
            resistance: resistance?,
            inductance: [l_d?, l_q?],
            leakage: leakage?,
            magnet_flux: magnet_flux?,
            rated_current: rated_current?,
            dc_link: dc_link?,
            pole_pairs: pole_pairs?,
        };
        self.together(&numbers);
        Some(numbers)
    }

    /// The shares of `saturation`, plain or one by one, as a table of them.
    fn shares(&mut self, value: &Value) -> Option<Table> {
        let own = match value {
            Value::Table(table) if !table.contains_key("value") => table.clone(),
            plain => std::iter::once(("d".to_owned(), plain.clone())).collect(),
        };
        let before = self.problems.len();
        for key in own.keys().filter(|key| !["d", "minus_d", "q"].contains(&key.as_str())) {
            let place = self.place("saturation");
            self.problems.push(format!("{place}`{key}` is none of d, minus_d, q"));
        }
        let of_d = "from \"-100 %\" to \"90 %\", by how much L_d falls at rated current along";
        let both = |share: f64| (-1.0..=0.9).contains(&share);
        self.number::<Share>("saturation.d", own.get("d"), &format!("{of_d} +d"), both);
        if let Some(share) = own.get("minus_d") {
            self.number::<Share>("saturation.minus_d", Some(share), &format!("{of_d} -d"), both);
        }
        if let Some(share) = own.get("q") {
            let needed = "from \"0 %\" to \"90 %\", by how much L_q falls at rated current along q";
            self.number::<Share>("saturation.q", Some(share), needed, |share| (0.0..=0.9).contains(&share));
        }
        (self.problems.len() == before).then_some(own)
    }

    /// All numbers with their sources.
    fn numbers(&self, shares: Option<Table>) -> Table {
        let mut numbers: Table =
            self.table.iter().map(|(key, value)| (key.clone(), with_source(value))).collect();
        if !numbers.contains_key("leakage") {
            let reason = "none: no measurement at the terminals tells it from the rest";
            numbers.insert("leakage".to_owned(), sourced("0 H", "assumed", reason));
        }
        if let Some(mut shares) = shares {
            for (_, share) in &mut shares {
                *share = with_source(share);
            }
            let none = || sourced("0 %", "assumed", "none: only the axis errs by it, and little");
            shares.entry("q").or_insert_with(none);
            numbers.insert("saturation".to_owned(), Value::Table(shares));
        }
        numbers
    }

    /// What no number alone can get wrong.
    fn together(&mut self, found: &Nameplate) {
        let [l_d, l_q] = found.inductance;
        if l_d.min(l_q) < 1e-6 * found.resistance {
            let place = self.place("resistance");
            self.problems.push(format!(
                "{place}with these L_d and L_q it makes a time constant L/R below 1 µs, which no motor has"
            ));
        }
        if self.problems.is_empty()
            && let Some(Value::Table(shares)) = found.numbers.get("saturation")
            && let Ok(shares) = SharesTable::deserialize(Value::Table(shares.clone()))
            && let Err(error) =
                Algebraic::falling([l_d, l_q], found.magnet_flux, found.rated_current, shares.falls())
        {
            let place = self.place("saturation");
            self.problems.push(format!("{place}{} must be {}", error.key, error.needed));
        }
    }
}

impl Nameplate {
    /// With all that it stands for.
    fn sheet(self, file: &str, stated: &Table) -> Table {
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
        ];
        sheet.insert("rating".to_owned(), table(rating));
        let [l_d, l_q] = self.inductance;
        let inferred = |value: f64| Some(sourced(value, "inferred", "from L_d, L_q and the leakage"));
        let winding = vec![
            ("pole_pairs", number("pole_pairs")),
            ("resistance", number("resistance")),
            ("mean_inductance", inferred((l_d + l_q - 2.0 * self.leakage) / 3.0)),
            ("saliency", inferred((l_d - l_q) / 3.0)),
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

    /// Inertia and friction where they are not given, in proportion to what the motor can do, as those of the paper's
    /// motor: rated torque T brings the rotor to the speed ω that its DC link allows in 0.16 s, and friction is 1.4 % of T.
    fn fill_rotor(&self, rotor: &mut Table) {
        let [l_d, l_q] = self.inductance;
        // Reluctance makes torque too; and there is always a rotor.
        let flux = self.magnet_flux.max((l_d - l_q).abs() * self.rated_current / 2.0);
        let flux = flux.max(0.1 * l_d * self.rated_current);
        let torque = 1.5 * self.pole_pairs * flux * self.rated_current;
        let speed = self.dc_link / (3.0_f64.sqrt() * flux * self.pole_pairs);
        // To two digits.
        let rounded = |value: f64| format!("{value:.1e}").parse::<f64>().unwrap_or(value);
        let friction = "1.4 % of the torque at rated current: bearings and seals";
        let stiction = rotor.get("coulomb").cloned();
        let defaults = [
            (
                "inertia",
                sourced(
                    rounded(0.16 * torque / speed),
                    "assumed",
                    "such that rated torque takes 0.16 s to full speed",
                ),
            ),
            ("stiction", stiction.unwrap_or_else(|| sourced(rounded(0.014 * torque), "assumed", friction))),
            ("coulomb", sourced(rounded(0.014 * torque), "assumed", friction)),
            ("viscous", sourced(0.0, "assumed", "negligible at the speeds of a detection")),
        ];
        for (key, value) in defaults {
            let stiction = rotor.get("stiction").cloned().filter(|_| key == "coulomb");
            rotor.entry(key).or_insert_with(|| stiction.unwrap_or(value));
        }
    }
}
