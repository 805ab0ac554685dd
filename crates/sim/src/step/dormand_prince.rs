//! The Dormand–Prince method of order 5(4): one step over a time in which the solution is smooth.
//!
//! The coefficients are from Hairer, Nørsett and Wanner, *Solving Ordinary Differential Equations I*, section II.6
//! (DOPRI5).

use std::array::from_fn;

use standstill_numeric::Lane;

/// Number of derivatives that a step evaluates: six before its end and one at its end.
pub const STAGES: usize = 7;

/// Stages of the method. Each stage has the share of the step at which the derivative is evaluated, and the weights of the previous
/// derivatives in the state at that time.
const STAGE: [(f64, [f64; STAGES - 1]); STAGES] = [
    (0.0, [0.0; 6]),
    (0.2, [1.0 / 5.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
    (0.3, [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0]),
    (0.8, [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0]),
    (8.0 / 9.0, [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0]),
    (1.0, [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0]),
    (1.0, [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0]),
];

/// One attempted step of the length `h` from the state `start`, for one machine or several side by side.
#[derive(Clone, Copy, Debug)]
pub struct Attempt<const N: usize, T = f64> {
    /// Length of the step in s.
    pub h: T,
    /// State at the beginning.
    pub start: [T; N],
    /// State at the end, computed with order 5.
    pub end: [T; N],
    /// Time derivatives of the state at the seven stages. The first stage is at the beginning of the step, the last one at its end.
    pub slopes: [[T; N]; STAGES],
}

impl<const N: usize, T: Lane> Attempt<N, T> {
    /// Makes a step of `h` seconds from a state. [`Self::take`] then computes it.
    #[inline(always)]
    pub fn new(start: [T; N], h: T) -> Self {
        Self { h, start, end: start, slopes: [[T::of(0.0); N]; STAGES] }
    }

    /// Computes the step. `derivative` returns the time derivative of a state at a time in s. `t` is the time in s at the beginning of
    /// the step.
    #[inline(always)]
    #[must_use]
    pub fn take(mut self, mut derivative: impl FnMut(T, &[T; N]) -> [T; N], t: T) -> Self {
        // The derivative is called at one place only, so that the compiler inlines it into the loop.
        for stage in 0..STAGES {
            let (share, weights) = STAGE[stage];
            let y = if stage == 0 { self.start } else { self.after(&weights) };
            self.slopes[stage] = derivative(t + self.h * share, &y);
            self.end = y;
        }
        self
    }

    /// Returns the state at the beginning plus `h` times the sum of the stages' derivatives with these weights.
    #[inline(always)]
    fn after(&self, weights: &[f64; STAGES - 1]) -> [T; N] {
        from_fn(|n| {
            let mut way = self.slopes[0][n] * weights[0];
            for (slope, weight) in self.slopes.iter().zip(weights).skip(1) {
                if *weight != 0.0 {
                    way = way + slope[n] * *weight;
                }
            }
            self.start[n] + self.h * way
        })
    }

    /// Returns the largest component of the error estimate relative to its tolerance. The step is acceptable if the value is at most 1.
    /// It is not-a-number if any component is not-a-number.
    #[inline(always)]
    pub fn error(&self, tolerance: &[f64; N]) -> T {
        let [k1, _, k3, k4, k5, k6, k7] = &self.slopes;
        let (mut worst, mut all) = (T::of(0.0), T::of(0.0));
        for n in 0..N {
            let difference = k1[n] * (71.0 / 57600.0) - k3[n] * (71.0 / 16695.0) + k4[n] * (71.0 / 1920.0)
                - k5[n] * (17253.0 / 339_200.0)
                + k6[n] * (22.0 / 525.0)
                - k7[n] * (1.0 / 40.0);
            let error = (self.h * difference).abs() * (1.0 / tolerance[n]);
            worst = T::choose(error.above(worst), error, worst);
            all = all + error;
        }
        // The maximum ignores values that are not numbers; the sum times zero makes the result not a number, too.
        worst + all * 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn oscillator(_: f64, y: &[f64; 2]) -> [f64; 2] {
        [y[1], -y[0]]
    }

    fn whole(f: impl Fn(f64, &[f64; 2]) -> [f64; 2], t: f64, y: &[f64; 2], h: f64) -> Attempt<2> {
        Attempt::new(*y, h).take(f, t)
    }

    fn error_of(steps: u32) -> f64 {
        let h = 1.0 / f64::from(steps);
        let mut y = [1.0, 0.0];
        for step in 0..steps {
            y = whole(oscillator, f64::from(step) * h, &y, h).end;
        }
        (y[0] - 1.0_f64.cos()).hypot(y[1] + 1.0_f64.sin())
    }

    #[test]
    fn analytic_order_five() {
        let order = (error_of(8) / error_of(16)).log2();
        assert!((order - 5.0).abs() < 0.4, "{order}");
    }

    #[test]
    fn law_the_error_sees_nan() {
        let broken = whole(|_, _| [f64::NAN, 0.0], 0.0, &[1.0, 0.0], 0.3);
        assert!(broken.error(&[1.0; 2]).is_nan());
    }
}
