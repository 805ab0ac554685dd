//! Interface between the simulation and the algorithms.

use std::sync::atomic::{AtomicBool, Ordering};

use serde::{Serialize, de::DeserializeOwned};
use standstill_sim::Tape;

/// A function of standard normal numbers, as many as the function reads from its [`Tape`], a record of a trial's draws.
///
/// ```
/// use std::convert::Infallible;
/// use standstill_odds::System;
/// use standstill_sim::{Purpose, Streams, Tape};
///
/// /// The mean of as many draws as the first one says.
/// struct Mean;
///
/// impl System for Mean {
///     type Error = Infallible;
///
///     fn values(&self, tapes: &[Tape]) -> Result<Vec<f64>, Infallible> {
///         let value = |tape| {
///             let mut draws = Streams::taped(tape).open(Purpose::CurrentNoise);
///             let count = if draws.normal() > 0.0 { 4 } else { 2 };
///             (0..count).map(|_| draws.normal()).sum::<f64>() / f64::from(count)
///         };
///         Ok(tapes.iter().map(value).collect())
///     }
/// }
///
/// let tape = Tape::new(1, 0);
/// let value = Mean.values(&[tape.clone()])?[0];
/// assert_eq!(Mean.values(&[tape])?, [value]);
/// # Ok::<(), Infallible>(())
/// ```
pub trait System: Sync {
    /// Reason why a value cannot be computed.
    type Error: Send;

    /// Returns the values of these tapes in their order; each value depends on its own tape alone. A value above zero
    /// is the event; a value below zero is minus the distance from the event, in any unit; minus infinity means that
    /// the distance is unknown.
    ///
    /// # Errors
    /// No trial can be made of the draws of a tape.
    fn values(&self, tapes: &[Tape]) -> Result<Vec<f64>, Self::Error>;

    /// Returns the number of values so far of trials that could not be carried out. Such trials make an answer
    /// doubtful.
    fn lost(&self) -> u64 {
        0
    }
}

/// Observer of a computation, which may stop it.
pub trait Watch: Sync {
    /// Returns true to stop the computation.
    fn stopped(&self) -> bool;

    /// Reports that this number of further trials is done.
    fn did(&self, trials: u64);

    /// Reports that the present run of subset simulation reached the level of this number, and the probability that a
    /// start lies beyond that level.
    fn came_to(&self, _level: u32, _probability: f64) {}

    /// Returns the result that was stored under this key before an interruption; none without one.
    fn recall(&self, _key: &str) -> Option<Vec<u8>> {
        None
    }

    /// Stores a part of the result under this key, in case the computation is interrupted.
    fn keep(&self, _key: &str, _bytes: &[u8]) {}
}

/// Returns the result that is stored under this key, or computes and stores it. The key must name all that the result
/// depends on, except the scenario. `trials`: returns the number of trials of a result.
///
/// # Errors
/// Those of `compute`.
pub fn kept<T: Serialize + DeserializeOwned, E>(
    watch: &dyn Watch,
    key: &str,
    trials: impl FnOnce(&T) -> u64,
    compute: impl FnOnce() -> Result<T, E>,
) -> Result<T, E> {
    let known = watch.recall(key).and_then(|bytes| postcard::from_bytes(&bytes).ok());
    if let Some(known) = known {
        watch.did(trials(&known));
        return Ok(known);
    }
    let found = compute()?;
    if let Ok(bytes) = postcard::to_stdvec(&found) {
        watch.keep(key, &bytes);
    }
    Ok(found)
}

/// Observer that reports nothing and stops the computation if the flag is set.
impl Watch for AtomicBool {
    fn stopped(&self) -> bool {
        self.load(Ordering::Relaxed)
    }

    fn did(&self, _: u64) {}
}

/// Reason why a computation has no result.
#[derive(Clone, Debug, PartialEq)]
pub enum Halt<E> {
    /// The observer stopped the computation.
    Stopped,
    /// A trial cannot be run.
    Failed(E),
}

impl<E> From<E> for Halt<E> {
    fn from(error: E) -> Self {
        Self::Failed(error)
    }
}
