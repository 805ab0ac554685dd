//! Play cells in the stator's iron against SciPy: a saturated core on a light rotor that turns, `tests/cross/scipy_hysteresis.py`.

use std::path::Path;

use standstill_inverter::OpenLeg;
use standstill_plant::{Friction, Hysteresis, built_in};
use standstill_scenario::{Document, Plan};
use standstill_sim::{Ended, NoProbe, RotorState, Tolerance, run};

use crate::bench::{Script, exact_case, ideal_inverter};
use crate::reference::commands;

#[test]
fn cross_play_cells_on_a_turning_rotor_against_scipy() {
    let mut motor = built_in("paper-5k5").expect("built in");
    motor.rotor.inertia = 1e-3;
    motor.rotor.friction = Friction::default();
    let mut reader = csv::Reader::from_reader(include_str!("../cross/scipy_hysteresis.csv").as_bytes());
    let rows: Vec<[f64; 6]> = reader.deserialize().map(|row| row.expect("golden row")).collect();
    let peak = rows.iter().flat_map(|row| row[1..4].iter()).fold(0.0_f64, |peak, i| peak.max(i.abs()));
    let deviation = |coercive_current: f64, flux: f64| {
        let mut motor = motor.clone();
        let hysteresis = Hysteresis { coercive_current, depth: 0.05, cells: 3 };
        motor.magnetics = motor.magnetics.clone().with_hysteresis(Some(hysteresis));
        let mut case = exact_case(&motor, ideal_inverter(OpenLeg::Diodes), 0.7_f64.to_degrees());
        case.rotor = RotorState::Free;
        case.tolerance = Tolerance { flux };
        let mut script = Script::new(commands());
        let end = run(&case, &mut script, false, &mut NoProbe);
        assert_eq!(rows.len(), script.readings.len());
        let pairs = rows.iter().zip(&script.readings);
        let off = pairs.flat_map(|(row, reading)| (0..3).map(|k| (row[k + 1] - reading.current.0[k]).abs()));
        let angle = (end.end_angle - rows.last().expect("rows")[4]).abs();
        (off.fold(0.0, f64::max) / peak, angle)
    };
    let (exact, usual, without) = (deviation(0.16, 1e-13), deviation(0.16, 1e-9), deviation(0.0, 1e-9));
    println!("{exact:?} {usual:?} {without:?}");
    assert!(exact.0 < 1e-10 && exact.1 < 1e-10, "{exact:?}");
    assert!(usual.0 < 1e-7 && usual.1 < 1e-7, "{usual:?}");
    // The test could not fail if the iron made no difference.
    assert!(without.0 > 1e-3, "{without:?}");
}

/// A sliding cell turns less than its tangent at the predicted end says. So a blocked leg was left with some microamperes, and where it
/// was to conduct next, no step was accepted any more.
#[test]
fn regress_a_blocked_leg_is_left_without_current_where_cells_slide() {
    let text = "motor.base = \"paper-5k5\"\nmotor.hysteresis = { coercive_current = 0.08, depth = \"5 %\", cells = 3 }\n\
                rotor.memory = \"former\"\ndetector.method = \"bipolar\"\n";
    let plan = Plan::new(Document::parse(Path::new("s.toml"), text).expect("TOML")).expect("a plan");
    let scenario = plan.scenario(0).expect("a scenario");
    for trial in [56, 247, 252] {
        let record = scenario.trial(trial).expect("settings");
        assert!(matches!(record.run.ended, Ended::Outcome(_)), "{trial}: {:?}", record.run.ended);
    }
}
