//! Reference frames as types: a quantity in one frame cannot be added to one in another.
//!
//! The transforms are amplitude-invariant: `α = (2a − b − c)/3`, `β = (b − c)/√3`. Power in these frames is
//! therefore 3/2 of the dot product of voltage and current.

use core::ops::{Add, Index, IndexMut, Mul, Neg, Sub};

use crate::{Angle, Arithmetic, Real};

/// 1/√3 and √3/2.
const INVERSE_ROOT_3: f64 = 0.577_350_269_189_625_8;
const HALF_ROOT_3: f64 = 0.866_025_403_784_438_6;

/// A phase of the winding, or the leg of the inverter that feeds it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Phase {
    /// Phase a (U): its magnetic axis is the angle zero.
    A,
    /// Phase b (V): 120° ahead.
    B,
    /// Phase c (W): 240° ahead.
    C,
}

impl Phase {
    /// The three phases in order.
    pub const ALL: [Self; 3] = [Self::A, Self::B, Self::C];

    /// Returns the next phase in positive rotation: a → b → c → a.
    ///
    /// ```
    /// use standstill_interface::Phase;
    ///
    /// assert_eq!(Phase::C.next(), Phase::A);
    /// assert_eq!(Phase::ALL.map(Phase::letter), ['a', 'b', 'c']);
    /// ```
    #[must_use]
    pub const fn next(self) -> Self {
        match self {
            Self::A => Self::B,
            Self::B => Self::C,
            Self::C => Self::A,
        }
    }

    /// Returns the lower-case letter.
    pub const fn letter(self) -> char {
        match self {
            Self::A => 'a',
            Self::B => 'b',
            Self::C => 'c',
        }
    }
}

/// One value per phase.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Abc<T>(pub [T; 3]);

impl<T> Abc<T> {
    /// Makes the phase by phase.
    pub const fn new(a: T, b: T, c: T) -> Self {
        Self([a, b, c])
    }

    /// Returns each phase's value through `f`.
    pub fn map<U>(self, mut f: impl FnMut(T) -> U) -> Abc<U> {
        // One by one: the library's loop over an array is not always taken apart.
        let Self([a, b, c]) = self;
        Abc([f(a), f(b), f(c)])
    }
}

impl<T> Index<Phase> for Abc<T> {
    type Output = T;

    fn index(&self, phase: Phase) -> &T {
        &self.0[phase as usize]
    }
}

impl<T> IndexMut<Phase> for Abc<T> {
    fn index_mut(&mut self, phase: Phase) -> &mut T {
        &mut self.0[phase as usize]
    }
}

impl<T: Arithmetic> Abc<T> {
    /// Applies the Clarke transform; the zero sequence is dropped.
    ///
    /// ```
    /// use standstill_interface::Abc;
    ///
    /// // A current into phase a that returns in equal parts through b and c lies along the axis of a.
    /// let current = Abc::new(2.0_f64, -1.0, -1.0).clarke();
    /// assert!((current.alpha - 2.0).abs() < 1e-12 && current.beta.abs() < 1e-12);
    /// ```
    #[inline(always)]
    pub fn clarke(self) -> AlphaBeta<T> {
        let [a, b, c] = self.0;
        AlphaBeta::new((a + a - b - c) * T::of(1.0 / 3.0), (b - c) * T::of(INVERSE_ROOT_3))
    }
}

macro_rules! plane_vector {
    ($(#[$doc:meta])* $name:ident, $x:ident: $x_doc:literal, $y:ident: $y_doc:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct $name<T> {
            #[doc = $x_doc]
            pub $x: T,
            #[doc = $y_doc]
            pub $y: T,
        }

        impl<T: Real> $name<T> {
            /// Returns the length.
            pub fn norm(self) -> T {
                self.$x.hypot(self.$y)
            }
        }

        impl<T: Arithmetic> $name<T> {
            /// Makes a vector from its two components.
            #[inline(always)]
            pub const fn new($x: T, $y: T) -> Self {
                Self { $x, $y }
            }

            /// Returns the dot product.
            #[inline(always)]
            pub fn dot(self, other: Self) -> T {
                self.$x * other.$x + self.$y * other.$y
            }

            /// Returns the vector turned forwards by a quarter turn: multiplication by j.
            #[inline(always)]
            #[must_use]
            pub fn quarter_turn(self) -> Self {
                Self::new(-self.$y, self.$x)
            }
        }

        impl<T: Arithmetic> Add for $name<T> {
            type Output = Self;
            #[inline(always)]
            fn add(self, other: Self) -> Self {
                Self::new(self.$x + other.$x, self.$y + other.$y)
            }
        }

        impl<T: Arithmetic> Sub for $name<T> {
            type Output = Self;
            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                Self::new(self.$x - other.$x, self.$y - other.$y)
            }
        }

        impl<T: Arithmetic> Mul<T> for $name<T> {
            type Output = Self;
            #[inline(always)]
            fn mul(self, factor: T) -> Self {
                Self::new(self.$x * factor, self.$y * factor)
            }
        }

        impl<T: Arithmetic> Neg for $name<T> {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                Self::new(-self.$x, -self.$y)
            }
        }
    };
}

plane_vector!(
    /// A vector in the stator's plane: α along the axis of phase a, β a quarter turn ahead.
    AlphaBeta,
    alpha: "Along the axis of phase a.",
    beta: "A quarter turn ahead of it."
);
plane_vector!(
    /// A vector in the rotor's plane: d along the magnet's north pole, q a quarter turn ahead.
    Dq,
    d: "Along the magnet's north pole.",
    q: "A quarter turn ahead of it."
);

impl<T: Real> AlphaBeta<T> {
    /// Applies the Park transform into the frame at the given angle.
    ///
    /// ```
    /// use standstill_interface::{AlphaBeta, Angle};
    ///
    /// // A vector along the rotor's axis has a d part alone.
    /// let vector = AlphaBeta::new(3.0_f64.sqrt(), 1.0).park(Angle::from_degrees(30.0));
    /// assert!((vector.d - 2.0).abs() < 1e-12 && vector.q.abs() < 1e-12);
    /// ```
    pub fn park(self, angle: Angle<T>) -> Dq<T> {
        let (sin, cos) = angle.radians().sin_cos();
        self.park_by(sin, cos)
    }
}

impl<T: Arithmetic> AlphaBeta<T> {
    /// Returns the inverse Clarke transform, without zero sequence.
    ///
    /// ```
    /// use standstill_interface::AlphaBeta;
    ///
    /// let phases = AlphaBeta::new(1.0_f64, 0.0).phases();
    /// assert_eq!(phases.0, [1.0, -0.5, -0.5]);
    /// ```
    #[inline(always)]
    pub fn phases(self) -> Abc<T> {
        let (a, b) = (T::of(-0.5) * self.alpha, T::of(HALF_ROOT_3) * self.beta);
        Abc::new(self.alpha, a + b, a - b)
    }

    /// Applies the Park transform with known sine and cosine.
    #[inline(always)]
    pub fn park_by(self, sin: T, cos: T) -> Dq<T> {
        Dq::new(cos * self.alpha + sin * self.beta, cos * self.beta - sin * self.alpha)
    }
}

impl<T: Real> Dq<T> {
    /// Returns the inverse Park transform: out of the frame at the given angle.
    ///
    /// ```
    /// use standstill_interface::{Angle, Dq};
    ///
    /// let angle = Angle::from_degrees(30.0_f64);
    /// let there = Dq::new(2.0, 0.5).unpark(angle);
    /// let back = there.park(angle);
    /// assert!((back.d - 2.0).abs() < 1e-12 && (back.q - 0.5).abs() < 1e-12);
    /// ```
    pub fn unpark(self, angle: Angle<T>) -> AlphaBeta<T> {
        let (sin, cos) = angle.radians().sin_cos();
        self.unpark_by(sin, cos)
    }
}

impl<T: Arithmetic> Dq<T> {
    /// Returns the inverse Park transform with sine and cosine already known.
    #[inline(always)]
    pub fn unpark_by(self, sin: T, cos: T) -> AlphaBeta<T> {
        AlphaBeta::new(cos * self.d - sin * self.q, sin * self.d + cos * self.q)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_clarke_and_park_round_trip() {
        let vector = AlphaBeta::new(1.3_f64, -0.7);
        let back = vector.phases().clarke();
        assert!((back - vector).norm() < 1e-15);
        let angle = Angle::from_degrees(77.0);
        assert!((vector.park(angle).unpark(angle) - vector).norm() < 1e-15);
    }

    #[test]
    fn analytic_a_vector_at_the_angle_lies_on_the_d_axis() {
        let angle = Angle::from_degrees(200.0_f64);
        let dq = AlphaBeta::new(angle.radians().cos(), angle.radians().sin()).park(angle);
        assert!((dq.d - 1.0).abs() < 1e-15 && dq.q.abs() < 1e-15);
    }
}
