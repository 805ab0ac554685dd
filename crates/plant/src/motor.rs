//! A motor: everything that the simulation needs, validated.

use standstill_interface::{AlphaBeta, Dq};

use crate::{Core, Linear, Magnetics, Rotor, Winding};

/// A permanent-magnet synchronous motor. SI units. Made by [`crate::DataSheet::motor`], which checks that the
/// numbers make a motor; whoever changes a field afterwards keeps that promise themselves.
#[derive(Clone, Debug, PartialEq)]
pub struct Motor {
    /// Its name.
    pub name: String,
    /// p, the number of pole pairs.
    pub pole_pairs: u32,
    /// R in Ω, one phase.
    pub resistance: f64,
    /// Rated current in A, peak of the phase current.
    pub rated_current: f64,
    /// DC-link voltage in V that it is meant for, if its data sheet says so.
    pub dc_link: Option<f64>,
    /// The winding without saturation.
    pub winding: Winding,
    /// ψ_pm in Wb, the open-circuit flux linkage.
    pub magnet_flux: f64,
    /// The core that is simulated.
    pub core: Core,
    /// The mechanical side.
    pub rotor: Rotor,
}

impl Motor {
    /// The same motor with a core that does not saturate: the winding of equations (1) and (2) alone.
    #[must_use]
    pub fn linearised(&self) -> Self {
        let core = Core::Linear(Linear::from_winding(&self.winding, self.magnet_flux));
        Self { core, ..self.clone() }
    }

    /// Torque in N·m: `3/2 p (ψ_α i_β − ψ_β i_α)`.
    pub fn torque(&self, flux: AlphaBeta<f64>, current: AlphaBeta<f64>) -> f64 {
        1.5 * f64::from(self.pole_pairs) * (flux.alpha * current.beta - flux.beta * current.alpha)
    }

    /// Flux in Wb with no current, at electrical angle θ in rad.
    pub fn open_circuit_flux(&self, angle: f64) -> AlphaBeta<f64> {
        let (sin, cos) = angle.sin_cos();
        // Newton's answer is exact to the last digits where the data sheet rounds its magnet flux.
        let flux = self.core.flux_at(Dq::new(0.0, 0.0)).unwrap_or(Dq::new(self.magnet_flux, 0.0));
        flux.unpark_by(sin, cos)
    }
}
