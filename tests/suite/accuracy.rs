//! The paper's scheme without any error but the ones named: what equations (1)–(10) promise.

use standstill_detect::{Decay, LineInductance};
use standstill_inverter::{Bridge, DeviceKind, Devices, OpenLeg};
use standstill_plant::Motor;
use standstill_scenario::{ErrorSet, Record, Scenario, Specimen};
use standstill_sim::{NoProbe, RotorState, run};

use crate::bench::{paper_motor, scenario};

/// Axis errors in degrees at 360 angles, with exact sensors and no dead time.
fn axis_errors(motor: &Motor, decay: Decay, bridge: Bridge) -> Vec<f64> {
    let mut scenario = Scenario::paper(motor.clone(), ErrorSet::None, decay, RotorState::Locked, 1);
    scenario.drive.bridge = bridge;
    // A core that does not saturate has no polarity: only the axis is asked for.
    scenario.detector.polarity.least_margin = 0.0;
    (0..360)
        .map(|degree| {
            let angle = f64::from(degree).to_radians();
            let case = scenario.case_at(angle, Specimen { drive: 0, noise: 0 });
            let mut detector = LineInductance::new(scenario.detector).expect("settings");
            let record = Record { trial: 0, run: run(&case, &mut detector, false, &mut NoProbe) };
            record.axis_error_deg().unwrap_or_else(|| panic!("{degree}°: {}", record.reason()))
        })
        .collect()
}

fn worst(errors: &[f64]) -> f64 {
    errors.iter().fold(0.0, |worst, e| f64::max(worst, e.abs()))
}

fn rms(errors: &[f64]) -> f64 {
    (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
}

fn drops(share: f64) -> Devices {
    Devices {
        kind: DeviceKind::Igbt,
        switch_drop: 0.9 * share,
        switch_resistance: 0.05 * share,
        diode_drop: share,
        diode_resistance: 0.03 * share,
    }
}

#[test]
fn law_with_a_truly_open_leg_the_scheme_is_exact_but_for_its_trapezoid() {
    let open = Bridge { open_leg: OpenLeg::Open, ..Bridge::default() };
    for decay in [Decay::Slow, Decay::Fast] {
        let errors = axis_errors(&paper_motor().linearised(), decay, open);
        assert!(worst(&errors) <= 0.01, "{decay:?}: {}°", worst(&errors));
    }
}

#[test]
fn law_the_sign_of_the_saliency_decides_between_d_and_q() {
    // A motor with L_d > L_q, told so, is exact; told the opposite, the answer is the q-axis.
    let open = Bridge { open_leg: OpenLeg::Open, ..Bridge::default() };
    let mut motor = paper_motor();
    motor.winding.saliency = 2.1e-3;
    let motor = motor.linearised();
    assert!(worst(&axis_errors(&motor, Decay::Fast, open)) <= 0.01);
    let mut scenario = scenario(ErrorSet::None, Decay::Fast, RotorState::Locked);
    scenario.motor = motor;
    scenario.detector.polarity.least_margin = 0.0;
    let record = scenario.trial(0).expect("settings");
    let error = record.axis_error_deg().expect("found").abs();
    assert!((error - 90.0).abs() < 0.01, "{error}");
}

#[test]
fn law_the_open_legs_diode_costs_accuracy_with_slow_decay_and_more_the_smaller_the_drops() {
    let linear = paper_motor().linearised();
    let error = |decay, share| {
        let bridge = Bridge { devices: drops(share), ..Bridge::default() };
        rms(&axis_errors(&linear, decay, bridge))
    };
    let (full, half, tenth) = (error(Decay::Slow, 1.0), error(Decay::Slow, 0.5), error(Decay::Slow, 0.1));
    // 0.58° and 1.18° in an independent prototype.
    assert!((full - 0.58).abs() < 0.06, "{full}");
    assert!((half - 1.18).abs() < 0.12, "{half}");
    assert!(tenth > half, "{tenth}");
    // With fast decay the idle leg stays within the rails.
    assert!(error(Decay::Fast, 1.0) < 0.01);
    assert!(error(Decay::Fast, 0.1) < 0.01);
}

#[test]
fn law_saturation_alone_costs_what_the_prototype_found() {
    let open = Bridge { open_leg: OpenLeg::Open, ..Bridge::default() };
    for (decay, expected) in [(Decay::Slow, 0.79), (Decay::Fast, 0.32)] {
        let got = rms(&axis_errors(&paper_motor(), decay, open));
        assert!((got / expected - 1.0).abs() < 0.2, "{decay:?}: {got}");
    }
}
