//! The outcome of a detection.

mod words;

use crate::{Abc, Angle, Phase, Real};

/// The two currents that the polarity decision compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Polarity<T> {
    /// i_d in A with the voltage vector along the candidate angle.
    pub along: T,
    /// i_d in A with the voltage vector against it, counted positive in its own direction.
    pub against: T,
}

impl<T: Real> Polarity<T> {
    /// Returns the absolute difference of the two currents in A.
    ///
    /// ```
    /// use standstill_interface::Polarity;
    ///
    /// // A saturating core draws more current towards the magnet's north pole.
    /// let polarity = Polarity { along: 8.5_f64, against: 8.0 };
    /// assert_eq!(polarity.margin(), 0.5);
    /// ```
    pub fn margin(&self) -> T {
        (self.along - self.against).abs()
    }
}

/// Test statistic for the pole: the distance of the readings from indifference, in standard deviations of their error.
///
/// The sign refers to the angle of the accompanying outcome. Positive evidence favours the north pole at that angle,
/// negative evidence the other end of the axis. A found angle is the end that the evidence favours, so its evidence is
/// positive. If the pole is undetermined, the outcome's angle is either end, and the sign tells which one the readings
/// favour. [`Outcome::evidence_for`] refers the evidence to a given pole, which makes it comparable between found and
/// undetermined starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoleEvidence<T> {
    /// Signed. Infinite where nothing is known to be wrong with the readings.
    pub deviations: T,
    /// Threshold of the method for naming a pole. Infinite if no evidence would suffice, because it contradicts the
    /// axis.
    pub needed: T,
}

impl<T: Real> PoleEvidence<T> {
    /// Returns whether it names a pole: exactly then a start is found.
    ///
    /// ```
    /// use standstill_interface::PoleEvidence;
    ///
    /// let evidence = PoleEvidence { deviations: -6.5_f64, needed: 5.1 };
    /// assert!(evidence.is_enough());
    /// assert_eq!(evidence.opposite().deviations, 6.5);
    /// ```
    pub fn is_enough(&self) -> bool {
        // Where no amount would do, an infinite one does not either.
        self.deviations.abs() >= self.needed && self.needed < T::infinity()
    }

    /// Returns the evidence referred to the other end of the axis.
    #[must_use]
    pub fn opposite(self) -> Self {
        Self { deviations: -self.deviations, ..self }
    }
}

/// Quantities that a detector measured on the way; a method fills in those that it measures.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Findings<T> {
    /// Line inductances L_AB, L_BC, L_CA in H.
    pub line_inductance: Option<Abc<T>>,
    /// Resistances in Ω of the three lines: two phases in series, plus the devices.
    pub line_resistance: Option<Abc<T>>,
    /// L_A in H, the mean self-inductance of a phase's air-gap flux.
    pub mean_inductance: Option<T>,
    /// L_B in H, signed as the motor's saliency.
    pub saliency: Option<T>,
    /// The polarity test's two currents.
    pub polarity: Option<Polarity<T>>,
    /// Standard deviation in rad that the noise of the readings gives the angle, as the method judges it.
    pub angle_deviation: Option<T>,
    /// Probability that the pole is the wrong one, as the method judges it.
    pub pole_error: Option<T>,
    /// Evidence for the pole. None before an axis is found; if the motor's poles draw equal currents by its configured
    /// signature, so that no reading favours one; and for methods that measure no pole, such as a method that turns the
    /// rotor to a known angle.
    pub pole_evidence: Option<PoleEvidence<T>>,
    /// Gains of the phases' current sensors relative to their mean, where a method compares them.
    pub sensor_gain: Option<Abc<T>>,
    /// Half the width in rad of the sector whose middle is the angle, for methods that answer in sectors.
    pub half_sector: Option<T>,
    /// Smallest margin of the checks that can end a detection with a fault: the factor by which the checked quantity
    /// kept its limit, minus 1. Negative if a check fired. None for a detector that does not report it, or that made no
    /// check with a limit; a clipped current, for example, has no limit.
    pub fault_margin: Option<T>,
    /// Time in s from the instant for which the angle holds to the end of the detection: the mean age of the readings, weighted as in the
    /// angle. If the rotor turns at the speed ω, its angle at the end of the detection is ahead of the found angle by ω times this time.
    /// None before an angle is found, and for a detector that does not report it.
    pub age: Option<T>,
}

/// A reason that a detector defines itself, if none of the others applies.
///
/// ```
/// use standstill_interface::{Fault, Own};
///
/// const NO_HALL: Own = Own { code: 3, text: "hall sensors disagree" };
/// assert_eq!(Fault::<f32>::Own(NO_HALL).to_string(), "hall sensors disagree");
/// # use std::string::ToString as _;
/// # extern crate std;
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Own {
    /// The detector's number for it.
    pub code: u32,
    /// The reason in words, for people. Static, so that a detector without allocator has it too; who makes detectors from
    /// elsewhere looks the text up once.
    pub text: &'static str,
}

/// Reason why the pole is undetermined although the axis is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Undetermined<T> {
    /// The two currents differ by less than the noise of the readings, or the least margin set, allows to trust.
    MarginBelowNoise {
        /// Measured current in A.
        margin: T,
        /// Required current in A.
        needed: T,
    },
    /// Both poles of this motor draw equal currents according to its configured signature, so there is nothing to
    /// compare.
    NoSignature,
    /// The readings leave too large a probability that the pole is the wrong one.
    NotDecided {
        /// Probability of a wrong pole.
        error: T,
        /// The limit.
        allowed: T,
    },
    /// A vector that should lie along the axis does not: the motor or a sensor is not as configured.
    OffAxis {
        /// Angle in rad between the two.
        angle: T,
        /// The limit.
        allowed: T,
    },
    /// The rotor may have turned so far since its axis was measured that one pole is taken for the other: by the speed that readings show, or
    /// by a speed that they would not show.
    MayHaveTurned {
        /// Angle in rad since then.
        angle: T,
        /// The limit.
        allowed: T,
    },
    /// A reason of the detector's own.
    Own(Own),
}

/// Direction in which a rotor turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rotation {
    /// Towards larger electrical angles.
    Forward,
    /// Towards smaller ones.
    Backward,
}

/// Reason why there is no angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault<T> {
    /// A current reached the end of the ADC's range.
    Clipped(Phase),
    /// The DC-link voltage reached the end of its converter's range.
    DcLinkClipped,
    /// A reading was not a number.
    NotANumber,
    /// A current that the method needs was seen by no sensor.
    Hidden(Phase),
    /// A pulse raised less current than can be measured: a broken wire, a missing DC link, too short a pulse.
    NoCurrent {
        /// Measured current in A.
        peak: T,
        /// Required current in A.
        needed: T,
    },
    /// A comparator tripped before its time is a measure of the current: during its blanking, or less than a tick and a half after it.
    TrippedEarly {
        /// Measured time in s.
        time: T,
        /// Required time in s.
        needed: T,
    },
    /// The current did not decay in the time allowed.
    CurrentPersists(T),
    /// No saliency was found: |L_B| / L_A is not larger than noise, the sensors' gains and the drive may cause on a
    /// motor without saliency, or smaller than the method is set to require. Such a motor has no axis that the method
    /// could find.
    NoSaliency {
        /// |L_B| / L_A as measured.
        ratio: T,
        /// The least value that would do.
        needed: T,
    },
    /// No saliency was found, because the timer's tick hides the saliency stated in the motor's data sheet.
    CoarseTimer {
        /// |L_B| / L_A of the data sheet.
        ratio: T,
        /// The least value that this timer shows.
        needed: T,
        /// Tick of the timer in s.
        tick: T,
        /// The longest tick in s that would do.
        allowed: T,
    },
    /// The samples have no inductance as their solution: equation (10) gave a value that is not positive.
    NotInductive(Phase),
    /// The method does not apply: the rotor did not follow the current that should have turned it, because it is
    /// locked or its load is too large.
    DidNotFollow {
        /// Flux in Wb that the magnet swept across the winding.
        swept: T,
        /// The least value that would do.
        needed: T,
    },
    /// The rotor does not stand still: later pulses see another angle than earlier ones.
    RotorMoves {
        /// Angle in rad between the axes that they see.
        angle: T,
        /// The limit.
        allowed: T,
    },
    /// The rotor turns: its magnet induces more than one at rest may seem to, or its axis is found further on than before.
    RotorTurns {
        /// Magnitude of the electrical speed in rad/s, computed from the voltage that the magnet induces or from two
        /// axes.
        speed: T,
        /// The speed in rad/s that noise and errors of the readings may look like.
        allowed: T,
        /// Direction of rotation; none if it depends on the pole and the pole is undetermined.
        way: Option<Rotation>,
    },
    /// The current through the shunt in the DC link reached the end of its converter's range: a unidirectional
    /// amplifier clips the current that diodes return to the link.
    LinkCurrentClipped,
    /// The shunt in the DC link saw no current that the method needs, or its amplifier had not settled.
    LinkCurrentHidden,
    /// A terminal's voltage reached the end of its converter's range.
    TerminalClipped,
    /// A terminal's voltage that the method needs was seen by no divider.
    TerminalHidden,
    /// A pulse puts too little voltage across a line.
    NoVoltage,
    /// The terminals do not come to rest after a pulse.
    TerminalsSwing,
    /// Sensors that read the same current disagree, one shows a current where none can flow, or equal pulses of a train
    /// show different currents: a sensor or a wire is faulty.
    SensorsDisagree {
        /// Difference in A.
        apart: T,
        /// The limit.
        allowed: T,
    },
    /// The DC link's voltage is not that of the drive's data sheet, or one that currents of equal pulses do not follow.
    DcLinkOutOfRange {
        /// Measured voltage in V.
        found: T,
        /// Lowest and highest voltage allowed.
        allowed: [T; 2],
    },
    /// A line's inductance is not one of the motor's data sheet: a wire, a contact or a sensor is faulty, or it is another motor.
    InductanceOutOfRange {
        /// The line's first phase.
        phase: Phase,
        /// Measured inductance in H.
        found: T,
        /// Smallest and largest inductance allowed.
        allowed: [T; 2],
    },
    /// The saliency is not that of the motor's data sheet: shorted turns have one of their own, or it is another motor.
    SaliencyOutOfRange {
        /// Measured |L_B| / L_A.
        found: T,
        /// Smallest and largest ratio allowed.
        allowed: [T; 2],
    },
    /// Pulses forward and backward through a line, or vectors along the axis and against it, differ by more than the poles can make them.
    DirectionsDiffer {
        /// The line's first phase; none: vectors.
        phase: Option<Phase>,
        /// Difference of the inductances, of vectors of the currents, relative to their mean.
        apart: T,
        /// The limit.
        allowed: T,
    },
    /// A phase loses more than the others, as by a contact that is not tight.
    ContactResistive {
        /// The phase.
        phase: Phase,
        /// Excess resistance of the phase over the other phases, in Ω.
        found: T,
        /// The limit.
        allowed: T,
    },
    /// The drive returned other samples than were asked for.
    UnexpectedReadings,
    /// A reason of the detector's own.
    Own(Own),
}

/// The outcome of a detection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome<T> {
    /// The rotor's angle, its north pole.
    Found {
        /// The electrical angle of the north pole.
        angle: Angle<T>,
        /// Values measured on the way.
        findings: Findings<T>,
    },
    /// The d-axis is known, which of its ends is north is not.
    Axis {
        /// One of the two candidates; the other one is opposite.
        angle: Angle<T>,
        /// Why.
        reason: Undetermined<T>,
        /// Values measured on the way.
        findings: Findings<T>,
    },
    /// No angle was found.
    Failed {
        /// Why.
        fault: Fault<T>,
        /// Values measured before the fault.
        findings: Findings<T>,
    },
}

impl<T: Copy> Outcome<T> {
    /// Returns the values measured on the way.
    ///
    /// ```
    /// use standstill_interface::{Angle, Findings, Outcome};
    ///
    /// let findings = Findings { mean_inductance: Some(9.2e-3), ..Findings::default() };
    /// let found = Outcome::Found { angle: Angle::from_degrees(40.0_f64), findings };
    /// assert_eq!(found.findings().mean_inductance, Some(9.2e-3));
    /// ```
    pub fn findings(&self) -> &Findings<T> {
        match self {
            Self::Found { findings, .. } | Self::Axis { findings, .. } | Self::Failed { findings, .. } => {
                findings
            }
        }
    }
}

impl<T> Outcome<T> {
    /// Returns the outcome with this [`Findings::fault_margin`].
    #[must_use]
    pub fn with_fault_margin(mut self, margin: Option<T>) -> Self {
        let (Self::Found { findings, .. } | Self::Axis { findings, .. } | Self::Failed { findings, .. }) =
            &mut self;
        findings.fault_margin = margin;
        self
    }
}

impl<T: Real> Outcome<T> {
    /// Returns the evidence in standard deviations that the north pole is at `north`, with an error below 90°, and not
    /// opposite. A simulation that knows the pole sees from the sign whether the readings favour it, and from the
    /// distance to the evidence needed how far a start is from a wrong pole.
    ///
    /// None if there is no evidence, see [`Findings::pole_evidence`].
    ///
    /// ```
    /// use standstill_interface::{Angle, Findings, Outcome, PoleEvidence};
    ///
    /// let evidence = PoleEvidence { deviations: 6.5, needed: 5.1 };
    /// let findings = Findings { pole_evidence: Some(evidence), ..Findings::default() };
    /// let found = Outcome::Found { angle: Angle::from_degrees(40.0), findings };
    /// assert_eq!(found.evidence_for(Angle::from_degrees(41.0)), Some(6.5));
    /// assert_eq!(found.evidence_for(Angle::from_degrees(221.0)), Some(-6.5));
    /// ```
    pub fn evidence_for(&self, north: Angle<T>) -> Option<T> {
        let (Self::Found { angle, findings } | Self::Axis { angle, findings, .. }) = self else {
            return None;
        };
        let evidence = findings.pole_evidence?;
        let same = angle.difference(north).abs() <= T::FRAC_PI_2();
        Some(if same { evidence } else { evidence.opposite() }.deviations)
    }
}
