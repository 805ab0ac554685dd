//! Options of the commands that run scenario files.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use standstill_campaign::store::Shard;
use standstill_report::table::Format;

use super::scenario::{Axes, Keys, Seed, assignment};
use super::trials;

#[derive(Debug, Args)]
pub struct Run {
    /// Scenario file (.toml); `standstill init` writes one
    pub scenario: PathBuf,
    #[command(flatten)]
    pub keys: Keys,
    /// Trials at each point [default: the scenario's]
    #[arg(long, value_parser = trials, allow_hyphen_values = true)]
    pub trials: Option<u64>,
    #[command(flatten)]
    pub seed: Seed,
    /// End a point when its 95 % interval is this narrow: `rms=2%` (half the interval, of the rms error), or
    /// `wrong_poles=0.01%` (half the interval of their probability); several must all hold
    #[arg(long, value_name = "WHAT=SHARE", value_parser = assignment)]
    pub stop_at: Vec<(String, String)>,
    #[command(flatten)]
    pub results: Results,
    /// Go on with a run that was interrupted; from the start if there is none
    #[arg(long)]
    pub resume: bool,
    /// Only this part of the trials, such as 3/8; `standstill merge` puts the parts together
    #[arg(long, value_name = "I/N", value_parser = shard, default_value = "1/1", hide_default_value = true)]
    pub shard: Shard,
    /// Worker threads [default: one per core]; the results do not depend on it
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
}

/// Where results go and what they are like.
#[derive(Debug, Args)]
pub struct Results {
    /// Folder for the files; made if it does not exist
    #[arg(long, value_name = "DIR", default_value = "standstill-out/run")]
    pub out: PathBuf,
    /// Format of the trials' file
    #[arg(long, value_enum, default_value_t = FormatName::Csv)]
    pub format: FormatName,
    /// Print the content of summary.json instead of text
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct Sweep {
    #[command(flatten)]
    pub run: Run,
    #[command(flatten)]
    pub axes: Axes,
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
    /// Folder for the files; made if it does not exist [default: `report` in the run's folder]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct Init {
    /// The file to write
    #[arg(default_value = "scenario.toml")]
    pub file: PathBuf,
    /// Write a motor's data sheet to this file (.toml) instead, to be filled in from its nameplate
    #[arg(long, value_name = "FILE", conflicts_with = "file")]
    pub motor: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct Completions {
    /// The shell
    #[arg(value_enum)]
    pub shell: clap_complete::Shell,
}

#[derive(Debug, Args)]
pub struct Man {
    /// Folder for the pages; made if it does not exist
    #[arg(long, value_name = "DIR", default_value = "standstill-out/man")]
    pub out: PathBuf,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FormatName {
    Csv,
    Parquet,
}

impl From<FormatName> for Format {
    fn from(name: FormatName) -> Self {
        match name {
            FormatName::Csv => Self::Csv,
            FormatName::Parquet => Self::Parquet,
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
