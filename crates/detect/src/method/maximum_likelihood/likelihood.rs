//! The most likely line inductances, given every sample of a train of pulses.
//!
//! A line's current in the direction s = ±1 of its pulse obeys
//! ```text
//! (L_k − s c_k i) di/dt = v − 2R i,    v = U − V_T while on,  −(U + V_D) afterwards, until i = 0
//! ```
//! from the instant t_s, common to all pulses, at which the drive really begins. White noise makes the likelihood a sum of
//! squares over {L_k, c_k, t_s}, k = AB, BC, CA. Its minimum is found by Gauss–Newton steps with Levenberg's damping; the
//! slopes ∂i/∂p are integrated along with i. Each line's pair (L_k, c_k) meets the others only in what is common to all,
//! which is eliminated: three 2×2 systems and one of the common parameters.
//!
//! Sensors of a bandwidth f_c see `y` instead of `i`, `τ dy/dt = i − y`, with τ = 1/(2π f_c): see [`lag`]. What their data
//! sheet says of τ is good to some 20 %; for all channels alike that is a second common parameter. While the current
//! rises it is nearly the same as t_s, but it delays the end of the pulse as well, which t_s does not.

mod lag;
#[cfg(test)]
mod tests;

use standstill_interface::Real;

use lag::{Memory, Response};

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
    /// How long in s after an edge of the legs samples are left out: what the edge makes the wires pick up decays.
    pub blank: T,
}

/// What a current depends on: L in H, c in H/A, both of its line, and t_s in s; and how it is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LineParameters<T> {
    pub inductance: T,
    pub slope: T,
    pub delay: T,
    /// τ of the sensors in s; zero: they see the current as it is.
    pub lag: T,
    /// How much later in s than its trigger each sample is taken.
    pub late: T,
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
    /// Whether a sample at `time` in s is near the edge that begins or the one that ends the pulse.
    fn near_an_edge(&self, time: T, delay: T) -> bool {
        let since = |edge: T| time >= edge && time - edge < self.blank;
        self.blank > T::zero() && (since(delay) || since(self.pulse))
    }

    /// Calls `sample` with number, current and its slopes over L, c, t_s and τ, of each sample while the current flows.
    pub fn follow(
        &self,
        p: &LineParameters<T>,
        forward: bool,
        count: usize,
        mut sample: impl FnMut(usize, T, [T; 4]),
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
        let mut memory = Memory::new();
        let mut response = Response::of(zero);
        for k in 0..count {
            let then = self.interval * T::of((k + 1) as f64) + p.late;
            while now < then {
                let on = now < self.pulse;
                if !on {
                    voltage = -self.off;
                }
                let end = if on { then.min(self.pulse) } else { then };
                let (next, begin) = step(&at, end - now, |at| rate(at, voltage));
                if p.lag > zero {
                    response = response.at((end - now) / p.lag);
                    memory.follow(&response, &at, &begin, &next, end - now);
                }
                (at, now) = (next, end);
            }
            if at.current < zero {
                return;
            }
            if then >= p.delay && !self.near_an_edge(then, p.delay) {
                if p.lag > zero {
                    sample(k, memory.seen.current, memory.slopes(p.lag));
                } else {
                    let [l, c, t] = at.slopes;
                    sample(k, at.current, [l, c, t, zero]);
                }
            }
        }
    }
}

/// One step of the classical Runge–Kutta method, and the rate at its beginning: its error is far below any sensor's at a
/// twentieth of a pulse.
fn step<T: Real>(at: &Flow<T>, time: T, rate: impl Fn(&Flow<T>) -> Flow<T>) -> (Flow<T>, Flow<T>) {
    let half = time / T::of(2.0);
    let k1 = rate(at);
    let k2 = rate(&at.plus(&k1, half));
    let k3 = rate(&at.plus(&k2, half));
    let k4 = rate(&at.plus(&k3, time));
    let sixth = time / T::of(6.0);
    let end =
        at.plus(&k1, sixth).plus(&k2, sixth * T::of(2.0)).plus(&k3, sixth * T::of(2.0)).plus(&k4, sixth);
    (end, k1)
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
    /// What is added to each inductance in H where the sensors of its line alone lag by a second more.
    pub lag_slope: [T; 3],
    /// τ of the sensors in s.
    #[cfg_attr(not(test), allow(dead_code, reason = "tests ask for it"))]
    pub lag: T,
}

/// Normal equations in scaled parameters.
#[derive(Clone, Copy, Debug)]
struct Normal<T> {
    /// Of each line: JᵀJ over (L, c), upper triangle.
    block: [[T; 3]; 3],
    /// Of each line: with t_s and with τ.
    coupling: [[[T; 2]; 2]; 3],
    /// Of t_s and τ: upper triangle.
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

/// A fit, begun at these parameters.
///
/// `None` where the samples do not determine it.
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
        slope_variance: inverse.slope.map(|entry| entry * variance * units[1] * units[1]),
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
    for (k, line) in curves.iter().enumerate() {
        for (forward, curve) in [false, true].into_iter().zip(line) {
            let mut last = zero;
            model.follow(&at[k], forward, curve.len(), |sample, current, slopes| {
                let residual = curve[sample] - current;
                n.products = n.products + residual * last;
                last = residual;
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
            });
        }
    }
    n
}

/// What the inverse of the normal matrix says of L and c.
struct Inverse<T> {
    inductance: [[T; 3]; 3],
    slope: [T; 3],
    /// What a change of τ of one line alone does to its L.
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
