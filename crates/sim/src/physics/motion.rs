//! Motion of the rotor: held, at rest by stiction or against a stop, or sliding.

use standstill_plant::Rotor;

/// Electrical speed in rad/s below which a rotor is treated as stopped when its state of motion is determined.
pub const RESTING_SPEED: f64 = 1e-9;

/// The rotor's state of motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Locked by a brake. The rotor never moves.
    Held,
    /// Free and at rest. The torque does not exceed the stiction.
    Resting,
    /// Free and moving forwards, or beginning to move forwards.
    Forward,
    /// Free and moving backwards, or beginning to move backwards.
    Backward,
    /// Free and without dry friction. The speed may be positive, negative or zero.
    Floating,
    /// At the forward end of the brake's play. The torque presses the rotor against the end, or friction holds the rotor there.
    AtUpper,
    /// At the backward end of the brake's play. The torque presses the rotor against the end, or friction holds the rotor there.
    AtLower,
}

/// The end of the brake's play that the rotor touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contact {
    /// Neither end.
    None,
    /// The forward end.
    Upper,
    /// The backward end.
    Lower,
}

impl Motion {
    /// Returns the state of motion of a rotor that is not locked. `speed` is the speed in rad/s. `torque` is the sum of all torques
    /// except friction, in N·m.
    pub fn resolve(rotor: &Rotor, speed: f64, torque: f64, contact: Contact) -> Self {
        let rests = speed.abs() <= RESTING_SPEED;
        if rests && contact == Contact::Upper && torque >= -rotor.friction.stiction {
            Self::AtUpper
        } else if rests && contact == Contact::Lower && torque <= rotor.friction.stiction {
            Self::AtLower
        } else if rotor.friction.stiction == 0.0 {
            Self::Floating
        } else if speed.abs() > RESTING_SPEED {
            if speed > 0.0 { Self::Forward } else { Self::Backward }
        } else if torque.abs() <= rotor.friction.stiction {
            Self::Resting
        } else if torque > 0.0 {
            Self::Forward
        } else {
            Self::Backward
        }
    }

    /// Returns whether the rotor's angle and speed may change in this state of motion.
    pub const fn moves(self) -> bool {
        matches!(self, Self::Forward | Self::Backward | Self::Floating)
    }

    /// Returns the friction torque in N·m at a mechanical speed in rad/s. A positive torque acts backwards.
    pub fn friction(self, rotor: &Rotor, mechanical_speed: f64) -> f64 {
        let dry = match self {
            Self::Forward => rotor.friction.coulomb,
            Self::Backward => -rotor.friction.coulomb,
            Self::Held | Self::Resting | Self::Floating | Self::AtUpper | Self::AtLower => 0.0,
        };
        dry + rotor.friction.viscous * mechanical_speed
    }

    /// Returns four coefficients of the motion's margin. The margin is positive while the motion lasts. It is the sum of the first
    /// coefficient, the second times the speed in rad/s, the third times the electromagnetic torque in N·m (cogging included), and the
    /// fourth times |torque − load| in N·m. For a rotor at rest the margin is a torque in N·m, for a moving rotor a speed in rad/s.
    /// `load` is the load torque in N·m.
    pub fn limits(self, rotor: &Rotor, load: f64) -> [f64; 4] {
        let stiction = rotor.friction.stiction;
        match self {
            Self::Held | Self::Floating => [f64::INFINITY, 0.0, 0.0, 0.0],
            Self::Resting => [stiction, 0.0, 0.0, -1.0],
            Self::Forward => [0.0, 1.0, 0.0, 0.0],
            Self::Backward => [0.0, -1.0, 0.0, 0.0],
            Self::AtUpper => [stiction - load, 0.0, 1.0, 0.0],
            Self::AtLower => [stiction + load, 0.0, -1.0, 0.0],
        }
    }

    /// Returns the electrical angles in rad at which the moving rotor may reach the ends of the brake's play. The angle is infinite for
    /// an end from which the rotor moves away.
    pub const fn way(self, [lower, upper]: [f64; 2]) -> [f64; 2] {
        match self {
            Self::Forward => [f64::NEG_INFINITY, upper],
            Self::Backward => [lower, f64::INFINITY],
            Self::Floating => [lower, upper],
            Self::Held | Self::Resting | Self::AtUpper | Self::AtLower => [f64::NEG_INFINITY, f64::INFINITY],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use standstill_plant::Friction;

    const ROTOR: Rotor = Rotor {
        inertia: 0.02,
        friction: Friction { stiction: 0.3, coulomb: 0.2, viscous: 0.0 },
        cogging: None,
        backlash: 0.0,
    };

    /// Returns the margin of a motion at a load of 0.2 N·m. `torque` is the electromagnetic torque minus the load.
    fn margin(motion: Motion, speed: f64, torque: f64) -> f64 {
        let [constant, by_speed, by_torque, by_size] = motion.limits(&ROTOR, 0.2);
        constant + by_speed * speed + by_torque * (torque + 0.2) + by_size * torque.abs()
    }

    #[test]
    fn law_a_rotor_rests_until_the_torque_exceeds_its_stiction() {
        let resolve = |speed, torque| Motion::resolve(&ROTOR, speed, torque, Contact::None);
        assert_eq!(resolve(0.0, 0.29), Motion::Resting);
        assert_eq!(resolve(0.0, -0.31), Motion::Backward);
        assert_eq!(resolve(1.0, -0.31), Motion::Forward);
        assert!(margin(Motion::Resting, 0.0, -0.31) < 0.0 && margin(Motion::Resting, 0.0, 0.29) > 0.0);
        assert!(margin(Motion::Forward, -1e-3, 0.0) < 0.0 && margin(Motion::Backward, -1e-3, 0.0) > 0.0);
    }

    #[test]
    fn law_a_stop_holds_against_any_torque_towards_it_and_none_away() {
        let at = |contact, torque| Motion::resolve(&ROTOR, 0.0, torque, contact);
        assert_eq!(at(Contact::Upper, 100.0), Motion::AtUpper);
        assert_eq!(at(Contact::Upper, -0.29), Motion::AtUpper);
        assert_eq!(at(Contact::Upper, -0.31), Motion::Backward);
        assert_eq!(at(Contact::Lower, -100.0), Motion::AtLower);
        assert_eq!(at(Contact::Lower, 0.31), Motion::Forward);
        assert!(margin(Motion::AtUpper, 0.0, -0.31) < 0.0 && margin(Motion::AtUpper, 0.0, 0.31) > 0.0);
        assert!(margin(Motion::AtLower, 0.0, 0.31) < 0.0 && margin(Motion::AtLower, 0.0, -0.31) > 0.0);
        assert_eq!(Motion::Forward.way([-1.0, 1.0])[1], 1.0);
        assert_eq!(Motion::Backward.way([-1.0, 1.0])[0], -1.0);
    }

    #[test]
    fn law_friction_opposes_motion() {
        assert!(Motion::Forward.friction(&ROTOR, 1.0) > 0.0);
        assert!(Motion::Backward.friction(&ROTOR, -1.0) < 0.0);
        assert_eq!(Motion::Resting.friction(&ROTOR, 0.0), 0.0);
    }
}
