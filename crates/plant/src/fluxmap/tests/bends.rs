//! Maps whose inductance falls within a small part of their flux.

use super::*;

/// The map of a motor whose axes do not see each other: ψ_d(i_d) and ψ_q(i_q) on a grid.
fn uncoupled(count: i32, psi_d: impl Fn(f64) -> f64, psi_q: impl Fn(f64) -> f64) -> MapSamples {
    let mut points = Vec::new();
    // Of each current once: a flux may be an integral.
    let along_q: Vec<[f64; 2]> = axis(40.0, count).into_iter().map(|i| [i, psi_q(i)]).collect();
    for i_d in axis(40.0, count) {
        let psi_d = psi_d(i_d);
        for [i_q, psi_q] in along_q.iter().copied() {
            let place = Place::Element(points.len() + 1);
            points.push(MapPoint { i_d, i_q, psi_d, psi_q, place });
        }
    }
    MapSamples { file: "map.npz".to_owned(), points, pole_pairs: None, resistance: None }
}

/// Inductances at a current, and what is said of their errors.
fn inductances(map: &FluxMap, report: &MapReport, current: Dq<f64>) -> ([f64; 2], [f64; 2]) {
    let flux = map.flux_at(current).expect("inside");
    let l = map.current_and_inverse_inductance(flux).1.inverse();
    let [dd, _, qq] = report.errors.at([current.d, current.q]);
    ([l.xx, l.yy], [dd, qq])
}

#[test]
fn law_a_map_whose_inductance_falls_to_a_thirtieth_is_simulated() {
    falls_to_a_thirtieth(&[33, 65]);
}

#[test]
#[ignore = "a map of more points: scripts/test-all.sh long"]
fn law_fine_maps_whose_inductance_falls_or_dips_are_followed() {
    falls_to_a_thirtieth(&[257]);
    dips(&[257]);
}

/// Maps of so many points a side.
fn falls_to_a_thirtieth(counts: &[i32]) {
    let flux = |i: f64| 0.58 * (i / 4.0).tanh() + 0.005 * i;
    let inductance = |i: f64| 0.145 / (i / 4.0).cosh().powi(2) + 0.005;
    for &count in counts {
        let samples = uncoupled(count, |i| 0.45 + 0.02 * i, flux);
        let (map, report) = FluxMap::new(&samples).unwrap_or_else(|error| panic!("{count}: {error}"));
        assert_eq!(report.convexity, None, "{count}");
        // A ten-thousandth of the largest current.
        assert!(report.evaluation_error < 4e-3, "{count}: {} A", report.evaluation_error);
        for i in axis(40.0, 401) {
            let ([l_d, l_q], [_, said]) = inductances(&map, &report, Dq::new(0.0, i));
            let off = (l_q - inductance(i)).abs();
            assert!(off < 2.0 * said, "{count}, {i}: {l_q} ± {said} H, {off} off");
            // The splines of 33 points are off by more: between two of them the inductance halves.
            assert!(count == 33 || off < 2e-3 * inductance(i).max(0.05), "{count}, {i}: {l_q} H, {off} off");
            assert!((l_d / 0.02 - 1.0).abs() < 1e-3, "{count}, {i}: {l_d} H");
        }
        assert_eq!(report.errors.too_coarse(), count == 33, "{count}: {:?}", report.errors.coarseness());
    }
}

#[test]
fn law_a_dip_of_an_inductance_between_few_points_is_followed_or_said() {
    dips(&[33, 65]);
}

/// Maps of so many points a side.
fn dips(counts: &[i32]) {
    let (width, depth) = (1.02, 6.849e-3);
    let inductance = |i: f64| 0.01 - depth * (-((i - 5.0) / width).powi(2) / 2.0).exp();
    // Its integral, by Simpson's rule.
    let flux = |i: f64| {
        let parts = 4000;
        let step = i / f64::from(parts);
        let sum: f64 = (0..parts)
            .map(|k| {
                let x = step * f64::from(k);
                (inductance(x) + 4.0 * inductance(x + step / 2.0) + inductance(x + step)) / 6.0
            })
            .sum();
        0.45 + sum * step
    };
    for &count in counts {
        let samples = uncoupled(count, flux, |i| 0.02 * i);
        let (map, report) = FluxMap::new(&samples).unwrap_or_else(|error| panic!("{count}: {error}"));
        // A thousandth of the largest current.
        assert!(report.evaluation_error < 0.04, "{count}: {} A", report.evaluation_error);
        for i in axis(40.0, 401) {
            let ([l_d, _], [said, _]) = inductances(&map, &report, Dq::new(i, 0.0));
            let off = (l_d - inductance(i)).abs();
            // Of points 2.5 A apart, one at most is within the dip.
            let within = if count == 33 { 3.0 } else { 2.0 };
            assert!(off < within * said, "{count}, {i}: {l_d} ± {said} H, {off} off");
        }
        // 65 points, and as many splines as there are at most, are 1.25 A apart.
        assert!(report.errors.too_coarse(), "{count}: {:?}", report.errors.coarseness());
        let ([l_d, _], _) = inductances(&map, &report, Dq::new(5.0, 0.0));
        assert!(count == 33 || (l_d / 3.151e-3 - 1.0).abs() < 0.04, "{count}: {l_d} H");
    }
}

/// Such a map over currents up to `reach` along q, with a knee that is this narrow in A.
fn knee(reach: f64, count: i32, knee: f64) -> MapSamples {
    let mut samples = uncoupled(count, |i| 0.45 + 0.02 * i, |_| 0.0);
    for p in &mut samples.points {
        p.i_q *= reach / 40.0;
        p.psi_q = 0.5 * ((p.i_q / knee).tanh() + 0.01 * p.i_q / knee);
    }
    samples.points.retain(|p| (p.i_d / 10.0).fract() == 0.0);
    samples
}

#[test]
fn law_a_bend_that_the_surface_cannot_follow_is_refused_and_a_smaller_range_is_read() {
    // L_q falls from 1 H to 10 mH within an ampere of forty. Points 0.6 A apart tell it, and their energy is convex.
    let message = FluxMap::new(&knee(40.0, 129, 0.5)).expect_err("too sharp").to_string();
    for part in
        ["positive definite, but that the 72 × 72 cells", "cannot follow", "smaller range of currents"]
    {
        assert!(message.contains(part), "{message}");
    }
    // A knee twice as wide makes a surface that is convex, but beside the energy.
    let message = FluxMap::new(&knee(40.0, 65, 1.2)).expect_err("too sharp").to_string();
    assert!(message.contains("72 × 72 cells of the simulated map are off its energy by up to"), "{message}");
    // What both ask for.
    let (map, report) = FluxMap::new(&knee(4.0, 65, 0.5)).expect("a smaller range is read");
    for i in axis(4.0, 33) {
        let ([_, l_q], [_, said]) = inductances(&map, &report, Dq::new(0.0, i));
        let exact = 1.0 / (i / 0.5).cosh().powi(2) + 0.01;
        assert!((l_q - exact).abs() < 2.0 * said && said < 0.01, "{i}: {l_q} ± {said} H, {exact}");
    }
}

#[test]
fn law_more_lines_where_a_coarse_map_bends_make_it_fine() {
    let flux = |i: f64| 0.58 * (i / 4.0).tanh() + 0.005 * i;
    let inductance = |i: f64| 0.145 / (i / 4.0).cosh().powi(2) + 0.005;
    let coarse = uncoupled(33, |i| 0.45 + 0.02 * i, flux);
    let (map, report) = FluxMap::new(&coarse).expect("is read with a note");
    assert!(report.errors.too_coarse() && map.note().is_some_and(|note| note.contains("too coarse")));
    // A line halfway between two where L_q is not yet that of the saturated core, all others as they are.
    let mut fine = coarse;
    let near = fine.points.iter().filter(|p| (-12.5..12.5).contains(&p.i_q)).cloned().collect::<Vec<_>>();
    for mut p in near {
        p.i_q += 1.25;
        p.psi_q = flux(p.i_q);
        p.place = Place::Element(fine.points.len() + 1);
        fine.points.push(p);
    }
    let (map, report) = FluxMap::new(&fine).expect("is read");
    assert!(!report.errors.too_coarse() && map.note().is_none(), "{:?}", report.errors.coarseness());
    for i in axis(40.0, 401) {
        let ([l_d, l_q], [_, said]) = inductances(&map, &report, Dq::new(0.0, i));
        let off = (l_q - inductance(i)).abs();
        assert!(off < 2.0 * said && off < 2e-3 * inductance(i).max(0.05), "{i}: {l_q} ± {said} H, {off} off");
        assert!((l_d / 0.02 - 1.0).abs() < 1e-3, "{i}: {l_d} H");
    }
}
