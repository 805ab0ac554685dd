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

/// Natural logarithm of a positive number that is neither subnormal nor infinite nor 1: the bits of [`ln`], without a branch and
/// without a call, so that a loop computes several side by side.
///
/// The algorithm is that of FreeBSD's `e_log.c`, by Sun Microsystems, which `libm` follows, too: x = 2^k (1 + f) with
/// √2/2 ≤ 1 + f < √2 and ln(1 + f) as a series in s = f/(2 + f).
///
/// ```
/// use standstill_numeric::{ln, ln_branchless};
///
/// assert_eq!(ln_branchless(0.02), ln(0.02));
/// ```
#[inline(always)]
#[allow(
    clippy::excessive_precision,
    clippy::unreadable_literal,
    reason = "the coefficients as they were published"
)]
pub fn ln_branchless(x: f64) -> f64 {
    const EVEN: [f64; 3] = [3.999999999940941908e-01, 2.222219843214978396e-01, 1.531383769920937332e-01];
    const ODD: [f64; 4] = [
        6.666666666666735130e-01,
        2.857142874366239149e-01,
        1.818357216161805012e-01,
        1.479819860511658591e-01,
    ];
    const LN_2: [f64; 2] = [6.93147180369123816490e-01, 1.90821492927058770002e-10];
    /// √2/2 as the upper half of a number's bits, and how far 1 is above it.
    const HALF_ROOT: u64 = 0x3fe6_a09e << 32;
    const TO_ONE: u64 = (0x3ff0_0000 << 32) - HALF_ROOT;
    /// Bits of the fraction, and of 2^52: put into the place of its fraction, a whole number is added to it.
    const FRACTION: u64 = (1 << 52) - 1;
    const WHOLE: f64 = 4_503_599_627_370_496.0;

    let shifted = x.to_bits() + TO_ONE;
    let k = f64::from_bits(WHOLE.to_bits() | shifted >> 52) - (WHOLE + 1023.0);
    let f = f64::from_bits((shifted & FRACTION) + HALF_ROOT) - 1.0;
    let half_square = 0.5 * f * f;
    let s = f / (2.0 + f);
    let (z, w) = (s * s, s * s * (s * s));
    let even = w * (EVEN[0] + w * (EVEN[1] + w * EVEN[2]));
    let odd = z * (ODD[0] + w * (ODD[1] + w * (ODD[2] + w * ODD[3])));
    s * (half_square + (odd + even)) + k * LN_2[1] - half_square + f + k * LN_2[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_the_logarithm_without_branches_has_the_same_bits() {
        let mut x = f64::MIN_POSITIVE;
        while x < 4e307 {
            for x in [x, x.next_up(), 1.0 / x] {
                assert_eq!(ln_branchless(x).to_bits(), ln(x).to_bits(), "{x:e}");
            }
            x *= 1.000_3 + 1e-5 * (x % 1.0);
        }
        for k in 1..200_000 {
            let x = 5e-6 * f64::from(k);
            assert_eq!(ln_branchless(x).to_bits(), ln(x).to_bits(), "{x:e}");
        }
    }

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
