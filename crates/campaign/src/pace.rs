//! Pace: the number of trials that are computed together.

use std::time::{Duration, Instant};

use standstill_numeric::whole;
use standstill_sim::MOST_LANES;

/// Blocks of trials: between them records are handed on. The records are the same whatever the blocks are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace {
    size: u64,
    least: u64,
}

/// Trials of a block at most.
const MOST: u64 = 2048;

/// Time that a block should take.
const LONG: Duration = Duration::from_millis(150);

impl Pace {
    /// Makes the pace before the first block, which gives work to all lanes of all threads.
    pub(crate) const fn new(threads: usize) -> Self {
        let least = (MOST_LANES * threads) as u64;
        Self { size: least, least }
    }

    /// Trials of the next block.
    pub(crate) const fn size(self) -> u64 {
        self.size
    }

    /// Returns the pace after a block that began at this time: at most twice as many trials, and fewer immediately if
    /// the block took too long.
    pub(crate) fn after(self, begun: Instant) -> Self {
        self.next(begun.elapsed())
    }

    fn next(self, took: Duration) -> Self {
        let share = LONG.as_secs_f64() / took.as_secs_f64().max(1e-9);
        // A share of at most two of a small number.
        let size: u64 = whole(self.size as f64 * share.min(2.0));
        Self { size: size.min(MOST).max(self.least), ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_blocks_grow_while_they_are_short_and_shrink_at_once() {
        let mut pace = Pace::new(2);
        let least = 2 * MOST_LANES as u64;
        assert_eq!(pace.size(), least);
        for _ in 0..20 {
            pace = pace.next(Duration::from_micros(10));
        }
        assert_eq!(pace.size(), MOST);
        // A slower point: twenty times as long as it should be, then four hundred times.
        assert_eq!(pace.next(Duration::from_secs(3)).size(), 102);
        assert_eq!(pace.next(Duration::from_secs(60)).size(), least);
        assert_eq!(Pace::new(64).next(Duration::from_secs(9)).size(), 64 * MOST_LANES as u64);
    }
}
