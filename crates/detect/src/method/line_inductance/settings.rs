//! Settings of the paper's method.

use standstill_interface::{Nanos, Real};

use crate::checks::{Check, Checks};
use crate::keys::{self, Keyed, Lines, Microseconds, Setting, Value, place};
use crate::nameplate::{Nameplate, Place, Sensing};
use crate::parts::lines::SaliencySign;
use crate::parts::plausibility::PlausibilitySettings;
use crate::parts::polarity::{PolarityRule, PolaritySettings, Signature};
use crate::parts::settle::SettleSettings;
use crate::settings::{
    Decay, LONGEST, SettingsError, Source, require, require_positive, require_share, require_zero_or_more,
};

/// Settings of the paper's method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineInductanceSettings<T> {
    /// t1: how long the DC link is across a line.
    pub pulse: Nanos,
    /// Time from the begin of one pulse to that of the next.
    pub period: Nanos,
    /// Pulses per line, averaged.
    pub pulses: u8,
    /// Decay of the current after a pulse.
    pub decay: Decay,
    /// Time before the end of the pulse at which i2 is sampled. Zero, as in the paper, samples at the edge itself. A
    /// drive with low-side shunts needs more than its jitter, because after the edge its shunts carry the currents of
    /// other legs. A drive that converts its phases one after the other, or whose readings an edge disturbs, needs time
    /// for all conversions before the edge.
    pub sample_lead: Nanos,
    /// Dead time of the drive, by which the pulse is shorter. Zero ignores it, which scales all inductances alike and
    /// does not change the angle.
    pub dead_time: Nanos,
    /// Sign of the motor's L_B.
    pub saliency: SaliencySign,
    /// Least current in A that a pulse must raise.
    pub least_current: T,
    /// |L_B| / L_A below which no angle is named.
    pub least_saliency: T,
    /// Relative standard deviation of the sensors' gains, which may look like a saliency.
    pub gain_tolerance: T,
    /// The wait before the first pulse of a line and before each vector; with fast decay also before each further
    /// pulse.
    pub settle: SettleSettings<T>,
    /// Checks whether the pulses' readings can be those of whole parts.
    pub plausibility: PlausibilitySettings<T>,
    /// The polarity test.
    pub polarity: PolaritySettings<T>,
    /// Arrangement of the current sensors, and times at which they are read.
    pub sensing: Sensing<T>,
}

impl<T: Real> LineInductanceSettings<T> {
    /// Returns the paper's settings (section 2: pulses of 80 µs every 2.4 ms, three per line, vectors near rated
    /// current). As in the paper, the larger current indicates north.
    ///
    /// Values that the paper does not print are chosen here: vectors of 1 ms, or half the time constant L_d/R if that
    /// is shorter, and a current 2 % above the rated one, the mean of Table 2. For other motors, pulses raise the same
    /// share of the rated current as 80 µs do on the paper's, and vectors are long enough for the link's voltage.
    ///
    /// ```
    /// # let nameplate = include!(concat!(env!("CARGO_MANIFEST_DIR"), "/doc/nameplate.rs"));
    /// use standstill_detect::{Decay, LineInductance, LineInductanceSettings};
    ///
    /// let settings = LineInductanceSettings::paper(Decay::Fast, &nameplate);
    /// assert!(LineInductance::new(settings).is_ok());
    /// // A pulse that does not fit into its period is refused, with the setting's name.
    /// let refused = LineInductance::new(LineInductanceSettings { pulse: settings.period * 2, ..settings });
    /// assert!(refused.is_err());
    /// ```
    pub fn paper(decay: Decay, drive: &Nameplate<T>) -> Self {
        // A fifth of the rated current into the mean line inductance, equation (4).
        let pulse = drive.line_pulse(T::of(0.2));
        // Shunts below the legs show a circulating current only after the edge.
        let before_edge = decay == Decay::Fast || !drive.sensing.place.switches();
        let lead = drive.sensing.lead();
        let lead = if drive.sensing.place.switches() { lead } else { lead.min(Nanos(pulse.0 / 2)) };
        Self {
            pulse,
            // Longer if the current of a longer pulse needs more time to decay.
            period: Nanos::from_micros(2400).max(pulse * 4),
            pulses: 3,
            decay,
            sample_lead: if before_edge { lead } else { Nanos::ZERO },
            dead_time: drive.dead_time,
            saliency: drive.saliency(),
            least_current: drive.rated_current * T::of(0.02),
            least_saliency: T::of(0.05),
            gain_tolerance: drive.gain_tolerance,
            settle: SettleSettings::suited(drive, 500, 400),
            plausibility: PlausibilitySettings {
                checks: Self::CHECKS.without(Check::Turning),
                ..PlausibilitySettings::suited(drive)
            },
            polarity: PolaritySettings::near_rated_current(
                drive,
                Signature::Normal,
                PolarityRule::TwoVectors,
            ),
            sensing: drive.sensing,
        }
    }

    /// Returns the arrangement of the sensors as far as it matters to a pulse: while the current circulates through the
    /// lower devices, all low-side shunts show it.
    pub(super) fn place(&self) -> Place {
        match self.decay {
            Decay::Fast => self.sensing.place,
            Decay::Slow => Place::InLine,
        }
    }

    /// Returns the time at which i3 is sampled, counted from the start of the pulse. With slow decay it is the end of
    /// the period, as in the paper; with fast decay it is four fifths of the pulse later, shortly before the current
    /// ends.
    pub(super) fn third_sample(&self) -> Nanos {
        match self.decay {
            Decay::Slow => self.period,
            Decay::Fast => self.pulse + Nanos(self.pulse.0 / 5 * 4),
        }
    }

    pub(super) fn check(&self) -> Result<(), SettingsError> {
        require(self.pulse > Nanos::ZERO, "pulse", "positive")?;
        require(self.pulses > 0, "pulses", "at least 1")?;
        require(
            self.dead_time + self.sample_lead < self.pulse,
            "dead_time",
            "with sample_lead shorter than the pulse",
        )?;
        let settled = Nanos::from_seconds(self.sensing.blank().to_double()) + self.sample_lead < self.pulse;
        let needed = "such that a pulse leaves time for a sample that no edge spoils";
        require(self.place() == Place::InLine || settled, self.sensing.blank_key(), needed)?;
        let decay_needs = self.pulse * 2 + self.settle.wait;
        require(self.period > decay_needs, "period", "longer than two pulses and settle.wait")?;
        require(self.period <= LONGEST, "period", "at most a minute")?;
        require_positive(self.least_current, "least_current")?;
        require_share(self.least_saliency, "least_saliency")?;
        require_zero_or_more(self.gain_tolerance, "gain_tolerance")?;
        self.settle.check()?;
        self.plausibility.check()?;
        self.polarity.check()
    }
}

impl<T: Real> Keyed for LineInductanceSettings<T> {
    const SETTINGS: &'static [Setting<Self>] = &[
        place!(PULSE, s => s.pulse, Value::time, nanos),
        place!(ROUNDS, s => s.pulses, Value::times, count),
        place!(LEAST_SALIENCY, s => s.least_saliency, Value::of, real),
        place!(GAIN_TOLERANCE, s => s.gain_tolerance, Value::of, real),
        Setting::new(
            &keys::CHECKS,
            |s| Some(Value::Checks(s.plausibility.checks)),
            |s, value| s.plausibility.checks.set_value(value) && s.polarity.checks.set_value(value),
        ),
        place!(VECTOR_CURRENT, s => s.polarity.current, Value::of, real),
        place!(POLE_ERROR, s => s.polarity => pole_error, set_pole_error),
    ];

    const CHECKS: Checks = PolaritySettings::<T>::CHECKS.with(Check::Inductance).with(Check::Saliency);

    /// Sources of readings. Fast decay needs others: see [`Keyed::needed_sources`].
    const SOURCES: &'static [Source] = &[Source::PhaseCurrents, Source::LinkCurrent];

    fn needed_sources(&self) -> &'static [Source] {
        // While the current circulates through the lower switches, none flows in the link.
        match self.decay {
            Decay::Fast => Self::SOURCES,
            Decay::Slow => &[Source::PhaseCurrents],
        }
    }

    fn describe(&self, line: &mut Lines<'_>) {
        line("pulse", format_args!("{}", Microseconds(self.pulse)));
        line("pulses", format_args!("{}", self.pulses));
        self.polarity.describe(line);
    }

    fn carrier(&self) -> Option<Nanos> {
        Some(self.polarity.carrier_period)
    }
}
