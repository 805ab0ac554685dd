//! What a report says.

use standstill_campaign::{Occurrence, Summary};
use standstill_report::figure::Figure;
use standstill_report::page::{Block, Chart, Page, Section, Table, TableColumn, Tone};

use super::study::setting;
use super::{Run, setup};
use crate::commands::run::quoted;
use crate::commands::run::results::{PointSummary, SummaryFile};
use crate::summary::{FAILING, GOOD, digits, number, rank, right};
use crate::units::Shown;

/// More starts than this without an angle are worth a warning.
const OFTEN: f64 = 0.01;

pub fn page(run: &Run, figures: &[(String, Figure)]) -> Page {
    let summary = &run.summary;
    let mut results = Vec::new();
    // Axes are varied on purpose: what they say together depends on how they were chosen.
    if summary.points.is_empty() {
        results.push(Block::Table(statistics(&summary.summary)));
    }
    if !summary.summary.reasons.is_empty() {
        results.push(Block::Table(reasons(&summary.summary)));
    }
    if !summary.points.is_empty() {
        results.push(Block::Table(points(&summary.points)));
    }
    let chart = |(name, figure): &(String, Figure)| {
        // Ids have no dots, keys do; keys have no dashes of this kind twice.
        let id = format!("chart-{}", name.replace(|c: char| !c.is_ascii_alphanumeric() && c != '_', "-"));
        Block::Chart(Chart { id, figure: figure.clone(), caption: caption(name).to_owned() })
    };
    let (tone, headline, details) = verdict(summary);
    let section = |title: &str, blocks: Vec<Block>| Section { title: title.to_owned(), blocks };
    Page {
        title: "Initial rotor position: Monte Carlo".to_owned(),
        subtitle: setting(&run.file),
        sections: vec![
            section("Verdict", vec![Block::Verdict { tone, headline, details }, Block::Facts(facts(run))]),
            section("Results", results),
            section("Figures", figures.iter().map(chart).collect()),
            section("Motor, drive and sensors", setup::blocks(run)),
            section("How to reproduce it", reproduce(run)),
        ],
        footer: format!("Standstill {}", summary.run.version),
    }
}

/// What the run says in a line, and what that rests on.
pub fn verdict(summary: &SummaryFile) -> (Tone, String, Vec<String>) {
    let s = &summary.summary;
    let percent = |share: f64| format!("{:.*} %", digits(share), 100.0 * share);
    let silent = (s.undetermined + s.failed) as f64 / s.trials as f64;
    let unsure = s.wrong_pole_probability.high > OFTEN;
    let answered = right(s);
    let ends = extremes(&summary.points);
    let tone = if s.wrong_poles > 0 || s.errors > 0 || s.found == 0 {
        Tone::Bad
    } else if answered < GOOD {
        Tone::Warning
    } else if !summary.points.is_empty() {
        // A sweep goes where the method fails: that is what it is for.
        Tone::Neutral
    } else if summary.run.pole_note.is_some() || silent > OFTEN || unsure || s.beyond_limit.value > OFTEN {
        Tone::Warning
    } else {
        Tone::Good
    };
    let poles = match s.wrong_poles {
        _ if summary.run.pole_note.is_some() => "Poles not judged".to_owned(),
        0 => format!("No wrong pole in {} starts", s.trials),
        1 => format!("1 wrong pole in {} starts", s.trials),
        many => format!("{many} wrong poles in {} starts", s.trials),
    };
    let rms = if s.axes == 0 {
        "no axis found".to_owned()
    } else if let Some((best, _)) = &ends {
        format!("best point {}° rms", number(best.summary.rms_deg.value, 3))
    } else {
        format!("{}° rms", number(s.rms_deg.value, 3))
    };
    let mut details = vec![
        format!("Probability of a wrong pole: {} at most (97.5 %)", percent(s.wrong_pole_probability.high)),
        format!(
            "Starts without an answer: {} undetermined, {} failed ({} together)",
            s.undetermined,
            s.failed,
            percent(silent)
        ),
        format!(
            "The error exceeds {}° in {} of starts with an angle",
            s.limit_deg,
            percent(s.beyond_limit.value)
        ),
    ];
    if let Some(note) = &summary.run.pole_note {
        details.push(format!("Poles: {note}"));
    }
    if s.errors > 0 {
        details.push(format!("{} trials could not be simulated", s.errors));
    }
    if unsure && s.wrong_poles == 0 {
        details.push("Too few starts to rule out wrong poles in one of a hundred".to_owned());
    }
    if let Some((best, worst)) = ends {
        let shown = Shown::of(&summary.points);
        let told = |point: &PointSummary| {
            let s = &point.summary;
            let right = percent(right(s));
            format!(
                "{right} right, {}° rms over {} axes at {}",
                number(s.rms_deg.value, 3),
                s.axes,
                describe(point, &shown)
            )
        };
        let best_point = if 1.0 - right(&best.summary) > FAILING {
            "No point answers 99 % of its starts; nearest"
        } else {
            "Best point"
        };
        details.push(format!("{best_point}: {}", told(best)));
        details.push(format!("Worst point: {}", told(worst)));
        let without = |point: &PointSummary| 1.0 - point.summary.found as f64 / point.summary.trials as f64;
        let most = summary.points.iter().max_by(|a, b| without(a).total_cmp(&without(b)));
        if let Some(point) = most.filter(|point| without(point) > 0.0) {
            details.push(format!(
                "Most starts without an answer: {} at {}",
                percent(without(point)),
                describe(point, &shown)
            ));
        }
        details.push("Trials of the same number share their random numbers at all points; what is said of all points together is as sure as one point's trials make it".to_owned());
    }
    details.extend(summary.unreached());
    (tone, format!("{poles}; {} answered rightly; {rms}", percent(answered)), details)
}

/// The best and the worst point: by the share of right answers, then by the rms error.
fn extremes(points: &[PointSummary]) -> Option<(&PointSummary, &PointSummary)> {
    let by = |a: &&PointSummary, b: &&PointSummary| rank(&a.summary, &b.summary);
    Some((points.iter().min_by(by)?, points.iter().max_by(by)?))
}

fn describe(point: &PointSummary, shown: &[Shown]) -> String {
    let values = shown.iter().zip(point.values.values());
    let values: Vec<String> = values
        .map(|(axis, value)| format!("{} = {} {}", axis.key, axis.text(value), axis.scale.unit))
        .collect();
    let values: Vec<&str> = values.iter().map(|value| value.trim_end()).collect();
    values.join(", ")
}

fn facts(run: &Run) -> Vec<(String, String)> {
    let (file, identity) = (&run.file, &run.summary.run);
    let varied =
        |key: &str, text: String| if file.axes.contains_key(key) { "varied".to_owned() } else { text };
    let mut facts = vec![
        ("Motor", varied("motor", file.motor.name())),
        ("Method", varied("detector.method", file.detector.name().to_owned())),
        ("Errors of drive and sensors", varied("errors", file.errors.0.name().to_owned())),
        ("Rotor", varied("rotor.state", file.rotor.state.0.name().to_owned())),
        ("Trials", run.summary.summary.trials.to_string()),
        ("Seed", identity.seed.to_string()),
        ("Program", format!("Standstill {}", identity.version)),
        ("Folder", run.folder.display().to_string()),
    ];
    if !run.summary.points.is_empty() {
        let keys: Vec<&str> = file.axes.keys().map(String::as_str).collect();
        facts.insert(4, ("Axes", keys.join(", ")));
        facts.insert(5, ("Points", run.summary.points.len().to_string()));
    }
    facts.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
}

/// Every figure with its interval.
fn statistics(s: &Summary) -> Table {
    let degrees = |name: &str, e: &standstill_campaign::Estimate| {
        let [value, low, high] =
            [e.value, e.low, e.high].map(|x| if x.is_nan() { String::new() } else { number(x, 4) });
        vec![name.to_owned(), "°".to_owned(), value, low, high, String::new()]
    };
    let share = |name: &str, count: Option<u64>, e: &standstill_campaign::Estimate| {
        let [value, low, high] =
            [e.value, e.low, e.high].map(|x| if x.is_nan() { String::new() } else { number(100.0 * x, 4) });
        vec![
            name.to_owned(),
            "%".to_owned(),
            value,
            low,
            high,
            count.map_or_else(String::new, |count| count.to_string()),
        ]
    };
    let single = |name: &str, unit: &str, value: String| {
        vec![name.to_owned(), unit.to_owned(), value, String::new(), String::new(), String::new()]
    };
    let beyond = format!("Error beyond {}°, of those with an angle", s.limit_deg);
    Table {
        caption: format!("All {} trials; intervals at 95 %, exact for counts", s.trials),
        columns: vec![
            TableColumn::text("quantity"),
            TableColumn::text("unit"),
            TableColumn::number("value", ""),
            TableColumn::number("from", ""),
            TableColumn::number("to", ""),
            TableColumn::number("count", ""),
        ],
        rows: vec![
            degrees("Rms error of the axis", &s.rms_deg),
            degrees("Mean error of the axis", &s.bias_deg),
            degrees("Median of its magnitude", &s.p50_deg),
            degrees("95th percentile", &s.p95_deg),
            degrees("99th percentile", &s.p99_deg),
            single("Largest", "°", if s.max_deg.is_nan() { String::new() } else { number(s.max_deg, 4) }),
            share(&beyond, None, &s.beyond_limit),
            share("Wrong pole", Some(s.wrong_poles), &s.wrong_pole_probability),
            share("Pole undetermined", Some(s.undetermined), &s.undetermined_probability),
            share("Failed", Some(s.failed), &s.failed_probability),
            single("Furthest movement of the rotor, electrical", "°", number(s.max_moved_deg, 3)),
            single("Mean duration", "ms", number(1e3 * s.mean_duration_s, 3)),
            single("Largest current", "A", number(s.peak_current_a, 3)),
        ],
    }
}

fn reasons(s: &Summary) -> Table {
    let row = |(reason, times): (&String, &Occurrence)| {
        let p = &times.probability;
        let shares = [p.value, p.low, p.high].map(|share| number(100.0 * share, 4));
        [vec![reason.clone(), times.count.to_string()], shares.to_vec()].concat()
    };
    Table {
        caption: "Why there was no angle".to_owned(),
        columns: vec![
            TableColumn::text("reason"),
            TableColumn::number("count", ""),
            TableColumn::number("probability", "%"),
            TableColumn::number("from", "%"),
            TableColumn::number("to", "%"),
        ],
        rows: s.reasons.iter().map(row).collect(),
    }
}

fn points(points: &[PointSummary]) -> Table {
    let shown = Shown::of(points);
    let numeric = |key: &str| {
        points.iter().all(|point| point.values.get(key).is_some_and(serde_json::Value::is_number))
    };
    let axis = |axis: &Shown| {
        if numeric(&axis.key) {
            TableColumn::number(axis.key.as_str(), axis.scale.unit.as_str())
        } else {
            TableColumn::text(axis.key.as_str())
        }
    };
    let results = [
        ("trials", ""),
        ("right", "%"),
        ("rms", "°"),
        ("from", "°"),
        ("to", "°"),
        ("95 %", "°"),
        ("wrong poles", ""),
        ("at most", "%"),
        ("undetermined", ""),
        ("failed", ""),
    ];
    let columns: Vec<TableColumn> =
        shown.iter().map(axis).chain(results.map(|(name, unit)| TableColumn::number(name, unit))).collect();
    let row = |point: &PointSummary| {
        let s = &point.summary;
        let degrees = |x: f64| if x.is_nan() { String::new() } else { number(x, 4) };
        let values = shown.iter().zip(point.values.values()).map(|(axis, value)| axis.text(value));
        values
            .chain([
                s.trials.to_string(),
                number(100.0 * right(s), 2),
                degrees(s.rms_deg.value),
                degrees(s.rms_deg.low),
                degrees(s.rms_deg.high),
                degrees(s.p95_deg.value),
                s.wrong_poles.to_string(),
                number(100.0 * s.wrong_pole_probability.high, 4),
                s.undetermined.to_string(),
                (s.failed + s.errors).to_string(),
            ])
            .collect()
    };
    Table {
        caption:
            "Points of the axes; rms with its 95 % interval, wrong poles with their upper limit (97.5 %)"
                .to_owned(),
        columns,
        rows: points.iter().map(row).collect(),
    }
}

fn caption(name: &str) -> &'static str {
    match name.split('_').next() {
        Some("error") => {
            "The band holds 90 % of the errors at each angle. Wrong poles are marked at the edge."
        }
        Some("distribution") => "Wrong poles are not in it: they are counted by themselves.",
        Some("heat") => "Other axes are pooled.",
        _ => "Bars are 95 % intervals. What never happened is shown as its upper limit.",
    }
}

fn reproduce(run: &Run) -> Vec<Block> {
    let trials = run.trials.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let format = if trials.ends_with("parquet") { " --format parquet" } else { "" };
    let out = quoted(&run.folder.display().to_string());
    vec![
        Block::Text(format!(
            "The same program version writes the same bytes on any machine and any number of threads. Save the scenario as scenario.toml{}.",
            if run.summary.run.scenario.contains("has the CRC-32") {
                ", with the motor's own files where it names them"
            } else {
                ""
            }
        )),
        Block::Code {
            caption: "Commands".to_owned(),
            text: format!("standstill run scenario.toml --out {out}{format}\nstandstill report {out}"),
        },
        Block::Code { caption: "scenario.toml".to_owned(), text: run.summary.run.scenario.clone() },
    ]
}
