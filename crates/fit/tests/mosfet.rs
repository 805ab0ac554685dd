//! Motors on MOSFET drives of 12 V, slow probes, cores of another law, and records whose legs are not those of their currents.
//! `examples/fit_coverage.rs` counts the same over many seeds.

#[allow(dead_code, reason = "other tests use the rest")]
mod scope;

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use scope::mosfet::{Bench, Iron, drive, six_vectors};
use scope::{Pulses, Scope};
use standstill_fit::record::{LINK, Record};
use standstill_fit::{DeviceKind, Devices, Estimate, Fit, FitError, MISFIT, Misfit, Start, fit};

fn found(bench: &Bench, scope: &Scope, seed: u64) -> (Pulses, Fit) {
    let pulses = bench.pulses(&six_vectors(bench.pulse(), 2.5 * bench.pulse()));
    let fit = pulses.found(scope, seed, &drive(bench, seed));
    (pulses, fit)
}

fn estimate<'a>(fit: &'a Fit, name: &str) -> &'a Estimate {
    fit.parameters.iter().find(|one| one.name == name).expect("named")
}

/// How far a truth is from its interval's middle, in half widths.
fn off(pulses: &Pulses, scope: &Scope, fit: &Fit, name: &str) -> f64 {
    let one = estimate(fit, name);
    let (truth, [low, high]) = pulses.truth_of(one, scope).zip(one.interval).expect("known");
    let middle = scope::beside(low.midpoint(high), truth, one.unit, 360.0);
    (truth - middle).abs() / ((high - low) / 2.0)
}

/// How far truths are from the middles of their intervals, in half widths: of drawn motors, drives, noise and starts, and these names.
fn offs<const N: usize>(iron: Iron, seeds: u64, names: [&str; N]) -> Vec<[f64; N]> {
    let one = |seed: u64| {
        let interval = 0.5e-6 * (1.0 + 0.08 * (0.618_033_988_75 * (seed + 1) as f64).fract());
        let scope = Scope { interval, delay: 0.3e-6, ..Scope::of(32.0) };
        let (pulses, fit) = found(&Bench::drawn(seed, iron), &scope, seed);
        assert!(fit.converged && fit.misfit().is_none() && fit.pole.identified, "{seed}: {}", fit.widened);
        names.map(|name| off(&pulses, &scope, &fit, name))
    };
    (0..seeds).into_par_iter().map(one).collect()
}

/// An interval contains the truth as often as it says, and is no wider than it need be. Of ten intervals of 95 % fewer than seven hold once in a
/// thousand times; errors are 0.51 of a half width, as rms, if intervals are right. So it is with a core of another law that readings of eight bits
/// hardly tell from the program's laws of iron: before the steep law was among those, the fall of L_d held in none of 64 seeds.
#[test]
fn law_intervals_hold_as_often_as_they_say() {
    const ALWAYS: [&str; 6] = ["L_d", "L_q", "angle", "delay", "dead_time", "resistance_with_switch"];
    let [a, b, c, d, e, f] = ALWAYS;
    let most_hold = |offs: &[Vec<f64>]| {
        for (k, _) in offs[0].iter().enumerate() {
            let of: Vec<f64> = offs.iter().map(|off| off[k]).collect();
            let held = of.iter().filter(|off| **off <= 1.0).count();
            assert!(held >= 7, "number {k}: {held} of 10 hold: {of:?}");
        }
    };
    let are_no_wider = |offs: &[Vec<f64>]| {
        let squares: Vec<f64> = offs.iter().flatten().map(|off| off * off).collect();
        let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        assert!((0.35..0.65).contains(&rms), "{rms} half widths");
    };
    let own = offs(Iron::Series([0.05, 0.02, 0.02]), 10, [a, b, c, d, e, f, "saturation.d", "saturation.q"]);
    let own: Vec<Vec<f64>> = own.into_iter().map(Vec::from).collect();
    most_hold(&own);
    are_no_wider(&own);
    let falls = ["saturation.d", "saturation.minus_d", "saturation.q"];
    let [along, against, across] = falls;
    let other = offs(Iron::Steep([0.0005, 3.0, 6.0]), 10, [a, b, c, d, e, f, along, against, across]);
    let other: Vec<Vec<f64>> = other.into_iter().map(Vec::from).collect();
    most_hold(&other);
    // Intervals of falls contain what several laws say.
    let without_falls: Vec<Vec<f64>> = other.iter().map(|off| off[..ALWAYS.len()].to_vec()).collect();
    are_no_wider(&without_falls);
}

/// All currents of the witness have gone when a pulse begins: diodes carry none back. Before, a step whose two halves had opposite diodes
/// kept up to 3 mA of 20 A, which a fit of readings with twelve bits took for a larger L_q.
#[test]
fn regress_the_witness_has_no_current_at_rest() {
    for seed in 0..4 {
        let bench = Bench::drawn(seed, Iron::Linear);
        let (pulse, rest) = (bench.pulse(), 2.5 * bench.pulse());
        let pulses = bench.pulses(&six_vectors(pulse, rest));
        for before in (0..6).map(|k| 20e-6 + (pulse + rest) * f64::from(k)) {
            let row = pulses.rows.iter().rev().find(|row| row[0] < before - 1e-9).expect("a row");
            assert_eq!(row[1..], [0.0; 4], "{seed} {before}");
        }
    }
}

/// Currents depend on the winding's resistance plus a switch's and on the winding's plus a diode's: three numbers, of which two are identified.
#[test]
fn regress_a_search_on_a_mosfet_drive_ends_and_its_intervals_hold() {
    let scope = Scope { interval: 0.51e-6, codes: 2048.0, ..Scope::of(32.0) };
    for seed in [3, 4] {
        let (pulses, fit) = found(&Bench::drawn(seed, Iron::Linear), &scope, seed);
        assert!(fit.converged && fit.widened < 1.5, "{}", fit.widened);
        assert!(!estimate(&fit, "switch_resistance").identified);
        for name in ["L_d", "L_q", "resistance", "resistance_with_switch", "diode_drop", "dead_time"] {
            assert!(estimate(&fit, name).identified, "{name}");
            let off = off(&pulses, &scope, &fit, name);
            assert!(off < 1.6, "{seed} {name}: {off}");
        }
        let width = |name: &str| {
            let [low, high] = estimate(&fit, name).interval.expect("a value");
            high - low
        };
        assert!(width("resistance_with_switch") < 0.8 * width("resistance"));
    }
}

/// The edges that begin this record's pulses all lie alike between two rows, and so do those that end them, 0.14 intervals later. A dead
/// time that is wrong by as much explains the readings as well; its interval must contain the truth all the same: the difference of
/// two places in an interval has a triangular distribution, half of the weight, and 95 % lie within 0.68 intervals.
#[test]
fn regress_pulses_of_no_whole_number_of_rows_leave_the_dead_time_open() {
    let interval = 0.5e-6 * (1.0 + 0.08 * 0.618_033_988_75);
    let scope = Scope { interval, codes: 2048.0, delay: 0.3e-6, ..Scope::of(32.0) };
    let (pulses, fit) = found(&Bench::drawn(0, Iron::Linear), &scope, 0);
    let one = estimate(&fit, "dead_time");
    let [low, high] = one.interval.expect("a value");
    let half = (high - low) / 2.0 / interval;
    assert!(one.identified && (0.60..0.76).contains(&half), "{half} intervals");
    for name in ["dead_time", "delay", "L_d", "L_q", "diode_drop"] {
        let off = off(&pulses, &scope, &fit, name);
        assert!(off < 1.6, "{name}: {off} half widths");
    }
}

/// Iron that saturates steeply and turns its axes is no core of a fit: it says that the difference is at large currents, and pulses as
/// short as it asks for are described, with L_d, L_q and the angle within their intervals.
#[test]
fn law_a_steep_core_is_named_and_shorter_pulses_of_it_are_described() {
    let bench = Bench::drawn(2, Iron::Steep([0.003, 3.0, 6.0]));
    let scope = Scope { interval: 0.51e-6, delay: 0.3e-6, ..Scope::of(32.0) };
    let (_, fit) = found(&bench, &scope, 2);
    let Some(Misfit::LargeCurrents { above, ratio, pulse, below }) = fit.misfit() else {
        panic!("{:?} {}", fit.misfit(), fit.widened)
    };
    assert!((0.5 * fit.reach..0.7 * fit.reach).contains(&above) && ratio > 2.0, "{above} {ratio}");
    assert!((pulse / bench.pulse() - 0.4).abs() < 0.04 && below < above, "{pulse} {below}");
    let pulses = bench.pulses(&six_vectors(pulse, 2.5 * pulse));
    let fit = pulses.found(&scope, 2, &drive(&bench, 2));
    assert!(fit.converged && fit.widened < MISFIT && fit.misfit().is_none(), "{}", fit.widened);
    assert!(fit.reach < 1.1 * below, "{}", fit.reach);
    for name in ["L_d", "L_q", "angle"] {
        let off = off(&pulses, &scope, &fit, name);
        assert!(off < 2.0, "{name}: {off} half widths");
    }
}

/// A diode's threshold that is stated four deviations of its estimate away from what the currents say is named, one that is stated
/// right is not.
#[test]
fn regress_a_stated_drop_that_the_currents_contradict_is_named() {
    let bench = Bench::drawn(3, Iron::Linear);
    let scope = Scope { interval: 0.51e-6, codes: 2048.0, ..Scope::of(32.0) };
    let pulses = bench.pulses(&six_vectors(bench.pulse(), 2.5 * bench.pulse()));
    let devices = Devices {
        kind: DeviceKind::Mosfet,
        switch_drop: 0.0,
        switch_resistance: bench.channel,
        diode_drop: bench.diode[0],
        diode_resistance: bench.diode[1],
    };
    let right = Start { motor: None, devices, dead_time: bench.dead_time, ..scope::start(None, 0) };
    let fit = pulses.found(&scope, 3, &right);
    assert_eq!(fit.discrepancies, []);
    let one = estimate(&fit, "diode_drop");
    let [low, _] = one.interval.expect("a value");
    let stated = one.value - 4.5 * (one.value - low) / 1.96;
    assert!(stated > 0.6 * bench.diode[0], "a data sheet's drop: {stated}");
    let wrong = Start { devices: Devices { diode_drop: stated, ..devices }, ..right };
    let fit = pulses.found(&scope, 3, &wrong);
    let named = |fit: &Fit| fit.discrepancies.iter().map(|one| one.name.clone()).collect::<Vec<_>>();
    assert_eq!(named(&fit), ["diode_drop"]);
    let one = &fit.discrepancies[0];
    assert!(one.is_stated && (3.0..6.0).contains(&one.deviations), "{one:?}");
    // As a guess it is nothing to wonder about: diodes differ by half.
    let fit = pulses.found(&scope, 3, &Start { stated: Vec::new(), ..wrong });
    assert_eq!(fit.discrepancies, []);
}

/// A low-pass of 20 kHz looks like a delay of 8 µs; its time constant is found, and the sheet does not suffer.
#[test]
fn regress_a_slow_probe_is_no_delay() {
    let bench = Bench::drawn(1, Iron::Series([0.05, 0.02, 0.02]));
    let scope = Scope { interval: 0.51e-6, lag: 8e-6, ..Scope::of(32.0) };
    let (pulses, fit) = found(&bench, &scope, 1);
    for name in ["probe_lag", "L_d", "L_q", "delay"] {
        let off = off(&pulses, &scope, &fit, name);
        assert!(estimate(&fit, name).identified && off < 1.6, "{name}: {off}");
    }
    // Measured only where pulses went.
    for (axis, name) in ["saturation.d", "saturation.minus_d", "saturation.q"].into_iter().enumerate() {
        let one = estimate(&fit, name);
        assert!(
            !one.identified || one.at.expect("a fall") < 1.12 * fit.reached[axis],
            "{one:?} {:?}",
            fit.reached
        );
    }
    let sheet = fit.sheet("p.csv", None);
    let assumed = sheet.matches("extrapolated: the pulses reached").count();
    let beyond = fit.extrapolated().into_iter().filter(|axis| fit.reached[*axis] > 0.1 * fit.current).count();
    assert_eq!(assumed, beyond, "{sheet}");
}

const SHUNT: Scope =
    Scope { interval: 0.51e-6, delay: 0.3e-6, codes: 2048.0, shunt: true, ..Scope::of(32.0) };

/// One shunt in the DC link in place of three sensors: what conducts decides whose current it is, and six vectors tell the motor, its pole
/// and the drive. `examples/fit_coverage.rs` counts its intervals over more seeds.
#[test]
fn cross_one_shunt_in_the_link_tells_the_motor() {
    one_shunt_tells(0..1);
}

#[test]
#[ignore = "more seeds; one runs by default: scripts/test-all.sh long"]
fn cross_one_shunt_in_the_link_tells_three_motors() {
    one_shunt_tells(0..3);
}

fn one_shunt_tells(seeds: std::ops::Range<u64>) {
    let mut held = [0; 2];
    for seed in seeds {
        // As in the example: a clock of the scope's own.
        let interval = 0.5e-6 * (1.0 + 0.08 * (0.618_033_988_75 * (seed + 1) as f64).fract());
        let scope = Scope { interval, ..SHUNT };
        let (pulses, fit) = found(&Bench::drawn(seed, Iron::Series([0.05, 0.02, 0.02])), &scope, seed);
        assert!(fit.converged && fit.widened < 1.5 && fit.pole.identified, "{} {:?}", fit.widened, fit.pole);
        for name in ["L_d", "L_q", "angle", "resistance_with_switch", "dead_time", "saturation.d"] {
            let off = off(&pulses, &SHUNT, &fit, name);
            assert!(estimate(&fit, name).identified && off < 2.0, "{seed} {name}: {off} half widths");
            held = [held[0] + usize::from(off <= 1.0), held[1] + 1];
        }
        // While switches conduct, readings tell R + R_S, while diodes do, R + R_D: of R alone no more is known than from what was stated
        // of both, each within half its value.
        let [low, high] = estimate(&fit, "resistance").interval.expect("a value");
        let devices = drive(&Bench::drawn(seed, Iron::Linear), seed).devices;
        let known =
            [devices.switch_resistance, devices.diode_resistance].map(|stated| 4.0 / (stated * stated));
        let half = known.iter().sum::<f64>().sqrt().recip();
        assert!((high - low) / 2.0 > 0.98 * half, "{seed}: {low} to {high}, {half}");
        // A single channel has no gain beside another's.
        let gains = fit.parameters.iter().filter(|one| one.name.contains("gain")).count();
        assert!(gains == 1 && !estimate(&fit, "common_gain").identified);
    }
    assert!(10 * held[0] >= 9 * held[1], "{held:?}");
}

/// What R gains and the diodes' slope loses hardly changes the readings of one shunt: there damping leaves nothing of a step, and the search
/// gave up where a whole step makes the readings likelier.
#[test]
fn regress_a_search_goes_on_in_a_direction_of_which_the_readings_tell_little() {
    let bench = Bench::drawn(9, Iron::Series([0.05, 0.02, 0.02]));
    let interval = 0.5e-6 * (1.0 + 0.08 * (10.0_f64 * 0.618_033_988_75).fract());
    let scope = Scope { interval, ..SHUNT };
    let (pulses, fit) = found(&bench, &scope, 9);
    assert!(fit.converged && fit.widened < 1.1 && fit.pole.identified, "{} {:?}", fit.widened, fit.pole);
    for name in ["L_d", "L_q", "angle", "resistance_with_switch"] {
        let off = off(&pulses, &scope, &fit, name);
        assert!(estimate(&fit, name).identified && off < 2.0, "{name}: {off} half widths");
    }
}

/// An amplifier for one direction clips at no current, and shows nothing of what diodes return.
#[test]
fn law_an_amplifier_for_one_direction_tells_the_motor_too() {
    let bench = Bench::drawn(1, Iron::Series([0.05, 0.02, 0.02]));
    let pulses = bench.pulses(&six_vectors(bench.pulse(), 2.5 * bench.pulse()));
    let mut record = Record::parse("p.csv", &pulses.text(&SHUNT, 1)).expect("a record");
    let rest = record.rows[0].current[LINK];
    record.rows.iter_mut().for_each(|row| row.current[LINK] = row.current[LINK].max(rest));
    let fit = fit(&[record], &drive(&bench, 1), &|| false).expect("a motor");
    assert!(fit.converged && fit.widened < 1.5 && fit.pole.identified, "{} {:?}", fit.widened, fit.pole);
    assert_eq!(fit.traces.len(), 6);
    for name in ["L_d", "L_q", "angle"] {
        let off = off(&pulses, &SHUNT, &fit, name);
        assert!(off < 1.6, "{name}: {off} half widths");
    }
}

/// Probes in one record and a shunt in another are channels of one fit.
#[test]
fn law_records_of_probes_and_of_a_shunt_are_fitted_together() {
    let bench = Bench::drawn(2, Iron::Linear);
    let pulses = bench.pulses(&six_vectors(bench.pulse(), 2.5 * bench.pulse()));
    let probes = Scope { shunt: false, ..SHUNT };
    let records =
        [probes, SHUNT].map(|scope| Record::parse("p.csv", &pulses.text(&scope, 2)).expect("a record"));
    let fit = fit(&records, &drive(&bench, 2), &|| false).expect("a motor");
    assert!(fit.converged && fit.widened < 1.5, "{}", fit.widened);
    let gains = ["gain_a", "gain_b", "gain_c", "gain_link"].map(|name| estimate(&fit, name));
    let truth = [SHUNT.gain[0], SHUNT.gain[1], SHUNT.gain[2], SHUNT.gain[0]];
    let mean = truth.iter().sum::<f64>() / 4.0;
    for (one, truth) in gains.into_iter().zip(truth) {
        let [low, high] = one.interval.expect("measured");
        let off = (truth / mean - low.midpoint(high)).abs() / ((high - low) / 2.0);
        assert!(one.identified && off < 2.0, "{one:?}: {off} half widths");
    }
}

/// The legs of two pulses exchanged: said at once, whichever they are, without a search.
#[test]
fn regress_exchanged_pulses_are_named_before_any_search() {
    let pulses = scope::scipy();
    let text = pulses.text(&Scope::of(8.0), 3);
    let vectors = [["high,low,low", "low,high,low"], ["low,low,high", "high,high,low"]];
    for [one, other] in vectors {
        let exchanged: String = text
            .lines()
            .map(|line| {
                let line =
                    if line.ends_with(one) { line.replace(one, other) } else { line.replace(other, one) };
                line + "\n"
            })
            .collect();
        let record = Record::parse("p.csv", &exchanged).expect("a record");
        let steps = AtomicUsize::new(0);
        let error = fit(&[record], &scope::start(None, 3), &|| {
            steps.fetch_add(1, Ordering::Relaxed);
            false
        });
        let Err(FitError::Legs(legs)) = error else { panic!("{error:?}") };
        assert_eq!((legs.0.len(), steps.into_inner()), (2, 0));
        let said = legs.to_string();
        assert!(said.contains(&format!("legs {one}, but currents as of {other}")), "{said}");
        assert!(said.ends_with("the legs of the two pulses look exchanged"), "{said}");
    }
}

/// Currents of no motor: refused after the first search, which has an end.
#[test]
fn regress_a_search_that_goes_nowhere_ends() {
    let text = scope::ngspice().text(&Scope::of(2.5), 1);
    // Phase a's current of every second pulse has the other sign, and a third of its size.
    let mut high = 0;
    let mut before = false;
    let odd: String = text
        .lines()
        .map(|line| {
            let drives = line.contains("high");
            high += usize::from(drives && !before);
            before = drives;
            let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
            if high % 2 == 1 && !line.starts_with('t') {
                for (k, field) in fields[1..4].iter_mut().enumerate() {
                    let current = field.parse::<f64>().expect("a current");
                    *field = format!("{:.6}", if k == 0 { -current } else { 0.3 * current });
                }
            }
            fields.join(",") + "\n"
        })
        .collect();
    let record = Record::parse("p.csv", &odd).expect("a record");
    let steps = AtomicUsize::new(0);
    let result = fit(&[record], &scope::start(None, 1), &|| {
        steps.fetch_add(1, Ordering::Relaxed);
        false
    });
    assert!(steps.into_inner() <= 60, "a search of four starts");
    let said = result.expect_err("no motor").to_string();
    assert!(said.contains("needed:"), "{said}");
}
