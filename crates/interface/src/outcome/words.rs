//! Reasons in words: their names, and with their numbers.

use core::fmt;

use super::{Fault, Rotation, Undetermined};
use crate::Real;

impl<T> Undetermined<T> {
    /// Returns the name of the reason, without its numbers.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::MarginBelowNoise { .. } => "polarity margin below noise",
            Self::NoSignature => "both poles of this motor answer alike",
            Self::NotDecided { .. } => "pole not certain enough",
            Self::OffAxis { .. } => "polarity points away from the axis",
            Self::MayHaveTurned { .. } => "the rotor may have turned since its axis was measured",
            Self::Own(own) => own.text,
        }
    }
}

impl<T> Fault<T> {
    /// Returns the name of the reason, without its numbers.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Clipped(_) | Self::LinkCurrentClipped => "current clipped by the ADC",
            Self::DcLinkClipped => "DC-link voltage clipped by the ADC",
            Self::NotANumber => "a reading is not a number",
            Self::Hidden(_) | Self::LinkCurrentHidden => "current seen by no sensor",
            Self::NoCurrent { .. } => "too little current",
            Self::TrippedEarly { .. } => "tripped too early to be timed",
            Self::CurrentPersists(_) => "current does not decay",
            Self::NoSaliency { .. } => "no saliency found",
            Self::CoarseTimer { .. } => "no saliency found: the timer's tick is too long",
            Self::NotInductive(_) => "a line that is no inductance",
            Self::DidNotFollow { .. } => "not applicable: the rotor did not follow",
            Self::RotorMoves { .. } => "the rotor moves",
            Self::RotorTurns { way: None, .. } => "the rotor turns",
            Self::RotorTurns { way: Some(Rotation::Forward), .. } => "the rotor turns forward",
            Self::RotorTurns { way: Some(Rotation::Backward), .. } => "the rotor turns backward",
            Self::TerminalClipped => "terminal voltage clipped by the ADC",
            Self::TerminalHidden => "terminal voltage seen by no divider",
            Self::NoVoltage => "too little voltage across a line",
            Self::TerminalsSwing => "the terminals do not come to rest",
            Self::SensorsDisagree { .. } => "current sensors disagree",
            Self::DcLinkOutOfRange { .. } => "DC link not as on the data sheet",
            Self::InductanceOutOfRange { .. } => "inductance not as on the data sheet",
            Self::SaliencyOutOfRange { .. } => "saliency not as on the data sheet",
            Self::DirectionsDiffer { phase: Some(_), .. } => "both ways of a line differ",
            Self::DirectionsDiffer { phase: None, .. } => "currents along the axis and against it differ",
            Self::ContactResistive { .. } => "a phase has more resistance than the others",
            Self::UnexpectedReadings => "unexpected readings",
            Self::Own(own) => own.text,
        }
    }
}

impl<T: Real> fmt::Display for Undetermined<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::MarginBelowNoise { margin, needed } => {
                write!(f, "polarity margin {margin:.3} A below the {needed:.3} A that the noise demands")
            }
            Self::NoSignature => write!(f, "both poles of this motor answer alike"),
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
            Self::Own(own) => f.write_str(own.text),
        }
    }
}

impl<T: Real> fmt::Display for Fault<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Clipped(phase) => write!(f, "current of phase {} clipped by the ADC", phase.letter()),
            Self::DcLinkClipped => write!(f, "DC-link voltage clipped by the ADC"),
            Self::NotANumber => write!(f, "a reading is not a number"),
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
            Self::TerminalClipped | Self::TerminalHidden | Self::NoVoltage | Self::TerminalsSwing => {
                f.write_str(self.name())
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
            Self::Own(own) => f.write_str(own.text),
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
