extern crate std;

use standstill_interface::{Detector, Nanos, Outcome, Phase, Step};

use super::*;
use crate::checks::{Check, Checks};
use crate::method::{Bipolar, BipolarSettings};
use crate::nameplate::Nameplate;
use crate::parts::plausibility::PlausibilitySettings;
use crate::testing::{LineMotor, PLATE};

fn detect(checks: Checks, motor: &mut LineMotor) -> Outcome<f64> {
    let mut settings = BipolarSettings::suited(&PLATE);
    settings.0.plausibility.checks = checks;
    let mut detector = Bipolar::new(settings).expect("settings");
    let mut readings = std::vec::Vec::new();
    loop {
        match detector.step(&readings) {
            Step::Drive(command) => readings = motor.readings(&command),
            Step::Done(outcome) => return outcome,
        }
    }
}

#[test]
fn analytic_a_contact_shows_its_resistance_and_its_phase() {
    for (k, phase) in Phase::ALL.into_iter().enumerate() {
        for contact in [3.0, 6.0] {
            for degrees in [10.0, 77.0, 200.0] {
                let mut motor = LineMotor::at(degrees);
                motor.contact[k] = contact;
                let outcome = detect(Checks::ALL, &mut motor);
                let Outcome::Failed {
                    fault: Fault::ContactResistive { phase: found, found: more, .. },
                    findings,
                } = outcome
                else {
                    panic!("{degrees}: {outcome:?}")
                };
                // A start that fails lies beyond the limit of the check that it fails.
                assert!(
                    findings.fault_margin.is_some_and(|margin| margin < 0.0),
                    "{:?}",
                    findings.fault_margin
                );
                assert_eq!(found, phase);
                // Saturation bends a line's losses by some per cent of all of them, which are 2.4 Ω and as much by devices.
                assert!((more - contact).abs() < 0.08 * (contact + 4.0), "{degrees} {contact}: {more}");
                // The check can be left out; then the angle is off.
                let outcome = detect(Checks::ALL.without(Check::Contact), &mut motor);
                let Outcome::Found { angle, .. } = outcome else { panic!("{outcome:?}") };
                assert!(motor.error(angle).abs() > 0.05, "{}", motor.error(angle));
            }
        }
    }
}

#[test]
fn law_phases_that_are_alike_lose_alike() {
    // Noise of the error set `default`, 20 mA, and sensors whose gains differ by 1 %.
    for trial in 0..400 {
        let mut motor = LineMotor::at(f64::from(trial) * 0.9).with_noise(0.02, trial);
        motor.gain = [1.01, 0.995, 1.0];
        motor.slope = [0.0, 1e-4, 3e-4][trial as usize % 3];
        let outcome = detect(Checks::of([Check::Contact, Check::Codes]), &mut motor);
        assert!(!matches!(outcome, Outcome::Failed { .. }), "{trial}: {outcome:?}");
    }
}

#[test]
fn law_currents_that_end_before_are_not_compared() {
    let train = PulseTrainSettings::suited(&PLATE, Nanos::from_micros(50));
    let (on, volts) = (train.samples_on(), 540.0 - train.on_drop);
    assert_eq!(Losses::pairs(&train, volts), on - 1);
    // Diodes that take a third of the link end the current after two thirds of the pulse.
    let low = PulseTrainSettings { off_drop: 270.0, ..train };
    let until = volts / 810.0 * on as f64;
    let pairs = Losses::pairs(&low, volts);
    assert!(
        pairs > 0 && pairs as f64 <= 0.95 * until && (pairs + 1) as f64 > 0.95 * until,
        "{pairs} {until}"
    );
    // What the switches take counts once: the current falls by (U + off) s, having risen by (U − on) t1.
    let interval = Nanos(train.pulse.0 / 100);
    let fine = PulseTrainSettings { on_drop: 135.0, off_drop: 0.0, interval, ..train };
    let until = 0.95 * fine.samples_on() as f64 * (540.0 - 135.0) / 540.0;
    let pairs = Losses::pairs(&fine, 540.0 - 135.0) as f64;
    assert!(pairs <= until && pairs + 1.0 > until, "{pairs} {until}");
}

/// A train of one line's pulses whose current rises to a peak and falls as a line of 27 mH with 12 Ω makes it, by the equation at the head
/// of the module, so that each pair of samples is exact.
fn shown(train: &PulseTrainSettings<f64>, peak: f64, resistance: f64) -> std::vec::Vec<Reading<f64>> {
    let (on, interval, t1) = (train.samples_on(), train.interval.seconds(), train.pulse.seconds());
    (1..=train.samples())
        .map(|n| {
            let apart = (n as f64 - on as f64) * interval;
            let lost = resistance / INDUCTANCE * 2.0 * peak * apart.abs() * (1.0 - apart.abs() / (2.0 * t1));
            let current = peak * (1.0 - apart.abs() / t1) - if apart > 0.0 { lost } else { 0.0 };
            Reading::measured(train.interval * n as u64, [current, -current, 0.0], 540.0)
        })
        .collect()
}

const INDUCTANCE: f64 = 27e-3;

#[test]
fn regress_pulses_with_a_pair_less_weigh_less() {
    // A link at the boundary of a pair: by noise of its readings, every other pulse of a line has a pair less.
    let settings = PulseTrainSettings::suited(&PLATE, Nanos::from_micros(20));
    let settings = PulseTrainSettings { off_drop: 150.0, ..settings };
    let train = Train::new(settings);
    let boundary = (200..540)
        .map(f64::from)
        .find(|volts| Losses::pairs(&settings, *volts) < Losses::pairs(&settings, *volts + 1.0))
        .expect("a boundary");
    let mut losses = Losses::new();
    for pulse in 0..18 {
        let slot = Slot::of(pulse);
        let (from, to) = slot.phases();
        let mut readings = shown(&settings, 3.5, 12.0);
        for reading in &mut readings {
            let current = reading.current.0[0];
            reading.current.0 = [0.0; 3];
            (reading.current[from], reading.current[to]) = (current, -current);
        }
        // One line's pulses all have the pair, one's none of them, the third's half.
        let more = match slot.line {
            0 => true,
            1 => false,
            _ => slot.forward,
        };
        losses.add(&train, slot, &readings, if more { boundary + 1.0 } else { boundary }).expect("currents");
    }
    let pairs = losses.0.map(|[back, forward]| back.count + forward.count);
    assert!(pairs[0] > pairs[2] && pairs[2] > pairs[1], "{pairs:?}");
    let timing = Timing { volts: boundary, late: [0.0; 3], deviation: 0.0 };
    let (found, _) = losses.resistances(0.0, [INDUCTANCE; 3], timing).expect("pairs");
    for resistance in found {
        assert!((resistance - 12.0).abs() < 1e-9, "{found:?}");
    }
    // A line without a pair gives no result, and the check passes.
    let mut none = losses;
    none.0[1][0] = Losses::new().0[1][0];
    assert_eq!(none.resistances(0.0, [INDUCTANCE; 3], timing), None);
}

/// Three pairs of one line with 12 Ω, whose peak comes so many seconds later: 540 V and 80 ns take 3.2 mA from each pair.
fn pairs(settings: &PulseTrainSettings<f64>, later: f64) -> Pairs<f64> {
    let (t1, interval) = (settings.pulse.seconds(), settings.interval.seconds());
    let mut pairs = Losses::new().0[0][0];
    for pair in 1..=3 {
        let apart = f64::from(pair) * interval;
        let time = 2.0 * apart * (1.0 - apart / (2.0 * t1));
        pairs.add((12.0 * 3.5 * time - 2.0 * 540.0 * later) / INDUCTANCE, time, 3.5);
    }
    pairs
}

#[test]
fn analytic_edges_that_come_later_are_no_losses() {
    let settings = PulseTrainSettings::suited(&PLATE, Nanos::from_micros(20));
    let found = |later: [f64; 3], known: f64, deviation: f64| {
        let timing = Timing { volts: 540.0, late: [-known; 3], deviation };
        let losses = Losses(later.map(|later| [pairs(&settings, later); 2]));
        losses.resistances(0.0, [INDUCTANCE; 3], timing).expect("pairs").0
    };
    for (later, known, deviation, most) in [
        // All lines alike, whatever is known of it.
        ([0.5e-6; 3], 0.0, 0.0, 1e-6),
        ([0.5e-6; 3], 0.2e-6, 0.0, 1e-6),
        ([0.5e-6; 3], 0.5e-6, 50e-9, 1e-6),
        // Lines that differ by as much as the drive states.
        ([0.1e-6, 0.3e-6, -0.2e-6], 0.0, 50e-9, 1e-6),
    ] {
        let found = found(later, known, deviation);
        assert!(found.iter().all(|found| (found - 12.0).abs() < most), "{later:?}: {found:?}");
    }
    // If the drive states that lines are equal, a line that is later than the others seems to lose less.
    let found = found([0.1e-6, 0.3e-6, -0.1e-6], 0.0, 0.0);
    let times = pairs(&settings, 0.0);
    let less = 2.0 * 540.0 * 0.2e-6 / 3.5 * times.time * 3.0 / (times.times + 3.0 * times.time * times.time);
    for (found, expected) in found.into_iter().zip([12.0, 12.0 - less, 12.0 + less]) {
        assert!((found - expected).abs() < 1e-6, "{found} {expected}");
    }
}

#[test]
fn analytic_a_slope_with_an_offset_of_known_width_is_the_likeliest() {
    // By the normal equations of slope and offset.
    let settings = PulseTrainSettings::suited(&PLATE, Nanos::from_micros(20));
    let of = pairs(&settings, 80e-9);
    let (noise, expected, variance) = (1e-6, -1e-3, 4e-6);
    let [sum, squares] = [3.0 * of.time, of.times + 3.0 * of.time * of.time];
    let [slope, mixed, constant] = [squares / noise, sum / noise, 3.0 / noise + 1.0 / variance];
    let products = (of.products + 3.0 * of.time * of.short) / noise;
    let right = 3.0 * of.short / noise + expected / variance;
    let determinant = slope * constant - mixed * mixed;
    let (found, spread) = of.slope(noise, (expected, variance));
    assert!((found / ((constant * products - mixed * right) / determinant) - 1.0).abs() < 1e-9, "{found}");
    assert!((spread / (constant / determinant) - 1.0).abs() < 1e-9, "{spread}");
    // Its offset alone, and what is left of a straight line.
    let (offset, spread) = of.offset(noise).expect("three times");
    assert!((offset + 2.0 * 540.0 * 80e-9 / INDUCTANCE).abs() < 1e-12, "{offset}");
    assert!((spread / (noise * squares / (3.0 * of.times)) - 1.0).abs() < 1e-9, "{spread}");
    assert!(of.residuals().0 < 1e-15 && of.residuals().1 == 1.0, "{:?}", of.residuals());
}

#[test]
fn law_what_scatters_more_than_the_zeroing_widens_the_limit() {
    // A fourth pair at the mean time, 1 mA beside the line: 3/4 (1 mA)² are left, with two degrees of freedom. The zeroing saw no noise.
    let settings = PulseTrainSettings::suited(&PLATE, Nanos::from_micros(20));
    let mut off = pairs(&settings, 0.0);
    off.add(off.short + 1e-3, off.time, 3.5);
    let timing = Timing { volts: 540.0, late: [0.0; 3], deviation: 0.0 };
    let losses = Losses([[off; 2]; 3]);
    let (sum, freedom) = off.residuals();
    assert!((sum / 0.75e-6 - 1.0).abs() < 1e-9 && freedom == 2.0, "{sum} {freedom}");
    let (_, deviation) = losses.resistances(0.0, [INDUCTANCE; 3], timing).expect("pairs");
    let (_, noisy) = losses.resistances(sum / freedom, [INDUCTANCE; 3], timing).expect("pairs");
    assert!(deviation > 0.0 && (deviation / noisy - 1.0).abs() < 1e-12, "{deviation} {noisy}");
}

#[test]
fn analytic_a_lines_own_edge_is_half_of_the_third_legs() {
    let plate = Nameplate { delay_mismatch: 60e-9, ..PLATE };
    let deviation = PlausibilitySettings::suited(&plate).edge_deviation;
    assert!((deviation / 30e-9 - 1.0).abs() < 1e-12, "{deviation}");
}
