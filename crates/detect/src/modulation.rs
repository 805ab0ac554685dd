//! Voltage vectors by PWM, with the dead time and the drops of the devices compensated.

use standstill_interface::{Abc, AlphaBeta, Command, Leg, Nanos, Real, Sampling, Stage};

use crate::nameplate::Nameplate;
use crate::settings::{SettingsError, require, require_positive, require_zero_or_more};

/// What PWM needs to know of the drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModulationSettings<T> {
    /// Period of the drive's PWM carrier.
    pub carrier_period: Nanos,
    /// Dead time of the drive, for its compensation. Zero: none.
    pub dead_time: Nanos,
    /// Voltage in V that a device takes, switch or diode. Zero: not compensated.
    pub drop: T,
    /// Rough inductance in H of a phase, for the ripple of the current.
    pub inductance: T,
    /// Current in A below which a leg's compensation fades out: about what a prediction gets wrong.
    pub fade: T,
}

impl<T: Real> ModulationSettings<T> {
    /// For this motor and drive.
    pub fn suited(drive: &Nameplate<T>) -> Self {
        Self {
            carrier_period: drive.carrier_period,
            dead_time: drive.dead_time,
            drop: (drive.switch_drop[0] + drive.diode_drop[0]) / T::of(2.0),
            inductance: drive.line_inductance() / T::of(2.0),
            fade: drive.rated_current * T::of(0.002),
        }
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

    /// This voltage in V for so many carrier periods, sampled once at their end, where the current is at its mean.
    ///
    /// `current` are the phase currents in A at the start and, as predicted, at the end of the first period.
    ///
    /// A dead time before the upper switch closes delays the leg's rise if its current is positive then; one before the
    /// lower closes delays the fall if the current is negative then. So what a period loses depends on the signs at two
    /// instants. Between the outer zero vectors the legs rise one after the other, and until leg k does, those before it
    /// have driven its current down by `r = U/(3L) Σ_j (t_k − t_j)`; after its fall likewise, so that
    /// ```text
    /// i(rise) = i(start) − r,   i(fall) = i(end) + r
    /// ```
    pub(crate) fn command(
        &self,
        voltage: AlphaBeta<T>,
        dc_link: T,
        [start, end]: [Abc<T>; 2],
        periods: u16,
    ) -> Command<T> {
        let (half, one) = (T::of(0.5), T::one());
        let period = T::of(self.carrier_period.seconds());
        let lost = T::of(self.dead_time.seconds()) / period + self.drop / dc_link;
        let plain = voltage.phases().map(|volts| half + volts / dc_link);
        let ripple = dc_link * period / (T::of(6.0) * self.inductance);
        let sure = |current: T| (current / self.fade).max(-one).min(one);
        let mut legs = plain;
        for (k, duty) in legs.0.iter_mut().enumerate() {
            let before = plain.0.iter().fold(T::zero(), |sum, other| sum + (*other - *duty).max(T::zero()));
            let down = ripple * before;
            let sign = (sure(start.0[k] - down) + sure(end.0[k] + down)) * half;
            *duty = (*duty + sign * lost).max(T::zero()).min(one);
        }
        let duration = self.carrier_period * u64::from(periods);
        Command::hold(Stage { legs: legs.map(Leg::Duty), duration }, Sampling::once(duration))
    }
}
