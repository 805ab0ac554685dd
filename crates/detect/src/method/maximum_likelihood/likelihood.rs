//! The most likely line inductances, given every sample of a train of pulses.
//!
//! A line's current in the direction s = ±1 of its pulse obeys
//! ```text
//! (L_k − s c_k i) di/dt = v − 2R i,    v = U − V_T while on,  −(U + V_D) afterwards, until i = 0
//! ```
//! from the instant t_s, common to all pulses, at which the drive really begins. White noise makes the likelihood a sum of
//! squares over {L_k, c_k, t_s}, k = AB, BC, CA. Its minimum is found by Gauss–Newton steps with Levenberg's damping; the
//! slopes ∂i/∂p are integrated along with i. Each line's pair (L_k, c_k) meets the others only in t_s, which is
//! eliminated: three 2×2 systems and one number.

#[cfg(test)]
mod tests;

use standstill_interface::Real;

/// What is known of a pulse and its samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PulseModel<T> {
    /// Voltage in V across the line while the pulse lasts.
    pub on: T,
    /// Voltage in V against the current afterwards.
    pub off: T,
    /// Resistance in Ω of the line.
    pub resistance: T,
    /// Length of the pulse in s.
    pub pulse: T,
    /// From one sample to the next in s, the first one interval after the start.
    pub interval: T,
}

/// What a current depends on: L in H, c in H/A, both of its line, and t_s in s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LineParameters<T> {
    pub inductance: T,
    pub slope: T,
    pub delay: T,
}

/// The current in A and its slopes over L, c and t_s.
#[derive(Clone, Copy, Debug)]
struct Flow<T> {
    current: T,
    slopes: [T; 3],
}

impl<T: Real> Flow<T> {
    fn plus(&self, rate: &Self, time: T) -> Self {
        Self {
            current: self.current + rate.current * time,
            slopes: core::array::from_fn(|k| self.slopes[k] + rate.slopes[k] * time),
        }
    }
}

impl<T: Real> PulseModel<T> {
    /// Calls `sample` with number, current and slopes of each sample while the current flows.
    pub fn follow(
        &self,
        p: &LineParameters<T>,
        forward: bool,
        count: usize,
        mut sample: impl FnMut(usize, T, [T; 3]),
    ) {
        let zero = T::zero();
        let sign = if forward { T::one() } else { -T::one() };
        let rate = |at: &Flow<T>, voltage: T| {
            let inductance = p.inductance - sign * p.slope * at.current;
            let f = (voltage - self.resistance * at.current) / inductance;
            let over_current = (f * sign * p.slope - self.resistance) / inductance;
            Flow {
                current: f,
                slopes: [
                    over_current * at.slopes[0] - f / inductance,
                    over_current * at.slopes[1] + f * sign * at.current / inductance,
                    over_current * at.slopes[2],
                ],
            }
        };
        // Later by dt is less by di/dt at the start.
        let start = -rate(&Flow { current: zero, slopes: [zero; 3] }, self.on).current;
        let mut at = Flow { current: zero, slopes: [zero, zero, start] };
        let mut now = p.delay;
        let mut voltage = self.on;
        for k in 0..count {
            let then = self.interval * T::of((k + 1) as f64);
            while now < then {
                let on = now < self.pulse;
                if !on {
                    voltage = -self.off;
                }
                let end = if on { then.min(self.pulse) } else { then };
                at = step(&at, end - now, |at| rate(at, voltage));
                now = end;
            }
            if at.current < zero {
                return;
            }
            if then >= p.delay {
                sample(k, at.current, at.slopes);
            }
        }
    }
}

/// One step of the classical Runge–Kutta method: its error is far below any sensor's at a twentieth of a pulse.
fn step<T: Real>(at: &Flow<T>, time: T, rate: impl Fn(&Flow<T>) -> Flow<T>) -> Flow<T> {
    let half = time / T::of(2.0);
    let k1 = rate(at);
    let k2 = rate(&at.plus(&k1, half));
    let k3 = rate(&at.plus(&k2, half));
    let k4 = rate(&at.plus(&k3, time));
    let sixth = time / T::of(6.0);
    at.plus(&k1, sixth).plus(&k2, sixth * T::of(2.0)).plus(&k3, sixth * T::of(2.0)).plus(&k4, sixth)
}

/// The answer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fit<T> {
    /// L_AB, L_BC, L_CA in H.
    pub inductance: [T; 3],
    /// c of the lines in H/A.
    pub slope: [T; 3],
    /// Covariance of the inductances in H².
    pub inductance_covariance: [[T; 3]; 3],
    /// Variances of the slopes in H²/A².
    pub slope_variance: [T; 3],
    /// Mean square of the residuals in A², corrected for what was fitted.
    pub variance: T,
    /// The part of it in A² that neighbours have in common beyond chance: noise has none, a model that does not fit has.
    pub misfit: T,
}

/// Normal equations in scaled parameters.
#[derive(Clone, Copy, Debug)]
struct Normal<T> {
    /// Of each line: JᵀJ over (L, c), upper triangle.
    block: [[T; 3]; 3],
    /// Of each line: with t_s.
    coupling: [[T; 2]; 3],
    delay: T,
    /// Jᵀr.
    right: [[T; 2]; 3],
    delay_right: T,
    squares: T,
    /// Sum of products of neighbouring residuals.
    products: T,
    count: T,
}

/// Curves to fit: by line; backward, forward; one sample per interval, in A.
pub(crate) type Curves<'a, T> = [[&'a [T]; 2]; 3];

/// Iterations; four are usual.
const ITERATIONS: usize = 12;

/// A fit, begun at these inductances in H and this delay in s.
///
/// `None` where the samples do not determine it.
pub(crate) fn fit<T: Real>(
    curves: &Curves<'_, T>,
    model: &PulseModel<T>,
    inductance: [T; 3],
    delay: T,
) -> Option<Fit<T>> {
    let mut at = inductance.map(|inductance| LineParameters { inductance, slope: T::zero(), delay });
    // Parameters in units of what changes a current by as much as itself.
    let units = {
        let mean = (inductance[0] + inductance[1] + inductance[2]) / T::of(3.0);
        let peak = model.on * model.pulse / mean;
        [mean, mean / peak, model.pulse]
    };
    let mut damping = T::of(1e-6);
    let mut normal = accumulate(curves, model, &at, units);
    for _ in 0..ITERATIONS {
        let (lines, shift, _) = solve(&normal, damping)?;
        let mut next = at;
        let mut largest = shift.abs();
        for (line, change) in next.iter_mut().zip(lines) {
            line.inductance = line.inductance + change[0] * units[0];
            line.slope = line.slope + change[1] * units[1];
            line.delay = line.delay + shift * units[2];
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
    let freedom = normal.count - T::of(7.0);
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
        slope_variance: inverse.slope.map(|entry| entry * variance * units[1] * units[1]),
        variance,
        misfit,
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
        coupling: [[zero; 2]; 3],
        delay: zero,
        right: [[zero; 2]; 3],
        delay_right: zero,
        squares: zero,
        products: zero,
        count: zero,
    };
    for (k, line) in curves.iter().enumerate() {
        for (forward, curve) in [false, true].into_iter().zip(line) {
            let mut last = zero;
            model.follow(&at[k], forward, curve.len(), |sample, current, slopes| {
                let residual = curve[sample] - current;
                n.products = n.products + residual * last;
                last = residual;
                let [l, c, t] = core::array::from_fn(|p| slopes[p] * units[p]);
                let [ll, lc, cc] = &mut n.block[k];
                (*ll, *lc, *cc) = (*ll + l * l, *lc + l * c, *cc + c * c);
                let [lt, ct] = &mut n.coupling[k];
                (*lt, *ct) = (*lt + l * t, *ct + c * t);
                let [lr, cr] = &mut n.right[k];
                (*lr, *cr) = (*lr + l * residual, *cr + c * residual);
                n.delay = n.delay + t * t;
                n.delay_right = n.delay_right + t * residual;
                n.squares = n.squares + residual * residual;
                n.count = n.count + T::one();
            });
        }
    }
    n
}

/// What the inverse of the normal matrix says of L and c.
struct Inverse<T> {
    inductance: [[T; 3]; 3],
    slope: [T; 3],
}

/// The step of (L, c) for each line, that of t_s, and the inverse, in scaled parameters.
#[allow(clippy::type_complexity)]
fn solve<T: Real>(n: &Normal<T>, damping: T) -> Option<([[T; 2]; 3], T, Inverse<T>)> {
    let zero = T::zero();
    let grown = T::one() + damping;
    // Per line: the inverse of its block, and that times the coupling and the right side.
    let mut inverse = [[zero; 3]; 3];
    let mut gain = [[zero; 2]; 3];
    let mut step = [[zero; 2]; 3];
    let (mut schur, mut right) = (n.delay * grown, n.delay_right);
    for k in 0..3 {
        let [ll, lc, cc] = n.block[k];
        let (ll, cc) = (ll * grown, cc * grown);
        let determinant = ll * cc - lc * lc;
        inverse[k] = [cc / determinant, -lc / determinant, ll / determinant];
        let [a, b, c] = inverse[k];
        let times = |[x, y]: [T; 2]| [a * x + b * y, b * x + c * y];
        gain[k] = times(n.coupling[k]);
        step[k] = times(n.right[k]);
        schur = schur - n.coupling[k][0] * gain[k][0] - n.coupling[k][1] * gain[k][1];
        right = right - n.coupling[k][0] * step[k][0] - n.coupling[k][1] * step[k][1];
    }
    let shift = right / schur;
    let positive = schur > zero && inverse.iter().all(|[a, _, c]| *a > zero && *c > zero);
    if !positive || !shift.is_finite() {
        return None;
    }
    for k in 0..3 {
        for p in 0..2 {
            step[k][p] = step[k][p] - gain[k][p] * shift;
        }
    }
    let of = |p: usize, diagonal: usize, k: usize, l: usize| {
        let own = if k == l { inverse[k][diagonal] } else { zero };
        own + gain[k][p] * gain[l][p] / schur
    };
    let inductance = core::array::from_fn(|k| core::array::from_fn(|l| of(0, 0, k, l)));
    let slope = core::array::from_fn(|k| of(1, 2, k, k));
    Some((step, shift, Inverse { inductance, slope }))
}
