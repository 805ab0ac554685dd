//! The checks of methods by name, and the set of those that are on. A check tests whether readings can be those of
//! sound parts and of a rotor at standstill.

use standstill_interface::{Choice, choice};

choice! {
    /// A check whether readings can be those of the motor and the drive that the data sheets describe, with all parts whole.
    pub enum Check {
        /// The voltage of the DC link is that of the data sheet.
        Link = "link",
        /// The sensors of one current agree, and none shows a current where none can flow.
        Sensors = "sensors",
        /// The inductances of the lines are those of the data sheet.
        Inductance = "inductance",
        /// Pulses in both directions of a line, or vectors along and against the axis, differ by no more than the difference of the poles explains.
        BothWays = "both-ways",
        /// No phase has more resistance than the others.
        Contact = "contact",
        /// Two sensors of one current differ by their gains alone, code by code.
        Codes = "codes",
        /// The rotor stands still.
        Turning = "turning",
        /// The saliency is that of the data sheet.
        Saliency = "saliency",
    }
}

/// The set of checks that are on.
///
/// ```
/// use standstill_detect::{Check, Checks};
///
/// let most = Checks::ALL.without(Check::Turning);
/// assert!(most.has(Check::Link) && !most.has(Check::Turning));
/// assert_eq!(most.iter().count() + 1, Check::ALL.len());
/// assert_eq!(most.with(Check::Turning), Checks::ALL);
/// assert_eq!(Checks::ALL.beyond(most), Some(Check::Turning));
/// assert_eq!(Checks::of(most.iter()), most);
/// // As a number, for languages without such a type: 1 stands for all.
/// assert_eq!(Checks::numbered(1.0), Some(Checks::ALL));
/// assert_eq!(Checks::numbered(most.number()), Some(most));
/// assert_eq!(Checks::numbered(0.5), None);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Checks(u16);

impl Checks {
    /// Every check.
    pub const ALL: Self = Self(((1 << Check::ALL.len()) - 1) << 1);
    /// The empty set of checks.
    pub const NONE: Self = Self(0);

    /// Makes the set of these checks.
    pub fn of(checks: impl IntoIterator<Item = Check>) -> Self {
        Self(checks.into_iter().fold(0, |all, check| all | bit(check)))
    }

    /// Returns the set of all checks if `on`, else the empty set.
    pub const fn all(on: bool) -> Self {
        if on { Self::ALL } else { Self::NONE }
    }

    /// Returns the set with one check more.
    #[must_use]
    pub const fn with(self, check: Check) -> Self {
        Self(self.0 | bit(check))
    }

    /// Returns the set without one check.
    #[must_use]
    pub const fn without(self, check: Check) -> Self {
        Self(self.0 & !bit(check))
    }

    /// Returns whether a check is on.
    pub const fn has(self, check: Check) -> bool {
        self.0 & bit(check) != 0
    }

    /// Returns the first check of this set that is not in `others`; none if all are.
    pub fn beyond(self, others: Self) -> Option<Check> {
        self.iter().find(|check| !others.has(*check))
    }

    /// Iterates over the checks that are on, in the order of [`Check::ALL`].
    pub fn iter(self) -> impl Iterator<Item = Check> {
        Check::ALL.into_iter().filter(move |check| self.has(*check))
    }

    /// Returns the set as a number: 0 for none, or a sum of 2 for the first of [`Check::ALL`], 4 for the second, and so on.
    pub fn number(self) -> f64 {
        f64::from(self.0)
    }

    /// Returns the checks for a number from [`Self::number`], or all checks for 1; none for any other number.
    pub fn numbered(number: f64) -> Option<Self> {
        if number == 1.0 {
            return Some(Self::ALL);
        }
        (0..=Self::ALL.0).step_by(2).map(Self).find(|checks| checks.number() == number)
    }

    /// Returns the checks with these names.
    ///
    /// # Errors
    /// Returns the first name that does not belong to a check.
    pub fn named<'a>(names: impl IntoIterator<Item = &'a str>) -> Result<Self, &'a str> {
        names.into_iter().try_fold(Self::NONE, |all, name| {
            <Check as Choice>::named(name).map(|check| Self(all.0 | bit(check))).ok_or(name)
        })
    }
}

/// Returns the bit of a check. The lowest bit is not used, because 1 stands for all checks.
const fn bit(check: Check) -> u16 {
    2 << check as u16
}
