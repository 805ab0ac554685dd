//! Pages: one HTML file with the results of a run, which can be mailed, opened without a network and printed.
//!
//! A [`Page`] holds plain data, from which its layout follows, as with a [`Figure`]. The file includes scripts and
//! pictures, and its content security policy forbids all fetching. Charts can be zoomed, panned and read out; without
//! scripts and on paper, the drawn figures replace them. Equal pages give equal bytes.
//!
//! All texts are escaped. In titles, labels, captions and paragraphs, indices of symbols such as `i_a` are set below
//! the line; cells, code and values of facts are not changed.

mod render;
mod sheet;
mod table;

#[cfg(test)]
mod tests;

pub use self::sheet::Sheet;
pub use self::table::{Column, Filled, Kind, Table};
use crate::figure::{Figure, FigureError};
use std::collections::HashSet;

use thiserror::Error;

/// A whole page.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Page {
    /// First heading, and the name of the browser's tab.
    pub title: String,
    /// Smaller text under the title. May be empty.
    pub subtitle: String,
    /// The sections, in their order. With two or more, wide screens have a table of contents.
    pub sections: Vec<Section>,
    /// Last line, which names the program that wrote the page. May be empty.
    pub footer: String,
}

/// A part of a page under its own heading.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Section {
    /// Heading.
    pub title: String,
    /// The pieces of the section, in their order.
    pub blocks: Vec<Block>,
    /// Whether only pages have it: terminals leave it out.
    pub aside: bool,
}

impl Section {
    /// Makes a section under its title.
    pub fn new(title: impl Into<String>, blocks: impl IntoIterator<Item = Block>) -> Self {
        Self { title: title.into(), blocks: blocks.into_iter().collect(), aside: false }
    }

    /// Restricts the block to pages; terminals do not show it.
    #[must_use]
    pub fn aside(self) -> Self {
        Self { aside: true, ..self }
    }
}

/// A piece of a section.
#[derive(Clone, Debug, PartialEq)]
pub enum Block {
    /// An answer in one line, with its grounds.
    Verdict {
        /// The kind of the answer.
        tone: Tone,
        /// The answer.
        headline: String,
        /// Reasons, one line each.
        details: Vec<String>,
    },
    /// Prose; empty lines separate paragraphs.
    Text(String),
    /// Sentences that stand below each other.
    List(Vec<String>),
    /// Text in a fixed pitch, with a button that copies it.
    Code {
        /// A name, such as that of the file.
        caption: String,
        /// The text, verbatim.
        text: String,
    },
    /// Names and values, such as those of motor and drive. Units belong to the values.
    Facts(Vec<(String, String)>),
    /// A table.
    Table(Table),
    /// A figure.
    Chart(Chart),
}

/// Kind of a verdict. It is shown by a word, not only by colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tone {
    /// Good: nothing to do.
    Good,
    /// Usable with care.
    Warning,
    /// Something is wrong.
    Bad,
    /// Neither.
    #[default]
    Neutral,
}

/// A figure that is a chart where scripts run.
///
/// The file contains all points of its layers, with nine digits: some 20 bytes each, and another 100 in the drawn
/// figure for each marker.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// Names the chart in links and the files of pictures saved from it: letters, digits, `-` and `_`, unique in
    /// its page and none of the page's own (`content`, `theme`, `palette`, `section-1` and so on).
    pub id: String,
    /// The figure. Its title and subtitle become texts of the page.
    pub figure: Figure,
    /// The sentence under the chart. May be empty.
    pub caption: String,
}

/// Why a page could not be written.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum PageError {
    /// The name of a chart is empty, has other characters than letters, digits, `-` and `_`, or is taken by another
    /// chart or by the page.
    #[error("`{0}` cannot name a chart: it must be letters, digits, - and _, and unique")]
    Id(String),
    /// A row of a table has not one cell per column.
    #[error("row {row} of the table `{table}` has {found} cells for {columns} columns")]
    Cells {
        /// Caption of the table.
        table: String,
        /// Index of the row, from 0.
        row: usize,
        /// Number of cells in the row.
        found: usize,
        /// Number of columns.
        columns: usize,
    },
    /// A figure could not be drawn.
    #[error("chart `{id}`: {why}")]
    Figure {
        /// Name of the chart.
        id: String,
        /// Why not.
        #[source]
        why: FigureError,
    },
}

/// Replaces control characters other than line ends and tabs, which texts from files can have and HTML and XML forbid, by U+FFFD.
///
/// ```
/// use standstill_report::page::printable;
///
/// assert_eq!(printable("a\u{1b}[2J\n".to_owned()), "a\u{fffd}[2J\n");
/// ```
pub fn printable(text: String) -> String {
    let is_printable = |c: char| !c.is_control() || matches!(c, '\n' | '\r' | '\t');
    if text.chars().all(is_printable) {
        return text;
    }
    text.chars().map(|c| if is_printable(c) { c } else { char::REPLACEMENT_CHARACTER }).collect()
}

impl Page {
    /// Returns the page as an HTML document.
    pub fn html(&self) -> Result<String, PageError> {
        self.check()?;
        let html = render::page(self)?;
        if render::PLOTLY.is_empty() {
            return Ok(printable(html));
        }
        // The library of charts has control characters in its own texts.
        let parts: Vec<String> = html.split(render::PLOTLY).map(|part| printable(part.to_owned())).collect();
        Ok(parts.join(render::PLOTLY))
    }

    fn check(&self) -> Result<(), PageError> {
        let mut ids = HashSet::new();
        for block in self.sections.iter().flat_map(|section| &section.blocks) {
            match block {
                Block::Chart(chart) => {
                    let allowed = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
                    let own = matches!(chart.id.as_str(), "content" | "theme" | "palette")
                        || chart.id.starts_with("section-");
                    if own || chart.id.is_empty() || !chart.id.chars().all(allowed) || !ids.insert(&chart.id)
                    {
                        return Err(PageError::Id(chart.id.clone()));
                    }
                }
                Block::Table(table) => {
                    let columns = table.columns.len();
                    if let Some((row, (_, cells))) =
                        table.rows.iter().enumerate().find(|(_, (_, cells))| cells.len() != columns)
                    {
                        let (table, found) = (table.caption.clone(), cells.len());
                        return Err(PageError::Cells { table, row, found, columns });
                    }
                }
                _ => (),
            }
        }
        Ok(())
    }
}
