//! Functions that are not arithmetic, with the same bits on every machine.
//!
//! Those of `f64` itself are the C library's, which differ in the last bit between machines: it has variants for
//! processors with fused multiplication. These are those of the `libm` crate, through [`Real`] where that has them.

use standstill_interface::Real;

macro_rules! functions {
    ($($(#[$doc:meta])* $name:ident($x:ident $(, $y:ident)?) = $value:expr;)*) => {$(
        $(#[$doc])*
        #[inline]
        pub fn $name($x: f64 $(, $y: f64)?) -> f64 {
            $value
        }
    )*};
}

functions! {
    /// Sine of an angle in rad.
    sin(x) = Real::sin(x);
    /// Cosine of an angle in rad.
    cos(x) = Real::cos(x);
    /// The angle in rad, from −π to π, of the point at `y` above and `x` to the right of the origin.
    ///
    /// ```
    /// assert_eq!(standstill_numeric::atan2(1.0, -1.0), 0.75 * std::f64::consts::PI);
    /// ```
    atan2(y, x) = Real::atan2(y, x);
    /// √(x² + y²), also where the squares would overflow.
    hypot(x, y) = Real::hypot(x, y);
    /// e^x.
    exp(x) = Real::exp(x);
    /// e^x − 1, exact near zero.
    exp_m1(x) = Real::exp_m1(x);
    /// Natural logarithm.
    ln(x) = Real::ln(x);
    /// ln(1 + x), exact near zero.
    ln_1p(x) = Real::ln_1p(x);
    /// Decimal logarithm.
    log10(x) = libm::log10(x);
    /// x^y; for whole exponents there is [`power`](crate::power).
    powf(x, y) = Real::powf(x, y);
    /// The complementary error function, 2/√π ∫ exp(−t²) dt from x on.
    ///
    /// ```
    /// use standstill_numeric::erfc;
    ///
    /// // A normal number is beyond three standard deviations in 0.27 % of all cases.
    /// assert!((erfc(3.0 / 2.0_f64.sqrt()) - 0.0027).abs() < 1e-6);
    /// ```
    erfc(x) = libm::erfc(x);
    /// ln Γ(x), of positive x.
    ///
    /// ```
    /// use standstill_numeric::{exp, ln_gamma};
    ///
    /// // Γ(n) = (n − 1)!
    /// assert!((exp(ln_gamma(6.0)) - 120.0).abs() < 1e-12);
    /// ```
    ln_gamma(x) = libm::lgamma(x);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Distance in units of the last place.
    fn ulps(a: f64, b: f64) -> u64 {
        a.to_bits().abs_diff(b.to_bits())
    }

    #[test]
    fn cross_functions_are_within_an_ulp_of_the_c_librarys() {
        let mut seen = 0;
        for k in 1..20_000_u32 {
            let x = 1e-3 * f64::from(k);
            let y = 7.3 - x;
            let pairs = [
                (sin(y), y.sin()),
                (cos(y), y.cos()),
                (atan2(y, x), y.atan2(x)),
                (hypot(x, y), x.hypot(y)),
                (exp(y), y.exp()),
                (exp_m1(y), y.exp_m1()),
                (ln(x), x.ln()),
                (ln_1p(x), x.ln_1p()),
                (log10(x), x.log10()),
                (powf(x, y), x.powf(y)),
            ];
            for (n, (own, other)) in pairs.into_iter().enumerate() {
                assert!(ulps(own, other) <= 1, "function {n} of {x} and {y}: {own:e} {other:e}");
                seen |= 1 << n;
            }
        }
        assert_eq!(seen, (1 << 10) - 1);
    }

    /// Bits that were computed once: another machine, or another library, must give the same.
    #[test]
    fn golden_bits_of_all_functions() {
        let mut digest = 0xcbf2_9ce4_8422_2325_u64;
        for k in 0..4096_u32 {
            let x = 1e-4 + 3.7e-3 * f64::from(k);
            let y = 1.3 - 0.9 * x;
            for value in [
                sin(x),
                cos(x),
                atan2(y, x),
                hypot(x, y),
                exp(y),
                exp_m1(y),
                ln(x),
                ln_1p(x),
                log10(x),
                powf(x, y),
                erfc(y),
                ln_gamma(x),
            ] {
                // Fowler, Noll and Vo: FNV-1a over words.
                digest = (digest ^ value.to_bits()).wrapping_mul(0x0100_0000_01b3);
            }
        }
        assert_eq!(format!("{digest:016x}"), "7fc312ad5e2eccde");
    }
}
