//! A figure of every kind, and what must not upset it.

use super::noise;
use standstill_report::figure::{
    Axis, AxisScale, Figure, Lane, Layer, Panel, Style, Ticks, cell_edges, rounded,
};
use standstill_report::page::Chart;
use std::f64::consts::TAU;

pub(super) fn all(motor: &str) -> Vec<Chart> {
    vec![
        error_over_angle(),
        waveform(),
        polarity(),
        methods(motor),
        influences(),
        convergence(),
        maps(),
        names(),
        decades(),
        admittance(),
        awkward(),
        extremes(),
    ]
}

fn chart(id: &str, title: &str, subtitle: &str, height: u32, panels: Vec<Panel>) -> Chart {
    let subtitle = (!subtitle.is_empty()).then(|| subtitle.to_owned());
    let figure = Figure { title: title.to_owned(), subtitle, width: 900, height, panels };
    Chart { id: id.to_owned(), figure, caption: format!("{title}, from made-up data.") }
}

fn error_over_angle() -> Chart {
    let mut random = noise(1);
    let bias = |angle: f64| 0.6 * (2.0 * angle.to_radians()).sin() + 0.3 * (6.0 * angle.to_radians()).cos();
    let points = (0..4_000).map(|_| {
        let angle = 360.0 * random();
        (angle, bias(angle) + 0.9 * (0..6).map(|_| random() - 0.5).sum::<f64>())
    });
    let grid = || (0..=72).map(|i| 5.0 * f64::from(i));
    let x = Axis::new("true rotor position θ (° electrical)").range(0.0, 360.0).step(60.0);
    let range = grid().map(|a| (a, bias(a) - 1.05, bias(a) + 1.05));
    let panel = Panel::new(x, Axis::new("error of the estimate θ_e − θ (°)"))
        .with(Layer::band("5 % to 95 % of the detections", Style::Orange, range))
        .with(Layer::points("one detection", Style::Blue, points))
        .with(Layer::line("median", Style::Black, grid().map(|a| (a, bias(a)))))
        .with(Layer::level("+2°", 2.0))
        .with(Layer::level("−2°", -2.0));
    let conditions = "4,000 detections, L_d = 9.2 mH, L_q = 12.6 mH, 20 kHz sampling, 12 bit";
    chart(
        "error-over-angle",
        "Error of the estimated position over the true one",
        conditions,
        480,
        vec![panel],
    )
}

/// Six pulses: voltages, noisy currents and conduction over one time axis.
fn waveform() -> Chart {
    let angle = |t: f64| (t / 1.2).floor() * TAU / 6.0;
    let shape = |t: f64| (-(t % 1.2) / 0.4).exp() - (-(t % 1.2) / 0.15).exp();
    let on = |t: f64| t % 1.2 < 0.3 && t < 7.2;
    let t = || Axis::new("time t (ms)").range(0.0, 7.2);
    let mut voltages = Panel::new(t(), Axis::new("phase voltage u (V)"));
    let mut currents = Panel { weight: 1.4, ..Panel::new(t(), Axis::new("phase current i (A)")) };
    for (leg, (name, style)) in ["a", "b", "c"].iter().zip(Style::ALL).enumerate() {
        let lag = leg as f64 * TAU / 3.0;
        let mut random = noise(7 + leg as u64);
        let edges = (0..=24).map(|i| f64::from(i) * 0.3 + 1e-9);
        let voltage = edges.map(|t| (t, if on(t) { 24.0 * (angle(t) - lag).cos() } else { 0.0 }));
        let time = (0..3600).map(|i| f64::from(i) * 0.002);
        let current = time.map(|t| (t, 14.0 * shape(t) * (angle(t) - lag).cos() + 0.12 * (random() - 0.5)));
        voltages = voltages.with(Layer::steps(&format!("u_{name}"), style, voltage));
        currents = currents.with(Layer::line(&format!("i_{name}"), style, current));
    }
    let spans = |leg: u32, pulse: u32| {
        let start = f64::from(pulse) * 1.2;
        let (drive, free) = if (pulse + 2 * leg) % 6 < 3 { (0, 3) } else { (2, 1) };
        [(start, start + 0.3, drive), (start + 0.3, start + 0.9, free), (start + 0.9, start + 1.2, 4)]
    };
    let lane = |leg: u32| Lane {
        label: format!("leg {}", ['a', 'b', 'c'][leg as usize]),
        spans: (0..6).flat_map(|pulse| spans(leg, pulse)).collect(),
    };
    let categories = ["upper switch", "upper diode", "lower switch", "lower diode", "blocked"];
    let modes = Panel::new(t(), Axis::new("conduction")).with(Layer::Lanes {
        lanes: (0..3).map(lane).collect(),
        categories: categories.map(String::from).to_vec(),
    });
    let panels = vec![voltages, currents, modes];
    chart("waveform", "Six test pulses at standstill", "θ = 75°, dead time 1 µs", 760, panels)
}

/// Lines with markers, and rules that are close to each other.
fn polarity() -> Chart {
    let mut panel = Panel::new(Axis::new("time t (ms)").range(0.0, 1.5), Axis::new("current |i| (A)"));
    for (label, style, gain) in
        [("along +d (saturating)", Style::Blue, 0.12), ("along −d", Style::Vermilion, -0.03)]
    {
        let current = |t: f64| 6.0 * (1.0 - (-t / 0.9).exp()) * (1.0 + gain * t * t);
        let series =
            |n: u32| (0..=n).map(move |i| 1.5 * f64::from(i) / f64::from(n)).map(|t| (t, current(t)));
        panel =
            panel.with(Layer::line(label, style, series(300))).with(Layer::points(label, style, series(30)));
    }
    let panel = panel.with(Layer::instant("end of pulse", 1.2)).with(Layer::instant("comparison", 1.25));
    chart("polarity", "The current rises faster where the field of the magnet adds", "", 420, vec![panel])
}

fn methods(motor: &str) -> Chart {
    let names =
        ["line inductance", "rotating injection", "pulsating injection", "bipolar", "maximum likelihood"];
    let x = Axis::categories("", names.map(String::from));
    let mut panel = Panel::new(x, Axis::new("rms error of the axis (°)"));
    for (errors, style, values, shift) in [
        ("default", Style::Blue, [0.84, 0.6, 1.1, 0.10, 0.045], -0.08),
        ("harsh", Style::Vermilion, [1.60, 1.0, 1.3, 0.22, 0.10], 0.08),
    ] {
        let points = values.into_iter().enumerate();
        let points = points.map(|(i, v)| (i as f64 + shift, v, v * 0.94 - 0.02, v * 1.07 + 0.03));
        panel = panel.with(Layer::error_bars(&format!("{motor}, {errors} errors"), style, points));
    }
    let title = format!("The methods on {motor}");
    chart("methods", &title, "2,000 trials each; whiskers are 95 % intervals", 380, vec![panel])
}

/// Panels with axes of their own, and a line with a gap.
fn influences() -> Chart {
    let panel = |label: &str, from: f64, to: f64, slope: f64| {
        let grid =
            || (0..=40).map(|i| f64::from(i) / 40.0).map(move |share| (share, from + (to - from) * share));
        let at = move |share: f64| 0.1 + slope * share.powi(2);
        let mean = grid().map(|(share, x)| (x, if share > 0.9 { f64::NAN } else { at(share) }));
        Panel::new(Axis::new(label).range(from, to), Axis::new("rms error (°)").range(0.0, 0.6))
            .with(Layer::band(
                "95 % interval",
                Style::Green,
                grid().map(|(s, x)| (x, 0.88 * at(s), 1.14 * at(s))),
            ))
            .with(Layer::line("mean over the other axes", Style::Green, mean))
            .with(Layer::level("tolerance 0.5°", 0.5))
    };
    let panels = vec![
        panel("dead time t_d (µs)", 0.5, 4.0, 0.42),
        panel("link voltage U_dc (V)", 480.0, 620.0, 0.08),
        panel("winding temperature (°C)", -20.0, 120.0, 0.2),
    ];
    chart("influences", "What the error depends on", "a gap is where fewer than 20 points lie", 860, panels)
}

fn convergence() -> Chart {
    let grid = || (1..=100).map(|i| 10.0 * f64::from(i));
    let interval = grid().map(|n| (n, (0.4 - 6.0 / n.sqrt()).max(0.0), 0.4 + 9.0 / n.sqrt()));
    let panel = Panel::new(Axis::new("points of the sweep n"), Axis::new("share of wrong poles (%)"))
        .with(Layer::band("95 % interval", Style::Purple, interval))
        .with(Layer::steps(
            "so far",
            Style::Purple,
            grid().map(|n| (n, 0.4 + (n / 37.0).sin() * 3.0 / n.sqrt())),
        ))
        .with(Layer::level("accepted", 1.0));
    chart("convergence", "Are 1,000 points enough?", "", 360, vec![panel])
}

/// Cells on a logarithmic axis, their values on a linear and on a logarithmic scale.
fn maps() -> Chart {
    let noise: Vec<f64> = (0..=30).map(|i| 1e-3 * 10f64.powf(f64::from(i) / 10.0)).collect();
    let dead = [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0];
    let rms = |noise: f64, dead: f64| 0.08 + 0.5 * noise.powf(0.7) + 0.02 * dead * dead;
    let panel = |colour: Axis, value: &dyn Fn(f64, f64) -> f64| {
        let (x, y) = (Axis::new("noise of the current i_n (A)").log10(), Axis::new("dead time t_d (µs)"));
        Panel::new(x, y).with(Layer::Heat {
            x_edges: cell_edges(&noise, AxisScale::Log10),
            y_edges: cell_edges(&dead, AxisScale::Linear),
            values: dead.iter().flat_map(|dead| noise.iter().map(|noise| value(*noise, *dead))).collect(),
            colour,
            blank: "no answer".to_owned(),
            texts: Vec::new(),
        })
    };
    let lost =
        |noise: f64, dead: f64| dead > 2.4 && noise > 0.3 || (noise - 0.01).abs() < 1e-4 && dead == 1.0;
    let errors = panel(Axis::new("rms error (°)"), &|n, d| if lost(n, d) { f64::NAN } else { rms(n, d) })
        .with(Layer::instant("sensor i_n", 0.05))
        .with(Layer::level("drive", 2.0));
    let wrong = panel(Axis::new("wrong poles (%)").log10(), &|n, d| {
        let share = 100.0 * (-9.0 + 4.0 * rms(n, d)).exp();
        if share < 0.02 { 0.0 } else { share }
    });
    chart(
        "map",
        "Error over noise and dead time",
        "400 trials a cell, harsh errors",
        820,
        vec![errors, wrong],
    )
}

/// Names on both axes, and numbers in the cells.
fn names() -> Chart {
    let axis =
        |label: &str, names: &[&str]| Axis::categories(label, names.iter().map(|name| (*name).to_owned()));
    let methods = [
        "pulse test",
        "high-frequency injection",
        "maximum-likelihood",
        "six pulses",
        "a name of many words",
    ];
    let none = f64::NAN;
    let values = [
        [0.011, 0.06, 0.0043, 0.12, 0.8],
        [0.1, 0.6, 0.045, 1.1, 4.2],
        [0.22, 1.3, 0.1, 1.6, 17.3],
        [2.4, none, 1.9, 12.5, none],
    ]
    .concat();
    let panel = Panel::new(
        axis("method", &methods),
        axis("errors", &["none", "default", "harsh", "broken <sensor>"]),
    )
    .with(Layer::Heat {
        x_edges: (0..=5).map(|i| f64::from(i) - 0.5).collect(),
        y_edges: (0..=4).map(|i| f64::from(i) - 0.5).collect(),
        texts: values.iter().map(|value| rounded(*value, 2)).collect(),
        values,
        colour: Axis::new("rms error of the axis θ_e (°)").range(0.01, 10.0).log10(),
        blank: "no answer".to_owned(),
    });
    chart("names", "Methods and errors", "2,000 trials each", 420, vec![panel])
}

/// A sweep over decades, with what has no place on a logarithmic axis and what was never seen.
fn decades() -> Chart {
    let points = [1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0, 3.0];
    let rms = |noise: f64| 0.02 + 0.6 * noise.powf(0.9);
    let x = || Axis::new("noise of the current i_n (A)").log10();
    let model = points.map(|n| (n, if n < 0.02 { 0.0 } else { 0.6 * rms(n) }, 1.5 * rms(n)));
    let trials = points.map(|n| (n, 1.1 * rms(n), 0.8 * rms(n) - 0.014, 1.6 * rms(n)));
    let errors = Panel::new(x(), Axis::new("rms error (°)").log10())
        .with(Layer::band("95 % interval of the model", Style::Green, model))
        .with(Layer::error_bars("trials, 95 % interval", Style::Blue, trials))
        .with(Layer::level("tolerance 0.5°", 0.5))
        .with(Layer::instant("sensor", 0.05));
    let wrong = Panel::new(x(), Axis::new("wrong poles (%)").log10())
        .with(Layer::error_bars(
            "seen",
            Style::Vermilion,
            points[4..].iter().map(|n| (*n, 2.0 * n, 1.2 * n, 3.1 * n)),
        ))
        .with(Layer::upper_limits(
            "never seen, 95 % limit",
            Style::Vermilion,
            points[..4].iter().map(|n| (*n, 0.06 + n)),
        ));
    chart("decades", "Noise over four decades", "5,000 trials a point", 720, vec![errors, wrong])
}

/// Read together on logarithmic axes, where some of it has no place.
fn admittance() -> Chart {
    let grid = || (-20..=40).map(|i| 10f64.powf(f64::from(i) / 10.0));
    let negative = |f: f64| if (f - 10.0).abs() < 2.0 { 2.0 } else { 0.0 };
    let panel = Panel::new(Axis::new("frequency f (Hz)").log10(), Axis::new("admittance Y (S)").log10())
        .with(Layer::line("model", Style::Blue, grid().map(|f| (f, 1.0 / (0.5 + 0.06 * f)))))
        .with(Layer::line(
            "measured",
            Style::Vermilion,
            grid().map(|f| (f, 1.0 / (0.5 + 0.05 * f) - negative(f))),
        ))
        .with(Layer::steps("table", Style::Green, grid().step_by(10).map(|f| (f, 1.3 / (0.5 + 0.06 * f)))));
    chart(
        "admittance",
        "Admittance at standstill",
        "gaps are where the reading was negative",
        400,
        vec![panel],
    )
}

fn awkward() -> Chart {
    let x = || Axis::new("x (s)");
    let flat = Panel::new(x(), Axis::new("constant (V)")).with(Layer::line(
        "constant",
        Style::Green,
        (0..5).map(|i| (f64::from(i), 3.3)),
    ));
    let one = Panel::new(Axis::new("one x"), Axis::new("one point (Ω)")).with(Layer::points(
        "",
        Style::Purple,
        vec![(1e-7, 2.5e7)],
    ));
    let none = Panel::new(x(), Axis::new("a label that is far too long for its panel (N·m)"))
        .with(Layer::line("nothing", Style::Blue, []))
        .with(Layer::level("upper limit", 1.0))
        .with(Layer::level("lower limit", 0.9));
    let names = ["pulse test", "high frequency injection", "inductance variation"];
    let mut named = Panel::new(Axis::categories("", names.map(String::from)), Axis::new("error (°)"));
    let mut styles = Panel::new(x(), Axis::new("styles"));
    for (index, style) in Style::ALL.into_iter().enumerate() {
        let (y, shift) = (index as f64, (index as f64 - 2.5) * 0.1);
        let points = [0.0, 1.0, 2.0].map(|i| (i + shift, i, i - 0.5, i + 0.8 + shift));
        named =
            named.with(Layer::error_bars(&format!("motor {index} with a rather long name"), style, points));
        let wave = (0..100).map(|i| f64::from(i) / 20.0).map(|t| (t, y + 0.4 * t.sin()));
        styles = styles.with(Layer::line(&format!("{style:?}"), style, wave));
    }
    let subtitle = "A subtitle with more to say than fits in one line: µ Ω ° ± − × · ≤ ≥ √ ² ₀₁₂ αβ γδθψω → — and <tags> & \
                    \"quotes\" must come out as they are";
    chart("awkward", "Awkward cases", subtitle, 1300, vec![flat, styles, none, one, named])
}

/// A small part of a decade, many decades, and a map without a single value.
fn extremes() -> Chart {
    let narrow = Panel::new(Axis::new("part of a decade (A)").log10(), Axis::new("rms error (°)").log10())
        .with(Layer::line("", Style::Green, [(2.0, 1.1), (3.4, 2.3)]));
    let wide = Panel::new(Axis::new("many decades").log10(), Axis::new("probability").log10())
        .with(Layer::line("", Style::Purple, [(1e-20, 1e-12), (1e5, 1.0)]));
    let five = Ticks::Step(5.0);
    let empty = Panel::new(Axis { ticks: five, ..Axis::new("x") }, Axis::new("y")).with(Layer::Heat {
        x_edges: vec![0.0, 10.0, 20.0],
        y_edges: vec![0.0, 1.0],
        values: vec![f64::NAN],
        colour: Axis::new("nothing"),
        blank: "no answer".to_owned(),
        texts: Vec::new(),
    });
    chart("extremes", "Extremes", "", 900, vec![narrow, wide, empty])
}
