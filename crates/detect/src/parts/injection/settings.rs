//! Settings of an injection, and the values that follow from them.

use standstill_interface::{AlphaBeta, Nanos, Real};

use super::Clock;
use crate::nameplate::Nameplate;
use crate::parts::lines::SaliencySign;
use crate::parts::modulation::ModulationSettings;
use crate::parts::polarity::PolaritySettings;
use crate::parts::settle::SettleSettings;
use crate::parts::significance;
use crate::parts::windows::{self, WindowSettings};
use crate::settings::{SettingsError, require, require_positive, require_share, require_zero_or_more};

/// Settings of an injection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InjectionSettings<T> {
    /// PWM, with compensation of dead time and drops.
    pub modulation: ModulationSettings<T>,
    /// Amplitude in V of the injected voltage.
    pub voltage: T,
    /// Number of steps per cycle of the injected voltage. A step is a carrier period; with windows, two carrier periods.
    pub periods: u16,
    /// Cycles before the measurement: over them a rotating vector grows, so that no direct current is left.
    pub ramp: u16,
    /// Cycles of one measurement.
    pub cycles: u16,
    /// Number of measurements, one after the other. A pulsating injection makes at least three: two along fixed axes,
    /// and each further one along the axis that the last one found. With five or more it checks whether the rotor
    /// turns.
    pub iterations: u8,
    /// Resistance of a phase in Ω.
    pub resistance: T,
    /// L_d in H, a rough value.
    pub d_axis_inductance: T,
    /// L_q in H, a rough value.
    pub q_axis_inductance: T,
    /// |L_B| / L_A below which no angle is named.
    pub least_saliency: T,
    /// Relative standard deviation of the sensors' gains, which may look like a saliency.
    pub gain_tolerance: T,
    /// Least current in A that the injection must raise.
    pub least_current: T,
    /// Windows for the samples of one shunt in the DC link; each step of the voltage then lasts two carrier periods, the second one
    /// mirrored. None: the phases have sensors.
    pub windows: Option<WindowSettings<T>>,
    /// The wait before the injection and before each vector of the polarity test.
    pub settle: SettleSettings<T>,
    /// The polarity test.
    pub polarity: PolaritySettings<T>,
}

impl<T: Real> InjectionSettings<T> {
    /// Returns settings for this motor and drive: 500 Hz on a carrier of 10 kHz, 10 cycles of ramp and 50 of
    /// measurement. The voltage makes a quarter of the rated current (60 V on the paper's motor), or as much as windows
    /// leave room for.
    pub(crate) fn suited(drive: &Nameplate<T>) -> Self {
        let windows = WindowSettings::suited(drive);
        let cycle = T::of(drive.carrier_period.seconds() * 20.0);
        let reactance = T::TAU() / cycle * (drive.d_axis_inductance + drive.q_axis_inductance) / T::of(2.0);
        // PWM must be able to give the voltage, with room for the compensation.
        let mut voltage = (drive.rated_current * T::of(0.17) * reactance).min(drive.dc_link * T::of(0.4));
        let modulation = ModulationSettings::suited(drive);
        if let Some(windows) = &windows {
            // Less than a third of the voltage would raise too little current: then it stays, and the check refuses the
            // windows, because a slower carrier is better.
            let room = windows.room(&modulation) * T::of(1.0 - 1e-6);
            voltage = if room * T::of(3.0) > voltage { voltage.min(room) } else { voltage };
        }
        Self {
            modulation,
            voltage,
            periods: if windows.is_some() { 10 } else { 20 },
            windows,
            ramp: 10,
            cycles: 50,
            iterations: 1,
            resistance: drive.resistance,
            d_axis_inductance: drive.d_axis_inductance,
            q_axis_inductance: drive.q_axis_inductance,
            least_saliency: T::of(0.02),
            gain_tolerance: drive.gain_tolerance,
            least_current: drive.rated_current * T::of(0.02),
            settle: SettleSettings::suited(drive, 500, 400),
            polarity: PolaritySettings::sequential(drive),
        }
    }

    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        self.modulation.check()?;
        require_positive(self.voltage, "voltage")?;
        // Half periods of a cycle and cycles of a measurement are counted in 16 bits.
        require((6..=10_000).contains(&self.periods), "periods", "from 6 to 10,000 a cycle")?;
        require((1..=30_000).contains(&self.cycles), "cycles", "from 1 to 30,000")?;
        require(self.ramp <= 30_000, "ramp", "at most 30,000")?;
        require(self.iterations > 0, "iterations", "at least 1")?;
        require_zero_or_more(self.resistance, "resistance")?;
        require_positive(self.d_axis_inductance, "d_axis_inductance")?;
        require_positive(self.q_axis_inductance, "q_axis_inductance")?;
        require_share(self.least_saliency, "least_saliency")?;
        require_zero_or_more(self.gain_tolerance, "gain_tolerance")?;
        require_positive(self.least_current, "least_current")?;
        require(
            self.polarity.carrier_period == self.modulation.carrier_period,
            "polarity.carrier_period",
            "that of the modulation",
        )?;
        if let Some(windows) = &self.windows {
            windows.check(&self.modulation, self.voltage)?;
        }
        self.settle.check()?;
        self.polarity.check()
    }

    /// Returns the length of a step of the voltage.
    pub(crate) fn step(&self) -> Nanos {
        self.modulation.carrier_period * if self.windows.is_some() { 2 } else { 1 }
    }

    /// Returns ω in rad/s.
    pub(crate) fn frequency(&self) -> T {
        T::TAU() / T::of(self.step().seconds() * f64::from(self.periods))
    }

    /// Returns cos and sin of the phase of the injected voltage when the current is read: at the end of a step, or with
    /// windows in its middle.
    pub(crate) fn phase_read(&self, clock: Clock) -> AlphaBeta<T> {
        self.phase(2 * clock.period + if self.windows.is_some() { 1 } else { 2 })
    }

    /// Returns ω in rad/s of the sinusoidal voltage V that would cause the current that is read, `V = (R + jωL) I`. For
    /// steps with half an angle x, the current in their middle corresponds to `ω tan x / x`, 3.4 % more for the 10
    /// steps of a cycle with windows. At their ends it corresponds to `ω sin x / x`, 0.4 % less for 20 steps, which is
    /// neglected.
    pub(crate) fn frequency_read(&self) -> T {
        if self.windows.is_none() {
            return self.frequency();
        }
        let half = T::TAU() / T::of(2.0 * f64::from(self.periods));
        let (sin, cos) = half.sin_cos();
        self.frequency() * (sin / (half * cos))
    }

    /// Returns Y0 = ½ (1/L_d + 1/L_q) in 1/H.
    pub(crate) fn mean_admittance(&self) -> T {
        (T::one() / self.d_axis_inductance + T::one() / self.q_axis_inductance) / T::of(2.0)
    }

    /// Returns the contribution of gains and modulation to the variance of each component of |L_B|/L_A e^{j2θ}, if
    /// `voltage` in V drove the current that was read. Three sensors have a gain each; that of one shunt is common to all currents and leaves
    /// the direction of a saliency as it is. `of_delays`: contribution of the legs' delays.
    pub(crate) fn doubt(&self, dc_link: T, voltage: T, of_delays: impl Fn(T, T, T, T) -> T) -> T {
        let pwm = &self.modulation;
        let [dead_time, period] = [pwm.dead_time, pwm.carrier_period].map(|time| T::of(time.seconds()));
        let gains =
            if self.windows.is_some() { T::zero() } else { significance::of_phases(self.gain_tolerance) };
        gains
            + significance::of_modulation(pwm.lost(dc_link) * dc_link, voltage)
            + of_delays(dead_time, period, dc_link, voltage)
    }

    /// Returns the variance of a current's component along a unit vector, relative to the variance of one reading,
    /// while the voltage is along `voltage`. Three sensors give the same in all directions; one shunt gives the largest
    /// across the voltage.
    pub(crate) fn noise_along(&self, direction: AlphaBeta<T>, voltage: AlphaBeta<T>) -> T {
        if self.windows.is_some() { windows::variance(voltage, direction) } else { T::of(2.0 / 3.0) }
    }

    pub(crate) fn saliency(&self) -> SaliencySign {
        SaliencySign::of(self.d_axis_inductance, self.q_axis_inductance)
    }

    /// Returns cos and sin of the phase of the injected voltage, this many half steps after the start of a cycle.
    pub(crate) fn phase(&self, half_periods: u16) -> AlphaBeta<T> {
        let share = T::of(f64::from(half_periods) / (2.0 * f64::from(self.periods)));
        let (sin, cos) = (T::TAU() * share).sin_cos();
        AlphaBeta::new(cos, sin)
    }
}
