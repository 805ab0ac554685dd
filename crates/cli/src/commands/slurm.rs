//! `standstill slurm`: a script that runs the shards of a scenario as a job array, and merges them.

use std::fmt::Write as _;
use std::path::Path;

use standstill_scenario::Plan;
use standstill_table::Format;

use super::question::given;
use super::run::{document, isolated};
use crate::arguments::{Rows, Seed, Slurm};
use crate::error::Error;
use crate::scenario;
use crate::shell::command_line::quoted;
use crate::shell::{Report, interrupt};

pub fn run(options: &Slurm) -> Result<Report, Error> {
    interrupt::at_once();
    options.amount.check(options.rows)?;
    let mut document = document(&options.scenario, &options.keys, &options.amount)?;
    scenario::vary(&mut document, &options.axes)?;
    // What is wrong with it shows here, and not a thousand times on the cluster.
    if options.isolate {
        isolated::plan(&document)?
    } else {
        Plan::new(document)?
    };
    let here = std::env::current_dir().map_err(|error| Error::Read(".".into(), error))?;
    let program = std::env::current_exe().map_err(|error| Error::Read("standstill".into(), error))?;
    Ok(Report { text: script(options, &here, &program), code: 0 })
}

/// Largest number of shards in one job array: Slurm's `MaxArraySize` is 1001 unless a cluster changes it, and indices
/// are below it.
const BLOCK: u32 = 1000;

/// Quotes a path for a shell.
fn path(path: &Path) -> String {
    quoted(&path.to_string_lossy())
}

/// Returns the command line of a task, without its shard.
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
    format!(
        r#"#!/bin/bash
# {shards_word} of {scenario}, and what puts them together when all are done. Submit both with
#   bash THIS-FILE
# and, after `standstill status {shards}` named shards to submit again, with
#   bash THIS-FILE --array=3,7-9
# Other options are handed on to sbatch, for the shards and for what puts them together. Shards go on where they ended; those that are
# done end at once.
{directives}set -eu
standstill={program}
shards={shards}

if [ -n "${{SLURM_ARRAY_TASK_ID:-}}" ]; then
    # Behind the script's name: how many shards are before those of this array.
    shard=$((SLURM_ARRAY_TASK_ID + ${{1:-0}}))
    exec "$standstill" {command} --threads {cpus} --resume --out "$shards" --shard "$shard/{count}"
fi

if ! command -v sbatch >/dev/null; then
    echo "sbatch is not here: run this where jobs are submitted to Slurm" >&2
    exit 2
fi
script=$(realpath "$0")
array=1-{count}
more=()
while [ $# -gt 0 ]; do
    case $1 in
        --array=*) array=${{1#--array=}} ;;
        --array | -a) array=${{2:?"$1: which shards?"}}; shift ;;
        -a*) array=${{1#-a}} ;;
        *) more+=("$1") ;;
    esac
    shift
done
# The numbers of an array are at most {BLOCK} (MaxArraySize of Slurm, unless a cluster sets another): shard {example} is number 3 of the
# array that has {BLOCK} shards before it.
limit=
case $array in *%*) limit=%${{array#*%}}; array=${{array%%%*}} ;; esac
arrays=()
IFS=, read -ra parts <<<"$array"
for part in "${{parts[@]}}"; do
    if ! [[ $part =~ ^([0-9]{{1,7}})(-([0-9]{{1,7}})(:([1-9][0-9]{{0,6}}))?)?$ ]]; then
        echo "--array: found '$part', needed shards such as 3,7-9" >&2
        exit 2
    fi
    from=$((10#${{BASH_REMATCH[1]}})) last=$((10#${{BASH_REMATCH[3]:-$from}})) step=$((10#${{BASH_REMATCH[5]:-1}}))
    if [ "$from" -lt 1 ] || [ "$last" -gt {count} ] || [ "$from" -gt "$last" ]; then
        echo "--array: found '$part', needed shards from 1 to {count}" >&2
        exit 2
    fi
    while [ "$from" -le "$last" ]; do
        of=$(((from - 1) / {BLOCK})) end=$last
        [ "$end" -le $(((of + 1) * {BLOCK})) ] || end=$(((of + 1) * {BLOCK}))
        end=$((from + (end - from) / step * step))
        words=$((from - of * {BLOCK}))
        if [ "$end" -gt "$from" ]; then
            words=$words-$((end - of * {BLOCK}))
            [ "$step" = 1 ] || words=$words:$step
        fi
        arrays[of]=${{arrays[of]:+${{arrays[of]}},}}$words
        from=$((end + step))
    done
done
cd {here}
mkdir -p "$shards"
jobs=
for of in "${{!arrays[@]}}"; do
    job=$(sbatch --parsable --output="$shards/%A_%a.log" --array="${{arrays[of]}}$limit" ${{more[@]+"${{more[@]}}"}} "$script" $((of * {BLOCK})))
    jobs=$jobs:${{job%%;*}}
done
merge=$(sbatch --parsable{merge_partition} ${{more[@]+"${{more[@]}}"}} --job-name={name}-merge --output="$shards/merge.log" \
    --dependency="afterok$jobs" --kill-on-invalid-dep=yes \
    --wrap="exec $(printf '%q ' "$standstill" merge "$shards" --out {out}{format})")
jobs=${{jobs#:}}
echo "submitted: shards as job ${{jobs//:/, }}, and job ${{merge%%;*}} to put them together in {out_plain}"
"#,
        count = options.shards,
        shards_word =
            if options.shards == 1 { "1 shard".to_owned() } else { format!("{} shards", options.shards) },
        scenario = path(&options.scenario),
        program = path(program),
        command = command(options),
        cpus = options.cpus,
        here = path(here),
        out_plain = options.out.display(),
        example = BLOCK + 3,
    )
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
