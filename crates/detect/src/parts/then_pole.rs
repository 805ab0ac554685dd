//! Common sequence of the methods that measure an axis and then test its pole.
//!
//! ```text
//!   wait ─► measure ─► measure ─► … ─► wait ─► measure ─► … ─► polarity test
//! ```

use standstill_interface::{Angle, Command, Fault, Findings, Nanos, Reading, Real, Step};

use crate::method::Sequence;
use crate::parts::instant;
use crate::parts::margin::Margin;
use crate::parts::polarity::{PolaritySettings, PolarityStep, PolarityTest};
use crate::parts::settle::Settler;

/// Next step after a command of a measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Next<T> {
    /// A wait until the current is gone; the measurement then goes on with [`Measurement::rested`].
    Wait,
    /// A further command of the measurement.
    Drive(Command<T>),
    /// The polarity test: the axis, the instant in s for which it holds, and the d-axis inductance in H.
    Test(Angle<T>, T, T),
}

/// The measurement of an axis.
pub(crate) trait Measurement<T: Real> {
    /// Returns the next command, after the last current has decayed.
    fn rested(&mut self, settler: &Settler<T>) -> Command<T>;

    /// Evaluates the readings of the last command. The settler's clock shows the end of that command.
    fn measured(
        &mut self,
        readings: &[Reading<T>],
        settler: &mut Settler<T>,
        findings: &mut Findings<T>,
    ) -> Result<Next<T>, Fault<T>>;
}

/// State of the sequence, named after the last command, whose readings come next.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant)] // As for `Step`: boxing would need an allocator.
pub(crate) enum State<T> {
    Start,
    Settling,
    Measuring,
    Testing(PolarityTest<T>),
}

/// A detector that measures an axis with the measurement `M` and then tests its pole.
#[derive(Clone, Debug)]
pub struct ThenPole<T, M> {
    pub(crate) measurement: M,
    pub(crate) state: State<T>,
    settler: Settler<T>,
    polarity: PolaritySettings<T>,
    findings: Findings<T>,
    /// Duration of the measurement so far, with its waits.
    measured: Nanos,
    /// Duration of the polarity test so far; the field after it is the instant in s for which the axis holds.
    tested: Nanos,
    instant: T,
}

impl<T: Real, M> ThenPole<T, M> {
    /// Makes a detector, ready for its first step.
    pub(crate) fn start(measurement: M, settler: Settler<T>, polarity: PolaritySettings<T>) -> Self {
        Self {
            measurement,
            state: State::Start,
            settler,
            polarity,
            findings: Findings::default(),
            measured: Nanos::ZERO,
            tested: Nanos::ZERO,
            instant: T::zero(),
        }
    }
}

impl<T: Real, M: Measurement<T>> Sequence<T> for ThenPole<T, M> {
    fn next(&mut self, readings: &[Reading<T>]) -> Result<Step<T>, Fault<T>> {
        let next = match &mut self.state {
            State::Start => Next::Wait,
            State::Settling => match self.settler.step(readings)? {
                Some(wait) => {
                    self.measured = self.measured + wait.duration();
                    return Ok(Step::Drive(wait));
                }
                None => Next::Drive(self.measurement.rested(&self.settler)),
            },
            State::Measuring => {
                self.settler.clock = self.measured;
                self.measurement.measured(readings, &mut self.settler, &mut self.findings)?
            }
            State::Testing(test) => {
                let step = test.step(readings)?;
                match &step {
                    PolarityStep::Drive(command) => self.tested = self.tested + command.duration(),
                    PolarityStep::Decided(_) => {
                        self.findings.age = Some(instant::age(self.measured + self.tested, self.instant));
                    }
                }
                return Ok(step.with(self.findings));
            }
        };
        Ok(Step::Drive(match next {
            Next::Wait => {
                self.state = State::Settling;
                let wait = self.settler.begin();
                self.measured = self.measured + wait.duration();
                wait
            }
            Next::Drive(command) => {
                self.state = State::Measuring;
                self.measured = self.measured + command.duration();
                command
            }
            Next::Test(axis, instant, d_axis_inductance) => {
                let mut test = PolarityTest::new(
                    self.polarity,
                    self.settler,
                    (axis, Nanos(self.measured.0 / 2)),
                    d_axis_inductance,
                );
                let wait = test.begin();
                (self.instant, self.tested) = (instant, wait.duration());
                self.state = State::Testing(test);
                wait
            }
        }))
    }

    fn so_far(&self) -> (&Findings<T>, Margin<T>) {
        let margin = match &self.state {
            State::Testing(test) => test.margin(),
            _ => self.settler.margin,
        };
        (&self.findings, margin)
    }
}
