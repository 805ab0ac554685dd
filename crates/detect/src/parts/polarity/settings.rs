//! Settings of the polarity test: the motor's signature, its vectors and its rule.

use standstill_interface::{
    Abc, AlphaBeta, Angle, Command, Leg, Nanos, PoleEvidence, Real, Sampling, Stage, choice,
};

use super::sequential::SequentialSettings;
use crate::checks::{Check, Checks};
use crate::keys::{Lines, Microseconds, Value};
use crate::nameplate::{Nameplate, Place};
use crate::parts::plausibility;
use crate::settings::{LONGEST, SettingsError, require, require_positive, require_zero_or_more};

choice! {
    /// The one of two opposite voltage vectors along the d-axis that raises the larger current: a property of the motor's
    /// magnetics, and the one thing about the poles that no measurement at standstill can tell.
    pub enum Signature {
        /// The vector towards the north pole.
        Normal = "normal",
        /// The vector towards the south pole.
        Inverted = "inverted",
        /// Neither, or it depends on the current: the detector gives no pole.
        None = "none",
    }
}

impl Signature {
    /// Describes the signature in words.
    pub const fn in_words(self) -> &'static str {
        match self {
            Self::Normal => "north draws more current",
            Self::Inverted => "south draws more current",
            Self::None => "both draw the same",
        }
    }

    /// Converts evidence for the pole that draws more current to evidence for north; none if neither pole draws more.
    pub(super) fn towards_north<T: Real>(self, draws_more: PoleEvidence<T>) -> Option<PoleEvidence<T>> {
        match self {
            Self::Normal => Some(draws_more),
            Self::Inverted => Some(draws_more.opposite()),
            Self::None => None,
        }
    }
}

/// Largest relative difference of the poles' currents up to which vectors of an intact drive raise at least half of the set current. The
/// library's motors with up to 10 % do; `pm-reluctance`, with 21 %, raises 36 % of it.
const EVEN: f64 = 0.15;

/// Rule by which the polarity test ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PolarityRule<T> {
    /// After one vector each way, as in the paper: the larger current decides if the difference exceeds the noise.
    TwoVectors,
    /// After as many pairs of vectors as the sequential test needs.
    Sequential(SequentialSettings<T>),
}

/// Settings of the polarity test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PolaritySettings<T> {
    /// Period of the drive's PWM carrier.
    pub carrier_period: Nanos,
    /// Carrier periods per vector.
    pub periods: u16,
    /// Current in A that a vector is to reach: near the rated current.
    pub current: T,
    /// Resistance of a phase in Ω, to choose the voltage; a rough value will do.
    pub resistance: T,
    /// Dead time of the drive, for its compensation. Zero: none.
    pub dead_time: Nanos,
    /// Least current in A that a vector must raise.
    pub least_current: T,
    /// Difference of the two currents in A below which two vectors name no pole, however quiet the sensors are.
    pub least_margin: T,
    /// Largest relative difference between the currents of both directions in a motor without saturation, in addition
    /// to the rule's own allowance: by the pattern of PWM within the time constant, and by jitter of the samples of the
    /// link's current.
    pub uneven: T,
    /// The motor's signature: which pole draws more current.
    pub signature: Signature,
    /// Rule by which the test ends.
    pub rule: PolarityRule<T>,
    /// Arrangement of the current sensors. One shunt in the DC link shows a vector's current after the vector, when
    /// diodes return it to the link.
    pub place: Place,
    /// Checks that are on: [`Check::BothWays`] and [`Check::Turning`]; by default the former alone. The latter would
    /// take good starts for a turning rotor if sensors are exact or better than the drive assumes, or if vectors move a
    /// free rotor.
    pub checks: Checks,
    /// Least mean of the currents along the axis and against it, as a share of `current`. A smaller mean shows that a
    /// part of the drive shortens the vectors. Zero: no check.
    pub least_share: T,
    /// Largest difference between the responses to vectors along the axis and against it, as a share of their mean.
    pub both_ways: T,
    /// Flux linkage of the magnet in Wb, by which a turning rotor induces a voltage; zero without a magnet.
    pub magnet_flux: T,
    /// Voltage drop in V of a switch and a diode in the path of the current that the magnet drives through shorted
    /// terminals.
    pub lost: T,
    /// L_q in H, a rough value.
    pub q_axis_inductance: T,
    /// Time after a vector, with all gates off, at which a shunt in the DC link is read first; a second reading follows
    /// after the same time again.
    pub window: Nanos,
}

impl<T: Real> PolaritySettings<T> {
    /// The checks of a polarity test by vectors: whether the responses of both directions differ by no more than the
    /// poles can make them, and whether the rotor stands still.
    pub(crate) const CHECKS: Checks = Checks::NONE.with(Check::BothWays).with(Check::Turning);

    /// Returns settings with vectors of 2 % above the rated current, the mean of the paper's Table 2. They last 1 ms or
    /// half the time constant L_d/R, whichever is shorter, but at least a carrier period, and as long as 0.3 of the
    /// link's voltage, which PWM can give in any direction, takes to raise the current in L_d.
    ///
    /// Two inductances that differ by 1 % make currents that differ by `x/(eˣ − 1)` per cent, x = R t / L_d: by 0.77 % after half the time
    /// constant, and by 0.07 % after four, when resistance alone determines the current.
    pub fn near_rated_current(drive: &Nameplate<T>, signature: Signature, rule: PolarityRule<T>) -> Self {
        let carrier_period = drive.carrier_period;
        let current = drive.rated_current * T::of(1.02);
        let whole =
            |time: Nanos| u16::try_from((time.0 / carrier_period.0.max(1)).max(1)).unwrap_or(u16::MAX);
        let millisecond = whole(Nanos::from_micros(1000));
        let half_constant = T::of(0.5) * drive.d_axis_inductance / drive.resistance;
        let least = millisecond.min(whole(Nanos::from_seconds(half_constant.to_double())));
        let duration = drive.d_axis_inductance * current / (T::of(0.3) * drive.dc_link);
        let needed = Nanos::from_seconds(duration.to_double()).0.div_ceil(carrier_period.0.max(1));
        let periods = u16::try_from(needed).unwrap_or(u16::MAX).clamp(least, millisecond.saturating_mul(20));
        // With the voltage of `amplitude`, (1/x + 1/2) (1 − e⁻ˣ) of the set current flows after x = R t / L. Less than half of that shows a
        // fault, unless the poles differ by more than `EVEN`.
        let time = T::of((carrier_period * u64::from(periods)).seconds());
        // The zero vector before the sample has different lengths for u and −u. A closed form for 0.3 of the link's
        // voltage gives a difference of 1.8 % of x², with x the carrier period in time constants. Below 0.3 % the
        // sequential rule allows for it.
        let constants = drive.resistance * T::of(carrier_period.seconds()) / drive.d_axis_inductance;
        let pattern = T::of(0.018) * constants * constants;
        let mut uneven = if pattern > T::of(0.003) { pattern } else { T::zero() };
        // The current at the end of a vector is extrapolated from two samples: its error is √5 times a jitter of up to
        // 1 µs, times the slope of a current that falls as 0.3 of the link raised it, or faster. After a millisecond
        // that is a small share.
        if drive.sensing.place == Place::InLink && periods < millisecond {
            uneven = uneven + T::of(7.4e-6) / time;
        }
        let x = (drive.resistance * time / drive.d_axis_inductance).max(T::of(1e-3));
        let reached = -(-x).exp_m1() * (x.recip() + T::of(0.5));
        let half = T::of(if drive.polarity_difference.abs() <= T::of(EVEN) { 0.5 } else { 0.0 });
        Self {
            carrier_period,
            periods,
            current,
            resistance: drive.resistance,
            dead_time: drive.dead_time,
            least_current: drive.rated_current * T::of(0.02),
            least_share: reached * half,
            least_margin: drive.rated_current * T::of(0.01),
            uneven,
            signature,
            rule,
            place: drive.sensing.place,
            checks: Self::CHECKS.without(Check::Turning),
            both_ways: plausibility::both_ways(drive),
            magnet_flux: drive.magnet_flux,
            lost: drive.switch_drop[0] + drive.reverse_drop[0],
            q_axis_inductance: drive.q_axis_inductance,
            // No jitter takes the first sample before the edge.
            window: drive.sensing.lead() + Nanos::from_micros(1),
        }
    }

    /// Returns settings with pairs of these vectors until the pole is certain enough, by the motor's signature.
    pub(crate) fn sequential(drive: &Nameplate<T>) -> Self {
        let rule = PolarityRule::Sequential(SequentialSettings::new(drive.polarity_difference));
        Self::near_rated_current(drive, drive.signature, rule)
    }

    /// Calls `line` with the settings that an engineer would copy into a drive.
    pub(crate) fn describe(&self, line: &mut Lines<'_>) {
        line("polarity.current", format_args!("{:.3} A", self.current));
        line("polarity vector", format_args!("{}", Microseconds(self.duration())));
        line("polarity.signature", format_args!("{}", self.signature.in_words()));
        match self.rule {
            PolarityRule::TwoVectors => line("polarity.rule", format_args!("two vectors")),
            PolarityRule::Sequential(rule) => {
                let error = rule.error.to_double();
                line("polarity.rule", format_args!("sequential, wrong in {error:.0e} of cases"));
            }
        }
    }

    /// Returns the allowed probability of a wrong pole; none if the rule does not have one.
    pub(crate) fn pole_error(&self) -> Option<Value> {
        match self.rule {
            PolarityRule::Sequential(sequential) => Some(Value::of(sequential.error)),
            PolarityRule::TwoVectors => None,
        }
    }

    /// Sets the allowed probability of a wrong pole. Returns false if the rule does not have one.
    pub(crate) fn set_pole_error(&mut self, value: Value) -> bool {
        match &mut self.rule {
            PolarityRule::Sequential(sequential) => {
                sequential.error = value.real();
                true
            }
            PolarityRule::TwoVectors => false,
        }
    }

    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        require(self.carrier_period > Nanos::ZERO, "polarity.carrier_period", "positive")?;
        require(self.periods > 0, "polarity.periods", "at least 1")?;
        require(self.duration() <= LONGEST, "polarity.periods", "such that a vector lasts a minute at most")?;
        require_positive(self.current, "polarity.current")?;
        require_zero_or_more(self.resistance, "polarity.resistance")?;
        require(
            self.dead_time * 4 < self.carrier_period,
            "polarity.dead_time",
            "less than a quarter of the carrier period",
        )?;
        require_positive(self.least_current, "polarity.least_current")?;
        require_zero_or_more(self.least_margin, "polarity.least_margin")?;
        require_zero_or_more(self.uneven, "polarity.uneven")?;
        require_zero_or_more(self.least_share, "polarity.least_share")?;
        require_positive(self.both_ways, "polarity.both_ways")?;
        require_zero_or_more(self.magnet_flux, "polarity.magnet_flux")?;
        require_zero_or_more(self.lost, "polarity.lost")?;
        require_positive(self.q_axis_inductance, "polarity.q_axis_inductance")?;
        match &self.rule {
            PolarityRule::TwoVectors => Ok(()),
            PolarityRule::Sequential(settings) => settings.check(),
        }
    }

    /// Returns the difference in A that a pole needs if a reading less its offset has this standard deviation in A. It
    /// is the largest of `least_margin`, four times `uneven` of the current, and four standard deviations of the
    /// difference, which are exceeded once in 30,000 times in each direction. With one shunt in the link the offset is
    /// part of that deviation.
    pub(crate) fn needed_margin(&self, noise: T) -> T {
        let least = self.least_margin.max(T::of(4.0) * self.uneven * self.current);
        least.max(T::of(4.0) * self.deviation_of_difference(noise))
    }

    /// Returns the standard deviation in A of the difference of two vectors' i_d, from the standard deviation in A of a
    /// reading's noise.
    ///
    /// With two sensors i_d is noisier than with three, by up to 1.6 times, depending on the angle.
    fn deviation_of_difference(&self, noise: T) -> T {
        (T::of(2.0) * self.by_reading()).sqrt() * noise
    }

    /// Returns the variance of i_d as a multiple of a reading's variance: 2/3 with three independent sensors. One shunt
    /// in the link shows at least cos 30° of i_d, and extrapolating two readings less the same offset to the end of the vector,
    /// `2 f − s − o`, has six times the variance of one.
    pub(crate) fn by_reading(&self) -> T {
        T::of(if self.place == Place::InLink { 8.0 } else { 2.0 / 3.0 })
    }

    /// Returns the evidence of two vectors for the pole that draws more current, and the evidence needed, both in
    /// standard deviations of the difference by noise. `difference`: current in A along the axis minus that against it.
    ///
    /// Sensors without noise, or with noise hidden by their converters, count as having a thousandth of the least
    /// margin as noise.
    pub(super) fn two_vectors(&self, difference: T, noise: T) -> PoleEvidence<T> {
        let deviation = self.deviation_of_difference(noise).max(self.least_margin * T::of(1e-3));
        let needed = (self.needed_margin(noise) / deviation).max(T::of(4.0));
        PoleEvidence { deviations: difference / deviation, needed }
    }

    /// Returns the length of one vector.
    pub fn duration(&self) -> Nanos {
        self.carrier_period * u64::from(self.periods)
    }

    /// Returns the amplitude in V of the vector that raises the wanted current in the d-axis: `L_d I / t + R I / 2`.
    pub(crate) fn amplitude(&self, d_axis_inductance: T) -> T {
        let duration = T::of(self.duration().seconds());
        self.current * (d_axis_inductance / duration + self.resistance / T::of(2.0))
    }

    /// Returns the vector at `angle`, by PWM on all three legs; `dc_link` in V. It is sampled at its end; for the
    /// sequential test at the end of each carrier period, which gives the mean of the DC link's voltage.
    ///
    /// The dead time takes from each leg a share of the period in the direction of its current, which is the direction
    /// of its voltage here. Near zero the direction is uncertain and the compensation fades out.
    pub(crate) fn command(&self, angle: Angle<T>, amplitude: T, dc_link: T) -> Command<T> {
        let (sin, cos) = angle.radians().sin_cos();
        let lost = T::of(self.dead_time.seconds() / self.carrier_period.seconds());
        let half = T::of(0.5);
        let phases = AlphaBeta::new(cos, sin).phases();
        let legs = phases.map(|share| {
            let sure = (share * T::of(5.0)).max(-T::one()).min(T::one());
            Leg::Duty((half + share * amplitude / dc_link + sure * lost).max(T::zero()).min(T::one()))
        });
        let duration = self.duration();
        let stage = Stage { legs, duration };
        if self.place == Place::InLink {
            // No conversion of the second sample comes after the end.
            let returned = Stage::off(self.window * 3);
            let sampling = Sampling::twice(duration + self.window, duration + self.window * 2);
            return Command::sequence(stage, returned, sampling);
        }
        let sampling = match self.rule {
            PolarityRule::TwoVectors => Sampling::once(duration),
            PolarityRule::Sequential(_) => Sampling {
                first: self.carrier_period,
                interval: self.carrier_period,
                count: u32::from(self.periods),
            },
        };
        Command::hold(stage, sampling)
    }

    /// Returns whether the test shorts the terminals to see whether the rotor turns. One shunt in the DC link does not
    /// see a current that circulates between the terminals.
    pub(super) fn looks(&self) -> bool {
        self.checks.has(Check::Turning) && self.magnet_flux > T::zero() && self.place != Place::InLink
    }

    /// Returns how long the terminals are shorted: as long as a vector, but at least a millisecond, so that a current
    /// shows.
    pub(super) fn short_time(&self) -> Nanos {
        self.duration().max(Nanos::from_micros(1000))
    }

    /// Returns the command that connects all terminals to the lower rail.
    pub(super) fn short(&self) -> Command<T> {
        let duration = self.short_time();
        let legs = Abc::new(Leg::Low, Leg::Low, Leg::Low);
        Command::hold(Stage { legs, duration }, Sampling::once(duration))
    }

    /// Returns the number of readings of one vector.
    pub(super) fn readings(&self) -> usize {
        match (self.rule, self.place) {
            (_, Place::InLink) => 2,
            (PolarityRule::Sequential(_), _) => usize::from(self.periods),
            (PolarityRule::TwoVectors, _) => 1,
        }
    }

    /// Returns i_d in A along `angle` at the end of a vector, from two later readings of the shunt in the DC link
    /// without offset. Diodes return the current of the legs whose current is negative, which is as large as the
    /// largest of the three currents. A saturated core returns it faster, so the straight line through both readings is
    /// extrapolated to the end of the vector.
    pub(super) fn returned_current([first, second]: [T; 2], angle: Angle<T>) -> T {
        let (sin, cos) = angle.radians().sin_cos();
        let Abc(shares) = AlphaBeta::new(cos, sin).phases();
        (second - first - first) / shares.into_iter().fold(T::zero(), |most, share| most.max(share.abs()))
    }

    /// Returns i_d in A of phase currents, in the frame at `angle`.
    pub(crate) fn direct_current(current: Abc<T>, angle: Angle<T>) -> T {
        current.clarke().park(angle).d
    }
}
