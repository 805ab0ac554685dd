//! What harmonics, eddy currents, temperature and maps do to a run.

use standstill_detect::{Decay, LineInductance};
use standstill_interface::{Abc, Command, Leg, Nanos, Sampling, Stage};
use standstill_inverter::OpenLeg;
use standstill_plant::{EddyBranch, Harmonics, Motor, Temperature, built_in};
use standstill_scenario::{ErrorSet, Record, Scenario, Specimen};
use standstill_sim::{Ended, Event, NoProbe, RotorState, RunError, Tolerance, Trace, run};

use crate::bench::{Script, exact_case, ideal_inverter, mapped, paper_motor};

#[test]
fn analytic_the_current_of_a_voltage_step_with_eddy_currents() {
    // Without resistance the flux is ψ_pm + V t and the lag V τ (1 − exp(−t/τ)):
    // i = V t/L + G V τ (1 − exp(−t/τ)), with G = depth/(1 − depth)/L.
    let mut motor = paper_motor().linearised();
    motor.resistance = 0.0;
    let (tau, depth) = (50e-6, 0.2);
    let branch = EddyBranch { time_constant: tau, d_depth: depth, q_depth: 0.0 };
    motor.magnetics = motor.magnetics.clone().with_eddy_currents(Some(branch));
    let inductance = motor.winding.d_axis_inductance();
    let mut case = exact_case(&motor, ideal_inverter(OpenLeg::Diodes), 0.0);
    case.tolerance = Tolerance { flux: 1e-13 };
    let legs = Abc::new(Leg::High, Leg::Low, Leg::Low);
    let stage = Stage { legs, duration: Nanos::from_micros(300) };
    let sampling = Sampling { first: Nanos::from_micros(5), interval: Nanos::from_micros(5), count: 60 };
    let mut script = Script::new(vec![Command::hold(stage, sampling)]);
    let end = run(&case, &mut script, true, &mut NoProbe);
    let voltage = 550.0 * 2.0 / 3.0;
    for (k, reading) in script.readings.iter().enumerate() {
        let t = 5e-6 * (k as f64 + 1.0);
        let eddy = depth / (1.0 - depth) / inductance * voltage * tau * (1.0 - (-t / tau).exp());
        let expected = voltage * t / inductance + eddy;
        let got = reading.current.0[0];
        assert!((got / expected - 1.0).abs() < 1e-9, "{t}: {got} {expected}");
    }
    // A short pulse sees L (1 − depth), and heat is what the branch makes of it.
    let first = voltage * 5e-6 / script.readings[0].current.0[0];
    assert!((first / inductance - (1.0 - depth)).abs() < 0.01, "{first}");
    let ledger = end.ledger.expect("asked for");
    assert!(ledger.eddy_loss > 0.0 && ledger.imbalance().abs() < 1e-9 * ledger.eddy_loss, "{ledger:?}");
}

/// rms of the axis error over all angles of an ideal drive, in degrees.
fn axis_error(motor: Motor) -> f64 {
    let mut scenario = Scenario::paper(motor, ErrorSet::None, Decay::Fast, RotorState::Locked, 1);
    scenario.detector.polarity.least_margin = 0.0;
    let squares = (0..180).map(|step| {
        let case = scenario.case_at(f64::from(2 * step).to_radians(), Specimen { drive: 0, noise: 0 });
        let mut detector = LineInductance::new(scenario.detector).expect("settings");
        let run = run(&case, &mut detector, false, &mut NoProbe);
        Record { trial: 0, run }.axis_error_deg().expect("an axis").powi(2)
    });
    (squares.sum::<f64>() / 180.0).sqrt()
}

#[test]
fn analytic_a_fourth_harmonic_costs_what_the_small_error_formula_says() {
    // The wave of 2θ is misread by half of the ratio of the amplitudes, six times a revolution: rms
    // L_4/(2 √2 |L_B|), 1.01° for 5 %. A phase that differs by δ shifts it by δ/(9 |L_B|)/2, rms √½ of that.
    let motor = paper_motor().linearised();
    let with = |harmonics| {
        let magnetics = motor.magnetics.clone().with_harmonics(harmonics);
        axis_error(Motor { magnetics, ..motor.clone() })
    };
    let saliency = motor.winding.saliency.abs();
    let own = axis_error(motor.clone());
    assert!(own < 0.01, "{own}");
    let fourth = with(Harmonics { inductance_4: 0.05 * saliency, ..Harmonics::default() });
    let expected = (0.05 / (2.0 * 2.0_f64.sqrt())).to_degrees();
    assert!((expected - 1.01).abs() < 0.01 && (fourth / expected - 1.0).abs() < 0.02, "{fourth} {expected}");
    let odd = 0.01 * motor.winding.mean_inductance;
    let one_phase = with(Harmonics { asymmetry: odd, ..Harmonics::default() });
    let expected = (odd / 9.0 / saliency / 2.0 * 2.0 * std::f64::consts::FRAC_1_SQRT_2).to_degrees();
    assert!((one_phase / expected - 1.0).abs() < 0.05, "{one_phase} {expected}");
}

#[test]
fn law_a_detection_on_a_map_is_that_on_the_core_it_was_sampled_from() {
    // L_q of `pm-reluctance` has a cusp at no current, from |ψ_q|³ in its energy, which splines round off; and its axes
    // differ fivefold, so that a line's current shows it more than the axes' do.
    for (name, bound) in [("paper-5k5", 1e-6), ("cross-saturation", 1e-6), ("pm-reluctance", 4e-3)] {
        let motor = built_in(name).expect("built in");
        let (map, _) = mapped(&motor, 1.6 * motor.rated_current);
        let detect = |motor: &Motor| {
            let scenario =
                Scenario::paper(motor.clone(), ErrorSet::Default, Decay::Fast, RotorState::Free, 1);
            let mut case = scenario.case(4);
            // Converters would round both to the same code or to neighbours.
            case.sensors.settings.adc = None;
            let mut trace = Trace::new(1.0);
            let mut detector = LineInductance::new(scenario.detector).expect("settings");
            let run = run(&case, &mut detector, false, &mut trace);
            let samples = trace.events.iter().filter_map(|(_, event)| match event {
                Event::Sample(reading) => Some(reading.current.0),
                _ => None,
            });
            (run, samples.collect::<Vec<_>>())
        };
        let ((own, own_samples), (its, its_samples)) = (detect(&motor), detect(&map));
        assert!(own_samples.len() == its_samples.len() && own_samples.len() > 20, "{name}");
        for (a, b) in own_samples.iter().flatten().zip(its_samples.iter().flatten()) {
            assert!((a - b).abs() < bound * motor.rated_current, "{name}: {a} {b}");
        }
        let (a, b) = (own.found().expect("an angle"), its.found().expect("an angle"));
        assert!((a - b).abs() < 0.05_f64.to_radians(), "{name}: {a} {b}");
    }
}

#[test]
fn law_leaving_a_map_ends_the_run_and_says_where() {
    let motor = paper_motor();
    let (map, report) = mapped(&motor, 5.0);
    assert_eq!(report.range, [[-5.0, 5.0]; 2]);
    // The line pulses stay inside, the polarity test needs 8 A.
    let scenario = Scenario::paper(map, ErrorSet::None, Decay::Fast, RotorState::Locked, 1);
    let mut trace = Trace::new(1e-3);
    let mut detector = LineInductance::new(scenario.detector).expect("settings");
    let run = run(&scenario.case_at(0.7, Specimen { drive: 0, noise: 0 }), &mut detector, false, &mut trace);
    let Ended::Error(RunError::LeftMap { current_ma: [d, q] }) = run.ended else { panic!("{:?}", run.ended) };
    assert!((d.abs() - 5000).abs() <= 1 && q.abs() < 5000, "{d} mA, {q} mA");
    assert!(matches!(trace.events.last(), Some((_, Event::LeftMap))), "{:?}", trace.events.last());
    let record = Record { trial: 0, run };
    assert!(record.reason().contains("left the motor's flux map"), "{}", record.reason());
    assert_eq!(record.estimated_angle_deg(), None);
}

#[test]
fn law_a_hot_motor_is_found_less_surely() {
    // 10 % less flux: the core is further from saturation, and the poles differ less.
    let margin = |magnet: f64| {
        let motor = paper_motor().at_temperature(Temperature { winding: None, magnet: Some(magnet) });
        let scenario =
            Scenario::paper(motor.expect("survives"), ErrorSet::None, Decay::Fast, RotorState::Locked, 1);
        let mut detector = LineInductance::new(scenario.detector).expect("settings");
        let case = scenario.case_at(0.5, Specimen { drive: 0, noise: 0 });
        let run = run(&case, &mut detector, false, &mut NoProbe);
        let Ended::Outcome(outcome) = run.ended else { panic!("{:?}", run.ended) };
        outcome.findings().polarity.expect("a polarity test").margin()
    };
    let (cold, hot) = (margin(20.0), margin(110.0));
    assert!(hot < 0.8 * cold && hot > 0.3 * cold, "{cold} {hot}");
}
