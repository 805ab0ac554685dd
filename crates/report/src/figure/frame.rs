//! Drawing a figure: its titles, the axes of its panels and, through [`layers`], what is in them.

use super::axis::Tick;
use super::canvas::{Align, Canvas, Rect, Type};
use super::layout::{
    LABEL, LABEL_LINE, PAD, PanelLayout, SMALL, SMALL_LINE, TICK, TICK_GAP, TITLE, TITLE_LINE, layout,
};
use super::style::{FRAME, GRID, INK, QUIET, WHITE};
use super::{Figure, FigureError, Layer, Panel, extent, layers, legend};
use plotters::backend::DrawingBackend;

/// From the middle of a line of type down to its baseline, per type size: half the height of a digit.
const HALF: f64 = 0.36;

type Drawn = Result<(), FigureError>;

fn plain(size: f64, align: Align) -> Type {
    Type { size, colour: INK, align, upwards: false }
}

pub(super) fn draw<B: DrawingBackend>(canvas: &mut Canvas<B>, figure: &Figure) -> Drawn {
    let whole =
        Rect { left: 0.0, top: 0.0, right: f64::from(figure.width), bottom: f64::from(figure.height) };
    canvas.rect(whole, WHITE)?;
    let places = layout(figure);
    let mut y = PAD;
    for line in &places.title {
        canvas.text(line, (PAD, y + 0.5 * TITLE_LINE + HALF * TITLE), plain(TITLE, Align::Start))?;
        y += TITLE_LINE;
    }
    for line in &places.subtitle {
        let set = Type { colour: QUIET, ..plain(SMALL, Align::Start) };
        canvas.text(line, (PAD, y + 0.5 * SMALL_LINE + HALF * SMALL), set)?;
        y += SMALL_LINE;
    }
    for (panel, place) in figure.panels.iter().zip(&places.panels) {
        draw_panel(canvas, panel, place)?;
    }
    Ok(())
}

fn draw_panel<B: DrawingBackend>(canvas: &mut Canvas<B>, panel: &Panel, place: &PanelLayout) -> Drawn {
    let plot = &place.plot;
    let area = plot.area;
    let has = |is: fn(&Layer) -> bool| panel.layers.iter().any(is);
    let has_lanes = has(|layer| matches!(layer, Layer::Lanes { .. }));
    let has_cells = has(|layer| matches!(layer, Layer::Heat { .. }));
    let major = |tick: &&Tick| !tick.text.is_empty() && !has_cells;
    for tick in place.x_ticks.ticks.iter().filter(major) {
        let x = plot.x.at(tick.at);
        canvas.path(&[(x, area.top), (x, area.bottom)], GRID, 1.0)?;
    }
    for tick in place.y_ticks.iter().filter(major).filter(|_| !has_lanes) {
        let y = plot.y.at(tick.at);
        canvas.path(&[(area.left, y), (area.right, y)], GRID, 1.0)?;
    }
    for layer in &panel.layers {
        layers::draw(canvas, plot, layer)?;
    }
    if !extent::has_data(panel) {
        let centre = ((area.left + area.right) / 2.0, (area.top + area.bottom) / 2.0 + HALF * LABEL);
        if has_cells {
            let half = 40.0;
            let (left, right) = (centre.0 - half, centre.0 + half);
            canvas.rect(
                Rect { left, right, top: centre.1 - 1.4 * LABEL, bottom: centre.1 + 0.7 * LABEL },
                WHITE,
            )?;
        }
        canvas.text("no data", centre, Type { colour: QUIET, ..plain(LABEL, Align::Middle) })?;
    }
    canvas.outline(area, FRAME, 1.0)?;

    let mut y = area.bottom;
    if let Some(bar) = &place.bar {
        bar.draw(canvas, area)?;
    }
    for tick in &place.x_ticks.ticks {
        draw_x_tick(canvas, place, tick)?;
    }
    if !place.shares_x {
        y += TICK + TICK_GAP + place.x_ticks.height;
        for line in &place.x_label {
            let at = ((area.left + area.right) / 2.0, y + 0.5 * LABEL_LINE + HALF * LABEL);
            canvas.text(line, at, plain(LABEL, Align::Middle))?;
            y += LABEL_LINE;
        }
    }
    for tick in &place.y_ticks {
        let y = plot.y.at(tick.at);
        canvas.path(&[(area.left - mark(tick), y), (area.left, y)], FRAME, 1.0)?;
        canvas.lines(&tick.text, (area.left - TICK - TICK_GAP, y), plain(SMALL, Align::End))?;
    }
    let middle = (area.top + area.bottom) / 2.0;
    for (index, line) in place.y_label.iter().enumerate() {
        let x = PAD + (index as f64 + 0.5) * LABEL_LINE + HALF * LABEL;
        canvas.text(line, (x, middle), Type { upwards: true, ..plain(LABEL, Align::Middle) })?;
    }
    draw_notes(canvas, place)?;
    let rows = place.above.iter().map(|note| note.row + 1).max().unwrap_or(0);
    let top = area.top - 4.0 - rows as f64 * SMALL_LINE - legend::height(&place.legend);
    legend::draw(canvas, &place.legend, (area.left, top))
}

/// The length of a tick's mark.
fn mark(tick: &Tick) -> f64 {
    if tick.text.is_empty() { 0.6 * TICK } else { TICK }
}

fn draw_x_tick<B: DrawingBackend>(canvas: &mut Canvas<B>, place: &PanelLayout, tick: &Tick) -> Drawn {
    let (x, bottom) = (place.plot.x.at(tick.at), place.plot.area.bottom);
    canvas.path(&[(x, bottom), (x, bottom + mark(tick))], FRAME, 1.0)?;
    if place.shares_x {
        return Ok(());
    }
    if place.x_ticks.upright {
        let at = (x + HALF * SMALL, bottom + TICK + TICK_GAP);
        return canvas.text(&tick.text, at, Type { upwards: true, ..plain(SMALL, Align::End) });
    }
    for (row, line) in tick.text.lines().enumerate() {
        let y = bottom + TICK + TICK_GAP + (row as f64 + 0.5) * SMALL_LINE + HALF * SMALL - 2.0;
        canvas.text(line, (x, y), plain(SMALL, Align::Middle))?;
    }
    Ok(())
}

/// The labels of rules.
fn draw_notes<B: DrawingBackend>(canvas: &mut Canvas<B>, place: &PanelLayout) -> Drawn {
    let area = place.plot.area;
    for note in &place.above {
        let y = area.top - 6.0 - note.row as f64 * SMALL_LINE;
        canvas.text(&note.text, (note.at, y), Type { colour: QUIET, ..plain(SMALL, Align::Middle) })?;
    }
    for note in &place.beside {
        let at = (area.right + 6.0, note.at + HALF * SMALL);
        canvas.text(&note.text, at, Type { colour: QUIET, ..plain(SMALL, Align::Start) })?;
    }
    Ok(())
}
