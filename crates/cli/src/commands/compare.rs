//! `standstill compare`: all methods on one motor, with errors, wrong poles, time, current and Cramér–Rao limit of each.

mod cache;
mod cells;

use serde_json::json;
use standstill_analysis::{Bound, Bounds, Entry, informative, mean_energy};
use standstill_campaign::{Campaign, Estimate, Occurrence, Sectors, Statistics, Summary};
use standstill_detect::MethodName;
use standstill_plant::Motor;
use standstill_quantity::{decimals, number as rounded};
use standstill_report::figure::rounded as rounded_to;
use standstill_report::page::{Block, Column, Table, Tone};
use standstill_sim::RunError;

use self::cells::{Cell, Comparison};
use super::question::given;
use crate::answer::{Answer, Made, Record, Records, verdict};
use crate::arguments::{Compare, Seed};
use crate::error::Error;
use crate::shell::asked::NotedQuestion;
use crate::shell::command_line::quoted;
use crate::shell::interrupt::{self, INTERRUPTED};
use crate::shell::output::Output;
use crate::shell::terminal::tell;
use crate::shell::values::{each_once, without_setting};
use crate::shell::{Report, progress};
use crate::summary::{good, good_heading, good_interval, right, sectors_in_words};
use crate::{doubts, figures};

/// Number of rotor angles, 22.5° apart, at which the Cramér–Rao limit is computed.
const ANGLES: usize = 16;

/// Number of rotor angles at which the Cramér–Rao limit is computed for methods without line pulses. Their detections are long, so that
/// even with few angles the limit takes about as long as the trials.
const FEW_ANGLES: usize = 8;

/// Returns true if the motor has a magnet, but its data do not show which pole is which.
fn is_open(motor: &Motor) -> bool {
    motor.has_magnet() && motor.pole_knowledge().is_open()
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// Returns a row for JSON and CSV. A missing value is null in JSON and empty in CSV.
fn record(entry: &Entry, motor: &Motor) -> Record {
    let s = &entry.summary;
    let open = is_open(motor);
    // Shares of the starts that named a sector.
    let share = |count: fn(&Sectors) -> u64| {
        s.sectors.filter(|of| of.named > 0).map(|of| count(&of) as f64 / of.named as f64)
    };
    let bound = |of: fn(&Bound) -> Option<f64>| entry.bound.as_ref().and_then(of).and_then(informative);
    let record = Record::default()
        .with("method", &entry.method)
        .with("rotor", entry.rotor.name())
        .with("errors", entry.errors.name())
        .with("trials", s.trials)
        // The share of starts with an angle and the right pole. All columns with errors count only the starts with an axis.
        .with("right", (!open).then(|| right(s)))
        .estimate("rms", "_deg", Some(s.rms_deg))
        .with("bias_deg", s.bias_deg.value)
        .with("p95_deg", s.p95_deg.value)
        .with("max_deg", s.max_deg)
        .with("wrong_poles", (!open).then_some(s.wrong_poles))
        // The upper end of the 95 % interval of the probability of a wrong pole.
        .with("wrong_poles_at_most", (!open).then_some(s.wrong_pole_probability.high))
        .with("undetermined", s.undetermined)
        .with("failed", s.failed)
        .with("half_sector_deg", s.sectors.map(|of| of.half_width_deg))
        .with("right_sector", share(|of| of.right))
        .with("sector_at_border", share(|of| of.at_border))
        .with("next_sector", share(|of| of.next))
        .with("further_sector", share(|of| of.further))
        .with("simulation_errors", s.errors)
        .with("duration_ms", s.mean_duration_s * 1e3)
        .with("peak_current_A", s.peak_current_a)
        .with("energy_J", finite(entry.energy_j))
        .with("moved_deg", s.max_moved_deg)
        // Cramér–Rao limits: from the method's own samples, from all samples at 100 kHz, and on a specimen whose gains, offsets and delays
        // are known only within tolerances.
        .with("bound_deg", bound(|bound| Some(bound.scheme_deg)))
        .with("bound_all_deg", bound(|bound| bound.all_deg))
        .with("bound_hybrid_deg", bound(|bound| bound.hybrid_deg))
        .with("efficiency", entry.efficiency())
        .with("reasons", reasons(entry));
    let pole_note = motor.pole_knowledge().note().filter(|_| motor.has_magnet());
    let record = if let Some(note) = pole_note { record.with("pole_note", note) } else { record };
    if let Some(note) = motor.map_note() { record.with("map_note", note) } else { record }
}

/// Returns the table. A narrow terminal shows each method above its rows and leaves out columns in the order of their ranks, those that
/// distinguish the methods least first.
fn table(entries: &[Entry], open: bool) -> Table {
    let largest = |of: fn(&Entry) -> f64| entries.iter().map(of).fold(0.0, f64::max);
    let ampere = decimals(1, largest(|entry| entry.summary.peak_current_a));
    let joule = decimals(2, largest(|entry| finite(entry.energy_j).unwrap_or_default()));
    let number = |value: f64, digits: usize| {
        finite(value).map_or_else(|| "–".to_owned(), |value| format!("{value:.digits$}"))
    };
    let column = |title: &str, rank: u8| Column::number(title).rank(rank);
    // A column of counts is always shown if any count is above zero. Counts of zero also follow from `right %`.
    let count = |title: &str, rank: u8, of: fn(&Summary) -> u64| {
        let none = entries.iter().all(|entry| of(&entry.summary) == 0);
        column(title, if none { rank } else { 0 }).of(move |entry: &Entry| of(&entry.summary).to_string())
    };
    let (wrong, of_wrong) = count("wrong", 1, |s| s.wrong_poles);
    let limits = if entries.iter().any(|entry| entry.limit().is_some()) { 0 } else { 8 };
    let limit = |entry: &Entry| {
        let bound = entry.bound.and_then(|bound| informative(bound.scheme_deg));
        bound.map_or_else(|| "–".to_owned(), |limit| rounded_to(limit, 3))
    };
    let columns = [
        Column::word("method").of(|entry: &Entry| entry.method.clone()),
        Column::word("rotor").of(|entry: &Entry| entry.rotor.name().to_owned()),
        Column::word("errors").of(|entry: &Entry| entry.errors.name().to_owned()),
        column("trials", 7).of(|entry: &Entry| entry.summary.trials.to_string()),
        column(good_heading(open), 0)
            .unit("%")
            .bracket(11)
            .of(move |entry: &Entry| good_interval(&entry.summary, open)),
        column("rms", 0).unit("°").bracket(9).of(|entry: &Entry| entry.summary.rms_deg.to_string()),
        column("p95", 2).unit("°").bracket(10).of(|entry: &Entry| entry.summary.p95_deg.to_string()),
        column("max", 6).unit("°").of(move |entry: &Entry| number(entry.summary.max_deg, 2)),
        wrong.judged().of(move |entry: &Entry| if open { "–".to_owned() } else { of_wrong(entry) }),
        count("undet.", 6, |s| s.undetermined),
        count("failed", 6, |s| s.failed + s.errors),
        column("ms", 0).of(|entry: &Entry| rounded(1, entry.summary.mean_duration_s * 1e3)),
        column("peak", 3).unit("A").of(move |entry: &Entry| number(entry.summary.peak_current_a, ampere)),
        column("J", 8).of(move |entry: &Entry| number(entry.energy_j, joule)),
        column("moved", 1).unit("°").of(move |entry: &Entry| number(entry.summary.max_moved_deg, 2)),
        column("limit", 4 + limits).unit("°").of(limit),
        column("eff.", 5 + limits).of(|entry: &Entry| efficiency(entry).alone()),
    ];
    let is_wrong = |entry: &Entry| entry.summary.wrong_poles > 0 && !open;
    Table::of(entries, |entry| if is_wrong(entry) { Tone::Bad } else { Tone::Neutral }, columns).headed()
}

/// Returns the ratio of the Cramér–Rao limit to the rms error. Its interval is computed from the interval of the rms error, because the
/// limit is exact.
fn efficiency(entry: &Entry) -> Estimate {
    let Estimate { value, low, high } = entry.summary.rms_deg;
    let limit = entry.efficiency().unwrap_or(f64::NAN) * value;
    Estimate { value: limit / value, low: limit / high, high: limit / low }
}

/// Returns the reasons why starts have no angle or no pole, each with its number of starts. Also returns the reason if there is no
/// Cramér–Rao limit.
fn reasons(entry: &Entry) -> String {
    let counted = entry.summary.reasons.iter();
    let counted =
        counted.map(|(reason, Occurrence { count, .. }): (&String, _)| format!("{count} × {reason}"));
    let no_bound: Option<RunError> = entry.no_bound;
    let all: Vec<String> = counted.chain(no_bound.map(|reason| format!("no limit: {reason}"))).collect();
    all.join("; ")
}

/// Runs the trials of the cells (rows of the comparison) one cell after the other. Stops early if the user interrupts. If `limits` is true,
/// the Cramér–Rao limits are computed, too.
fn entries(cells: &[Cell], limits: bool, threads: Option<usize>) -> Result<Vec<Entry>, Error> {
    let stop = interrupt::flag();
    let bar = progress::bar(cells.iter().map(|cell| cell.trials).sum());
    let mut entries = Vec::new();
    for cell in cells {
        bar.set_message(format!("{}, {}, {}", cell.method, cell.rotor.name(), cell.errors.name()));
        let mut statistics = Statistics::default();
        let campaign = Campaign { scenario: &cell.scenario, trials: cell.trials, threads };
        let done = campaign.run(&stop, |record| {
            statistics.add(record);
            bar.inc(1);
            Ok::<(), Error>(())
        })?;
        // A row whose trials are all done is kept, even if the user interrupted during the last trials.
        if done < cell.trials {
            break;
        }
        let angles = if cell.scenario.detector.has_line_pulses() { ANGLES } else { FEW_ANGLES };
        let (bound, no_bound) = if limits {
            let bounds = Bounds { threads, ..Bounds::of_method(&cell.scenario) };
            let compute = || Bound::or_reason(bounds, angles);
            // The name of a library does not identify its detector, so its limit is not cached.
            let known = MethodName::ALL.iter().any(|method| method.name() == cell.method);
            if known { cache::limit(&cell.scenario, angles, compute)? } else { compute()? }
        } else {
            (None, None)
        };
        let entry = Entry {
            method: cell.method.clone(),
            rotor: cell.rotor,
            errors: cell.errors,
            summary: statistics.summary(),
            energy_j: mean_energy(&cell.scenario, cell.trials)?,
            bound,
            no_bound,
        };
        entries.push(entry);
    }
    bar.finish_and_clear();
    Ok(entries)
}

pub fn run(options: &Compare) -> Result<Report, Error> {
    let Comparison { motor, seed, cells, left_out, .. } = Comparison::new(options)?;
    if let Some(cell) = cells.first() {
        doubts::warn(&cell.scenario);
    }
    let asked = || {
        let each: Vec<_> = cells
            .iter()
            .map(|cell| (&cell.method, cell.rotor, cell.errors, cell.trials, &cell.scenario))
            .collect();
        let said = format!("{}, seed {seed}", motor.name);
        NotedQuestion::new("compare", said, &(options.no_limit, each), options.force.force)
    };
    let asked = (!options.json).then(asked);
    if let Some(asked) = &asked {
        drop(Output::answering(asked.clone(), &options.out, &["comparison.csv", "comparison.html"])?);
    }
    let entries = entries(&cells, !options.no_limit, options.threads.map(usize::from))?;
    let interrupted = entries.len() < cells.len();
    let failed = entries.iter().any(|entry| entry.summary.errors > 0);
    let code = if interrupted { INTERRUPTED } else { u8::from(failed) };
    let records: Records = entries.iter().map(|entry| record(entry, &motor)).collect();
    let left_out = left_out.iter().map(|(method, setting)| (method.name(), &setting[..]));
    let left_out = without_setting(left_out);
    if options.json {
        for sentence in &left_out {
            tell(sentence);
        }
        let json = serde_json::to_string_pretty(&records);
        let json = json.map_err(|error| Error::Write("standard output".into(), error.into()))?;
        return Ok(Report { text: json + "\n", code });
    }
    if entries.is_empty() {
        return Ok(Report { text: "Interrupted before the first method was done.\n".to_owned(), code });
    }
    let mut blocks = blocks(&entries, &motor);
    blocks.extend(left_out.into_iter().map(Block::Text));
    if interrupted {
        let said = format!("Interrupted: {} of {} rows are in these files.", entries.len(), cells.len());
        blocks.push(Block::Text(said));
    }
    let open = is_open(&motor);
    let judged = if open { ", poles not judged" } else { "" };
    // Without an axis there is no error to draw.
    let has_axis = entries.iter().any(|entry| entry.summary.rms_deg.value.is_finite());
    let figure =
        has_axis.then(|| figures::comparison(&entries, format!("{}, seed {seed}{judged}", motor.name), open));
    let title = format!("Methods on {}, seed {seed}", motor.name);
    let verdict = verdict(Tone::Neutral, title.clone(), Vec::new());
    let answer = Answer::new("comparison", title, String::new(), verdict, blocks);
    let answer = match figure {
        Some(figure) => answer.with("comparison", figure, ""),
        None => answer,
    };
    let answer = Answer { json: json!(records), csv: Some(records), code, ..answer };
    let answer = if interrupted { answer } else { next(options, &entries, open, answer) };
    answer.report(Some(options.out.clone()), false, &Made { asked, ..Made::default() })
}

/// Adds the command that is proposed next. If starts have no answer, this is a search for settings. Otherwise it simulates one start with
/// the best method.
fn next(options: &Compare, entries: &[Entry], open: bool, answer: Answer) -> Answer {
    let scenario = options.source.scenario.as_ref().map(|path| path.to_string_lossy().into_owned());
    // Where a command takes a scenario file, a motor's name is allowed, too.
    let left_out = scenario.is_none().then_some("motor");
    let of = scenario.or_else(|| options.motor.clone()).unwrap_or_else(|| "paper-5k5".to_owned());
    let again =
        given(&of, &options.source.keys, Seed::default()) + &cells::conditions(options).as_keys(left_out);
    let answers = |entry: &Entry| good(&entry.summary, open);
    let best = entries.iter().filter(|entry| open || entry.summary.wrong_poles == 0).max_by(|a, b| {
        answers(a).total_cmp(&answers(b)).then(b.summary.rms_deg.value.total_cmp(&a.summary.rms_deg.value))
    });
    match best.filter(|best| answers(best) > 0.99) {
        Some(best) => {
            // A library is named by its option already.
            let is_method = MethodName::ALL.iter().any(|method| method.name() == best.method);
            let method = if is_method { format!(" -s detector.method={}", best.method) } else { String::new() };
            // Methods whose error intervals overlap cannot be ranked by these starts.
            let is_near = |entry: &&Entry| {
                let is_like = entry.method != best.method && entry.errors == best.errors && entry.rotor == best.rotor;
                is_like && (open || entry.summary.wrong_poles == 0) && answers(entry) >= answers(best) && entry.summary.rms_deg.low <= best.summary.rms_deg.high
            };
            let near = each_once(entries.iter().filter(is_near).map(|entry| entry.method.as_str())).len();
            let why = match near {
                0 => "which answers most and is the most exact of those".to_owned(),
                1 => "which answers most; another method answers as many, with errors that these starts do not tell apart".to_owned(),
                _ => format!("which answers most; {near} others answer as many, with errors that these starts do not tell apart"),
            };
            answer.next(
                format!("one start of {}, {why}", best.method),
                format!(
                    "standstill trace {again}{method} -s errors={} -s rotor.state={} --out {}",
                    best.errors.name(),
                    best.rotor.name(),
                    quoted(&format!("trace-{}", best.method))
                ),
            )
        }
        None => answer.next(
            "none answers 99 of 100 starts without a wrong pole as it is set: pulses and rounds with which one does",
            format!("standstill check {again}"),
        ),
    }
}

fn blocks(entries: &[Entry], motor: &Motor) -> Vec<Block> {
    let open = is_open(motor);
    let table = table(entries, open);
    let good =
        if open { "axis: starts with an axis." } else { "right: starts with an angle and the right pole." };
    let poles = motor.pole_knowledge().note().filter(|_| motor.has_magnet());
    let poles = poles.map(|note| format!("wrong, undet.: {note}."));
    let map = motor.map_note().map(|note| format!("Map: {note}."));
    let legend: Vec<String> = [format!("{good} {LEGEND}")].into_iter().chain(poles).chain(map).collect();
    let reasons =
        entries.iter().map(|entry| (entry, reasons(entry))).filter(|(_, reasons)| !reasons.is_empty());
    let reasons = reasons.map(|(Entry { method, rotor, errors, .. }, reasons)| {
        format!("{method}, {}, {}: {reasons}", rotor.name(), errors.name())
    });
    let reasons: Vec<String> = reasons.collect();
    let mut blocks = vec![Block::Table(table), Block::Text(legend.join("\n\n"))];
    let sectors: Vec<String> = entries
        .iter()
        .filter_map(|Entry { method, rotor, errors, summary, .. }| {
            let said = sectors_in_words(&summary.sectors?, summary.limit_deg);
            let [rotor, errors] = [rotor.name(), errors.name()];
            Some(format!("{method}, {rotor}, {errors}: errors are those beyond the sector named; {said}"))
        })
        .collect();
    blocks.extend((!sectors.is_empty()).then_some(Block::List(sectors)));
    blocks.extend((!reasons.is_empty()).then_some(Block::List(reasons)));
    blocks
}

const LEGEND: &str = "rms, p95, max: error of the axis, of starts that have one. wrong: wrong poles; undet.: axis without pole; failed: no angle. ms, peak A, J: \
     time, largest current and mean energy of a detection. moved: furthest that a rotor moved. limit: Cramér–Rao, from what \
     the drive reads of the method's pulses (line pulses without the polarity test that follows), with known gains and offsets; eff.: limit / rms.";
