//! `standstill faults`: the effect of each failure mode on each method: answers, wrong poles, and whether the fault is
//! detected.

mod rates;
mod refused;
mod table;
mod words;

use std::path::Path;

use serde_json::json;
use standstill_analysis::faults::{Allowed, Begins, Counts, Entry, duration, reasons_that_name, study};
use standstill_campaign::Estimate;
use standstill_detect::MethodName;
use standstill_plant::Digest;
use standstill_report::page::Block;
use standstill_scenario::{Document, FaultMode, Origin, Plan, ScenarioFile};

use self::rates::Rates;
use super::question::{Asked, again, document, plan_of, setting, silence};
use crate::answer::{Answer, Record, Records, verdict};
use crate::arguments::Faults as Options;
use crate::error::Error;
use crate::shell::command_line::{quoted, set_pair};
use crate::shell::values::each_once;
use crate::shell::{NOT_SHOWN, Report};

/// Number of trials of each fault with each method. If no trial has a wrong pole, the one-sided 95 % upper bound of the probability of a
/// wrong pole is 0.1 %.
const TRIALS: u64 = 3000;

/// A row of the answer: one fault with one method.
struct Row {
    entry: Entry,
    method: String,
    /// The method if `--method` names it. None for the scenario's own method.
    by_name: Option<MethodName>,
    counts: Counts,
    /// True if the method has checks that can be switched off.
    has_checks: bool,
    /// True if the method answers with sectors. An error is then the angle between the rotor and the border of the sector, for a rotor
    /// outside the sector.
    in_sectors: bool,
}

/// A fault that the drive cannot have, with the reason.
struct Left {
    mode: FaultMode,
    reason: String,
}

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
            let row = Row {
                entry,
                method: name.clone(),
                by_name: *method,
                counts: Counts::default(),
                has_checks: plans.1.is_some(),
                in_sectors: plans.0.scenario(0)?.detector.half_sector().is_some(),
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

impl Row {
    /// Returns the fault and its onset in words.
    fn fault(&self) -> String {
        let name = self.name();
        match self.entry.begins {
            Begins::Before => name,
            Begins::During => format!("{name}, during"),
            Begins::Briefly => format!("{name}, 50 µs"),
        }
    }

    fn name(&self) -> String {
        self.entry.name().unwrap_or_else(|| "as it is".to_owned())
    }

    /// Returns the most frequent reason why starts have no answer. Empty if all starts have an answer.
    fn reason(&self) -> String {
        let most = self.counts.unanswered.iter().max_by_key(|(_, count)| **count);
        most.map_or_else(String::new, |(reason, _)| reason.clone())
    }

    /// Returns the number of starts without an answer whose reason names the faulty part. None if there is no reason that names this part.
    fn rightly(&self) -> Option<u64> {
        let named: Vec<&str> =
            self.entry.modes.iter().flat_map(|mode| reasons_that_name(*mode)).copied().collect();
        (!named.is_empty()).then(|| self.counts.ended_by(&named))
    }

    /// Returns the command that shows the worst start. `asked` is the scenario with its keys. None if no answer is dangerous.
    fn worst_command(&self, asked: &str) -> Option<String> {
        let worst = self.counts.worst?;
        let keys: String = self.entry.arguments().iter().map(|pair| set_pair(pair)).collect();
        // The scenario may set fewer trials than were studied.
        let trials = set_pair(&format!("trials={}", self.counts.trials));
        let folder = quoted(&format!("trace-{}-{}", self.fault().replace(' ', "-"), worst.trial));
        let method = with(self.by_name);
        Some(format!("standstill trace {asked}{method}{keys}{trials} --trial {} --out {folder}", worst.trial))
    }

    fn record(&self, rate: Option<f64>, asked: &str) -> Record {
        let of = &self.counts;
        let coverage = of.coverage().unwrap_or(Estimate::UNKNOWN);
        Record::default()
            .with("method", &self.method)
            .with("failure_mode", self.name())
            .with("begins", self.entry.name().map(|_| self.entry.begins.name()))
            .with("magnitude", self.entry.arguments().join(" "))
            .with("effect", self.effect())
            .with("trials", of.trials)
            .with("right", of.right)
            .with("wrong_pole", of.wrong_pole)
            .with("wrong_pole_at_most", of.wrong_pole_bound())
            .with("right_pole_beyond_limit", of.beyond)
            .with("undetected_at_most", of.undetected_bound())
            .with("moved", of.moved)
            .with("overcurrent", of.overcurrent)
            .with("detected", of.detected())
            .with("undetermined", of.undetermined)
            .with("errors", of.errors)
            .with("detected_by", self.reason())
            .with("detected_rightly", self.rightly())
            .with("mean_reaction_s", of.reactions.mean())
            .with("longest_reaction_s", of.reactions.worst())
            .with("detected_without_checks", self.has_checks.then_some(of.refused_without))
            .with("refused_share", of.refused_share().map(|of| of.value))
            .with("refused_share_at_least", of.refused_share().map(|of| of.low))
            .with("dangerous_without_checks", self.has_checks.then_some(of.dangerous))
            .with("dangerous_and_detected", self.has_checks.then_some(of.caught))
            .with("coverage", coverage.value)
            .with("coverage_at_least", coverage.low)
            .with("worst_error_deg", of.worst.map(|worst| worst.error_deg))
            .with("worst_trial", of.worst.map(|worst| worst.trial))
            .with("worst_command", self.worst_command(asked))
            .with("reasons", json!(of.unanswered).to_string())
            .with("rate", rate)
            .with("wrong_pole_rate_at_most", rate.map(|rate| rate * of.wrong_pole_bound()))
    }

    /// Returns the effect of the fault in the sense of a failure-mode and effects analysis. None for the drive without a fault.
    fn effect(&self) -> Option<String> {
        self.entry.name()?;
        let of = &self.counts;
        let answers = if of.wrong_pole > 0 {
            Some("wrong pole")
        } else if of.beyond > 0 {
            Some(if self.in_sectors {
                "angle beyond the limit and the sector"
            } else {
                "angle beyond the limit"
            })
        } else if of.detected() == of.trials {
            Some("no start")
        } else if of.detected() > 0 {
            Some("no start in some")
        } else {
            None
        };
        let moved = (of.moved > 0).then_some("movement beyond the limit");
        let current = (of.overcurrent > 0).then_some("current beyond the limit");
        let all: Vec<&str> = [answers, moved, current].into_iter().flatten().collect();
        Some(if all.is_empty() { "none (latent)".to_owned() } else { all.join("; ") })
    }
}

/// Formats `count` / `total` in per cent: two decimals below 10 %, one decimal from 10 % on.
fn percent(count: u64, total: u64) -> String {
    match (count, 100.0 * count as f64 / total.max(1) as f64) {
        (0, _) => "0".to_owned(),
        (_, share) if share < 10.0 => format!("{share:.2}"),
        (_, share) => format!("{share:.1}"),
    }
}

/// The question that the rows of the table answer.
struct Subject<'a> {
    /// The scenario with its keys, for a command line.
    asked: String,
    rates: Option<&'a Rates>,
    allowed: Allowed,
    /// True if the scenario itself has faults. They are then present in each row.
    has_own: bool,
    has_magnet: bool,
    /// True if the motor has a magnet and its data show which pole is which.
    has_poles: bool,
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

/// Returns the command-line option that sets the method of a row. Empty for the scenario's own method.
fn with(method: Option<MethodName>) -> String {
    method.map_or(String::new(), |method| format!(" -s detector.method={}", method.name()))
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
