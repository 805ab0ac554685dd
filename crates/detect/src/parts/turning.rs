//! Check whether the rotor turns: the voltage that its magnet induces makes forward and backward pulses differ across
//! the axis.
//!
//! A magnet of flux ψ that turns at ω induces a voltage vector of ωψ at right angles to itself. The line in direction u
//! sees its component `e = √3 ωψ (u · q)`, with q a quarter turn ahead of the north pole. A forward pulse has U − e to
//! drive its current, a backward pulse U + e. Their inductances differ by `g e / U`, with a factor g of the method.
//! Summed over the three directions,
//! ```text
//! D = along the magnet: saturation;   D_q = −g (3√3/2) ωψ / U
//! ```
//! For a rotor at standstill, D_q consists only of noise, of errors that repetition does not reveal, and of an axis or
//! a saturation that is slightly askew. The sign of D_q gives the direction of rotation once the north pole is known.

use standstill_interface::{AlphaBeta, Angle, Fault, Real, Rotation};

use super::margin::Margin;
use super::polarity::{Pointer, Signature};
use super::significance;

/// g of a method that reads the current at the end of its pulses: i = (U ∓ e) t / L both ways.
pub(crate) const AT_THE_END: f64 = 2.0;

/// g of a method that fits a slope of the inductance over the current to the samples of a pulse and its decay.
///
/// The current i of a symmetric pulse rises to a peak at t₁ and falls as long. A slope c adds c i² / (2L), which squared
/// and integrated over both halves is c² U⁴ t₁⁵ / (10 L⁶); the magnet adds −e t / L, in product with the former
/// −c e U² t₁⁴ / (3 L⁴). The best fit is the slope −(10/3) e L² / (U² t₁), which at the peak is −(10/3) e / U of the
/// inductance.
pub(crate) const BY_SLOPE: f64 = 10.0 / 3.0;

/// Number of standard deviations of D_q up to which a rotor counts as standing still. Chance exceeds it in two of a
/// billion starts, if the deviation is known; see [`estimated`].
const DEVIATIONS: f64 = 6.0;

/// Share of D along the magnet that may lie across it where the rotor stands: 8.5° askew.
const ASKEW: f64 = 0.15;

/// One degree in rad, the unit in which allowed differences between successive axes of a rotor at standstill are
/// stated.
pub(crate) const DEGREE: f64 = core::f64::consts::PI / 180.0;

/// Largest ratio of D across the magnet to D along it for which the latter distinguishes north from south, and so
/// forward from backward.
const MOST_ACROSS: f64 = 4.0;

/// Returns a variance, enlarged so that six standard deviations of it are exceeded as rarely as with a known variance,
/// although it was estimated with this many degrees of freedom. An estimate from few readings may by chance be far too
/// small, in one of a thousand starts: see [`significance`].
pub(crate) fn estimated<T: Real>(variance: T, freedom: T) -> T {
    (significance::scattered(variance, freedom) / T::of(DEVIATIONS * DEVIATIONS)).max(variance)
}

/// Check whether the rotor stands still, by D.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Standing<T> {
    /// D_q for each volt of ωψ: g (3√3/2) / U, in D's unit.
    pub by_volt: T,
    /// Flux of the magnet in Wb.
    pub flux: T,
    pub signature: Signature,
    /// Largest probability of a wrong pole at which the pole still gives the direction of rotation.
    pub pole_error: T,
}

impl<T: Real> Standing<T> {
    /// Makes the check for a method with this factor g whose D is relative to the inductance, with pulses of a link of
    /// this voltage in V.
    pub fn of(g: f64, volts: T, flux: T, (signature, pole_error): (Signature, T)) -> Self {
        let by_volt = T::of(g * 1.5) * T::of(3.0).sqrt() / volts;
        Self { by_volt, flux, signature, pole_error }
    }

    /// Returns the speed in rad/s electrical above which a rotor counts as turning; arguments: D along the magnet, its
    /// standard deviation, and that of the axis in rad.
    fn allowed(&self, along: T, deviation: T, axis: T) -> T {
        let askew = along.abs() * (T::of(ASKEW) + axis * T::of(DEVIATIONS));
        (deviation * T::of(DEVIATIONS) + askew) / (self.by_volt * self.flux)
    }

    /// Checks D; `deviation`: standard deviation of the axis in rad.
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
        check_speed(margin, speed, allowed, self.way(pointer, axis))
    }

    /// Returns the direction of rotation; none if the pole is open.
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

/// Number of standard deviations of an injection's noise that count as one: the few readings before it may by chance
/// show only a third of the real noise.
pub(crate) const FEW: f64 = 3.0;

/// Returns the part of a vector that neither a constant nor another vector explains.
pub(crate) fn beside<T: Real, const N: usize>(of: [T; N], other: [T; N]) -> [T; N] {
    let without_mean = |of: [T; N]| {
        let mean = of.iter().fold(T::zero(), |sum, value| sum + *value) / T::of(N as f64);
        of.map(|value| value - mean)
    };
    let (of, other) = (without_mean(of), without_mean(other));
    let product = |a: [T; N], b: [T; N]| a.into_iter().zip(b).fold(T::zero(), |sum, (a, b)| sum + a * b);
    let square = product(other, other);
    let share = if square > T::zero() { product(of, other) / square } else { T::zero() };
    core::array::from_fn(|k| of[k] - share * other[k])
}

/// Returns the standard deviation to be used for noise of this variance, estimated with this many degrees of freedom
/// with three sensors, or with two (`derived`).
pub(crate) fn deviation<T: Real>(variance: T, freedom: T, derived: bool) -> T {
    let sensors = T::of(if derived { BY_TWO } else { 1.0 });
    (estimated(variance, freedom) * sensors).sqrt()
}

/// Ratio of two estimates of a speed up to which they are the same speed.
const MOST_UNLIKE: f64 = 2.5;

/// Returns the direction of rotation of an axis that has moved by `ahead` in rad. None if the movement in a shorter
/// time, `within`, of which `share` of `ahead` is expected, shows another speed: an axis looks the same after half a
/// turn, so a fast rotor seems to creep in either direction.
pub(crate) fn direction<T: Real>(ahead: T, within: T, share: T) -> Option<Rotation> {
    let alike = within / (ahead * share);
    let is_known = alike > T::of(1.0 / MOST_UNLIKE) && alike < T::of(MOST_UNLIKE);
    let way = if ahead > T::zero() { Rotation::Forward } else { Rotation::Backward };
    is_known.then_some(way)
}

/// Checks that an axis has not moved. Arguments: the angle in rad by which the axis is ahead, and the time in s; the
/// standard deviation of that angle; an additional angle that is allowed; the direction of rotation, if it is known.
pub(crate) fn check_axis<T: Real>(
    margin: &mut Margin<T>,
    (ahead, seconds): (T, T),
    deviation: T,
    apart: T,
    way: Option<Rotation>,
) -> Result<(), Fault<T>> {
    let allowed = apart + deviation * T::of(DEVIATIONS);
    margin.compared(allowed / seconds, seconds);
    check_speed(margin, (ahead / seconds).abs(), allowed / seconds, way)
}

/// Returns the largest rms scatter in A of this many readings of a constant current vector, from sensors with this
/// noise in A.
pub(crate) fn held<T: Real>(noise: T, derived: bool, readings: T) -> T {
    let sensors = T::of(if derived { BY_TWO } else { 1.0 });
    // Both components of a vector, which three sensors read with two thirds of the noise's variance each.
    let variance = noise * noise * sensors * T::of(4.0 / 3.0);
    (variance * (T::one() + T::of(DEVIATIONS) / readings.sqrt())).sqrt()
}

/// Checks that a measured speed in rad/s is at most `allowed`, which readings of a rotor at rest may show by their
/// errors.
pub(crate) fn check_speed<T: Real>(
    margin: &mut Margin<T>,
    speed: T,
    allowed: T,
    way: Option<Rotation>,
) -> Result<(), Fault<T>> {
    margin.at_most(speed, allowed);
    // A speed that is not a number passes here; another check ends the detection.
    if speed > allowed { Err(Fault::RotorTurns { speed, allowed, way }) } else { Ok(()) }
}

/// Returns the current in A that a volt drives in `seconds` through this resistance in Ω and inductance in H: `(1 −
/// e^(−R t/L))/R`.
pub(crate) fn by_volt<T: Real>(seconds: T, resistance: T, inductance: T) -> T {
    let x = resistance * seconds / inductance;
    let rises = if x > T::of(1e-3) { -(-x).exp_m1() / x } else { T::one() - x / T::of(2.0) };
    seconds / inductance * rises
}

/// Terminals that are connected with one another for a while, so that a turning magnet drives a current across itself:
/// `−ωψ/R (1 − e^(−R t/L_q))`, or `−ωψ t/L_q` without resistance.
///
/// A rotor at standstill drives no current, and nothing else does: no device carries a current of which a late edge, a
/// dead time or the charge of a terminal could take a share, no iron is magnetised, and a late sample finds the same
/// current. Only noise and offsets of the sensors remain, and both are known from readings without current.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Short<T> {
    /// Time in s for which the terminals are connected.
    pub duration: T,
    /// Resistance of the winding in Ω; the next fields are L_q in H and the magnet's flux linkage in Wb.
    pub resistance: T,
    pub inductance: T,
    pub flux: T,
    /// Voltage drop in V of a switch and a diode in the path of a current through two phases.
    pub lost: T,
}

/// Allowed voltage that seems to drive a current at standstill, as a share of the link's: by offsets that a converter
/// rounds.
const AT_REST: f64 = 0.001;

/// If the axis is wrong, opposite vectors have opposite currents across it. This share of these currents may appear as
/// equal ones, because a core has less inductance across the magnet while a vector along it saturates it.
pub(crate) const UNEVEN: f64 = 0.05;

/// Largest ratio of the variance of a current vector's components with two sensors to that with three.
const BY_TWO: f64 = 2.6;

impl<T: Real> Short<T> {
    /// Checks the current vector in A at the end of the connection, offsets removed; `volts`: voltage of the link;
    /// `deviation`: of the vector's components, in A; `north`: the pole, if it is known, by an axis that was measured
    /// `since` seconds before. Returns the largest speed in rad/s that this check does not show.
    pub fn check(
        &self,
        margin: &mut Margin<T>,
        current: AlphaBeta<T>,
        (volts, deviation): (T, T),
        (north, since): (Option<Angle<T>>, T),
    ) -> Result<T, Fault<T>> {
        let by_volt = by_volt(self.duration, self.resistance, self.inductance);
        // One phase against two: two thirds of the voltage that devices take of a line.
        let lost = self.lost * T::of(2.0 / 3.0);
        let speed = |current: T| (current / by_volt + lost) / self.flux;
        let allowed = deviation * T::of(DEVIATIONS) + by_volt * volts * T::of(AT_REST);
        // The margin compares currents: a speed contains the drops of devices even for the allowed current.
        let size = current.alpha.hypot(current.beta);
        margin.at_most(size, allowed);
        let (speed, allowed, is_more) = (speed(size), speed(allowed), size > allowed);
        if is_more {
            // If the rotor has turned away from the measured axis, the pole gives no direction.
            let north = north.filter(|_| speed * since < Pointer::most_off_axis());
            let ahead = |north| current.park(north).q < T::zero();
            let way = north.map(|north| if ahead(north) { Rotation::Forward } else { Rotation::Backward });
            return Err(Fault::RotorTurns { speed, allowed, way });
        }
        Ok(allowed)
    }
}

#[cfg(test)]
mod tests;
