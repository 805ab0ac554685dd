//! Line pulses in both directions: their settings, and how axis and pole are computed from the measured lines.
//!
//! Methods differ in how they compute the inductance of a line, and its fall with the current, from the samples.

use standstill_interface::{Abc, Angle, Fault, Findings, Nanos, Phase, Reading, Real};

use super::lines::{Saliency, SaliencySign};
use super::margin::Margin;
use super::plausibility::PlausibilitySettings;
use super::polarity::{Pointer, Pole, Signature};
use super::significance;
use super::train::{Derived, GainComparison, PulseTrainSettings, Slot, Train};
use super::turning::Standing;
use crate::checks::Check;
use crate::commissioning::Correction;
use crate::nameplate::{Nameplate, Place, Sensing};
use crate::settings::{SettingsError, require, require_error, require_share};

/// Settings of a method by line pulses in both directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BothWaysSettings<T> {
    /// The pulses; of an adaptive method, the first train.
    pub train: PulseTrainSettings<T>,
    /// Sign of the motor's L_B.
    pub saliency: SaliencySign,
    /// |L_B| / L_A below which no angle is named.
    pub least_saliency: T,
    /// Standard deviation of the sensors' gains, relative; zero: taken as equal.
    pub gain_tolerance: T,
    /// Correction from a commissioning run.
    pub correction: Correction<T>,
    /// The pole that draws more current in pulses like these.
    pub signature: Signature,
    /// Probability of a wrong pole that is allowed.
    pub pole_error: T,
    /// Standard deviation of errors that look like saturation and that repetition does not reveal, as a share of the
    /// inductance at the pulse's peak: offsets, delays of the legs.
    pub pole_floor: T,
    /// Lag, delays and pick-up of the sensors.
    pub sensing: Sensing<T>,
    /// Checks whether readings can be those of whole parts.
    pub plausibility: PlausibilitySettings<T>,
}

impl<T: Real> BothWaysSettings<T> {
    /// Returns settings for this motor and drive, with samples about every `interval`.
    pub(crate) fn suited(drive: &Nameplate<T>, interval: Nanos) -> Self {
        Self {
            train: PulseTrainSettings::suited(drive, interval),
            saliency: drive.saliency(),
            least_saliency: T::of(0.005),
            gain_tolerance: drive.gain_tolerance,
            correction: Correction::none(),
            signature: drive.pulse_signature,
            pole_error: T::of(1e-6),
            pole_floor: T::of(0.0015),
            sensing: drive.sensing,
            plausibility: PlausibilitySettings::suited(drive),
        }
    }

    /// Checks all settings except those of the train.
    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        require_share(self.least_saliency, "least_saliency")?;
        let tolerance = self.gain_tolerance;
        require(tolerance >= T::zero() && tolerance < T::one(), "gain_tolerance", "from 0 to below 1")?;
        require_error(self.pole_error, "pole_error")?;
        require_share(self.pole_floor, "pole_floor")?;
        self.plausibility.check()?;
        self.sensing.check()
    }

    /// Returns the inductances in H and the saliency of `lines` in H, measured by sensors with the gain ratios
    /// `ratios`. The effect of the gains is removed, and from the saliency also the errors learnt in commissioning.
    pub(crate) fn saliency(
        &self,
        lines: [T; 3],
        ratios: [T; 3],
        derived: Derived,
        findings: &mut Findings<T>,
    ) -> ([T; 3], Saliency<T>) {
        let gains = GainComparison::line_gains(ratios, derived);
        let lines = core::array::from_fn(|k| lines[k] * gains[k].exp());
        // The mean of both directions has no effect of saturation that depends on the pole.
        let saliency = self.correction.apply(Abc(lines), self.saliency, None);
        findings.line_inductance = Some(Abc(lines));
        findings.mean_inductance = Some(saliency.mean);
        findings.saliency = Some(saliency.amplitude);
        findings.sensor_gain = Some(GainComparison::gains(ratios));
        (lines, saliency)
    }

    /// Checks that the saliency suffices for an axis; `square`: the square of |L_B|/L_A that noise and gains require,
    /// `train`: the last pulses.
    pub(crate) fn check_saliency(
        &self,
        margin: &mut Margin<T>,
        saliency: &Saliency<T>,
        square: T,
        train: &PulseTrainSettings<T>,
    ) -> Result<(), Fault<T>> {
        significance::check(margin, saliency.ratio(), square + Self::timing(train), self.least_saliency)
    }

    /// Returns the square of |L_B|/L_A that the delays of the legs require.
    fn timing(train: &PulseTrainSettings<T>) -> T {
        let [dead, pulse] = [train.dead_time, train.pulse].map(|time| T::of(time.seconds()));
        significance::known(significance::of_lines(significance::of_timing(dead, pulse)))
    }

    /// Checks that the saliency is that of the data sheet; arguments as of [`Self::check_saliency`].
    pub(crate) fn check_sheet(
        &self,
        margin: &mut Margin<T>,
        saliency: &Saliency<T>,
        square: T,
        train: &PulseTrainSettings<T>,
    ) -> Result<(), Fault<T>> {
        let found = (saliency.ratio(), square + Self::timing(train));
        self.plausibility.saliency(margin, found, train.pulse, train.resistance)
    }

    /// Checks the reading at the end of a pulse: the link's voltage, and that the currents of the sensors sum to zero.
    pub(crate) fn check_pulse(
        &self,
        train: &mut Train<T>,
        slot: Slot,
        reading: &Reading<T>,
    ) -> Result<(), Fault<T>> {
        self.plausibility.link(&mut train.margin, reading)?;
        if train.settings.place.switches() {
            return Ok(());
        }
        let both = train.both(slot, reading)?;
        let (enters, leaves) = slot.phases();
        let third = Phase::ALL.into_iter().find(|phase| *phase != enters && *phase != leaves);
        let idle = third.map_or(T::zero(), |third| reading.current[third] - train.offset[third]);
        // Phases that are converted one after the other see different instants of a current that rises.
        let apart = T::of((self.sensing.skew * 2).seconds() / train.settings.pulse.seconds());
        let allowed =
            train.settings.threshold + (self.plausibility.sensors + apart) * both.0.abs().max(both.1.abs());
        self.plausibility.sum(&mut train.margin, reading, both, idle, allowed)
    }

    /// Checks that the rotor stands still, from a vector that points along the magnet, relative to the inductance at
    /// the peak of the pulses. `volts`: voltage of the link that drives the current; `g`: the method's factor, see
    /// [`turning`].
    pub(crate) fn check_standing(
        &self,
        margin: &mut Margin<T>,
        (g, volts): (f64, T),
        pointer: &Pointer<T>,
        (axis, deviation): (Angle<T>, T),
    ) -> Result<(), Fault<T>> {
        if !self.plausibility.checks.has(Check::Turning) {
            return Ok(());
        }
        let flux = self.plausibility.magnet_flux;
        let standing = Standing::of(g, volts, flux, (self.signature, self.pole_error));
        standing.check(margin, pointer, axis, deviation)
    }

    /// Returns the pole from a vector that points along the magnet.
    pub(crate) fn pole(&self, saliency: &Saliency<T>, pointer: &Pointer<T>) -> Pole<T> {
        pointer.read(saliency.axis, self.signature, self.pole_error)
    }

    /// Returns the variance of errors that repetition does not reveal, in the relative difference between a line's
    /// forward and backward pulses; `ratios`: variances of r of the lines (see [`GainComparison::known`]).
    pub(crate) fn pole_variance(&self, derived: Derived, ratios: [T; 3]) -> T {
        let [ab, bc, ca] = ratios;
        let changing = match (derived, self.train.place) {
            (Derived::Several, Place::BelowLegs) => (ab + bc + ca) / T::of(3.0),
            (Derived::Several, _) => T::of(2.0) * self.gain_tolerance * self.gain_tolerance,
            _ => T::zero(),
        };
        self.pole_floor * self.pole_floor + changing
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::checks::Checks;
    use standstill_interface::Phase;

    #[test]
    fn analytic_sensors_that_change_with_the_direction_count_twice_their_tolerance() {
        let settings = BothWaysSettings {
            train: PulseTrainSettings {
                pulse: Nanos::from_micros(200),
                rest: Nanos::from_micros(320),
                rounds: 3,
                interval: Nanos::from_micros(50),
                zeroing: 30,
                threshold: 0.2,
                attempts: 3,
                least_current: 0.3,
                dead_time: Nanos(2000),
                resistance: 0.0,
                on_drop: 0.0,
                off_drop: 0.0,
                place: Place::InLine,
                ringing: Nanos::ZERO,
            },
            saliency: SaliencySign::Negative,
            least_saliency: 0.005,
            gain_tolerance: 0.02,
            correction: Correction::none(),
            signature: Signature::Normal,
            pole_error: 1e-6,
            pole_floor: 0.01_f64,
            sensing: Sensing::default(),
            plausibility: PlausibilitySettings {
                checks: Checks::ALL,
                sensors: 0.1,
                idle_is_blocked: true,
                line: [1e-3, 1.0],
                saliency: 0.2,
                rated_pulse: 400e-6,
                saturates: 1.0,
                both_ways: [0.1, 0.2],
                dc_link: [100.0, 1000.0],
                edge_deviation: 0.0,
                magnet_flux: 0.5,
            },
        };
        let ratios = [1e-5, 2e-5, 3e-5];
        assert_eq!(settings.pole_variance(Derived::None, ratios), 1e-4);
        assert_eq!(settings.pole_variance(Derived::One(Phase::C), ratios), 1e-4);
        assert!((settings.pole_variance(Derived::Several, ratios) - 9e-4).abs() < 1e-18);
        // Below the legs the sensors were compared.
        let train = PulseTrainSettings { place: Place::BelowLegs, ..settings.train };
        let below = BothWaysSettings { train, ..settings };
        assert!((below.pole_variance(Derived::Several, ratios) - 1.2e-4).abs() < 1e-18);
    }
}
