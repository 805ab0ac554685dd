//! Tables as wide as the terminal: prose is broken, then brackets and columns that matter less are left out, then rows are stacked.

use std::fmt::Write as _;

use console::{Alignment, measure_text_width, pad_str};
use standstill_report::page::Tone;

use crate::shell::terminal::{colours, paint, width, wrapped};

/// Prose is not broken into narrower columns than this.
const NARROWEST: usize = 24;

/// Lines of several rows are told apart by one space on either side of a cell.
const AROUND: usize = 2;

/// A column.
#[derive(Clone, Debug)]
pub struct Column {
    title: String,
    kind: Kind,
    rank: u8,
    bracket: u8,
    judged: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Word,
    Number,
    Prose,
}

impl Column {
    fn new(title: impl Into<String>, kind: Kind) -> Self {
        Self { title: title.into(), kind, rank: 0, bracket: 0, judged: false }
    }

    /// Words that are not broken.
    pub fn word(title: impl Into<String>) -> Self {
        Self::new(title, Kind::Word)
    }

    /// Numbers, aligned to the right.
    pub fn number(title: impl Into<String>) -> Self {
        Self::new(title, Kind::Number)
    }

    /// Words that may stand in several lines.
    pub fn prose(title: impl Into<String>) -> Self {
        Self::new(title, Kind::Prose)
    }

    /// One that is left out where there is no room, those of the highest rank first.
    #[must_use]
    pub fn rank(self, rank: u8) -> Self {
        Self { rank, ..self }
    }

    /// One whose cells lose the bracket at their end, an interval or a share, where there is no room: in the same order as columns
    /// are left out.
    #[must_use]
    pub fn bracket(self, rank: u8) -> Self {
        Self { bracket: rank, ..self }
    }

    /// The one that shows the row's tone as its colour.
    #[must_use]
    pub fn judged(self) -> Self {
        Self { judged: true, ..self }
    }
}

/// A table.
#[derive(Clone, Debug)]
pub struct Table {
    columns: Vec<Column>,
    rows: Vec<(Tone, Vec<String>)>,
    headed: bool,
}

/// Columns that are shown, by their places, with the widths of their cells.
type Layout = Vec<(usize, usize)>;

impl Table {
    /// One without rows.
    pub fn new(columns: impl IntoIterator<Item = Column>) -> Self {
        Self { columns: columns.into_iter().collect(), rows: Vec::new(), headed: false }
    }

    /// Its rows.
    #[must_use]
    pub fn rows(self, rows: impl IntoIterator<Item = Vec<String>>) -> Self {
        self.judged(rows.into_iter().map(|row| (Tone::Neutral, row)))
    }

    /// Its rows with their tones.
    #[must_use]
    pub fn judged(mut self, rows: impl IntoIterator<Item = (Tone, Vec<String>)>) -> Self {
        self.rows = rows.into_iter().collect();
        self
    }

    /// Where there is no room, the first cells become lines above their rows.
    #[must_use]
    pub fn headed(self) -> Self {
        Self { headed: true, ..self }
    }

    /// For the terminal.
    pub fn text(&self) -> String {
        self.within(width(), colours())
    }

    /// For a page, which scrolls.
    pub fn whole(&self) -> String {
        self.within(usize::MAX, false)
    }

    /// In so many columns.
    pub fn within(&self, width: usize, colours: bool) -> String {
        let all: Vec<usize> = (0..self.columns.len()).collect();
        if let Some(layout) = self.layout(&all, width) {
            return self.drawn(&layout, None, colours);
        }
        let head = self.headed.then_some(0);
        let mut shown: Vec<usize> = all.into_iter().filter(|place| Some(*place) != head).collect();
        let (mut table, mut dropped, mut cut) = (self.clone(), Vec::new(), Vec::new());
        loop {
            if let Some(layout) = table.layout(&shown, width) {
                return table.drawn(&layout, head, colours) + &self.left_out(dropped, cut, width);
            }
            let columns = &table.columns;
            let by = |rank: fn(&Column) -> u8| {
                let ranked = shown.iter().map(|place| (rank(&columns[*place]), *place));
                ranked.filter(|(rank, _)| *rank > 0).max()
            };
            match (by(|column| column.bracket), by(|column| column.rank)) {
                (Some((bracket, _)), rank) if rank.is_none_or(|(rank, _)| bracket >= rank) => {
                    // Those of one rank go together.
                    let alike = |place: &usize| table.columns[*place].bracket == bracket;
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

    /// Without the brackets of a column.
    fn cut(&mut self, place: usize) {
        self.columns[place].bracket = 0;
        for (_, row) in &mut self.rows {
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
            let titles: Vec<&str> = places.iter().map(|place| self.columns[*place].title.as_str()).collect();
            titles.join(", ")
        };
        let columns = titles(&mut dropped);
        let between = if columns.is_empty() || cut.is_empty() { "" } else { ", and " };
        let brackets =
            if cut.is_empty() { String::new() } else { format!("the brackets of {}", titles(&mut cut)) };
        let all: Vec<usize> = (0..self.columns.len()).collect();
        let needed = self.least(&all).iter().map(|width| width + AROUND).sum::<usize>();
        let said = format!(
            "No room for {columns}{between}{brackets}: COLUMNS={needed} or a wider terminal shows them."
        );
        wrapped(&said, width).join("\n") + "\n"
    }

    /// Width of the widest cell of a column.
    fn widest(&self, place: usize) -> usize {
        self.rows.iter().map(|(_, row)| measure_text_width(&row[place])).max().unwrap_or_default()
    }

    /// The least widths of these columns.
    fn least(&self, places: &[usize]) -> Vec<usize> {
        let least = |place: &usize| {
            let column = &self.columns[*place];
            let title = pieces(&column.title).map(measure_text_width).max().unwrap_or_default();
            let cells = self.widest(*place);
            title.max(if column.kind == Kind::Prose { cells.min(NARROWEST) } else { cells })
        };
        places.iter().map(least).collect()
    }

    /// Widths with which these columns fit, if they do.
    fn layout(&self, places: &[usize], width: usize) -> Option<Layout> {
        let mut widths = self.least(places);
        let room =
            |widths: &[usize]| width.checked_sub(widths.iter().map(|width| width + AROUND).sum::<usize>());
        let mut left = room(&widths)?;
        // What is left over goes to prose, then to titles that were broken.
        let natural = |place: usize| self.widest(place).max(measure_text_width(&self.columns[place].title));
        let prose = |k: &usize| self.columns[places[*k]].kind == Kind::Prose;
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
        let titles: Vec<Vec<String>> =
            layout.iter().map(|(place, width)| broken(&self.columns[*place].title, *width)).collect();
        self.lines(&mut text, layout, &titles, |_, line| line);
        let whole: usize = layout.iter().map(|(_, width)| width + AROUND).sum();
        let _ = writeln!(text, "{}", "─".repeat(whole));
        for (tone, row) in &self.rows {
            if let Some(head) = head.filter(|head| !row[*head].is_empty()) {
                let _ = writeln!(text, "{}", row[head]);
            }
            let cells: Vec<Vec<String>> = layout
                .iter()
                .map(|(place, width)| match self.columns[*place].kind {
                    Kind::Prose => wrapped(&row[*place], *width),
                    Kind::Word | Kind::Number => vec![row[*place].clone()],
                })
                .collect();
            self.lines(&mut text, layout, &cells, |place, line| {
                if self.columns[place].judged { paint(*tone, &line, colours) } else { line }
            });
        }
        text
    }

    /// Cells of several lines side by side; those of titles stand at the bottom.
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
                let right = self.columns[*place].kind == Kind::Number;
                let alignment = if right { Alignment::Right } else { Alignment::Left };
                let _ = write!(line, " {} ", pad_str(&cell, *width, alignment, None));
            }
            let _ = writeln!(text, "{}", line.trim_end());
        }
    }

    /// A line for each cell, where not even the columns that matter fit side by side.
    fn stacked(&self, width: usize, colours: bool) -> String {
        let titles =
            self.columns.iter().map(|column| measure_text_width(&column.title)).max().unwrap_or_default();
        // Long titles leave half of the room to their cells.
        let titles = titles.min(width / 2);
        let mut blocks = Vec::new();
        for (tone, row) in &self.rows {
            let mut block = String::new();
            for (column, cell) in self.columns.iter().zip(row).filter(|(_, cell)| !cell.is_empty()) {
                let title = broken(&column.title, titles);
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

/// Where a title may be broken: at spaces and behind the dots of keys.
fn pieces(title: &str) -> impl Iterator<Item = &str> {
    title.split(' ').flat_map(|word| word.split_inclusive('.'))
}

/// A title in lines of at most this width, if its pieces have it.
fn broken(title: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in title.split(' ') {
        for (k, piece) in word.split_inclusive('.').enumerate() {
            let line = lines.last_mut().expect("a line");
            let between = if k == 0 && !line.is_empty() { " " } else { "" };
            if line.is_empty()
                || measure_text_width(line) + between.len() + measure_text_width(piece) <= width
            {
                line.push_str(between);
                line.push_str(piece);
            } else {
                lines.push(piece.to_owned());
            }
        }
    }
    lines
}

#[cfg(test)]
mod tests;
