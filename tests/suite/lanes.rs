//! Machines side by side compute what each computes alone, to the last bit.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use standstill_campaign::ErrorSet;
use standstill_inverter::Conduction::{Blocked, LowerDiode, LowerSwitch, UpperDiode, UpperSwitch};
use standstill_inverter::{DcLink, Modes, Storage};
use standstill_plant::{Motor, Pack};
use standstill_sim::{CORE, Flow, LANES, Machine, Motion, PLANE, WITH_EDDY, step, step_of_lanes};

use crate::bench::all_kinds_of_motors;

/// Modes as pulses, decays and vectors have them; none, one or all legs blocked.
const MODES: [Modes; 6] = [
    [UpperSwitch, LowerSwitch, Blocked],
    [LowerDiode, Blocked, UpperDiode],
    [Blocked, LowerSwitch, LowerDiode],
    [UpperSwitch, LowerSwitch, LowerSwitch],
    [LowerDiode, UpperDiode, UpperDiode],
    [Blocked, Blocked, Blocked],
];

/// A step of machines in different states, modes and phases of the ripple, of different lengths.
fn compare<const N: usize>(motor: &Motor, motion: Motion, storage: Option<Storage>, random: &mut ChaCha8Rng) {
    let drive = ErrorSet::Harsh.drive(motor.rated_current, 550.0);
    let link = DcLink { storage, ..drive.link };
    let mut machines = [Flow::new(motor, &drive.bridge, &link, motion).machine; LANES];
    let mut start = [[0.0; N]; LANES];
    let (mut time, mut h) = ([0.0; LANES], [0.0; LANES]);
    for k in 0..LANES {
        let angle = random.random_range(0.0..6.0);
        let mut flow = Flow::new(motor, &drive.bridge, &link, motion);
        flow.conduct(MODES[random.random_range(0..MODES.len())]);
        flow.turn(motion, angle);
        flow.machine.ripple_phase = random.random_range(0.0..6.0);
        machines[k] = flow.machine;
        let rest = motor.open_circuit_flux(angle);
        let size = 0.1 * rest.norm().max(0.1);
        start[k][0] = rest.alpha + size * random.random_range(-1.0..1.0);
        start[k][1] = rest.beta + size * random.random_range(-1.0..1.0);
        for (n, value) in [(2, angle), (3, random.random_range(-5.0..5.0)), (4, 550.0), (5, rest.norm())] {
            if n < N {
                start[k][n] = value;
            }
        }
        time[k] = random.random_range(0.0..0.1);
        h[k] = random.random_range(1e-7..1e-4);
    }
    let across = |of: &[[f64; N]; LANES]| std::array::from_fn(|n| Pack(std::array::from_fn(|k| of[k][n])));
    let tolerance = [1e-9; N];
    let slope: [[f64; N]; LANES] = std::array::from_fn(|k| machines[k].evaluate(time[k], &start[k]).slope);
    let all = step_of_lanes(
        &Machine::side_by_side(&machines),
        &Pack(time),
        &across(&start),
        &across(&slope),
        &Pack(h),
        &tolerance,
    );
    for k in 0..LANES {
        let one = step(&machines[k], time[k], &start[k], &slope[k], h[k], &tolerance);
        let same = |lane: Pack<LANES>, alone: f64| {
            assert!(alone.is_finite(), "{} {motion:?}", motor.name);
            assert_eq!(lane.0[k].to_bits(), alone.to_bits(), "{} {motion:?}", motor.name);
        };
        same(all.error, one.error);
        for n in 0..N {
            same(all.attempt.end[n], one.attempt.end[n]);
            same(all.attempt.end_slope[n], one.attempt.end_slope[n]);
            same(all.middle_state[n], one.middle_state[n]);
            for stage in 0..6 {
                same(all.attempt.slopes[stage][n], one.attempt.slopes[stage][n]);
            }
        }
        for leg in 0..3 {
            same(all.end.operating.port.current[leg], one.end.operating.port.current[leg]);
            same(all.end.potentials[leg], one.end.potentials[leg]);
            same(all.middle.potentials[leg], one.middle.potentials[leg]);
        }
        same(all.end.operating.torque, one.end.operating.torque);
    }
    // The lanes are not all the same.
    assert_ne!(all.attempt.end[0].0[0], all.attempt.end[0].0[1]);
}

#[test]
fn law_lanes_have_the_bits_of_a_machine_alone() {
    let mut random = ChaCha8Rng::seed_from_u64(6);
    for motor in all_kinds_of_motors() {
        let storage = Some(Storage { capacitance: 500e-6, source_resistance: 0.2 });
        for _ in 0..20 {
            if motor.magnetics.eddy_currents().is_none() {
                compare::<PLANE>(&motor, Motion::Held, None, &mut random);
                compare::<CORE>(&motor, Motion::Forward, None, &mut random);
                compare::<CORE>(&motor, Motion::Backward, storage, &mut random);
            }
            compare::<WITH_EDDY>(&motor, Motion::Floating, None, &mut random);
        }
    }
}
