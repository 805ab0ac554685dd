//! Common parts of the detectors' settings.

use core::fmt;

use standstill_interface::{Detector, Nanos, Real, choice};

choice! {
    /// How a pulse's current decays.
    pub enum Decay {
        /// Both driven legs low: the zero vector of the paper. The current circulates and is not gone before the
        /// next pulse of the pair, which equation (10) allows for.
        Slow = "slow",
        /// All gates off: the current returns to the DC link through the diodes, against its full voltage.
        Fast = "fast",
    }
}

/// A setting with which no detector can work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SettingsError {
    /// Name of the setting.
    pub setting: &'static str,
    /// The requirement, in words.
    pub needed: &'static str,
}

impl SettingsError {
    /// Makes an error with its own text, for a detector that is defined elsewhere. The text is static, because a
    /// firmware has no allocator; a text made at run time may be leaked, because the error ends the run.
    pub const fn own(text: &'static str) -> Self {
        Self { setting: "", needed: text }
    }

    /// Returns the error's own text, if it has one.
    pub const fn own_text(&self) -> Option<&'static str> {
        if self.setting.is_empty() { Some(self.needed) } else { None }
    }
}

impl fmt::Display for SettingsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(text) = self.own_text() {
            return f.write_str(text);
        }
        write!(f, "detector setting `{}` must be {}", self.setting, self.needed)
    }
}

impl core::error::Error for SettingsError {}

/// Returns an error unless `holds`.
pub(crate) fn require(holds: bool, setting: &'static str, needed: &'static str) -> Result<(), SettingsError> {
    if holds { Ok(()) } else { Err(SettingsError { setting, needed }) }
}

/// Requires a positive, finite value.
pub(crate) fn require_positive<T: Real>(value: T, setting: &'static str) -> Result<(), SettingsError> {
    require(value.is_finite() && value > T::zero(), setting, "positive and finite")
}

/// Requires a finite value of zero or more.
pub(crate) fn require_zero_or_more<T: Real>(value: T, setting: &'static str) -> Result<(), SettingsError> {
    require(value.is_finite() && value >= T::zero(), setting, "zero or more and finite")
}

/// Requires a value above zero and below one.
pub(crate) fn require_share<T: Real>(value: T, setting: &'static str) -> Result<(), SettingsError> {
    require(value > T::zero() && value < T::one(), setting, "above 0 and below 1")
}

/// Requires a probability of a wrong pole from 1e-30 to below 0.5.
pub(crate) fn require_error<T: Real>(value: T, setting: &'static str) -> Result<(), SettingsError> {
    // Below 1e-30 an exponential in single precision loses digits.
    let least = T::of(1e-30);
    require(value >= least && value < T::of(0.5), setting, "a probability from 1e-30 to below 0.5")
}

/// Longest time that a detection may wait for a single event.
pub(crate) const LONGEST: Nanos = Nanos(60_000_000_000);

/// A kind of readings that a drive may have in addition to its DC-link voltage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The currents of the phases, by sensors in line or by shunts below the legs.
    PhaseCurrents,
    /// The current of the DC link, by one shunt.
    LinkCurrent,
    /// The voltages of the terminals, behind dividers.
    Terminals,
    /// The times that currents take to a comparator's threshold.
    CapturedTimes,
}

impl Source {
    /// All kinds.
    pub const ALL: &'static [Self] =
        &[Self::PhaseCurrents, Self::LinkCurrent, Self::Terminals, Self::CapturedTimes];

    /// Returns whether a sensor of currents gives these readings.
    ///
    /// ```
    /// use standstill_detect::Source;
    ///
    /// assert!(Source::LinkCurrent.is_current() && !Source::CapturedTimes.is_current());
    /// ```
    pub const fn is_current(self) -> bool {
        matches!(self, Self::PhaseCurrents | Self::LinkCurrent)
    }

    /// Returns whether a drive with the readings `there` has any that a method with the sources `needed` can work with.
    pub fn any_of(needed: &[Self], there: &[Self]) -> bool {
        needed.iter().any(|source| there.contains(source))
    }

    /// Returns the readings in words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::PhaseCurrents => "the currents of the phases",
            Self::LinkCurrent => "the current of the DC link",
            Self::Terminals => "the voltages of the terminals",
            Self::CapturedTimes => "the time that a current takes to a threshold",
        }
    }

    /// Returns the setting of a drive that gives such readings, as scenario files have it.
    pub const fn setting(self) -> &'static str {
        match self {
            Self::PhaseCurrents => {
                "`sensors.arrangement` \"three-in-line\", \"two-in-line\" or \"low-side-shunts\""
            }
            Self::LinkCurrent => "`sensors.arrangement` \"dc-link-shunt\"",
            Self::Terminals => "`sensors.terminals` true",
            Self::CapturedTimes => "`sensors.timer`",
        }
    }
}

/// Settings from which a detector is made.
///
/// ```
/// # let nameplate = include!(concat!(env!("CARGO_MANIFEST_DIR"), "/doc/nameplate.rs"));
/// use standstill_detect::{BipolarSettings, Settings};
/// use standstill_interface::{Detector, Step};
///
/// let mut detector = BipolarSettings::suited(&nameplate).detector()?;
/// // Its first order needs no readings.
/// assert!(matches!(detector.step(&[]), Step::Drive(_)));
/// # Ok::<(), standstill_detect::SettingsError>(())
/// ```
pub trait Settings<T: Real> {
    /// The detector that these settings make.
    type Detector: Detector<T>;

    /// Makes a detector, ready for its first step.
    ///
    /// # Errors
    /// The method cannot work with one of the settings.
    fn detector(&self) -> Result<Self::Detector, SettingsError>;

    /// The PWM carrier's period that the drive must have; none if the method uses no PWM.
    fn carrier_period(&self) -> Option<Nanos> {
        None
    }

    /// The kinds of readings of which any one is enough for the method.
    fn sources(&self) -> &'static [Source] {
        Source::ALL
    }

    /// Whether the method turns the rotor: it then does not find the angle at which the rotor stood before.
    fn turns_rotor(&self) -> bool {
        false
    }
}
