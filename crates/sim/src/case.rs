//! Input and result of one run.

use std::fmt;

use standstill_interface::{Nanos, Outcome, Real};
use standstill_inverter::{Inverter, Modes};
use standstill_plant::Motor;
use thiserror::Error;

use crate::control::Past;
use crate::{Faults, Ledger, SensorSettings, Sensors, Streams};

/// Mechanical state of the rotor: locked, free, braked with play, or driven.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RotorState {
    /// Held by a brake.
    Locked,
    /// Free, with the friction of its motor.
    Free,
    /// Held by a brake with play.
    Braked(Play),
    /// Turned from outside, as by a rolling vehicle, a sinking lift or a fan in the wind: the motor's torque has no effect on the motion,
    /// which follows [`Case::start_speed`] and [`Case::acceleration`].
    Driven,
}

/// Travel of a rotor between the stops of its brake, in rad electrical; both values are zero or more. The stops are
/// hard: a rotor that runs into one loses all of its speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Play {
    /// Largest angle backwards from the initial position.
    pub below: f64,
    /// Largest angle forwards from the initial position.
    pub above: f64,
}

impl Play {
    /// Returns the play of a motor's brake for a rotor that starts in the middle: half of the backlash on each side.
    ///
    /// ```
    /// use standstill_plant::built_in;
    /// use standstill_sim::Play;
    ///
    /// // Without a brake's play the rotor cannot move within it.
    /// let play = Play::of(&built_in("paper-5k5").ok_or("not built in")?);
    /// assert!(play.below <= 0.0 && play.above >= 0.0);
    /// # Ok::<(), &str>(())
    /// ```
    pub fn of(motor: &Motor) -> Self {
        let half = motor.rotor.backlash * f64::from(motor.pole_pairs) / 2.0;
        Self { below: half, above: half }
    }
}

/// Largest numerical error of one step. The tolerance is absolute and suits the few mWb by which a pulse's response
/// differs between the two poles; a tolerance relative to the magnet's flux, some 0.45 Wb, would hide this difference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Tolerance of the flux in Wb, from which the tolerances of the other quantities follow.
    pub flux: f64,
}

impl Default for Tolerance {
    /// Returns a flux tolerance of 1e-9 Wb: 0.1 µA at an inductance of 10 mH.
    fn default() -> Self {
        Self { flux: 1e-9 }
    }
}

/// All inputs of one run. The specimen's random parameters have fixed values. Only the noise and the jitter of the samples
/// and the noise of the comparators are generated during the run, from [`Case::streams`].
///
/// ```
/// use standstill_interface::{Command, Detector, Fault, Findings, Nanos, Outcome, Phase, Reading, Sampling, Stage, Step};
/// use standstill_inverter::{Bridge, DcLink, GateTiming, Inverter};
/// use standstill_plant::built_in;
/// use standstill_sim::{Case, NoProbe, run};
///
/// /// Pulses phase a against phase b for 100 µs and keeps the current at its end.
/// struct OnePulse(f64);
///
/// impl Detector<f64> for OnePulse {
///     fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
///         if let Some(reading) = readings.first() {
///             self.0 = reading.current[Phase::A];
///             let fault = Fault::NoCurrent { peak: self.0, needed: f64::INFINITY };
///             return Step::Done(Outcome::Failed { fault, findings: Findings::default() });
///         }
///         let pulse = Stage::line(Phase::A, Phase::B, Nanos::from_micros(100));
///         Step::Drive(Command::hold(pulse, Sampling::once(pulse.duration)))
///     }
/// }
///
/// let motor = built_in("paper-5k5").ok_or("not built in")?.linearised();
/// let inverter = Inverter {
///     bridge: Bridge::default(),
///     gates: [GateTiming::default(); 3],
///     link: DcLink::stiff(550.0),
///     carrier_period: Nanos::from_micros(100),
/// };
/// let case = Case { start_angle: 0.5, ..Case::new(&motor, inverter) };
/// let mut detector = OnePulse(0.0);
/// let run = run(&case, &mut detector, true, &mut NoProbe);
/// // A line of inductance L and resistance 2 R: u/2R (1 − exp(−2R t/L)).
/// let (line, resistance) = (motor.winding.line_inductances(0.5).0[0], 2.0 * motor.resistance);
/// let expected = 550.0 / resistance * (1.0 - (-resistance * 1e-4 / line).exp());
/// assert!((detector.0 - expected).abs() < 1e-6, "{} {expected}", detector.0);
/// // And the energies balance.
/// assert!(run.ledger.ok_or("was asked for")?.imbalance() < 1e-9);
/// # Ok::<(), &str>(())
/// ```
#[derive(Clone, Debug)]
pub struct Case<'a> {
    /// The motor.
    pub motor: &'a Motor,
    /// The inverter of this specimen, with fixed values of its gate delays and of the phase of its DC link's ripple.
    pub inverter: Inverter,
    /// The sensors of this specimen, with fixed values of their errors.
    pub sensors: Sensors,
    /// Initial electrical angle θ of the rotor in rad.
    pub start_angle: f64,
    /// Mechanical state of the rotor.
    pub rotor: RotorState,
    /// Direction of the last large flux change in earlier operation, as an electrical angle in rad from the a-axis. This
    /// direction determines the remanence of the stator's iron. None if the iron has never been magnetised. Ignored for
    /// iron without hysteresis.
    pub memory: Option<f64>,
    /// Torque in N·m that the load exerts against forward motion; a hanging load keeps pulling at standstill.
    pub load_torque: f64,
    /// Initial speed of a rotor that is free or driven, in rad/s electrical.
    pub start_speed: f64,
    /// Acceleration of a driven rotor in rad/s² electrical: its angle at time t is `start_angle + start_speed t + acceleration t²/2`.
    pub acceleration: f64,
    /// Faults of wires, switches and sensors.
    pub faults: Faults,
    /// Random numbers for the noise and the jitter of the samples and for the noise of the comparators.
    pub streams: Streams<'a>,
    /// Numerical tolerance.
    pub tolerance: Tolerance,
    /// Longest time of a detection; a command that would end later ends the run with [`RunError::TimeLimit`].
    pub time_limit: Nanos,
}

impl<'a> Case<'a> {
    /// Default time limit: several times as long as the slowest decay of a large motor.
    pub const TIME_LIMIT: Nanos = Nanos(20_000_000_000);

    /// Makes the case of a motor on an inverter with its rotor locked at θ = 0 and exact sensors.
    pub fn new(motor: &'a Motor, inverter: Inverter) -> Self {
        Self {
            motor,
            inverter,
            sensors: Sensors::nominal(SensorSettings::IDEAL),
            start_angle: 0.0,
            rotor: RotorState::Locked,
            memory: None,
            load_torque: 0.0,
            start_speed: 0.0,
            acceleration: 0.0,
            faults: Faults::default(),
            streams: Streams::new(1, 0),
            tolerance: Tolerance::default(),
            time_limit: Case::TIME_LIMIT,
        }
    }
}

/// Computational effort of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Number of evaluations of the magnetic core in steps, accepted or rejected. The evaluations for events and for setting currents
    /// to zero, a few per cent more, are not counted.
    pub derivatives: u64,
    /// Number of accepted integration steps.
    pub steps: u64,
    /// Number of segments: intervals between two instants that are known beforehand, such as samples and ends of commands.
    pub segments: u64,
    /// Number of events: changes of conduction, of motion and the like whose times had to be located within segments.
    pub events: u64,
}

/// State of a run at the instant of its error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Time since the start of the detection.
    pub time: Nanos,
    /// Conduction modes of the legs.
    pub modes: Modes,
    /// Currents of the legs in A, each as the bits of an `f32`. The numbers are shown to people only; bits, unlike `f32`, can be
    /// compared exactly ([`Eq`]).
    pub current: [u32; 3],
}

impl Place {
    /// Returns the place at a time in ns with these modes and these currents in A.
    pub(crate) fn new(time: f64, modes: Modes, current: [f64; 3]) -> Self {
        // The seven digits of single precision suffice for a message.
        #[allow(clippy::cast_possible_truncation)]
        let current = current.map(|current| (current as f32).to_bits());
        Self { time: Nanos::from_seconds(time * 1e-9), modes, current }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "at {} s", self.time.seconds())?;
        for (k, leg) in ["a", "b", "c"].into_iter().enumerate() {
            let (mode, current) = (self.modes[k].name().replace('_', " "), f32::from_bits(self.current[k]));
            write!(f, ", {leg} {mode} ")?;
            if current.is_finite() {
                write!(f, "{current:.6} A")?;
            } else {
                write!(f, "without a finite current")?;
            }
        }
        Ok(())
    }
}

/// Reason why a run ended without an outcome of the detector.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum RunError {
    /// A command without duration, with a sample after its end, or with more than a million samples.
    #[error("command without duration, with a sample after its end or with too many")]
    BadCommand,
    /// A duty that is not a number, or a duty on a drive whose carrier has no period.
    #[error("duty cycle that is not a number, or on a carrier without period")]
    BadDuty,
    /// A command with a threshold on a drive without comparators, or without a timer that captures their trips.
    #[error("command with a threshold on a drive without comparator and timer")]
    NoComparator,
    /// The detector was not done within the time limit.
    #[error("not done within {} s", .0.seconds())]
    TimeLimit(Nanos),
    /// Conduction modes changed more often than is physically possible; the run ends with an error instead of a
    /// guessed state.
    #[error("conduction modes keep changing without time passing, {0}")]
    Chatter(Place),
    /// The state became infinite or not a number.
    #[error("the simulation left the finite numbers, {0}")]
    NotFinite(Place),
    /// The state is finite, and no step from it was short enough to be accepted.
    #[error("no step of the simulation was short enough: the state changes too fast, {0}")]
    NoStep(Place),
    /// A conduction mode had ended before a step began, so that no step, however short, could locate the end.
    #[error("a conduction mode had ended before a step began: no step can be taken from there, {0}")]
    Stuck(Place),
    /// A comparator reported a current beyond the drive's trip level: all switches are off, and stay off.
    #[error("overcurrent: a comparator tripped at {:.3} A", *current_ma as f64 * 1e-3)]
    Overcurrent {
        /// Current in mA at the comparator at that instant.
        current_ma: i64,
    },
    /// The currents left the flux map of the motor; the fluxes beyond the map are unknown.
    #[error(
        "the currents left the motor's flux map at i_d = {:.3} A, i_q = {:.3} A",
        current_ma[0] as f64 * 1e-3, current_ma[1] as f64 * 1e-3
    )]
    LeftMap {
        /// Current of the magnetic core in mA along d and q at that instant, on the axes of the flux map. It contains the
        /// current that stands for the magnet's change by temperature, so it may differ from the winding's current.
        current_ma: [i64; 2],
    },
}

impl RunError {
    /// Returns the name of the error without the time and the currents at which it happened, so that errors of one kind are counted
    /// together.
    pub fn name(&self) -> String {
        match self {
            Self::Overcurrent { .. } => "overcurrent: a comparator tripped".to_owned(),
            Self::LeftMap { .. } => "the currents left the motor's flux map".to_owned(),
            Self::Chatter(place) | Self::NotFinite(place) | Self::NoStep(place) | Self::Stuck(place) => {
                self.to_string().replace(&format!(", {place}"), "")
            }
            other => other.to_string(),
        }
    }

    /// Returns the error for a current in A that tripped the drive.
    pub(crate) fn overcurrent(current: f64) -> Self {
        // What a machine carries is far below what i64 holds in mA.
        #[allow(clippy::cast_possible_truncation)]
        let current_ma = (current * 1e3).round() as i64;
        Self::Overcurrent { current_ma }
    }

    /// Returns the error for currents in A along d and q that left the flux map.
    pub(crate) fn left_map(current: [f64; 2]) -> Self {
        // Currents of a map are far below what i64 holds in mA.
        #[allow(clippy::cast_possible_truncation)]
        let current_ma = current.map(|current| (current * 1e3).round() as i64);
        Self::LeftMap { current_ma }
    }
}

/// Ending of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ended<T> {
    /// The detector finished with this outcome.
    Outcome(Outcome<T>),
    /// The run ended with this error before the detector was done.
    Error(RunError),
}

/// The result of a run; `E` is the type of its ending.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunOf<E> {
    /// Ending of the run.
    pub ended: E,
    /// Duration from the start of the run to its end.
    pub duration: Nanos,
    /// Initial electrical angle of the rotor in rad.
    pub start_angle: f64,
    /// Electrical angle of the rotor in rad at the end: the right answer of the detector.
    pub end_angle: f64,
    /// Electrical angle of the rotor in rad at the instant for which the found angle holds: the end of the run less the age in the findings.
    /// Its error is less than what the rotor's acceleration changes within a command. None if no angle was found, if the detector does
    /// not state its age, or if it states one that is longer than the run: nothing was measured before.
    pub instant_angle: Option<f64>,
    /// Whether the rotor has a magnet, and with it a north pole to be found.
    pub has_pole: bool,
    /// The resolver's reading at the end, in rad.
    pub resolver_angle: f64,
    /// Largest distance of the rotor from its initial position, in rad electrical.
    pub moved: f64,
    /// Largest magnitude in A of a phase current at the ends of steps.
    pub peak_current: f64,
    /// Energy balance of the run, if one was requested.
    pub ledger: Option<Ledger>,
    /// Computational effort.
    pub work: Work,
}

/// The result of one run of a detector whose numbers have the type `T`.
pub type Run<T> = RunOf<Ended<T>>;

/// A finished run without its detector's outcome: `ended` is the error that stopped the run, none if the detector was
/// done.
pub(crate) struct Finished {
    pub run: RunOf<Option<RunError>>,
    /// Past angles of the rotor.
    pub past: Past,
}

impl Finished {
    /// Returns the run's result with the ending `ended`.
    pub(crate) fn run<T: Real>(&self, ended: Ended<T>) -> Run<T> {
        let RunOf { duration, start_angle, end_angle, has_pole, resolver_angle, moved, .. } = self.run;
        let RunOf { peak_current, ledger, work, .. } = self.run;
        let age = match ended {
            Ended::Outcome(Outcome::Found { findings, .. } | Outcome::Axis { findings, .. }) => findings.age,
            _ => None,
        };
        // An age in single precision may be rounded upwards.
        let longest = duration.seconds() * (1.0 + 1e-6);
        let age = age.map(Real::to_double).filter(|age| (0.0..=longest).contains(age));
        let instant_angle = age.map(|age| {
            let turned = self.past.turned(duration.seconds() - age);
            turned.map_or(end_angle, |turned| start_angle + turned)
        });
        Run {
            ended,
            duration,
            start_angle,
            end_angle,
            instant_angle,
            has_pole,
            resolver_angle,
            moved,
            peak_current,
            ledger,
            work,
        }
    }
}

impl<T: Real> Run<T> {
    /// Returns the angle found in rad; none if no angle was found, or only an axis without its pole.
    pub fn found(&self) -> Option<f64> {
        match self.ended {
            Ended::Outcome(Outcome::Found { angle, .. }) => Some(angle.radians().to_double()),
            _ => None,
        }
    }
}
