//! Rotating high-frequency injection.
//!
//! A voltage V e^{jωt} raises a current with a part that turns with it, `P e^{jωt}`, and by saliency one that turns
//! against it, `N e^{−jωt}`, whose phase has 2θ in it. With `P = ⟨i e^{−jωt}⟩`, `N = ⟨i e^{jωt}⟩`
//! ```text
//! 2θ = arg[N P (L_Σ + jR/ω)],   L_Σ = (L_d + L_q)/2,   for L_d < L_q; half a turn further for L_d > L_q
//! ```
//! A shift of the time of all samples turns P and N against each other and cancels in the product.

use standstill_interface::{
    AlphaBeta, Angle, Command, Detector, Fault, Findings, Nanos, Outcome, Reading, Real, Step,
};

use crate::injection::{Clock, InjectionSettings, conjugate, times};
use crate::lines::SaliencySign;
use crate::nameplate::Nameplate;
use crate::polarity::{PolarityStep, PolarityTest};
use crate::settings::{Settings, SettingsError};
use crate::settle::{Settler, all_seen, link};

/// Settings of the rotating injection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RotatingInjectionSettings<T>(pub InjectionSettings<T>);

impl<T: Real> RotatingInjectionSettings<T> {
    /// For this motor and drive.
    pub fn suited(drive: &Nameplate<T>) -> Self {
        Self(InjectionSettings::rotating(drive))
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

/// The detector by rotating injection.
#[derive(Clone, Debug)]
pub struct RotatingInjection<T> {
    settings: InjectionSettings<T>,
    state: State<T>,
    settler: Settler<T>,
    dc_link: T,
    /// Sums of i e^{−jωt} and i e^{jωt}.
    positive: AlphaBeta<T>,
    negative: AlphaBeta<T>,
    findings: Findings<T>,
}

impl<T: Real> RotatingInjection<T> {
    /// A detector, ready for its first step.
    ///
    /// # Errors
    /// A setting with which the method cannot work.
    pub fn new(settings: RotatingInjectionSettings<T>) -> Result<Self, SettingsError> {
        let RotatingInjectionSettings(settings) = settings;
        settings.check()?;
        let zero = AlphaBeta::new(T::zero(), T::zero());
        Ok(Self {
            settings,
            state: State::Start,
            settler: Settler::new(settings.settle, true),
            dc_link: T::zero(),
            positive: zero,
            negative: zero,
            findings: Findings::default(),
        })
    }

    /// The voltage of one carrier period, and the current in A that it meets: a quarter of a cycle behind.
    fn inject(&self, clock: Clock) -> Command<T> {
        let s = &self.settings;
        let ramp = T::of(f64::from(s.ramp) * f64::from(s.periods));
        let now = T::of(f64::from(clock.cycle) * f64::from(s.periods) + f64::from(clock.period) + 0.5);
        let amplitude = s.voltage * (now / ramp.max(T::of(0.5))).min(T::one());
        let voltage = s.phase(2 * clock.period + 1) * amplitude;
        let expected = -voltage.quarter_turn() * (s.mean_admittance() / s.frequency());
        s.modulation.command(voltage, self.dc_link, expected.phases(), 1)
    }

    fn add(&mut self, clock: Clock, readings: &[Reading<T>]) -> Result<(), Fault<T>> {
        let [reading] = readings else { return Err(Fault::UnexpectedReadings) };
        let current = all_seen(reading)?.clarke();
        self.dc_link = link(reading)?;
        if clock.cycle >= self.settings.ramp {
            let phase = self.settings.phase(2 * clock.period + 2);
            self.positive = self.positive + times(current, conjugate(phase));
            self.negative = self.negative + times(current, phase);
        }
        Ok(())
    }

    fn find_axis(&mut self) -> Result<Angle<T>, Fault<T>> {
        let s = &self.settings;
        let samples = T::of(f64::from(s.cycles) * f64::from(s.periods));
        let (positive, negative) = (self.positive.norm() / samples, self.negative.norm() / samples);
        if positive < s.least_current {
            return Err(Fault::NoCurrent { peak: positive, needed: s.least_current });
        }
        let mean = (s.d_axis_inductance + s.q_axis_inductance) / T::of(2.0);
        let resistive = AlphaBeta::new(mean, s.resistance / s.frequency());
        // Products of sums would leave the range of single precision before their arguments do.
        let unit = |z: AlphaBeta<T>| z * (T::one() / z.norm());
        let product = times(times(unit(self.negative), unit(self.positive)), resistive);
        let product = match s.saliency() {
            SaliencySign::Negative => product,
            SaliencySign::Positive => -product,
        };
        // |N|/|P| = (1/L_d − 1/L_q)/(1/L_d + 1/L_q) = |L_B|/L_A.
        let ratio = negative / positive;
        self.findings.mean_inductance = Some(s.voltage / (positive * s.frequency() * T::of(1.5)));
        if ratio < s.least_saliency || !ratio.is_finite() {
            return Err(Fault::NoSaliency { ratio, needed: s.least_saliency });
        }
        let noise = self.settler.noise.deviation();
        // N has a noise of σ √(2/3)/√n in each component; half of its angle's.
        self.findings.angle_deviation = Some(noise * T::of(1.0 / 6.0).sqrt() / (samples.sqrt() * negative));
        Ok(Angle::from_radians(product.beta.atan2(product.alpha) / T::of(2.0)))
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
                if clock.cycle < self.settings.ramp + self.settings.cycles {
                    self.state = State::Injecting(clock);
                    self.inject(clock)
                } else {
                    let axis = self.find_axis()?;
                    let s = &self.settings;
                    let mut test = PolarityTest::new(s.polarity, self.settler, axis, s.d_axis_inductance);
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

impl<T: Real> Detector<T> for RotatingInjection<T> {
    fn step(&mut self, readings: &[Reading<T>]) -> Step<T> {
        let step = self.next(readings);
        step.unwrap_or_else(|fault| Step::Done(Outcome::Failed { fault, findings: self.findings }))
    }
}

impl<T: Real> Settings<T> for RotatingInjectionSettings<T> {
    type Detector = RotatingInjection<T>;

    fn detector(&self) -> Result<Self::Detector, SettingsError> {
        RotatingInjection::new(*self)
    }

    fn carrier_period(&self) -> Option<Nanos> {
        Some(self.0.modulation.carrier_period)
    }
}
