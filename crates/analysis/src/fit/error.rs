//! What keeps a fit from succeeding.

use std::fmt;

use super::record::MOST_ROWS;
use super::{MOST_EDGES, Wiring};

/// A fit that did not succeed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FitError {
    /// The pulses raise no current that could be seen.
    NoCurrent,
    /// Channels that are on other phases than their columns say, or the wrong way round.
    Wiring(Wiring),
    /// No plant comes near the readings.
    NoPlant,
    /// More rows, of all records together, than a fit takes.
    TooManyRows(usize),
    /// An interrupt.
    Stopped,
    /// More changes of the legs than can be placed between rows so far apart.
    TooManyEdges(usize),
}

impl fmt::Display for FitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoCurrent => {
                write!(
                    f,
                    "found no current that rises in a pulse; needed: pulses of at least ten times the channels' resolution, and currents into the motor counted positive"
                )
            }
            Self::Wiring(wiring) => write!(
                f,
                "found currents that the legs do not raise; with {wiring} they would be; needed: each current in its own phase's column, positive into the motor"
            ),
            Self::NoPlant => {
                write!(
                    f,
                    "no motor at standstill comes near these currents; needed: legs, currents and DC link of one inverter and motor, in these columns' units"
                )
            }
            Self::TooManyRows(rows) => {
                write!(f, "found {rows} rows in all files; needed: at most {MOST_ROWS}")
            }
            Self::Stopped => write!(f, "stopped"),
            Self::TooManyEdges(count) => write!(
                f,
                "found {count} changes of the legs between rows so far apart that their places matter; needed: at most {MOST_EDGES}, or rows closer together"
            ),
        }
    }
}

impl std::error::Error for FitError {}
