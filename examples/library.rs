//! Standstill as a library: a motor by its nameplate, one detection, and the odds over a thousand of them.
//!
//! Run with `cargo run --release --example library`.

use standstill_campaign::Campaign;
use standstill_detect::MethodName;
use standstill_plant::DataSheet;
use standstill_scenario::{ErrorSet, Scenario};
use standstill_sim::RotorState;

const PUMP: &str = r#"
name = "pump"
[nameplate]
pole_pairs = 3
resistance = "0.9 Ω"
L_d = "9 mH"
L_q = "12 mH"
magnet_flux = "0.3 Wb"
rated_current = "8 A"
dc_link = "550 V"
saturation = "6 %"
"#;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let motor = DataSheet::parse("pump.toml", PUMP)?.motor()?;
    let scenario = Scenario::of_method(MethodName::Bipolar, motor, ErrorSet::Default, RotorState::Free, 1);

    let start = scenario.trial(0)?;
    println!(
        "rotor at {:.2}°: {:?}, error {:?}°",
        start.true_angle_deg(),
        start.verdict(),
        start.error_deg()
    );

    let starts = Campaign { scenario: &scenario, trials: 1000, threads: None }.summary()?;
    let rms = starts.rms_deg;
    println!(
        "rms {:.3}° [{:.3}, {:.3}], wrong poles {} of {}",
        rms.value, rms.low, rms.high, starts.wrong_poles, starts.trials
    );
    Ok(())
}
