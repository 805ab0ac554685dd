//! Terminals with a capacitance.

use standstill_detect::{Method, MethodName};
use standstill_interface::{Abc, Command, Leg, Nanos, Sampling, Stage};
use standstill_inverter::OpenLeg;
use standstill_plant::Motor;
use standstill_scenario::{ErrorSet, Scenario};
use standstill_sim::{NoProbe, RotorState, Run, SensorSettings, Tolerance, Trace, referee, run};

use crate::bench::{Script, exact_case, ideal_inverter, paper_motor, reference_motor};

#[test]
fn explore_pulse() {
    let motor = paper_motor();
    for (open, motor) in
        [(OpenLeg::Open, reference_motor()), (OpenLeg::Open, paper_motor()), (OpenLeg::Diodes, paper_motor())]
    {
        let mut inverter = ideal_inverter(open);
        inverter.bridge.terminal_capacitance = 0.3e-9;
        let stage = |legs, micros| Stage { legs: Abc(legs), duration: Nanos::from_micros(micros) };
        let command = Command::sequence(
            stage([Leg::High, Leg::Low, Leg::Off], 80),
            stage([Leg::Off, Leg::Off, Leg::Off], 320),
            Sampling { first: Nanos::from_micros(1), interval: Nanos::from_micros(1), count: 400 },
        );
        let mut case = exact_case(&motor, inverter, 20.0);
        let mut script = Script::new(vec![command; 1]);
        let ours: Run<f64> = run(&case, &mut script, true, &mut NoProbe);
        case.tolerance = Tolerance { flux: 1e-13 };
        let mut reference = Script::new(vec![command; 1]);
        let theirs: Run<f64> = referee(&case, &mut reference, true, &mut NoProbe);
        println!("{:?}\n{:?}", ours, theirs);
        println!("imbalance {:e} {:e}", ours.ledger.unwrap().imbalance(), theirs.ledger.unwrap().imbalance());
        for (a, b) in script.readings.iter().zip(&reference.readings).step_by(9) {
            println!(
                "{} {:?} {:.2e}",
                a.at.0,
                a.current.0,
                (0..3).map(|k| (a.current.0[k] - b.current.0[k]).abs()).fold(0.0, f64::max)
            );
        }
    }
}
