extern crate std;
use std::vec;
use std::vec::Vec;

use super::*;
use crate::testing::Noise;

const MODEL: PulseModel<f64> = PulseModel {
    on: 548.0,
    off: 552.0,
    resistance: 2.4,
    pulse: 200e-6,
    interval: 10e-6,
    blank: 0.0,
    before_end: 0.0,
};

const TRUE: [LineParameters<f64>; 3] = [
    LineParameters { inductance: 32.8e-3, slope: 1.2e-4, delay: 2.2e-6, lag: 0.0, late: 0.0 },
    LineParameters { inductance: 28.0e-3, slope: -0.4e-4, delay: 2.2e-6, lag: 0.0, late: 0.0 },
    LineParameters { inductance: 22.0e-3, slope: 0.0, delay: 2.2e-6, lag: 0.0, late: 0.0 },
];

/// Where a fit begins.
fn from(inductance: f64) -> [LineParameters<f64>; 3] {
    [LineParameters { inductance, slope: 0.0, delay: 1e-6, lag: 0.0, late: 0.0 }; 3]
}

fn curve(p: &LineParameters<f64>, forward: bool) -> Vec<f64> {
    let mut curve = vec![0.0; 52];
    MODEL.one_way(p, forward, 52, |k, current, _| curve[k] = current);
    curve
}

#[test]
fn analytic_without_saturation_the_current_is_exponential() {
    let p = LineParameters { inductance: 28.0e-3, slope: 0.0, delay: 2e-6, lag: 0.0, late: 0.0 };
    let on = |t: f64| MODEL.on / MODEL.resistance * (1.0 - (-MODEL.resistance * t / p.inductance).exp());
    let mut seen = 0;
    MODEL.one_way(&p, true, 52, |k, current, slopes| {
        let t = 10e-6 * (k + 1) as f64;
        if t <= 200e-6 {
            assert!((current - on(t - 2e-6)).abs() < 1e-9, "{k}");
            let slope = (on(t - 2.001e-6) - on(t - 1.999e-6)) / 2e-9;
            assert!((slopes[2] - slope).abs() < 1e-2 * slope.abs(), "{k}");
        }
        seen += 1;
    });
    // Up for 198 µs and down a little faster.
    assert!((38..=40).contains(&seen), "{seen}");
}

#[test]
fn analytic_slopes_are_differences() {
    let p = TRUE[0];
    let moved = |l: f64, c: f64, t: f64| LineParameters {
        inductance: p.inductance + l,
        slope: p.slope + c,
        delay: p.delay + t,
        ..p
    };
    for (n, step) in [(0, (1e-9, 0.0, 0.0)), (1, (0.0, 1e-9, 0.0)), (2, (0.0, 0.0, 1e-11))] {
        let (l, c, t) = step;
        let up = curve(&moved(l, c, t), true);
        let down = curve(&moved(-l, -c, -t), true);
        MODEL.one_way(&p, true, 52, |k, _, slopes| {
            let difference = (up[k] - down[k]) / (2.0 * (l + c + t));
            assert!((slopes[n] - difference).abs() < 1e-4 * difference.abs() + 1e-3, "{n} {k}");
        });
    }
}

#[test]
fn analytic_behind_a_filter_of_first_order_an_exponential_is_two() {
    for lag in [8e-6, 0.8e-6, 0.16e-6] {
        let p = LineParameters { inductance: 28.0e-3, slope: 0.0, delay: 2e-6, lag, late: 0.7e-6 };
        let own = p.inductance / MODEL.resistance;
        let on = |t: f64| {
            let [slow, fast] = [own, lag].map(|of| of * (-t / of).exp());
            MODEL.on / MODEL.resistance * (1.0 - (slow - fast) / (own - lag))
        };
        MODEL.one_way(&p, true, 19, |k, current, slopes| {
            let t = 10e-6 * (k + 1) as f64 + 0.7e-6 - 2e-6;
            assert!((current - on(t)).abs() < 1e-8, "{lag} {k}: {current} {}", on(t));
            let slope = (on(t - 1e-9) - on(t + 1e-9)) / 2e-9;
            assert!((slopes[2] / slope - 1.0).abs() < 1e-4, "{lag} {k}");
        });
        let moved = |by: f64| curve(&LineParameters { lag: lag + by, ..p }, true);
        let (up, down) = (moved(1e-10), moved(-1e-10));
        MODEL.one_way(&p, true, 52, |k, _, slopes| {
            let difference = (up[k] - down[k]) / 2e-10;
            assert!(
                (slopes[3] - difference).abs() < 1e-3 * difference.abs() + 5.0,
                "{lag} {k} {slopes:?} {difference}"
            );
        });
    }
}

#[test]
fn analytic_a_fit_finds_how_much_the_sensors_lag() {
    // 50 kHz within 20 % of the data sheet, and a converter that takes one phase after the other.
    let nominal = 3.2e-6;
    for share in [0.8, 1.0, 1.25] {
        let seen =
            |k: usize| LineParameters { lag: nominal * share, late: [0.5e-6, 1.5e-6, 1e-6][k], ..TRUE[k] };
        let all: Vec<[Vec<f64>; 2]> =
            (0..3).map(|k| [curve(&seen(k), false), curve(&seen(k), true)]).collect();
        let curves: Curves<'_, f64> = core::array::from_fn(|k| [&all[k][0][..], &all[k][1][..]]);
        let start = core::array::from_fn(|k| LineParameters {
            inductance: 26e-3,
            slope: 0.0,
            delay: 1e-6,
            lag: nominal,
            late: seen(k).late,
        });
        for model in [MODEL, PulseModel { blank: 2.5e-6, ..MODEL }] {
            let found = fit(&curves, &model, start).expect("determined");
            for (k, line) in TRUE.iter().enumerate() {
                assert!((found.inductance[k] / line.inductance - 1.0).abs() < 1e-8, "{share} {found:?}");
            }
            assert!((found.lag / nominal - share).abs() < 1e-6, "{share} {found:?}");
        }
        // With a line of its own lag, its inductance moves by what is said.
        let more = LineParameters { lag: nominal * share + 1e-9, ..seen(1) };
        let moved = [curve(&more, false), curve(&more, true)];
        let curves = [curves[0], [&moved[0][..], &moved[1][..]], curves[2]];
        let found = fit(&curves, &MODEL, start).expect("determined");
        // A third of it is taken for a lag of all.
        let change = (found.inductance[1] - TRUE[1].inductance) / 1e-9;
        let ratio = change / found.lag_slope[1];
        assert!((0.5..1.0).contains(&ratio), "{ratio}");
    }
}

#[test]
fn analytic_samples_near_an_edge_are_left_out() {
    let model = PulseModel { blank: 9e-6, ..MODEL };
    let mut seen = Vec::new();
    model.one_way(&TRUE[0], true, 52, |k, _, _| seen.push(k));
    // The pulse begins at 2.2 µs and ends with the sample at 200 µs.
    assert!(
        !seen.contains(&0)
            && seen.contains(&1)
            && seen.contains(&18)
            && !seen.contains(&19)
            && seen.contains(&20)
    );
}

#[test]
fn analytic_a_fit_recovers_what_made_its_curves() {
    let all: Vec<[Vec<f64>; 2]> = TRUE.iter().map(|p| [curve(p, false), curve(p, true)]).collect();
    let curves: Curves<'_, f64> = core::array::from_fn(|k| [&all[k][0][..], &all[k][1][..]]);
    let found = fit(&curves, &MODEL, from(26e-3)).expect("determined");
    for (k, line) in TRUE.iter().enumerate() {
        assert!((found.inductance[k] / line.inductance - 1.0).abs() < 1e-9, "{found:?}");
        assert!((found.slope[k] - line.slope).abs() < 1e-10);
    }
    // Which tells that t_s is right too.
    assert!(found.variance < 1e-15);
}

/// Curves with noise of this deviation in A, and the fit of them.
fn fit_with(noise: &mut Noise, deviation: f64, bend: f64, start: f64) -> Option<Fit<f64>> {
    let mut all: Vec<[Vec<f64>; 2]> = TRUE.iter().map(|p| [curve(p, false), curve(p, true)]).collect();
    for curve in all.iter_mut().flatten() {
        for (k, current) in curve.iter_mut().enumerate() {
            *current += deviation * noise.gauss() + bend * (k as f64 * 0.5).sin();
        }
    }
    let curves: Curves<'_, f64> = core::array::from_fn(|k| [&all[k][0][..], &all[k][1][..]]);
    fit(&curves, &MODEL, from(start))
}

#[test]
fn regress_a_step_to_a_negative_inductance_is_no_solution_but_is_taken_back() {
    let found = fit_with(&mut Noise::new(1), 0.0, 0.0, 75e-3).expect("determined");
    for (k, line) in TRUE.iter().enumerate() {
        assert!((found.inductance[k] / line.inductance - 1.0).abs() < 1e-6, "{found:?}");
    }
}

#[test]
fn law_a_fit_scatters_as_its_covariance_says_and_knows_its_noise() {
    let (trials, deviation) = (400, 0.02);
    let mut noise = Noise::new(5);
    let (mut products, mut stated) = ([[0.0; 3]; 3], [[0.0; 3]; 3]);
    let (mut slopes, mut slopes_stated, mut variance, mut misfit) = (0.0, 0.0, 0.0, 0.0);
    for _ in 0..trials {
        let found = fit_with(&mut noise, deviation, 0.0, 28e-3).expect("determined");
        let off: [f64; 3] = core::array::from_fn(|k| found.inductance[k] - TRUE[k].inductance);
        for k in 0..3 {
            for l in 0..3 {
                products[k][l] += off[k] * off[l] / f64::from(trials);
                stated[k][l] += found.inductance_covariance[k][l] / f64::from(trials);
            }
            slopes += (found.slope[k] - TRUE[k].slope).powi(2);
            slopes_stated += found.slope_variance[k];
        }
        variance += found.variance / f64::from(trials);
        misfit += found.misfit / f64::from(trials);
    }
    for k in 0..3 {
        for l in 0..3 {
            let scale = (stated[k][k] * stated[l][l]).sqrt();
            assert!((products[k][l] - stated[k][l]).abs() < 0.25 * scale, "{products:?} {stated:?}");
        }
    }
    assert!((slopes / slopes_stated - 1.0).abs() < 0.15, "{slopes} {slopes_stated}");
    assert!((variance.sqrt() / deviation - 1.0).abs() < 0.02, "{variance}");
    // Neighbours of white noise have nothing in common.
    assert!(misfit < 0.01 * variance, "{misfit} {variance}");
}

#[test]
fn law_what_the_model_does_not_explain_is_seen() {
    let found = fit_with(&mut Noise::new(9), 0.01, 0.05, 28e-3).expect("determined");
    // A wave has a mean square of 0.05²/2, of which neighbours at 0.5 rad share cos 0.5.
    let expected = 0.05 * 0.05 / 2.0 * 0.5_f64.cos();
    assert!((0.6..1.05).contains(&(found.misfit / expected)), "{} {expected}", found.misfit);
}

/// A wave that the model does not explain is in the pole's deviation once: what is left of the residuals is noise, and both together
/// are no less than what the wave does.
#[test]
fn law_what_rings_counts_once_and_enough() {
    let mut noise = Noise::new(13);
    let (trials, deviation, wave) = (200, 0.01, 0.03);
    let (mut squares, mut stated, mut left) = (0.0, 0.0, 0.0);
    let peak = MODEL.on * MODEL.pulse / TRUE[1].inductance;
    for _ in 0..trials {
        let mut all: Vec<[Vec<f64>; 2]> = TRUE.iter().map(|p| [curve(p, false), curve(p, true)]).collect();
        // From 7 to 20 samples a period, the same after each pulse: it decays.
        let turn = 0.6 + 0.15 * noise.gauss().clamp(-2.0, 2.0);
        for curve in all.iter_mut().flatten() {
            let phase = 3.0 * noise.gauss();
            for (k, current) in curve.iter_mut().enumerate() {
                let ringing = wave * (k as f64 * turn + phase).sin() * (-(k as f64 % 20.0) / 15.0).exp();
                *current += deviation * noise.gauss() + ringing;
            }
        }
        let curves: Curves<'_, f64> = core::array::from_fn(|k| [&all[k][0][..], &all[k][1][..]]);
        let found = fit(&curves, &MODEL, from(28e-3)).expect("determined");
        for (k, line) in TRUE.iter().enumerate() {
            let share = peak / line.inductance;
            squares += ((found.slope[k] - line.slope) * share).powi(2);
            stated += found.slope_variance[k] * share * share + found.misfit / (peak * peak);
            left += (found.variance - found.misfit) / f64::from(3 * trials);
        }
    }
    assert!(squares < stated, "{squares} {stated}");
    // Noise, what is subtracted by chance, and what a wave has that its neighbours do not share.
    assert!(left < 3.0 * deviation * deviation, "{left}");
    let clean = fit_with(&mut Noise::new(3), deviation, 0.0, 28e-3).expect("determined");
    let ringing = fit_with(&mut Noise::new(3), deviation, 0.05, 28e-3).expect("determined");
    for k in 0..3 {
        let grown = ringing.slope_variance[k] / clean.slope_variance[k];
        let counted_twice = ringing.variance / clean.variance;
        assert!(grown < 0.5 * counted_twice, "{grown} {counted_twice}");
    }
}

#[test]
fn law_curves_without_information_have_no_fit() {
    let nothing = [0.0_f64; 52];
    let curves: Curves<'_, f64> = [[&nothing; 2]; 3];
    for start in [28e-3, -1.0, 0.0, f64::NAN, f64::INFINITY] {
        let found = fit(&curves, &MODEL, from(start));
        assert!(found.is_none_or(|fit| !fit.inductance.iter().all(|l| (0.0..0.1).contains(l))), "{start}");
    }
    let few = [1.0_f64; 1];
    assert!(fit(&[[&few; 2]; 3], &MODEL, from(28e-3)).is_none());
    // A beginning after many samples, or before the first.
    for delay in [-3e-5, 3.5e-5] {
        let p = LineParameters { inductance: 28e-3, slope: 0.0, delay, lag: 0.0, late: 0.0 };
        let mut first = None;
        MODEL.one_way(&p, true, 52, |k, current, _| {
            assert!(current >= 0.0);
            first.get_or_insert((k, current));
        });
        let (k, current) = first.expect("samples");
        let since = 10e-6 * (k + 1) as f64 - delay;
        assert_eq!(k, if delay < 0.0 { 0 } else { 3 });
        assert!((current / (MODEL.on * since / p.inductance) - 1.0).abs() < 0.01);
    }
}

#[test]
fn law_each_way_ends_where_its_own_current_does() {
    // Far from symmetric: the larger current loses more to the resistance and is gone earlier.
    let model = PulseModel { resistance: 40.0, ..MODEL };
    let p = LineParameters { inductance: 28.0e-3, slope: 3.0e-3, delay: 2e-6, lag: 0.0, late: 0.0 };
    let mut seen = [0; 2];
    model.follow(&p, 52, |_, way, current, _| {
        assert!(current >= 0.0, "{way:?} {current}");
        seen[usize::from(way == Way::Forward)] += 1;
    });
    assert!(seen[0] > seen[1] && seen[1] > 20, "{seen:?}");
}
