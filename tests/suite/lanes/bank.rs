//! One step of a bank against the same of each machine alone.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use standstill_campaign::{DriveSettings, ErrorSet};
use standstill_inverter::Conduction::{Blocked, LowerDiode, LowerSwitch, UpperDiode, UpperSwitch};
use standstill_inverter::{DcLink, Gate, Modes, Sag, Storage};
use standstill_plant::Motor;
use standstill_sim::{Ask, Bank, CORE, Flow, LANES, Motion, PLANE, Stride};

use crate::bench::{all_kinds_of_motors, mapped, paper_motor};

/// Gates and modes as pulses, decays and vectors have them; none, one or all legs blocked.
const MODES: [([Gate; 3], Modes); 7] = [
    ([Gate::High, Gate::Low, Gate::Off], [UpperSwitch, LowerSwitch, Blocked]),
    ([Gate::Off; 3], [LowerDiode, Blocked, UpperDiode]),
    ([Gate::Off, Gate::Low, Gate::Low], [Blocked, LowerSwitch, LowerDiode]),
    ([Gate::High, Gate::Low, Gate::Low], [UpperSwitch, LowerSwitch, LowerSwitch]),
    ([Gate::Off; 3], [LowerDiode, UpperDiode, UpperDiode]),
    ([Gate::Low, Gate::High, Gate::Low], [LowerDiode, UpperDiode, Blocked]),
    ([Gate::Off; 3], [Blocked; 3]),
];

const AT_REST: [Motion; 4] = [Motion::Held, Motion::Resting, Motion::AtUpper, Motion::AtLower];
const MOVING: [Motion; 3] = [Motion::Forward, Motion::Backward, Motion::Floating];

/// Absolute tolerances as a rig has them; each lane takes as many as its state is long.
const TOLERANCE: [f64; CORE] = [1e-9, 1e-9, 2e-9, 2e-6, 1e-4];

/// A machine in a lane and the step that it asks for.
struct Seated<'a> {
    flow: Flow<'a>,
    time: f64,
    start: [f64; CORE],
    h: f64,
}

impl<'a> Seated<'a> {
    fn new(motor: &'a Motor, drive: &'a DriveSettings, motion: Motion, random: &mut ChaCha8Rng) -> Self {
        let mut flow = Flow::new(motor, &drive.bridge, &drive.link, motion);
        let angle = random.random_range(0.0..6.0);
        flow.machine.ripple_phase = random.random_range(0.0..6.0);
        flow.machine.load_torque = random.random_range(-1.0..1.0);
        flow.stops = random.random_bool(0.5).then_some([angle - 1e-3, angle + 1e-3]);
        let (gates, modes) = MODES[random.random_range(0..MODES.len())];
        flow.gates = gates;
        flow.conduct(modes);
        flow.turn(motion, angle);
        let rest = motor.open_circuit_flux(angle);
        let size = 0.1 * rest.norm().max(0.1);
        let mut off = |flux: f64| flux + size * random.random_range(-1.0..1.0);
        let (alpha, beta) = (off(rest.alpha), off(rest.beta));
        let speed = if motion.moves() { random.random_range(-5.0..5.0) } else { 0.0 };
        let start = [alpha, beta, angle, speed, 550.0 + random.random_range(-20.0..20.0)];
        // Most steps are as long as those of a detection, some are far too long.
        let h = 10.0_f64.powf(random.random_range(-7.0..-3.0));
        Self { flow, time: random.random_range(0.0..0.1), start, h }
    }

    fn ask<const N: usize>(&self) -> Ask<'_, N> {
        let Flow { machine, limits, .. } = &self.flow;
        Ask {
            machine,
            limits,
            time: self.time,
            start: self.start[..N].try_into().expect("shorter"),
            h: self.h,
        }
    }
}

/// The bits of everything in a step; what tells when currents reached zero counts where something ended.
fn bits<const N: usize>(stride: &Stride<N>) -> Vec<u64> {
    let Stride { error, margin, end, port, crossing } = stride;
    let gamma = port.inverse_inductance;
    let mut all = vec![*error, *margin];
    all.extend(end);
    all.extend(port.current);
    all.extend([gamma.xx, gamma.xy, gamma.yy, port.holding.alpha, port.holding.beta, port.dc_link]);
    if *margin < 0.0 {
        all.push(crossing.other_margin);
        all.extend(crossing.middle_current);
        all.extend(crossing.rise.as_flattened());
    }
    // A result that is no number is none, whatever else its bits say.
    all.into_iter().map(|value| if value.is_nan() { u64::MAX } else { value.to_bits() }).collect()
}

/// What came out of many comparisons, so that none of them compares nothing.
#[derive(Default)]
struct Seen {
    ended: u32,
    went_on: u32,
    refused: u32,
    accepted: u32,
}

/// The lanes that were served have what their machines compute alone.
fn compare<const N: usize>(
    bank: &Bank,
    seated: &[Seated],
    served: [bool; LANES],
    label: &str,
    seen: &mut Seen,
) {
    let tolerance: [f64; N] = TOLERANCE[..N].try_into().expect("shorter");
    for (lane, seated) in seated.iter().enumerate().filter(|(lane, _)| served[*lane]) {
        let alone = seated.ask::<N>().stride(&tolerance);
        assert_eq!(bits(&bank.take::<N>(lane)), bits(&alone), "{label}, lane {lane}: {alone:?}");
        *(if alone.margin < 0.0 { &mut seen.ended } else { &mut seen.went_on }) += 1;
        *(if alone.error <= 1.0 { &mut seen.accepted } else { &mut seen.refused }) += 1;
    }
}

/// A bank full of machines of one kind: right-hand sides, then a step, then the same step of half of them.
fn compare_a_kind<const N: usize>(
    motor: &Motor,
    drive: &DriveSettings,
    motions: &[Motion],
    random: &mut ChaCha8Rng,
    seen: &mut Seen,
) {
    let pick = |random: &mut ChaCha8Rng| motions[random.random_range(0..motions.len())];
    let seated: [Seated; LANES] = std::array::from_fn(|_| Seated::new(motor, drive, pick(random), random));
    let mut bank = Bank::new(motor, &drive.link, TOLERANCE);
    for (lane, seated) in seated.iter().enumerate() {
        bank.seat(lane, &seated.flow.machine, &seated.flow.limits);
        bank.put(lane, &seated.ask::<N>());
    }
    let label = format!("{}, {motions:?}, {:?}", motor.name, drive.link);
    let slopes = bank.slopes::<N>(motions[0].moves());
    for (lane, seated) in seated.iter().enumerate() {
        let ask = seated.ask::<N>();
        let alone = seated.flow.evaluate(ask.time, &ask.start).slope;
        let lane = slopes.map(|slope| slope.0[lane].to_bits());
        assert_eq!(lane, alone.map(f64::to_bits), "{label}: {alone:?}");
    }
    assert_eq!(bank.step(), [true; LANES], "{label}");
    compare::<N>(&bank, &seated, [true; LANES], &label, seen);
    // The lanes are not all the same.
    assert_ne!(bank.take::<N>(0).end, bank.take::<N>(1).end, "{label}");
    // Nobody asks any more.
    assert_eq!(bank.step(), [false; LANES], "{label}");
    let even: [bool; LANES] = std::array::from_fn(|lane| lane % 2 == 0);
    for lane in (0..LANES).filter(|lane| even[*lane]) {
        bank.put(lane, &seated[lane].ask::<N>());
    }
    assert_eq!(bank.step(), even, "{label}");
    compare::<N>(&bank, &seated, even, &label, seen);
}

/// All kinds of motors that lanes know, and one with a map.
fn motors() -> Vec<Motor> {
    let mut all = all_kinds_of_motors();
    all.retain(|motor| motor.magnetics.eddy_currents().is_none());
    let paper = paper_motor();
    all.push(mapped(&paper, 1.6 * paper.rated_current).0);
    all
}

/// Poor drives, on a stiff link and on weaker ones.
fn drives(motor: &Motor) -> [DriveSettings; 4] {
    let drive = ErrorSet::Harsh.drive(motor.rated_current, 550.0);
    let with = |storage, sag| DriveSettings { link: DcLink { storage, sag, ..drive.link }, ..drive };
    let storage = Some(Storage { capacitance: 500e-6, source_resistance: 0.2 });
    // Some lanes are before it, some within, some after.
    let sag = Some(Sag { depth: 0.3, start: 0.02, duration: 0.05 });
    [with(None, None), with(None, sag), with(storage, None), with(storage, sag)]
}

#[test]
fn law_a_step_in_lanes_has_the_bits_of_a_machine_alone() {
    let mut random = ChaCha8Rng::seed_from_u64(6);
    let mut seen = Seen::default();
    for motor in motors() {
        for drive in drives(&motor) {
            for _ in 0..10 {
                if drive.link.storage.is_none() {
                    compare_a_kind::<PLANE>(&motor, &drive, &AT_REST, &mut random, &mut seen);
                }
                compare_a_kind::<CORE>(&motor, &drive, &AT_REST, &mut random, &mut seen);
                compare_a_kind::<CORE>(&motor, &drive, &MOVING, &mut random, &mut seen);
            }
        }
    }
    let Seen { ended, went_on, refused, accepted } = seen;
    assert!(ended.min(went_on).min(refused).min(accepted) > 1000, "{ended} {went_on} {refused} {accepted}");
}

#[test]
fn law_machines_of_another_kind_wait_and_disturb_nobody() {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let mut seen = Seen::default();
    for motor in motors() {
        let drive = drives(&motor)[0];
        for _ in 0..10 {
            let moves: [bool; LANES] = std::array::from_fn(|_| random.random_bool(0.4));
            let seated = moves.map(|moves| {
                let motion = if moves { MOVING[0] } else { AT_REST[1] };
                Seated::new(&motor, &drive, motion, &mut random)
            });
            let mut bank = Bank::new(&motor, &drive.link, TOLERANCE);
            for (lane, seated) in seated.iter().enumerate() {
                bank.seat(lane, &seated.flow.machine, &seated.flow.limits);
                if moves[lane] {
                    bank.put(lane, &seated.ask::<CORE>());
                } else {
                    bank.put(lane, &seated.ask::<PLANE>());
                }
            }
            let mut waiting = [true; LANES];
            // Two kinds, two steps.
            for _ in 0..2 {
                let served = bank.step();
                let Some(first) = served.iter().position(|served| *served) else { break };
                for lane in 0..LANES {
                    let expected = waiting[lane] && moves[lane] == moves[first];
                    assert_eq!(served[lane], expected, "{}, lane {lane}", motor.name);
                    waiting[lane] &= !served[lane];
                }
                if moves[first] {
                    compare::<CORE>(&bank, &seated, served, &motor.name, &mut seen);
                } else {
                    compare::<PLANE>(&bank, &seated, served, &motor.name, &mut seen);
                }
            }
            assert_eq!(waiting, [false; LANES], "{}", motor.name);
            assert_eq!(bank.step(), [false; LANES], "{}", motor.name);
        }
    }
    assert!(seen.accepted > 500 && seen.ended > 100);
}
