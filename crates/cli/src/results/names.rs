//! Names of the files of a run.

use standstill_table::Format;

/// Name of the file with the summaries.
pub const SUMMARY: &str = "summary.json";

/// Name of the file from which a run without rows can be extended.
pub const STATISTICS: &str = "run.statistics";

/// Returns the name of the file of trials.
pub const fn trials_name(format: Format) -> &'static str {
    match format {
        Format::Csv => "trials.csv",
        Format::Parquet => "trials.parquet",
        Format::Npz => "trials.npz",
        Format::Mat => "trials.mat",
    }
}
