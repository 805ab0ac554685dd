//! Conversion of a motor's numbers to the conventions of other data sheets, tools and controllers.

#[cfg(test)]
mod tests;

use std::f64::consts::PI;

use serde::Serialize;
use standstill_quantity::unit::{Ampere, Henry, Ohm, One, Weber};
use standstill_quantity::{Scale, Unit, short};
use toml::{Table, Value};

use super::super::MotorError;
use super::given::{CURRENT, FLUX, Group, INDUCTANCES, RESISTANCE, in_phase_values, instead_of, keys, ways};
use super::reader::Reader;

/// A number of a motor, expressed in one of the ways that data sheets use, see
/// [`DataSheet::equal_numbers`](crate::DataSheet::equal_numbers).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EqualNumber {
    /// Name of the quantity, such as `resistance`; the same for all ways of giving it.
    pub quantity: &'static str,
    /// Key in `[nameplate]`; none if data sheets here do not accept this way.
    pub key: Option<&'static str>,
    /// Value in `unit`.
    pub value: f64,
    /// Unit of the value: SI, V/krpm, rpm/V; empty of pure numbers.
    pub unit: &'static str,
    /// Value with its unit, in six digits.
    pub text: String,
    /// Description of this way.
    pub meaning: &'static str,
}

/// A key by which a number that can be converted is given, see
/// [`DataSheet::convertible_keys`](crate::DataSheet::convertible_keys).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct ConvertibleKey {
    /// The key, as in `[nameplate]`.
    pub key: &'static str,
    /// Name of the quantity, as in [`EqualNumber::quantity`]; empty of `pole_pairs`, which other numbers need.
    pub quantity: &'static str,
    /// Number of the way of giving the quantity: keys of one way, such as `L_d` and `L_q`, are given together.
    pub way: usize,
    /// Description of this way.
    pub meaning: &'static str,
}

/// All keys of numbers that can be converted.
pub(in crate::datasheet) fn convertible_keys() -> Vec<ConvertibleKey> {
    let mut all = Vec::new();
    Ways(&RESISTANCE, &mut all).add(1.0, 1.0, false);
    of_inductances([1.0; 2], &mut all);
    of_flux(1.0, Some(1.0), &mut all);
    Ways(&CURRENT, &mut all).add(1.0, 1.0, false);
    let poles = "half the number of poles";
    let mut keys = vec![ConvertibleKey { key: "pole_pairs", quantity: "", way: 0, meaning: poles }];
    for (way, of) in ways().enumerate() {
        keys.extend(of.iter().filter_map(|key| {
            let EqualNumber { quantity, meaning, .. } =
                *all.iter().find(|number| number.key == Some(*key))?;
            Some(ConvertibleKey { key, quantity, way: way + 1, meaning })
        }));
    }
    keys
}

fn text(value: f64, symbol: &str) -> String {
    let scale = Scale::suiting(symbol, value.abs());
    format!("{} {}", short(scale.number(value)), scale.unit).trim_end().to_owned()
}

/// Collects ways of one quantity.
struct Ways<'a>(&'static Group, &'a mut Vec<EqualNumber>);

impl Ways<'_> {
    /// Appends the ways of one key for the value of a phase, those of numbers per turn of the shaft or the others.
    fn add(&mut self, phase: f64, pole_pairs: f64, per_turn: bool) {
        for way in self.0.ways.iter().filter(|way| way.per_turn == per_turn) {
            self.push(Some(way.key[0]), (way.given)(phase, pole_pairs), way.unit, way.meaning);
        }
    }

    fn push(&mut self, key: Option<&'static str>, value: f64, unit: &'static str, meaning: &'static str) {
        let quantity = self.0.quantity;
        self.1.push(EqualNumber { quantity, key, value, unit, text: text(value, unit), meaning });
    }
}

/// Inductances of a phase along both axes in H.
fn of_inductances([d, q]: [f64; 2], all: &mut Vec<EqualNumber>) {
    let mut ways = Ways(&INDUCTANCES, all);
    let mut henry =
        |key: Option<&'static str>, value: f64, meaning| ways.push(key, value, Henry::SYMBOL, meaning);
    henry(Some("L_d"), d, "of a phase, along the magnet");
    henry(Some("L_q"), q, "of a phase, across the magnet");
    if d == q {
        ways.add(d, 1.0, false);
    }
    let mut henry =
        |key: Option<&'static str>, value: f64, meaning| ways.push(key, value, Henry::SYMBOL, meaning);
    // Between two terminals nobody sees which axis the least belongs to: these keys take it for that of the magnet.
    if d <= q {
        henry(Some("L_line_to_line_min"), 2.0 * d, "between two terminals, least while the shaft turns");
        henry(Some("L_line_to_line_max"), 2.0 * q, "between two terminals, most while the shaft turns");
    } else {
        henry(None, 2.0 * q, "between two terminals, least while the shaft turns (along q)");
        henry(None, 2.0 * d, "between two terminals, most while the shaft turns (along d)");
    }
    henry(Some("vesc_L"), 0.5 * (d + q), "foc_motor_l of a VESC; phase_inductance of an ODrive");
    henry(Some("vesc_ld_lq_diff"), q - d, "foc_motor_ld_lq_diff of a VESC");
    if d != q {
        henry(None, 1.5 * (d + q), "of a winding in delta, mean over the angle");
    }
    ways.push(None, (q - d).abs() / (q + d), "", "saliency, |L_q − L_d| / (L_q + L_d)");
}

/// Appends all ways of giving the peak flux linkage of a phase in Wb; those per turn of the shaft need the pole pairs.
fn of_flux(flux: f64, pole_pairs: Option<f64>, all: &mut Vec<EqualNumber>) {
    let mut ways = Ways(&FLUX, all);
    ways.add(flux, 1.0, false);
    let meaning = "of a phase, peak, per electrical hertz (C2000: RATED_FLUX_VpHz)";
    ways.push(None, 2.0 * PI * flux, "V/Hz", meaning);
    if let Some(pole_pairs) = pole_pairs.filter(|_| flux > 0.0) {
        ways.add(flux, pole_pairs, true);
    }
}

/// Returns all ways of giving the numbers of this table, which has keys of a `[nameplate]`.
pub(in crate::datasheet) fn equal_numbers(given: &Table) -> Result<Vec<EqualNumber>, MotorError> {
    let mut reader = Reader { table: given, text: None, problems: Vec::new() };
    let known: Vec<&str> = std::iter::once("pole_pairs").chain(keys()).collect();
    for key in given.keys().filter(|key| !known.contains(&key.as_str())) {
        reader.problems.push(instead_of(key).map_or_else(
            || {
                format!(
                    "`{key}` is none of the numbers that can be converted, which are {}",
                    known.join(", ")
                )
            },
            |instead| format!("`{key}` leaves open what it is: {instead}"),
        ));
    }
    if !given.keys().any(|key| key != "pole_pairs") && reader.problems.is_empty() {
        reader.problems.push(format!("no number to convert; known are {}", known.join(", ")));
    }
    let pairs = given.get("pole_pairs");
    let is_per_turn = |key: &&String| FLUX.ways.iter().any(|way| way.per_turn && way.key[0] == key.as_str());
    let needs_pairs = given.keys().find(is_per_turn);
    let pole_pairs = match (pairs, needs_pairs) {
        (None, Some(key)) => {
            reader.problems.push(format!(
                "`pole_pairs` is missing: `{key}` speaks of turns of the shaft, a flux linkage of electrical ones"
            ));
            None
        }
        (None, None) => None,
        (pairs, _) => reader.number::<One>(
            "pole_pairs",
            pairs,
            "a whole number from 1 to 200, half the number of poles",
            |p| (1.0..=200.0).contains(&p) && p.fract() == 0.0,
        ),
    };
    let phase = in_phase_values(&mut reader, false);
    let mut reader = Reader { table: &phase, text: None, problems: reader.problems };
    let has = |key: &str| phase.contains_key(key);
    let mut all = Vec::new();
    if has("resistance")
        && let Some(r) = reader.positive::<Ohm>("resistance", "positive, such as \"50 mΩ\"")
    {
        Ways(&RESISTANCE, &mut all).add(r, 1.0, false);
    }
    if has("L_d") || has("L_q") {
        let [d, q] = ["L_d", "L_q"].map(|key| {
            let needed = "the positive inductance of a phase along the magnet (L_d) or across it (L_q), such as \"2.1 mH\"";
            reader.number::<Henry>(key, phase.get(key), needed, |l| (1e-15..=1e12).contains(&l))
        });
        if let (Some(d), Some(q)) = (d, q) {
            of_inductances([d, q], &mut all);
        }
    }
    if has("magnet_flux")
        && let Some(flux) = reader.number::<Weber>(
            "magnet_flux",
            phase.get("magnet_flux"),
            "zero or more, such as \"90 mWb\"",
            |flux| flux == 0.0 || (1e-15..=1e12).contains(&flux),
        )
    {
        of_flux(flux, pole_pairs, &mut all);
    }
    if has("rated_current")
        && let Some(peak) = reader.positive::<Ampere>("rated_current", "positive, such as \"10 A\"")
    {
        Ways(&CURRENT, &mut all).add(peak, 1.0, false);
    }
    if reader.problems.is_empty() {
        return Ok(all);
    }
    Err(MotorError::Format { file: "the numbers given".to_owned(), message: reader.problems.join("; ") })
}

/// Makes a table of pairs of key and text. Texts that are numbers become numbers.
pub(in crate::datasheet) fn table<'a>(given: impl IntoIterator<Item = (&'a str, &'a str)>) -> Table {
    let value = |text: &str| {
        let text = text.trim();
        let whole = text.parse::<i64>().map(Value::Integer);
        let number = || text.parse::<f64>().map(Value::Float);
        whole.or_else(|_| number()).unwrap_or_else(|_| Value::String(text.to_owned()))
    };
    given.into_iter().map(|(key, text)| (key.trim().to_owned(), value(text))).collect()
}
