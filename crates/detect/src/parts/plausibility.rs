//! Plausibility: whether readings can come from the motor and the drive of the data sheets, without a fault.
//!
//! An open wire, a sensor that is dead, stuck or reversed, a weak contact or a motor of another type changes currents
//! in ways that a method alone may take for an angle. Each check compares the readings of pulses with the range that
//! the tolerances of intact parts allow.

use standstill_interface::{Fault, Nanos, Phase, Reading, Real, Sensed};

use super::losses::{Losses, Timing};
use super::margin::Margin;
use super::train::{Derived, GainComparison, LINES, PulseTrainSettings, Train};
use crate::checks::{Check, Checks};
use crate::nameplate::{Nameplate, Place};
use crate::settings::{SettingsError, require, require_positive, require_zero_or_more};

/// The checks of a method with line pulses, and the limits for intact parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlausibilitySettings<T> {
    /// Checks that are on.
    pub checks: Checks,
    /// Largest sum of the currents that three sensors show, as a share of the line's.
    pub sensors: T,
    /// Whether the phase that is open during a pulse has no current, because its terminal stays between the rails.
    pub idle_is_blocked: bool,
    /// Smallest and largest inductance in H of two phases in series of the data sheet's motor, without current.
    pub line: [T; 2],
    /// |L_q − L_d| / (L_q + L_d) of the data sheet's motor, without current.
    pub saliency: T,
    /// Pulse in s that raises the rated current; `saturates`, the next field: share of the inductance that is left at
    /// that current.
    pub rated_pulse: T,
    pub saturates: T,
    /// Largest difference between a line's forward and backward inductances, as a share of their mean: caused by all
    /// parts of the drive, and by the difference of the poles in a pulse of that length.
    pub both_ways: [T; 2],
    /// Smallest and largest voltage in V of the DC link.
    pub dc_link: [T; 2],
    /// Standard deviation in s of each line's own part of the time between edges and samples, in addition to a part
    /// that all lines have in common.
    pub edge_deviation: T,
    /// Flux linkage of the magnet in Wb, by which a turning rotor induces a voltage; zero without a magnet.
    pub magnet_flux: T,
}

/// Share by which a motor's inductances may differ from its data sheet, and the link from its nominal voltage.
const SHEET: f64 = 0.35;

/// Share by which each of a motor's two inductances may differ from its data sheet for the check of the saliency.
const EACH: f64 = 0.1;

/// Number of standard errors by which a saliency may leave its range, as a multiple of those that make one significant:
/// six. One in a billion starts exceeds that.
const BEYOND: f64 = 1.5;

/// Largest ratio of the inductances along the two axes for which an open terminal stays between the rails and its
/// diodes carry no current. With Γ = diag(1/L_d, 1/L_q) turned by the rotor, the terminal is (√3/2) |Γ_⊥∥ / Γ_⊥⊥| of
/// the link's voltage away from the middle, at most (√3/4) (r − 1) / √r. At r = 3 this is one half, where the rails
/// are. The constant is lower, to allow for saturation.
const BLOCKED: f64 = 2.2;

/// Largest mean square of the difference between two sensors of a current that a factor does not explain, as a multiple
/// of the variance in the zeroing. Some twenty readings exceed it by chance in one of a hundred million starts.
const SCATTER: f64 = 4.0;

/// Rms difference of two intact sensors in a pulse, as a share of the current: filters that differ, edges, bends.
const UNEVEN: f64 = 0.005;

/// Returns the largest difference between the forward and backward responses of an intact drive, as a share of their
/// mean: the part of all components of the drive, and the part of the poles at rated current.
fn by_poles<T: Real>(drive: &Nameplate<T>) -> [T; 2] {
    [T::of(0.1), T::of(2.0) * drive.polarity_difference.abs()]
}

/// Returns the sum of both parts for currents near the rated one. If the data sheet states no difference of the poles,
/// returns 2, the largest possible value, which limits nothing.
pub(crate) fn both_ways<T: Real>(drive: &Nameplate<T>) -> T {
    let [parts, poles] = by_poles(drive);
    if poles > T::zero() { parts + poles } else { T::of(2.0) }
}

impl<T: Real> PlausibilitySettings<T> {
    /// Returns limits for this motor and drive.
    ///
    /// Two sensors may differ by their gains: eight standard deviations, and two per cent. A data sheet's inductance is
    /// accurate to a third; a core that saturates has a smaller one, because its rated pulse is shorter, and the
    /// resistive drop makes it look larger. One direction of a line may saturate by the difference of the poles at
    /// rated current. Both grow for pulses longer than the rated one.
    pub(crate) fn suited(drive: &Nameplate<T>) -> Self {
        let [least, most] = [
            drive.d_axis_inductance.min(drive.q_axis_inductance),
            drive.d_axis_inductance.max(drive.q_axis_inductance),
        ];
        let two = T::of(2.0);
        let linear = two * least * drive.rated_current / drive.dc_link;
        let saturates = (T::of(drive.rated_pulse.seconds()) / linear).min(T::one());
        let [below, above] = [T::of(1.0 - SHEET), T::of(1.0 + SHEET)];
        Self {
            checks: Checks::ALL,
            idle_is_blocked: most < least * T::of(BLOCKED),
            sensors: T::of(0.02) + T::of(8.0) * drive.gain_tolerance,
            line: [two * least * below, two * most * above],
            saliency: (most - least) / (most + least),
            rated_pulse: T::of(drive.rated_pulse.seconds()),
            saturates,
            both_ways: by_poles(drive),
            dc_link: [drive.dc_link * below, drive.dc_link * above],
            // The voltage ends at the mean of the turn-offs of two legs, (τa + τb + τc) / 2 − τc / 2. So do the filters of two sensors.
            edge_deviation: (drive.delay_mismatch * drive.delay_mismatch / T::of(4.0)
                + drive.sensing.lag_deviation() * drive.sensing.lag_deviation() / two)
                .sqrt(),
            magnet_flux: drive.magnet_flux,
        }
    }

    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        require_positive(self.sensors, "plausibility.sensors")?;
        require_positive(self.line[0], "plausibility.line")?;
        require(self.line[1] > self.line[0], "plausibility.line", "an upper limit above the lower one")?;
        require_zero_or_more(self.saliency, "plausibility.saliency")?;
        require(self.saliency < T::one(), "plausibility.saliency", "below 1")?;
        require_positive(self.rated_pulse, "plausibility.rated_pulse")?;
        require_positive(self.saturates, "plausibility.saturates")?;
        require_positive(self.both_ways[0], "plausibility.both_ways")?;
        require_zero_or_more(self.both_ways[1], "plausibility.both_ways")?;
        require_positive(self.dc_link[0], "plausibility.dc_link")?;
        require(
            self.dc_link[1] > self.dc_link[0],
            "plausibility.dc_link",
            "an upper limit above the lower one",
        )?;
        require_zero_or_more(self.edge_deviation, "plausibility.edge_deviation")?;
        require_zero_or_more(self.magnet_flux, "plausibility.magnet_flux")
    }

    /// Checks the link's voltage in a reading.
    pub(crate) fn link(&self, margin: &mut Margin<T>, reading: &Reading<T>) -> Result<(), Fault<T>> {
        if !self.checks.has(Check::Link) {
            return Ok(());
        }
        let [low, high] = self.dc_link;
        margin.at_least(reading.dc_link, low);
        margin.at_most(reading.dc_link, high);
        if reading.dc_link >= low && reading.dc_link <= high {
            Ok(())
        } else {
            Err(Fault::DcLinkOutOfRange { found: reading.dc_link, allowed: self.dc_link })
        }
    }

    /// Checks that the currents of three sensors sum to zero at the end of a pulse, and that the third phase has no
    /// current if it cannot have any. The currents have no offsets: `from` enters the line at one sensor, `to` leaves
    /// it at the other, `idle` is the third phase; `allowed`: limit in A.
    pub(crate) fn sum(
        &self,
        margin: &mut Margin<T>,
        reading: &Reading<T>,
        (from, to): (T, T),
        idle: T,
        allowed: T,
    ) -> Result<(), Fault<T>> {
        // A current that is derived from the other two always agrees with them.
        let derived = Phase::ALL.iter().any(|phase| reading.sensed[*phase] != Sensed::Measured);
        if derived || !self.checks.has(Check::Sensors) {
            return Ok(());
        }
        let mut holds = |apart: T| {
            margin.at_most(apart, allowed);
            if apart <= allowed { Ok(()) } else { Err(Fault::SensorsDisagree { apart, allowed }) }
        };
        holds((from - to + idle).abs())?;
        if self.idle_is_blocked { holds(idle.abs()) } else { Ok(()) }
    }

    /// Returns the smallest and the largest inductance in H of a line in pulses of this length in s, and the largest
    /// difference between both directions. A rated pulse saturates according to the data sheet; a longer one saturates
    /// in proportion to the current, at most by four fifths in all; a shorter one gets the range of the rated pulse.
    fn of_pulse(&self, pulse: T) -> ([T; 2], T) {
        let times = (pulse / self.rated_pulse).max(T::one());
        ([self.line[0] * self.left(pulse), self.line[1]], self.both_ways[0] + self.both_ways[1] * times)
    }

    /// Returns the share of an inductance that saturation leaves in a pulse of this length in s.
    fn left(&self, pulse: T) -> T {
        let times = (pulse / self.rated_pulse).max(T::one());
        (T::one() - (T::one() - self.saturates) * times).max(self.saturates.min(T::of(0.2)))
    }

    /// Returns the smallest and the largest |L_B|/L_A of the data sheet's motor in pulses of this length in s, whose
    /// current the resistance of a phase in Ω bends.
    ///
    /// With `z = (r − 1)/(r + 1)` and the ratio r of the larger inductance to the smaller one, `artanh z = ln(r)/2`. If
    /// each inductance may differ by a share τ, r changes by (1 + τ)/(1 − τ) at most, and artanh z by artanh τ: z lies
    /// between (z ∓ τ)/(1 ∓ z τ). If saturation leaves a share s of one of them, artanh z changes by ln(1/s)/2 more. A
    /// current that a resistance bends adds the same amount to all lines, which makes z smaller.
    fn saliencies(&self, pulse: T, resistance: T) -> [T; 2] {
        let saturates = self.left(pulse);
        let tolerance = T::of((1.0 + EACH) / (1.0 - EACH)) / saturates;
        let ratio = (T::one() + self.saliency) / (T::one() - self.saliency);
        let of_ratio = |ratio: T| (ratio - T::one()) / (ratio + T::one());
        let bent = resistance * T::of(2.0) * pulse / (self.line[0] * saturates);
        [
            of_ratio(ratio / tolerance).max(T::zero())
                / (T::one() + bent / T::of(2.0) + bent * bent / T::of(12.0)),
            of_ratio(ratio * tolerance),
        ]
    }

    /// Checks that a saliency is that of the data sheet's motor: shorted turns add one of their own, along the axis of
    /// their phase. `ratio`: |L_B|/L_A, measured with pulses of this length; `square`: square of the ratio that its
    /// errors require of a significant one; `resistance`: see [`Self::inductances`].
    pub(crate) fn saliency(
        &self,
        margin: &mut Margin<T>,
        (ratio, square): (T, T),
        pulse: Nanos,
        resistance: T,
    ) -> Result<(), Fault<T>> {
        // If the third leg's diodes carry a part of the current, lines have other inductances than two phases in series.
        if !self.checks.has(Check::Saliency) || !self.idle_is_blocked {
            return Ok(());
        }
        let errors = square.sqrt() * T::of(BEYOND);
        let [low, high] = self.saliencies(T::of(pulse.seconds()), resistance);
        let (low, high) = (low - errors, high + errors);
        if low > T::zero() {
            margin.at_least(ratio, low);
        }
        margin.at_most(ratio, high);
        if ratio < low || ratio > high {
            return Err(Fault::SaliencyOutOfRange { found: ratio, allowed: [low.max(T::zero()), high] });
        }
        Ok(())
    }

    /// Checks that no phase has more resistance than the others, see [`Losses::check`].
    pub(crate) fn contact(
        &self,
        margin: &mut Margin<T>,
        losses: &Losses<T>,
        train: &Train<T>,
        lines: [T; 3],
        (volts, late): (T, [T; 3]),
    ) -> Result<(), Fault<T>> {
        // If the third leg's diodes carry a part of the current, lines differ for that reason.
        let on = self.checks.has(Check::Contact) && self.idle_is_blocked;
        if on {
            losses.check(margin, train, lines, Timing { volts, late, deviation: self.edge_deviation })
        } else {
            Ok(())
        }
    }

    /// Checks that the two sensors of each line differ only by a factor and by noise. A stuck bit of a converter makes
    /// steps, which no factor explains.
    pub(crate) fn codes(
        &self,
        margin: &mut Margin<T>,
        gains: &GainComparison<T>,
        train: &Train<T>,
    ) -> Result<(), Fault<T>> {
        // A single shunt has no second sensor to compare, nor has a line whose other phase is derived.
        let both =
            train.settings.place == Place::InLine && train.derived == Derived::None && self.idle_is_blocked;
        if !both || !self.checks.has(Check::Codes) {
            return Ok(());
        }
        for (apart, current) in gains.residuals() {
            let systematic = current * T::of(UNEVEN);
            let allowed = (train.noise * T::of(SCATTER) + systematic * systematic).sqrt();
            margin.at_most(apart, allowed);
            if apart > allowed {
                return Err(Fault::SensorsDisagree { apart, allowed });
            }
        }
        Ok(())
    }

    /// Checks the inductances in H of the three lines, backward and forward, from pulses of this length; `resistance`:
    /// that of a phase in Ω, if the inductances contain its effect, else zero.
    pub(crate) fn inductances(
        &self,
        margin: &mut Margin<T>,
        lines: [[T; 2]; 3],
        pulse: Nanos,
        resistance: T,
    ) -> Result<(), Fault<T>> {
        if !self.checks.has(Check::Inductance) {
            return Ok(());
        }
        let pulse = T::of(pulse.seconds());
        let ([low, high], _) = self.of_pulse(pulse);
        // A current that a resistance bends looks like one of a larger inductance: x / (1 − e⁻ˣ) of it, x = R t / L.
        let x = resistance * T::of(2.0) * pulse / low;
        let high = high * (T::one() + x / T::of(2.0) + x * x / T::of(12.0));
        for (k, [back, forward]) in lines.into_iter().enumerate() {
            let found = (back + forward) / T::of(2.0);
            margin.at_least(found, low);
            margin.at_most(found, high);
            if !(found >= low && found <= high) {
                return Err(Fault::InductanceOutOfRange { phase: LINES[k].0, found, allowed: [low, high] });
            }
        }
        Ok(())
    }

    /// Checks that these inductances in H, backward and forward, differ by no more than the poles can make them.
    pub(crate) fn directions(
        &self,
        margin: &mut Margin<T>,
        lines: [[T; 2]; 3],
        train: &PulseTrainSettings<T>,
    ) -> Result<(), Fault<T>> {
        if !self.checks.has(Check::BothWays) {
            return Ok(());
        }
        let (_, allowed) = self.of_pulse(T::of(train.pulse.seconds()));
        for (k, [back, forward]) in lines.into_iter().enumerate() {
            let apart = T::of(2.0) * (forward - back).abs() / (back + forward);
            margin.at_most(apart, allowed);
            if apart > allowed || !apart.is_finite() {
                return Err(Fault::DirectionsDiffer { phase: Some(LINES[k].0), apart, allowed });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
