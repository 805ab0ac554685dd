//! Machines side by side in wide registers, chosen while the program runs.

use std::ops::{BitAnd, BitOr, Not};

use super::Lane;

/// A condition per lane; false in all lanes by default.
pub trait Mask: Copy + Default + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {
    /// Returns one bit for each lane, the first lane in the lowest.
    fn bits(self) -> u32;

    /// Returns whether it holds anywhere.
    #[inline(always)]
    fn anywhere(self) -> bool {
        self.bits() != 0
    }

    /// Makes a mask from such bits.
    fn of_bits(bits: u32) -> Self;
}

impl Mask for bool {
    #[inline(always)]
    fn bits(self) -> u32 {
        u32::from(self)
    }

    #[inline(always)]
    fn of_bits(bits: u32) -> Self {
        bits & 1 == 1
    }
}

/// Numbers side by side whose operations are single instructions, or one number alone.
///
/// A type of this kind that needs more than the program's own target can only be named by who was given it by
/// [`on_widest`], which looks at the processor first: to have one is to be allowed to use it. Its operations become single
/// instructions only inside [`Wide::compute`].
pub trait Wide: Lane<Mask: Mask> + 'static {
    /// Number of lanes.
    const LANES: usize;

    /// True for a single number. Code under this condition is compiled for a single number only.
    const ALONE: bool = Self::LANES == 1;

    /// Returns the number in a lane; panics beyond the last.
    fn get(&self, lane: usize) -> f64;

    /// Puts a number into a lane; panics beyond the last.
    fn put(&mut self, lane: usize, value: f64);

    /// Carries out a computation with the processor's instructions for this type.
    fn compute<C: Compute>(computation: C) -> C::Output;

    /// Makes one number at a place, zero elsewhere.
    #[inline(always)]
    #[must_use]
    fn only(mask: Self::Mask, number: Self) -> Self {
        Self::choose(mask, number, Self::of(0.0))
    }
}

/// The largest [`Wide::LANES`].
pub const MOST_LANES: usize = 8;

/// A computation that [`Wide::compute`] carries out. Its method must be `#[inline(always)]`, and so must be all that is to
/// use wide registers.
pub trait Compute {
    /// Result of the computation.
    type Output;

    /// Computes it.
    fn compute(self) -> Self::Output;
}

impl Wide for f64 {
    const LANES: usize = 1;

    #[inline(always)]
    fn get(&self, lane: usize) -> f64 {
        assert!(lane == 0);
        *self
    }

    #[inline(always)]
    fn put(&mut self, lane: usize, value: f64) {
        assert!(lane == 0);
        *self = value;
    }

    #[inline(always)]
    fn compute<C: Compute>(computation: C) -> C::Output {
        computation.compute()
    }
}

/// Work that is the same for every type of numbers side by side.
pub trait OnWidest {
    /// Result of the computation.
    type Output;

    /// Does it with numbers of this type.
    fn with<V: Wide>(self) -> Self::Output;
}

/// Instructions that numbers side by side may use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Width {
    /// Numbers are computed one after the other, on any processor.
    One,
    /// 256-bit registers (AVX2).
    Avx2,
    /// 512-bit registers (AVX-512 F, DQ, VL and BW).
    Avx512,
}

impl Width {
    /// Each there is.
    pub const ALL: [Self; 3] = [Self::One, Self::Avx2, Self::Avx512];

    /// Iterates over the widths that this processor has, the narrowest first.
    ///
    /// ```
    /// use standstill_numeric::Width;
    ///
    /// assert_eq!(Width::available().next(), Some(Width::One));
    /// assert_eq!(Width::available().last(), Some(Width::widest()));
    /// ```
    pub fn available() -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(|width| *width <= Self::widest())
    }

    /// Makes the widest that this processor has.
    pub fn widest() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            // Each that `x86` asks a compiler for.
            if is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx512vl")
                && is_x86_feature_detected!("avx512bw")
                && is_x86_feature_detected!("bmi2")
            {
                return Self::Avx512;
            }
            if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("bmi2") {
                return Self::Avx2;
            }
        }
        Self::One
    }
}

/// Does work with the widest numbers that the processor has, but none wider than `most`.
pub fn on_widest<W: OnWidest>(most: Width, work: W) -> W::Output {
    match most.min(Width::widest()) {
        #[cfg(target_arch = "x86_64")]
        Width::Avx512 => work.with::<super::x86::Avx512>(),
        #[cfg(target_arch = "x86_64")]
        Width::Avx2 => work.with::<super::x86::Avx2>(),
        _ => work.with::<f64>(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sin_cos;

    /// Every operation of a lane, on two numbers.
    fn results<T: Lane>(x: T, y: T) -> [T; 7] {
        [
            x + y * x - y / x,
            T::choose(x.above(y), x, y),
            x.least(y),
            x.greatest(y),
            x.abs().sqrt() * 3.0 - 1.0 + 0.5,
            sin_cos(x).0,
            -sin_cos(x).1,
        ]
    }

    struct EachLane;

    impl OnWidest for EachLane {
        /// How many lanes were looked at.
        type Output = usize;

        fn with<V: Wide>(self) -> usize {
            let of = |lane: usize| {
                [(lane as f64 - 1.3) * 1.7, if lane == 2 { f64::NAN } else { 0.3 + lane as f64 }]
            };
            let (mut x, mut y) = (V::of(0.0), V::of(0.0));
            for lane in 0..V::LANES {
                let [a, b] = of(lane);
                x.put(lane, a);
                y.put(lane, b);
            }
            let all = results(x, y);
            let above = y.above(x);
            for lane in 0..V::LANES {
                let [a, b] = of(lane);
                for (wide, one) in all.iter().zip(results(a, b)) {
                    let same =
                        wide.get(lane).to_bits() == one.to_bits() || wide.get(lane).is_nan() && one.is_nan();
                    assert!(same, "{} lanes, lane {lane}: {} {one}", V::LANES, wide.get(lane));
                }
                assert_eq!(above.bits() >> lane & 1 == 1, b > a);
                let bit = 1 << lane;
                assert_eq!(V::Mask::of_bits(bit).bits(), bit);
                assert_eq!((!V::Mask::of_bits(bit) & V::Mask::of_bits(bit | 1)).bits(), u32::from(lane != 0));
                assert_eq!(V::only(V::Mask::of_bits(bit), x).get(lane).to_bits(), a.to_bits());
            }
            assert!(!x.above(x).anywhere() && (x.above(-x).anywhere() || V::LANES == 1));
            V::LANES
        }
    }

    #[test]
    fn law_a_lane_is_a_number() {
        let lanes: Vec<usize> = Width::available().map(|width| on_widest(width, EachLane)).collect();
        // Each width is another computation: none is counted twice.
        assert_eq!(lanes, [1, 4, 8][..lanes.len()]);
    }
}
