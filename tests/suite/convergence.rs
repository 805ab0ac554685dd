//! The numerical error of a whole run shrinks with the work as a method of order four promises.

use standstill_interface::{Abc, Command, Leg, Nanos, Sampling, Stage};
use standstill_inverter::OpenLeg;
use standstill_plant::built_in;
use standstill_sim::{NoProbe, RotorState, Tolerance, run};

use crate::bench::{Script, exact_case, ideal_inverter};

#[test]
fn law_the_error_of_a_run_falls_with_the_fourth_power_of_the_work() {
    // A light rotor turned by saturated currents over long commands, so that steps and not instants set the work.
    let mut motor = built_in("paper-5k5").expect("built in");
    motor.rotor.inertia = 5e-4;
    motor.rotor.friction = standstill_plant::Friction::default();
    let commands = || {
        let legs = [[1, 0, 0], [0, 1, 1], [0, 1, 0], [1, 0, 1], [0, 0, 0]];
        legs.map(|legs| {
            let legs = Abc(legs.map(|leg| if leg == 1 { Leg::High } else { Leg::Low }));
            let duration = Nanos::from_micros(8000);
            Command::hold(Stage { legs, duration }, Sampling::once(duration))
        })
        .to_vec()
    };
    let currents = |tolerance: f64| {
        let mut case = exact_case(&motor, ideal_inverter(OpenLeg::Diodes), 50.0);
        case.inverter.link.voltage = 80.0;
        case.rotor = RotorState::Free;
        case.tolerance = Tolerance { flux: tolerance };
        let mut script = Script::new(commands());
        let end = run(&case, &mut script, false, &mut NoProbe);
        assert!(end.moved > 0.2, "the rotor must turn: {}", end.moved);
        (end.work.derivatives as f64, script.readings.iter().flat_map(|r| r.current.0).collect::<Vec<f64>>())
    };
    let (_, exact) = currents(1e-14);
    let points: Vec<(f64, f64)> = [1e-8, 1e-9, 1e-10, 1e-11]
        .into_iter()
        .map(|tolerance| {
            let (work, got) = currents(tolerance);
            let error = got.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            println!("{tolerance:e}: {work} evaluations of the core, {error:e} A");
            (work.ln(), error.ln())
        })
        .collect();
    // Slope of the straight line through all points.
    let n = points.len() as f64;
    let (mx, my) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
    let (sxy, sxx) = points
        .iter()
        .fold((0.0, 0.0), |(xy, xx), p| (xy + (p.0 - mx) * (p.1 - my), xx + (p.0 - mx) * (p.0 - mx)));
    let order = -sxy / sxx;
    println!("order {order}");
    assert!((order - 4.0).abs() < 0.6, "{order}");
}
