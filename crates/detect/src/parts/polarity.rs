//! Polarity test, which finds the north end of the axis: voltage vectors along the axis and against it, each from rest.
//!
//! A voltage vector along the magnet drives the core further into saturation, one against it reduces saturation. So the
//! first raises the larger current, or in motors with iron bridges the smaller one: this is the motor's [`Signature`].
//! Both currents are near the rated one, where the difference is largest. They lie on the d-axis and make no torque.
//!
//! ```text
//!   two vectors (the paper):  wait ─► along ─► wait ─► against ─► wait ─► the larger current
//!   sequential:               wait ─► along ─► wait ─► against ─► wait ─► against ─► wait ─► along ─► … until certain
//! ```
//! The order is ABBA, so that linear drift does not look like a pole.

mod checks;
mod pointer;
mod sequential;
mod settings;
#[cfg(test)]
mod tests;
mod turned;

use standstill_interface::{
    Abc, Angle, Command, Fault, Findings, Nanos, Outcome, Phase, Polarity, PoleEvidence, Reading, Real, Step,
    Undetermined,
};

use crate::nameplate::Place;
use crate::parts::margin::Margin;
use crate::parts::settle::{Settler, all_seen, link, link_current};
use checks::Driven;
pub(crate) use pointer::Pointer;
pub use sequential::SequentialSettings;
pub use settings::{PolarityRule, PolaritySettings, Signature};

/// Least number of pairs before the sequential test may stop.
const LEAST_PAIRS: u16 = 2;
/// Least number of pairs if they scatter by more than [`BY_CHANCE`] times the variance of the sensors' noise.
const SCATTERED_PAIRS: u16 = 4;
/// Ratio of the variance of pairs to that of the noise which few pairs exceed by chance.
const BY_CHANCE: f64 = 4.0;

/// Result of the polarity test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pole<T> {
    /// The north pole's electrical angle or, if the pole is undetermined, that of one end of the axis.
    pub angle: Angle<T>,
    /// Why the pole is undetermined; none: it is determined.
    pub undetermined: Option<Undetermined<T>>,
    /// The two currents compared: means over all pairs.
    pub polarity: Option<Polarity<T>>,
    /// Probability that the pole is wrong, if the rule estimates it.
    pub error: Option<T>,
    /// Evidence for the pole, referred to `angle`; none without a signature.
    pub evidence: Option<PoleEvidence<T>>,
}

impl<T: Real> Pole<T> {
    /// Returns the end of `axis` that the evidence for north favours, if it suffices; otherwise a pole that is
    /// undetermined for this reason.
    fn decided(axis: Angle<T>, evidence: Option<PoleEvidence<T>>, reason: Undetermined<T>) -> Self {
        let named = evidence.is_some_and(|evidence| evidence.is_enough());
        let towards = evidence.is_some_and(|evidence| evidence.deviations > T::zero());
        let turned = named && !towards;
        Self {
            angle: if turned { axis.opposite() } else { axis },
            undetermined: (!named).then(|| evidence.map_or(Undetermined::NoSignature, |_| reason)),
            polarity: None,
            error: None,
            evidence: if turned { evidence.map(PoleEvidence::opposite) } else { evidence },
        }
    }

    /// Makes the pole undetermined for this reason, whatever its evidence.
    fn open(&mut self, reason: Undetermined<T>) {
        self.undetermined = Some(reason);
        self.evidence = self.evidence.map(|evidence| PoleEvidence { needed: T::infinity(), ..evidence });
    }

    /// Returns the outcome of a detection with this pole and the earlier findings.
    pub(crate) fn outcome(self, findings: Findings<T>) -> Outcome<T> {
        if !self.angle.radians().is_finite() || self.error.is_some_and(T::is_nan) {
            return Outcome::Failed { fault: Fault::NotANumber, findings };
        }
        let findings = Findings {
            polarity: self.polarity.or(findings.polarity),
            pole_error: self.error,
            pole_evidence: self.evidence,
            ..findings
        };
        match self.undetermined {
            None => Outcome::Found { angle: self.angle, findings },
            Some(reason) => Outcome::Axis { angle: self.angle, reason, findings },
        }
    }
}

/// Next step of the test.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use = "a step that is not carried out is lost"]
#[allow(clippy::large_enum_variant)] // As for `Step`: boxing would need an allocator.
pub(crate) enum PolarityStep<T> {
    Drive(Command<T>),
    Decided(Pole<T>),
}

impl<T: Real> PolarityStep<T> {
    /// Converts to a step of the whole detector, with its earlier findings.
    pub fn with(self, findings: Findings<T>) -> Step<T> {
        match self {
            Self::Drive(command) => Step::Drive(command),
            Self::Decided(pole) => Step::Done(pole.outcome(findings)),
        }
    }
}

/// State of the sequence, named after the last command.
#[derive(Clone, Copy, Debug, PartialEq)]
enum State {
    Settling { last: bool },
    Pushing,
    Shorted,
}

/// The polarity test of a known axis.
#[derive(Clone, Debug)]
pub(crate) struct PolarityTest<T> {
    settings: PolaritySettings<T>,
    settler: Settler<T>,
    state: State,
    axis: Angle<T>,
    amplitude: T,
    /// Vectors given so far.
    vectors: u16,
    /// Responses in A of the present pair, the north candidate first; the field after it has them in A/V.
    current: [T; 2],
    response: [T; 2],
    /// Sums over the pairs: the currents in A along the axis and against it, the relative differences of the responses,
    /// and the squares of these differences.
    along: T,
    against: T,
    sum: T,
    squares: T,
    /// Responses across the axis in A/V of the present pair, in the axis's frame; their sum is the part that does not
    /// reverse with the voltage. `across`, the next field: that sum over the pairs, relative to the mean response along
    /// the axis. Zero if the sensors do not show the whole current vector.
    sideways: [T; 2],
    across: T,
    /// Current that the magnet drove through the shorted terminals; none before they were shorted.
    driven: Option<Driven<T>>,
    /// Time since the middle of the axis' measurement.
    since: Nanos,
}

impl<T: Real> PolarityTest<T> {
    /// Makes a test of an axis; `since`: time since the middle of the axis's measurement; `settler`: knows the noise
    /// from the method's waits.
    pub fn new(
        settings: PolaritySettings<T>,
        settler: Settler<T>,
        (axis, since): (Angle<T>, Nanos),
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
            sideways: [zero; 2],
            across: zero,
            driven: None,
            since,
        }
    }

    /// Returns the first step. Without a signature there is nothing to test, but the last current must still decay.
    pub fn begin(&mut self) -> Command<T> {
        self.wait(self.settings.signature == Signature::None)
    }

    /// Returns the margin of this test and of the measurements before it.
    pub fn margin(&self) -> Margin<T> {
        self.settler.margin
    }

    fn wait(&mut self, last: bool) -> Command<T> {
        self.state = State::Settling { last };
        self.settler.begin()
    }

    /// Returns whether the next vector is against the axis, in the order ABBA.
    fn against(&self) -> bool {
        matches!(self.vectors % 4, 1 | 2)
    }

    fn direction(&self) -> Angle<T> {
        if self.against() { self.axis.opposite() } else { self.axis }
    }

    pub fn step(&mut self, readings: &[Reading<T>]) -> Result<PolarityStep<T>, Fault<T>> {
        let next = self.stepped(readings)?;
        if let PolarityStep::Drive(command) = &next {
            self.since = self.since + command.duration();
        }
        Ok(next)
    }

    fn stepped(&mut self, readings: &[Reading<T>]) -> Result<PolarityStep<T>, Fault<T>> {
        Ok(match self.state {
            State::Settling { last } => match self.settler.step(readings)? {
                Some(wait) => PolarityStep::Drive(wait),
                None if last && self.driven.is_none() && self.settings.looks() => {
                    self.state = State::Shorted;
                    PolarityStep::Drive(self.settings.short())
                }
                None if last => {
                    let mut pole = self.answer();
                    self.check_standing(&mut pole)?;
                    self.check_directions()?;
                    PolarityStep::Decided(pole)
                }
                None => {
                    self.state = State::Pushing;
                    let (direction, amplitude) = (self.direction(), self.amplitude);
                    PolarityStep::Drive(self.settings.command(direction, amplitude, self.settler.dc_link))
                }
            },
            State::Shorted => {
                let [last] = readings else { return Err(Fault::UnexpectedReadings) };
                self.driven = Some(Driven::of(last)?);
                PolarityStep::Drive(self.wait(true))
            }
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
        let direction = self.direction();
        let slot = usize::from(self.against());
        let sequential = matches!(self.settings.rule, PolarityRule::Sequential(_));
        if readings.len() != self.settings.readings() {
            return Err(Fault::UnexpectedReadings);
        }
        let residual = self.settler.residual;
        let mut sideways = T::zero();
        let current = if self.settings.place == Place::InLink {
            let shown = |reading| Ok(link_current(reading)? - residual[Phase::A]);
            PolaritySettings::returned_current([shown(&readings[0])?, shown(last)?], direction)
        } else {
            let seen = all_seen(last)?;
            let current = PolaritySettings::direct_current(seen, direction);
            let raised = Abc(core::array::from_fn(|k| seen.0[k] - residual.0[k]));
            sideways = raised.clarke().park(self.axis).q;
            // The reading without current is the sensors' offset. The rule of two vectors subtracts its mean over all waits, in `answer`.
            if sequential { current - PolaritySettings::direct_current(residual, direction) } else { current }
        };
        let needed = self.settings.least_current;
        self.settler.margin.at_least(current, needed);
        if current < needed || !current.is_finite() {
            return Err(Fault::NoCurrent { peak: current, needed });
        }
        let mut volts = T::zero();
        for reading in readings {
            volts = volts + link(reading)?;
        }
        self.current[slot] = current;
        let count = T::of(readings.len() as f64);
        self.response[slot] = current * count / volts;
        self.sideways[slot] = sideways * count / volts;
        self.vectors += 1;
        if self.vectors.is_multiple_of(2) {
            let [along, against] = self.response;
            let difference = T::of(2.0) * (along - against) / (along + against);
            let [first, second] = self.sideways;
            self.across = self.across + T::of(2.0) * (first + second) / (along + against);
            self.sum = self.sum + difference;
            self.squares = self.squares + difference * difference;
            self.along = self.along + self.current[0];
            self.against = self.against + self.current[1];
        }
        Ok(())
    }

    /// Returns the mean of the relative differences, the variance of one of them, and the part of that variance by the
    /// sensors' noise.
    fn differences(&self) -> (T, T, T) {
        let n = T::of(f64::from(self.pairs()));
        let mean = self.sum / n;
        // Noise of two i_d and of their two offsets.
        let noise = self.settler.noise.deviation() * n * T::of(2.0) / (self.along + self.against);
        let least = T::of(4.0) * self.settings.by_reading() * noise * noise;
        let scatter = (self.squares - self.sum * mean) / (n - T::one());
        // A few pairs may agree by chance.
        (mean, if scatter > least { scatter } else { least }, least)
    }

    /// Returns the mean difference and its variance, from scatter and from errors that repetition does not reveal.
    fn mean(&self, sequential: &SequentialSettings<T>) -> (T, T) {
        let (mean, variance, _) = self.differences();
        let n = T::of(f64::from(self.pairs()));
        let floor = sequential.floor.max(self.settings.uneven);
        (mean, variance / n + floor * floor)
    }

    /// Returns whether no further pairs are needed or allowed.
    fn is_enough(&self, sequential: &SequentialSettings<T>) -> bool {
        let pairs = self.pairs();
        if pairs >= u16::from(sequential.most_pairs) {
            return true;
        }
        if pairs < LEAST_PAIRS {
            return false;
        }
        let (_, variance, least) = self.differences();
        // A scatter beyond the sensors' noise is known from the pairs alone, so it takes more of them.
        let known = variance <= T::of(BY_CHANCE) * least || pairs >= SCATTERED_PAIRS;
        let (mean, variance) = self.mean(sequential);
        known && sequential.evidence(mean, variance).is_enough()
    }

    fn answer(&self) -> Pole<T> {
        let signature = self.settings.signature;
        if signature == Signature::None {
            return Pole::decided(self.axis, None, Undetermined::NoSignature);
        }
        let n = T::of(f64::from(self.pairs()));
        let (mut along, mut against) = (self.along / n, self.against / n);
        let (draws_more, reason, error) = match self.settings.rule {
            PolarityRule::TwoVectors => {
                let mut noise = self.settler.noise.deviation();
                if self.settings.place != Place::InLink {
                    // An offset adds to one current and takes from the other. Its mean over the waits has noise, too.
                    let (offset, waits) = self.settler.offset();
                    let offset = PolaritySettings::direct_current(offset, self.axis);
                    (along, against) = (along - offset, against + offset);
                    noise = noise * (T::one() + T::of(2.0) / waits).sqrt();
                }
                let (margin, needed) = ((along - against).abs(), self.settings.needed_margin(noise));
                let evidence = self.settings.two_vectors(along - against, noise);
                (evidence, Undetermined::MarginBelowNoise { margin, needed }, None)
            }
            PolarityRule::Sequential(sequential) => {
                let (mean, variance) = self.mean(&sequential);
                let (error, allowed) = (sequential.error_of(mean, variance), sequential.error);
                let mut evidence = sequential.evidence(mean, variance);
                let mut reason = Undetermined::NotDecided { error, allowed };
                if let Some(off_axis) = self.off_axis(evidence) {
                    (evidence.needed, reason) = (T::infinity(), off_axis);
                }
                (evidence, reason, Some(error))
            }
        };
        let mut pole = Pole::decided(self.axis, signature.towards_north(draws_more), reason);
        if let Some(turned) = self.turned().filter(|_| pole.undetermined.is_none()) {
            pole.open(turned);
        }
        Pole { polarity: Some(Polarity { along, against }), error, ..pole }
    }
}
