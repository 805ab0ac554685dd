//! The nearest convex co-energy, for data that are not convex.

use std::sync::LazyLock;

use super::*;

/// A map of a motor that saturates hard: twice the rated current.
fn saturated() -> MapSamples {
    let motor = built_in("pm-reluctance").expect("built in");
    let grid = axis(2.0 * motor.rated_current, 21);
    sampled(motor.magnetics.core(), &grid, &grid)
}

/// The same with a dip that no convex energy has.
fn bent() -> MapSamples {
    let mut samples = saturated();
    // A bump of the co-energy in one place, wider than a point, so that it is no noise: its inductances at the top are
    // −2 × 0.08/6 H, more than the motor's L_d of 17 mH.
    for p in &mut samples.points {
        let off = ((p.i_d + 10.0).powi(2) + (p.i_q - 10.0).powi(2)) / 6.0;
        let bump = -0.08 * 2.0 / 6.0 * (-off).exp();
        p.psi_d += bump * (p.i_d + 10.0);
        p.psi_q += bump * (p.i_q - 10.0);
    }
    samples
}

/// Its map, which takes seconds.
pub(super) static MADE_CONVEX: LazyLock<(FluxMap, MapReport)> =
    LazyLock::new(|| FluxMap::new(&bent()).unwrap_or_else(|error| panic!("{error}")));

#[test]
fn law_where_the_nearest_energy_is_not_convex_the_nearest_convex_one_is_simulated() {
    let (own, exact) = FluxMap::new(&saturated()).expect("a map");
    assert_eq!(exact.convexity, None);
    let largest = exact.largest_flux;
    let (map, report) = &*MADE_CONVEX;
    let away = report.convexity.expect("it is not convex");
    assert!(away > 1e-5 * largest && away < 0.01 * largest, "{away} {largest}");
    for d in axis(17.0, 35) {
        for q in axis(17.0, 35) {
            let flux = map.flux_at(Dq::new(d, q)).expect("inside");
            let (_, gamma) = map.current_and_inverse_inductance(flux);
            assert!(gamma.is_positive_definite(), "{d} {q}");
        }
    }
    // Far from the dip nothing changes.
    let flux = own.flux_at(Dq::new(9.0, -9.0)).expect("inside");
    assert!((map.current(flux) - Dq::new(9.0, -9.0)).norm() < 0.05);
}

#[test]
fn law_noisy_maps_of_every_motor_are_read() {
    let noises = [(1e-3, 1), (2e-3, 2)];
    let motors = ["paper-5k5", "pm-reluctance", "reluctance-6k7", "cross-saturation"];
    for (name, (share, seed)) in motors.into_iter().zip(noises.into_iter().cycle()) {
        let motor = built_in(name).expect("built in");
        let grid = axis(3.0 * motor.rated_current, 25);
        let mut samples = sampled(motor.magnetics.core(), &grid, &grid);
        add_noise(&mut samples, share, seed);
        let (map, report) = FluxMap::new(&samples).unwrap_or_else(|error| panic!("{name} {share}: {error}"));
        let noise = report.noise / (share * report.largest_flux);
        assert!((noise - 1.0).abs() < 0.15, "{name} {share} {noise}");
        let corner = Dq::new(grid[0], grid[24]);
        let off = (map.current(map.flux_at(corner).expect("inside")) - corner).norm();
        assert!(off < 1e-9, "{name} {share} {off}");
    }
}
