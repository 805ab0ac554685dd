//! A figure as charts of plotters: where each is, its mesh and axes, and the texts around it.

use super::axis::{SHORT_MARKS, Scale, Tick};
use super::backend::{Backend, Drawn, Rect, Sheet, Surface, UNIT, px};
use super::colour::Colour;
use super::heat::{self, Bar};
use super::legend::{self, Placed};
use super::style::{FRAME, GRID, INK, QUIET, WHITE};
use super::text::{width, wrap};
use super::ticks::{self, text_width};
use super::{Figure, Layer, Panel, extent, layers};
use plotters::chart::{ChartBuilder, ChartContext};
use plotters::coord::cartesian::Cartesian2d;
use plotters::drawing::IntoDrawingArea;
use plotters::element::Rectangle;
use plotters::style::{FontDesc, FontFamily, FontStyle, FontTransform, TRANSPARENT, TextStyle};
use plotters_backend::BackendColor;
use plotters_backend::text_anchor::{HPos, Pos, VPos};
use std::cell::RefCell;
use std::rc::Rc;

/// Type sizes and heights of lines, in logical pixels.
const TITLE: f64 = 17.0;
const TITLE_LINE: f64 = 23.0;
pub(super) const SMALL: f64 = 13.0;
pub(super) const SMALL_LINE: f64 = 17.0;
pub(super) const LABEL: f64 = 14.0;
pub(super) const LABEL_LINE: f64 = 18.0;

/// Free space around the figure.
const PAD: f64 = 12.0;
/// Length of a tick.
pub(super) const TICK: f64 = 4.5;
/// Length of a tick without text.
const SHORT_TICK: f64 = 2.7;
/// Gap between a tick and its text: plotters leaves as much as the tick is long.
pub(super) const TICK_GAP: f64 = TICK;
/// Space between a panel and the one below it.
const BETWEEN: f64 = 16.0;

pub(super) const LEFT: Pos = Pos { h_pos: HPos::Left, v_pos: VPos::Center };
pub(super) const CENTRE: Pos = Pos { h_pos: HPos::Center, v_pos: VPos::Center };

/// A panel as a chart of plotters: coordinates are those of the data.
pub type Chart = ChartContext<'static, Backend, Cartesian2d<Scale, Scale>>;

/// Returns the type of a size in logical pixels.
pub(super) fn type_of(size: f64, Colour(r, g, b, alpha): Colour) -> TextStyle<'static> {
    let font = FontDesc::new(FontFamily::SansSerif, size * UNIT, FontStyle::Normal);
    TextStyle { color: BackendColor { alpha, rgb: (r, g, b) }, ..font.into() }
}

/// Returns the plotting area of a chart.
pub(super) fn area(chart: &Chart) -> Rect {
    let (x, y) = chart.plotting_area().get_pixel_range();
    let at = |place: i32| f64::from(place) / UNIT;
    Rect { left: at(x.start), right: at(x.end), top: at(y.start), bottom: at(y.end) }
}

/// Returns the axes of a chart without its mesh: labels, numbers, long marks, then short ones.
pub(super) fn axes(chart: &mut Chart, x_label: &str, y_label: &str) -> Drawn {
    for (marks, size, labels) in [(2, TICK, [x_label, y_label]), (SHORT_MARKS, SHORT_TICK, [""; 2])] {
        let mut mesh = chart.configure_mesh();
        mesh.disable_mesh().x_labels(marks).y_labels(marks).set_all_tick_mark_size(px(size));
        mesh.axis_style(FRAME.stroke(1.0)).label_style(type_of(SMALL, INK));
        mesh.axis_desc_style(type_of(LABEL, INK)).x_desc(labels[0]).y_desc(labels[1]).draw()?;
    }
    Ok(())
}

/// Place of a panel and of the texts around it, which may have several lines.
#[derive(Default)]
struct Place {
    area: Rect,
    x: Scale,
    y: Scale,
    /// The horizontal axis shares texts of ticks and label with that of the next panel.
    shares_x: bool,
    /// The texts of the horizontal ticks read from bottom to top.
    upright: bool,
    title: String,
    x_label: String,
    y_label: String,
    legend: Vec<Placed>,
    /// The labels of vertical rules: middle, line counted from the panel, text.
    notes: Vec<(f64, usize, String)>,
    bar: Option<Bar>,
}

/// Returns the height of a text of which each line is so high.
fn height(text: &str, line: f64) -> f64 {
    text.lines().count() as f64 * line
}

impl Place {
    /// Returns the top of the legend.
    fn legend_top(&self) -> f64 {
        let rows = self.notes.iter().map(|note| note.1 + 1).max().unwrap_or(0);
        self.area.top - 4.0 - rows as f64 * SMALL_LINE - legend::height(&self.legend)
    }

    fn above(&self) -> f64 {
        let room = self.area.top - self.legend_top() + height(&self.title, LABEL_LINE);
        if room > 4.0 { room } else { SMALL / 2.0 }
    }

    fn below(&self) -> f64 {
        if self.shares_x {
            return BETWEEN;
        }
        let of =
            |tick: &Tick| if self.upright { text_width(tick) + 4.0 } else { height(&tick.text, SMALL_LINE) };
        let texts = self.x.ticks.iter().map(of).fold(0.0, f64::max) + height(&self.x_label, LABEL_LINE);
        BETWEEN + TICK + TICK_GAP + texts + 2.0
    }
}

/// Draws a figure, and `more` on the chart of each panel, over its layers.
pub(super) fn draw(
    surface: Rc<RefCell<dyn Surface>>,
    figure: &Figure,
    more: &mut dyn FnMut(usize, &mut Chart) -> Drawn,
) -> Drawn {
    let sheet = Backend::new(surface, figure.width, figure.height).into_drawing_area();
    let (right, bottom) = (f64::from(figure.width), f64::from(figure.height));
    sheet.draw(&Rectangle::new(Rect { left: 0.0, top: 0.0, right, bottom }.corners(), WHITE.fill()))?;
    let room = right - 2.0 * PAD;
    let mut top = PAD;
    let subtitle = figure.subtitle.as_deref().unwrap_or("");
    for (text, size, line, ink) in
        [(&*figure.title, TITLE, TITLE_LINE, INK), (subtitle, SMALL, SMALL_LINE, QUIET)]
    {
        for text in wrap(text, size, room) {
            sheet.draw_text(&text, &type_of(size, ink).pos(LEFT), (px(PAD), px(top + 0.5 * line)))?;
            top += line;
        }
    }
    let top = if top > PAD { top + 6.0 } else { top };
    for (index, (panel, place)) in figure.panels.iter().zip(places(figure, top)).enumerate() {
        draw_panel(&sheet, panel, place, |chart| {
            panel.layers.iter().try_for_each(|layer| layers::draw(chart, layer))?;
            more(index, chart)
        })?;
    }
    Ok(())
}

fn draw_panel(
    sheet: &Sheet,
    panel: &Panel,
    place: Place,
    draw_layers: impl FnOnce(&mut Chart) -> Drawn,
) -> Drawn {
    let area = place.area;
    let (small, quiet) = (type_of(SMALL, INK), type_of(SMALL, QUIET));
    let below = (TICK + TICK_GAP + 1.0).max(place.below() - BETWEEN);
    let room = (px(area.right - PAD), px(area.height() + below));
    let mut chart = ChartBuilder::on(&sheet.clone().shrink((px(PAD), px(area.top)), room))
        .y_label_area_size(px(area.left - PAD))
        .x_label_area_size(px(below))
        .build_cartesian_2d(place.x.clone(), place.y.clone())?;
    if !panel.has_cells() {
        let mut mesh = chart.configure_mesh();
        mesh.disable_axes().bold_line_style(GRID.stroke(1.0)).light_line_style(TRANSPARENT);
        if panel.has_lanes() {
            mesh.disable_y_mesh();
        }
        mesh.draw()?;
    }
    draw_layers(&mut chart)?;
    if !panel.has_data() {
        let (x, y) = area.centre();
        if panel.has_cells() {
            let ground = Rect { left: x - 40.0, right: x + 40.0, top: y - 15.0, bottom: y + 15.0 };
            sheet.draw(&Rectangle::new(ground.corners(), WHITE.fill()))?;
        }
        sheet.draw_text("no data", &type_of(LABEL, QUIET).pos(CENTRE), (px(x), px(y)))?;
    }
    sheet.draw(&Rectangle::new(area.corners(), FRAME.stroke(1.0)))?;
    axes(&mut chart, &place.x_label, &place.y_label)?;
    if place.upright && !place.shares_x {
        // plotters sets a turned text with its middle at the tick; these end there.
        let set = small.transform(FontTransform::Rotate270).pos(Pos { h_pos: HPos::Right, ..CENTRE });
        for tick in &place.x.ticks {
            let x = place.x.at(tick.at, (area.left, area.right));
            sheet.draw_text(&tick.text, &set, (px(x), px(area.bottom + TICK + TICK_GAP)))?;
        }
    }
    for (at, row, text) in &place.notes {
        let y = area.top - 10.5 - *row as f64 * SMALL_LINE;
        sheet.draw_text(text, &quiet.pos(CENTRE), (px(*at), px(y)))?;
    }
    for (y, text) in notes_beside(panel, &place.y, area) {
        sheet.draw_text(text, &quiet.pos(LEFT), (px(area.right + 6.0), px(y)))?;
    }
    let top = place.legend_top();
    legend::draw(sheet, &place.legend, (area.left, top))?;
    let middle = top - 0.5 * height(&place.title, LABEL_LINE);
    sheet.draw_text(&place.title, &type_of(LABEL, INK).pos(LEFT), (px(area.left), px(middle)))?;
    place.bar.map_or(Ok(()), |bar| bar.draw(sheet, area.right + notes_width(panel), area))
}

/// Returns the places of the panels below `top`.
fn places(figure: &Figure, top: f64) -> Vec<Place> {
    let weight = |p: &Panel| if p.weight.is_finite() && p.weight > 0.0 { p.weight } else { 1.0 };
    let total: f64 = figure.panels.iter().map(weight).sum();
    let space = f64::from(figure.height) - top - PAD;
    let shares = |room: f64| figure.panels.iter().map(move |p| weight(p) / total * room);
    // How many ticks and lines of label fit depends on heights that depend on the legends, which depend on the
    // width of the ticks' texts: a second pass starts from the heights the first one found.
    let mut heights: Vec<f64> = shares(space).map(|share| share - 60.0).collect();
    let mut places = Vec::new();
    for _ in 0..2 {
        places = side_by_side(figure, &heights);
        let taken: f64 = places.iter().map(|p| p.above() + p.below()).sum::<f64>() - BETWEEN;
        heights = shares(space - taken).map(|share| share.max(20.0)).collect();
        let mut y = top;
        for (place, height) in places.iter_mut().zip(&heights) {
            y += place.above();
            (place.area.top, place.area.bottom) = (y, y + height);
            y += height + place.below();
        }
    }
    places
}

/// Returns the places of the panels without their vertical positions; all panels have the same left and right ends.
fn side_by_side(figure: &Figure, heights: &[f64]) -> Vec<Place> {
    let (wide, panels) = (f64::from(figure.width), &figure.panels);
    // Names taller or wider than this would leave too little of the figure.
    let tall = (0.4 * f64::from(figure.height) / panels.len().max(1) as f64).clamp(60.0, 200.0);
    // Neighbours with equal axes are shown over the same range.
    let groups = panels.chunk_by(|a, b| a.x == b.x);
    let ranges = groups.flat_map(|group| vec![extent::horizontal(group); group.len()]);
    let mut places = Vec::new();
    for (index, ((panel, shown), &height)) in panels.iter().zip(ranges).zip(heights).enumerate() {
        let y_range = extent::vertical(panel, shown);
        let ticks = ticks::vertical(&panel.lane_axis(), y_range, height, 0.3 * wide);
        places.push(Place {
            x: Scale::new(shown, panel.x.scale),
            y: Scale { ticks, ..Scale::new(y_range, panel.y.scale) },
            shares_x: panels.get(index + 1).is_some_and(|next| next.x == panel.x),
            y_label: wrap(&panel.y.label, LABEL, height).join("\n"),
            bar: heat::bar(panel, height),
            ..Place::default()
        });
    }
    let widest = |of: &dyn Fn(&Place) -> f64| places.iter().map(of).fold(0.0, f64::max);
    let tick_width = widest(&|place| place.y.ticks.iter().map(text_width).fold(0.0, f64::max));
    let left = PAD + widest(&|place| height(&place.y_label, LABEL_LINE)) + 6.0 + tick_width + TICK_GAP + TICK;
    let beside = panels
        .iter()
        .zip(&places)
        .map(|(panel, place)| notes_width(panel) + place.bar.as_ref().map_or(0.0, Bar::width));
    let mut right = wide - PAD - beside.fold(12.0, f64::max);
    // The text of a tick near the right end reaches beyond it: the second pass has the room.
    for _ in 0..2 {
        let ends = (left, right);
        let mut beyond = wide - PAD / 2.0;
        for (place, panel) in places.iter_mut().zip(panels) {
            (place.x.ticks, place.upright) = ticks::horizontal(&panel.x, &place.x, ends, tall);
            place.x.is_mute = place.upright || place.shares_x;
            let half = |tick| if place.upright { SMALL_LINE / 2.0 } else { text_width(tick) / 2.0 };
            let reach = place.x.ticks.iter().map(|tick| place.x.at(tick.at, ends) + half(tick));
            beyond = reach.fold(beyond, f64::max);
        }
        right = (right - (beyond - (wide - PAD / 2.0))).max(left + 20.0);
    }
    for (place, panel) in places.iter_mut().zip(panels) {
        (place.area.left, place.area.right) = (left, right);
        place.title = wrap(&panel.title, LABEL, right - left).join("\n");
        if !place.shares_x {
            place.x_label = wrap(&panel.x.label, LABEL, right - left).join("\n");
        }
        place.legend = legend::place(panel, right - left);
        place.notes = notes_above(panel, &place.x, (left, right));
    }
    places
}

/// Returns the places and labels of the vertical or of the horizontal rules.
fn labels(panel: &Panel, of_vertical: bool) -> impl Iterator<Item = (f64, &str)> {
    panel.layers.iter().filter_map(move |layer| match layer {
        Layer::VerticalRule { label: Some(label), x: at } if of_vertical => Some((*at, &**label)),
        Layer::HorizontalRule { label: Some(label), y: at } if !of_vertical => Some((*at, &**label)),
        _ => None,
    })
}

/// Returns the room that the labels of horizontal rules need.
fn notes_width(panel: &Panel) -> f64 {
    labels(panel, false).map(|(_, label)| width(label, SMALL) + 6.0).fold(0.0, f64::max)
}

/// Returns the labels of vertical rules, each over its rule: middle, line and text. Two that would touch make way to
/// both sides if each still reaches its rule, otherwise the second goes a line higher.
fn notes_above(panel: &Panel, x: &Scale, (left, right): (f64, f64)) -> Vec<(f64, usize, String)> {
    const GAP: f64 = 12.0;
    let half = |text: &str| width(text, SMALL) / 2.0;
    let mut wanted: Vec<(f64, &str)> = labels(panel, true).filter(|(at, _)| x.shows(*at)).collect();
    wanted.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Kept over the panel; a text wider than that starts at its left end.
    let over = |at: f64, text| x.at(at, (left, right)).min(right + PAD - half(text)).max(left + half(text));
    let mut notes: Vec<_> =
        wanted.iter().map(|(at, text)| (over(*at, text), 0, (*text).to_owned())).collect();
    for (index, pair) in wanted.windows(2).enumerate() {
        let halves = (half(pair[0].1), half(pair[1].1));
        let overlap = notes[index].0 + halves.0 + GAP + halves.1 - notes[index + 1].0;
        let (before, after) = (notes[index].0 - overlap / 2.0, notes[index + 1].0 + overlap / 2.0);
        let rules = (x.at(pair[0].0, (left, right)), x.at(pair[1].0, (left, right)));
        let reach = rules.0 <= before + halves.0 && after - halves.1 <= rules.1;
        if overlap > 0.0 && reach && left <= before - halves.0 && after + halves.1 <= right + PAD {
            (notes[index].0, notes[index + 1].0) = (before, after);
        }
    }
    let mut rows: Vec<f64> = Vec::new();
    for (middle, row, text) in &mut notes {
        *row = rows.iter().position(|end| *end <= *middle - half(text) + 0.1).unwrap_or(rows.len());
        rows.resize(rows.len().max(*row + 1), 0.0);
        rows[*row] = *middle + half(text) + GAP;
    }
    notes
}

/// Returns the labels of horizontal rules and their positions. A label is level with its rule, unless the label above
/// it is in the way.
fn notes_beside<'p>(panel: &'p Panel, y: &Scale, area: Rect) -> Vec<(f64, &'p str)> {
    let shown = labels(panel, false).filter(|(at, _)| y.shows(*at));
    let mut notes: Vec<_> = shown.map(|(at, label)| (y.at(at, (area.bottom, area.top)), label)).collect();
    notes.sort_by(|a, b| a.0.total_cmp(&b.0));
    for index in 1..notes.len() {
        notes[index].0 = notes[index].0.max(notes[index - 1].0 + SMALL_LINE);
    }
    notes
}
