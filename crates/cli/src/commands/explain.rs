//! `standstill explain`: why trials of a finished run ended as they did.

mod choose;
mod words;

use std::path::Path;

use serde_json::json;
use standstill_analysis::{Cause, Explained, Halt, Trials};
use standstill_campaign::store::{Shard, Sweep};
use standstill_report::figure::Figure;
use standstill_report::page::{Block, Section};
use standstill_scenario::{Document, FileError, Plan, Record as Trial, Single, written};

use self::choose::{Choice, Chosen};
use super::question::setting;
use crate::answer::{Answer, Made, Record};
use crate::arguments::Explain as Options;
use crate::error::Error;
use crate::results::{FinishedRun, say_extension};
use crate::scenario::hosted;
use crate::shell::Report;
use crate::shell::asked::NotedQuestion;
use crate::shell::command_line::{quoted, set, typed};
use crate::shell::interrupt::INTERRUPTED;
use crate::shell::output::Output;
use crate::shell::progress::Watched;
use crate::shell::setup::{self, Setup};

/// A trial that was simulated again, with its waveforms and its *causes*, the effect of each random error of the trial.
struct Repeated {
    chosen: Chosen,
    single: Single,
    explained: Explained,
    figure: Figure,
}

pub fn run(options: &Options) -> Result<Report, Error> {
    let run = FinishedRun::open(&options.folder)?;
    say_extension(&options.folder);
    let plan = plan(&run, options)?;
    let Choice { chosen, lost, name } = choose::choose(&run, options)?;
    // Each selection of trials has its own folder.
    let own = || (!options.json).then(|| options.folder.join("explain").join(name));
    let folder = options.out.clone().or_else(own);
    let trials: Vec<String> = chosen.iter().map(|chosen| chosen.trial.to_string()).collect();
    let said = format!("{} {}", if trials.len() == 1 { "trial" } else { "trials" }, trials.join(", "));
    let asked = NotedQuestion::new("explain", said, &(&run.summary.run, &chosen), options.force.force);
    if let Some(folder) = &folder {
        drop(Output::answering(asked.clone(), folder, &["explain.csv", "explain.json", "explain.html"])?);
    }
    let mut runs = 0;
    for chosen in &chosen {
        runs += Explained::runs(&Trials::at(&plan, chosen.point)?);
    }
    let watched = Watched::new(runs);
    let mut all = Vec::new();
    for chosen in chosen {
        watched.bar.set_message(format!("trial {}", chosen.trial));
        match tell(&plan, chosen, &watched) {
            Ok(one) => all.push(one),
            Err(Halt::Stopped) => {
                let text = "Interrupted; no files were written.\n".to_owned();
                return Ok(Report { text, code: INTERRUPTED });
            }
            Err(Halt::Failed(error)) => return Err(error),
        }
    }
    watched.bar.finish_and_clear();
    let place = options.files.as_deref().unwrap_or_else(|| Path::new("")).join("scenario");
    let varied = run.file.axes.keys().cloned().collect();
    let folder_of_run = quoted(&options.folder.to_string_lossy());
    let command = format!("standstill run scenario.toml --out {folder_of_run}\n{}", typed());
    let (text, files) = (&run.summary.run.scenario, &run.summary.run.files);
    let setup = Setup::of(&place, text, files, varied);
    let made = Made { setup: Some(setup), command, asked: Some(asked), ..Made::default() };
    answer(&run, &plan, &all, lost).report(folder, options.json, &made)
}

/// Returns the plan of the run. Fails if the program or a file has changed since the run, because the trials then cannot be repeated.
fn plan(run: &FinishedRun, options: &Options) -> Result<Plan, Error> {
    let place = options.files.as_deref().unwrap_or_else(|| Path::new("")).join("scenario");
    let recorded = &run.summary.run;
    let plan = Plan::new(hosted(Document::parse(&place, &recorded.scenario)?)?)?;
    let mut now = Sweep { plan: &plan, shard: Shard::WHOLE, threads: None }.identity()?;
    // A number that is written and read again may have other digits for the same value.
    now.scenario.clone_from(&recorded.scenario);
    match recorded.whole().difference(&now) {
        Some(difference) => {
            let found = format!("a run that cannot be repeated: {difference}");
            let needed = "the program that made it, and the files that it read (--files says where they are)";
            Err(Error::results(&run.folder, found, needed))
        }
        None => Ok(plan),
    }
}

/// Repeats a trial and records its waveforms. Then repeats it once for each of its errors, with this error set to its mean.
fn tell(plan: &Plan, chosen: Chosen, watched: &Watched) -> Result<Repeated, Halt<Error>> {
    let failed = |error: FileError| Halt::Failed(Error::from(error));
    let trials = Trials::at(plan, chosen.point).map_err(failed)?;
    let explained =
        Explained::of(&trials, plan.file().seed, chosen.trial, watched).map_err(|halt| match halt {
            Halt::Stopped => Halt::Stopped,
            Halt::Failed(error) => failed(error),
        })?;
    let single = plan.single(chosen.point, chosen.trial).map_err(failed)?;
    let file = plan.file_at(chosen.point).map_err(failed)?;
    let scenario = &single.scenario;
    let watched = scenario.watched(&single.case(), false, f64::INFINITY);
    let (record, _, trace) = watched.map_err(|error| Halt::Failed(error.into()))?;
    let title = format!("trial {}, rotor at {:.2}°", chosen.trial, record.start_angle_deg());
    let figure = super::waveforms(&trace, &title, &setting(&file, scenario), scenario, &record);
    Ok(Repeated { chosen, single, explained, figure })
}

fn record(of: &Repeated, cause: &Cause) -> Record {
    Record::default()
        .with("point", of.chosen.point)
        .with("trial", of.chosen.trial)
        .with("error", &cause.name)
        .with("key", &cause.key)
        .with("drawn_deviations", cause.drawn)
        .with("outcome_without", cause.without.verdict().name())
        .with("error_without_deg", cause.without.error_deg())
        .with("axis_error_without_deg", cause.without.axis_error_deg())
        .estimate("part", "_deg", cause.part_deg)
        .with("within_rounding", cause.within_rounding)
}

fn ended(record: &Trial) -> serde_json::Value {
    json!({
        "outcome": record.verdict().name(),
        "reason": record.reason(),
        "error_deg": record.error_deg(),
        "axis_error_deg": record.axis_error_deg(),
        "pole_correct": record.pole_correct(),
        "age_s": record.findings().age,
    })
}

fn json_of(one: &Repeated) -> serde_json::Value {
    let cause = |cause: &Cause| {
        let part = cause.part_deg;
        json!({
            "error": cause.name,
            "key": cause.key,
            "drawn_deviations": cause.drawn,
            "without": ended(&cause.without),
            "part_deg": part.map(|part| part.value),
            "part_low_deg": part.map(|part| part.low),
            "part_high_deg": part.map(|part| part.high),
            "within_rounding": cause.within_rounding,
        })
    };
    json!({
        "point": one.chosen.point,
        "trial": one.chosen.trial,
        "start_angle_deg": one.explained.record.start_angle_deg(),
        "ended": ended(&one.explained.record),
        "specimen": super::trace::specimen::json(&one.single.case(), &one.single.drawn),
        "rounding_deg": one.explained.rounding_deg,
        "causes": one.explained.causes.iter().map(cause).collect::<Vec<_>>(),
        "without_all": ended(&one.explained.without_all),
    })
}

/// Returns the sentence on the trials without an axis, which are listed by ascending number. `lost` is the number of such trials, `listed`
/// is the number of trials that the answer shows. None if all trials have an axis.
fn without_axis(lost: u64, listed: usize) -> Option<String> {
    (lost > 0).then(|| {
        let first = if lost > listed as u64 {
            ". They are listed by their numbers; --worst K shows more of them, --trial N any other"
        } else {
            ""
        };
        format!("{lost} trials found no axis, so no error orders them{first}")
    })
}

fn answer(run: &FinishedRun, plan: &Plan, all: &[Repeated], lost: u64) -> Answer {
    let mut sections: Vec<Section> = Vec::new();
    for one in all {
        let mut blocks = words::blocks(plan, one);
        let lost = without_axis(lost, all.len()).filter(|_| sections.is_empty()).map(Block::Text);
        blocks.splice(1..1, lost);
        sections.push(Section::new(format!("Trial {}", one.chosen.trial), blocks));
    }
    let figures = all.iter().map(|one| {
        let name = format!("trial_{}_{}", one.chosen.point, one.chosen.trial);
        (name, one.figure.clone(), "Marks are what the drive read.".to_owned())
    });
    let answer = Answer {
        name: "explain",
        title: "Why these trials".to_owned(),
        setting: setup::setting(&run.file),
        sections,
        figures: figures.collect(),
        json: json!({ "folder": run.folder, "without_axis": lost, "trials": all.iter().map(json_of).collect::<Vec<_>>() }),
        csv: Some(
            all.iter().flat_map(|one| one.explained.causes.iter().map(|cause| record(one, cause))).collect(),
        ),
        ..Answer::default()
    };
    let (mut named, note) = run.begun();
    if let Some(one) = all.first().filter(|_| !run.file.axes.is_empty()) {
        // Questions are asked of scenarios without axes: at this point.
        let values = &plan.points()[one.chosen.point].values;
        named.line += &set("axes", "{}");
        named.line.extend(values.iter().map(|(key, value)| set(key, &written(value))));
    }
    let next = words::next(all, &named).into_iter();
    next.fold(answer, |answer, (purpose, command)| answer.next(format!("{purpose}{note}"), command))
}
