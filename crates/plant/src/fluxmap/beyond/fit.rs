//! Algebraic cores fitted to a map: the laws that continue a side without data.
//!
//! For given exponents, an [`Algebraic`] core is linear in its factors: currents are sums of known functions of the
//! flux, with factors that must not be negative. Iron bridges add three non-linear numbers: ψ_n, k_q and the flux at
//! which the bridges saturate. An outer search by steps finds these. Fluxes and currents are scaled by their largest
//! values during the fit.

use nalgebra::{DMatrix, DVector};
use standstill_interface::Dq;
use standstill_numeric::{exp, power};

use crate::{Algebraic, IronBridge};

/// A core that was fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FittedCore {
    /// The core.
    pub core: Algebraic,
    /// rms distance of its currents from the map's, over the largest current of the map.
    pub distance: f64,
}

/// A flux in Wb and its current in A.
pub(super) type Point = (Dq<f64>, Dq<f64>);

/// Exponents that are tried for each axis.
const OWN: [u8; 10] = [1, 2, 3, 4, 5, 6, 7, 8, 10, 12];
/// Exponents that are tried for the cross-coupling.
const CROSS: [u8; 4] = [0, 1, 2, 3];
/// And of the conductance of a bridge.
const BRIDGE: [u8; 4] = [1, 2, 4, 6];

/// Factors of a core: a_d0, a_dd, a_q0, a_qq, a_dq, i_f, a_b.
const FACTORS: usize = 7;

/// S, T, U and V.
type Exponents = [u8; 4];

/// Parameters of a bridge that enter nonlinearly: ψ_n, ln k_q, ln a_bp, and its exponent.
#[derive(Clone, Copy)]
struct Bridge {
    numbers: [f64; 3],
    exponent: u8,
}

/// A core in shares of the largest flux and current.
#[derive(Clone, Copy)]
struct Shape {
    exponents: Exponents,
    bridge: Option<Bridge>,
    factors: [f64; FACTORS],
    /// Mean square distance of a component of the current.
    square: f64,
}

/// Data that cores are fitted to.
pub(super) struct Data {
    points: Vec<Point>,
    flux: f64,
    current: f64,
}

impl Data {
    /// Scales points to their largest flux and current; none if all fluxes or all currents are zero.
    pub(super) fn new(points: &[Point]) -> Option<Self> {
        let flux = points.iter().map(|(flux, _)| flux.norm()).fold(0.0, f64::max);
        let current = points.iter().map(|(_, current)| current.norm()).fold(0.0, f64::max);
        let points = points.iter().map(|(psi, i)| (*psi * (1.0 / flux), *i * (1.0 / current))).collect();
        (flux > 0.0 && current > 0.0).then_some(Self { points, flux, current })
    }

    /// Cores without bridges, one for each set of exponents.
    pub(super) fn plain(&self) -> Vec<FittedCore> {
        let mut fits = Vec::new();
        for s in OWN {
            for t in OWN {
                for u in CROSS {
                    fits.extend(CROSS.iter().filter_map(|v| self.linear([s, t, u, *v], None)));
                }
            }
        }
        fits.iter().map(|shape| self.core(shape)).collect()
    }

    /// Cores with bridges: those met on the way to the best exponents, from some of either kind.
    pub(super) fn bridged(&self) -> Vec<FittedCore> {
        let mut fits = Vec::new();
        for exponent in BRIDGE {
            let mut exponents = [4, 6, 1, 1];
            let mut best = self.with_bridge(exponents, exponent);
            fits.extend(best);
            // One exponent at a time to a neighbouring value, until none is better.
            while let Some(better) = self.neighbours(exponents, exponent, best, &mut fits) {
                exponents = better.exponents;
                best = Some(better);
            }
        }
        fits.iter().map(|shape| self.core(shape)).collect()
    }

    fn neighbours(
        &self,
        exponents: Exponents,
        bridge: u8,
        best: Option<Shape>,
        fits: &mut Vec<Shape>,
    ) -> Option<Shape> {
        let mut better = None;
        for (axis, values) in [&OWN[..], &OWN[..], &CROSS[..], &CROSS[..]].into_iter().enumerate() {
            let now = values.iter().position(|value| *value == exponents[axis])?;
            for next in [now.checked_sub(1), Some(now + 1)].into_iter().flatten() {
                let Some(value) = values.get(next) else { continue };
                let mut exponents = exponents;
                exponents[axis] = *value;
                let Some(fit) = self.with_bridge(exponents, bridge) else { continue };
                fits.push(fit);
                // A gain of less than a thousandth is none.
                if better.or(best).is_none_or(|best: Shape| fit.square < 0.999 * best.square) {
                    better = Some(fit);
                }
            }
        }
        better
    }

    /// Returns the best ψ_n, k_q and a_bp for these exponents. The search takes steps along each of the three and
    /// halves them when no step improves the fit.
    fn with_bridge(&self, exponents: Exponents, exponent: u8) -> Option<Shape> {
        let at = |numbers| self.linear(exponents, Some(Bridge { numbers, exponent }));
        let starts = [0.4, 0.8].into_iter().flat_map(|flux| [0.0, 3.0].map(|bend| [flux, -2.0, bend]));
        let mut best = starts.filter_map(at).min_by(|a, b| a.square.total_cmp(&b.square))?;
        let mut steps = [0.2, 1.0, 1.0];
        while steps[0] > 5e-3 {
            let mut found = false;
            for axis in 0..3 {
                for sign in [-1.0, 1.0] {
                    let Some(Bridge { mut numbers, .. }) = best.bridge else { continue };
                    numbers[axis] += sign * steps[axis];
                    let allowed = (-1.0..=2.0).contains(&numbers[0])
                        && (-6.0..=2.0).contains(&numbers[1])
                        && (-6.0..=12.0).contains(&numbers[2]);
                    if !allowed {
                        continue;
                    }
                    if let Some(next) = at(numbers).filter(|next| next.square < best.square) {
                        (best, found) = (next, true);
                    }
                }
            }
            if !found {
                steps = steps.map(|step| step / 2.0);
            }
        }
        Some(best)
    }

    /// Returns the factors for these exponents by least squares, none of them negative; none if they are not
    /// identifiable.
    fn linear(&self, exponents: Exponents, bridge: Option<Bridge>) -> Option<Shape> {
        let mut normal = [[0.0; FACTORS]; FACTORS];
        let mut right = [0.0; FACTORS];
        let mut own = 0.0;
        for (flux, current) in &self.points {
            for (row, value) in functions(*flux, exponents, bridge).into_iter().zip([current.d, current.q]) {
                own += value * value;
                for a in 0..FACTORS {
                    right[a] += row[a] * value;
                    for b in 0..=a {
                        normal[a][b] += row[a] * row[b];
                    }
                }
            }
        }
        let used = if bridge.is_some() { FACTORS } else { FACTORS - 1 };
        let (factors, gain) = not_negative(&normal, &right, used)?;
        let square = (own - gain).max(0.0) / (2.0 * self.points.len() as f64);
        Some(Shape { exponents, bridge, factors, square })
    }

    /// Returns the core in Wb and A.
    fn core(&self, shape: &Shape) -> FittedCore {
        let [s, t, u, v] = shape.exponents;
        let [d, dd, q, qq, cross, magnet, bridge] = shape.factors;
        let per = |exponent: u8| self.current / power(self.flux, exponent);
        let bridge = shape.bridge.map(|Bridge { numbers: [flux, share, bend], exponent }| IronBridge {
            strength: bridge * per(exponent + 1),
            saturation: exp(bend) / power(self.flux, exponent),
            q_share: exp(share),
            magnet_flux: flux * self.flux,
            exponent,
        });
        let core = Algebraic {
            d: d * per(1),
            dd: dd * per(s + 1),
            d_exponent: s,
            q: q * per(1),
            qq: qq * per(t + 1),
            q_exponent: t,
            cross: cross * per(u + v + 3),
            cross_d_exponent: u,
            cross_q_exponent: v,
            magnet_current: magnet * self.current,
            bridge,
        };
        FittedCore { core, distance: shape.square.sqrt() }
    }
}

/// Returns the contribution of each factor to i_d and to i_q at a flux.
fn functions(flux: Dq<f64>, [s, t, u, v]: Exponents, bridge: Option<Bridge>) -> [[f64; FACTORS]; 2] {
    let (x, y) = (flux.d.abs(), flux.q.abs());
    let cross_d = power(x, u) * power(y, v + 2) * flux.d / f64::from(v + 2);
    let cross_q = power(x, u + 2) * power(y, v) * flux.q / f64::from(u + 2);
    let [ribs_d, ribs_q] = bridge.map_or([0.0; 2], |Bridge { numbers: [magnet, share, bend], exponent }| {
        let (b, k) = (flux.d - magnet, exp(share));
        let p = power((b * b + k * flux.q * flux.q).sqrt(), exponent);
        let g = p / (1.0 + exp(bend) * p);
        [g * b, g * k * flux.q]
    });
    [
        [flux.d, power(x, s) * flux.d, 0.0, 0.0, cross_d, -1.0, ribs_d],
        [0.0, 0.0, flux.q, power(y, t) * flux.q, cross_q, 0.0, ribs_q],
    ]
}

/// Returns the non-negative factors of least squares, and the reduction of the sum of squares. While some factors are
/// negative, the most negative one is set to zero. `normal` is filled below its diagonal.
fn not_negative(
    normal: &[[f64; FACTORS]; FACTORS],
    right: &[f64; FACTORS],
    used: usize,
) -> Option<([f64; FACTORS], f64)> {
    let mut chosen: Vec<usize> = (0..used).filter(|k| normal[*k][*k] > 0.0).collect();
    // Of length one, so that what is nearly dependent is seen whatever its size.
    let scale = |k: usize| normal[k][k].sqrt();
    while !chosen.is_empty() {
        let matrix = DMatrix::from_fn(chosen.len(), chosen.len(), |a, b| {
            let (a, b) = (chosen[a.max(b)], chosen[a.min(b)]);
            normal[a][b] / (scale(a) * scale(b)) + if a == b { 1e-12 } else { 0.0 }
        });
        let vector = DVector::from_fn(chosen.len(), |a, _| right[chosen[a]] / scale(chosen[a]));
        let solution = matrix.cholesky()?.solve(&vector);
        if solution.min() >= 0.0 {
            let mut factors = [0.0; FACTORS];
            for (a, k) in chosen.iter().enumerate() {
                factors[*k] = solution[a] / scale(*k);
            }
            return Some((factors, solution.dot(&vector)));
        }
        chosen.remove(solution.imin());
    }
    None
}
