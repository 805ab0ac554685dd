//! Temperature of winding and magnet: a hot winding has more resistance, a hot magnet less flux.

use thiserror::Error;

use crate::Motor;

/// Temperature dependence of a motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thermal {
    /// Temperature in °C of the winding at which the motor's numbers hold.
    pub winding_reference: f64,
    /// Temperature in °C of the magnet at which the motor's numbers hold.
    pub magnet_reference: f64,
    /// Change of the resistance in 1/K, relative to its value at the winding's reference.
    pub winding_coefficient: f64,
    /// Change of the open-circuit flux in 1/K, relative to its value at the magnet's reference.
    pub magnet_coefficient: f64,
}

impl Default for Thermal {
    /// Returns the coefficients of copper and usual neodymium magnets, with references of 20 °C.
    fn default() -> Self {
        Self {
            winding_reference: 20.0,
            magnet_reference: 20.0,
            winding_coefficient: 3.93e-3,
            magnet_coefficient: -1.1e-3,
        }
    }
}

/// Temperatures in °C; none: that of the data sheet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Temperature {
    /// Temperature of the winding.
    pub winding: Option<f64>,
    /// Temperature of the magnet.
    pub magnet: Option<f64>,
}

impl Temperature {
    /// Least and largest temperature in °C: the coefficients hold between them.
    pub const RANGE: [f64; 2] = [-60.0, 300.0];
}

/// A temperature that the motor does not survive.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("temperature of the {part} is {found} °C, but must {needed}")]
pub struct TemperatureError {
    part: &'static str,
    found: String,
    needed: String,
}

impl Motor {
    /// Returns the motor at other temperatures: resistance and open-circuit flux change in proportion to the distance
    /// from the reference, the cogging torque with the square of the flux. The iron stays as it is.
    ///
    /// The temperatures become the new references, and the coefficients are converted to the new values. The result
    /// therefore does not depend on intermediate temperatures.
    ///
    /// ```
    /// use standstill_plant::{Temperature, built_in};
    ///
    /// let cold = built_in("paper-5k5").ok_or("not built in")?;
    /// let hot = cold.at_temperature(Temperature { winding: Some(120.0), magnet: Some(100.0) })?;
    /// // Copper gains 0.39 % a kelvin, a magnet loses about 0.1 %.
    /// assert!(hot.resistance > 1.3 * cold.resistance);
    /// assert!(hot.magnet_flux < cold.magnet_flux);
    /// assert!(cold.at_temperature(Temperature { winding: Some(-300.0), magnet: None }).is_err());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn at_temperature(&self, at: Temperature) -> Result<Self, TemperatureError> {
        let error =
            |part, found: f64, needed: String| TemperatureError { part, found: found.to_string(), needed };
        let [least, most] = Temperature::RANGE;
        let range = || format!("be from {least} to {most} °C and leave the motor resistance and flux");
        let factor = |part, temperature: f64, reference: f64, coefficient: f64| {
            let factor = 1.0 + coefficient * (temperature - reference);
            if (least..=most).contains(&temperature) && factor > 0.0 {
                Ok(factor)
            } else {
                Err(error(part, temperature, range()))
            }
        };
        let mut motor = self.clone();
        let (before, thermal) = (self.thermal, &mut motor.thermal);
        if let Some(winding) = at.winding {
            let change = factor("winding", winding, before.winding_reference, before.winding_coefficient)?;
            motor.resistance *= change;
            thermal.winding_reference = winding;
            thermal.winding_coefficient /= change;
        }
        let Some(found) = at.magnet else { return Ok(motor) };
        let magnet = factor("magnet", found, before.magnet_reference, before.magnet_coefficient)?;
        thermal.magnet_reference = found;
        thermal.magnet_coefficient /= magnet;
        if magnet == 1.0 {
            return Ok(motor);
        }
        motor.with_magnet(magnet).map_err(|why| error("magnet", found, why.unwrap_or_else(range)))
    }

    /// Returns the motor with magnets of which the open-circuit flux is this multiple: the core is saturated by less of it, and the
    /// cogging torque changes with its square.
    ///
    /// ```
    /// use standstill_plant::built_in;
    ///
    /// let motor = built_in("paper-5k5").ok_or("not built in")?;
    /// let weak = motor.clone().with_magnet(0.8).map_err(|_| "no such magnet")?;
    /// assert_eq!(weak.magnet_flux, 0.8 * motor.magnet_flux);
    /// # Ok::<(), &str>(())
    /// ```
    ///
    /// # Errors
    /// A magnet that the motor's core does not describe; with a sentence where its inductances do not bear the harmonics any more.
    pub fn with_magnet(mut self, magnet: f64) -> Result<Self, Option<String>> {
        self.magnet_flux *= magnet;
        if let Some(cogging) = &mut self.rotor.cogging {
            cogging.torque *= magnet * magnet;
        }
        let circuit = self.magnetics.with_magnet(magnet).map_err(|_| None)?;
        // Without its magnet's saturation a core has other inductances.
        let (harmonics, inductance) = (circuit.harmonics(), circuit.inductance());
        if !harmonics.fit(inductance) {
            return Err(Some(format!(
                "leave the smaller inductance, here {:.4e} H, at least twice the harmonics 3/2 |inductance_4| + 2/3 |asymmetry|, {:.4e} H",
                inductance.smaller_eigenvalue(),
                harmonics.largest_inductance()
            )));
        }
        self.magnetics = circuit;
        Ok(self)
    }
}

#[cfg(test)]
mod tests {
    use standstill_interface::Dq;
    use standstill_numeric::Heading;

    use super::*;
    use crate::{Harmonics, built_in, built_in_names};

    #[test]
    fn analytic_a_hot_motor_has_more_resistance_and_less_flux() {
        for name in built_in_names() {
            let cold = built_in(name).expect("built in");
            let thermal = cold.thermal;
            let hot = |winding, magnet| {
                cold.at_temperature(Temperature { winding: Some(winding), magnet: Some(magnet) })
                    .expect("survives")
            };
            let same = hot(thermal.winding_reference, thermal.magnet_reference);
            assert_eq!(same, cold);
            let motor = hot(thermal.winding_reference + 100.0, thermal.magnet_reference + 80.0);
            let resistance = cold.resistance * (1.0 + 100.0 * thermal.winding_coefficient);
            assert!((motor.resistance - resistance).abs() < 1e-12, "{name}");
            let (before, after) = (cold.magnetics.rest(Heading::ZERO), motor.magnetics.rest(Heading::ZERO));
            let flux = before.d * (1.0 + 80.0 * thermal.magnet_coefficient);
            assert!((after.d - flux).abs() < 1e-12, "{name}: {} {flux}", after.d);
            // No current flows there.
            let current = motor.magnetics.state(after, Heading::ZERO).current;
            assert!(current.norm() < 1e-9, "{name}: {current:?}");
            let with_current = motor.magnetics.flux_at(Dq::new(1.0, 1.0), Heading::ZERO).expect("convex");
            assert!(
                (motor.magnetics.state(with_current, Heading::ZERO).current - Dq::new(1.0, 1.0)).norm()
                    < 1e-9
            );
        }
    }

    #[test]
    fn law_a_temperature_is_the_same_whatever_was_before() {
        for name in built_in_names() {
            let mut cold = built_in(name).expect("built in");
            cold.rotor.cogging = Some(crate::Cogging { torque: 0.2, periods: 6 });
            let harmonics = Harmonics { flux_5: 0.01 * cold.magnet_flux, ..Harmonics::default() };
            cold.magnetics = cold.magnetics.with_harmonics(harmonics);
            let at = |motor: &Motor, winding, magnet| {
                motor
                    .at_temperature(Temperature { winding: Some(winding), magnet: Some(magnet) })
                    .expect("survives")
            };
            let hot = at(&cold, 140.0, 120.0);
            assert_eq!(at(&hot, 140.0, 120.0), hot, "{name}");
            for (winding, magnet) in [(20.0, 20.0), (80.0, 60.0), (-30.0, -30.0)] {
                let (straight, around) = (at(&cold, winding, magnet), at(&hot, winding, magnet));
                let close = |a: f64, b: f64| assert!((a - b).abs() <= 1e-12 * a.abs(), "{name}: {a} {b}");
                close(straight.resistance, around.resistance);
                close(straight.magnet_flux, around.magnet_flux);
                close(straight.cogging(0.1), around.cogging(0.1));
                close(straight.magnetics.inductance().xx, around.magnetics.inductance().xx);
                let current =
                    |motor: &Motor| motor.magnetics.state(Dq::new(0.4, 0.2), Heading::of(0.3)).current.norm();
                assert!((current(&straight) / current(&around) - 1.0).abs() < 1e-10, "{name}");
            }
        }
    }

    #[test]
    fn law_cogging_goes_with_the_square_of_the_magnet() {
        // Slots pull at the magnet's flux density squared (Maxwell's stress).
        let cold = built_in("slot-harmonics").expect("built in");
        let hot = cold.at_temperature(Temperature { winding: None, magnet: Some(100.0) }).expect("survives");
        let share = hot.magnet_flux / cold.magnet_flux;
        assert!((share - (1.0 - 1.1e-3 * 80.0)).abs() < 1e-12);
        for angle in [0.1, 0.5, 2.0] {
            assert!((hot.cogging(angle) - share * share * cold.cogging(angle)).abs() < 1e-15, "{angle}");
        }
    }

    #[test]
    fn regress_harmonics_that_are_too_large_for_a_cold_core_are_an_error() {
        // A colder magnet saturates the core more, and a little too much for harmonics near their limit; at the limit of
        // the whole inductance there would be no number.
        let mut motor = built_in("paper-5k5").expect("built in");
        let least = motor.magnetics.inductance().smaller_eigenvalue();
        let at =
            |motor: &Motor, magnet| motor.at_temperature(Temperature { winding: None, magnet: Some(magnet) });
        for share in [0.499, 0.999] {
            let harmonics = Harmonics { inductance_4: share / 1.5 * least, ..Harmonics::default() };
            motor.magnetics = motor.magnetics.clone().with_harmonics(harmonics);
            let error = at(&motor, -60.0).expect_err("must be refused").to_string();
            assert!(error.contains("magnet is -60 °C") && error.contains("3/2 |inductance_4|"), "{error}");
        }
        let harmonics = Harmonics { inductance_4: 0.4 / 1.5 * least, ..Harmonics::default() };
        motor.magnetics = motor.magnetics.clone().with_harmonics(harmonics);
        let cold = at(&motor, -60.0).expect("fits");
        assert!(cold.magnetics.state(Dq::new(0.5, 0.1), Heading::of(0.3)).current.norm().is_finite());
    }

    #[test]
    fn regress_temperatures_beyond_sense_are_refused() {
        let motor = built_in("paper-5k5").expect("built in");
        for temperature in [f64::NAN, 1e4, -273.0] {
            let winding = Temperature { winding: Some(temperature), magnet: None };
            let error = motor.at_temperature(winding).expect_err("must be refused").to_string();
            assert!(error.contains("winding") && error.contains("-60 to 300"), "{error}");
        }
    }
}
