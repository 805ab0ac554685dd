//! Figure that compares two runs.

use standstill_report::figure::{Axis, Figure, Layer, Panel, Style};

use standstill_campaign::Estimate;

use super::row::Compared;
use super::{CASES, Common};

/// Draws the rms errors of both runs at the top, their difference in the middle, and the rates of failures at the
/// bottom.
pub fn figure(rows: &[Compared], points: &[Common], names: &[String; 2], conditions: &str) -> Figure {
    /// Largest number of names on the axis; more names would overlap.
    const NAMED: usize = 6;
    let names = [format!("A: {}", names[0]), format!("B: {}", names[1])];
    let rms: Vec<&Compared> = rows.iter().filter(|row| row.is_rms()).collect();
    let single = points.len() == 1;
    let x = || match points {
        [one] => Axis::categories("", [one.name.clone()]),
        few if few.len() <= NAMED => Axis::categories("", few.iter().map(|point| point.name.clone())),
        _ => Axis::new("point, in the order of the table").whole(),
    };
    let both = |panel: Panel, rows: &[&Compared]| {
        let at = |shift: f64, run: usize| {
            let bar = move |(place, row): (usize, &&Compared)| {
                let Estimate { value, low, high } = row.of[run].times(row.factor());
                (place as f64 + shift, value, low, high)
            };
            // A value that is not finite has no bar.
            let known = |row: &&Compared| {
                let Estimate { value, low, high } = row.of[run];
                [value, low, high].iter().all(|x| x.is_finite())
            };
            rows.iter().enumerate().filter(|(_, row)| known(row)).map(bar).collect::<Vec<_>>()
        };
        panel.with(Layer::error_bars(&names[0], Style::Blue, at(-0.08, 0))).with(Layer::error_bars(
            &names[1],
            Style::Vermilion,
            at(0.08, 1),
        ))
    };
    let upper = both(Panel::new(x(), Axis::new("rms error (°)")), &rms);
    let bar =
        |(place, row): (usize, &&Compared)| (place as f64, row.apart.value, row.apart.low, row.apart.high);
    let apart = Panel::new(x(), Axis::new("B less A (°)"))
        .with(Layer::error_bars(
            "difference with 95 % interval",
            Style::Black,
            rms.iter().enumerate().filter(|(_, row)| row.apart.high.is_finite()).map(bar),
        ))
        .with(Layer::level("", 0.0));
    // A panel without numbers is left out. One panel always remains: that of the rates for a single point, that of the rms errors for
    // several points.
    let mut panels = Vec::new();
    if !single || rms.iter().any(|row| row.of.iter().any(|of| of.value.is_finite())) {
        panels.push(upper);
    }
    if rms.iter().any(|row| row.apart.high.is_finite()) {
        panels.push(apart);
    }
    if single {
        let rest: Vec<&Compared> = rows.iter().filter(|row| CASES.contains(&row.measure)).collect();
        let panel = Panel::new(Axis::categories("", CASES.map(str::to_owned)), Axis::new("starts (%)"));
        panels.push(both(panel, &rest));
    } else {
        for case in CASES {
            let rest: Vec<&Compared> = rows.iter().filter(|row| row.measure == case).collect();
            // A case that never happens has no panel.
            if rest.iter().any(|row| row.of.iter().any(|of| of.value > 0.0)) {
                panels.push(both(Panel::new(x(), Axis::new(format!("{case} (%)"))), &rest));
            }
        }
    }
    // There are five panels at most.
    #[allow(clippy::cast_possible_truncation)]
    let height = 120 + 230 * panels.len() as u32;
    let title = "Two runs compared, with 95 % intervals".to_owned();
    Figure { title, subtitle: Some(conditions.to_owned()), width: 860, height, panels }
}
