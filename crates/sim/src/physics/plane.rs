//! Vectors in the coordinate plane of a run.

use std::ops::{Add, Mul, Sub};

use standstill_interface::{AlphaBeta, Arithmetic, Dq};
use standstill_numeric::{Heading, Lane, Symmetric, Wide};

/// A vector in the plane of a run. This plane is the stator's αβ plane, turned by the rotor's initial angle. Until the rotor moves, the
/// first axis is the d-axis and the second the q-axis, so that a locked rotor needs no rotation. The axes of the phases are constant
/// during a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane<T = f64> {
    /// Component along the d-axis of the rotor at its initial position.
    pub x: T,
    /// Component along the axis that is 90° (electrical) ahead of the axis of `x`.
    pub y: T,
}

// Not derived: a derived `default` is not `inline(always)` and would be compiled without the instructions of wide registers.
impl<T: Default> Default for Plane<T> {
    #[inline(always)]
    fn default() -> Self {
        Self { x: T::default(), y: T::default() }
    }
}

impl<T: Arithmetic> Plane<T> {
    /// Makes a vector from its two components.
    #[inline(always)]
    pub const fn new(x: T, y: T) -> Self {
        Self { x, y }
    }

    /// Returns the dot product.
    #[inline(always)]
    pub fn dot(self, other: Self) -> T {
        self.x * other.x + self.y * other.y
    }

    /// Returns the cross product, that is, its third component.
    #[inline(always)]
    pub fn cross(self, other: Self) -> T {
        self.x * other.y - self.y * other.x
    }

    /// Returns the vector turned forwards by 90°.
    #[inline(always)]
    pub fn quarter_turn(self) -> Self {
        Self::new(-self.y, self.x)
    }

    /// Returns a symmetric matrix times this vector.
    #[inline(always)]
    pub fn through(self, m: Symmetric<T>) -> Self {
        Self::new(m.xx * self.x + m.xy * self.y, m.xy * self.x + m.yy * self.y)
    }

    /// Converts the vector to the d- and q-axes of the rotor. `turned` is the angle by which the rotor has turned since the start of the
    /// run.
    #[inline(always)]
    pub fn to_rotor(self, turned: Heading<T>) -> Dq<T> {
        AlphaBeta::new(self.x, self.y).park_by(turned.sin, turned.cos)
    }

    /// Converts a vector from the d- and q-axes of the rotor. `turned` is the angle by which the rotor has turned since the start of the
    /// run.
    #[inline(always)]
    pub fn from_rotor(v: Dq<T>, turned: Heading<T>) -> Self {
        let AlphaBeta { alpha, beta } = v.unpark_by(turned.sin, turned.cos);
        Self::new(alpha, beta)
    }

    /// Converts the vector to the stator's αβ plane. `start` is the initial angle of the rotor as a heading (sine and cosine).
    #[inline(always)]
    pub fn to_stator(self, start: Heading<T>) -> AlphaBeta<T> {
        Dq::new(self.x, self.y).unpark_by(start.sin, start.cos)
    }

    /// Converts a vector from the stator's αβ plane. `start` is the initial angle of the rotor as a heading (sine and cosine).
    #[inline(always)]
    pub fn from_stator(v: AlphaBeta<T>, start: Heading<T>) -> Self {
        let Dq { d, q } = v.park_by(start.sin, start.cos);
        Self::new(d, q)
    }
}

impl<V: Wide> Plane<V> {
    /// Returns the vector of one lane.
    pub fn get(&self, lane: usize) -> Plane {
        Plane::new(self.x.get(lane), self.y.get(lane))
    }

    /// Sets the vector of one lane.
    pub fn put(&mut self, lane: usize, of: Plane) {
        self.x.put(lane, of.x);
        self.y.put(lane, of.y);
    }
}

impl<T: Lane> Plane<T> {
    /// Returns for each lane the vector `yes` if the lane is in the mask, and the vector `no` otherwise.
    #[inline(always)]
    pub fn choose(mask: T::Mask, yes: Self, no: Self) -> Self {
        Self::new(T::choose(mask, yes.x, no.x), T::choose(mask, yes.y, no.y))
    }
}

impl<T: Arithmetic> Add for Plane<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y)
    }
}

impl<T: Arithmetic> Sub for Plane<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y)
    }
}

impl<T: Arithmetic> Mul<T> for Plane<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: T) -> Self {
        Self::new(self.x * factor, self.y * factor)
    }
}
