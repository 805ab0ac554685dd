//! Constant inductances: equations (1) and (2) in the rotor's frame.

use standstill_interface::Dq;
use standstill_numeric::Symmetric;

use super::Magnetics;
use crate::Winding;

/// `W = (ψ_d − ψ_pm)² / (2 L_d) + ψ_q² / (2 L_q)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Linear {
    /// L_d in H.
    pub d_axis_inductance: f64,
    /// L_q in H.
    pub q_axis_inductance: f64,
    /// ψ_pm in Wb, the flux linkage of the magnet.
    pub magnet_flux: f64,
}

impl Linear {
    /// Makes the core of a winding by equations (1) and (2) with a magnet.
    pub fn from_winding(winding: &Winding, magnet_flux: f64) -> Self {
        Self {
            d_axis_inductance: winding.d_axis_inductance(),
            q_axis_inductance: winding.q_axis_inductance(),
            magnet_flux,
        }
    }
}

impl Magnetics for Linear {
    fn energy(&self, flux: Dq<f64>) -> f64 {
        let d = flux.d - self.magnet_flux;
        (d * d / self.d_axis_inductance + flux.q * flux.q / self.q_axis_inductance) / 2.0
    }

    fn current_and_inverse_inductance(&self, flux: Dq<f64>) -> (Dq<f64>, Symmetric) {
        let (d, q) = (1.0 / self.d_axis_inductance, 1.0 / self.q_axis_inductance);
        (Dq::new((flux.d - self.magnet_flux) * d, flux.q * q), Symmetric::new(d, 0.0, q))
    }
}
