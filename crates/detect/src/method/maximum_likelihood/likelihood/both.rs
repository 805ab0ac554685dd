//! Pairs of numbers for forward and backward pulses. Both are computed together in one register, so that two divisions
//! take no longer than one.

use core::ops::{Add, Div, Mul, Neg, Sub};

use standstill_interface::{Arithmetic, Real};

/// A number for the pulse backward and one for that forward.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Both<T>(pub [T; 2]);

impl<T: Real> Both<T> {
    /// Returns the same value for both directions.
    #[inline(always)]
    pub fn all(value: T) -> Self {
        Self([value; 2])
    }
}

macro_rules! each_by_itself {
    ($($operation:ident $name:ident;)*) => {$(
        impl<T: Real> $operation for Both<T> {
            type Output = Self;

            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                let (Self([a, b]), Self([c, d])) = (self, other);
                Self([a.$name(c), b.$name(d)])
            }
        }
    )*};
}

each_by_itself! {
    Add add;
    Sub sub;
    Mul mul;
    Div div;
}

impl<T: Real> Neg for Both<T> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        let Self([a, b]) = self;
        Self([-a, -b])
    }
}

impl<T: Real> Mul<T> for Both<T> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, factor: T) -> Self {
        self * Self::all(factor)
    }
}

impl<T: Real> Div<T> for Both<T> {
    type Output = Self;

    #[inline(always)]
    fn div(self, divisor: T) -> Self {
        self / Self::all(divisor)
    }
}

impl<T: Real> Arithmetic for Both<T> {
    #[inline(always)]
    fn of(value: f64) -> Self {
        Self::all(T::of(value))
    }
}
