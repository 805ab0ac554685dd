//! Which reasons for no answer name the part that is faulty.

use standstill_scenario::FaultMode;

/// Reasons for no answer that name a faulty current sensor.
const SENSORS: &[&str] =
    &["current sensors disagree", "current clipped by the ADC", "current seen by no sensor"];

/// Reasons for no answer that name a faulty DC link or a faulty sensor of its voltage.
const LINK: &[&str] = &["DC link not as on the data sheet", "DC-link voltage clipped by the ADC"];

/// Returns the names of those reasons for no answer that name the faulty part of a failure mode. They tell where to look for the fault.
/// Empty if no method has such a reason, so that every detection of this fault has another reason.
///
/// ```
/// use standstill_analysis::faults::reasons_that_name;
/// use standstill_scenario::FaultMode;
///
/// assert_eq!(reasons_that_name(FaultMode::PhaseOpen)[0], "too little current");
/// assert!(reasons_that_name(FaultMode::TerminalsSwapped).is_empty());
/// ```
pub const fn reasons_that_name(mode: FaultMode) -> &'static [&'static str] {
    match mode {
        FaultMode::PhaseOpen => &["too little current"],
        // An open switch ends the pulses of one way.
        FaultMode::UpperSwitchOpen | FaultMode::LowerSwitchOpen | FaultMode::LegOff => &[
            "too little current",
            "both ways of a line differ",
            "currents along the axis and against it differ",
        ],
        FaultMode::ContactResistance => &["a phase has more resistance than the others"],
        // The shorted turns lower the inductance of their phase, and their current is a loss of it.
        FaultMode::TurnsShorted => &[
            "saliency not as on the data sheet",
            "inductance not as on the data sheet",
            "a phase has more resistance than the others",
            "a line that is no inductance",
        ],
        FaultMode::SheetInductance => &["inductance not as on the data sheet"],
        FaultMode::CurrentDead
        | FaultMode::CurrentFrozen
        | FaultMode::CurrentStuck
        | FaultMode::CurrentBit
        | FaultMode::CurrentGain
        | FaultMode::CurrentOffset
        | FaultMode::CurrentSign
        | FaultMode::CurrentsSwapped
        | FaultMode::CurrentSlow => SENSORS,
        FaultMode::LinkGain
        | FaultMode::LinkStuck
        | FaultMode::LinkCapacitorAged
        | FaultMode::SupplyWeak
        | FaultMode::SupplyLimited => LINK,
        FaultMode::TerminalsSwapped
        | FaultMode::TerminalsTurned
        | FaultMode::MagnetWeak
        | FaultMode::SheetSignature
        | FaultMode::SheetResistance
        | FaultMode::DeadTimeLong
        | FaultMode::ReferenceDrift
        | FaultMode::SampleLate
        | FaultMode::ComparatorStuck
        | FaultMode::TimerOff
        | FaultMode::CommandLate
        | FaultMode::DutyLimited
        | FaultMode::SampleLost => &[],
    }
}

#[cfg(test)]
mod tests {
    use standstill_interface::{Fault, Phase};

    use super::*;

    #[test]
    fn law_each_reason_that_names_a_part_is_one_that_a_method_can_give() {
        let (zero, allowed, phase) = (0.0_f64, [0.0; 2], Phase::A);
        let given = [
            Fault::NoCurrent { peak: zero, needed: zero },
            Fault::DirectionsDiffer { phase: Some(phase), apart: zero, allowed: zero },
            Fault::DirectionsDiffer { phase: None, apart: zero, allowed: zero },
            Fault::ContactResistive { phase, found: zero, allowed: zero },
            Fault::SaliencyOutOfRange { found: zero, allowed },
            Fault::InductanceOutOfRange { phase, found: zero, allowed },
            Fault::NotInductive(phase),
            Fault::SensorsDisagree { apart: zero, allowed: zero },
            Fault::Clipped(phase),
            Fault::Hidden(phase),
            Fault::DcLinkOutOfRange { found: zero, allowed },
            Fault::DcLinkClipped,
        ]
        .map(|fault| fault.name());
        for mode in FaultMode::ALL {
            for reason in reasons_that_name(mode) {
                assert!(given.contains(reason), "{mode:?}: {reason}");
            }
        }
    }
}
