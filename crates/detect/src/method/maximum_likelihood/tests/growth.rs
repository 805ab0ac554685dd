//! How far the pulses of adaptive trains grow.

use super::*;

#[test]
fn law_growth_stays_within_its_limits() {
    let adaptive = MaximumLikelihoodSettings::<f64>::adaptive(&nameplate());
    let limits = adaptive.adaptive.expect("adaptive");
    for (most_current, deviation) in [(7.0, 0.03), (3.0, 0.03), (7.0, 0.01)] {
        let mut settings = adaptive;
        settings.adaptive = Some(Adaptive { most_current, deviation: 1e-6, ..limits });
        let mut motor = LineMotor { deviation, ..LineMotor::at(77.0) };
        detect(settings, &mut motor, |_| ());
        let lengths: Vec<f64> = motor.pulses.chunks(6).map(|train| train[0].0).collect();
        assert_eq!(lengths.len(), usize::from(limits.most_trains));
        for pair in lengths.windows(2) {
            assert!(pair[1] >= pair[0] && pair[1] <= 3.0 * pair[0] + 1e-9, "{lengths:?}");
        }
        assert!(lengths.iter().all(|length| *length <= limits.longest.seconds()), "{lengths:?}");
        let peak = motor.pulses.iter().fold(0.0, |peak: f64, pulse| peak.max(pulse.1));
        assert!(peak < 1.1 * most_current, "{peak} {lengths:?}");
        assert!(lengths[7] > 2.0 * lengths[0], "{lengths:?}");
    }
    // Pulses that suffice end the detection; a second train has pulses that are at least a quarter longer.
    let mut motor = LineMotor { deviation: 0.002, slope: 1e-3, ..LineMotor::at(77.0) };
    let (_, findings) = found(detect(adaptive, &mut motor, |_| ()));
    assert!(findings.angle_deviation.expect("stated") <= limits.deviation);
    assert!(findings.pole_error.expect("stated") <= 1e-6);
    assert!(motor.pulses.len() <= 18, "{}", motor.pulses.len());
}

#[test]
fn law_no_pulse_grows_beyond_what_raises_the_rated_current_in_some_line() {
    let linear = Nameplate::<f64> { rated_pulse: Nanos::from_micros(260), ..nameplate() };
    let longest = |drive: &Nameplate<f64>| {
        MaximumLikelihoodSettings::adaptive(drive).adaptive.expect("adaptive").longest.seconds()
    };
    let whole =
        2.0 * linear.d_axis_inductance.min(linear.q_axis_inductance) * linear.rated_current / linear.dc_link;
    for share in [0.2, 0.5, 0.8] {
        let drive = Nameplate { rated_pulse: Nanos::from_seconds(share * whole), ..linear };
        let expected = share * whole * (0.9 + 0.1 * share);
        let longest = longest(&drive);
        assert!(longest <= expected + 1e-9, "{share}: {longest} {expected}");
        assert!(longest > 0.95 * expected, "{share}: {longest} {expected}");
    }
}
