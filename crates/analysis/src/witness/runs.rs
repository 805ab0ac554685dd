//! Checks of whole detections: conservation of energy, an independent integrator, a symmetry.

use standstill_detect::{Decay, LineInductance, MethodName};
use standstill_inverter::{OpenLeg, Storage};
use standstill_scenario::{ErrorSet, Record, Scenario, Specimen};
use standstill_sim::{Ledger, NoProbe, RotorState, Tolerance, run};

use super::{Witness, WitnessError, motor};
use crate::bound::replay::{record, replay, replay_refereed};

fn setting<E: std::fmt::Display>(error: &E) -> WitnessError {
    WitnessError::Setting(error.to_string())
}

/// Returns the energies of a whole detection by the paper's method, with a free rotor and a DC link whose voltage sags.
fn ledger(decay: Decay, name: &str) -> Result<Ledger, WitnessError> {
    let mut scenario = Scenario::paper(motor(name)?, ErrorSet::Default, decay, RotorState::Free, 1);
    scenario.drive.link.storage = Some(Storage { capacitance: 500e-6, source_resistance: 0.2 });
    let mut case = scenario.case(3);
    case.tolerance = Tolerance { flux: 1e-12 };
    let mut detector = LineInductance::new(scenario.detector).map_err(|error| setting(&error))?;
    run(&case, &mut detector, true, &mut NoProbe).ledger.ok_or_else(|| setting(&"a run without a ledger"))
}

/// Checks that energy is conserved. The source's energy must equal the energy that is lost, stored or turned into motion. The figure is the
/// imbalance, divided by the energy that is lost or turned into motion.
fn energy(decay: Decay, name: &str) -> Result<Witness, WitnessError> {
    let ledger = ledger(decay, name)?;
    let scale = ledger.copper_loss + ledger.device_loss + ledger.shaft_work.abs();
    let claim = format!("imbalance of the energies of a whole detection, {name}, {} decay", decay.name());
    Ok(Witness::number(claim, "conservation", [0.0, ledger.imbalance() / scale], 1e-6, ""))
}

/// Checks the simulation against an independent integrator. Both run the commands of a detection, the integrator with a tighter tolerance.
/// The figure is the largest difference of the currents in A.
fn agreement(method: MethodName) -> Result<Witness, WitnessError> {
    let scenario = Scenario::of_method(method, motor("paper-5k5")?, ErrorSet::Default, RotorState::Free, 1);
    let mut case = scenario.case(5);
    case.sensors.settings.adc = None;
    case.sensors.settings.dc_link.adc = None;
    let commands = record(&case, scenario.detector_for(&case).map_err(|error| setting(&error))?)?;
    let mut tight = case.clone();
    tight.tolerance = Tolerance { flux: 1e-13 };
    let (here, known) = (replay(&case, &commands)?, replay_refereed(&tight, &commands)?);
    let apart = here.value.iter().zip(&known.value).flat_map(|(a, b)| (0..3).map(|k| (a[k] - b[k]).abs()));
    let apart = if here.value.len() == known.value.len() && !here.value.is_empty() {
        apart.fold(0.0, f64::max)
    } else {
        f64::NAN
    };
    let limit = 1.25e-7 * scenario.motor.rated_current;
    let claim = format!("largest difference of the currents of a detection by {method} from the referee's");
    Ok(Witness::number(claim, "another integrator", [0.0, apart], limit, "A"))
}

/// Checks the paper's method on a motor without saturation and with an ideally open leg. The figure is the largest axis error in degrees.
fn paper(decay: Decay) -> Result<Witness, WitnessError> {
    let linear = motor("paper-5k5")?.linearised();
    let mut scenario = Scenario::paper(linear, ErrorSet::None, decay, RotorState::Locked, 1);
    scenario.drive.bridge.open_leg = OpenLeg::Open;
    let mut worst = 0.0_f64;
    for step in 0..12 {
        let angle = f64::from(step) * 0.55;
        let case = scenario.case_at(angle, Specimen { drive: 0, noise: 0 });
        let mut detector = LineInductance::new(scenario.detector).map_err(|error| setting(&error))?;
        let run = run(&case, &mut detector, false, &mut NoProbe);
        let error = Record { trial: 0, run }.axis_error_deg().unwrap_or(f64::NAN).abs();
        worst = if error.is_nan() { error } else { worst.max(error) };
    }
    let claim =
        format!("largest error of the paper's method where its equations are exact, {} decay", decay.name());
    Ok(Witness::number(claim, "equations (5) to (7)", [0.0, worst], 0.01, "°"))
}

pub(super) fn all() -> Result<Vec<Witness>, WitnessError> {
    Ok(vec![
        energy(Decay::Fast, "paper-5k5")?,
        energy(Decay::Slow, "gearless-hoist")?,
        agreement(MethodName::Bipolar)?,
        agreement(MethodName::LineInductanceFast)?,
        paper(Decay::Fast)?,
        paper(Decay::Slow)?,
    ])
}
