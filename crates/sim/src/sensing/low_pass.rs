//! The first-order low-pass filter of the link's sensor and of the dividers.

use standstill_numeric::exp;

/// A first-order low-pass filter. Its output is exact up to rounding if the input is a cubic over the step.
#[derive(Clone, Copy, Debug)]
pub struct LowPass {
    time_constant: f64,
    output: f64,
}

impl LowPass {
    /// Makes a filter with this corner frequency in Hz and this present output.
    pub fn new(bandwidth: f64, output: f64) -> Self {
        Self { time_constant: 1.0 / (std::f64::consts::TAU * bandwidth), output }
    }

    /// Returns the present output, in the unit of the input.
    pub fn output(&self) -> f64 {
        self.output
    }

    /// Advances the filter over `h` seconds. `x` contains the values of the input at 0, h/3, 2h/3 and h.
    pub fn advance(&mut self, h: f64, x: [f64; 4]) {
        let r = h / self.time_constant;
        if r < 0.01 {
            // On short steps the powers of τ/h below would amplify rounding errors. There, the 3/8 rule for the convolution
            // with the filter's response has an error of the order r⁵.
            let [a, b, c, d] = x;
            let ends = a * exp(-r) + 3.0 * b * exp(-2.0 * r / 3.0) + 3.0 * c * exp(-r / 3.0) + d;
            self.output = self.output * exp(-r) + r / 8.0 * ends;
            return;
        }
        // The cubic's derivatives at both ends; the filter follows x − τ x' + τ² x'' − τ³ x''' plus a transient.
        let [a, b, c, d] = x;
        let third = (d - 3.0 * c + 3.0 * b - a) * 27.0;
        let second = [9.0 * (2.0 * a - 5.0 * b + 4.0 * c - d), 9.0 * (2.0 * d - 5.0 * c + 4.0 * b - a)];
        let first = [-5.5 * a + 9.0 * b - 4.5 * c + d, 5.5 * d - 9.0 * c + 4.5 * b - a];
        let ratio = self.time_constant / h;
        let follow = |x: f64, end: usize| x - ratio * (first[end] - ratio * (second[end] - ratio * third));
        let transient = self.output - follow(a, 0);
        self.output = follow(d, 1) + transient * exp(-h / self.time_constant);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_low_pass_of_a_ramp_lags_by_its_time_constant() {
        let mut filter = LowPass::new(1.0 / (std::f64::consts::TAU * 1e-6), 0.0);
        // x = t in one long step, then compare with t − τ (1 − e^{−t/τ}).
        filter.advance(5e-6, [0.0, 5e-6 / 3.0, 10e-6 / 3.0, 5e-6]);
        let exact = 5e-6 - 1e-6 * (1.0 - (-5.0_f64).exp());
        assert!((filter.output() - exact).abs() < 1e-18);
        // Steps of no length change nothing, however short.
        let mut settled = LowPass::new(1e3, 1.0);
        for h in [1e-9, 1e-11, 1e-13, 1e-15] {
            settled.advance(h, [1.0, 1.0 + 1e-15, 1.0 - 1e-15, 1.0]);
        }
        assert!((settled.output() - 1.0).abs() < 1e-12, "{}", settled.output());
        // Just below and just above the change of method: the same ramp.
        for h in [0.0099e-6, 0.0101e-6] {
            let mut filter = LowPass::new(1.0 / (std::f64::consts::TAU * 1e-6), 0.0);
            filter.advance(h, [0.0, h / 3.0, 2.0 * h / 3.0, h]);
            let exact = h + 1e-6 * (-h / 1e-6).exp_m1();
            assert!((filter.output() - exact).abs() < 1e-7 * exact, "{} {exact}", filter.output());
        }
        // A cubic in two steps is a cubic in one.
        let cubic = |t: f64| 1.0 + t - 2.0 * t * t + 0.5 * t * t * t;
        let advance = |filter: &mut LowPass, from: f64, h: f64| {
            filter.advance(h, [0.0, 1.0, 2.0, 3.0].map(|k| cubic(from + k * h / 3.0)));
        };
        let (mut one, mut two) = (LowPass::new(0.3, 0.0), LowPass::new(0.3, 0.0));
        advance(&mut one, 0.0, 2.0);
        advance(&mut two, 0.0, 0.7);
        advance(&mut two, 0.7, 1.3);
        assert!((one.output() - two.output()).abs() < 1e-13);
    }
}
