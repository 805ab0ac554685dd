//! Whether readings can be those of the motor and the drive that the data sheets describe, with all parts whole.
//!
//! An open wire, a sensor that is dead, stuck or reversed, a weak contact or a motor of another type changes currents in ways that a
//! method alone may take for an angle. Each check compares what pulses show with what tolerances of whole parts leave room for.

use standstill_interface::{Fault, Phase, Reading, Real, Sensed};

use super::margin::Margin;
use super::train::{LINES, PulseTrainSettings};
use crate::nameplate::Nameplate;
use crate::settings::{SettingsError, require, require_positive};

/// The checks of a method by line pulses, and the limits of what whole parts may show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlausibilitySettings<T> {
    /// Whether readings are checked.
    pub on: bool,
    /// Largest sum of the currents that three sensors show, as a share of the line's.
    pub sensors: T,
    /// Whether the phase that is open during a pulse has no current, because its terminal stays between the rails.
    pub idle_is_blocked: bool,
    /// Smallest and largest inductance in H of two phases in series in the pulses of the data sheet's motor.
    pub line: [T; 2],
    /// Largest difference between a line's inductances forward and backward, as a share of their mean.
    pub both_ways: T,
    /// Smallest and largest voltage in V of the DC link.
    pub dc_link: [T; 2],
}

/// Share by which a motor's inductances may differ from its data sheet, and the link from its nominal voltage.
const SHEET: f64 = 0.35;

/// Largest ratio of the inductances along the two axes up to which an open terminal stays between the rails, and its diodes without a
/// current. With Γ = diag(1/L_d, 1/L_q) turned by the rotor, the terminal is (√3/2) |Γ_⊥∥ / Γ_⊥⊥| of the link away from the middle, at
/// most (√3/4) (r − 1) / √r: half of it, where the rails are, at r = 3. Saturation leaves room below.
const BLOCKED: f64 = 2.2;

impl<T: Real> PlausibilitySettings<T> {
    /// Limits for this motor and drive.
    ///
    /// Two sensors differ by their gains: eight deviations, and two per cent. A data sheet's inductance is good to a third; a core that
    /// saturates has less, as its rated pulse is shorter, and the drop across the resistance makes it look larger. One way of a line
    /// saturates by what the poles differ at rated current.
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
            on: true,
            idle_is_blocked: most < least * T::of(BLOCKED),
            sensors: T::of(0.02) + T::of(8.0) * drive.gain_tolerance,
            line: [two * least * saturates * below, two * most * above],
            both_ways: T::of(0.1) + two * drive.polarity_difference.abs(),
            dc_link: [drive.dc_link * below, drive.dc_link * above],
        }
    }

    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        require_positive(self.sensors, "plausibility.sensors")?;
        require_positive(self.line[0], "plausibility.line")?;
        require(self.line[1] > self.line[0], "plausibility.line", "an upper limit above the lower one")?;
        require_positive(self.both_ways, "plausibility.both_ways")?;
        require_positive(self.dc_link[0], "plausibility.dc_link")?;
        require(
            self.dc_link[1] > self.dc_link[0],
            "plausibility.dc_link",
            "an upper limit above the lower one",
        )
    }

    /// Checks the link's voltage in a reading.
    pub(crate) fn link(&self, margin: &mut Margin<T>, reading: &Reading<T>) -> Result<(), Fault<T>> {
        let [low, high] = self.dc_link;
        margin.at_least(reading.dc_link, low);
        margin.at_most(reading.dc_link, high);
        if reading.dc_link >= low && reading.dc_link <= high {
            Ok(())
        } else {
            Err(Fault::DcLinkOutOfRange { found: reading.dc_link, allowed: self.dc_link })
        }
    }

    /// Checks of three sensors that their currents sum to zero at the end of a pulse, and that the third phase has none where it cannot
    /// have any. Offsets are removed: what enters a line by one sensor, what leaves it by the other, and the third phase; `allowed` in A.
    pub(crate) fn sum(
        &self,
        margin: &mut Margin<T>,
        reading: &Reading<T>,
        (from, to): (T, T),
        idle: T,
        allowed: T,
    ) -> Result<(), Fault<T>> {
        // What follows from the other two agrees with them.
        if Phase::ALL.iter().any(|phase| reading.sensed[*phase] != Sensed::Measured) {
            return Ok(());
        }
        let mut holds = |apart: T| {
            margin.at_most(apart, allowed);
            if apart <= allowed { Ok(()) } else { Err(Fault::SensorsDisagree { apart, allowed }) }
        };
        holds((from - to + idle).abs())?;
        if self.idle_is_blocked { holds(idle.abs()) } else { Ok(()) }
    }

    /// Checks the inductances in H of the three lines, backward and forward, which pulses of `train` have shown.
    pub(crate) fn lines(
        &self,
        margin: &mut Margin<T>,
        lines: [[T; 2]; 3],
        train: &PulseTrainSettings<T>,
    ) -> Result<(), Fault<T>> {
        if !self.on {
            return Ok(());
        }
        let [low, high] = self.line;
        // A current that a resistance bends looks like one of a larger inductance: x / (1 − e⁻ˣ) of it, x = R t / L.
        let x = train.resistance * T::of(2.0) * T::of(train.pulse.seconds()) / low;
        let high = high * (T::one() + x / T::of(2.0) + x * x / T::of(12.0));
        for (k, [back, forward]) in lines.into_iter().enumerate() {
            let mean = (back + forward) / T::of(2.0);
            margin.at_least(mean, low);
            margin.at_most(mean, high);
            if !(mean >= low && mean <= high) {
                return Err(Fault::InductanceOutOfRange {
                    phase: LINES[k].0,
                    found: mean,
                    allowed: [low, high],
                });
            }
            let apart = (forward - back).abs() / mean;
            margin.at_most(apart, self.both_ways);
            if apart > self.both_ways || !apart.is_finite() {
                return Err(Fault::DirectionsDiffer { phase: LINES[k].0, apart, allowed: self.both_ways });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
