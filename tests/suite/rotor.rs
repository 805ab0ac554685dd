//! A rotor that can move.

use standstill_campaign::{ErrorSet, Record, Specimen};
use standstill_detect::{Decay, LineInductance};
use standstill_sim::{NoProbe, RotorState, run};

use crate::bench::scenario;

/// Largest movement in electrical degrees over 24 angles.
fn largest_move(decay: Decay, rotor: RotorState) -> f64 {
    let scenario = scenario(ErrorSet::Default, decay, rotor);
    (0..24_u32)
        .map(|k| {
            let case = scenario
                .case_at(f64::from(15 * k).to_radians(), Specimen { drive: k.into(), noise: k.into() });
            let mut detector = LineInductance::new(scenario.detector).expect("settings");
            Record { trial: 0, run: run(&case, &mut detector, false, &mut NoProbe) }.rotor_moved_deg()
        })
        .fold(0.0, f64::max)
}

#[test]
fn law_slow_decay_turns_a_free_rotor_and_fast_decay_does_not() {
    // The paper says that a free rotor stays. With slow decay it does not: the current persists for milliseconds.
    let slow = largest_move(Decay::Slow, RotorState::Free);
    assert!(slow > 10.0 && slow < 60.0, "{slow}°");
    let fast = largest_move(Decay::Fast, RotorState::Free);
    assert!(fast < 0.05, "{fast}°");
}

#[test]
fn law_a_locked_rotor_does_not_move() {
    assert_eq!(largest_move(Decay::Slow, RotorState::Locked), 0.0);
}
