//! The stator's iron remembers: closed forms, the energy ledger, the referee. Against SciPy: `tests/suite/hysteresis.rs`.
#![allow(clippy::disallowed_methods, reason = "tests compare with the C library")]

mod bench;
mod beside;

use standstill_interface::{Command, Nanos, Reading, Sampling};
use standstill_inverter::{Devices, OpenLeg};
use standstill_plant::{EddyBranch, Hysteresis, Motor, built_in};
use standstill_sim::{Broken, Case, Ended, Fault, NoProbe, RotorState, Run, Tolerance, referee};

use crate::script::*;
use bench::*;
use standstill_interface::Leg::{High, Low, Off};

/// Returns the largest difference of two runs' currents in A.
fn apart(ours: &[Reading<f64>], theirs: &[Reading<f64>]) -> f64 {
    let pairs = ours.iter().zip(theirs);
    pairs.flat_map(|(a, b)| (0..3).map(|k| (a.current.0[k] - b.current.0[k]).abs())).fold(0.0, f64::max)
}

#[test]
fn cross_the_referee_has_the_same_currents_and_no_energy_is_lost() {
    let mut motors: Vec<Motor> = vec![
        of("paper-5k5", 0.01, 3),
        of("paper-5k5", 0.002, 1),
        of("pm-reluctance", 0.01, 2),
        of("gearless-hoist", 0.005, 3),
        of("slot-harmonics", 0.01, 3),
    ];
    let eddy = EddyBranch { time_constant: 60e-6, d_depth: 0.25, q_depth: 0.15 };
    let paper = motors[0].clone();
    motors.push(Motor { magnetics: paper.magnetics.clone().with_eddy_currents(Some(eddy)), ..paper });
    let free = motors.len();
    for (number, motor) in motors.iter().enumerate() {
        for rotor in [RotorState::Locked, RotorState::Free].into_iter().take(1 + usize::from(number < free)) {
            for memory in [None, Some(1.0)] {
                let mut case = case(motor, inverter(USUAL, OpenLeg::Diodes));
                (case.rotor, case.memory) = (rotor, memory);
                let mut lost = 0.0;
                for (name, commands) in sequences(80) {
                    let (ours, readings) = play(&case, &commands);
                    let mut strict = case.clone();
                    strict.tolerance = Tolerance { flux: 1e-3 * case.tolerance.flux };
                    let mut script = Script::new(&commands);
                    let theirs: Run<f64> = referee(&strict, &mut script, true, &mut NoProbe);
                    let worst = apart(&readings, &script.readings) / motor.rated_current;
                    let which = format!("{} {number} {rotor:?} {memory:?} {name}", motor.name);
                    println!("{which}: {worst:.1e} of rated, {:?} {:?}", ours.work, theirs.work);
                    assert!(!matches!(theirs.ended, Ended::Error(_)), "{which}: {:?}", theirs.ended);
                    assert_eq!(readings.len(), script.readings.len());
                    assert!(worst < 5e-7, "{which}: {worst:e} of rated");
                    for ledger in [ours.ledger, theirs.ledger].map(|ledger| ledger.expect("asked for")) {
                        let scale = ledger.copper_loss + ledger.device_loss + ledger.shaft_work.abs();
                        let left = (ledger.imbalance() / scale).abs();
                        assert!(left < 1e-5, "{which}: {left:e} {ledger:?}");
                        assert!(ledger.hysteresis_loss >= 0.0, "{which}: {ledger:?}");
                        lost += ledger.hysteresis_loss;
                    }
                    assert!(lost > 0.0, "{} {number}: nothing slides", motor.name);
                }
            }
        }
    }
}

/// A pulse on all legs along the axis of phase a, forwards or backwards, ideal switches: the flux moves by 2/3 U a second.
fn along_a(forward: bool, micros: u64, count: u32) -> Command<f64> {
    let legs = if forward { [High, Low, Low] } else { [Low, High, High] };
    sampled(Command::hold(stage(legs, micros), Sampling::NONE), count)
}

const RISE: f64 = 2.0 / 3.0 * LINK;

fn phase_a(readings: &[Reading<f64>]) -> Vec<f64> {
    readings.iter().map(|reading| reading.current.0[0]).collect()
}

/// One cell, 10 mH: i = s/L + K e. It is stuck up to r, slides, and turns back to −r. A loop from −S to S costs 3/2 · 4 κ (S − r).
#[test]
fn analytic_one_cell_over_a_loop() {
    let motor = linear(Hysteresis { coercive_current: 0.08, depth: 0.05, cells: 1 });
    let cell = motor.magnetics.cells().expect("cells")[0];
    let (k, r) = (cell.stiffness, cell.reach);
    assert!((k * r - 0.08).abs() < 1e-15 && (k - 0.05 / 0.95 / 10e-3).abs() < 1e-12);
    let case = case(&motor, inverter(Devices::default(), OpenLeg::Open));
    let commands = [along_a(true, 80, 16), along_a(false, 160, 32), along_a(true, 160, 32)];
    let (run, readings) = play(&case, &commands);
    let (mut e, mut s, mut worst): (f64, f64, f64) = (0.0, 0.0, 0.0);
    for (n, i) in phase_a(&readings).into_iter().enumerate() {
        let step = if (16..48).contains(&n) { -RISE * 5e-6 } else { RISE * 5e-6 };
        s += step;
        e = (e + step).clamp(-r, r);
        worst = worst.max((i - (s / 10e-3 + k * e)).abs());
    }
    assert!(worst < 1e-6, "{worst} A");
    let loss = 1.5 * k * r * 5.0 * (RISE * 80e-6 - r);
    let got = run.ledger.expect("asked for").hysteresis_loss;
    assert!((got / loss - 1.0).abs() < 1e-6, "{got} J, {loss} J");
    // Each turn of the loop ends at its tip.
    let all = phase_a(&readings);
    assert!((all[15] - all[79]).abs() < 1e-6);
}

/// Opposite pulses do not cancel: what is left of the flux's change is none, of the force the coercive current.
#[test]
fn analytic_opposite_pulses_leave_the_coercive_current() {
    let hysteresis = Hysteresis { coercive_current: 0.04, depth: 0.05, cells: 3 };
    let motor = linear(hysteresis);
    let case = case(&motor, inverter(Devices::default(), OpenLeg::Open));
    let (_, readings) = play(&case, &[along_a(true, 80, 1), along_a(false, 80, 1)]);
    let left = phase_a(&readings)[1];
    assert!((left + hysteresis.coercive_current).abs() < 1e-6, "{left}");
    let plain = linear(Hysteresis { coercive_current: 0.0, ..hysteresis });
    let case = Case { motor: &plain, ..case };
    let (_, readings) = play(&case, &[along_a(true, 80, 1), along_a(false, 80, 1)]);
    assert!(phase_a(&readings)[1].abs() < 1e-6);
}

/// At its corners the virgin curve is Rayleigh's: K s − K s²/(4 r̄).
#[test]
fn analytic_the_virgin_curve_is_rayleighs() {
    let s = RISE * 80e-6;
    let stiffness = 0.05 / 0.95 / 10e-3;
    let motor = linear(Hysteresis { coercive_current: stiffness * s / 2.0, depth: 0.05, cells: 2 });
    let case = case(&motor, inverter(Devices::default(), OpenLeg::Open));
    let (_, readings) = play(&case, &[along_a(true, 80, 2)]);
    for (n, i) in phase_a(&readings).into_iter().enumerate() {
        let s = s * (n + 1) as f64 / 2.0;
        let rayleigh = stiffness * (s - s * s / (2.0 * RISE * 80e-6));
        assert!((i - s / 10e-3 - rayleigh).abs() < 1e-6, "{i} {rayleigh}");
    }
}

/// A pulse that is taken back and given again leaves no trace but its loss: the loop closes, and what follows does not know of it.
#[test]
fn law_minor_loops_close_and_are_forgotten() {
    let motor = linear(Hysteresis { coercive_current: 0.1, depth: 0.05, cells: 3 });
    let case = case(&motor, inverter(Devices::default(), OpenLeg::Open));
    let straight = play(&case, &[along_a(true, 80, 1), along_a(true, 60, 3)]);
    let looped = play(
        &case,
        &[along_a(true, 80, 1), along_a(false, 40, 1), along_a(true, 40, 1), along_a(true, 60, 3)],
    );
    let (one, two) = (phase_a(&straight.1), phase_a(&looped.1));
    for (a, b) in [(0, 0), (0, 2), (1, 3), (2, 4), (3, 5)] {
        assert!((one[a] - two[b]).abs() < 1e-6, "{one:?} {two:?}");
    }
    let [one, two] = [straight, looped].map(|(run, _)| run.ledger.expect("asked for").hysteresis_loss);
    assert!(two > 1.01 * one, "{one} {two}");
}

/// Without coercive current or without cells a run has the bits of one on the core alone; with next to none, next to its currents.
#[test]
fn law_without_thresholds_the_core_is_alone() {
    let plain = built_in("paper-5k5").expect("built in");
    for rotor in [RotorState::Locked, RotorState::Free] {
        for (name, commands) in sequences(80) {
            let go = |motor: &Motor| {
                let case = Case { rotor, ..case(motor, inverter(USUAL, OpenLeg::Diodes)) };
                let (run, readings) = play(&case, &commands);
                (
                    format!("{run:?}"),
                    readings.iter().flat_map(|reading| reading.current.0).collect::<Vec<_>>(),
                )
            };
            let alone = go(&plain);
            assert_eq!(alone, go(&of("paper-5k5", 0.0, 3)), "{name}");
            assert_eq!(alone, go(&of("paper-5k5", 0.01, 0)), "{name}");
            for (share, bound) in [(1e-6, 1e-4), (1e-2, 1.0)] {
                let off = go(&of("paper-5k5", share, 3)).1;
                let worst = off.iter().zip(&alone.1).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(worst < bound && (share < 1e-3 || worst > 1e-3), "{rotor:?} {name} {share}: {worst}");
            }
        }
    }
}

/// Over random orders of the legs energy goes where the ledger says, and the iron never gives any back.
#[test]
fn law_no_energy_is_created() {
    let mut state = 1_u64;
    let mut below = |most: u32| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        u32::try_from(state >> 33).expect("31 bits") % most
    };
    let motors = [of("paper-5k5", 0.02, 3), of("pm-reluctance", 0.1, 3), of("surface-magnet", 0.005, 2)];
    for number in 0..60 {
        let motor = &motors[number % 3];
        let mut case = case(motor, inverter(USUAL, OpenLeg::Diodes));
        case.start_angle = number as f64;
        case.tolerance = Tolerance { flux: 1e-11 };
        case.memory = (number % 2 == 0).then_some(0.3 * number as f64);
        case.rotor = if number % 4 < 2 { RotorState::Locked } else { RotorState::Free };
        let mut lost = 0.0;
        let mut commands = Vec::new();
        for _ in 0..4 {
            let legs = [(); 3].map(|()| [Off, Low, High][below(3) as usize]);
            commands.push(Command::hold(stage(legs, u64::from(1 + below(120))), Sampling::NONE));
            let ledger = ledger(&case, &commands);
            let scale = ledger.source.abs() + ledger.field_change.abs() + ledger.copper_loss + 1e-6;
            let left = ledger.imbalance() / scale;
            assert!(left.abs() < 1e-6, "{} {number}: {left:e} {ledger:?}", motor.name);
            assert!(ledger.hysteresis_loss >= lost - 1e-12, "{} {number}: {lost} {ledger:?}", motor.name);
            lost = ledger.hysteresis_loss;
        }
    }
}

#[test]
fn law_a_run_has_the_same_bits_in_lanes_of_each_width() {
    let motors = [of("paper-5k5", 0.01, 3), of("paper-5k5", 0.002, 1), of("surface-magnet", 0.03, 2)];
    let cases: Vec<_> = (0..20)
        .map(|k| {
            let mut case = case(&motors[k % 3], inverter(USUAL, OpenLeg::Diodes));
            case.start_angle = 0.3 * k as f64;
            case.memory = (k % 2 == 0).then_some(k as f64);
            if k % 5 == 1 {
                assert!(case.faults.push(breaks(30)));
            }
            let [(_, fast), (_, slow), _, (_, pwm)] = sequences(80);
            (case, Script::new([&fast, &slow, &pwm][k % 3]))
        })
        .collect();
    same_bits_in_lanes(&cases);
}

/// A torque of remanence turns a rotor without friction from where it is: towards where the iron was last magnetised.
#[test]
fn law_remanence_pulls_at_the_rotor() {
    let mut motor = of("paper-5k5", 0.01, 3);
    motor.rotor.friction = standstill_plant::Friction::default();
    let moved = |memory| {
        let mut case = case(&motor, inverter(USUAL, OpenLeg::Diodes));
        (case.rotor, case.memory) = (RotorState::Free, memory);
        let (run, readings) =
            play(&case, &[sampled(Command::hold(stage([Off; 3], 5000), Sampling::NONE), 10)]);
        assert!(phase_a(&readings).iter().all(|i| i.abs() < 1e-9));
        let ledger = run.ledger.expect("asked for");
        assert!(ledger.imbalance().abs() < 1e-6 * (ledger.kinetic_change.abs() + 1e-9), "{ledger:?}");
        run.end_angle - run.start_angle
    };
    assert_eq!(moved(None), 0.0);
    let quarter = std::f64::consts::FRAC_PI_2;
    let (ahead, behind) = (moved(Some(0.35 + quarter)), moved(Some(0.35 - quarter)));
    // What the flux was moved along last pulls back: the pinned flux is behind it.
    assert!(ahead < -1e-4 && (ahead + behind).abs() < 1e-3 * behind, "{ahead} {behind}");
}

/// A wire of phase a that breaks after a time in µs.
fn breaks(micros: u64) -> Fault {
    Fault { from: Nanos::from_micros(micros), ..Fault::lasting(Broken::Wire(0)) }
}

/// A wire breaks that carries a current: the flux falls at once, and play, which knows no time, follows it as any other way. With one
/// cell on one line all is known: up to ψ₀ the cell slid from r on, on the way back to no current it is stuck for 2 r.
#[test]
fn analytic_a_wire_that_breaks_leaves_the_iron_with_its_remanence() {
    for (share, jumps_far) in [(0.02, true), (0.1, false)] {
        let hysteresis = Hysteresis { coercive_current: share * 8.0, depth: 0.2, cells: 1 };
        let motor = linear(hysteresis);
        let [cell, ..] = motor.magnetics.cells().copied().expect("cells");
        let (stiffness, reach) = (cell.stiffness, cell.reach);
        let mut case = case(&motor, inverter(Devices::default(), OpenLeg::Open));
        case.tolerance = Tolerance { flux: 1e-12 };
        assert!(case.faults.push(breaks(150)));
        let (run, _) = play(&case, &[Command::hold(stage([High, Low, Off], 151), Sampling::NONE)]);
        let ledger = run.ledger.expect("asked for");
        // i = ψ/L + κ, of which the line's current is √3/2.
        let (inductance, threshold) = (10e-3, stiffness * reach);
        let before = (run.peak_current / 0.75_f64.sqrt() - threshold) * inductance;
        // At no current: ψ = L κ where the cell slides back, and where it is stuck ψ/L + K (r − (ψ₀ − ψ)) = 0.
        let far = threshold * inductance;
        let slides_back = (before - far - 2.0 * reach).max(0.0);
        assert_eq!(slides_back > 0.0, jumps_far, "both kinds of ends: {before} {reach}");
        let stuck = stiffness * (before - reach) / (1.0 / inductance + stiffness);
        let after = if jumps_far { far } else { stuck };
        let away = (reach - (before - after)).max(-reach);
        let near = |found: f64, expected: f64, what: &str| {
            assert!((found / expected - 1.0).abs() < 1e-5, "{share} {what}: {found}, not {expected}");
        };
        near(ledger.hysteresis_loss, 1.5 * threshold * (before - reach + slides_back), "loss");
        let stored = |flux: f64, away: f64| 0.75 * (flux * flux / inductance + stiffness * away * away);
        near(ledger.field_change, stored(after, away), "field");
        let arc = stored(before, reach) - stored(after, away) - 1.5 * threshold * slides_back;
        near(ledger.device_loss, arc, "arc");
        assert!(ledger.imbalance().abs() < 1e-9 * ledger.source, "{ledger:?}");
    }
}

/// Where the core saturates and three cells turn, too: as the referee says, and without a joule too many.
#[test]
fn cross_breaking_wires_of_turning_iron_agree_with_the_referee() {
    for (name, share) in [("paper-5k5", 0.02), ("slot-harmonics", 0.002), ("pm-reluctance", 0.05)] {
        let motor = of(name, share, 3);
        for (rotor, speed) in [(RotorState::Locked, 0.0), (RotorState::Driven, -300.0)] {
            let mut case = case(&motor, inverter(USUAL, OpenLeg::Diodes));
            (case.rotor, case.start_speed, case.memory) = (rotor, speed, Some(1.0));
            assert!(case.faults.push(Fault { until: Nanos::from_micros(70), ..breaks(50) }));
            let commands = [pulse([High, Low, Low], [Off; 3], 100), pulse([Low, High, Off], [Off; 3], 60)];
            let (ours, readings) = play(&case, &commands);
            let ledger = ours.ledger.expect("asked for");
            let scale = ledger.source.abs().max(ledger.shaft_work.abs());
            assert!(ledger.imbalance().abs() < 1e-6 * scale, "{name} {rotor:?}: {ledger:?}");
            let mut strict = case.clone();
            strict.tolerance = Tolerance { flux: 1e-3 * case.tolerance.flux };
            let mut script = Script::new(commands);
            let theirs: Run<f64> = referee(&strict, &mut script, true, &mut NoProbe);
            let apart = apart(&readings, &script.readings);
            assert!(apart < 1e-5 * motor.rated_current, "{name} {rotor:?}: {apart}");
            let lost = theirs.ledger.expect("asked for").hysteresis_loss;
            assert!(
                (ledger.hysteresis_loss / lost - 1.0).abs() < 1e-3,
                "{name} {rotor:?}: {ledger:?} {lost}"
            );
        }
    }
}
