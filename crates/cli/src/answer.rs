//! The answer of a command as a value, which is built once and then written as text, page, JSON and CSV.

mod records;

use std::fmt::Write as _;
use std::io::Write;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use serde_json::Value;
use standstill_report::figure::Figure;
use standstill_report::page::{Block, Chart, Page, Section, Tone};
use standstill_table::TableError;

pub use self::records::{Record, Records};
use crate::error::Error;
use crate::shell::Report;
use crate::shell::asked::NotedQuestion;
use crate::shell::command_line::once;
use crate::shell::output::{Output, file_list};
use crate::shell::setup::Setup;
use crate::shell::table::Print as _;
use crate::shell::terminal::paragraph;

/// The answer of a command.
#[derive(Default)]
#[must_use]
pub struct Answer {
    /// Base name of the answer's files.
    pub name: &'static str,
    /// Title of the HTML page.
    pub title: String,
    /// Motor, method and conditions, which are the first paragraph of the text and the subtitle of the page.
    pub setting: String,
    /// Sections of the answer: verdict, tables and sentences.
    pub sections: Vec<Section>,
    /// Figures, each with its file name and caption.
    pub figures: Vec<(String, Figure, String)>,
    /// The numbers as JSON.
    pub json: Value,
    /// Rows of the CSV file. None for an answer whose only files are the page and its figures.
    pub csv: Option<Records>,
    /// Further files, each with name and content.
    pub files: Vec<(&'static str, Vec<u8>)>,
    /// Commands that are possible next. They are the last lines of the text and the last section of the page's answer.
    pub next: Vec<Next>,
    /// Exit code of the command.
    pub code: u8,
}

/// A command that is possible after an answer.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Next {
    /// Purpose of the command as a phrase, such as `to see the worst start`, the simulated motor start with the largest error.
    pub purpose: String,
    /// Command line.
    pub command: String,
}

/// Data that the page and the files of an answer need in addition to the answer itself: scenario, command lines, question and long tables.
#[derive(Default)]
pub struct Made<'a> {
    /// The scenario. None for an answer about several scenarios.
    pub setup: Option<Setup<'a>>,
    /// Subtitle of the page. It is used if the answer's text begins with the verdict, so that the text itself has no subtitle.
    pub subtitle: String,
    /// Facts that the page lists after the facts of the scenario. Each has a name and a value.
    pub facts: Vec<(String, String)>,
    /// Command lines that reproduce the answer.
    pub command: String,
    /// The question that the files answer. It is stored in a file beside them. None if the JSON of the answer contains the question.
    pub asked: Option<NotedQuestion>,
    /// Tables that are too long for memory; they are written before all other files.
    pub tables: Vec<TableFile<'a>>,
}

/// A file that is written row by row.
pub struct TableFile<'a> {
    /// Name of the file.
    pub name: String,
    /// Function that writes the file's rows.
    pub rows: Box<Rows<'a>>,
}

/// Function that writes the rows of a table.
type Rows<'a> = dyn Fn(&mut (dyn Write + Send)) -> Result<(), TableError> + 'a;

impl Answer {
    /// Makes an answer from a verdict and the blocks below it.
    pub fn new(
        name: &'static str,
        title: String,
        setting: String,
        verdict: Block,
        blocks: Vec<Block>,
    ) -> Self {
        let sections = vec![Section::new("Answer", std::iter::once(verdict).chain(blocks))];
        Self { name, title, setting, sections, ..Self::default() }
    }

    /// Adds a figure with its caption.
    pub fn with(mut self, name: impl Into<String>, figure: Figure, caption: impl Into<String>) -> Self {
        self.figures.push((name.into(), figure, caption.into()));
        self
    }

    /// Adds a command that is possible next, with its purpose.
    pub fn next(mut self, purpose: impl Into<String>, command: impl Into<String>) -> Self {
        self.next.push(Next { purpose: purpose.into(), command: once(&command.into()) });
        self
    }

    /// Returns the text for terminals.
    pub fn text(&self) -> String {
        let mut text = String::new();
        if !self.setting.is_empty() {
            let _ = writeln!(text, "{}", self.setting);
        }
        text + &sections(&self.sections)
    }

    /// Writes the answer's files if `folder` is given. Returns the text to print, which is the JSON if `as_json` is true.
    pub fn report(self, folder: Option<PathBuf>, as_json: bool, made: &Made<'_>) -> Result<Report, Error> {
        let (code, json) = (self.code, format!("{:#}\n", self.json));
        let mut text = if as_json { String::new() } else { self.text() };
        let next = self.next.clone();
        if let Some(folder) = folder {
            let files = self.files(&folder, &json, made)?;
            let _ = write!(text, "\n{}", file_list(&folder, &files));
        }
        if !as_json && !next.is_empty() {
            gap(&mut text);
            text += next_lines(&next).trim_start();
        }
        Ok(Report { text: if as_json { json } else { text }, code })
    }

    /// Returns the names of the files of this answer.
    fn names(&self) -> Vec<String> {
        let data = if self.csv.is_some() { &["csv", "json", "html"][..] } else { &["html"] };
        let mut names: Vec<String> = data.iter().map(|kind| format!("{}.{kind}", self.name)).collect();
        for (name, ..) in &self.figures {
            names.extend(["svg", "png"].map(|kind| format!("{name}.{kind}")));
        }
        names.extend(self.files.iter().map(|(name, _)| (*name).to_owned()));
        names
    }

    fn files(mut self, folder: &std::path::Path, json: &str, made: &Made<'_>) -> Result<Vec<String>, Error> {
        let names = self.names();
        let tables = made.tables.iter().map(|table| table.name.as_str());
        let all: Vec<&str> = tables.chain(names.iter().map(String::as_str)).collect();
        let mut output = match &made.asked {
            Some(asked) => Output::answering(asked.clone(), folder, &all)?,
            None => Output::create(folder, &all)?,
        };
        for TableFile { name, rows } in &made.tables {
            let mut file = output.begin(name)?;
            rows(&mut file).map_err(|error| Error::table(&folder.join(name), error))?;
            output.close(name, file)?;
        }
        if let Some(rows) = &self.csv {
            let csv = rows.csv().map_err(Error::writing(&folder.join(&names[0])))?;
            output.file(&names[0], &csv)?;
            output.file(&names[1], json.as_bytes())?;
        }
        for (name, figure, _) in &self.figures {
            output.figure(name, figure)?;
        }
        for (name, content) in &self.files {
            output.file(name, content)?;
        }
        let html = format!("{}.html", self.name);
        let figures = std::mem::take(&mut self.figures);
        output.file(&html, self.page(figures, made).html().map_err(Error::Page)?.as_bytes())?;
        output.finish()
    }

    /// Makes the HTML page, with the figures after the first section and the scenario at the end.
    pub fn page(self, figures: Vec<(String, Figure, String)>, made: &Made<'_>) -> Page {
        let mut sections = self.sections;
        // The name of a figure may contain a key with dots; an id of the page must have none.
        let id = |name: &str| name.replace(|c: char| !c.is_ascii_alphanumeric() && c != '_', "-");
        let chart = |(name, figure, caption): (String, Figure, String)| {
            Block::Chart(Chart { id: format!("chart-{}", id(&name)), figure, caption })
        };
        if !figures.is_empty() {
            sections.insert(1.min(sections.len()), Section::new("Figures", figures.into_iter().map(chart)));
        }
        let heading = made.setup.as_ref().and_then(Setup::heading).unwrap_or_default();
        let facts: Vec<_> = heading.into_iter().chain(made.facts.iter().cloned()).collect();
        if let Some(first) = sections.first_mut().filter(|_| !facts.is_empty()) {
            first.blocks.push(Block::Facts(facts));
        }
        if !self.next.is_empty() {
            let code = |Next { purpose, command }| Block::Code { caption: purpose, text: command + "\n" };
            sections.push(Section::new("What next", self.next.into_iter().map(code)));
        }
        if let Some(setup) = &made.setup {
            sections.extend([setup.section(), setup.reproduce(&made.command)]);
        }
        let footer = format!("Standstill {}", env!("CARGO_PKG_VERSION"));
        let subtitle = self.setting + &made.subtitle;
        Page { title: self.title, subtitle, sections, footer }
    }
}

/// Formats the proposed next commands as text for terminals. The text begins with an empty line. It is empty if there are no commands.
pub fn next_lines(next: &[Next]) -> String {
    let lines = next.iter().map(|Next { purpose, command }| format!("  {purpose}\n    {command}\n"));
    let lines: String = lines.collect();
    if lines.is_empty() { lines } else { format!("\nWhat next:\n{lines}") }
}

/// Makes the block of a verdict.
pub fn verdict(tone: Tone, headline: impl Into<String>, details: Vec<String>) -> Block {
    Block::Verdict { tone, headline: headline.into(), details }
}

/// Formats sections as text for terminals. Sections that are meant for the page only are left out.
pub fn sections(sections: &[Section]) -> String {
    let mut text = String::new();
    for (k, section) in sections.iter().filter(|section| !section.aside).enumerate() {
        if k > 0 {
            gap(&mut text);
        }
        blocks(&mut text, &section.blocks);
    }
    text
}

/// Appends an empty line. Does nothing if the text is empty or already ends with an empty line.
fn gap(text: &mut String) {
    if !text.is_empty() && !text.ends_with("\n\n") {
        text.push('\n');
    }
}

/// Appends blocks as text for terminals. The lines of a verdict are not wrapped, because programs search for them.
fn blocks(text: &mut String, all: &[Block]) {
    for block in all {
        match block {
            Block::Verdict { headline, details, .. } => {
                let _ = writeln!(text, "{headline}");
                text.extend(details.iter().map(|detail| format!("  {detail}\n")));
            }
            Block::Facts(facts) => {
                text.extend(facts.iter().map(|(name, value)| format!("  {name:<24} {value}\n")));
            }
            Block::List(sentences) => {
                gap(text);
                text.extend(sentences.iter().map(|sentence| paragraph("  – ", sentence)));
            }
            Block::Text(prose) => {
                gap(text);
                text.extend(prose.split("\n\n").map(|sentences| paragraph("", sentences)));
            }
            Block::Code { text: code, .. } => {
                gap(text);
                text.push_str(code);
            }
            Block::Table(table) => {
                gap(text);
                if !table.caption.is_empty() {
                    *text += &paragraph("", &table.caption);
                }
                // A list of names and values stands right below its caption.
                if !table.caption.is_empty() && table.has_titles() {
                    text.push('\n');
                }
                *text += &table.text();
            }
            Block::Chart(_) => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use standstill_campaign::Estimate;
    use standstill_report::page::{Column, Table};

    use super::*;

    #[test]
    fn law_text_page_json_and_csv_of_an_answer_have_the_same_numbers() {
        let of = |k: u32| Estimate { value: f64::from(k) / 7.0, low: 0.01, high: 123.4 };
        let rows = || (1..40).map(|k| vec![format!("source {k}"), of(k).to_string()]);
        let table = Table::new([Column::word("source"), Column::number("share").unit("%")]).rows(rows());
        let aside = table.clone().rows([vec!["aside".to_owned(), "0.777".to_owned()]]);
        let record = |k: u32| {
            Record::default().with("name", k).estimate("share", "_deg", Some(of(k))).with("x", f64::NAN)
        };
        let records: Records = (1..40).map(record).collect();
        let verdict = verdict(Tone::Good, "headline 5.1", vec!["detail 6.2".to_owned()]);
        let blocks = vec![Block::Table(table), Block::Text("one 7.3\n\ntwo 8.4".to_owned())];
        let mut answer = Answer::new("name", "title".to_owned(), "setting 9.5".to_owned(), verdict, blocks);
        answer.sections.push(Section::new("Aside", [Block::Table(aside)]).aside());
        answer.json = serde_json::json!({ "rows": records });
        let (text, json) = (answer.text(), answer.json.clone());
        assert!(
            !text.contains("0.777") && text.starts_with("setting 9.5\nheadline 5.1\n  detail 6.2\n\n"),
            "{text}"
        );
        let html = answer.page(Vec::new(), &Made::default()).html().expect("a page");
        let cells: Vec<String> = rows().flatten().collect();
        for part in ["headline 5.1", "detail 6.2", "one 7.3", "two 8.4"]
            .into_iter()
            .chain(cells.iter().map(String::as_str))
        {
            assert!(text.contains(part) && html.contains(part), "{part}");
        }
        assert!(html.contains("<td>aside</td>") && html.contains("0.777"));
        let csv = String::from_utf8(records.csv().expect("written")).expect("text");
        let mut lines = csv.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
        let names = lines.next().expect("a header");
        assert_eq!(names, ["name", "share_deg", "share_low_deg", "share_high_deg", "x"]);
        for (k, line) in lines.enumerate() {
            for (name, cell) in names.iter().zip(line) {
                assert_eq!(cell.parse().ok(), json["rows"][k][name].as_f64(), "{name} of row {k}");
            }
        }
    }
}
