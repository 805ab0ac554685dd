//! `standstill merge`: the shards of a run put together, as the whole run would have written it.

use standstill_campaign::store::Shards;

use super::run::results::{self, Results};
use crate::Report;
use crate::arguments::Merge;
use crate::error::Error;
use crate::interrupt::{self, INTERRUPTED};

pub fn run(options: &Merge) -> Result<Report, Error> {
    let stop = interrupt::flag();
    let shards = Shards::collect(&options.shards)?;
    results::guard(&options.results, &shards.identity().whole(), true)?;
    match Results::write(&options.results, &shards, &stop)? {
        Some(results) => Ok(results.report(&options.results)),
        None => Ok(Report {
            text: "Interrupted: nothing was written; the shards are as they were.\n".to_owned(),
            code: INTERRUPTED,
        }),
    }
}
