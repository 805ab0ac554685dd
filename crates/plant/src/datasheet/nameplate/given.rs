//! Numbers of a `[nameplate]` in the ways in which data sheets and controllers give them, and the values of a phase
//! that they come to.
//!
//! In the list below, ω is the electrical speed, p the number of pole pairs, ψ the peak flux linkage of a phase. A
//! shaft's speed n in revolutions per minute makes ω = p·2π·n/60.
//!
//! * **Between two terminals.** Two phases of a star are in series, so a resistance or an inductance between two
//!   terminals is twice that of a phase. In delta a phase is parallel to the other two in series, so the measured value
//!   is 2/3 of a phase's. Half of it, 1/3, is the phase of the equivalent star. Half of the measured value is therefore
//!   right for either connection. While the shaft turns, the inductance between two terminals runs from 2·L_d to 2·L_q,
//!   with the third terminal open; magnets inside the rotor make L_d the smaller one.
//! * **`Kv`** in rpm/V is the speed at which the *peak* voltage between two terminals is one volt: √3·ω·ψ = 1 V at n =
//!   Kv, so that ψ = 60 / (2π·√3·p·Kv). This is the hobby's convention; ODrive's torque constant 8.27 / Kv N m per
//!   ampere of a phase's peak is the same statement, 3/2·p·ψ = √3/2·60/(2π) / Kv.
//! * **`Ke_…`** in V per 1,000 rpm is ψ·ω at n = 1,000, times √3 between two terminals, over √2 as an rms value.
//!   `Ke_line_peak` is that of `MathWorks`' Motor Control Blockset (`Vpk_LL/krpm`), `Ke_line_rms` that of ST's Motor
//!   Control Workbench ("Volts RMS ph-ph/kRPM").
//! * **`vesc_…`** are `foc_motor_r`, `foc_motor_l`, `foc_motor_flux_linkage` and `foc_motor_ld_lq_diff` of a VESC:
//!   values of a phase, L = (L_d + L_q)/2 and difference L_q − L_d (`motor/foc_math.c`: `p_lq = l + diff/2`, `p_ld = l
//!   − diff/2`). Firmware before 5.03 measured R and L 2/3 as large ("Correct scaling for resistance and inductance" in
//!   its changelog).
//! * **`Kt_…`** is torque per ampere of a phase, 3/2·p·ψ of its peak (ODrive's `torque_constant`), √2 times that of its rms.
//! * **`rated_current_rms`** is the rms current of a phase, its peak over √2.
//! * **`…_delta`** is of one winding of a motor in delta: its resistance and inductance are three times those of a phase of the equivalent star,
//!   its current is 1/√3 of the terminal's.

#[cfg(test)]
mod tests;

use std::f64::consts::{PI, SQRT_2};

use standstill_quantity::Unit;
use standstill_quantity::unit::{
    Ampere, Henry, NewtonMetrePerAmpere, Ohm, RevolutionsPerMinuteVolt, VoltPerThousandRevolutionsPerMinute,
    Weber,
};
use toml::{Table, Value};

use super::reader::Reader;
use super::whole::sourced;

/// A way of giving a number by one key.
pub(super) struct Way {
    pub(super) key: [&'static str; 1],
    pub(super) unit: &'static str,
    /// Description of this way.
    pub(super) meaning: &'static str,
    /// True if the number is per turn of the shaft, so that the pole pairs p are needed.
    pub(super) per_turn: bool,
    /// Returns this way's number for the value of a phase and p, 1 unless needed.
    pub(super) given: fn(f64, f64) -> f64,
    /// Returns the value of a phase for this way's number and p.
    phase: fn(f64, f64) -> f64,
    read: fn(&mut Reader<'_>, &'static str, &str) -> Option<f64>,
    /// The requirement, as messages name it, and the conversion as the source of a converted number.
    words: [&'static str; 2],
}

/// A number that data sheets give in several ways.
pub(super) struct Group {
    name: &'static str,
    /// Name of the quantity, the same for all ways.
    pub(super) quantity: &'static str,
    /// The keys of a phase.
    pub(super) phase: &'static [&'static str],
    /// Ways of two keys.
    pairs: &'static [&'static [&'static str]],
    pub(super) ways: &'static [Way],
}

/// Makes ways: key and unit, meaning, number from a phase's value, phase's value from the number, requirement, conversion.
macro_rules! ways {
    ($($key:literal $unit:ident $(per $turn:ident)?, $meaning:literal, $given:expr, $phase:expr, $needed:literal, $how:literal;)*) => {
        &[$(Way {
            key: [$key],
            unit: <$unit as Unit>::SYMBOL,
            meaning: $meaning,
            per_turn: ways!(@ $($turn)?),
            given: $given,
            phase: $phase,
            read: |reader, key, needed| reader.positive::<$unit>(key, needed),
            words: [$needed, $how],
        }),*]
    };
    (@ turn) => { true };
    (@) => { false };
}

type Torque = NewtonMetrePerAmpere;
type Volts = VoltPerThousandRevolutionsPerMinute;

const fn same(value: f64, _: f64) -> f64 {
    value
}

pub(super) static RESISTANCE: Group = Group {
    name: "the resistance",
    quantity: "resistance",
    phase: &["resistance"],
    pairs: &[],
    ways: ways! {
        "resistance" Ohm, "of a phase, in star", same, same, "", "";
        "resistance_line_to_line" Ohm, "between two terminals, in star and in delta", |r, _| 2.0 * r, |r, _| 0.5 * r,
            "the positive resistance between two terminals, such as \"0.1 Ω\"", "half of {} between two terminals";
        "vesc_R" Ohm, "foc_motor_r of a VESC (firmware from 5.03)", same, same,
            "the positive foc_motor_r of a VESC, such as \"18 mΩ\"", "foc_motor_r = {}";
        "resistance_delta" Ohm, "of a winding between two terminals, in delta", |r, _| 3.0 * r, |r, _| r / 3.0,
            "the positive resistance of a winding in delta, such as \"0.15 Ω\"", "a third of {} in delta";
    },
};

/// The ways of one key give inductances that are alike along both axes.
pub(super) static INDUCTANCES: Group = Group {
    name: "the inductances",
    quantity: "inductance",
    phase: &["L_d", "L_q"],
    pairs: &[&["L_d", "L_q"], &["L_line_to_line_min", "L_line_to_line_max"], &["vesc_L", "vesc_ld_lq_diff"]],
    ways: ways! {
        "L_line_to_line" Henry, "between two terminals, alike along both axes", |l, _| 2.0 * l, |l, _| 0.5 * l,
            "the positive inductance between two terminals, such as \"40 µH\"", "half of {} between two terminals, alike along both axes";
        "L_delta" Henry, "of a winding in delta, alike along both axes", |l, _| 3.0 * l, |l, _| l / 3.0,
            "the positive inductance of a winding in delta, such as \"60 µH\"", "a third of {} in delta, alike along both axes";
    },
};

pub(super) static FLUX: Group = Group {
    name: "the magnet's flux",
    quantity: "magnet's flux",
    phase: &["magnet_flux"],
    pairs: &[],
    ways: ways! {
        "magnet_flux" Weber, "flux linkage of a phase, peak", same, same, "", "";
        "vesc_lambda" Weber, "foc_motor_flux_linkage of a VESC", same, same,
            "the positive foc_motor_flux_linkage of a VESC, such as \"3.4 mWb\"", "foc_motor_flux_linkage = {}";
        "Kv" RevolutionsPerMinuteVolt per turn, "speed for a peak of 1 V between two terminals",
            |flux, p| 1000.0 / (root(3.0) * voltage(flux, p)), |kv, p| 60.0 / (2.0 * PI * root(3.0) * p * kv),
            "positive, such as \"900 rpm/V\"", "Kv = {}, 60 / (2π √3 p Kv)";
        "Ke_line_peak" Volts per turn, "between two terminals, peak (Motor Control Blockset)",
            |flux, p| root(3.0) * voltage(flux, p), |ke, p| of_voltage(ke / root(3.0), p),
            "positive, such as \"4.6 V/krpm\"", "Ke = {} between two terminals, peak";
        "Ke_line_rms" Volts per turn, "between two terminals, rms (Motor Control Workbench)",
            |flux, p| root(3.0) * voltage(flux, p) / SQRT_2, |ke, p| of_voltage(ke * SQRT_2 / root(3.0), p),
            "positive, such as \"4.6 V/krpm\"", "Ke = {} between two terminals, rms";
        "Ke_phase_peak" Volts per turn, "of a phase, peak", voltage, of_voltage,
            "positive, such as \"4.6 V/krpm\"", "Ke = {} of a phase, peak";
        "Ke_phase_rms" Volts per turn, "of a phase, rms", |flux, p| voltage(flux, p) / SQRT_2, |ke, p| of_voltage(ke * SQRT_2, p),
            "positive, such as \"4.6 V/krpm\"", "Ke = {} of a phase, rms";
        "Kt_peak" Torque per turn, "torque per ampere of a phase's peak (ODrive: 8.27 / Kv)",
            |flux, p| 1.5 * p * flux, |kt, p| kt / (1.5 * p),
            "positive, such as \"12 mN m/A\"", "Kt = {} of a phase's peak, 2 Kt / (3 p)";
        "Kt_rms" Torque per turn, "torque per ampere rms of a phase", |flux, p| SQRT_2 * (1.5 * p * flux), |kt, p| kt / SQRT_2 / (1.5 * p),
            "positive, such as \"12 mN m/A\"", "Kt = {} of a phase's rms, √2 Kt / (3 p)";
    },
};

pub(super) static CURRENT: Group = Group {
    name: "the rated current",
    quantity: "rated current",
    phase: &["rated_current"],
    pairs: &[],
    ways: ways! {
        "rated_current" Ampere, "of a phase, peak", same, same, "", "";
        "rated_current_rms" Ampere, "of a phase, rms", |peak, _| peak / SQRT_2, |i, _| SQRT_2 * i,
            "the positive rms current of a phase, such as \"10 A\"", "√2 times {} rms";
        "rated_current_delta" Ampere, "of a winding in delta, peak", |peak, _| peak / root(3.0), |i, _| root(3.0) * i,
            "the positive peak current of a winding in delta, such as \"10 A\"", "√3 times {} in delta";
    },
};

pub(super) static GROUPS: [&Group; 4] = [&RESISTANCE, &INDUCTANCES, &FLUX, &CURRENT];

fn root(of: f64) -> f64 {
    of.sqrt()
}

/// Returns the peak voltage of a phase at 1,000 rpm for ψ in Wb.
fn voltage(flux: f64, pole_pairs: f64) -> f64 {
    flux * pole_pairs * 2.0 * PI * 1000.0 / 60.0
}

/// Returns ψ in Wb for the peak voltage of a phase at 1,000 rpm.
fn of_voltage(phase_peak: f64, pole_pairs: f64) -> f64 {
    phase_peak / (pole_pairs * 2.0 * PI * 1000.0 / 60.0)
}

impl Group {
    /// All ways of giving the number, each with its keys.
    fn keys(&self) -> impl Iterator<Item = &'static [&'static str]> + use<> {
        self.pairs.iter().copied().chain(self.ways.iter().map(|way| &way.key[..]))
    }
}

/// All ways of giving a number, each with its keys.
pub(super) fn ways() -> impl Iterator<Item = &'static [&'static str]> {
    GROUPS.iter().flat_map(|group| group.keys())
}

/// Returns all keys that give a number in one of several ways.
pub(super) fn keys() -> impl Iterator<Item = &'static str> {
    ways().flatten().copied()
}

/// Returns the key of a sheet that gives the same number as this key, such as `nameplate.magnet_flux`, in another way; none if the sheet has
/// no such key.
pub(in crate::datasheet) fn stands_for(key: &str, sheet: &Table) -> Option<&'static str> {
    let plate = sheet.get("nameplate").and_then(Value::as_table)?;
    let key = key.strip_prefix("nameplate.")?;
    let group = GROUPS.iter().find(|of| of.phase.contains(&key))?;
    group.keys().flatten().copied().find(|key| !group.phase.contains(key) && plate.contains_key(*key))
}

/// Returns the unambiguous keys that replace an ambiguous one.
pub(super) fn instead_of(key: &str) -> Option<&'static str> {
    Some(match key {
        "Ke" | "ke" | "K_e" => {
            "a voltage constant is Ke_line_peak, Ke_line_rms, Ke_phase_peak or Ke_phase_rms, between two terminals or of a phase, peak or rms"
        }
        "Kt" | "kt" | "KT" | "K_t" | "torque_constant" => {
            "a torque constant is Kt_peak or Kt_rms, per ampere of a phase's peak or rms; per ampere of direct current in six-step operation it is Ke_line_peak, of which 1 V/krpm is 9.549 mN m/A"
        }
        "KV" | "kv" | "K_v" => "a speed constant is Kv, such as Kv = \"900 rpm/V\"",
        "L" | "inductance" => {
            "one inductance is L_line_to_line between two terminals, L_delta of a winding in delta, or both L_d and L_q of a phase"
        }
        "R" => {
            "a resistance is resistance of a phase, resistance_line_to_line between two terminals, or resistance_delta of a winding in delta"
        }
        "poles" | "pole_count" => "pole_pairs is half the number of poles",
        "L_d_line_to_line" | "L_q_line_to_line" | "Ld_line_to_line" | "Lq_line_to_line" => {
            "the inductances between two terminals are L_line_to_line_min, twice L_d, and L_line_to_line_max, twice L_q"
        }
        "lambda" | "psi" | "flux" => "a flux linkage is magnet_flux, the peak of a phase",
        _ => return None,
    })
}

/// Rounds the value of a converted number to six digits; the given number has fewer.
fn in_six_digits(mut converted: Value) -> Value {
    if let Some(Value::Float(value)) = converted.get_mut("value") {
        *value = standstill_quantity::significant(*value, 6);
    }
    converted
}

/// Returns a converted number with its source.
fn converted(value: f64, from: &Value, how: &str) -> Value {
    let of = |key: &str| from.get(key).and_then(Value::as_str);
    let plain = from.get("value").unwrap_or(from);
    let plain = plain.as_str().map_or_else(|| plain.to_string(), str::to_owned);
    let reason = of("reason").map_or_else(String::new, |reason| format!("; {reason}"));
    // What was assumed or measured stays so.
    let source = of("source").filter(|source| *source != "given").unwrap_or("inferred");
    sourced(value, source, &(how.replace("{}", &plain) + &reason))
}

/// Returns the table with the values of a phase in place of all other ways of giving them. Wrong numbers and numbers
/// given twice are added to the reader's problems. A wrong number is replaced by a valid one, which is not used because
/// the sheet is refused. `is_rounded`: converted values are rounded to six digits, as a data sheet shows them.
pub(super) fn in_phase_values(reader: &mut Reader, is_rounded: bool) -> Table {
    let given = reader.table;
    let mut table = given.clone();
    for key in keys().filter(|key| !GROUPS.iter().any(|group| group.phase.contains(key))) {
        table.remove(key);
    }
    for group in GROUPS {
        let is_given = |way: &&[&str]| way.iter().any(|key| given.contains_key(*key));
        let ways: Vec<&[&str]> = group.keys().filter(is_given).collect();
        if let [first, .., last] = ways[..] {
            let keys: Vec<&str> = [first, last]
                .iter()
                .filter_map(|way| way.iter().find(|key| given.contains_key(**key)).copied())
                .collect();
            let place = reader.place(keys[1]);
            reader
                .problems
                .push(format!("{place}gives {}, as `{}` does: keep one of them", group.name, keys[0]));
        }
        let Some(way) = ways.first().filter(|way| way[0] != group.phase[0] || ways.len() > 1) else {
            continue;
        };
        let values = convert(reader, group, way);
        for (at, key) in group.phase.iter().enumerate() {
            let value = values.as_ref().and_then(|values| values.get(at).or(values.first())).cloned();
            let value = if is_rounded { value.map(in_six_digits) } else { value };
            if value.is_some() || !table.contains_key(*key) {
                table.insert((*key).to_owned(), value.unwrap_or(Value::Float(1e-3)));
            }
        }
    }
    table
}

/// Returns the values of a phase that the keys of one way come to; none if one is wrong, or is a phase's already.
fn convert(reader: &mut Reader, group: &Group, way: &[&'static str]) -> Option<Vec<Value>> {
    let given = reader.table;
    let from = |key: &str| given.get(key).cloned().unwrap_or(Value::Float(0.0));
    match way[0] {
        "L_line_to_line_min" => {
            let [least, most] = ["L_line_to_line_min", "L_line_to_line_max"].map(|key| {
                reader.positive::<Henry>(key, "the positive inductance between two terminals where it is least (min) or most (max), such as \"40 µH\"")
            });
            let (least, most) = (least?, most?);
            if most < least {
                let place = reader.place("L_line_to_line_max");
                reader.problems.push(format!("{place}must be at least L_line_to_line_min"));
                return None;
            }
            let half = |value: f64, key: &str| {
                converted(0.5 * value, &from(key), "half of {} between two terminals")
            };
            Some(vec![half(least, "L_line_to_line_min"), half(most, "L_line_to_line_max")])
        }
        key @ "vesc_L" => {
            let l = reader.positive::<Henry>(key, "the positive foc_motor_l of a VESC, such as \"14 µH\"")?;
            let apart = "vesc_ld_lq_diff";
            let difference = match given.get(apart) {
                None => 0.0,
                value => {
                    let needed = "foc_motor_ld_lq_diff of a VESC, less than twice vesc_L either way";
                    reader.number::<Henry>(apart, value, needed, |d| d.abs() < 2.0 * l)?
                }
            };
            let how = "foc_motor_l = {}, half of foc_motor_ld_lq_diff less along d and more along q";
            Some([-0.5, 0.5].map(|half| converted(l + half * difference, &from(key), how)).into())
        }
        key => {
            let way = group.ways.iter().find(|way| way.key[0] == key && !group.phase.contains(&key))?;
            let [needed, how] = way.words;
            let value = (way.read)(reader, key, needed)?;
            let pole_pairs = if way.per_turn { pole_pairs(given)? } else { 1.0 };
            Some(vec![converted((way.phase)(value, pole_pairs), &from(key), how)])
        }
    }
}

/// Returns the number of pole pairs; none if it is no number of at least one.
fn pole_pairs(given: &Table) -> Option<f64> {
    let value = given.get("pole_pairs")?;
    let value = value.get("value").unwrap_or(value);
    value.as_float().or_else(|| value.as_integer().map(|n| n as f64)).filter(|p| *p >= 1.0)
}
