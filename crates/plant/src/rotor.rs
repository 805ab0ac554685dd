//! The rotor as a mechanical body.

use crate::Cogging;

/// Friction of a rotor. Torques in N·m, speeds mechanical.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Friction {
    /// Torque in N·m that must be exceeded before a resting rotor moves.
    pub stiction: f64,
    /// Torque in N·m against any motion, whatever its speed. At most the stiction.
    pub coulomb: f64,
    /// Torque per speed in N·m·s/rad.
    pub viscous: f64,
}

/// A rotor that obeys `J dω/dt = T − friction`, and rests until the torque exceeds its stiction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotor {
    /// Moment of inertia J in kg·m², with everything that is coupled to the shaft.
    pub inertia: f64,
    /// Friction of the bearings.
    pub friction: Friction,
    /// Torque without current, from slots.
    pub cogging: Option<Cogging>,
    /// Play of its brake in rad, mechanical: how far the rotor can turn, from one end to the other, while the brake
    /// is applied.
    pub backlash: f64,
}
