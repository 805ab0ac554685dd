//! State variables of the machines; between two instants they are smooth functions of time.

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
    /// Flux χ of the eddy currents in Wb, in the rotor's plane: it follows the winding's flux with a lag.
    pub lagging: Dq<T>,
    /// Flux χ of shorted turns in Wb, along the axis of their phase: it follows the winding's flux with a lag. Unused without
    /// shorted turns.
    pub shorted: T,
    /// Potentials of the terminals in V against the negative rail. Unused if terminals have no capacitance.
    pub potential: [T; 3],
}
