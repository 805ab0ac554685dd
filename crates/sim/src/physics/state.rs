//! State variables of the machines; between two instants they are smooth functions of time.

use standstill_interface::Dq;

use super::plane::Plane;

/// State variables of one machine, or of several machines side by side.
#[derive(Clone, Copy, Debug, Default)]
pub struct State<T = f64> {
    /// Flux linkage ψ of the winding in Wb, in the run's plane.
    pub flux: Plane<T>,
    /// Electrical angle in rad by which the rotor has turned since the start of the run.
    pub turned: T,
    /// Electrical speed ω in rad/s.
    pub speed: T,
    /// DC-link voltage in V.
    pub link: T,
    /// Flux χ of the eddy currents in Wb, in the rotor's plane. It follows the winding's flux with a lag.
    pub lagging: Dq<T>,
    /// Flux χ of shorted turns in Wb, along the axis of the shorted phase. It follows the winding's flux with a lag. Without shorted
    /// turns it is not used.
    pub shorted: T,
    /// Potentials of the terminals in V against the negative rail. Not used if the terminals have no capacitance.
    pub potential: [T; 3],
}
