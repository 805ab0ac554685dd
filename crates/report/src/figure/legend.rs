//! The legend of a panel: a row of keys above it, which never covers data.

use super::canvas::{Align, Canvas, Point, Rect, Type};
use super::layers::{BAND_OPACITY, COLUMN, draw_fill, draw_markers, draw_upper_limit};
use super::reduce::dash;
use super::style::{FILLS, FRAME, INK, LINE_WIDTH, MARKER_RADIUS, Style};
use super::svg::Svg;
use super::{Layer, Panel, heat, text};

const SIZE: f64 = 13.0;
const LONG_KEY: f64 = 30.0;
const SHORT_KEY: f64 = 12.0;
const KEY_GAP: f64 = 7.0;
const ENTRY_GAP: f64 = 22.0;
/// Height of one row.
pub(super) const ROW: f64 = 20.0;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Key {
    Line(Style),
    Marker(Style),
    Band(Style),
    Bar(Style),
    UpperLimit(Style),
    /// Cells without a value.
    Blank,
    /// Index of the fill.
    Fill(usize),
}

/// What a label means: the looks of all layers that have it, each once.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Entry {
    pub label: String,
    pub keys: Vec<Key>,
}

/// An entry's place, from the left end of the legend.
pub(super) struct Placed {
    entry: Entry,
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

/// The entries of a panel; none if it has no legend.
pub(super) fn entries(panel: &Panel) -> Vec<Entry> {
    let mut entries: Vec<Entry> = Vec::new();
    let mut add = |label: &str, key: Key| match entries.iter_mut().find(|entry| entry.label == label) {
        Some(entry) if entry.keys.contains(&key) => (),
        Some(entry) => entry.keys.push(key),
        None => entries.push(Entry { label: label.to_owned(), keys: vec![key] }),
    };
    for layer in panel.layers.iter().filter(|_| panel.legend) {
        match layer {
            Layer::Line { label: Some(label), style, .. }
            | Layer::Steps { label: Some(label), style, .. } => add(label, Key::Line(*style)),
            Layer::Points { label: Some(label), style, .. } => add(label, Key::Marker(*style)),
            Layer::Band { label: Some(label), style, .. } => add(label, Key::Band(*style)),
            Layer::ErrorBars { label: Some(label), style, .. } => add(label, Key::Bar(*style)),
            Layer::UpperLimits { label: Some(label), style, .. } => add(label, Key::UpperLimit(*style)),
            Layer::Hatched { label: Some(label), .. } => add(label, Key::Blank),
            Layer::Heat { .. } => heat::blanks(layer).into_iter().for_each(|blank| add(blank, Key::Blank)),
            Layer::Lanes { categories, .. } => {
                categories.iter().enumerate().for_each(|(index, name)| add(name, Key::Fill(index % FILLS)));
            }
            _ => (),
        }
    }
    entries
}

/// The entries of a panel in rows at most `width` wide.
pub(super) fn place(panel: &Panel, width: f64) -> Vec<Placed> {
    let (mut x, mut row) = (0.0, 0);
    let place = |entry: Entry| {
        let wide = entry.key_width() + KEY_GAP + text::width(&entry.label, SIZE);
        if x > 0.0 && x + wide > width {
            (x, row) = (0.0, row + 1);
        }
        let at = x;
        x += wide + ENTRY_GAP;
        Placed { entry, x: at, row }
    };
    entries(panel).into_iter().map(place).collect()
}

pub(super) fn height(entries: &[Placed]) -> f64 {
    entries.last().map_or(0.0, |last| (last.row + 1) as f64 * ROW)
}

/// Draws the entries with their upper left corner at `corner`.
pub(super) fn draw(canvas: &mut dyn Canvas, entries: &[Placed], corner: Point) {
    let set = Type { size: SIZE, colour: INK, align: Align::Start, upwards: false };
    for Placed { entry, x, row } in entries {
        let (left, middle) = (corner.0 + x, corner.1 + (*row as f64 + 0.5) * ROW);
        let right = left + entry.key_width();
        for key in &entry.keys {
            draw_key(canvas, *key, (left, right), middle);
        }
        canvas.lines(&entry.label, (right + KEY_GAP, middle), set);
    }
}

/// A key as an SVG of its own.
pub(crate) fn swatch(keys: &[Key]) -> String {
    let mut canvas = Svg::new(30, 14);
    for key in keys {
        draw_key(&mut canvas, *key, (0.5, 29.5), 7.0);
    }
    canvas.finish()
}

fn draw_key(canvas: &mut dyn Canvas, key: Key, (left, right): (f64, f64), middle: f64) {
    let area = Rect { left, top: middle - 6.0, right, bottom: middle + 6.0 };
    let centre = area.centre();
    match key {
        Key::Line(style) => {
            let line = vec![(left, middle), (right, middle)];
            let dashes = style.dashes();
            let strokes = if dashes.is_empty() { vec![line] } else { dash(&line, dashes, COLUMN) };
            canvas.strokes(&strokes, style.colour(), LINE_WIDTH * 1.2);
        }
        Key::Marker(style) => draw_markers(canvas, style, &[centre], MARKER_RADIUS),
        Key::Band(style) => canvas.rect(area, style.colour().faded(BAND_OPACITY)),
        Key::Bar(style) => {
            let whisker = [(centre.0, area.top - 1.0), (centre.0, area.bottom + 1.0)];
            canvas.path(&whisker, style.colour(), LINE_WIDTH);
            draw_markers(canvas, style, &[centre], MARKER_RADIUS);
        }
        Key::UpperLimit(style) => draw_upper_limit(canvas, style, (centre.0, area.top), f64::INFINITY),
        Key::Blank => {
            heat::blank(canvas, area);
            canvas.outline(area, FRAME, 0.75);
        }
        Key::Fill(category) => {
            draw_fill(canvas, category, area);
            canvas.outline(area, FRAME, 0.75);
        }
    }
}
