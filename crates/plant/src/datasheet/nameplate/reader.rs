//! Reads and checks a `[nameplate]`; all missing and wrong keys are named together.

use standstill_files::sheet::{SharesTable, Sourced};
use standstill_files::{in_words, key_span, line_of};
use standstill_quantity::Unit;
use standstill_quantity::unit::{
    Ampere, Henry, NewtonMetre, Ohm, One, RevolutionsPerMinute, Share, Volt, Watt, Weber,
};
use toml::{Table, Value};

use super::super::MotorError;
use super::whole::{BESIDE, Nameplate, Strength, sourced, with_source};
use super::{falls, given};
use crate::Algebraic;

/// Tables that a nameplate replaces.
const REPLACED: [&str; 5] = ["rating", "winding", "saturation", "bridge", "map"];
/// Keys of quantities with one name; [`GROUPS`] has those that data sheets give in several ways.
const KEYS: [&str; 7] =
    ["pole_pairs", "dc_link", "power", "rated_speed", "rated_torque", "leakage", "saturation"];

/// The keys of a `[nameplate]`.
pub(in crate::datasheet) fn known_keys() -> Vec<&'static str> {
    KEYS.into_iter().chain(given::keys()).collect()
}

/// Returns the data sheet, like any other, that a sheet with a `[nameplate]` amounts to. `text` is its file's, for
/// line numbers.
pub(in crate::datasheet) fn spelled_out(
    file: &str,
    sheet: &Table,
    text: Option<&str>,
) -> Result<Table, MotorError> {
    for key in ["nameplate"].iter().chain(&BESIDE) {
        if let Some(found) = sheet.get(*key).filter(|found| !found.is_table()) {
            let text = text.unwrap_or_default();
            let line = key_span(text, key).map(|span| format!("line {}, ", line_of(text, span.start)));
            let (line, found) = (line.unwrap_or_default(), in_words(found));
            let message = format!("{line}`{key}`: found {found}, needed a table, which begins with [{key}]");
            return Err(MotorError::Format { file: file.to_owned(), message });
        }
    }
    // A motor that its tables describe already has no use for a nameplate of some keys.
    let described: Vec<&str> = REPLACED.into_iter().filter(|key| sheet.contains_key(*key)).collect();
    if ["rating", "winding"].iter().all(|key| described.contains(key)) {
        let tables: Vec<String> = described.iter().map(|key| format!("[{key}]")).collect();
        let message = format!(
            "[nameplate] stands beside {}, which describe this motor: change their keys, which `standstill motors` shows, such as `winding.resistance` (in a scenario `motor.winding.resistance`), or leave them out",
            tables.join(", ")
        );
        return Err(MotorError::Format { file: file.to_owned(), message });
    }
    let empty = Table::new();
    let table = sheet.get("nameplate").and_then(Value::as_table).unwrap_or(&empty);
    let mut reader = Reader { table, text, problems: Vec::new() };
    let in_phase = given::in_phase_values(&mut reader, true);
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
    let known = known_keys();
    for key in table.keys().filter(|key| !known.contains(&key.as_str())) {
        let place = reader.place(key);
        let needed = given::instead_of(key).map_or_else(
            || format!("is no key of [nameplate], which are {}", known.join(", ")),
            |instead| format!("is no key of [nameplate]: {instead}"),
        );
        reader.problems.push(format!("{place}{needed}"));
    }
    let mut reader = Reader { table: &in_phase, ..reader };
    let nameplate = reader.nameplate();
    if let (Some(nameplate), true) = (nameplate, reader.problems.is_empty()) {
        return Ok(nameplate.sheet(file, sheet));
    }
    let message = format!("[nameplate]: {}", reader.problems.join("; "));
    Err(MotorError::Format { file: file.to_owned(), message })
}

/// Returns true for positive numbers within the limits of a motor. Numbers beyond are typing errors and would become
/// infinite.
fn positive(value: f64) -> bool {
    (1e-15..=1e12).contains(&value)
}

/// Reader of a `[nameplate]` that collects problems, in the order of the file.
pub(super) struct Reader<'a> {
    pub(super) table: &'a Table,
    pub(super) text: Option<&'a str>,
    pub(super) problems: Vec<String>,
}

impl Reader<'_> {
    /// Returns the place of a key in words, as the beginning of a message.
    pub(super) fn place(&self, key: &str) -> String {
        let first = key.split('.').next().unwrap_or_default();
        let text = self.text.filter(|_| self.table.contains_key(first));
        let line =
            text.and_then(|text| Some(line_of(text, key_span(text, &format!("nameplate.{key}"))?.start)));
        line.map_or_else(|| format!("`{key}` "), |line| format!("line {line}, `{key}`: "))
    }

    /// Returns the number of a key if `fits` accepts it. `needed`: description of the accepted values, for the message.
    pub(super) fn number<U: Unit>(
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
        // The key itself stands behind the line, with its parts.
        let line = place.split('`').next().unwrap_or_default().to_owned();
        match Sourced::<U>::of(with_source(value)) {
            Ok(found) if fits(found.number()) => Some(found.number()),
            Ok(found) => {
                let is_plain = matches!(value, Value::Integer(_) | Value::Float(_));
                let is_percentage = is_plain && needed.contains('%') && fits(found.number() / 100.0);
                let meant =
                    if is_percentage { format!(" (did you mean \"{value} %\"?)") } else { String::new() };
                self.problems.push(format!("{line}`{key}` is {}{meant}, but must be {needed}", found.value));
                None
            }
            Err(error) => {
                self.problems.push(format!("{line}`{key}`: {}", error.message.trim().replace('\n', " ")));
                None
            }
        }
    }

    /// Returns a positive number by its key.
    pub(super) fn positive<U: Unit>(&mut self, key: &'static str, needed: &str) -> Option<f64> {
        let table = self.table;
        self.number::<U>(key, table.get(key), needed, positive)
    }

    fn nameplate(&mut self) -> Option<Nameplate> {
        let table = self.table;
        let get = |key: &str| table.get(key);
        let pole_pairs = self.number::<One>(
            "pole_pairs",
            get("pole_pairs"),
            "a whole number from 1 to 200, half the number of poles",
            |p| (1.0..=200.0).contains(&p) && p.fract() == 0.0,
        );
        let resistance = self.positive::<Ohm>(
            "resistance",
            "the positive resistance of one phase, half of that between two terminals, such as \"50 mΩ\"",
        );
        let [l_d, l_q] = [("L_d", "along the magnet"), ("L_q", "across the magnet")].map(|(key, where_to)| {
            let needed = format!(
                "the positive inductance of one phase {where_to} without current, half of the one between two terminals there, such as \"2.1 mH\""
            );
            self.positive::<Henry>(key, &needed)
        });
        let magnet_flux = self.number::<Weber>(
            "magnet_flux",
            get("magnet_flux"),
            "zero or more, the peak voltage of a phase over the electrical speed in rad/s, such as \"90 mWb\"",
            |flux| flux == 0.0 || positive(flux),
        );
        let rated_current = self.positive::<Ampere>(
            "rated_current",
            "the positive peak current of a phase, the rms value times 1.414, such as \"10 A\"",
        );
        let dc_link =
            self.positive::<Volt>("dc_link", "the positive voltage of the drive's DC link, such as \"48 V\"");
        if table.contains_key("power") {
            self.positive::<Watt>("power", "positive, such as \"5 kW\"");
        }
        if table.contains_key("rated_speed") {
            self.positive::<RevolutionsPerMinute>("rated_speed", "positive, such as \"3000 rpm\"");
        }
        if table.contains_key("rated_torque") {
            self.positive::<NewtonMetre>("rated_torque", "positive, such as \"14 N m\"");
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
            leakage: leakage?,
            strength: Strength {
                inductance: [l_d?, l_q?],
                magnet_flux: magnet_flux?,
                rated_current: rated_current?,
                dc_link: dc_link?,
                pole_pairs: pole_pairs?,
            },
        };
        self.together(&numbers);
        Some(numbers)
    }

    /// Returns the shares of `saturation`, plain or one by one, as a table of them.
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

    /// Returns all numbers with their sources.
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

    /// Checks relations between the numbers.
    fn together(&mut self, found: &Nameplate) {
        let Strength { inductance: [l_d, l_q], magnet_flux, rated_current, .. } = found.strength;
        if l_d.min(l_q) < 1e-6 * found.resistance {
            let place = self.place("resistance");
            self.problems.push(format!(
                "{place}with these L_d and L_q it makes a time constant L/R below 1 µs, which no motor has"
            ));
        }
        if self.problems.is_empty()
            && let Some(Value::Table(shares)) = found.numbers.get("saturation")
            && let Ok(shares) = SharesTable::read(shares.clone())
            && let Err(error) = Algebraic::falling([l_d, l_q], magnet_flux, rated_current, falls(&shares))
        {
            let place = self.place("saturation");
            self.problems.push(format!("{place}{} must be {}", error.key, error.needed));
        }
    }
}
