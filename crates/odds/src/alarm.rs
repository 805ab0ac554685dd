//! Alarms: findings that make an answer doubtful.

use std::fmt;

/// Reason why an answer is doubtful.
#[derive(Clone, Debug, PartialEq)]
pub enum Alarm {
    /// The runs disagree by more than their own estimates of their errors.
    Disagree {
        /// Observed coefficient of variation between the runs.
        found: f64,
        /// Expected coefficient of variation.
        expected: f64,
    },
    /// The sentinel draws, which no trial reads, have this rms mean in standard deviations instead of zero: few
    /// independent states were left.
    Unread(f64),
    /// All states of a run's last level descend from this number of states of its first level.
    Ancestors(u32),
    /// Importance sampling found less than the levels, by more than both expect of chance: it missed a part of the event,
    /// or the runs err alike by chance.
    Apart {
        /// Probability by the levels, which is the answer.
        levels: f64,
        /// Probability by importance sampling.
        mixture: f64,
    },
    /// Some runs did not reach the event.
    Missed {
        /// Number of runs that did not reach the event.
        runs: usize,
        /// Number of all runs.
        of: usize,
    },
    /// The order parameter does not show how far a start is from the event: the answer is that of plain trials.
    Flat,
    /// All starts are equally far from the event: the answer is the upper limit from the plain trials done so far.
    Constant,
    /// No run reached the event.
    TooRare {
        /// Largest probability of a run's last level, at which the run gave up.
        level: f64,
        /// Upper end of the 95 % interval of the mean probability of the runs' last levels. The event lies within these
        /// levels, so its probability is no larger, provided that the runs missed no part of it.
        at_most: f64,
    },
    /// This number of simulations could not continue; they count as starts without the event.
    Errors(u64),
    /// This share of the failed starts ended with a fault that no margin announces, so that the chains cannot approach
    /// it.
    Unled(f64),
    /// This share of the wrong poles has an axis error above 45°: the axis is lost, and any pole is wrong.
    WrongAxes(f64),
}

impl Alarm {
    /// Returns true if the runs may have missed a part of the event, or have few independent states in it.
    pub const fn is_of_runs(&self) -> bool {
        matches!(
            self,
            Self::Disagree { .. }
                | Self::Unread(_)
                | Self::Ancestors(_)
                | Self::Apart { .. }
                | Self::Missed { .. }
                | Self::TooRare { .. }
        )
    }
}

impl fmt::Display for Alarm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Disagree { found, expected } => write!(
                f,
                "the runs scatter by {:.0} % where they expect {:.0} % of themselves: the event may have parts that \
                 some runs miss",
                100.0 * found,
                100.0 * expected
            ),
            Self::Unread(mean) => write!(
                f,
                "draws that nothing reads have a mean of {mean:.2} standard deviations, and should have none: few independent states are left; \
                 more effort leaves more"
            ),
            Self::Ancestors(count) => {
                write!(
                    f,
                    "all states of a run's last level descend from {count} of its first: its parts are few"
                )
            }
            Self::Apart { levels, mixture } => write!(
                f,
                "importance sampling finds {mixture:.1e} where the levels find {levels:.1e}: it missed a part of the event, or the runs agree \
                 by chance on too much"
            ),
            Self::Missed { runs, of } => write!(f, "{runs} of {of} runs did not reach the event"),
            Self::Flat => write!(
                f,
                "no quantity shows how near a start is to the event, or the quantity is clipped or coarsely quantised: the answer counts plain \
                 trials"
            ),
            Self::Constant => write!(
                f,
                "all starts are equally far from the event, so nothing leads there: the bound is what the plain trials \
                 done until then carry"
            ),
            Self::TooRare { level, at_most } => write!(
                f,
                "not reached: the runs gave up at {level:.0e}. The bound is that of the plain trials and holds in any case. If the runs \
                 missed no part of the event, which nothing proves, its probability is at most {at_most:.1e}"
            ),
            Self::Errors(count) => {
                write!(f, "{count} simulations could not go on and count as starts without the event")
            }
            Self::Unled(share) => write!(
                f,
                "{:.0} % of the failed starts ended with a fault that no margin tells beforehand, as a clipped current: \
                 there may be more of them",
                100.0 * share
            ),
            Self::WrongAxes(share) => write!(
                f,
                "{:.0} % of the wrong poles have an axis error above 45°: it is the axis that is lost, not the pole",
                100.0 * share
            ),
        }
    }
}
