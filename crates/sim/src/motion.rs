//! Whether the rotor moves: held, resting on its stiction, or sliding.

use standstill_plant::Rotor;

/// Speed in rad/s (electrical) below which a sliding rotor counts as stopped when its motion is decided.
pub const RESTING_SPEED: f64 = 1e-9;

/// The rotor's state of motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Locked by a brake: never moves.
    Held,
    /// Free, but the torque does not exceed the stiction.
    Resting,
    /// Free and moving forwards, or about to.
    Forward,
    /// Free and moving backwards, or about to.
    Backward,
    /// Free without any dry friction: its speed may have either sign.
    Floating,
}

impl Motion {
    /// The motion of a free rotor at this speed under this torque in N·m.
    pub fn resolve(rotor: &Rotor, speed: f64, torque: f64) -> Self {
        if rotor.friction.stiction == 0.0 {
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

    /// Whether angle and speed change.
    pub const fn moves(self) -> bool {
        matches!(self, Self::Forward | Self::Backward | Self::Floating)
    }

    /// Friction torque in N·m against the motion at mechanical speed in rad/s, positive backwards.
    pub fn friction(self, rotor: &Rotor, mechanical_speed: f64) -> f64 {
        let dry = match self {
            Self::Forward => rotor.friction.coulomb,
            Self::Backward => -rotor.friction.coulomb,
            Self::Held | Self::Resting | Self::Floating => 0.0,
        };
        dry + rotor.friction.viscous * mechanical_speed
    }

    /// How far the motion is from changing, positive while it holds: a torque in N·m when resting, a speed in
    /// rad/s when sliding.
    pub fn margin(self, rotor: &Rotor, speed: f64, torque: f64) -> f64 {
        match self {
            Self::Held | Self::Floating => f64::INFINITY,
            Self::Resting => rotor.friction.stiction - torque.abs(),
            Self::Forward => speed,
            Self::Backward => -speed,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use standstill_plant::Friction;

    const ROTOR: Rotor =
        Rotor { inertia: 0.02, friction: Friction { stiction: 0.3, coulomb: 0.2, viscous: 0.0 } };

    #[test]
    fn law_a_rotor_rests_until_the_torque_exceeds_its_stiction() {
        assert_eq!(Motion::resolve(&ROTOR, 0.0, 0.29), Motion::Resting);
        assert_eq!(Motion::resolve(&ROTOR, 0.0, -0.31), Motion::Backward);
        assert_eq!(Motion::resolve(&ROTOR, 1.0, -0.31), Motion::Forward);
        assert!(Motion::Resting.margin(&ROTOR, 0.0, -0.31) < 0.0);
    }

    #[test]
    fn law_friction_opposes_motion() {
        assert!(Motion::Forward.friction(&ROTOR, 1.0) > 0.0);
        assert!(Motion::Backward.friction(&ROTOR, -1.0) < 0.0);
        assert_eq!(Motion::Resting.friction(&ROTOR, 0.0), 0.0);
    }
}
