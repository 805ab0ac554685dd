//! Commissioning in firmware. Without an interface for C so far: it is built here so that it stays without standard library.

use standstill_detect::{Commissioning, CommissioningError, CommissioningSettings, Learnt};
use standstill_interface::{Abc, Angle};

/// Returns a correction from line inductances at several positions.
///
/// # Errors
/// Nothing that can be learnt.
pub fn learn(
    settings: CommissioningSettings<f32>,
    starts: &[(Abc<f32>, Option<Angle<f32>>)],
) -> Result<Learnt<f32>, CommissioningError<f32>> {
    let mut commissioning = Commissioning::new(settings).map_err(|_| CommissioningError::NoConvergence)?;
    for (lines, north) in starts {
        commissioning.add(*lines, *north)?;
    }
    commissioning.learn()
}
