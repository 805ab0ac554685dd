//! Time of an FMU: the importer's, which has parts of nanoseconds; that of the machine inside has whole ones.

use standstill_fmu::{Part, Role};

use super::importer::{Slave, unpacked};
use super::{FIELD, PERIOD};

/// Importers compute a communication point from the number of the step.
fn point(n: u32, step: f64) -> f64 {
    f64::from(n) * step
}

/// Steps of 1000.4 ns: rounded one by one they would be 4 µs short after ten thousand, in which the current rises by 0.02 A.
#[test]
fn law_steps_of_a_motor_do_not_drift_from_the_importers_time() {
    let unpacked = unpacked("motor = \"paper-5k5\"\nrotor.angle = 0", Part::Motor);
    let (steps, step) = (10_000, 1000.4e-9);
    let [one, many] = [1, steps].map(|parts| {
        let slave = Slave::ready(&unpacked, &[]);
        for (name, value) in [("u_a", 100.0), ("u_b", -50.0), ("u_c", -50.0)] {
            assert_eq!(slave.set(name, value), 0);
        }
        let length = point(steps / parts, step);
        for n in 0..parts {
            assert_eq!(slave.step(point(n, length), length), 0, "{}", slave.said());
        }
        slave.get("i_a")
    });
    assert!(one > 10.0 && (one - many).abs() < 1e-5, "{one} A in one step, {many} A in many");
}

/// A period of 1428.57 ns is 1429 ns inside: after a few thousand steps the two are a period apart.
#[test]
fn law_a_drive_takes_the_importers_period_for_its_own_however_long() {
    let unpacked =
        unpacked("motor = \"low-inertia\"\ninverter = { carrier = 700e3, dead_time = 0 }", Part::Drive);
    let period = 1.0 / 700e3;
    let slave = Slave::ready(&unpacked, &[]);
    for n in 0..10_000 {
        assert_eq!(slave.step(point(n, period), period), 0, "step {n}: {}", slave.said());
    }
    // That does not make it blind: a step that begins before the last one ended, or that leaves one out.
    for off in [-1, 1] {
        let again = Slave::ready(&unpacked, &[]);
        for n in 0..2000 {
            assert_eq!(again.step(point(n, period), period), 0);
        }
        assert_eq!(again.step(f64::from(2000 + off) * period, period), 3);
        assert!(again.said().contains("where the last step ended"), "{}", again.said());
    }
}

/// Each point a little too late would leave the machine behind by as much as there are steps.
#[test]
fn law_points_may_be_off_by_what_is_rounded_and_no_more() {
    let unpacked = unpacked(FIELD, Part::Drive);
    let period = PERIOD.seconds();
    for (late, code) in [(1.5e-9, 0), (0.2 * period, 3), (-0.2 * period, 3)] {
        let slave = Slave::ready(&unpacked, &[]);
        assert_eq!(slave.step(0.0, period), 0);
        assert_eq!(slave.step(period + late, period), code, "{late:e}: {}", slave.said());
    }
}

#[test]
fn law_a_simulation_begins_and_ends_where_nanoseconds_can_be_told_apart() {
    let unpacked = unpacked("motor = \"paper-5k5\"\nrotor.angle = 0", Part::Motor);
    let slave = Slave::made(&unpacked);
    assert_eq!(slave.start_at(1e7), 3);
    assert!(
        slave.said().contains("start time: found 10000000 s, needed from -1000000 to 1000000 s"),
        "{}",
        slave.said()
    );
    assert_eq!(slave.start_at(-3e5), 0, "{}", slave.said());
    assert_eq!((slave.call("fmi2EnterInitializationMode"), slave.call("fmi2ExitInitializationMode")), (0, 0));
    assert_eq!(slave.step(-3e5, 9_999.0), 0, "{}", slave.said());
    assert_eq!(slave.set("u_a", 10.0), 0);
    assert_eq!(slave.step(-3e5 + 9_999.0, 0.5), 0, "{}", slave.said());
    assert!(slave.get("i_a") > 1.0);
    assert_eq!(slave.step(-3e5 + 9_999.5, 1.0), 3);
    assert!(slave.said().contains("an instance simulates at most 10000 s"), "{}", slave.said());
}

/// The description says how long a period is before any parameter is set, and the clock of FMI 3.0 is declared constant.
#[test]
fn law_no_parameter_changes_the_communication_step() {
    let unpacked = unpacked(FIELD, Part::Drive);
    assert_eq!(unpacked.model.period(), PERIOD);
    let mut tried = 0;
    for variable in unpacked.model.variables.iter().filter(|variable| variable.is_parameter()) {
        assert_ne!(variable.name, "inverter.carrier");
        let start = variable.start.expect("parameters have one");
        let (low, high) = variable.limits.map_or((-1e9, 1e9), |[low, high]| (low, high));
        let whole = variable.kind != standstill_fmu::Kind::Real;
        let other = if whole { start + 1.0 } else { start * 1.01 + 1e-9 * f64::from(u8::from(start == 0.0)) };
        let slave = Slave::made(&unpacked);
        if !(low..=high).contains(&other) || slave.set(&variable.name, other) != 0 {
            continue;
        }
        let ready = [slave.call("fmi2EnterInitializationMode"), slave.call("fmi2ExitInitializationMode")];
        // Some need another key beside them.
        if ready == [0, 0] {
            assert_eq!(slave.step(0.0, PERIOD.seconds()), 0, "{}: {}", variable.name, slave.said());
            tried += usize::from(matches!(variable.role, Role::Key(_)));
        }
    }
    assert!(tried > 30, "{tried} keys");
}
