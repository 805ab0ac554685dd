//! `standstill bounds`: the Cramér–Rao limit of a scenario's pulses over the rotor's angle.

use serde_json::{Value, json};
use standstill_analysis::{Bound, Bounds, informative};

use crate::arguments::Bounds as Options;
use crate::doubts;
use crate::error::Error;
use crate::scenario::{self, Shipped, Shorthands};
use crate::shell::Report;
use crate::shell::interrupt;
use crate::shell::table::{Column, Table};
use crate::shell::terminal::paragraph;

/// A bound's values; none of one that says nothing.
fn values(bound: &Bound) -> [Option<f64>; 4] {
    [Some(bound.scheme_deg), Some(bound.all_deg), bound.hybrid_deg, bound.hybrid_all_deg]
        .map(|v| v.and_then(informative))
}

const NAMES: [&str; 4] = ["scheme_deg", "all_deg", "hybrid_deg", "hybrid_all_deg"];

fn object(bound: &Bound) -> serde_json::Map<String, Value> {
    NAMES.iter().zip(values(bound)).map(|(name, value)| ((*name).to_owned(), json!(value))).collect()
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
    if options.json {
        let each = |(number, bound): (usize, &Bound)| {
            let mut object = object(bound);
            object.insert("angle_deg".to_owned(), angle(number).into());
            Value::Object(object)
        };
        let json = json!({
            "setup": super::setup_json(&file, &motor),
            "method": method,
            "rms": found.as_ref().map(|bounds| object(&Bound::rms(bounds))),
            "angles": found.as_ref().map(|bounds| bounds.iter().enumerate().map(each).collect::<Vec<_>>()),
        });
        return Ok(Report { text: format!("{json:#}\n"), code: 0 });
    }
    let mut text = format!(
        "{}, {method}, {} errors: no unbiased method knows the axis better from these commands (Cramér–Rao)\n\n",
        motor.name,
        file.errors.0.name()
    );
    let Some(bounds) = found else {
        text += "The method turns the rotor: it does not look for where the rotor stood, and has no such limit.\n";
        return Ok(Report { text, code: 0 });
    };
    let cells = |first: String, bound: &Bound| {
        let number = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| format!("{value:.4}"));
        std::iter::once(first).chain(values(bound).map(number)).collect()
    };
    let mut rows: Vec<Vec<String>> = bounds
        .iter()
        .enumerate()
        .map(|(number, bound)| cells(format!("{:.1}", angle(number)), bound))
        .collect();
    rows.push(cells("rms".to_owned(), &Bound::rms(&bounds)));
    let titles = ["angle °", "own samples °", "all samples °", "on a specimen °", "all, specimen °"];
    text += &Table::new(titles.map(Column::number)).rows(rows).text();
    text.push('\n');
    text += &paragraph(
        "",
        &format!(
            "All samples: every {:.0} µs of the same commands. On a specimen: gains, offsets and delays of drive and \
             sensors are not known either.",
            interval.seconds() * 1e6
        ),
    );
    Ok(Report { text, code: 0 })
}
