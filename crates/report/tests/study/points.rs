//! Which points the figures of a sweep show.

use standstill_report::figure::{Figure, Layer};
use standstill_report::study::{Coordinate, Study, figures};

use super::{grid, interval, number, point, study};

/// A figure's marks and cells: panel, title, legend, x, value.
fn marks(figure: &Figure) -> Vec<(usize, String, String, f64, f64)> {
    let mut all = Vec::new();
    for (index, panel) in figure.panels.iter().enumerate() {
        for layer in &panel.layers {
            let (Layer::ErrorBars { label, points, .. } | Layer::Hollow { label, points, .. }) = layer else {
                continue;
            };
            let label = label.clone().unwrap_or_default();
            let known = points.iter().filter(|point| point.1.is_finite());
            all.extend(known.map(|point| (index, panel.title.clone(), label.clone(), point.0, point.1)));
        }
    }
    all
}

fn find<'a>(all: &'a [(String, Figure)], name: &str) -> &'a Figure {
    &all.iter().find(|(other, _)| other == name).unwrap_or_else(|| panic!("{name}")).1
}

#[test]
fn law_each_mark_of_a_sweep_is_one_point_and_none_is_pooled() {
    let study = grid();
    let all = figures(&study);
    // A curve for each method, a panel for each dead time, and all points in them.
    let shown = marks(find(&all, "sweep_noise"));
    assert_eq!(shown.len(), study.points.len());
    for point in &study.points {
        let [Coordinate::Name(method), Coordinate::Number(noise), Coordinate::Number(dead)] =
            &point.coordinates[..]
        else {
            panic!("three coordinates")
        };
        let own = |(_, title, label, x, value): &&(usize, String, String, f64, f64)| {
            label == method
                && title == &format!("dead/time = {dead}")
                && (x / noise - 1.0).abs() < 0.2
                && *value == point.rms_deg.value
        };
        assert_eq!(shown.iter().filter(own).count(), 1, "{point:?}");
    }
    let odds = find(&all, "wrong_poles_noise");
    assert!(marks(odds).iter().all(|mark| (mark.4 - 0.3).abs() < 1e-12), "3 in 1000 at each point");
    let map = find(&all, "heat_noise_dead_time");
    let titles: Vec<&str> = map.panels.iter().map(|panel| panel.title.as_str()).collect();
    assert_eq!(titles, ["bipolar", "subdivision"]);
    let ranges = map.panels.iter().map(|panel| match &panel.layers[0] {
        Layer::Heat { colour, .. } => colour.range,
        _ => None,
    });
    assert!(ranges.clone().all(|range| range == Some((0.01, 2.0))), "one scale of colours");
    for (name, figure) in &all {
        let said = figure.subtitle.clone().unwrap_or_default() + &figure.title;
        assert!(!said.contains("pooled"), "{name}: {said}");
    }
}

#[test]
fn law_what_a_figure_cannot_show_stands_as_at_the_best_point_or_in_steps_and_it_says_so() {
    // Four axes of numbers: curves, panels, and the fourth as at the best point.
    let mut points = Vec::new();
    for a in 0..9 {
        for b in 0..3 {
            for c in 0..2 {
                for d in 0..10 {
                    let at = [a, b, c, d].map(|k| number(f64::from(k)));
                    points.push(point(at.to_vec(), interval(1.0 + f64::from(d), 0.1), 100, 0));
                }
            }
        }
    }
    let best = points.iter().position(|point| point.coordinates[3] == number(7.0));
    let study = Study { best, ..study(&["a", "b", "c", "d"], points) };
    let all = figures(&study);
    let over = find(&all, "sweep_a");
    assert!(over.subtitle.as_deref().is_some_and(|said| said.starts_with("d = 7, as at the best point")));
    assert!(marks(over).iter().all(|mark| mark.4 == 8.0), "of d = 7 alone");
    assert_eq!((over.panels.len(), marks(over).len()), (3, 9 * 2 * 3));
    // Of two axes, one curve for each value up to six.
    let few =
        study.points.iter().filter(|p| p.coordinates[1] == number(0.0) && p.coordinates[2] == number(0.0));
    let few = Study { points: few.cloned().collect(), best: None, ..study.clone() };
    let all = figures(&few);
    let over = find(&all, "sweep_a");
    assert!(over.subtitle.as_deref().is_some_and(|said| said.starts_with("6 of 10 values of d")));
    let rms: Vec<f64> =
        marks(over).iter().filter(|mark| mark.0 == 0 && mark.3.abs() < 0.2).map(|mark| mark.4).collect();
    assert_eq!(rms, [1.0, 3.0, 5.0, 6.0, 8.0, 10.0], "the ends among them");
    let Layer::Heat { values, .. } = &find(&all, "heat_a_d").panels[0].layers[0] else { panic!("a map") };
    assert_eq!(values.len(), 90, "the map has all");
    // Names all have a curve, in two panels of equal size.
    let names = |k: i32| Coordinate::Name(format!("m{k}"));
    let named = (0..9).flat_map(|k| (0..3).map(move |x| (k, x)));
    let named = named.map(|(k, x)| point(vec![names(k), number(f64::from(x))], interval(1.0, 0.1), 100, 0));
    let all = figures(&super::study(&["method", "x"], named.collect()));
    let over = find(&all, "sweep_x");
    assert_eq!(
        marks(over).iter().filter(|mark| mark.3.abs() < 0.2).map(|mark| mark.0).collect::<Vec<_>>(),
        [0, 0, 0, 0, 0, 1, 1, 1, 1]
    );
}

#[test]
fn law_curves_that_fail_are_hollow_and_hatched_where_all_do() {
    let mut points = Vec::new();
    for x in 0..4 {
        for y in 0..2 {
            let mut point =
                point(vec![number(f64::from(x)), number(f64::from(y))], interval(1.0, 0.1), 100, 0);
            point.failed = if x + y > 2 { 5 } else { 0 };
            points.push(point);
        }
    }
    let all = figures(&study(&["x", "y"], points));
    let panel = &find(&all, "sweep_x").panels[0];
    let Layer::Hatched { label, spans } = &panel.layers[0] else { panic!("strips") };
    assert!(label.as_ref().is_some_and(|label| label.starts_with("hollow: more than 1 %")));
    // Of y = 1 from x = 2 on, of y = 0 from x = 3 on; the last strip reaches the end.
    assert_eq!(spans, &[(2.5, f64::INFINITY)]);
    let hollow = panel.layers.iter().filter_map(|layer| match layer {
        Layer::Hollow { points, label, .. } => {
            Some((label.clone()?, points.iter().map(|p| p.0.round()).collect::<Vec<_>>()))
        }
        _ => None,
    });
    assert_eq!(
        hollow.collect::<Vec<_>>(),
        [("y = 0".to_owned(), vec![3.0]), ("y = 1".to_owned(), vec![2.0, 3.0])]
    );
}
