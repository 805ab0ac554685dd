//! Charts of made-up data.

use standstill_report::figure::{Axis, Figure, Lane, Layer, Panel, Style, Ticks};
use standstill_report::page::Chart;
use std::f64::consts::TAU;

/// Numbers that scatter evenly from 0 to 1, the same in every run.
pub(super) fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f64 / (1u64 << 24) as f64
    }
}

fn bias(angle: f64) -> f64 {
    0.6 * (2.0 * angle.to_radians()).sin() + 0.3 * (6.0 * angle.to_radians()).cos()
}

pub(super) fn scatter() -> Chart {
    let mut random = noise(1);
    let points = (0..4_000)
        .map(|_| {
            let angle = 360.0 * random();
            (angle, bias(angle) + 0.9 * (0..6).map(|_| random() - 0.5).sum::<f64>())
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
    Chart {
        id: "error-over-angle".into(),
        figure: Figure {
            title: "Error of the estimated position over the true position".into(),
            subtitle: Some("4,000 detections, L_d = 9.2 mH, L_q = 12.6 mH, 20 kHz sampling, 12 bit".into()),
            width: 900,
            height: 480,
            panels: vec![panel],
        },
        caption: "The bias repeats twice a turn: it is that of the sensors' gains. Nothing lies beyond ±4°."
            .into(),
    }
}

/// Six pulses: voltages, currents and conduction over one time axis.
pub(super) fn waveform() -> Chart {
    let pulse = |t: f64| (t / 1.2).floor();
    let angle = |t: f64| pulse(t) * TAU / 6.0;
    let shape = |t: f64| (-(t % 1.2) / 0.4).exp() - (-(t % 1.2) / 0.15).exp();
    let on = |t: f64| t % 1.2 < 0.3 && t < 7.2;
    let t = || Axis::new("time t (ms)").range(0.0, 7.2);
    let mut voltages = Panel::new(t(), Axis::new("phase voltage u (V)"));
    let mut currents = Panel { weight: 1.4, ..Panel::new(t(), Axis::new("phase current i (A)")) };
    for (leg, (name, style)) in ["a", "b", "c"].iter().zip(Style::ALL).enumerate() {
        let lag = leg as f64 * TAU / 3.0;
        let mut random = noise(7 + leg as u64);
        voltages = voltages.with(Layer::Steps {
            label: Some(format!("u_{name}")),
            points: (0..=24)
                .map(|i| f64::from(i) * 0.3 + 1e-9)
                .map(|t| (t, if on(t) { 24.0 * (angle(t) - lag).cos() } else { 0.0 }))
                .collect(),
            style,
        });
        currents = currents.with(Layer::Line {
            label: Some(format!("i_{name}")),
            points: (0..1800)
                .map(|i| f64::from(i) * 0.004)
                .map(|t| (t, 14.0 * shape(t) * (angle(t) - lag).cos() + 0.12 * (random() - 0.5)))
                .collect(),
            style,
        });
    }
    let lane = |leg: u32| Lane {
        label: format!("leg {}", ['a', 'b', 'c'][leg as usize]),
        spans: (0..6u32)
            .flat_map(|pulse| {
                let start = f64::from(pulse) * 1.2;
                let (drive, free) = if (pulse + 2 * leg) % 6 < 3 { (0, 3) } else { (2, 1) };
                [(start, start + 0.3, drive), (start + 0.3, start + 0.9, free), (start + 0.9, start + 1.2, 4)]
            })
            .collect(),
    };
    let categories = ["upper switch", "upper diode", "lower switch", "lower diode", "blocked"];
    let modes = Panel::new(t(), Axis::new("conduction")).with(Layer::Lanes {
        lanes: (0..3).map(lane).collect(),
        categories: categories.map(String::from).to_vec(),
    });
    Chart {
        id: "waveform".into(),
        figure: Figure {
            title: "Six test pulses at standstill".into(),
            subtitle: Some("θ = 75°, dead time 1 µs".into()),
            width: 900,
            height: 760,
            panels: vec![voltages, currents, modes],
        },
        caption: "One detection of the sweep, the one with the largest error.".into(),
    }
}

pub(super) fn polarity() -> Chart {
    let current = |gain: f64| move |t: f64| 6.0 * (1.0 - (-t / 0.9).exp()) * (1.0 + gain * t * t);
    let series = |of: &dyn Fn(f64) -> f64, n: u32| -> Vec<(f64, f64)> {
        (0..=n).map(|i| 1.5 * f64::from(i) / f64::from(n)).map(|t| (t, of(t))).collect()
    };
    let mut panel = Panel::new(Axis::new("time t (ms)").range(0.0, 1.5), Axis::new("current |i| (A)"));
    let (north, south) = (current(0.12), current(-0.03));
    for (label, style, of) in [
        ("along +d (saturating)", Style::Blue, &north as &dyn Fn(f64) -> f64),
        ("along −d", Style::Vermilion, &south),
    ] {
        panel = panel
            .with(Layer::Line { label: Some(label.into()), points: series(of, 300), style })
            .with(Layer::Points { label: Some(label.into()), points: series(of, 30), style });
    }
    panel = panel
        .with(Layer::VerticalRule { label: Some("end of pulse".into()), x: 1.2 })
        .with(Layer::VerticalRule { label: Some("comparison".into()), x: 1.25 });
    Chart {
        id: "polarity".into(),
        figure: Figure {
            title: "The current rises faster where the field of the magnet adds".into(),
            subtitle: None,
            width: 900,
            height: 420,
            panels: vec![panel],
        },
        caption: String::new(),
    }
}

pub(super) fn methods(motor: &str) -> Chart {
    let names =
        ["line inductance", "rotating injection", "pulsating injection", "bipolar", "maximum likelihood"];
    let ticks = names.iter().enumerate().map(|(i, name)| (i as f64, (*name).to_owned())).collect();
    let x = Axis { ticks: Ticks::Named(ticks), ..Axis::new("").range(-0.5, 4.5) };
    let mut panel = Panel::new(x, Axis::new("rms error of the axis (°)"));
    for (errors, style, values, shift) in [
        (&format!("{motor}, default errors"), Style::Blue, [0.84, 0.6, 1.1, 0.10, 0.045], -0.08),
        (&format!("{motor}, harsh errors"), Style::Vermilion, [1.60, 1.0, 1.3, 0.22, 0.10], 0.08),
    ] {
        panel = panel.with(Layer::ErrorBars {
            label: Some(errors.clone()),
            points: values
                .iter()
                .enumerate()
                .map(|(i, v)| (i as f64 + shift, *v, v * 0.94 - 0.02, v * 1.07 + 0.03))
                .collect(),
            style,
        });
    }
    Chart {
        id: "methods".into(),
        figure: Figure {
            title: format!("The methods on {motor}"),
            subtitle: Some("2,000 trials each; whiskers are 95 % intervals".into()),
            width: 900,
            height: 380,
            panels: vec![panel],
        },
        caption: String::new(),
    }
}

/// Panels with axes of their own.
pub(super) fn influences() -> Chart {
    let panel = |label: &str, from: f64, to: f64, slope: f64| {
        let grid = || (0..=40).map(move |i| from + (to - from) * f64::from(i) / 40.0);
        let at = move |x: f64| 0.1 + slope * ((x - from) / (to - from)).powi(2);
        Panel::new(Axis::new(label).range(from, to), Axis::new("rms error (°)").range(0.0, 0.6))
            .with(Layer::Band {
                label: Some("95 % interval".into()),
                points: grid().map(|x| (x, 0.88 * at(x), 1.14 * at(x))).collect(),
                style: Style::Green,
            })
            .with(Layer::Line {
                label: Some("mean over the other axes".into()),
                points: grid()
                    .map(|x| (x, if (x - from) / (to - from) > 0.9 { f64::NAN } else { at(x) }))
                    .collect(),
                style: Style::Green,
            })
            .with(Layer::HorizontalRule { label: Some("tolerance 0.5°".into()), y: 0.5 })
    };
    Chart {
        id: "influences".into(),
        figure: Figure {
            title: "What the error depends on".into(),
            subtitle: Some(
                "mean over the other axes of the sweep; a gap is where fewer than 20 points lie".into(),
            ),
            width: 900,
            height: 860,
            panels: vec![
                panel("dead time t_d (µs)", 0.5, 4.0, 0.42),
                panel("link voltage U_dc (V)", 480.0, 620.0, 0.08),
                panel("winding temperature (°C)", -20.0, 120.0, 0.2),
            ],
        },
        caption: "Dead time dominates; the link's voltage hardly matters.".into(),
    }
}

pub(super) fn convergence() -> Chart {
    let grid = || (1..=100).map(|i| 10.0 * f64::from(i));
    let panel = Panel::new(Axis::new("points of the sweep n"), Axis::new("share of wrong poles (%)"))
        .with(Layer::Band {
            label: Some("95 % interval".into()),
            points: grid()
                .map(|n| (n, (0.4 - 6.0 / n.sqrt()).max(0.0), 0.4 + 18.0 / n.sqrt() / 2.0))
                .collect(),
            style: Style::Purple,
        })
        .with(Layer::Steps {
            label: Some("so far".into()),
            points: grid().map(|n| (n, 0.4 + (n / 37.0).sin() * 3.0 / n.sqrt())).collect(),
            style: Style::Purple,
        })
        .with(Layer::HorizontalRule { label: Some("accepted".into()), y: 1.0 });
    Chart {
        id: "convergence".into(),
        figure: Figure {
            title: "Are 1,000 points enough?".into(),
            subtitle: None,
            width: 900,
            height: 360,
            panels: vec![panel],
        },
        caption: String::new(),
    }
}
