//! Checks of the numbers beside winding and core: rotor, harmonics, eddy currents, hysteresis, temperature.

use standstill_files::sheet::{
    EddyTable, HarmonicsTable, HysteresisTable, RatingTable, RotorTable, Sourced, ThermalTable,
};
use standstill_numeric::Heading;
use standstill_quantity::listed;
use standstill_quantity::unit::One;

use super::MotorError;
use super::check::Check;
use crate::{
    Cogging, EddyBranch, Friction, Harmonics, Hysteresis, MOST_CELLS, MagneticCircuit, Ratings, Rotor,
    Thermal,
};

impl Check<'_> {
    pub(super) fn ratings(&self, table: &RatingTable) -> Result<Ratings, MotorError> {
        Ok(Ratings {
            power: self.positive_if_given("rating.power", table.power.as_ref())?,
            speed_rpm: self.positive_if_given("rating.speed", table.speed.as_ref())?,
            torque: self.positive_if_given("rating.torque", table.torque.as_ref())?,
        })
    }

    pub(super) fn rotor(&self, r: &RotorTable) -> Result<Rotor, MotorError> {
        let friction = Friction {
            stiction: self.at_least_zero("rotor.stiction", &r.stiction)?,
            coulomb: self.at_least_zero("rotor.coulomb", &r.coulomb)?,
            viscous: self.at_least_zero("rotor.viscous", &r.viscous)?,
        };
        if friction.coulomb > friction.stiction {
            let needed = format!("at most rotor.stiction, {}", r.stiction.value);
            return Err(self.value("rotor.coulomb", r.coulomb.value, &needed));
        }
        let cogging = match (&r.cogging_torque, &r.cogging_periods) {
            (None, None) => None,
            (Some(torque), Some(periods)) => Some(Cogging {
                torque: self.at_least_zero("rotor.cogging_torque", torque)?,
                periods: self.cogging_periods(periods)?,
            }),
            (torque, _) => {
                let key = if torque.is_some() { "rotor.cogging_periods" } else { "rotor.cogging_torque" };
                return Err(self.value(
                    key,
                    "missing",
                    "given: cogging has a torque and a number of periods",
                ));
            }
        };
        let backlash = match &r.brake_backlash {
            None => 0.0,
            Some(play) => self
                .within("rotor.brake_backlash", play, 0.0..=90.0, "from 0 to 90 deg of the shaft")?
                .to_radians(),
        };
        Ok(Rotor { inertia: self.positive("rotor.inertia", &r.inertia)?, friction, cogging, backlash })
    }

    /// Slots and poles look the same again after the lcm(slots, poles)-th part of a turn of the shaft: lcm/p periods per
    /// electrical turn, and the lcm is a multiple of the 2 p poles.
    fn cogging_periods(&self, from: &Sourced<One>) -> Result<u8, MotorError> {
        let key = "rotor.cogging_periods";
        let periods = self.whole(key, from, 1, 200)?;
        if periods % 2 == 1 {
            let needed = "even: lcm(slots, poles) over the pole pairs, as each pole pulls like its opposite";
            return Err(self.value(key, from.value, needed));
        }
        Ok(periods)
    }

    pub(super) fn harmonics(
        &self,
        table: Option<&HarmonicsTable>,
        circuit: &MagneticCircuit,
    ) -> Result<Harmonics, MotorError> {
        let Some(table) = table else { return Ok(Harmonics::default()) };
        let inductance = |from: &Option<Sourced<_>>| from.as_ref().map_or(0.0, Sourced::number);
        let flux = |from: &Option<Sourced<_>>| from.as_ref().map_or(0.0, Sourced::number);
        let harmonics = Harmonics {
            inductance_4: inductance(&table.inductance_4),
            asymmetry: inductance(&table.asymmetry),
            flux_5: flux(&table.flux_5),
            flux_7: flux(&table.flux_7),
        };
        let least = circuit.inductance().smaller_eigenvalue();
        if !harmonics.fit(circuit.inductance()) {
            // The key to look at is the one that contributes more.
            let asymmetry = Harmonics { inductance_4: 0.0, ..harmonics }.largest_inductance();
            let (key, from) = if 2.0 * asymmetry > harmonics.largest_inductance() {
                ("harmonics.asymmetry", &table.asymmetry)
            } else {
                ("harmonics.inductance_4", &table.inductance_4)
            };
            let found = from.as_ref().map_or_else(String::new, |from| from.value.to_string());
            let needed = format!(
                "small enough for 3/2 |inductance_4| + 2/3 |asymmetry|, here {}, to be at most half of the smaller inductance, {}",
                listed(&[harmonics.largest_inductance()], "H"),
                listed(&[0.5 * least], "H")
            );
            return Err(self.value(key, found, &needed));
        }
        let rest = circuit.rest(Heading::ZERO).norm();
        for (key, found) in [("harmonics.flux_5", &table.flux_5), ("harmonics.flux_7", &table.flux_7)] {
            if let Some(found) = found
                && found.number().abs() > 0.3 * rest
            {
                let needed =
                    format!("at most 0.3 of the flux without current, {}", listed(&[0.3 * rest], "Wb"));
                return Err(self.value(key, found.value, &needed));
            }
        }
        Ok(harmonics)
    }

    pub(super) fn eddy(&self, table: Option<&EddyTable>) -> Result<Option<EddyBranch>, MotorError> {
        let Some(table) = table else { return Ok(None) };
        let (time, needed) = ("from 1 µs to 1 s", "a share of the inductance, from 0 to 0.9");
        Ok(Some(EddyBranch {
            time_constant: self.within("eddy.time_constant", &table.time_constant, 1e-6..=1.0, time)?,
            d_depth: self.within("eddy.d_depth", &table.d_depth, 0.0..=0.9, needed)?,
            q_depth: self.within("eddy.q_depth", &table.q_depth, 0.0..=0.9, needed)?,
        }))
    }

    /// Makes the hysteresis of a motor with this rated current in A.
    pub(super) fn hysteresis(
        &self,
        table: Option<&HysteresisTable>,
        rated_current: f64,
    ) -> Result<Option<Hysteresis>, MotorError> {
        let Some(table) = table else { return Ok(None) };
        let HysteresisTable { coercive_current: coercive, depth, cells } = table;
        let [least, most] = [1e-4, 0.1].map(|share| share * rated_current);
        let current = coercive.number();
        if current != 0.0 && !(least..=most).contains(&current) {
            let needed = format!(
                "0, or from 0.01 % to 10 % of rated current, {} to {}: less is not seen, more is no soft iron",
                listed(&[least], "A"),
                listed(&[most], "A")
            );
            return Err(self.value("hysteresis.coercive_current", coercive.value, &needed));
        }
        let needed = "a share of the inductance, from 0.001 to 0.5: most of it is the air gap's";
        let depth = self.within("hysteresis.depth", depth, 0.001..=0.5, needed)?;
        // Few and whole.
        #[allow(clippy::cast_possible_truncation)]
        let number = (0..=MOST_CELLS as u8).find(|n| f64::from(*n) == cells.number());
        Ok(Some(Hysteresis {
            coercive_current: current,
            depth,
            cells: number
                .ok_or_else(|| self.value("hysteresis.cells", cells.value, "0 (no hysteresis), 1, 2 or 3"))?,
        }))
    }

    pub(super) fn thermal(&self, table: Option<&ThermalTable>) -> Result<Thermal, MotorError> {
        let Some(table) = table else { return Ok(Thermal::default()) };
        let (celsius, per_kelvin) = ("from -60 to 300 °C", "from -0.02 to 0.02 1/K");
        let reference = self.within("thermal.reference", &table.reference, -60.0..=300.0, celsius)?;
        let coefficient = |key, from: &Sourced<_>| self.within(key, from, -0.02..=0.02, per_kelvin);
        Ok(Thermal {
            winding_reference: reference,
            magnet_reference: reference,
            winding_coefficient: coefficient("thermal.winding_coefficient", &table.winding_coefficient)?,
            magnet_coefficient: coefficient("thermal.magnet_coefficient", &table.magnet_coefficient)?,
        })
    }
}
