//! Maps as texts: a header that names quantities and units, then one line a point, in any order; or wide tables.
//!
//! Split here rather than by a CSV library: numbers are never quoted, and every line keeps its number past comments
//! and blank lines.

use super::columns::{Column, MapValues, Quantity};
use super::{MapError, MapLayout, MapPoint, MapSamples, Place, polar, wide};
use crate::import::arrays::MOST_POINTS;

/// Columns that a line may have: those of a wide table.
const MOST_COLUMNS: usize = 2048;

/// Bytes that a line may have: a wide table's has some 60 kB. A file without line ends would be one name of a column.
const LONGEST_LINE: usize = 1 << 20;

/// A line that is neither blank nor a comment.
#[derive(Clone, Copy)]
pub(super) struct Line<'a> {
    /// Number of the line, from 1.
    pub(super) number: usize,
    pub(super) text: &'a str,
    /// Separator of the fields; a blank stands for any number of blanks.
    separator: char,
}

impl<'a> Line<'a> {
    pub(super) fn fields(self) -> Vec<&'a str> {
        if self.separator == ' ' {
            self.text.split_whitespace().take(MOST_COLUMNS + 1).collect()
        } else {
            self.text.split(self.separator).map(str::trim).take(MOST_COLUMNS + 1).collect()
        }
    }

    /// Returns a finite number; with semicolons or tabs between fields also with a decimal comma.
    pub(super) fn value(self, text: &str) -> Option<f64> {
        let text = text.trim_matches('"');
        let value = text
            .parse::<f64>()
            .ok()
            .or_else(|| (self.separator != ',').then(|| text.replacen(',', ".", 1).parse().ok()).flatten());
        value.filter(|value| value.is_finite())
    }
}

/// The file that is being read, for messages.
pub(super) struct Source<'a> {
    pub(super) file: &'a str,
    pub(super) layout: &'a MapLayout,
}

impl Source<'_> {
    pub(super) fn error(&self, line: usize, found: impl Into<String>, needed: impl Into<String>) -> MapError {
        MapError::new(self.file, Some(&Place::Line(line)), found, needed)
    }

    /// Returns quantity and unit of a column by its header; none for a quantity that maps do not have.
    pub(super) fn column(&self, line: usize, name: &str) -> Result<Option<Column>, MapError> {
        let column = Column::parse(name).map_err(|units| {
            self.error(line, format!("the column `{}`", shortened(name)), format!("one of the units {units}"))
        })?;
        column.map(|column| self.check(line, name, column).map(|()| column)).transpose()
    }

    /// Returns the finite number in a field, multiplied by `scale`. `before`: the beginning of the message, which names
    /// the field.
    pub(super) fn number(&self, line: Line, before: &str, field: &str, scale: f64) -> Result<f64, MapError> {
        line.value(field).map(|value| value * scale).ok_or_else(|| {
            self.error(line.number, format!("{before}`{}`", shortened(field)), "a finite number")
        })
    }

    /// Checks that a map has no more points than allowed.
    pub(super) fn bounded(&self, line: usize, points: usize) -> Result<(), MapError> {
        let needed = "at most 1,048,576 points, 1,024 × 1,024";
        if points <= MOST_POINTS { Ok(()) } else { Err(self.error(line, "more points", needed)) }
    }

    /// Checks that a header with rms is confirmed by the options, and that no header contradicts them.
    pub(super) fn check(&self, line: usize, header: &str, column: Column) -> Result<(), MapError> {
        match (column.values, self.layout.values) {
            (Some(MapValues::Rms), None) => {
                let needed = "`--values rms` (in a data sheet, `values = \"rms\"` in [map]), or a header without it for peak values";
                Err(self.error(line, format!("`{}`, which says rms", shortened(header)), needed))
            }
            (Some(one), Some(other)) if one != other => {
                let needed = format!("one of both: --values asks for {}", MapValues::NAMES[other as usize]);
                let found = format!("`{}`, which says {}", shortened(header), MapValues::NAMES[one as usize]);
                Err(self.error(line, found, needed))
            }
            _ => Ok(()),
        }
    }
}

pub(super) fn read(file: &str, bytes: &[u8], layout: &MapLayout) -> Result<MapSamples, MapError> {
    let source = Source { file, layout };
    let text = std::str::from_utf8(bytes).map_err(|failure| {
        let line = bytes[..failure.valid_up_to()].split(|byte| *byte == b'\n').count();
        source.error(line, "bytes that are not UTF-8", "a text")
    })?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    if let Some(at) = text.lines().position(|line| line.len() > LONGEST_LINE) {
        let needed = "at most 1 MiB in a line, and lines that end";
        return Err(source.error(at + 1, "a line of more than 1 MiB", needed));
    }
    let lines = || {
        let numbered = text.lines().enumerate().map(|(at, line)| (at + 1, line.trim()));
        numbered.filter(|(_, line)| !line.is_empty() && !line.starts_with(['#', '%']))
    };
    let empty = || MapError::new(file, None, "an empty file", format!("a header with the columns {COLUMNS}"));
    // The title of a wide table stands alone: then the next line tells.
    let mark_of = |(_, line): (usize, &str)| [';', '\t', ','].into_iter().find(|mark| line.contains(*mark));
    let separator = lines().take(2).find_map(mark_of).unwrap_or(' ');
    let lines = lines().map(|(number, text)| Line { number, text, separator });
    if lines.clone().take(2).any(|line| line.text.contains('\\')) {
        return wide::read(&source, lines);
    }
    let columns = Header::read(&source, lines.clone().next().ok_or_else(empty)?)?;
    let skipped = usize::from(layout.columns.is_none() || !columns.first_is_data);
    let mut rows = Vec::new();
    for line in lines.skip(skipped) {
        source.bounded(line.number, rows.len() + 1)?;
        rows.push((line.number, columns.row(&source, line)?));
    }
    if rows.is_empty() {
        return Err(MapError::new(file, None, "no point", "a rectangle of currents with their fluxes"));
    }
    let points = match columns.polar {
        None => rows.into_iter().map(|(line, values)| point(values, Place::Line(line))).collect(),
        Some(from_q) => polar::points(file, &rows, from_q)?,
    };
    Ok(MapSamples { file: file.to_owned(), points, pole_pairs: None, resistance: None })
}

pub(super) fn point([i_d, i_q, psi_d, psi_q]: [f64; 4], place: Place) -> MapPoint {
    MapPoint { i_d, i_q, psi_d, psi_q, place }
}

/// The layout of this program's own files.
const COLUMNS: &str = "i_d_A,i_q_A,psi_d_Wb,psi_q_Wb";

/// Positions of the four numbers in a line.
struct Header {
    /// Column, and from its unit to SI: i_d, i_q (or amplitude and angle), ψ_d, ψ_q.
    places: [(usize, f64); 4],
    names: [String; 4],
    count: usize,
    /// The currents are polar, with the angle from +q.
    polar: Option<bool>,
    first_is_data: bool,
}

impl Header {
    fn read(source: &Source, line: Line) -> Result<Self, MapError> {
        let there = line.fields();
        let names: Vec<&str> = match &source.layout.columns {
            Some(columns) => columns.split(',').map(str::trim).collect(),
            None => there.clone(),
        };
        if names.len() != there.len() || there.len() > MOST_COLUMNS {
            let found = format!("{} column(s) in `{}`", there.len(), shortened(line.text));
            let needed = format!("as many as --columns names, {}, and at most {MOST_COLUMNS}", names.len());
            return Err(source.error(line.number, found, needed));
        }
        let mut found: [Vec<(usize, Column)>; 6] = Default::default();
        for (at, name) in names.iter().enumerate() {
            if let Some(column) = source.column(line.number, name)? {
                let slot = match column.quantity {
                    Quantity::Dq(place) => place,
                    Quantity::Amplitude => 4,
                    Quantity::AngleFromD | Quantity::AngleFromQ => 5,
                };
                found[slot].push((at, column));
            }
        }
        let polar = found[0].is_empty() && found[1].is_empty() && !found[5].is_empty();
        let wanted = if polar { [4, 5, 2, 3] } else { [0, 1, 2, 3] };
        let mut places = [(0, 0.0); 4];
        for (place, slot) in places.iter_mut().zip(wanted) {
            match found[slot][..] {
                [(at, column)] => *place = (at, column.scale),
                [] => return Err(unknown(source, line, &there)),
                [_, (at, _), ..] => {
                    let found = format!("`{}` twice: the same as another column", shortened(names[at]));
                    return Err(source.error(line.number, found, "each quantity once"));
                }
            }
        }
        let from_q = found[5].first().is_some_and(|(_, column)| column.quantity == Quantity::AngleFromQ);
        Ok(Self {
            names: places.map(|(at, _)| names[at].to_owned()),
            places,
            count: there.len(),
            polar: polar.then_some(from_q),
            first_is_data: there.iter().all(|field| line.value(field).is_some()),
        })
    }

    /// Returns the four numbers of a line in SI units.
    fn row(&self, source: &Source, line: Line) -> Result<[f64; 4], MapError> {
        let fields = line.fields();
        if fields.len() != self.count {
            let found = format!("{} field(s) in `{}`", fields.len(), shortened(line.text));
            return Err(source.error(line.number, found, format!("{} as in the header", self.count)));
        }
        let mut values = [0.0; 4];
        for ((value, (at, scale)), name) in values.iter_mut().zip(self.places).zip(&self.names) {
            *value = source.number(line, &format!("{name} = "), fields[at], scale)?;
        }
        Ok(values)
    }
}

/// Returns the error for an unknown header, with the command that would read the file.
fn unknown(source: &Source, line: Line, there: &[&str]) -> MapError {
    let numbers = there.iter().all(|field| line.value(field).is_some());
    let what = if numbers { "numbers without a header" } else { "a header" };
    let found = format!("{what} of {} column(s): `{}`", there.len(), shortened(line.text));
    let names = COLUMNS
        .split(',')
        .map(str::to_owned)
        .chain(std::iter::repeat_n("-".to_owned(), there.len().saturating_sub(4).min(8)));
    let names = names.collect::<Vec<_>>().join(",");
    let needed = format!(
        "a header with i_d, i_q, psi_d, psi_q (or i, angle_from_d or angle_from_q, psi_d, psi_q) and units, such as {COLUMNS}; \
         or say what each column is, in its order and with `-` for others: standstill magnetics {} --columns {names}",
        source.file
    );
    source.error(line.number, found, needed)
}

/// Returns the beginning of a text for messages, because the text may be a whole binary file.
pub(super) fn shortened(text: &str) -> String {
    if text.chars().take(61).count() <= 60 {
        text.to_owned()
    } else {
        text.chars().take(60).chain("…".chars()).collect()
    }
}

#[cfg(test)]
mod tests;
