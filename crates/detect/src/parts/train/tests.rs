extern crate std;
use std::vec::Vec;

use standstill_interface::Sensed;

use super::ringing::MOST_WAITS;
use super::*;
use crate::nameplate::Nameplate;

#[test]
fn law_every_round_has_all_six_pulses_and_odd_ones_go_back() {
    for round in 0..4_u16 {
        let mut slots: [Slot; 6] =
            core::array::from_fn(|k| Slot::of(6 * round + u16::try_from(k).expect("small")));
        assert_eq!(slots[0].line, if round.is_multiple_of(2) { 0 } else { 2 });
        slots.sort_by_key(|slot| (slot.line, slot.forward));
        for (k, slot) in slots.iter().enumerate() {
            assert_eq!(*slot, Slot { line: k / 2, forward: k % 2 == 1 });
        }
    }
}

#[test]
fn analytic_gains_from_the_lines() {
    let gain = [1.01_f64, 0.995, 0.998];
    let mut comparison = GainComparison::new();
    for (line, (first, second)) in LINES.into_iter().enumerate() {
        for forward in [true, false] {
            for current in [0.5, 1.0, 2.0] {
                let (first, second) = (gain[first as usize] * current, gain[second as usize] * current);
                let pair = if forward { (first, second) } else { (second, first) };
                comparison.add(Slot { line, forward }, pair);
            }
        }
    }
    let (ratios, variances) =
        GainComparison::known(comparison.measured(0.0).0, comparison.measured(0.0).1, 0.01);
    assert_eq!(variances, [0.0; 3]);
    let Abc(found) = GainComparison::gains(ratios);
    let mean = (gain[0] * gain[1] * gain[2]).cbrt();
    for k in 0..3 {
        assert!((found[k] - gain[k] / mean).abs() < 1e-12);
    }
    let lines = GainComparison::line_gains(ratios, Derived::None);
    assert!((lines[0] - ((gain[0] * gain[1]).sqrt() / mean).ln()).abs() < 1e-12);
    // Without a sensor in c, line BC shows b's gain and line CA a's.
    let two = GainComparison::line_gains([(gain[0] / gain[1]).ln(), 0.0, 0.0], Derived::One(Phase::C));
    let mean = (gain[0] * gain[1]).sqrt();
    assert_eq!(two[0], 0.0);
    assert!((two[1] - (gain[1] / mean).ln()).abs() < 1e-12 && (two[2] - (gain[0] / mean).ln()).abs() < 1e-12);
    // Sensors known to be equal are not corrected.
    let (ratios, noise) = comparison.measured(1e-4);
    assert_eq!(GainComparison::known(ratios, noise, 0.0).0, [0.0; 3]);
}

const SETTINGS: PulseTrainSettings<f64> = PulseTrainSettings {
    pulse: Nanos::from_micros(100),
    rest: Nanos::from_micros(160),
    rounds: 2,
    interval: Nanos::from_micros(25),
    zeroing: 10,
    threshold: 0.1,
    attempts: 3,
    least_current: 0.5,
    dead_time: Nanos(2000),
    resistance: 1.0,
    on_drop: 2.0,
    off_drop: 2.0,
    place: crate::nameplate::Place::InLine,
    ringing: Nanos::ZERO,
};

fn reading(current: [f64; 3]) -> Reading<f64> {
    Reading::measured(Nanos::ZERO, current, 540.0)
}

/// A train after its first command, and the readings of one zeroing.
fn zeroed(of: impl Fn(f64) -> [f64; 3]) -> (Train<f64>, Result<Option<Slot>, Fault<f64>>) {
    let mut train = Train::new(SETTINGS);
    assert_eq!(train.take(&[]), Ok(None));
    let command = train.next().expect("zeroing");
    assert_eq!(command.sampling.count, 10);
    assert_eq!(command.stage.legs, Stage::<f64>::off(Nanos::ZERO).legs);
    let readings: Vec<_> = (0..10).map(|k| reading(of(f64::from(k) / 10.0))).collect();
    let taken = train.take(&readings);
    (train, taken)
}

#[test]
fn law_zeroing_accepts_an_offset_and_rejects_a_current_that_decays() {
    let pulses = |train: &mut Train<f64>| train.next().expect("a command").then.is_some();
    // Up to twice the threshold, with noise below it.
    let (mut train, taken) = zeroed(|t| [0.19, -0.15, 0.05 + 0.08 * (t - 0.45)]);
    assert_eq!(taken, Ok(None));
    assert!(pulses(&mut train));
    assert!((train.offset.0[0] - 0.19).abs() < 1e-12 && (train.offset.0[2] - 0.05).abs() < 1e-9);
    // More than that is a current, and so is what changes by more than the threshold.
    for of in [|_| [0.21, 0.0, 0.0], |t: f64| [0.19 * (-3.0 * t).exp(), -0.15, 0.0], |_| [0.0, -0.21, 0.0]] {
        let (mut train, taken) = zeroed(of);
        assert_eq!(taken, Ok(None));
        assert!(!pulses(&mut train));
    }
}

#[test]
fn law_zeroing_is_repeated_so_many_times_and_forgets_what_came_before() {
    let (mut train, _) = zeroed(|_| [5.0, -5.0, 0.0]);
    for attempt in 2..=3 {
        assert!(train.next().expect("again").then.is_none());
        let taken = train.take(&[reading([5.0, -5.0, 0.0]); 10]);
        assert_eq!(taken.is_ok(), attempt < 3, "{attempt}");
        if let Err(fault) = taken {
            assert_eq!(fault, Fault::CurrentPersists(2.5));
        }
    }
    let (mut train, _) = zeroed(|_| [5.0, -5.0, 0.0]);
    assert!(train.next().is_some_and(|command| command.then.is_none()));
    assert_eq!(train.take(&[reading([0.02, 0.0, -0.02]); 10]), Ok(None));
    assert!(train.next().is_some_and(|command| command.then.is_some()));
    assert!((train.offset.0[0] - 0.02).abs() < 1e-12);
    assert_eq!(zeroed(|_| [f64::NAN, 0.0, 0.0]).1, Err(Fault::NotANumber));
    assert_eq!(zeroed(|_| [1e20, 0.0, 0.0]).1, Err(Fault::NotANumber));
}

/// Readings of the pulse under way, to this peak in A; `end` is what is left.
fn pulse(train: &Train<f64>, slot: Slot, peak: f64, end: f64) -> Vec<Reading<f64>> {
    let (from, to) = slot.phases();
    let (n, on) = (train.settings.samples(), train.settings.samples_on());
    (1..=n)
        .map(|k| {
            let current = if k <= on { peak * k as f64 / on as f64 } else { end };
            let mut reading = reading(train.offset.0);
            reading.current[from] += current;
            reading.current[to] -= current;
            reading
        })
        .collect()
}

#[test]
fn law_a_pulse_is_taken_with_its_offsets_removed() {
    let (mut train, _) = zeroed(|_| [0.19, -0.1, 0.05]);
    let mut slots = Vec::new();
    while let Some(command) = train.next() {
        let slot = train.under_way.expect("a pulse");
        let (from, to) = slot.phases();
        assert_eq!(command.stage, Stage::line(from, to, SETTINGS.pulse));
        assert_eq!(command.then, Some(Stage::off(SETTINGS.rest)));
        assert_eq!(command.sampling.count, 10);
        let readings = pulse(&train, slot, 2.0, 0.0);
        assert_eq!(train.take(&readings), Ok(Some(slot)));
        // The fourth sample is at the end of the pulse.
        assert!((train.current(slot, &readings[3]).expect("seen") - 2.0).abs() < 1e-12);
        let (in_from, out_of_to) = train.both(slot, &readings[1]).expect("seen");
        assert!((in_from - 1.0).abs() < 1e-12 && (out_of_to - 1.0).abs() < 1e-12);
        slots.push(slot);
    }
    assert_eq!(slots.len(), 12);
    train.restart(PulseTrainSettings { rounds: 1, ..SETTINGS });
    // Offsets stay, and there is no other zeroing.
    assert!(train.next().is_some_and(|command| command.then.is_some()));
    assert!((train.offset.0[0] - 0.19).abs() < 1e-12);
}

/// A train with terminals that may ring for a millisecond, in its first pulse.
fn in_a_pulse(place: Place) -> Train<f64> {
    let settings = PulseTrainSettings { ringing: Nanos::from_micros(1000), place, ..SETTINGS };
    let mut train = Train::new(settings);
    assert_eq!(train.take(&[]), Ok(None));
    let _ = train.next();
    assert_eq!(train.take(&[reading([0.1; 3]); 10]), Ok(None));
    assert!(train.next().is_some_and(|command| command.then.is_some()));
    train
}

/// The train after readings of the pulse under way that leave this current in A.
fn left(mut train: Train<f64>, end: f64) -> Train<f64> {
    let readings = pulse(&train, train.under_way.expect("a pulse"), 2.0, end);
    assert!(train.take(&readings).is_ok_and(|slot| slot.is_some()), "{end}");
    train
}

#[test]
fn law_terminals_that_ring_are_waited_for_until_they_are_quiet() {
    // Of the threshold of 0.1 A a part, and more than all of it.
    for end in [0.05, 0.5] {
        let mut train = left(in_a_pulse(Place::InLine), end);
        let wait = train.next().expect("a wait");
        // A rest of 160 µs, of which the current takes 100: 940 µs are left, for as many samples as a pulse has.
        assert!(wait.then.is_none() && wait.stage.duration == Nanos::from_micros(940), "{wait:?}");
        assert_eq!(train.take(&[reading([0.1; 3]); 5]), Err(Fault::UnexpectedReadings));
        assert_eq!(train.take(&[reading([0.1, 0.1 + end, 0.1]); 10]), Ok(None));
        assert!(train.next().is_some_and(|command| command.then.is_none()), "{end}");
        assert_eq!(train.take(&[reading([0.1; 3]); 10]), Ok(None));
        assert!(train.next().is_some_and(|command| command.then.is_some()), "{end}");
        // What does not go is no ringing: below the threshold it may stay, above it is a fault.
        train = left(train, end);
        for wait in 1..=MOST_WAITS {
            assert!(train.next().is_some_and(|command| command.then.is_none()), "{wait}");
            let taken = train.take(&[reading([0.1, 0.1 + end, 0.1]); 10]);
            assert_eq!(taken.is_ok(), wait < MOST_WAITS || end < 0.1, "{wait} {taken:?}");
        }
        assert!(end > 0.1 || train.next().is_some_and(|command| command.then.is_some()));
    }
    let mut quiet = left(in_a_pulse(Place::InLine), 0.0);
    assert!(quiet.next().is_some_and(|command| command.then.is_some()));
}

#[test]
fn law_shunts_that_show_no_ringing_wait_for_it_once() {
    let mut train = left(in_a_pulse(Place::BelowLegs), 0.0);
    assert!(train.next().is_some_and(|command| command.then.is_none()));
    assert_eq!(train.take(&[reading([0.1; 3]); 10]), Ok(None));
    assert!(train.next().is_some_and(|command| command.then.is_some()));
}

#[test]
fn analytic_a_shunt_in_the_link_is_one_reading_where_three_sensors_are_three() {
    // Ten readings of ±10 mA give 9 degrees of freedom, or 27. Six standard deviations of the ratio to ten (or thirty) others: 1 + 6 √(2/10 + 2/9)
    // = 4.9 times that variance, or 1 + 6 √(2/30 + 2/27) = 3.3 times. ±20 mA is 3.6 times (4 · 9/10).
    let scattered = |size: f64| -> Vec<Reading<f64>> {
        (0..10)
            .map(|k| {
                let current = 0.1 + if k % 2 == 0 { size } else { -size };
                Reading { link_current: current, link_sensed: Sensed::Measured, ..reading([current; 3]) }
            })
            .collect()
    };
    for (place, waits) in [(Place::InLink, false), (Place::InLine, true)] {
        let mut train =
            Train::new(PulseTrainSettings { ringing: Nanos::from_micros(1000), place, ..SETTINGS });
        assert_eq!(train.take(&[]), Ok(None));
        let _ = train.next();
        assert_eq!(train.take(&scattered(0.01)), Ok(None));
        assert!((train.noise / (1e-4 * 10.0 / 9.0) - 1.0).abs() < 1e-9, "{place:?} {}", train.noise);
        assert!(train.next().is_some_and(|command| command.then.is_some()));
        (train.last_peak, train.waits) = (0.0, 1);
        assert!(train.decayed(&scattered(0.02)).is_ok());
        assert_eq!(train.waits > 0, waits, "{place:?}");
    }
}

#[test]
fn analytic_an_open_terminal_rings_with_half_the_link() {
    // 0.5 nF at 48 mH, 560 V, 30 µs: √(1.5 L C) = 6 µs; 280 V over 12 kΩ, less e^(−30/60), beside 560 V · 30 µs / 96 mH.
    let drive = Nameplate { d_axis_inductance: 38e-3, q_axis_inductance: 58e-3, ..crate::testing::PLATE };
    let train = PulseTrainSettings {
        pulse: Nanos::from_micros(30),
        ..PulseTrainSettings::suited(&drive, SETTINGS.interval)
    };
    assert_eq!(train.ringing, Nanos::from_micros(300));
    let expected = 280.0 / 12e3 * (-0.5_f64).exp() / (560.0 * 30e-6 / 96e-3);
    assert!((train.rings() / expected - 1.0).abs() < 1e-9, "{} {expected}", train.rings());
    assert_eq!(SETTINGS.rings(), 0.0);
}

#[test]
fn law_a_pulse_that_is_none_is_a_fault() {
    let taken = |change: fn(&mut Vec<Reading<f64>>), peak: f64, end: f64| {
        let (mut train, _) = zeroed(|_| [0.1; 3]);
        let _ = train.next();
        let slot = train.under_way.expect("a pulse");
        let mut readings = pulse(&train, slot, peak, end);
        change(&mut readings);
        train.take(&readings).map(|_| train.derived)
    };
    assert_eq!(taken(|_| (), 2.0, 0.09), Ok(Derived::None));
    assert!(matches!(taken(|_| (), 0.49, 0.0), Err(Fault::NoCurrent { needed: 0.5, .. })));
    assert!(matches!(taken(|_| (), -2.0, 0.0), Err(Fault::NoCurrent { .. })));
    assert!(matches!(taken(|_| (), 2.0, 0.11), Err(Fault::CurrentPersists(_))));
    assert_eq!(taken(|r| r.truncate(9), 2.0, 0.0), Err(Fault::UnexpectedReadings));
    assert_eq!(taken(|r| r[3].sensed.0[1] = Sensed::Clipped, 2.0, 0.0), Err(Fault::Clipped(Phase::B)));
    assert_eq!(taken(|r| r[3].current.0[0] = f64::NAN, 2.0, 0.0), Err(Fault::NotANumber));
    // Two sensors in line; shunts below the legs.
    let derive = |phases: &[usize]| {
        let (mut train, _) = zeroed(|_| [0.0; 3]);
        let _ = train.next();
        let slot = train.under_way.expect("a pulse");
        let mut readings = pulse(&train, slot, 2.0, 0.0);
        for (k, phase) in phases.iter().enumerate() {
            readings[k].sensed.0[*phase] = Sensed::Derived;
        }
        train.take(&readings).map(|_| train.derived)
    };
    assert_eq!(derive(&[2, 2, 2]), Ok(Derived::One(Phase::C)));
    assert_eq!(derive(&[0, 2]), Ok(Derived::Several));
}

#[test]
fn law_a_sample_that_an_edge_spoils_is_no_peak() {
    let taken = |spoilt_end: bool, peak: f64| {
        let (mut train, _) = zeroed(|_| [0.1; 3]);
        train.spoilt_end = spoilt_end;
        let _ = train.next();
        let slot = train.under_way.expect("a pulse");
        let mut readings = pulse(&train, slot, peak, 0.0);
        readings[3].current = Abc([0.1; 3]);
        train.take(&readings)
    };
    assert!(matches!(taken(false, 2.0), Err(Fault::NoCurrent { .. })));
    assert!(matches!(taken(true, 2.0), Ok(Some(_))));
    // From 73 to 98 µs after the dead time a current of 0.49 A grows to 0.4933 A: from 0.3675 A.
    let Err(Fault::NoCurrent { peak, .. }) = taken(true, 0.49) else { panic!("too little") };
    assert!((peak - 0.75 * 0.49 * 98.0 / 73.0).abs() < 1e-12, "{peak}");
}

#[test]
fn analytic_two_sensors_in_line_tell_the_gains_of_the_lines() {
    // A phase without a sensor shows what the other one of its line does.
    let gain = [0.01_f64, -0.005, 0.002];
    for phase in Phase::ALL {
        let derived = phase as usize;
        let of = |k: usize, other: usize| gain[if k == derived { other } else { k }];
        let ratios: [f64; 3] = core::array::from_fn(|k| of(k, (k + 1) % 3) - of((k + 1) % 3, k));
        let found = GainComparison::line_gains(ratios, Derived::One(phase));
        let lines: [f64; 3] = core::array::from_fn(|k| (of(k, (k + 1) % 3) + of((k + 1) % 3, k)) / 2.0);
        let mean = lines.iter().sum::<f64>() / 3.0;
        for k in 0..3 {
            assert!((found[k] - (lines[k] - mean)).abs() < 1e-12, "{phase:?}: {found:?} {lines:?}");
        }
        for line in 0..3 {
            let mut moved = ratios;
            moved[line] += 1.0;
            let moved = GainComparison::line_gains(moved, Derived::One(phase));
            let slopes: [f64; 3] = GainComparison::line_gain_slopes(line, Derived::One(phase));
            for k in 0..3 {
                assert!((moved[k] - found[k] - slopes[k]).abs() < 1e-12);
            }
        }
    }
}

#[test]
fn analytic_the_noise_of_a_comparison_and_what_is_known_before() {
    let mut comparison = GainComparison::new();
    let slot = Slot { line: 1, forward: true };
    for _ in 0..100 {
        comparison.add(slot, (2.02, 2.0));
    }
    let (ratios, noise) = comparison.measured(0.04_f64);
    assert!((ratios[1] - 1.01_f64.ln()).abs() < 1e-12);
    // Σ i² = 400 in each, nearly.
    assert!((noise[1] / (0.04 * 2.0 / 400.0) - 1.0).abs() < 0.02);
    // Sensors that showed nothing are not compared.
    assert_eq!((ratios[0], noise[0]), (0.0, f64::INFINITY));
    // A prior of two gains.
    let (known, variance) = GainComparison::known(ratios, noise, 0.01);
    let prior = 2.0 * 0.01 * 0.01;
    assert!((known[1] - ratios[1] * prior / (prior + noise[1])).abs() < 1e-15);
    assert!((variance[1] - 1.0 / (1.0 / prior + 1.0 / noise[1])).abs() < 1e-15);
    assert_eq!((known[0], variance[0]), (0.0, prior));
}

#[test]
fn law_settings_that_cannot_work_are_refused() {
    assert!(SETTINGS.check().is_ok());
    let broken = [
        PulseTrainSettings { pulse: Nanos::ZERO, ..SETTINGS },
        PulseTrainSettings { dead_time: SETTINGS.pulse, ..SETTINGS },
        PulseTrainSettings { rest: SETTINGS.pulse, ..SETTINGS },
        PulseTrainSettings { rest: Nanos(u64::MAX), ..SETTINGS },
        PulseTrainSettings { rounds: 0, ..SETTINGS },
        PulseTrainSettings { interval: Nanos::ZERO, ..SETTINGS },
        PulseTrainSettings { interval: Nanos::from_micros(30), ..SETTINGS },
        PulseTrainSettings { interval: Nanos(1), ..SETTINGS },
        PulseTrainSettings { zeroing: 0, ..SETTINGS },
        PulseTrainSettings { threshold: f64::NAN, ..SETTINGS },
        PulseTrainSettings { attempts: 0, ..SETTINGS },
        PulseTrainSettings { least_current: 0.0, ..SETTINGS },
        PulseTrainSettings { resistance: f64::INFINITY, ..SETTINGS },
        PulseTrainSettings { on_drop: -1.0, ..SETTINGS },
        PulseTrainSettings { off_drop: f64::NAN, ..SETTINGS },
    ];
    assert!(broken.iter().all(|settings| settings.check().is_err()));
    assert!(SETTINGS.with_pulse(Nanos(u64::MAX)).check().is_err());
    let longer = SETTINGS.with_pulse(Nanos::from_micros(202));
    assert_eq!((longer.samples_on(), longer.pulse, longer.rest), (4, Nanos(202_000), Nanos(323_200)));
}

#[test]
fn law_a_rest_is_a_share_of_its_pulse_and_longer_than_that() {
    let pulse = Nanos(200_000);
    let suited = PulseTrainSettings::suited(&crate::testing::PLATE, Nanos(20_000));
    let suited = PulseTrainSettings { pulse, rest: rest_after(pulse), ..suited };
    assert_eq!((suited.rest, suited.rest_share()), (Nanos(320_000), 1.6));
    let set = |share: f64| {
        let mut settings = suited;
        settings.set_rest_share(share);
        settings
    };
    assert_eq!((set(1.05).rest, set(1.05).rest_share()), (Nanos(210_000), 1.05));
    assert!(set(1.05).check().is_ok());
    // As long as the pulse is too short, and so is less.
    for share in [1.0, 0.5] {
        assert!(set(share).check().is_err_and(|error| std::format!("{error:?}").contains("rest")), "{share}");
    }
}
