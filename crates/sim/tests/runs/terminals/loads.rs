//! Terminals whose dividers discharge them: closed forms, the energy ledger, and the referee.

use standstill_sim::{Ledger, Snapshot, TerminalSensor};

use super::*;

/// The case with a divider of this resistance in Ω at each terminal.
fn loaded(mut case: Case<'_>, resistance: f64) -> Case<'_> {
    let terminal = TerminalSensor { resistance: Some(resistance), ..TerminalSensor::IDEAL };
    case.sensors = Sensors::nominal(SensorSettings { terminal: Some(terminal), ..SensorSettings::IDEAL });
    case
}

/// Currents in A and potentials in V as vectors.
fn vectors(of: &Snapshot) -> [[f64; 2]; 2] {
    [of.current, of.potential].map(|[a, b, c]| [(2.0 * a - b - c) / 3.0, (b - c) / f64::sqrt(3.0)])
}

/// Energy in J that the dividers of a trace have lost, by the trapezoidal rule.
fn lost_in_dividers(of: &[Snapshot], resistance: f64) -> f64 {
    let power = |of: &Snapshot| of.potential.iter().map(|v| v * v / resistance).sum::<f64>();
    of.windows(2).map(|of| (power(&of[0]) + power(&of[1])) / 2.0 * (of[1].time - of[0].time)).sum()
}

fn balances(ledger: &Ledger, scale: f64) {
    assert!((ledger.imbalance() / scale).abs() < 5e-5, "{ledger:?}");
}

/// One terminal rings about U ω²/(ω² + 2δγ), between the rail of the two others and the negative one: `v″ + (2δ + γ) v′ + (ω² + 2δγ) v =
/// ω² U` with 2δ = R/(1.5 L) and γ = 1/(R_d C).
#[test]
fn analytic_a_divider_damps_and_lowers_a_terminal_that_rings() {
    for (inductance, capacitance, quality, load, micros) in [
        (13e-3, 0.3e-9, 5.0, 1e6, 600_u32),
        (13e-3, 0.3e-9, 1e9, 100e3, 600),
        (13e-3, 10e-9, 2.0, 5e3, 1500),
        (27e-6, 1e-9, 50.0, 20e3, 200),
    ] {
        let motor = linear(inductance, 1e-6);
        let loops = 1.5 * inductance;
        let resistance = f64::sqrt(loops / capacitance) / quality;
        let mut inverter = inverter(Devices::default(), OpenLeg::Open, capacitance, LINK);
        inverter.bridge.terminal_resistance = resistance;
        let case = loaded(case(&motor, inverter), load);
        let (free, falls, leaks) =
            (1.0 / (loops * capacitance), (resistance + 1.5e-6) / loops, 1.0 / (load * capacitance));
        let (square, decay) = (free + falls * leaks, (falls + leaks) / 2.0);
        let angular = (square - decay * decay).sqrt();
        let middle = LINK * free / square;
        let mut trace = Trace::new(f64::from(micros) * 1e-6 / 4000.0);
        let mut script = Script::new([hold([High, High, Off], u64::from(micros))]);
        let run = run::<f64, _>(&case, &mut script, true, &mut trace);
        assert!(trace.snapshots.len() > 2000, "{}", trace.snapshots.len());
        let current_scale = LINK * (capacitance / loops).sqrt();
        for snapshot in &trace.snapshots[1..] {
            let (sin, cos) = (angular * snapshot.time).sin_cos();
            let swing = (-decay * snapshot.time).exp();
            let potential = middle * (1.0 - swing * (cos + decay / angular * sin));
            let rise = middle * swing * square / angular * sin;
            let current = -capacitance * (rise + leaks * potential);
            let [_, _, v] = snapshot.potential;
            assert!((v - potential).abs() < 2e-6 * LINK, "{load} {} s: {v} {potential}", snapshot.time);
            let off = (snapshot.current[2] - current).abs();
            assert!(
                off < 2e-6 * current_scale,
                "{load} {} s: {} {current}",
                snapshot.time,
                snapshot.current[2]
            );
        }
        let ledger = run.ledger.expect("asked for");
        let lost = lost_in_dividers(&trace.snapshots[1..], load);
        assert!((ledger.divider_loss / lost - 1.0).abs() < 1e-3, "{ledger:?} {lost}");
        balances(&ledger, ledger.divider_loss + ledger.copper_loss);
    }
}

/// Two or three terminals: differences ring, damped by both; the sum of three, about which no current says anything, decays by e^(−γ t).
#[test]
fn analytic_terminals_that_ring_together_are_discharged_together() {
    let (inductance, capacitance, load) = (13e-3, 1e-9, 60e3);
    let motor = linear(inductance, 1e-6);
    let resistance = f64::sqrt(1.5 * inductance / capacitance) / 5.0;
    let leaks = 1.0 / (load * capacitance);
    for (legs, along) in [([Off; 3], 1.0), ([Low, Off, Off], 3.0)] {
        let mut inverter = inverter(Devices::default(), OpenLeg::Open, capacitance, LINK);
        inverter.bridge.terminal_resistance = resistance;
        let case = loaded(case(&motor, inverter), load);
        let mut trace = Trace::new(3e-7);
        let mut script = Script::new([hold([Low, High, Off], 1), hold(legs, 400)]);
        let run = run::<f64, _>(&case, &mut script, true, &mut trace);
        let after: Vec<_> = trace.snapshots.iter().filter(|snapshot| snapshot.time >= 1e-6).collect();
        let [first, ..] = after[..] else { panic!("no trace") };
        let start = vectors(first);
        let sum = |of: &Snapshot| of.potential.iter().sum::<f64>();
        assert!(after.len() > 1200 && start[1][1] > 100.0 && sum(first) > 400.0, "{first:?}");
        for snapshot in &after {
            let time = snapshot.time - first.time;
            if legs == [Off; 3] {
                let should = sum(first) * (-leaks * time).exp();
                assert!((sum(snapshot) - should).abs() < 1e-9 * LINK, "{time} s: {snapshot:?} {should}");
            }
            for (axis, share) in [along, 1.0].into_iter().enumerate() {
                let falls = (resistance / share + 1e-6) / inductance;
                let [i, v] = [start[0][axis], start[1][axis]];
                let mean = -(falls + leaks) / 2.0;
                let apart = (leaks - falls) / 2.0;
                let angular = (1.0 / (inductance * capacitance * share) - apart * apart).sqrt();
                let (sin, cos) = (angular * time).sin_cos();
                let swing = (mean * time).exp();
                let rise = v / inductance - falls * i - mean * i;
                let fall = -i / (capacitance * share) - leaks * v - mean * v;
                let current = swing * (i * cos + rise / angular * sin);
                let potential = swing * (v * cos + fall / angular * sin);
                let [[i, v], size] =
                    [vectors(snapshot).map(|of| of[axis]), [LINK * (capacitance / inductance).sqrt(), LINK]];
                assert!((v - potential).abs() < 2e-6 * size[1], "{legs:?} {axis} {time} s: {v} {potential}");
                assert!((i - current).abs() < 2e-6 * size[0], "{legs:?} {axis} {time} s: {i} {current}");
            }
        }
        let ledger = run.ledger.expect("asked for");
        balances(&ledger, ledger.divider_loss + ledger.copper_loss);
    }
}

/// Idle terminals are at the negative rail. Held at the positive one, each divider loses U²/R; left alone, what the terminal stores.
#[test]
fn law_dividers_lose_what_rails_and_terminals_give() {
    let (capacitance, load) = (1e-9, 1e6);
    let motor = linear(13e-3, 1.0);
    let mut inverter = inverter(Devices::default(), OpenLeg::Diodes, capacitance, LINK);
    inverter.bridge.terminal_resistance = 900.0;
    let case = loaded(case(&motor, inverter), load);
    let once = |legs| sampled(hold(legs, 500), 5);
    let (idle, read) = play(&case, &[once([Off; 3])]);
    let idle = idle.ledger.expect("asked for");
    assert!(read.iter().all(|read| read.terminal.0.iter().all(|v| v.abs() < 1e-9)), "{read:?}");
    assert!(
        [idle.source, idle.divider_loss, idle.terminal_change].iter().all(|of| of.abs() < 1e-18),
        "{idle:?}"
    );
    let (held, read) = play(&case, &[once([High; 3])]);
    assert!(read.iter().all(|read| read.terminal.0 == [LINK; 3]), "{read:?}");
    let (held, close) = (held.ledger.expect("asked for"), |a: f64, b: f64| (a / b - 1.0).abs() < 1e-9);
    assert!(close(held.divider_loss, 3.0 * LINK * LINK / load * 500e-6), "{held:?}");
    assert!(close(held.source, held.divider_loss + 3.0 * capacitance * LINK * LINK), "{held:?}");
    // What each stored falls by e^(−t/R C), and twelve time constants later nothing is left.
    let (left, read) = play(&case, &[once([High; 3]), once([Off; 3]), hold([Off; 3], 12_000)]);
    for reading in &read[read.len() / 2..] {
        let should = LINK * (-reading.at.seconds() / (load * capacitance)).exp();
        assert!(reading.terminal.0.iter().all(|v| close(*v, should)), "{reading:?} {should}");
    }
    let left = left.ledger.expect("asked for");
    assert!(left.terminal_change.abs() < 1e-9 * held.terminal_change, "{left:?}");
    assert!(close(left.divider_loss - held.divider_loss, held.terminal_change), "{left:?} {held:?}");
    balances(&left, left.divider_loss);
}

#[test]
fn cross_the_referee_has_the_same_currents_and_potentials() {
    for (name, devices, micros) in
        [("paper-5k5", USUAL, 80), ("slot-harmonics", USUAL, 80), ("light-vehicle", MOSFETS, 10)]
    {
        let motor = built_in(name).expect("built in");
        let link = motor.dc_link.unwrap_or(LINK);
        let mut case = case(&motor, inverter(devices, OpenLeg::Diodes, 0.3e-9, link));
        case.inverter.link.ripple = 0.002;
        let impedance = (1.5 * motor.winding.q_axis_inductance() / 0.3e-9).sqrt();
        case.inverter.bridge.terminal_resistance = impedance / 5.0;
        let case = loaded(case, 20.0 * impedance);
        for (sequence, commands) in sequences(micros) {
            let (ours, readings) = play(&case, &commands);
            let mut strict = case.clone();
            strict.tolerance = Tolerance { flux: 1e-4 * case.tolerance.flux };
            let mut script = Script::new(&commands);
            let theirs: Run<f64> = referee(&strict, &mut script, false, &mut NoProbe);
            assert!(
                [&ours, &theirs].iter().all(|run| !matches!(run.ended, Ended::Error(_))),
                "{ours:?} {theirs:?}"
            );
            let (mut amps, mut volts) = (0.0_f64, 0.0_f64);
            for (a, b) in readings.iter().zip(&script.readings) {
                for k in 0..3 {
                    amps = amps.max((a.current.0[k] - b.current.0[k]).abs() / motor.rated_current);
                    volts = volts.max((a.terminal.0[k] - b.terminal.0[k]).abs() / link);
                }
            }
            let ledger = ours.ledger.expect("asked for");
            let scale = ledger.copper_loss + ledger.device_loss;
            let left = (ledger.imbalance() / scale).abs();
            println!(
                "{name} {sequence}: {amps:.1e} of rated, {volts:.1e} of the link, {left:.1e}, {:?}",
                ours.work
            );
            assert!(readings.len() >= 20 && ours.work.events > 2 && ledger.divider_loss > 0.0);
            assert!(amps < 1e-6 && volts < 1e-4 && left < 2e-5, "{name} {sequence}: {ledger:?}");
        }
    }
}
