//! Options of the commands that run scenario files.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use standstill_analysis::Event;
use standstill_analysis::faults::Begins;
use standstill_analysis::limit::{Limits, Measure, Subject};
use standstill_analysis::subset::Effort;
use standstill_campaign::store::Shard;
use standstill_detect::MethodName;
use standstill_scenario::FaultMode;
use standstill_table::Format;

use super::scenario::{Axes, Keys, Seed, Source, assignment};
use super::values::{Force, MOST_ROWS, Mode, OUT, choice, trial, whole};
use crate::error::Error;

/// Largest number of trials at each sweep point of a run that keeps only statistics. Even with the largest number of sweep points, the
/// total number of trials fits into 64 bits.
const MOST_TRIALS: u64 = 100_000_000_000;

/// Largest number of trials at each value of a key in `require`, and of each failure mode in `faults`.
pub const MOST_AT_A_VALUE: u64 = 100_000_000;

/// Number and selection of trials.
#[derive(Debug, Args)]
pub struct Amount {
    /// Trials at each point [default: the scenario's]
    #[arg(long, value_parser = whole::<u64>(1..=MOST_TRIALS), allow_hyphen_values = true)]
    pub trials: Option<u64>,
    #[command(flatten)]
    pub seed: Seed,
    /// End a point when its 95 % interval is this narrow: `rms=2%` (half the interval, of the rms error), or
    /// `wrong_poles=0.01%` (half the interval of their probability); several must all hold
    #[arg(long, value_name = "WHAT=SHARE", value_parser = assignment)]
    pub stop_at: Vec<(String, String)>,
}

#[derive(Debug, Args)]
pub struct Run {
    /// Scenario file (.toml); `standstill init` writes one
    pub scenario: PathBuf,
    #[command(flatten)]
    pub keys: Keys,
    #[command(flatten)]
    pub amount: Amount,
    #[command(flatten)]
    pub results: Results,
    /// Rows to keep: `all`, one of each trial, or `none`, only statistics, for runs of a billion trials
    #[arg(long, value_enum, default_value_t = Rows::All)]
    pub rows: Rows,
    /// Go on with a run that was interrupted, or one that had fewer --trials; from the start if there is none
    #[arg(long)]
    pub resume: bool,
    /// Only this part of the trials, such as 3/8; `standstill merge` puts the parts together
    #[arg(long, value_name = "I/N", value_parser = shard, default_value = "1/1", hide_default_value = true)]
    pub shard: Shard,
    /// Number of worker threads [default: one per core]; the results do not depend on it
    #[arg(long, value_parser = whole::<u16>(1..=1024))]
    pub threads: Option<u16>,
    /// Run a library in processes of its own: a crash, an exit or a call longer than detector.call_timeout costs that trial alone
    #[arg(long)]
    pub isolate: bool,
}

/// Folder and format of the results.
#[derive(Debug, Args)]
pub struct Results {
    /// Folder for the files, created if it does not exist
    #[arg(long, value_name = "DIR", default_value = OUT)]
    pub out: PathBuf,
    /// Format of the trials' file; `npz`: a NumPy archive, `mat`: a MATLAB file
    #[arg(long, value_parser = choice::<Format>(), default_value = "csv")]
    pub format: Format,
    /// Replace the results of another run in that folder. Without it they stay: the default folder gets a number, and a folder of --out is refused
    #[arg(long)]
    pub force: bool,
    /// Print the content of summary.json instead of text
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct Lab {
    /// A scenario file (.toml), or a folder with scenarios and runs; the page reads no file outside the folder [without:
    /// the default scenario and no files]
    #[arg(value_name = "SCENARIO | FOLDER")]
    pub place: Option<PathBuf>,
    #[command(flatten)]
    pub keys: Keys,
    /// Port of 127.0.0.1 [default: any that is free]
    #[arg(long, value_name = "N", value_parser = whole::<u16>(1..=65_535), allow_hyphen_values = true)]
    pub port: Option<u16>,
    /// Only print the address
    #[arg(long)]
    pub no_browser: bool,
}

#[derive(Debug, Args)]
pub struct Sweep {
    #[command(flatten)]
    pub run: Run,
    #[command(flatten)]
    pub axes: Axes,
}

/// Options of the commands that answer one question of a scenario.
#[derive(Debug, Args)]
pub struct Question {
    /// Scenario file (.toml) without axes; `standstill init` writes one
    pub scenario: PathBuf,
    #[command(flatten)]
    pub keys: Keys,
    #[command(flatten)]
    pub seed: Seed,
    /// Folder for table, figure and page, created if it does not exist [default: standstill-out/SCENARIO-COMMAND; with --json
    /// none]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Go on with a question of this scenario that was interrupted; from the start if there is none
    #[arg(long)]
    pub resume: bool,
    /// Replace the answer to another question in that folder; without --resume also the intermediate results of an interrupted
    /// one
    #[arg(long)]
    pub force: bool,
    /// Print JSON; files are written only with --out
    #[arg(long)]
    pub json: bool,
    /// Number of worker threads [default: one per core]; the results do not depend on it
    #[arg(long, value_parser = whole::<u16>(1..=1024))]
    pub threads: Option<u16>,
}

#[derive(Debug, Args)]
pub struct Odds {
    #[command(flatten)]
    pub question: Question,
    /// The event: wrong-pole, wrong-evidence (readings in favour of the wrong pole, enough or not), undetermined,
    /// failed, `|e| > 3 deg` (the axis is off by more; of all starts), `moved > 1 deg`, `peak_current > 8 A`
    #[arg(long, value_name = "EVENT")]
    pub event: Event,
    /// quick, normal or high: 1,000, 4,000 or 16,000 states of a level, and levels down to 1e-9, 1e-12 or 1e-15. Each step costs four
    /// times the trials and halves the interval; quick loses parts of the event that lie at other angles sooner
    #[arg(long, value_name = "EFFORT", default_value = "normal", value_parser = choice::<Effort>())]
    pub effort: Effort,
}

#[derive(Debug, Args)]
pub struct Faults {
    #[command(flatten)]
    pub question: Question,
    /// Failure mode, such as phase-open; repeat it for several [default: all that the drive can have]
    #[arg(long, value_name = "MODE", value_parser = Mode)]
    pub mode: Vec<FaultMode>,
    /// When faults begin; repeat it for several [default: each that a mode can]
    #[arg(long, value_name = "WHEN", value_parser = choice::<Begins>())]
    pub begins: Vec<Begins>,
    /// Also study each pair of modes at once
    #[arg(long)]
    pub pairs: bool,
    /// Method; repeat it for several [default: the scenario's]
    #[arg(long, value_name = "METHOD", value_parser = choice::<MethodName>())]
    pub method: Vec<MethodName>,
    /// TOML file with the failure rate of each mode, such as `phase-open = 20`, all in one unit: the weights with which outcomes are added up
    #[arg(long, value_name = "FILE")]
    pub rates: Option<PathBuf>,
    /// Trials of each mode with each method [default: 3000]
    #[arg(long, value_parser = whole::<u64>(1..=MOST_AT_A_VALUE), allow_hyphen_values = true)]
    pub trials: Option<u64>,
}

#[derive(Debug, Args)]
pub struct Qualify {
    #[command(flatten)]
    pub question: Question,
    /// File of requirements (.toml), each a table [[requirement]] with `id`, `text` and `limit`, such as `P(wrong_pole) <= 1e-6`
    pub requirements: PathBuf,
    /// Judge only the requirement of this id, as it is judged in the whole list; repeat it for several
    #[arg(long, value_name = "ID")]
    pub only: Vec<String>,
    /// Leave out the witnesses of this machine, which take some seconds
    #[arg(long)]
    pub no_witness: bool,
}

#[derive(Debug, Args)]
pub struct Witness {
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct Budget {
    #[command(flatten)]
    pub question: Question,
    /// Pairs of samples; the trials are 2 + 3 times the number of sources as many [default: 8000]
    #[arg(long, value_name = "N", value_parser = whole::<u32>(100..=10_000_000))]
    pub pairs: Option<u32>,
}

#[derive(Debug, Args)]
pub struct Require {
    #[command(flatten)]
    pub question: Question,
    /// The key whose largest or smallest value is searched, such as `sensors.noise`; two for their trade-off curve
    #[arg(long, value_name = "KEY", required = true)]
    pub key: Vec<String>,
    /// Limits that must hold, such as `rms <= 1 deg, unanswered <= 0.1 %`: rms, p95, p99, p95_at_instant (at the instant for which
    /// the angle holds), P(|e| > X) (the angle is off by more, of all starts), wrong_poles, unanswered, moved, duration, peak_current.
    /// Starts without an answer count against each
    #[arg(long, value_name = "LIMITS")]
    pub limit: Limits,
    /// Range of the search, such as `1 mA:50 mA`; of two keys once for each [default: 30 times the scenario's value either way]
    #[arg(long, value_name = "FROM:TO", allow_hyphen_values = true)]
    pub between: Vec<String>,
    /// Trials at one value at most [default: 300000]
    #[arg(long, value_name = "N", value_parser = whole::<u32>(100..=MOST_AT_A_VALUE))]
    pub most: Option<u32>,
}

#[derive(Debug, Args)]
pub struct Tune {
    #[command(flatten)]
    pub question: Question,
    /// A key to be tuned, and its range, such as `detector.pulse=50us:400us` or `detector.rounds=1:12`; any number of
    /// times
    #[arg(long, value_name = "KEY=LOW:HIGH", value_parser = assignment, required = true)]
    pub vary: Vec<(String, String)>,
    /// The measure to minimise: rms, p95, p99, p95_at_instant, P(|e| > X), wrong_poles, unanswered, moved, duration, peak_current
    #[arg(long, value_name = "MEASURE")]
    pub minimise: Measure,
    /// Limits that must hold, such as `moved <= 0.1 deg, unanswered <= 0.1 %`; `duration <= start`: no more than with the scenario's own
    /// settings. Starts without an answer count against each
    #[arg(long, value_name = "LIMITS")]
    pub subject_to: Option<Subject>,
    /// Second measure, against which the figure shows the first [default: duration, or rms if duration is minimised]
    #[arg(long, value_name = "MEASURE")]
    pub against: Option<Measure>,
    /// Trials at the last settings; those before have fewer [default: 20000, more where a limit needs it]
    #[arg(long, value_name = "N", value_parser = whole::<u32>(1_000..=100_000_000))]
    pub trials: Option<u32>,
    /// Number of starting points of the search, one of them the scenario's own settings [default: 6]
    #[arg(long, value_name = "N", value_parser = whole::<u16>(1..=1000))]
    pub starts: Option<u16>,
}

#[derive(Debug, Args)]
pub struct Explain {
    /// Folder of the run, with summary.json and the trials
    pub folder: PathBuf,
    /// This trial, by its number in the trials' file
    #[arg(long, value_name = "N", value_parser = trial(), conflicts_with_all = ["worst", "wrong_poles", "unanswered"])]
    pub trial: Option<u64>,
    /// The K trials with the largest axis errors, those without an axis before, by their numbers [default: 1]
    #[arg(long, value_name = "K", value_parser = whole::<u16>(1..=100))]
    pub worst: Option<u16>,
    /// Trials that named the wrong pole, those with the largest axis errors first; up to 10, or up to --worst K
    #[arg(long)]
    pub wrong_poles: bool,
    /// Trials without an answer, by their numbers; up to 10, or up to --worst K
    #[arg(long, conflicts_with = "wrong_poles")]
    pub unanswered: bool,
    /// Only of this point of the axes, from 0 as in summary.json [default: of all; of --trial the first]
    #[arg(long, value_name = "P", value_parser = whole::<usize>(0..=u64::MAX))]
    pub point: Option<usize>,
    /// Folder to which paths in the scenario, such as a motor's data sheet, are relative [default: this folder]
    #[arg(long, value_name = "DIR")]
    pub files: Option<PathBuf>,
    /// Folder for table, figures and page, created if it does not exist [default: one of these trials' own in `explain` in the run's folder; with --json none]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub force: Force,
    /// Print JSON; files are written only with --out
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct Merge {
    /// Folders with the shards' journals
    #[arg(required = true, value_name = "SHARDS")]
    pub shards: Vec<PathBuf>,
    #[command(flatten)]
    pub results: Results,
}

#[derive(Debug, Args)]
pub struct Report {
    /// Folder of the run, with summary.json and the trials
    pub folder: PathBuf,
    /// Folder of a second run, which is compared with the first: trial by trial where they share the seed
    pub second: Option<PathBuf>,
    /// Folder for the files, created if it does not exist [default: `report` in the first run's folder; with --json none]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub force: Force,
    /// Print JSON; files are written only with --out
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct Init {
    /// The file to write
    #[arg(default_value = "scenario.toml")]
    pub file: PathBuf,
    /// Write a motor's data sheet to this file (.toml) instead, to be filled in from its nameplate
    #[arg(long, value_name = "FILE", conflicts_with = "file")]
    pub motor: Option<PathBuf>,
    /// Take the data sheet's numbers from a motor configuration that VESC Tool saved as XML
    #[arg(long, value_name = "XML", requires = "motor")]
    pub vesc: Option<PathBuf>,
    /// Write a data sheet that names this flux map (.csv, .npz, .mat), to be filled in with what a map does not tell
    #[arg(long, value_name = "FILE", requires = "motor", conflicts_with = "vesc")]
    pub map: Option<PathBuf>,
}

#[cfg(feature = "program")]
#[derive(Debug, Args)]
pub struct Completions {
    /// The shell
    #[arg(value_enum)]
    pub shell: clap_complete::Shell,
}

#[derive(Debug, Args)]
pub struct Man {
    /// Folder for the pages, created if it does not exist
    #[arg(long, value_name = "DIR", default_value = "standstill-out/man")]
    pub out: PathBuf,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Rows {
    /// A row of each trial
    All,
    /// Only statistics
    None,
}

#[derive(Debug, Args)]
pub struct Status {
    /// Folders with the shards' journals
    #[arg(required = true, value_name = "FOLDER")]
    pub folders: Vec<PathBuf>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct Bounds {
    #[command(flatten)]
    pub source: Source,
    /// Number of rotor angles, evenly spread, at which the limit is computed; one that shares no factor with six covers more cases
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = whole::<u16>(1..=3600))]
    pub angles: u16,
    #[command(flatten)]
    pub seed: Seed,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Number of worker threads [default: one per core]; the results do not depend on it
    #[arg(long, value_parser = whole::<u16>(1..=1024))]
    pub threads: Option<u16>,
}

impl Amount {
    /// Refuses a run that keeps the rows of more trials than is allowed.
    pub fn check(&self, rows: Rows) -> Result<(), Error> {
        match self.trials {
            Some(trials) if rows == Rows::All && trials > MOST_ROWS => Err(Error::Arguments(format!(
                "--trials {trials}: needed at most {MOST_ROWS} with a row of each; with `--rows none`, which keeps statistics alone, at most {MOST_TRIALS}"
            ))),
            _ => Ok(()),
        }
    }
}

fn shard(text: &str) -> Result<Shard, String> {
    let parts =
        text.split_once('/').and_then(|(index, count)| Some((index.parse().ok()?, count.parse().ok()?)));
    match parts {
        Some((index, count)) if (1..=count).contains(&index) && count <= 1_000_000 => {
            Ok(Shard { index, count })
        }
        _ => Err("not I/N with I from 1 to N and N up to 1000000, such as 3/8".to_owned()),
    }
}
