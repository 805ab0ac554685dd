//! Whole parts of numbers, as counts and indices.

/// An unsigned integer that a number can be cut to.
pub trait Count {
    /// Returns the whole part.
    fn cut(value: f64) -> Self;
}

macro_rules! counts {
    ($($integer:ty),*) => {
        $(impl Count for $integer {
            #[inline(always)]
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
            fn cut(value: f64) -> Self {
                value as Self
            }
        })*
    };
}

counts!(u8, u32, u64, usize);

/// Returns the whole part of a number as a count. A number below zero and NaN give 0, one beyond the integer its largest value.
///
/// ```
/// assert_eq!((byte(2.9), byte(-1.0), byte(f64::NAN), byte(1e9)), (2, 0, 0, 255));
///
/// fn byte(value: f64) -> u8 {
///     standstill_numeric::whole(value)
/// }
/// ```
#[inline(always)]
pub fn whole<T: Count>(value: f64) -> T {
    T::cut(value)
}
