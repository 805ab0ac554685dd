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

#[test]
fn law_maps_of_five_to_a_thousand_values_a_side_are_read() {
    let inductance = 0.2 / 20.0;
    for (count, within) in [(7, 0.1), (31, 1e-3), (256, 1e-4), (1024, 1e-4)] {
        let samples = map_of(count);
        let begin = std::time::Instant::now();
        let (map, report) = FluxMap::new(&samples).unwrap_or_else(|error| panic!("{error}"));
        assert!(begin.elapsed().as_secs() < 120, "{count}: {:?}", begin.elapsed());
        eprintln!("{count} values: {:?}, {:?}", begin.elapsed(), report.splines);
        let rest = map.flux_at(Dq::new(0.0, 0.0)).expect("inside");
        let l = map.current_and_inverse_inductance(rest).1.inverse();
        assert!((l.xx / inductance - 1.0).abs() < within, "{count}: {l:?}");
        assert_eq!(report.size, [usize::try_from(count).expect("positive"); 2]);
    }
    // Half a map with as many values as are allowed, and its other half.
    let mut half = map_of(257);
    half.points.retain(|p| p.i_q >= 0.0);
    let (_, report) = FluxMap::new(&half).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((report.size, report.mirrored), ([257, 257], [false, true]));
}
