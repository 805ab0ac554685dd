//! The errors of commands, in one line each.

use std::path::{Path, PathBuf};

use standstill_analysis::paper::PaperError;
use standstill_analysis::witness::WitnessError;
use standstill_analysis::{BoundError, SuitabilityError};
use standstill_campaign::CampaignError;
use standstill_campaign::store::{JournalError, ShardsError, SweepError};
use standstill_detect::SettingsError;
use standstill_files::remedy;
use standstill_fit::FitError;
use standstill_fit::record::RecordError;
#[cfg(feature = "program")]
use standstill_lab::ServerError;
use standstill_plant::{MapError, MotorError, NoConvergence, TemperatureError, built_in_names};
use standstill_report::figure::FigureError;
use standstill_report::page::PageError;
use standstill_scenario::{FileError, quoted};
use standstill_table::TableError;

#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A mistake in the command line, with the parser's explanation.
    #[error("{0}")]
    Arguments(String),
    #[error(
        "unknown motor {}: neither built in ({}) nor the path of a data sheet (.toml)",
        quoted(.0, built_in_names()), built_in_names().collect::<Vec<_>>().join(", ")
    )]
    UnknownMotor(String),
    #[error(transparent)]
    Motor(MotorError),
    #[error("cannot read {0}: {1}")]
    Read(PathBuf, std::io::Error),
    /// A file exists in place of a folder, or a folder in place of a file.
    #[error("{path} is {is}, but must be {needed}")]
    InTheWay { path: PathBuf, is: &'static str, needed: &'static str },
    #[error("cannot write {0}: {1}{remedy}", remedy = remedy(.1))]
    Write(PathBuf, std::io::Error),
    #[error(transparent)]
    Campaign(#[from] CampaignError),
    #[error("no Cramér–Rao limit: {0}")]
    Bound(#[from] BoundError),
    #[error("cannot draw: {0}")]
    Figure(#[from] FigureError),
    #[error(transparent)]
    Record(RecordError),
    #[error("a statement of the paper: {0}")]
    Paper(PaperError),
    #[error("no witness: {0}")]
    Witness(WitnessError),
    #[error("no motor fits these traces: {0}")]
    Fit(FitError),
    #[error("the core has no such state: {0}")]
    Magnetics(NoConvergence),
    #[error(transparent)]
    Temperature(#[from] TemperatureError),
    #[error(transparent)]
    Map(MapError),
    #[error(transparent)]
    Scenario(#[from] FileError),
    #[error(transparent)]
    Journal(#[from] JournalError),
    #[error(transparent)]
    Sweep(#[from] SweepError),
    #[error(transparent)]
    Suitability(#[from] SuitabilityError),
    #[error("{0}")]
    Threads(String),
    #[error(transparent)]
    Shards(#[from] ShardsError),
    #[error(transparent)]
    Table(TableError),
    #[error("cannot write the page: {0}")]
    Page(PageError),
    #[cfg(feature = "program")]
    #[error(transparent)]
    Lab(ServerError),
    /// The results exist already or belong to another run.
    #[error("{path}: found {found}, needed {needed}")]
    Results { path: PathBuf, found: String, needed: String },
    /// The results at this path belong to another run or question and are not replaced. `of` is "run" or "question".
    #[error(
        "{path}: found the results of another {of}: {difference}, needed another --out, or --force to replace them"
    )]
    Another { path: PathBuf, of: String, difference: String },
}

impl Error {
    /// Returns a function for `map_err` that adds `path` to a write error.
    pub fn writing(path: &Path) -> impl FnOnce(std::io::Error) -> Self + use<> {
        let path = path.to_owned();
        move |error| Self::Write(path, error)
    }

    /// Returns the error of a file or folder: `found` describes the present content, and `needed` the content that the command needs.
    pub fn results(path: impl Into<PathBuf>, found: impl Into<String>, needed: impl Into<String>) -> Self {
        Self::Results { path: path.into(), found: found.into(), needed: needed.into() }
    }

    /// Returns the error that the results at a path belong to another run or question and are not replaced. `of` is "run" or "question",
    /// and `difference` describes the differences.
    pub fn another(of: &str, path: impl Into<PathBuf>, difference: &str) -> Self {
        Self::Another { path: path.into(), of: of.to_owned(), difference: difference.to_owned() }
    }

    /// Returns the error that an unfinished run or question has left a journal at `path`, which the command does not
    /// overwrite.
    pub fn unfinished(path: impl Into<PathBuf>, found: &str) -> Self {
        Self::results(path, found, "--resume to go on with it, another --out, or --force to throw it away")
    }

    /// Converts the error of a table that cannot be written. The message names `path` if the operating system caused the error.
    pub fn table(path: &Path, error: TableError) -> Self {
        match error {
            TableError::Write(error) => Self::Write(path.to_owned(), error),
            error => Self::Table(error),
        }
    }
}

impl From<SettingsError> for Error {
    fn from(error: SettingsError) -> Self {
        Self::Campaign(CampaignError::Settings(error))
    }
}
