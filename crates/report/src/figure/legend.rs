//! The legend of a panel: a row of keys above it, which never covers data.

use super::backend::{Backend, Drawn, Point, Rect, Sheet, px};
use super::chart::{LEFT, SMALL, type_of};
use super::layers::{BAND_OPACITY, draw_fill, line, marker, upper_limit};
use super::style::{FILLS, FRAME, INK, LINE_WIDTH, Style};
use super::svg::Svg;
use super::{Layer, Panel, heat, text};
use plotters::drawing::IntoDrawingArea;
use plotters::element::{PathElement, Rectangle};
use std::cell::RefCell;
use std::rc::Rc;

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

/// A label and the looks of all layers that have it, each once.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Entry {
    pub label: String,
    pub keys: Vec<Key>,
}

/// An entry, its place from the left end of the legend, its row.
pub(super) type Placed = (Entry, f64, usize);

impl Entry {
    /// Returns the width of the keys: markers alone need less room than pieces of line.
    fn key_width(&self) -> f64 {
        let short =
            self.keys.iter().all(|key| matches!(key, Key::Marker(_) | Key::Bar(_) | Key::UpperLimit(_)));
        if short { SHORT_KEY } else { LONG_KEY }
    }
}

/// Returns the entries of a panel; none if it has no legend.
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

/// Returns the entries of a panel in rows at most `width` wide. A label that is wider than a row has several, one for each of its lines.
pub(super) fn place(panel: &Panel, width: f64) -> Vec<Placed> {
    // Where the next entry of a row begins, the row, and the first row that is free.
    let (mut x, mut row, mut next) = (0.0, 0, 0);
    let place = |mut entry: Entry| {
        let beside = entry.key_width() + KEY_GAP;
        let wide = beside + text::width(&entry.label, SMALL);
        if x > 0.0 && x + wide > width {
            (x, row) = (0.0, next);
        }
        if wide > width {
            entry.label = text::wrap(&entry.label, SMALL, width - beside).join("\n");
        }
        let at = x;
        x += wide + ENTRY_GAP;
        next = next.max(row + rows(&entry));
        (entry, at, row)
    };
    entries(panel).into_iter().map(place).collect()
}

/// The rows of an entry: the lines of its label.
fn rows(entry: &Entry) -> usize {
    entry.label.lines().count().max(1)
}

pub(super) fn height(entries: &[Placed]) -> f64 {
    entries.iter().map(|(entry, _, row)| row + rows(entry)).max().unwrap_or(0) as f64 * ROW
}

/// Draws the entries with their upper left corner at `corner`.
pub(super) fn draw(sheet: &Sheet, entries: &[Placed], corner: Point) -> Drawn {
    for (entry, x, row) in entries {
        let (left, middle) = (corner.0 + x, corner.1 + (*row as f64 + 0.5 * rows(entry) as f64) * ROW);
        let right = left + entry.key_width();
        for key in &entry.keys {
            draw_key(sheet, *key, (left, right), middle)?;
        }
        sheet.draw_text(&entry.label, &type_of(SMALL, INK).pos(LEFT), (px(right + KEY_GAP), px(middle)))?;
    }
    Ok(())
}

/// Returns a key as a separate SVG.
pub(crate) fn swatch(keys: &[Key]) -> String {
    let svg = Rc::new(RefCell::new(Svg::new(30, 14)));
    let sheet = Backend::new(svg.clone(), 30, 14).into_drawing_area();
    for key in keys {
        draw_key(&sheet, *key, (0.5, 29.5), 7.0).expect("an SVG takes everything");
    }
    svg.take().finish()
}

fn draw_key(sheet: &Sheet, key: Key, (left, right): (f64, f64), middle: f64) -> Drawn {
    let area = Rect { left, top: middle - 6.0, right, bottom: middle + 6.0 };
    let (x, y) = (px(area.centre().0), px(middle));
    let framed = || sheet.draw(&Rectangle::new(area.corners(), FRAME.stroke(0.75)));
    match key {
        Key::Line(style) => sheet.draw(&line(
            vec![(px(left), y), (px(right), y)],
            style.colour(),
            1.2 * LINE_WIDTH,
            style.dashes(),
        )),
        Key::Marker(style) => sheet.draw(&marker(style, (x, y))),
        Key::Band(style) => {
            sheet.draw(&Rectangle::new(area.corners(), style.colour().faded(BAND_OPACITY).fill()))
        }
        Key::Bar(style) => {
            let whisker = vec![(x, px(area.top - 1.0)), (x, px(area.bottom + 1.0))];
            sheet.draw(&PathElement::new(whisker, style.colour().stroke(LINE_WIDTH)))?;
            sheet.draw(&marker(style, (x, y)))
        }
        Key::UpperLimit(style) => sheet.draw(&upper_limit(style, (x, px(area.top)), f64::INFINITY)),
        Key::Blank => heat::blank(sheet, area).and_then(|()| framed()),
        Key::Fill(category) => draw_fill(sheet, category, area).and_then(|()| framed()),
    }
}
