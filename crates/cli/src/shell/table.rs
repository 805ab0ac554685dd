//! Tables that fit the terminal's width. If a table is too wide, prose is wrapped first; then brackets and less
//! important columns are left out; at last each row is printed as a list of its cells.

use std::fmt::Write as _;

use console::{Alignment, measure_text_width, pad_str};
use standstill_report::page::{Column, Kind, Table};

use super::terminal::{colours, paint, paragraph, width};
use super::wrap::{pieces, wrapped, wrapped_title};

/// Smallest column width into which prose is wrapped.
const NARROWEST: usize = 24;

/// Total width of the spaces on the two sides of a cell, in characters.
const AROUND: usize = 2;

/// Columns that are shown. Each entry contains the index and the cell width of a column.
type Layout = Vec<(usize, usize)>;

/// Formatting of a table as text.
pub trait Print {
    /// Returns the table as text in the terminal's width.
    fn text(&self) -> String {
        self.within(width(), colours())
    }

    /// Returns the table as text of at most `width` characters.
    fn within(&self, width: usize, colours: bool) -> String;
}

impl Print for Table {
    fn within(&self, width: usize, colours: bool) -> String {
        let mut table = self.clone();
        let mut sentence = String::new();
        if let Some((rows, under)) = table.excerpt.take() {
            table.rows = rows.into_iter().map(|row| self.rows[row].clone()).collect();
            sentence = if under.is_empty() { under } else { paragraph("", &under) };
        }
        if table.headed {
            // The first cell is printed only where it differs from that of the row before.
            for k in (1..table.rows.len()).rev() {
                if table.rows[k].1[0] == table.rows[k - 1].1[0] {
                    table.rows[k].1[0].clear();
                }
            }
        }
        Layouter(table).within(width, colours) + &sentence
    }
}

/// A table whose layout is computed. Texts in brackets and columns are omitted step by step until the table fits into the width.
#[derive(Clone)]
struct Layouter(Table);

impl Layouter {
    fn within(&self, width: usize, colours: bool) -> String {
        let all: Vec<usize> = (0..self.0.columns.len()).collect();
        if let Some(layout) = self.layout(&all, width) {
            return self.drawn(&layout, None, colours);
        }
        let head = self.0.headed.then_some(0);
        let mut shown: Vec<usize> = all.into_iter().filter(|place| Some(*place) != head).collect();
        let (mut table, mut dropped, mut cut) = (self.clone(), Vec::new(), Vec::new());
        loop {
            if let Some(layout) = table.layout(&shown, width) {
                return table.drawn(&layout, head, colours) + &self.left_out(dropped, cut, width);
            }
            let columns = &table.0.columns;
            let by = |rank: fn(&Column) -> u8| {
                let ranked = shown.iter().map(|place| (rank(&columns[*place]), *place));
                ranked.filter(|(rank, _)| *rank > 0).max()
            };
            match (by(|column| column.bracket), by(|column| column.rank)) {
                (Some((bracket, _)), rank) if rank.is_none_or(|(rank, _)| bracket >= rank) => {
                    // Brackets of one rank are left out together.
                    let alike = |place: &usize| table.0.columns[*place].bracket == bracket;
                    let alike: Vec<usize> = shown.iter().copied().filter(alike).collect();
                    for place in alike {
                        table.cut(place);
                        cut.push(place);
                    }
                }
                (_, Some((_, place))) => {
                    shown.retain(|other| *other != place);
                    cut.retain(|other| *other != place);
                    dropped.push(place);
                }
                _ => return self.stacked(width, colours),
            }
        }
    }

    /// Removes the text in brackets from the cells of a column.
    fn cut(&mut self, place: usize) {
        self.0.columns[place].bracket = 0;
        for (_, row) in &mut self.0.rows {
            let cell = &mut row[place];
            cell.truncate(cell.find(['(', '[']).map_or(cell.len(), |at| cell[..at].trim_end().len()));
        }
    }

    fn left_out(&self, mut dropped: Vec<usize>, mut cut: Vec<usize>, width: usize) -> String {
        if dropped.is_empty() && cut.is_empty() {
            return String::new();
        }
        let titles = |places: &mut Vec<usize>| {
            places.sort_unstable();
            let titles: Vec<String> = places.iter().map(|place| self.0.columns[*place].title()).collect();
            titles.join(", ")
        };
        let columns = titles(&mut dropped);
        let between = if columns.is_empty() || cut.is_empty() { "" } else { ", and " };
        let brackets =
            if cut.is_empty() { String::new() } else { format!("the brackets of {}", titles(&mut cut)) };
        let all: Vec<usize> = (0..self.0.columns.len()).collect();
        let needed = self.least(&all).iter().map(|width| width + AROUND).sum::<usize>();
        let said = format!(
            "No room for {columns}{between}{brackets}: COLUMNS={needed} or a wider terminal shows them."
        );
        wrapped(&said, width).join("\n") + "\n"
    }

    /// Returns the width of a column's widest cell.
    fn widest(&self, place: usize) -> usize {
        self.0.rows.iter().map(|(_, row)| measure_text_width(&row[place])).max().unwrap_or_default()
    }

    /// Returns the smallest width that each of these columns can have.
    fn least(&self, places: &[usize]) -> Vec<usize> {
        let least = |place: &usize| {
            let column = &self.0.columns[*place];
            let title =
                pieces(&column.title()).map(|(_, piece)| measure_text_width(piece)).max().unwrap_or_default();
            let cells = self.widest(*place);
            title.max(if column.kind == Kind::Prose { cells.min(NARROWEST) } else { cells })
        };
        places.iter().map(least).collect()
    }

    /// Returns widths with which all of these columns fit into `width`. Returns none if they do not fit.
    fn layout(&self, places: &[usize], width: usize) -> Option<Layout> {
        let mut widths = self.least(places);
        let room =
            |widths: &[usize]| width.checked_sub(widths.iter().map(|width| width + AROUND).sum::<usize>());
        let mut left = room(&widths)?;
        // Width that is left over goes to prose, then to titles that were wrapped.
        let natural =
            |place: usize| self.widest(place).max(measure_text_width(&self.0.columns[place].title()));
        let prose = |k: &usize| self.0.columns[places[*k]].kind == Kind::Prose;
        let (prose, others): (Vec<usize>, Vec<usize>) = (0..places.len()).partition(prose);
        let mut open = prose.clone();
        while left > 0 && !open.is_empty() {
            open.retain(|k| widths[*k] < natural(places[*k]));
            for k in &open {
                let more = (left / open.len()).max(1).min(natural(places[*k]) - widths[*k]).min(left);
                widths[*k] += more;
                left -= more;
            }
        }
        for k in others {
            let more = natural(places[k]) - widths[k];
            if more <= left {
                widths[k] += more;
                left -= more;
            }
        }
        Some(places.iter().copied().zip(widths).collect())
    }

    fn drawn(&self, layout: &Layout, head: Option<usize>, colours: bool) -> String {
        let mut text = String::new();
        let titles: Vec<Vec<String>> = layout
            .iter()
            .map(|(place, width)| wrapped_title(&self.0.columns[*place].title(), *width))
            .collect();
        // A list of names and values has no titles.
        if self.0.has_titles() {
            self.lines(&mut text, layout, &titles, |_, line| line);
            let whole: usize = layout.iter().map(|(_, width)| width + AROUND).sum();
            let _ = writeln!(text, "{}", "─".repeat(whole));
        }
        for (tone, row) in &self.0.rows {
            if let Some(head) = head.filter(|head| !row[*head].is_empty()) {
                let _ = writeln!(text, "{}", row[head]);
            }
            let cells: Vec<Vec<String>> = layout
                .iter()
                .map(|(place, width)| match self.0.columns[*place].kind {
                    Kind::Prose => wrapped(&row[*place], *width),
                    Kind::Word | Kind::Number => vec![row[*place].clone()],
                })
                .collect();
            self.lines(&mut text, layout, &cells, |place, line| {
                if self.0.columns[place].judged { paint(*tone, &line, colours) } else { line }
            });
        }
        text
    }

    /// Appends a row whose cells may have several lines, side by side.
    fn lines(
        &self,
        text: &mut String,
        layout: &Layout,
        cells: &[Vec<String>],
        painted: impl Fn(usize, String) -> String,
    ) {
        for k in 0..cells.iter().map(Vec::len).max().unwrap_or_default() {
            let mut line = String::new();
            for ((place, width), cell) in layout.iter().zip(cells) {
                let cell = cell.get(k).cloned().unwrap_or_default();
                let cell = if cell.is_empty() { cell } else { painted(*place, cell) };
                let right = self.0.columns[*place].kind == Kind::Number;
                let alignment = if right { Alignment::Right } else { Alignment::Left };
                let _ = write!(line, " {} ", pad_str(&cell, *width, alignment, None));
            }
            let _ = writeln!(text, "{}", line.trim_end());
        }
    }

    /// Returns the table with one line for each cell. This layout is for terminals that are too narrow for the important columns side by
    /// side.
    fn stacked(&self, width: usize, colours: bool) -> String {
        let titles =
            self.0.columns.iter().map(|column| measure_text_width(&column.title())).max().unwrap_or_default();
        // Titles take at most half of the width.
        let titles = titles.min(width / 2);
        let mut blocks = Vec::new();
        for (tone, row) in &self.0.rows {
            let mut block = String::new();
            for (column, cell) in self.0.columns.iter().zip(row).filter(|(_, cell)| !cell.is_empty()) {
                let title = wrapped_title(&column.title(), titles);
                let cell = wrapped(cell, width.saturating_sub(titles + AROUND + 1));
                for k in 0..title.len().max(cell.len()) {
                    let line = cell.get(k).cloned().unwrap_or_default();
                    let line = if column.judged { paint(*tone, &line, colours) } else { line };
                    let title =
                        pad_str(title.get(k).map_or("", String::as_str), titles, Alignment::Left, None);
                    let _ = writeln!(block, "{}", format!(" {title}  {line}").trim_end());
                }
            }
            blocks.push(block);
        }
        blocks.join("\n")
    }
}

#[cfg(test)]
mod tests;
