//! Model of the three line inductances over the angle, and its inverse.
//!
//! With `u = e^{j2θ}` and `v = e^{jθ}`
//! ```text
//! Z = c + S u + H u⁻² + j P v⁻¹
//! ```
//! with c, S, H and P all in H, or all relative to the same inductance.

use standstill_interface::{Angle, Real};

use crate::parts::complex::{Complex, Turning};

/// Number of unknowns in addition to the angles.
pub(super) const UNKNOWNS: usize = 5;

/// Indices of the unknowns in a vector.
pub(super) mod at {
    /// Re c; Im c follows.
    pub const OFFSET: usize = 0;
    pub const SALIENCY: usize = 2;
    pub const FOURTH: usize = 3;
    pub const SATURATION: usize = 4;
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Model<T> {
    /// c, the constant that unequal phases and gains cause.
    pub(super) offset: Complex<T>,
    /// S: L_B with its sign.
    pub(super) saliency: T,
    /// H: L_4.
    pub(super) fourth: T,
    /// P, the effect of saturation.
    pub(super) saturation: T,
}

/// Z at an angle, and its derivatives with respect to the angle in rad and to the unknowns.
pub(super) struct Reading<T> {
    pub(super) z: Complex<T>,
    pub(super) over_angle: Complex<T>,
    pub(super) over_unknowns: [Complex<T>; UNKNOWNS],
}

impl<T: Real> Model<T> {
    pub(super) fn moved(&self, step: &[T; UNKNOWNS]) -> Self {
        Self {
            offset: self.offset + Complex::new(step[at::OFFSET], step[at::OFFSET + 1]),
            saliency: self.saliency + step[at::SALIENCY],
            fourth: self.fourth + step[at::FOURTH],
            saturation: self.saturation + step[at::SATURATION],
        }
    }

    /// Returns whether Z − c turns forwards whenever the rotor does, so that each Z belongs to one axis only.
    pub(super) fn is_unique(&self) -> bool {
        let backwards = T::of(4.0) * self.fourth.abs() + self.saturation.abs();
        backwards < T::of(1.8) * self.saliency.abs()
    }

    pub(super) fn at(&self, angle: T) -> Reading<T> {
        let v = Complex::turn(angle);
        let u = v * v;
        let (back, across) = ((u * u).conj(), v.conj().quarter_turn());
        let two = T::of(2.0);
        let rest = u.scale(self.saliency) + back.scale(self.fourth) + across.scale(self.saturation);
        let turning = u.scale(two * self.saliency)
            - back.scale(two * two * self.fourth)
            - across.scale(self.saturation);
        let one = Complex::new(T::one(), T::zero());
        Reading {
            z: self.offset + rest,
            over_angle: turning.quarter_turn(),
            over_unknowns: [one, one.quarter_turn(), u, back, across],
        }
    }

    /// Returns the derivative, with respect to each unknown, of the angle in rad that is found from a given Z.
    pub(super) fn angle_over_unknowns(&self, angle: T) -> [T; UNKNOWNS] {
        let v = Complex::turn(angle);
        let u = v * v;
        let (three, six) = (u * v, u * u * u);
        let slope =
            T::of(2.0) * self.saliency - T::of(4.0) * self.fourth * six.re - self.saturation * three.im;
        [u.im, -u.re, T::zero(), six.im, -three.re].map(|across| across / slope)
    }

    /// Returns θ in rad and the signed saliency that give Z. Only the sign of S is used, because a motor's saliency
    /// changes with temperature. If the pole is unknown, θ is one of two angles, and P counts as zero.
    ///
    /// `X = (Z − c) u⁻¹ = S + H u⁻³ + j P v⁻³` has the imaginary part `Im X + H sin 6θ − P cos 3θ = 0`, which Newton's
    /// method solves.
    pub(super) fn angle(&self, z: Complex<T>, north: Option<Angle<T>>) -> (T, T) {
        let two = T::of(2.0);
        let rest = z - self.offset;
        let sign = self.saliency.signum();
        let mut angle = rest.scale(sign).argument() / two;
        let mut saturation = T::zero();
        if let Some(north) = north {
            saturation = self.saturation;
            if Angle::from_radians(angle).difference(north).abs() > T::FRAC_PI_2() {
                angle = angle + T::PI();
            }
        }
        let length = rest.length();
        let mut amplitude = sign * length;
        for _ in 0..STEPS {
            let v = Complex::turn(angle);
            let u = v * v;
            let (three, six) = (u * v, u * u * u);
            let x = rest * u.conj();
            let (fourth, along) = (self.fourth * six.re, saturation * three.im);
            amplitude = x.re - fourth - along;
            let off = x.im + self.fourth * six.im - saturation * three.re;
            let slope = two * x.re - T::of(6.0) * fourth - T::of(3.0) * along;
            // Where the model does not hold, the slope may vanish: it is bounded, so that the step stays finite.
            let step = off / (sign * (sign * slope).max(length / two));
            angle = angle + step;
            if step.abs() <= T::epsilon() {
                break;
            }
        }
        (angle, amplitude)
    }
}

/// Each step of Newton's method doubles the digits; the start is wrong by a tenth of a radian at most.
const STEPS: usize = 8;
