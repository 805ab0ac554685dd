//! `standstill fit`: a motor's data identified from scope traces.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::json;
use standstill_analysis::fit::record::{LINK, Record, RecordError};
use standstill_analysis::fit::{Estimate, Fit, MISFIT, MOST_USED, NonIdentifiable, Start, fit};
use standstill_plant::{DataSheet, Files, Motor, built_in};
use standstill_quantity::Scale;
use standstill_scenario::Document;

mod next;

use crate::arguments::{Fit as Options, Keys};
use crate::error::Error;
use crate::figures;
use crate::scenario::{self, Shorthands};
use crate::shell::Report;
use crate::shell::asked::NotedQuestion;
use crate::shell::interrupt;
use crate::shell::output::Output;
use crate::shell::output::file_list;
use crate::shell::progress;
use crate::shell::table::Print as _;
use crate::shell::terminal::paragraph;
use crate::summary::{decimals_of, fixed};
use standstill_report::page::{Column, Table};

const FILES: [&str; 4] = ["motor.toml", "fit.json", "fit.svg", "fit.png"];

/// Ratio of the readings' information about a direction to that of the prior, below which the direction is named.
const HARDLY_IDENTIFIED: f64 = 0.1;

/// Parameters whose non-identifiable directions the text names; fit.json contains all.
const OF_THE_WINDING: [&str; 4] = ["L_d", "L_q", "angle", "resistance"];

/// Keys of the drive that a fit uses; it accepts no others.
const DRIVE_KEYS: [&str; 8] = [
    "inverter.devices",
    "inverter.dead_time",
    "inverter.switch_drop",
    "inverter.switch_resistance",
    "inverter.channel_resistance",
    "inverter.diode_drop",
    "inverter.diode_resistance",
    SETTLE_KEY,
];

/// Key of the time that the amplifier of a shunt in the DC link takes.
const SETTLE_KEY: &str = "sensors.settle";

/// Keys that state the resistance of the switches.
const SWITCH_KEYS: [&str; 2] = ["inverter.switch_resistance", "inverter.channel_resistance"];

/// Returns the name of the estimate of a drive's key.
fn estimate_of(key: &str) -> &str {
    if SWITCH_KEYS.contains(&key) { "switch_resistance" } else { key.trim_start_matches("inverter.") }
}

fn read(path: &Path) -> Result<Record, Error> {
    let bytes = Files::default().read(path).map_err(|error| Error::Read(path.to_owned(), error))?;
    let file = path.display().to_string();
    match std::str::from_utf8(&bytes) {
        Ok(text) => Record::parse(&file, text).map_err(Error::Record),
        Err(error) => {
            let line = bytes[..error.valid_up_to()].split(|byte| *byte == b'\n').count();
            let found = "bytes that are no UTF-8".to_owned();
            let needed = "a text with commas between its columns".to_owned();
            Err(Error::Record(RecordError { file, line: Some(line), column: None, found, needed }))
        }
    }
}

/// Returns the initial motor and drive of the fit.
fn start(options: &Options, records: &[Record]) -> Result<Start, Error> {
    if let Some((key, _)) = options.set.iter().find(|(key, _)| !DRIVE_KEYS.contains(&key.as_str())) {
        let known = DRIVE_KEYS.join(", ");
        return Err(Error::Arguments(format!(
            "-s {key}: needed a key of the drive that a fit uses: {known}"
        )));
    }
    let shorthands = Shorthands::default().with("--motor", "motor", options.motor.as_deref());
    let mut keys = Keys { set: options.set.clone(), detector: None };
    if records.iter().any(|record| record.channels[LINK]) {
        keys.set.push(("sensors.arrangement".to_owned(), "dc-link-shunt".to_owned()));
    } else if options.set.iter().any(|(key, _)| key == SETTLE_KEY) {
        let message = format!("-s {SETTLE_KEY}: needed a trace with i_link_A, the current of a shunt in the DC link");
        return Err(Error::Arguments(message));
    }
    let document = scenario::changed(Document::parse(Path::new("scenario"), "")?, &keys, shorthands)?;
    let motor = options.motor.as_ref().map(|_| document.motor()).transpose()?;
    let drive_of = if let Some(motor) = &motor {
        motor.clone()
    } else {
        // Devices are sized to the current.
        let rows = || records.iter().flat_map(|record| &record.rows);
        let currents = rows().flat_map(|row| row.current).filter(|i| i.is_finite());
        let current = currents.fold(0.0, |most, i| i.abs().max(most));
        let link = rows().map(|row| row.link).fold(0.0, f64::max);
        let like = built_in("paper-5k5").ok_or_else(|| Error::UnknownMotor("paper-5k5".to_owned()))?;
        Motor { rated_current: current.max(1e-6), dc_link: Some(link), ..like }
    };
    let stated = options.set.iter().map(|(key, _)| estimate_of(key).to_owned()).collect();
    let scenario = document.unchecked_scenario_of(&drive_of)?;
    let (devices, dead_time) = (scenario.drive.bridge.devices, scenario.drive.dead_time.seconds());
    let settle = scenario.sensors.settle.seconds();
    Ok(Start { motor, devices, dead_time, stated, settle, most_used: MOST_USED })
}

/// Returns whether both paths lead to one existing file.
fn same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// Refuses traces that are given twice, and output files that would replace an input.
fn distinct(options: &Options) -> Result<(), Error> {
    for (k, trace) in options.traces.iter().enumerate() {
        if options.traces[..k].iter().any(|before| same_file(before, trace)) {
            let path = trace.display();
            return Err(Error::Arguments(format!(
                "{path}: found the same file twice; needed: each trace once"
            )));
        }
    }
    let motor = options.motor.as_ref().map(Path::new);
    for input in options.traces.iter().map(std::path::PathBuf::as_path).chain(motor) {
        if let Some(name) = FILES.iter().find(|name| same_file(input, &options.out.join(name))) {
            let (out, input) = (options.out.display(), input.display());
            return Err(Error::Arguments(format!(
                "--out {out}: {name} there is {input}, which is read; needed: another folder"
            )));
        }
    }
    Ok(())
}

pub fn run(options: &Options) -> Result<Report, Error> {
    interrupt::at_once();
    distinct(options)?;
    let records = options.traces.iter().map(|path| read(path)).collect::<Result<Vec<_>, _>>()?;
    let start = start(options, &records)?;
    let traces: Vec<String> = options.traces.iter().map(|path| path.display().to_string()).collect();
    let said = traces.join(", ");
    let asked = NotedQuestion::new(
        "fit",
        said,
        &(&records, &start, &options.motor, &options.set),
        options.force.force,
    );
    let mut output = Output::answering(asked, &options.out, &FILES)?;
    let spinner = progress::spinner("fitting");
    let fitted = fit(&records, &start, &|| {
        spinner.inc(1);
        false
    });
    spinner.finish_and_clear();
    let fitted = fitted.map_err(Error::Fit)?;
    let names: Vec<String> = options.traces.iter().map(|path| path.display().to_string()).collect();
    let sheet = fitted.sheet(&names.join(", "), start.motor.as_ref());
    // The sheet must load.
    DataSheet::parse("motor.toml", &sheet).and_then(|sheet| sheet.motor()).map_err(Error::Motor)?;
    let json = json_of(&fitted, &names, options);
    output.file("motor.toml", sheet.as_bytes())?;
    output.file("fit.json", format!("{json:#}\n").as_bytes())?;
    let figure = figures::fit(&fitted, &names.join(", "), subtitle(&fitted));
    output.figure("fit", &figure)?;
    let files = output.finish()?;
    if options.json {
        return Ok(Report { text: format!("{json:#}\n"), code: 0 });
    }
    let text =
        text_of(&fitted, &records) + "\n" + &file_list(&options.out, &files) + &next::steps(&fitted, options);
    Ok(Report { text, code: 0 })
}

fn subtitle(fit: &Fit) -> String {
    let scale = Scale::suiting("A", fit.residual_rms);
    format!(
        "residual {:.3} {} rms; lines: 95 % of noise and converter",
        scale.number(fit.residual_rms),
        scale.unit
    )
}

fn json_of(fit: &Fit, files: &[String], options: &Options) -> serde_json::Value {
    json!({
        "files": files,
        "start": options.motor,
        "parameters": fit.parameters.iter().map(|estimate| json!({
            "name": estimate.name,
            "unit": estimate.unit,
            "value": estimate.value,
            "low": estimate.interval.map(|[low, _]| low),
            "high": estimate.interval.map(|[_, high]| high),
            "identified": estimate.identified,
            "at_A": estimate.at,
        })).collect::<Vec<_>>(),
        "non_identifiable_directions": fit.non_identifiable.iter().map(|direction| json!({
            "information": direction.information,
            "moves": direction.parts.iter().map(|(name, by)| json!({ "name": name, "by": by })).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
        "pole": { "identified": fit.pole.identified, "deviations": fit.pole.deviations, "both_ways": fit.pole.both_ways },
        "discrepancies": fit.discrepancies.iter().map(|one| json!({
            "name": one.name,
            "unit": one.unit,
            "begun_with": one.begun_with,
            "stated": one.is_stated,
            "deviations": one.deviations,
        })).collect::<Vec<_>>(),
        "fixed_biases": fit.fixed_biases.iter().map(|bias| json!({
            "fixed": bias.fixed.0,
            "off_by": bias.fixed.1,
            "moves": bias.moves.iter().map(|(name, by)| json!({ "name": name, "by": by })).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
        "residual_rms_A": fit.residual_rms,
        "expected_rms_A": fit.expected_rms,
        "intervals_widened": fit.widened,
        "converged": fit.converged,
        "describes": fit.widened < MISFIT,
        "row_stride": fit.every,
        "readings": fit.readings,
        "clipped_readings": fit.clipped,
        "pulses": fit.traces.len(),
        "largest_current_A": fit.reach,
        "saturation_at_A": fit.current,
        "reached_A": { "d": fit.reached[0], "minus_d": fit.reached[1], "q": fit.reached[2] },
        "dc_link_V": fit.link,
        "dc_link_spread": fit.link_spread,
    })
}

/// Formats a value and its interval in one unit, with the digits that the interval supports.
fn cells(estimate: &Estimate) -> [String; 2] {
    let share = estimate.name.starts_with("saturation");
    let [low, high] = estimate.interval.unwrap_or([estimate.value; 2]);
    let scale = if share {
        Scale::percent()
    } else {
        Scale::suiting(estimate.unit, estimate.value.abs().max(high - low))
    };
    let decimals = decimals_of([estimate.value, low, high].map(|value| scale.number(value)));
    let number = |value: f64| fixed(scale.number(value), decimals);
    let unit = scale.unit.replace("ohm", "Ω");
    let value = format!("{} {unit}", number(estimate.value)).trim_end().to_owned();
    let interval = match estimate.interval {
        Some(_) if estimate.identified => format!("{} … {}", number(low), number(high)),
        Some(_) => format!("± {} assumed", number((high - low) / 2.0)),
        None => "–".to_owned(),
    };
    [value, interval]
}

fn text_of(fit: &Fit, records: &[Record]) -> String {
    let rows: usize = records.iter().map(|record| record.rows.len()).sum();
    let used = if fit.every == 1 { String::new() } else { format!(" (one in {} used)", fit.every) };
    let mut text = format!(
        "{rows} rows{used}, {} from rest, up to {} A on {} V\n\n",
        if fit.traces.len() == 1 {
            "one pulse or train".to_owned()
        } else {
            format!("{} pulses or trains", fit.traces.len())
        },
        standstill_quantity::number(2, fit.reach),
        standstill_quantity::number(1, fit.link)
    );
    let rows = fit.parameters.iter().map(|estimate| {
        let [value, interval] = cells(estimate);
        let measured = if estimate.identified { "measured" } else { "not measured: fixed" };
        let at = estimate.at.filter(|_| estimate.identified);
        let at = at.map(|at| format!(" at {} A", standstill_quantity::number(2, at))).unwrap_or_default();
        vec![estimate.name.clone() + &at, value, interval, measured.to_owned()]
    });
    let columns = [
        Column::word("parameter"),
        Column::number("value"),
        Column::number("95 % interval"),
        Column::prose(""),
    ];
    text += &Table::new(columns).rows(rows).text();
    text += "\n";
    for sentence in sentences(fit) {
        text += &paragraph("  – ", &sentence);
    }
    text
}

fn ampere(value: f64) -> String {
    let scale = Scale::suiting("A", value);
    format!("{:.3} {}", scale.number(value), scale.unit)
}

/// Returns the sentences that interpret the numbers.
fn sentences(fit: &Fit) -> Vec<String> {
    let mut said = vec![format!(
        "Residual {} rms, noise and converter {}.",
        ampere(fit.residual_rms),
        ampere(fit.expected_rms)
    )];
    if fit.widened >= MISFIT {
        said.push(format!(
            "The simulation does NOT describe these currents: residuals follow each other, and intervals are {:.1} times as wide for it. {}",
            fit.widened,
            next::misfit(fit)
        ));
    }
    if !fit.converged {
        said.push("The search for the most likely parameters did NOT end at them: the intervals are not 95 % ones. Begin nearer: --motor with a motor like it, -s inverter.dead_time and the like as known.".to_owned());
    }
    if fit.clipped > 0 {
        said.push(format!(
            "{} readings lie at the ends of their channels' ranges: they count as currents of at least that.",
            fit.clipped
        ));
    }
    if fit.link_spread > 0.02 {
        said.push(format!(
            "The DC link moves by {:.1} % within a pulse; its mean is what is simulated.",
            100.0 * fit.link_spread
        ));
    }
    said.push(if fit.pole.identified {
        format!("North from south: {:.1} deviations, by the convention that a current along the magnet saturates the iron more{}.", fit.pole.deviations, if fit.falls.is_some_and(|[d, minus_d, _]| d < minus_d) { " against it (as in the motor that the fit began with)" } else { "" })
    } else if !fit.pole.both_ways {
        "The half turn of the angle stays open: the pulses drive current to one side of the magnet only. The angle may be 180° more. Add pulses the other way.".to_owned()
    } else {
        "The half turn of the angle stays open: the iron saturates alike in both directions, as far as these currents go. The angle may be 180° more.".to_owned()
    });
    said.extend(fit.discrepancies.iter().map(|one| next::discrepancy(fit, one)));
    said.extend(next::saturation(fit));
    said.extend(next::probe(fit));
    said.push("The simulated terminals have no capacitance: what rings after a leg opens (66 kHz with 13 mH and 0.3 nF) is read as noise, and what charges a terminal as a current of the motor.".to_owned());
    said.push("No trace tells a gain that all channels, or the DC link's, have in common: resistance and inductances are in proportion to the link's gain over the channels'.".to_owned());
    let of = |name: &str, value: f64| {
        let estimate = fit.parameters.iter().find(|estimate| estimate.name == name);
        let scale = Scale::suiting(estimate.map_or("", |estimate| estimate.unit), value.abs());
        format!("{:.2} {}", scale.number(value.abs()), scale.unit.replace("ohm", "Ω")).trim_end().to_owned()
    };
    let named = |direction: &&NonIdentifiable| {
        direction.information < HARDLY_IDENTIFIED
            && direction.parts.len() > 1
            && OF_THE_WINDING.contains(&direction.parts[0].0.as_str())
    };
    for direction in fit.non_identifiable.iter().filter(named) {
        let first = direction.parts[0].1;
        let part = |(name, by): &(String, f64)| {
            format!("{name} by {}{}", if by * first < 0.0 { "−" } else { "" }, of(name, *by))
        };
        said.push(format!(
            "The readings do not identify one direction of the parameters: a move of {} hardly changes the currents.",
            direction.parts.iter().map(part).collect::<Vec<_>>().join(" together with ")
        ));
    }
    for bias in &fit.fixed_biases {
        let mut moves = String::new();
        for (k, (name, by)) in bias.moves.iter().enumerate() {
            let _ = write!(moves, "{}{name} by {}", if k == 0 { "" } else { ", " }, of(name, *by));
        }
        said.push(format!(
            "{} is fixed, not measured; if it is off by {}, it biases {moves}, which their intervals contain.",
            bias.fixed.0,
            of(&bias.fixed.0, bias.fixed.1)
        ));
    }
    said
}
