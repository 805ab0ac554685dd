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

use standstill_quantity::unit::{
    Ampere, Henry, NewtonMetrePerAmpere, Ohm, RevolutionsPerMinuteVolt, VoltPerThousandRevolutionsPerMinute,
    Weber,
};
use toml::{Table, Value};

use super::reader::Reader;
use super::whole::sourced;

/// A number that data sheets give in several ways: its name, the keys that it has in the end, and the ways, each with its keys.
struct Group {
    name: &'static str,
    phase: &'static [&'static str],
    ways: &'static [&'static [&'static str]],
}

static GROUPS: [Group; 4] = [
    Group {
        name: "the resistance",
        phase: &["resistance"],
        ways: &[&["resistance"], &["resistance_line_to_line"], &["resistance_delta"], &["vesc_R"]],
    },
    Group {
        name: "the inductances",
        phase: &["L_d", "L_q"],
        ways: &[
            &["L_d", "L_q"],
            &["L_line_to_line"],
            &["L_line_to_line_min", "L_line_to_line_max"],
            &["L_delta"],
            &["vesc_L", "vesc_ld_lq_diff"],
        ],
    },
    Group {
        name: "the magnet's flux",
        phase: &["magnet_flux"],
        ways: &[
            &["magnet_flux"],
            &["Kv"],
            &["Ke_line_peak"],
            &["Ke_line_rms"],
            &["Ke_phase_peak"],
            &["Ke_phase_rms"],
            &["Kt_peak"],
            &["Kt_rms"],
            &["vesc_lambda"],
        ],
    },
    Group {
        name: "the rated current",
        phase: &["rated_current"],
        ways: &[&["rated_current"], &["rated_current_rms"], &["rated_current_delta"]],
    },
];

/// All ways of giving a number, each with its keys.
pub(super) fn ways() -> impl Iterator<Item = &'static [&'static str]> {
    GROUPS.iter().flat_map(|group| group.ways.iter().copied())
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
    group.ways[1..].iter().copied().flatten().copied().find(|key| plate.contains_key(*key))
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
        "lambda" | "psi" | "flux" => "a flux linkage is magnet_flux, the peak of a phase",
        _ => return None,
    })
}

/// Returns ψ in Wb for a speed constant in rpm/V and a number of pole pairs.
fn of_speed_constant(kv: f64, pole_pairs: f64) -> f64 {
    60.0 / (2.0 * PI * 3.0_f64.sqrt() * pole_pairs * kv)
}

/// Returns ψ in Wb for the peak voltage of a phase at 1,000 rpm.
fn of_voltage_constant(phase_peak: f64, pole_pairs: f64) -> f64 {
    phase_peak / (pole_pairs * 2.0 * PI * 1000.0 / 60.0)
}

/// Returns ψ in Wb for a torque in N m per ampere of a phase's peak.
fn of_torque_constant(per_peak: f64, pole_pairs: f64) -> f64 {
    per_peak / (1.5 * pole_pairs)
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
    for group in &GROUPS {
        let is_given = |way: &&&[&str]| way.iter().any(|key| given.contains_key(*key));
        let ways: Vec<&&[&str]> = group.ways.iter().filter(is_given).collect();
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
        let values = convert(reader, way);
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
fn convert(reader: &mut Reader, way: &[&'static str]) -> Option<Vec<Value>> {
    let given = reader.table;
    let from = |key: &str| given.get(key).cloned().unwrap_or(Value::Float(0.0));
    let key = way[0];
    match key {
        "resistance_line_to_line" => {
            let r = reader
                .positive::<Ohm>(key, "the positive resistance between two terminals, such as \"0.1 Ω\"")?;
            Some(vec![converted(0.5 * r, &from(key), "half of {} between two terminals")])
        }
        "resistance_delta" => {
            let needed = "the positive resistance of a winding in delta, such as \"0.15 Ω\"";
            Some(vec![converted(
                reader.positive::<Ohm>(key, needed)? / 3.0,
                &from(key),
                "a third of {} in delta",
            )])
        }
        "vesc_R" => {
            let r = reader.positive::<Ohm>(key, "the positive foc_motor_r of a VESC, such as \"18 mΩ\"")?;
            Some(vec![converted(r, &from(key), "foc_motor_r = {}")])
        }
        "L_line_to_line" => {
            let l = reader
                .positive::<Henry>(key, "the positive inductance between two terminals, such as \"40 µH\"")?;
            Some(vec![converted(
                0.5 * l,
                &from(key),
                "half of {} between two terminals, alike along both axes",
            )])
        }
        "L_delta" => {
            let needed = "the positive inductance of a winding in delta, such as \"60 µH\"";
            let l = reader.positive::<Henry>(key, needed)?;
            Some(vec![converted(l / 3.0, &from(key), "a third of {} in delta, alike along both axes")])
        }
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
        "vesc_L" => {
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
        "rated_current_rms" => {
            let i =
                reader.positive::<Ampere>(key, "the positive rms current of a phase, such as \"10 A\"")?;
            Some(vec![converted(SQRT_2 * i, &from(key), "√2 times {} rms")])
        }
        "rated_current_delta" => {
            let needed = "the positive peak current of a winding in delta, such as \"10 A\"";
            let i = reader.positive::<Ampere>(key, needed)?;
            Some(vec![converted(3.0_f64.sqrt() * i, &from(key), "√3 times {} in delta")])
        }
        _ => flux(reader, key),
    }
}

/// Returns the peak flux linkage of a phase that a speed, voltage or torque constant or a VESC's number comes to; none if it is wrong, or another key.
fn flux(reader: &mut Reader, key: &'static str) -> Option<Vec<Value>> {
    let given = reader.table;
    let pole_pairs = || {
        let value = given.get("pole_pairs")?;
        let value = value.get("value").unwrap_or(value);
        value.as_float().or_else(|| value.as_integer().map(|n| n as f64)).filter(|p| *p >= 1.0)
    };
    let volts = |reader: &mut Reader| {
        reader.positive::<VoltPerThousandRevolutionsPerMinute>(key, "positive, such as \"4.6 V/krpm\"")
    };
    let torque =
        |reader: &mut Reader| reader.positive::<NewtonMetrePerAmpere>(key, "positive, such as \"12 mN m/A\"");
    let flux = |value: f64, how: &str| {
        Some(vec![converted(value, &given.get(key).cloned().unwrap_or(Value::Float(0.0)), how)])
    };
    match key {
        "Kv" => {
            let kv = reader.positive::<RevolutionsPerMinuteVolt>(key, "positive, such as \"900 rpm/V\"")?;
            flux(of_speed_constant(kv, pole_pairs()?), "Kv = {}, 60 / (2π √3 p Kv)")
        }
        "Ke_line_peak" => flux(
            of_voltage_constant(volts(reader)? / 3.0_f64.sqrt(), pole_pairs()?),
            "Ke = {} between two terminals, peak",
        ),
        "Ke_line_rms" => flux(
            of_voltage_constant(volts(reader)? * SQRT_2 / 3.0_f64.sqrt(), pole_pairs()?),
            "Ke = {} between two terminals, rms",
        ),
        "Ke_phase_peak" => {
            flux(of_voltage_constant(volts(reader)?, pole_pairs()?), "Ke = {} of a phase, peak")
        }
        "Ke_phase_rms" => {
            flux(of_voltage_constant(volts(reader)? * SQRT_2, pole_pairs()?), "Ke = {} of a phase, rms")
        }
        "Kt_peak" => flux(
            of_torque_constant(torque(reader)?, pole_pairs()?),
            "Kt = {} of a phase's peak, 2 Kt / (3 p)",
        ),
        "Kt_rms" => flux(
            of_torque_constant(torque(reader)? / SQRT_2, pole_pairs()?),
            "Kt = {} of a phase's rms, √2 Kt / (3 p)",
        ),
        "vesc_lambda" => {
            let flux_linkage = reader.positive::<Weber>(
                key,
                "the positive foc_motor_flux_linkage of a VESC, such as \"3.4 mWb\"",
            )?;
            flux(flux_linkage, "foc_motor_flux_linkage = {}")
        }
        _ => None,
    }
}
