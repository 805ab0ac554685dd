//! `standstill slurm`: a script that runs the shards of a scenario as a job array, and merges them.

use std::fmt::Write as _;
use std::path::Path;

use standstill_table::Format;

use super::question::given;
use super::run::{document, isolated};
use crate::arguments::{Rows, Seed, Slurm};
use crate::error::Error;
use crate::scenario;
use crate::shell::command_line::{filled, quoted};
use crate::shell::{Report, interrupt, progress};

pub fn run(options: &Slurm) -> Result<Report, Error> {
    interrupt::at_once();
    options.amount.check(options.rows)?;
    let mut document = document(&options.scenario, &options.keys, &options.amount)?;
    scenario::vary(&mut document, &options.axes)?;
    // A mistake in the scenario is reported here, and not by every job on the cluster.
    if options.isolate {
        isolated::plan(&document)?
    } else {
        progress::plan(document)?
    };
    let here = std::env::current_dir().map_err(|error| Error::Read(".".into(), error))?;
    let program = std::env::current_exe().map_err(|error| Error::Read("standstill".into(), error))?;
    Ok(Report { text: script(options, &here, &program), code: 0 })
}

/// Largest number of shards in one job array. Array indices must be below Slurm's `MaxArraySize`, which is 1001 by default.
const BLOCK: u32 = 1000;

/// Quotes a path for a shell.
fn path(path: &Path) -> String {
    quoted(&path.to_string_lossy())
}

/// Returns the command line that all shards have in common: the subcommand (`run` or `sweep`), the scenario, and the options.
fn command(options: &Slurm) -> String {
    let sweep =
        !options.axes.vary.is_empty() || options.axes.design.is_some() || options.axes.points.is_some();
    let scenario = given(&options.scenario.to_string_lossy(), &options.keys, Seed::default());
    let mut words = vec![if sweep { "sweep" } else { "run" }.to_owned(), scenario];
    let pairs = |option: &str, pairs: &[(String, String)]| {
        pairs
            .iter()
            .map(|(key, value)| format!("{option} {}", quoted(&format!("{key}={value}"))))
            .collect::<Vec<_>>()
    };
    words.extend(pairs("--vary", &options.axes.vary));
    words.extend(
        options.axes.design.map(|design| format!("--design {}", standstill_interface::Choice::name(design))),
    );
    words.extend(options.axes.points.map(|points| format!("--points {points}")));
    words.extend(options.amount.trials.map(|trials| format!("--trials {trials}")));
    words.extend(options.amount.seed.seed.map(|seed| format!("--seed {seed}")));
    words.extend(pairs("--stop-at", &options.amount.stop_at));
    words.extend(options.isolate.then(|| "--isolate".to_owned()));
    words.extend((options.rows == Rows::None).then(|| "--rows none".to_owned()));
    words.join(" ")
}

fn script(options: &Slurm, here: &Path, program: &Path) -> String {
    let name = options.scenario.file_stem().unwrap_or_default().to_string_lossy();
    let name: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
    let mut directives = format!("#SBATCH --job-name={name}\n#SBATCH --cpus-per-task={}\n", options.cpus);
    for (option, value) in [("time", &options.time), ("partition", &options.partition)] {
        if let Some(value) = value {
            let _ = writeln!(directives, "#SBATCH --{option}={value}");
        }
    }
    let format = match options.format {
        Format::Csv => String::new(),
        format => format!(" --format {}", format.name()),
    };
    let [out, shards] = [path(&options.out), path(&options.out.join("shards"))];
    let merge_partition =
        options.partition.as_ref().map_or_else(String::new, |name| format!(" --partition={name}"));
    let count = options.shards;
    let values = [
        ("shards_word", if count == 1 { "1 shard".to_owned() } else { format!("{count} shards") }),
        ("scenario", path(&options.scenario)),
        ("shards", shards),
        ("directives", directives),
        ("program", path(program)),
        ("command", command(options)),
        ("cpus", options.cpus.to_string()),
        ("count", count.to_string()),
        ("block", BLOCK.to_string()),
        ("example", (BLOCK + 3).to_string()),
        ("here", path(here)),
        ("merge_partition", merge_partition),
        ("name", name),
        ("out", out),
        ("format", format),
        ("out_plain", options.out.display().to_string()),
    ];
    filled(include_str!("slurm/script.sh"), &values)
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::arguments::{Arguments, Command};

    #[test]
    fn law_the_script_has_all_that_was_asked_for_and_a_shell_understands_it() {
        let words = [
            "standstill",
            "slurm",
            "it's mine.toml",
            "--shards",
            "20",
            "--cpus",
            "4",
            "--time",
            "02:00:00",
            "--partition",
            "short",
            "-s",
            "sensors.noise=20 mA",
            "--vary",
            "errors=default,harsh",
            "--rows",
            "none",
            "--isolate",
            "--out",
            "big out",
        ];
        let Ok(Arguments { command: Command::Slurm(options) }) = Arguments::try_parse_from(words) else {
            panic!("a command line");
        };
        let text = script(&options, Path::new("/home/a b"), Path::new("/opt/standstill"));
        for line in [
            "#SBATCH --cpus-per-task=4\n",
            "#SBATCH --time=02:00:00\n",
            "#SBATCH --partition=short\n",
            "sweep 'it'\\''s mine.toml' -s 'sensors.noise=20 mA' --vary errors=default,harsh --isolate --rows none --threads 4 --resume",
            "cd '/home/a b'\n",
            "array=1-20\n",
            "--dependency=\"afterok$jobs\"",
        ] {
            assert!(text.contains(line), "{line}\n{text}");
        }
        // Directives count only before the first command.
        let last = text.rfind("#SBATCH").expect("some");
        assert!(last < text.find("set -eu").expect("there"));
        for bad in ["a b", "x\ny", ""] {
            assert!(
                Arguments::try_parse_from(["standstill", "slurm", "s.toml", "--shards", "2", "--time", bad])
                    .is_err()
            );
        }
    }
}
