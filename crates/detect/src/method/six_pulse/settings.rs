//! Settings of the six pulses.

use standstill_interface::{Angle, Nanos, Real};

use crate::checks::Checks;
use crate::keys::{Keyed, Lines, Microseconds, Setting, Value, place};
use crate::nameplate::{Nameplate, Place, Sensing};
use crate::parts::lines::SaliencySign;
use crate::parts::polarity::Signature;
use crate::parts::train::Derived;
use crate::settings::{
    LONGEST, SettingsError, Source, require, require_error, require_positive, require_share,
    require_zero_or_more,
};

/// Number of rounds if currents are sampled.
const SAMPLED_ROUNDS: u8 = 4;

/// Settings of the six pulses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SixPulseSettings<T> {
    /// Current in A at which a pulse ends; without a timer, the current for which the pulse is designed.
    pub threshold: T,
    /// Longest pulse, if the time to the threshold is measured.
    pub longest: Nanos,
    /// Length of every pulse, if the current at its end is sampled.
    pub sampled: Nanos,
    /// Time for which all switches are open after a pulse, as a share of the longest pulse. A remaining current would
    /// shift the next time, and no reading would show it.
    pub pause: T,
    /// Whether opposite pulses follow each other, instead of neighbours around the circle.
    pub pairs: bool,
    /// Rounds of six pulses.
    pub rounds: u8,
    /// Whether the time to the threshold is measured, instead of the current after a fixed time.
    pub timed: bool,
    /// Dead time, which passes before a pulse begins.
    pub dead_time: Nanos,
    /// Sign of the motor's L_B.
    pub saliency: SaliencySign,
    /// |L_B| / L_A below which no angle is named.
    pub least_saliency: T,
    /// |L_B| / L_A of the motor's data sheet. If the timer is too coarse to show it, the fault names the timer.
    pub data_sheet_saliency: T,
    /// The pole that draws more current at the threshold.
    pub signature: Signature,
    /// Probability of a wrong pole that is allowed.
    pub pole_error: T,
    /// Standard deviation of the current sensors' gains, relative.
    pub gain_tolerance: T,
    /// Checks that are on: whether the rotor stands still. By default none, because comparator noise that the drive
    /// does not know would look like a turning rotor.
    pub checks: Checks,
    /// Flux linkage of the magnet in Wb, by which a turning rotor induces a voltage; zero without a magnet.
    pub magnet_flux: T,
    /// Width of the sectors in which the answer is given; zero: the answer is an angle.
    pub sector: Angle<T>,
    /// The sensors, with comparators and timer.
    pub sensing: Sensing<T>,
}

/// Returns whether each leg's comparators see only the pulses in which this leg alone is low.
fn misses_pulses<T: Real>(sensing: &Sensing<T>) -> bool {
    sensing.comparator.own && sensing.place == Place::BelowLegs
}

impl<T: Real> SixPulseSettings<T> {
    /// Returns settings for this motor and drive. If the drive captures times, the pulses end at the rated current;
    /// otherwise they have the length that raises the rated current in the direction in which the core saturates most.
    pub fn suited(drive: &Nameplate<T>) -> Self {
        let timed = drive.sensing.comparator.tick > T::zero() && !misses_pulses(&drive.sensing);
        let threshold = drive.rated_current;
        let mut settings = Self {
            threshold,
            longest: Nanos::ZERO,
            sampled: Nanos::ZERO,
            pause: T::of(1.6),
            pairs: false,
            rounds: if timed { 1 } else { SAMPLED_ROUNDS },
            timed,
            dead_time: drive.dead_time,
            saliency: drive.saliency(),
            least_saliency: T::of(0.005),
            data_sheet_saliency: (drive.d_axis_inductance - drive.q_axis_inductance).abs()
                / (drive.d_axis_inductance + drive.q_axis_inductance),
            signature: drive.signature,
            pole_error: T::of(1e-4),
            gain_tolerance: drive.gain_tolerance,
            checks: Checks::NONE,
            magnet_flux: drive.magnet_flux,
            sector: Angle::from_radians(T::zero()),
            sensing: drive.sensing,
        };
        (settings.longest, settings.sampled) =
            (settings.suited_pulse(drive, true), settings.suited_pulse(drive, false));
        settings
    }

    /// Returns the length of a pulse: if `timed`, one that surely reaches the threshold; otherwise one that reaches it
    /// in the direction in which the core saturates most.
    pub(super) fn suited_pulse(&self, drive: &Nameplate<T>, timed: bool) -> Nanos {
        let seconds = if timed {
            // The link's voltage less the drops of two devices and the winding at the threshold, with half as much in
            // reserve.
            let drop = drive.switch_drop[0] * T::of(2.0)
                + self.threshold * (drive.resistance + drive.switch_drop[1]) * T::of(1.5);
            let left = (drive.dc_link - drop).max(drive.dc_link * T::of(0.2));
            let most = drive.d_axis_inductance.max(drive.q_axis_inductance);
            let comparator = drive.sensing.comparator.delay;
            T::of(1.5 * 1.5) * most * self.threshold / left + comparator + T::of(1e-6)
        } else {
            // The rated pulse is for two phases in series; here one and a half are in series.
            T::of(0.75 * drive.rated_pulse.seconds()) * self.threshold / drive.rated_current
        };
        // A shunt in the link is read once its amplifier has settled.
        let settled = if timed { T::zero() } else { T::of(self.sensing.settle.seconds()) };
        let seconds = seconds.max(T::of(self.sensing.lead().seconds() * 2.0)).max(settled);
        // At most a third of the longest wait, so that the pause after the pulse stays below that.
        let seconds = seconds.min(T::of(LONGEST.seconds() / 3.0));
        let micros = (seconds / T::of(1e-6)).round().max(T::of(2.0)).to_double();
        Nanos::from_seconds(micros * 1e-6) + drive.dead_time
    }

    /// Returns whether a shunt in the link shows the current of the single leg.
    pub(super) fn in_link(&self) -> bool {
        !self.timed && self.sensing.place == Place::InLink
    }

    /// Returns the variance of each component of the second harmonic, and of the first one, caused by the sensors'
    /// gains.
    ///
    /// The sensor of a phase, with gain g, reads both directions of that phase: ⅔ Σ g e^{j2φ}, which looks like a
    /// saliency and not like a pole. A phase without a sensor has half the sum of the others' gains. Shunts below the
    /// legs see one direction; the other direction is read by the other two shunts: ⅙ Σ g e^{j2φ}, and −½ Σ g e^{jφ} in
    /// the pole's harmonic. Each component of Σ g e^{jφ} has 3/2 of a gain's variance.
    pub(super) fn of_gains(&self, derived: Derived) -> [T; 2] {
        let shares = match derived {
            _ if self.timed || self.in_link() => [0.0, 0.0],
            Derived::None => [2.0 / 3.0, 0.0],
            Derived::One(_) => [1.0 / 3.0, 0.0],
            Derived::Several => [1.0 / 24.0, 3.0 / 8.0],
        };
        let tolerance = self.gain_tolerance;
        shares.map(|share| T::of(share) * tolerance * tolerance)
    }

    pub(super) fn check(&self) -> Result<(), SettingsError> {
        let comparator = &self.sensing.comparator;
        require_positive(self.threshold, "threshold")?;
        require(
            !self.timed || comparator.tick > T::zero(),
            "timed",
            "false, or `sensors.timer` be set: without a timer this drive captures no time to a threshold",
        )?;
        require(
            !self.timed || !misses_pulses(&self.sensing),
            "timed",
            "false, or `sensors.comparators` \"common\": comparators of shunts below the legs see no leg that is high, and so three of the six pulses",
        )?;
        require(
            !self.timed || comparator.highest == T::zero() || self.threshold <= comparator.highest,
            "threshold",
            "at most the highest code of the converter that sets it: `sensors.threshold_range`",
        )?;
        let pulse = self.pulse();
        require(
            pulse > self.dead_time + self.sensing.lead() && pulse <= LONGEST,
            "threshold",
            "such that a pulse is longer than the dead time, and at most a minute",
        )?;
        require(
            self.pause > T::zero() && self.pause() <= LONGEST,
            "pause",
            "above zero, and such that a pulse takes a minute at most",
        )?;
        let rounds = if self.timed { 1 } else { 2 };
        require(
            self.rounds >= rounds,
            "rounds",
            "at least 1, and 2 where `timed` is false, to see how the pulses scatter",
        )?;
        let sector = self.sector.degrees().round().to_double();
        require([0.0, 30.0, 60.0].contains(&sector), "sector", "0, 30 or 60 degrees")?;
        require_share(self.least_saliency, "least_saliency")?;
        require_error(self.pole_error, "pole_error")?;
        require_zero_or_more(self.gain_tolerance, "gain_tolerance")?;
        require_zero_or_more(self.magnet_flux, "magnet_flux")?;
        self.sensing.check()
    }

    /// Returns the length of a pulse; if its time is measured, the longest time.
    pub(super) fn pulse(&self) -> Nanos {
        if self.timed { self.longest } else { self.sampled }
    }

    /// Returns the time for which all switches are open after a pulse.
    pub(super) fn pause(&self) -> Nanos {
        Nanos::from_seconds(self.pulse().seconds() * self.pause.to_double()).max(Nanos(1))
    }

    /// Returns the shortest pause, as a share of the pulse like the setting, after which no current is left for the
    /// next pulse.
    ///
    /// With all switches open, the diodes put the link's voltage U and two diode drops against the current i of the
    /// single leg, which flows through one and a half phases. It ends after `L/R ln(1 + 1.5 R i / (U + 2 U_D))`, with
    /// the larger of L_d and L_q as L. A comparator opens the switches after its delay, in which i rises by `U / (1.5
    /// L)` per second with the smaller of them. For sampled pulses the current follows from their length. A saturated
    /// core has less flux to lose.
    pub fn least_pause(&self, drive: &Nameplate<T>) -> T {
        let three_halves = T::of(1.5);
        let [d, q] = [drive.d_axis_inductance, drive.q_axis_inductance];
        let rise = drive.dc_link / (three_halves * d.min(q));
        let current = if self.timed {
            let comparator = &self.sensing.comparator;
            self.threshold + comparator.offset * T::of(3.0) + rise * comparator.delay
        } else {
            // With the larger inductance here as below, L cancels: the flux that the link's voltage has built up is the
            // flux that decays.
            drive.dc_link * T::of(self.sampled.seconds()) / (three_halves * d.max(q))
        };
        let against = drive.dc_link + drive.diode_drop[0] * T::of(2.0);
        let share = three_halves * drive.resistance * current / against;
        // For a small x, ln(1 + x) is x.
        let time_constants = if share > T::of(1e-6) { (T::one() + share).ln() / share } else { T::one() };
        let decay = three_halves * d.max(q) * current / against * time_constants;
        decay / T::of(self.pulse().seconds())
    }

    /// Sets the threshold, and the pulses in proportion.
    pub(super) fn set_threshold(&mut self, threshold: T) {
        let share = (threshold / self.threshold).to_double();
        let dead_time = self.dead_time;
        for pulse in [&mut self.longest, &mut self.sampled] {
            *pulse = dead_time + Nanos::from_seconds(((*pulse - dead_time).seconds() * share).max(2e-6));
        }
        self.threshold = threshold;
    }
}

impl<T: Real> Keyed for SixPulseSettings<T> {
    const SOURCES: &'static [Source] = &[Source::CapturedTimes, Source::PhaseCurrents, Source::LinkCurrent];

    const SETTINGS: &'static [Setting<Self>] = &[
        place!(PAUSE, s => s.pause, Value::of, real),
        place!(PAIRS, s => s.pairs, Value::Flag, is_set),
        place!(ROUNDS, s => s.rounds, Value::times, count),
        place!(LEAST_SALIENCY, s => s.least_saliency, Value::of, real),
        place!(POLE_ERROR, s => s.pole_error, Value::of, real),
        place!(GAIN_TOLERANCE, s => s.gain_tolerance, Value::of, real),
        place!(CHECKS, s => s.checks => value, set_value),
        place!(THRESHOLD, s => Value::of(s.threshold); value => s.set_threshold(value.real())),
        place!(TIMED, s => s.timed, Value::Flag, is_set),
        place!(
            SECTOR, s => Value::of(s.sector.degrees());
            value => s.sector = Angle::from_degrees(value.real())
        ),
    ];

    fn needed_sources(&self) -> &'static [Source] {
        // Without a timer `check` refuses timed pulses, by their key.
        if self.timed { Self::SOURCES } else { &[Source::PhaseCurrents, Source::LinkCurrent] }
    }

    fn describe(&self, line: &mut Lines<'_>) {
        line("threshold", format_args!("{} A", self.threshold.to_double()));
        line("rounds", format_args!("{}", self.rounds));
        let length = if self.timed { "longest pulse" } else { "pulse" };
        line(length, format_args!("{}", Microseconds(self.pulse())));
        line("pause", format_args!("{}", Microseconds(self.pause())));
        line("order", format_args!("{}", if self.pairs { "in opposite pairs" } else { "around the circle" }));
        line("signature", format_args!("{}", self.signature.in_words()));
    }
}
