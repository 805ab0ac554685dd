//! Heat maps, logarithmic axes and upper limits of made-up data.

use standstill_report::figure::{Axis, AxisScale, Figure, Layer, Panel, Style, cell_edges};
use standstill_report::page::Chart;

fn chart(id: &str, title: &str, subtitle: &str, height: u32, panels: Vec<Panel>, caption: &str) -> Chart {
    Chart {
        id: id.into(),
        figure: Figure { title: title.into(), subtitle: Some(subtitle.into()), width: 900, height, panels },
        caption: caption.into(),
    }
}

/// Cells on a logarithmic axis, their values on a linear and on a logarithmic scale.
pub(super) fn grid() -> Chart {
    let noise: Vec<f64> = (0..=30).map(|i| 1e-3 * 10f64.powf(f64::from(i) / 10.0)).collect();
    let dead: Vec<f64> = [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0].to_vec();
    let rms = |noise: f64, dead: f64| 0.08 + 0.5 * noise.powf(0.7) + 0.02 * dead * dead;
    let cells = |value: &dyn Fn(f64, f64) -> f64| -> Vec<f64> {
        dead.iter().flat_map(|dead| noise.iter().map(move |noise| value(*noise, *dead))).collect()
    };
    let panel = |label: &str, logarithmic: bool, values| {
        let colour = Axis::new(label);
        let axes = (Axis::new("noise of the current i_n (A)").log10(), Axis::new("dead time t_d (µs)"));
        Panel::new(axes.0, axes.1).with(Layer::Heat {
            x_edges: cell_edges(&noise, AxisScale::Log10),
            y_edges: cell_edges(&dead, AxisScale::Linear),
            values,
            colour: if logarithmic { colour.log10() } else { colour },
            numbers: true,
        })
    };
    let lost =
        |noise: f64, dead: f64| dead > 2.4 && noise > 0.3 || (noise - 0.01).abs() < 1e-4 && dead == 1.0;
    let with_gaps = |noise, dead| if lost(noise, dead) { f64::NAN } else { rms(noise, dead) };
    let wrong = |noise: f64, dead: f64| {
        let share = 100.0 * (-9.0 + 4.0 * rms(noise, dead)).exp();
        if share < 0.02 { 0.0 } else { share }
    };
    chart(
        "map",
        "Error over noise and dead time",
        "400 trials a cell, harsh errors",
        820,
        vec![
            panel("rms error (°)", false, cells(&with_gaps))
                .with(Layer::VerticalRule { label: Some("sensor i_n".into()), x: 0.05 })
                .with(Layer::HorizontalRule { label: Some("drive".into()), y: 2.0 }),
            panel("wrong poles (%)", true, cells(&wrong)),
        ],
        "Hatched cells have fewer than 20 trials that could be simulated. No wrong pole has the lightest colour.",
    )
}

/// Names on both axes, and numbers in the cells.
pub(super) fn methods() -> Chart {
    let names = |all: &[&str]| all.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
    let methods =
        names(&["pulse test", "high-frequency injection", "maximum-likelihood", "six pulses", "saturation"]);
    let errors = names(&["none", "default", "harsh", "broken <sensor>"]);
    let values = vec![
        0.011,
        0.06,
        0.0043,
        0.12,
        0.8, //
        0.1,
        0.6,
        0.045,
        1.1,
        4.2, //
        0.22,
        1.3,
        0.1,
        1.6,
        17.3, //
        2.4,
        f64::NAN,
        1.9,
        12.5,
        f64::NAN,
    ];
    let panel = Panel::new(Axis::categories("method", methods), Axis::categories("errors", errors)).with(
        Layer::Heat {
            x_edges: (0..=5).map(|i| f64::from(i) - 0.5).collect(),
            y_edges: (0..=4).map(|i| f64::from(i) - 0.5).collect(),
            values,
            colour: Axis::new("rms error of the axis θ_e (°)").range(0.01, 10.0).log10(),
            numbers: true,
        },
    );
    chart("names", "Methods and errors", "2,000 trials each", 420, vec![panel], "")
}

/// A sweep over decades, with what was never seen.
pub(super) fn noise() -> Chart {
    let points = [1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0, 3.0];
    let rms = |noise: f64| 0.02 + 0.6 * noise.powf(0.9);
    let x = || Axis::new("noise of the current i_n (A)").log10();
    let errors = Panel::new(x(), Axis::new("rms error (°)").log10())
        .with(Layer::Band {
            label: Some("95 % interval of the model".into()),
            points: points
                .iter()
                .map(|n| (*n, if *n < 0.02 { 0.0 } else { 0.6 * rms(*n) }, 1.5 * rms(*n)))
                .collect(),
            style: Style::Green,
        })
        .with(Layer::ErrorBars {
            label: Some("trials, 95 % interval".into()),
            points: points
                .iter()
                .map(|n| (*n, 1.1 * rms(*n), 0.8 * rms(*n) - 0.014, 1.6 * rms(*n)))
                .collect(),
            style: Style::Blue,
        })
        .with(Layer::HorizontalRule { label: Some("tolerance 0.5°".into()), y: 0.5 })
        .with(Layer::VerticalRule { label: Some("sensor".into()), x: 0.05 });
    let wrong = Panel::new(x(), Axis::new("wrong poles (%)").log10())
        .with(Layer::ErrorBars {
            label: Some("seen".into()),
            points: points[4..].iter().map(|n| (*n, 2.0 * n, 1.2 * n, 3.1 * n)).collect(),
            style: Style::Vermilion,
        })
        .with(Layer::UpperLimits {
            label: Some("never seen, 95 % limit".into()),
            points: points[..4].iter().map(|n| (*n, 0.06 + n)).collect(),
            style: Style::Vermilion,
        });
    chart("decades", "Noise over four decades", "5,000 trials a point", 720, vec![errors, wrong], "")
}

/// Read together on logarithmic axes, where some of it has no place.
pub(super) fn decay() -> Chart {
    let grid = || (-20..=40).map(|i| 10f64.powf(f64::from(i) / 10.0));
    let panel = Panel::new(Axis::new("frequency f (Hz)").log10(), Axis::new("admittance Y (S)").log10())
        .with(Layer::Line {
            label: Some("model".into()),
            points: grid().map(|f| (f, 1.0 / (0.5 + 0.06 * f))).collect(),
            style: Style::Blue,
        })
        .with(Layer::Line {
            label: Some("measured".into()),
            points: grid()
                .map(|f| (f, 1.0 / (0.5 + 0.05 * f) - if (f - 10.0).abs() < 2.0 { 2.0 } else { 0.0 }))
                .collect(),
            style: Style::Vermilion,
        })
        .with(Layer::Steps {
            label: Some("table".into()),
            points: grid().step_by(10).map(|f| (f, 1.3 / (0.5 + 0.06 * f))).collect(),
            style: Style::Green,
        });
    chart(
        "admittance",
        "Admittance at standstill",
        "gaps are where the reading was negative",
        400,
        vec![panel],
        "",
    )
}
