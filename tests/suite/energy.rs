//! Energy over a whole detection: what the source gives is lost, stored, or turned into motion.

use standstill_detect::{Decay, LineInductance};
use standstill_inverter::Storage;
use standstill_plant::{Friction, built_in};
use standstill_scenario::ErrorSet;
use standstill_sim::{Ledger, NoProbe, RotorState, Tolerance, run};

use crate::bench::scenario;

fn ledger(decay: Decay, rotor: RotorState, motor: &str, storage: Option<Storage>) -> Ledger {
    let mut scenario = scenario(ErrorSet::Default, decay, rotor);
    scenario.motor = built_in(motor).expect("built in");
    scenario.drive.link.storage = storage;
    let mut case = scenario.case(3);
    case.tolerance = Tolerance { flux: 1e-12 };
    let mut detector = LineInductance::new(scenario.detector).expect("settings");
    run(&case, &mut detector, true, &mut NoProbe).ledger.expect("asked for")
}

/// promise: energy-balance
#[test]
fn law_energy_balance_over_a_whole_detection() {
    let capacitor = Storage { capacitance: 500e-6, source_resistance: 0.2 };
    for motor in ["paper-5k5", "gearless-hoist"] {
        for decay in [Decay::Slow, Decay::Fast] {
            for rotor in [RotorState::Locked, RotorState::Free] {
                for storage in [None, Some(capacitor)] {
                    let ledger = ledger(decay, rotor, motor, storage);
                    // Measured against what was lost and moved, not against the reactive energy that came and went.
                    let scale = ledger.copper_loss + ledger.device_loss + ledger.shaft_work.abs();
                    let relative = ledger.imbalance() / scale;
                    assert!(relative.abs() < 1e-6, "{motor} {decay:?} {rotor:?}: {relative:e} {ledger:?}");
                    assert!(
                        scale > 1e-2 && ledger.copper_loss > 0.0 && ledger.device_loss > 0.0,
                        "{ledger:?}"
                    );
                    // The last wait leaves no current behind: the field holds what it held.
                    assert!(ledger.field_change.abs() < 1e-9 * scale, "{ledger:?}");
                    if rotor == RotorState::Locked {
                        assert_eq!(ledger.shaft_work, 0.0);
                    }
                }
            }
        }
    }
}

#[test]
fn law_without_friction_the_shaft_work_is_the_kinetic_energy() {
    let mut scenario = scenario(ErrorSet::Default, Decay::Slow, RotorState::Free);
    scenario.motor.rotor.friction = Friction::default();
    let mut case = scenario.case(3);
    case.tolerance = Tolerance { flux: 1e-12 };
    let mut detector = LineInductance::new(scenario.detector).expect("settings");
    let ledger = run(&case, &mut detector, true, &mut NoProbe).ledger.expect("asked for");
    assert!(ledger.shaft_work > 1e-4, "{ledger:?}");
    assert!((ledger.shaft_work / ledger.kinetic_change - 1.0).abs() < 1e-6, "{ledger:?}");
}

#[test]
fn law_the_rotor_gets_its_kinetic_energy_from_the_shaft() {
    let ledger = ledger(Decay::Slow, RotorState::Free, "paper-5k5", None);
    // Friction takes the rest: never more than what came in.
    assert!(ledger.shaft_work > ledger.kinetic_change && ledger.kinetic_change >= 0.0, "{ledger:?}");
    assert!(ledger.shaft_work > 1e-4, "{ledger:?}");
}
