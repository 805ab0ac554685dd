//! `standstill faults`: the effect of each failure mode on each method: answers, wrong poles, and whether the fault is
//! detected.

mod rates;
mod refused;
mod row;
mod table;
mod words;

use std::path::Path;

use serde_json::json;
use standstill_analysis::faults::{Allowed, Begins, Counts, Entry, duration, study};
use standstill_detect::{MethodName, Settings as _};
use standstill_plant::Digest;
use standstill_report::page::Block;
use standstill_scenario::{Document, FaultMode, Origin, Plan, ScenarioFile};

use self::rates::Rates;
use self::refused::Left;
use self::row::{Row, with};
use self::words::Subject;
use super::question::{Asked, again, document, plan_of, setting, silence};
use crate::answer::{Answer, Records, verdict};
use crate::arguments::Faults as Options;
use crate::error::Error;
use crate::shell::values::each_once;
use crate::shell::{NOT_SHOWN, Report};

/// Number of trials of each fault with each method. If no trial has a wrong pole, the one-sided 95 % upper bound of the probability of a
/// wrong pole is 0.1 %.
const TRIALS: u64 = 3000;

/// Name of the entry in the question's identity that holds the digest of the file of rates.
const RATES: &str = "digest of --rates";

pub fn run(options: &Options) -> Result<Report, Error> {
    let question = &options.question;
    let document = document(question)?;
    let plan = plan_of(document.clone())?;
    let scenario = plan.scenario(0)?;
    let file = plan.file();
    let trials = options.trials.unwrap_or(TRIALS);
    let allowed = Allowed::of(file, &scenario);
    let rates = options.rates.as_deref().map(Rates::read).transpose()?;
    let methods: Vec<Option<MethodName>> = match &options.method[..] {
        [] => vec![None],
        given => each_once(given.iter().copied()).into_iter().map(Some).collect(),
    };
    refused::has_room(options, &plan)?;
    let (entries, left) = entries(options, &plan);
    refused::are_studied(options, &entries, &left, rates.as_ref())?;
    let count = (entries.len() * methods.len()) as u64 * trials;
    let names = |of: Vec<&str>| (!of.is_empty()).then(|| of.join(", "));
    let named = [
        ("--mode", names(options.mode.iter().map(|mode| mode.name()).collect())),
        ("--begins", names(options.begins.iter().map(|begins| begins.name()).collect())),
        ("--pairs", options.pairs.then(|| "each two modes".to_owned())),
        ("--method", names(options.method.iter().map(|method| method.name()).collect())),
        ("--trials", Some(trials.to_string())),
        ("--rates", options.rates.as_ref().map(|path| path.to_string_lossy().into_owned())),
        (RATES, options.rates.as_ref().map(|path| digest(path)).transpose()?),
    ];
    let asked = match Asked::new(question, "faults", &plan, named, count)? {
        Ok(asked) => asked,
        Err(finished) => return Ok(finished),
    };
    // All scenarios are built before the first trial, so that a mistake in a fault or method is reported early.
    let mut studies = Vec::new();
    for method in &methods {
        let (document, name) = with_method(&document, file, *method)?;
        let (whole, _) = Entry::whole().plans(&plan, &document)?;
        let during = entries.iter().any(|entry| entry.begins != Begins::Before);
        let lasts = if during { duration(&whole)? } else { 0.0 };
        for entry in &entries {
            let entry = entry.over(lasts);
            let plans = entry.plans(&plan, &document)?;
            let detector = plans.0.scenario(0)?.detector;
            let row = Row {
                entry,
                method: name.clone(),
                by_name: *method,
                counts: Counts::default(),
                has_checks: plans.1.is_some(),
                reads_current: detector.sources().iter().any(|source| source.is_current()),
                in_sectors: detector.half_sector().is_some(),
            };
            studies.push((row, plans));
        }
    }
    let mut rows = Vec::new();
    let found = asked.run(|| {
        for (row, (broken, unchecked)) in studies {
            asked.watched.bar.set_message(format!("{}: {}", row.method, row.fault()));
            let key = format!("{} {}", row.method, row.entry.arguments().join(" "));
            let counts = study(&key, (&broken, unchecked.as_ref()), trials, allowed, &asked.watched)?;
            rows.push(Row { counts, ..row });
        }
        Ok(())
    })?;
    if found.is_none() {
        let total = entries.len() * methods.len();
        return Ok(asked.interrupted(&format!("{} of {total} faults were studied", rows.len())));
    }
    let own = setting(file, &scenario);
    // If the user names methods, the scenario's own method is not studied.
    let names: Vec<&str> = methods.iter().flatten().map(|method| method.name()).collect();
    let between = |method: &str| format!(", {method}, ");
    let of_scenario = if names.is_empty() {
        own
    } else {
        own.replacen(&between(file.detector.name()), &between(&names.join(" and ")), 1)
    };
    let subject = Subject {
        asked: again(question),
        rates: rates.as_ref(),
        allowed,
        has_own: !file.faults.is_empty(),
        has_magnet: scenario.motor.has_magnet(),
        has_poles: scenario.motor.has_magnet() && !plan.pole_is_open(),
    };
    let answer = answer(of_scenario, &subject, &rows, &left);
    let is_mute = rows.iter().any(words::is_mute);
    let answer = if is_mute { silence::lead(answer, question, plan.file()) } else { answer };
    asked.answer(&scenario, answer)
}

/// Returns the digest of the file of rates. The weighted sums of an answer depend on this file.
fn digest(path: &Path) -> Result<String, Error> {
    Ok(Digest::of_file(path).map_err(|error| Error::Read(path.to_owned(), error))?.to_string())
}

/// Returns the entries to study and the faults that the drive cannot have. The first entry is the drive without a fault.
fn entries(options: &Options, plan: &Plan) -> (Vec<Entry>, Vec<Left>) {
    let (mut entries, mut left) = (vec![Entry::whole()], Vec::new());
    let modes = if options.mode.is_empty() {
        FaultMode::ALL.to_vec()
    } else {
        each_once(options.mode.iter().copied())
    };
    let before = plan.file().faults.len();
    let Ok(scenario) = plan.scenario(0) else { return (entries, left) };
    for mode in modes {
        if let Some(reason) = mode.lacks_usual(&scenario) {
            left.push(Left { mode, reason: reason.to_owned() });
            continue;
        }
        let usual = Entry::usual(mode, &scenario, before);
        let asked = |begins: &Begins| options.begins.is_empty() || options.begins.contains(begins);
        let ways = Entry::ways(mode).filter(asked);
        entries.extend(ways.map(|begins| Entry { begins, ..usual.clone() }));
    }
    if options.pairs {
        let single: Vec<FaultMode> = entries.iter().filter_map(Entry::weighed).collect();
        for (number, first) in single.iter().enumerate() {
            let pairs = single[number + 1..].iter().map(|second| [*first, *second]);
            entries.extend(pairs.map(|pair| Entry::pair(pair, &scenario, before)));
        }
    }
    (entries, left)
}

/// Returns the document with the given method and the name of this method. If no method is given, returns the document unchanged with its
/// own method's name.
fn with_method(
    document: &Document,
    file: &ScenarioFile,
    method: Option<MethodName>,
) -> Result<(Document, String), standstill_scenario::FileError> {
    let Some(method) = method else { return Ok((document.clone(), file.detector.name().to_owned())) };
    let mut document = document.clone();
    for key in ["detector.library", "detector.config"] {
        document.remove(key);
    }
    document.set_value("detector.method", method.name().into(), Origin::Option("--method"))?;
    Ok((document, method.name().to_owned()))
}

fn answer(setting: String, of: &Subject<'_>, rows: &[Row], left: &[Left]) -> Answer {
    let Subject { asked, rates, allowed, .. } = of;
    let (tone, headline) = words::headline(rows);
    let mut details = words::details(of, rows);
    details.extend(weights(rows, *rates));
    let next = words::worst(rows).and_then(|(row, _)| row.worst_command(asked));
    let rate = |row: &Row| rates.and_then(|rates| rates.of(row.entry.weighed()));
    let records: Records = rows.iter().map(|row| row.record(rate(row), asked)).collect();
    let json = json!({
        "demand": { "error_deg": allowed.error_deg, "moved_deg": allowed.moved_deg, "current_A": allowed.current },
        "rows": records,
        "not_studied": left.iter().map(|left| json!({ "mode": left.mode.name(), "needed": left.reason })).collect::<Vec<_>>(),
    });
    let mut blocks = vec![Block::Table(table::of(rows)), Block::Text(table::LEGEND.join("\n\n"))];
    if !left.is_empty() {
        let of = |left: &Left| format!("{}: needs {}", left.mode.name(), left.reason);
        blocks.push(Block::Text("Faults that this drive cannot have:".to_owned()));
        blocks.push(Block::List(left.iter().map(of).collect()));
    }
    let verdict = verdict(tone, headline, details);
    let answer =
        Answer::new("faults", "What each failure mode leads to".to_owned(), setting, verdict, blocks);
    let code = if words::is_silent(rows) { NOT_SHOWN } else { 0 };
    let answer = Answer { json, csv: Some(records), code, ..answer };
    let answer = match next {
        Some(command) => answer.next("to see the worst start", command),
        None => answer,
    };
    if code == NOT_SHOWN {
        return answer;
    }
    // If there are several methods, the one with the most dangerous answers is named.
    let asked_about = rows.iter().rev().max_by_key(|row| row.counts.undetected()).and_then(|row| row.by_name);
    let (purpose, event) = if of.has_poles {
        ("how rare a wrong pole is", "wrong-pole".to_owned())
    } else {
        ("how rare such an axis is", format!("'|e| > {} deg'", allowed.error_deg))
    };
    let purpose = format!("{purpose} {}", words::beside(of.has_own));
    answer.next(&purpose, format!("standstill odds {asked}{} --event {event}", with(asked_about)))
}

/// Returns the sentences on the weighted sums, on failure modes without a rate, and on failure modes that were not studied.
fn weights(rows: &[Row], rates: Option<&Rates>) -> Vec<String> {
    let Some(rates) = rates else {
        return vec!["unweighted: --rates FILE takes a table of failure rates".to_owned()];
    };
    let mut lines: Vec<String> = rates.weighted(rows).iter().map(rates::Weighted::said).collect();
    let [unstudied, without] = rates.missing(rows);
    let listed =
        |names: Vec<&str>, what: &str| (!names.is_empty()).then(|| format!("{what}: {}", names.join(", ")));
    lines.extend(listed(unstudied, "rates of modes that were not studied, left out of the sums"));
    lines.extend(listed(without, "modes without a rate, left out of the sums"));
    if rows.iter().any(|row| row.entry.modes.len() > 1) {
        lines.push("pairs of faults have no rate and are left out of the sums".to_owned());
    }
    lines
}
