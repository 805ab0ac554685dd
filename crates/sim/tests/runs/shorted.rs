//! Shorted turns: two coupled circuits in closed form, coils of the whole motor while it turns, the referee, the energy ledger, lanes.
#![allow(clippy::disallowed_methods, reason = "tests compare with the C library")]

use super::script::{LINK, Script, same_bits_in_lanes, stage};
use Leg::{High, Low, Off};
use standstill_interface::{Command, Leg, Nanos, Reading, Sampling};
use standstill_inverter::{Bridge, DcLink, GateTiming, Inverter, OpenLeg};
use standstill_plant::{EddyBranch, Motor, built_in};
use standstill_sim::{Broken, Case, Ended, Fault, Faults, NoProbe, RotorState, Run, Short, referee, run};

fn motor() -> Motor {
    built_in("paper-5k5").expect("built in")
}

/// Ideal switches; turns of a phase that are shorted.
fn case(motor: &Motor, phase: usize, short: Short, start_angle: f64) -> Case<'_> {
    let bridge = Bridge { open_leg: OpenLeg::Diodes, ..Bridge::default() };
    let gates = [GateTiming::default(); 3];
    let inverter =
        Inverter { bridge, gates, link: DcLink::stiff(LINK), carrier_period: Nanos::from_micros(100) };
    let mut faults = Faults::default();
    assert!(faults.push(Fault::lasting(Broken::Shorted(phase, short))));
    Case { start_angle, faults, ..Case::new(motor, inverter) }
}

fn hold(legs: [Leg<f64>; 3], micros: u64) -> Command<f64> {
    let step = Nanos::from_micros(10);
    #[expect(clippy::cast_possible_truncation, reason = "few")]
    let sampling = Sampling { first: step, interval: step, count: (micros / 10) as u32 };
    Command::hold(stage(legs, micros), sampling)
}

fn balanced(run: &Run<f64>) {
    assert!(matches!(run.ended, Ended::Outcome(_)), "{:?}", run.ended);
    let ledger = run.ledger.expect("asked for");
    let scale = ledger.source.abs().max(ledger.shaft_work.abs()).max(1e-3);
    assert!(ledger.imbalance().abs() < 1e-6 * scale, "{:e} of {scale}: {ledger:?}", ledger.imbalance());
}

fn play(case: &Case<'_>, commands: &[Command<f64>]) -> (Vec<Reading<f64>>, Run<f64>) {
    let mut script = Script::new(commands);
    let run = run(case, &mut script, true, &mut NoProbe);
    balanced(&run);
    (script.readings, run)
}

fn worst(ours: &[Reading<f64>], theirs: &[Reading<f64>]) -> f64 {
    assert_eq!(ours.len(), theirs.len());
    let phases = ours.iter().zip(theirs).flat_map(|(a, b)| a.current.0.into_iter().zip(b.current.0));
    phases.fold(0.0, |worst, (a, b)| worst.max((a - b).abs()))
}

/// All commands of a start: lines both ways, a vector, slow and fast decay.
fn start() -> Vec<Command<f64>> {
    [[High, Low, Off], [Low, High, Off], [Off, High, Low], [High, Low, Low], [Low, High, High]]
        .map(|legs| [hold(legs, 150), hold([Off; 3], 300), hold([Low; 3], 200)])
        .concat()
}

/// Along the axis of the phase both circuits are alone: with the d-axis there, `V = R (i + ⅔ k j) + dψ/dt`, ψ = L_d (i + ⅔ k j), and
/// `0 = k R (i + j) + R_f j + d(k ψ + L_l j)/dt`. Their solution is two exponentials.
#[test]
fn analytic_two_coupled_circuits_answer_a_step() {
    let motor = motor().linearised();
    let (winding, r) = (motor.winding, motor.resistance);
    for (k, fault, c) in [(0.1, 0.0, 0.9), (0.3, 0.4, 0.7), (1.0, 0.0, 0.95), (0.02, 0.01, 0.98)] {
        let short = Short { share: k, resistance: fault, coupling: c };
        let (read, _) = play(&case(&motor, 0, short, 0.0), &[hold([High, Low, Low], 400)]);
        let (phase, mean) = (winding.mean_inductance, 1.5 * winding.mean_inductance);
        assert_eq!(winding.leakage, 0.0);
        let (l, leak) = (winding.d_axis_inductance(), k * k * (phase / (c * c) - 2.0 / 3.0 * mean));
        // M x′ = v − N x of x = (i, j).
        let (m, n) = (2.0 / 3.0 * k, k * r);
        let inductance = [[l, l * m], [k * l, k * l * m + leak]];
        let resistance = [[r, r * m], [n, n + fault]];
        let v = 2.0 / 3.0 * LINK;
        let determinant = |a: [[f64; 2]; 2]| a[0][0] * a[1][1] - a[0][1] * a[1][0];
        let inverse = |a: [[f64; 2]; 2]| {
            let d = determinant(a);
            [[a[1][1] / d, -a[0][1] / d], [-a[1][0] / d, a[0][0] / d]]
        };
        let product = |a: [[f64; 2]; 2], b: [[f64; 2]; 2]| {
            [0, 1].map(|row: usize| {
                [0, 1].map(|column: usize| a[row][0] * b[0][column] + a[row][1] * b[1][column])
            })
        };
        let a = product(inverse(inductance), resistance);
        let end = inverse(resistance)[0][0] * v;
        let (trace, det) = (a[0][0] + a[1][1], determinant(a));
        let root = (trace * trace / 4.0 - det).sqrt();
        let rates = [trace / 2.0 + root, trace / 2.0 - root];
        // i = i∞ + p e^(−s t) + q e^(−u t): zero at first, with the slope of M⁻¹ v.
        let slope = inverse(inductance)[0][0] * v;
        let p = (end * rates[1] - slope) / (rates[0] - rates[1]);
        let q = -end - p;
        assert!(rates[1] > 0.0 && rates[0] > 2.0 * rates[1], "{rates:?}");
        for reading in &read {
            let t = reading.at.seconds();
            let expected = end + p * (-rates[0] * t).exp() + q * (-rates[1] * t).exp();
            let found = reading.current.0[0];
            assert!(
                (found - expected).abs() < 2e-6 * expected.abs().max(1.0),
                "{short:?} at {t}: {found}, not {expected}"
            );
        }
    }
}

/// A path of a large resistance carries what the turns induce, `k u/(R_f + k R)`, and the phase carries ⅔ k of it more.
#[test]
fn analytic_a_path_of_large_resistance_is_no_short() {
    let motor = motor().linearised();
    let vector = [hold([High, Low, Low], 150)];
    let short = |resistance| Short { share: 0.1, resistance, coupling: 0.9 };
    let healthy = Case { faults: Faults::default(), ..case(&motor, 0, short(1.0), 0.0) };
    let (whole, _) = play(&healthy, &vector);
    for resistance in [1e2, 1e3, 1e4] {
        let (read, _) = play(&case(&motor, 0, short(resistance), 0.0), &vector);
        for (read, whole) in read.iter().zip(&whole).skip(5) {
            let [more, ..]: [f64; 3] = std::array::from_fn(|k| read.current.0[k] - whole.current.0[k]);
            let induced = 2.0 / 3.0 * LINK - motor.resistance * whole.current.0[0];
            let expected = 2.0 / 3.0 * 0.1 * 0.1 * induced / (resistance + 0.1 * motor.resistance);
            assert!((more / expected - 1.0).abs() < 0.02, "{resistance} Ω: {more} A, not {expected}");
        }
    }
}

/// The motor's coils, one by one, while it turns: the healthy turns, the shorted ones, b and c, by the matrix of the phases, without any
/// plane, branch or lagging flux; steps of Runge and Kutta of order 4.
fn coils(motor: &Motor, short: Short, angle: f64, speed: f64, voltage: [f64; 3], time: f64) -> [f64; 3] {
    let (k, winding, r) = (short.share, motor.winding, motor.resistance);
    let phase = winding.mean_inductance + winding.leakage;
    let beyond = k * k * phase * (1.0 / (short.coupling * short.coupling) - 1.0);
    // Mesh currents: a back by c, b back by c, and that of the short. Rows of phases for each.
    let meshes = [[1.0, 0.0, -1.0], [0.0, 1.0, -1.0], [k, 0.0, 0.0]];
    let magnet = |angle: f64| {
        [0.0, 1.0, 2.0].map(|n: f64| motor.magnet_flux * (angle - n * std::f64::consts::TAU / 3.0).cos())
    };
    let through =
        |row: [f64; 3], phases: [f64; 3]| row[0] * phases[0] + row[1] * phases[1] + row[2] * phases[2];
    let inductance = |angle: f64| {
        let matrix = winding.inductance_matrix(angle);
        let mut of = [[0.0; 3]; 3];
        for m in 0..3 {
            for n in 0..3 {
                let phases: [f64; 3] =
                    std::array::from_fn(|p| (0..3).map(|q| matrix[(p, q)] * meshes[n][q]).sum());
                of[m][n] = through(meshes[m], phases);
            }
        }
        of[2][2] += beyond;
        of
    };
    let resistance = [[2.0 * r, r, k * r], [r, 2.0 * r, 0.0], [k * r, 0.0, k * r + short.resistance]];
    let driven = [voltage[0] - voltage[2], voltage[1] - voltage[2], 0.0];
    let currents = |flux: [f64; 3], angle: f64| {
        let of = inductance(angle);
        let magnet = magnet(angle);
        let y: [f64; 3] = std::array::from_fn(|m| flux[m] - through(meshes[m], magnet));
        let det = |of: [[f64; 3]; 3]| {
            of[0][0] * (of[1][1] * of[2][2] - of[1][2] * of[2][1])
                - of[0][1] * (of[1][0] * of[2][2] - of[1][2] * of[2][0])
                + of[0][2] * (of[1][0] * of[2][1] - of[1][1] * of[2][0])
        };
        let all = det(of);
        [0, 1, 2].map(|n: usize| {
            let mut with = of;
            (0..3).for_each(|m| with[m][n] = y[m]);
            det(with) / all
        })
    };
    let slope = |flux: [f64; 3], t: f64| -> [f64; 3] {
        let i = currents(flux, angle + speed * t);
        std::array::from_fn(|m| driven[m] - through(resistance[m], i))
    };
    let mut flux: [f64; 3] = std::array::from_fn(|m| through(meshes[m], magnet(angle)));
    let steps = 20_000;
    let h = time / f64::from(steps);
    for step in 0..steps {
        let t = f64::from(step) * h;
        let at = |by: [f64; 3], share: f64| std::array::from_fn(|m| flux[m] + by[m] * share);
        let a = slope(flux, t);
        let b = slope(at(a, h / 2.0), t + h / 2.0);
        let c = slope(at(b, h / 2.0), t + h / 2.0);
        let d = slope(at(c, h), t + h);
        flux = std::array::from_fn(|m| flux[m] + h / 6.0 * (a[m] + 2.0 * b[m] + 2.0 * c[m] + d[m]));
    }
    let [a, b, _] = currents(flux, angle + speed * time);
    [a, b, -a - b]
}

#[test]
fn analytic_a_rotor_that_turns_drives_the_shorted_turns() {
    let mut motor = motor();
    motor.winding.leakage = 1e-3;
    let motor = motor.linearised();
    for (speed, voltage, legs) in [
        (0.0, [LINK, 0.0, 0.0], [High, Low, Low]),
        (80.0, [0.0, LINK, 0.0], [Low, High, Low]),
        (-250.0, [0.0, LINK, LINK], [Low, High, High]),
    ] {
        for (k, resistance, coupling) in [(0.1, 0.0, 0.9), (0.5, 0.3, 0.7)] {
            let short = Short { share: k, resistance, coupling };
            let of = Case { rotor: RotorState::Driven, start_speed: speed, ..case(&motor, 0, short, 0.7) };
            let (read, _) = play(&of, &[hold(legs, 500)]);
            let expected = coils(&motor, short, 0.7, speed, voltage, 5e-4);
            let last = read.last().expect("samples");
            for (found, expected) in last.current.0.into_iter().zip(expected) {
                assert!(
                    (found - expected).abs() < 5e-6 * expected.abs().max(1.0),
                    "{speed} {short:?}: {found}, not {expected}"
                );
            }
            // Without the short they are others.
            let (whole, _) = play(&Case { faults: Faults::default(), ..of }, &[hold(legs, 500)]);
            assert!((whole[49].current.0[0] - expected[0]).abs() > 1e-2, "{speed} {short:?}");
        }
    }
}

/// On saturated cores, with the rotor held, free and driven, the referee takes the same steps, and energies balance.
#[test]
fn cross_the_referee_has_the_short_too() {
    for (name, rotor, speed, link) in [
        ("paper-5k5", RotorState::Locked, 0.0, LINK),
        ("paper-5k5", RotorState::Free, 0.0, LINK),
        ("pm-reluctance", RotorState::Driven, 40.0, LINK),
        ("light-vehicle", RotorState::Free, -20.0, 48.0),
    ] {
        let motor = built_in(name).expect("built in");
        for (share, resistance, coupling) in [(0.1, 0.0, 0.9), (0.4, 0.2, 0.6), (0.2, 0.1, 0.95)] {
            let short = Short { share, resistance: resistance * motor.resistance, coupling };
            let mut of = Case { rotor, start_speed: speed, ..case(&motor, 1, short, 0.7) };
            of.inverter.link = DcLink::stiff(link);
            let (read, run) = play(&of, &start());
            let mut script = Script::new(start());
            let refereed = referee(&of, &mut script, true, &mut NoProbe);
            assert!(matches!(refereed.ended, Ended::Outcome(_)), "{:?}", refereed.ended);
            let off = worst(&read, &script.readings);
            assert!(off < 2e-6 * motor.rated_current.max(1.0), "{name} {short:?}: {off} A");
            assert!((run.end_angle - refereed.end_angle).abs() < 1e-7, "{name} {short:?}");
        }
    }
}

/// The flux may be off by a step's tolerance wherever a current ends; the core's current, which is then that of the shorted turns, does work on
/// it. So what misses in the balance falls with the tolerance, also where the short settles within microseconds.
#[test]
fn law_what_misses_in_the_balance_falls_with_the_tolerance() {
    let motor = motor();
    let short = Short { share: 0.05, resistance: 0.5 * motor.resistance, coupling: 0.95 };
    let missing = [1e-9, 1e-11].map(|flux| {
        let mut of = case(&motor, 1, short, 0.7);
        of.tolerance.flux = flux;
        let run = run(&of, &mut Script::new(start()), true, &mut NoProbe);
        run.ledger.expect("asked for").imbalance().abs()
    });
    assert!(missing[0] < 5e-6 && missing[1] < 0.15 * missing[0], "{missing:?}");
}

/// It begins without a current, so nothing jumps; afterwards the motor is one with a short.
#[test]
fn law_a_short_may_begin_during_the_detection() {
    let motor = motor();
    let short = Short { share: 0.2, resistance: 0.05, coupling: 0.9 };
    let mut later = case(&motor, 2, short, 0.7);
    let fault = Fault { from: Nanos::from_micros(705), ..Fault::lasting(Broken::Shorted(2, short)) };
    later.faults = Faults::default();
    assert!(later.faults.push(fault));
    let healthy = Case { faults: Faults::default(), ..later.clone() };
    let (read, _) = play(&later, &start());
    let (whole, _) = play(&healthy, &start());
    // 700 µs are over with the first reading of the second pulse's decay.
    let before = 15 + 30 + 20 + 5;
    assert!(worst(&read[..before], &whole[..before]) < 1e-6, "{}", worst(&read[..before], &whole[..before]));
    assert!(worst(&read, &whole) > 0.1);
}

#[test]
fn law_lanes_have_the_bits_of_a_machine_alone() {
    let motor = motor();
    let cases: Vec<_> = [0.7, 2.0, 4.0, 5.5, 0.1]
        .into_iter()
        .enumerate()
        .map(|(n, angle)| {
            let short = Short { share: 0.05 + 0.1 * n as f64, resistance: 0.02, coupling: 0.9 };
            (case(&motor, n % 3, short, angle), Script::new(start()))
        })
        .collect();
    same_bits_in_lanes(&cases);
}

/// All switches are off and the rotor turns, so nothing but the shorted turns carries a current: `d(ψ cos θ − (L + 1/g) i)/dt = R_b i`, with
/// the branch's current i, L of a round rotor and the numbers g and R_b of the head of `effect/shorted.rs`. Its sine makes a torque whose
/// work is heat in the turns. χ followed a flux that blocked legs do not have: a lag of microseconds was wrong by 4e-5 of itself.
#[test]
fn regress_shorted_turns_of_an_idle_rotor_follow_the_flux_that_blocked_legs_leave() {
    let mut motor = built_in("light-vehicle").expect("built in").linearised();
    motor.winding.saliency = 0.0;
    let motor = motor.linearised();
    let (winding, r, speed) = (motor.winding, motor.resistance, 220.0);
    let inductance = 1.5 * winding.mean_inductance + winding.leakage;
    for (share, resistance, coupling) in [(0.07, 0.5, 0.77), (0.3, 0.0, 0.9)] {
        let short = Short { share, resistance: resistance * r, coupling };
        let mut of = Case { rotor: RotorState::Driven, start_speed: speed, ..case(&motor, 0, short, 0.7) };
        of.inverter.link = DcLink::stiff(48.0);
        let work = |periods: u32| {
            let time = f64::from(periods) * std::f64::consts::TAU / speed;
            let command = Command::hold(stage([Off; 3], 1), Sampling::NONE);
            let stage = standstill_interface::Stage { duration: Nanos::from_seconds(time), ..command.stage };
            let run = run(&of, &mut Script::new([Command { stage, ..command }]), true, &mut NoProbe);
            assert!(matches!(run.ended, Ended::Outcome(_)), "{:?}", run.ended);
            let ledger = run.ledger.expect("asked for");
            let missing = ledger.imbalance();
            assert!(missing.abs() < 1e-7 * ledger.shaft_work.abs(), "{short:?}: {missing:e} J, {ledger:?}");
            ledger.copper_loss
        };
        // Between two times after which the beginning is over.
        let found = work(3) - work(2);
        let phase = winding.mean_inductance + winding.leakage;
        let leak = share * share * (phase / (coupling * coupling) - 2.0 / 3.0 * inductance);
        let (lag, met) =
            (1.5 * leak / (share * share), 1.5 * (share * r + short.resistance) / (share * share));
        let driven = speed * motor.magnet_flux;
        let square = driven * driven / (met * met + (speed * (inductance + lag)).powi(2));
        let expected = 1.5 * met * square / 2.0 * std::f64::consts::TAU / speed;
        assert!((found / expected - 1.0).abs() < 1e-6, "{short:?}: {found} J, not {expected} J");
    }
}

/// What lags the flux goes on while no current flows: after a pause of many of its time constants a second pulse is the first one again, and
/// after a short one it is not.
#[test]
fn law_a_pause_without_current_lets_what_lags_the_flux_fade() {
    let plain = motor().linearised();
    let eddy = EddyBranch { time_constant: 2e-3, d_depth: 0.25, q_depth: 0.15 };
    let magnetics = plain.magnetics.clone().with_eddy_currents(Some(eddy));
    let with_eddies = Motor { magnetics, ..plain.clone() };
    let short = Short { share: 0.3, resistance: 0.1, coupling: 0.9 };
    let healthy = Case { faults: Faults::default(), ..case(&with_eddies, 0, short, 0.3) };
    for case in [healthy, case(&plain, 0, short, 0.3)] {
        let pulses = |pause: u64| {
            let pulse = hold([High, Low, Low], 150);
            let (read, _) = play(&case, &[pulse, hold([Off; 3], pause), pulse]);
            let idle = &read[read.len() - 16];
            assert!(
                idle.current.0.into_iter().all(|i| i.abs() < 1e-9),
                "no current flows before the second pulse: {idle:?}"
            );
            worst(&read[..15], &read[read.len() - 15..]) / read[14].current.0[0].abs()
        };
        let [soon, late] = [400, 60_000].map(pulses);
        assert!(soon > 1e-4 && late < 1e-9, "{soon:e} {late:e}");
    }
}
