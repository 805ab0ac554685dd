//! What rotating and pulsating high-frequency injection have in common.

use standstill_interface::{AlphaBeta, Nanos, Real};

use crate::lines::SaliencySign;
use crate::modulation::ModulationSettings;
use crate::nameplate::Nameplate;
use crate::polarity::{PolarityRule, PolaritySettings, SequentialSettings};
use crate::settings::{SettingsError, require, require_positive};
use crate::settle::SettleSettings;

/// Settings of an injection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InjectionSettings<T> {
    /// PWM.
    pub modulation: ModulationSettings<T>,
    /// Amplitude in V of the injected voltage.
    pub voltage: T,
    /// Carrier periods per cycle of the injected voltage.
    pub periods: u16,
    /// Cycles before the measurement: over them a rotating vector grows, so that no direct current is left.
    pub ramp: u16,
    /// Cycles of one measurement.
    pub cycles: u16,
    /// Measurements one after the other; a pulsating injection turns to the angle found by the last.
    pub iterations: u8,
    /// Resistance of a phase in Ω.
    pub resistance: T,
    /// L_d in H, a rough value.
    pub d_axis_inductance: T,
    /// L_q in H, likewise.
    pub q_axis_inductance: T,
    /// |L_B| / L_A below which no angle is named.
    pub least_saliency: T,
    /// Current in A that the injection must at least raise.
    pub least_current: T,
    /// The wait before it and before each vector of the polarity test.
    pub settle: SettleSettings<T>,
    /// The polarity test.
    pub polarity: PolaritySettings<T>,
}

impl<T: Real> InjectionSettings<T> {
    /// 500 Hz on a carrier of 10 kHz, a voltage that makes a quarter of the rated current (60 V on the paper's motor).
    fn suited(drive: &Nameplate<T>) -> Self {
        let periods = 20_u16;
        let cycle = T::of(drive.carrier_period.seconds() * f64::from(periods));
        let reactance = T::TAU() / cycle * (drive.d_axis_inductance + drive.q_axis_inductance) / T::of(2.0);
        // PWM must be able to give it, with room for its compensation.
        let voltage = (drive.rated_current * T::of(0.17) * reactance).min(drive.dc_link * T::of(0.4));
        Self {
            modulation: ModulationSettings {
                carrier_period: drive.carrier_period,
                dead_time: drive.dead_time,
                fade: voltage / reactance / T::of(8.0),
            },
            voltage,
            periods,
            ramp: 10,
            cycles: 50,
            iterations: 1,
            resistance: drive.resistance,
            d_axis_inductance: drive.d_axis_inductance,
            q_axis_inductance: drive.q_axis_inductance,
            least_saliency: T::of(0.02),
            least_current: drive.rated_current * T::of(0.02),
            settle: SettleSettings {
                wait: Nanos::from_micros(500),
                threshold: drive.rated_current * T::of(0.025),
                attempts: 400,
            },
            polarity: PolaritySettings::near_rated_current(
                drive,
                drive.signature,
                PolarityRule::Sequential(SequentialSettings::new(drive.polarity_difference)),
            ),
        }
    }

    /// A rotating injection: 10 cycles of ramp, 50 of measurement.
    pub fn rotating(drive: &Nameplate<T>) -> Self {
        Self::suited(drive)
    }

    /// A pulsating injection: 6 measurements of 10 cycles, of which the first two of each are left to settle.
    pub fn pulsating(drive: &Nameplate<T>) -> Self {
        Self { ramp: 2, cycles: 8, iterations: 6, ..Self::suited(drive) }
    }

    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        require(self.modulation.carrier_period > Nanos::ZERO, "modulation.carrier_period", "positive")?;
        require(
            self.modulation.dead_time * 4 < self.modulation.carrier_period,
            "modulation.dead_time",
            "less than a quarter of the carrier period",
        )?;
        require_positive(self.modulation.fade, "modulation.fade")?;
        require_positive(self.voltage, "voltage")?;
        require(self.periods >= 6, "periods", "at least 6 a cycle")?;
        require(self.cycles > 0, "cycles", "at least 1")?;
        require(self.iterations > 0, "iterations", "at least 1")?;
        require(self.resistance >= T::zero(), "resistance", "zero or more")?;
        require_positive(self.d_axis_inductance, "d_axis_inductance")?;
        require_positive(self.q_axis_inductance, "q_axis_inductance")?;
        require_positive(self.least_saliency, "least_saliency")?;
        require_positive(self.least_current, "least_current")?;
        require(
            self.polarity.carrier_period == self.modulation.carrier_period,
            "polarity.carrier_period",
            "that of the modulation",
        )?;
        self.settle.check()?;
        self.polarity.check()
    }

    /// ω in rad/s.
    pub(crate) fn frequency(&self) -> T {
        T::TAU() / T::of(self.modulation.carrier_period.seconds() * f64::from(self.periods))
    }

    /// Y0 = ½ (1/L_d + 1/L_q) in 1/H.
    pub(crate) fn mean_admittance(&self) -> T {
        (T::one() / self.d_axis_inductance + T::one() / self.q_axis_inductance) / T::of(2.0)
    }

    pub(crate) fn saliency(&self) -> SaliencySign {
        if self.d_axis_inductance > self.q_axis_inductance {
            SaliencySign::Positive
        } else {
            SaliencySign::Negative
        }
    }

    /// cos and sin of the phase of the injected voltage, half carrier periods after the start of a cycle.
    pub(crate) fn phase(&self, half_periods: u16) -> AlphaBeta<T> {
        let share = T::of(f64::from(half_periods) / (2.0 * f64::from(self.periods)));
        let (sin, cos) = (T::TAU() * share).sin_cos();
        AlphaBeta::new(cos, sin)
    }
}

/// Counts carrier periods within cycles and cycles within measurements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Clock {
    pub period: u16,
    pub cycle: u16,
}

impl Clock {
    pub const START: Self = Self { period: 0, cycle: 0 };

    /// One carrier period on.
    pub fn advance(&mut self, periods: u16) {
        self.period += 1;
        if self.period >= periods {
            self.period = 0;
            self.cycle += 1;
        }
    }
}

/// Product of complex numbers.
pub(crate) fn times<T: Real>(a: AlphaBeta<T>, b: AlphaBeta<T>) -> AlphaBeta<T> {
    AlphaBeta::new(a.alpha * b.alpha - a.beta * b.beta, a.alpha * b.beta + a.beta * b.alpha)
}

/// Conjugate.
pub(crate) fn conjugate<T: Real>(a: AlphaBeta<T>) -> AlphaBeta<T> {
    AlphaBeta::new(a.alpha, -a.beta)
}
