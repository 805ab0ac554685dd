//! The simulation as the algorithms need it.

use std::sync::atomic::{AtomicBool, Ordering};

use serde::{Serialize, de::DeserializeOwned};
use standstill_sim::Tape;

/// A function of a vector of standard normals that grows as it is read.
///
/// ```
/// use std::convert::Infallible;
/// use standstill_analysis::System;
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
    /// Reason why there is no value.
    type Error: Send;

    /// The values at these tapes, in their order. The value of a tape does not depend on the others. What is above zero
    /// is the event; what is below says how far it is from it. Minus infinity where nothing says that.
    ///
    /// # Errors
    /// Draws that make nothing that can be run.
    fn values(&self, tapes: &[Tape]) -> Result<Vec<f64>, Self::Error>;
}

/// Observer of the work, which may end it.
pub trait Watch: Sync {
    /// True to stop.
    fn stopped(&self) -> bool;

    /// So many further trials are done.
    fn did(&self, trials: u64);

    /// The run at hand has come down to a level of this number, beyond which starts are with this probability.
    fn came_to(&self, _level: u32, _probability: f64) {}

    /// Result that an interrupted question kept under this key.
    fn recall(&self, _key: &str) -> Option<Vec<u8>> {
        None
    }

    /// Keeps a part of the answer, should the question be interrupted.
    fn keep(&self, _key: &str, _bytes: &[u8]) {}
}

/// Result kept under this key, or else computed and then kept. The key has all that the result depends on but
/// the scenario; `trials` is what the result costs.
pub(crate) fn kept<T: Serialize + DeserializeOwned, E>(
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

/// Nobody looks on, but a flag may be set.
impl Watch for AtomicBool {
    fn stopped(&self) -> bool {
        self.load(Ordering::Relaxed)
    }

    fn did(&self, _: u64) {}
}

/// Reason why there is no result.
#[derive(Clone, Debug, PartialEq)]
pub enum Halt<E> {
    /// Somebody asked to stop.
    Stopped,
    /// A trial that cannot be run.
    Failed(E),
}

impl<E> From<E> for Halt<E> {
    fn from(error: E) -> Self {
        Self::Failed(error)
    }
}
