//! Results that survive: a journal while a campaign runs, files when it is done.
//!
//! ```text
//!   trials in order ─► journal (blocks with a checksum) ─► trials.csv or trials.parquet, summary.json
//!                        │ killed, resumed: cut off after the last whole block
//! ```
//! The files are made from the journal alone. So they are the same however often the run was interrupted, and those of
//! shards that were merged are those of a single run.

mod identity;
mod journal;
mod row;
mod shards;
mod sweep;
mod walk;

pub use identity::{Identity, Shard};
pub use journal::{Journal, JournalError, Rows};
pub use row::Row;
pub use shards::{Shards, ShardsError};
pub use sweep::{Sweep, SweepError};
pub use walk::Walk;

#[cfg(test)]
pub(crate) use walk::tests::row as test_row;
