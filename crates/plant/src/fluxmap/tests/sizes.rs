//! Maps of any size.

use super::*;

/// ψ of a motor that saturates, from a co-energy.
fn flux(d: f64, q: f64) -> [f64; 2] {
    let (x, y) = (d / 20.0, q / 15.0);
    [0.3 + 0.2 * x.tanh() - 0.005 * x * y * y, 0.3 * y.tanh() - 0.005 * 20.0 / 15.0 * x * x * y]
}

fn map_of(count: i32) -> MapSamples {
    let mut points = Vec::new();
    for i_d in axis(20.0, count) {
        for i_q in axis(20.0, count) {
            let [psi_d, psi_q] = flux(i_d, i_q);
            points.push(MapPoint { i_d, i_q, psi_d, psi_q, place: Place::Element(points.len() + 1) });
        }
    }
    MapSamples { file: "map.npz".to_owned(), points, pole_pairs: None, resistance: None }
}

/// Processor time in s that this thread has had, and the most memory in kB that its process has; none where the system does not
/// say so.
fn used() -> Option<(f64, u64)> {
    let time = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let peak =
        status.lines().find_map(|line| line.strip_prefix("VmHWM:")?.split_whitespace().next()?.parse().ok());
    Some((time.split_whitespace().next()?.parse::<f64>().ok()? * 1e-9, peak?))
}

/// The map of these samples, within 30 s and 2 GB.
fn made(samples: &MapSamples) -> (FluxMap, MapReport) {
    let before = used();
    let made = FluxMap::new(samples).unwrap_or_else(|error| panic!("{error}"));
    if let (Some((before, _)), Some((after, memory))) = (before, used()) {
        eprintln!("{} points: {:.1} s, {} MB", samples.points.len(), after - before, memory / 1000);
        assert!(after - before < 30.0, "{} points: {} s", samples.points.len(), after - before);
        assert!(memory < 2_000_000, "{} points: {memory} kB", samples.points.len());
    }
    made
}

/// L_d without current.
fn at_rest(map: &FluxMap) -> f64 {
    let rest = map.flux_at(Dq::new(0.0, 0.0)).expect("inside");
    map.current_and_inverse_inductance(rest).1.inverse().xx
}

const INDUCTANCE: f64 = 0.2 / 20.0;

fn a_map_is_read_with_noise(count: i32) {
    let mut noisy = map_of(count);
    add_noise(&mut noisy, 1e-3, 3);
    let (map, report) = made(&noisy);
    assert!((report.noise / (1e-3 * report.largest_flux) - 1.0).abs() < 0.05, "{report:?}");
    assert_eq!(report.size, [usize::try_from(count).expect("positive"); 2]);
    assert!((at_rest(&map) / INDUCTANCE - 1.0).abs() < 0.01, "{}", at_rest(&map));
}

#[test]
fn law_a_map_of_hundreds_of_values_a_side_is_read_with_noise() {
    a_map_is_read_with_noise(400);
}

#[test]
#[ignore = "six times the points of the test that runs by default: scripts/test-all.sh long"]
fn law_a_map_of_the_largest_size_is_read_with_noise() {
    a_map_is_read_with_noise(1024);
}

#[test]
fn law_a_map_is_read_where_it_is_not_convex() {
    a_map_is_read_where_it_is_not_convex(49);
}

#[test]
#[ignore = "seven times the points of the test that runs by default: scripts/test-all.sh long"]
fn law_a_large_map_is_read_where_it_is_not_convex() {
    // The points of any larger one go into as many splines, and the search is among those.
    a_map_is_read_where_it_is_not_convex(129);
}

fn a_map_is_read_where_it_is_not_convex(count: i32) {
    let mut bent = map_of(count);
    // A bump of the co-energy: an inductance of −2 × 0.025/4 H at its top, where the motor has 8.6 mH.
    for p in &mut bent.points {
        let off = ((p.i_d - 8.0).powi(2) + (p.i_q - 5.0).powi(2)) / 4.0;
        let bump = -0.025 * 2.0 / 4.0 * (-off).exp();
        p.psi_d += bump * (p.i_d - 8.0);
        p.psi_q += bump * (p.i_q - 5.0);
    }
    let (_, report) = made(&bent);
    assert!(report.convexity.is_some(), "{report:?}");
}

#[test]
fn law_maps_of_few_and_of_many_values_a_side_are_read() {
    maps_are_read(&[(7, 0.1), (31, 1e-3), (64, 2e-4)], 65);
}

#[test]
#[ignore = "larger maps: scripts/test-all.sh long"]
fn law_maps_of_hundreds_of_values_a_side_are_read() {
    // Half a map with as many values as are allowed.
    maps_are_read(&[(128, 1e-4)], 257);
}

/// Maps of so many values a side with the error of their inductance, and half a map.
fn maps_are_read(sizes: &[(i32, f64)], half_size: i32) {
    for &(count, within) in sizes {
        let samples = map_of(count);
        let (map, report) = made(&samples);
        assert!((at_rest(&map) / INDUCTANCE - 1.0).abs() < within, "{count}: {}", at_rest(&map));
        assert_eq!(report.size, [usize::try_from(count).expect("positive"); 2]);
    }
    // The other half is that of the first.
    let mut half = map_of(half_size);
    half.points.retain(|p| p.i_q >= 0.0);
    let (_, report) = FluxMap::new(&half).unwrap_or_else(|error| panic!("{error}"));
    let size = usize::try_from(half_size).expect("positive");
    assert_eq!((report.size, report.mirrored), ([size; 2], [false, true]));
}
