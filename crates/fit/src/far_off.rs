//! Refuses currents that no motor at standstill has.

use super::parameters::Point;
use super::reached::traces;
use super::record::{CHANNELS, Record};
use super::result::Trace;
use super::{Fit, FitError, Work};

/// Ratio of the rms of the nearest linear motor's residuals to the rms of the currents above which a record is refused.
const FAR_OFF: f64 = 0.5;

/// Least resistance of a winding, as a share of the link's voltage over the largest current. A converter of 20 bits would not show less.
const LEAST_RESISTANCE: f64 = 1e-6;

impl Fit {
    /// Returns this fit if its resistance is above zero, as a data sheet must state it: above a millionth of the link's voltage over the
    /// largest current. `records`: those of the fit, whose names the error has.
    ///
    /// # Errors
    /// [`FitError::NoResistance`], with the swing of the DC link where that may be why.
    pub fn with_a_resistance(self, records: &[Record]) -> Result<Self, FitError> {
        if self.plant.resistance > LEAST_RESISTANCE * self.link / self.reach {
            return Ok(self);
        }
        Err(FitError::NoResistance.beside(Some(self.link_swing), records))
    }
}

impl Work<'_> {
    /// Refuses records of which the nearest linear motor leaves most of the current unexplained: a search would not converge.
    pub(super) fn is_near(&self, point: &Point, records: &[Record]) -> Result<(), FitError> {
        let squares = |trace: &Trace| {
            let (mut off, mut all) = (0.0, 0.0);
            for (read, simulated) in trace.measured.iter().zip(&trace.simulated) {
                for k in (0..CHANNELS).filter(|k| !read[*k].is_nan()) {
                    let [r, i] = [read[k] - simulated[k], read[k] - point.offset[k]];
                    (off, all) = (off + r * r, all + i * i);
                }
            }
            (off, all)
        };
        let traces = traces(&self.problem, point).ok_or(FitError::NoPlant)?;
        let each: Vec<(f64, f64)> = traces.iter().map(squares).collect();
        let [off, all] = [|(off, _): &(f64, f64)| *off, |(_, all): &(f64, f64)| *all]
            .map(|which| each.iter().map(which).sum::<f64>());
        let share = (off / all).sqrt();
        if share < FAR_OFF {
            return Ok(());
        }
        let worst =
            (0..each.len()).max_by(|a, b| each[*a].0.total_cmp(&each[*b].0)).ok_or(FitError::NoPlant)?;
        let piece = &self.problem.pieces[worst];
        let time = piece.edges.first().map_or(0.0, |edge| edge.at);
        Err(FitError::FarOff { share, file: records[piece.record].file.clone(), time })
    }
}
