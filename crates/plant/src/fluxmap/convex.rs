//! The nearest convex energy to a map.
//!
//! An integrator cannot follow an energy whose Hessian has a negative eigenvalue: more current would make less flux.
//! Noise or a typing error can bend the nearest energy that far. In this case, the nearest convex energy is sought: its
//! Hessians H, at twice as many points along each axis as it has functions, have no eigenvalue below a floor,
//! ```text
//! |A c − y|² + λ cᵀP c → min,   G c = z,   each 2 × 2 matrix of z at least the floor
//! ```
//! by alternating directions (Boyd et al. 2011, doi 10.1561/2200000016): c solves a system with the band of the fit,
//! and z is each Hessian with its eigenvalues raised to the floor. A general conic solver would need five million more
//! numbers; the crate that was tried (clarabel) adds over a minute of processor time to a cold build.

use nalgebra::DMatrix;
use standstill_numeric::hypot;

use super::co_energy::CoEnergy;
use super::project::{Fit, Scaled};

/// Floors of the eigenvalues as shares of their median, the least that suffices first: where inductances are much smaller
/// than elsewhere, the current bends more sharply over the flux than the surface that is simulated can follow.
pub(super) const FLOORS: [f64; 5] = [0.02, 0.05, 0.1, 0.2, 0.4];

/// Largest number of iterations.
const MOST: usize = 1500;
/// Number of iterations after which the weight of both halves is adjusted.
const BALANCE: usize = 40;

/// Hessians at the places, over scaled currents: along d, mixed (times √2, so that sums of squares are those of matrices) and
/// along q.
type Hessians = [DMatrix<f64>; 3];

/// Returns the nearest energy whose eigenvalues are at least this share of the median, from one that is not.
pub(super) fn nearest(fit: &Fit, lambda: f64, start: &CoEnergy, share: f64) -> Option<CoEnergy> {
    let scaled = fit.scaled();
    let floor = share * median_eigenvalue(&hessians(&scaled, &start.coefficients));
    if floor.is_nan() || floor <= 0.0 {
        return None;
    }
    let coefficients = alternate(fit, lambda, &scaled, &start.coefficients, floor)?;
    Some(CoEnergy { coefficients, ..start.clone() })
}

fn alternate(
    fit: &Fit,
    lambda: f64,
    scaled: &Scaled,
    start: &DMatrix<f64>,
    floor: f64,
) -> Option<DMatrix<f64>> {
    let mut weight = 0.1 * fit.weight_of(scaled);
    let mut factor = fit.with_hessians(lambda, scaled, weight)?;
    let mut c = start.clone();
    let mut z = raised(hessians(scaled, &c), floor);
    let mut dual: Hessians = z.clone().map(|m| m * 0.0);
    for step in 1..=MOST {
        let target: Hessians = std::array::from_fn(|k| &z[k] - &dual[k]);
        c = fit.solve_with(&factor, &(back(scaled, &target) * weight));
        let h = hessians(scaled, &c);
        let before = z.clone();
        z = raised(std::array::from_fn(|k| &h[k] + &dual[k]), floor);
        let (mut off, mut moved) = (0.0_f64, 0.0_f64);
        for k in 0..3 {
            let gap = &h[k] - &z[k];
            off = off.max(gap.amax());
            moved = moved.max((&z[k] - &before[k]).amax());
            dual[k] += gap;
        }
        // The Hessians are then at most this below their floor.
        if off < 0.2 * floor && moved < 0.2 * floor {
            break;
        }
        if step % BALANCE == 0 && (off > 5.0 * moved || moved > 5.0 * off) {
            let change = if off > moved { 3.0 } else { 1.0 / 3.0 };
            weight *= change;
            dual = dual.map(|dual| dual / change);
            factor = fit.with_hessians(lambda, scaled, weight)?;
        }
    }
    Some(c)
}

fn hessians(scaled: &Scaled, c: &DMatrix<f64>) -> Hessians {
    let (d, q) = (&scaled.d, &scaled.q);
    let sum = |order_d: usize, order_q: usize| &d[order_d] * c * q[order_q].transpose();
    [sum(2, 0), sum(1, 1) * std::f64::consts::SQRT_2, sum(0, 2)]
}

/// Returns the transposed of [`hessians`].
fn back(scaled: &Scaled, [dd, dq, qq]: &Hessians) -> DMatrix<f64> {
    let (d, q) = (&scaled.d, &scaled.q);
    let sum = |h: &DMatrix<f64>, order_d: usize, order_q: usize| d[order_d].tr_mul(h) * &q[order_q];
    sum(dd, 2, 0) + sum(dq, 1, 1) * std::f64::consts::SQRT_2 + sum(qq, 0, 2)
}

/// Returns the mean, half difference and length: the eigenvalues are mean ± length.
fn parts(dd: f64, dq: f64, qq: f64) -> (f64, f64, f64, f64) {
    let (mean, half, cross) = ((dd + qq) / 2.0, (dd - qq) / 2.0, dq * std::f64::consts::FRAC_1_SQRT_2);
    (mean, half, cross, hypot(half, cross))
}

/// Returns each matrix with its eigenvalues raised to the floor.
fn raised([mut dd, mut dq, mut qq]: Hessians, floor: f64) -> Hessians {
    for k in 0..dd.len() {
        let (mean, half, cross, length) = parts(dd[k], dq[k], qq[k]);
        if mean - length >= floor {
            continue;
        }
        let (high, low) = ((mean + length).max(floor), floor);
        let share = if length > 0.0 { (high - low) / 2.0 / length } else { 0.0 };
        let mean = (high + low) / 2.0;
        (dd[k], qq[k]) = (mean + share * half, mean - share * half);
        dq[k] = share * cross * std::f64::consts::SQRT_2;
    }
    [dd, dq, qq]
}

fn median_eigenvalue([dd, dq, qq]: &Hessians) -> f64 {
    let low = |k: usize| {
        let (mean, _, _, length) = parts(dd[k], dq[k], qq[k]);
        mean - length
    };
    let mut all: Vec<f64> = (0..dd.len()).map(low).collect();
    all.sort_by(f64::total_cmp);
    all[all.len() / 2]
}
