//! Voltage vectors by PWM, with the dead time compensated.

use standstill_interface::{Abc, AlphaBeta, Command, Leg, Nanos, Real, Sampling, Stage};

/// What PWM needs to know of the drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModulationSettings<T> {
    /// Period of the drive's PWM carrier.
    pub carrier_period: Nanos,
    /// Dead time of the drive, for its compensation. Zero: none.
    pub dead_time: Nanos,
    /// Current in A below which a leg's compensation fades out: about what the ripple makes change its sign.
    pub fade: T,
}

impl<T: Real> ModulationSettings<T> {
    /// This voltage in V for so many carrier periods, sampled once at their end, where the current is at its mean.
    ///
    /// The dead time takes from each leg a share of the period in the direction of its current; `expected` are the phase
    /// currents in A in the middle of the command.
    pub(crate) fn command(
        &self,
        voltage: AlphaBeta<T>,
        dc_link: T,
        expected: Abc<T>,
        periods: u16,
    ) -> Command<T> {
        let lost = T::of(self.dead_time.seconds() / self.carrier_period.seconds());
        let half = T::of(0.5);
        let mut legs = voltage.phases().map(|volts| half + volts / dc_link);
        for (duty, current) in legs.0.iter_mut().zip(expected.0) {
            let sure = (current / self.fade).max(-T::one()).min(T::one());
            *duty = (*duty + sure * lost).max(T::zero()).min(T::one());
        }
        let duration = self.carrier_period * u64::from(periods);
        Command::hold(Stage { legs: legs.map(Leg::Duty), duration }, Sampling::once(duration))
    }
}
