//! Whether the rotor turns: what its magnet induces makes pulses both ways differ across the axis.
//!
//! A magnet of flux ψ that turns at ω induces a vector of ωψ across itself, of which the line in direction u sees
//! `e = √3 ωψ (u · q)`, q a quarter turn ahead of the north pole. A pulse forward has U − e for its current, one backward U + e: their
//! inductances differ by `g e / U`, with a g of the method. Summed over the three directions,
//! ```text
//! D = along the magnet: saturation;   D_q = −g (3√3/2) ωψ / U
//! ```
//! A rotor that stands has no D_q but for noise, for what repetition does not reveal, and for an axis or a saturation that is a little
//! askew. The sign of D_q says which way the rotor turns once the north pole is known.

use standstill_interface::{Angle, Fault, Real, Rotation};

use super::margin::Margin;
use super::polarity::{Pointer, Signature};
use super::significance;

/// g of a method that reads the current at the end of its pulses: i = (U ∓ e) t / L both ways.
pub(crate) const AT_THE_END: f64 = 2.0;

/// g of a method that fits a slope of the inductance over the current to the samples of a pulse and its decay.
///
/// The current i of an even pulse rises to a peak at t₁ and falls as long. A slope c adds c i² / (2L), which squared and integrated
/// over both halves is c² U⁴ t₁⁵ / (10 L⁶); the magnet adds −e t / L, in product with the former −c e U² t₁⁴ / (3 L⁴). The slope that
/// fits best is −(10/3) e L² / (U² t₁), which at the peak is −(10/3) e / U of the inductance.
pub(crate) const BY_SLOPE: f64 = 10.0 / 3.0;

/// Standard deviations of D_q up to which a rotor is taken to stand: by chance beyond in two of a billion starts, where the deviation is
/// known; see [`estimated`].
const DEVIATIONS: f64 = 6.0;

/// Share of D along the magnet that may lie across it where the rotor stands: 8.5° askew.
const ASKEW: f64 = 0.15;

/// Ratio of D across the magnet to D along it up to which the latter tells north from south, hence forward from backward.
const MOST_ACROSS: f64 = 4.0;

/// The variance of which six deviations are as seldom exceeded by chance as those of an estimate with so many degrees of freedom may be,
/// in one of a thousand starts: of few readings an estimate may by chance be far too small, see [`significance`].
pub(crate) fn estimated<T: Real>(variance: T, freedom: T) -> T {
    (significance::scattered(variance, freedom) / T::of(DEVIATIONS * DEVIATIONS)).max(variance)
}

/// The check whether the rotor stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Standing<T> {
    /// D_q for each volt of ωψ: g (3√3/2) / U, in D's unit.
    pub by_volt: T,
    /// Flux of the magnet in Wb.
    pub flux: T,
    pub signature: Signature,
    /// Probability of a wrong pole that is allowed to a pole that names a direction.
    pub pole_error: T,
}

impl<T: Real> Standing<T> {
    /// For a method of this g whose D is relative to the inductance, pulses of a link of this voltage in V.
    pub fn of(g: f64, volts: T, flux: T, (signature, pole_error): (Signature, T)) -> Self {
        let by_volt = T::of(g * 1.5) * T::of(3.0).sqrt() / volts;
        Self { by_volt, flux, signature, pole_error }
    }

    /// The speed in rad/s electrical beyond which a rotor is taken to turn, for D along the magnet, its standard deviation, and that of the
    /// axis in rad.
    fn allowed(&self, along: T, deviation: T, axis: T) -> T {
        let askew = along.abs() * (T::of(ASKEW) + axis * T::of(DEVIATIONS));
        (deviation * T::of(DEVIATIONS) + askew) / (self.by_volt * self.flux)
    }

    /// Checks D of a rotor whose axis is known with this standard deviation in rad.
    pub fn check(
        &self,
        margin: &mut Margin<T>,
        pointer: &Pointer<T>,
        axis: Angle<T>,
        deviation: T,
    ) -> Result<(), Fault<T>> {
        // Without a magnet nothing is induced.
        if self.flux <= T::zero() {
            return Ok(());
        }
        let on = pointer.direction.park(axis);
        let speed = on.q.abs() / (self.by_volt * self.flux);
        let allowed = self.allowed(on.d, pointer.deviation, deviation);
        margin.at_most(speed, allowed);
        // What is not a number is no speed; it ends a detection elsewhere.
        if speed > allowed {
            Err(Fault::RotorTurns { speed, allowed, way: self.way(pointer, axis) })
        } else {
            Ok(())
        }
    }

    /// Which way it turns; none where the pole stays open.
    fn way(&self, pointer: &Pointer<T>, axis: Angle<T>) -> Option<Rotation> {
        let on = pointer.direction.park(axis);
        if on.q.abs() > on.d.abs() * T::of(MOST_ACROSS) {
            return None;
        }
        let north = pointer.north(axis, self.signature, self.pole_error)?;
        let ahead = pointer.direction.park(north).q;
        Some(if ahead < T::zero() { Rotation::Forward } else { Rotation::Backward })
    }
}

#[cfg(test)]
mod tests;
