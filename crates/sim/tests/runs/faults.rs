//! Faults of wires, switches and sensors: closed forms of what flows and is read, the energy ledger, and lanes.
#![allow(clippy::disallowed_methods, reason = "tests compare with the C library")]

mod software;

use super::script::{LINK, Script, same_bits_in_lanes, stage};
use Leg::{Duty, High, Low, Off};
use standstill_interface::{Command, Leg, Nanos, Reading, Sampling, Sensed};
use standstill_inverter::{Bridge, DcLink, DeviceKind, Devices, Gate, GateTiming, Inverter, OpenLeg};
use standstill_plant::{Motor, built_in};
use standstill_sim::{
    Adc, Broken, Case, Ended, Event, Fault, Faults, Health, Misreading, NoProbe, Purpose, RotorState, Run,
    SensorSettings, Sensors, Streams, Trace, run,
};

const USUAL: Devices = Devices {
    kind: DeviceKind::Igbt,
    switch_drop: 0.9,
    switch_resistance: 50e-3,
    diode_drop: 1.0,
    diode_resistance: 30e-3,
};

const US: u64 = 1000;

fn motor() -> Motor {
    built_in("paper-5k5").expect("built in")
}

/// Ideal switches, or usual ones with dead time, diodes and a capacitance of each terminal.
fn case<'a>(motor: &'a Motor, usual: bool, faults: &[Fault]) -> Case<'a> {
    let mut bridge = Bridge { open_leg: OpenLeg::Diodes, ..Bridge::default() };
    let mut timing = GateTiming::default();
    if usual {
        bridge =
            Bridge { devices: USUAL, terminal_capacitance: 0.5e-9, terminal_resistance: 300.0, ..bridge };
        timing = GateTiming { dead_time: Nanos::from_micros(2), ..timing };
    }
    let (gates, carrier_period) = ([timing; 3], Nanos::from_micros(100));
    let inverter = Inverter { bridge, gates, link: DcLink::stiff(LINK), carrier_period };
    let mut all = Faults::default();
    assert!(faults.iter().all(|fault| all.push(*fault)));
    Case { start_angle: 0.7, faults: all, ..Case::new(motor, inverter) }
}

fn pulse(legs: [Leg<f64>; 3], micros: u64) -> Command<f64> {
    Command::hold(stage(legs, micros), Sampling::once(Nanos::from_micros(micros)))
}

fn play(case: &Case<'_>, commands: &[Command<f64>]) -> (Vec<Reading<f64>>, Run<f64>) {
    let mut script = Script::new(commands);
    let run = run(case, &mut script, true, &mut NoProbe);
    assert!(matches!(run.ended, Ended::Outcome(_)), "{:?}", run.ended);
    let ledger = run.ledger.expect("asked for");
    assert!(ledger.imbalance().abs() < 1e-6 * ledger.source.abs().max(1e-3), "{ledger:?}");
    (script.readings, run)
}

/// Current in A of a line with a voltage in V, an inductance in H and a resistance in Ω after a time in s.
fn line(voltage: f64, inductance: f64, resistance: f64, time: f64) -> f64 {
    voltage / resistance * -(-resistance * time / inductance).exp_m1()
}

/// Inductances in H between two terminals at an angle in rad, the third open: ab, bc, ca.
fn lines(motor: &Motor, angle: f64) -> [f64; 3] {
    motor.winding.line_inductances(angle).0
}

fn near(found: f64, expected: f64, what: &str) {
    assert!((found - expected).abs() < 1e-6 * expected.abs().max(1e-3), "{what}: {found}, not {expected}");
}

#[test]
fn analytic_an_open_wire_leaves_one_line() {
    let motor = motor().linearised();
    let open = [Fault::lasting(Broken::Wire(0))];
    let (read, run) = play(
        &case(&motor, false, &open),
        &[pulse([High, Low, Off], 100), pulse([High, High, Low], 100), pulse([Off; 3], 2000)],
    );
    assert!(
        read[0].current.0.iter().all(|i| i.abs() < 1e-9),
        "one wire alone carries nothing: {:?}",
        read[0].current
    );
    let [_, bc, _] = lines(&motor, 0.7);
    let expected = line(LINK, bc, 2.0 * motor.resistance, 1e-4);
    near(read[1].current.0[1], expected, "b to c");
    near(read[1].current.0[2], -expected, "b to c");
    assert_eq!(read[1].current.0[0], 0.0);
    near(run.peak_current, expected, "peak");
    // Usual switches and terminals that ring with the winding: the same line, smaller by what they drop.
    let (read, _) = play(&case(&motor, true, &open), &[pulse([High, High, Low], 100), pulse([Off; 3], 2000)]);
    assert_eq!(read[0].current.0[0], 0.0, "behind the open wire nothing is read");
    let dropped = read[0].current.0[1] / expected;
    assert!((0.95..1.0).contains(&dropped), "{dropped}");
}

#[test]
fn analytic_a_contact_adds_its_resistance_to_two_lines() {
    let motor = motor().linearised();
    let weak = [Fault::lasting(Broken::Contact(1, 3.0))];
    let ([ab, bc, ca], r) = (lines(&motor, 0.7), motor.resistance);
    let commands = [[High, Low, Off], [Off, High, Low], [Low, Off, High]]
        .map(|legs| [pulse(legs, 300), pulse([Off; 3], 5000)])
        .concat();
    let (read, run) = play(&case(&motor, false, &weak), &commands);
    for (k, (leg, inductance, resistance)) in
        [(0, ab, 2.0 * r + 3.0), (1, bc, 2.0 * r + 3.0), (2, ca, 2.0 * r)].into_iter().enumerate()
    {
        near(read[2 * k].current.0[leg], line(LINK, inductance, resistance, 3e-4), "line");
    }
    // Its heat is in the balance: with a contact of nothing, less is lost.
    let whole = play(&case(&motor, false, &[]), &commands).1.ledger.expect("asked for").copper_loss;
    assert!(run.ledger.expect("asked for").copper_loss > 1.2 * whole);
    play(&case(&motor, true, &weak), &commands);
}

/// With two wires exchanged the drive has the motor's mirror image; with all three moved on, the motor turned.
#[test]
fn analytic_exchanged_wires_mirror_or_turn_the_motor() {
    let motor = motor();
    let commands = [[High, Low, Off], [Low, High, Low], [Off, Low, High], [Low, Low, High]]
        .map(|legs| [pulse(legs, 150), pulse([Off; 3], 4000)])
        .concat();
    let third = std::f64::consts::TAU / 3.0;
    for usual in [false, true] {
        for (wires, equal) in [([0, 2, 1], -0.7), ([1, 2, 0], 0.7 - third), ([2, 0, 1], 0.7 + third)] {
            let exchanged = case(&motor, usual, &[Fault::lasting(Broken::Wires(wires))]);
            let expected = Case { start_angle: equal, ..case(&motor, usual, &[]) };
            let (read, expected) = (play(&exchanged, &commands).0, play(&expected, &commands).0);
            for (read, expected) in read.iter().zip(&expected) {
                for (read, expected) in read.current.0.into_iter().zip(expected.current.0) {
                    assert!((read - expected).abs() < 2e-5, "{wires:?} {usual}: {read}, not {expected}");
                }
            }
        }
    }
}

#[test]
fn law_an_open_switch_ends_pulses_of_one_sign() {
    let motor = motor();
    let commands = [pulse([High, Low, Off], 100), pulse([Off; 3], 4000), pulse([Low, High, Off], 100)];
    for usual in [false, true] {
        let whole = play(&case(&motor, usual, &[]), &commands).0;
        let open = Fault::lasting(Broken::Switch(0, Gate::High));
        let read = play(&case(&motor, usual, &[open]), &commands).0;
        // Terminals of 0.5 nF ring with some 10 mH: at most 550 V √(C/L).
        let rings = if usual { 0.15 } else { 1e-9 };
        assert!(read[0].current.0[0].abs() < rings, "{:?}", read[0].current);
        // What rings after the first pulse is left of it.
        let (read, whole) = (read[2].current.0[0], whole[2].current.0[0]);
        assert!(
            (read - whole).abs() < if usual { 0.01 } else { 1e-6 },
            "the other switch: {read}, not {whole}"
        );
        // A leg of which both are open carries nothing, whatever is ordered.
        let off = Fault::lasting(Broken::Switch(0, Gate::Off));
        let read = play(&case(&motor, usual, &[off]), &commands).0;
        assert!(read.iter().all(|read| read.current.0[0].abs() < rings));
    }
    // With pulse-width modulation its lower switch and its diodes go on: the leg never reaches the upper rail by itself.
    let modulated =
        Command::hold(stage([Duty(0.6), Duty(0.4), Duty(0.4)], 400), Sampling::once(Nanos::from_micros(400)));
    let open = Fault::lasting(Broken::Switch(0, Gate::High));
    let current = |faults: &[Fault]| play(&case(&motor, true, faults), &[modulated]).0[0].current.0[0];
    assert!(current(&[]) > 1.0 && current(&[open]) < 0.15, "{} {}", current(&[]), current(&[open]));
}

/// A wire that opens 30 µs after the begin of the third command, and closes 50 µs later.
#[test]
fn analytic_a_fault_that_waits_for_a_command_counts_from_its_begin() {
    let motor = motor().linearised();
    let [ab, ..] = lines(&motor, 0.7);
    let r = 2.0 * motor.resistance;
    let fault = Fault {
        command: Some(3),
        from: Nanos(30 * US),
        until: Nanos(80 * US),
        ..Fault::lasting(Broken::Wire(0))
    };
    let sampled =
        |micros: u64, at: u64| Command::hold(stage([High, Low, Off], micros), Sampling::once(Nanos(at * US)));
    let rest = pulse([Off, Off, Off], 700);
    let commands = [sampled(100, 90), rest, sampled(100, 20), sampled(100, 80)];
    let (readings, run) = play(&case(&motor, false, &[fault]), &commands);
    let read: Vec<f64> = readings.iter().map(|read| read.current.0[0]).collect();
    // As long after the begin of the first command nothing has broken; in the fourth the wire has been closed for as long as that.
    for (found, time) in [(read[0], 90e-6), (read[2], 20e-6), (read[3], 100e-6)] {
        let expected = line(LINK, ab, r, time);
        assert!((found - expected).abs() < 1e-6 * expected.abs().max(1.0), "{found}, not {expected}");
    }
    assert!(read[1].abs() < 1e-9, "{}", read[1]);
    // As the same times since the start of the run, to the bit.
    let plain = Fault { command: None, from: Nanos(830 * US), until: Nanos(880 * US), ..fault };
    assert_eq!(play(&case(&motor, false, &[plain]), &commands), (readings, run));
}

/// A contact that opens for a while: its current ends at once, and rises again from zero.
#[test]
fn analytic_an_intermittent_contact_begins_anew() {
    let motor = motor().linearised();
    let [ab, ..] = lines(&motor, 0.7);
    let (from, until) = (Nanos(100 * US), Nanos(150 * US));
    let opens = |broken| [Fault { broken, command: None, from, until }];
    let r = 2.0 * motor.resistance;
    for usual in [false, true] {
        let case = case(&motor, usual, &opens(Broken::Wire(0)));
        let mut trace = Trace::new(2e-6);
        let sampling = Sampling { first: Nanos(99 * US), interval: Nanos(50 * US), count: 3 };
        let command = Command::hold(stage([High, Low, Off], 250), sampling);
        let mut script = Script::new([command]);
        run(&case, &mut script, false, &mut trace);
        let changes: Vec<(f64, Event)> =
            trace.events.iter().filter(|(_, event)| matches!(event, Event::Fault(..))).copied().collect();
        let [(opened, what), (closed, that)] = changes[..] else { panic!("{changes:?}") };
        assert!((opened - 100e-6).abs() + (closed - 150e-6).abs() < 1e-12, "{changes:?}");
        assert_eq!(what, Event::Fault(Broken::Wire(0), Health::Broken));
        assert_eq!(that, Event::Fault(Broken::Wire(0), Health::Whole));
        let read = script.readings.iter().map(|read| read.current.0[0]).collect::<Vec<_>>();
        let expected = [line(LINK, ab, r, 99e-6), 0.0, line(LINK, ab, r, 49e-6)];
        for (read, expected) in read.iter().zip(expected) {
            let off = if usual { 0.1 * expected } else { 1e-6 };
            assert!((read - expected).abs() <= off, "{usual}: {read}, not {expected}");
        }
    }
    // A core that saturates: the arc ends the current all the same, and its energy is in the balance.
    let motor = self::motor();
    play(
        &self::case(&motor, false, &opens(Broken::Wire(0))),
        &[pulse([High, Low, Low], 250), pulse([Off; 3], 4000)],
    );
    // A switch that opens leaves the current to the diode.
    let open = Broken::Switch(0, Gate::High);
    let (read, _) = play(
        &self::case(&motor, false, &opens(open)),
        &[Command::hold(
            stage([High, Low, Off], 250),
            Sampling { first: Nanos(100 * US), interval: Nanos(25 * US), count: 5 },
        )],
    );
    let at: Vec<f64> = read.iter().map(|read| read.current.0[0]).collect();
    assert!(at[0] > 1.0 && at[1] < at[0] && at[1] > 0.9 * at[0], "{at:?}");
    assert!(at[2] < at[1] && at[3] > at[2] && at[4] > at[3], "{at:?}");
}

#[test]
fn law_each_misreading_shows_in_its_channel() {
    let motor = motor();
    let read = |settings: SensorSettings, faults: &[Fault]| {
        let sensors = Sensors::nominal(settings);
        let case = Case { sensors, ..case(&motor, false, faults) };
        let sampling = Sampling { first: Nanos(40 * US), interval: Nanos(30 * US), count: 3 };
        let mut script = Script::new([Command::hold(stage([High, Low, Low], 100), sampling)]);
        run(&case, &mut script, false, &mut NoProbe);
        script.readings
    };
    let ideal = SensorSettings::IDEAL;
    let whole = read(ideal, &[]);
    let sensor = |k, how| [Fault::lasting(Broken::Sensor(k, how))];
    let phase =
        |readings: &[Reading<f64>], k: usize| readings.iter().map(|of| of.current.0[k]).collect::<Vec<_>>();
    let (a, b) = (phase(&whole, 0), phase(&whole, 1));
    assert_eq!(phase(&read(ideal, &sensor(0, Misreading::Dead)), 0), [0.0; 3]);
    assert_eq!(phase(&read(ideal, &sensor(0, Misreading::Stuck(2.5))), 0), [2.5; 3]);
    assert_eq!(phase(&read(ideal, &sensor(0, Misreading::Frozen)), 0), [a[0]; 3]);
    assert_eq!(phase(&read(ideal, &sensor(0, Misreading::Gain(-1.0))), 0), [-a[0], -a[1], -a[2]]);
    assert_eq!(
        phase(&read(ideal, &sensor(0, Misreading::Offset(0.5))), 0),
        [a[0] + 0.5, a[1] + 0.5, a[2] + 0.5]
    );
    assert_eq!(phase(&read(ideal, &sensor(0, Misreading::Gain(2.0))), 1), b, "the others are whole");
    let link = read(ideal, &sensor(3, Misreading::Gain(0.5)));
    assert_eq!(link[0].dc_link, LINK / 2.0);
    let exchanged = read(ideal, &[Fault::lasting(Broken::Exchanged(0, 1))]);
    assert_eq!([phase(&exchanged, 0), phase(&exchanged, 1)], [b, a.clone()]);
    let drifts = phase(&read(ideal, &[Fault::lasting(Broken::Drift(1000.0))]), 0);
    near(drifts[1], a[1] * (1.0 + 1000.0 * 70e-6), "drift");
    // From 60 µs on, and until 90 µs.
    let while_there = |how| [Fault { from: Nanos(60 * US), until: Nanos(90 * US), ..sensor(0, how)[0] }];
    let frozen = phase(&read(ideal, &while_there(Misreading::Frozen)), 0);
    assert_eq!(frozen[..2], [a[0]; 2]);
    near(frozen[2], a[2], "thawed");
    assert_eq!(phase(&read(ideal, &while_there(Misreading::Dead)), 0)[1], 0.0);
    // Codes: what is stuck beyond the range clips, and a bit moves the value by its weight.
    let adc = Adc { bits: 8, low: -32.0, high: 32.0 };
    let converted = SensorSettings { adc: Some(adc), ..ideal };
    let stuck = read(converted, &sensor(0, Misreading::Stuck(40.0)));
    assert!(stuck.iter().all(|of| of.sensed.0[0] == Sensed::Clipped && of.current.0[0] == 31.75));
    let codes = |faults: &[Fault]| {
        read(converted, faults).iter().map(|of| of.counts.current.0[0]).collect::<Vec<_>>()
    };
    let (clean, set, clear) = (
        codes(&[]),
        codes(&sensor(0, Misreading::Bit(4, true))),
        codes(&sensor(0, Misreading::Bit(4, false))),
    );
    assert!(clean.iter().zip(&set).all(|(clean, set)| *set == clean | 16));
    assert!(clean.iter().zip(&clear).all(|(clean, clear)| *clear == clean & !16));
    assert!(set != clear);
}

/// Faults of one machine change nothing in its neighbours, and the same bits come out in every width.
#[test]
fn law_lanes_have_the_bits_of_a_run_alone() {
    let motor = motor();
    let opens = |broken| Fault { from: Nanos(130 * US), until: Nanos(480 * US), ..Fault::lasting(broken) };
    let faults = [
        vec![],
        vec![opens(Broken::Wire(2))],
        vec![Fault::lasting(Broken::Contact(0, 2.0)), opens(Broken::Switch(1, Gate::Low))],
        vec![Fault::lasting(Broken::Wires([2, 1, 0]))],
        vec![opens(Broken::Sensor(1, Misreading::Frozen))],
    ];
    let commands = [
        pulse([High, Low, Off], 100),
        pulse([Duty(0.7), Duty(0.3), Duty(0.4)], 400),
        pulse([Off, Low, High], 80),
        pulse([Off; 3], 700),
    ];
    for usual in [false, true] {
        let cases: Vec<_> = faults
            .iter()
            .cycle()
            .take(11)
            .map(|faults| {
                let rotor = if usual { RotorState::Free } else { RotorState::Locked };
                (Case { rotor, ..case(&motor, usual, faults) }, Script::new(commands))
            })
            .collect();
        same_bits_in_lanes(&cases);
    }
}

/// Random faults and gates: a run ends in its outcome, and its energies balance.
#[test]
fn law_random_faults_leave_the_balance_whole() {
    let motor = motor();
    for number in 0..60 {
        let mut random = Streams::new(7, number).open(Purpose::Angle);
        let mut pick = |of: u64| usize::try_from(random.integer(of - 1)).expect("small");
        let broken = match pick(4) {
            0 => Broken::Wire(pick(3)),
            1 => Broken::Contact(pick(3), 0.1 + pick(50) as f64 * 0.2),
            2 => Broken::Switch(pick(3), [Gate::Off, Gate::Low, Gate::High][pick(3)]),
            _ => Broken::Wires([[0, 2, 1], [1, 2, 0], [2, 1, 0]][pick(3)]),
        };
        let whole_run = matches!(broken, Broken::Wires(_));
        let from = if whole_run { Nanos::ZERO } else { Nanos(pick(900_000) as u64) };
        let until = if whole_run { Nanos(u64::MAX) } else { from + Nanos(1 + pick(400_000) as u64) };
        let commands: Vec<_> = (0..8)
            .map(|_| pulse([(); 3].map(|()| [High, Low, Off, Duty(0.37)][pick(4)]), 40 + pick(160) as u64))
            .chain([pulse([Off; 3], 600)])
            .collect();
        let case = case(&motor, number % 2 == 0, &[Fault { broken, command: None, from, until }]);
        let mut script = Script::new(&commands);
        let run = run(&case, &mut script, true, &mut NoProbe);
        assert!(matches!(run.ended, Ended::Outcome(_)), "{number} {broken:?}: {:?}", run.ended);
        let ledger = run.ledger.expect("asked for");
        assert!(
            ledger.imbalance().abs() < 1e-6 * ledger.source.abs().max(1.0),
            "{number} {broken:?} {ledger:?}"
        );
    }
}
