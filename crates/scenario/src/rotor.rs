//! Motion of the rotor and remanence of the iron, as a scenario names them.

use standstill_interface::choice;
use standstill_plant::Motor;
use standstill_sim::{Play, RotorState};

choice! {
    /// Motion of the rotor.
    #[derive(Default)]
    pub enum Rotor {
        /// Held.
        Locked = "locked" default,
        /// Free but for its friction.
        Free = "free",
        /// Held by a brake that lets it play.
        Brake = "brake",
        /// Turned at `rotor.speed`, with `rotor.acceleration`, by what the motor cannot slow: a vehicle that rolls, a lift that sinks.
        Driven = "driven",
    }
}

choice! {
    /// Memory of the stator's iron at the start, where the motor's data sheet has a hysteresis.
    #[derive(Default)]
    pub enum Memory {
        /// Nothing: it was demagnetised at this angle.
        Virgin = "virgin" default,
        /// Former operation, after which the flux last changed by much in some direction: each trial draws its own, uniformly.
        Former = "former",
    }
}

impl Rotor {
    /// Returns the rotor's state for this motor; none for a brake without play, because only the motor's data give the
    /// play.
    pub fn state(self, motor: &Motor) -> Option<RotorState> {
        match self {
            Self::Locked => Some(RotorState::Locked),
            Self::Free => Some(RotorState::Free),
            Self::Driven => Some(RotorState::Driven),
            Self::Brake => (motor.rotor.backlash > 0.0).then(|| RotorState::Braked(Play::of(motor))),
        }
    }
}
