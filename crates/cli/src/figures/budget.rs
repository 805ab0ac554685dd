//! Figures of an error budget.

use standstill_analysis::Budget;
use standstill_campaign::Estimate;
use standstill_report::figure::{Axis, Figure, Layer, Panel, Style};

/// Largest number of sources that a reader can distinguish in the figure over the angle.
const DRAWN: usize = 4;

/// A source of error in the chart. `share` is its share of the mean square error without interactions, and `total` the share with all
/// interactions, if known. Each share has three numbers: its value and the lower and upper end of its interval.
pub struct Bar {
    pub name: String,
    pub share: [f64; 3],
    pub total: Option<[f64; 3]>,
}

/// Draws the shares in per cent, the largest at the top.
pub fn shares(bars: &[Bar], subtitle: String) -> Figure {
    const TOTALS: &str = "with all in which it has a part, with its interval";
    let names = bars.iter().rev().map(|bar| bar.name.clone());
    let place = |k: usize| (bars.len() - 1 - k) as f64;
    let mut panel = Panel::new(Axis::new("share of the mean square (%)"), Axis::categories("", names));
    for (k, bar) in bars.iter().enumerate() {
        let [share, low, high] = bar.share.map(|share| 100.0 * share);
        let (y, half) = (place(k), 0.3);
        let area = [(share.min(0.0), y - half, y + half), (share.max(0.0), y - half, y + half)];
        panel = panel.with(Layer::band("by itself, with its 95 % interval", Style::Blue, area));
        panel =
            panel.with(Layer::line("by itself, with its 95 % interval", Style::Blue, [(low, y), (high, y)]));
    }
    let totals =
        bars.iter().enumerate().filter_map(|(k, bar)| Some((place(k), bar.total?.map(|x| 100.0 * x))));
    for (y, [total, low, high]) in totals {
        // Below the interval of the share by itself, so that both can be seen.
        let y = y - 0.15;
        panel = panel.with(Layer::line("", Style::Vermilion, [(low, y), (high, y)])).with(Layer::points(
            TOTALS,
            Style::Vermilion,
            [(total, y)],
        ));
    }
    // A chart has a dozen rows: the cast loses nothing.
    #[allow(clippy::cast_possible_truncation)]
    let height = 160 + 40 * bars.len() as u32;
    Figure::new("Where the error comes from", subtitle, height.clamp(300, 2000), [panel])
}

/// Draws the contribution of each source over the angle, with its 95 % interval. Contributions are mean squares, so they can be added.
pub fn over_angle(budget: &Budget, subtitle: &str) -> Figure {
    let parts = &budget.over_angle;
    let x = Axis::new("rotor angle (°)").range(0.0, 360.0).step(60.0);
    let mut panel = Panel::new(x, Axis::new("mean square error (°²)"));
    let mut ranked: Vec<usize> = (0..budget.items.len()).collect();
    ranked.sort_by(|a, b| budget.items[*b].share.value.total_cmp(&budget.items[*a].share.value));
    let styles = [Style::Blue, Style::Orange, Style::Green, Style::Purple];
    let sources = styles.into_iter().zip(ranked).take(DRAWN);
    let mut curves: Vec<(&str, Style, Vec<Estimate>)> = vec![
        ("all together", Style::Black, parts.iter().map(|part| part.squares.all).collect()),
        ("the method's own", Style::Vermilion, parts.iter().map(|part| part.squares.common).collect()),
    ];
    curves.extend(sources.map(|(style, source)| {
        let of = parts.iter().map(|part| part.squares.first[source]).collect();
        (budget.items[source].source.key.as_str(), style, of)
    }));
    for (label, style, estimates) in curves {
        let around = around(parts.iter().map(|part| part.angle_deg).zip(estimates).collect());
        panel = panel
            .with(Layer::band("", style, around.iter().map(|(x, e)| (*x, e.low, e.high))))
            .with(Layer::line(label, style, around.iter().map(|(x, e)| (*x, e.value))));
    }
    let width = 360 / parts.len().max(1);
    Figure::new(
        "Where the error comes from, over the rotor's angle",
        format!("{subtitle}; means over {width}° with their 95 % intervals"),
        480,
        [panel],
    )
}

/// Adds two points, at 0° and at 360°, to estimates over equal ranges of the angle. Both have the mean of the first and the last estimate.
fn around(mut of: Vec<(f64, Estimate)>) -> Vec<(f64, Estimate)> {
    let (Some((_, first)), Some((_, last))) = (of.first(), of.last()) else { return of };
    let middle = |of: fn(&Estimate) -> f64| (of(first) + of(last)) / 2.0;
    let seam = Estimate { value: middle(|e| e.value), low: middle(|e| e.low), high: middle(|e| e.high) };
    of.insert(0, (0.0, seam));
    of.push((360.0, seam));
    of
}
