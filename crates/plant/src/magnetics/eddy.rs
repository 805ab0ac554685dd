//! Eddy currents in magnets and rotor iron: the inductance is smaller for a short pulse than for a slow one.
//!
//! The model is one dynamic branch, parallel to the core. A flux χ follows the winding's flux ψ, and its lag drives
//! eddy currents against the change,
//! ```text
//! i = ∂W/∂ψ + G (ψ − χ),   dχ/dt = (ψ − χ)/τ
//! ```
//! This is the gradient of `W + ½ (ψ − χ)ᵀ G (ψ − χ)`, and `3/2 (ψ − χ)ᵀ G (ψ − χ)/τ ≥ 0` is the heat in the branch.
//! The branch is passive for all parameters and has no effect once χ = ψ. The inductance is `Γ⁻¹` for a slow pulse and
//! `(Γ + G)⁻¹` for an infinitely short one. The branch turns with the rotor.

use standstill_interface::Dq;
use standstill_numeric::Symmetric;

/// Eddy currents of the rotor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EddyBranch {
    /// τ in s: how fast the eddy currents die while the flux stands still.
    pub time_constant: f64,
    /// Share of L_d, without current, that an infinitely short pulse does not meet; 0 to below 1.
    pub d_depth: f64,
    /// Share of L_q that eddy currents take from a short pulse.
    pub q_depth: f64,
}

impl EddyBranch {
    /// Returns G in 1/H; `inductance`: incremental inductance in H at no current.
    pub(super) fn inverse_inductance(&self, inductance: Symmetric) -> Dq<f64> {
        let of = |depth: f64, l: f64| depth / ((1.0 - depth) * l);
        Dq::new(of(self.d_depth, inductance.xx), of(self.q_depth, inductance.yy))
    }
}
