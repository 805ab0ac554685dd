//! `standstill merge`: merges the shards of a run into the files of the whole run.

use standstill_campaign::store::Shards;

use super::run::results::Results;
use crate::arguments::Merge;
use crate::error::Error;
use crate::results::{Begun, files_wanted, guard};
use crate::shell::Report;
use crate::shell::interrupt::{self, INTERRUPTED};

pub fn run(options: &Merge) -> Result<Report, Error> {
    let stop = interrupt::flag();
    let shards = Shards::collect(&options.shards)?;
    guard(&options.results, &shards.identity.whole(), true)?;
    match Results::write(&options.results, &shards, &stop)? {
        Some(results) => {
            // All shards have the scenario of the whole run, so the note of any shard serves.
            let out = &options.results.out;
            match options.shards.iter().find_map(|folder| Begun::of(folder)).filter(|_| files_wanted()) {
                Some(begun) => begun.note(out)?,
                None => Begun::forget(out),
            }
            Ok(results.report(&options.results, None))
        }
        None => Ok(Report {
            text: "Interrupted: nothing was written; the shards are as they were.\n".to_owned(),
            code: INTERRUPTED,
        }),
    }
}
