//! The number a detector computes with.

use core::ops::{Add, Div, Mul, Neg, Sub};

use num_traits::FloatConst;
use num_traits::float::FloatCore;

use crate::Reading;

/// Component of a vector: a number, or several side by side that are computed alike.
pub trait Arithmetic:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// Makes a constant, rounded to the type's precision.
    fn of(value: f64) -> Self;
}

/// The number type of a detector, `f32` or `f64`. A detector is written once and runs in double precision here, in
/// single precision on a microcontroller.
///
/// All functions that are not exact by definition, such as the sine, are those of the `libm` crate, not of a C library,
/// so that they give the same bits on every machine. That is why `num_traits::Float` is not used: it takes the C
/// library's functions as soon as any crate of a program enables its feature `std`.
///
/// ```
/// use standstill_interface::Real;
///
/// fn length<T: Real>(x: T, y: T) -> T {
///     x.hypot(y)
/// }
///
/// assert_eq!((length(3.0_f32, 4.0), length(0.6_f64, 0.8)), (5.0, 1.0));
/// ```
pub trait Real:
    Arithmetic + Default + FloatCore + FloatConst + core::fmt::Debug + core::fmt::Display + Send + Sync + 'static
{
    /// Returns the value in double precision.
    fn to_double(self) -> f64;

    /// Returns the square root, which is exact except for the last rounding.
    #[must_use]
    fn sqrt(self) -> Self;

    /// Returns the sine of an angle in rad.
    #[must_use]
    fn sin(self) -> Self;

    /// Returns the cosine of an angle in rad.
    #[must_use]
    fn cos(self) -> Self;

    /// Returns sine and cosine of an angle in rad.
    fn sin_cos(self) -> (Self, Self) {
        (self.sin(), self.cos())
    }

    /// Returns the tangent of an angle in rad.
    #[must_use]
    fn tan(self) -> Self;

    /// Returns the angle in rad, from −π/2 to π/2, with this sine.
    #[must_use]
    fn asin(self) -> Self;

    /// Returns the angle in rad, from 0 to π, with this cosine.
    #[must_use]
    fn acos(self) -> Self;

    /// Returns the angle in rad, from −π to π, of the point with ordinate `self` and abscissa `x`.
    #[must_use]
    fn atan2(self, x: Self) -> Self;

    /// Returns √(x² + y²), even if the squares would overflow.
    #[must_use]
    fn hypot(self, other: Self) -> Self;

    /// Returns e^x.
    #[must_use]
    fn exp(self) -> Self;

    /// Returns e^x − 1, exact near zero.
    #[must_use]
    fn exp_m1(self) -> Self;

    /// Returns the natural logarithm.
    #[must_use]
    fn ln(self) -> Self;

    /// Returns ln(1 + x), exact near zero.
    #[must_use]
    fn ln_1p(self) -> Self;

    /// Returns x^y.
    #[must_use]
    fn powf(self, exponent: Self) -> Self;

    /// Returns double-precision readings as readings of this number type if it is double precision itself, so that they
    /// need not be copied; else none.
    #[must_use]
    fn of_doubles(_: &[Reading<f64>]) -> Option<&[Reading<Self>]> {
        None
    }
}

impl Arithmetic for f64 {
    #[inline(always)]
    fn of(value: f64) -> Self {
        value
    }
}

impl Arithmetic for f32 {
    // Rounding to single precision is what is asked for.
    #[allow(clippy::cast_possible_truncation)]
    fn of(value: f64) -> Self {
        value as f32
    }
}

macro_rules! real {
    ($float:ident, $of_doubles:expr, $($name:ident($($other:ident)?) = $function:ident),*) => {
        impl Real for $float {
            #[inline]
            fn to_double(self) -> f64 {
                self.into()
            }

            #[inline]
            fn of_doubles(readings: &[Reading<f64>]) -> Option<&[Reading<Self>]> {
                $of_doubles(readings)
            }

            $(#[inline]
            fn $name(self $(, $other: Self)?) -> Self {
                libm::$function(self $(, $other)?)
            })*
        }
    };
}

real!(
    f32,
    |_| None,
    sqrt() = sqrtf,
    sin() = sinf,
    cos() = cosf,
    tan() = tanf,
    asin() = asinf,
    acos() = acosf,
    atan2(x) = atan2f,
    hypot(other) = hypotf,
    exp() = expf,
    exp_m1() = expm1f,
    ln() = logf,
    ln_1p() = log1pf,
    powf(exponent) = powf
);
real!(
    f64,
    Some,
    sqrt() = sqrt,
    sin() = sin,
    cos() = cos,
    tan() = tan,
    asin() = asin,
    acos() = acos,
    atan2(x) = atan2,
    hypot(other) = hypot,
    exp() = exp,
    exp_m1() = expm1,
    ln() = log,
    ln_1p() = log1p,
    powf(exponent) = pow
);
