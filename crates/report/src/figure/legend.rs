//! The legend of a panel: a row of keys above it, which never covers data.

use super::canvas::{Align, Canvas, Point, Rect, Type};
use super::heat;
use super::layers::{BAND_OPACITY, COLUMN, draw_fill, draw_marker, draw_upper_limit};
use super::reduce::dash;
use super::style::{FRAME, INK, LINE_WIDTH, MARKER_RADIUS, Style, faded};
use super::{FigureError, Layer, Panel, text};
use plotters::backend::DrawingBackend;

const SIZE: f64 = 13.0;
const LONG_KEY: f64 = 30.0;
const SHORT_KEY: f64 = 12.0;
const KEY_GAP: f64 = 7.0;
const ENTRY_GAP: f64 = 22.0;
/// Height of one row.
pub(super) const ROW: f64 = 20.0;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Key {
    Line(Style),
    Marker(Style),
    Band(Style),
    Bar(Style),
    Fill(usize),
    UpperLimit(Style),
    Blank,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Entry {
    label: String,
    keys: Vec<Key>,
    /// From the left end of the legend.
    x: f64,
    row: usize,
}

impl Entry {
    /// A lone marker needs less room than a piece of line.
    fn key_width(&self) -> f64 {
        let short =
            self.keys.iter().all(|key| matches!(key, Key::Marker(_) | Key::Bar(_) | Key::UpperLimit(_)));
        if short { SHORT_KEY } else { LONG_KEY }
    }
}

/// The entries of a panel, set in rows at most `width` wide.
pub(super) fn entries(panel: &Panel, width: f64) -> Vec<Entry> {
    let mut entries: Vec<Entry> = Vec::new();
    let mut add = |label: &str, key: Key| match entries.iter_mut().find(|entry| entry.label == label) {
        Some(entry) => entry.keys.push(key),
        None => entries.push(Entry { label: label.to_owned(), keys: vec![key], x: 0.0, row: 0 }),
    };
    for layer in panel.layers.iter().filter(|_| panel.legend) {
        match layer {
            Layer::Line { label: Some(label), style, .. }
            | Layer::Steps { label: Some(label), style, .. } => {
                add(label, Key::Line(*style));
            }
            Layer::Points { label: Some(label), style, .. } => add(label, Key::Marker(*style)),
            Layer::Band { label: Some(label), style, .. } => add(label, Key::Band(*style)),
            Layer::ErrorBars { label: Some(label), style, .. } => add(label, Key::Bar(*style)),
            Layer::UpperLimits { label: Some(label), style, .. } => add(label, Key::UpperLimit(*style)),
            layer @ Layer::Heat { .. } if heat::has_blanks(layer) => add("no value", Key::Blank),
            Layer::Lanes { categories, .. } => {
                categories.iter().enumerate().for_each(|(index, name)| add(name, Key::Fill(index)));
            }
            _ => (),
        }
    }
    let (mut x, mut row) = (0.0, 0);
    for entry in &mut entries {
        let wide = entry.key_width() + KEY_GAP + text::width(&entry.label, SIZE);
        if x > 0.0 && x + wide > width {
            (x, row) = (0.0, row + 1);
        }
        (entry.x, entry.row) = (x, row);
        x += wide + ENTRY_GAP;
    }
    entries
}

pub(super) fn height(entries: &[Entry]) -> f64 {
    entries.last().map_or(0.0, |last| (last.row + 1) as f64 * ROW)
}

/// Draws the entries with their upper left corner at `corner`.
pub(super) fn draw<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    entries: &[Entry],
    corner: Point,
) -> Result<(), FigureError> {
    let set = Type { size: SIZE, colour: INK, align: Align::Start, upwards: false };
    for entry in entries {
        let left = corner.0 + entry.x;
        let middle = corner.1 + (entry.row as f64 + 0.5) * ROW;
        for key in &entry.keys {
            draw_key(canvas, *key, (left, left + entry.key_width()), middle)?;
        }
        canvas.text(&entry.label, (left + entry.key_width() + KEY_GAP, middle + 0.36 * SIZE), set)?;
    }
    Ok(())
}

fn draw_key<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    key: Key,
    (left, right): (f64, f64),
    middle: f64,
) -> Result<(), FigureError> {
    let centre = ((left + right) / 2.0, middle);
    let area = Rect { left, top: middle - 6.0, right, bottom: middle + 6.0 };
    match key {
        Key::Line(style) => {
            let line = vec![(left, middle), (right, middle)];
            let strokes =
                if style.dashes().is_empty() { vec![line] } else { dash(&line, style.dashes(), COLUMN) };
            for stroke in strokes {
                canvas.path(&stroke, style.colour(), LINE_WIDTH * 1.2)?;
            }
            Ok(())
        }
        Key::Marker(style) => draw_marker(canvas, style, centre, MARKER_RADIUS),
        Key::Band(style) => canvas.rect(area, faded(style.colour(), BAND_OPACITY)),
        Key::Bar(style) => {
            canvas.path(
                &[(centre.0, area.top - 1.0), (centre.0, area.bottom + 1.0)],
                style.colour(),
                LINE_WIDTH,
            )?;
            draw_marker(canvas, style, centre, MARKER_RADIUS)
        }
        Key::UpperLimit(style) => draw_upper_limit(canvas, style, (centre.0, middle - 6.0), None),
        Key::Blank => {
            heat::blank(canvas, area)?;
            canvas.outline(area, FRAME, 0.75)
        }
        Key::Fill(category) => {
            draw_fill(canvas, category, area)?;
            canvas.outline(area, FRAME, 0.75)
        }
    }
}
