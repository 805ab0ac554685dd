//! Does the numerical error of a whole run fall as the method promises?
//!
//! A light rotor is turned by saturated currents: five voltage vectors of 8 ms each, all legs driven. The same run is
//! repeated at tolerances from coarse to fine and compared with one that leaves no tolerance. The method is of order
//! four: ten times the work, ten thousand times less error.
//!
//! Run with `cargo run --release --example convergence`; writes `standstill-out/examples/convergence.svg` and `.png`.
#![allow(clippy::disallowed_methods, reason = "an example may differ in its last digits")]

use standstill_interface::{
    Abc, Command, Detector, Fault, Findings, Leg, Nanos, Outcome, Reading, Sampling, Stage, Step,
};
use standstill_inverter::{Bridge, DcLink, GateTiming, Inverter};
use standstill_plant::{Friction, Motor, built_in};
use standstill_report::figure::{Axis, Figure, Layer, Panel, Style};
use standstill_sim::{Case, Faults, NoProbe, RotorState, SensorSettings, Sensors, Streams, Tolerance, run};

/// A detector that gives one command after the other and keeps what it reads.
struct Script {
    commands: std::array::IntoIter<Command<f64>, 5>,
    readings: Vec<Reading<f64>>,
}

impl Detector<f64> for Script {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        self.readings.extend_from_slice(readings);
        match self.commands.next() {
            Some(command) => Step::Drive(command),
            None => Step::Done(Outcome::Failed {
                fault: Fault::UnexpectedReadings,
                findings: Findings::default(),
            }),
        }
    }
}

/// Right-hand sides evaluated, and the sampled currents in A.
fn attempt(motor: &Motor, tolerance: f64) -> (f64, Vec<f64>) {
    let vectors = [[1, 0, 0], [0, 1, 1], [0, 1, 0], [1, 0, 1], [0, 0, 0]];
    let commands = vectors.map(|legs| {
        let legs = Abc(legs.map(|leg| if leg == 1 { Leg::High } else { Leg::Low }));
        let duration = Nanos::from_micros(8000);
        Command::hold(Stage { legs, duration }, Sampling::once(duration))
    });
    let case = Case {
        motor,
        inverter: Inverter {
            bridge: Bridge::default(),
            gates: [GateTiming::default(); 3],
            link: DcLink::stiff(80.0),
            carrier_period: Nanos::from_micros(100),
        },
        sensors: Sensors::nominal(SensorSettings::IDEAL),
        start_angle: 50.0_f64.to_radians(),
        rotor: RotorState::Free,
        memory: None,
        load_torque: 0.0,
        start_speed: 0.0,
        acceleration: 0.0,
        faults: Faults::default(),
        streams: Streams::new(1, 0),
        tolerance: Tolerance { flux: tolerance },
        time_limit: Case::TIME_LIMIT,
    };
    let mut script = Script { commands: commands.into_iter(), readings: Vec::new() };
    let end = run(&case, &mut script, false, &mut NoProbe);
    (end.work.derivatives as f64, script.readings.iter().flat_map(|reading| reading.current.0).collect())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut motor = built_in("paper-5k5").ok_or("no such motor")?;
    motor.rotor.inertia = 5e-4;
    motor.rotor.friction = Friction::default();
    let (_, exact) = attempt(&motor, 1e-14);
    let mut points = Vec::new();
    println!("tolerance (Wb)       evaluations  largest error of a sampled current (A)");
    for exponent in 4..=11 {
        let tolerance = 10_f64.powi(-exponent);
        let (work, currents) = attempt(&motor, tolerance);
        let error = currents.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("{tolerance:14e}  {work:16}  {error:e}");
        points.push((work.log10(), error.log10()));
    }
    // The expected slope, through a point in the middle.
    let (x, y) = points[points.len() / 2];
    let slope = [points[0].0, points[points.len() - 1].0].map(|at| (at, y - 4.0 * (at - x)));
    let (noise, default) = (0.01_f64.log10(), points[5]);
    let line = |label: &str, points: Vec<(f64, f64)>, style| Layer::Line {
        label: Some(label.to_owned()),
        points,
        style,
    };
    let ends = [points[0].0, points[points.len() - 1].0];
    let panel = Panel::new(
        Axis::new("work: log₁₀ of the evaluations of the core"),
        Axis::new("log₁₀ of the largest current error in A"),
    )
    .with(line("tolerances of 10⁻⁴ to 10⁻¹¹ Wb", points.clone(), Style::Blue))
    .with(line("order 4", slope.to_vec(), Style::Black))
    .with(line(
        "noise of the default sensors, 10 mA",
        ends.map(|at| (at, noise)).to_vec(),
        Style::Vermilion,
    ));
    let figure = Figure {
        title: "Convergence of a run".to_owned(),
        subtitle: Some(format!(
            "saturated motor, rotor turning; at the default tolerance of 10⁻⁹ Wb the error is {:.1e} A",
            10_f64.powf(default.1)
        )),
        width: 900,
        height: 440,
        panels: vec![panel],
    };
    let folder = std::path::Path::new("standstill-out/examples");
    std::fs::create_dir_all(folder)?;
    std::fs::write(folder.join("convergence.svg"), figure.svg()?)?;
    std::fs::write(folder.join("convergence.png"), figure.png()?)?;
    println!("drawn in {}", folder.join("convergence.png").display());
    Ok(())
}
