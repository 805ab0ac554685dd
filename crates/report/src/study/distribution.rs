//! Distribution of the axis error.

use super::cloud::quantile;
use super::{Caption, ErrorCloud, StudyPoint};
use crate::figure::{Axis, Figure, Layer, Panel, Style, significant};
use standstill_numeric::whole;

/// Returns the figure of the distribution. The upper panel has the histogram of the signed axis error with rms and 95th
/// percentile, the lower one the probability that the error's magnitude exceeds a value.
///
/// The lower panel shows the exceedance 1 − F on a logarithmic scale instead of F, because designers ask for the
/// probability of large errors, at which F is flat. Median, p95 and p99, at 50, 5 and 1 %, are those of `point`, as in
/// tables.
pub(super) fn distribution(caption: &Caption, cloud: &ErrorCloud, point: &StudyPoint) -> Figure {
    let kept = cloud.signed();
    let rms = ("rms", point.rms_deg);
    let [p50, p95, p99] = [("p50", point.p50_deg), ("p95", point.p95_deg), ("p99", point.p99_deg)];
    let mut remarks = Vec::new();
    let mut upper = Panel::new(Axis::new("error of the axis e (°)"), Axis::new("share per bin (%)"));
    let mut lower = Panel::new(
        Axis::new("magnitude of the error |e| (°)").log10(),
        Axis::new("P(|e| exceeds it) (%)").log10(),
    );
    if let Some(histogram) = Histogram::of(kept.kept()) {
        if histogram.outside > 0 {
            let share = histogram.outside as f64 / kept.kept().len() as f64;
            remarks.push(format!("{} % beyond the ends of the histogram", significant(100.0 * share)));
        }
        let label = match kept.every() {
            1 if kept.seen() == 1 => "1 detection".to_owned(),
            1 => format!("{} detections", kept.seen()),
            every => format!("one detection in {every} of {}", kept.seen()),
        };
        let (first, last) =
            (histogram.first, histogram.first + histogram.width * histogram.shares.len() as f64);
        upper.x = upper.x.range(first, last);
        upper.y = upper.y.range(0.0, 1.08 * histogram.shares.iter().copied().fold(0.0, f64::max));
        let band = histogram.outline().map(|(x, y)| (x, 0.0, y));
        upper = upper.with(Layer::band(&label, Style::Blue, band));
        for (name, at) in [rms, p95] {
            upper = upper
                .with(Layer::instant(&format!("−{name}"), -at.value))
                .with(Layer::instant(&format!("{name} {}°", at.alone()), at.value));
        }
        let mut curve: Vec<(f64, f64)> =
            cloud.exceedance().into_iter().map(|(x, p)| (x, 100.0 * p)).collect();
        // The steps begin before the first error, and the last one ends at none.
        if let Some(&(least, _)) = curve.first().filter(|(least, _)| *least > 0.0) {
            curve.insert(0, (0.5 * least, 100.0));
        }
        let floor = 50.0 / kept.seen() as f64;
        for point in &mut curve {
            point.1 = point.1.max(floor);
        }
        let from = p50.1.value / 50.0;
        let to = 1.15 * cloud.max_deg();
        if from > 0.0 && to > from {
            lower.x = lower.x.range(from, to);
        }
        lower.y = lower.y.range(floor, 110.0);
        lower = lower.with(Layer::steps("", Style::Blue, curve));
        for (name, at) in [p50, p95, p99] {
            lower = lower.with(Layer::instant(&format!("{name} {}°", at.alone()), at.value));
        }
        let largest = format!("largest {}°", significant(cloud.max_deg()));
        remarks.insert(0, format!("mean {}°, {largest}", point.bias_deg.alone()));
    }
    caption.figure(&remarks, 760, vec![upper, lower])
}

/// Shares in per cent of equal bins.
struct Histogram {
    first: f64,
    width: f64,
    shares: Vec<f64>,
    outside: usize,
}

impl Histogram {
    /// Makes a histogram over the range without a thousandth of the errors at either end, extended by half of it on
    /// both sides. The bins have the width of Freedman and Diaconis; there are 10 to 100.
    fn of(errors: &[f64]) -> Option<Self> {
        let mut sorted = errors.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let (least, most) = (*sorted.first()?, *sorted.last()?);
        let (low, high) = (quantile(&mut sorted, 0.001), quantile(&mut sorted, 0.999));
        let more = 0.5 * (high - low);
        let (mut first, mut last) = (least.max(low - more), most.min(high + more));
        if last - first <= 1e-9 * first.abs().max(last.abs()) {
            let half = (0.1 * first.abs()).max(1e-6);
            (first, last) = (first - half, last + half);
        }
        let quarters = quantile(&mut sorted, 0.75) - quantile(&mut sorted, 0.25);
        let wanted = 2.0 * quarters / (errors.len() as f64).cbrt();
        let bins = ((last - first) / wanted).ceil();
        let bins = if bins.is_finite() { bins.clamp(10.0, 100.0) } else { 10.0 };
        let width = (last - first) / bins;
        let mut shares = vec![0.0; whole(bins)];
        let mut outside = 0;
        for error in errors {
            let place = (error - first) / width;
            // The last bin holds its upper end.
            if !(0.0..=bins).contains(&place) {
                outside += 1;
                continue;
            }
            let bin = whole::<usize>(place).min(shares.len() - 1);
            shares[bin] += 100.0 / errors.len() as f64;
        }
        Some(Self { first, width, shares, outside })
    }

    /// Returns the corners of its upper side.
    fn outline(&self) -> impl Iterator<Item = (f64, f64)> {
        let edge = |index: usize| self.first + index as f64 * self.width;
        self.shares.iter().enumerate().flat_map(move |(i, share)| [(edge(i), *share), (edge(i + 1), *share)])
    }
}
