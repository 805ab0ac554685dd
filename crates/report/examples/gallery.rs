//! Draws one figure of each kind the reports use, and the awkward cases, into the folder given as argument.

use standstill_report::figure::{Axis, AxisScale, Figure, Lane, Layer, Panel, Style, cell_edges};
use std::f64::consts::TAU;
use std::path::Path;
use std::time::Instant;

/// Numbers that scatter evenly from 0 to 1, the same in every run.
fn noise() -> impl FnMut() -> f64 {
    let mut state = 1u64;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f64 / (1u64 << 24) as f64
    }
}

fn error_over_angle() -> Figure {
    let mut random = noise();
    let bias = |angle: f64| 0.6 * (2.0 * angle.to_radians()).sin() + 0.3 * (6.0 * angle.to_radians()).cos();
    let points = (0..10_000)
        .map(|_| {
            let angle = 360.0 * random();
            let spread = (0..6).map(|_| random() - 0.5).sum::<f64>();
            (angle, bias(angle) + 0.9 * spread)
        })
        .collect();
    let grid = || (0..=72).map(|i| 5.0 * f64::from(i));
    let x = Axis::new("true rotor position θ (° electrical)").range(0.0, 360.0).step(60.0);
    let panel = Panel::new(x, Axis::new("error of the estimate θ_e − θ (°)"))
        .with(Layer::Band {
            label: Some("5 % to 95 % of the detections".into()),
            points: grid().map(|a| (a, bias(a) - 1.05, bias(a) + 1.05)).collect(),
            style: Style::Orange,
        })
        .with(Layer::Points { label: Some("one detection".into()), points, style: Style::Blue })
        .with(Layer::Line {
            label: Some("median".into()),
            points: grid().map(|a| (a, bias(a))).collect(),
            style: Style::Black,
        })
        .with(Layer::HorizontalRule { label: Some("+2°".into()), y: 2.0 })
        .with(Layer::HorizontalRule { label: Some("−2°".into()), y: -2.0 });
    Figure {
        title: "Error of the estimated position over the true position".into(),
        subtitle: Some("10 000 detections, L_d = 1.2 mH, L_q = 1.6 mH, 20 kHz sampling, 12 bit".into()),
        width: 900,
        height: 480,
        panels: vec![panel],
    }
}

fn waveform() -> Figure {
    const STEP: f64 = 0.000_24;
    let pulse = |t: f64| (t / 1.2).floor();
    let angle = |t: f64| pulse(t) * TAU / 6.0;
    let shape = |t: f64| (-(t % 1.2) / 0.4).exp() - (-(t % 1.2) / 0.15).exp();
    let time = || (0..30_000).map(|i| f64::from(i) * STEP);
    let on = |t: f64| t % 1.2 < 0.3 && t < 7.2;
    let voltage = |leg: f64| {
        (0..=24)
            .map(|i| f64::from(i) * 0.3)
            .map(|t| (t, if on(t + 1e-9) { 24.0 * (angle(t + 1e-9) - leg * TAU / 3.0).cos() } else { 0.0 }))
            .collect::<Vec<_>>()
    };
    let current = |leg: f64| {
        let mut random = noise();
        time()
            .map(|t| (t, 14.0 * shape(t) * (angle(t) - leg * TAU / 3.0).cos() + 0.12 * (random() - 0.5)))
            .collect::<Vec<_>>()
    };
    let t = || Axis::new("time t (ms)").range(0.0, 7.2);
    let mut voltages = Panel::new(t(), Axis::new("voltage (V)"));
    let mut currents = Panel { weight: 1.4, ..Panel::new(t(), Axis::new("phase current (A)")) };
    for (leg, (name, style)) in ["a", "b", "c"].iter().zip(Style::ALL).enumerate() {
        voltages = voltages.with(Layer::Steps {
            label: Some(format!("u_{name}")),
            points: voltage(leg as f64),
            style,
        });
        currents = currents.with(Layer::Line {
            label: Some(format!("i_{name}")),
            points: current(leg as f64),
            style,
        });
    }
    let lanes = (0..3u32)
        .map(|leg| Lane {
            label: format!("leg {}", ['a', 'b', 'c'][leg as usize]),
            spans: (0..6u32)
                .flat_map(|pulse| {
                    let start = f64::from(pulse) * 1.2;
                    let up = (pulse + 2 * leg) % 6 < 3;
                    let (drive, free) = if up { (0, 3) } else { (2, 1) };
                    [
                        (start, start + 0.3, drive),
                        (start + 0.3, start + 0.9, free),
                        (start + 0.9, start + 1.2, 4),
                    ]
                })
                .collect(),
        })
        .collect();
    let categories = ["upper switch", "upper diode", "lower switch", "lower diode", "blocked"];
    let modes = Panel::new(t(), Axis::new("conduction"))
        .with(Layer::Lanes { lanes, categories: categories.map(String::from).to_vec() });
    Figure {
        title: "Six test pulses at standstill".into(),
        subtitle: Some("θ = 75°, dead time 1 µs".into()),
        width: 900,
        height: 760,
        panels: vec![voltages, currents, modes],
    }
}

fn polarity() -> Figure {
    let current = |gain: f64| move |t: f64| 6.0 * (1.0 - (-t / 0.9).exp()) * (1.0 + gain * t * t);
    let series = |of: &dyn Fn(f64) -> f64, n: u32| -> Vec<(f64, f64)> {
        (0..=n).map(|i| 1.5 * f64::from(i) / f64::from(n)).map(|t| (t, of(t))).collect()
    };
    let (north, south) = (current(0.12), current(-0.03));
    let mut panel = Panel::new(Axis::new("time t (ms)").range(0.0, 1.5), Axis::new("current |i| (A)"));
    for (label, style, of) in [
        ("along +d (saturating)", Style::Blue, &north as &dyn Fn(f64) -> f64),
        ("along −d", Style::Vermilion, &south),
    ] {
        panel = panel
            .with(Layer::Line { label: Some(label.into()), points: series(of, 1500), style })
            .with(Layer::Points { label: Some(label.into()), points: series(of, 30), style });
    }
    panel = panel
        .with(Layer::VerticalRule { label: Some("end of pulse".into()), x: 1.2 })
        .with(Layer::VerticalRule { label: Some("comparison".into()), x: 1.25 });
    Figure {
        title: "Polarity: the current rises faster where the field of the magnet adds".into(),
        subtitle: None,
        width: 900,
        height: 420,
        panels: vec![panel],
    }
}

fn awkward() -> Figure {
    let x = || Axis::new("x (s)");
    let flat = Panel::new(x(), Axis::new("constant (V)")).with(Layer::Line {
        label: Some("constant".into()),
        points: (0..5).map(|i| (f64::from(i), 3.3)).collect(),
        style: Style::Green,
    });
    let one = Panel::new(Axis::new("one x"), Axis::new("one point (Ω)")).with(Layer::Points {
        label: None,
        points: vec![(1e-7, 2.5e7)],
        style: Style::Purple,
    });
    let none = Panel::new(x(), Axis::new("a label that is far too long for its panel (N·m)"))
        .with(Layer::Line { label: Some("nothing".into()), points: vec![], style: Style::Blue })
        .with(Layer::HorizontalRule { label: Some("upper limit".into()), y: 1.0 })
        .with(Layer::HorizontalRule { label: Some("lower limit".into()), y: 0.9 });
    let names = ["pulse test", "high frequency injection", "inductance variation"];
    let bars = Panel::new(Axis::categories("", names.map(String::from)), Axis::new("error (°)"));
    let mut bars = bars;
    for (index, style) in Style::ALL.into_iter().enumerate() {
        let shift = (index as f64 - 2.5) * 0.1;
        bars = bars.with(Layer::ErrorBars {
            label: Some(format!("motor {index} with a rather long name")),
            points: (0..3).map(f64::from).map(|i| (i + shift, i, i - 0.5, i + 0.8 + shift)).collect(),
            style,
        });
    }
    let mut all = Panel::new(x(), Axis::new("styles"));
    for (index, style) in Style::ALL.into_iter().enumerate() {
        let y = index as f64;
        all = all.with(Layer::Line {
            label: Some(format!("{style:?}")),
            points: (0..100).map(|i| f64::from(i) / 20.0).map(|t| (t, y + 0.4 * t.sin())).collect(),
            style,
        });
    }
    Figure {
        title: "Awkward cases".into(),
        subtitle: Some("A subtitle with more to say than fits in one line: µ Ω ° ± − × · ≤ ≥ √ ² ₀₁₂ αβ γδθψω → — and <tags> & \"quotes\" must come out as they are".into()),
        width: 700,
        height: 1300,
        panels: vec![flat, all, none, one, bars],
    }
}

/// Heat maps with names and numbers on their axes, and without a single value.
fn heat() -> Figure {
    let values = |columns: u32, rows: u32| -> Vec<f64> {
        (0..rows * columns)
            .map(|i| {
                let (x, y) = (f64::from(i % columns), f64::from(i / columns));
                if i % 17 == 5 { f64::NAN } else { 0.05 * (1.0 + x * x) * (1.0 + 0.3 * y) }
            })
            .collect()
    };
    let methods =
        ["bipolar", "hfi-rotating", "hfi-pulsating", "maximum-likelihood-adaptive", "a name of many words"];
    let named = Panel::new(
        Axis::categories("method", methods.map(String::from)),
        Axis::categories("motor", ["paper", "gearless-hoist", "pm-reluctance"].map(String::from)),
    )
    .with(Layer::Heat {
        x_edges: (0..=5).map(|i| f64::from(i) - 0.5).collect(),
        y_edges: (0..=3).map(|i| f64::from(i) - 0.5).collect(),
        values: values(5, 3),
        colour: Axis::new("rms error of the axis (°)").log10(),
        numbers: true,
    });
    let noise: Vec<f64> = (0..40).map(|i| 1e-3 * 10f64.powf(f64::from(i) / 13.0)).collect();
    let dead: Vec<f64> = (0..40).map(|i| 0.1 * f64::from(i)).collect();
    let fine = Panel {
        weight: 2.0,
        ..Panel::new(Axis::new("noise of the current (A)").log10(), Axis::new("dead time (µs)"))
    }
    .with(Layer::Heat {
        x_edges: cell_edges(&noise, AxisScale::Log10),
        y_edges: cell_edges(&dead, AxisScale::Linear),
        values: values(40, 40),
        colour: Axis::new("rms error (°)"),
        numbers: true,
    })
    .with(Layer::HorizontalRule { label: Some("limit".into()), y: 2.0 });
    let empty = Panel { weight: 0.7, ..Panel::new(Axis::new("x"), Axis::new("y")) }.with(Layer::Heat {
        x_edges: vec![0.0, 1.0, 2.0],
        y_edges: vec![0.0, 1.0],
        values: vec![f64::NAN],
        colour: Axis::new("nothing"),
        numbers: true,
    });
    Figure {
        title: "Heat maps".into(),
        subtitle: Some("names and numbers; a fine grid with a logarithmic axis; no value at all".into()),
        width: 900,
        height: 1200,
        panels: vec![named, fine, empty],
    }
}

/// Logarithmic axes with what has no place on them, and upper limits.
fn logarithmic() -> Figure {
    let curve =
        |gain: f64| (-40..=40).map(|i| 10f64.powf(f64::from(i) / 20.0)).map(move |x| (x, gain * x.powf(1.5)));
    let panel = Panel::new(Axis::new("noise (mA)").log10(), Axis::new("rms error (°)").log10())
        .with(Layer::Band {
            label: Some("from nothing".into()),
            points: curve(0.1).map(|(x, y)| (x, if x < 0.1 { 0.0 } else { y / 2.0 }, 2.0 * y)).collect(),
            style: Style::Orange,
        })
        .with(Layer::Line { label: Some("middle".into()), points: curve(0.1).collect(), style: Style::Blue })
        .with(Layer::ErrorBars {
            label: Some("with and without a lower end".into()),
            points: vec![(0.03, 1.0, 0.0, 3.0), (0.3, 1.0, 0.5, 2.0), (0.0, 1.0, 0.5, 2.0)],
            style: Style::Black,
        })
        .with(Layer::UpperLimits {
            label: Some("none in 1000: upper limit".into()),
            points: vec![(1.0, 1e-3), (10.0, 3e-3), (30.0, 1.3e-4)],
            style: Style::Vermilion,
        });
    let narrow = Panel::new(Axis::new("part of a decade (A)").log10(), Axis::new("rms error (°)").log10())
        .with(Layer::Line { label: None, points: vec![(2.0, 1.1), (3.4, 2.3)], style: Style::Green });
    let wide = Panel::new(Axis::new("many decades").log10(), Axis::new("probability").log10())
        .with(Layer::Line { label: None, points: vec![(1e-20, 1e-12), (1e5, 1.0)], style: Style::Purple });
    Figure {
        title: "Logarithmic axes".into(),
        subtitle: None,
        width: 900,
        height: 900,
        panels: vec![panel, narrow, wide],
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).ok_or("usage: gallery FOLDER")?;
    std::fs::create_dir_all(&folder)?;
    for (name, figure) in [
        ("error", error_over_angle()),
        ("waveform", waveform()),
        ("polarity", polarity()),
        ("awkward", awkward()),
        ("heat", heat()),
        ("logarithmic", logarithmic()),
    ] {
        let start = Instant::now();
        let svg = figure.svg()?;
        let drawn = start.elapsed();
        let start = Instant::now();
        let png = figure.png()?;
        println!(
            "{name}: svg {} kB in {drawn:.0?}, png {} kB in {:.0?}",
            svg.len() / 1000,
            png.len() / 1000,
            start.elapsed()
        );
        std::fs::write(Path::new(&folder).join(format!("{name}.svg")), svg)?;
        std::fs::write(Path::new(&folder).join(format!("{name}.png")), png)?;
    }
    Ok(())
}
