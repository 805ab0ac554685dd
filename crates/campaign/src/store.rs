//! Results that survive: a journal while a campaign runs, files when it is done.
//!
//! ```text
//!   trials in order ─► journal (blocks with a checksum) ─► trials.csv or trials.parquet, summary.json
//!                        │ killed, resumed: cut off after the last whole block
//! ```
//! The files are made from the journal alone. So they are the same however often the run was interrupted, and those of
//! shards that were merged are those of a single run. A run may keep statistics alone ([`Tally`]), which add up exactly.

mod block;
mod earlier;
mod identity;
mod journal;
mod notes;
mod row;
mod shards;
mod survey;
mod sweep;
mod tally;
mod walk;

pub use earlier::Earlier;
pub use identity::{Identity, Shard, values};
pub use journal::{Journal, JournalError, Keep, Rows};
pub use notes::Notes;
pub use row::Row;
pub use shards::{Shards, ShardsError, beside, head};
pub use survey::{State, Survey, Surveyed};
pub use sweep::{Sweep, SweepError};
pub use tally::{Tallied, Tally};
pub use walk::Walk;

#[cfg(test)]
pub(crate) use walk::tests::row as test_row;
