//! Amplifiers of shunts and capacitors of converters: closed forms of what they show before they have settled.

use std::f64::consts::TAU;

use standstill_interface::{Abc, Command, Leg, Nanos, Phase, Sampling, Sensed, Stage};
use standstill_inverter::OpenLeg;
use standstill_sim::{Arrangement, NoProbe, run};

use crate::bench::{Script, exact_case, ideal_inverter, reference_motor};

/// Current of the link behind a filter while a line's current rises, and while diodes return it: the filter meets `i`, then `−i`.
#[test]
fn analytic_a_slow_amplifier_shows_what_it_has_not_settled_from() {
    const ON: f64 = 80e-6;
    let motor = reference_motor();
    let lag = 1.0 / (TAU * 100e3);
    let winding = motor.winding.d_axis_inductance() / motor.resistance;
    let most = 550.0 / (2.0 * motor.resistance);
    // Line current: up to ON towards `most`, then from there towards −`most`.
    let peak = most * (1.0 - (-ON / winding).exp());
    // Response at t of a filter that begins at `y` to a + b e^(−t/winding).
    let response = |t: f64, y: f64, a: f64, b: f64| {
        let gain = b * winding / (winding - lag);
        a + gain * (-t / winding).exp() + (y - a - gain) * (-t / lag).exp()
    };
    let rise = |t: f64| response(t, 0.0, most, -most);
    let expected = |t: f64| {
        if t <= ON { rise(t) } else { response(t - ON, rise(ON), most, -(peak + most)) }
    };
    let at = |at: u64| {
        let mut case = exact_case(&motor, ideal_inverter(OpenLeg::Diodes), 330.0);
        case.sensors.settings.arrangement = Arrangement::DcLinkShunt;
        case.sensors.settings.bandwidth = Some(100e3);
        let pulse = Stage::line(Phase::A, Phase::B, Nanos::from_micros(80));
        let command = Command::sequence(pulse, Stage::off(Nanos::from_micros(40)), Sampling::once(Nanos(at)));
        let mut script = Script::new(vec![command]);
        run(&case, &mut script, false, &mut NoProbe);
        script.readings[0]
    };
    for time in [5_000, 37_000, 79_900, 80_300, 81_000, 95_000] {
        let (read, should) = (at(time), expected(time as f64 * 1e-9));
        assert!((read.link_current - should).abs() < 2e-6, "{time} ns: {} A, {should} A", read.link_current);
        // Too early after the edge, and the drive does not know: it reads the wrong sign and size, unflagged.
        assert_eq!(read.link_sensed, Sensed::Measured);
    }
}

/// What an amplifier or a capacitor still has when the current is gone it goes on losing: in a straight line, or by e^(−t/τ).
#[test]
fn analytic_amplifiers_and_capacitors_go_on_while_no_current_flows() {
    const ON: f64 = 20e-6;
    // Its resistance makes the current fall faster than it rose.
    let mut motor = reference_motor();
    motor.resistance = 40.0;
    let inductance = motor.winding.d_axis_inductance();
    let (winding, slope) = (inductance / motor.resistance, 550.0 / (2.0 * inductance));
    let gone = ON + winding * (2.0 - (-ON / winding).exp()).ln();
    assert!(gone < 39.2e-6, "{gone}");
    let at = |slew: f64, acquisition: f64, at: u64| {
        let mut case = exact_case(&motor, ideal_inverter(OpenLeg::Diodes), 330.0);
        case.sensors.settings.arrangement = Arrangement::DcLinkShunt;
        case.sensors.settings.slew = slew;
        case.sensors.settings.acquisition = acquisition;
        let pulse = Stage::line(Phase::A, Phase::B, Nanos::from_micros(20));
        let command = Command::sequence(pulse, Stage::off(Nanos::from_micros(60)), Sampling::once(Nanos(at)));
        let mut script = Script::new(vec![command]);
        run(&case, &mut script, false, &mut NoProbe);
        script.readings[0].link_current
    };
    // Slower than the current: S t up to the edge, and as long down again.
    let slew = 0.75 * slope;
    for (time, should) in [(10_000, slew * 10e-6), (39_500, slew * 0.5e-6), (41_000, 0.0)] {
        let read = at(slew, 0.0, time);
        assert!((read - should).abs() < 2e-6, "{time} ns: {read} A, {should} A");
    }
    let [early, late] = [45_000, 50_000].map(|time| at(0.0, 5e-6, time));
    assert!(early.abs() > 1e-3 && (late / early - (-1.0_f64).exp()).abs() < 1e-5, "{early} A, {late} A");
}

/// An amplifier with a slew rate goes from the current before an edge to the one after it in a straight line, with and without a filter
/// in front of the limit.
#[test]
fn analytic_an_amplifier_with_a_slew_rate_reaches_the_current_after_an_edge_late() {
    const ON: f64 = 80e-6;
    const SLEW: f64 = 2e6;
    let motor = reference_motor();
    let winding = motor.winding.d_axis_inductance() / motor.resistance;
    let most = 550.0 / (2.0 * motor.resistance);
    let peak = most * (1.0 - (-ON / winding).exp());
    let at = |bandwidth, arrangement, at: u64| {
        let mut case = exact_case(&motor, ideal_inverter(OpenLeg::Diodes), 330.0);
        case.sensors.settings.arrangement = arrangement;
        case.sensors.settings.bandwidth = bandwidth;
        case.sensors.settings.slew = SLEW;
        let pulse = Stage::line(Phase::A, Phase::B, Nanos::from_micros(80));
        let command = Command::sequence(pulse, Stage::off(Nanos::from_micros(40)), Sampling::once(Nanos(at)));
        let mut script = Script::new(vec![command]);
        run(&case, &mut script, false, &mut NoProbe);
        script.readings[0]
    };
    // What the link carries: i, and after the edge −i.
    let rise = |t: f64| most * (1.0 - (-t / winding).exp());
    let fall = |t: f64| -(peak + most) * (-t / winding).exp() + most;
    for time in [5_000, 79_900, 80_000, 80_500, 81_900, 82_200, 84_000, 95_000] {
        let t = time as f64 * 1e-9;
        let should = if t <= ON { rise(t) } else { fall(t - ON).max(rise(ON) - SLEW * (t - ON)) };
        let read = at(None, Arrangement::DcLinkShunt, time).link_current;
        assert!((read - should).abs() < 2e-6, "{time} ns: {read} A, {should} A");
        // Behind a filter that is faster than the limit.
        let lag = 1.0 / (TAU * 100e3);
        let response = |t: f64, y: f64, a: f64, b: f64| {
            let gain = b * winding / (winding - lag);
            a + gain * (-t / winding).exp() + (y - a - gain) * (-t / lag).exp()
        };
        let filtered = |t: f64| response(t, 0.0, most, -most);
        let after = response(t - ON, filtered(ON), most, -(peak + most));
        let should = if t <= ON { filtered(t) } else { after.max(filtered(ON) - SLEW * (t - ON)) };
        let read = at(Some(100e3), Arrangement::DcLinkShunt, time).link_current;
        assert!((read - should).abs() < 2e-6, "{time} ns, filtered: {read} A, {should} A");
    }
    // Below leg b, which the pulse leaves, the current ends with the pulse; below leg a it begins.
    let read = at(None, Arrangement::LowSideShunts, 80_500);
    let should = [SLEW * 0.5e-6, -(peak - SLEW * 0.5e-6)];
    for (k, should) in should.into_iter().enumerate() {
        assert!((read.current.0[k] - should).abs() < 2e-6, "{read:?}: {should} A");
    }
}

/// Right before dead time and settling time have passed since a request the drive hides what it reads, and from then on it does not.
#[test]
fn law_a_reading_is_hidden_until_the_amplifier_is_taken_to_have_settled() {
    let motor = reference_motor();
    let pulse = |legs: [Leg<f64>; 3], micros| Stage { legs: Abc(legs), duration: Nanos::from_micros(micros) };
    let (high, low) = (Leg::High, Leg::Low);
    let command = |at| {
        Command::sequence(
            pulse([high, low, low], 80),
            pulse([high, high, low], 40),
            Sampling::once(Nanos(at)),
        )
    };
    for arrangement in [Arrangement::DcLinkShunt, Arrangement::LowSideShunts] {
        let at = |at: u64| {
            let mut case = exact_case(&motor, ideal_inverter(OpenLeg::Diodes), 330.0);
            case.sensors.settings.arrangement = arrangement;
            case.sensors.settings.settle = Nanos(3000);
            for gates in &mut case.inverter.gates {
                gates.dead_time = Nanos(2000);
            }
            let mut script = Script::new(vec![command(at)]);
            run(&case, &mut script, false, &mut NoProbe);
            script.readings[0].sensed.0.map(|sensed| sensed != Sensed::Hidden)
        };
        let shunt = arrangement == Arrangement::DcLinkShunt;
        // At the begin all legs are requested, after 80 µs leg b alone.
        assert_eq!(at(4_999), [false; 3]);
        assert_eq!(at(5_000), if shunt { [true, false, false] } else { [true; 3] });
        assert_eq!(at(84_999), [false, false, !shunt]);
        assert_eq!(at(85_000), [false, false, true]);
    }
}
