//! Reasons in words: their names, and with their numbers.

use core::fmt;

use super::{Fault, Rotation, Undetermined};
use crate::Real;

impl<T> Undetermined<T> {
    /// Returns the name of the reason, without its numbers.
    pub const fn name(&self) -> &'static str {
        self.listed().1
    }

    /// Returns the code of the reason in `enum sts_reason` of the header, and its name.
    pub(crate) const fn listed(&self) -> (u32, &'static str) {
        match self {
            Self::MarginBelowNoise { .. } => (1, "polarity margin below noise"),
            Self::NoSignature => (2, "both poles of this motor answer alike"),
            Self::NotDecided { .. } => (3, "pole not certain enough"),
            Self::OffAxis { .. } => (4, "polarity points away from the axis"),
            Self::MayHaveTurned { .. } => (5, "the rotor may have turned since its axis was measured"),
            Self::Own(own) => (own.code, own.text),
        }
    }
}

impl<T> Fault<T> {
    /// Returns the name of the reason, without its numbers.
    pub const fn name(&self) -> &'static str {
        self.listed().1
    }

    /// Returns the code of the reason in `enum sts_reason` of the header, and its name.
    pub(crate) const fn listed(&self) -> (u32, &'static str) {
        match self {
            Self::Clipped(_) | Self::LinkCurrentClipped => (16, "current clipped by the ADC"),
            Self::DcLinkClipped => (17, "DC-link voltage clipped by the ADC"),
            Self::NotANumber => (18, "a reading is not a number"),
            Self::Hidden(_) | Self::LinkCurrentHidden => (19, "current seen by no sensor"),
            Self::NoCurrent { .. } => (20, "too little current"),
            Self::TrippedEarly { .. } => (27, "tripped too early to be timed"),
            Self::CurrentPersists(_) => (21, "current does not decay"),
            Self::NoSaliency { .. } => (22, "no saliency found"),
            Self::CoarseTimer { .. } => (36, "no saliency found: the timer's tick is too long"),
            Self::NotInductive(_) => (23, "a line that is no inductance"),
            Self::DidNotFollow { .. } => (24, "not applicable: the rotor did not follow"),
            Self::RotorMoves { .. } => (25, "the rotor moves"),
            Self::RotorTurns { way: None, .. } => (37, "the rotor turns"),
            Self::RotorTurns { way: Some(Rotation::Forward), .. } => (38, "the rotor turns forward"),
            Self::RotorTurns { way: Some(Rotation::Backward), .. } => (39, "the rotor turns backward"),
            Self::TerminalClipped => (28, "terminal voltage clipped by the ADC"),
            Self::TerminalHidden => (29, "terminal voltage seen by no divider"),
            Self::NoVoltage => (30, "too little voltage across a line"),
            Self::TerminalsSwing => (31, "the terminals do not come to rest"),
            Self::SensorsDisagree { .. } => (32, "current sensors disagree"),
            Self::DcLinkOutOfRange { .. } => (33, "DC link not as on the data sheet"),
            Self::InductanceOutOfRange { .. } => (34, "inductance not as on the data sheet"),
            Self::SaliencyOutOfRange { .. } => (41, "saliency not as on the data sheet"),
            Self::DirectionsDiffer { phase: Some(_), .. } => (35, "both ways of a line differ"),
            Self::DirectionsDiffer { phase: None, .. } => {
                (35, "currents along the axis and against it differ")
            }
            Self::ContactResistive { .. } => (40, "a phase has more resistance than the others"),
            Self::UnexpectedReadings => (26, "unexpected readings"),
            Self::Own(own) => (own.code, own.text),
        }
    }
}

impl<T: Real> fmt::Display for Undetermined<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::MarginBelowNoise { margin, needed } => {
                write!(f, "polarity margin {margin:.3} A below the {needed:.3} A that the noise demands")
            }
            Self::NotDecided { error, allowed } => {
                let [error, allowed] = [*error, *allowed].map(T::to_double);
                write!(f, "wrong pole with a probability of {error:.1e} where {allowed:.1e} is allowed")
            }
            Self::OffAxis { angle, allowed } => {
                let [angle, allowed] = [*angle, *allowed].map(T::to_degrees);
                write!(f, "polarity points {angle:.0}° away from the axis where {allowed:.0}° are allowed")
            }
            Self::MayHaveTurned { angle, allowed } => {
                let [angle, allowed] = [*angle, *allowed].map(T::to_degrees);
                write!(
                    f,
                    "the rotor may have turned by {angle:.0}° since its axis was measured where {allowed:.0}° are allowed"
                )
            }
            Self::NoSignature | Self::Own(_) => f.write_str(self.name()),
        }
    }
}

impl<T: Real> fmt::Display for Fault<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Clipped(phase) => write!(f, "current of phase {} clipped by the ADC", phase.letter()),
            Self::Hidden(phase) => write!(f, "current of phase {} seen by no sensor", phase.letter()),
            Self::NoCurrent { peak, needed } => {
                write!(f, "too little current: {peak:.4} A where at least {needed:.4} A are needed")
            }
            Self::TrippedEarly { time, needed } => {
                let [time, needed] = [*time, *needed].map(|time| time.to_double() * 1e6);
                write!(
                    f,
                    "tripped too early to be timed: after {time:.3} us where more than {needed:.3} us are needed"
                )
            }
            Self::CurrentPersists(current) => write!(f, "current of {current:.3} A does not decay"),
            Self::NoSaliency { ratio, needed } => {
                write!(f, "no saliency found: |L_B|/L_A = {ratio:.4} where at least {needed:.4} is needed")
            }
            Self::CoarseTimer { ratio, needed, tick, allowed } => {
                let [tick, allowed] = [*tick, *allowed].map(|time| time.to_double() * 1e6);
                write!(
                    f,
                    "no saliency found: the timer's tick of {tick:.3} us shows none below |L_B|/L_A = {needed:.4}, and the data sheet has {ratio:.4}; a tick of at most {allowed:.3} us shows it, or a higher threshold"
                )
            }
            Self::NotInductive(phase) => {
                write!(f, "the line from phase {} did not answer as an inductance", phase.letter())
            }
            Self::DidNotFollow { swept, needed } => {
                write!(
                    f,
                    "not applicable: the rotor did not follow, the magnet swept {swept:.3} Wb where {needed:.3} Wb are needed"
                )
            }
            Self::RotorMoves { angle, allowed } => {
                let [angle, allowed] = [*angle, *allowed].map(T::to_degrees);
                write!(
                    f,
                    "the rotor moves: pulses see axes {angle:.1}° apart where {allowed:.1}° are allowed"
                )
            }
            Self::RotorTurns { speed, allowed, .. } => {
                let [speed, allowed] = [*speed, *allowed].map(T::to_double);
                write!(
                    f,
                    "{}: readings are those of {speed:.3} rad/s (electrical) where at rest they leave room for {allowed:.3}",
                    self.name()
                )
            }
            Self::LinkCurrentClipped => write!(f, "current of the DC link clipped by the ADC"),
            Self::LinkCurrentHidden => {
                write!(f, "current of the DC link read before its amplifier has settled")
            }
            Self::SensorsDisagree { apart, allowed } => {
                write!(f, "current sensors disagree by {apart:.3} A where {allowed:.3} A are allowed")
            }
            Self::DcLinkOutOfRange { found, allowed: [low, high] } => {
                write!(f, "DC link of {found:.1} V where {low:.1} to {high:.1} V are allowed")
            }
            Self::InductanceOutOfRange { phase, found, allowed } => {
                let [found, low, high] = [*found, allowed[0], allowed[1]].map(|of| of.to_double() * 1e3);
                write!(
                    f,
                    "the line from phase {} has {found:.4} mH where {low:.4} to {high:.4} mH are allowed",
                    phase.letter()
                )
            }
            Self::SaliencyOutOfRange { found, allowed: [low, high] } => {
                write!(f, "saliency |L_B|/L_A of {found:.4} where {low:.4} to {high:.4} are allowed")
            }
            Self::DirectionsDiffer { phase, apart, allowed } => {
                let [apart, allowed] = [*apart, *allowed].map(|of| of.to_double() * 100.0);
                match phase {
                    Some(phase) => write!(f, "both ways of the line from phase {} differ", phase.letter())?,
                    None => write!(f, "currents per volt along the axis and against it differ")?,
                }
                write!(f, " by {apart:.1} % where {allowed:.1} % are allowed")
            }
            Self::ContactResistive { phase, found, allowed } => {
                let [found, allowed] = [*found, *allowed].map(T::to_double);
                write!(
                    f,
                    "phase {} has {found:.3} Ω more than the others where {allowed:.3} Ω are allowed",
                    phase.letter()
                )
            }
            Self::UnexpectedReadings => write!(f, "the drive returned other samples than were asked for"),
            Self::DcLinkClipped
            | Self::NotANumber
            | Self::TerminalClipped
            | Self::TerminalHidden
            | Self::NoVoltage
            | Self::TerminalsSwing
            | Self::Own(_) => f.write_str(self.name()),
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::string::ToString as _;

    use super::*;
    use crate::Phase;

    #[test]
    fn law_a_reason_with_its_numbers_begins_as_its_name_does() {
        let faults: [Fault<f64>; 9] = [
            Fault::NotANumber,
            Fault::DcLinkClipped,
            Fault::NoVoltage,
            Fault::TerminalsSwing,
            Fault::NoCurrent { peak: 0.1, needed: 0.5 },
            Fault::NoSaliency { ratio: 0.01, needed: 0.02 },
            Fault::RotorMoves { angle: 0.1, allowed: 0.05 },
            Fault::RotorTurns { way: Some(Rotation::Backward), speed: 3.0, allowed: 1.0 },
            Fault::SensorsDisagree { apart: 0.3, allowed: 0.1 },
        ];
        for fault in faults {
            assert!(fault.to_string().starts_with(fault.name()), "{}: {fault}", fault.name());
            assert!(fault.name().contains(' '), "a name in words: {fault:?}");
        }
        for phase in Phase::ALL {
            let said = Fault::<f64>::Clipped(phase).to_string();
            assert!(said.contains(phase.letter()) && said.ends_with("clipped by the ADC"), "{said}");
        }
        let open = Undetermined::MarginBelowNoise { margin: 0.1, needed: 0.3 };
        assert_eq!(open.to_string(), "polarity margin 0.100 A below the 0.300 A that the noise demands");
        assert_eq!(open.name(), "polarity margin below noise");
    }
}
