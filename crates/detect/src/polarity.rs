//! Which end of the axis is north: the two-vector test of the paper.
//!
//! A voltage vector along the magnet drives the core further into saturation, one against it brings it out; so
//! the first raises the larger current. Both are near the rated current, where the difference is largest. They
//! lie on the d-axis and make no torque.

use standstill_interface::{Abc, AlphaBeta, Angle, Command, Leg, Nanos, Real, Sampling, Stage};

use crate::settings::{SettingsError, require, require_positive};

/// Settings of the polarity test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PolaritySettings<T> {
    /// Period of the drive's PWM carrier.
    pub carrier_period: Nanos,
    /// Carrier periods per vector.
    pub periods: u16,
    /// Current in A that a vector is to reach: near the rated current.
    pub current: T,
    /// Resistance of a phase in Ω, to choose the voltage; a rough value will do.
    pub resistance: T,
    /// Dead time of the drive, for its compensation. Zero: none.
    pub dead_time: Nanos,
    /// Difference of the two currents in A below which no pole is named, however quiet the sensors are.
    pub least_margin: T,
}

impl<T: Real> PolaritySettings<T> {
    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        require(self.carrier_period > Nanos::ZERO, "polarity.carrier_period", "positive")?;
        require(self.periods > 0, "polarity.periods", "at least 1")?;
        let longest = Nanos(60_000_000_000);
        require(self.duration() <= longest, "polarity.periods", "such that a vector lasts a minute at most")?;
        require_positive(self.current, "polarity.current")?;
        require(self.resistance >= T::zero(), "polarity.resistance", "zero or more")?;
        require(
            self.dead_time * 4 < self.carrier_period,
            "polarity.dead_time",
            "less than a quarter of the carrier period",
        )?;
        require(self.least_margin >= T::zero(), "polarity.least_margin", "zero or more")
    }

    /// The difference in A that a pole needs when a reading's noise has this standard deviation in A.
    ///
    /// With three independent sensors i_d has √(2/3) of a reading's noise, the difference of two of them √(4/3), of
    /// which four standard deviations are exceeded once in 30,000 times each way. With two sensors i_d is noisier, by
    /// up to 1.6 times, depending on the angle.
    pub(crate) fn needed_margin(&self, noise: T) -> T {
        self.least_margin.max(T::of(4.0) * T::of(4.0 / 3.0).sqrt() * noise)
    }

    fn duration(&self) -> Nanos {
        self.carrier_period * u64::from(self.periods)
    }

    /// Amplitude in V of the vector that raises the wanted current in the d-axis: `L_d I / t + R I / 2`.
    pub(crate) fn amplitude(&self, d_axis_inductance: T) -> T {
        let duration = T::of(self.duration().seconds());
        self.current * (d_axis_inductance / duration + self.resistance / T::of(2.0))
    }

    /// The vector at `angle`, by PWM on all three legs, sampled once at its end; `dc_link` in V.
    ///
    /// The dead time takes from each leg a share of the period in the direction of its current, which is the
    /// direction of its voltage here. Near zero the direction is uncertain and the compensation fades out.
    pub(crate) fn command(&self, angle: Angle<T>, amplitude: T, dc_link: T) -> Command<T> {
        let (sin, cos) = angle.radians().sin_cos();
        let lost = T::of(self.dead_time.seconds() / self.carrier_period.seconds());
        let half = T::of(0.5);
        let phases = AlphaBeta::new(cos, sin).phases();
        let legs = phases.map(|share| {
            let sure = (share * T::of(5.0)).max(-T::one()).min(T::one());
            Leg::Duty((half + share * amplitude / dc_link + sure * lost).max(T::zero()).min(T::one()))
        });
        let duration = self.duration();
        Command::hold(Stage { legs, duration }, Sampling::once(duration))
    }

    /// i_d in A of phase currents, in the frame at `angle`.
    pub(crate) fn direct_current(current: Abc<T>, angle: Angle<T>) -> T {
        current.clarke().park(angle).d
    }
}
