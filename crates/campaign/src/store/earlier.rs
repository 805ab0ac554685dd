//! Rows of an earlier run with fewer trials, so that only the rest of a longer one is computed.
//!
//! ```text
//!   earlier run, 8,000 trials a point:  0 … 7999 │ 0 … 7999
//!   this run,    9,000 trials a point:  0 … 7999, 8000 … 8999 │ 0 … 7999, 8000 … 8999
//! ```

use std::iter::Peekable;
use std::path::Path;

use super::journal::{JournalError, Rows};
use super::row::Row;

/// Rows with their points, in the order of a run.
type Source = Box<dyn Iterator<Item = (usize, Row)> + Send>;

/// Rows of earlier runs; rows that none of them has are computed.
#[derive(Default)]
pub struct Earlier {
    sources: Vec<Peekable<Source>>,
    taken: u64,
}

impl Earlier {
    /// Adds the rows of a run, in its order; gaps may be.
    pub fn add(&mut self, rows: impl Iterator<Item = (usize, Row)> + Send + 'static) {
        let rows: Source = Box::new(rows);
        self.sources.push(rows.peekable());
    }

    /// Adds the rows of a journal, up to its last whole block.
    ///
    /// # Errors
    /// A journal that cannot be read.
    pub fn add_journal(&mut self, path: &Path) -> Result<(), JournalError> {
        let mut rows = Rows::open(path)?;
        // What cannot be read any further is computed again.
        self.add(std::iter::from_fn(move || rows.block().ok().flatten()).flatten());
        Ok(())
    }

    /// Returns the row of this point and trial, if one of them has it. Rows must be asked for in order.
    pub(super) fn row(&mut self, place: (usize, u64)) -> Option<Row> {
        for source in &mut self.sources {
            while source.next_if(|(point, row)| (*point, row.trial) < place).is_some() {}
            if let Some((_, row)) = source.next_if(|(point, row)| (*point, row.trial) == place) {
                self.taken += 1;
                return Some(row);
            }
        }
        None
    }

    /// Returns the number of rows taken from earlier runs.
    pub fn taken(&self) -> u64 {
        self.taken
    }
}
