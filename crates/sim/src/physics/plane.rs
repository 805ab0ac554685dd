//! Vectors in the coordinate plane of a run.

use std::ops::{Add, Mul, Sub};

use standstill_interface::{AlphaBeta, Arithmetic, Dq};
use standstill_numeric::{Heading, Lane, Symmetric, Wide};

/// A vector in the plane of a run: the stator's αβ plane, turned by the rotor's initial angle. While the rotor has not
/// moved, the first axis is d and the second q, so a locked rotor needs no rotation; the phases' axes are constants of
/// the run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane<T = f64> {
    /// Component along the d-axis of the rotor at its initial position.
    pub x: T,
    /// Component along the axis 90° (electrical) ahead of `x`.
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

    /// Returns the third component of the cross product.
    #[inline(always)]
    pub fn cross(self, other: Self) -> T {
        self.x * other.y - self.y * other.x
    }

    /// Returns the vector turned by a quarter turn forwards.
    #[inline(always)]
    pub fn quarter_turn(self) -> Self {
        Self::new(-self.y, self.x)
    }

    /// Returns a symmetric matrix times this vector.
    #[inline(always)]
    pub fn through(self, m: Symmetric<T>) -> Self {
        Self::new(m.xx * self.x + m.xy * self.y, m.xy * self.x + m.yy * self.y)
    }

    /// Converts the vector to the d and q axes of a rotor that has turned by `turned` since its start.
    #[inline(always)]
    pub fn to_rotor(self, turned: Heading<T>) -> Dq<T> {
        AlphaBeta::new(self.x, self.y).park_by(turned.sin, turned.cos)
    }

    /// Converts a vector from the d and q axes of a rotor that has turned by `turned` since its start.
    #[inline(always)]
    pub fn from_rotor(v: Dq<T>, turned: Heading<T>) -> Self {
        let AlphaBeta { alpha, beta } = v.unpark_by(turned.sin, turned.cos);
        Self::new(alpha, beta)
    }

    /// Converts the vector to the stator's αβ plane; `start`: initial angle of the rotor as sine and cosine.
    #[inline(always)]
    pub fn to_stator(self, start: Heading<T>) -> AlphaBeta<T> {
        Dq::new(self.x, self.y).unpark_by(start.sin, start.cos)
    }

    /// Converts a vector from the stator's αβ plane; `start`: initial angle of the rotor as sine and cosine.
    #[inline(always)]
    pub fn from_stator(v: AlphaBeta<T>, start: Heading<T>) -> Self {
        let Dq { d, q } = v.park_by(start.sin, start.cos);
        Self::new(d, q)
    }
}

impl<V: Wide> Plane<V> {
    /// Returns the vector in a lane.
    pub fn get(&self, lane: usize) -> Plane {
        Plane::new(self.x.get(lane), self.y.get(lane))
    }

    /// Puts a vector into a lane.
    pub fn put(&mut self, lane: usize, of: Plane) {
        self.x.put(lane, of.x);
        self.y.put(lane, of.y);
    }
}

impl<T: Lane> Plane<T> {
    /// Returns vector `yes` in the lanes of the mask, vector `no` elsewhere.
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
