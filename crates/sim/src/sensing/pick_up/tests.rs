use standstill_inverter::{Bridge, Conduction, Gate};

use super::*;
use crate::physics::legs::Legs;
use Conduction::{Blocked, LowerDiode, LowerSwitch, UpperDiode, UpperSwitch};

const OF: PickUp = PickUp { amplitude: 0.2, decay: 0.5e-6, frequency: 5e6 };

/// Pick-up of a sequence of gates and modes, with the time in ns of the last one.
struct Course {
    picked_up: PickedUp<f64>,
    time: f64,
}

impl Course {
    fn new() -> Self {
        let mut picked_up = PickedUp::default();
        picked_up.put(0, OF);
        Self { picked_up, time: 0.0 }
    }

    /// Returns the pick-up in A at a time in ns.
    fn at(&self, time: f64) -> f64 {
        let mut copy = self.picked_up;
        copy.advance(true, (time - self.time) * 1e-9, None);
        copy.at(0)
    }

    fn follow(&mut self, time: f64, gates: [Gate; 3], modes: [Conduction; 3]) {
        self.picked_up.advance(true, (time - self.time) * 1e-9, None);
        self.time = time;
        let mut legs: Legs<f64> = Legs::idle(false, false);
        legs.put_bridge(0, &Bridge::default());
        for (to, gate) in legs.gates.iter_mut().zip(gates) {
            to.expect(0, Some((-2.0, -1.0, gate)));
        }
        legs.put(0, modes);
        self.picked_up.follow(true, &legs.at::<false>(time, 1.0));
    }
}

#[test]
fn analytic_edges_ring_and_add_up() {
    let mut course = Course::new();
    let wave = |t: f64| (-t / 0.5e-6).exp() * (TAU * 5e6 * t).cos();
    // From rest, leg a switches to the upper rail: half an edge. Leg c's gates stay off while its diode carries the current.
    course.follow(0.0, [Gate::High, Gate::Off, Gate::Off], [UpperSwitch, Blocked, UpperDiode]);
    assert!((course.at(130.0) - 0.1 * wave(130e-9)).abs() < 1e-15);
    // All gates turn off. The current of leg a continues through the lower diode: a whole falling edge. Leg c's potential stays.
    course.follow(700.0, [Gate::Off; 3], [LowerDiode, Blocked, UpperDiode]);
    for t in [700.0, 731.0, 1500.0] {
        let expected = 0.1 * wave(t * 1e-9) - 0.2 * wave((t - 700.0) * 1e-9);
        assert!((course.at(t) - expected).abs() < 1e-14, "{t} ns: {} A", course.at(t));
    }
    assert!(course.at(700.0 + 40_000.0).abs() < 1e-27);
}

#[test]
fn law_what_moves_no_potential_at_once_rings_not() {
    let mut course = Course::new();
    course.follow(0.0, [Gate::Off; 3], [LowerDiode, UpperDiode, Blocked]);
    // A switch in parallel to a conducting diode turns on.
    course.follow(1000.0, [Gate::Low, Gate::High, Gate::Off], [LowerDiode, UpperDiode, Blocked]);
    course.follow(2000.0, [Gate::Low, Gate::High, Gate::Off], [LowerSwitch, UpperSwitch, Blocked]);
    // Currents end, and diodes of other legs conduct.
    course.follow(3000.0, [Gate::Off; 3], [LowerDiode, Blocked, UpperDiode]);
    assert!([0.0, 100.0, 1100.0, 2100.0, 3100.0].iter().all(|t| course.at(*t) == 0.0));
}

#[test]
fn analytic_what_glides_is_the_sum_of_its_parts() {
    // The rate of change of the potentials over h seconds is a cubic plus an oscillation. Expected: the sum of many small jumps.
    let (decay, angle) = (0.4, 2.5);
    let over = f64::exp(-decay);
    let of = Oscillation {
        phasor: [0.3, -0.2],
        turns: [-decay, angle],
        over: [over * f64::cos(angle), over * f64::sin(angle)],
    };
    let none = Oscillation { phasor: [0.0; 2], turns: [0.0, 1.0], over: [1.0_f64.cos(), 1.0_f64.sin()] };
    let (all, moves) = ([of, none], Moves { cubic: [0.4, -0.5, 0.2, 0.3], shares: [0.7, 1.0] });
    for h in [1e-13, 1e-8, 0.3e-6, 3e-6] {
        let mut course = Course::new();
        course.picked_up.advance(true, h, Some((&moves, &all)));
        let sum_to = |end: f64| -> f64 {
            let parts = 40_000;
            (0..parts)
                .map(|n| {
                    let s = (f64::from(n) + 0.5) / f64::from(parts) * end;
                    let left = h * (end - s);
                    let wave = (-decay * s).exp() * (0.3 * (angle * s).cos() + 0.2 * (angle * s).sin());
                    let moved = 0.4 - 0.5 * s + 0.2 * s * s + 0.3 * s * s * s + 0.7 * wave;
                    0.2 * moved * end / f64::from(parts) * (-left / 0.5e-6).exp() * (TAU * 5e6 * left).cos()
                })
                .sum()
        };
        assert!((course.picked_up.at(0) - sum_to(1.0)).abs() < 1e-7, "{h} s: {}", course.picked_up.at(0));
        let of_share = [all[0].of_lane(0, 0.3), all[1].of_lane(0, 0.3)];
        let part = Course::new().picked_up.within(0, 0.3, h, Some((&moves, &of_share)));
        assert!((part - sum_to(0.3)).abs() < 1e-7, "{h} s: {part} {}", sum_to(0.3));
        let before = course.picked_up.at(0);
        course.picked_up.jump(0, 0.5);
        assert!((course.picked_up.at(0) - before - 0.1).abs() < 1e-15);
        course.picked_up.advance(false, 1.0, Some((&moves, &all)));
        assert!((course.picked_up.at(0) - before - 0.1).abs() < 1e-15);
    }
}
