//! Which end of the axis is north: voltage vectors along it and against it, from rest each time.
//!
//! A voltage vector along the magnet drives the core further into saturation, one against it brings it out; so
//! the first raises the larger current, or in motors with iron bridges the smaller one: that is the motor's
//! [`Signature`]. Both are near the rated current, where the difference is largest. They lie on the d-axis and make no
//! torque.
//!
//! ```text
//!   two vectors (the paper):  wait ─► along ─► wait ─► against ─► wait ─► the larger current
//!   sequential:               wait ─► along ─► wait ─► against ─► wait ─► against ─► wait ─► along ─► … until certain
//! ```
//! Order ABBA: what drifts linearly in time does not tell the poles apart.

mod pointer;
mod sequential;
#[cfg(test)]
mod tests;

use standstill_interface::{
    Abc, AlphaBeta, Angle, Command, Fault, Findings, Leg, Nanos, Outcome, Polarity, Reading, Real, Sampling,
    Stage, Undetermined, choice,
};

use crate::nameplate::Nameplate;
use crate::settings::{LONGEST, SettingsError, require, require_positive, require_zero_or_more};
use crate::settle::{Settler, all_seen, link};
pub(crate) use pointer::Pointer;
pub use sequential::SequentialSettings;

choice! {
    /// Which of two opposite voltage vectors along the d-axis raises the larger current: a property of the motor's
    /// magnetics, and the one thing about the poles that no measurement at standstill can tell.
    pub enum Signature {
        /// The one towards north.
        Normal = "normal",
        /// The one towards south.
        Inverted = "inverted",
        /// Neither, or it depends on the current: no pole is named.
        None = "none",
    }
}

/// When the pole is certain enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PolarityRule<T> {
    /// After one vector each way, as in the paper: the larger current decides if the difference exceeds the noise.
    TwoVectors,
    /// After as many as it takes.
    Sequential(SequentialSettings<T>),
}

/// Pairs before the sequential test may stop; and where they scatter by more than so many times the variance that the
/// sensors' noise gives them, which few pairs do by chance.
const LEAST_PAIRS: u16 = 2;
const SCATTERED_PAIRS: u16 = 4;
const BY_CHANCE: f64 = 4.0;

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
    /// Current in A that a vector must at least raise.
    pub least_current: T,
    /// Difference of the two currents in A below which two vectors name no pole, however quiet the sensors are.
    pub least_margin: T,
    /// What the motor's answer means.
    pub signature: Signature,
    /// When to stop.
    pub rule: PolarityRule<T>,
}

impl<T: Real> PolaritySettings<T> {
    /// Vectors 2 % above the rated current, the mean of the paper's Table 2, of at least 1 ms, and so long that at most
    /// 0.3 of the link is needed, which PWM can give in any direction.
    pub fn near_rated_current(drive: &Nameplate<T>, signature: Signature, rule: PolarityRule<T>) -> Self {
        let carrier_period = drive.carrier_period;
        let current = drive.rated_current * T::of(1.02);
        // A millisecond, in whole periods.
        let least = u16::try_from((1_000_000 / carrier_period.0.max(1)).max(1)).unwrap_or(u16::MAX);
        let duration = drive.d_axis_inductance * current / (T::of(0.3) * drive.dc_link);
        let needed = Nanos::from_seconds(duration.to_double()).0.div_ceil(carrier_period.0.max(1));
        Self {
            carrier_period,
            periods: u16::try_from(needed).unwrap_or(u16::MAX).clamp(least, least.saturating_mul(20)),
            current,
            resistance: drive.resistance,
            dead_time: drive.dead_time,
            least_current: drive.rated_current * T::of(0.02),
            least_margin: drive.rated_current * T::of(0.01),
            signature,
            rule,
        }
    }

    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        require(self.carrier_period > Nanos::ZERO, "polarity.carrier_period", "positive")?;
        require(self.periods > 0, "polarity.periods", "at least 1")?;
        require(self.duration() <= LONGEST, "polarity.periods", "such that a vector lasts a minute at most")?;
        require_positive(self.current, "polarity.current")?;
        require_zero_or_more(self.resistance, "polarity.resistance")?;
        require(
            self.dead_time * 4 < self.carrier_period,
            "polarity.dead_time",
            "less than a quarter of the carrier period",
        )?;
        require_positive(self.least_current, "polarity.least_current")?;
        require_zero_or_more(self.least_margin, "polarity.least_margin")?;
        match &self.rule {
            PolarityRule::TwoVectors => Ok(()),
            PolarityRule::Sequential(settings) => settings.check(),
        }
    }

    /// The difference in A that a pole needs when a reading's noise has this standard deviation in A.
    ///
    /// With three independent sensors i_d has √(2/3) of a reading's noise, the difference of two of them √(4/3), of
    /// which four standard deviations are exceeded once in 30,000 times each way. With two sensors i_d is noisier, by
    /// up to 1.6 times, depending on the angle.
    pub(crate) fn needed_margin(&self, noise: T) -> T {
        self.least_margin.max(T::of(4.0) * T::of(4.0 / 3.0).sqrt() * noise)
    }

    /// Length of one vector.
    pub fn duration(&self) -> Nanos {
        self.carrier_period * u64::from(self.periods)
    }

    /// Amplitude in V of the vector that raises the wanted current in the d-axis: `L_d I / t + R I / 2`.
    pub(crate) fn amplitude(&self, d_axis_inductance: T) -> T {
        let duration = T::of(self.duration().seconds());
        self.current * (d_axis_inductance / duration + self.resistance / T::of(2.0))
    }

    /// The vector at `angle`, by PWM on all three legs; `dc_link` in V. Sampled at its end; for the sequential test at
    /// the end of each carrier period, to know the mean of the DC link.
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
        let sampling = match self.rule {
            PolarityRule::TwoVectors => Sampling::once(duration),
            PolarityRule::Sequential(_) => Sampling {
                first: self.carrier_period,
                interval: self.carrier_period,
                count: u32::from(self.periods),
            },
        };
        Command::hold(Stage { legs, duration }, sampling)
    }

    /// i_d in A of phase currents, in the frame at `angle`.
    pub(crate) fn direct_current(current: Abc<T>, angle: Angle<T>) -> T {
        current.clarke().park(angle).d
    }
}

/// What the test says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pole<T> {
    /// The north pole's electrical angle, or one end of the axis if there is a reason.
    pub angle: Angle<T>,
    /// Why the pole is undetermined; none: it is determined.
    pub undetermined: Option<Undetermined<T>>,
    /// The two currents compared: means over all pairs.
    pub polarity: Option<Polarity<T>>,
    /// Probability that the pole is wrong, where the rule knows it.
    pub error: Option<T>,
}

impl<T: Real> Pole<T> {
    /// The end of a detection that found this and, before, these.
    pub(crate) fn outcome(self, findings: Findings<T>) -> Outcome<T> {
        let findings =
            Findings { polarity: self.polarity.or(findings.polarity), pole_error: self.error, ..findings };
        match self.undetermined {
            _ if !self.angle.radians().is_finite() => Outcome::Failed { fault: Fault::NotANumber, findings },
            None => Outcome::Found { angle: self.angle, findings },
            Some(reason) => Outcome::Axis { angle: self.angle, reason, findings },
        }
    }
}

/// What the test wants next.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use = "a step that is not carried out is lost"]
#[allow(clippy::large_enum_variant)] // As for `Step`: boxing would need an allocator.
pub(crate) enum PolarityStep<T> {
    Drive(Command<T>),
    Decided(Pole<T>),
}

/// What the last command was.
#[derive(Clone, Copy, Debug, PartialEq)]
enum State {
    Settling { last: bool },
    Pushing,
}

/// The polarity test, once an axis is known.
#[derive(Clone, Debug)]
pub(crate) struct PolarityTest<T> {
    settings: PolaritySettings<T>,
    settler: Settler<T>,
    state: State,
    axis: Angle<T>,
    amplitude: T,
    /// Vectors given so far.
    vectors: u16,
    /// Responses in A and in A/V, north candidate first, of the pair in the making.
    current: [T; 2],
    response: [T; 2],
    /// Sums over the pairs.
    along: T,
    against: T,
    sum: T,
    squares: T,
}

impl<T: Real> PolarityTest<T> {
    /// A test that takes over after a method's own measurements; `settler` knows the noise from its waits.
    pub fn new(
        settings: PolaritySettings<T>,
        settler: Settler<T>,
        axis: Angle<T>,
        d_axis_inductance: T,
    ) -> Self {
        let zero = T::zero();
        Self {
            settings,
            settler,
            state: State::Settling { last: false },
            axis,
            amplitude: settings.amplitude(d_axis_inductance),
            vectors: 0,
            current: [zero; 2],
            response: [zero; 2],
            along: zero,
            against: zero,
            sum: zero,
            squares: zero,
        }
    }

    /// The first step. Without a signature there is nothing to test, but the last current must be gone.
    pub fn begin(&mut self) -> Command<T> {
        self.wait(self.settings.signature == Signature::None)
    }

    fn wait(&mut self, last: bool) -> Command<T> {
        self.state = State::Settling { last };
        self.settler.begin()
    }

    /// Whether the next vector is the one against the axis: in the order ABBA.
    fn against(&self) -> bool {
        matches!(self.vectors % 4, 1 | 2)
    }

    fn direction(&self) -> Angle<T> {
        if self.against() { self.axis.opposite() } else { self.axis }
    }

    pub fn step(&mut self, readings: &[Reading<T>]) -> Result<PolarityStep<T>, Fault<T>> {
        Ok(match self.state {
            State::Settling { last } => match self.settler.step(readings)? {
                Some(wait) => PolarityStep::Drive(wait),
                None if last => PolarityStep::Decided(self.answer()),
                None => {
                    self.state = State::Pushing;
                    let (direction, amplitude) = (self.direction(), self.amplitude);
                    PolarityStep::Drive(self.settings.command(direction, amplitude, self.settler.dc_link))
                }
            },
            State::Pushing => {
                self.pushed(readings)?;
                let enough = self.vectors.is_multiple_of(2)
                    && match self.settings.rule {
                        PolarityRule::TwoVectors => true,
                        PolarityRule::Sequential(sequential) => self.is_enough(&sequential),
                    };
                PolarityStep::Drive(self.wait(enough))
            }
        })
    }

    fn pairs(&self) -> u16 {
        self.vectors / 2
    }

    fn pushed(&mut self, readings: &[Reading<T>]) -> Result<(), Fault<T>> {
        let Some(last) = readings.last() else { return Err(Fault::UnexpectedReadings) };
        let seen = all_seen(last)?;
        let direction = self.direction();
        let slot = usize::from(self.against());
        let sequential = matches!(self.settings.rule, PolarityRule::Sequential(_));
        let expected = if sequential { usize::from(self.settings.periods) } else { 1 };
        if readings.len() != expected {
            return Err(Fault::UnexpectedReadings);
        }
        let mut current = PolaritySettings::direct_current(seen, direction);
        if sequential {
            // What the sensors read without current is their offset.
            current = current - PolaritySettings::direct_current(self.settler.residual, direction);
        }
        let needed = self.settings.least_current;
        if current < needed || !current.is_finite() {
            return Err(Fault::NoCurrent { peak: current, needed });
        }
        let mut volts = T::zero();
        for reading in readings {
            volts = volts + link(reading)?;
        }
        self.current[slot] = current;
        self.response[slot] = current * T::of(readings.len() as f64) / volts;
        self.vectors += 1;
        if self.vectors.is_multiple_of(2) {
            let [along, against] = self.response;
            let difference = T::of(2.0) * (along - against) / (along + against);
            self.sum = self.sum + difference;
            self.squares = self.squares + difference * difference;
            self.along = self.along + self.current[0];
            self.against = self.against + self.current[1];
        }
        Ok(())
    }

    /// Mean of the relative differences, the variance of one of them, and what of that is the sensors' noise.
    fn differences(&self) -> (T, T, T) {
        let n = T::of(f64::from(self.pairs()));
        let mean = self.sum / n;
        // Two i_d of three sensors, each with √(2/3) of a reading's noise, and their two offsets.
        let noise = self.settler.noise.deviation() * n * T::of(2.0) / (self.along + self.against);
        let least = T::of(8.0 / 3.0) * noise * noise;
        let scatter = (self.squares - self.sum * mean) / (n - T::one());
        // A few pairs may agree by chance.
        (mean, if scatter > least { scatter } else { least }, least)
    }

    /// The probability of a wrong pole.
    fn error(&self, sequential: &SequentialSettings<T>) -> T {
        let (mean, variance, _) = self.differences();
        let n = T::of(f64::from(self.pairs()));
        sequential.error_of(mean, variance / n + sequential.floor * sequential.floor)
    }

    /// Whether no more pairs are needed, or allowed.
    fn is_enough(&self, sequential: &SequentialSettings<T>) -> bool {
        let pairs = self.pairs();
        if pairs >= u16::from(sequential.most_pairs) {
            return true;
        }
        if pairs < LEAST_PAIRS {
            return false;
        }
        let (_, variance, least) = self.differences();
        // More than the sensors' noise makes of it is known from the pairs alone.
        let known = variance <= T::of(BY_CHANCE) * least || pairs >= SCATTERED_PAIRS;
        known && self.error(sequential) <= sequential.error
    }

    fn answer(&self) -> Pole<T> {
        if self.settings.signature == Signature::None {
            let undetermined = Some(Undetermined::NoSignature);
            return Pole { angle: self.axis, undetermined, polarity: None, error: None };
        }
        let n = T::of(f64::from(self.pairs()));
        let (along, against) = (self.along / n, self.against / n);
        let (more, undetermined, error) = match self.settings.rule {
            PolarityRule::TwoVectors => {
                let margin = (along - against).abs();
                let needed = self.settings.needed_margin(self.settler.noise.deviation());
                let reason = (margin < needed || !margin.is_finite())
                    .then_some(Undetermined::MarginBelowNoise { margin, needed });
                (along - against, reason, None)
            }
            PolarityRule::Sequential(sequential) => {
                let (error, allowed) = (self.error(&sequential), sequential.error);
                let reason = (error > allowed || error.is_nan())
                    .then_some(Undetermined::NotDecided { error, allowed });
                (self.sum, reason, Some(error))
            }
        };
        let towards = (more > T::zero()) == (self.settings.signature == Signature::Normal);
        let angle = if towards || undetermined.is_some() { self.axis } else { self.axis.opposite() };
        Pole { angle, undetermined, polarity: Some(Polarity { along, against }), error }
    }
}
