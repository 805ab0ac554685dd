//! The maximum-likelihood line inductances, from all samples of a train of pulses.
//!
//! A line's current in the direction s = ±1 of its pulse obeys
//! ```text
//! (L_k − s c_k i) di/dt = v − 2R i,    v = U − V_T while on,  −(U + V_D) afterwards, until i = 0
//! ```
//! from the instant t_s, common to all pulses, at which the drive actually begins. With white noise the negative
//! log-likelihood is a sum of squares over {L_k, c_k, t_s}, k = AB, BC, CA. Its minimum is found by Gauss–Newton steps
//! with Levenberg's damping; the derivatives ∂i/∂p are integrated along with i. Each line's pair (L_k, c_k) is coupled
//! to the others only by the common parameters, so elimination leaves three 2×2 systems and one system of the common
//! parameters.
//!
//! Sensors with a bandwidth f_c read `y` instead of `i`, `τ dy/dt = i − y`, with τ = 1/(2π f_c): see [`lag`]. Their
//! data sheet gives τ within some 20 %, and its deviation is nearly equal in all channels, so it is a second common
//! parameter. While the current rises, τ acts nearly like t_s, but it also delays the end of the pulse, which t_s does
//! not.

mod both;
mod current;
mod lag;
#[cfg(test)]
mod tests;

use standstill_interface::Real;

use super::MOST_SAMPLES;
use current::Way;
pub(crate) use current::{LineParameters, PulseModel};

/// The answer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fit<T> {
    /// L_AB, L_BC, L_CA in H.
    pub inductance: [T; 3],
    /// c of the lines in H/A.
    pub slope: [T; 3],
    /// Covariance of the inductances in H².
    pub inductance_covariance: [[T; 3]; 3],
    /// Variances of the slopes in H²/A² by the noise part of the residuals. The part by `misfit` averages out less;
    /// code that reads a pole must add it once.
    pub slope_variance: [T; 3],
    /// Mean square of the residuals in A², corrected for the number of fitted parameters.
    pub variance: T,
    /// The part of it in A² that neighbours have in common beyond chance: noise has none, a model that does not fit has.
    pub misfit: T,
    /// Shift of each inductance in H where the sensors of its line alone lag by a second more.
    pub lag_slope: [T; 3],
    /// τ of the sensors in s.
    #[cfg_attr(not(test), allow(dead_code, reason = "tests ask for it"))]
    pub lag: T,
}

/// Normal equations in scaled parameters.
#[derive(Clone, Copy, Debug)]
struct Normal<T> {
    /// The upper triangle of JᵀJ over (L, c), for each line.
    block: [[T; 3]; 3],
    /// The entries of JᵀJ between (L, c) and t_s, τ, for each line.
    coupling: [[[T; 2]; 2]; 3],
    /// The upper triangle of JᵀJ over t_s and τ.
    common: [T; 3],
    /// Jᵀr.
    right: [[T; 2]; 3],
    common_right: [T; 2],
    squares: T,
    /// Sum of products of neighbouring residuals.
    products: T,
    count: T,
}

/// Curves to fit: by line; backward, forward; one sample per interval, in A.
pub(crate) type Curves<'a, T> = [[&'a [T]; 2]; 3];

/// Iterations; four are usual.
const ITERATIONS: usize = 12;

/// The least share of their nominal τ that the sensors are taken to have.
const LEAST_LAG: f64 = 0.125;

/// Fits the samples, starting from these parameters.
///
/// `None` if the samples do not determine the parameters.
pub(crate) fn fit<T: Real>(
    curves: &Curves<'_, T>,
    model: &PulseModel<T>,
    start: [LineParameters<T>; 3],
) -> Option<Fit<T>> {
    let mut at = start;
    let least_lag = start[0].lag * T::of(LEAST_LAG);
    // Parameters in units of what changes a current by as much as itself.
    let units = {
        let [a, b, c] = start.map(|line| line.inductance);
        let mean = (a + b + c) / T::of(3.0);
        let peak = model.on * model.pulse / mean;
        [mean, mean / peak, model.pulse]
    };
    let mut damping = T::of(1e-6);
    let mut normal = accumulate(curves, model, &at, units);
    for _ in 0..ITERATIONS {
        let (lines, [shift, lag], _) = solve(&normal, damping)?;
        let mut next = at;
        // Where noise hides how much the sensors lag, it is no news that the least is not little enough.
        let lag = (at[0].lag + lag * units[2]).max(least_lag);
        let mut largest = shift.abs().max((lag - at[0].lag).abs() / units[2]);
        for (line, change) in next.iter_mut().zip(lines) {
            line.inductance = line.inductance + change[0] * units[0];
            line.slope = line.slope + change[1] * units[1];
            line.delay = line.delay + shift * units[2];
            line.lag = lag;
            largest = largest.max(change[0].abs()).max(change[1].abs());
        }
        if !largest.is_finite() {
            return None;
        }
        let trial = accumulate(curves, model, &next, units);
        // A line without inductance answers with no current at all and has no residuals either.
        let such_a_line = next.iter().all(|line| line.inductance > T::zero());
        if such_a_line && trial.squares <= normal.squares {
            (at, normal) = (next, trial);
            damping = damping / T::of(10.0);
        } else {
            damping = damping * T::of(100.0);
        }
        // In single precision the sum of squares is noise before the steps are.
        if largest < T::of(1e-7).max(T::epsilon() * T::of(16.0)) {
            break;
        }
    }
    let (_, _, inverse) = solve(&normal, T::zero())?;
    let freedom = normal.count - T::of(if least_lag > T::zero() { 8.0 } else { 7.0 });
    if freedom <= T::zero() {
        return None;
    }
    let variance = normal.squares / freedom;
    // Products of white noise have a mean of zero with the standard deviation variance/√n.
    let chance = T::of(4.0) * variance * normal.count.sqrt();
    let misfit = ((normal.products - chance) / normal.count).max(T::zero());
    let inductance_covariance =
        inverse.inductance.map(|row| row.map(|entry| entry * variance * units[0] * units[0]));
    Some(Fit {
        inductance: at.map(|line| line.inductance),
        slope: at.map(|line| line.slope),
        inductance_covariance,
        slope_variance: inverse.slope.map(|entry| entry * (variance - misfit) * units[1] * units[1]),
        variance,
        misfit,
        lag_slope: inverse.lag.map(|gain| gain * units[0] / units[2]),
        lag: at[0].lag,
    })
}

fn accumulate<T: Real>(
    curves: &Curves<'_, T>,
    model: &PulseModel<T>,
    at: &[LineParameters<T>; 3],
    units: [T; 3],
) -> Normal<T> {
    let zero = T::zero();
    let mut n = Normal {
        block: [[zero; 3]; 3],
        coupling: [[[zero; 2]; 2]; 3],
        common: [zero; 3],
        right: [[zero; 2]; 3],
        common_right: [zero; 2],
        squares: zero,
        products: zero,
        count: zero,
    };
    // Sums are in the order of the curves, whatever is computed beside each other.
    let mut forwards = [(0, zero, [zero; 4]); MOST_SAMPLES];
    for (k, line) in curves.iter().enumerate() {
        let [mut backward, mut forward] = line.map(|curve| Residuals { curve, last: zero });
        let mut kept = 0;
        model.follow(&at[k], line[0].len(), |sample, way, current, slopes| match way {
            Way::Backward => backward.add(&mut n, k, units, (sample, current, slopes)),
            Way::Forward => {
                forwards[kept] = (sample, current, slopes);
                kept += 1;
            }
        });
        for sample in &forwards[..kept] {
            forward.add(&mut n, k, units, *sample);
        }
    }
    n
}

/// Residuals of one curve against the model.
struct Residuals<'a, T> {
    curve: &'a [T],
    /// Residual of the sample before.
    last: T,
}

impl<T: Real> Residuals<'_, T> {
    /// Adds a sample of line `k`: its number, the model's current and the slopes of that.
    #[inline]
    fn add(&mut self, n: &mut Normal<T>, k: usize, units: [T; 3], sample: (usize, T, [T; 4])) {
        let (sample, current, slopes) = sample;
        let residual = self.curve[sample] - current;
        n.products = n.products + residual * self.last;
        self.last = residual;
        let [l, c, t, m] = core::array::from_fn(|p| slopes[p] * units[p.min(2)]);
        let [ll, lc, cc] = &mut n.block[k];
        (*ll, *lc, *cc) = (*ll + l * l, *lc + l * c, *cc + c * c);
        for ([lp, cp], p) in n.coupling[k].iter_mut().zip([t, m]) {
            (*lp, *cp) = (*lp + l * p, *cp + c * p);
        }
        let [lr, cr] = &mut n.right[k];
        (*lr, *cr) = (*lr + l * residual, *cr + c * residual);
        let [tt, tm, mm] = &mut n.common;
        (*tt, *tm, *mm) = (*tt + t * t, *tm + t * m, *mm + m * m);
        let [tr, mr] = &mut n.common_right;
        (*tr, *mr) = (*tr + t * residual, *mr + m * residual);
        n.squares = n.squares + residual * residual;
        n.count = n.count + T::one();
    }
}

/// Blocks of the inverse of the normal matrix for L and c.
struct Inverse<T> {
    inductance: [[T; 3]; 3],
    slope: [T; 3],
    /// Derivative of a line's L by τ of that line alone.
    lag: [T; 3],
}

/// A step of (L, c) for each line, one of t_s and τ, and the inverse of the normal equations, in scaled parameters.
type Solution<T> = ([[T; 2]; 3], [T; 2], Inverse<T>);

/// Solves the normal equations.
fn solve<T: Real>(n: &Normal<T>, damping: T) -> Option<Solution<T>> {
    let zero = T::zero();
    let grown = T::one() + damping;
    // Per line: the inverse of its block, and that times the couplings and the right side.
    let mut inverse = [[zero; 3]; 3];
    let mut gain = [[[zero; 2]; 2]; 3];
    let mut step = [[zero; 2]; 3];
    let [mut tt, mut tm, mut mm] = n.common;
    // Without lag nothing depends on it: a step of zero.
    mm = if mm > zero { mm * grown } else { T::one() };
    tt = tt * grown;
    let [mut right, mut lag_right] = n.common_right;
    for k in 0..3 {
        let [ll, lc, cc] = n.block[k];
        let (ll, cc) = (ll * grown, cc * grown);
        let determinant = ll * cc - lc * lc;
        inverse[k] = [cc / determinant, -lc / determinant, ll / determinant];
        let [a, b, c] = inverse[k];
        let times = |[x, y]: [T; 2]| [a * x + b * y, b * x + c * y];
        gain[k] = n.coupling[k].map(times);
        step[k] = times(n.right[k]);
        let less = |from: T, [x, y]: [T; 2], [u, v]: [T; 2]| from - x * u - y * v;
        let [delay, lag] = n.coupling[k];
        tt = less(tt, delay, gain[k][0]);
        tm = less(tm, delay, gain[k][1]);
        mm = less(mm, lag, gain[k][1]);
        right = less(right, delay, step[k]);
        lag_right = less(lag_right, lag, step[k]);
    }
    // τ is eliminated from the two common parameters as well.
    let lag_of_delay = tm / mm;
    let schur = tt - tm * lag_of_delay;
    let shift = (right - lag_right * lag_of_delay) / schur;
    let lag = (lag_right - tm * shift) / mm;
    let positive = schur > zero && mm > zero && inverse.iter().all(|[a, _, c]| *a > zero && *c > zero);
    if !positive || !shift.is_finite() || !lag.is_finite() {
        return None;
    }
    for k in 0..3 {
        for p in 0..2 {
            step[k][p] = step[k][p] - gain[k][0][p] * shift - gain[k][1][p] * lag;
        }
    }
    let of = |p: usize, diagonal: usize, k: usize, l: usize| {
        let own = if k == l { inverse[k][diagonal] } else { zero };
        let by_delay = |k: usize| gain[k][0][p] - gain[k][1][p] * lag_of_delay;
        own + by_delay(k) * by_delay(l) / schur + gain[k][1][p] * gain[l][1][p] / mm
    };
    let inductance = core::array::from_fn(|k| core::array::from_fn(|l| of(0, 0, k, l)));
    let slope = core::array::from_fn(|k| of(1, 2, k, k));
    Some((step, [shift, lag], Inverse { inductance, slope, lag: gain.map(|gain| gain[1][0]) }))
}
