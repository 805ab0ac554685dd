//! Results that survive: a journal while a campaign runs, files when it is done.
//!
//! ```text
//!   trials in order ─► journal (blocks with a checksum) ─► trials.csv or trials.parquet, summary.json
//!                        │ killed, resumed: cut off after the last whole block
//! ```
//! The files are made from the journal alone. So they are the same however often the run was interrupted, and those of
//! shards that were merged are those of a single run.

mod journal;
mod row;
mod sweep;

pub use journal::{Identity, Journal, JournalError, Rows, Shard};
pub use row::Row;
pub use sweep::{Sweep, SweepError};
