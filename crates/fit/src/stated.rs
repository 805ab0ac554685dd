//! Angles of the rotor that the records state.

use super::FitError;
use super::record::Record;

/// Largest change in electrical degrees of a rotor's angle within a record: the fit has a rotor that stands still.
const STANDS_STILL: f64 = 2.0;

/// Angles of a record's rows, in degrees.
#[derive(Default)]
pub(super) struct Turned {
    first: f64,
    /// Sum of what the angles are beside the first.
    beside: f64,
    count: u32,
}

impl Turned {
    /// Adds the angle of a row. If the rotor does not stand still, returns what was found and what is needed.
    pub(super) fn add(&mut self, angle: f64) -> Result<(), (String, String)> {
        if self.count == 0 {
            self.first = angle;
        }
        let beside = wrapped(angle - self.first);
        if beside.abs() > STANDS_STILL {
            let found = format!("{angle}, {beside:.1}° from the first row");
            let needed = format!("a rotor that stands still, within {STANDS_STILL}° in a record");
            return Err((found, needed));
        }
        (self.beside, self.count) = (self.beside + beside, self.count + 1);
        Ok(())
    }

    /// Returns the mean angle in rad; none without rows.
    pub(super) fn mean(&self) -> Option<f64> {
        (self.count > 0).then(|| wrapped(self.first + self.beside / f64::from(self.count)).to_radians())
    }
}

/// Returns an angle in degrees from −180 to 180.
fn wrapped(degrees: f64) -> f64 {
    degrees - 360.0 * (degrees / 360.0).round()
}

/// Returns the angle in rad of the first record; none if no record states one.
///
/// # Errors
/// [`FitError::NoAngle`] if only some of the records state one: how far the others are turned is then unknown.
pub(super) fn origin(records: &[Record]) -> Result<Option<f64>, FitError> {
    if records.iter().all(|record| record.angle.is_none()) {
        return Ok(None);
    }
    match records.iter().find(|record| record.angle.is_none()) {
        Some(without) => Err(FitError::NoAngle(without.file.clone())),
        None => Ok(records.first().and_then(|record| record.angle)),
    }
}
