//! Draws the figures of made-up studies, also awkward ones, into the folder given as argument.

use standstill_report::study::{
    Coordinate, Design, ErrorCloud, Interval, Study, StudyAxis, StudyPoint, figures,
};
use std::path::Path;

/// Numbers that scatter evenly from 0 to 1, the same in every run.
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f64 / (1u64 << 24) as f64
    }
}

/// Wilson's interval, which is near enough to the exact one for a picture.
fn binomial(count: u64, total: u64, _points: u64) -> Interval {
    let (k, n) = (count as f64, total as f64);
    let (p, z) = (k / n, 1.96);
    let middle = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
    let half = z / (1.0 + z * z / n) * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
    Interval { value: p, low: (middle - half).max(0.0), high: middle + half }
}

fn axis(key: &str, label: &str, unit: &str, logarithmic: bool) -> StudyAxis {
    StudyAxis { key: key.into(), label: label.into(), unit: unit.into(), logarithmic }
}

/// A point whose errors have this rms, with odds that grow with it.
fn point(
    coordinates: Vec<Coordinate>,
    rms: f64,
    trials: u64,
    random: &mut impl FnMut() -> f64,
) -> StudyPoint {
    let relative = 1.4 / (trials as f64).sqrt();
    let value = rms * (1.0 + relative * (random() - 0.5));
    let interval = |v: f64, r: f64| Interval { value: v, low: v * (1.0 - r), high: v * (1.0 + r) };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of the trials")]
    let mut count = |odds: f64| (odds.min(0.3) * trials as f64 + 0.7 * random()) as u64;
    let (wrong_poles, undetermined, failed) = (count(1e-3 * rms * rms), count(4e-3 * rms), count(1e-4 * rms));
    StudyPoint {
        coordinates,
        trials,
        axes: trials - failed,
        wrong_poles,
        undetermined,
        failed,
        rms_deg: interval(value, relative),
        p95_deg: interval(1.96 * value, 1.6 * relative),
        bias_deg: Interval { value: 0.1 * rms, low: 0.09 * rms, high: 0.11 * rms },
    }
}

fn cloud(trials: u32, scale: f64, odds: f64) -> ErrorCloud {
    let mut random = noise(7);
    let mut cloud = ErrorCloud::new();
    for _ in 0..trials {
        let angle = 360.0 * random();
        let spread: f64 = (0..6).map(|_| random() - 0.5).sum();
        let rare = if random() < 0.01 { 4.0 } else { 1.0 };
        let error = scale * (0.5 * (2.0 * angle.to_radians()).sin() + 0.9 * rare * spread);
        let turned = if random() < odds { error + 180.0 } else { error };
        cloud.add(angle, Some(error), Some(turned));
    }
    cloud
}

const METHODS: [&str; 9] = [
    "line-inductance",
    "line-inductance-fast",
    "subdivision",
    "hfi-rotating",
    "hfi-pulsating",
    "dc-alignment",
    "bipolar",
    "maximum-likelihood",
    "maximum-likelihood-adaptive",
];

fn study(title: &str, axes: Vec<StudyAxis>, points: Vec<StudyPoint>, cloud: Option<ErrorCloud>) -> Study {
    Study {
        title: title.into(),
        subtitle: Some("paper's motor, default errors, locked rotor".into()),
        axes,
        points,
        design: Design::Grid,
        cloud,
        binomial,
    }
}

/// Methods over noise and dead time, full factorial.
fn grid(methods: usize, noises: u32, dead_times: u32) -> Study {
    let mut random = noise(3);
    let mut points = Vec::new();
    for (index, method) in METHODS.iter().take(methods).enumerate() {
        for i in 0..noises {
            for j in 0..dead_times {
                let a = 0.001 * 10f64.powf(3.0 * f64::from(i) / f64::from(noises.max(2) - 1));
                let d = 4.0 * f64::from(j) / f64::from(dead_times.max(2) - 1);
                let rms = (0.02 + 8.0 * a) * (1.0 + 0.2 * d * d) * (0.3 + 0.4 * index as f64);
                let at =
                    vec![Coordinate::Name((*method).into()), Coordinate::Number(a), Coordinate::Number(d)];
                points.push(point(at, rms, 2000, &mut random));
            }
        }
    }
    let axes = vec![
        axis("method.name", "method", "", false),
        axis("sensors.noise", "noise of the current sensors, standard deviation", "A", true),
        axis("inverter.dead_time", "dead time", "µs", false),
    ];
    study("a grid", axes, points, Some(cloud(3000, 1.0, 0.01)))
}

fn studies() -> Vec<(&'static str, Study)> {
    let mut random = noise(5);
    let one_axis = (0..9u32)
        .map(|i| (i, vec![Coordinate::Number(0.5 * f64::from(i))]))
        .map(|(i, at)| point(at, 0.05 * 1.6f64.powf(f64::from(i)), 2000 + 100 * u64::from(i), &mut random))
        .collect();
    let many = [
        "sensors.noise",
        "inverter.dead_time",
        "winding.resistance",
        "rotor.friction",
        "link.sag",
        "adc.bits",
    ];
    let mut scattered = study(
        "a Latin hypercube",
        many.iter()
            .map(|key| axis(key, "", "", *key == "sensors.noise"))
            .chain([axis("motor", "", "", false)])
            .collect(),
        (0..300)
            .map(|i| {
                let u: Vec<f64> = (0..6).map(|_| random()).collect();
                let mut at: Vec<_> = u.iter().map(|v| Coordinate::Number(*v)).collect();
                at[0] = Coordinate::Number(0.001 * 1000f64.powf(u[0]));
                at.push(Coordinate::Name(["paper", "gearless-hoist", "pm-reluctance"][i % 3].into()));
                point(at, 0.05 * 100f64.powf(u[0]) * (1.0 + u[1]) * (1.0 + (i % 3) as f64), 500, &mut random)
            })
            .collect(),
        None,
    );
    scattered.design = Design::Scattered;
    let zero = [0.0, 0.001, 0.01, 0.1, 1.0];
    let from_zero = zero.map(|a| point(vec![Coordinate::Number(a)], 0.1 + a, 1000, &mut random)).to_vec();
    let same = point(vec![Coordinate::Number(1.0)], 0.3, 100, &mut random);
    vec![
        ("run", study("one run", vec![], vec![], Some(cloud(200_000, 0.01, 1e-4)))),
        ("large_errors", study("a bad method", vec![], vec![], Some(cloud(800, 30.0, 0.3)))),
        (
            "axis",
            study("three motors", vec![axis("inverter.dead_time", "dead time", "µs", false)], one_axis, None),
        ),
        ("grid", grid(3, 7, 5)),
        ("nine", grid(9, 2, 2)),
        ("fine", grid(1, 40, 40)),
        ("small", grid(1, 2, 2)),
        ("scattered", scattered),
        (
            "from_zero",
            study("noise from zero", vec![axis("sensors.noise", "noise", "A", true)], from_zero, None),
        ),
        (
            "one_point",
            study("one point", vec![axis("x", "", "", false)], vec![same], Some(cloud(1, 1.0, 0.0))),
        ),
        ("nothing", study("", vec![axis("x", "", "", false)], vec![], Some(ErrorCloud::new()))),
    ]
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).ok_or("usage: study FOLDER")?;
    std::fs::create_dir_all(&folder)?;
    for (name, study) in studies() {
        for (figure_name, figure) in figures(&study) {
            let stem = Path::new(&folder).join(format!("{name}-{figure_name}"));
            std::fs::write(format!("{}.svg", stem.display()), figure.svg()?)?;
            std::fs::write(format!("{}.png", stem.display()), figure.png()?)?;
            println!("{}", stem.display());
        }
    }
    Ok(())
}
