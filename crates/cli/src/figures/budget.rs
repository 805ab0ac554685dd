//! Where the error comes from.

use standstill_analysis::Budget;
use standstill_report::figure::{Axis, Figure, Layer, Panel, Style};

use super::WIDTH;

/// Sources that the picture over the angle can tell apart.
const DRAWN: usize = 4;

/// A row of the chart: its name, its share with the interval, and its total if it has one.
pub struct Bar {
    pub name: String,
    pub share: [f64; 3],
    pub total: Option<f64>,
}

/// Shares in per cent, the largest at the top.
pub fn shares(bars: &[Bar], subtitle: String) -> Figure {
    let names = bars.iter().rev().map(|bar| bar.name.clone());
    let place = |k: usize| (bars.len() - 1 - k) as f64;
    let mut panel = Panel::new(Axis::new("share of the mean square (%)"), Axis::categories("", names));
    for (k, bar) in bars.iter().enumerate() {
        let [share, low, high] = bar.share.map(|share| 100.0 * share);
        let (y, half) = (place(k), 0.3);
        let area = [(0.0, y - half, y + half), (share.max(0.0), y - half, y + half)];
        panel = panel.with(Layer::band("by itself, with its 95 % interval", Style::Blue, area));
        panel =
            panel.with(Layer::line("by itself, with its 95 % interval", Style::Blue, [(low, y), (high, y)]));
    }
    let totals = bars.iter().enumerate().filter_map(|(k, bar)| Some((100.0 * bar.total?, place(k))));
    panel = panel.with(Layer::points("with all in which it has a part", Style::Vermilion, totals));
    // Of a dozen rows.
    #[allow(clippy::cast_possible_truncation)]
    let height = 160 + 40 * bars.len() as u32;
    Figure {
        title: "Where the error comes from".to_owned(),
        subtitle: Some(subtitle),
        width: WIDTH,
        height: height.clamp(300, 2000),
        panels: vec![panel],
    }
}

/// The contributions over the angle.
pub fn over_angle(budget: &Budget, subtitle: String) -> Figure {
    let parts = &budget.over_angle;
    let x = Axis::new("rotor angle (°)").range(0.0, 360.0).step(60.0);
    let line = |of: &dyn Fn(&standstill_analysis::Part) -> f64| -> Vec<(f64, f64)> {
        parts.iter().map(|part| (part.angle_deg, of(part))).collect()
    };
    let mut panel = Panel::new(x, Axis::new("rms error (°)"))
        .with(Layer::line("all together", Style::Black, line(&|part| part.rms_deg)))
        .with(Layer::line("the method's own", Style::Vermilion, line(&|part| part.method_deg)));
    let mut ranked: Vec<usize> = (0..budget.items.len()).collect();
    ranked.sort_by(|a, b| budget.items[*b].share.value.total_cmp(&budget.items[*a].share.value));
    let styles = [Style::Blue, Style::Orange, Style::Green, Style::Purple];
    for (style, source) in styles.into_iter().zip(ranked).take(DRAWN) {
        let key = &budget.items[source].source.key;
        panel = panel.with(Layer::line(key, style, line(&|part| part.sources_deg[source])));
    }
    Figure {
        title: "The same over the rotor's angle".to_owned(),
        subtitle: Some(subtitle),
        width: WIDTH,
        height: 480,
        panels: vec![panel],
    }
}
