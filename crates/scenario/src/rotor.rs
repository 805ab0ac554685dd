//! Whether the rotor can move, as a scenario says it.

use standstill_interface::choice;
use standstill_plant::Motor;
use standstill_sim::{Play, RotorState};

choice! {
    /// Whether the rotor can move.
    #[derive(Default)]
    pub enum Rotor {
        /// Held.
        Locked = "locked" default,
        /// Free but for its friction.
        Free = "free",
        /// Held by a brake that lets it play.
        Brake = "brake",
    }
}

impl Rotor {
    /// The state of this motor's rotor; none if its brake does not let it play. Only the motor knows how far it does.
    pub fn state(self, motor: &Motor) -> Option<RotorState> {
        match self {
            Self::Locked => Some(RotorState::Locked),
            Self::Free => Some(RotorState::Free),
            Self::Brake => (motor.rotor.backlash > 0.0).then(|| RotorState::Braked(Play::of(motor))),
        }
    }
}
