//! Maps of one side of the d-axis.

use super::*;
use crate::{Core, Motor, PolarityPoint, PoleKnowledge};

/// The map of a built-in motor for i_d ≤ 0, or ≥ 0, and these i_q, continued.
fn continued(motor: &Motor, positive: bool, q: &[f64]) -> (FluxMap, MapReport) {
    let reach = 1.1 * motor.rated_current;
    let side = |i: &f64| if positive { *i > -1e-6 * reach } else { *i < 1e-6 * reach };
    let d: Vec<f64> = axis(reach, 23).into_iter().filter(side).collect();
    FluxMap::continued(&sampled(motor.magnetics.core(), &d, q)).expect("a map")
}

fn both(motor: &Motor) -> Vec<f64> {
    axis(1.1 * motor.rated_current, 23)
}

fn difference(magnetics: &MagneticCircuit, current: f64) -> f64 {
    PolarityPoint::of(magnetics, current).expect("within the map").difference()
}

#[test]
fn law_the_spread_of_what_fits_contains_the_pole_that_was_not_in_the_data() {
    // One pole that is assumed, and one that stays open.
    the_spread_contains_the_pole_of(&["paper-5k5", "pm-reluctance"]);
}

#[test]
#[ignore = "all motors; two run by default: scripts/test-all.sh long"]
fn law_the_spread_of_what_fits_contains_the_pole_of_each_motor() {
    the_spread_contains_the_pole_of(&crate::built_in_names().collect::<Vec<_>>());
}

fn the_spread_contains_the_pole_of(names: &[&str]) {
    let motors = names.iter().map(|name| built_in(name).expect("built in"));
    // What a sheet does not tell of the poles, its core does not either.
    for motor in motors.filter(|motor| motor.has_magnet() && !motor.pole_knowledge().is_open()) {
        let name = &motor.name;
        let (map, report) = continued(&motor, false, &both(&motor));
        let continuation = report.continued.expect("one side");
        let truth = difference(&motor.magnetics, motor.rated_current);
        let spread = continuation.spread(&map, motor.rated_current);
        let contains = |low: f64, high: f64| low - 1e-3 < truth && truth < high + 1e-3;
        assert!(
            spread.iter().any(|kind| contains(kind.difference[0], kind.difference[1])),
            "{name}: {truth} {spread:?}"
        );
        let known = match motor.name.as_str() {
            // Cores with bridges fit its negative side to a thousandth and say either pole; or they say one pole, and its
            // difference only to a factor of more than ten.
            "pm-reluctance" | "cross-saturation" => PoleKnowledge::NotDetermined,
            _ => PoleKnowledge::Assumed,
        };
        assert_eq!(map.pole(motor.rated_current), known, "{name}: {spread:?}");
        // What the map simulates is one of them.
        let simulated =
            difference(&MagneticCircuit::new(Core::Map(map)).expect("a core"), motor.rated_current);
        assert!(known != PoleKnowledge::Assumed || simulated * truth > 0.0, "{name}: {simulated} {truth}");
    }
}

#[test]
fn law_the_side_of_the_data_stays_what_it_was() {
    let motor = built_in("pm-reluctance").expect("built in");
    let rated = motor.rated_current;
    for positive in [false, true] {
        let (map, report) = continued(&motor, positive, &both(&motor));
        let sign = if positive { 1.0 } else { -1.0 };
        assert_eq!(report.size, [23, 23]);
        assert!(report.continued.is_some());
        for (d, q) in [(0.2, 0.3), (0.5, -0.8), (1.0, 0.0), (0.9, 0.9)] {
            let current = Dq::new(sign * d, q) * rated;
            let flux = motor.magnetics.core().flux_at(current).expect("convex");
            let off = (map.current(flux) - current).norm();
            assert!(off < 5e-3 * rated, "{current:?}: {off} A");
        }
    }
}

#[test]
fn law_a_quadrant_is_mirrored_and_continued_and_a_whole_map_is_neither() {
    let motor = built_in("paper-5k5").expect("built in");
    let q: Vec<f64> = both(&motor).into_iter().filter(|i| *i > -1e-6).collect();
    let (map, report) = continued(&motor, false, &q);
    assert_eq!((report.mirrored, report.size), ([false, true], [23, 23]));
    assert_eq!(map.pole(motor.rated_current), PoleKnowledge::Assumed);
    // As far as the data reach there is nothing to assume.
    let whole = sampled(motor.magnetics.core(), &both(&motor), &both(&motor));
    let (with, report) = FluxMap::continued(&whole).expect("a map");
    assert_eq!((report.continued, with.pole(motor.rated_current)), (None, PoleKnowledge::Known));
    assert_eq!(with, FluxMap::new(&whole).expect("a map").0);
    // A file that covers more than a motor uses says all that matters.
    let reach = 1.1 * motor.rated_current;
    let wide: Vec<f64> = (-20..=11).map(|k| 0.1 * f64::from(k) * reach).collect();
    let (map, _) = FluxMap::continued(&sampled(motor.magnetics.core(), &wide, &both(&motor))).expect("a map");
    assert_eq!(map.pole(motor.rated_current), PoleKnowledge::Known);
    assert_eq!(map.pole(1.5 * motor.rated_current), PoleKnowledge::Assumed);
}

#[test]
fn law_what_no_core_describes_is_not_continued() {
    // An inductance that rises with the current along q.
    let d: Vec<f64> = (-10..=0).map(f64::from).collect();
    let q: Vec<f64> = (-10..=10).map(f64::from).collect();
    let mut samples = sampled(built_in("paper-5k5").expect("built in").magnetics.core(), &d, &q);
    for p in &mut samples.points {
        p.psi_q = (2e-3 + 2e-3 * p.i_q.abs()) * p.i_q;
    }
    let error = FluxMap::continued(&samples).expect_err("no core").to_string();
    assert!(error.contains("no algebraic core fits"), "{error}");
}
