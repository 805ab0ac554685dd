//! Saturated cores against SciPy at a relative tolerance of 1e-13: on a turning rotor (`tests/cross/scipy_reference.py`),
//! and with an idle leg's diode (`benches/tools/scipy_hybrid.py`).

use standstill_interface::{Abc, Command, Leg, Nanos, Sampling, Stage};
use standstill_inverter::OpenLeg;
use standstill_plant::{Friction, Motor, built_in};
use standstill_sim::{NoProbe, RotorState, Tolerance, Trace, run};

use crate::bench::{Script, exact_case, ideal_inverter, usual_inverter};

/// The sequence of the script: legs (high or low), and how long in µs.
pub fn commands() -> Vec<Command<f64>> {
    [
        ([1, 0, 0], 300),
        ([0, 1, 0], 400),
        ([0, 0, 0], 2000),
        ([1, 1, 0], 250),
        ([0, 0, 1], 300),
        ([0, 1, 1], 150),
        ([1, 1, 1], 1600),
    ]
    .into_iter()
    .map(|(legs, micros)| {
        let legs = Abc(legs.map(|leg| if leg == 1 { Leg::High } else { Leg::Low }));
        let step = Nanos::from_micros(50);
        let sampling =
            Sampling { first: step, interval: step, count: u32::try_from(micros / 50).expect("few") };
        Command::hold(Stage { legs, duration: Nanos::from_micros(micros) }, sampling)
    })
    .collect()
}

fn against_scipy(name: &str, inertia: f64, angle: f64, golden: &str) {
    let mut motor: Motor = built_in(name).expect("built in");
    motor.rotor.inertia = inertia;
    motor.rotor.friction = Friction::default();
    let mut case = exact_case(&motor, ideal_inverter(OpenLeg::Diodes), angle.to_degrees());
    case.rotor = RotorState::Free;
    case.tolerance = Tolerance { flux: 1e-14 };
    let mut script = Script::new(commands());
    let end = run(&case, &mut script, false, &mut NoProbe);
    let mut reader = csv::Reader::from_reader(golden.as_bytes());
    let rows: Vec<[f64; 6]> = reader.deserialize().map(|row| row.expect("golden row")).collect();
    assert_eq!(rows.len(), script.readings.len());
    let peak = rows.iter().flat_map(|row| row[1..4].iter()).fold(0.0_f64, |peak, i| peak.max(i.abs()));
    for (row, reading) in rows.iter().zip(&script.readings) {
        for (ours, theirs) in reading.current.0.iter().zip(&row[1..4]) {
            assert!((ours - theirs).abs() < 1e-8 * peak, "{name} at {} s: {ours} {theirs}", row[0]);
        }
    }
    let last = rows.last().expect("rows");
    assert!((end.end_angle - last[4]).abs() < 1e-8, "{name}: {} {}", end.end_angle, last[4]);
    assert!(end.moved > 0.05, "{name}: the rotor must turn, it moved {} rad", end.moved);

    // The default tolerance is a hundred times and more below the 10 mA of the default sensors' noise.
    case.tolerance = Tolerance::default();
    let mut script = Script::new(commands());
    run(&case, &mut script, false, &mut Trace::new(1e-3));
    for (row, reading) in rows.iter().zip(&script.readings) {
        for (ours, theirs) in reading.current.0.iter().zip(&row[1..4]) {
            assert!((ours - theirs).abs() < 1e-4, "{name} at {} s: {ours} {theirs}", row[0]);
        }
    }
}

#[test]
fn cross_saturated_core_and_turning_rotor_against_scipy() {
    against_scipy("paper-5k5", 1e-3, 0.7, include_str!("../cross/scipy_paper-5k5.csv"));
    against_scipy("pm-reluctance", 2e-5, 2.0, include_str!("../cross/scipy_pm-reluctance.csv"));
}

/// Three line pulses of `benches/tools/problem.py`, each followed by a low-side freewheel: the sampled currents in A.
fn line_pulses(motor: &Motor, open_leg: OpenLeg, tolerance: Tolerance) -> Vec<[f64; 3]> {
    let stage = |legs, micros| Stage { legs: Abc(legs), duration: Nanos::from_micros(micros) };
    let command = Command::sequence(
        stage([Leg::High, Leg::Low, Leg::Off], 80),
        stage([Leg::Low, Leg::Low, Leg::Off], 2320),
        Sampling { first: Nanos::from_micros(80), interval: Nanos::from_micros(400), count: 6 },
    );
    let mut case = exact_case(motor, usual_inverter(open_leg), 20.0);
    case.tolerance = tolerance;
    let mut script = Script::new(vec![command; 3]);
    run(&case, &mut script, false, &mut NoProbe);
    script.readings.iter().map(|reading| reading.current.0).collect()
}

#[test]
fn cross_idle_leg_on_a_saturated_core_against_scipy() {
    let motor = built_in("paper-5k5").expect("built in");
    let mut reader = csv::Reader::from_reader(include_str!("../../benches/tools/reference.csv").as_bytes());
    let rows: Vec<[f64; 4]> = reader.deserialize().map(|row| row.expect("golden row")).collect();
    // The diode of the idle leg carries current in every sample of the freewheels.
    assert_eq!(rows.iter().filter(|row| row[3] > 0.5e-3).count(), 15);
    let deviation = |open_leg, flux| {
        let ours = line_pulses(&motor, open_leg, Tolerance { flux });
        assert_eq!(ours.len(), rows.len());
        let pairs = rows
            .iter()
            .zip(&ours)
            .flat_map(|(row, ours)| row[1..].iter().zip(ours).map(|(a, b)| (a - b).abs()));
        pairs.fold(0.0, f64::max)
    };
    // Two other methods of SciPy differ from the reference by up to 1e-11 A.
    let (usual, tight) = (Tolerance::default().flux, 1e-14);
    for (flux, bound) in [(usual, 2e-7), (tight, 1e-10)] {
        let worst = deviation(OpenLeg::Diodes, flux);
        println!("{flux:.0e} Wb: {worst:.1e} A");
        assert!(worst < bound, "{worst:e} A at {flux:e} Wb");
    }
    // Without the diode the currents are others: the comparison would notice.
    assert!(deviation(OpenLeg::Open, usual) > 1e-2);
}
