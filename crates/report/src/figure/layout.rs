//! Where everything goes: margins from the widths of texts, heights from what is left.

use super::axis::{Scale, Tick};
use super::canvas::Rect;
use super::heat::{self, Bar};
use super::layers::Plot;
use super::legend::{self, Placed};
use super::text::{width, wrap};
use super::ticks::{self, Horizontal, text_width};
use super::{Figure, Layer, Panel, extent};

/// Type sizes and heights of lines, in logical pixels.
pub(super) const TITLE: f64 = 17.0;
pub(super) const TITLE_LINE: f64 = 23.0;
pub(super) const SMALL: f64 = 13.0;
pub(super) const SMALL_LINE: f64 = 17.0;
pub(super) const LABEL: f64 = 14.0;
pub(super) const LABEL_LINE: f64 = 18.0;

/// Free space around the figure.
pub(super) const PAD: f64 = 12.0;
/// Length of a tick, and the gap to its text.
pub(super) const TICK: f64 = 4.5;
pub(super) const TICK_GAP: f64 = 4.0;
/// Between a panel and the one below it.
const BETWEEN: f64 = 16.0;

/// A text of a rule beside or above its panel.
pub(super) struct Note {
    pub text: String,
    /// Along the edge at which it stands.
    pub at: f64,
    /// The line of notes it is in, counted from the edge.
    pub row: usize,
}

pub(super) struct PanelLayout {
    pub plot: Plot,
    pub x_ticks: Horizontal,
    pub y_ticks: Vec<Tick>,
    /// Texts of ticks and the label of the horizontal axis are left to the panel below.
    pub shares_x: bool,
    pub title: Vec<String>,
    pub x_label: Vec<String>,
    pub y_label: Vec<String>,
    pub legend: Vec<Placed>,
    pub above: Vec<Note>,
    pub beside: Vec<Note>,
    /// The colour bar to the right of the panel.
    pub bar: Option<Bar>,
}

pub(super) struct Layout {
    pub title: Vec<String>,
    pub subtitle: Vec<String>,
    pub panels: Vec<PanelLayout>,
}

pub(super) fn layout(figure: &Figure) -> Layout {
    let room = f64::from(figure.width) - 2.0 * PAD;
    let title = wrap(&figure.title, TITLE, room);
    let subtitle = wrap(figure.subtitle.as_deref().unwrap_or(""), SMALL, room);
    let mut top = PAD + title.len() as f64 * TITLE_LINE + subtitle.len() as f64 * SMALL_LINE;
    if top > PAD {
        top += 6.0;
    }
    let shown = x_ranges(&figure.panels);
    let weights: Vec<f64> = figure
        .panels
        .iter()
        .map(|p| if p.weight.is_finite() && p.weight > 0.0 { p.weight } else { 1.0 })
        .collect();
    let total: f64 = weights.iter().sum();
    let space = f64::from(figure.height) - top - PAD;
    // How many ticks and lines of label fit depends on heights that depend on the legends, which depend on the
    // width of the ticks' texts: a second pass starts from the heights the first one found.
    let mut heights: Vec<f64> = weights.iter().map(|w| w / total * space - 60.0).collect();
    let mut panels = Vec::new();
    for _ in 0..2 {
        panels = place(figure, &shown, &heights);
        let taken: f64 = panels.iter().map(|p| above(p) + below(p)).sum();
        let between = BETWEEN * (panels.len().max(1) - 1) as f64;
        heights = weights.iter().map(|w| (w / total * (space - taken - between)).max(20.0)).collect();
        let mut y = top;
        for (panel, height) in panels.iter_mut().zip(&heights) {
            y += above(panel);
            panel.plot.area.top = y;
            panel.plot.area.bottom = y + height;
            panel.plot.y.pixels = (y + height, y);
            y += height + below(panel) + BETWEEN;
        }
    }
    for (panel, described) in panels.iter_mut().zip(&figure.panels) {
        panel.beside = beside(described, &panel.plot.y);
    }
    Layout { title, subtitle, panels }
}

fn above(panel: &PanelLayout) -> f64 {
    let rows = panel.above.iter().map(|note| note.row + 1).max().unwrap_or(0);
    let legend = panel.title.len() as f64 * LABEL_LINE + legend::height(&panel.legend);
    legend + rows as f64 * SMALL_LINE + if rows > 0 || legend > 0.0 { 4.0 } else { SMALL / 2.0 }
}

fn below(panel: &PanelLayout) -> f64 {
    if panel.shares_x {
        0.0
    } else {
        TICK + TICK_GAP + panel.x_ticks.height + panel.x_label.len() as f64 * LABEL_LINE
    }
}

/// The horizontal range of each panel; neighbours with equal axes are shown over the same range.
fn x_ranges(panels: &[Panel]) -> Vec<(f64, f64)> {
    panels
        .chunk_by(|a, b| a.x == b.x)
        .flat_map(|group| {
            let range = extent::horizontal(&group.iter().collect::<Vec<_>>());
            group.iter().map(move |_| range)
        })
        .collect()
}

/// Everything but the vertical places.
fn place(figure: &Figure, shown: &[(f64, f64)], heights: &[f64]) -> Vec<PanelLayout> {
    let y_labels: Vec<_> =
        figure.panels.iter().zip(heights).map(|(p, h)| wrap(&p.y.label, LABEL, *h)).collect();
    let y_scales: Vec<_> = figure.panels.iter().zip(shown).map(|(p, x)| extent::vertical(p, *x)).collect();
    // Names longer than this would leave too little of the figure.
    let wide = 0.3 * f64::from(figure.width);
    let y_ticks: Vec<_> = figure
        .panels
        .iter()
        .zip(&y_scales)
        .zip(heights)
        .map(|((p, y), h)| ticks::vertical(p, *y, *h, wide))
        .collect();
    let bars: Vec<_> = figure.panels.iter().zip(heights).map(|(p, h)| heat::bar(p, *h)).collect();
    let label_lines = y_labels.iter().map(Vec::len).max().unwrap_or(0) as f64;
    let tick_width = y_ticks.iter().flatten().map(text_width).fold(0.0, f64::max);
    let left = PAD + label_lines * LABEL_LINE + 6.0 + tick_width + TICK_GAP + TICK;
    let notes: Vec<f64> = figure.panels.iter().map(notes_width).collect();
    let beside = notes.iter().zip(&bars).map(|(notes, bar)| notes + bar.as_ref().map_or(0.0, Bar::width));
    let right = f64::from(figure.width) - PAD - beside.fold(12.0, f64::max);
    // The text of a tick near the right end reaches beyond it.
    let beyond = figure.panels.iter().zip(shown).flat_map(|(panel, range)| {
        let x = Scale { range: *range, pixels: (left, right), spread: panel.x.scale };
        let found = ticks::horizontal(panel, &x, tallest(figure));
        let ends: Vec<_> = found.ticks.iter().map(|tick| x.at(tick.at) + found.half_width(tick)).collect();
        ends
    });
    let limit = f64::from(figure.width) - PAD / 2.0;
    let right = (right - (beyond.fold(limit, f64::max) - limit)).max(left + 20.0);

    let mut panels = Vec::new();
    let parts = figure.panels.iter().zip(shown).zip(y_scales).zip(y_ticks).zip(y_labels).zip(bars);
    for (index, (((((panel, x_range), y_range), y_ticks), y_label), bar)) in parts.enumerate() {
        let x = Scale { range: *x_range, pixels: (left, right), spread: panel.x.scale };
        panels.push(PanelLayout {
            plot: Plot {
                area: Rect { left, right, top: 0.0, bottom: 0.0 },
                x,
                y: Scale { range: y_range, pixels: (0.0, 0.0), spread: panel.y.scale },
            },
            x_ticks: ticks::horizontal(panel, &x, tallest(figure)),
            y_ticks,
            shares_x: figure.panels.get(index + 1).is_some_and(|next| next.x == panel.x),
            title: wrap(&panel.title, LABEL, right - left),
            x_label: wrap(&panel.x.label, LABEL, right - left),
            y_label,
            legend: legend::place(panel, right - left),
            above: notes_above(panel, &x),
            beside: Vec::new(),
            bar: bar.map(|bar| bar.placed(right + notes[index])),
        });
    }
    panels
}

/// How tall the names of a horizontal axis may be.
fn tallest(figure: &Figure) -> f64 {
    (0.4 * f64::from(figure.height) / figure.panels.len().max(1) as f64).clamp(60.0, 200.0)
}

/// The room that the labels of horizontal rules need.
fn notes_width(panel: &Panel) -> f64 {
    let widths = panel.layers.iter().filter_map(|layer| match layer {
        Layer::HorizontalRule { label: Some(label), .. } => Some(width(label, SMALL) + 6.0),
        _ => None,
    });
    widths.fold(0.0, f64::max)
}

/// The labels of vertical rules, each over its rule: two that would touch make way to both sides if each still
/// reaches its rule, otherwise the second goes a row higher.
fn notes_above(panel: &Panel, x: &Scale) -> Vec<Note> {
    const GAP: f64 = 12.0;
    let mut wanted: Vec<(f64, &String)> = panel
        .layers
        .iter()
        .filter_map(|layer| match layer {
            Layer::VerticalRule { label: Some(label), x: at } if x.shows(*at) => Some((x.at(*at), label)),
            _ => None,
        })
        .collect();
    wanted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut notes: Vec<Note> = Vec::new();
    // Of each row: its last note, and how far to the left that note may go.
    let mut rows: Vec<(usize, f64)> = Vec::new();
    for (index, (rule, text)) in wanted.into_iter().enumerate() {
        let half = width(text, SMALL) / 2.0;
        // Kept over the panel; a text wider than that starts at its left end.
        let mut at = rule.min(x.pixels.1 + PAD - half).max(x.pixels.0 + half);
        let mut row = 0;
        let mut least = rule - half;
        while let Some(&(last, its_least)) = rows.get(row) {
            let its_half = width(&notes[last].text, SMALL) / 2.0;
            let overlap = notes[last].at + its_half + GAP - (at - half);
            if overlap <= 0.0 {
                least = least.max(notes[last].at + its_half + GAP + half);
                break;
            }
            let back = (overlap / 2.0).max(overlap - half).min(notes[last].at - its_least);
            let forth = overlap - back;
            if back >= 0.0 && forth <= half && at + forth + half <= x.pixels.1 + PAD {
                notes[last].at -= back;
                at += forth;
                least = at;
                break;
            }
            row += 1;
        }
        if row == rows.len() {
            rows.push((index, least));
        }
        rows[row] = (index, least.max(x.pixels.0 + half));
        notes.push(Note { text: text.clone(), at, row });
    }
    notes
}

/// The labels of horizontal rules, each level with its rule unless the one above is in the way.
fn beside(panel: &Panel, y: &Scale) -> Vec<Note> {
    let mut notes: Vec<Note> = panel
        .layers
        .iter()
        .filter_map(|layer| match layer {
            Layer::HorizontalRule { label: Some(label), y: at } if y.shows(*at) => {
                Some(Note { text: label.clone(), at: y.at(*at), row: 0 })
            }
            _ => None,
        })
        .collect();
    notes.sort_by(|a, b| a.at.total_cmp(&b.at));
    for index in 1..notes.len() {
        notes[index].at = notes[index].at.max(notes[index - 1].at + SMALL_LINE);
    }
    notes
}
