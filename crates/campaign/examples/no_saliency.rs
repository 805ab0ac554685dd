//! How often each method names an axis where there is none: linear cores with L_B = 0 and the other data of five built-in motors.
//!
//! ```sh
//! cargo run --release -p standstill-campaign --features measure --example no_saliency -- 1000
//! ```
//!
//! Each cell has the starts that named an axis, with default and with harsh errors, and the upper end of the exact 95 % interval of
//! their share over both.

use std::error::Error;

use standstill_campaign::{Campaign, binomial_interval};
use standstill_detect::MethodName;
use standstill_plant::{Motor, built_in};
use standstill_scenario::{ErrorSet, Scenario};
use standstill_sim::RotorState;

const MOTORS: [&str; 5] = ["paper-5k5", "surface-magnet", "light-vehicle", "outrunner", "gimbal"];

/// The built-in motor as a linear core with the same inductance all around.
fn round(name: &str) -> Result<Motor, String> {
    let mut motor = built_in(name).ok_or_else(|| format!("{name} is not built in"))?;
    motor.winding.saliency = 0.0;
    Ok(motor.linearised())
}

/// The starts that named an axis, with a pole or without.
fn named(motor: &Motor, method: MethodName, errors: ErrorSet, trials: u64) -> Result<u64, Box<dyn Error>> {
    let scenario = Scenario::of_method(method, motor.clone(), errors, RotorState::Locked, 1);
    let summary = Campaign { scenario: &scenario, trials, threads: None }.summary()?;
    Ok(summary.found + summary.undetermined)
}

fn main() -> Result<(), Box<dyn Error>> {
    let trials = std::env::args().nth(1).map_or(Ok(1000), |count| count.parse())?;
    println!("| method | {} |", MOTORS.map(|name| format!("as {name}")).join(" | "));
    println!("|---{}|", "|---".repeat(MOTORS.len()));
    // One turns the rotor, and says so on a locked one.
    for method in MethodName::ALL.into_iter().filter(|method| *method != MethodName::DcAlignment) {
        print!("| {method} |");
        for name in MOTORS {
            let motor = round(name)?;
            let default = named(&motor, method, ErrorSet::Default, trials)?;
            let harsh = named(&motor, method, ErrorSet::Harsh, trials)?;
            let most = 100.0 * binomial_interval(default + harsh, 2 * trials).high;
            print!(" {default}, {harsh}: ≤ {most:.2} % |");
        }
        println!();
    }
    Ok(())
}
