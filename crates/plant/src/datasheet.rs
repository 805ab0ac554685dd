//! Motor data sheets: TOML in which each number says where it comes from.

use std::fmt;

use serde::Deserialize;
use standstill_interface::Dq;

use crate::quantity::unit::{
    Ampere, Henry, KilogramSquareMetre, NewtonMetre, NewtonMetreSecond, Ohm, One, Volt, Watt, Weber,
};
use crate::{
    Algebraic, Core, Friction, IronBridge, Linear, Magnetics, Motor, Quantity, Rotor, Unit, Winding,
};

/// Where a number comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Source {
    /// Printed in the source that the data sheet names.
    Given,
    /// Computed from what is printed there.
    Inferred,
    /// Neither: chosen, for the reason stated.
    Assumed,
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Given => "given",
            Self::Inferred => "inferred",
            Self::Assumed => "assumed",
        })
    }
}

/// One number of a data sheet.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, bound = "U: Unit", expecting = "a table { value = …, source = …, reason = … }")]
pub struct Sourced<U> {
    value: Quantity<U>,
    source: Source,
    reason: String,
}

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

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RatingTable {
    power: Option<Sourced<Watt>>,
    current: Sourced<Ampere>,
    dc_link: Option<Sourced<Volt>>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct WindingTable {
    pole_pairs: Sourced<One>,
    resistance: Sourced<Ohm>,
    mean_inductance: Sourced<Henry>,
    saliency: Sourced<Henry>,
    leakage: Sourced<Henry>,
    magnet_flux: Sourced<Weber>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SaturationTable {
    a_d0: Sourced<One>,
    a_dd: Sourced<One>,
    s: Sourced<One>,
    a_q0: Sourced<One>,
    a_qq: Sourced<One>,
    t: Sourced<One>,
    a_dq: Sourced<One>,
    u: Sourced<One>,
    v: Sourced<One>,
    i_f: Sourced<Ampere>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct BridgeTable {
    a_b: Sourced<One>,
    a_bp: Sourced<One>,
    k_q: Sourced<One>,
    psi_n: Sourced<Weber>,
    w: Sourced<One>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RotorTable {
    inertia: Sourced<KilogramSquareMetre>,
    stiction: Sourced<NewtonMetre>,
    coulomb: Sourced<NewtonMetre>,
    viscous: Sourced<NewtonMetreSecond>,
}

/// A motor as its file states it. Without a `[saturation]` table the core is linear; a `[bridge]` table adds the
/// iron bridges of a magnet-assisted reluctance rotor to it.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DataSheet {
    /// The file, or the built-in's name.
    #[serde(skip)]
    file: String,
    name: String,
    title: String,
    notes: String,
    rating: RatingTable,
    winding: WindingTable,
    saturation: Option<SaturationTable>,
    bridge: Option<BridgeTable>,
    rotor: RotorTable,
}

/// A data sheet that is not a motor.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum MotorError {
    /// Not TOML, or not with these keys; the message shows the line.
    Format {
        /// The file, or the built-in's name.
        file: String,
        /// What the parser says.
        message: String,
    },
    /// A number that no motor has.
    Value {
        /// The file, or the built-in's name.
        file: String,
        /// Its key.
        key: &'static str,
        /// What was found.
        found: String,
        /// What is needed.
        needed: String,
    },
}

impl fmt::Display for MotorError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Format { file, message } => write!(f, "{file}: {message}"),
            Self::Value { file, key, found, needed } => {
                write!(f, "{file}: `{key}` is {found}, but must be {needed}")
            }
        }
    }
}

impl std::error::Error for MotorError {}

/// The line of a position in a text, and the key that stands there.
fn place(text: &str, position: usize) -> String {
    let line = text.char_indices().take_while(|(at, _)| *at < position).filter(|(_, c)| *c == '\n').count();
    let key = text.lines().nth(line).and_then(|line| line.split_once('=')).map_or("", |(key, _)| key.trim());
    if key.is_empty() { format!("line {}: ", line + 1) } else { format!("line {}, `{key}`: ", line + 1) }
}

impl DataSheet {
    /// From the text of a file; `file` is its name for error messages.
    pub fn parse(file: &str, text: &str) -> Result<Self, MotorError> {
        let sheet: Self = toml::from_str(text).map_err(|error| {
            let place = error.span().map_or_else(String::new, |span| place(text, span.start));
            let message = error.message().replace('\n', " ");
            MotorError::Format { file: file.to_owned(), message: place + &message }
        })?;
        let printable = |c: char| c.is_ascii_alphanumeric() || "-_. ".contains(c);
        if sheet.name.is_empty() || sheet.name.len() > 60 || !sheet.name.chars().all(printable) {
            let found = format!("{:?}", sheet.name.chars().take(60).collect::<String>());
            let needed = "1 to 60 letters, digits, spaces, dots, dashes or underscores".to_owned();
            return Err(MotorError::Value { file: file.to_owned(), key: "name", found, needed });
        }
        Ok(Self { file: file.to_owned(), ..sheet })
    }

    /// What the motor is.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// What its user should know.
    pub fn notes(&self) -> &str {
        &self.notes
    }

    /// Each number with its source, in the order of the file.
    pub fn entries(&self) -> Vec<Entry> {
        fn entry<U: Unit>(table: &str, key: &str, from: &Sourced<U>) -> Entry {
            Entry {
                key: format!("{table}.{key}"),
                value: from.value.to_string(),
                source: from.source,
                reason: from.reason.trim().to_owned(),
            }
        }
        let Self { rating, winding: w, rotor: r, .. } = self;
        let mut entries = Vec::new();
        entries.extend(rating.power.as_ref().map(|power| entry("rating", "power", power)));
        entries.push(entry("rating", "current", &rating.current));
        entries.extend(rating.dc_link.as_ref().map(|dc_link| entry("rating", "dc_link", dc_link)));
        entries.extend([
            entry("winding", "pole_pairs", &w.pole_pairs),
            entry("winding", "resistance", &w.resistance),
            entry("winding", "mean_inductance", &w.mean_inductance),
            entry("winding", "saliency", &w.saliency),
            entry("winding", "leakage", &w.leakage),
            entry("winding", "magnet_flux", &w.magnet_flux),
        ]);
        if let Some(s) = &self.saturation {
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
        if let Some(b) = &self.bridge {
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
        entries
    }

    /// The motor, if the numbers make one.
    pub fn motor(&self) -> Result<Motor, MotorError> {
        let check = Check { file: &self.file };
        let w = &self.winding;
        let resistance = check.positive("winding.resistance", &w.resistance)?;
        if let Some(power) = &self.rating.power {
            check.positive("rating.power", power)?;
        }
        let winding = Winding {
            mean_inductance: check.positive("winding.mean_inductance", &w.mean_inductance)?,
            saliency: w.saliency.value.value(),
            leakage: check.at_least_zero("winding.leakage", &w.leakage)?,
        };
        if winding.d_axis_inductance() <= 0.0 || winding.q_axis_inductance() <= 0.0 {
            return Err(check.value(
                "winding.saliency",
                &w.saliency.value,
                "such that L_d = 3/2 (L_A + L_B) + L_σ and L_q = 3/2 (L_A − L_B) + L_σ are positive",
            ));
        }
        if winding.d_axis_inductance().min(winding.q_axis_inductance()) < 1e-6 * resistance {
            let needed =
                "small enough for time constants L_d/R and L_q/R of at least 1 µs, as every motor has";
            return Err(check.value("winding.resistance", &w.resistance.value, needed));
        }
        let magnet_flux = check.at_least_zero("winding.magnet_flux", &w.magnet_flux)?;
        let r = &self.rotor;
        let friction = Friction {
            stiction: check.at_least_zero("rotor.stiction", &r.stiction)?,
            coulomb: check.at_least_zero("rotor.coulomb", &r.coulomb)?,
            viscous: check.at_least_zero("rotor.viscous", &r.viscous)?,
        };
        if friction.coulomb > friction.stiction {
            let needed = format!("at most rotor.stiction, {}", r.stiction.value);
            return Err(check.value("rotor.coulomb", &r.coulomb.value, &needed));
        }
        let motor = Motor {
            name: self.name.clone(),
            pole_pairs: check.whole("winding.pole_pairs", &w.pole_pairs, 1, 200)?.into(),
            resistance,
            rated_current: check.positive("rating.current", &self.rating.current)?,
            dc_link: match &self.rating.dc_link {
                Some(dc_link) => Some(check.positive("rating.dc_link", dc_link)?),
                None => None,
            },
            winding,
            magnet_flux,
            core: match (&self.saturation, &self.bridge) {
                (None, None) => Core::Linear(Linear::from_winding(&winding, magnet_flux)),
                (None, Some(_)) => {
                    return Err(check.value(
                        "bridge",
                        &"given without [saturation]",
                        "given with it, or not at all",
                    ));
                }
                (Some(table), bridge) => {
                    let bridge = bridge.as_ref().map(|table| check.bridge(table)).transpose()?;
                    Core::Algebraic(Algebraic { bridge, ..check.saturation(table)? })
                }
            },
            rotor: Rotor { inertia: check.positive("rotor.inertia", &r.inertia)?, friction },
        };
        check.core(&motor)?;
        check.consistent(&motor)?;
        Ok(motor)
    }
}

struct Check<'a> {
    file: &'a str,
}

/// No number of a motor is larger than this in SI units. It keeps typing errors from becoming infinite.
const LARGEST: f64 = 1e6;

impl Check<'_> {
    fn value(&self, key: &'static str, found: &impl fmt::Display, needed: &str) -> MotorError {
        MotorError::Value {
            file: self.file.to_owned(),
            key,
            found: found.to_string(),
            needed: needed.to_owned(),
        }
    }

    fn positive<U: Unit>(&self, key: &'static str, from: &Sourced<U>) -> Result<f64, MotorError> {
        let value = from.value.value();
        if (1.0 / LARGEST..=LARGEST).contains(&value) {
            Ok(value)
        } else {
            Err(self.value(key, &from.value, &format!("positive, from 1e-6 to 1e6 {}", U::SYMBOL)))
        }
    }

    fn at_least_zero<U: Unit>(&self, key: &'static str, from: &Sourced<U>) -> Result<f64, MotorError> {
        let value = from.value.value();
        if (0.0..=LARGEST).contains(&value) {
            Ok(value)
        } else {
            Err(self.value(key, &from.value, &format!("zero or more, up to 1e6 {}", U::SYMBOL)))
        }
    }

    /// A saturated core must be the motor that `[winding]` describes, or a change there would go unnoticed.
    fn consistent(&self, motor: &Motor) -> Result<(), MotorError> {
        let Ok(rest) = motor.core.flux_at(Dq::new(0.0, 0.0)) else { return Ok(()) };
        let l = motor.core.current_and_inverse_inductance(rest).1.inverse();
        let winding = &motor.winding;
        let pairs = [
            ("winding.mean_inductance", "L_d without current", l.xx, winding.d_axis_inductance(), "H", 0.0),
            ("winding.mean_inductance", "L_q without current", l.yy, winding.q_axis_inductance(), "H", 0.0),
            ("winding.magnet_flux", "flux without current", rest.d, motor.magnet_flux, "Wb", 1e-4),
        ];
        for (key, what, saturated, stated, unit, slack) in pairs {
            if (saturated - stated).abs() > 0.02 * stated.abs() + slack {
                let found = format!("such that the {what} is {stated:.4e} {unit}");
                let needed = format!("within 2 % of what [saturation] makes it, {saturated:.4e} {unit}");
                return Err(self.value(key, &found, &needed));
            }
        }
        Ok(())
    }

    fn whole(&self, key: &'static str, from: &Sourced<One>, least: u8, most: u8) -> Result<u8, MotorError> {
        (least..=most).find(|n| f64::from(*n) == from.value.value()).ok_or_else(|| {
            self.value(
                key,
                &from.value,
                if least == 0 { "a whole number from 0 to 60" } else { "a whole number from 1 to 200" },
            )
        })
    }

    fn saturation(&self, table: &SaturationTable) -> Result<Algebraic, MotorError> {
        Ok(Algebraic {
            d: self.at_least_zero("saturation.a_d0", &table.a_d0)?,
            dd: self.at_least_zero("saturation.a_dd", &table.a_dd)?,
            d_exponent: self.whole("saturation.s", &table.s, 0, 60)?,
            q: self.at_least_zero("saturation.a_q0", &table.a_q0)?,
            qq: self.at_least_zero("saturation.a_qq", &table.a_qq)?,
            q_exponent: self.whole("saturation.t", &table.t, 0, 60)?,
            cross: self.at_least_zero("saturation.a_dq", &table.a_dq)?,
            cross_d_exponent: self.whole("saturation.u", &table.u, 0, 60)?,
            cross_q_exponent: self.whole("saturation.v", &table.v, 0, 60)?,
            magnet_current: self.at_least_zero("saturation.i_f", &table.i_f)?,
            bridge: None,
        })
    }

    fn bridge(&self, table: &BridgeTable) -> Result<IronBridge, MotorError> {
        Ok(IronBridge {
            strength: self.at_least_zero("bridge.a_b", &table.a_b)?,
            saturation: self.at_least_zero("bridge.a_bp", &table.a_bp)?,
            q_share: self.at_least_zero("bridge.k_q", &table.k_q)?,
            magnet_flux: self.at_least_zero("bridge.psi_n", &table.psi_n)?,
            exponent: self.whole("bridge.w", &table.w, 1, 200)?,
        })
    }

    /// The Hessian must be positive definite wherever a detection may take the core: to three times the rated
    /// current in any direction.
    fn core(&self, motor: &Motor) -> Result<(), MotorError> {
        for step in 0..48 {
            let (sin, cos) = (f64::from(step) * std::f64::consts::TAU / 48.0).sin_cos();
            for share in [0.0, 0.5, 1.0, 2.0, 3.0] {
                let current = Dq::new(cos, sin) * (motor.rated_current * share);
                let convex = motor.core.flux_at(current).is_ok_and(|flux| {
                    motor.core.current_and_inverse_inductance(flux).1.is_positive_definite()
                });
                if !convex {
                    let found = format!("not convex near i_d = {:.3} A, i_q = {:.3} A", current.d, current.q);
                    return Err(self.value(
                        "saturation",
                        &found,
                        "an energy whose inductances stay positive",
                    ));
                }
            }
        }
        Ok(())
    }
}
