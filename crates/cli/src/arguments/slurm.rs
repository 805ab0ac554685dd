//! Options of `standstill slurm`.

use std::path::PathBuf;

use clap::Args;
use standstill_table::Format;

use super::campaigns::{Amount, Rows};
use super::scenario::{Axes, Keys};
use super::values::{OUT, choice, whole};

#[derive(Debug, Args)]
pub struct Slurm {
    /// Scenario file (.toml)
    pub scenario: PathBuf,
    /// Number of shards, which are the tasks of a job array
    #[arg(long, value_name = "N", value_parser = whole::<u32>(1..=1_000_000))]
    pub shards: u32,
    /// Processors of each task, and threads
    #[arg(long, value_name = "C", default_value_t = 1, value_parser = whole::<u16>(1..=1024))]
    pub cpus: u16,
    /// Longest time of a task, as Slurm writes it, such as 02:30:00 [default: the partition's]
    #[arg(long, value_parser = slurm_time)]
    pub time: Option<String>,
    /// Partition, which is a queue [default: the cluster's]
    #[arg(long, value_parser = directive)]
    pub partition: Option<String>,
    #[command(flatten)]
    pub keys: Keys,
    #[command(flatten)]
    pub axes: Axes,
    #[command(flatten)]
    pub amount: Amount,
    /// Rows of trials to keep
    #[arg(long, value_enum, default_value_t = Rows::All)]
    pub rows: Rows,
    /// Run a library in processes of its own: a crash, an exit or a call longer than detector.call_timeout costs that trial alone
    #[arg(long)]
    pub isolate: bool,
    /// Folder for the results; journals and logs go to `shards` in it
    #[arg(long, value_name = "DIR", default_value = OUT)]
    pub out: PathBuf,
    /// Format of the trials' file; `npz`: a NumPy archive, `mat`: a MATLAB file
    #[arg(long, value_parser = choice::<Format>(), default_value = "csv")]
    pub format: Format,
}

/// Checks a time limit in Slurm's syntax.
fn slurm_time(text: &str) -> Result<String, String> {
    let (days, clock) = text.split_once('-').map_or((None, text), |(days, clock)| (Some(days), clock));
    let parts: Vec<&str> = clock.split(':').collect();
    let number = |part: &str| !part.is_empty() && part.len() <= 6 && part.bytes().all(|c| c.is_ascii_digit());
    if days.is_none_or(number) && parts.len() <= 3 && parts.into_iter().all(number) {
        return Ok(text.to_owned());
    }
    Err("not a time as Slurm takes it: minutes, minutes:seconds, hours:minutes:seconds, days-hours, days-hours:minutes or days-hours:minutes:seconds".to_owned())
}

/// Checks that a word contains only characters that are safe in a Slurm directive.
fn directive(text: &str) -> Result<String, String> {
    let fits = |c: char| c.is_ascii_alphanumeric() || "-_.:,".contains(c);
    match text {
        "" => Err("empty".to_owned()),
        text if text.chars().all(fits) => Ok(text.to_owned()),
        _ => Err("not one word of letters, digits and -_.:,".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_times_are_as_slurm_takes_them() {
        for time in ["0", "30", "30:10", "02:30:00", "1-2", "1-02:30", "1-02:30:10"] {
            assert_eq!(slurm_time(time), Ok(time.to_owned()));
        }
        for time in ["", "abc", "1-", "-1", "1:", ":30", "1:2:3:4", "1-2:3:4:5", "1-2-3", "+1", "1.5", "1 2"]
        {
            assert!(slurm_time(time).is_err(), "{time}");
        }
    }
}
