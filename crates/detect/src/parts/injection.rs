//! Sequence and settings of high-frequency injection, rotating and pulsating.
//!
//! ```text
//!   wait ─► a voltage per carrier period, a sample at its end, for some cycles ─► demodulated ─► polarity test
//!           ▲                                                                         │ not yet
//!           └─────────────────────────────────────────────────────────────────────────┘
//! ```

mod settings;
#[cfg(test)]
mod tests;

use core::marker::PhantomData;

use standstill_interface::{Abc, AlphaBeta, Angle, Command, Fault, Findings, Nanos, Phase, Reading, Real};

use crate::checks::Checks;
use crate::keys::{self, Keyed, Lines, Setting, Value, place};
use crate::nameplate::Nameplate;
use crate::parts::margin::Margin;
use crate::parts::polarity::PolaritySettings;
use crate::parts::settle::{Settler, all_seen, link};
use crate::parts::then_pole::{Measurement, Next, ThenPole};
use crate::parts::windows;
use crate::settings::{SettingsError, Source};

pub use settings::InjectionSettings;

/// Position in time of an injection: step of the voltage within a cycle, and cycle within a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clock {
    /// Step within the cycle.
    pub period: u16,
    /// Cycle within the measurement.
    pub cycle: u16,
}

impl Clock {
    const START: Self = Self { period: 0, cycle: 0 };

    /// Advances by one step; `periods`: number of steps per cycle.
    fn advance(&mut self, periods: u16) {
        self.period += 1;
        if self.period >= periods {
            self.period = 0;
            self.cycle += 1;
        }
    }
}

/// Demodulator of an injection: defines the injected voltage, and evaluates the current.
pub trait Demodulator<T: Real>: 'static {
    /// Makes the state before the first measurement.
    fn new() -> Self;

    /// Adapts settings that suit any injection to this method.
    fn suited(settings: InjectionSettings<T>) -> InjectionSettings<T> {
        settings
    }

    /// Describes the settings: see [`Keyed::describe`].
    fn describe(_: &InjectionSettings<T>, _: &mut Lines<'_>) {}

    /// Returns the voltage in V of a step.
    fn voltage(&self, settings: &InjectionSettings<T>, clock: Clock) -> AlphaBeta<T>;

    /// Adds the current in A that was read in a step of the measurement, at the phase that the settings define.
    fn add(&mut self, settings: &InjectionSettings<T>, clock: Clock, current: AlphaBeta<T>);

    /// Concludes a measurement: returns the axis, or none if another measurement follows. `noise`: noise of a reading
    /// in A rms; `dc_link`: voltage of the DC link in V.
    fn conclude(
        &mut self,
        settings: &InjectionSettings<T>,
        noise: T,
        dc_link: T,
        findings: &mut Findings<T>,
        margin: &mut Margin<T>,
    ) -> Result<Option<Angle<T>>, Fault<T>>;
}

/// Settings of an injection; the type `D` defines the kind of injection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InjectionMethod<T, D>(pub InjectionSettings<T>, pub PhantomData<D>);

impl<T: Real, D: Demodulator<T>> InjectionMethod<T, D> {
    /// Returns settings for this motor and drive.
    pub fn suited(drive: &Nameplate<T>) -> Self {
        Self(D::suited(InjectionSettings::suited(drive)), PhantomData)
    }
}

/// A detector by injection; the type `D` defines the kind of injection.
pub type Injection<T, D> = ThenPole<T, Injecting<T, D>>;

/// The measurement of an injection.
#[derive(Clone, Debug)]
pub struct Injecting<T, D> {
    settings: InjectionSettings<T>,
    demodulator: D,
    /// The step under way.
    clock: Clock,
    /// Last link voltage in V and currents in A, offsets removed.
    dc_link: T,
    current: Abc<T>,
    /// With windows: the currents in A of the first period of a pair; none until it has been read.
    first: Option<[T; 2]>,
}

impl<T: Real, D: Demodulator<T>> Injection<T, D> {
    pub(crate) fn new(InjectionMethod(settings, _): InjectionMethod<T, D>) -> Result<Self, SettingsError> {
        settings.check()?;
        let zero = T::zero();
        let measurement = Injecting {
            settings,
            demodulator: D::new(),
            clock: Clock::START,
            dc_link: zero,
            current: Abc::new(zero, zero, zero),
            first: None,
        };
        Ok(Self::start(measurement, Settler::new(settings.settle, true), settings.polarity))
    }
}

impl<T: Real, D: Demodulator<T>> Injecting<T, D> {
    /// Returns the command for one carrier period.
    fn inject(&mut self, clock: Clock) -> Command<T> {
        self.clock = clock;
        let s = &self.settings;
        let voltage = self.demodulator.voltage(s, clock);
        let rise = voltage * (T::of(s.modulation.carrier_period.seconds()) / s.modulation.inductance);
        let end = (self.current.clarke() + rise).phases();
        let Some(windows) = &s.windows else {
            return s.modulation.command(voltage, self.dc_link, [self.current, end], 1);
        };
        let currents = [self.current, end];
        // Until both periods of the pair have been read, the predicted current is used.
        self.current = end;
        windows.period(&s.modulation, voltage, self.dc_link, currents, self.first.is_some())
    }

    /// Reads a period with windows; returns whether the pair is complete.
    fn read_windows(&mut self, readings: &[Reading<T>], residual: Abc<T>) -> Result<bool, Fault<T>> {
        let (s, clock) = (&self.settings, self.clock);
        let (seen, dc_link) = windows::seen(readings, self.first.is_some(), residual[Phase::A])?;
        self.dc_link = dc_link;
        let Some(first) = self.first.take() else {
            self.first = Some(seen);
            return Ok(false);
        };
        let half = T::of(0.5);
        let middle = core::array::from_fn(|n| (first[n] + seen[n]) * half);
        let voltage = self.demodulator.voltage(s, clock);
        let middle = windows::phases(middle, windows::order(voltage));
        if clock.cycle >= s.ramp {
            self.demodulator.add(s, clock, middle.clarke());
        }
        let rise = voltage * (T::of(s.modulation.carrier_period.seconds()) / s.modulation.inductance);
        self.current = (middle.clarke() + rise).phases();
        Ok(true)
    }

    fn read(&mut self, readings: &[Reading<T>], offset: Abc<T>) -> Result<(), Fault<T>> {
        let [reading] = readings else { return Err(Fault::UnexpectedReadings) };
        let seen = all_seen(reading)?;
        self.current = Abc(core::array::from_fn(|k| seen.0[k] - offset.0[k]));
        self.dc_link = link(reading)?;
        if self.clock.cycle >= self.settings.ramp {
            self.demodulator.add(&self.settings, self.clock, self.current.clarke());
        }
        Ok(())
    }
}

impl<T: Real, D: Demodulator<T>> Measurement<T> for Injecting<T, D> {
    fn rested(&mut self, settler: &Settler<T>) -> Command<T> {
        self.dc_link = settler.dc_link;
        self.inject(Clock::START)
    }

    fn measured(
        &mut self,
        readings: &[Reading<T>],
        settler: &mut Settler<T>,
        findings: &mut Findings<T>,
    ) -> Result<Next<T>, Fault<T>> {
        if self.settings.windows.is_none() {
            self.read(readings, settler.residual)?;
        } else if !self.read_windows(readings, settler.residual)? {
            return Ok(Next::Drive(self.inject(self.clock)));
        }
        let (s, mut clock) = (&self.settings, self.clock);
        clock.advance(s.periods);
        if clock.cycle >= s.ramp + s.cycles {
            let (noise, link) = (settler.noise.deviation(), self.dc_link);
            let axis = self.demodulator.conclude(s, noise, link, findings, &mut settler.margin)?;
            if let Some(axis) = axis {
                // The middle of the cycles that were demodulated.
                let cycles = s.step() * (u64::from(s.periods) * u64::from(s.cycles));
                let middle = settler.clock - Nanos(cycles.0 / 2);
                return Ok(Next::Test(axis, T::of(middle.seconds()), s.d_axis_inductance));
            }
            clock = Clock::START;
        }
        Ok(Next::Drive(self.inject(clock)))
    }
}

impl<T: Real, D: Demodulator<T>> Keyed for InjectionMethod<T, D> {
    const SETTINGS: &'static [Setting<Self>] = &[
        place!(LEAST_SALIENCY, s => s.0.least_saliency, Value::of, real),
        place!(GAIN_TOLERANCE, s => s.0.gain_tolerance, Value::of, real),
        place!(CHECKS, s => s.0.polarity.checks => value, set_value),
        place!(VECTOR_CURRENT, s => s.0.polarity.current, Value::of, real),
        place!(POLE_ERROR, s => s.0.polarity => pole_error, set_pole_error),
        place!(VOLTAGE, s => s.0.voltage, Value::of, real),
        place!(COMPENSATION, s => s.0.modulation => compensation, set_compensation),
        Setting::new(
            &keys::WINDOW,
            |s| s.0.windows.map(|windows| Value::time(windows.length)),
            |s, value| {
                let Some(windows) = &mut s.0.windows else { return false };
                windows.length = value.nanos();
                true
            },
        ),
    ];

    const CHECKS: Checks = PolaritySettings::<T>::CHECKS;

    const SOURCES: &'static [Source] = &[Source::PhaseCurrents, Source::LinkCurrent];

    fn needed_sources(&self) -> &'static [Source] {
        if self.0.windows.is_some() { &[Source::LinkCurrent] } else { &[Source::PhaseCurrents] }
    }

    fn describe(&self, line: &mut Lines<'_>) {
        D::describe(&self.0, line);
    }

    fn carrier(&self) -> Option<Nanos> {
        Some(self.0.modulation.carrier_period)
    }
}
