//! Tables: the same for pages and for terminals, which have less room.

use super::Tone;

/// A table. On a page its rows can be sorted by each column and, if there are more than 20, filtered.
#[derive(Clone, Debug, Default, PartialEq)]
#[must_use]
pub struct Table {
    /// The subject of the table; may be empty.
    pub caption: String,
    /// The columns, left to right.
    pub columns: Vec<Column>,
    /// The cells of each row, one per column, with the row's tone. An empty cell, or `–`, is one without value.
    pub rows: Vec<(Tone, Vec<String>)>,
    /// True if the first cells become lines above their rows when there is too little room.
    pub headed: bool,
    /// The rows that a terminal shows where these are not all, and the sentence under them.
    pub excerpt: Option<(Vec<usize>, String)>,
}

/// Heading of a column, and its behaviour when there is too little room.
#[derive(Clone, Debug, PartialEq, Eq)]
#[must_use]
pub struct Column {
    /// The quantity.
    pub name: String,
    /// Unit of the values; empty if there is none.
    pub unit: String,
    /// The kind of its cells.
    pub kind: Kind,
    /// Rank for removal when there is too little room: the column with the highest rank is left out first; 0: never.
    pub rank: u8,
    /// Rank for shortening when there is too little room: cells lose the bracket at their end, such as an interval or a
    /// share, highest rank first; 0: never.
    pub bracket: u8,
    /// Whether its cells have the colour of their row's tone.
    pub judged: bool,
}

/// A column of [`Table::of`], and the closure that writes its cell of an item.
pub type Filled<'a, T> = (Column, Box<dyn Fn(&T) -> String + 'a>);

/// The kind of a column's cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Words that stand in one line.
    Word,
    /// Numbers with a decimal point, with or without an interval in brackets: aligned to the right, sorted by value.
    Number,
    /// Words that may stand in several lines.
    Prose,
}

impl Column {
    /// Returns the column with the closure that writes its cells, for [`Table::of`].
    pub fn of<'a, T>(self, cell: impl Fn(&T) -> String + 'a) -> Filled<'a, T> {
        (self, Box::new(cell))
    }

    fn new(name: impl Into<String>, kind: Kind) -> Self {
        Self { name: name.into(), unit: String::new(), kind, rank: 0, bracket: 0, judged: false }
    }

    /// Makes a column of words that stand in one line.
    pub fn word(name: impl Into<String>) -> Self {
        Self::new(name, Kind::Word)
    }

    /// Makes a column of numbers.
    pub fn number(name: impl Into<String>) -> Self {
        Self::new(name, Kind::Number)
    }

    /// Makes a column of words that may stand in several lines.
    pub fn prose(name: impl Into<String>) -> Self {
        Self::new(name, Kind::Prose)
    }

    /// Sets the unit.
    pub fn unit(self, unit: impl Into<String>) -> Self {
        Self { unit: unit.into(), ..self }
    }

    /// Sets the rank, see [`Column::rank`].
    pub fn rank(self, rank: u8) -> Self {
        Self { rank, ..self }
    }

    /// Sets the rank for removal of brackets, see [`Column::bracket`].
    pub fn bracket(self, rank: u8) -> Self {
        Self { bracket: rank, ..self }
    }

    /// Colours the column's cells by the tones of their rows.
    pub fn judged(self) -> Self {
        Self { judged: true, ..self }
    }

    /// Returns the name and unit in one text.
    pub fn title(&self) -> String {
        format!("{} {}", self.name, self.unit).trim_end().to_owned()
    }
}

impl Table {
    /// Makes a table without rows.
    pub fn new(columns: impl IntoIterator<Item = Column>) -> Self {
        Self { columns: columns.into_iter().collect(), ..Self::default() }
    }

    /// Returns whether its columns have titles; a list of names and values has none.
    pub fn has_titles(&self) -> bool {
        self.columns.iter().any(|column| !column.name.is_empty())
    }

    /// Sets the caption.
    pub fn captioned(self, caption: impl Into<String>) -> Self {
        Self { caption: caption.into(), ..self }
    }

    /// Makes a table with a row for each item. `tone` returns the tone of a row; the closures of the columns write the
    /// cells.
    pub fn of<'a, T: 'a>(
        items: impl IntoIterator<Item = &'a T>,
        tone: impl Fn(&T) -> Tone,
        columns: impl IntoIterator<Item = Filled<'a, T>>,
    ) -> Self {
        let (columns, cells): (Vec<_>, Vec<_>) = columns.into_iter().unzip();
        let row = |item: &'a T| (tone(item), cells.iter().map(|cell| cell(item)).collect());
        Self::new(columns).judged(items.into_iter().map(row))
    }

    /// Adds rows without tone.
    pub fn rows(self, rows: impl IntoIterator<Item = Vec<String>>) -> Self {
        self.judged(rows.into_iter().map(|row| (Tone::Neutral, row)))
    }

    /// Adds rows with their tones.
    pub fn judged(self, rows: impl IntoIterator<Item = (Tone, Vec<String>)>) -> Self {
        Self { rows: rows.into_iter().collect(), ..self }
    }

    /// Moves the first cells to lines above their rows when there is too little room.
    pub fn headed(self) -> Self {
        Self { headed: true, ..self }
    }

    /// Limits a terminal's view to some rows, with a sentence below them.
    pub fn excerpt(self, rows: Vec<usize>, sentence: impl Into<String>) -> Self {
        Self { excerpt: Some((rows, sentence.into())), ..self }
    }
}
