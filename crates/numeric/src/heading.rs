//! The direction of the d-axis, kept as sine and cosine so that harmonics of the angle cost no trigonometry.

use crate::{Lane, sin_cos};

/// Sine and cosine of the electrical angle θ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heading<T = f64> {
    /// sin θ.
    pub sin: T,
    /// cos θ.
    pub cos: T,
}

impl Heading {
    /// θ = 0: the d-axis on the axis of phase a.
    pub const ZERO: Self = Self { sin: 0.0, cos: 1.0 };
}

impl<T: Lane> Heading<T> {
    /// Computes sine and cosine of an angle in rad.
    #[inline(always)]
    pub fn of(angle: T) -> Self {
        let (sin, cos) = sin_cos(angle);
        Self { sin, cos }
    }

    /// Returns sine and cosine of `2θ`.
    #[inline(always)]
    #[must_use]
    pub fn doubled(self) -> Self {
        let twice = self.sin + self.sin;
        Self { sin: twice * self.cos, cos: T::of(1.0) - twice * self.sin }
    }

    /// Returns sine and cosine of `3θ`.
    #[inline(always)]
    #[must_use]
    pub fn tripled(self) -> Self {
        let (s, c) = (self.sin, self.cos);
        Self { sin: s * (T::of(3.0) - s * s * 4.0), cos: c * (c * c * 4.0 - 3.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_multiples_of_the_angle() {
        for degree in 0..360 {
            let angle = f64::from(degree).to_radians();
            let six = Heading::of(angle).doubled().tripled();
            let exact = Heading::of(6.0 * angle);
            assert!((six.sin - exact.sin).abs() < 1e-14 && (six.cos - exact.cos).abs() < 1e-14, "{degree}°");
        }
    }
}
