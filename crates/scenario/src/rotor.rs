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
        /// Free to turn, with its friction.
        Free = "free",
        /// Held by a brake with play.
        Brake = "brake",
        /// Turned at `rotor.speed` and `rotor.acceleration` whatever the motor's torque, as by a vehicle that rolls or
        /// a lift that sinks.
        Driven = "driven",
    }
}

choice! {
    /// Magnetisation of the stator's iron at the start, for motors whose data sheet has a `[hysteresis]`.
    #[derive(Default)]
    pub enum Memory {
        /// No remanence: the iron was demagnetised with the rotor at its initial angle.
        Virgin = "virgin" default,
        /// Remanence of former operation, along the direction in which the flux last changed by much. Each trial draws
        /// this direction, uniformly.
        Former = "former",
    }
}

impl Rotor {
    /// Returns the rotor's state for this motor. Returns none if the rotor is held by a brake and the motor's data give no play of the
    /// brake.
    pub fn state(self, motor: &Motor) -> Option<RotorState> {
        match self {
            Self::Locked => Some(RotorState::Locked),
            Self::Free => Some(RotorState::Free),
            Self::Driven => Some(RotorState::Driven),
            Self::Brake => (motor.rotor.backlash > 0.0).then(|| RotorState::Braked(Play::of(motor))),
        }
    }
}
