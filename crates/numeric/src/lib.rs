//! Arithmetic and elementary functions: the same operations, in the same order, on every machine.
//!
//! * [`Lane`]: a number, or several of them side by side in wide registers ([`Wide`]). Equations are written once for both.
//! * [`sin_cos`], [`power`], [`four`], [`eight`]: functions of a lane that no library has for several numbers.
//! * [`sin`], [`exp`], [`ln`], [`hypot`] and so on: functions of one number, from a library that every machine has alike.
//! * [`PER_FACTORIAL`]: the coefficients of exponentials.
//! * [`Symmetric`]: a 2×2 matrix such as an inverse inductance.
//! * [`Heading`]: an angle as its sine and cosine.
//! * [`dot`], [`dots`]: products of rows, one or four side by side.
//! * [`beta`]: the incomplete beta function, for tails of distributions.
//! * [`rank`]: where a quantile stands among sorted values.
//! * [`root`]: where a function of one number is zero.
//!
//! ```
//! use standstill_numeric::{OnWidest, Wide, Width, on_widest, sin_cos};
//!
//! struct SineOfLast;
//! impl OnWidest for SineOfLast {
//!     type Output = f64;
//!     fn with<V: Wide>(self) -> f64 {
//!         let mut angles = V::of(0.5);
//!         angles.put(V::LANES - 1, 1.5);
//!         sin_cos(angles).0.get(V::LANES - 1)
//!     }
//! }
//! // A lane has the bits that the number has alone.
//! assert_eq!(on_widest(Width::Avx512, SineOfLast).to_bits(), sin_cos(1.5_f64).0.to_bits());
//! ```
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the C library"))]

mod beta;
mod dot;
mod factorials;
mod functions;
mod heading;
mod lane;
mod quantile;
mod root;
mod symmetric;
mod whole;

pub use beta::beta;
pub use dot::{ROWS, dot, dots};
pub use factorials::PER_FACTORIAL;
pub use functions::{
    atan2, cos, erfc, exp, exp_m1, hypot, ln, ln_1p, ln_branchless, ln_gamma, log10, powf, sin,
};
pub use heading::Heading;
pub use lane::{
    Compute, Lane, MOST_LANES, Mask, OnWidest, Wide, Width, eight, four, on_widest, power, sin_cos,
};
pub use quantile::rank;
pub use root::root;
pub use symmetric::Symmetric;
pub use whole::{Count, whole};
