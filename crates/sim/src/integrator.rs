//! The Dormand–Prince method of order 5(4) with dense output: one smooth step.
//!
//! Coefficients and the continuous extension of order 4 are those of Hairer, Nørsett and Wanner, *Solving
//! Ordinary Differential Equations I*, section II.6 (DOPRI5).

/// One step from `start` over `h`, not yet accepted.
#[derive(Clone, Copy, Debug)]
pub struct Attempt<const N: usize> {
    /// Length in s.
    pub h: f64,
    /// State at the beginning.
    pub start: [f64; N],
    /// State at the end, order 5.
    pub end: [f64; N],
    /// Derivative at the end: the next step's first.
    pub end_slope: [f64; N],
    slopes: [[f64; N]; 6],
}

/// Right-hand sides that an attempt evaluates; the one at its start comes from the step before.
pub const STAGES: u64 = 6;

impl<const N: usize> Attempt<N> {
    /// Takes a step; `slope` is the derivative at its beginning. That at the end is left to the caller, who may want
    /// more of that state than its derivative: neither [`Self::error`] nor [`Self::dense`] is known before.
    #[inline]
    pub fn new(
        derivative: impl Fn(f64, &[f64; N]) -> [f64; N],
        t: f64,
        start: &[f64; N],
        slope: &[f64; N],
        h: f64,
    ) -> Self {
        let y = start;
        let k1 = slope;
        let at = |c: f64, f: &dyn Fn(usize) -> f64| {
            derivative(t + c * h, &std::array::from_fn(|n| y[n] + h * f(n)))
        };
        let k2 = at(0.2, &|n| k1[n] / 5.0);
        let k3 = at(0.3, &|n| 3.0 / 40.0 * k1[n] + 9.0 / 40.0 * k2[n]);
        let k4 = at(0.8, &|n| 44.0 / 45.0 * k1[n] - 56.0 / 15.0 * k2[n] + 32.0 / 9.0 * k3[n]);
        let k5 = at(8.0 / 9.0, &|n| {
            19372.0 / 6561.0 * k1[n] - 25360.0 / 2187.0 * k2[n] + 64448.0 / 6561.0 * k3[n]
                - 212.0 / 729.0 * k4[n]
        });
        let k6 = at(1.0, &|n| {
            9017.0 / 3168.0 * k1[n] - 355.0 / 33.0 * k2[n] + 46732.0 / 5247.0 * k3[n] + 49.0 / 176.0 * k4[n]
                - 5103.0 / 18656.0 * k5[n]
        });
        let end: [f64; N] = std::array::from_fn(|n| {
            y[n] + h
                * (35.0 / 384.0 * k1[n] + 500.0 / 1113.0 * k3[n] + 125.0 / 192.0 * k4[n]
                    - 2187.0 / 6784.0 * k5[n]
                    + 11.0 / 84.0 * k6[n])
        });
        Self { h, start: *start, end, end_slope: [0.0; N], slopes: [*k1, k2, k3, k4, k5, k6] }
    }

    /// The step with the derivative at its end.
    #[inline]
    pub fn with_end_slope(self, end_slope: [f64; N]) -> Self {
        Self { end_slope, ..self }
    }

    /// The largest component of the error estimate, each relative to its tolerance: at most 1 to be accepted.
    #[inline]
    pub fn error(&self, tolerance: &[f64; N]) -> f64 {
        let [k1, _, k3, k4, k5, k6] = &self.slopes;
        let k7 = &self.end_slope;
        (0..N)
            .map(|n| {
                let difference = 71.0 / 57600.0 * k1[n] - 71.0 / 16695.0 * k3[n] + 71.0 / 1920.0 * k4[n]
                    - 17253.0 / 339_200.0 * k5[n]
                    + 22.0 / 525.0 * k6[n]
                    - 1.0 / 40.0 * k7[n];
                (self.h * difference).abs() / tolerance[n]
            })
            // `max` would drop a NaN, and with it a step that went wrong.
            .fold(0.0, |worst, error| if error > worst || error.is_nan() { error } else { worst })
    }

    /// The state at share `x` (0 to 1) of the step, order 4.
    #[inline]
    pub fn dense(&self, x: f64) -> [f64; N] {
        let [k1, _, k3, k4, k5, k6] = &self.slopes;
        let k7 = &self.end_slope;
        std::array::from_fn(|n| {
            let way = self.end[n] - self.start[n];
            let c2 = self.h * k1[n] - way;
            let c3 = way - self.h * k7[n] - c2;
            let c4 = self.h
                * (-12_715_105_075.0 / 11_282_082_432.0 * k1[n]
                    + 87_487_479_700.0 / 32_700_410_799.0 * k3[n]
                    - 10_690_763_975.0 / 1_880_347_072.0 * k4[n]
                    + 701_980_252_875.0 / 199_316_789_632.0 * k5[n]
                    - 1_453_857_185.0 / 822_651_844.0 * k6[n]
                    + 69_997_945.0 / 29_380_423.0 * k7[n]);
            self.start[n] + x * (way + (1.0 - x) * (c2 + x * (c3 + (1.0 - x) * c4)))
        })
    }

    /// The length to try next, from this one's error. A step far too long can leave the finite numbers; a shorter one
    /// need not.
    pub fn next_length(&self, error: f64) -> f64 {
        let factor = match error {
            0.0 => 5.0,
            error if error.is_finite() => 0.9 * error.powf(-0.2),
            _ => 0.2,
        };
        self.h * factor.clamp(0.2, 5.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn oscillator(_: f64, y: &[f64; 2]) -> [f64; 2] {
        [y[1], -y[0]]
    }

    fn whole(
        f: impl Fn(f64, &[f64; 2]) -> [f64; 2],
        t: f64,
        y: &[f64; 2],
        slope: &[f64; 2],
        h: f64,
    ) -> Attempt<2> {
        let attempt = Attempt::new(&f, t, y, slope, h);
        attempt.with_end_slope(f(t + h, &attempt.end))
    }

    fn integrate(steps: u32) -> (f64, f64) {
        let h = 1.0 / f64::from(steps);
        let mut y = [1.0, 0.0];
        let mut dense_error: f64 = 0.0;
        for step in 0..steps {
            let t = f64::from(step) * h;
            let attempt = whole(oscillator, t, &y, &oscillator(t, &y), h);
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
        let attempt = whole(oscillator, 0.0, &[1.0, 0.0], &[0.0, -1.0], 0.3);
        assert_eq!(attempt.dense(0.0), attempt.start);
        assert!((attempt.dense(1.0)[0] - attempt.end[0]).abs() < 1e-15);
        let broken = whole(|_, _| [f64::NAN, 0.0], 0.0, &[1.0, 0.0], &[0.0, -1.0], 0.3);
        assert!(broken.error(&[1.0; 2]).is_nan());
        assert!((broken.next_length(f64::NAN) - 0.2 * 0.3).abs() < 1e-15);
    }
}
