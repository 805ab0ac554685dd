//! Figure of a fit: simulated and measured currents, and the residuals.

use standstill_fit::Trace;
use standstill_fit::record::CHANNELS;
use standstill_report::figure::{Axis, Figure, Layer, Panel, Style};

/// Largest number of points of a channel in the figure. More points would only make the file larger.
const MOST_POINTS: usize = 4000;

/// Names and styles of the channels.
const CURRENTS: [(&str, Style); CHANNELS] = [
    ("i_a", Style::PHASES[0]),
    ("i_b", Style::PHASES[1]),
    ("i_c", Style::PHASES[2]),
    ("i_link", Style::Purple),
];

/// Traces that the figure shows one after the other, and the unit of the time axis in s.
struct Rows<'a> {
    traces: &'a [Trace],
    unit: f64,
}

impl Rows<'_> {
    /// Returns the times of all rows in the unit of the axis. Traces from different files follow each other.
    fn times(&self) -> Vec<f64> {
        let mut times: Vec<f64> = Vec::new();
        let (mut origin, mut before) = (None, f64::NEG_INFINITY);
        for trace in self.traces {
            let first = trace.time.first().copied().unwrap_or_default();
            if first < before || origin.is_none() {
                origin = Some(first - times.last().copied().unwrap_or_default() * self.unit);
            }
            let origin = origin.unwrap_or_default();
            times.extend(trace.time.iter().map(|time| (time - origin) / self.unit));
            before = trace.time.last().copied().unwrap_or(before);
        }
        times
    }

    /// Returns the points of channel `k`, in A over time, with a gap after each trace. If `thin` is true, returns at most about
    /// [`MOST_POINTS`] points.
    fn channel(
        &self,
        k: usize,
        value: impl Fn(&Trace, usize) -> [f64; CHANNELS],
        thin: bool,
    ) -> Vec<(f64, f64)> {
        let times = self.times();
        let every = if thin { times.len().div_ceil(MOST_POINTS) } else { 1 };
        let mut points = Vec::new();
        let mut row = 0;
        for trace in self.traces {
            for n in 0..trace.time.len() {
                if row % every == 0 {
                    points.push((times[row], value(trace, n)[k]));
                }
                row += 1;
            }
            points.push((f64::NAN, f64::NAN));
        }
        points
    }

    fn panels(&self, label: &str, expected: f64) -> [Panel; 2] {
        let axis = || {
            let unit = if self.unit < 1e-4 { "µs" } else { "ms" };
            Axis::new(format!("{label} ({unit})"))
        };
        let mut currents = Panel { weight: 1.5, ..Panel::new(axis(), Axis::new("current (A)")) };
        let mut left = Panel { weight: 0.8, legend: false, ..Panel::new(axis(), Axis::new("residual (A)")) };
        for (k, (name, style)) in CURRENTS.into_iter().enumerate() {
            let measured = self.channel(k, |trace, n| trace.measured[n], true);
            if measured.iter().all(|(_, i)| i.is_nan()) {
                continue;
            }
            currents = currents.with(Layer::points(&format!("{name} measured"), style, measured));
            let residual = |trace: &Trace, n: usize| {
                std::array::from_fn(|k| trace.measured[n][k] - trace.simulated[n][k])
            };
            left = left.with(Layer::points("", style, self.channel(k, residual, true)));
        }
        for k in 0..CHANNELS {
            let simulated = self.channel(k, |trace, n| trace.simulated[n], false);
            let shown = self.traces.iter().flat_map(|trace| &trace.measured).any(|i| !i[k].is_nan());
            if shown {
                currents = currents.with(Layer::line("simulated", Style::Black, simulated));
            }
        }
        left = left
            .with(Layer::level("+1.96 σ", 1.96 * expected))
            .with(Layer::level("−1.96 σ", -1.96 * expected));
        [currents, left]
    }
}

/// Draws the measured and simulated currents of all pulses and their residuals, and a close-up of the pulse with the largest current.
/// `expected` is the rms in A of the residuals that noise and A/D converters cause by themselves.
pub fn fit(traces: &[Trace], expected: f64, title: &str, subtitle: String) -> Figure {
    let largest = |trace: &Trace| trace.simulated.iter().flatten().map(|i| i.abs()).fold(0.0, f64::max);
    let close =
        traces.iter().enumerate().max_by(|a, b| largest(a.1).total_cmp(&largest(b.1))).map_or(0, |(k, _)| k);
    let span = |traces: &[Trace]| {
        let spans = traces.iter().filter_map(|trace| Some(trace.time.last()? - trace.time.first()?));
        if spans.sum::<f64>() < 2e-3 { 1e-6 } else { 1e-3 }
    };
    let all = Rows { traces, unit: span(traces) };
    let one = &traces[close..=close];
    let near = Rows { traces: one, unit: span(one) };
    let mut panels = all.panels("time", expected).to_vec();
    if traces.len() > 1 {
        panels.extend(near.panels("time within the pulse of the largest current", expected));
    }
    Figure::new(title.to_owned(), subtitle, if panels.len() > 2 { 960 } else { 560 }, panels)
}
