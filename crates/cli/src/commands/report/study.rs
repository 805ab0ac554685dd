//! Conversion of a run's results into the data of its figures.

use standstill_campaign::{Summary, binomial_interval};
use standstill_report::study::{Coordinate, Design, ErrorCloud, Study, StudyAxis, StudyPoint};
use standstill_scenario::{AxisSpec, DesignKind};

use crate::results::{FinishedRun, PointSummary};
use crate::shell::setup::setting;
use crate::shell::values::Shown;
use crate::summary::Ranking;

/// Ratio of largest to smallest value above which a positive sweep axis is drawn on a logarithmic scale.
const LONG: f64 = 30.0;

pub fn study(run: &FinishedRun, cloud: ErrorCloud) -> Study {
    let points = &run.summary.points;
    let open = run.summary.run.pole_is_open;
    let shown = Shown::of(points);
    let axes = shown.iter().filter_map(|shown| Some(axis(shown, run.file.axes.get(&shown.key)?, points)));
    let of = run.summary.points.iter().enumerate();
    let ranking = Ranking::of(points.iter().map(|point| &point.summary), open);
    let best = of.min_by(|(_, a), (_, b)| ranking.compare(&a.summary, &b.summary));
    let points = if let Some(whole) = run.summary.whole() {
        vec![point(Vec::new(), whole, open)]
    } else {
        let place = |of: &PointSummary| {
            let values = shown.iter().map(|axis| match of.values.get(&axis.key) {
                Some(serde_json::Value::Number(number)) => {
                    Coordinate::Number(axis.scale.number(number.as_f64().unwrap_or(f64::NAN)))
                }
                Some(serde_json::Value::String(name)) => Coordinate::Name(name.clone()),
                other => Coordinate::Name(other.map_or_else(String::new, ToString::to_string)),
            });
            point(values.collect(), &of.summary, open)
        };
        points.iter().map(place).collect()
    };
    Study {
        title: String::new(),
        subtitle: Some(setting(&run.file)),
        axes: axes.collect(),
        points,
        design: match run.file.design.kind.0 {
            DesignKind::Grid => Design::Grid,
            DesignKind::LatinHypercube | DesignKind::Sobol => Design::Scattered,
        },
        cloud: Some(cloud),
        best: best.map(|(index, _)| index),
        poles_are_judged: !open,
        binomial: binomial_interval,
    }
}

fn axis(shown: &Shown, spec: &AxisSpec, points: &[PointSummary]) -> StudyAxis {
    let numbers = || points.iter().filter_map(|point| point.values.get(&shown.key)?.as_f64());
    let (least, largest) = numbers()
        .fold((f64::INFINITY, 0.0_f64), |(least, largest), value| (least.min(value), largest.max(value)));
    let logarithmic = match spec {
        AxisSpec::Range(range) => range.log,
        AxisSpec::List(_) => least > 0.0 && largest / least > LONG,
    };
    StudyAxis { key: shown.key.clone(), label: String::new(), unit: shown.scale.unit.clone(), logarithmic }
}

/// Converts a sweep point to a point of the figures. `open` is true if only the axis is judged, not the pole.
fn point(coordinates: Vec<Coordinate>, s: &Summary, open: bool) -> StudyPoint {
    let judged = |count: u64| if open { 0 } else { count };
    StudyPoint {
        coordinates,
        trials: s.trials,
        axes: s.axes,
        wrong_poles: judged(s.wrong_poles),
        undetermined: judged(s.undetermined),
        failed: s.failed + s.errors,
        rms_deg: s.rms_deg,
        p50_deg: s.p50_deg,
        p95_deg: s.p95_deg,
        p99_deg: s.p99_deg,
        bias_deg: s.bias_deg,
    }
}
