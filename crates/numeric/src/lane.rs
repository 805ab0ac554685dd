//! Numbers in lanes: the equations are written once and computed for one machine or for several in parallel.
//!
//! A computation in `f64` and one in a lane consist of the same sequence of additions, multiplications, divisions and
//! roots, each rounded separately, so the results are the same to the last bit. There are no branches on values: both
//! alternatives are computed, and each lane chooses one.

mod wide;
#[cfg(target_arch = "x86_64")]
mod x86;

use std::ops::{Add, Mul, Sub};

use standstill_interface::Arithmetic;

pub use wide::{Compute, MOST_LANES, Mask, OnWidest, Wide, Width, on_widest};
#[cfg(target_arch = "x86_64")]
pub(crate) use x86::sums_of_products;

/// One number, or several in lanes; zero by default.
pub trait Lane:
    Arithmetic
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Default
    + std::fmt::Debug
{
    /// A truth value for each lane.
    type Mask: Copy + std::fmt::Debug;

    /// Returns the absolute value.
    #[must_use]
    fn abs(self) -> Self;

    /// Returns the square root.
    #[must_use]
    fn sqrt(self) -> Self;

    /// Returns the lanes in which this number is larger than the other one.
    fn above(self, other: Self) -> Self::Mask;

    /// Returns the smaller of two numbers; where `other` is not a number, this one.
    #[inline(always)]
    #[must_use]
    fn least(self, other: Self) -> Self {
        Self::choose(self.above(other), other, self)
    }

    /// Returns the larger of two numbers; where `other` is not a number, this one.
    #[inline(always)]
    #[must_use]
    fn greatest(self, other: Self) -> Self {
        Self::choose(other.above(self), other, self)
    }

    /// Returns the lanes in which this bit of the number is set.
    fn bit(self, bit: u32) -> Self::Mask;

    /// Returns `yes` in lanes in which the mask is true, `no` in the others.
    #[must_use]
    fn choose(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// Returns whether the mask holds anywhere.
    fn any(mask: Self::Mask) -> bool;
}

impl Lane for f64 {
    type Mask = bool;

    #[inline(always)]
    fn abs(self) -> Self {
        self.abs()
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }

    #[inline(always)]
    fn above(self, other: Self) -> bool {
        self > other
    }

    #[inline(always)]
    fn bit(self, bit: u32) -> bool {
        self.to_bits() >> bit & 1 == 1
    }

    #[inline(always)]
    fn choose(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }

    #[inline(always)]
    fn any(mask: bool) -> bool {
        mask
    }
}

/// Returns `x^n` by repeated squaring. The multiplications and their order are the same on all machines, unlike those
/// of a library's `pow`.
///
/// ```
/// assert_eq!(standstill_numeric::power(1.5, 3), 3.375);
/// ```
#[inline(always)]
pub fn power<T: Lane>(x: T, exponent: u8) -> T {
    let (mut result, mut square, mut left) = (T::of(1.0), x, exponent);
    while left > 0 {
        if left & 1 == 1 {
            result = result * square;
        }
        left >>= 1;
        if left > 0 {
            square = square * square;
        }
    }
    result
}

/// Returns c₀ + c₁ x + c₂ x² + c₃ x³, given x². The terms are added in pairs, so that each product depends on at most
/// one other.
#[inline(always)]
pub fn four<T: Lane>(x: T, x2: T, c: [f64; 4]) -> T {
    (x * c[3] + c[2]) * x2 + (x * c[1] + c[0])
}

/// Returns a polynomial with eight coefficients, given x² and x⁴, by the scheme of G. Estrin, "Organization of computer
/// systems" (1960), DOI 10.1145/1460361.1460365.
///
/// ```
/// use standstill_numeric::eight;
/// let x = 2.0_f64;
/// let digits = [1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 3.0];
/// assert_eq!(eight(x, x * x, x * x * x * x, digits), 1.0 + 4.0 + 8.0 + 3.0 * 128.0);
/// ```
#[inline(always)]
pub fn eight<T: Lane>(x: T, x2: T, x4: T, c: [f64; 8]) -> T {
    four(x, x2, [c[4], c[5], c[6], c[7]]) * x4 + four(x, x2, [c[0], c[1], c[2], c[3]])
}

/// Added to a number below 2^51, it rounds it to a whole one, which then is in the lowest bits.
const ROUND: f64 = 6_755_399_441_055_744.0;

/// π/2 in three parts, the first two with so few bits that a whole number up to 2^20 times them is exact.
const QUARTER: [f64; 3] = [1.570_796_326_734_125_6, 6.077_100_506_303_966e-11, 2.022_266_248_795_950_7e-21];

#[inline(always)]
fn polynomial<T: Lane>(x: T, coefficients: [f64; 5], first: f64) -> T {
    let mut sum = T::of(first);
    for c in coefficients {
        sum = sum * x + c;
    }
    sum
}

/// Returns sine and cosine of an angle in rad, with errors of about one ulp for angles up to a million rad.
///
/// A library's functions may differ in the last bit from machine to machine, and do not work on several lanes.
/// Reduction to ±π/4 and the polynomials are those of fdlibm (Sun Microsystems, 1993).
#[inline(always)]
pub fn sin_cos<T: Lane>(angle: T) -> (T, T) {
    let shifted = angle * std::f64::consts::FRAC_2_PI + ROUND;
    let quarters = shifted - ROUND;
    let x = angle - quarters * QUARTER[0] - quarters * QUARTER[1] - quarters * QUARTER[2];
    let z = x * x;
    let of_sin = polynomial(
        z,
        [
            -2.505_076_025_340_686_3e-8,
            2.755_731_370_707_006_8e-6,
            -1.984_126_982_985_795e-4,
            8.333_333_333_322_49e-3,
            -1.666_666_666_666_663_2e-1,
        ],
        1.589_690_995_211_55e-10,
    );
    let of_cos = polynomial(
        z,
        [
            2.087_572_321_298_175e-9,
            -2.755_731_435_139_066_3e-7,
            2.480_158_728_947_673e-5,
            -1.388_888_888_887_411e-3,
            4.166_666_666_666_66e-2,
        ],
        -1.135_964_755_778_819_5e-11,
    );
    let sin = x + x * z * of_sin;
    let cos = T::of(1.0) - (z * 0.5 - z * z * of_cos);
    let odd = shifted.bit(0);
    let (s, c) = (T::choose(odd, cos, sin), T::choose(odd, sin, cos));
    (T::choose(shifted.bit(1), -s, s), T::choose((shifted + 1.0).bit(1), -c, c))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_sine_and_cosine_are_those_of_the_library() {
        for n in -200_000..200_000_i32 {
            for angle in [f64::from(n) * 1e-4, f64::from(n) * 1.234_567] {
                let (sin, cos) = sin_cos(angle);
                assert!((sin - angle.sin()).abs() < 2.3e-16, "{angle}: {sin} {}", angle.sin());
                assert!((cos - angle.cos()).abs() < 2.3e-16, "{angle}: {cos} {}", angle.cos());
            }
        }
        assert_eq!(sin_cos(0.0), (0.0, 1.0));
        assert!(sin_cos(f64::NAN).0.is_nan() && sin_cos(f64::INFINITY).1.is_nan());
    }

    #[test]
    fn analytic_the_smaller_and_the_larger_of_two() {
        for (a, b) in [(1.0, 2.0), (2.0, 1.0), (-1.0, -2.0), (-3.0, 4.0), (f64::NEG_INFINITY, 0.0)] {
            let (low, high) = if a < b { (a, b) } else { (b, a) };
            assert_eq!((a.least(b), a.greatest(b)), (low, high));
        }
        assert_eq!((1.0.least(f64::NAN), 1.0.greatest(f64::NAN)), (1.0, 1.0));
    }

    #[test]
    fn analytic_powers() {
        for exponent in 0..=20 {
            let exact = 1.1_f64.powi(exponent.into());
            assert!((power(1.1, exponent) / exact - 1.0).abs() < 1e-15);
        }
    }
}
