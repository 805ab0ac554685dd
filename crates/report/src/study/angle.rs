//! The error over the rotor's angle.

use super::cloud::quantile;
use super::{Caption, ErrorCloud};
use crate::figure::{Axis, Figure, Layer, Panel, Style};

/// Axis error over the true angle: single trials, the median and the range from 5 to 95 % in bins of 5°. The scale is that
/// of the errors; wrong poles are crosses along the upper edge, and outliers beyond the frame are counted in the subtitle.
pub(super) fn error_over_angle(caption: &Caption, cloud: &ErrorCloud) -> Figure {
    let quantiles = cloud.angle_quantiles([0.05, 0.5, 0.95]);
    let x = Axis::new("true rotor angle θ (° electrical)").range(0.0, 360.0).step(60.0);
    // A few outliers must not flatten everything else.
    let mut errors = cloud.signed().kept().to_vec();
    let (low, high) = (quantile(&mut errors, 0.001), quantile(&mut errors, 0.999));
    let (least, most) = (quantile(&mut errors, 0.0), quantile(&mut errors, 1.0));
    let spread = high - low;
    let mut bottom = (low - 0.35 * spread).max(least - 0.08 * spread);
    // The marks of wrong poles need some room.
    let mut top = (high + 0.35 * spread).min(most + 0.12 * spread);
    if top <= bottom || !top.is_finite() {
        let half = if low.is_finite() { (0.1 * low.abs()).max(1e-6) } else { 1.0 };
        let middle = if low.is_finite() { low } else { 0.0 };
        (bottom, top) = (middle - half, middle + half);
    }
    let points = cloud.points();
    let beyond = points.kept().iter().filter(|(_, e)| !(bottom..=top).contains(e)).count();
    let wrong = cloud.wrong();
    let one_in =
        |what: &str, every: u64| if every == 1 { what.to_owned() } else { format!("{what} in {every}") };
    let mut panel = Panel::new(x, Axis::new("error of the axis θ_e − θ (°)").range(bottom, top));
    if !quantiles.is_empty() {
        let range = quantiles.iter().map(|(x, [low, _, high])| (*x, *low, *high));
        panel = panel.with(Layer::band("5 % to 95 %", Style::Orange, range));
    }
    if !points.kept().is_empty() {
        let label = one_in("one detection", points.every());
        panel = panel.with(Layer::points(&label, Style::Blue, points.kept().iter().copied()));
    }
    if !quantiles.is_empty() {
        let median = quantiles.iter().map(|(x, [_, median, _])| (*x, *median));
        panel = panel.with(Layer::line("median", Style::Black, median));
    }
    if !wrong.kept().is_empty() {
        let edge = top - 0.03 * (top - bottom);
        let label = format!("{}, {} in all", one_in("wrong pole", wrong.every()), cloud.wrong_poles());
        let marks = wrong.kept().iter().map(|angle| (*angle, edge));
        panel = panel.with(Layer::points(&label, Style::Vermilion, marks));
    }
    let remark = (beyond > 0).then(|| format!("{beyond} of the points shown are beyond the frame"));
    caption.figure(remark.as_slice(), 480, vec![panel])
}
