//! What keeps a fit from succeeding.

use super::record::MOST_ROWS;
use super::{Exchanged, MOST_EDGES, Wiring};
use standstill_quantity::Quantity;
use standstill_quantity::unit::Second;
use thiserror::Error;

/// A fit that did not succeed.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FitError {
    /// The pulses raise no current that could be seen.
    #[error(
        "found no current that rises in a pulse; needed: pulses of at least ten times the channels' resolution, and \
         currents into the motor counted positive"
    )]
    NoCurrent,
    /// Channels that are on other phases than their columns say, or the wrong way round.
    #[error(
        "found currents that the legs do not raise; with {0} they would be; needed: each current in its own phase's \
         column, positive into the motor"
    )]
    Wiring(Wiring),
    /// Pulses with the legs of others.
    #[error(
        "found legs that do not raise the currents beside them: {0}; needed: in each row what the legs were asked for then"
    )]
    Legs(Exchanged),
    /// No plant comes near the readings.
    #[error(
        "no motor at standstill comes near these currents; needed: legs, currents and DC link of one inverter and motor, \
         in these columns' units"
    )]
    NoPlant,
    /// The nearest linear motor leaves more than half of the currents: what share of them, and in which pulse most, by file and time in s.
    #[error(
        "no motor at standstill comes near these currents: the nearest leaves {:.0} % of them, most in the pulse at {} of \
         {file}; needed: legs, currents and DC link of one inverter and motor, in these columns' units, and a rotor that \
         stays",
        100.0 * share, Quantity::<Second>::si((time * 1e8).round() / 1e8)
    )]
    FarOff {
        /// Root mean square of the residuals over that of the currents.
        share: f64,
        /// File of the pulse.
        file: String,
        /// When it begins, in s.
        time: f64,
    },
    /// More rows, of all records together, than a fit takes.
    #[error("found {0} rows in all files; needed: at most {MOST_ROWS}")]
    TooManyRows(usize),
    /// An interrupt.
    #[error("stopped")]
    Stopped,
    /// More changes of the legs than can be placed between rows so far apart.
    #[error(
        "found {0} changes of the legs between rows so far apart that their places matter; needed: at most {MOST_EDGES}, \
         or rows closer together"
    )]
    TooManyEdges(usize),
}
