//! Complex numbers: what the lines tell turns with 2θ, and complex multiplication is that turning.

use core::ops::{Add, Mul, Sub};

use standstill_interface::{Abc, Real};

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Complex<T> {
    pub(super) re: T,
    pub(super) im: T,
}

impl<T: Real> Complex<T> {
    pub(super) fn new(re: T, im: T) -> Self {
        Self { re, im }
    }

    pub(super) fn zero() -> Self {
        Self::new(T::zero(), T::zero())
    }

    /// e^{jx}.
    pub(super) fn turn(radians: T) -> Self {
        let (im, re) = radians.sin_cos();
        Self { re, im }
    }

    pub(super) fn conjugate(self) -> Self {
        Self::new(self.re, -self.im)
    }

    /// j times it.
    pub(super) fn quarter_turn(self) -> Self {
        Self::new(-self.im, self.re)
    }

    pub(super) fn scale(self, by: T) -> Self {
        Self::new(self.re * by, self.im * by)
    }

    pub(super) fn dot(self, other: Self) -> T {
        self.re * other.re + self.im * other.im
    }

    pub(super) fn norm(self) -> T {
        self.re.hypot(self.im)
    }

    pub(super) fn argument(self) -> T {
        self.im.atan2(self.re)
    }

    /// Z and M of three lines: equations (6) and (5) of the paper.
    pub(super) fn of_lines(Abc([ab, bc, ca]): Abc<T>) -> (Self, T) {
        let nine = T::of(9.0);
        let z = Self::new((ca + ab - bc - bc) / nine, T::of(3.0).sqrt() * (ca - ab) / nine);
        (z, (ab + bc + ca) / nine)
    }
}

impl<T: Real> Add for Complex<T> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::new(self.re + other.re, self.im + other.im)
    }
}

impl<T: Real> Sub for Complex<T> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::new(self.re - other.re, self.im - other.im)
    }
}

impl<T: Real> Mul for Complex<T> {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self::new(self.re * other.re - self.im * other.im, self.re * other.im + self.im * other.re)
    }
}
