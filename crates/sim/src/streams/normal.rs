//! Conversion of draws to uniform numbers and standard normals, and back.
//!
//! A draw is one of 2^48 values k with equal probability. As a uniform number it is u = (k + ½)/2^48, as a standard
//! normal z = Φ⁻¹(u), between −7.86 and 7.86. The values are far enough apart to recover k from the rounded z through
//! Φ(z), so a list of normals contains all information of the draws.

use std::f64::consts::FRAC_1_SQRT_2;

use multiversion::multiversion;

use self::coefficients::{FAR_TAIL, MIDDLE, NEAR_TAIL};
use super::AT_ONCE;

/// Number of values that a draw can have.
const VALUES: f64 = (1_u64 << 48) as f64;

/// 2^52. For an integer n below it, the low bits of the floating-point number 2^52 + n are the bits of n.
const WHOLE: f64 = (1_u64 << 52) as f64;

/// Returns the uniform number in (0, 1) computed from a random word.
#[inline(always)]
pub(super) fn uniform_of_word(word: u64) -> f64 {
    uniform_of_value(word >> 16)
}

/// Returns the uniform number (k + ½)/2^48 for the value k.
#[inline(always)]
fn uniform_of_value(value: u64) -> f64 {
    // By the bits of 2^52 + k: with the instructions of any x86-64 processor, a conversion of `u64` takes ten of them.
    (f64::from_bits(WHOLE.to_bits() | value) - WHOLE + 0.5) / VALUES
}

/// Returns the value k of the draw that a uniform number represents.
#[inline]
pub(super) fn value(uniform: f64) -> u64 {
    // Between 0 and 2^48.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let value = (uniform * VALUES) as u64;
    value
}

/// Returns the value k of a uniform number that is exactly (k + ½)/2^48. It avoids a conversion, which would take ten instructions.
#[inline(always)]
pub(super) fn value_of_draw(uniform: f64) -> u64 {
    (uniform * VALUES - 0.5 + WHOLE).to_bits() - WHOLE.to_bits()
}

/// Returns the lower tail probability Φ(−z).
pub(super) fn lower_tail(z: f64) -> f64 {
    0.5 * standstill_numeric::erfc(z * FRAC_1_SQRT_2)
}

/// Returns the uniform number Φ(z) for a standard normal z, rounded to the nearest of the 2^48 values.
pub(super) fn uniform_of_normal(normal: f64) -> f64 {
    let below = uniform_of_value(value(lower_tail(normal.abs())).min((1 << 47) - 1));
    if normal < 0.0 { below } else { 1.0 - below }
}

/// Largest distance of a uniform number from ½ for which [`central`] is valid.
const CENTRAL: f64 = 0.425;

/// Returns the standard normal Φ⁻¹(u) of a uniform number u. The relative error is about 1e-16 plus rounding. Source: algorithm AS 241 of
/// M. J. Wichura, "The percentage points of the normal distribution", Applied Statistics 37 (1988), pp. 477–484.
#[inline]
pub(super) fn normal_of_uniform(uniform: f64) -> f64 {
    let off = uniform - 0.5;
    if off.abs() <= CENTRAL { central(off) } else { tail(uniform) }
}

/// Replaces uniform numbers by their standard normals. The results are bit by bit equal to those of [`normal_of_uniform`].
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+avx2+bmi2", "x86_64+avx2+bmi2"))]
pub(super) fn normals_of_uniforms(numbers: &mut [f64; AT_ONCE]) {
    let uniforms = *numbers;
    for (number, uniform) in numbers.iter_mut().zip(uniforms) {
        *number = central(uniform - 0.5);
    }
    // One number in seven is in a tail.
    let mut tails = 0_u32;
    for (n, uniform) in uniforms.iter().enumerate() {
        tails |= u32::from((uniform - 0.5).abs() > CENTRAL) << n;
    }
    while tails != 0 {
        // Of 32 numbers, mostly five are in a tail; the unused places are computed, too, and ignored.
        let (mut places, mut some, mut count) = ([0; SIDE_BY_SIDE], [0.5 - CENTRAL; SIDE_BY_SIDE], 0);
        while tails != 0 && count < SIDE_BY_SIDE {
            places[count] = tails.trailing_zeros() as usize;
            some[count] = uniforms[places[count]];
            tails &= tails - 1;
            count += 1;
        }
        let mut found = some;
        for number in &mut found {
            *number = near_tail(*number);
        }
        for (place, (uniform, found)) in places.into_iter().zip(some.into_iter().zip(found)).take(count) {
            let is_far = uniform.min(1.0 - uniform) < FAR;
            numbers[place] = if is_far { tail(uniform) } else { found };
        }
    }
}

/// Number of tail values that are computed together.
const SIDE_BY_SIDE: usize = 8;

/// Tail probability above which the coefficients of the near tail are certainly valid. They are valid down to e^−25.
const FAR: f64 = 2e-11;

/// Returns the result of [`tail`] for tail probabilities above [`FAR`], without a branch.
#[inline(always)]
fn near_tail(uniform: f64) -> f64 {
    let beyond = 1.0 - uniform;
    let probability = if uniform < beyond { uniform } else { beyond };
    let r = (-standstill_numeric::ln_branchless(probability)).sqrt();
    ratio(NEAR_TAIL, r - 1.6).copysign(uniform - 0.5)
}

/// Returns the value of a polynomial at `x`. The first coefficient is the constant.
#[inline(always)]
fn polynomial(coefficients: [f64; 8], x: f64) -> f64 {
    coefficients.into_iter().rev().fold(0.0, |sum, coefficient| sum * x + coefficient)
}

/// Returns the ratio of two polynomials at `x`. The first one is the numerator, the second one the denominator.
#[inline(always)]
fn ratio([above, below]: [[f64; 8]; 2], x: f64) -> f64 {
    polynomial(above, x) / polynomial(below, x)
}

/// Returns Φ⁻¹(½ + off). The distance `off` must be at most [`CENTRAL`].
#[inline(always)]
fn central(off: f64) -> f64 {
    off * ratio(MIDDLE, CENTRAL * CENTRAL - off * off)
}

/// Returns Φ⁻¹ of a uniform number in a tail, that is, further than [`CENTRAL`] from ½.
fn tail(uniform: f64) -> f64 {
    let probability = uniform.min(1.0 - uniform);
    let r = (-standstill_numeric::ln(probability)).sqrt();
    let size = if r <= 5.0 { ratio(NEAR_TAIL, r - 1.6) } else { ratio(FAR_TAIL, r - 5.0) };
    if uniform < 0.5 { -size } else { size }
}

// The coefficients as they were published.
#[allow(clippy::excessive_precision, clippy::unreadable_literal)]
#[rustfmt::skip]
mod coefficients {
    /// Numerator and denominator of the middle, for uniform numbers up to `CENTRAL` from ½.
    pub const MIDDLE: [[f64; 8]; 2] = [
        [
            3.3871328727963666080, 1.3314166789178437745e2, 1.9715909503065514427e3, 1.3731693765509461125e4,
            4.5921953931549871457e4, 6.7265770927008700853e4, 3.3430575583588128105e4, 2.5090809287301226727e3,
        ],
        [
            1.0, 4.2313330701600911252e1, 6.8718700749205790830e2, 5.3941960214247511077e3,
            2.1213794301586595867e4, 3.9307895800092710610e4, 2.8729085735721942674e4, 5.2264952788528545610e3,
        ],
    ];

    /// Numerator and denominator of the near tail, for √(−ln p) up to 5.
    pub const NEAR_TAIL: [[f64; 8]; 2] = [
        [
            1.42343711074968357734, 4.63033784615654529590, 5.76949722146069140550, 3.64784832476320460504,
            1.27045825245236838258, 2.41780725177450611770e-1, 2.27238449892691845833e-2, 7.74545014278341407640e-4,
        ],
        [
            1.0, 2.05319162663775882187, 1.67638483018380384940, 6.89767334985100004550e-1,
            1.48103976427480074590e-1, 1.51986665636164571966e-2, 5.47593808499534494600e-4, 1.05075007164441684324e-9,
        ],
    ];

    /// Numerator and denominator of the far tail, for √(−ln p) above 5.
    pub const FAR_TAIL: [[f64; 8]; 2] = [
        [
            6.65790464350110377720, 5.46378491116411436990, 1.78482653991729133580, 2.96560571828504891230e-1,
            2.65321895265761230930e-2, 1.24266094738807843860e-3, 2.71155556874348757815e-5, 2.01033439929228813265e-7,
        ],
        [
            1.0, 5.99832206555887937690e-1, 1.36929880922735805310e-1, 1.48753612908506148525e-2,
            7.86869131145613259100e-4, 1.84631831751005468180e-5, 1.42151175831644588870e-7, 2.04426310338993978564e-15,
        ],
    ];
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tests blocks of uniform numbers over the whole range. Some blocks lie entirely in a tail, with numbers far out; some lie entirely
    /// in the middle.
    #[test]
    fn law_many_numbers_have_the_bits_of_each_alone() {
        let ends = [0, 1, 1000, 3800, 4000, 1 << 20].map(uniform_of_value);
        let mut uniforms: Vec<f64> = ends.into_iter().chain(ends.map(|uniform| 1.0 - uniform)).collect();
        for k in 0..200_000_u32 {
            uniforms.push(uniform_of_value((1 << 47) / 200_000 * u64::from(k) * 2 + 7));
        }
        let (blocks, _) = uniforms.as_chunks::<AT_ONCE>();
        for block in blocks {
            let mut normals = *block;
            normals_of_uniforms(&mut normals);
            for (normal, uniform) in normals.into_iter().zip(block) {
                assert_eq!(normal.to_bits(), normal_of_uniform(*uniform).to_bits(), "{uniform:e}");
            }
        }
    }
}
