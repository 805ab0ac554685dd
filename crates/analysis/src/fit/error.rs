//! What keeps a fit from succeeding.

use std::fmt;

use super::record::MOST_ROWS;
use super::{Exchanged, MOST_EDGES, Wiring};
use standstill_quantity::Quantity;
use standstill_quantity::unit::Second;

/// A fit that did not succeed.
#[derive(Clone, Debug, PartialEq)]
pub enum FitError {
    /// The pulses raise no current that could be seen.
    NoCurrent,
    /// Channels that are on other phases than their columns say, or the wrong way round.
    Wiring(Wiring),
    /// Pulses with the legs of others.
    Legs(Exchanged),
    /// No plant comes near the readings.
    NoPlant,
    /// The nearest linear motor leaves more than half of the currents: what share of them, and in which pulse most, by file and time in s.
    FarOff {
        /// Root mean square of the residuals over that of the currents.
        share: f64,
        /// File of the pulse.
        file: String,
        /// When it begins, in s.
        time: f64,
    },
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
            Self::Legs(exchanged) => write!(
                f,
                "found legs that do not raise the currents beside them: {exchanged}; needed: in each row what the legs were asked for then"
            ),
            Self::FarOff { share, file, time } => write!(
                f,
                "no motor at standstill comes near these currents: the nearest leaves {:.0} % of them, most in the pulse at {} of {file}; needed: legs, currents and DC link of one inverter and motor, in these columns' units, and a rotor that stays",
                100.0 * share,
                Quantity::<Second>::si((time * 1e8).round() / 1e8)
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
