//! The number a detector computes with.

use core::ops::{Add, Div, Mul, Neg, Sub};

use num_traits::{Float, FloatConst};

/// What the vectors of the planes are made of: a number, or several side by side that are computed alike.
pub trait Arithmetic:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// A constant, rounded to the type's precision.
    fn of(value: f64) -> Self;
}

/// `f32` or `f64`. A detector is written once and runs in double precision here, in single precision on a
/// microcontroller.
pub trait Real:
    Arithmetic + Float + FloatConst + core::fmt::Debug + core::fmt::Display + Send + Sync + 'static
{
    /// The value in double precision.
    fn to_double(self) -> f64;
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

impl Real for f64 {
    fn to_double(self) -> f64 {
        self
    }
}

impl Real for f32 {
    fn to_double(self) -> f64 {
        f64::from(self)
    }
}
