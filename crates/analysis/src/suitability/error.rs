//! Errors of a check.

use standstill_campaign::CampaignError;
use standstill_scenario::FileError;
use thiserror::Error;

use crate::bound::BoundError;

/// Error of a suitability check that reached no verdict.
#[derive(Debug, Error)]
pub enum SuitabilityError {
    /// The scenario is invalid.
    #[error(transparent)]
    File(#[from] FileError),
    /// The trials could not be run.
    #[error(transparent)]
    Campaign(#[from] CampaignError),
    /// The Cramér–Rao limit could not be computed.
    #[error("no Cramér–Rao limit: {0}")]
    Bound(#[from] BoundError),
}
