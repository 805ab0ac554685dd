//! A constant inductance in series with a core, along d and q. It represents a change of L_A and L_B of any core.
//!
//! ```text
//!   ψ = u + M i,   i = ∂W₀/∂u − magnet,   W(ψ) = W₀(u) − magnet·u + ½ i·M i
//! ```
//! Then `∂W/∂ψ = i` and `Γ = (Γ₀⁻¹ + M)⁻¹`: the result is again one energy, with the flux without current of the core
//! alone.

use standstill_interface::Dq;
use standstill_numeric::Symmetric;

use super::MagneticCircuit;
use crate::FluxMap;
use crate::magnetics::{Core, Magnetics};

/// A core behind a constant inductance.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    core: Core,
    /// Difference along d in A between the core's current and the winding's, as in [`MagneticCircuit`].
    magnet: Dq<f64>,
    /// M in H.
    inductance: Dq<f64>,
}

/// A core's state behind the inductance.
struct Inner {
    /// u in Wb.
    flux: Dq<f64>,
    /// i in A.
    current: Dq<f64>,
    /// Γ₀ in 1/H.
    inverse_inductance: Symmetric,
}

impl Series {
    /// Returns the core's state where the winding's flux is ψ, by Newton's iteration from u = ψ: M is small.
    fn inner(&self, flux: Dq<f64>) -> Inner {
        let Dq { d, q } = self.inductance;
        let at = |u: Dq<f64>| {
            let (mut current, inverse_inductance) = self.core.current_and_inverse_inductance(u);
            current = current - self.magnet;
            Inner { flux: u, current, inverse_inductance }
        };
        let mut inner = at(flux);
        for _ in 0..20 {
            let Inner { flux: u, current, inverse_inductance: gamma } = inner;
            let off = flux - u - Dq::new(d * current.d, q * current.q);
            // (1 + M Γ₀) Δu = what is missing.
            let (xx, xy, yx, yy) = (1.0 + d * gamma.xx, d * gamma.xy, q * gamma.xy, 1.0 + q * gamma.yy);
            let determinant = xx * yy - xy * yx;
            // Where a negative M outweighs what saturation leaves, there is no such u. Only a step that an integrator is
            // about to reject goes there; it must get numbers.
            if determinant < 0.5 {
                break;
            }
            let next = u + Dq::new(yy * off.d - xy * off.q, xx * off.q - yx * off.d) * (1.0 / determinant);
            if next == u || off.norm() <= 1e-16 * flux.norm() {
                break;
            }
            inner = at(next);
        }
        inner
    }
}

impl Series {
    /// Returns the map behind the inductance, if its core is one.
    pub(super) fn map(&self) -> Option<&FluxMap> {
        match &self.core {
            Core::Map(map) => Some(map),
            Core::Series(series) => series.map(),
            Core::Linear(_) | Core::Algebraic(_) => None,
        }
    }
}

impl Magnetics for Series {
    fn energy(&self, flux: Dq<f64>) -> f64 {
        let Inner { flux: u, current: i, .. } = self.inner(flux);
        let stored = (self.inductance.d * i.d * i.d + self.inductance.q * i.q * i.q) / 2.0;
        self.core.energy(u) + self.magnet.dot(flux - u) + stored
    }

    // Not inlined: the cores of every other run stay as small as they were.
    #[inline(never)]
    fn current_and_inverse_inductance(&self, flux: Dq<f64>) -> (Dq<f64>, Symmetric) {
        let Inner { current, inverse_inductance, .. } = self.inner(flux);
        let l = inverse_inductance.inverse();
        let whole = Symmetric::new(l.xx + self.inductance.d, l.xy, l.yy + self.inductance.q);
        (current + self.magnet, whole.inverse())
    }

    fn kinks(&self) -> [bool; 2] {
        self.core.kinks()
    }

    fn near(&self, current: Dq<f64>) -> Dq<f64> {
        let winding = current - self.magnet;
        self.core.near(current) + Dq::new(self.inductance.d * winding.d, self.inductance.q * winding.q)
    }

    fn flux_scale(&self) -> f64 {
        self.core.flux_scale()
    }

    fn margin(&self, current: Dq<f64>) -> f64 {
        self.core.margin(current)
    }
}

impl MagneticCircuit {
    /// Adds a constant inductance in H in series along d and along q. It may be negative, but the sum must
    /// stay an inductance.
    pub fn with_series_inductance(&self, inductance: Dq<f64>) -> Self {
        let series = Series { core: self.core.clone(), magnet: self.magnet, inductance };
        let l = self.inductance;
        let changed = Self {
            core: Core::Series(Box::new(series)),
            inductance: Symmetric::new(l.xx + inductance.d, l.xy, l.yy + inductance.q),
            ..self.clone()
        };
        changed.with_harmonics(self.harmonics).with_eddy_currents(self.eddy_currents())
    }
}

#[cfg(test)]
mod tests {
    use standstill_numeric::Heading;

    use super::*;
    use crate::{built_in, built_in_names};

    const ADDED: Dq<f64> = Dq::new(0.2e-3, -0.3e-3);

    #[test]
    fn law_series_inductance_adds_its_flux_to_any_core() {
        for name in built_in_names() {
            let motor = built_in(name).expect("built in");
            let hot = motor.magnetics.with_magnet(0.9).expect("convex");
            for circuit in [motor.magnetics.clone(), hot, motor.linearised().magnetics] {
                let share = 0.02 * circuit.inductance().smaller_eigenvalue() / 0.2e-3;
                let added = ADDED * share;
                let changed = circuit.with_series_inductance(added);
                for (d, q) in [(0.0, 0.0), (0.7, 0.2), (-0.5, 0.6), (0.1, -0.8)] {
                    let current = Dq::new(d, q) * motor.rated_current;
                    let flux = |of: &MagneticCircuit| of.core.flux_at(current + of.magnet).expect("convex");
                    let (one, other) = (flux(&circuit), flux(&changed));
                    let expected = one + Dq::new(added.d * current.d, added.q * current.q);
                    assert!((other - expected).norm() < 1e-11 * (1.0 + one.norm()), "{name} {current:?}");
                }
            }
        }
    }

    #[test]
    fn regress_absurd_flux_gives_numbers() {
        let circuit = built_in("paper-5k5").expect("built in").magnetics;
        for share in [-1.0, 1.0] {
            let changed = circuit.with_series_inductance(Dq::new(1e-5 * share, 1e-5 * share));
            for flux in [4.0, 1e3, 1e9] {
                let state = changed.state(Dq::new(flux, -flux), Heading::ZERO);
                assert!(
                    state.current.norm().is_finite() && state.inverse_inductance.determinant().is_finite()
                );
            }
        }
    }

    #[test]
    fn law_series_inductance_is_one_energy_and_adds_to_the_inductance() {
        let motor = built_in("paper-5k5").expect("built in");
        let hot = motor.magnetics.with_magnet(0.9).expect("convex");
        for circuit in [motor.magnetics, hot] {
            let changed = circuit.with_series_inductance(ADDED);
            let at = Heading::ZERO;
            let rest = circuit.rest(at);
            assert_eq!(changed.rest(at), rest);
            assert!(changed.state(rest, at).current.norm() < 1e-12);
            let l = changed.state(rest, at).inverse_inductance.inverse();
            assert!((l.xx - circuit.inductance().xx - ADDED.d).abs() < 1e-15);
            assert!((l.yy - circuit.inductance().yy - ADDED.q).abs() < 1e-15);
            let h = 1e-5;
            for flux in [rest + Dq::new(0.1, 0.05), rest + Dq::new(-0.2, 0.1), Dq::new(0.02, -0.3)] {
                let state = changed.state(flux, at);
                for (step, current, column) in [
                    (
                        Dq::new(h, 0.0),
                        state.current.d,
                        (state.inverse_inductance.xx, state.inverse_inductance.xy),
                    ),
                    (
                        Dq::new(0.0, h),
                        state.current.q,
                        (state.inverse_inductance.xy, state.inverse_inductance.yy),
                    ),
                ] {
                    let slope =
                        (changed.energy(flux + step, at) - changed.energy(flux - step, at)) / (2.0 * h);
                    assert!((slope - current).abs() < 1e-6 * (1.0 + current.abs()), "{flux:?}");
                    let change = (changed.state(flux + step, at).current
                        - changed.state(flux - step, at).current)
                        * (0.5 / h);
                    assert!((change - Dq::new(column.0, column.1)).norm() < 1e-6 * change.norm(), "{flux:?}");
                }
            }
        }
    }
}
