//! The rule that decides which end of an axis is the north pole.

use standstill_detect::{PolarityRule, SequentialSettings};
use standstill_interface::choice;

choice! {
    /// The rule by which the pole is decided, in methods that find the axis first and then run a separate polarity test.
    pub enum PoleRule {
        /// By one voltage vector in each direction along the axis, as in the paper.
        TwoVectors = "two-vectors",
        /// By as many voltage vectors as it takes, with a probability of one in a million to be wrong.
        Sequential = "sequential",
    }
}

impl PoleRule {
    /// Returns the settings of the rule. `difference` is the relative difference between the currents of the motor's two poles.
    pub(crate) fn settings(self, difference: f64) -> PolarityRule<f64> {
        match self {
            Self::TwoVectors => PolarityRule::TwoVectors,
            Self::Sequential => PolarityRule::Sequential(SequentialSettings::new(difference)),
        }
    }
}
