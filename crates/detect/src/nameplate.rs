//! Nameplate data of motor and drive, from which each method's settings follow.

use standstill_interface::{Nanos, Real};

use crate::parts::lines::SaliencySign;
use crate::parts::polarity::Signature;
use crate::parts::train::{Derived, LINES};
use crate::settings::{SettingsError, require, require_positive, require_zero_or_more};

/// The drive's comparators and the timer that captures when one of them trips, as their data sheets state it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Comparing<T> {
    /// Tick of the timer in s; 0: no time is captured.
    pub tick: T,
    /// Mean delay in s from the threshold to the captured time.
    pub delay: T,
    /// Whether each leg has comparators of its own, one for each direction of its current; else one serves all.
    pub own: bool,
    /// Standard deviation of each comparator's offset in A.
    pub offset: T,
    /// Standard deviation of each comparator's delay in s.
    pub delay_spread: T,
    /// Noise at a comparator in A rms.
    pub noise: T,
    /// Time in s after the begin of a pulse during which comparators are ignored.
    pub blanking: T,
    /// Highest threshold in A that the drive can set; 0: any.
    pub highest: T,
    /// Standard deviation of the timer's clock, relative.
    pub clock_error: T,
}

impl<T: Real> Comparing<T> {
    /// Conversion to another precision.
    fn cast<U: Real>(&self) -> Comparing<U> {
        let cast = |value: T| U::of(value.to_double());
        Comparing {
            tick: cast(self.tick),
            delay: cast(self.delay),
            own: self.own,
            offset: cast(self.offset),
            delay_spread: cast(self.delay_spread),
            noise: cast(self.noise),
            blanking: cast(self.blanking),
            highest: cast(self.highest),
            clock_error: cast(self.clock_error),
        }
    }

    fn check(&self) -> Result<(), SettingsError> {
        require_zero_or_more(self.tick, "sensing.comparator.tick")?;
        require_zero_or_more(self.delay, "sensing.comparator.delay")?;
        require_zero_or_more(self.offset, "sensing.comparator.offset")?;
        require_zero_or_more(self.delay_spread, "sensing.comparator.delay_spread")?;
        require_zero_or_more(self.noise, "sensing.comparator.noise")?;
        require_zero_or_more(self.blanking, "sensing.comparator.blanking")?;
        require_zero_or_more(self.highest, "sensing.comparator.highest")?;
        require_zero_or_more(self.clock_error, "sensing.comparator.clock_error")
    }
}

/// How the current sensors and their converter work, as their data sheets state it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensing<T> {
    /// Nominal corner frequency in Hz of the current sensors' first-order filters: they lag by 1/(2π f). None: no filter.
    pub bandwidth: Option<T>,
    /// By what share at most each phase's corner frequency is off beside what all are off in common, which is fitted.
    pub bandwidth_mismatch: T,
    /// The converter takes phases a, b and c (0, 1 and 2) one after the other: k this much times k after the trigger, but none
    /// after the end of its command. The DC link is taken together with phase a.
    pub skew: Nanos,
    /// From the first conversion of a sample to its last: a reading is the mean of several, evenly apart.
    pub averaged: Nanos,
    /// Amplitude in A of what an edge of a leg's potential adds to all readings of current, and the time constant in s with
    /// which it decays. Zeros: nothing.
    pub pick_up: [T; 2],
    /// Whether one shunt in the DC link takes the place of the phases' sensors.
    pub one_shunt: bool,
    /// Time after a request to a leg during which shunts are not read: dead time and settling of their amplifiers.
    pub settle: Nanos,
    /// Noise of a sample of the DC link's voltage in V rms, with that of its converter's rounding.
    pub link_noise: T,
    /// Comparators and timer.
    pub comparator: Comparing<T>,
}

/// The dividers through which a drive reads its terminals' voltages, as their data sheets state them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dividers<T> {
    /// Standard deviation of their gains, relative. Zero: equal.
    pub gain_tolerance: T,
    /// Standard deviation of their offsets in V of the terminal.
    pub offset: T,
    /// Corner frequency in Hz of their first-order filters. None: no filter.
    pub bandwidth: Option<T>,
}

impl<T: Real> Dividers<T> {
    /// Conversion to another precision.
    fn cast<U: Real>(&self) -> Dividers<U> {
        let cast = |value: T| U::of(value.to_double());
        Dividers {
            gain_tolerance: cast(self.gain_tolerance),
            offset: cast(self.offset),
            bandwidth: self.bandwidth.map(cast),
        }
    }

    fn check(&self) -> Result<(), SettingsError> {
        if let Some(bandwidth) = self.bandwidth {
            require_positive(bandwidth, "dividers.bandwidth")?;
        }
        let tolerance = self.gain_tolerance;
        let is_share = tolerance >= T::zero() && tolerance < T::one();
        require(is_share, "dividers.gain_tolerance", "from 0 to below 1")?;
        require_zero_or_more(self.offset, "dividers.offset")
    }
}

impl<T: Real> Default for Dividers<T> {
    /// Dividers without errors and filters.
    fn default() -> Self {
        Self { gain_tolerance: T::zero(), offset: T::zero(), bandwidth: None }
    }
}

impl<T: Real> Default for Sensing<T> {
    /// Sensors in the phases without filters, all converted at once, without pick-up.
    fn default() -> Self {
        Self {
            bandwidth: None,
            bandwidth_mismatch: T::zero(),
            skew: Nanos::ZERO,
            averaged: Nanos::ZERO,
            pick_up: [T::zero(); 2],
            one_shunt: false,
            settle: Nanos::ZERO,
            link_noise: T::zero(),
            comparator: Comparing::default(),
        }
    }
}

impl<T: Real> Sensing<T> {
    /// Conversion to another precision.
    fn cast<U: Real>(&self) -> Sensing<U> {
        let cast = |value: T| U::of(value.to_double());
        Sensing {
            bandwidth: self.bandwidth.map(cast),
            bandwidth_mismatch: cast(self.bandwidth_mismatch),
            skew: self.skew,
            averaged: self.averaged,
            pick_up: self.pick_up.map(cast),
            one_shunt: self.one_shunt,
            settle: self.settle,
            link_noise: cast(self.link_noise),
            comparator: self.comparator.cast(),
        }
    }

    /// τ in s by which the sensors lag; zero without filter.
    pub(crate) fn lag(&self) -> T {
        self.bandwidth.map_or(T::zero(), |corner| (T::TAU() * corner).recip())
    }

    /// Standard deviation in s of a line's τ from that of the others: the mean of two sensors, each uniformly off.
    pub(crate) fn lag_deviation(&self) -> T {
        self.lag() * self.bandwidth_mismatch / T::of(6.0).sqrt()
    }

    /// How much later in s than its trigger a line's current is sampled: the mean of its two phases. While the current is
    /// a straight line between the two samples, so is their mean. A phase without sensor is as late as the one that carries
    /// the line's current with it, because the third has none. Of shunts below the legs it is the one or the other by
    /// direction: their mean is the same. One shunt in the link is read once, at its trigger. Where
    /// several conversions are averaged, half of their span comes on top.
    pub(crate) fn late(&self, line: usize, derived: Derived) -> T {
        let (from, to) = LINES[line];
        let sampled = |phase, other| if derived == Derived::One(phase) { other } else { phase };
        let skew = self.skew * (sampled(from, to) as u64 + sampled(to, from) as u64);
        T::of((skew + self.averaged).seconds() / 2.0)
    }

    /// How long in s after an edge samples are spoilt: until 0.7 % of its pick-up is left, and until shunts are read.
    pub(crate) fn blank(&self) -> T {
        let [amplitude, decay] = self.pick_up;
        let settle = T::of(self.settle.seconds());
        if amplitude > T::zero() { settle.max(decay * T::of(5.0)) } else { settle }
    }

    /// How much earlier than the end of a pulse its current is sampled: early enough that the converter is through with all phases before
    /// the edge, and that no jitter moves a sample into what the edge adds. A shunt in the DC link shows the current with the other sign
    /// after the edge.
    pub(crate) fn lead(&self) -> Nanos {
        let blank = Nanos::from_seconds(self.blank().to_double());
        let blank = if self.one_shunt { blank.max(Nanos::from_micros(1)) } else { blank };
        self.averaged + self.skew * 2 + blank
    }

    /// The key that has the largest part in [`Self::lead`].
    pub(crate) fn lead_key(&self) -> &'static str {
        let blank = Nanos::from_seconds(self.blank().to_double());
        if self.averaged > blank.max(self.skew * 2) {
            "sensors.oversampling"
        } else if self.skew * 2 > blank {
            "sensors.skew"
        } else {
            self.blank_key()
        }
    }

    /// For how long in s a current that has risen evenly for `time` shows in sensors that lag: τ less, once it has risen for some τ.
    pub(crate) fn seen(&self, time: T) -> T {
        let lag = self.lag();
        if lag > T::zero() { time - lag * (T::one() - (-time / lag).exp()) } else { time }
    }

    /// Whether a sample at a time compares the sensors, where a pulse ends after `pulse`. Of phases that are converted one
    /// after the other a later one reads more while the current rises and less while it falls: that cancels but for the
    /// sample at the peak. Nor may what an edge adds look like a gain.
    pub(crate) fn compares(&self, pulse: Nanos) -> impl Fn(Nanos) -> bool {
        let until = pulse + Nanos::from_seconds(self.blank().to_double());
        let skew = self.skew * 2 + self.averaged;
        let alike = skew == Nanos::ZERO && until == pulse;
        move |time| alike || time + skew < pulse || time > until
    }

    /// The key that decides [`Self::blank`].
    pub(crate) fn blank_key(&self) -> &'static str {
        if self.blank() > T::of(self.settle.seconds()) { "sensors.pick_up_decay" } else { "sensors.settle" }
    }

    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        if let Some(bandwidth) = self.bandwidth {
            require_positive(bandwidth, "sensing.bandwidth")?;
        }
        let mismatch = self.bandwidth_mismatch;
        let is_share = mismatch >= T::zero() && mismatch < T::one();
        require(is_share, "sensing.bandwidth_mismatch", "from 0 to below 1")?;
        require(self.skew <= Nanos::from_micros(100), "sensing.skew", "at most 100 us")?;
        require(self.averaged <= Nanos::from_micros(20_000), "sensing.averaged", "at most 20 ms")?;
        let [amplitude, decay] = self.pick_up;
        require_zero_or_more(amplitude, "sensing.pick_up")?;
        require_zero_or_more(decay, "sensing.pick_up")?;
        self.comparator.check()
    }
}

/// Motor and drive as their data sheets state them. Rough values will do: no method takes an angle from them.
///
/// ```
/// use standstill_detect::{Dividers, Nameplate, Sensing, Signature};
/// use standstill_interface::Nanos;
///
/// let nameplate = Nameplate {
///     rated_current: 8.5_f64,
///     resistance: 0.8,
///     d_axis_inductance: 10.65e-3,
///     q_axis_inductance: 16.95e-3,
///     magnet_flux: 0.42,
///     signature: Signature::Normal,
///     pulse_signature: Signature::Normal,
///     polarity_difference: 0.06,
///     cross_saturation: 0.0,
///     rated_pulse: Nanos::from_micros(330),
///     gain_tolerance: 0.005,
///     sensing: Sensing::default(),
///     dividers: Dividers::default(),
///     dc_link: 550.0,
///     dead_time: Nanos::from_micros(2),
///     carrier_period: Nanos::from_micros(100),
///     switch_drop: [0.9, 0.05],
///     diode_drop: [0.8, 0.03],
///     reverse_drop: [0.8, 0.03],
/// };
/// nameplate.check()?;
/// assert!(Nameplate { dc_link: 0.0, ..nameplate }.check().is_err());
/// # Ok::<(), standstill_detect::SettingsError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nameplate<T> {
    /// Rated current of a phase in A, peak.
    pub rated_current: T,
    /// Resistance of a phase in Ω.
    pub resistance: T,
    /// L_d in H without current.
    pub d_axis_inductance: T,
    /// L_q in H without current.
    pub q_axis_inductance: T,
    /// Flux linkage of the magnet in Wb, from the voltage constant; zero without magnet.
    pub magnet_flux: T,
    /// Which pole draws the larger current near rated current.
    pub signature: Signature,
    /// Which pole draws the larger current in pulses of half the rated current, which the bipolar methods use.
    pub pulse_signature: Signature,
    /// By what share one pole's current exceeds the other's near rated current.
    pub polarity_difference: T,
    /// How much 1/L_q rises with a current along the magnet where 1/L_d rises by one: zero without cross saturation.
    pub cross_saturation: T,
    /// The pulse across a line that raises the rated current in it where its core saturates most: shorter than the
    /// inductances without current say.
    pub rated_pulse: Nanos,
    /// Standard deviation of the current sensors' gains, relative, as their data sheet tolerates it. Zero: equal.
    pub gain_tolerance: T,
    /// How the current sensors and their converter work.
    pub sensing: Sensing<T>,
    /// The dividers at the terminals, of a drive that has them.
    pub dividers: Dividers<T>,
    /// DC link in V.
    pub dc_link: T,
    /// Dead time of the drive.
    pub dead_time: Nanos,
    /// Period of its PWM carrier.
    pub carrier_period: Nanos,
    /// Voltage in V across a conducting switch, and its slope in Ω.
    pub switch_drop: [T; 2],
    /// Likewise of a diode whose leg has both switches off.
    pub diode_drop: [T; 2],
    /// Likewise of a leg whose current flows against the switch that is on: through the diode beside an IGBT, backwards
    /// through the channel of a MOSFET.
    pub reverse_drop: [T; 2],
}

impl<T: Real> Nameplate<T> {
    /// The sign of L_B.
    pub fn saliency(&self) -> SaliencySign {
        SaliencySign::of(self.d_axis_inductance, self.q_axis_inductance)
    }

    /// Mean inductance in H of two phases in series: L_d + L_q.
    pub fn line_inductance(&self) -> T {
        self.d_axis_inductance + self.q_axis_inductance
    }

    /// A pulse that raises this share of the rated current in a line on average, and at most half more in any, in steps of
    /// 10 µs, from 20 µs to 3 ms.
    ///
    /// ```
    /// # let nameplate = include!(concat!(env!("CARGO_MANIFEST_DIR"), "/doc/nameplate.rs"));
    /// // Half the rated current in 27.6 mH at 550 V: 213 µs, in steps of 10 µs.
    /// assert_eq!(nameplate.line_pulse(0.5).seconds(), 210e-6);
    /// ```
    pub fn line_pulse(&self, share: T) -> Nanos {
        let step = T::of(10e-6);
        let pulse = share * self.rated_current * self.line_inductance() / self.dc_link;
        let pulse = pulse.min(share * T::of(1.5 * self.rated_pulse.seconds()));
        let steps = (pulse / step).round().max(T::of(2.0)).min(T::of(300.0));
        Nanos::from_seconds((steps * step).to_double())
    }

    /// The longest pulse that raises no more than the rated current in any line.
    ///
    /// The more a core saturates, the steeper the current is at the end of the pulse, and a link that is a per cent higher
    /// makes more of that: 1 % less for each 10 % by which saturation shortens the pulse.
    pub(crate) fn longest_pulse(&self) -> Nanos {
        let least = self.d_axis_inductance.min(self.q_axis_inductance);
        let linear = (T::of(2.0) * least * self.rated_current / self.dc_link).to_double();
        let share = (self.rated_pulse.seconds() / linear).min(1.0);
        Nanos::from_seconds(self.rated_pulse.seconds() * (0.9 + 0.1 * share))
    }

    /// Conversion to another precision.
    ///
    /// ```
    /// # let nameplate = include!(concat!(env!("CARGO_MANIFEST_DIR"), "/doc/nameplate.rs"));
    /// use standstill_detect::Nameplate;
    ///
    /// // A microcontroller computes in single precision.
    /// let single: Nameplate<f32> = nameplate.cast();
    /// assert_eq!(single.rated_current, 8.5);
    /// ```
    pub fn cast<U: Real>(&self) -> Nameplate<U> {
        let cast = |value: T| U::of(value.to_double());
        Nameplate {
            rated_current: cast(self.rated_current),
            resistance: cast(self.resistance),
            d_axis_inductance: cast(self.d_axis_inductance),
            q_axis_inductance: cast(self.q_axis_inductance),
            magnet_flux: cast(self.magnet_flux),
            signature: self.signature,
            pulse_signature: self.pulse_signature,
            polarity_difference: cast(self.polarity_difference),
            cross_saturation: cast(self.cross_saturation),
            rated_pulse: self.rated_pulse,
            gain_tolerance: cast(self.gain_tolerance),
            sensing: self.sensing.cast(),
            dividers: self.dividers.cast(),
            dc_link: cast(self.dc_link),
            dead_time: self.dead_time,
            carrier_period: self.carrier_period,
            switch_drop: self.switch_drop.map(cast),
            diode_drop: self.diode_drop.map(cast),
            reverse_drop: self.reverse_drop.map(cast),
        }
    }

    /// # Errors
    /// A value that cannot be.
    pub fn check(&self) -> Result<(), SettingsError> {
        require_positive(self.rated_current, "rated_current")?;
        require_positive(self.d_axis_inductance, "d_axis_inductance")?;
        require_positive(self.q_axis_inductance, "q_axis_inductance")?;
        require(self.rated_pulse > Nanos::ZERO, "rated_pulse", "positive")?;
        require_positive(self.dc_link, "dc_link")?;
        require_zero_or_more(self.resistance, "resistance")?;
        require_zero_or_more(self.magnet_flux, "magnet_flux")?;
        require(self.polarity_difference.is_finite(), "polarity_difference", "finite")?;
        require(self.cross_saturation.is_finite(), "cross_saturation", "finite")?;
        require_zero_or_more(self.gain_tolerance, "gain_tolerance")?;
        require(self.gain_tolerance < T::one(), "gain_tolerance", "below 1")?;
        self.sensing.check()?;
        self.dividers.check()?;
        for drop in self.switch_drop.into_iter().chain(self.diode_drop).chain(self.reverse_drop) {
            require_zero_or_more(drop, "switch_drop, diode_drop and reverse_drop")?;
        }
        require(self.carrier_period > Nanos::ZERO, "carrier_period", "positive")?;
        let quarter = "less than a quarter of the carrier period";
        require(self.dead_time <= longest_dead_time(self.carrier_period), "dead_time", quarter)
    }
}

/// The longest dead time that leaves a PWM room: less than a quarter of its period.
pub fn longest_dead_time(carrier_period: Nanos) -> Nanos {
    Nanos(carrier_period.0.saturating_sub(1) / 4)
}

#[cfg(test)]
mod tests {
    use super::*;
    use standstill_interface::Phase;

    use crate::testing::PLATE;

    #[test]
    fn analytic_a_pulse_raises_its_share_of_the_rated_current() {
        // 0.5 · 7 A · 28 mH / 540 V = 181 µs on average, 0.5 · 1.5 · 300 µs = 225 µs where the core saturates most.
        assert_eq!(PLATE.line_pulse(0.5), Nanos::from_micros(180));
        let saturating = Nameplate { rated_pulse: Nanos::from_micros(200), ..PLATE };
        assert_eq!(saturating.line_pulse(0.5), Nanos::from_micros(150));
        assert_eq!((PLATE.line_pulse(1e-3), PLATE.line_pulse(1.5)), (Nanos(20_000), Nanos(540_000)));
        assert_eq!(Nameplate { rated_pulse: Nanos(10_000_000), ..PLATE }.line_pulse(9.0), Nanos(3_000_000));
        assert_eq!(PLATE.line_pulse(f64::NAN), Nanos(20_000));
        assert_eq!(PLATE.cast::<f32>().line_pulse(0.5), Nanos::from_micros(180));
        assert_eq!(PLATE.saliency(), SaliencySign::Negative);
        assert_eq!(Nameplate { q_axis_inductance: 9e-3, ..PLATE }.saliency(), SaliencySign::Positive);
    }

    #[test]
    fn analytic_a_derived_phase_is_as_late_as_the_one_that_it_is_derived_from() {
        let sensing = Sensing { skew: Nanos(1000), ..PLATE.sensing };
        let late = |derived| [0, 1, 2].map(|line| sensing.late(line, derived) * 1e6);
        for (derived, expected) in [
            (Derived::None, [0.5, 1.5, 1.0]),
            (Derived::One(Phase::C), [0.5, 1.0, 0.0]),
            (Derived::One(Phase::A), [1.0, 1.5, 2.0]),
            (Derived::Several, [0.5, 1.5, 1.0]),
        ] {
            let found = late(derived);
            assert!((0..3).all(|k| (found[k] - expected[k]).abs() < 1e-12), "{derived:?}: {found:?}");
        }
    }

    #[test]
    fn law_values_that_cannot_be_are_refused() {
        assert!(PLATE.check().is_ok());
        let broken = [
            Nameplate { rated_current: f64::NAN, ..PLATE },
            Nameplate { resistance: f64::INFINITY, ..PLATE },
            Nameplate { d_axis_inductance: 0.0, ..PLATE },
            Nameplate { q_axis_inductance: -1.0, ..PLATE },
            Nameplate { magnet_flux: -0.1, ..PLATE },
            Nameplate { polarity_difference: f64::NAN, ..PLATE },
            Nameplate { cross_saturation: f64::INFINITY, ..PLATE },
            Nameplate { rated_pulse: Nanos::ZERO, ..PLATE },
            Nameplate { gain_tolerance: 1.0, ..PLATE },
            Nameplate { gain_tolerance: f64::NAN, ..PLATE },
            Nameplate { dc_link: 0.0, ..PLATE },
            Nameplate { dead_time: Nanos::from_micros(25), ..PLATE },
            Nameplate { carrier_period: Nanos::ZERO, ..PLATE },
            Nameplate { switch_drop: [0.0, f64::INFINITY], ..PLATE },
            Nameplate { diode_drop: [-1.0, 0.0], ..PLATE },
            Nameplate { reverse_drop: [0.0, f64::NAN], ..PLATE },
            Nameplate { sensing: Sensing { bandwidth: Some(0.0), ..PLATE.sensing }, ..PLATE },
            Nameplate { sensing: Sensing { bandwidth_mismatch: 1.0, ..PLATE.sensing }, ..PLATE },
            Nameplate { sensing: Sensing { skew: Nanos(100_001), ..PLATE.sensing }, ..PLATE },
            Nameplate { sensing: Sensing { pick_up: [0.1, f64::NAN], ..PLATE.sensing }, ..PLATE },
            Nameplate { dividers: Dividers { gain_tolerance: 1.0, ..PLATE.dividers }, ..PLATE },
            Nameplate { dividers: Dividers { offset: -1.0, ..PLATE.dividers }, ..PLATE },
            Nameplate { dividers: Dividers { bandwidth: Some(0.0), ..PLATE.dividers }, ..PLATE },
        ];
        assert!(broken.iter().all(|plate| plate.check().is_err()));
    }
}
