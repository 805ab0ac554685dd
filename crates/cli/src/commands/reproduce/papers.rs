//! `standstill reproduce --paper`: the statements of a further paper beside the numbers of this program.

use standstill_analysis::paper::{Paper, PaperError, Statement};
use standstill_analysis::witness::Witness;
use standstill_report::page::{Block, Section, Tone};

use crate::answer::{Answer, verdict};
use crate::commands::witness;
use crate::error::Error;
use crate::shell::interrupt::{self, INTERRUPTED};
use crate::shell::{Report, progress};

/// Returns the report on a paper's statements. Its exit code is 1 if a statement differs without a stated reason.
pub fn run(paper: &Paper) -> Result<Report, Error> {
    let (stop, bar) = (interrupt::flag(), progress::working("statements"));
    let found = paper.statements(&stop);
    bar.finish_and_clear();
    match found {
        Ok(found) => Ok(report(paper, &found)),
        Err(PaperError::Stopped) => {
            let text = "Interrupted: not all statements were repeated.\n".to_owned();
            Ok(Report { text, code: INTERRUPTED })
        }
        Err(error) => Err(Error::Paper(error)),
    }
}

fn report(paper: &Paper, found: &[Statement]) -> Report {
    let holding = found.iter().filter(|statement| statement.witness.holds()).count();
    let code = u8::from(!found.iter().all(Statement::is_as_expected));
    let tone = match (code, holding == found.len()) {
        (0, true) => Tone::Good,
        (0, false) => Tone::Warning,
        _ => Tone::Bad,
    };
    let headline = format!("{holding} of {} statements are reproduced", found.len());
    // Statements with the same reason share it.
    let differing = found.iter().filter(|statement| !statement.witness.holds()).collect::<Vec<_>>();
    let shared = differing.chunk_by(|one, other| one.because == other.because).map(|same| {
        let claims: Vec<&str> = same.iter().map(|statement| statement.witness.claim.as_str()).collect();
        let why = same[0].because.unwrap_or("no reason is known");
        format!("{}: not reproduced; {why}", claims.join("; "))
    });
    let assumed = paper.assumed.iter().map(|assumed| format!("assumed: {assumed}"));
    let details = shared.chain(assumed).collect();
    let witnesses: Vec<Witness> = found.iter().map(|statement| statement.witness.clone()).collect();
    let blocks = vec![
        verdict(tone, headline, details),
        Block::Table(witness::table(&witnesses, "computed by")),
        Block::Text(
            "Known: the paper's number; here: this program's. docs/notes/witnesses.md has the scenarios."
                .to_owned(),
        ),
    ];
    let sections = vec![Section::new("Answer", blocks)];
    let setting = paper.citation.to_owned();
    let answer = Answer { setting, sections, ..Answer::default() };
    Report { text: answer.text(), code }
}
