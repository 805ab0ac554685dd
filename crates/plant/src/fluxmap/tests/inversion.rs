//! Every point of a map has its flux.

use std::fmt::Write as _;
use std::path::Path;

use standstill_files::Files;

use super::*;

/// Numbers from 0 to 1.
fn uniform(mut state: u64) -> impl FnMut() -> f64 {
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// The current's distance in A, of 2,000 random points and the four corners, from the one that was asked for.
fn worst(map: &FluxMap) -> f64 {
    let [[d_low, d_high], [q_low, q_high]] = map.range();
    let mut uniform = uniform(0x9e37_79b9_7f4a_7c15);
    let mut random = || Dq::new(d_low + (d_high - d_low) * uniform(), q_low + (q_high - q_low) * uniform());
    let corners = [d_low, d_high].into_iter().flat_map(|d| [q_low, q_high].map(|q| Dq::new(d, q)));
    let currents: Vec<Dq<f64>> = corners.chain((0..2_000).map(|_| random())).collect();
    let off = |current: &Dq<f64>| {
        let flux = map.flux_at(*current).unwrap_or_else(|error| panic!("{error}"));
        (map.current(flux) - *current).norm()
    };
    currents.iter().map(off).fold(0.0, f64::max)
}

#[test]
fn law_every_point_of_a_map_has_its_flux() {
    for name in ["paper-5k5", "pm-reluctance", "reluctance-6k7", "cross-saturation"] {
        let motor = built_in(name).expect("built in");
        // Where a map reaches furthest its core is least like a straight line; one motor has the smaller maps as well.
        let shares = if name == "cross-saturation" { &[0.5, 1.5, 3.0][..] } else { &[3.0] };
        for share in shares.iter().copied() {
            let grid = axis(share * motor.rated_current, 21);
            let mut samples = sampled(motor.magnetics.core(), &grid, &grid);
            for noisy in [false, true] {
                if noisy && share != 1.5 {
                    continue;
                }
                if noisy {
                    add_noise(&mut samples, 1e-3, 7);
                }
                let (map, _) =
                    FluxMap::new(&samples).unwrap_or_else(|error| panic!("{name} {share} {error}"));
                let worst = worst(&map);
                assert!(worst < 1e-9, "{name} {share} {noisy}: {worst} A");
            }
        }
    }
}

#[test]
fn law_every_point_of_a_map_that_was_made_convex_or_continued_has_its_flux() {
    let (convex, report) = &*super::convexity::MADE_CONVEX;
    assert!(report.convexity.is_some(), "{report:?}");
    let motor = built_in("cross-saturation").expect("built in");
    let grid = axis(1.5 * motor.rated_current, 21);
    let half: Vec<f64> = grid.iter().copied().filter(|i| *i < 1e-6).collect();
    let side = sampled(motor.magnetics.core(), &half, &grid);
    let (continued, report) = FluxMap::continued(&side).unwrap_or_else(|error| panic!("{error}"));
    assert!(report.continued.is_some(), "{report:?}");
    for (name, map) in [("made convex", convex), ("continued", &continued)] {
        let worst = worst(map);
        assert!(worst < 1e-9, "{name}: {worst} A");
    }
}

#[test]
fn law_every_point_of_a_map_of_any_layout_has_its_flux() {
    let read = |path: &Path| {
        let samples = MapSamples::read(path, &Files::default()).unwrap_or_else(|error| panic!("{error}"));
        FluxMap::new(&samples).unwrap_or_else(|error| panic!("{error}")).0
    };
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../files/tests/maps");
    for name in ["axes.npz", "meshes.npz", "flat_v5.mat", "model_v7.mat", "model_v73.mat"] {
        let worst = worst(&read(&folder.join(name)));
        assert!(worst < 1e-9, "{name}: {worst} A");
    }
    let motor = built_in("cross-saturation").expect("built in");
    let mut polar = "i_A,angle_from_d_deg,psi_d_Wb,psi_q_Wb\n".to_owned();
    for amplitude in axis(12.0, 33).into_iter().filter(|i| *i > -1e-9) {
        for angle in (-180..180).step_by(10) {
            let (sin, cos) = f64::from(angle).to_radians().sin_cos();
            let flux =
                motor.magnetics.core().flux_at(Dq::new(amplitude * cos, amplitude * sin)).expect("convex");
            let _ = writeln!(polar, "{amplitude},{angle},{},{}", flux.d, flux.q);
        }
    }
    let scratch = tempfile::tempdir().expect("a folder");
    let path = scratch.path().join("polar.csv");
    std::fs::write(&path, polar).expect("writes");
    let map = read(&path);
    assert!(map.reach() > 8.0, "{}", map.reach());
    let worst = worst(&map);
    assert!(worst < 1e-9, "polar: {worst} A");
}

#[test]
fn law_a_circuit_finds_the_flux_of_every_current_of_its_map() {
    let motor = built_in("pm-reluctance").expect("built in");
    let grid = axis(2.5 * motor.rated_current, 19);
    let (map, _) = FluxMap::new(&sampled(motor.magnetics.core(), &grid, &grid)).expect("a map");
    let reach = map.reach();
    let plain = MagneticCircuit::new(crate::Core::Map(map)).expect("a state at rest");
    let harmonics = crate::Harmonics { inductance_4: 0.5e-3, flux_5: 2e-3, ..crate::Harmonics::default() };
    let hot = plain.with_magnet(0.9).expect("convex");
    let mut uniform = uniform(77);
    for circuit in [plain.clone(), hot, plain.with_harmonics(harmonics)] {
        let [d, q] = circuit.range().expect("a map");
        for _ in 0..2_000 {
            let within = |[low, high]: [f64; 2], share: f64| low + (high - low) * (0.05 + 0.9 * share);
            let current = Dq::new(within(d, uniform()), within(q, uniform()));
            let at = Heading::of(6.3 * uniform());
            let flux = circuit.flux_at(current, at).unwrap_or_else(|error| panic!("{error}"));
            let off = (circuit.state(flux, at).current - current).norm();
            assert!(off < 1e-9 * reach, "{current:?}: {off}");
        }
    }
}
