//! How many trials are computed at a time.

use std::time::{Duration, Instant};

/// Blocks as long as an interruption may wait: between them records are handed on and an interruption is looked for. The
/// records are the same whatever the blocks are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace(u64);

/// Trials of a block at least and at most.
const BLOCK: [u64; 2] = [8, 512];

/// How long a block may take and still be followed by a larger one.
const SHORT: Duration = Duration::from_millis(100);

impl Pace {
    /// Before the first block.
    pub(crate) const START: Self = Self(BLOCK[0]);

    /// Trials of the next block.
    pub(crate) const fn size(self) -> u64 {
        self.0
    }

    /// After a block that began then.
    pub(crate) fn after(self, begun: Instant) -> Self {
        let [least, most] = BLOCK;
        Self(if begun.elapsed() < SHORT { (2 * self.0).min(most) } else { (self.0 / 2).max(least) })
    }
}
