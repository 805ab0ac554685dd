//! The direction of the d-axis, kept as sine and cosine so that harmonics of the angle cost no trigonometry.

/// Sine and cosine of the electrical angle θ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heading {
    /// sin θ.
    pub sin: f64,
    /// cos θ.
    pub cos: f64,
}

impl Heading {
    /// θ = 0: the d-axis on the axis of phase a.
    pub const ZERO: Self = Self { sin: 0.0, cos: 1.0 };

    /// Of an angle in rad.
    pub fn of(angle: f64) -> Self {
        let (sin, cos) = angle.sin_cos();
        Self { sin, cos }
    }

    /// Sine and cosine of `2θ`.
    #[inline]
    #[must_use]
    pub fn doubled(self) -> Self {
        Self { sin: 2.0 * self.sin * self.cos, cos: 1.0 - 2.0 * self.sin * self.sin }
    }

    /// Sine and cosine of `3θ`.
    #[inline]
    #[must_use]
    pub fn tripled(self) -> Self {
        let (s, c) = (self.sin, self.cos);
        Self { sin: s * (3.0 - 4.0 * s * s), cos: c * (4.0 * c * c - 3.0) }
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
