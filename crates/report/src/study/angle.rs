//! The error over the rotor's angle.

use super::cloud::quantile;
use super::periodic::Series;
use super::{Caption, ErrorCloud};
use crate::figure::{Axis, Figure, Layer, Panel, Style};

/// Returns the figure of the axis error over the true angle: single trials, and typical values by angle. The range is
/// that of the errors. Wrong poles are crosses along the upper edge, and the subtitle counts outliers beyond the range.
/// Title and subtitle are those of a [`Study`](super::Study).
pub fn error_over_angle(title: &str, subtitle: Option<String>, cloud: &ErrorCloud) -> Figure {
    let caption = Caption::of("Error over the rotor angle", title, subtitle);
    let typical = typical(cloud);
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
    if let Some(Typical { range, .. }) = &typical {
        panel = panel.with(Layer::band("5 % to 95 %", Style::Orange, range.iter().copied()));
    }
    if !points.kept().is_empty() {
        let label = one_in("one detection", points.every());
        panel = panel.with(Layer::points(&label, Style::Blue, points.kept().iter().copied()));
    }
    if let Some(Typical { curve, label, interval, .. }) = &typical {
        if !interval.is_empty() {
            panel =
                panel.with(Layer::band("95 % interval of the mean", Style::Black, interval.iter().copied()));
        }
        panel = panel.with(Layer::line(label, Style::Black, curve.iter().copied()));
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

/// Quantiles of the error at each angle, from 0 to 360°, equal at both ends.
struct Typical {
    label: String,
    curve: Vec<(f64, f64)>,
    /// Confidence interval of the curve; empty if bins have so many starts that the interval is no wider than the line.
    interval: Vec<(f64, f64, f64)>,
    /// Between these lie nine of ten starts.
    range: Vec<(f64, f64, f64)>,
}

/// Angles at which a smooth curve is drawn, in degrees from one to the next: a sixtieth of a period of 60°.
const STEP: u32 = 1;
/// Number of bins of the spread around a smooth curve.
const SPREAD_BINS: usize = 12;
/// Smallest number of starts in each of these bins.
const SPREAD_STARTS: usize = 40;

/// Returns medians and quantiles of narrow bins if there are enough starts, otherwise a smooth curve with the spread
/// around it.
fn typical(cloud: &ErrorCloud) -> Option<Typical> {
    let quantiles = cloud.angle_quantiles([0.05, 0.5, 0.95]);
    if !quantiles.is_empty() {
        let around = around(&quantiles);
        return Some(Typical {
            label: format!("median in bins of {:.0}°", 360.0 / quantiles.len() as f64),
            curve: around.iter().map(|(x, [_, median, _])| (*x, *median)).collect(),
            interval: Vec::new(),
            range: around.iter().map(|(x, [low, _, high])| (*x, *low, *high)).collect(),
        });
    }
    let points = cloud.points().kept();
    let series = Series::of(points)?;
    let spread = spread(points, &series);
    let angles = || (0..=360 / STEP).map(|k| f64::from(k * STEP));
    let few = if series.order < 6 { ": too few starts for a period of 60°" } else { "" };
    Some(Typical {
        label: format!("mean, Fourier series to order {}{few}", series.order),
        curve: angles().map(|x| (x, series.at(x))).collect(),
        interval: angles()
            .map(|x| (x, series.at(x) - series.half_width(x), series.at(x) + series.half_width(x)))
            .collect(),
        range: angles()
            .map(|x| {
                let [low, high] = between(&spread, x);
                (x, series.at(x) + low, series.at(x) + high)
            })
            .collect(),
    })
}

/// Returns the values of even bins with those at 0 and 360°, which are as far from the last bin as from the first.
fn around<const N: usize>(bins: &[(f64, [f64; N])]) -> Vec<(f64, [f64; N])> {
    let (Some((_, first)), Some((_, last))) = (bins.first(), bins.last()) else { return Vec::new() };
    let seam: [f64; N] = std::array::from_fn(|k| (first[k] + last[k]) / 2.0);
    std::iter::once((0.0, seam)).chain(bins.iter().copied()).chain([(360.0, seam)]).collect()
}

/// Returns the 5 and 95 % quantiles of the distances from a curve, in wide bins; the curve itself is not blurred by
/// their width. If a bin has too few starts, returns the quantiles of all starts.
fn spread(points: &[(f64, f64)], series: &Series) -> Vec<(f64, [f64; 2])> {
    let mut bins = vec![Vec::new(); SPREAD_BINS];
    for point in points {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an angle in [0, 360)")]
        let bin = ((point.0 / 360.0 * SPREAD_BINS as f64) as usize).min(SPREAD_BINS - 1);
        bins[bin].push(series.residual(*point));
    }
    if bins.iter().any(|bin| bin.len() < SPREAD_STARTS) {
        bins = vec![bins.concat()];
    }
    let width = 360.0 / bins.len() as f64;
    let of = |(k, bin): (usize, &mut Vec<f64>)| {
        ((k as f64 + 0.5) * width, [0.05, 0.95].map(|share| quantile(bin, share)))
    };
    bins.iter_mut().enumerate().map(of).collect()
}

/// Interpolates linearly between the middles of bins.
fn between(bins: &[(f64, [f64; 2])], x: f64) -> [f64; 2] {
    let all = around(bins);
    let next = all.iter().position(|(at, _)| *at >= x).unwrap_or(all.len() - 1).max(1);
    let ((from, a), (to, b)) = (all[next - 1], all[next]);
    let share = (x - from) / (to - from);
    std::array::from_fn(|k| a[k] + share * (b[k] - a[k]))
}
