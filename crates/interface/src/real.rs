//! The number a detector computes with.

use num_traits::{Float, FloatConst};

/// `f32` or `f64`. A detector is written once and runs in double precision here, in single precision on a
/// microcontroller.
pub trait Real: Float + FloatConst + core::fmt::Debug + core::fmt::Display + Send + Sync + 'static {
    /// A constant, rounded to the type's precision.
    fn of(value: f64) -> Self;

    /// The value in double precision.
    fn to_double(self) -> f64;
}

impl Real for f64 {
    fn of(value: f64) -> Self {
        value
    }

    fn to_double(self) -> f64 {
        self
    }
}

impl Real for f32 {
    // Rounding to single precision is what is asked for.
    #[allow(clippy::cast_possible_truncation)]
    fn of(value: f64) -> Self {
        value as f32
    }

    fn to_double(self) -> f64 {
        f64::from(self)
    }
}
