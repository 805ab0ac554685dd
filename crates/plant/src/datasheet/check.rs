//! Whether the numbers of a data sheet make a motor.

use std::fmt;
use std::ops::RangeInclusive;

use standstill_files::sheet::{BridgeTable, SaturationTable, Sourced};
use standstill_interface::Dq;
use standstill_numeric::sin_cos;
use standstill_quantity::unit::One;
use standstill_quantity::{Unit, listed, short};

use super::{DataSheet, MotorError, nameplate, wrong};
use crate::{Algebraic, Core, FluxMap, IronBridge, Linear, MagneticCircuit, Magnetics, Motor, Winding};

impl DataSheet {
    /// Returns the motor, if the numbers make one.
    pub fn motor(&self) -> Result<Motor, MotorError> {
        self.motor_of(None)
    }

    /// Returns the motor of this sheet, which differs from the sheet of `known` in numbers of `[winding]` and `[rotor]`
    /// only. If these numbers do not change the core, as with `[saturation]` or `[map]`, the core of `known` is reused
    /// and not checked again.
    ///
    /// ```
    /// use standstill_plant::{DataSheet, built_in};
    /// use standstill_quantity::Quantity;
    ///
    /// let known = built_in("paper-5k5").ok_or("not built in")?;
    /// let text = DataSheet::built_in_text("paper-5k5").ok_or("not built in")?;
    /// let mut sheet = DataSheet::parse("paper-5k5", text)?;
    /// sheet.tables_mut().winding.resistance.value = Quantity::si(1.3);
    /// let other = sheet.motor_beside(&known)?;
    /// assert_eq!(other, sheet.motor()?);
    /// assert_eq!((other.resistance, known.resistance), (1.3, 1.2));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn motor_beside(&self, known: &Motor) -> Result<Motor, MotorError> {
        self.motor_of(Some(known))
    }

    fn motor_of(&self, known: Option<&Motor>) -> Result<Motor, MotorError> {
        let check = Check { sheet: (&self.file, &self.text) };
        let w = &self.tables.winding;
        let resistance = check.positive("winding.resistance", &w.resistance)?;
        let known_map = known.and_then(|known| match known.magnetics.core() {
            Core::Map(map) => Some(map.clone()),
            _ => None,
        });
        let map = match known_map {
            Some(map) => Some(map),
            None => self.map().map_err(MotorError::Map)?.map(|(map, _)| map),
        };
        let (winding, magnet_flux, core) = match map {
            Some(map) => self.mapped(&check, map)?,
            None => self.wound(&check)?,
        };
        if winding.d_axis_inductance().min(winding.q_axis_inductance()) < 1e-6 * resistance {
            let needed =
                "small enough for time constants L_d/R and L_q/R of at least 1 µs, as every motor has";
            return Err(check.value("winding.resistance", w.resistance.value, needed));
        }
        let rated_current = check.positive("rating.current", &self.tables.rating.current)?;
        // A map is the one that is known already; to compare it number by number would take as long as a detection.
        let same = known.filter(|known| matches!(core, Core::Map(_)) || *known.magnetics.core() == core);
        let magnetics = match same {
            Some(known) => known.magnetics.clone(),
            None => self.circuit(&check, core, rated_current)?,
        };
        let motor = Motor {
            name: self.tables.name.clone(),
            pole_pairs: check.whole("winding.pole_pairs", &w.pole_pairs, 1, 200)?.into(),
            resistance,
            rated_current,
            dc_link: check.positive_if_given("rating.dc_link", self.tables.rating.dc_link.as_ref())?,
            winding,
            magnet_flux,
            magnetics,
            thermal: check.thermal(self.tables.thermal.as_ref())?,
            rotor: check.rotor(&self.tables.rotor)?,
            ratings: check.ratings(&self.tables.rating)?,
        };
        // One by a nameplate is convex as it is made.
        if same.is_none() && self.tables.nameplate.is_none() {
            check.core(&motor)?;
        }
        check.consistent(&motor)?;
        Ok(motor)
    }

    /// Makes the magnetic circuit: core, harmonics, eddy currents and hysteresis.
    fn circuit(&self, check: &Check, core: Core, rated_current: f64) -> Result<MagneticCircuit, MotorError> {
        let circuit = MagneticCircuit::new(core)
            .map_err(|_| check.value("saturation", "not convex at no current", CONVEX))?;
        let circuit = circuit.with_eddy_currents(check.eddy(self.tables.eddy.as_ref())?);
        let harmonics = check.harmonics(self.tables.harmonics.as_ref(), &circuit)?;
        let hysteresis = check.hysteresis(self.tables.hysteresis.as_ref(), rated_current)?;
        Ok(circuit.with_hysteresis(hysteresis).with_harmonics(harmonics))
    }

    /// Returns the winding, magnet flux and core as `[winding]`, `[saturation]` and `[bridge]` state them.
    fn wound(&self, check: &Check) -> Result<(Winding, f64, Core), MotorError> {
        let w = &self.tables.winding;
        let missing = |key| {
            let needed = "given, unless a [map] tells it";
            move || check.value(key, "missing", needed)
        };
        let mean_inductance = w.mean_inductance.as_ref().ok_or_else(missing("winding.mean_inductance"))?;
        let saliency = w.saliency.as_ref().ok_or_else(missing("winding.saliency"))?;
        let leakage = w.leakage.as_ref().ok_or_else(missing("winding.leakage"))?;
        let magnet_flux = w.magnet_flux.as_ref().ok_or_else(missing("winding.magnet_flux"))?;
        let winding = Winding {
            mean_inductance: check.positive("winding.mean_inductance", mean_inductance)?,
            saliency: saliency.number(),
            leakage: check.at_least_zero("winding.leakage", leakage)?,
        };
        if winding.d_axis_inductance() <= 0.0 || winding.q_axis_inductance() <= 0.0 {
            return Err(check.value(
                "winding.saliency",
                saliency.value,
                "such that L_d = 3/2 (L_A + L_B) + L_σ and L_q = 3/2 (L_A − L_B) + L_σ are positive",
            ));
        }
        let magnet_flux = check.at_least_zero("winding.magnet_flux", magnet_flux)?;
        Ok((winding, magnet_flux, self.core(check, &winding, magnet_flux)?))
    }

    /// Returns the winding, magnet flux and core from a map. Inductances and flux stated in `[winding]` must agree with
    /// the map.
    fn mapped(&self, check: &Check, map: FluxMap) -> Result<(Winding, f64, Core), MotorError> {
        for (key, given) in
            [("saturation", self.tables.saturation.is_some()), ("bridge", self.tables.bridge.is_some())]
        {
            if given {
                return Err(check.value(key, "given beside [map]", "left out: the map is the whole core"));
            }
        }
        let [[d_low, d_high], [q_low, q_high]] = map.range();
        let rated = check.positive("rating.current", &self.tables.rating.current)?;
        let least = MAP_REACH * rated;
        if (-d_low).min(d_high).min(-q_low).min(q_high) < least * (1.0 - 1e-6) {
            let file = self.tables.map.as_ref().map_or("", |table| table.file.name());
            let [along_d, along_q] =
                map.range().map(|[low, high]| format!("{} to {} A", short(low), short(high)));
            let found = format!("{file} with i_d from {along_d}, i_q from {along_q}");
            let mut needed = format!(
                "a map of at least ±{least:.4} A along d and q, {MAP_REACH} times rating.current: a polarity test goes there"
            );
            let beyond = self.tables.map.as_ref().is_some_and(|table| table.beyond.is_some());
            if !beyond && d_high.max(-d_low) >= least && q_high.min(-q_low) >= least {
                needed += "; or beyond = \"fitted\" in [map], which continues it along d, so that its poles are assumed";
            }
            return Err(check.value("map.file", found, &needed));
        }
        let (winding, magnet_flux) = Winding::of_map(&map);
        let w = &self.tables.winding;
        let stated = Winding {
            mean_inductance: w.mean_inductance.as_ref().map_or(winding.mean_inductance, Sourced::number),
            saliency: w.saliency.as_ref().map_or(winding.saliency, Sourced::number),
            leakage: w.leakage.as_ref().map_or(0.0, Sourced::number),
        };
        let stated_flux = w.magnet_flux.as_ref().map_or(magnet_flux, Sourced::number);
        Ok((stated, stated_flux, Core::Map(map)))
    }

    fn core(&self, check: &Check, winding: &Winding, magnet_flux: f64) -> Result<Core, MotorError> {
        if let Some(nameplate) = &self.tables.nameplate {
            let needed = "one whose inductances can fall as it says";
            let core = nameplate::core(nameplate, winding, magnet_flux);
            return core.ok_or_else(|| check.value("nameplate.saturation", "given", needed));
        }
        match (&self.tables.saturation, &self.tables.bridge) {
            (None, None) => Ok(Core::Linear(Linear::from_winding(winding, magnet_flux))),
            (None, Some(_)) => {
                Err(check.value("bridge", "given without [saturation]", "given with it, or not at all"))
            }
            (Some(table), bridge) => {
                let bridge = bridge.as_ref().map(|table| check.bridge(table)).transpose()?;
                Ok(Core::Algebraic(Algebraic { bridge, ..check.saturation(table)? }))
            }
        }
    }
}

pub(super) struct Check<'a> {
    /// File and text of the sheet.
    sheet: (&'a str, &'a str),
}

/// Range of a map over the rated current: a polarity test goes 2 % beyond that, and a little more as its voltage is.
const MAP_REACH: f64 = 1.05;

/// Largest magnitude of a motor's number in SI units. The limit keeps typing errors from becoming infinite.
const LARGEST: f64 = 1e12;

/// Requirement of a core.
const CONVEX: &str = "an energy whose inductances stay positive";

/// Smallest positive number of a motor in SI units. Finer limits depend on the motor's other numbers.
const SMALLEST: f64 = 1e-15;

impl Check<'_> {
    pub(super) fn value(
        &self,
        key: &'static str,
        found: impl fmt::Display,
        needed: impl fmt::Display,
    ) -> MotorError {
        wrong(self.sheet, key, found.to_string(), needed.to_string())
    }

    /// Returns a number if it is within this range. `needed`: description of the allowed values, for the message.
    pub(super) fn within<U: Unit>(
        &self,
        key: &'static str,
        from: &Sourced<U>,
        range: RangeInclusive<f64>,
        needed: impl fmt::Display,
    ) -> Result<f64, MotorError> {
        let number = from.number();
        if range.contains(&number) { Ok(number) } else { Err(self.value(key, from.value, needed)) }
    }

    pub(super) fn positive<U: Unit>(&self, key: &'static str, from: &Sourced<U>) -> Result<f64, MotorError> {
        self.within(key, from, SMALLEST..=LARGEST, format_args!("positive, from 1e-15 to 1e12 {}", U::SYMBOL))
    }

    pub(super) fn positive_if_given<U: Unit>(
        &self,
        key: &'static str,
        from: Option<&Sourced<U>>,
    ) -> Result<Option<f64>, MotorError> {
        from.map(|from| self.positive(key, from)).transpose()
    }

    pub(super) fn at_least_zero<U: Unit>(
        &self,
        key: &'static str,
        from: &Sourced<U>,
    ) -> Result<f64, MotorError> {
        self.within(key, from, 0.0..=LARGEST, format_args!("zero or more, up to 1e12 {}", U::SYMBOL))
    }

    /// Checks that a saturated core has the inductances and flux of `[winding]`; otherwise a change there would go
    /// unnoticed.
    fn consistent(&self, motor: &Motor) -> Result<(), MotorError> {
        let core = motor.magnetics.core();
        let (rest, l) = (motor.magnetics.core_rest(), motor.magnetics.inductance());
        let flux = if matches!(core, Core::Map(map) if !map.has_magnet()) { 0.0 } else { rest.d };
        let winding = &motor.winding;
        // A flux that matters beside what rated current makes: there are motors of milliwebers.
        let slack = 1e-3 * l.xx.max(l.yy) * motor.rated_current;
        let pairs = [
            ("winding.mean_inductance", "L_d without current", l.xx, winding.d_axis_inductance(), "H", 0.0),
            ("winding.mean_inductance", "L_q without current", l.yy, winding.q_axis_inductance(), "H", 0.0),
            ("winding.magnet_flux", "flux without current", flux, motor.magnet_flux, "Wb", slack),
        ];
        for (key, what, saturated, stated, unit, slack) in pairs {
            if (saturated - stated).abs() > 0.02 * stated.abs() + slack {
                let found = format!("such that the {what} is {}", listed(&[stated], unit));
                let makes = listed(&[saturated], unit);
                let needed = format!("within 2 % of what [saturation] or [map] makes it, {makes}");
                return Err(self.value(key, found, &needed));
            }
        }
        Ok(())
    }

    pub(super) fn whole(
        &self,
        key: &'static str,
        from: &Sourced<One>,
        least: u8,
        most: u8,
    ) -> Result<u8, MotorError> {
        let found = (least..=most).find(|n| f64::from(*n) == from.number());
        let needed = format_args!("a whole number from {least} to {most}");
        found.ok_or_else(|| self.value(key, from.value, needed))
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

    /// Checks that the Hessian is positive definite up to three times the rated current in any direction, as far as a
    /// detection may drive the core.
    fn core(&self, motor: &Motor) -> Result<(), MotorError> {
        // Positive inductances are all that one without saturation needs.
        if matches!(motor.magnetics.core(), Core::Linear(_)) {
            return Ok(());
        }
        for step in 0..48 {
            let (sin, cos) = sin_cos(f64::from(step) * std::f64::consts::TAU / 48.0);
            for share in [0.0, 0.5, 1.0, 2.0, 3.0] {
                let current = Dq::new(cos, sin) * (motor.rated_current * share);
                let core = motor.magnetics.core();
                if core.margin(current) < 0.0 {
                    continue;
                }
                let convex = core
                    .flux_at(current)
                    .is_ok_and(|flux| core.current_and_inverse_inductance(flux).1.is_positive_definite());
                if !convex {
                    let found = format!("not convex near i_d = {:.3} A, i_q = {:.3} A", current.d, current.q);
                    return Err(self.value("saturation", found, CONVEX));
                }
            }
        }
        Ok(())
    }
}
