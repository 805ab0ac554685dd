//! Errors of a fit.

use super::record::{MOST_ROWS, Record};
use super::{Exchanged, MOST_EDGES, Swing, Wiring};
use standstill_quantity::Quantity;
use standstill_quantity::unit::Second;
use thiserror::Error;

/// Error of a fit that did not succeed.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FitError {
    /// No pulse raises a visible current.
    #[error(
        "found no current that rises in a pulse; needed: pulses of at least ten times the channels' resolution, and \
         currents into the motor counted positive"
    )]
    NoCurrent,
    /// Channels are on other phases than their columns state, or reversed.
    #[error(
        "found currents that the legs do not raise; with {0} they would be; needed: each current in its own phase's \
         column, positive into the motor"
    )]
    Wiring(Wiring),
    /// The current of a shunt in the DC link has the other sign.
    #[error(
        "found a current of the link (i_link_A) that falls in pulses; needed: positive from the DC link into the bridge"
    )]
    LinkReversed,
    /// A shunt alone, with pulses along so few axes.
    #[error(
        "found pulses along {} and the current of one shunt in the DC link (i_link_A) alone, which shows each pulse only along its own \
         legs; needed: pulses along three axes at least, such as high,low,low and low,high,low and low,low,high, for L_d, L_q and the \
         angle (and each the other way round for the pole); or two phase currents",
        if *.0 == 1 { "one axis".to_owned() } else { format!("{} axes", .0) }
    )]
    FewAxes(usize),
    /// No pulse lasts longer than a shunt's readings are left out, a time in s.
    #[error(
        "found no reading of the link's current (i_link_A) in a pulse later than {} after a change of the legs, when a shunt's amplifier is \
         taken to have settled; needed: longer pulses, or -s sensors.settle=… as the amplifier has it",
        Quantity::<Second>::si(*.0)
    )]
    Unsettled(f64),
    /// Some pulses have the legs of other pulses.
    #[error(
        "found legs that do not raise the currents beside them: {0}; needed: in each row what the legs were asked for then"
    )]
    Legs(Exchanged),
    /// No parameters make the plant's currents come near the readings.
    #[error(
        "no motor at standstill comes near these currents; needed: legs, currents and DC link of one inverter and motor, \
         in these columns' units"
    )]
    NoPlant,
    /// The nearest motor has a winding without resistance.
    #[error(
        "{NO_RESISTANCE}; needed: u_dc_V read at the bridge in each row, pulses so long \
         that a resistance shows, and a rotor that stays"
    )]
    NoResistance,
    /// The nearest linear motor leaves more than half of the currents unexplained: their share, and the pulse with the largest
    /// residual, by file and time in s.
    #[error(
        "no motor at standstill comes near these currents: the nearest leaves {:.0} % of them, most in the pulse at {} of \
         {file}; needed: legs, currents and DC link of one inverter and motor, in these columns' units, and a rotor that \
         stays",
        100.0 * share, Quantity::<Second>::si((time * 1e8).round() / 1e8)
    )]
    FarOff {
        /// Rms of the residuals divided by the rms of the currents.
        share: f64,
        /// File of the pulse.
        file: String,
        /// Beginning of the pulse in s.
        time: f64,
    },
    /// No motor comes near, or one without resistance, and the DC link, whose mean is simulated, moves much within a pulse: the error, the
    /// file of the largest swing, and the swing.
    #[error(
        "{}. The DC link of {file} moves between {:.1} and {:.1} V while legs drive, and its mean is simulated: {}",
        error.beside_a_link(), swing.ends[0], swing.ends[1], error.steadier(swing)
    )]
    SoftLink {
        /// Error without regard to the link.
        error: Box<FitError>,
        /// File of the swing.
        file: String,
        /// The swing.
        swing: Swing,
    },
    /// Some records state the rotor's angle, but this one does not.
    #[error(
        "{0}: found no column angle_deg, which other files have; needed: the rotor's electrical angle in all files or in none"
    )]
    NoAngle(String),
    /// A record to be predicted states the rotor's angle, but the fit's records do not.
    #[error(
        "{0}: found the column angle_deg, which the fit's files do not have; needed: the rotor's electrical angle in all files or in none"
    )]
    NewAngle(String),
    /// A record to be predicted has a channel that the fit's records do not have: its name.
    #[error(
        "{file}: found readings of {channel}, of which the fit has none; needed: channels whose gain and offset the fit has found"
    )]
    NewChannel {
        /// File of the record.
        file: String,
        /// Column of the channel.
        channel: &'static str,
    },
    /// All records together have more rows than a fit takes.
    #[error("found {0} rows in all files; needed: at most {MOST_ROWS}")]
    TooManyRows(usize),
    /// The fit was interrupted.
    #[error("stopped")]
    Stopped,
    /// More edges must be estimated, because rows are far apart, than a fit can place.
    #[error(
        "found {0} changes of the legs between rows so far apart that their places matter; needed: at most {MOST_EDGES}, \
         or rows closer together"
    )]
    TooManyEdges(usize),
}

/// What was found where the nearest winding has no resistance.
const NO_RESISTANCE: &str = "found a winding without resistance: nothing slows the currents' rise";

impl FitError {
    /// Returns this error with the swing of the DC link, if that may be why no motor comes near.
    pub(super) fn beside(self, swing: Option<Swing>, records: &[Record]) -> Self {
        let may_explain = |swing: &Swing| match &self {
            Self::NoPlant | Self::NoResistance => swing.is_soft(),
            Self::FarOff { .. } => swing.may_leave_half(),
            _ => false,
        };
        let named = swing.filter(may_explain).and_then(|swing| Some((swing, records.get(swing.record)?)));
        match named {
            Some((swing, record)) => {
                Self::SoftLink { error: Box::new(self), file: record.file.clone(), swing }
            }
            None => self,
        }
    }

    /// Returns this error as it stands before a DC link's swing: without the long pulses, in which such a link moves still more.
    fn beside_a_link(&self) -> String {
        match self {
            Self::NoResistance => NO_RESISTANCE.to_owned(),
            _ => self.to_string(),
        }
    }

    /// Returns which records have a steadier link and mend this error: shorter pulses would show still less of a resistance.
    const fn steadier(&self, swing: &Swing) -> &'static str {
        match (self, swing.pulses) {
            (Self::NoResistance, ..=1) => "record with more capacitance at the bridge",
            _ => swing.steadier(),
        }
    }
}
