//! The pictures of `docs/tutorial.md`, one for each idea.
//!
//! Run with `cargo run --release --example pictures`; writes `docs/pictures/pulse.svg`, `methods.svg` and `poles.svg`.

use std::error::Error;
use std::path::Path;

use standstill_detect::Method;
use standstill_interface::{Angle, Phase};
use standstill_report::figure::{Axis, Figure, Layer, Panel, Style};
use standstill_scenario::{Document, Plan, Record, Scenario, Specimen};
use standstill_sim::{Ended, Event, NoProbe, Probe, Trace, run};

fn scenario(text: &str) -> Result<Scenario<Method<f64>>, Box<dyn Error>> {
    Ok(Plan::new(Document::parse(Path::new("picture"), text)?)?.scenario(0)?)
}

/// One detection at an electrical angle in degrees, with a specimen of its own.
fn detection(
    scenario: &Scenario<Method<f64>>,
    degrees: f64,
    number: u64,
    probe: &mut impl Probe,
) -> Result<Record, Box<dyn Error>> {
    let case = scenario.case_at(degrees.to_radians(), Specimen { drive: number, noise: number });
    let run = run(&case, &mut scenario.detector_for(&case)?, false, probe);
    Ok(Record { trial: number, run })
}

fn line(label: &str, points: Vec<(f64, f64)>, style: Style) -> Layer {
    Layer::Line { label: Some(label.to_owned()), points, style }
}

/// The first pulses of a train: currents, and what the drive reads of them.
fn pulse() -> Result<Figure, Box<dyn Error>> {
    let scenario = scenario("detector.method = \"bipolar\"")?;
    let mut trace = Trace::new(2e-6);
    detection(&scenario, 43.0, 1, &mut trace)?;
    let moved = |currents: [f64; 3]| currents.iter().any(|current| current.abs() > 0.05);
    let from = trace.snapshots.iter().find(|s| moved(s.current)).map_or(0.0, |s| s.time) - 60e-6;
    let to = from + 1.1e-3;
    let micros = |time: f64| 1e6 * (time - from);
    let time = || Axis::new("time (µs)").range(0.0, 1100.0).step(100.0);
    let shown: Vec<_> = trace.snapshots.iter().filter(|s| s.time >= from && s.time <= to).collect();
    let mut currents = Panel { weight: 1.5, ..Panel::new(time(), Axis::new("current (A)")) };
    let mut potentials = Panel::new(time(), Axis::new("terminal potential (V)"));
    for (k, phase) in Phase::ALL.into_iter().enumerate() {
        let of = |value: fn(&standstill_sim::Snapshot) -> [f64; 3]| -> Vec<(f64, f64)> {
            shown.iter().map(|s| (micros(s.time), value(s)[k])).collect()
        };
        currents =
            currents.with(line(&format!("phase {}", phase.letter()), of(|s| s.current), Style::nth(k)));
        let label = format!("terminal {}", phase.letter());
        potentials = potentials.with(line(&label, of(|s| s.potential), Style::nth(k)));
    }
    let read = trace.events.iter().filter_map(|(time, event)| match event {
        Event::Sample(reading) if *time >= from && *time <= to => Some((micros(*time), reading.current.0[0])),
        _ => None,
    });
    currents = currents.with(Layer::Points {
        label: Some("reading of phase a".to_owned()),
        points: read.collect(),
        style: Style::Purple,
    });
    Ok(Figure {
        title: "A pulse each way on the line a-b".to_owned(),
        subtitle: Some(
            "paper-5k5 at 43°: the slope of the current has the inductance, and the inductance the angle"
                .to_owned(),
        ),
        width: 760,
        height: 460,
        panels: vec![currents, potentials],
    })
}

/// Rms error of the axis at each angle, over as many drives, for four methods.
fn methods() -> Result<Figure, Box<dyn Error>> {
    let mut panel = Panel::new(
        Axis::new("true rotor angle (° electrical)").range(0.0, 360.0).step(60.0),
        Axis::new("rms error of the axis (°)"),
    );
    let methods = ["line-inductance-fast", "hfi-rotating", "bipolar", "maximum-likelihood"];
    for (k, method) in methods.into_iter().enumerate() {
        let scenario = scenario(&format!("detector.method = \"{method}\""))?;
        let mut points = Vec::new();
        for step in 0..=36 {
            let angle = 10.0 * f64::from(step);
            let (mut squares, mut found) = (0.0, 0.0);
            for drive in 0..24 {
                let record = detection(&scenario, angle, drive, &mut NoProbe)?;
                if let Some(error) = record.axis_error_deg() {
                    squares += error * error;
                    found += 1.0;
                }
            }
            points.push((angle, (squares / f64::max(found, 1.0)).sqrt()));
        }
        panel = panel.with(line(method, points, Style::nth(k)));
    }
    Ok(Figure {
        title: "Error over the rotor's angle, four methods".to_owned(),
        subtitle: Some("paper-5k5, default errors, 24 drives at each angle".to_owned()),
        width: 760,
        height: 380,
        panels: vec![panel],
    })
}

/// The evidence for the true pole in standard deviations of its own noise.
fn poles() -> Result<Figure, Box<dyn Error>> {
    let mut panel = Panel::new(
        Axis::new("true rotor angle (° electrical)").range(0.0, 360.0).step(60.0),
        Axis::new("evidence for the true pole (deviations)"),
    );
    let mut needed = f64::NAN;
    for (k, noise) in ["20 mA", "60 mA"].into_iter().enumerate() {
        let scenario = scenario(&format!("detector.method = \"bipolar\"\nsensors.noise = \"{noise}\""))?;
        let mut points = Vec::new();
        for number in 0..360_u32 {
            let record = detection(&scenario, f64::from(number), number.into(), &mut NoProbe)?;
            let Ended::Outcome(outcome) = record.run.ended else { continue };
            let north = Angle::from_degrees(record.true_angle_deg());
            points.extend(outcome.evidence_for(north).map(|evidence| (f64::from(number), evidence)));
            needed = outcome.findings().pole_evidence.map_or(needed, |evidence| evidence.needed);
        }
        let label = Some(format!("noise {noise}"));
        panel = panel.with(Layer::Points { label, points, style: Style::nth(k) });
    }
    for (label, y) in [("right pole named above", needed), ("wrong pole named below", -needed)] {
        panel = panel.with(Layer::HorizontalRule { label: Some(label.to_owned()), y });
    }
    Ok(Figure {
        title: "How sure the poles are".to_owned(),
        subtitle: Some("paper-5k5, bipolar: between the two lines the answer is “undetermined”".to_owned()),
        width: 760,
        height: 380,
        panels: vec![panel],
    })
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = Path::new("docs/pictures");
    std::fs::create_dir_all(folder)?;
    for (name, figure) in [("pulse", pulse()?), ("methods", methods()?), ("poles", poles()?)] {
        std::fs::write(folder.join(format!("{name}.svg")), figure.svg()?)?;
        println!("{}", folder.join(format!("{name}.svg")).display());
    }
    Ok(())
}
