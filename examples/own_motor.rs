//! A motor of one's own: from a data sheet to the error of the paper's method on it.
//!
//! The question: a small motor with little saliency, |L_B|/L_A = 0.1. How much worse than the paper's motor (0.23)?
//! The small-error formula says that the sensors' part of the error grows as the saliency shrinks.
//!
//! Run with `cargo run --release --example own_motor`.

use standstill_campaign::{Campaign, CampaignError};
use standstill_detect::Decay;
use standstill_plant::{DataSheet, Motor, built_in};
use standstill_scenario::{ErrorSet, Scenario};
use standstill_sim::RotorState;

const SHEET: &str = r#"
name = "mine"
title = "A small pump motor"
notes = "Each number says where it comes from: given, inferred or assumed."

[rating]
current = { value = "8 A", source = "given", reason = "name plate" }

[winding]
pole_pairs = { value = 3, source = "given", reason = "name plate" }
resistance = { value = "900 mΩ", source = "given", reason = "measured with an ohmmeter, cold" }
mean_inductance = { value = "9 mH", source = "given", reason = "measured with an LCR meter at 1 kHz" }
saliency = { value = "-0.9 mH", source = "given", reason = "measured with an LCR meter at 1 kHz" }
leakage = { value = "500 uH", source = "assumed", reason = "a twentieth of the total" }
magnet_flux = { value = "0.3 Wb", source = "inferred", reason = "from the open-circuit voltage" }

# 1/L_d = 1/12.65 mH at the magnet flux: a_d0 + (S + 1) a_dd 0.3^S = 79.05 / H, of which 5 % saturate.
[saturation]
a_d0 = { value = 75.1, source = "assumed", reason = "L_d at rest" }
a_dd = { value = 271, source = "assumed", reason = "saturates by a few per cent at rated current" }
s = { value = 5, source = "assumed", reason = "usual" }
a_q0 = { value = 65.15, source = "inferred", reason = "1 / L_q = 1 / 15.35 mH" }
a_qq = { value = 0, source = "assumed", reason = "not measured" }
t = { value = 0, source = "assumed", reason = "no effect" }
a_dq = { value = 0, source = "assumed", reason = "not measured" }
u = { value = 0, source = "assumed", reason = "no effect" }
v = { value = 0, source = "assumed", reason = "no effect" }
i_f = { value = "22.73 A", source = "inferred", reason = "no current at the magnet flux" }

[rotor]
inertia = { value = "0.004 kg m²", source = "given", reason = "data sheet" }
stiction = { value = "0.1 N m", source = "assumed", reason = "bearings" }
coulomb = { value = "0.1 N m", source = "assumed", reason = "bearings" }
viscous = { value = "0 N m s", source = "assumed", reason = "slow" }
"#;

fn measure(name: &str, motor: Motor) -> Result<(), CampaignError> {
    let ratio = motor.winding.saliency.abs() / motor.winding.mean_inductance;
    let scenario = Scenario::paper(motor, ErrorSet::Default, Decay::Fast, RotorState::Free, 1);
    let s = Campaign { scenario: &scenario, trials: 2000, threads: None }.summary()?;
    println!(
        "{name:10} |L_B|/L_A = {ratio:.2}: rms {:.2}° [{:.2}, {:.2}], wrong poles {}, undetermined {} of {}",
        s.rms_deg.value, s.rms_deg.low, s.rms_deg.high, s.wrong_poles, s.undetermined, s.trials
    );
    Ok(())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    measure("paper-5k5", built_in("paper-5k5").ok_or("no such motor")?)?;
    measure("mine", DataSheet::parse("own_motor.rs", SHEET)?.motor()?)?;
    Ok(())
}
