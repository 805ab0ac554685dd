//! The Dormand–Prince method of order 5(4) with dense output: one smooth step.
//!
//! Coefficients and the continuous extension of order 4 are those of Hairer, Nørsett and Wanner, *Solving
//! Ordinary Differential Equations I*, section II.6 (DOPRI5).

use standstill_numeric::Lane;

/// Something for each number of a state. Spelled out, for a compiler that made a loop of it would put the same number of
/// several machines apart and not those of all machines side by side.
macro_rules! each {
    ($n:ident $do:block) => {
        each!($n $do 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15);
    };
    ($n:ident $do:block $($k:literal)+) => {
        $(
            let $n = $k;
            if $n < N $do
        )+
    };
}

/// Derivatives that a step needs: six within it and the one at its end.
pub const STAGES: usize = 7;

/// One step from `start` over `h`, not yet accepted; of one machine or of several side by side.
#[derive(Clone, Copy, Debug)]
pub struct Attempt<const N: usize, T = f64> {
    /// Length in s.
    pub h: T,
    /// State at the beginning.
    pub start: [T; N],
    /// State at the end, order 5.
    pub end: [T; N],
    /// Derivatives at the beginning, within, and at the end.
    pub slopes: [[T; N]; STAGES],
}

impl<const N: usize, T: Lane> Attempt<N, T> {
    /// A step of which nothing is known yet.
    #[inline(always)]
    pub fn new(start: [T; N], h: T) -> Self {
        Self { h, start, end: start, slopes: [[T::of(0.0); N]; STAGES] }
    }

    /// Takes the step.
    #[inline(always)]
    #[must_use]
    pub fn take(mut self, mut derivative: impl FnMut(T, &[T; N]) -> [T; N], t: T) -> Self {
        // One call of the right-hand side, so that it can be part of the loop.
        for stage in 0..STAGES {
            let (share, y) = self.wants(stage);
            self.knows(stage, &y, derivative(t + self.h * share, &y));
        }
        self
    }

    /// The state whose derivative the step needs next, and its share of the step; it has those of all stages before. After
    /// the last comes the middle of the step, from dense output.
    #[inline(always)]
    pub fn wants(&self, stage: usize) -> (f64, [T; N]) {
        let [k1, k2, k3, k4, k5, k6, _] = &self.slopes;
        let mut way = [T::of(0.0); N];
        let share = match stage {
            0 => return (0.0, self.start),
            1 => {
                each!(n {
                    way[n] = k1[n] * (1.0 / 5.0);
                });
                0.2
            }
            2 => {
                each!(n {
                    way[n] = k1[n] * (3.0 / 40.0) + k2[n] * (9.0 / 40.0);
                });
                0.3
            }
            3 => {
                each!(n {
                    way[n] = k1[n] * (44.0 / 45.0) - k2[n] * (56.0 / 15.0) + k3[n] * (32.0 / 9.0);
                });
                0.8
            }
            4 => {
                each!(n {
                    way[n] = k1[n] * (19372.0 / 6561.0) - k2[n] * (25360.0 / 2187.0)
                        + k3[n] * (64448.0 / 6561.0)
                        - k4[n] * (212.0 / 729.0);
                });
                8.0 / 9.0
            }
            5 => {
                each!(n {
                    way[n] = k1[n] * (9017.0 / 3168.0) - k2[n] * (355.0 / 33.0)
                        + k3[n] * (46732.0 / 5247.0)
                        + k4[n] * (49.0 / 176.0)
                        - k5[n] * (5103.0 / 18656.0);
                });
                1.0
            }
            6 => {
                each!(n {
                    way[n] = k1[n] * (35.0 / 384.0) + k3[n] * (500.0 / 1113.0) + k4[n] * (125.0 / 192.0)
                        - k5[n] * (2187.0 / 6784.0)
                        + k6[n] * (11.0 / 84.0);
                });
                1.0
            }
            _ => return (0.5, self.dense(0.5)),
        };
        each!(n {
            way[n] = self.start[n] + self.h * way[n];
        });
        (share, way)
    }

    /// Takes the derivative that was wanted, at the state where it is.
    #[inline(always)]
    pub fn knows(&mut self, stage: usize, y: &[T; N], slope: [T; N]) {
        if stage < STAGES {
            self.end = *y;
            self.slopes[stage] = slope;
        }
    }

    /// The largest component of the error estimate, each relative to its tolerance: at most 1 to be accepted. Not a
    /// number if any of them is none.
    #[inline(always)]
    pub fn error(&self, tolerance: &[f64; N]) -> T {
        let [k1, _, k3, k4, k5, k6, k7] = &self.slopes;
        let (mut worst, mut all) = (T::of(0.0), T::of(0.0));
        each!(n {
            let difference = k1[n] * (71.0 / 57600.0) - k3[n] * (71.0 / 16695.0) + k4[n] * (71.0 / 1920.0)
                - k5[n] * (17253.0 / 339_200.0)
                + k6[n] * (22.0 / 525.0)
                - k7[n] * (1.0 / 40.0);
            let error = (self.h * difference).abs() * (1.0 / tolerance[n]);
            worst = T::choose(error.above(worst), error, worst);
            all = all + error;
        });
        // The larger of two numbers would drop what is none, and with it a step that went wrong.
        worst + all * 0.0
    }

    /// The state at share `x` (0 to 1) of the step, order 4.
    #[inline(always)]
    pub fn dense(&self, x: f64) -> [T; N] {
        let [k1, _, k3, k4, k5, k6, k7] = &self.slopes;
        let mut state = [T::of(0.0); N];
        each!(n {
            let way = self.end[n] - self.start[n];
            let c2 = self.h * k1[n] - way;
            let c3 = way - self.h * k7[n] - c2;
            let c4 = self.h
                * (k1[n] * (-12_715_105_075.0 / 11_282_082_432.0)
                    + k3[n] * (87_487_479_700.0 / 32_700_410_799.0)
                    - k4[n] * (10_690_763_975.0 / 1_880_347_072.0)
                    + k5[n] * (701_980_252_875.0 / 199_316_789_632.0)
                    - k6[n] * (1_453_857_185.0 / 822_651_844.0)
                    + k7[n] * (69_997_945.0 / 29_380_423.0));
            state[n] = self.start[n] + (way + (c2 + (c3 + c4 * (1.0 - x)) * x) * (1.0 - x)) * x;
        });
        state
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

    fn integrate(steps: u32) -> (f64, f64) {
        let h = 1.0 / f64::from(steps);
        let mut y = [1.0, 0.0];
        let mut dense_error: f64 = 0.0;
        for step in 0..steps {
            let t = f64::from(step) * h;
            let attempt = whole(oscillator, t, &y, h);
            dense_error = dense_error.max((attempt.dense(0.4)[0] - (t + 0.4 * h).cos()).abs());
            y = attempt.end;
        }
        ((y[0] - 1.0_f64.cos()).hypot(y[1] + 1.0_f64.sin()), dense_error)
    }

    #[test]
    fn analytic_order_five_at_the_end_and_four_between() {
        let ((coarse, coarse_dense), (fine, fine_dense)) = (integrate(8), integrate(16));
        let (order, dense_order) = ((coarse / fine).log2(), (coarse_dense / fine_dense).log2());
        assert!((order - 5.0).abs() < 0.4, "{order}");
        // Local error of a fourth-order extension: h^5.
        assert!((dense_order - 5.0).abs() < 0.5, "{dense_order}");
    }

    #[test]
    fn law_dense_output_meets_both_ends_and_the_error_sees_nan() {
        let attempt = whole(oscillator, 0.0, &[1.0, 0.0], 0.3);
        assert_eq!(attempt.dense(0.0), attempt.start);
        assert!((attempt.dense(1.0)[0] - attempt.end[0]).abs() < 1e-15);
        let broken = whole(|_, _| [f64::NAN, 0.0], 0.0, &[1.0, 0.0], 0.3);
        assert!(broken.error(&[1.0; 2]).is_nan());
    }
}
