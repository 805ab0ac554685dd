//! MOSFETs beside terminals with a capacitance: channels conduct both ways, so that currents rest in them and swing through zero.

use super::*;

/// The bridge that a scenario gives a motor at a low voltage: 0.1 V across a channel at rated current, terminals that ring with a
/// quality of 5, legs that are not told alike.
fn bridge(motor: &Motor, capacitance: f64) -> Inverter {
    let winding = &motor.winding;
    let inductance = (winding.d_axis_inductance() + winding.q_axis_inductance()) / 2.0;
    let per_rated = 1.0 / motor.rated_current;
    let devices =
        Devices { switch_resistance: 0.1 * per_rated, diode_resistance: 0.08 * per_rated, ..MOSFETS };
    let link = motor.dc_link.expect("of a low voltage");
    let mut inverter = inverter(devices, OpenLeg::Diodes, capacitance, link);
    inverter.bridge.terminal_resistance = (1.5 * inductance / capacitance).sqrt() / 5.0;
    for (gates, on) in inverter.gates.iter_mut().zip([139, 180, 175]) {
        (gates.turn_on_delay, gates.turn_off_delay) = (Nanos(on), Nanos(90 + on / 2));
    }
    inverter
}

/// Two pulses of a line with slow decay, and a wait with all legs at the lower rail and then off before what comes next.
fn slow_decay(pulse: [Leg<f64>; 3]) -> Vec<Command<f64>> {
    let short = pulse.map(|leg| if leg == High { Low } else { leg });
    let one = |count| {
        let both = Command::sequence(stage(pulse, 28), stage(short, 2372), Sampling::NONE);
        sampled(both, count)
    };
    let vector = [Duty(0.6), Duty(0.45), Duty(0.45)];
    let waits = [hold([Low; 3], 500), hold([Off; 3], 500)];
    [&[one(240), one(60)][..], &waits, &[hold(vector, 300)], &waits].concat()
}

/// A gate's edge came while a current was smaller than what counts as one, but larger than what a mode's end is located to. How the
/// current changed then decided which way the channel conducts; that was not the way the current still flowed, and ended at once.
#[test]
fn regress_a_current_that_rests_in_a_channel_does_not_chatter() {
    for name in ["gimbal", "outrunner", "light-vehicle"] {
        let motor = built_in(name).expect("built in");
        for (capacitance, place) in [1e-9, 10e-9].into_iter().flat_map(|c| (0..6_u32).map(move |k| (c, k))) {
            let mut case = case(&motor, bridge(&motor, capacitance));
            case.start_angle = 0.55 * f64::from(place);
            let lines = [[High, Low, Off], [Off, High, Low], [Low, Off, High]];
            let commands = lines.map(slow_decay).concat();
            let (run, _) = play(&case, &commands);
            let told = format!("{name} {capacitance} F, {} rad: {:?}", case.start_angle, run.work);
            assert!(!matches!(run.ended, Ended::Error(_)), "{told} {:?}", run.ended);
            assert!(run.work.events < 2000, "{told}");
            let ledger = run.ledger.expect("asked for");
            let lost = ledger.copper_loss + ledger.device_loss;
            assert!((ledger.imbalance() / lost).abs() < 1e-6, "{told} {ledger:?}");
        }
    }
}

/// Slow decay, which leaves currents in channels to rest there, and a wait after it.
#[test]
fn cross_the_referee_agrees_where_currents_rest_in_channels() {
    for (name, capacitance) in [("gimbal", 10e-9), ("outrunner", 1e-9), ("light-vehicle", 10e-9)] {
        let motor = built_in(name).expect("built in");
        let case = case(&motor, bridge(&motor, capacitance));
        let commands = &slow_decay([High, Low, Off])[..];
        let (ours, readings) = play(&case, commands);
        let strict = Case { tolerance: Tolerance { flux: 1e-3 * case.tolerance.flux }, ..case.clone() };
        let mut script = Script::new(commands);
        let theirs: Run<f64> = referee(&strict, &mut script, false, &mut NoProbe);
        assert!(!matches!(theirs.ended, Ended::Error(_)), "{name}: {:?} {:?}", theirs.ended, theirs.work);
        let pairs = readings.iter().zip(&script.readings);
        let off = pairs.flat_map(|(a, b)| (0..3).map(|k| (a.current.0[k] - b.current.0[k]).abs()));
        let worst = off.fold(0.0, f64::max) / motor.rated_current;
        println!("{name} {capacitance} F: {worst:.1e} of rated, {:?}", ours.work);
        assert!(readings.len() == 300 && script.readings.len() == 300);
        assert!(worst < 1e-6, "{name}: {worst:e} of rated");
    }
}
