//! The results of a run in its folder: the content of `summary.json`, the tables beside it, and pages that have become
//! outdated.

mod begun;
mod folder;
mod intact;
mod names;
mod stale;
mod summary;
mod tables;

use standstill_campaign::store::Identity;

pub use self::begun::Begun;
pub use self::folder::{FinishedRun, rows, say_extension};
pub use self::names::{STATISTICS, SUMMARY, trials_name};
pub use self::stale::mark;
pub use self::summary::{PointSummary, SummaryFile};
pub use self::tables::Tables;
use crate::arguments::Results as Options;
use crate::error::Error;
use crate::shell::host;

/// Refuses to replace the results of another run or other files, unless `--force` is given. The same run may be repeated, because it writes
/// the same results. If the run `extends` earlier results, it may replace them, because the new results contain all earlier trials.
///
/// # Errors
/// The summary belongs to another run, or the file is not a summary.
pub fn guard(options: &Options, identity: &Identity, extends: bool) -> Result<(), Error> {
    let path = options.out.join(SUMMARY);
    if options.force || !files_wanted() || !path.exists() {
        return Ok(());
    }
    match SummaryFile::read(&options.out) {
        Ok(summary) if extends && summary.run.begins(identity) => Ok(()),
        Ok(summary) => summary
            .run
            .difference(identity)
            .map_or(Ok(()), |difference| Err(Error::another("run", path, &difference))),
        Err(changed) if intact::is_changed_file(&path) => Err(changed),
        Err(_) => Err(Error::another("run", path, "this file is not of `standstill run`")),
    }
}

/// Returns true if results are written into files. A host program may request the results only in memory.
pub fn files_wanted() -> bool {
    host::current().is_none_or(|host| host.files)
}
