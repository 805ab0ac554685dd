//! Numbers side by side in the registers of AVX2 and AVX-512.
//!
//! The two types are named nowhere outside this crate: only `on_widest` hands them out, as a type parameter, after it has
//! seen that the processor has their instructions. That is why their operations are safe to call.

#![allow(clippy::wildcard_imports, reason = "instructions by their names, as in the manuals")]
#![allow(unsafe_code, reason = "the processor's vector instructions; see above for why they may be used")]

use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use standstill_interface::Arithmetic;

use super::Lane;
use super::wide::{Compute, MOST_LANES, Mask, Wide};
use crate::dot::Fours;

/// Calls an instruction of the processor.
macro_rules! on_processor {
    ($call:expr) => {
        // SAFETY: values of the two types exist only where the processor has been seen to have their instructions.
        unsafe { $call }
    };
}

/// Defines a type with as many numbers as fit in one register. With two registers per number, the compiler would no
/// longer keep the values of a step in registers, but copy them.
macro_rules! numbers {
    (
        $name:ident, $masks:ident, $vector:ty, $mask:ty, $lanes:literal, $features:literal,
        set: $set:ident, add: $add:ident, sub: $sub:ident, mul: $mul:ident, div: $div:ident, sqrt: $sqrt:ident,
        least: $least:ident, greatest: $greatest:ident,
        $ops:ident
    ) => {
        /// Numbers side by side.
        #[derive(Clone, Copy, Debug)]
        #[repr(transparent)]
        pub struct $name($vector);

        /// A condition per lane.
        #[derive(Clone, Copy, Debug)]
        pub struct $masks($mask);

        numbers!(@operator $name Add add $add);
        numbers!(@operator $name Sub sub $sub);
        numbers!(@operator $name Mul mul $mul);
        numbers!(@operator $name Div div $div);

        impl Neg for $name {
            type Output = Self;

            #[inline(always)]
            fn neg(self) -> Self {
                Self(on_processor!($ops::negative(self.0)))
            }
        }

        impl Default for $name {
            #[inline(always)]
            fn default() -> Self {
                Self::of(0.0)
            }
        }

        impl Default for $masks {
            #[inline(always)]
            fn default() -> Self {
                Self::of_bits(0)
            }
        }

        impl Arithmetic for $name {
            #[inline(always)]
            fn of(value: f64) -> Self {
                Self(on_processor!($set(value)))
            }
        }

        impl Lane for $name {
            type Mask = $masks;

            #[inline(always)]
            fn abs(self) -> Self {
                Self(on_processor!($ops::magnitude(self.0)))
            }

            #[inline(always)]
            fn sqrt(self) -> Self {
                Self(on_processor!($sqrt(self.0)))
            }

            #[inline(always)]
            fn above(self, other: Self) -> $masks {
                $masks(on_processor!($ops::above(self.0, other.0)))
            }

            // The instructions take their second operand where one is no number, as is asked for here.
            #[inline(always)]
            fn least(self, other: Self) -> Self {
                Self(on_processor!($least(other.0, self.0)))
            }

            #[inline(always)]
            fn greatest(self, other: Self) -> Self {
                Self(on_processor!($greatest(other.0, self.0)))
            }

            #[inline(always)]
            fn bit(self, bit: u32) -> $masks {
                $masks(on_processor!($ops::bit(self.0, bit)))
            }

            #[inline(always)]
            fn choose(mask: $masks, yes: Self, no: Self) -> Self {
                Self(on_processor!($ops::choose(mask.0, yes.0, no.0)))
            }

            #[inline(always)]
            fn any(mask: $masks) -> bool {
                mask.anywhere()
            }
        }

        impl Wide for $name {
            const LANES: usize = $lanes;

            #[inline(always)]
            fn get(&self, lane: usize) -> f64 {
                assert!(lane < Self::LANES);
                // SAFETY: as many numbers without gaps between them.
                unsafe { *std::ptr::from_ref(self).cast::<f64>().add(lane) }
            }

            #[inline(always)]
            fn put(&mut self, lane: usize, value: f64) {
                assert!(lane < Self::LANES);
                // SAFETY: as many numbers without gaps between them.
                unsafe { *std::ptr::from_mut(self).cast::<f64>().add(lane) = value }
            }

            #[inline(always)]
            fn compute<C: Compute>(computation: C) -> C::Output {
                #[inline]
                #[target_feature(enable = $features)]
                fn with_features<C: Compute>(computation: C) -> C::Output {
                    computation.compute()
                }
                on_processor!(with_features(computation))
            }
        }

        impl BitAnd for $masks {
            type Output = Self;

            #[inline(always)]
            fn bitand(self, other: Self) -> Self {
                Self(on_processor!($ops::and(self.0, other.0)))
            }
        }

        impl BitOr for $masks {
            type Output = Self;

            #[inline(always)]
            fn bitor(self, other: Self) -> Self {
                Self(on_processor!($ops::or(self.0, other.0)))
            }
        }

        impl Not for $masks {
            type Output = Self;

            #[inline(always)]
            fn not(self) -> Self {
                Self(on_processor!($ops::not(self.0)))
            }
        }

        impl Mask for $masks {
            #[inline(always)]
            fn bits(self) -> u32 {
                on_processor!($ops::bits(self.0))
            }

            #[inline(always)]
            fn of_bits(bits: u32) -> Self {
                Self(on_processor!($ops::of_bits(bits)))
            }
        }
    };
    (@operator $name:ident $trait:ident $method:ident $instruction:ident) => {
        impl $trait for $name {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(on_processor!($instruction(self.0, other.0)))
            }
        }

        impl $trait<f64> for $name {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: f64) -> Self {
                $trait::$method(self, Self::of(other))
            }
        }
    };
}

numbers!(
    Avx512, Masks512, __m512d, __mmask8, 8, "avx512f,avx512dq,avx512vl,avx512bw,bmi2",
    set: _mm512_set1_pd, add: _mm512_add_pd, sub: _mm512_sub_pd, mul: _mm512_mul_pd, div: _mm512_div_pd,
    sqrt: _mm512_sqrt_pd, least: _mm512_min_pd, greatest: _mm512_max_pd,
    avx512
);
numbers!(
    Avx2, Masks256, __m256d, __m256d, 4, "avx2,bmi2",
    set: _mm256_set1_pd, add: _mm256_add_pd, sub: _mm256_sub_pd, mul: _mm256_mul_pd, div: _mm256_div_pd,
    sqrt: _mm256_sqrt_pd, least: _mm256_min_pd, greatest: _mm256_max_pd,
    avx2
);

/// Operations that differ in AVX-512: a mask is a bit for each number.
mod avx512 {
    use super::*;

    macro_rules! of_features {
        ($($(#[$doc:meta])* fn $name:ident($($argument:ident: $type:ty),*) -> $result:ty $body:block)+) => {$(
            #[inline]
            #[target_feature(enable = "avx512f,avx512dq")]
            pub fn $name($($argument: $type),*) -> $result $body
        )+};
    }

    of_features! {
        fn negative(x: __m512d) -> __m512d { _mm512_xor_pd(x, _mm512_set1_pd(-0.0)) }
        fn magnitude(x: __m512d) -> __m512d { _mm512_abs_pd(x) }
        fn above(x: __m512d, y: __m512d) -> __mmask8 { _mm512_cmp_pd_mask::<_CMP_GT_OQ>(x, y) }
        fn bit(x: __m512d, bit: u32) -> __mmask8 {
            _mm512_test_epi64_mask(_mm512_castpd_si512(x), _mm512_set1_epi64(1 << bit))
        }
        fn choose(mask: __mmask8, yes: __m512d, no: __m512d) -> __m512d { _mm512_mask_blend_pd(mask, no, yes) }
        fn and(x: __mmask8, y: __mmask8) -> __mmask8 { x & y }
        fn or(x: __mmask8, y: __mmask8) -> __mmask8 { x | y }
        fn not(x: __mmask8) -> __mmask8 { !x }
        fn bits(x: __mmask8) -> u32 { u32::from(x) }
        fn of_bits(bits: u32) -> __mmask8 { (bits & 0xff) as __mmask8 }
    }
}

/// Operations that differ in AVX2: a mask is all bits of a number or none.
mod avx2 {
    use super::*;

    macro_rules! of_features {
        ($($(#[$doc:meta])* fn $name:ident($($argument:ident: $type:ty),*) -> $result:ty $body:block)+) => {$(
            #[inline]
            #[target_feature(enable = "avx2")]
            pub fn $name($($argument: $type),*) -> $result $body
        )+};
    }

    of_features! {
        fn negative(x: __m256d) -> __m256d { _mm256_xor_pd(x, _mm256_set1_pd(-0.0)) }
        fn magnitude(x: __m256d) -> __m256d { _mm256_andnot_pd(_mm256_set1_pd(-0.0), x) }
        fn above(x: __m256d, y: __m256d) -> __m256d { _mm256_cmp_pd::<_CMP_GT_OQ>(x, y) }
        fn bit(x: __m256d, bit: u32) -> __m256d {
            let bit = _mm256_set1_epi64x(1 << bit);
            _mm256_castsi256_pd(_mm256_cmpeq_epi64(_mm256_and_si256(_mm256_castpd_si256(x), bit), bit))
        }
        fn choose(mask: __m256d, yes: __m256d, no: __m256d) -> __m256d { _mm256_blendv_pd(no, yes, mask) }
        fn and(x: __m256d, y: __m256d) -> __m256d { _mm256_and_pd(x, y) }
        fn or(x: __m256d, y: __m256d) -> __m256d { _mm256_or_pd(x, y) }
        fn not(x: __m256d) -> __m256d { _mm256_xor_pd(x, _mm256_castsi256_pd(_mm256_set1_epi64x(-1))) }
        fn bits(x: __m256d) -> u32 { _mm256_movemask_pd(x).cast_unsigned() }
        fn of_bits(bits: u32) -> __m256d {
            let lanes = _mm256_set_epi64x(8, 4, 2, 1);
            let set = _mm256_and_si256(_mm256_set1_epi64x(i64::from(bits)), lanes);
            _mm256_castsi256_pd(_mm256_cmpeq_epi64(set, lanes))
        }
    }
}

/// Returns the sums of the products of four pairs of rows, each in four parts: every fourth product. All rows have as many fours; none on
/// a processor without the instructions.
pub(crate) fn sums_of_products(fours: Fours<'_>) -> Option<[[f64; 4]; 4]> {
    #[target_feature(enable = "avx2")]
    fn sums([a, b, c, d]: Fours<'_>) -> [[f64; 4]; 4] {
        // The load of four neighbours, and the store.
        let of = |four: &[f64; 4]| _mm256_setr_pd(four[0], four[1], four[2], four[3]);
        let plus = |sum, (x, y): (&[f64; 4], &[f64; 4])| _mm256_add_pd(sum, _mm256_mul_pd(of(x), of(y)));
        let mut sums = [_mm256_setzero_pd(); 4];
        let rows = a.0.iter().zip(a.1).zip(b.0.iter().zip(b.1));
        for ((a, b), (c, d)) in rows.zip(c.0.iter().zip(c.1).zip(d.0.iter().zip(d.1))) {
            sums = [plus(sums[0], a), plus(sums[1], b), plus(sums[2], c), plus(sums[3], d)];
        }
        sums.map(|sum| [0, 1, 2, 3].map(|lane| Avx2(sum).get(lane)))
    }
    // SAFETY: the processor has the instructions.
    is_x86_feature_detected!("avx2").then(|| unsafe { sums(fours) })
}

/// Arrays with an entry for each lane have room for every width.
const _: () = assert!(Avx512::LANES <= MOST_LANES && Avx2::LANES <= MOST_LANES);
