use super::*;

fn said(degrees: f64, deviation: f64) -> Said<f64> {
    let (l_a, l_b) = (9.2e-3, -2.1e-3);
    let third = core::f64::consts::TAU / 3.0;
    let line = |shift: f64| 3.0 * l_a - 3.0 * l_b * (2.0 * degrees.to_radians() + shift).cos();
    // Equal and independent variances v of the lines give the axis v/(54 L_B²).
    let of_line = deviation * deviation * 54.0 * l_b * l_b;
    Said {
        lines: [line(-third), line(0.0), line(third)],
        variance: deviation * deviation,
        covariance: core::array::from_fn(|k| core::array::from_fn(|l| if k == l { of_line } else { 0.0 })),
        shift: [0.0; 3],
        ratios: [0.01, 0.0, -0.01],
        ratio_noise: [1e-5; 3],
        direction: AlphaBeta::new(1e-4, 0.0),
        noise: 1e-10,
        floor: 1e-6,
        instants: [0.0; 3],
    }
}

/// Variance in rad² of the axis of all trains.
fn variance(all: &Combined<f64>) -> f64 {
    let sign = SaliencySign::Negative;
    Saliency::from_lines(Abc(all.lines), sign).axis_variance(&all.covariance(), sign)
}

fn combined(trains: &[Said<f64>]) -> Combined<f64> {
    let mut combined = Combined::new();
    for train in trains {
        combined.add(train);
    }
    combined
}

#[test]
fn analytic_trains_weigh_by_their_information() {
    let (short, long) = (said(50.0, 0.02), said(50.2, 0.01));
    let both = combined(&[short, long]);
    assert!((variance(&both) / 0.8e-4 - 1.0).abs() < 1e-3);
    assert!(variance(&both) < long.variance);
    for k in 0..3 {
        assert!((both.lines[k] - (0.2 * short.lines[k] + 0.8 * long.lines[k])).abs() < 1e-15);
    }
    let one = combined(&[long]);
    assert_eq!((one.lines, one.trains), (long.lines, 1));
    assert!((variance(&one) / 1e-4 - 1.0).abs() < 1e-9);
}

#[test]
fn analytic_what_is_known_of_the_gains_counts_once() {
    let prior: f64 = 2.0 * 0.005 * 0.005;
    for n in [1_u8, 2, 8] {
        let (ratios, variances) = {
            let mut all = Combined::new();
            (0..n).for_each(|_| all.add(&said(50.0, 0.01)));
            all.ratios(0.005)
        };
        let noise = 1e-5 / f64::from(n);
        assert!((ratios[0] - 0.01 * prior / (prior + noise)).abs() < 1e-12, "{n}");
        assert!((variances[0] / (prior * noise / (prior + noise)) - 1.0).abs() < 1e-9, "{n}");
    }
    assert_eq!(combined(&[said(50.0, 0.01)]).ratios(0.0), ([0.0; 3], [0.0; 3]));
    // The second of two trains alone has compared the sensors of this line.
    let nothing = Said { ratio_noise: [f64::INFINITY; 3], ratios: [0.0; 3], ..said(50.0, 0.01) };
    let (ratios, _) = combined(&[nothing, said(50.0, 0.01)]).ratios(1.0);
    assert!((ratios[0] - 0.01).abs() < 1e-6);
    assert_eq!(combined(&[nothing]).ratios(0.01).0, [0.0; 3]);
}

#[test]
fn analytic_a_specimens_own_lag_does_not_average_out() {
    let shift = 1e-5;
    let lagging = Said { shift: [shift, 0.0, 0.0], ..said(50.0, 0.01) };
    for n in [1_u8, 2, 8] {
        let mut all = Combined::new();
        (0..n).for_each(|_| all.add(&lagging));
        let [[first, ..], [_, second, _], _] = all.covariance();
        assert!((second / (lagging.covariance[1][1] / f64::from(n)) - 1.0).abs() < 1e-12, "{n}");
        assert!(((first - second) / (shift * shift) - 1.0).abs() < 1e-9, "{n}");
    }
}

#[test]
fn analytic_noise_of_a_pole_averages_out_and_its_floor_does_not() {
    for n in [1_u8, 2, 8] {
        let mut all = Combined::new();
        (0..n).for_each(|_| all.add(&said(50.0, 0.01)));
        let pointer = all.pointer();
        assert!((pointer.direction.alpha - 1e-4).abs() < 1e-18);
        let expected = (1e-10 / f64::from(n) + 1e-12_f64).sqrt();
        assert!((pointer.deviation / expected - 1.0).abs() < 1e-9, "{n}: {} {expected}", pointer.deviation);
    }
    // The more certain of two has more of both.
    let sure = Said { noise: 0.0, direction: AlphaBeta::new(0.9e-4, 0.0), ..said(50.0, 0.01) };
    let pointer = combined(&[said(50.0, 0.01), sure]).pointer();
    assert!((pointer.direction.alpha - 0.9e-4).abs() < 0.02e-4 && pointer.deviation < 1.5e-6);
}

#[test]
fn analytic_trains_that_contradict_each_other_become_less_certain() {
    let with = |alpha: f64, beta: f64| Said { direction: AlphaBeta::new(alpha, beta), ..said(50.0, 0.01) };
    let agree = combined(&[with(1e-4, 0.0), with(1.1e-4, 0.0)]).pointer();
    let apart = combined(&[with(1e-4, 0.0), with(0.0, 1e-4)]).pointer();
    // χ² = |difference|² / (2 variance) with 2 degrees of freedom.
    let chi_square: f64 = 2e-8 / (2.0 * (1e-10 + 1e-12));
    assert!((apart.deviation / agree.deviation - (chi_square / 2.0).sqrt()).abs() < 1e-9);
    // With three: 4 degrees of freedom, each is away from the mean by 1/√3 of the sides of a triangle.
    let three = combined(&[with(1e-4, 0.0), with(-0.5e-4, 0.866_025_4e-4), with(-0.5e-4, -0.866_025_4e-4)]);
    let alike = combined(&[with(1e-4, 0.0); 3]).pointer();
    let chi_square = 3.0 * 1e-8 / (1e-10 + 1e-12);
    let ratio = three.pointer().deviation / alike.deviation;
    assert!((ratio - (chi_square / 4.0_f64).sqrt()).abs() < 1e-6, "{ratio}");
}

#[test]
fn law_a_rotor_that_moved_is_a_fault() {
    let before = combined(&[said(179.5, 0.001)]);
    let axis = |degrees: f64| Angle::from_degrees(degrees);
    let check = |degrees: f64, deviation: f64| {
        let mut margin = Margin::new();
        let checked =
            before.check_movement(&mut margin, axis(degrees), deviation * deviation, SaliencySign::Negative);
        // Its margin says what it said.
        assert!(
            degrees.is_nan() || margin.smallest().is_none_or(|margin| (margin >= 0.0) == checked.is_ok())
        );
        checked
    };
    // 0.57° and four standard deviations of both, 0.32°; also across the end of the half turn.
    for (degrees, stands) in
        [(179.5, true), (180.3, true), (0.3, true), (178.7, true), (0.5, false), (178.5, false)]
    {
        assert_eq!(check(degrees, 0.001).is_ok(), stands, "{degrees}");
    }
    assert!(
        matches!(check(90.0, 0.001), Err(Fault::RotorMoves { angle, .. }) if (angle - 1.5620).abs() < 1e-3)
    );
    assert!(check(4.0, 0.02).is_ok() && check(f64::NAN, 0.001).is_err());
    let mut margin = Margin::new();
    assert!(Combined::new().check_movement(&mut margin, axis(90.0), 0.0, SaliencySign::Negative).is_ok());
}

#[test]
fn regress_no_noise_and_single_precision_keep_their_numbers() {
    let exact = Said {
        variance: 0.0,
        covariance: [[0.0; 3]; 3],
        ratio_noise: [0.0; 3],
        noise: 0.0,
        ..said(50.0, 0.0)
    };
    for all in [combined(&[exact]), combined(&[exact, exact])] {
        assert_eq!(all.lines, exact.lines);
        assert_eq!(all.covariance(), [[0.0; 3]; 3]);
        assert!((all.ratios(0.005).0[0] - 0.01).abs() < 1e-8);
    }
    // Kiloamperes and microhenries: c of 1e-12 H/A has a weight whose square is no number of single precision.
    let mut all = Combined::<f32>::new();
    for _ in 0..3 {
        all.add(&Said {
            lines: [2e-6, 1.8e-6, 1.5e-6],
            variance: 1e-6,
            covariance: [[1e-18; 3]; 3],
            shift: [0.0; 3],
            ratios: [0.0; 3],
            ratio_noise: [1e-6; 3],
            direction: AlphaBeta::new(1e-12, 0.0),
            noise: 1e-28,
            floor: 1e-13,
            instants: [0.0; 3],
        });
    }
    let pointer = all.pointer();
    assert!((pointer.direction.alpha / 1e-12 - 1.0).abs() < 1e-5);
    assert!((pointer.deviation / 1.0017e-13 - 1.0).abs() < 1e-2, "{}", pointer.deviation);
}
