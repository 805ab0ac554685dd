//! Complex numbers. The vector of the line inductances turns with 2θ, and complex multiplication describes such
//! turning.

pub(crate) use num_complex::Complex;
use standstill_interface::{AlphaBeta, Real};

/// Operations of a complex number beyond its arithmetic. Sine, arc tangent and root are those of [`Real`].
pub(crate) trait Turning<T> {
    /// Returns 0.
    fn zero() -> Self;

    /// Returns e^{jx}.
    fn turn(radians: T) -> Self;

    /// Returns α + jβ.
    fn of(vector: AlphaBeta<T>) -> Self;

    /// Returns j times the number.
    fn quarter_turn(self) -> Self;

    /// Returns the dot product of the two numbers as vectors.
    fn dot(self, other: Self) -> T;

    /// Returns the absolute value.
    fn length(self) -> T;

    /// Returns the argument in rad.
    fn argument(self) -> T;
}

impl<T: Real> Turning<T> for Complex<T> {
    fn zero() -> Self {
        Self::new(T::zero(), T::zero())
    }

    fn turn(radians: T) -> Self {
        let (im, re) = radians.sin_cos();
        Self { re, im }
    }

    fn of(vector: AlphaBeta<T>) -> Self {
        Self::new(vector.alpha, vector.beta)
    }

    fn quarter_turn(self) -> Self {
        Self::new(-self.im, self.re)
    }

    fn dot(self, other: Self) -> T {
        self.re * other.re + self.im * other.im
    }

    fn length(self) -> T {
        self.re.hypot(self.im)
    }

    fn argument(self) -> T {
        self.im.atan2(self.re)
    }
}
