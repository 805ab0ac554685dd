//! How fast is a simulated second, and how exact? The problem that other programs solve in `benches/tools/`.
//!
//! ```text
//!   a high, b low, c off ─► low-side freewheel ─► … three times     18 samples against benches/tools/reference.csv
//!        80 µs                  2320 µs
//! ```
//! After the three pulses the paper's whole detection with drops, dead time, tolerances and sensors, on one thread.
//!
//! Run with `cargo run --release --example three_pulses`; `-- --csv` prints name, simulated seconds per second and
//! largest error in A, one line each.

use std::hint::black_box;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use standstill_campaign::{Campaign, CampaignError};
use standstill_detect::{Method, MethodName, Settings};
use standstill_interface::{
    Abc, Command, Detector, Fault, Findings, Leg, Nanos, Outcome, Reading, Sampling, Stage, Step,
};
use standstill_inverter::{DcLink, DeviceKind, GateTiming, Inverter};
use standstill_plant::{Motor, built_in};
use standstill_scenario::{ErrorSet, Scenario};
use standstill_sim::{Case, Faults, NoProbe, RotorState, SensorSettings, Sensors, Streams, Tolerance, run};

const ANGLE_DEG: f64 = 20.0;
const PULSES: usize = 3;
const SAMPLES: u32 = 6;
/// By the same equations with SciPy at a relative tolerance of 1e-13: time in s, currents in A.
const REFERENCE: &str = include_str!("../benches/tools/reference.csv");

/// A detector that orders the pulses and keeps what it reads.
#[derive(Default)]
struct Pulses {
    ordered: usize,
    currents: [[f64; 3]; PULSES * SAMPLES as usize],
    read: usize,
}

impl Detector<f64> for Pulses {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        for reading in readings {
            self.currents[self.read] = reading.current.0;
            self.read += 1;
        }
        if self.ordered == PULSES {
            let (fault, findings) = (Fault::UnexpectedReadings, Findings::default());
            return Step::Done(Outcome::Failed { fault, findings });
        }
        self.ordered += 1;
        let stage = |legs, micros| Stage { legs: Abc(legs), duration: Nanos::from_micros(micros) };
        Step::Drive(Command::sequence(
            stage([Leg::High, Leg::Low, Leg::Off], 80),
            stage([Leg::Low, Leg::Low, Leg::Off], 2320),
            Sampling { first: Nanos::from_micros(80), interval: Nanos::from_micros(400), count: SAMPLES },
        ))
    }
}

fn case(motor: &Motor, tolerance: Tolerance) -> Case<'_> {
    let timing = GateTiming { dead_time: Nanos::from_micros(2), ..GateTiming::default() };
    Case {
        motor,
        inverter: Inverter {
            // 0.9 V + 50 mΩ and 1.0 V + 30 mΩ.
            bridge: ErrorSet::Default.drive(motor, DeviceKind::Igbt).bridge,
            gates: [timing; 3],
            link: DcLink::stiff(550.0),
            carrier_period: Nanos::from_micros(100),
        },
        sensors: Sensors::nominal(SensorSettings::IDEAL),
        start_angle: ANGLE_DEG.to_radians(),
        rotor: RotorState::Locked,
        memory: None,
        load_torque: 0.0,
        start_speed: 0.0,
        acceleration: 0.0,
        faults: Faults::default(),
        streams: Streams::new(1, 0),
        tolerance,
        time_limit: Case::TIME_LIMIT,
    }
}

/// Simulated seconds per second: the best of some rounds of a task that returns what it simulated.
fn rate(mut task: impl FnMut() -> f64) -> f64 {
    let round = |_| {
        let begin = Instant::now();
        let simulated = task();
        simulated / begin.elapsed().as_secs_f64()
    };
    (0..15).map(round).fold(0.0, f64::max)
}

/// What a detector reads, on its way.
struct Listening<D> {
    inner: D,
    currents: Vec<f64>,
}

impl<D: Detector<f64>> Detector<f64> for Listening<D> {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        self.currents.extend(readings.iter().flat_map(|reading| reading.current.0));
        self.inner.step(readings)
    }
}

/// The largest numerical error in A of what detections read: the same drives with exact sensors, whose converters would
/// hide it, against runs that leave no tolerance.
fn error_of_detections(mut scenario: Scenario<Method<f64>>) -> Result<f64, Box<dyn std::error::Error>> {
    scenario.sensors = SensorSettings::IDEAL;
    let mut tight = scenario.clone();
    tight.tolerance = Tolerance { flux: 1e-14 };
    let read = |scenario: &Scenario<Method<f64>>, trial| {
        let mut detector = Listening { inner: scenario.detector.detector()?, currents: Vec::new() };
        scenario.trial_with(trial, &mut detector);
        Ok::<_, Box<dyn std::error::Error>>(detector.currents)
    };
    let mut worst: f64 = 0.0;
    for trial in 0..50 {
        let (usual, exact) = (read(&scenario, trial)?, read(&tight, trial)?);
        if usual.len() != exact.len() {
            return Err(format!("trial {trial}: another number of readings at a tight tolerance").into());
        }
        worst = usual.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(worst, f64::max);
    }
    Ok(worst)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let csv = std::env::args().any(|argument| argument == "--csv");
    let tell = |name: &str, rate: f64, error: f64| {
        if csv {
            println!("standstill {name},{rate:.6e},{error:.3e}");
        } else {
            println!("{name:24}{rate:>12.0} simulated seconds per second, {error:.1e} A");
        }
    };
    let motor = built_in("paper-5k5").ok_or("no such motor")?;
    let case = case(&motor, Tolerance::default());

    let mut pulses = Pulses::default();
    run(&case, &mut pulses, false, &mut NoProbe);
    let mut error: f64 = 0.0;
    for (line, ours) in REFERENCE.lines().skip(1).zip(&pulses.currents) {
        let row: Vec<f64> = line.split(',').map(str::parse).collect::<Result<_, _>>()?;
        let worst = ours.iter().zip(&row[1..]).map(|(ours, exact)| (ours - exact).abs()).fold(0.0, f64::max);
        error = error.max(worst);
        if !csv {
            let [a, b, c] = ours;
            let micros = row[0] * 1e6;
            println!("{micros:6.0} µs: i = {a:+.6} {b:+.6} {c:+.6} A, error {worst:.1e} A");
        }
    }
    let repeated = || {
        (0..2000)
            .map(|_| run(black_box(&case), &mut Pulses::default(), false, &mut NoProbe).duration.seconds())
            .sum()
    };
    tell("three pulses", rate(repeated), error);

    for method in [MethodName::LineInductance, MethodName::LineInductanceFast] {
        let scenario = Scenario::of_method(method, motor.clone(), ErrorSet::Default, RotorState::Locked, 1);
        let campaign = Campaign { scenario: &scenario, trials: 1000, threads: Some(1) };
        let mut failed = false;
        let rate = rate(|| {
            let mut simulated = 0.0;
            let done = campaign.run(&AtomicBool::new(false), |record| {
                simulated += record.run.duration.seconds();
                Ok::<(), CampaignError>(())
            });
            failed |= done.is_err();
            simulated
        });
        if failed {
            return Err(format!("{}: the campaign failed", method.name()).into());
        }
        tell(method.name(), rate, error_of_detections(scenario)?);
    }
    Ok(())
}
