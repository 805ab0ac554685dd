//! All of the motor's magnetics in one: core, magnet's temperature, harmonics, eddy currents, cogging.

mod series;
mod side_by_side;

use standstill_interface::Dq;

pub use series::Series;
pub use side_by_side::{Circuits, Eddies};

use standstill_numeric::{Heading, Lane, Symmetric, cos, sin_cos};

use super::harmonics::Distortion;
use super::hysteresis::{Cell, Hysteresis, MOST_CELLS};
use super::{Core, EddyBranch, Harmonics, Magnetics, NoConvergence};
use crate::FluxMap;

/// The magnetics at one flux and one rotor angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MagneticState<T = f64> {
    /// i = ∂W/∂ψ in A, without eddy currents.
    pub current: Dq<T>,
    /// Γ = ∂²W/∂ψ² in 1/H.
    pub inverse_inductance: Symmetric<T>,
    /// ∂W/∂θ in J per 3/2 and rad, at constant ψ.
    pub energy_slope: T,
    /// ∂²W/∂θ² in J per 3/2 and rad², at constant ψ.
    pub energy_bend: T,
    /// ∂i/∂θ in A/rad, at constant ψ.
    pub current_slope: Dq<T>,
    /// Flux in Wb of the core itself; equal to ψ without harmonics.
    pub core_flux: Dq<T>,
    /// Current in A of the core itself, for look-up in its map: equal to i without harmonics, plus the change of the
    /// magnet.
    pub core_current: Dq<T>,
}

impl<T: Lane> MagneticState<T> {
    /// Makes the state of a core without harmonics, with the magnet's change by temperature.
    #[inline(always)]
    fn undistorted(flux: Dq<T>, core_current: Dq<T>, hessian: Symmetric<T>, magnet: Dq<T>) -> Self {
        let zero = T::of(0.0);
        Self {
            current: Dq::new(core_current.d - magnet.d, core_current.q - magnet.q),
            inverse_inductance: hessian,
            energy_slope: zero,
            energy_bend: zero,
            current_slope: Dq::new(zero, zero),
            core_flux: flux,
            core_current,
        }
    }
}

/// Torque of a rotor without current, from slots: `T = −T_c sin(n θ)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cogging {
    /// T_c in N·m.
    pub torque: f64,
    /// n, periods in one electrical revolution; even.
    pub periods: u8,
}

impl Cogging {
    /// Returns the torque in N·m at electrical angle θ in rad.
    #[inline(always)]
    pub fn at<T: Lane>(&self, angle: T) -> T {
        sin_cos(angle * f64::from(self.periods)).0 * -self.torque
    }

    /// Returns the energy in J at electrical angle θ in rad; the torque is its negative slope over the mechanical
    /// angle.
    pub fn energy(&self, angle: f64, pole_pairs: u32) -> f64 {
        let n = f64::from(self.periods);
        -self.torque / (n * f64::from(pole_pairs)) * cos(n * angle)
    }
}

/// The magnetic side of a motor.
///
/// ```
/// use standstill_interface::Dq;
/// use standstill_numeric::Heading;
/// use standstill_plant::{Core, Linear, MagneticCircuit};
///
/// let core = Linear { d_axis_inductance: 10e-3, q_axis_inductance: 15e-3, magnet_flux: 0.4 };
/// let circuit = MagneticCircuit::new(Core::Linear(core))?;
/// // Without current there is the magnet's flux alone.
/// assert!((circuit.rest(Heading::ZERO).d - 0.4).abs() < 1e-12);
/// let state = circuit.state(Dq::new(0.42, 0.06), Heading::ZERO);
/// assert!((state.current.d - 2.0).abs() < 1e-9 && (state.current.q - 4.0).abs() < 1e-9);
/// # Ok::<(), standstill_plant::NoConvergence>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[must_use]
pub struct MagneticCircuit {
    core: Core,
    /// m: change of the magnet with temperature, as a current in A: `W = W₀ − m·ψ`. Along the flux without current, if
    /// the core is symmetric about it.
    magnet: Dq<f64>,
    rest: Dq<f64>,
    inductance: Symmetric,
    harmonics: Harmonics,
    distortion: Option<Distortion>,
    eddy: Option<(EddyBranch, Dq<f64>)>,
    hysteresis: Option<(Hysteresis, [Cell; MOST_CELLS])>,
}

impl MagneticCircuit {
    /// Makes a core alone.
    ///
    /// # Errors
    /// A core that has no state without current.
    pub fn new(core: Core) -> Result<Self, NoConvergence> {
        let rest = core.flux_at(Dq::new(0.0, 0.0))?;
        let inductance = core.current_and_inverse_inductance(rest).1.inverse();
        let harmonics = Harmonics::default();
        Ok(Self {
            core,
            magnet: Dq::new(0.0, 0.0),
            rest,
            inductance,
            harmonics,
            distortion: None,
            eddy: None,
            hysteresis: None,
        })
    }

    /// Sets the harmonics, which must be smaller than the inductances: see [`Harmonics::fit`].
    pub fn with_harmonics(self, harmonics: Harmonics) -> Self {
        let distortion = harmonics.any().then(|| Distortion::new(harmonics, self.rest, self.inductance));
        Self { harmonics, distortion, ..self }
    }

    /// Sets the eddy currents.
    pub fn with_eddy_currents(self, eddy: Option<EddyBranch>) -> Self {
        let eddy = eddy.map(|branch| (branch, branch.inverse_inductance(self.inductance)));
        Self { eddy, ..self }
    }

    /// Sets the hysteresis. A hysteresis without coercive current or cells changes nothing.
    pub fn with_hysteresis(self, hysteresis: Option<Hysteresis>) -> Self {
        let remembers = |of: &Hysteresis| of.coercive_current > 0.0 && of.depth > 0.0 && of.cells > 0;
        let least = self.inductance.smaller_eigenvalue();
        let hysteresis = hysteresis.filter(remembers).map(|of| (of, of.cells_of(least)));
        Self { hysteresis, ..self }
    }

    /// Scales the magnet such that the flux without current becomes `share` of its present value, as when a magnet is
    /// hot. The law of the iron's saturation does not change; the magnet's magnetomotive force does.
    ///
    /// * A magnet in series with the iron of its axis is equivalent to a current in a winding around it: `W = W₀ −
    ///   m·ψ`. The iron's W₀ depends on the flux only, and `m = ∇W₀(share ψ₀)` makes the current zero at that flux.
    /// * A magnet beside a saturated [`crate::IronBridge`] is not: the winding's current acts on iron and barrier, the
    ///   change of the magnet on the barrier and its ribs. In this case, the remanence ψ_n changes in the ribs' energy.
    ///
    /// A map does not distinguish the two cases; the first is assumed. The map of a rotor with saturated bridges should
    /// therefore be made at the magnet's temperature.
    ///
    /// # Errors
    /// The core has no such flux.
    pub fn with_magnet(&self, share: f64) -> Result<Self, NoConvergence> {
        let nothing = Dq::new(0.0, 0.0);
        let rest = self.rest * share;
        let core = match &self.core {
            Core::Algebraic(core) if core.bridge.is_some() => {
                let changed = core.with_flux(rest.d);
                Core::Algebraic(changed.ok_or(NoConvergence { current: nothing, beyond: None })?)
            }
            core => core.clone(),
        };
        let (at_rest, hessian) = core.current_and_inverse_inductance(rest);
        let scaled = Harmonics {
            flux_5: self.harmonics.flux_5 * share,
            flux_7: self.harmonics.flux_7 * share,
            ..self.harmonics
        };
        let changed = Self { core, magnet: at_rest, rest, inductance: hessian.inverse(), ..self.clone() };
        Ok(changed.with_harmonics(scaled).with_eddy_currents(self.eddy.map(|(branch, _)| branch)))
    }

    /// Returns the core without its harmonics and eddy currents.
    pub const fn core(&self) -> &Core {
        &self.core
    }

    /// Returns the harmonics.
    pub const fn harmonics(&self) -> Harmonics {
        self.harmonics
    }

    /// Returns the eddy currents.
    pub fn eddy_currents(&self) -> Option<EddyBranch> {
        self.eddy.map(|(branch, _)| branch)
    }

    /// Returns the hysteresis of its iron.
    pub fn hysteresis(&self) -> Option<Hysteresis> {
        self.hysteresis.map(|(hysteresis, _)| hysteresis)
    }

    /// Returns the cells of its iron.
    pub fn cells(&self) -> Option<&[Cell; MOST_CELLS]> {
        self.hysteresis.as_ref().map(|(_, cells)| cells)
    }

    /// Returns the incremental inductance in H without current and without harmonics.
    pub const fn inductance(&self) -> Symmetric {
        self.inductance
    }

    /// Returns the flux in Wb of the core without current, harmonics apart.
    pub(crate) const fn core_rest(&self) -> Dq<f64> {
        self.rest
    }

    /// Returns the flux in Wb without current.
    pub fn rest(&self, at: Heading) -> Dq<f64> {
        self.distortion.map_or(self.rest, |distortion| distortion.rest(at))
    }

    /// Returns the current, inductance and their slopes at a flux in Wb.
    pub fn state(&self, flux: Dq<f64>, at: Heading) -> MagneticState {
        if let Some(distortion) = &self.distortion {
            let inside = distortion.inwards(flux, at);
            let (current, hessian) = self.core.current_and_inverse_inductance(inside.core_flux);
            return inside.outwards(current, hessian, self.magnet);
        }
        let (current, hessian) = self.core.current_and_inverse_inductance(flux);
        MagneticState::undistorted(flux, current, hessian, self.magnet)
    }

    /// Returns W in J per 3/2, without the energy of the eddy currents.
    pub fn energy(&self, flux: Dq<f64>, at: Heading) -> f64 {
        let core_flux = self.distortion.map_or(flux, |distortion| distortion.core_flux(flux, at));
        self.core.energy(core_flux) - self.magnet.dot(core_flux)
    }

    /// Returns the eddy currents G (ψ − χ) in A and their inverse inductance G in 1/H, where χ lags ψ by `lag` in Wb;
    /// none for a circuit without eddy currents.
    #[inline(always)]
    pub fn eddy<T: Lane>(&self, lag: Dq<T>) -> Option<Eddy<T>> {
        let (branch, g) = self.eddy?;
        Some(Eddy {
            current: Dq::new(lag.d * g.d, lag.q * g.q),
            inverse_inductance: g,
            time_constant: branch.time_constant,
        })
    }

    /// Returns the flux in Wb at this current in A after the eddy currents have decayed.
    ///
    /// # Errors
    /// [`NoConvergence`] if there is no such state; for a convex energy there always is one.
    pub fn flux_at(&self, current: Dq<f64>, at: Heading) -> Result<Dq<f64>, NoConvergence> {
        let flux = match &self.core {
            Core::Map(map) => {
                let near = map.near(current + self.magnet);
                super::explicit_newton(current, near, self.core.flux_scale(), |flux| {
                    let state = self.state(flux, at);
                    (state.current, state.inverse_inductance)
                })
            }
            core => super::newton(current, self.rest(at), core.flux_scale(), |flux| {
                let state = self.state(flux, at);
                (self.energy(flux, at), state.current, state.inverse_inductance)
            }),
        }
        // Within a map the energy is convex: what was not found is beyond.
        .map_err(|error| NoConvergence { beyond: self.range(), ..error })?;
        match &self.core {
            Core::Map(map) if self.margin(&self.state(flux, at)) < -1e-9 * map.reach() => {
                Err(NoConvergence { current, beyond: self.range() })
            }
            _ => Ok(flux),
        }
    }

    /// Returns the ranges of i_d and i_q in A of the winding that a map covers, without harmonics; none for a formula.
    /// They are the ranges of the map less the change of the magnet: a hot magnet is equivalent to a current that
    /// opposes it.
    pub fn range(&self) -> Option<[[f64; 2]; 2]> {
        let Core::Map(map) = &self.core else { return None };
        let [d, q] = map.range();
        Some([d.map(|end| end - self.magnet.d), q.map(|end| end - self.magnet.q)])
    }

    /// Returns the map if the core is one, also if a constant inductance is in series with it.
    pub fn map(&self) -> Option<&FluxMap> {
        match &self.core {
            Core::Map(map) => Some(map),
            Core::Series(series) => series.map(),
            Core::Linear(_) | Core::Algebraic(_) => None,
        }
    }

    /// Returns the distance in A of the core's current from the end of the range of its map, negative beyond; infinite
    /// for a formula. The current is that of the core itself, because the data do not include the change of the magnet.
    #[inline]
    pub fn margin(&self, state: &MagneticState) -> f64 {
        self.core.margin(state.core_current)
    }
}

/// The eddy currents at one lag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eddy<T = f64> {
    /// Current in A that is added to the core's.
    pub current: Dq<T>,
    /// G in 1/H.
    pub inverse_inductance: Dq<f64>,
    /// τ in s.
    pub time_constant: f64,
}
