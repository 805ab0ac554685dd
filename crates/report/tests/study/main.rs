//! Figures of studies: which points they show, what is kept of the trials, and which figures there are.

mod clouds;
mod points;

use standstill_report::figure::{Axis, AxisScale, Figure, Layer, Panel, cell_edges};
use standstill_report::study::{
    Coordinate, Design, ErrorCloud, Estimate, Study, StudyAxis, StudyPoint, figures,
};

fn interval(value: f64, half: f64) -> Estimate {
    Estimate { value, low: value - half, high: value + half }
}

fn point(coordinates: Vec<Coordinate>, rms: Estimate, trials: u64, wrong_poles: u64) -> StudyPoint {
    StudyPoint {
        coordinates,
        trials,
        axes: trials,
        wrong_poles,
        undetermined: 0,
        failed: 0,
        rms_deg: rms,
        p50_deg: Estimate { value: 0.7 * rms.value, ..Estimate::UNKNOWN },
        p95_deg: Estimate { value: 2.0 * rms.value, ..Estimate::UNKNOWN },
        p99_deg: Estimate { value: 2.6 * rms.value, ..Estimate::UNKNOWN },
        bias_deg: Estimate::UNKNOWN,
    }
}

fn study(keys: &[&str], points: Vec<StudyPoint>) -> Study {
    let axis = |key: &&str| StudyAxis {
        key: (*key).into(),
        label: String::new(),
        unit: String::new(),
        logarithmic: *key == "noise",
    };
    Study {
        title: "test".into(),
        subtitle: None,
        axes: keys.iter().map(axis).collect(),
        points,
        design: Design::Grid,
        cloud: None,
        best: None,
        poles_are_judged: true,
        binomial: |count, total| interval(count as f64 / total as f64, 0.01),
    }
}

fn number(value: f64) -> Coordinate {
    Coordinate::Number(value)
}

fn grid() -> Study {
    let mut points = Vec::new();
    for method in ["bipolar", "subdivision"] {
        for noise in [0.01, 0.1, 1.0] {
            for dead in [0.0, 1.0] {
                let at = vec![Coordinate::Name(method.into()), number(noise), number(dead)];
                points.push(point(at, interval(noise * (1.0 + dead), 0.1 * noise), 1000, 3));
            }
        }
    }
    study(&["method", "noise", "dead/time"], points)
}

#[test]
fn law_figures_follow_from_the_axes() {
    let names = |study: &Study| figures(study).into_iter().map(|(name, _)| name).collect::<Vec<_>>();
    assert_eq!(
        names(&grid()),
        [
            "sweep_method",
            "wrong_poles_method",
            "sweep_noise",
            "wrong_poles_noise",
            "sweep_dead_time",
            "wrong_poles_dead_time",
            "heat_noise_dead_time",
            "heat_method_noise",
            "heat_method_dead_time"
        ]
    );
    let scattered = Study { design: Design::Scattered, ..grid() };
    assert_eq!(names(&scattered), ["scatter"]);
    let alone = |p: &&StudyPoint| p.coordinates[1] == number(0.1) && p.coordinates[2] == number(1.0);
    let alone = Study { points: grid().points.iter().filter(alone).cloned().collect(), ..grid() };
    assert_eq!(names(&alone), ["methods"]);
    let mut cloud = ErrorCloud::default();
    let all = point(Vec::new(), interval(1.0, 0.1), 1000, 0);
    let run = |cloud: &ErrorCloud| Study { cloud: Some(cloud.clone()), ..study(&[], vec![all.clone()]) };
    // No start found an axis: nothing to draw.
    cloud.add(10.0, None, None);
    assert_eq!(names(&run(&cloud)), [""; 0]);
    cloud.add(10.0, Some(0.1), Some(0.1));
    assert_eq!(names(&run(&cloud)), ["error_over_angle", "distribution"]);
}

#[test]
fn law_a_sweep_reaches_the_points_that_fail_and_hatches_them() {
    let failed = |x: f64, share: u64, rms: Estimate| {
        let mut point = point(vec![number(x)], rms, 100, 0);
        (point.failed, point.axes) = (share, 100 - share);
        point
    };
    let some = interval(1.0, 0.1);
    let points = |last: Estimate| {
        let all = [(1.0, 0, some), (2.0, 1, some), (3.0, 2, some), (4.0, 100, last)];
        study(&["x"], all.into_iter().map(|(x, share, rms)| failed(x, share, rms)).collect())
    };
    let all = figures(&points(Estimate::UNKNOWN));
    let find = |name: &str| all.iter().find(|(other, _)| other == name).map(|(_, figure)| figure);
    let sweep = find("sweep_x").expect("a sweep");
    let Layer::Hatched { spans, label } = &sweep.panels[0].layers[0] else { panic!("strips") };
    assert!(label.as_ref().is_some_and(|label| label.contains("more than 1 %")));
    // Half way to the neighbours, and to the end beyond the last; 1 of 100 is not more than 1 %.
    assert_eq!(spans, &[(2.5, 3.5), (3.5, f64::INFINITY)]);
    // The one with 2 % is a ring, which no line reaches; the one without any answer has no mark.
    let line = sweep.panels[0].layers.iter().find_map(|layer| match layer {
        Layer::Line { points, .. } => Some(points.iter().map(|p| p.1.is_finite()).collect::<Vec<_>>()),
        _ => None,
    });
    assert_eq!(line, Some(vec![true, true, false, false]));
    let marks = |layer: &Layer| match layer {
        Layer::ErrorBars { points, .. } => Some((false, points.clone())),
        Layer::Hollow { points, .. } => Some((true, points.clone())),
        _ => None,
    };
    let marks: Vec<_> = sweep.panels[0].layers.iter().filter_map(marks).collect();
    let at = |points: &[(f64, f64, f64, f64)]| {
        points.iter().filter(|p| p.1.is_finite()).map(|p| p.0).collect::<Vec<_>>()
    };
    let marks: Vec<_> = marks.iter().map(|(hollow, points)| (*hollow, at(points))).collect();
    // Of the rms; the percentile has the same.
    assert_eq!(marks[..2], [(false, vec![1.0, 2.0]), (true, vec![3.0])]);
    let svg = sweep.svg().expect("drawn");
    assert!(svg.contains(">4<"), "{svg}");
    // No pole was wrong, and where none was named, none is said to be right: failures alone have a panel.
    let odds = find("wrong_poles_x").expect("odds");
    assert_eq!(odds.panels.len(), 1);
    assert!(odds.panels[0].y.label.starts_with("failed"), "{}", odds.panels[0].y.label);
    // Nothing fails: nothing is hatched. Nothing is found: no figure of errors, none of wrong poles.
    let fine = study(&["x"], (1..4).map(|x| failed(f64::from(x), 0, some)).collect());
    let layers = |study: &Study| figures(study)[0].1.panels[0].layers.clone();
    assert!(!layers(&fine).iter().any(|layer| matches!(layer, Layer::Hatched { .. })));
    let none = study(&["x"], (1..4).map(|x| failed(f64::from(x), 100, Estimate::UNKNOWN)).collect());
    let all = figures(&none);
    assert_eq!(all.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["wrong_poles_x"]);
    let svg = all[0].1.svg().expect("drawn");
    assert!(svg.contains("no pole was named") && !svg.contains("wrong pole (%)"), "{svg}");
}

#[test]
fn law_equal_studies_give_equal_files() {
    for ((name, a), (_, b)) in figures(&grid()).into_iter().zip(figures(&grid())) {
        // Debug, because gaps are not equal to themselves.
        assert_eq!(format!("{a:?}"), format!("{b:?}"), "{name}");
        assert_eq!(a.svg(), b.svg(), "{name}");
    }
}

#[test]
fn law_missing_combinations_are_cells_without_value() {
    let mut study = grid();
    study.points.retain(|p| p.coordinates[1] != number(1.0) || p.coordinates[2] != number(1.0));
    let (_, map) = figures(&study).into_iter().find(|(name, _)| name == "heat_noise_dead_time").unwrap();
    let Layer::Heat { values, x_edges, .. } = &map.panels[0].layers[0] else { panic!("a heat map") };
    assert_eq!((values.len(), x_edges.len()), (6, 4));
    assert_eq!(
        values.iter().map(|v| v.is_nan()).collect::<Vec<_>>(),
        [false, false, false, false, false, true]
    );
    assert!(map.svg().unwrap().contains(">not run<"));
    let (_, whole) = figures(&grid()).into_iter().find(|(name, _)| name == "heat_noise_dead_time").unwrap();
    assert!(!whole.svg().unwrap().contains("not run"));
}

#[test]
fn law_points_that_fail_too_often_are_hatched_and_sweeps_pool_no_trials() {
    let mut study = grid();
    for point in study.points.iter_mut().filter(|p| p.coordinates[1] == number(0.01)) {
        (point.wrong_poles, point.undetermined) = (0, 11);
    }
    let mut cloud = ErrorCloud::default();
    cloud.add(10.0, Some(0.1), Some(0.1));
    study.cloud = Some(cloud);
    let all = figures(&study);
    let (_, map) = all.iter().find(|(name, _)| name == "heat_noise_dead_time").expect("a map");
    let Layer::Heat { values, .. } = &map.panels[0].layers[0] else { panic!("a heat map") };
    // The smallest errors, but of starts of which 1.1 % have no answer.
    assert_eq!(
        values.iter().map(|v| v.is_nan()).collect::<Vec<_>>(),
        [true, false, false, true, false, false]
    );
    assert!(map.svg().unwrap().contains(">more than 1 % without a right answer<"));
    assert!(all.iter().all(|(name, _)| name != "error_over_angle" && name != "distribution"));
    // Where all fail, the map has no value at all, and says why.
    for point in &mut study.points {
        (point.wrong_poles, point.undetermined) = (0, 11);
    }
    let all = figures(&study);
    let (_, map) = all.iter().find(|(name, _)| name == "heat_noise_dead_time").expect("a map");
    let Layer::Heat { values, .. } = &map.panels[0].layers[0] else { panic!("a heat map") };
    assert!(!values.is_empty() && values.iter().all(|value| value.is_nan()));
    assert!(map.subtitle.as_ref().is_some_and(|text| text.contains("every cell hatched")));
    assert!(map.svg().unwrap().contains(">more than 1 % without a right answer<"));
}

#[test]
fn law_a_count_of_zero_is_an_upper_limit_and_limits_alone_have_no_figure() {
    let point = |i: u32, wrong| point(vec![number(f64::from(i))], interval(1.0, 0.1), 500, wrong);
    let all = figures(&study(&["x"], (1..4).map(|i| point(i, u64::from(i == 2))).collect()));
    let (_, odds) = all.iter().find(|(name, _)| name == "wrong_poles_x").unwrap();
    let svg = odds.svg().unwrap();
    assert!(svg.contains("none in 500: upper limit") && svg.contains("undetermined: none"), "{svg}");
    let limits = odds.panels[0].layers.iter().find_map(|layer| match layer {
        Layer::UpperLimits { points, .. } => Some(points.clone()),
        _ => None,
    });
    assert_eq!(limits.unwrap(), [(1.0, 1.0), (3.0, 1.0)]);
    // What was never seen says nothing over an axis: a sentence has it.
    let all = figures(&study(&["x"], (1..4).map(|i| point(i, 0)).collect()));
    assert_eq!(all.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["sweep_x"]);
    let said = all[0].1.subtitle.clone().unwrap();
    assert_eq!(said, "wrong pole, undetermined, failed: each none, at most 1.00 % a point");
}

#[test]
fn regress_no_pole_is_wrong_where_poles_are_not_judged() {
    // As commands make it of a map that leaves the pole open: neither wrong nor undetermined.
    let points = |failed| {
        let point = move |i: u32| StudyPoint {
            failed,
            ..point(vec![number(f64::from(i))], interval(1.0, 0.1), 500, 0)
        };
        (1..4).map(point).collect()
    };
    let open = |failed| figures(&Study { poles_are_judged: false, ..study(&["x"], points(failed)) });
    let text =
        |figures: &[(String, Figure)]| figures.iter().map(|(_, f)| f.svg().unwrap()).collect::<String>();
    let fine = open(0);
    assert_eq!(fine.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["sweep_x"]);
    assert!(!text(&fine).contains("pole") && text(&fine).contains("failed: none"), "{}", text(&fine));
    let some = text(&open(50));
    assert!(some.contains("more than 1 % without an axis") && !some.contains("wrong pole"), "{some}");
}

#[test]
fn regress_awkward_studies_are_drawn() {
    let nan = Estimate::UNKNOWN;
    let unknown = (0..3).map(|i| point(vec![number(f64::from(i))], nan, 0, 0)).collect();
    let zero = (0..3).map(|i| point(vec![number(f64::from(i))], interval(0.0, 0.0), 10, 10)).collect();
    let mixed = vec![
        point(vec![number(f64::NAN), Coordinate::Name("a".into())], interval(1.0, 0.1), 1, 0),
        point(vec![Coordinate::Name("b".into())], interval(1.0, 0.1), 1, 1),
    ];
    let mut one = ErrorCloud::default();
    one.add(0.0, Some(0.0), Some(180.0));
    for study in [
        study(&["noise"], unknown),
        study(&["noise"], zero),
        study(&["noise", "x"], mixed),
        Study { cloud: Some(one), ..study(&["noise"], vec![]) },
        Study { cloud: Some(ErrorCloud::default()), design: Design::Scattered, ..grid() },
    ] {
        for (_, figure) in figures(&study) {
            figure.svg().unwrap();
            figure.png().unwrap();
        }
    }
}

#[test]
fn regress_cells_and_marks_have_no_digits_beyond_their_intervals() {
    let at = |x: f64, y: f64, rms: Estimate| {
        point(vec![Coordinate::Number(x), Coordinate::Number(y)], rms, 1000, 0)
    };
    let points = vec![
        at(1.0, 1.0, interval(0.752, 0.023)),
        at(2.0, 1.0, interval(0.752, 0.4)),
        at(1.0, 2.0, interval(14.23, 0.4)),
        at(2.0, 2.0, interval(7.52, 1.2)),
    ];
    let all = figures(&study(&["x", "y"], points));
    let heat = &all.iter().find(|(name, _)| name.starts_with("heat_")).expect("a map").1;
    let Layer::Heat { texts, .. } = &heat.panels[0].layers[0] else { panic!("{heat:?}") };
    assert_eq!(texts[..], ["0.752", "0.8", "14.2", "7.5"]);
    // One run: the figure's marks are the table's.
    let mut cloud = ErrorCloud::default();
    (0..1000).for_each(|k| cloud.add(f64::from(k) * 0.36, Some((f64::from(k) * 0.7).sin()), None));
    let one =
        Study { cloud: Some(cloud), ..study(&[], vec![point(Vec::new(), interval(0.404, 0.04), 1000, 0)]) };
    let all = figures(&one);
    let svg = all.iter().find(|(name, _)| name == "distribution").expect("a figure").1.svg().expect("drawn");
    assert!(svg.contains("rms 0.40°") && svg.contains("p95 0.81°"), "{svg}");
}

#[test]
fn law_cells_reach_half_way_to_their_neighbours() {
    assert_eq!(cell_edges(&[0.0, 1.0, 3.0], AxisScale::Linear), [-0.5, 0.5, 2.0, 4.0]);
    let log = cell_edges(&[1.0, 4.0], AxisScale::Log10);
    assert!(log.iter().zip([0.5, 2.0, 8.0]).all(|(a, b)| (a - b).abs() < 1e-12), "{log:?}");
    assert_eq!(cell_edges(&[], AxisScale::Linear), [0.0; 0]);
}

#[test]
fn law_awkward_maps_and_logarithms_are_drawn() {
    let heat = |x_edges: Vec<f64>, values: Vec<f64>| Layer::Heat {
        x_edges,
        y_edges: vec![1.0, 2.0],
        values,
        colour: Axis::new("value").log10(),
        blank: String::new(),
        texts: vec!["1".to_owned(); 2],
    };
    let log = || Panel::new(Axis::new("x").log10().range(-1.0, 1.0), Axis::new("y").log10());
    let panels = vec![
        log().with(heat(vec![0.0, 1.0, 2.0], vec![0.0, -1.0])),
        log().with(heat(vec![f64::NAN, 1.0, 1.0, 0.5], vec![f64::INFINITY])),
        log().with(heat(vec![], vec![1.0])),
        log().with(Layer::HorizontalRule { label: Some("nowhere".into()), y: 0.0 }),
    ];
    let drawn = Figure { title: String::new(), subtitle: None, width: 400, height: 900, panels };
    assert_eq!(drawn.svg(), drawn.svg());
    drawn.png().unwrap();
}
