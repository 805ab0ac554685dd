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

use standstill_interface::{
    Abc, AlphaBeta, Angle, Command, Fault, Findings, Nanos, Phase, Reading, Real, Step,
};

use crate::checks::Checks;
use crate::keys::{self, Keyed, Lines, Setting, Value, place};
use crate::method::Sequence;
use crate::nameplate::Nameplate;
use crate::parts::margin::Margin;
use crate::parts::polarity::{PolaritySettings, PolarityTest};
use crate::parts::settle::{Settler, all_seen, link};
use crate::parts::windows;
use crate::settings::{SettingsError, Source};

pub use settings::InjectionSettings;

/// Position in time of an injection: steps of the voltage within cycles, cycles within a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clock {
    /// Step within the cycle.
    pub period: u16,
    /// Cycle within the measurement.
    pub cycle: u16,
}

impl Clock {
    const START: Self = Self { period: 0, cycle: 0 };

    /// Advances by this many carrier periods.
    fn advance(&mut self, periods: u16) {
        self.period += 1;
        if self.period >= periods {
            self.period = 0;
            self.cycle += 1;
        }
    }
}

/// Demodulator of an injection: the injected voltage, and how its current is read.
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

/// Settings of an injection of the kind that `D` is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InjectionMethod<T, D>(pub InjectionSettings<T>, pub PhantomData<D>);

impl<T: Real, D: Demodulator<T>> InjectionMethod<T, D> {
    /// Returns settings for this motor and drive.
    pub fn suited(drive: &Nameplate<T>) -> Self {
        Self(D::suited(InjectionSettings::suited(drive)), PhantomData)
    }
}

/// State of the sequence, named after the last command.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant)] // As for `Step`: boxing would need an allocator.
enum State<T> {
    Start,
    Settling,
    Injecting(Clock),
    Testing(PolarityTest<T>),
}

/// A detector by injection; the type `D` defines the kind of injection.
#[derive(Clone, Debug)]
pub struct Injection<T, D> {
    settings: InjectionSettings<T>,
    demodulator: D,
    state: State<T>,
    settler: Settler<T>,
    /// Last link voltage in V and currents in A, offsets removed.
    dc_link: T,
    current: Abc<T>,
    /// With windows: the readings of the first period of the pair; none before it.
    first: Option<[T; 2]>,
    findings: Findings<T>,
}

impl<T: Real, D: Demodulator<T>> Injection<T, D> {
    pub(crate) fn new(InjectionMethod(settings, _): InjectionMethod<T, D>) -> Result<Self, SettingsError> {
        settings.check()?;
        let zero = T::zero();
        Ok(Self {
            settings,
            demodulator: D::new(),
            state: State::Start,
            settler: Settler::new(settings.settle, true),
            dc_link: zero,
            current: Abc::new(zero, zero, zero),
            first: None,
            findings: Findings::default(),
        })
    }

    /// Returns the command for one carrier period.
    fn inject(&mut self, clock: Clock) -> Command<T> {
        self.state = State::Injecting(clock);
        let s = &self.settings;
        let voltage = self.demodulator.voltage(s, clock);
        let rise = voltage * (T::of(s.modulation.carrier_period.seconds()) / s.modulation.inductance);
        let end = (self.current.clarke() + rise).phases();
        let Some(windows) = &s.windows else {
            return s.modulation.command(voltage, self.dc_link, [self.current, end], 1);
        };
        let currents = [self.current, end];
        // Until the pair has been read its middle is as predicted.
        self.current = end;
        windows.period(&s.modulation, voltage, self.dc_link, currents, self.first.is_some())
    }

    /// Reads a period with windows; returns whether the pair is complete.
    fn read_windows(&mut self, clock: Clock, readings: &[Reading<T>]) -> Result<bool, Fault<T>> {
        let s = &self.settings;
        let (seen, dc_link) = windows::seen(readings, self.first.is_some(), self.settler.residual[Phase::A])?;
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

    /// Returns the first carrier period, after the last current has decayed.
    fn begin(&mut self) -> Command<T> {
        self.dc_link = self.settler.dc_link;
        self.inject(Clock::START)
    }

    fn read(&mut self, clock: Clock, readings: &[Reading<T>]) -> Result<(), Fault<T>> {
        let [reading] = readings else { return Err(Fault::UnexpectedReadings) };
        let seen = all_seen(reading)?;
        let offset = self.settler.residual;
        self.current = Abc(core::array::from_fn(|k| seen.0[k] - offset.0[k]));
        self.dc_link = link(reading)?;
        if clock.cycle >= self.settings.ramp {
            self.demodulator.add(&self.settings, clock, self.current.clarke());
        }
        Ok(())
    }

    /// Evaluates a carrier period and returns the next command.
    fn injected(&mut self, mut clock: Clock, readings: &[Reading<T>]) -> Result<Command<T>, Fault<T>> {
        if self.settings.windows.is_none() {
            self.read(clock, readings)?;
        } else if !self.read_windows(clock, readings)? {
            return Ok(self.inject(clock));
        }
        let s = &self.settings;
        clock.advance(s.periods);
        if clock.cycle >= s.ramp + s.cycles {
            let noise = self.settler.noise.deviation();
            let (link, margin) = (self.dc_link, &mut self.settler.margin);
            let concluded = self.demodulator.conclude(s, noise, link, &mut self.findings, margin)?;
            if let Some(axis) = concluded {
                let mut test = PolarityTest::new(s.polarity, self.settler, axis, s.d_axis_inductance);
                let wait = test.begin();
                self.state = State::Testing(test);
                return Ok(wait);
            }
            clock = Clock::START;
        }
        Ok(self.inject(clock))
    }
}

impl<T: Real, D: Demodulator<T>> Sequence<T> for Injection<T, D> {
    fn next(&mut self, readings: &[Reading<T>]) -> Result<Step<T>, Fault<T>> {
        let command = match &mut self.state {
            State::Start => {
                self.state = State::Settling;
                self.settler.begin()
            }
            State::Settling => match self.settler.step(readings)? {
                Some(wait) => wait,
                None => self.begin(),
            },
            State::Injecting(clock) => {
                let clock = *clock;
                self.injected(clock, readings)?
            }
            State::Testing(test) => return Ok(test.step(readings)?.with(self.findings)),
        };
        Ok(Step::Drive(command))
    }

    fn so_far(&self) -> (&Findings<T>, Margin<T>) {
        let margin = match &self.state {
            State::Testing(test) => test.margin(),
            _ => self.settler.margin,
        };
        (&self.findings, margin)
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
