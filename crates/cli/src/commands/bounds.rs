//! `standstill bounds`: the Cramér–Rao limit of a scenario's pulses over the rotor's angle.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use serde_json::json;
use standstill_analysis::{Bound, Bounds, Halt, informative};
use standstill_detect::Source;
use standstill_interface::Nanos;
use standstill_report::page::{Block, Column, Table, Tone};
use standstill_scenario::{Document, Plan};

use super::question::{Silence, given, silence};
use crate::answer::{Answer, Made, Record, Records, verdict};
use crate::arguments::Bounds as Options;
use crate::doubts;
use crate::error::Error;
use crate::scenario::{self, Shipped, Shorthands};
use crate::shell::setup::in_words;
use crate::shell::{NOT_SHOWN, Report, interrupt, workers};

/// Returns four Cramér–Rao limits of the rms error in electrical degrees. The first uses the method's own samples, the second all samples.
/// The third and the fourth are the same limits if gains, offsets and delays are known only within tolerances. `None` if a limit was not
/// computed or is too large to be informative.
fn values(bound: &Bound) -> [Option<f64>; 4] {
    [Some(bound.scheme_deg), bound.all_deg, bound.hybrid_deg, bound.hybrid_all_deg]
        .map(|v| v.and_then(informative))
}

fn record(bound: &Bound) -> Record {
    let names = ["scheme_deg", "all_deg", "hybrid_deg", "hybrid_all_deg"];
    names
        .into_iter()
        .zip(values(bound))
        .fold(Record::default(), |record, (name, value)| record.with(name, value))
}

fn cells(first: String, bound: &Bound) -> Vec<String> {
    let number = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| format!("{value:.4}"));
    std::iter::once(first).chain(values(bound).map(number)).collect()
}

pub fn run(options: &Options) -> Result<Report, Error> {
    interrupt::at_once();
    let shorthands = Shorthands::default().seed(options.seed);
    let document = scenario::document(&options.source, Shipped::Empty, shorthands)?;
    let file = document.load_single()?;
    let motor = document.motor()?;
    let scenario = document.scenario_of(&motor)?;
    doubts::warn(&scenario);
    let bounds = Bounds { threads: options.threads.map(usize::from), ..Bounds::of_method(&scenario) };
    let angles = usize::from(options.angles);
    let method = file.detector.name();
    let (found, interval) = (bounds.over(angles)?, bounds.interval);
    let angle = |number: usize| 360.0 * number as f64 / angles as f64;
    let each = |(number, bound): (usize, &Bound)| record(bound).with("angle_deg", angle(number));
    // If the samples contain no information on the axis, simulated starts of the scenario give the reasons.
    let is_blind =
        found.as_ref().is_some_and(|bounds| bounds.iter().flat_map(values).all(|value| value.is_none()));
    let starts = if is_blind { Some(starts(options, document)?) } else { None };
    let json = json!({
        "setup": super::setup_json(&file, &motor),
        "method": method,
        "rms": found.as_ref().map(|bounds| record(&Bound::rms(bounds))),
        "angles": found.as_ref().map(|bounds| bounds.iter().enumerate().map(each).collect::<Records>()),
        "plain_starts": starts.as_ref().map(Silence::json),
    });
    let says = if is_blind {
        "these commands do not tell the axis at any of these angles, so it has no Cramér–Rao limit"
    } else {
        "no unbiased method knows the axis better from these commands (Cramér–Rao)"
    };
    let headline = format!("{}, {method}, {}: {says}", motor.name, in_words(file.errors.0));
    let blocks = match &found {
        None => vec![Block::Text(TURNS.to_owned())],
        Some(bounds) => {
            let rows = bounds
                .iter()
                .enumerate()
                .map(|(number, bound)| cells(format!("{:.1}", angle(number)), bound));
            let columns = ["angle", "own samples", "all samples", "on a specimen", "all, specimen"];
            let table = Table::new(columns.map(|name| Column::number(name).unit("°")))
                .rows(rows.chain([cells("rms".to_owned(), &Bound::rms(bounds))]));
            let read: Vec<&str> = scenario.sources().into_iter().map(Source::words).collect();
            let legend = format!(
                "Read: {}. All samples: the own ones and every {:.0} µs of the same commands. On a specimen: gains, \
                 offsets and delays of drive and sensors are not known either.",
                if read.is_empty() {
                    "nothing that tells the rotor's angle".to_owned()
                } else {
                    read.join("; ")
                },
                interval.map_or(f64::NAN, Nanos::seconds) * 1e6
            );
            vec![Block::Table(table), Block::Text(legend)]
        }
    };
    let tone = if is_blind { Tone::Bad } else { Tone::Neutral };
    let details = starts.as_ref().map(Silence::sentence).into_iter().collect();
    let verdict = verdict(tone, headline, details);
    let answer = Answer::new("bounds", "Cramér–Rao limit".to_owned(), String::new(), verdict, blocks);
    let answer = Answer { json, code: if is_blind { NOT_SHOWN } else { 0 }, ..answer };
    // The next command accepts a motor's name in place of a scenario file.
    let scenario = options.source.scenario.as_deref().unwrap_or_else(|| Path::new("paper-5k5"));
    let keys = &options.source.keys;
    let answer = if is_blind {
        Answer { next: vec![silence::next(scenario, keys, options.seed, &file)], ..answer }
    } else {
        let again = given(&scenario.to_string_lossy(), keys, options.seed);
        answer.next("what the methods reach of it, in some minutes", format!("standstill compare {again}"))
    };
    answer.report(None, options.json, &Made::default())
}

/// Simulates motor starts of the scenario and counts those in which the detector finds an axis.
fn starts(options: &Options, document: Document) -> Result<Silence, Error> {
    let plan = Plan::new(document)?;
    let run = || Silence::of_axes(&plan, &AtomicBool::new(false));
    match workers(options.threads.map(usize::from))?.install(run) {
        Ok(starts) => Ok(starts),
        Err(Halt::Failed(error)) => Err(error.into()),
        Err(Halt::Stopped) => unreachable!("nothing stops it"),
    }
}

const TURNS: &str =
    "The method turns the rotor: it does not look for where the rotor stood, and has no such limit.";
