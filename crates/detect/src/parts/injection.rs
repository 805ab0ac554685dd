//! Sequence and settings of high-frequency injection, rotating and pulsating.
//!
//! ```text
//!   wait ─► a voltage per carrier period, a sample at its end, for some cycles ─► demodulated ─► polarity test
//!           ▲                                                                         │ not yet
//!           └─────────────────────────────────────────────────────────────────────────┘
//! ```

#[cfg(test)]
mod tests;

use core::marker::PhantomData;

use standstill_interface::{
    Abc, AlphaBeta, Angle, Command, Fault, Findings, Nanos, Phase, Reading, Real, Step,
};

use crate::keys::{self, Keyed, Lines, Setting, Value, place};
use crate::method::Sequence;
use crate::nameplate::Nameplate;
use crate::parts::lines::SaliencySign;
use crate::parts::margin::Margin;
use crate::parts::modulation::ModulationSettings;
use crate::parts::polarity::{PolaritySettings, PolarityTest};
use crate::parts::settle::{SettleSettings, Settler, all_seen, link};
use crate::parts::significance;
use crate::parts::windows::{self, WindowSettings};
use crate::settings::{
    SettingsError, Source, require, require_positive, require_share, require_zero_or_more,
};

/// Settings of an injection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InjectionSettings<T> {
    /// PWM.
    pub modulation: ModulationSettings<T>,
    /// Amplitude in V of the injected voltage.
    pub voltage: T,
    /// Steps per cycle of the injected voltage, each a carrier period, or two of them with windows.
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
    /// Standard deviation of the sensors' gains, relative: what may look like a saliency.
    pub gain_tolerance: T,
    /// Current in A that the injection must at least raise.
    pub least_current: T,
    /// Windows for the samples of one shunt in the DC link; each step of the voltage then lasts two carrier periods, the second one
    /// mirrored. None: the phases have sensors.
    pub windows: Option<WindowSettings<T>>,
    /// The wait before it and before each vector of the polarity test.
    pub settle: SettleSettings<T>,
    /// The polarity test.
    pub polarity: PolaritySettings<T>,
}

impl<T: Real> InjectionSettings<T> {
    /// 500 Hz on a carrier of 10 kHz, a voltage that makes a quarter of the rated current (60 V on the paper's motor); 10 cycles of
    /// ramp, 50 of measurement.
    fn suited(drive: &Nameplate<T>) -> Self {
        let windows = WindowSettings::suited(drive);
        let cycle = T::of(drive.carrier_period.seconds() * 20.0);
        let reactance = T::TAU() / cycle * (drive.d_axis_inductance + drive.q_axis_inductance) / T::of(2.0);
        // PWM must be able to give it, with room for its compensation.
        let voltage = (drive.rated_current * T::of(0.17) * reactance).min(drive.dc_link * T::of(0.4));
        Self {
            modulation: ModulationSettings::suited(drive),
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

    /// How long a step of the voltage lasts.
    pub(crate) fn step(&self) -> Nanos {
        self.modulation.carrier_period * if self.windows.is_some() { 2 } else { 1 }
    }

    /// ω in rad/s.
    pub(crate) fn frequency(&self) -> T {
        T::TAU() / T::of(self.step().seconds() * f64::from(self.periods))
    }

    /// cos and sin of the phase of the injected voltage when the current is read: at the end of a step, or with windows in its middle.
    pub(crate) fn phase_read(&self, clock: Clock) -> AlphaBeta<T> {
        self.phase(2 * clock.period + if self.windows.is_some() { 1 } else { 2 })
    }

    /// The voltage in V whose sine would make the current that is read of a winding without resistance. Of steps with half an angle x the
    /// current in their middle is x cot x of that.
    pub(crate) fn voltage_read(&self) -> T {
        if self.windows.is_none() {
            return self.voltage;
        }
        let half = T::TAU() / T::of(2.0 * f64::from(self.periods));
        let (sin, cos) = half.sin_cos();
        self.voltage * half * cos / sin
    }

    /// Y0 = ½ (1/L_d + 1/L_q) in 1/H.
    pub(crate) fn mean_admittance(&self) -> T {
        (T::one() / self.d_axis_inductance + T::one() / self.q_axis_inductance) / T::of(2.0)
    }

    /// Contribution of gains and modulation to the variance of each component of |L_B|/L_A e^{j2θ}, where `voltage` V drove the current
    /// that was read; `of_delays` is what the legs' delays make of it.
    pub(crate) fn doubt(&self, dc_link: T, voltage: T, of_delays: impl Fn(T, T, T, T) -> T) -> T {
        let pwm = &self.modulation;
        let [dead_time, period] = [pwm.dead_time, pwm.carrier_period].map(|time| T::of(time.seconds()));
        significance::of_phases(self.gain_tolerance)
            + significance::of_modulation(pwm.lost(dc_link) * dc_link, voltage)
            + of_delays(dead_time, period, dc_link, voltage)
    }

    pub(crate) fn saliency(&self) -> SaliencySign {
        SaliencySign::of(self.d_axis_inductance, self.q_axis_inductance)
    }

    /// cos and sin of the phase of the injected voltage, half steps after the start of a cycle.
    pub(crate) fn phase(&self, half_periods: u16) -> AlphaBeta<T> {
        let share = T::of(f64::from(half_periods) / (2.0 * f64::from(self.periods)));
        let (sin, cos) = (T::TAU() * share).sin_cos();
        AlphaBeta::new(cos, sin)
    }
}

/// Where an injection is: steps of the voltage within cycles, cycles within a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clock {
    /// Step within the cycle.
    pub period: u16,
    /// Cycle within the measurement.
    pub cycle: u16,
}

impl Clock {
    const START: Self = Self { period: 0, cycle: 0 };

    /// One carrier period on.
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
    /// Before the first measurement.
    fn new() -> Self;

    /// Its settings, from those that suit any injection.
    fn suited(settings: InjectionSettings<T>) -> InjectionSettings<T> {
        settings
    }

    /// See [`Keyed::describe`].
    fn describe(_: &InjectionSettings<T>, _: &mut Lines<'_>) {}

    /// The voltage in V of a step.
    fn voltage(&self, settings: &InjectionSettings<T>, clock: Clock) -> AlphaBeta<T>;

    /// The current in A that was read in a step of the measurement, at the phase that its settings say.
    fn add(&mut self, settings: &InjectionSettings<T>, clock: Clock, current: AlphaBeta<T>);

    /// After a measurement: the axis, or none if there is to be another one. `noise` of a reading in A rms, the DC link's voltage
    /// in V.
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
    /// For this motor and drive.
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

/// A detector by injection, of the kind that `D` is.
#[derive(Clone, Debug)]
pub struct Injection<T, D> {
    settings: InjectionSettings<T>,
    demodulator: D,
    state: State<T>,
    settler: Settler<T>,
    /// Last link voltage in V and currents in A, offsets removed.
    dc_link: T,
    current: Abc<T>,
    /// With windows: what the first period of the pair showed; none before it.
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

    /// One carrier period.
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

    /// The first carrier period, once the last current is gone.
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

    /// After a carrier period.
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
