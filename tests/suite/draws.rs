//! What is drawn for a trial has the size that the error set states, and each error reaches the readings.

use standstill_detect::Decay;
use standstill_interface::{Command, Nanos, Phase, Sampling, Stage};
use standstill_inverter::Sag;
use standstill_scenario::{ErrorSet, Scenario};
use standstill_sim::{Arrangement, Case, Event, NoProbe, RotorState, Trace, run};

use crate::bench::{Script, scenario};

const SPECIMENS: u64 = 4000;

fn harsh() -> Scenario {
    scenario(ErrorSet::Harsh, Decay::Fast, RotorState::Locked)
}

/// Mean and standard deviation.
fn moments(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let values: Vec<f64> = values.collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, (values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt())
}

/// Over the specimens: mean and deviation of one number of each case.
fn drawn(number: impl Fn(&Case) -> f64) -> (f64, f64) {
    let scenario = harsh();
    moments((0..SPECIMENS).map(|trial| number(&scenario.case(trial))))
}

#[test]
fn law_specimens_have_the_stated_spread() {
    // 4,000 draws tell a standard deviation to 1.1 %.
    let near = |(mean, deviation): (f64, f64), expected: (f64, f64)| {
        assert!((mean - expected.0).abs() < 4.0 * expected.1 / 60.0, "{mean} against {expected:?}");
        assert!((deviation / expected.1 - 1.0).abs() < 0.05, "{deviation} against {expected:?}");
    };
    for k in 0..3 {
        near(drawn(|case| case.sensors.gain[k]), (1.0, 0.01));
        near(drawn(|case| case.sensors.offset[k]), (0.0, 0.05));
        near(drawn(|case| case.inverter.gates[k].turn_on_delay.0 as f64), (300.0, 100.0));
        near(drawn(|case| case.inverter.gates[k].turn_off_delay.0 as f64), (300.0, 100.0));
    }
    near(drawn(|case| case.sensors.dc_link_gain), (1.0, 0.001));
    near(drawn(|case| case.sensors.resolver_error.to_degrees()), (0.0, 0.5));
    let turn = std::f64::consts::TAU;
    near(drawn(|case| case.inverter.link.ripple_phase), (turn / 2.0, turn / 12.0_f64.sqrt()));
}

#[test]
fn law_delays_shift_the_gate_edges() {
    let scenario = harsh();
    let case = scenario.case(5);
    let pulse = Stage::line(Phase::A, Phase::B, Nanos::from_micros(80));
    let mut trace = Trace::new(1e-5);
    let command = Command::sequence(pulse, Stage::off(Nanos::from_micros(20)), Sampling::NONE);
    run(&case, &mut Script::new(vec![command]), false, &mut trace);
    let edges: Vec<f64> = trace
        .events
        .iter()
        .filter_map(|(time, event)| matches!(event, Event::Gate(Phase::A, _)).then_some(time * 1e9))
        .collect();
    let timing = case.inverter.gates[0];
    let expected = [2000 + timing.turn_on_delay.0, 80_000 + timing.turn_off_delay.0];
    assert_eq!(edges.len(), 2);
    for (edge, expected) in edges.iter().zip(expected) {
        assert!((edge - expected as f64).abs() < 1e-3, "{edges:?} against {expected:?}");
    }
}

/// Readings of the DC link in V, every millisecond for 60 ms with nothing flowing.
fn link_readings(change: impl Fn(&mut Case)) -> Vec<f64> {
    let scenario = scenario(ErrorSet::None, Decay::Fast, RotorState::Locked);
    let mut case = scenario.case(0);
    change(&mut case);
    let duration = Nanos::from_micros(60_000);
    let sampling = Sampling { first: Nanos::ZERO, interval: Nanos::from_micros(1000), count: 61 };
    let mut script = Script::new(vec![Command::hold(Stage::off(duration), sampling)]);
    run(&case, &mut script, false, &mut NoProbe);
    script.readings.iter().map(|reading| reading.dc_link).collect()
}

#[test]
fn law_ripple_sag_and_gain_show_in_the_readings() {
    let largest = |readings: &[f64]| readings.iter().copied().fold(f64::MIN, f64::max);
    let smallest = |readings: &[f64]| readings.iter().copied().fold(f64::MAX, f64::min);
    assert!(link_readings(|_| ()).iter().all(|u| *u == 550.0));
    let ripple = link_readings(|case| {
        case.inverter.link.ripple = 0.01;
        case.inverter.link.ripple_frequency = 130.0;
    });
    assert!(largest(&ripple) > 555.0 && smallest(&ripple) < 545.0);
    let gain = link_readings(|case| case.sensors.dc_link_gain = 1.01);
    assert!(gain.iter().all(|u| (u - 555.5).abs() < 1e-9));

    // A sag that is over before the command ends, on a stiff link and behind a capacitor of R C = 2 ms.
    let sag = Sag { depth: 0.4, start: 0.020, duration: 0.004 };
    for storage in [None, Some(standstill_inverter::Storage { capacitance: 2e-3, source_resistance: 1.0 })] {
        let readings = link_readings(|case| {
            case.inverter.link.sag = Some(sag);
            case.inverter.link.storage = storage;
        });
        let deepest = smallest(&readings);
        let expected = if storage.is_none() { 330.0..331.0 } else { 400.0..470.0 };
        assert!(expected.contains(&deepest), "{storage:?}: {deepest} V");
        assert!((readings[10] - 550.0).abs() < 1e-3 && (readings[60] - 550.0).abs() < 1e-3);
    }
}

#[test]
fn law_filters_in_the_rig_lag_and_do_not_blow_up() {
    // Slow filters with many short steps around events. A first-order lag on a ramp delays it by τ, alike in all
    // phases; the axis is about as good as without.
    for (decay, current, link) in
        [(Decay::Slow, None, Some(1e3)), (Decay::Fast, None, Some(5e3)), (Decay::Fast, Some(20e3), Some(1e3))]
    {
        let mut scenario = scenario(ErrorSet::Default, decay, RotorState::Locked);
        scenario.sensors.bandwidth = current;
        scenario.sensors.dc_link.bandwidth = link;
        for trial in 0..60 {
            let record = scenario.trial(trial).expect("settings");
            let error = record.error_deg().unwrap_or(180.0);
            assert!(error.abs() < 6.0, "{decay:?} {current:?} {link:?}, trial {trial}: {error}°");
        }
    }
    // Shunts behind filters still see lower devices only: in a decay with all gates off, the leg that sources.
    let mut shunts = scenario(ErrorSet::None, Decay::Fast, RotorState::Locked);
    shunts.sensors.arrangement = Arrangement::LowSideShunts;
    shunts.sensors.bandwidth = Some(1e6);
    let pulse = Nanos::from_micros(80);
    let decay = Stage::off(Nanos::from_micros(40));
    let command = Command::sequence(
        Stage::line(Phase::A, Phase::B, pulse),
        decay,
        Sampling::once(Nanos::from_micros(100)),
    );
    let mut script = Script::new(vec![command]);
    run(&shunts.case(0), &mut script, false, &mut NoProbe);
    let [a, b, c] = script.readings[0].current.0;
    assert!(a > 0.5 && b.abs() < 1e-6 && c.abs() < 1e-6, "{a} {b} {c}");

    // The lag itself: a line pulse's ramp of slope s reads s (t − τ) at its end.
    let mut scenario = scenario(ErrorSet::None, Decay::Fast, RotorState::Locked);
    scenario.motor = scenario.motor.linearised();
    let read = |scenario: &Scenario| {
        let pulse = Nanos::from_micros(80);
        let command = Command::hold(Stage::line(Phase::A, Phase::B, pulse), Sampling::once(pulse));
        let mut script = Script::new(vec![command]);
        run(&scenario.case(0), &mut script, false, &mut NoProbe);
        script.readings[0].current[Phase::A]
    };
    let sharp = read(&scenario);
    scenario.sensors.bandwidth = Some(100e3);
    let tau = 1.0 / (std::f64::consts::TAU * 100e3);
    let expected = sharp * (1.0 - tau / 80e-6);
    assert!((read(&scenario) / expected - 1.0).abs() < 1e-3, "{} {expected}", read(&scenario));
}

#[test]
fn law_a_filter_on_a_rippling_link_reads_alike_after_one_wait_and_after_many() {
    let read = |corner: f64, pieces: u64| {
        let mut exact = scenario(ErrorSet::None, Decay::Fast, RotorState::Locked);
        exact.drive.link.ripple = 0.05;
        exact.sensors.dc_link.bandwidth = Some(corner);
        let duration = Nanos(20_500_000 / pieces);
        let command = Command::hold(Stage::off(duration), Sampling::once(duration));
        let mut script = Script::new(vec![command; usize::try_from(pieces).expect("few")]);
        run(&exact.case(0), &mut script, false, &mut NoProbe);
        script.readings.last().expect("a reading").dc_link
    };
    for corner in [20.0, 200.0, 2000.0] {
        let (one, many) = (read(corner, 1), read(corner, 1000));
        assert!((one - many).abs() < 0.1, "{corner} Hz: {one} V, {many} V");
    }
}
