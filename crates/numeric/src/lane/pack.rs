//! Several numbers side by side, in an array that a compiler puts into wide registers where it may use them.

#![allow(clippy::needless_range_loop, reason = "iterators are closures")]

use std::ops::{Add, Div, Mul, Neg, Sub};

use standstill_interface::Arithmetic;

use super::Lane;

/// `K` numbers. Their operations are those of `f64`, one by one.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub struct Pack<const K: usize>(pub [f64; K]);

// Loops and no closures below: what is not inlined into a function that is compiled for wide registers is compiled for
// narrow ones.
macro_rules! operations {
    ($($trait:ident $method:ident $assign:tt),+) => {$(
        impl<const K: usize> $trait for Pack<K> {
            type Output = Self;

            #[inline(always)]
            fn $method(mut self, other: Self) -> Self {
                for k in 0..K {
                    self.0[k] $assign other.0[k];
                }
                self
            }
        }

        impl<const K: usize> $trait<f64> for Pack<K> {
            type Output = Self;

            #[inline(always)]
            fn $method(mut self, other: f64) -> Self {
                for k in 0..K {
                    self.0[k] $assign other;
                }
                self
            }
        }
    )+};
}

operations!(Add add +=, Sub sub -=, Mul mul *=, Div div /=);

impl<const K: usize> Neg for Pack<K> {
    type Output = Self;

    #[inline(always)]
    fn neg(mut self) -> Self {
        for x in &mut self.0 {
            *x = -*x;
        }
        self
    }
}

impl<const K: usize> Arithmetic for Pack<K> {
    #[inline(always)]
    fn of(value: f64) -> Self {
        Self([value; K])
    }
}

impl<const K: usize> Lane for Pack<K> {
    // All bits of a lane set or none: that is how processors hold them.
    type Mask = [u64; K];

    #[inline(always)]
    fn abs(mut self) -> Self {
        for x in &mut self.0 {
            *x = x.abs();
        }
        self
    }

    #[inline(always)]
    fn sqrt(mut self) -> Self {
        for x in &mut self.0 {
            *x = x.sqrt();
        }
        self
    }

    #[inline(always)]
    fn above(self, other: Self) -> Self::Mask {
        let mut mask = [0; K];
        for k in 0..K {
            mask[k] = if self.0[k] > other.0[k] { u64::MAX } else { 0 };
        }
        mask
    }

    #[inline(always)]
    fn bit(self, bit: u32) -> Self::Mask {
        let mut mask = [0; K];
        for k in 0..K {
            mask[k] = (self.0[k].to_bits() >> bit & 1).wrapping_neg();
        }
        mask
    }

    #[inline(always)]
    fn choose(mask: Self::Mask, yes: Self, no: Self) -> Self {
        let mut chosen = yes;
        for k in 0..K {
            chosen.0[k] = f64::from_bits(yes.0[k].to_bits() & mask[k] | no.0[k].to_bits() & !mask[k]);
        }
        chosen
    }

    #[inline(always)]
    fn any(mask: Self::Mask) -> bool {
        let mut all = 0;
        for lane in mask {
            all |= lane;
        }
        all != 0
    }

    #[inline(always)]
    fn each<const M: usize>(x: Self, y: Self, function: impl Fn(f64, f64) -> [f64; M]) -> [Self; M] {
        let mut all = [Self([0.0; K]); M];
        for k in 0..K {
            for (one, value) in all.iter_mut().zip(function(x.0[k], y.0[k])) {
                one.0[k] = value;
            }
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sin_cos;

    #[test]
    fn law_a_lane_is_a_number() {
        let of = |k: usize| (k as f64 - 3.3) * 1.7;
        let x = Pack::<8>(std::array::from_fn(of));
        let y = Pack::<8>(std::array::from_fn(|k| 0.3 + k as f64));
        let lanes = [
            (x + y * x - y / x).0,
            Pack::choose(x.above(y), x, y).0,
            x.least(y).0,
            x.greatest(y).0,
            (x.abs().sqrt() * 3.0 - 1.0 + 0.5).0,
            sin_cos(x).0.0,
            (-sin_cos(x).1).0,
            Pack::each(x, y, |x, y| [x.hypot(y)])[0].0,
        ];
        for k in 0..8 {
            let (x, y) = (of(k), 0.3 + k as f64);
            let single = [
                x + y * x - y / x,
                if x > y { x } else { y },
                if x > y { y } else { x },
                if y > x { y } else { x },
                x.abs().sqrt() * 3.0 - 1.0 + 0.5,
                sin_cos(x).0,
                -sin_cos(x).1,
                x.hypot(y),
            ];
            for (lanes, single) in lanes.iter().zip(single) {
                assert_eq!(lanes[k].to_bits(), single.to_bits());
            }
        }
        assert!(!Pack::<8>::any(x.above(x)) && Pack::<8>::any(x.above(-x)));
    }
}
