extern crate std;
use std::vec::Vec;

use standstill_interface::{Abc, Angle, Detector, Outcome};

use super::*;
use crate::checks::{Check, Checks};
use crate::commissioning::Correction;
use crate::nameplate::{Place, Sensing};
use crate::parts::lines::SaliencySign;
use crate::parts::plausibility::PlausibilitySettings;
use crate::parts::polarity::Signature;
use crate::parts::train::PulseTrainSettings;
use crate::testing::{LineMotor, Noise, mean_and_deviation};

fn settings<T: Real>() -> BipolarSettings<T> {
    BipolarSettings(BothWaysSettings {
        train: PulseTrainSettings {
            pulse: Nanos::from_micros(200),
            rest: Nanos::from_micros(320),
            rounds: 3,
            interval: Nanos::from_micros(50),
            zeroing: 30,
            threshold: T::of(0.2),
            attempts: 3,
            least_current: T::of(0.3),
            dead_time: Nanos(2000),
            resistance: T::zero(),
            on_drop: T::of(LineMotor::DROP),
            off_drop: T::of(LineMotor::DROP),
            place: Place::InLine,
            ringing: Nanos::ZERO,
        },
        saliency: SaliencySign::Negative,
        least_saliency: T::of(0.005),
        gain_tolerance: T::of(0.005),
        correction: Correction::none(),
        signature: Signature::Normal,
        pole_error: T::of(1e-6),
        pole_floor: T::of(0.0015),
        sensing: Sensing::default(),
        plausibility: PlausibilitySettings {
            checks: Checks::ALL,
            edge_deviation: T::zero(),
            magnet_flux: T::zero(),
            sensors: T::of(0.06),
            idle_is_blocked: true,
            line: [T::of(5e-3), T::of(50e-3)],
            saliency: T::of(2.1 / 9.2),
            rated_pulse: T::of(400e-6),
            saturates: T::one(),
            both_ways: [T::of(0.1), T::of(0.2)],
            dc_link: [T::of(300.0), T::of(800.0)],
        },
    })
}

fn detect<T: Real>(settings: BipolarSettings<T>, motor: &mut LineMotor) -> Outcome<T> {
    let mut detector = Bipolar::new(settings).expect("settings");
    let mut readings = Vec::new();
    loop {
        match detector.step(&readings) {
            Step::Drive(command) => readings = motor.readings(&command),
            Step::Done(outcome) => return outcome,
        }
    }
}

fn found<T: Real>(outcome: Outcome<T>) -> (Angle<T>, Findings<T>) {
    match outcome {
        Outcome::Found { angle, findings } => (angle, findings),
        other => panic!("{other:?}"),
    }
}

#[test]
fn analytic_offsets_gains_and_saturation_cancel() {
    for degrees in [0.0, 33.0, 90.0, 170.0, 200.0, 359.0] {
        let mut motor = LineMotor { slope: 3e-4, ..LineMotor::at(degrees) };
        (motor.offset, motor.gain) = ([0.1, -0.05, 0.02], [1.004, 0.997, 1.001]);
        let (angle, findings) = found(detect(settings::<f64>(), &mut motor));
        // The resistance is in each line's inductance, as much as the line is small.
        assert!(motor.error(angle).abs() < 0.1, "{degrees}: {}", motor.error(angle));
        let Abc(gains) = findings.sensor_gain.expect("compared");
        let mean = motor.gain.iter().sum::<f64>() / 3.0;
        assert!((0..3).all(|k| (gains[k] - motor.gain[k] / mean).abs() < 1e-4), "{gains:?}");
        let inverted =
            BipolarSettings(BothWaysSettings { signature: Signature::Inverted, ..settings::<f64>().0 });
        let (other, _) = found(detect(inverted, &mut motor));
        assert!((motor.error(other).abs() - 180.0).abs() < 0.1);
    }
}

/// The method with shunts below the legs, sampled ten times a pulse.
fn below_legs() -> BipolarSettings<f64> {
    let all = settings::<f64>().0;
    let interval = Nanos(all.train.pulse.0 / 10);
    let train = PulseTrainSettings { place: Place::BelowLegs, interval, ..all.train };
    let sensing = Sensing { place: Place::BelowLegs, ..all.sensing };
    BipolarSettings(BothWaysSettings { train, sensing, ..all })
}

#[test]
fn analytic_shunts_below_the_legs_are_compared_where_one_takes_over_from_the_other() {
    for degrees in [0.0, 33.0, 90.0, 170.0, 200.0, 359.0] {
        let mut motor = LineMotor { slope: 3e-4, place: Place::BelowLegs, ..LineMotor::at(degrees) };
        (motor.offset, motor.gain) = ([0.1, -0.05, 0.02], [1.004, 0.997, 1.001]);
        let (angle, findings) = found(detect(below_legs(), &mut motor));
        assert!(motor.error(angle).abs() < 0.1, "{degrees}: {}", motor.error(angle));
        let Abc(gains) = findings.sensor_gain.expect("compared");
        let mean = motor.gain.iter().sum::<f64>() / 3.0;
        assert!((0..3).all(|k| (gains[k] - motor.gain[k] / mean).abs() < 2e-4), "{degrees}: {gains:?}");
    }
}

#[test]
fn law_gains_of_shunts_below_the_legs_are_no_saturation_and_the_stated_deviation_is_the_scatter() {
    // Without saturation there is no pole: gains that differ between the directions of the pulses must not imitate one.
    let (mut squares, mut stated, mut evidence) = (0.0_f64, 0.0_f64, Vec::new());
    for trial in 0..200_u32 {
        let mut motor =
            LineMotor { slope: 0.0, place: Place::BelowLegs, ..LineMotor::at(40.0) }.with_noise(0.02, trial);
        motor.gain = core::array::from_fn(|_| 1.0 + 0.005 * motor.noise.gauss());
        let outcome = detect(below_legs(), &mut motor);
        let Outcome::Axis { angle, findings, .. } = outcome else { panic!("{outcome:?}") };
        let error = motor.error(angle);
        squares += (error - 180.0 * (error / 180.0).round()).to_radians().powi(2);
        stated += findings.angle_deviation.expect("stated").powi(2);
        evidence.push(motor.evidence(&outcome));
    }
    let ratio = (squares / stated).sqrt();
    assert!((0.8..1.2).contains(&ratio), "{ratio}");
    let (mean, deviation) = mean_and_deviation(&evidence);
    assert!(mean.abs() < 0.3 && deviation < 1.2, "{mean} {deviation}");
}

#[test]
fn law_the_stated_deviation_is_the_scatter_in_both_precisions() {
    let (mut squares, mut stated) = (0.0_f64, 0.0_f64);
    for trial in 0..200_u32 {
        let motor = |scale: f64| LineMotor {
            deviation: 0.02 * scale,
            slope: 3e-4,
            noise: Noise::new(u64::from(trial) + 1),
            ..LineMotor::at(40.0)
        };
        let mut noisy = motor(1.0);
        let without = BipolarSettings(BothWaysSettings { gain_tolerance: 0.0, ..settings::<f64>().0 });
        let (angle, findings) = found(detect(without, &mut noisy));
        let none = found(detect(without, &mut motor(0.0))).0;
        squares += (angle.difference(none)).powi(2);
        stated += findings.angle_deviation.expect("stated").powi(2);
        // A quiet drive scatters by less than what squares of inductances keep in single precision.
        let (_, double) = found(detect(settings::<f64>(), &mut motor(0.02)));
        let (_, single) = found(detect(settings::<f32>(), &mut motor(0.02)));
        let single = f64::from(single.angle_deviation.expect("stated"));
        let ratio = single / double.angle_deviation.expect("stated");
        assert!((0.95..1.05).contains(&ratio), "{ratio}");
    }
    let ratio = (squares / stated).sqrt();
    assert!((0.85..1.15).contains(&ratio), "{ratio}");
}

#[test]
fn law_a_saliency_of_another_motor_is_a_fault() {
    for (saliency, holds) in [(0.15, true), (2.1 / 9.2, true), (0.3, true), (0.45, false)] {
        let mut settings = settings::<f64>();
        settings.0.plausibility.saliency = saliency;
        let found = detect(settings, &mut LineMotor::at(33.0));
        assert_eq!(matches!(found, Outcome::Found { .. }), holds, "{saliency}: {found:?}");
        let refused = matches!(found, Outcome::Failed { fault: Fault::SaliencyOutOfRange { .. }, .. });
        assert!(holds != refused, "{saliency}: {found:?}");
        settings.0.plausibility.checks = Checks::ALL.without(Check::Saliency);
        assert!(matches!(detect(settings, &mut LineMotor::at(33.0)), Outcome::Found { .. }), "{saliency}");
    }
}

#[test]
fn law_a_link_below_the_drops_is_a_fault() {
    // It would turn every inductance around, and the axis by a quarter turn.
    let mut settings = settings::<f64>();
    settings.0.train.on_drop = 600.0;
    let outcome = detect(settings, &mut LineMotor::at(33.0));
    assert!(matches!(outcome, Outcome::Failed { fault: Fault::NotInductive(_), .. }), "{outcome:?}");
    let round = &mut LineMotor { saliency: 0.0, slope: 0.0, ..LineMotor::at(33.0) };
    let outcome = detect(self::settings::<f64>(), round);
    assert!(matches!(outcome, Outcome::Failed { fault: Fault::NoSaliency { .. }, .. }), "{outcome:?}");
}

#[test]
fn law_right_poles_have_positive_evidence_that_scatters_by_one_deviation() {
    // Offsets known from many samples and no floor: the readings' noise is the only error.
    let mut settings =
        BothWaysSettings { gain_tolerance: 0.0, pole_floor: 1e-9, pole_error: 1e-2, ..settings::<f64>().0 };
    (settings.train.zeroing, settings.train.rounds) = (3000, 12);
    for (slope, signature) in [(3e-5, Signature::Normal), (-3e-5, Signature::Inverted)] {
        let settings = BipolarSettings(BothWaysSettings { signature, ..settings });
        let (mut all, mut named) = (Vec::new(), 0);
        for trial in 0..400 {
            let mut motor = LineMotor { slope, ..LineMotor::at(130.0) }.with_noise(0.03, trial);
            let outcome = detect(settings, &mut motor);
            let evidence = motor.evidence(&outcome);
            if let Outcome::Found { angle, findings } = outcome {
                let right = motor.error(angle).abs() < 90.0;
                assert_eq!(right, evidence > 0.0);
                assert_eq!(findings.pole_evidence.expect("named").deviations, evidence.abs());
                named += 1;
            }
            all.push(evidence);
        }
        let (mean, deviation) = mean_and_deviation(&all);
        assert!((2.5..3.5).contains(&mean) && (0.9..1.12).contains(&deviation), "{mean} {deviation}");
        assert!((100..300).contains(&named), "{named}");
    }
}

#[test]
fn law_the_drive_knows_how_its_sensors_lag_when_they_are_converted_and_what_edges_add() {
    let known = Sensing {
        bandwidth: Some(200e3),
        bandwidth_mismatch: 0.03,
        skew: Nanos(500),
        pick_up: [0.2, 0.5e-6],
        ..Sensing::default()
    };
    let mut untold = settings::<f64>();
    // A drive that does not know its sensors' times would take them for broken.
    untold.0.plausibility.checks = Checks::ALL.without(Check::Codes).without(Check::Contact);
    let informed = settings::<f64>();
    let informed = BipolarSettings(BothWaysSettings { sensing: known, ..informed.0 });
    let (mut worst, mut unknown) = (0.0_f64, 0.0_f64);
    for degrees in [0.0, 33.0, 77.0, 130.0, 200.0, 310.0] {
        // The resistance is in each line's inductance whatever the sensors are.
        let mut plain = LineMotor { slope: 3e-4, ..LineMotor::at(degrees) };
        let (angle, findings) = found(detect(untold, &mut plain));
        let (own, inductance) = (plain.error(angle), findings.mean_inductance.expect("found"));
        // The specimen lags by a fifth more than its data sheet says.
        let behind = |settings| {
            let mut motor = LineMotor { slope: 3e-4, ..LineMotor::at(degrees) };
            motor.gain = [1.004, 0.997, 1.001];
            motor.lag = [1.2 / (core::f64::consts::TAU * 200e3); 3];
            (motor.skew, motor.pick_up) = (0.5e-6, [0.2, 0.5e-6, 5e6]);
            let outcome = detect(settings, &mut motor);
            let (Outcome::Found { angle, .. } | Outcome::Axis { angle, .. }) = outcome else {
                panic!("{outcome:?}")
            };
            (motor.error(angle) - own, outcome)
        };
        let (error, outcome) = behind(informed);
        let (_, findings) = found(outcome);
        worst = worst.max(error.abs());
        assert!((findings.mean_inductance.expect("found") / inductance - 1.0).abs() < 2e-3, "{findings:?}");
        let Abc(gains) = findings.sensor_gain.expect("compared");
        let mean = (1.004 + 0.997 + 1.001) / 3.0;
        let off = |k: usize, gain: f64| (gains[k] - gain / mean).abs();
        assert!(
            [1.004, 0.997, 1.001].into_iter().enumerate().all(|(k, gain)| off(k, gain) < 1e-4),
            "{gains:?}"
        );
        unknown = unknown.max(behind(untold).0.abs());
    }
    assert!(worst < 0.01 && unknown > 10.0 * worst, "{worst} {unknown}");
}
