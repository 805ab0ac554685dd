mod bends;
mod convexity;
mod inversion;
mod noise;
mod one_sided;
mod sizes;

use standstill_interface::Dq;
use standstill_numeric::Heading;

use self::noise::add_noise;
use super::*;
use crate::{MagneticCircuit, Magnetics, built_in};
use standstill_files::{MapPoint, Place};

/// A map of a core, sampled on a grid.
fn sampled(core: &impl Magnetics, d: &[f64], q: &[f64]) -> MapSamples {
    let mut points = Vec::new();
    for i_d in d {
        for i_q in q {
            let flux = core.flux_at(Dq::new(*i_d, *i_q)).expect("convex");
            let place = Place::Line(points.len() + 2);
            points.push(MapPoint { i_d: *i_d, i_q: *i_q, psi_d: flux.d, psi_q: flux.q, place });
        }
    }
    MapSamples { file: "map.csv".to_owned(), points, pole_pairs: None, resistance: None }
}

/// The same of a machine whose d-axis is this many degrees ahead of that of its map.
fn off_axis(core: &impl Magnetics, grid: &[f64], degrees: f64) -> MapSamples {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let turn = |x: Dq<f64>, sin: f64| Dq::new(cos * x.d - sin * x.q, sin * x.d + cos * x.q);
    let mut samples = sampled(core, grid, grid);
    for p in &mut samples.points {
        let flux = core.flux_at(turn(Dq::new(p.i_d, p.i_q), -sin)).expect("convex");
        Dq { d: p.psi_d, q: p.psi_q } = turn(flux, sin);
    }
    samples
}

fn axis(reach: f64, count: i32) -> Vec<f64> {
    (0..count).map(|k| reach * (2.0 * f64::from(k) / f64::from(count - 1) - 1.0)).collect()
}

#[test]
fn law_a_map_sampled_from_a_core_gives_the_core_back() {
    for name in ["paper-5k5", "pm-reluctance", "reluctance-6k7", "cross-saturation"] {
        let motor = built_in(name).expect("built in");
        let core = motor.magnetics.core();
        let rated = motor.rated_current;
        let grid = axis(1.5 * rated, 31);
        let (map, report) = FluxMap::new(&sampled(core, &grid, &grid)).expect("a map");
        assert!(report.reciprocity_error < 0.005, "{name}: {report:?}");
        assert!(report.distance[1] < 1e-3 * report.largest_flux, "{name}: {report:?}");
        let off = |d: f64, q: f64| {
            let current = Dq::new(d, q);
            let flux = core.flux_at(current).expect("convex");
            (map.current(flux) - current).norm()
        };
        let over = |d: Vec<f64>, q: Vec<f64>| {
            d.iter().flat_map(|d| q.iter().map(|q| off(*d, *q))).fold(0.0, f64::max)
        };
        let worst = over(axis(rated, 23), axis(rated, 19));
        assert!(worst < 1e-3 * rated, "{name}: {worst} A");
        // Closer to the axes than the points of the map are. The reluctance motors' energies go with |ψ|³ there: their
        // inductances have a cusp, which a smooth map of this grid cannot show.
        let close = || axis(0.06 * rated, 7);
        let worst = over(axis(rated, 23), close()).max(over(close(), axis(rated, 23)));
        let bound = match name {
            "reluctance-6k7" => 4e-3,
            "pm-reluctance" => 1.5e-3,
            _ => 1e-3,
        };
        assert!(worst < bound * rated, "{name}, close to the axes: {worst} A");
        let polarity = |core: &dyn Fn(f64) -> f64| {
            let rest = core(0.0);
            (rest - core(-rated)) / (core(rated) - rest) - 1.0
        };
        let own = polarity(&|i| core.flux_at(Dq::new(i, 0.0)).expect("convex").d);
        let its = polarity(&|i| map.flux_at(Dq::new(i, 0.0)).expect("convex").d);
        assert!((its - own).abs() < 0.01 * own.abs() + 1e-6, "{name}: {own} {its}");
    }
}

#[test]
fn law_a_map_is_one_convex_energy_and_knows_its_end() {
    let motor = built_in("pm-reluctance").expect("built in");
    let grid = axis(12.0, 15);
    let (map, _) = FluxMap::new(&sampled(motor.magnetics.core(), &grid, &grid)).expect("a map");
    let h = 1e-6;
    for d in axis(11.0, 9) {
        for q in axis(11.0, 9) {
            let flux = map.flux_at(Dq::new(d, q)).expect("inside");
            let (current, gamma) = map.current_and_inverse_inductance(flux);
            assert!(gamma.is_positive_definite());
            let slope = |step: Dq<f64>| (map.energy(flux + step) - map.energy(flux - step)) / (2.0 * h);
            let numeric = Dq::new(slope(Dq::new(h, 0.0)), slope(Dq::new(0.0, h)));
            assert!((current - numeric).norm() < 1e-5, "{current:?} {numeric:?}");
            let bend = |step: Dq<f64>| (map.current(flux + step) - map.current(flux - step)) * (0.5 / h);
            let (x, y) = (bend(Dq::new(h, 0.0)), bend(Dq::new(0.0, h)));
            for (got, exact) in [(x.d, gamma.xx), (x.q, gamma.xy), (y.d, gamma.xy), (y.q, gamma.yy)] {
                assert!((got - exact).abs() < 1e-5 * (gamma.xx + gamma.yy), "{got} {exact}");
            }
        }
    }
    assert!(map.margin(Dq::new(11.9, 0.0)) > 0.0 && map.margin(Dq::new(12.1, 0.0)) < 0.0);
    assert!(map.margin(Dq::new(0.0, -12.1)) < 0.0);
    let circuit = MagneticCircuit::new(crate::Core::Map(map)).expect("a state at rest");
    let error = circuit.flux_at(Dq::new(13.0, 0.0), Heading::ZERO).expect_err("beyond the map").to_string();
    assert!(error.contains("13 A") && error.contains("-12 to 12 A"), "{error}");
    // Nor where the surface goes on beyond the map such that there is no such current.
    for current in [16.0, 40.0, 1e3, 1e6] {
        for (d, q) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (1.0, -1.0)] {
            let error =
                circuit.flux_at(Dq::new(d, q) * current, Heading::ZERO).expect_err("beyond").to_string();
            assert!(error.contains("-12 to 12 A"), "{error}");
        }
    }
}

#[test]
fn law_machines_of_any_size_are_computed_alike() {
    let motor = built_in("cross-saturation").expect("built in");
    let grid = axis(12.0, 15);
    let samples = sampled(motor.magnetics.core(), &grid, &grid);
    let circuit = |current: f64, flux: f64| {
        let mut samples = samples.clone();
        for p in &mut samples.points {
            (p.i_d, p.i_q) = (p.i_d * current, p.i_q * current);
            (p.psi_d, p.psi_q) = (p.psi_d * flux, p.psi_q * flux);
        }
        let (map, _) = FluxMap::new(&samples).expect("a map");
        MagneticCircuit::new(crate::Core::Map(map)).expect("a state at rest")
    };
    let own = circuit(1.0, 1.0);
    for (current, flux) in [(2e6, 1e4), (1e-6, 1.0), (1.0, 1e-9)] {
        let other = circuit(current, flux);
        for (d, q) in [(0.0, 0.0), (12.0, 0.0), (-12.0, 12.0), (3.0, -7.0)] {
            let expected = own.flux_at(Dq::new(d, q), Heading::ZERO).expect("inside") * flux;
            let got = other.flux_at(Dq::new(d, q) * current, Heading::ZERO).expect("inside");
            assert!((got - expected).norm() < 1e-7 * flux, "{current} {flux}: {got:?} {expected:?}");
        }
        let beyond = other.flux_at(Dq::new(12.001, 0.0) * current, Heading::ZERO);
        assert!(beyond.is_err(), "{current} {flux}");
    }
}

#[test]
fn law_the_projection_takes_the_curl_away_and_says_how_much() {
    let motor = built_in("cross-saturation").expect("built in");
    let grid = axis(12.0, 21);
    let mut samples = sampled(motor.magnetics.core(), &grid, &grid);
    // A curl: cross inductances of +e and −e, 40 µH.
    for point in &mut samples.points {
        point.psi_d += 2e-5 * point.i_q;
        point.psi_q -= 2e-5 * point.i_d;
    }
    let (map, report) = FluxMap::new(&samples).expect("a map");
    assert!((report.reciprocity_error * report.cross_inductance / 4e-5 - 1.0).abs() < 0.1, "{report:?}");
    assert!(report.distance[0] > 5e-5 && report.distance[1] < 1e-3, "{report:?}");
    // The curl is antisymmetric, its nearest gradient is zero: the fluxes are those without it.
    for d in axis(8.0, 5) {
        let current = Dq::new(d, 3.0);
        let flux = motor.magnetics.core().flux_at(current).expect("convex");
        assert!((map.current(flux) - current).norm() < 0.02, "{current:?}");
    }
}

#[test]
fn law_axes_of_reluctance_convention_and_half_maps_are_brought_into_order() {
    let motor = built_in("pm-reluctance").expect("built in");
    let core = motor.magnetics.core();
    let whole = axis(12.0, 17);
    let half: Vec<f64> = whole.iter().copied().filter(|i| *i >= 0.0).collect();
    let (own, report) = FluxMap::new(&sampled(core, &whole, &whole)).expect("a map");
    assert_eq!((report.axes, report.mirrored), (MapAxes::Magnet, [false, false]));
    let (mirrored, report) = FluxMap::new(&sampled(core, &whole, &half)).expect("a map");
    assert_eq!((report.axes, report.mirrored), (MapAxes::Magnet, [false, true]));
    // Reluctance axes: the magnet along −q.
    let mut samples = sampled(core, &whole, &whole);
    for point in &mut samples.points {
        (point.i_d, point.i_q) = (point.i_q, -point.i_d);
        (point.psi_d, point.psi_q) = (point.psi_q, -point.psi_d);
    }
    let (turned, report) = FluxMap::new(&samples).expect("a map");
    assert_eq!(report.axes, MapAxes::Turned(3));
    for map in [mirrored, turned] {
        for (d, q) in [(0.0, 0.0), (7.0, -5.0), (-6.0, 4.0)] {
            let flux = own.flux_at(Dq::new(d, q)).expect("inside");
            assert!((map.current(flux) - Dq::new(d, q)).norm() < 1e-3, "{d} {q}");
        }
    }
    // No magnet, one quadrant.
    let motor = built_in("reluctance-6k7").expect("built in");
    let (map, report) = FluxMap::new(&sampled(motor.magnetics.core(), &half, &half)).expect("a map");
    assert_eq!((report.axes, report.mirrored), (MapAxes::NoMagnet, [true, true]));
    let flux = motor.magnetics.core().flux_at(Dq::new(-5.0, -6.0)).expect("convex");
    assert!((map.current(flux) - Dq::new(-5.0, -6.0)).norm() < 0.02);
    // A zero that rounding has moved has no twin.
    let mut samples = sampled(motor.magnetics.core(), &half, &half);
    for p in &mut samples.points {
        (p.i_d, p.i_q) = (p.i_d + 1e-9, p.i_q - 1e-9);
    }
    let (_, moved) = FluxMap::new(&samples).expect("a map");
    assert_eq!((moved.size, moved.mirrored), (report.size, report.mirrored));
}

#[test]
fn regress_what_is_wrong_with_a_map_is_named() {
    let motor = built_in("paper-5k5").expect("built in");
    let grid = axis(8.0, 5);
    let good = sampled(motor.magnetics.core(), &grid, &grid);
    let error = |change: &dyn Fn(&mut Vec<MapPoint>)| {
        let mut samples = good.clone();
        change(&mut samples.points);
        FluxMap::new(&samples).expect_err("must be refused").to_string()
    };
    let missing = error(&|points| {
        points.remove(7);
    });
    assert!(missing.contains("i_d = -4 A, i_q = 0 A") && missing.contains("1 of the 5 × 5"), "{missing}");
    let double = error(&|points| points.push(points[3].clone()));
    assert!(double.contains("second point"), "{double}");
    let falling = error(&|points| points[12].psi_d = 0.3);
    assert!(falling.starts_with("map.csv: line 14") && falling.contains("more flux along d"), "{falling}");
    let row = error(&|points| points.truncate(5));
    assert!(row.contains("only 1 value(s) of i_d"), "{row}");
    let few = error(&|points| points.retain(|p| [-8.0, 0.0, 8.0].contains(&p.i_d)));
    assert!(few.contains("only 3 values of i_d") && few.contains("at least 5"), "{few}");
    let scattered = error(&|points| {
        for k in 0..1100 {
            points.push(MapPoint { i_d: 0.01 * f64::from(k) + 1e-3, ..points[12].clone() });
        }
    });
    assert!(scattered.contains("at most 1024"), "{scattered}");
    let shifted = error(&|points| points.iter_mut().for_each(|p| p.i_q += 20.0));
    assert!(shifted.contains("contains 0 A"), "{shifted}");
    let coupled = error(&|points| {
        for p in points {
            (p.psi_d, p.psi_q) = (p.psi_d + 0.02 * p.i_q, p.psi_q + 0.02 * p.i_d);
        }
    });
    assert!(coupled.contains("not convex") && coupled.contains("L_dq"), "{coupled}");
    let skew = error(&|points| points.iter_mut().for_each(|p| p.psi_q += 0.3));
    assert!(skew.contains("within 1° of +d"), "{skew}");
    let transposed = error(&|points| {
        for k in 0..5 {
            for m in 0..k {
                let (one, other) = (5 * k + m, 5 * m + k);
                let (a, b) = (points[one].clone(), points[other].clone());
                (points[one].psi_d, points[one].psi_q) = (b.psi_d, b.psi_q);
                (points[other].psi_d, points[other].psi_q) = (a.psi_d, a.psi_q);
            }
        }
    });
    assert!(transposed.contains("look transposed"), "{transposed}");
    // Stairs, the same at each i_q.
    let grid = axis(8.0, 13);
    let mut stairs = sampled(motor.magnetics.core(), &grid, &grid);
    for (k, point) in stairs.points.iter_mut().enumerate() {
        point.psi_d += if (k / 13) % 2 == 0 { 0.006 } else { -0.006 };
    }
    // The nearest convex energy does without the stairs; that it is far away, and how little is known, is said.
    let (_, report) = FluxMap::new(&stairs).unwrap_or_else(|error| panic!("{error}"));
    assert!(report.convexity.is_some_and(|away| away > 2e-3), "{report:?}");
    assert!(report.distance[1] > 5e-3 && report.errors.too_coarse(), "{report:?}");
    assert!(report.errors.at([-8.0, 0.0])[0] > 0.02, "{report:?}");
}

#[test]
fn regress_uneven_steps_are_named_and_do_not_pass_for_bad_data() {
    let motor = built_in("paper-5k5").expect("built in");
    let uneven = |least: f64| vec![-8.0, -6.0, -4.0, -2.0, 0.0, least, 2.0, 4.0, 6.0, 8.0];
    let map = |d: &[f64], q: &[f64]| FluxMap::new(&sampled(motor.magnetics.core(), d, q));
    let (good, l) = (axis(8.0, 9), motor.magnetics.inductance());
    let error = map(&good, &uneven(0.025)).expect_err("must be refused").to_string();
    let steps = "steps of i_q from 0.025 A (from 0 to 0.025 A) to 2 A (from 6 to 8 A), 80 : 1";
    assert!(error.contains(steps) && error.contains("at most 20 : 1"), "{error}");
    // What is let through is computed well.
    let (map, _) = map(&uneven(0.1), &uneven(0.11)).expect("a map");
    let got = MagneticCircuit::new(crate::Core::Map(map)).expect("a state at rest").inductance();
    assert!((got.xx / l.xx - 1.0).abs() < 1e-3 && (got.yy / l.yy - 1.0).abs() < 1e-3, "{got:?} {l:?}");
}

#[test]
fn law_the_end_of_a_map_is_that_of_its_own_currents_also_with_a_hot_magnet() {
    let motor = built_in("paper-5k5").expect("built in");
    let grid = axis(12.0, 15);
    let (map, _) = FluxMap::new(&sampled(motor.magnetics.core(), &grid, &grid)).expect("a map");
    let cold = MagneticCircuit::new(crate::Core::Map(map.clone())).expect("a state at rest");
    let flux_5 = 0.01 * cold.rest(Heading::ZERO).d;
    let distorted = cold.clone().with_harmonics(crate::Harmonics { flux_5, ..crate::Harmonics::default() });
    for circuit in [cold.with_magnet(0.95), distorted.with_magnet(0.95)].map(|hot| hot.expect("convex")) {
        // 5 % of the flux are 2.1 A less magnetisation: more current along +d is known, and less along −d.
        let [[low, high], q] = circuit.range().expect("a map");
        assert!((low + 12.0 - 2.1).abs() < 0.05 && (high - 12.0 - 2.1).abs() < 0.05, "{low} {high}");
        assert!(q.iter().zip([-12.0, 12.0]).all(|(end, own)| (end - own).abs() < 1e-3), "{q:?}");
        for current in [low + 0.01, high - 0.01] {
            let flux = circuit.flux_at(Dq::new(current, 0.0), Heading::ZERO).expect("inside");
            let state = circuit.state(flux, Heading::ZERO);
            let own = map.current(state.core_flux);
            assert!((state.core_current - own).norm() < 1e-12, "{state:?} {own:?}");
            assert!((circuit.margin(&state) - map.margin(own)).abs() < 1e-12 && map.margin(own) < 0.011);
        }
        for current in [low - 0.02, high + 0.02] {
            let error =
                circuit.flux_at(Dq::new(current, 0.0), Heading::ZERO).expect_err("beyond").to_string();
            let range = [low, high].map(standstill_quantity::short);
            assert!(error.contains(&format!("i_d from {} to {} A", range[0], range[1])), "{error}");
        }
    }
}

#[test]
fn law_no_current_flows_without_voltage_also_in_a_hot_magnet_that_is_off_its_axis() {
    let motor = built_in("cross-saturation").expect("built in");
    let grid = axis(12.0, 15);
    // Half a degree: what is left of the search for the axis.
    let (map, _) = FluxMap::new(&off_axis(motor.magnetics.core(), &grid, 0.5)).expect("a map");
    let cold = MagneticCircuit::new(crate::Core::Map(map)).expect("a state at rest");
    let hot = cold.with_magnet(0.9).expect("convex");
    let (before, after) = (cold.rest(Heading::ZERO), hot.rest(Heading::ZERO));
    assert!((after - before * 0.9).norm() < 1e-12 && before.q.abs() > 1e-3, "{before:?} {after:?}");
    let left = hot.state(after, Heading::ZERO).current;
    assert!(left.norm() < 1e-9, "{left:?}");
    let found = hot.flux_at(Dq::new(0.0, 0.0), Heading::ZERO).expect("inside");
    assert!((found - after).norm() < 1e-9, "{found:?} {after:?}");
}

#[test]
fn law_a_magnet_off_its_axis_is_told_and_beyond_a_degree_refused() {
    let grid = axis(12.0, 15);
    let of = |name: &str, degrees: f64| {
        let motor = built_in(name).expect("built in");
        FluxMap::new(&off_axis(motor.magnetics.core(), &grid, degrees))
    };
    for degrees in [-0.8, 0.0, 0.8] {
        let (_, report) = of("cross-saturation", degrees).expect("a map");
        assert!((report.off_axis - degrees).abs() < 1e-6, "{degrees}: {}", report.off_axis);
    }
    for degrees in [-5.0, 2.0, 9.9] {
        let error = of("cross-saturation", degrees).expect_err("must be refused").to_string();
        let found = format!("found flux without current at {degrees:.2}° from d");
        assert!(error.contains(&found) && error.contains("within 1° of +d"), "{error}");
        assert!(error.contains(&format!("axes turned by {degrees:.2}°")), "{error}");
    }
    let (_, report) = of("reluctance-6k7", 0.0).expect("a map");
    assert_eq!((report.axes, report.off_axis), (MapAxes::NoMagnet, 0.0));
}
