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

#[test]
fn law_shunts_below_the_legs_show_angle_and_pole() {
    // Converted one after the other: the same shunt shows one way of a line late and the other way early.
    let sensing = Sensing { place: Place::BelowLegs, skew: Nanos(500), ..Sensing::default() };
    let drive = Nameplate { sensing, ..nameplate() };
    for settings in [MaximumLikelihoodSettings::suited(&drive), MaximumLikelihoodSettings::adaptive(&drive)] {
        let mut exact =
            LineMotor { slope: 4e-4, place: Place::BelowLegs, skew: 0.5e-6, ..LineMotor::at(77.0) };
        (exact.offset, exact.gain) = ([0.05, -0.08, 0.02], [1.004, 0.997, 1.001]);
        let (angle, findings) = found(detect(settings, &mut exact, |_| ()));
        assert!(exact.error(angle).abs() < 0.01, "{}", exact.error(angle));
        let Abc::<f64>(gains) = findings.sensor_gain.expect("compared");
        let mean = exact.gain.iter().sum::<f64>() / 3.0;
        assert!((0..3).all(|k| (gains[k] - exact.gain[k] / mean).abs() < 2e-4), "{gains:?}");
        let (mut squares, mut stated, trials) = (0.0, 0.0, 100);
        for trial in 0..trials {
            let mut motor = LineMotor {
                slope: 4e-4,
                place: Place::BelowLegs,
                skew: 0.5e-6,
                ..LineMotor::at(3.6 * f64::from(trial))
            }
            .with_noise(0.02, trial);
            motor.gain = core::array::from_fn(|_| 1.0 + 0.005 * motor.noise.gauss());
            let (angle, findings) = found(detect(settings, &mut motor, |_| ()));
            squares += motor.error(angle).powi(2) / f64::from(trials);
            stated += findings.angle_deviation.expect("stated").to_degrees().powi(2) / f64::from(trials);
        }
        let ratio = (squares / stated).sqrt();
        assert!((0.7..1.4).contains(&ratio), "{ratio}: {} {}", squares.sqrt(), stated.sqrt());
    }
}
