//! Bandwidth, phases converted one after the other, and pick-up: against closed forms.

use std::f64::consts::TAU;

use standstill_detect::{Method, MethodName};
use standstill_interface::{Command, Nanos, Phase, Reading, Sampling, Stage};
use standstill_inverter::OpenLeg;
use standstill_plant::built_in;
use standstill_scenario::{ErrorSet, Scenario};
use standstill_sim::{Adc, NoProbe, PickUp, RotorState, Sensors, run};

use crate::bench::{Script, exact_case, ideal_inverter, reference_motor};

const ON: f64 = 80e-6;

/// A line pulse A to B of 80 µs and 40 µs of fast decay, with the rotor where the pulse is along d: one equation of first
/// order, `2 L_d di/dt = ±U − 2 R i`.
fn readings(change: impl Fn(&mut Sensors), times: &[u64]) -> Vec<Reading<f64>> {
    let motor = reference_motor();
    let mut case = exact_case(&motor, ideal_inverter(OpenLeg::Diodes), 330.0);
    change(&mut case.sensors);
    let read = |time: &u64| {
        let stages =
            [Stage::line(Phase::A, Phase::B, Nanos::from_micros(80)), Stage::off(Nanos::from_micros(40))];
        let command = Command::sequence(stages[0], stages[1], Sampling::once(Nanos(*time)));
        let mut script = Script::new(vec![command]);
        run(&case, &mut script, false, &mut NoProbe);
        script.readings[0]
    };
    times.iter().map(read).collect()
}

/// Current of phase a in A at a time in s behind a filter of such a time constant in s, from the two exponentials.
fn expected(t: f64, lag: f64) -> f64 {
    let motor = reference_motor();
    let winding = motor.winding.d_axis_inductance() / motor.resistance;
    // The response to a voltage that is switched on at zero: the difference of two of these is the pulse.
    let step = |t: f64| {
        if t <= 0.0 {
            return 0.0;
        }
        let ends = winding * (-t / winding).exp() - lag * (-t / lag).exp();
        1.0 - ends / (winding - lag)
    };
    550.0 / (2.0 * motor.resistance) * (step(t) - 2.0 * step(t - ON))
}

#[test]
fn analytic_each_phase_lags_by_its_own_filter_and_is_taken_at_its_own_time() {
    let corner = [1.1, 0.8, 1.0];
    let times = [5_000, 37_000, 79_900, 80_300, 95_000];
    let read = readings(
        |sensors| {
            sensors.settings.bandwidth = Some(100e3);
            sensors.settings.skew = Nanos(700);
            sensors.corner = corner;
        },
        &times,
    );
    for (at, reading) in times.into_iter().zip(read) {
        for (k, sign) in [(0, 1.0), (1, -1.0)] {
            let t = at as f64 * 1e-9 + k as f64 * 0.7e-6;
            let should = sign * expected(t, 1.0 / (TAU * 100e3 * corner[k]));
            assert!((reading.current.0[k] - should).abs() < 2e-6, "{k} at {at} ns: {reading:?} {should}");
        }
        assert_eq!(reading.at, Nanos(at));
    }
}

/// The capacitor of the converter, alone and behind the sensors' filters: the response of one pole more.
#[test]
fn analytic_a_capacitor_in_front_of_the_converter_is_one_pole_more() {
    let motor = reference_motor();
    let winding = motor.winding.d_axis_inductance() / motor.resistance;
    let times = [2_000, 37_000, 79_900, 80_400, 95_000];
    let filter = 1.0 / (TAU * 100e3);
    // 1.59 us is the filter's own time constant, where both cannot be told apart.
    for (bandwidth, acquisition) in
        [(None, 0.7e-6), (Some(100e3), 0.7e-6), (Some(100e3), 4e-6), (Some(100e3), filter)]
    {
        let read = readings(
            |sensors| {
                sensors.settings.bandwidth = bandwidth;
                sensors.settings.acquisition = acquisition;
            },
            &times,
        );
        let cascade = |t: f64| {
            let step = |t: f64| {
                // A little apart, where two poles are one.
                let poles = [winding, filter * 1.00005, acquisition];
                let part = |i: usize| {
                    let [a, b] = [poles[(i + 1) % 3], poles[(i + 2) % 3]];
                    poles[i] * poles[i] / ((poles[i] - a) * (poles[i] - b)) * (-t / poles[i]).exp()
                };
                if t <= 0.0 { 0.0 } else { 1.0 - part(0) - part(1) - part(2) }
            };
            550.0 / (2.0 * motor.resistance) * (step(t) - 2.0 * step(t - ON))
        };
        for (at, reading) in times.into_iter().zip(read) {
            let t = at as f64 * 1e-9;
            let should = if bandwidth.is_none() { expected(t, acquisition) } else { cascade(t) };
            let within = if bandwidth.is_none() { 2e-6 } else { 1e-4 };
            assert!(
                (reading.current.0[0] - should).abs() < within,
                "{bandwidth:?} {acquisition} at {at} ns: {} {should}",
                reading.current.0[0]
            );
        }
    }
}

#[test]
fn law_no_phase_is_taken_after_the_end_of_its_command() {
    let skewed = |skew: u64| {
        readings(|sensors| sensors.settings.skew = Nanos(skew), &[119_000, 120_000])
            .into_iter()
            .map(|reading| reading.current.0)
            .collect::<Vec<_>>()
    };
    let (at_once, late) = (skewed(0), skewed(800));
    assert_eq!(late[1], at_once[1]);
    // At 119 µs phase b is taken 0.8 µs later, phase c (which has no current) at the end.
    let fall = (at_once[0][1] - at_once[1][1]) / 1e-6;
    assert_eq!(late[0][0], at_once[0][0]);
    assert!((late[0][1] - (at_once[0][1] - fall * 0.8e-6)).abs() < 1e-5, "{late:?} {at_once:?}");
}

#[test]
fn analytic_a_reading_is_the_mean_of_its_conversions() {
    let times = [37_000, 79_900, 95_000, 119_000];
    // With filters samples are read off the steps that pass them, without they end steps.
    for (bandwidth, skew) in [(None, 0), (None, 300), (Some(100e3), 0), (Some(100e3), 300)] {
        let read = readings(
            |sensors| {
                sensors.settings.bandwidth = bandwidth;
                sensors.settings.skew = Nanos(skew);
                sensors.settings.oversampling = 5;
                sensors.settings.conversion = Nanos(800);
            },
            &times,
        );
        let lag = bandwidth.map_or(1e-12, |corner| 1.0 / (TAU * corner));
        for (at, reading) in times.into_iter().zip(read) {
            for (k, sign) in [(0_u8, 1.0), (1, -1.0)] {
                let mut mean = 0.0;
                let mut begin = at;
                for _ in 0..5 {
                    // Nothing is converted after the end of the command.
                    mean += expected((begin + u64::from(k) * skew).min(120_000) as f64 * 1e-9, lag) / 5.0;
                    begin = (begin + 800).min(120_000);
                }
                let value = sign * mean;
                assert!(
                    (reading.current.0[usize::from(k)] - value).abs() < 2e-5,
                    "{k} at {at} ns: {reading:?} {value}"
                );
            }
            assert_eq!(reading.at, Nanos(at));
        }
    }
}

#[test]
fn law_a_mean_has_less_noise_and_its_code_is_a_sum() {
    let motor = reference_motor();
    let rms = |oversampling| {
        let mut case = exact_case(&motor, ideal_inverter(OpenLeg::Diodes), 330.0);
        case.sensors.settings.noise = 0.1;
        case.sensors.settings.adc = Some(Adc { bits: 12, low: -20.0, high: 20.0 });
        case.sensors.settings.oversampling = oversampling;
        let sampling = Sampling { first: Nanos(100_000), interval: Nanos(100_000), count: 1000 };
        let command = Command::hold(Stage::off(Nanos(100_100_000)), sampling);
        let mut script = Script::new(vec![command]);
        run(&case, &mut script, false, &mut NoProbe);
        for reading in &script.readings {
            let n = f64::from(oversampling);
            let value = f64::from(reading.counts.current.0[0]) / n * (40.0 / 4096.0) - 20.0;
            assert!((value - reading.current.0[0]).abs() < 1e-9, "{reading:?}");
        }
        let squares: f64 = script.readings.iter().map(|reading| reading.current.0[0].powi(2)).sum();
        (squares / script.readings.len() as f64).sqrt()
    };
    assert!((rms(1) / rms(16) / 4.0 - 1.0).abs() < 0.1, "{} {}", rms(1), rms(16));
}

/// The drive knows that a mean is that of its middle: pulses both ways have no larger error by it, and less noise.
#[test]
fn law_methods_that_know_the_mean_gain_by_it() {
    for method in [MethodName::Bipolar, MethodName::MaximumLikelihood] {
        let rms = |oversampling| {
            let mut scenario = field(method);
            scenario.sensors.noise *= 5.0;
            scenario.sensors.oversampling = oversampling;
            scenario.detector = Method::suited(method, &scenario.nameplate());
            let errors =
                (0..60).map(|trial| scenario.trial(trial).expect("settings").error_deg().unwrap_or(90.0));
            (errors.map(|error| error * error).sum::<f64>() / 60.0).sqrt()
        };
        let (one, four) = (rms(1), rms(4));
        assert!(four < 0.85 * one, "{method}: {four}° with four conversions, {one}° with one");
    }
}

#[test]
fn analytic_edges_add_their_ringing_to_all_phases() {
    let of = PickUp { amplitude: 0.2, decay: 0.4e-6, frequency: 4e6 };
    let times = [10, 400, 1_100, 79_999, 80_010, 80_060, 80_333, 81_500];
    let with = readings(|sensors| sensors.settings.pick_up = Some(of), &times);
    let without = readings(|_| {}, &times);
    let ring = |t: f64| if t > 0.0 { (-t / 0.4e-6).exp() * (TAU * 4e6 * t).cos() } else { 0.0 };
    for ((at, with), without) in times.into_iter().zip(with).zip(without) {
        // At the begin a rises and b falls, by half the link each; at its end a falls and b rises by all of it: they cancel.
        for k in 0..3 {
            let added = with.current.0[k] - without.current.0[k];
            assert!(added.abs() < 1e-12, "{k} at {at} ns: {added}");
        }
    }
    for at in [10, 400, 1_100, 80_000, 80_060, 80_333, 81_500] {
        let t = at as f64 * 1e-9;
        let added = one_leg(of, at) - one_leg(PickUp { amplitude: 0.0, ..of }, at);
        // Two legs fall from where they float, one rises: a half less two halves. Then the one that rose falls wholly.
        let should = -0.1 * ring(t) - 0.2 * ring(t - ON);
        assert!((added - should).abs() < 1e-9, "{at} ns: {added} A, {should} A");
    }
}

/// What phase a reads at a time in ns where a is high and then low, with b and c low all the time.
fn one_leg(of: PickUp, at: u64) -> f64 {
    use standstill_interface::{Abc, Leg};
    let motor = reference_motor();
    let mut case = exact_case(&motor, ideal_inverter(OpenLeg::Diodes), 0.0);
    case.sensors.settings.pick_up = Some(of);
    let stage =
        |a, micros| Stage { legs: Abc([a, Leg::Low, Leg::Low]), duration: Nanos::from_micros(micros) };
    let command = Command::sequence(stage(Leg::High, 80), stage(Leg::Low, 40), Sampling::once(Nanos(at)));
    let mut script = Script::new(vec![command]);
    run(&case, &mut script, false, &mut NoProbe);
    script.readings[0].current[Phase::A]
}

fn field(method: MethodName) -> Scenario<Method<f64>> {
    let motor = built_in("paper-5k5").expect("built in");
    Scenario::of_method(method, motor, ErrorSet::Field, RotorState::Locked, 1)
}

#[test]
fn law_corner_frequencies_have_the_stated_spread_and_shift_no_other_draw() {
    let (field, mut default) = (field(MethodName::Bipolar), field(MethodName::Bipolar));
    default.sensors = ErrorSet::Default.sensors(default.motor.rated_current, 550.0);
    let (mut least, mut most, mut apart) = (f64::INFINITY, 0.0_f64, 0.0_f64);
    let mut sum = 0.0_f64;
    for trial in 0..4000 {
        let [a, b] = [&field, &default].map(|scenario| scenario.case(trial));
        let corner = a.sensors.corner;
        for k in 0..3 {
            (least, most) = (least.min(corner[k]), most.max(corner[k]));
            apart = apart.max(corner[k] / corner[(k + 1) % 3]);
            sum += corner[k] / 12_000.0;
        }
        assert_eq!(b.sensors.corner, [1.0; 3]);
        // Comparators of the field are slower.
        let (settings, comparator) = (b.sensors.settings, b.sensors.comparator);
        assert_eq!(Sensors { settings, comparator, corner: [1.0; 3], ..a.sensors }, b.sensors);
        assert_eq!((a.start_angle, a.inverter), (b.start_angle, b.inverter));
    }
    // Uniform over ±20 % with ±3 % on top.
    assert!(least > 0.8 * 0.97 && least < 0.785 && most < 1.2 * 1.03 && most > 1.225, "{least} {most}");
    assert!(apart < 1.03 / 0.97 && apart > 1.055 && (sum - 1.0).abs() < 0.008, "{apart} {sum}");
}

#[test]
fn law_what_the_drive_knows_is_nominal() {
    let sensing = field(MethodName::Bipolar).nameplate().sensing;
    assert_eq!((sensing.bandwidth, sensing.skew), (Some(200e3), Nanos(500)));
    assert_eq!(sensing.bandwidth_mismatch, 0.03);
    assert_eq!(sensing.pick_up, [0.2, 0.5e-6]);
}
