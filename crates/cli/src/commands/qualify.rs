//! `standstill qualify`: whether a list of requirements is met, with the evidence for an assessor.

mod advice;
mod junit;
mod manifest;
#[cfg(test)]
mod tests;
mod words;

use standstill_analysis::Halt;
use standstill_analysis::qualify::{Case, Qualification, Requirements, Verdict};
use standstill_analysis::witness::Witness;

use standstill_files::read_text;
use standstill_plant::Digest;
use standstill_report::page::{Block, Column, Section, Table, Tone};
use standstill_scenario::quoted as nearest;

use self::words::Words;
use super::question::{Asked, document, plan_of, setting};
use super::witness;
use crate::answer::{Answer, verdict};
use crate::arguments::Qualify as Options;
use crate::error::Error;
use crate::shell::{NOT_SHOWN, Report};

/// Exit code if a requirement failed.
const FAILED: u8 = 1;

pub fn run(options: &Options) -> Result<Report, Error> {
    let question = &options.question;
    let document = document(question)?;
    let plan = plan_of(document.clone())?;
    let path = &options.requirements;
    let text = read_text(path).map_err(|error| Error::Read(path.clone(), error))?;
    let requirements = Requirements::parse(path, &text)?;
    let asked_for = only(options, &requirements)?;
    let digest = Digest::of(text.as_bytes()).to_string();
    let named = [
        (&*path.to_string_lossy(), Some(digest.clone())),
        ("--only", (!options.only.is_empty()).then(|| options.only.join(", "))),
        ("--no-witness", options.no_witness.then(String::new)),
    ];
    // All cases are built before the first trial, so that a mistake in one of them is reported early.
    let mut found = Qualification::new(requirements, &plan, &document)?;
    let asked = match Asked::new(question, "qualify", &plan, named, 0)? {
        Ok(asked) => asked,
        Err(finished) => return Ok(finished),
    };
    let (watched, bar) = (&asked.watched, &asked.watched.bar);
    let mut heard: Result<Option<Vec<Witness>>, Error> = Ok(None);
    let ended = asked.run(|| {
        found.judge(watched, &|number| asked_for.contains(&number), |of, case| {
            bar.set_message(progress(of, case));
        })?;
        if !options.no_witness {
            bar.set_message("witnesses");
            heard = witness::hear(watched.flag(), |group| bar.set_message(format!("witnesses: {group}")));
            if let Ok(None) = heard {
                return Err(Halt::Stopped);
            }
        }
        Ok(())
    })?;
    if ended.is_none() {
        let decided = asked_for.iter().filter(|number| found.verdict(**number) != Verdict::NotShown).count();
        return Ok(asked.interrupted(&format!("{decided} of {} requirements were decided", asked_for.len())));
    }
    let heard = heard?;
    let silent = heard.iter().flatten().filter(|witness| !witness.holds()).collect();
    let words = Words { found: &found, asked: &asked_for, question, requirements: path, silent };
    let scenario = plan.scenario(0)?;
    let manifest = manifest::of(&plan, path, &digest, asked.identity())?;
    asked.answer(&scenario, answer(&words, setting(plan.file(), &scenario), manifest, heard.as_deref()))
}

/// Returns the indices of the requirements that `--only` names, in ascending order. Without this option, returns the indices of all
/// requirements.
fn only(options: &Options, requirements: &Requirements) -> Result<Vec<usize>, Error> {
    let place = |id: &String| {
        let ids = || requirements.list.iter().map(|requirement| requirement.id.as_str());
        ids().position(|known| known == id).ok_or_else(|| {
            let known = ids().collect::<Vec<_>>().join(", ");
            let found = nearest(id, ids());
            Error::Arguments(format!(
                "--only: found {found}, needed an id of {}: {known}",
                options.requirements.display()
            ))
        })
    };
    match &options.only[..] {
        [] => Ok((0..requirements.list.len()).collect()),
        given => {
            let mut numbers = given.iter().map(place).collect::<Result<Vec<_>, _>>()?;
            numbers.sort_unstable();
            numbers.dedup();
            Ok(numbers)
        }
    }
}

fn progress(of: &Qualification, number: usize) -> String {
    let case: &Case = &of.cases[number];
    format!("case {} of {}: {}", number + 1, of.cases.len(), words::case(case))
}

fn answer(
    words: &Words<'_>,
    setting: String,
    manifest: serde_json::Value,
    witnesses: Option<&[Witness]>,
) -> Answer {
    let found = words.found;
    let of = |verdict| words.asked.iter().filter(|number| found.verdict(**number) == verdict).count();
    let [passed, failed, open] = [Verdict::Passed, Verdict::Failed, Verdict::NotShown].map(of);
    let silent = !words.silent.is_empty();
    let (tone, code) = match () {
        () if failed > 0 || silent => (Tone::Bad, FAILED),
        () if open > 0 => (Tone::Warning, NOT_SHOWN),
        () => (Tone::Good, 0),
    };
    let headline =
        format!("{passed} of {} requirements passed, {failed} failed, {open} not shown", words.asked.len());
    let mut details = vec![words.confidence()];
    details.extend(
        silent.then(|| "a witness does not hold: this program or machine computes other numbers".to_owned()),
    );
    let columns = [
        Column::word("requirement"),
        Column::word("verdict"),
        Column::prose("limit"),
        Column::prose("shown"),
        Column::number("trials"),
    ];
    let rows = words.asked.iter().map(|number| words.row(*number));
    let mut blocks = vec![Block::Table(Table::new(columns).rows(rows))];
    blocks.extend(words.next());
    let mut json = words.json();
    json["manifest"] = manifest;
    json["annex"] = manifest::annex(found, witnesses);
    let sign = words.sheet(&headline, &setting, &json["manifest"], witnesses).html();
    let records = words.records();
    let answer =
        Answer::new("qualify", "Qualification".to_owned(), setting, verdict(tone, headline, details), blocks);
    let mut answer = Answer {
        json,
        csv: Some(records),
        code,
        files: vec![
            ("qualify-junit.xml", junit::suite(words).into_bytes()),
            ("qualify-sign.html", sign.into_bytes()),
        ],
        ..answer
    };
    answer.sections.extend(manifest::sections(found, witnesses).into_iter().map(Section::aside));
    answer
}
