//! Nameplate data of motor and drive, from which each method's settings follow.

/// Converts a struct to another precision: its numbers, its other values, its pairs and options of numbers, and its parts.
macro_rules! cast {
    ($from:ident as $to:ident { $($number:ident),*; $($same:ident),*; $($each:ident),*; $($part:ident),* }) => {{
        let cast = |value: T| U::of(value.to_double());
        $to {
            $($number: cast($from.$number),)*
            $($same: $from.$same,)*
            $($each: $from.$each.map(cast),)*
            $($part: $from.$part.cast(),)*
        }
    }};
}

mod sensors;

use standstill_interface::{Nanos, Real};

pub use self::sensors::{Comparing, Dividers, Place, Sensing};
use crate::parts::lines::SaliencySign;
use crate::parts::polarity::Signature;
use crate::settings::{SettingsError, require, require_positive, require_zero_or_more};

/// Motor and drive as their data sheets state them. Rough values will do: no method takes an angle from them.
///
/// ```
/// use standstill_detect::{Dividers, Nameplate, Sensing, Signature};
/// use standstill_interface::Nanos;
///
/// let nameplate = Nameplate {
///     rated_current: 8.5_f64,
///     resistance: 0.8,
///     d_axis_inductance: 10.65e-3,
///     q_axis_inductance: 16.95e-3,
///     magnet_flux: 0.42,
///     signature: Signature::Normal,
///     pulse_signature: Signature::Normal,
///     polarity_difference: 0.06,
///     cross_saturation: 0.0,
///     rated_pulse: Nanos::from_micros(330),
///     gain_tolerance: 0.005,
///     sensing: Sensing::default(),
///     dividers: Dividers::default(),
///     dc_link: 550.0,
///     dead_time: Nanos::from_micros(2),
///     delay_mismatch: 50e-9,
///     carrier_period: Nanos::from_micros(100),
///     switch_drop: [0.9, 0.05],
///     diode_drop: [0.8, 0.03],
///     reverse_drop: [0.8, 0.03],
/// };
/// nameplate.check()?;
/// assert!(Nameplate { dc_link: 0.0, ..nameplate }.check().is_err());
/// # Ok::<(), standstill_detect::SettingsError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nameplate<T> {
    /// Rated current of a phase in A, peak.
    pub rated_current: T,
    /// Resistance of a phase in Ω.
    pub resistance: T,
    /// L_d in H without current. [`Check::Saliency`](crate::Check::Saliency) takes both inductances to be right within 10 %;
    /// leave it out where they are only roughly known.
    pub d_axis_inductance: T,
    /// L_q in H without current.
    pub q_axis_inductance: T,
    /// Flux linkage of the magnet in Wb, from the voltage constant; zero without magnet.
    pub magnet_flux: T,
    /// The pole that draws the larger current near rated current.
    pub signature: Signature,
    /// The pole that draws the larger current in pulses of half the rated current, which the bipolar methods use.
    pub pulse_signature: Signature,
    /// Relative difference between the currents of the two poles near rated current.
    pub polarity_difference: T,
    /// Change of 1/L_q with a current along the magnet, relative to the change of 1/L_d; zero without cross saturation.
    pub cross_saturation: T,
    /// Length of the pulse across a line that raises the rated current in the direction in which the core saturates
    /// most. It is shorter than the inductances at zero current suggest.
    pub rated_pulse: Nanos,
    /// Standard deviation of the current sensors' gains, relative, as their data sheet tolerates it. Zero: equal.
    pub gain_tolerance: T,
    /// Properties of the current sensors and their converter.
    pub sensing: Sensing<T>,
    /// The dividers at the terminals, if the drive has any.
    pub dividers: Dividers<T>,
    /// Voltage of the DC link in V.
    pub dc_link: T,
    /// Dead time of the drive.
    pub dead_time: Nanos,
    /// Standard deviation in s of the legs' turn-off delays; a third of the mismatch that a gate driver's data sheet states at most. Zero:
    /// equal, and a leg that is late may look like a bad contact.
    pub delay_mismatch: T,
    /// Period of the drive's PWM carrier.
    pub carrier_period: Nanos,
    /// Voltage in V across a conducting switch, and its slope in Ω.
    pub switch_drop: [T; 2],
    /// Voltage in V across a conducting diode whose leg has both switches off, and its slope in Ω.
    pub diode_drop: [T; 2],
    /// Voltage in V, and its slope in Ω, for a current that flows against the switch that is on: through the diode
    /// beside an IGBT, backwards through the channel of a MOSFET.
    pub reverse_drop: [T; 2],
}

impl<T: Real> Nameplate<T> {
    /// Returns the sign of L_B.
    pub fn saliency(&self) -> SaliencySign {
        SaliencySign::of(self.d_axis_inductance, self.q_axis_inductance)
    }

    /// Returns the mean inductance in H of two phases in series: L_d + L_q.
    pub fn line_inductance(&self) -> T {
        self.d_axis_inductance + self.q_axis_inductance
    }

    /// Returns the length of a pulse that raises this share of the rated current in a line on average, and at most half
    /// more in any line, in steps of 10 µs, from 20 µs to 3 ms.
    ///
    /// ```
    /// # let nameplate = include!(concat!(env!("CARGO_MANIFEST_DIR"), "/doc/nameplate.rs"));
    /// // Half the rated current in 27.6 mH at 550 V: 213 µs, in steps of 10 µs.
    /// assert_eq!(nameplate.line_pulse(0.5).seconds(), 210e-6);
    /// ```
    pub fn line_pulse(&self, share: T) -> Nanos {
        let step = T::of(10e-6);
        let pulse = share * self.rated_current * self.line_inductance() / self.dc_link;
        let pulse = pulse.min(share * T::of(1.5 * self.rated_pulse.seconds()));
        let steps = (pulse / step).round().max(T::of(2.0)).min(T::of(300.0));
        Nanos::from_seconds((steps * step).to_double())
    }

    /// Returns the longest pulse that does not exceed the rated current in any line.
    ///
    /// The more a core saturates, the steeper is the current at the end of the pulse, and the larger is the effect of
    /// an error of the link's voltage. So the pulse is 1 % shorter for each 10 % by which saturation shortens it.
    pub(crate) fn longest_pulse(&self) -> Nanos {
        let least = self.d_axis_inductance.min(self.q_axis_inductance);
        let linear = (T::of(2.0) * least * self.rated_current / self.dc_link).to_double();
        let share = (self.rated_pulse.seconds() / linear).min(1.0);
        Nanos::from_seconds(self.rated_pulse.seconds() * (0.9 + 0.1 * share))
    }

    /// Converts to another precision.
    ///
    /// ```
    /// # let nameplate = include!(concat!(env!("CARGO_MANIFEST_DIR"), "/doc/nameplate.rs"));
    /// use standstill_detect::Nameplate;
    ///
    /// // A microcontroller computes in single precision.
    /// let single: Nameplate<f32> = nameplate.cast();
    /// assert_eq!(single.rated_current, 8.5);
    /// ```
    pub fn cast<U: Real>(&self) -> Nameplate<U> {
        cast!(self as Nameplate {
            rated_current, resistance, d_axis_inductance, q_axis_inductance, magnet_flux, polarity_difference, cross_saturation,
            gain_tolerance, dc_link, delay_mismatch;
            signature, pulse_signature, rated_pulse, dead_time, carrier_period;
            switch_drop, diode_drop, reverse_drop;
            sensing, dividers
        })
    }

    /// Checks all values.
    ///
    /// # Errors
    /// A value is outside its range.
    pub fn check(&self) -> Result<(), SettingsError> {
        require_positive(self.rated_current, "rated_current")?;
        require_positive(self.d_axis_inductance, "d_axis_inductance")?;
        require_positive(self.q_axis_inductance, "q_axis_inductance")?;
        require(self.rated_pulse > Nanos::ZERO, "rated_pulse", "positive")?;
        require_positive(self.dc_link, "dc_link")?;
        require_zero_or_more(self.delay_mismatch, "delay_mismatch")?;
        let period = T::of(self.carrier_period.seconds());
        require(
            self.delay_mismatch < period,
            "delay_mismatch",
            "in seconds, and shorter than the carrier period",
        )?;
        require_zero_or_more(self.resistance, "resistance")?;
        require_zero_or_more(self.magnet_flux, "magnet_flux")?;
        require(self.polarity_difference.is_finite(), "polarity_difference", "finite")?;
        require(self.cross_saturation.is_finite(), "cross_saturation", "finite")?;
        require_zero_or_more(self.gain_tolerance, "gain_tolerance")?;
        require(self.gain_tolerance < T::one(), "gain_tolerance", "below 1")?;
        self.sensing.check()?;
        self.dividers.check()?;
        for drop in self.switch_drop.into_iter().chain(self.diode_drop).chain(self.reverse_drop) {
            require_zero_or_more(drop, "switch_drop, diode_drop and reverse_drop")?;
        }
        require(self.carrier_period > Nanos::ZERO, "carrier_period", "positive")?;
        let quarter = "less than a quarter of the carrier period";
        require(self.dead_time <= longest_dead_time(self.carrier_period), "dead_time", quarter)
    }
}

/// Returns the longest dead time that leaves room for PWM: just under a quarter of the carrier period.
pub fn longest_dead_time(carrier_period: Nanos) -> Nanos {
    Nanos(carrier_period.0.saturating_sub(1) / 4)
}

#[cfg(test)]
mod tests {
    use super::*;
    use standstill_interface::Phase;

    use crate::parts::train::Derived;
    use crate::testing::PLATE;

    #[test]
    fn analytic_a_pulse_raises_its_share_of_the_rated_current() {
        // 0.5 · 7 A · 28 mH / 540 V = 181 µs on average, 0.5 · 1.5 · 300 µs = 225 µs where the core saturates most.
        assert_eq!(PLATE.line_pulse(0.5), Nanos::from_micros(180));
        let saturating = Nameplate { rated_pulse: Nanos::from_micros(200), ..PLATE };
        assert_eq!(saturating.line_pulse(0.5), Nanos::from_micros(150));
        assert_eq!((PLATE.line_pulse(1e-3), PLATE.line_pulse(1.5)), (Nanos(20_000), Nanos(540_000)));
        assert_eq!(Nameplate { rated_pulse: Nanos(10_000_000), ..PLATE }.line_pulse(9.0), Nanos(3_000_000));
        assert_eq!(PLATE.line_pulse(f64::NAN), Nanos(20_000));
        assert_eq!(PLATE.cast::<f32>().line_pulse(0.5), Nanos::from_micros(180));
        assert_eq!(PLATE.saliency(), SaliencySign::Negative);
        assert_eq!(Nameplate { q_axis_inductance: 9e-3, ..PLATE }.saliency(), SaliencySign::Positive);
    }

    #[test]
    fn analytic_a_derived_phase_is_as_late_as_the_one_that_it_is_derived_from() {
        let sensing = Sensing { skew: Nanos(1000), ..PLATE.sensing };
        let late = |derived| [0, 1, 2].map(|line| sensing.late(line, derived) * 1e6);
        for (derived, expected) in [
            (Derived::None, [0.5, 1.5, 1.0]),
            (Derived::One(Phase::C), [0.5, 1.0, 0.0]),
            (Derived::One(Phase::A), [1.0, 1.5, 2.0]),
            (Derived::Several, [0.5, 1.5, 1.0]),
        ] {
            let found = late(derived);
            assert!((0..3).all(|k| (found[k] - expected[k]).abs() < 1e-12), "{derived:?}: {found:?}");
        }
    }

    #[test]
    fn law_values_that_cannot_be_are_refused() {
        assert!(PLATE.check().is_ok());
        let broken = [
            Nameplate { rated_current: f64::NAN, ..PLATE },
            Nameplate { resistance: f64::INFINITY, ..PLATE },
            Nameplate { d_axis_inductance: 0.0, ..PLATE },
            Nameplate { q_axis_inductance: -1.0, ..PLATE },
            Nameplate { magnet_flux: -0.1, ..PLATE },
            Nameplate { polarity_difference: f64::NAN, ..PLATE },
            Nameplate { cross_saturation: f64::INFINITY, ..PLATE },
            Nameplate { rated_pulse: Nanos::ZERO, ..PLATE },
            Nameplate { gain_tolerance: 1.0, ..PLATE },
            Nameplate { gain_tolerance: f64::NAN, ..PLATE },
            Nameplate { dc_link: 0.0, ..PLATE },
            Nameplate { dead_time: Nanos::from_micros(25), ..PLATE },
            Nameplate { delay_mismatch: -1e-9, ..PLATE },
            Nameplate { delay_mismatch: 50.0, ..PLATE },
            Nameplate { carrier_period: Nanos::ZERO, ..PLATE },
            Nameplate { switch_drop: [0.0, f64::INFINITY], ..PLATE },
            Nameplate { diode_drop: [-1.0, 0.0], ..PLATE },
            Nameplate { reverse_drop: [0.0, f64::NAN], ..PLATE },
            Nameplate { sensing: Sensing { bandwidth: Some(0.0), ..PLATE.sensing }, ..PLATE },
            Nameplate { sensing: Sensing { bandwidth_mismatch: 1.0, ..PLATE.sensing }, ..PLATE },
            Nameplate { sensing: Sensing { skew: Nanos(100_001), ..PLATE.sensing }, ..PLATE },
            Nameplate { sensing: Sensing { pick_up: [0.1, f64::NAN], ..PLATE.sensing }, ..PLATE },
            Nameplate { dividers: Dividers { gain_tolerance: 1.0, ..PLATE.dividers }, ..PLATE },
            Nameplate { dividers: Dividers { offset: -1.0, ..PLATE.dividers }, ..PLATE },
            Nameplate { dividers: Dividers { bandwidth: Some(0.0), ..PLATE.dividers }, ..PLATE },
        ];
        assert!(broken.iter().all(|plate| plate.check().is_err()));
    }
}
