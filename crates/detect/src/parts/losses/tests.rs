extern crate std;

use standstill_interface::{Detector, Nanos, Outcome, Phase, Step};

use super::*;
use crate::checks::{Check, Checks};
use crate::method::{Bipolar, BipolarSettings};
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
    let (on, volts) = (train.samples_on(), 540.0);
    assert_eq!(Losses::pairs(&train, volts), on - 1);
    // Diodes that take a third of the link end the current after two thirds of the pulse.
    let low = PulseTrainSettings { off_drop: 270.0, ..train };
    let until = (540.0 - low.on_drop) / 810.0 * on as f64;
    let pairs = Losses::pairs(&low, volts);
    assert!(
        pairs > 0 && pairs as f64 <= 0.95 * until && (pairs + 1) as f64 > 0.95 * until,
        "{pairs} {until}"
    );
}
