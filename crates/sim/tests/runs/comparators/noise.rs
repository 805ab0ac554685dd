//! Noise at a comparator: how much the captured times scatter, and the first crossing of noise with a bandwidth.

use std::f64::consts::PI;

use super::*;

#[test]
fn law_noise_has_the_stated_size_in_time() {
    let motor = motor().linearised();
    let settings = ComparatorSettings { noise: 0.02, ..TIMER };
    let case = Case { streams: Streams::new(3, 5), ..case(&motor, false, settings) };
    let commands: Vec<_> = (0..400).map(|_| until(4.0, vector(0))).collect();
    let (readings, _) = readings(&case, &commands);
    let times: Vec<f64> =
        readings.iter().map(|reading| f64::from(reading.capture.expect("tripped").ticks) * 1e-12).collect();
    let mean = times.iter().sum::<f64>() / 400.0;
    let rms = (times.iter().map(|time| (time - mean).powi(2)).sum::<f64>() / 399.0).sqrt();
    let expected = time_to(&motor, 0.0, 0, 4.02) - time_to(&motor, 0.0, 0, 4.0);
    assert!((rms / expected - 1.0).abs() < 0.15, "{rms} {expected}");
}

/// The first crossing of noise with a bandwidth against another program of it: rand_distr's normals, the current in closed form.
#[test]
fn cross_fast_noise_trips_at_its_first_crossing() {
    use rand_chacha::rand_core::SeedableRng as _;
    use rand_distr::{Distribution, StandardNormal};
    let motor = motor().linearised();
    let (noise, threshold) = (0.05, 2.0);
    let plain = time_to(&motor, 0.0, 0, threshold);
    // So near the threshold the current rises evenly: its time constant is milliseconds.
    let slope = 0.2 / (time_to(&motor, 0.0, 0, threshold + 0.1) - time_to(&motor, 0.0, 0, threshold - 0.1));
    let mut spreads = Vec::new();
    for bandwidth in [1e4, 1e6, 5e6] {
        let settings = ComparatorSettings { noise, noise_bandwidth: bandwidth, ..TIMER };
        let here: Vec<f64> = (0..400)
            .map(|trial| {
                let case = Case { streams: Streams::new(5, trial), ..case(&motor, false, settings) };
                let (readings, _) = readings(&case, &[until(threshold, vector(0))]);
                f64::from(readings[0].capture.expect("tripped").ticks) * 1e-12 - plain
            })
            .collect();
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(7);
        let hold = 0.25 / (2.0 * PI * bandwidth);
        let kept = (-0.25_f64).exp();
        let there: Vec<f64> = (0..8000)
            .map(|_| {
                let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
                let mut begin = -6.0 * noise / slope;
                let mut value = noise * normal();
                loop {
                    // Within a value's time the current rises to the level, or has been above it from the first.
                    let trip = begin.max(-value / slope);
                    if trip <= begin + hold {
                        return trip;
                    }
                    begin += hold;
                    value = kept * value + noise * (1.0 - kept * kept).sqrt() * normal();
                }
            })
            .collect();
        let of = |times: &[f64]| {
            let mean = times.iter().sum::<f64>() / times.len() as f64;
            let square = times.iter().map(|time| (time - mean).powi(2)).sum::<f64>() / times.len() as f64;
            (mean, square.sqrt())
        };
        let ((mean, spread), (expected, width)) = (of(&here), of(&there));
        assert!((mean - expected).abs() < 4.0 * width / 400.0_f64.sqrt(), "{bandwidth}: {mean} {expected}");
        assert!((spread / width - 1.0).abs() < 0.15, "{bandwidth}: {spread} {width}");
        spreads.push((mean, spread));
    }
    // Slow noise is one draw a pulse; fast noise trips earlier and scatters less.
    assert!(
        (spreads[0].1 * slope / noise - 1.0).abs() < 0.15 && spreads[0].0.abs() * slope < 0.3 * noise,
        "{spreads:?}"
    );
    assert!(spreads[2].0 < spreads[1].0 && spreads[2].1 < 0.7 * spreads[0].1, "{spreads:?}");
}
