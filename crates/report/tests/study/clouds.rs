//! Clouds of errors: their bands over the angle, their quantiles, and how much of them is kept.

use standstill_report::figure::Layer;
use standstill_report::study::{ErrorCloud, Study, Thinned, figures};

use super::study;

#[test]
fn law_bands_are_of_bins_with_starts_enough() {
    let of = |starts: u32| {
        let mut cloud = ErrorCloud::default();
        for k in 0..starts {
            cloud.add(f64::from(k) * 360.0 / f64::from(starts), Some(f64::from(k % 7)), None);
        }
        cloud.angle_quantiles([0.5]).len()
    };
    // 40 in each bin of 5°; then of 10°; below, a smooth curve is drawn.
    assert_eq!([2880, 2879, 1440, 1439].map(of), [72, 36, 36, 0]);
}

#[test]
fn analytic_an_error_of_six_periods_is_drawn_in_its_size_and_closes_at_360_degrees() {
    for starts in [104u32, 479, 480, 720, 1439, 1440, 2880, 30_000] {
        let mut cloud = ErrorCloud::default();
        for k in 0..starts {
            let angle = (f64::from(k) + 0.5) * 360.0 / f64::from(starts);
            // A spread of its own, of nine values from −0.1 to 0.1.
            let spread = 0.025 * f64::from(k * 4 % 9) - 0.1;
            cloud.add(angle, Some((6.0 * angle + 60.0).to_radians().sin() + spread), None);
        }
        let all = figures(&Study { cloud: Some(cloud), ..study(&[], vec![]) });
        let (_, figure) = all.iter().find(|(name, _)| name == "error_over_angle").expect("a figure");
        let layers = &figure.panels[0].layers;
        let curve = layers.iter().find_map(|layer| match layer {
            Layer::Line { points, .. } => Some(points.clone()),
            _ => None,
        });
        let curve = curve.expect("a curve");
        let (least, most) =
            curve.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), (_, y)| (a.min(*y), b.max(*y)));
        // sin of a third of 3π/… over 10° keeps 95 %, less what the bins' places miss of the top.
        assert!(most - least > 1.86 && most - least < 2.1, "{starts}: {least} to {most}");
        assert_eq!((curve[0].0, curve[curve.len() - 1].0), (0.0, 360.0));
        for layer in layers {
            let Layer::Band { points, .. } = layer else { continue };
            let (first, last) = (points[0], points[points.len() - 1]);
            assert_eq!((first.0, last.0), (0.0, 360.0));
            assert!((first.1 - last.1).abs() < 1e-9 && (first.2 - last.2).abs() < 1e-9, "{starts}");
        }
        assert!((curve[0].1 - curve[curve.len() - 1].1).abs() < 1e-9);
    }
}

#[test]
fn law_thinning_keeps_every_nth_in_bounded_memory() {
    let mut thinned = Thinned::new(100);
    (0..10_000u32).for_each(|i| thinned.push(i));
    assert_eq!((thinned.every(), thinned.seen()), (128, 10_000));
    assert!(thinned.kept().iter().enumerate().all(|(k, value)| *value == 128 * u32::try_from(k).unwrap()));
    assert_eq!(thinned.kept().len(), 79);
}

#[test]
fn analytic_quantiles_of_a_uniform_error() {
    for scale in [0.001, 30.0] {
        let mut cloud = ErrorCloud::default();
        for i in 0..400_000u32 {
            // Two sequences that fill the square evenly.
            let (u, v) = ((f64::from(i) * 0.754_877_666).fract(), (f64::from(i) * 0.569_840_291).fract());
            cloud.add(360.0 * u, Some(scale * (2.0 * v - 1.0)), None);
        }
        let bins = cloud.angle_quantiles([0.05, 0.5, 0.95]);
        assert_eq!(bins.len(), 72);
        for (angle, found) in bins {
            for (value, exact) in found.into_iter().zip([-0.9, 0.0, 0.9]) {
                assert!((value / scale - exact).abs() < 0.1, "{angle}: {value}");
            }
        }
        // Nothing grows with the trials.
        assert!(cloud.points().kept().len() <= 4000 && cloud.signed().kept().len() <= 20_000);
        let exceedance = cloud.exceedance();
        assert!(exceedance.len() <= 3073 && exceedance.is_sorted_by(|a, b| a.0 <= b.0 && a.1 >= b.1));
    }
}

#[test]
fn law_wrong_poles_do_not_blow_the_scale() {
    let mut cloud = ErrorCloud::default();
    for i in 0..1000u32 {
        let error = 0.01 * f64::from(i % 7);
        cloud.add(f64::from(i), Some(error), Some(if i % 100 == 0 { error - 180.0 } else { error }));
    }
    cloud.add(1.0, None, None);
    cloud.add(f64::NAN, Some(f64::NAN), None);
    assert_eq!((cloud.trials(), cloud.axes(), cloud.wrong_poles()), (1002, 1000, 10));
    let run = Study { cloud: Some(cloud), ..study(&[], vec![]) };
    let (_, figure) = &figures(&run)[0];
    assert!(figure.panels[0].y.range.unwrap().1 < 0.2);
    assert!(figure.svg().unwrap().contains("wrong pole, 10 in all"));
}
