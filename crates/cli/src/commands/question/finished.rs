//! Finished answers, of which `--resume` prints the text again without computing anything.

use std::fmt::Write as _;
use std::path::Path;

use serde::{Deserialize, Serialize};
use standstill_files::read_text;
use standstill_report::page::Block;

use crate::answer::{Answer, Next};
use crate::error::Error;
use crate::shell::Report;
use crate::shell::output::file_list;

/// Key under which the JSON of an answer has the answer's text.
pub const KEY: &str = "said";

/// The text of an answer, as stored in its JSON. Only the page has the tables and figures.
#[derive(Debug, Serialize, Deserialize)]
pub struct Said {
    setting: String,
    headline: String,
    details: Vec<String>,
    next: Vec<Next>,
    code: u8,
}

impl Said {
    pub fn of(answer: &Answer) -> Self {
        let mut said = Self {
            setting: answer.setting.clone(),
            headline: String::new(),
            details: Vec::new(),
            next: answer.next.clone(),
            code: answer.code,
        };
        let mut blocks = answer.sections.iter().flat_map(|section| &section.blocks);
        if let Some(Block::Verdict { headline, details, .. }) =
            blocks.find(|block| matches!(block, Block::Verdict { .. }))
        {
            said.headline.clone_from(headline);
            said.details.clone_from(details);
        }
        said
    }

    fn text(&self) -> String {
        let Self { setting, headline, details, .. } = self;
        let mut text = String::new();
        for line in [setting, headline].into_iter().filter(|line| !line.is_empty()) {
            let _ = writeln!(text, "{line}");
        }
        text.extend(details.iter().map(|detail| format!("  {detail}\n")));
        text
    }
}

/// Returns the report of a finished answer with this name in a folder. The caller must check that the answer belongs to the same question.
/// None if there is no finished answer, or if an older version stored it without its text.
///
/// # Errors
/// The answer cannot be read.
pub fn report(folder: &Path, name: &str, as_json: bool) -> Result<Option<Report>, Error> {
    #[derive(Deserialize)]
    struct Kept {
        said: Said,
    }
    let files = ["csv", "json", "html", "svg", "png"].map(|kind| format!("{name}.{kind}"));
    let [csv, json, html] = [0, 1, 2].map(|file: usize| folder.join(&files[file]));
    if ![&csv, &json, &html].into_iter().all(|file| file.is_file()) {
        return Ok(None);
    }
    let text = read_text(&json).map_err(|error| Error::Read(json, error))?;
    let Ok(Kept { said }) = serde_json::from_str::<Kept>(&text) else { return Ok(None) };
    if as_json {
        return Ok(Some(Report { text, code: said.code }));
    }
    let there: Vec<String> = files.into_iter().filter(|file| folder.join(file).is_file()).collect();
    let list = file_list(folder, &there);
    let text = format!("{}\nThis is the finished answer; nothing was computed again.\n{list}", said.text());
    Ok(Some(Report { text: text + &crate::answer::next_lines(&said.next), code: said.code }))
}
