//! Error over angle as a picture: what the open leg's diode costs when the current decays slowly.
//!
//! With ideal switches and exact sensors, the paper's method has hardly any error on a core that does not saturate,
//! as long as the third leg is truly open. Its diodes change that: when two legs are low, saliency lifts the third
//! terminal below the negative rail, and its lower diode conducts.
//!
//! Run with `cargo run --release --example error_picture`; writes `standstill-out/examples/open_leg.svg` and `.png`.

use standstill_detect::{Decay, LineInductance};
use standstill_inverter::{DeviceKind, OpenLeg};
use standstill_plant::built_in;
use standstill_report::figure::{Axis, Figure, Layer, Panel, Style};
use standstill_scenario::{ErrorSet, Record, Scenario, Specimen};
use standstill_sim::{NoProbe, RotorState, run};

fn curve(label: &str, scenario: &Scenario, style: Style) -> Result<Layer, Box<dyn std::error::Error>> {
    let mut points = Vec::new();
    for degree in 0..=360 {
        let angle = f64::from(degree);
        let case = scenario.case_at(angle.to_radians(), Specimen { drive: 0, noise: 0 });
        let run = run(&case, &mut LineInductance::new(scenario.detector)?, false, &mut NoProbe);
        points.push((angle, Record { trial: 0, run }.axis_error_deg().unwrap_or(f64::NAN)));
    }
    let worst = points.iter().map(|(_, error)| error.abs()).fold(0.0, f64::max);
    println!("{label}: at most {worst:.3}°");
    Ok(Layer::Line { label: Some(label.to_owned()), points, style })
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let motor = built_in("paper-5k5").ok_or("no such motor")?.linearised();
    let mut panel = Panel::new(
        Axis::new("true rotor angle θ (° electrical)").range(0.0, 360.0).step(60.0),
        Axis::new("error of the axis (°)"),
    );
    let mut scenario = Scenario::paper(motor, ErrorSet::None, Decay::Slow, RotorState::Locked, 1);
    // A core that does not saturate has no polarity; only the axis is asked for.
    scenario.detector.polarity.least_margin = 0.0;
    panel = panel.with(curve("third leg truly open", &scenario, Style::Black)?);

    scenario.drive.bridge.open_leg = OpenLeg::Diodes;
    scenario.drive.bridge.devices = ErrorSet::Default.drive(&scenario.motor, DeviceKind::Igbt).bridge.devices;
    panel = panel.with(curve("third leg with diodes, usual drops", &scenario, Style::Blue)?);

    scenario.drive.bridge.devices.diode_drop *= 0.5;
    scenario.drive.bridge.devices.switch_drop *= 0.5;
    panel = panel.with(curve("third leg with diodes, half the drops", &scenario, Style::Vermilion)?);

    let figure = Figure {
        title: "What the open leg's diode costs".to_owned(),
        subtitle: Some("line inductances with slow decay, ideal sensors, no saturation".to_owned()),
        width: 900,
        height: 440,
        panels: vec![panel],
    };
    let folder = std::path::Path::new("standstill-out/examples");
    std::fs::create_dir_all(folder)?;
    std::fs::write(folder.join("open_leg.svg"), figure.svg()?)?;
    std::fs::write(folder.join("open_leg.png"), figure.png()?)?;
    println!("drawn in {}", folder.join("open_leg.png").display());
    Ok(())
}
