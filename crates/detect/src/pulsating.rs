//! Pulsating high-frequency injection.
//!
//! A voltage V cos ωt along the estimated axis raises a current I sin ωt with the components
//! ```text
//! I_d = V/ω (Y0 + Y1 cos 2δ),   I_q = V/ω Y1 sin 2δ,   Y0,1 = ½ (1/L_d ± 1/L_q)
//! ```
//! where δ is how far the axis is ahead of its estimate: `δ = ½ atan2(I_q, I_d − V Y0/ω)`, and again along the corrected
//! axis. There I_q vanishes whatever V and Y0 are; they only show the way. For L_d > L_q, where Y1 is negative, both
//! arguments change their sign.

use standstill_interface::{
    AlphaBeta, Angle, Command, Detector, Dq, Fault, Findings, Nanos, Outcome, Reading, Real, Step,
};

use crate::injection::{Clock, InjectionSettings};
use crate::lines::SaliencySign;
use crate::nameplate::Nameplate;
use crate::polarity::{PolarityStep, PolarityTest};
use crate::settings::{Settings, SettingsError};
use crate::settle::{Settler, all_seen, link};

/// Settings of the pulsating injection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PulsatingInjectionSettings<T>(pub InjectionSettings<T>);

impl<T: Real> PulsatingInjectionSettings<T> {
    /// For this motor and drive.
    pub fn suited(drive: &Nameplate<T>) -> Self {
        Self(InjectionSettings::pulsating(drive))
    }
}

#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant)] // As for `Step`: boxing would need an allocator.
enum State<T> {
    Start,
    Settling,
    Injecting(Clock),
    Testing(PolarityTest<T>),
}

/// The detector by pulsating injection.
#[derive(Clone, Debug)]
pub struct PulsatingInjection<T> {
    settings: InjectionSettings<T>,
    state: State<T>,
    settler: Settler<T>,
    dc_link: T,
    axis: Angle<T>,
    iteration: u8,
    /// Sum of i sin ωt.
    sum: AlphaBeta<T>,
    findings: Findings<T>,
}

impl<T: Real> PulsatingInjection<T> {
    /// A detector, ready for its first step.
    ///
    /// # Errors
    /// A setting with which the method cannot work.
    pub fn new(settings: PulsatingInjectionSettings<T>) -> Result<Self, SettingsError> {
        let PulsatingInjectionSettings(settings) = settings;
        settings.check()?;
        Ok(Self {
            settings,
            state: State::Start,
            settler: Settler::new(settings.settle, true),
            dc_link: T::zero(),
            axis: Angle::from_radians(T::zero()),
            iteration: 0,
            sum: AlphaBeta::new(T::zero(), T::zero()),
            findings: Findings::default(),
        })
    }

    /// The voltage of one carrier period, and the current in A that it meets: a quarter of a cycle behind.
    fn inject(&self, clock: Clock) -> Command<T> {
        let s = &self.settings;
        let phase = s.phase(2 * clock.period + 1);
        let voltage = Dq::new(s.voltage * phase.alpha, T::zero()).unpark(self.axis);
        let amplitude = s.voltage * s.mean_admittance() / s.frequency();
        let expected = Dq::new(amplitude * phase.beta, T::zero()).unpark(self.axis);
        s.modulation.command(voltage, self.dc_link, expected.phases(), 1)
    }

    fn add(&mut self, clock: Clock, readings: &[Reading<T>]) -> Result<(), Fault<T>> {
        let [reading] = readings else { return Err(Fault::UnexpectedReadings) };
        let current = all_seen(reading)?.clarke();
        self.dc_link = link(reading)?;
        if clock.cycle >= self.settings.ramp {
            self.sum = self.sum + current * self.settings.phase(2 * clock.period + 2).beta;
        }
        Ok(())
    }

    /// After a measurement: the corrected axis.
    fn correct(&mut self) -> Result<(), Fault<T>> {
        let s = &self.settings;
        let samples = T::of(f64::from(s.cycles) * f64::from(s.periods));
        let current = (self.sum * (T::of(2.0) / samples)).park(self.axis);
        self.sum = AlphaBeta::new(T::zero(), T::zero());
        if current.norm() < s.least_current {
            return Err(Fault::NoCurrent { peak: current.norm(), needed: s.least_current });
        }
        let mean = s.voltage * s.mean_admittance() / s.frequency();
        let (sine, cosine) = match s.saliency() {
            SaliencySign::Negative => (current.q, current.d - mean),
            SaliencySign::Positive => (-current.q, mean - current.d),
        };
        let ratio = sine.hypot(cosine) / mean;
        if ratio < s.least_saliency || !ratio.is_finite() {
            return Err(Fault::NoSaliency { ratio, needed: s.least_saliency });
        }
        let noise = self.settler.noise.deviation();
        // I_q has a noise of σ √(2/3) √(2/n); δ is I_q over twice the saliency's current.
        self.findings.angle_deviation =
            Some(noise * T::of(1.0 / 3.0).sqrt() / (samples.sqrt() * ratio * mean));
        let ahead = sine.atan2(cosine) / T::of(2.0);
        self.axis = Angle::from_radians(self.axis.radians() + ahead);
        Ok(())
    }

    /// The first command, once the last current is gone.
    fn begin(&mut self) -> Command<T> {
        self.dc_link = self.settler.dc_link;
        self.state = State::Injecting(Clock::START);
        self.inject(Clock::START)
    }

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
                let mut clock = *clock;
                self.add(clock, readings)?;
                clock.advance(self.settings.periods);
                if clock.cycle >= self.settings.ramp + self.settings.cycles {
                    self.correct()?;
                    self.iteration += 1;
                    clock = Clock::START;
                }
                if self.iteration < self.settings.iterations {
                    self.state = State::Injecting(clock);
                    self.inject(clock)
                } else {
                    let s = &self.settings;
                    let mut test =
                        PolarityTest::new(s.polarity, self.settler, self.axis, s.d_axis_inductance);
                    let wait = test.begin();
                    self.state = State::Testing(test);
                    wait
                }
            }
            State::Testing(test) => match test.step(readings)? {
                PolarityStep::Drive(command) => command,
                PolarityStep::Decided(pole) => return Ok(Step::Done(pole.outcome(self.findings))),
            },
        };
        Ok(Step::Drive(command))
    }
}

impl<T: Real> Detector<T> for PulsatingInjection<T> {
    fn step(&mut self, readings: &[Reading<T>]) -> Step<T> {
        let step = self.next(readings);
        step.unwrap_or_else(|fault| Step::Done(Outcome::Failed { fault, findings: self.findings }))
    }
}

impl<T: Real> Settings<T> for PulsatingInjectionSettings<T> {
    type Detector = PulsatingInjection<T>;

    fn detector(&self) -> Result<Self::Detector, SettingsError> {
        PulsatingInjection::new(*self)
    }

    fn carrier_period(&self) -> Option<Nanos> {
        Some(self.0.modulation.carrier_period)
    }
}
