//! Drawing a figure: its titles, the axes of its panels and, through [`layers`], what is in them.

use super::axis::Tick;
use super::canvas::{Align, Canvas, HALF, Rect, Type};
use super::layout::{
    LABEL, LABEL_LINE, PAD, PanelLayout, SMALL, SMALL_LINE, TICK, TICK_GAP, TITLE, TITLE_LINE, layout,
};
use super::style::{FRAME, GRID, INK, QUIET, WHITE};
use super::{Figure, Panel, extent, layers, legend};

fn plain(size: f64, align: Align) -> Type {
    Type { size, colour: INK, align, upwards: false }
}

pub(super) fn draw(canvas: &mut dyn Canvas, figure: &Figure) {
    let (right, bottom) = (f64::from(figure.width), f64::from(figure.height));
    canvas.rect(Rect { left: 0.0, top: 0.0, right, bottom }, WHITE);
    let places = layout(figure);
    let mut y = PAD;
    for line in &places.title {
        canvas.text(line, (PAD, y + 0.5 * TITLE_LINE + HALF * TITLE), plain(TITLE, Align::Start));
        y += TITLE_LINE;
    }
    for line in &places.subtitle {
        let set = Type { colour: QUIET, ..plain(SMALL, Align::Start) };
        canvas.text(line, (PAD, y + 0.5 * SMALL_LINE + HALF * SMALL), set);
        y += SMALL_LINE;
    }
    for (panel, place) in figure.panels.iter().zip(&places.panels) {
        draw_panel(canvas, panel, place);
    }
}

fn draw_panel(canvas: &mut dyn Canvas, panel: &Panel, place: &PanelLayout) {
    let plot = &place.plot;
    let area = plot.area;
    let (has_lanes, has_cells) = (panel.has_lanes(), panel.has_cells());
    let major = |tick: &&Tick| !tick.text.is_empty() && !has_cells;
    for tick in place.x_ticks.ticks.iter().filter(major) {
        let x = plot.x.at(tick.at);
        canvas.path(&[(x, area.top), (x, area.bottom)], GRID, 1.0);
    }
    for tick in place.y_ticks.iter().filter(major).filter(|_| !has_lanes) {
        let y = plot.y.at(tick.at);
        canvas.path(&[(area.left, y), (area.right, y)], GRID, 1.0);
    }
    for layer in &panel.layers {
        layers::draw(canvas, plot, layer);
    }
    if !extent::has_data(panel) {
        let (x, y) = area.centre();
        if has_cells {
            canvas.rect(Rect { left: x - 40.0, right: x + 40.0, top: y - 15.0, bottom: y + 15.0 }, WHITE);
        }
        canvas.lines("no data", (x, y), Type { colour: QUIET, ..plain(LABEL, Align::Middle) });
    }
    canvas.outline(area, FRAME, 1.0);
    if let Some(bar) = &place.bar {
        bar.draw(canvas, area);
    }
    for tick in &place.x_ticks.ticks {
        draw_x_tick(canvas, place, tick);
    }
    let below = area.bottom + TICK + TICK_GAP + place.x_ticks.height;
    let labels = if place.shares_x { &[][..] } else { &place.x_label };
    for (index, line) in labels.iter().enumerate() {
        let at = (area.centre().0, below + (index as f64 + 0.5) * LABEL_LINE);
        canvas.lines(line, at, plain(LABEL, Align::Middle));
    }
    for tick in &place.y_ticks {
        let y = plot.y.at(tick.at);
        canvas.path(&[(area.left - tick.mark(), y), (area.left, y)], FRAME, 1.0);
        canvas.lines(&tick.text, (area.left - TICK - TICK_GAP, y), plain(SMALL, Align::End));
    }
    draw_upwards(canvas, &place.y_label, (PAD, area.centre().1));
    draw_notes(canvas, place);
    let rows = place.above.iter().map(|note| note.row + 1).max().unwrap_or(0);
    let top = area.top - 4.0 - rows as f64 * SMALL_LINE - legend::height(&place.legend);
    legend::draw(canvas, &place.legend, (area.left, top));
    for (index, line) in place.title.iter().rev().enumerate() {
        let at = (area.left, top - (index as f64 + 0.5) * LABEL_LINE);
        canvas.lines(line, at, plain(LABEL, Align::Start));
    }
}

/// Lines of a label that read from bottom to top, the first with its left edge and all with their middle at a place.
pub(super) fn draw_upwards(canvas: &mut dyn Canvas, label: &[String], (left, middle): (f64, f64)) {
    for (index, line) in label.iter().enumerate() {
        let x = left + (index as f64 + 0.5) * LABEL_LINE + HALF * LABEL;
        canvas.text(line, (x, middle), Type { upwards: true, ..plain(LABEL, Align::Middle) });
    }
}

fn draw_x_tick(canvas: &mut dyn Canvas, place: &PanelLayout, tick: &Tick) {
    let (x, bottom) = (place.plot.x.at(tick.at), place.plot.area.bottom);
    canvas.path(&[(x, bottom), (x, bottom + tick.mark())], FRAME, 1.0);
    let below = bottom + TICK + TICK_GAP;
    if place.shares_x {
        return;
    }
    if place.x_ticks.upright {
        let set = Type { upwards: true, ..plain(SMALL, Align::End) };
        return canvas.text(&tick.text, (x + HALF * SMALL, below), set);
    }
    for (row, line) in tick.text.lines().enumerate() {
        let y = below + (row as f64 + 0.5) * SMALL_LINE - 2.0;
        canvas.lines(line, (x, y), plain(SMALL, Align::Middle));
    }
}

/// The labels of rules.
fn draw_notes(canvas: &mut dyn Canvas, place: &PanelLayout) {
    let area = place.plot.area;
    for note in &place.above {
        let y = area.top - 6.0 - note.row as f64 * SMALL_LINE;
        canvas.text(&note.text, (note.at, y), Type { colour: QUIET, ..plain(SMALL, Align::Middle) });
    }
    for note in &place.beside {
        let set = Type { colour: QUIET, ..plain(SMALL, Align::Start) };
        canvas.lines(&note.text, (area.right + 6.0, note.at), set);
    }
}
