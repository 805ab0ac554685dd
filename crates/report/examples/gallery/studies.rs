//! Studies, also awkward ones.

use super::noise;
use standstill_report::study::{Coordinate, Design, ErrorCloud, Estimate, Study, StudyAxis, StudyPoint};

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

/// Wilson's interval, which is near enough to the exact one for a picture.
fn binomial(count: u64, total: u64) -> Estimate {
    let (k, n) = (count as f64, total as f64);
    let (p, z) = (k / n, 1.96);
    let middle = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
    let half = z / (1.0 + z * z / n) * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
    Estimate { value: p, low: (middle - half).max(0.0), high: middle + half }
}

fn axis(key: &str, label: &str, unit: &str) -> StudyAxis {
    StudyAxis { key: key.into(), label: label.into(), unit: unit.into(), logarithmic: key == "sensors.noise" }
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
    let interval = |v: f64, r: f64| Estimate { value: v, low: v * (1.0 - r), high: v * (1.0 + r) };
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
        p50_deg: interval(0.67 * value, 1.6 * relative),
        p95_deg: interval(1.96 * value, 1.6 * relative),
        p99_deg: interval(2.58 * value, 3.0 * relative),
        bias_deg: interval(0.1 * rms, 0.1),
    }
}

fn cloud(trials: u32, scale: f64, odds: f64) -> ErrorCloud {
    let mut random = noise(1);
    let mut cloud = ErrorCloud::default();
    for _ in 0..trials {
        let angle = 360.0 * random();
        let spread: f64 = (0..6).map(|_| random() - 0.5).sum();
        let rare = if random() < 0.01 { 4.0 } else { 1.0 };
        let error = scale * (0.5 * (2.0 * angle.to_radians()).sin() + 0.9 * rare * spread);
        cloud.add(angle, Some(error), Some(if random() < odds { error + 180.0 } else { error }));
    }
    cloud
}

fn study(title: &str, axes: Vec<StudyAxis>, points: Vec<StudyPoint>, cloud: Option<ErrorCloud>) -> Study {
    let subtitle = Some("paper's motor, default errors, locked rotor".into());
    Study {
        title: title.into(),
        subtitle,
        axes,
        points,
        design: Design::Grid,
        cloud,
        best: None,
        poles_are_judged: true,
        binomial,
    }
}

/// Methods over noise and dead time, full factorial.
fn grid(methods: usize, noises: u32, dead_times: u32) -> Study {
    let mut random = noise(3);
    let mut points = Vec::new();
    for (index, method) in METHODS.iter().take(methods).enumerate() {
        for (i, j) in (0..noises).flat_map(|i| (0..dead_times).map(move |j| (i, j))) {
            let a = 0.001 * 10f64.powf(3.0 * f64::from(i) / f64::from(noises.max(2) - 1));
            let d = 4.0 * f64::from(j) / f64::from(dead_times.max(2) - 1);
            let rms = (0.02 + 8.0 * a) * (1.0 + 0.2 * d * d) * (0.3 + 0.4 * index as f64);
            let at = vec![Coordinate::Name((*method).into()), Coordinate::Number(a), Coordinate::Number(d)];
            points.push(point(at, rms, 2000, &mut random));
        }
    }
    let axes = vec![
        axis("method.name", "method", ""),
        axis("sensors.noise", "noise of the current sensors, standard deviation", "A"),
        axis("inverter.dead_time", "dead time", "µs"),
    ];
    study("a grid", axes, points, Some(cloud(3000, 1.0, 0.01)))
}

fn scattered() -> Study {
    let mut random = noise(5);
    let keys = [
        "sensors.noise",
        "inverter.dead_time",
        "winding.resistance",
        "rotor.friction",
        "link.sag",
        "adc.bits",
    ];
    let axes = keys.into_iter().chain(["motor"]).map(|key| axis(key, "", "")).collect();
    let at = |i: usize| {
        let u: Vec<f64> = keys.iter().map(|_| random()).collect();
        let mut at: Vec<_> = u.iter().map(|v| Coordinate::Number(*v)).collect();
        at[0] = Coordinate::Number(0.001 * 1000f64.powf(u[0]));
        at.push(Coordinate::Name(["paper", "gearless-hoist", "pm-reluctance"][i % 3].into()));
        point(at, 0.05 * 100f64.powf(u[0]) * (1.0 + u[1]) * (1.0 + (i % 3) as f64), 500, &mut random)
    };
    let points = (0..300).map(at).collect();
    Study { design: Design::Scattered, ..study("a Latin hypercube", axes, points, None) }
}

pub(super) fn all() -> Vec<(&'static str, Study)> {
    let mut random = noise(5);
    let mut at = |x: f64, rms: f64, trials| point(vec![Coordinate::Number(x)], rms, trials, &mut random);
    let dead = (0..9u32)
        .map(|i| at(0.5 * f64::from(i), 0.05 * 1.6f64.powf(f64::from(i)), 2000 + 100 * u64::from(i)));
    let dead = dead.collect();
    let from_zero = [0.0, 0.001, 0.01, 0.1, 1.0].map(|a| at(a, 0.1 + a, 1000)).to_vec();
    let one = vec![at(1.0, 0.3, 100)];
    let x = || vec![axis("x", "", "")];
    vec![
        ("run", study("one run", vec![], vec![], Some(cloud(200_000, 0.01, 1e-4)))),
        ("large_errors", study("a bad method", vec![], vec![], Some(cloud(800, 30.0, 0.3)))),
        ("axis", study("one axis", vec![axis("inverter.dead_time", "dead time", "µs")], dead, None)),
        ("grid", grid(3, 7, 5)),
        ("nine", grid(9, 2, 2)),
        ("fine", grid(1, 40, 40)),
        ("scattered", scattered()),
        ("from_zero", study("noise from zero", vec![axis("sensors.noise", "noise", "A")], from_zero, None)),
        ("one_point", study("one point", x(), one, Some(cloud(1, 1.0, 0.0)))),
        ("nothing", study("", x(), vec![], Some(ErrorCloud::default()))),
    ]
}
