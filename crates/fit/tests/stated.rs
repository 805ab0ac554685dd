//! Records that state the rotor's angle, and records that a fit has not seen. The plant of the records is the test's own integration of
//! u = R i + dψ/dt, ψ_d = L_d i_d, ψ_q = L_q i_q with 10 mH and 16 mH.
#![allow(clippy::disallowed_methods, reason = "tests compare with the C library")]

#[allow(dead_code, reason = "of the scope, only what these records need")]
mod scope;

use scope::{Scope, beside};
use standstill_fit::record::Record;
use standstill_fit::{Estimate, Fit, FitError, fit};

const LOW: [&str; 3] = ["low"; 3];
const ALONG_A: [&str; 3] = ["high", "low", "low"];
const AGAINST_A: [&str; 3] = ["low", "high", "high"];
const ALONG_B: [&str; 3] = ["low", "high", "low"];

/// A pulse with the rotor at an angle in degrees, as a scope has it, with the angle in degrees that it states.
fn record(file: &str, angle: f64, vector: [&'static str; 3], stated: Option<f64>) -> Record {
    let stages = [(50e-6, LOW), (200e-6, vector), (300e-6, LOW)];
    let scope = Scope { gain: [1.0; 3], delay: 0.0, ..Scope::of(12.0) };
    let text = scope::ideal(angle, 0.0, &stages).text(&scope, 7);
    let with = |(k, line): (usize, &str)| match stated {
        Some(_) if k == 0 => format!("{line},angle_deg\n"),
        Some(stated) => format!("{line},{stated}\n"),
        None => format!("{line}\n"),
    };
    Record::parse(file, &text.lines().enumerate().map(with).collect::<String>()).expect("a record")
}

fn fitted(records: &[Record]) -> Fit {
    fit(records, &scope::start(None, 1), &|| false).expect("a motor")
}

fn estimate<'a>(fit: &'a Fit, name: &str) -> &'a Estimate {
    fit.parameters.iter().find(|estimate| estimate.name == name).expect("an estimate")
}

/// Two pulses at each of three angles, as an encoder off by `zero` degrees states them.
fn turned(zero: f64) -> Vec<Record> {
    let angles = [20.0, 65.0, -110.0];
    let both =
        |angle: f64| [ALONG_A, ALONG_B].map(|vector| record("t.csv", angle, vector, Some(angle + zero)));
    angles.into_iter().flat_map(both).collect()
}

/// One motor describes pulses at several angles, where the records state these; an encoder's zero shows.
#[test]
fn law_pulses_at_several_stated_angles_are_of_one_motor() {
    for zero in [0.0, 3.0] {
        let found = fitted(&turned(zero));
        assert!(
            found.residual_rms < 0.02 * found.current_rms,
            "{} {}",
            found.residual_rms,
            found.current_rms
        );
        for (name, truth) in [("L_d", 10e-3), ("L_q", 16e-3), ("angle", 20.0)] {
            let of = estimate(&found, name);
            let [low, high] = of.interval.expect("an interval");
            let value = beside(of.value, truth, of.unit, 360.0);
            assert!(
                of.identified && (value - truth).abs() < 1.5 * (high - low),
                "{name}: {value}, {low} to {high}"
            );
        }
        assert!(found.pole.stated);
    }
    let unstated = turned(0.0).into_iter().map(|of| Record { angle: None, ..of }).collect::<Vec<_>>();
    let lost = fit(&unstated, &scope::start(None, 1), &|| false);
    assert!(lost.is_err() || lost.is_ok_and(|fit| fit.residual_rms > 0.05 * fit.current_rms));
}

/// Pulses along a known axis tell its inductance and nothing of the other.
#[test]
fn law_pulses_along_a_stated_d_axis_tell_l_d_alone() {
    let both = [ALONG_A, AGAINST_A].map(|vector| record("d.csv", 0.0, vector, Some(0.0)));
    let found = fitted(&both);
    let l_d = estimate(&found, "L_d");
    assert!(l_d.identified && (l_d.value / 10e-3 - 1.0).abs() < 0.01, "{l_d:?}");
    let [l_q, angle] = ["L_q", "angle"].map(|name| estimate(&found, name));
    assert!(!l_q.identified && !angle.identified, "{l_q:?} {angle:?}");
    assert!(angle.value.abs() < 1e-9 && (5e-3..50e-3).contains(&l_q.value), "{l_q:?} {angle:?}");
    // At 90° the same pulses are along q.
    let found = fitted(&[ALONG_A, AGAINST_A].map(|vector| record("q.csv", 90.0, vector, Some(90.0))));
    let l_q = estimate(&found, "L_q");
    assert!(l_q.identified && (l_q.value / 16e-3 - 1.0).abs() < 0.01, "{l_q:?}");
    assert!(!estimate(&found, "L_d").identified);
}

/// Half of the records tell the currents of the other half; a rotor that stands elsewhere than stated shows.
#[test]
fn law_a_fit_predicts_records_that_it_has_not_seen() {
    let all = turned(0.0);
    let found = fitted(&all[..4]);
    let own = found.residual_rms / found.current_rms;
    let start = scope::start(None, 1);
    let share = |record: &Record| {
        let predicted = found.predict(record, &start).expect("a prediction");
        assert!(predicted.traces.iter().all(|trace| trace.time.len() == trace.simulated.len()));
        predicted.residual_rms / predicted.current_rms
    };
    for unseen in &all[4..] {
        assert!(share(unseen) < 1.2 * own, "{} beside {own}", share(unseen));
    }
    // In the records the rotor stands at −110°; L differs by (L_q − L_d) sin 2δ/2 and so on, a tenth of the current for 20°.
    let moved = Record { angle: Some(-90.0_f64.to_radians()), ..all[4].clone() };
    assert!(share(&moved) > 5.0 * own, "{} beside {own}", share(&moved));
    let unstated = Record { angle: None, ..all[4].clone() };
    assert_eq!(
        found.predict(&unstated, &start).expect_err("no angle"),
        FitError::NoAngle("t.csv".to_owned())
    );
    let more = Record { channels: [true; 4], ..all[4].clone() };
    let message = found.predict(&more, &start).expect_err("a new channel").to_string();
    assert!(message.contains("i_link_A"), "{message}");
    let mixed = [all[0].clone(), unstated];
    assert!(matches!(fit(&mixed, &start, &|| false), Err(FitError::NoAngle(_))));
}

/// Large residuals in few rows do not follow each other: the noise at rest shows them.
#[test]
fn law_residuals_far_above_the_noise_at_rest_are_not_described() {
    let found = fitted(&turned(0.0));
    let rest = found.rest_rms.expect("rows at rest");
    assert!(found.describes() && found.misfit().is_none() && found.residual_rms < 1.5 * rest, "{rest}");
    for (times, described) in [(1.9, true), (2.1, false)] {
        let other = Fit { rest_rms: Some(found.residual_rms / times), ..found.clone() };
        assert_eq!((other.describes(), other.misfit().is_none()), (described, described), "{times}");
        assert_eq!(other.sheet("t.csv", None).contains("WARNING"), !described);
    }
    assert!(Fit { rest_rms: None, ..found }.describes());
}

#[test]
fn regress_an_angle_that_moves_within_a_record_is_refused() {
    let stages = [(50e-6, LOW), (200e-6, ALONG_A), (300e-6, LOW)];
    let text = scope::ideal(0.0, 0.0, &stages).text(&Scope::of(12.0), 7);
    let with = |moves: f64| {
        let line = |(k, line): (usize, &str)| match k {
            0 => format!("{line},angle_deg\n"),
            // Across the wrap, where nothing jumps.
            k if k < 40 => format!("{line},359.5\n"),
            _ => format!("{line},{}\n", 0.5 + moves),
        };
        Record::parse("m.csv", &text.lines().enumerate().map(line).collect::<String>())
    };
    let still = with(0.0).expect("a record").angle.expect("an angle").to_degrees();
    assert!((0.0..0.5).contains(&still), "{still}");
    let message = with(5.0).expect_err("moves").to_string();
    let said = "m.csv, line 41, column angle_deg: found 5.5, 6.0° from the first row; needed: a rotor that stands still, within 2°";
    assert!(message.contains(said), "{message}");
}
