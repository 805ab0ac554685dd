//! Voltage vectors by PWM, with the dead time and the drops of the devices compensated.

use standstill_interface::{Abc, AlphaBeta, Command, Leg, Nanos, Real, Sampling, Stage};

use crate::keys::Value;
use crate::nameplate::Nameplate;
use crate::settings::{SettingsError, require, require_positive, require_zero_or_more};

/// Settings of the PWM.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModulationSettings<T> {
    /// Period of the drive's PWM carrier.
    pub carrier_period: Nanos,
    /// Dead time of the drive, for its compensation. Zero: none.
    pub dead_time: Nanos,
    /// Voltage drop in V of a device, switch or diode. Zero: not compensated.
    pub drop: T,
    /// Rough inductance in H of a phase, for the ripple of the current.
    pub inductance: T,
    /// Current in A below which a leg's compensation fades out: about the error of a predicted current.
    pub fade: T,
}

impl<T: Real> ModulationSettings<T> {
    /// Returns settings for this motor and drive.
    pub fn suited(drive: &Nameplate<T>) -> Self {
        Self {
            carrier_period: drive.carrier_period,
            dead_time: drive.dead_time,
            drop: (drive.switch_drop[0] + drive.reverse_drop[0]) / T::of(2.0),
            inductance: drive.line_inductance() / T::of(2.0),
            fade: drive.rated_current * T::of(0.002),
        }
    }

    /// Returns whether dead time or drops are compensated, as a key's value.
    #[allow(clippy::unnecessary_wraps, reason = "the form of a setting that may be missing")]
    pub(crate) fn compensation(&self) -> Option<Value> {
        Some(Value::Flag(self.dead_time > Nanos::ZERO || self.drop > T::zero()))
    }

    /// Switches the compensation of both off if the value is false. True changes nothing: the values to compensate are
    /// the drive's.
    pub(crate) fn set_compensation(&mut self, value: Value) -> bool {
        if !value.is_set() {
            (self.dead_time, self.drop) = (Nanos::ZERO, T::zero());
        }
        true
    }

    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        let period = Nanos(1)..=Nanos(100_000_000);
        require(
            period.contains(&self.carrier_period),
            "modulation.carrier_period",
            "positive, at most 0.1 s",
        )?;
        let quarter = "less than a quarter of the carrier period";
        require(self.dead_time * 4 < self.carrier_period, "modulation.dead_time", quarter)?;
        require_zero_or_more(self.drop, "modulation.drop")?;
        require_positive(self.inductance, "modulation.inductance")?;
        require_positive(self.fade, "modulation.fade")
    }

    /// Returns the loss of a leg's voltage by dead time and drops, as a share of the link.
    pub(crate) fn lost(&self, dc_link: T) -> T {
        T::of(self.dead_time.seconds()) / T::of(self.carrier_period.seconds()) + self.drop / dc_link
    }

    /// Returns a command for this voltage in V over this many carrier periods, sampled once at the end, where the
    /// current has its mean value.
    ///
    /// `current` are the phase currents in A at the start and, as predicted, at the end of the first period.
    ///
    /// A dead time before the upper switch closes delays the leg's rise if its current is positive then; one before the
    /// lower closes delays the fall if the current is negative then. So the voltage lost in a period depends on the
    /// signs at two instants. Between the outer zero vectors the legs rise one after the other, and until leg k does,
    /// those before it have reduced its current by `r = U/(3L) Σ_j (t_k − t_j)`; the same happens after its fall, so
    /// that
    /// ```text
    /// i(rise) = i(start) − r,   i(fall) = i(end) + r
    /// ```
    pub(crate) fn command(
        &self,
        voltage: AlphaBeta<T>,
        dc_link: T,
        currents: [Abc<T>; 2],
        periods: u16,
    ) -> Command<T> {
        let legs = self.duties(voltage, dc_link, currents);
        let duration = self.carrier_period * u64::from(periods);
        Command::hold(Stage { legs: legs.map(Leg::Duty), duration }, Sampling::once(duration))
    }

    /// Returns the duties of the legs for this voltage in V; `currents`: as for [`Self::command`].
    fn duties(&self, voltage: AlphaBeta<T>, dc_link: T, currents: [Abc<T>; 2]) -> Abc<T> {
        let (half, one) = (T::of(0.5), T::one());
        let lost = self.lost(dc_link);
        let plain = Self::plain(voltage, dc_link);
        let signs = self.signs([plain; 2], dc_link, currents);
        let mut legs = plain;
        for (k, duty) in legs.0.iter_mut().enumerate() {
            let sign = (signs[0].0[k] + signs[1].0[k]) * half;
            *duty = (*duty + sign * lost).max(T::zero()).min(one);
        }
        legs
    }

    /// Returns the duties for this voltage in V of legs without losses.
    pub(crate) fn plain(voltage: AlphaBeta<T>, dc_link: T) -> Abc<T> {
        voltage.phases().map(|volts| T::of(0.5) + volts / dc_link)
    }

    /// Returns the directions of the legs' currents, from −1 to 1, when each leg rises and when it falls. `high`: share
    /// of the first and of the second half of the period for which each leg is high, adjacent to the middle.
    pub(crate) fn signs(&self, high: [Abc<T>; 2], dc_link: T, [start, end]: [Abc<T>; 2]) -> [Abc<T>; 2] {
        let one = T::one();
        let period = T::of(self.carrier_period.seconds());
        let ripple = dc_link * period / (T::of(6.0) * self.inductance);
        let sure = |current: T| (current / self.fade).max(-one).min(one);
        let down = |n: usize, k: usize| {
            let own = high[n].0[k];
            ripple * high[n].0.iter().fold(T::zero(), |sum, other| sum + (*other - own).max(T::zero()))
        };
        [
            Abc(core::array::from_fn(|k| sure(start.0[k] - down(0, k)))),
            Abc(core::array::from_fn(|k| sure(end.0[k] + down(1, k)))),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PWM: ModulationSettings<f64> = ModulationSettings {
        carrier_period: Nanos::from_micros(100),
        dead_time: Nanos(2000),
        drop: 1.5,
        inductance: 10e-3,
        fade: 1e-6,
    };

    fn duties(volts: f64, [start, end]: [[f64; 3]; 2]) -> [f64; 3] {
        let command = PWM.command(AlphaBeta::new(volts, 0.0), 500.0, [Abc(start), Abc(end)], 3);
        assert_eq!(command.duration(), PWM.carrier_period * 3);
        assert_eq!(command.sampling, Sampling::once(command.duration()));
        command.stage.legs.0.map(|leg| if let Leg::Duty(duty) = leg { duty } else { panic!("no PWM") })
    }

    /// With these signs of the leg's current, summed over its rise and its fall.
    fn expected(volts: f64, signs: f64) -> f64 {
        // 2 µs of 100 µs, 1.5 V of 500 V, half of it at each instant.
        0.5 + volts / 500.0 + signs / 2.0 * (0.02 + 0.003)
    }

    fn assert_duties(found: [f64; 3], expected: [f64; 3]) {
        for k in 0..3 {
            assert!((found[k] - expected[k]).abs() < 1e-12, "{found:?} {expected:?}");
        }
    }

    #[test]
    fn analytic_large_currents_keep_their_sign() {
        let current = [3.0, -2.0, -1.0];
        let found = duties(50.0, [current; 2]);
        assert_duties(found, [expected(50.0, 2.0), expected(-25.0, -2.0), expected(-25.0, -2.0)]);
        let current = [-3.0, 2.0, 1.0];
        let found = duties(50.0, [current; 2]);
        assert_duties(found, [expected(50.0, -2.0), expected(-25.0, 2.0), expected(-25.0, 2.0)]);
        // A current that changes its sign within the period is lost at one instant and gained at the other.
        let found = duties(50.0, [[-3.0, 2.0, 1.0], [3.0, -2.0, -1.0]]);
        assert_duties(found, [expected(50.0, 0.0), expected(-25.0, 0.0), expected(-25.0, 0.0)]);
    }

    #[test]
    fn analytic_the_ripple_decides_over_small_currents() {
        // Leg a rises first, 7.5 µs before b and c: 75 V of 500 V apart, half of the difference at each end. Until then it
        // drives their current down by 500 V/(3 · 10 mH) 7.5 µs = 0.125 A, its own not at all.
        for (small, signs) in [(0.12, 0.0), (-0.12, 0.0), (0.13, 2.0), (-0.13, -2.0)] {
            let found = duties(50.0, [[-1e-3, small, small]; 2]);
            assert_duties(found, [expected(50.0, -2.0), expected(-25.0, signs), expected(-25.0, signs)]);
        }
        // Rise by the current at the start, fall by the one at the end.
        let found = duties(50.0, [[1e-3, -1.0, 1.0], [1e-3, 0.12, -0.12]]);
        assert_duties(found, [expected(50.0, 2.0), expected(-25.0, 0.0), expected(-25.0, 2.0)]);
        // Two legs before the third add up.
        let found = duties(-50.0, [[0.24, 1e-3, -1e-3]; 2]);
        assert_duties(found, [expected(-50.0, 0.0), expected(25.0, 2.0), expected(25.0, -2.0)]);
        let found = duties(-50.0, [[0.26, 1e-3, -1e-3]; 2]);
        assert_duties(found, [expected(-50.0, 2.0), expected(25.0, 2.0), expected(25.0, -2.0)]);
    }

    #[test]
    fn law_a_compensation_fades_out_and_a_duty_has_its_limits() {
        let soft = ModulationSettings { fade: 0.1, inductance: 1e9, ..PWM };
        let duty = |current: f64, volts: f64| {
            let current = Abc([current, 0.0, 0.0]);
            let Leg::Duty(duty) =
                soft.command(AlphaBeta::new(volts, 0.0), 500.0, [current; 2], 1).stage.legs.0[0]
            else {
                panic!("no PWM")
            };
            duty
        };
        assert!((duty(0.04, 0.0) - expected(0.0, 0.8)).abs() < 1e-9);
        assert!((duty(-0.02, 0.0) - expected(0.0, -0.4)).abs() < 1e-9);
        assert!((duty(9.0, 0.0) - expected(0.0, 2.0)).abs() < 1e-9);
        assert_eq!((duty(1.0, 250.0), duty(-1.0, -250.0), duty(1.0, f64::NAN)), (1.0, 0.0, 0.0));
    }

    #[test]
    fn law_settings_that_cannot_work_are_refused() {
        assert!(PWM.check().is_ok());
        let broken = [
            ModulationSettings { carrier_period: Nanos::ZERO, ..PWM },
            ModulationSettings { carrier_period: Nanos(200_000_000), ..PWM },
            ModulationSettings { dead_time: Nanos::from_micros(25), ..PWM },
            ModulationSettings { drop: f64::INFINITY, ..PWM },
            ModulationSettings { drop: -1.0, ..PWM },
            ModulationSettings { inductance: 0.0, ..PWM },
            ModulationSettings { fade: f64::NAN, ..PWM },
        ];
        assert!(broken.iter().all(|settings| settings.check().is_err()));
    }
}
