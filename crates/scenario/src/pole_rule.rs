//! The rule by which the pole of an axis is decided.

use standstill_detect::{PolarityRule, SequentialSettings};
use standstill_interface::choice;

choice! {
    /// The rule by which a pole is decided, where a polarity test of its own follows the axis.
    pub enum PoleRule {
        /// By one vector each way, as in the paper.
        TwoVectors = "two-vectors",
        /// By as many as it takes, with a probability of one in a million to be wrong.
        Sequential = "sequential",
    }
}

impl PoleRule {
    /// Returns the rule's settings; `difference` is the relative difference between the currents of the motor's two poles.
    pub(crate) fn settings(self, difference: f64) -> PolarityRule<f64> {
        match self {
            Self::TwoVectors => PolarityRule::TwoVectors,
            Self::Sequential => PolarityRule::Sequential(SequentialSettings::new(difference)),
        }
    }
}
