//! A drive that is given its commands, and a motor that is fed with voltages: both are the one engine.

use standstill_interface::{
    Abc, Command, Detector, Findings, Leg, Nanos, Outcome, Reading, Sampling, Stage, Step,
};
use standstill_inverter::{Bridge, DcLink, Devices, GateTiming, Inverter};
use standstill_plant::{Motor, built_in};
use standstill_sim::{
    Adc, Case, Driven, NoProbe, RotorState, RunError, SensorSettings, Sensors, Streams, run,
};

#[allow(clippy::large_types_passed_by_value, reason = "settings are made for each test")]
fn case(motor: &Motor, rotor: RotorState, devices: Devices, sensors: SensorSettings) -> Case<'_> {
    let dead_time = Nanos(if devices == Devices::default() { 0 } else { 2000 });
    let inverter = Inverter {
        bridge: Bridge { devices, ..Bridge::default() },
        gates: [GateTiming { dead_time, ..GateTiming::default() }; 3],
        link: DcLink::stiff(550.0),
        carrier_period: Nanos(66_667),
    };
    Case {
        sensors: Sensors::nominal(sensors),
        start_angle: 0.7,
        rotor,
        streams: Streams::new(1, 3),
        ..Case::new(motor, inverter)
    }
}

const USUAL: Devices = Devices { switch_drop: 0.9, switch_resistance: 0.05, diode_drop: 1.0, ..IGBT };
const IGBT: Devices = Devices {
    kind: standstill_inverter::DeviceKind::Igbt,
    switch_drop: 0.0,
    switch_resistance: 0.0,
    diode_drop: 0.0,
    diode_resistance: 0.0,
};

const SENSORS: SensorSettings = SensorSettings {
    noise: 0.01,
    bandwidth: Some(100e3),
    adc: Some(Adc { bits: 12, low: -20.0, high: 20.0 }),
    jitter: Nanos(100),
    ..SensorSettings::IDEAL
};

/// Duties that differ from period to period, with a leg that is off now and then.
fn script() -> Vec<Command<f64>> {
    let period = |n: u32| {
        let off = if n % 5 == 4 { Leg::Off } else { Leg::Duty(0.55) };
        let legs = Abc([Leg::Duty(0.3 + 0.02 * f64::from(n % 7)), off, Leg::Duty(0.45)]);
        Command::hold(Stage { legs, duration: Nanos(66_667) }, Sampling::once(Nanos(66_667)))
    };
    (0..40).map(period).collect()
}

/// Gives the commands one after the other, and keeps what it reads.
#[derive(Default)]
struct Scripted(Vec<Command<f64>>, Vec<Reading<f64>>);

impl Detector<f64> for Scripted {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        self.1.extend_from_slice(readings);
        if self.0.is_empty() {
            let fault = standstill_interface::Fault::UnexpectedReadings;
            return Step::Done(Outcome::Failed { fault, findings: Findings::default() });
        }
        Step::Drive(self.0.remove(0))
    }
}

#[test]
fn law_a_driven_machine_reads_what_a_detector_reads_and_a_copy_goes_on_to_the_same_bits() {
    let motor = built_in("paper-5k5").expect("built in");
    for rotor in [RotorState::Locked, RotorState::Free] {
        let case = case(&motor, rotor, USUAL, SENSORS);
        let mut detector = Scripted(script(), Vec::new());
        let whole = run(&case, &mut detector, false, &mut NoProbe);
        let mut drive = Driven::new(&case);
        let mut copy = None;
        let mut read = Vec::new();
        for (n, command) in script().iter().enumerate() {
            if n == 17 {
                copy = Some(drive.clone());
            }
            read.extend_from_slice(drive.carry_out(command).expect("a command"));
        }
        assert_eq!(read, detector.1);
        assert!(read.len() == 40 && read[39].current.0[0].abs() > 0.5, "{:?}", read[39]);
        assert_eq!(drive.now().angle, whole.end_angle);
        assert_eq!((drive.now().speed != 0.0), rotor == RotorState::Free);
        let mut copy = copy.expect("made");
        assert_ne!(copy.now(), drive.now());
        for command in &script()[17..] {
            copy.carry_out(command).expect("a command");
        }
        assert_eq!((copy.now(), copy.readings()), (drive.now(), drive.readings()));
    }
}

#[test]
fn cross_a_fed_motor_is_the_motor_of_a_bridge_without_drops() {
    let motor = built_in("paper-5k5").expect("built in");
    for rotor in [RotorState::Locked, RotorState::Free] {
        let case = case(&motor, rotor, Devices::default(), SensorSettings::IDEAL);
        let (mut drive, mut fed) = (Driven::new(&case), Driven::motor(&case));
        for (legs, potential) in [
            ([Leg::High, Leg::Low, Leg::Low], [550.0, 0.0, 0.0]),
            ([Leg::Low, Leg::Low, Leg::High], [-40.0, -40.0, 510.0]),
            ([Leg::Low, Leg::Low, Leg::Low], [0.0; 3]),
        ] {
            let duration = Nanos(123_456);
            let command = Command::hold(Stage { legs: Abc(legs), duration }, Sampling::NONE);
            drive.carry_out(&command).expect("a command");
            fed.feed(potential, duration).expect("voltages");
            let (a, b) = (drive.now(), fed.now());
            assert!(a.torque.abs() > 0.1 && a.time == b.time, "{a:?}");
            for k in 0..3 {
                assert!((a.current[k] - b.current[k]).abs() < 1e-6, "{a:?}\n{b:?}");
            }
            assert!((a.angle - b.angle).abs() < 1e-9 && (a.torque - b.torque).abs() < 1e-5, "{a:?}\n{b:?}");
        }
    }
}

/// Where its rotor starts and stops, a motor that is fed goes on with the currents that it had.
#[test]
fn law_a_fed_motor_has_no_jumps_where_its_rotor_starts_and_stops() {
    let motor = built_in("paper-5k5").expect("built in");
    let case = case(&motor, RotorState::Free, Devices::default(), SensorSettings::IDEAL);
    let mut fed = Driven::motor(&case);
    let (mut last, mut changes, mut largest) = (fed.now(), 0, 0.0_f64);
    for n in 0..10_000 {
        // 20 V that turn five times a second.
        let angle = f64::from(n) * 20e-6 * 5.0 * std::f64::consts::TAU;
        let potential =
            [0.0, 1.0, 2.0].map(|k| 20.0 * standstill_numeric::cos(angle - k * std::f64::consts::TAU / 3.0));
        fed.feed(potential, Nanos(20_000)).expect("voltages");
        let now = fed.now();
        changes += u32::from((now.speed == 0.0) != (last.speed == 0.0) || now.speed * last.speed < 0.0);
        for k in 0..3 {
            largest = largest.max((now.current[k] - last.current[k]).abs());
        }
        last = now;
    }
    // 20 V across the smaller inductance for 20 µs raise 0.04 A, and as much again may be induced.
    assert!(changes >= 2 && largest < 0.1, "{changes} changes, {largest} A");
}

#[test]
fn analytic_a_fed_linear_motor_follows_its_time_constant() {
    let mut motor = built_in("paper-5k5").expect("built in");
    motor = motor.linearised();
    let start_angle = 0.0;
    let case =
        Case { start_angle, ..case(&motor, RotorState::Locked, Devices::default(), SensorSettings::IDEAL) };
    let mut fed = Driven::motor(&case);
    // Along the d-axis: phase a against the two others.
    let (u, step) = (3.0, Nanos(10_000_000));
    let inductance = motor.winding.d_axis_inductance();
    for n in 1..=5 {
        fed.feed([2.0 / 3.0 * u, -u / 3.0, -u / 3.0], step).expect("voltages");
        let t = f64::from(n) * step.seconds();
        let i = 2.0 / 3.0 * u / motor.resistance
            * -standstill_numeric::exp_m1(-t * motor.resistance / inductance);
        let now = fed.now();
        assert!((now.current[0] - i).abs() < 1e-6, "{now:?} {i}");
        assert!((now.current[1] + i / 2.0).abs() < 1e-6 && now.torque.abs() < 1e-6, "{now:?}");
    }
    assert!(matches!(fed.feed([f64::NAN, 0.0, 0.0], step), Err(RunError::NotFinite(_))));
}

/// Time is in f64, in nanoseconds: after 10,000 s, the longest that an FMU runs, an instant is still exact to 2 ps.
#[test]
fn law_a_drive_that_has_waited_reads_what_it_would_have_read_at_once() {
    let motor = built_in("paper-5k5").expect("built in");
    for rotor in [RotorState::Locked, RotorState::Free] {
        let case = Case { time_limit: Nanos(u64::MAX), ..case(&motor, rotor, USUAL, SensorSettings::IDEAL) };
        let after = |waits: u64| -> Vec<[f64; 3]> {
            let mut drive = Driven::new(&case);
            for _ in 0..waits {
                let wait = Command::hold(Stage::off(Nanos(10_000_000_000)), Sampling::NONE);
                drive.carry_out(&wait).expect("a wait");
            }
            script().iter().map(|of| drive.carry_out(of).expect("a command")[0].current.0).collect()
        };
        let (at_once, later) = (after(0), after(1000));
        assert!(at_once.iter().flatten().any(|current| current.abs() > 0.5));
        for (there, here) in at_once.iter().zip(&later) {
            for k in 0..3 {
                assert!((there[k] - here[k]).abs() < 1e-7, "{rotor:?}: {there:?} {here:?}");
            }
        }
    }
}

/// Neither filters nor terminals, ripple or a weak link of the case's inverter are there.
#[test]
fn law_a_fed_motor_has_nothing_of_the_inverter_and_the_sensors() {
    let motor = built_in("paper-5k5").expect("built in");
    let ideal = case(&motor, RotorState::Free, Devices::default(), SensorSettings::IDEAL);
    let mut real = case(&motor, RotorState::Free, USUAL, SENSORS);
    real.inverter.bridge.terminal_capacitance = 1e-9;
    real.inverter.link.ripple = 0.2;
    let fed = |case: &Case| {
        let mut fed = Driven::motor(case);
        let mut seen = Vec::new();
        for n in 0..50 {
            let on = f64::from(n % 3) * 100.0;
            fed.feed([on, -on, 0.0], Nanos(50_000)).expect("voltages");
            seen.push(fed.now());
        }
        seen
    };
    let (alone, beside) = (fed(&ideal), fed(&real));
    assert!(alone[49].torque.abs() > 0.1, "{:?}", alone[49]);
    assert_eq!(alone, beside);
}
