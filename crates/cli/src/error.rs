//! What can go wrong, in one line each.

use std::fmt;
use std::path::{Path, PathBuf};

use standstill_analysis::fit::FitError;
use standstill_analysis::fit::record::RecordError;
use standstill_analysis::{BoundError, SuitabilityError};
use standstill_campaign::CampaignError;
use standstill_campaign::store::{JournalError, ShardsError, SweepError};
use standstill_detect::SettingsError;
#[cfg(feature = "program")]
use standstill_lab::ServerError;
use standstill_plant::{MapError, MotorError, NoConvergence, TemperatureError, built_in_names};
use standstill_report::figure::FigureError;
use standstill_report::page::PageError;
use standstill_scenario::{FileError, quoted};
use standstill_table::TableError;

#[derive(Debug)]
pub enum Error {
    /// The command line, as explained by its parser.
    Arguments(String),
    UnknownMotor(String),
    Motor(MotorError),
    Read(PathBuf, std::io::Error),
    /// A file where a folder must be, or a folder where a file must be.
    InTheWay {
        path: PathBuf,
        is: &'static str,
        needed: &'static str,
    },
    Write(PathBuf, std::io::Error),
    Campaign(CampaignError),
    Bound(BoundError),
    Figure(FigureError),
    Record(RecordError),
    Fit(FitError),
    Magnetics(NoConvergence),
    Temperature(TemperatureError),
    Map(MapError),
    Scenario(FileError),
    Journal(JournalError),
    Threads(String),
    Shards(ShardsError),
    Table(TableError),
    Page(PageError),
    #[cfg(feature = "program")]
    Lab(ServerError),
    /// Results that are already there, or that are of another run.
    Results {
        path: PathBuf,
        found: String,
        needed: String,
    },
}

impl Error {
    /// For `map_err` on writing to `path`.
    pub fn writing(path: &Path) -> impl FnOnce(std::io::Error) -> Self + use<> {
        let path = path.to_owned();
        move |error| Self::Write(path, error)
    }

    /// Results that are not replaced.
    pub fn another_run(path: PathBuf, difference: &str) -> Self {
        Self::Results {
            path,
            found: format!("the results of another run: {difference}"),
            needed: "another --out, or --force to replace them".to_owned(),
        }
    }

    /// A table that cannot be written; where the operating system refuses, the message names `path`.
    pub fn table(path: &Path, error: TableError) -> Self {
        match error {
            TableError::Write(error) => Self::Write(path.to_owned(), error),
            error => Self::Table(error),
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Arguments(message) => f.write_str(message),
            Self::UnknownMotor(name) => {
                let known = built_in_names().collect::<Vec<_>>().join(", ");
                write!(
                    f,
                    "unknown motor {}: neither built in ({known}) nor the path of a data sheet (.toml)",
                    quoted(name, built_in_names())
                )
            }
            Self::Motor(error) => error.fmt(f),
            Self::Read(path, error) => write!(f, "cannot read {}: {error}", path.display()),
            Self::InTheWay { path, is, needed } => {
                write!(f, "{} is {is}, but must be {needed}", path.display())
            }
            Self::Write(path, error) => write!(f, "cannot write {}: {error}", path.display()),
            Self::Campaign(error) => error.fmt(f),
            Self::Bound(error) => write!(f, "no Cramér–Rao limit: {error}"),
            Self::Temperature(error) => error.fmt(f),
            Self::Map(error) => error.fmt(f),
            Self::Scenario(error) => error.fmt(f),
            Self::Journal(error) => error.fmt(f),
            Self::Threads(error) => f.write_str(error),
            Self::Shards(error) => error.fmt(f),
            Self::Table(error) => error.fmt(f),
            Self::Page(error) => write!(f, "cannot write the page: {error}"),
            #[cfg(feature = "program")]
            Self::Lab(error) => error.fmt(f),
            Self::Results { path, found, needed } => {
                write!(f, "{}: found {found}, needed {needed}", path.display())
            }
            Self::Magnetics(error) => write!(f, "the core has no such state: {error}"),
            Self::Figure(error) => write!(f, "cannot draw: {error}"),
            Self::Record(error) => error.fmt(f),
            Self::Fit(error) => write!(f, "no motor fits these traces: {error}"),
        }
    }
}

/// Errors that are a kind of [`Error`] as they are.
macro_rules! from {
    ($($error:ty => $kind:ident),+) => {
        $(impl From<$error> for Error {
            fn from(error: $error) -> Self {
                Self::$kind(error)
            }
        })+
    };
}

from!(FileError => Scenario, JournalError => Journal, ShardsError => Shards, CampaignError => Campaign, BoundError => Bound, TemperatureError => Temperature, FigureError => Figure);

impl From<SweepError> for Error {
    fn from(error: SweepError) -> Self {
        match error {
            SweepError::File(error) => Self::Scenario(error),
            SweepError::Journal(error) => Self::Journal(error),
            SweepError::Threads(_) => Self::Threads(error.to_string()),
        }
    }
}

impl From<SuitabilityError> for Error {
    fn from(error: SuitabilityError) -> Self {
        match error {
            SuitabilityError::File(error) => Self::Scenario(error),
            SuitabilityError::Campaign(error) => Self::Campaign(error),
            SuitabilityError::Bound(error) => Self::Bound(error),
        }
    }
}

impl From<SettingsError> for Error {
    fn from(error: SettingsError) -> Self {
        Self::Campaign(CampaignError::Settings(error))
    }
}
