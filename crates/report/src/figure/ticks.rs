//! Which ticks an axis of a given length in pixels has room for, and how their texts are set.

use super::axis::{Axis, AxisScale, Scale, Tick, Ticks, ticks};
use super::decades::log_ticks;
use super::layout::{SMALL, SMALL_LINE};
use super::text::{fit, width};
use super::{Layer, Panel};

/// Least distance of two texts along a line.
const APART: f64 = 14.0;

/// The ticks of a horizontal axis.
pub(super) struct Horizontal {
    pub ticks: Vec<Tick>,
    /// Height of the texts.
    pub height: f64,
    /// Whether the texts read from bottom to top.
    pub upright: bool,
}

impl Horizontal {
    /// How far the text of a tick reaches to either side.
    pub fn half_width(&self, tick: &Tick) -> f64 {
        if self.upright { SMALL_LINE / 2.0 } else { text_width(tick) / 2.0 }
    }
}

/// The width of the widest line of a tick's text.
pub(super) fn text_width(tick: &Tick) -> f64 {
    tick.text.lines().map(|line| width(line, SMALL)).fold(0.0, f64::max)
}

/// Ticks far enough apart for their texts, which may be at most `tall`.
pub(super) fn horizontal(panel: &Panel, x: &Scale, tall: f64) -> Horizontal {
    let flat = |ticks| Horizontal { ticks, height: SMALL_LINE, upright: false };
    if let Ticks::Named(_) = panel.x.ticks {
        return names(ticks(&panel.x.ticks, x.range, 1.0, 1.0), x, tall);
    }
    if panel.x.scale == AxisScale::Log10 {
        let found = log_ticks(x.range, |ticks| {
            let room = |pair: &[Tick]| {
                (x.at(pair[1].at) - x.at(pair[0].at)).abs()
                    >= 0.5 * (text_width(&pair[0]) + text_width(&pair[1])) + APART
            };
            ticks.windows(2).all(room)
        });
        return flat(counted(&panel.x, found));
    }
    let room = x.pixels.1 - x.pixels.0;
    let mut most = (room / 75.0).clamp(1.0, 12.0);
    let mut densest = room / 30.0;
    loop {
        let found = ticks(&panel.x.ticks, x.range, most, densest);
        let widest = found.iter().map(text_width).fold(0.0, f64::max);
        if found.len() < 3 || densest < 2.0 || widest + APART <= gap(&found, x) {
            return flat(found);
        }
        most = (most * 0.8).max(1.0);
        densest *= 0.8;
    }
}

/// Of an axis of whole numbers those ticks alone.
fn counted(axis: &Axis, mut ticks: Vec<Tick>) -> Vec<Tick> {
    ticks.retain(|tick| axis.ticks != Ticks::Whole || (tick.at - tick.at.round()).abs() < 1e-9);
    ticks
}

/// The least distance of two ticks in pixels, that of the ends for a single one.
fn gap(ticks: &[Tick], scale: &Scale) -> f64 {
    let whole = (scale.pixels.1 - scale.pixels.0).abs();
    let between = ticks.windows(2).map(|pair| (scale.at(pair[1].at) - scale.at(pair[0].at)).abs());
    between.fold(whole, f64::min)
}

/// Names side by side: on several lines, or else upright.
fn names(mut named: Vec<Tick>, x: &Scale, tall: f64) -> Horizontal {
    named.sort_by(|a, b| a.at.total_cmp(&b.at));
    let slot = gap(&named, x) - 8.0;
    let fitted: Vec<Vec<String>> = named.iter().map(|tick| fit(&tick.text, SMALL, slot)).collect();
    let lines = fitted.iter().map(Vec::len).max().unwrap_or(1).max(1);
    let narrow = fitted.iter().flatten().all(|line| width(line, SMALL) <= slot && !line.ends_with('…'));
    if narrow && lines as f64 * SMALL_LINE <= tall.max(2.0 * SMALL_LINE) {
        for (tick, lines) in named.iter_mut().zip(fitted) {
            tick.text = lines.join("\n");
        }
        return Horizontal { ticks: named, height: lines as f64 * SMALL_LINE, upright: false };
    }
    thin_out(&mut named, slot + 8.0);
    for tick in &mut named {
        tick.text = super::text::shorten(&tick.text, SMALL, tall.max(40.0));
    }
    let height = named.iter().map(text_width).fold(0.0, f64::max) + 4.0;
    Horizontal { ticks: named, height, upright: true }
}

/// Takes texts away until the others are a line apart; every tick keeps its mark.
fn thin_out(ticks: &mut [Tick], gap: f64) {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "fewer than there are ticks")]
    let every = ((SMALL_LINE - 1.0) / gap.max(0.1)).ceil().max(1.0) as usize;
    for (index, tick) in ticks.iter_mut().enumerate() {
        if index % every != 0 {
            tick.text.clear();
        }
    }
}

/// The ticks of a panel's vertical axis, `height` tall, with names at most `wide`.
pub(super) fn vertical(panel: &Panel, range: (f64, f64), height: f64, wide: f64) -> Vec<Tick> {
    let lanes = panel.layers.iter().find_map(|layer| match layer {
        Layer::Lanes { lanes, .. } => {
            let places = (0..lanes.len()).rev().map(|i| i as f64 + 0.5);
            Some(places.zip(lanes).map(|(at, lane)| (at, lane.label.clone())).collect())
        }
        _ => None,
    });
    match lanes {
        Some(names) => {
            let axis = Axis { ticks: Ticks::Named(names), ..Axis::new("") };
            along(&axis, range, height, wide)
        }
        None => along(&panel.y, range, height, wide),
    }
}

/// The ticks of an upright axis.
pub(super) fn along(axis: &Axis, range: (f64, f64), height: f64, wide: f64) -> Vec<Tick> {
    let scale = Scale { range, pixels: (height, 0.0), spread: axis.scale };
    if let Ticks::Named(_) = axis.ticks {
        let mut named = ticks(&axis.ticks, range, 1.0, 1.0);
        named.sort_by(|a, b| a.at.total_cmp(&b.at));
        let gap = gap(&named, &scale);
        thin_out(&mut named, gap);
        for tick in &mut named {
            let lines = fit(&tick.text, SMALL, wide);
            tick.text = if lines.len() as f64 * SMALL_LINE <= gap.max(SMALL_LINE) {
                lines.join("\n")
            } else {
                super::text::shorten(&tick.text, SMALL, wide)
            };
        }
        return named;
    }
    if axis.scale == AxisScale::Log10 {
        let found = log_ticks(range, |ticks| {
            ticks.windows(2).all(|pair| (scale.at(pair[1].at) - scale.at(pair[0].at)).abs() >= 21.0)
        });
        return counted(axis, found);
    }
    ticks(&axis.ticks, range, (height / 38.0).clamp(2.0, 12.0), (height / 22.0).max(1.0))
}
