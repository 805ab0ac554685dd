//! State variables: they change smoothly between two instants.

use standstill_interface::Dq;

use super::plane::Plane;

/// The state of a run, of one machine or of several side by side.
#[derive(Clone, Copy, Debug, Default)]
pub struct State<T = f64> {
    /// Flux linkage ψ of the winding in Wb, in the run's plane.
    pub flux: Plane<T>,
    /// Angle by which the rotor has turned since its start, in rad electrical.
    pub turned: T,
    /// Electrical speed ω in rad/s.
    pub speed: T,
    /// DC-link voltage in V.
    pub link: T,
    /// The lagging flux χ of the eddy currents in Wb, in the rotor's plane.
    pub lagging: Dq<T>,
    /// The lagging flux χ of shorted turns in Wb, along the axis of their phase; else unused.
    pub shorted: T,
    /// Potentials of the terminals in V against the negative rail, if terminals have a capacitance; else unused.
    pub potential: [T; 3],
}
