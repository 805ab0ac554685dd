//! The core as one energy.
//!
//! All magnetic quantities follow from a function `W(ψ_d, ψ_q)`: its gradient is the current, its Hessian the inverse
//! of the incremental inductance. Reciprocity (∂i_d/∂ψ_q = ∂i_q/∂ψ_d) then holds by construction and no run can create
//! energy. The physical field energy is `3/2 W`.
//!
//! A [`Magnetics`] is such a core. The [`MagneticCircuit`] of a motor is a core with optional additions, each with an
//! energy: a warmer or colder magnet, harmonics over the rotor angle, eddy currents. Its iron may have [`Hysteresis`],
//! which dissipates energy.

mod algebraic;
mod circuit;
mod eddy;
mod falls;
mod harmonics;
mod hysteresis;
mod iron_bridge;
mod linear;

use std::fmt;

use standstill_interface::Dq;
use standstill_numeric::Symmetric;
use standstill_quantity::short;

use crate::FluxMap;

pub use algebraic::Algebraic;
pub use circuit::{Circuits, Cogging, Eddies, Eddy, MagneticCircuit, MagneticState, Series};
pub use eddy::EddyBranch;
pub use falls::{Falls, FallsError};
pub use harmonics::Harmonics;
pub use hysteresis::{Cell, Hysteresis, MOST_CELLS};
pub use iron_bridge::IronBridge;
pub use linear::Linear;

/// A core without losses: flux linkage in Wb to current in A.
///
/// ```
/// use standstill_interface::Dq;
/// use standstill_plant::{Linear, Magnetics};
///
/// let core = Linear { d_axis_inductance: 10e-3, q_axis_inductance: 15e-3, magnet_flux: 0.4 };
/// let flux = core.flux_at(Dq::new(2.0, 4.0))?;
/// assert!((flux.d - 0.42).abs() < 1e-12 && (flux.q - 0.06).abs() < 1e-12);
/// // The current is the slope of the energy.
/// let step = 1e-6;
/// let slope = (core.energy(Dq::new(flux.d + step, flux.q)) - core.energy(Dq::new(flux.d - step, flux.q))) / (2.0 * step);
/// assert!((slope - core.current(flux).d).abs() < 1e-6);
/// # Ok::<(), standstill_plant::NoConvergence>(())
/// ```
pub trait Magnetics {
    /// Returns W in J per 3/2; multiply by 3/2 for the physical energy.
    fn energy(&self, flux: Dq<f64>) -> f64;

    /// Returns the current `∂W/∂ψ` in A and the inverse incremental inductance `∂²W/∂ψ²` in 1/H.
    fn current_and_inverse_inductance(&self, flux: Dq<f64>) -> (Dq<f64>, Symmetric);

    /// Returns whether the energy has a kink in a higher derivative where ψ_d, or ψ_q, crosses zero, so that an
    /// integrator must not step across. Terms such as |ψ|ψ make one; they are smooth on either side.
    fn kinks(&self) -> [bool; 2] {
        [false; 2]
    }

    /// Returns the current in A alone.
    fn current(&self, flux: Dq<f64>) -> Dq<f64> {
        self.current_and_inverse_inductance(flux).0
    }

    /// Returns the flux in Wb at which the given current in A flows, by damped Newton iteration from zero flux.
    ///
    /// # Errors
    /// [`NoConvergence`] if the core has no such state; a convex energy always has one.
    fn flux_at(&self, current: Dq<f64>) -> Result<Dq<f64>, NoConvergence> {
        newton(current, self.near(current), self.flux_scale(), |flux| {
            let (i, gamma) = self.current_and_inverse_inductance(flux);
            (self.energy(flux), i, gamma)
        })
    }

    /// Returns a flux in Wb to which this core's rounding is in proportion, also where its flux is zero. A formula is
    /// exact there.
    fn flux_scale(&self) -> f64 {
        0.0
    }

    /// Returns a flux in Wb near that of a current in A, where the search for it begins.
    fn near(&self, _current: Dq<f64>) -> Dq<f64> {
        Dq::new(0.0, 0.0)
    }

    /// Returns the distance of the current in A from the end of the core's known range, negative beyond. A formula is
    /// known for all currents.
    fn margin(&self, _current: Dq<f64>) -> f64 {
        f64::INFINITY
    }
}

/// Returns the flux at which `current` flows, by damped Newton iteration from `flux`. `at` returns W, its gradient and
/// its Hessian. The tolerance is in proportion to the fluxes on the way and to `scale`, both in Wb, because currents of
/// machines range from milliamperes to megaamperes.
fn newton(
    current: Dq<f64>,
    mut flux: Dq<f64>,
    scale: f64,
    at: impl Fn(Dq<f64>) -> (f64, Dq<f64>, Symmetric),
) -> Result<Dq<f64>, NoConvergence> {
    let distance = |flux| at(flux).0 - current.dot(flux);
    let near = |way: Dq<f64>, flux: Dq<f64>, share: f64| way.norm() <= share * flux.norm().max(scale);
    for _ in 0..200 {
        let (_, i, gamma) = at(flux);
        let way = gamma.inverse().times_dq(current - i);
        // W(ψ) − i·ψ is convex and has its minimum at the flux sought: never step uphill. Close to it the
        // difference drowns in rounding, and Newton's own step is right.
        // Nor to where a map has no data and is not convex.
        let mut share = 1.0;
        let bad = |next: Dq<f64>| distance(next) > distance(flux) || !at(next).2.is_positive_definite();
        while !near(way, flux, 1e-6) && bad(flux + way * share) && share > 1e-6 {
            share *= 0.5;
        }
        flux = flux + way * share;
        if near(way, flux, 1e-15) {
            break;
        }
    }
    // What is left of the current, as the flux that it amounts to.
    let (_, i, gamma) = at(flux);
    let left = gamma.inverse().times_dq(current - i);
    if near(left, flux, 1e-11) { Ok(flux) } else { Err(NoConvergence { current, beyond: None }) }
}

/// Returns the flux at which `current` flows, by Newton's method from a close flux, such as that of a map's co-energy.
/// Steps are halved until the current comes closer to `current`. The method therefore returns even from beyond the
/// surface's edge, where the current is no longer the gradient of the energy.
pub(crate) fn explicit_newton(
    current: Dq<f64>,
    mut flux: Dq<f64>,
    scale: f64,
    at: impl Fn(Dq<f64>) -> (Dq<f64>, Symmetric),
) -> Result<Dq<f64>, NoConvergence> {
    let (mut i, mut gamma) = at(flux);
    for _ in 0..50 {
        let way = gamma.inverse().times_dq(current - i);
        let off = (current - i).norm();
        let (mut share, mut next) = (1.0, at(flux + way));
        while (current - next.0).norm() >= off && share > 1e-3 {
            share *= 0.5;
            next = at(flux + way * share);
        }
        // No closer: as close as rounding lets it.
        if (current - next.0).norm() >= off {
            break;
        }
        flux = flux + way * share;
        (i, gamma) = next;
    }
    let left = gamma.inverse().times_dq(current - i);
    if left.norm() <= 1e-11 * flux.norm().max(scale) {
        Ok(flux)
    } else {
        Err(NoConvergence { current, beyond: None })
    }
}

/// The core has no state with this current.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoConvergence {
    /// The current in A that was asked for.
    pub current: Dq<f64>,
    /// The range of i_d and i_q in A that is known, if that is why; see [`MagneticCircuit::range`].
    pub beyond: Option<[[f64; 2]; 2]>,
}

impl fmt::Display for NoConvergence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "no flux found at i_d = {} A, i_q = {} A", short(self.current.d), short(self.current.q))?;
        match self.beyond {
            Some(range) => {
                let [[d_low, d_high], [q_low, q_high]] = range.map(|ends| ends.map(short));
                write!(f, "; the map covers i_d from {d_low} to {d_high} A, i_q from {q_low} to {q_high} A")
            }
            None => Ok(()),
        }
    }
}

impl std::error::Error for NoConvergence {}

/// The cores that a motor can have.
#[derive(Clone, Debug, PartialEq)]
pub enum Core {
    /// Constant inductances.
    Linear(Linear),
    /// Algebraic saturation.
    Algebraic(Algebraic),
    /// A map from finite elements or measurement.
    Map(FluxMap),
    /// A core in series with a constant inductance.
    Series(Box<Series>),
}

/// Dispatches to the core.
macro_rules! of_each {
    ($self:ident, $core:ident => $value:expr) => {
        match $self {
            Self::Linear($core) => $value,
            Self::Algebraic($core) => $value,
            Self::Map($core) => $value,
            Self::Series($core) => $value,
        }
    };
}

impl Magnetics for Core {
    fn energy(&self, flux: Dq<f64>) -> f64 {
        of_each!(self, core => core.energy(flux))
    }

    fn kinks(&self) -> [bool; 2] {
        of_each!(self, core => core.kinks())
    }

    fn current_and_inverse_inductance(&self, flux: Dq<f64>) -> (Dq<f64>, Symmetric) {
        of_each!(self, core => core.current_and_inverse_inductance(flux))
    }

    fn flux_at(&self, current: Dq<f64>) -> Result<Dq<f64>, NoConvergence> {
        of_each!(self, core => core.flux_at(current))
    }

    fn near(&self, current: Dq<f64>) -> Dq<f64> {
        of_each!(self, core => core.near(current))
    }

    fn flux_scale(&self) -> f64 {
        of_each!(self, core => core.flux_scale())
    }

    #[inline]
    fn margin(&self, current: Dq<f64>) -> f64 {
        of_each!(self, core => core.margin(current))
    }
}

#[cfg(test)]
mod tests;
