//! Currents pass through zero late: an instant is then told to 4e-6 ns, in which the current of a small motor changes by more than
//! what counts as zero.

use super::*;

/// After that long numbers of ns are 4e-6 apart.
const WAIT_MICROS: u64 = 17_200_000;

/// So much later, from rest.
fn late(commands: &[Command<f64>]) -> Vec<Command<f64>> {
    [&[hold([Off; 3], WAIT_MICROS)][..], commands].concat()
}

/// What it ends with and reads. Without a ledger, which looks at each of a million periods.
fn played(case: &Case, commands: &[Command<f64>]) -> (Run<f64>, Vec<Reading<f64>>) {
    let mut script = Script::new(commands);
    let run = run(case, &mut script, false, &mut NoProbe);
    (run, script.readings)
}

/// A terminal swings while the two others are held by channels that are on. Each of these has half of its current, and is a resistance
/// both ways: nothing begins or ends where the current reverses, twice a period, and the swing is the one of a fixed resistance.
///
/// `i″ + R/L i′ + i/(L C) = 0` with L = 1.5 times the winding's, R = 1.5 times its resistance and half of a channel's.
#[test]
fn analytic_a_channel_is_a_resistance_whichever_way_its_current_flows() {
    let (inductance, winding, channel, capacitance, link) = (27e-6, 20e-3, 10e-3, 1e-9, 24.0);
    let motor = linear(inductance, winding);
    let (l, r) = (1.5 * inductance, 1.5 * winding + 0.5 * channel);
    let (decay, square) = (r / (2.0 * l), 1.0 / (l * capacitance));
    let angular = f64::sqrt(square - decay * decay);
    let devices = Devices { switch_resistance: channel, ..MOSFETS };
    // Above 0.9 of its way up the open terminal would meet its diode: its swing is about the lower rail, as far as half the link.
    let mut case = case(&motor, inverter(devices, OpenLeg::Open, capacitance, link));
    case.inverter.gates = [GateTiming::default(); 3];
    let swing = sampled(hold([Low, Low, Off], 40), 400);
    for commands in [vec![swing], late(&[swing])] {
        let (run, readings) = played(&case, &commands);
        assert!(!matches!(run.ended, Ended::Error(_)), "{:?} {:?}", run.ended, run.work);
        assert!(readings.len() == 400 && run.work.events < 200, "{:?}", run.work);
        let size = link / 2.0 * capacitance * square / angular;
        for (time, reading) in (1..).map(|k| f64::from(k) * 1e-7).zip(&readings) {
            let current = size * (-decay * time).exp() * (angular * time).sin();
            for (found, share) in reading.current.0.into_iter().zip([-0.5, -0.5, 1.0]) {
                let off = (found - share * current).abs();
                assert!(off < 2e-5 * size, "{time} s: {found} A where {} is right", share * current);
            }
        }
    }
}

/// Whatever the legs are made of: what follows after a long wait at rest is what would have followed at once.
#[test]
fn law_currents_do_not_depend_on_when_they_begin() {
    let ideal_legs = Devices::default();
    // Without thresholds, but another resistance each way: the mode changes where its current does, and nothing else with it.
    let uneven = Devices { switch_resistance: 50e-3, diode_resistance: 10e-3, ..ideal_legs };
    for (name, link) in [("outrunner", 12.0), ("light-vehicle", 48.0)] {
        let motor = built_in(name).expect("built in");
        for (of, devices) in
            [("ideal", ideal_legs), ("uneven", uneven), ("usual", USUAL), ("MOSFETs", MOSFETS)]
        {
            let mut case = case(&motor, inverter(devices, OpenLeg::Diodes, 0.3e-9, link));
            case.inverter.bridge.terminal_resistance =
                (1.5 * motor.winding.q_axis_inductance() / 0.3e-9).sqrt() / 5.0;
            for (kind, commands) in sequences(10) {
                let [at_once, later] =
                    [commands.clone(), late(&commands)].map(|commands| played(&case, &commands));
                let told = format!("{name}, {of}, {kind}: {:?}", later.0.work);
                assert!(!matches!(later.0.ended, Ended::Error(_)), "{told} {:?}", later.0.ended);
                let pairs = at_once.1.iter().zip(&later.1);
                let off = pairs.flat_map(|(a, b)| (0..3).map(|k| (a.current.0[k] - b.current.0[k]).abs()));
                let worst = off.fold(0.0, f64::max) / motor.rated_current;
                println!("{told}, {worst:.1e} of rated");
                assert!(at_once.1.len() == later.1.len() && worst < 1e-6, "{told} {worst:e} of rated");
            }
        }
    }
}
