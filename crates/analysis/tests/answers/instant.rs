//! The instant for which an angle holds.

use standstill_scenario::Record;

use crate::turning::{electrical, starts};

/// Starts at the speeds `rpm` and `-rpm` from the same angles, without errors of the drive: half of the difference of their axis errors, as a
/// time in s. What does not depend on the speed cancels. The first number is the lateness at the end of the detection, the second one that
/// at the stated instant.
fn lateness(method: &str, rpm: f64, keys: &[(&str, &str)], trials: u64) -> Vec<[f64; 2]> {
    let keys = [&[("detector.checks", "false")], keys].concat();
    let [forward, backward] = [rpm, -rpm].map(|rpm| {
        let mut all = starts("paper-5k5", method, "none", rpm, &keys, trials);
        all.sort_by_key(|record| record.trial);
        all
    });
    let speed = electrical(rpm);
    let error = |record: &Record| record.axis_error_deg().map(f64::to_radians);
    let both = forward.iter().zip(&backward);
    both.filter_map(|(forward, backward)| {
        let late = (error(backward)? - error(forward)?) / (2.0 * speed);
        let age = (forward.findings().age? + backward.findings().age?) / 2.0;
        Some([late, late - age])
    })
    .collect()
}

fn mean_and_deviation(of: &[f64]) -> (f64, f64) {
    let mean = of.iter().sum::<f64>() / of.len() as f64;
    (mean, (of.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / of.len() as f64).sqrt())
}

type Keys = &'static [(&'static str, &'static str)];

/// The timer of comparators without a tick to speak of.
const TIMER: (&str, &str) = ("sensors.timer", "1 ns");

/// Each method is late by the age that it states: the mean over the angles by less than 2 % of it, single angles by the share in the table.
/// Pulses both ways cancel what the magnet induces. Unidirectional ones, and vectors given once, leave a part of it that changes with the angle
/// and has no mean. The vectors of `subdivision` have steps of the angle, which its answer follows.
#[test]
fn law_an_axis_is_late_by_its_age() {
    let cases: [(&str, Keys, f64); 12] = [
        ("bipolar", &[], 0.01),
        ("maximum-likelihood", &[], 0.01),
        ("maximum-likelihood-adaptive", &[], 0.01),
        ("hfi-rotating", &[], 0.015),
        ("hfi-pulsating", &[], 0.015),
        ("six-pulse", &[TIMER, ("detector.rounds", "2")], 0.015),
        ("six-pulse", &[("detector.rounds", "2")], 0.03),
        ("six-pulse", &[TIMER], 0.06),
        ("open-terminal", &[("sensors.terminals", "true")], 0.2),
        ("line-inductance-fast", &[], 0.02),
        ("line-inductance", &[], 0.03),
        ("subdivision", &[], 0.6),
    ];
    for (method, keys, share) in cases {
        let found = lateness(method, 0.5, keys, 60);
        let of = |k: usize| mean_and_deviation(&found.iter().map(|of| of[k]).collect::<Vec<_>>());
        let ((late, spread), (rest, left)) = (of(0), of(1));
        let said =
            format!("{method} {keys:?}: {late:.6} ± {spread:.6} s, at its instant {rest:.6} ± {left:.6} s");
        assert!(found.len() >= 55, "{said}: {}", found.len());
        assert!(
            rest.abs() < 0.01 * late + 3.0 * left / (found.len() as f64).sqrt() && rest.abs() < 0.1 * late,
            "{said}"
        );
        assert!(left < share * late, "{said}");
    }
}
