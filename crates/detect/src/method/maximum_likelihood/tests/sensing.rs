//! Behind sensors that lag, are converted one after the other and hear the edges.

use super::*;

/// What the drive knows of sensors like these.
fn sensing(bandwidth: Option<f64>, skew: f64, pick_up: [f64; 2]) -> Sensing<f64> {
    Sensing {
        bandwidth,
        bandwidth_mismatch: 0.03,
        skew: Nanos::from_seconds(skew),
        pick_up,
        ..Sensing::default()
    }
}

#[test]
fn law_poles_are_named_behind_sensors_of_any_bandwidth() {
    for bandwidth in [20e3, 50e3, 200e3, 1e6] {
        let drive = Nameplate { sensing: sensing(Some(bandwidth), 0.0, [0.0; 2]), ..nameplate() };
        let fixed = MaximumLikelihoodSettings::suited(&drive);
        for settings in [fixed, MaximumLikelihoodSettings::adaptive(&drive)] {
            let (mut squares, mut stated, trials) = (0.0, 0.0, 60);
            for trial in 0..trials {
                let mut motor = LineMotor { slope: 4e-4, ..LineMotor::at(6.0 * f64::from(trial)) }
                    .with_noise(0.01, trial);
                let mut off = |share: f64| 1.0 + share * (2.0 * motor.noise.uniform() - 1.0);
                let all = off(0.2) / (core::f64::consts::TAU * bandwidth);
                motor.lag = [(); 3].map(|()| all * off(0.03));
                let (angle, findings) = found(detect(settings, &mut motor, |_| ()));
                squares += motor.error(angle).powi(2) / f64::from(trials);
                stated += findings.angle_deviation.expect("stated").to_degrees().powi(2) / f64::from(trials);
            }
            let rms = squares.sqrt();
            assert!(rms < if bandwidth < 50e3 { 0.3 } else { 0.15 }, "{bandwidth}: {rms}");
            assert!(rms < 1.4 * stated.sqrt(), "{bandwidth}: {rms} {}", stated.sqrt());
        }
    }
}

#[test]
fn analytic_the_drive_knows_when_each_phase_is_converted_and_which_samples_are_spoilt() {
    let (skew, ringing) = (0.5e-6, [0.3, 0.4e-6, 5e6]);
    let plain = |sensing| Nameplate { sensing, ..nameplate() };
    let known = plain(sensing(None, skew, [0.3, 0.4e-6]));
    let (mut worst, mut informed, mut unknown) = (0.0_f64, Vec::new(), Vec::new());
    for degrees in [0.0, 33.0, 77.0, 130.0, 200.0, 310.0] {
        let error = |settings| {
            let mut motor = LineMotor { skew, pick_up: ringing, slope: 4e-4, ..LineMotor::at(degrees) };
            let (angle, _) = found(detect(settings, &mut motor, |_| ()));
            motor.error(angle).abs()
        };
        worst = worst.max(error(MaximumLikelihoodSettings::suited(&known)));
        worst = worst.max(error(MaximumLikelihoodSettings::adaptive(&known)));
        let mut motor = LineMotor { skew, pick_up: ringing, slope: 4e-4, ..LineMotor::at(degrees) };
        let uninformed = MaximumLikelihoodSettings::suited(&plain(Sensing::default()));
        let deviation = |outcome: &Outcome<f64>| outcome.findings().angle_deviation.expect("stated");
        unknown.push(deviation(&detect(uninformed, &mut motor, |_| ())));
        let mut motor = LineMotor { skew, pick_up: ringing, slope: 4e-4, ..LineMotor::at(degrees) };
        informed.push(deviation(&detect(MaximumLikelihoodSettings::suited(&known), &mut motor, |_| ())));
    }
    assert!(worst < 0.06, "{worst}");
    // What is not known looks like noise.
    assert!((0..6).all(|k| unknown[k] > 5.0 * informed[k]), "{unknown:?} {informed:?}");
}
