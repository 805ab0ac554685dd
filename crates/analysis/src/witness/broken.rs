//! Closed forms of broken parts and of a rotor that turns.

use standstill_interface::{Abc, Command, Leg, Nanos, Phase, Sampling, Stage};
use standstill_inverter::OpenLeg;
use standstill_numeric::{cos, exp, exp_m1, sin};
use standstill_plant::{Core, Linear, MagneticCircuit, Motor, Winding};
use standstill_sim::{Broken, Case, Fault, Faults, RotorState, Short, Tolerance};

use super::forms::{LINK, case, line_motor};
use super::{Witness, WitnessError, motor};
use crate::bound::replay::replay;

/// Returns the current in A of phase a when the stage ends.
fn current_of_a(case: &Case<'_>, legs: [Leg<f64>; 3], micros: u64) -> Result<f64, WitnessError> {
    let end = Nanos::from_micros(micros);
    let stage = Stage { legs: Abc(legs), duration: end };
    Ok(replay(case, &[Command::hold(stage, Sampling::once(end))])?.value[0][0])
}

/// Returns the case with a fault that exists before the run.
fn with(case: Case<'_>, broken: Broken) -> Case<'_> {
    let mut faults = Faults::default();
    faults.push(Fault::lasting(broken));
    Case { faults, tolerance: Tolerance { flux: 1e-13 }, ..case }
}

/// Checks the current in A of a voltage vector along phase a whose wire to phase c is open. What is left is the line from a to b, and the
/// closed form is U/2R (1 − exp(−2R t/L)).
fn open_phase() -> Result<Witness, WitnessError> {
    let (motor, angle_deg) = (line_motor()?, 43.2_f64);
    let line = motor.winding.line_inductances(angle_deg.to_radians())[Phase::A];
    let known = -LINK / 2.0 * exp_m1(-2.0 * 80e-6 / line);
    let open = with(case(&motor, OpenLeg::Diodes, angle_deg), Broken::Wire(2));
    let here = current_of_a(&open, [Leg::High, Leg::Low, Leg::Low], 80)?;
    Ok(Witness::closed("current of a vector whose third wire is open", [known, here], 1e-9 * known, "A"))
}

/// Checks the current in A of a voltage step along phase a with a share k of the turns of this phase shorted. With the d-axis there, the
/// phase and the shorted turns are two coupled circuits, `V = R (i + ⅔ k j) + dψ/dt` with `ψ = L_d (i + ⅔ k j)` and
/// `0 = k R (i + j) + R_f j + d(k ψ + L_l j)/dt`. Their solution is a sum of two exponentials.
fn shorted_turns() -> Result<Witness, WitnessError> {
    let motor = motor("paper-5k5")?.linearised();
    let (r, l, time) = (motor.resistance, motor.winding.d_axis_inductance(), 400e-6);
    let (k, fault, coupling) = (0.3, 0.4, 0.7);
    let phase = motor.winding.mean_inductance;
    let leak = k * k * phase * (1.0 / (coupling * coupling) - 1.0);
    let voltage = LINK * 2.0 / 3.0;
    let (m, n) = (2.0 / 3.0 * k, k * r);
    // M x′ = v − N x of x = (i, j): the rates are the eigenvalues of M⁻¹ N.
    let ([a, b, c, d], [e, f, g, h]) = ([l, l * m, k * l, k * l * m + leak], [r, r * m, n, n + fault]);
    let (of_m, of_n) = (a * d - b * c, e * h - f * g);
    let trace = (d * e - b * g + a * h - c * f) / of_m;
    let root = (trace * trace / 4.0 - of_n / of_m).sqrt();
    let [fast, slow] = [trace / 2.0 + root, trace / 2.0 - root];
    // i = i∞ + p exp(−fast t) + q exp(−slow t), which is zero at first, with the slope of M⁻¹ v.
    let (end, slope) = (h / of_n * voltage, d / of_m * voltage);
    let p = (end * slow - slope) / (fast - slow);
    let known = end + p * exp(-fast * time) - (end + p) * exp(-slow * time);
    let short = Short { share: k, resistance: fault, coupling };
    let broken = with(case(&motor, OpenLeg::Diodes, 0.0), Broken::Shorted(0, short));
    let here = current_of_a(&broken, [Leg::High, Leg::Low, Leg::Low], 400)?;
    Ok(Witness::closed("current of a voltage step with shorted turns", [known, here], 1e-8 * known, "A"))
}

/// Checks the current in A that the magnet of a turning rotor drives through shorted terminals, in a motor without saliency. In the rotor's
/// frame it is −jωψ/(R + jωL) (1 − exp(−(R/L + jω) t)).
fn turning_rotor() -> Result<Witness, WitnessError> {
    let (speed, flux, inductance, angle, time) = (60.0, 0.45, 13.8e-3, 0.7, 2e-3);
    let winding = Winding { mean_inductance: inductance / 1.5, saliency: 0.0, leakage: 0.0 };
    let core = Core::Linear(Linear::from_winding(&winding, flux));
    let magnetics = MagneticCircuit::new(core).map_err(|error| WitnessError::Setting(error.to_string()))?;
    let motor = Motor { resistance: 1.0, winding, magnetics, magnet_flux: flux, ..motor("paper-5k5")? };
    let (r, x) = (motor.resistance, speed * inductance);
    let [steady_d, steady_q] = [-x, -r].map(|part| part * speed * flux / (r * r + x * x));
    let left = exp(-r / inductance * time);
    let [real, imaginary] = [1.0 - left * cos(speed * time), left * sin(speed * time)];
    let [d, q] = [steady_d * real - steady_q * imaginary, steady_d * imaginary + steady_q * real];
    let end = angle + speed * time;
    let known = d * cos(end) - q * sin(end);
    let still = case(&motor, OpenLeg::Diodes, 0.0);
    let turning = Case {
        start_angle: angle,
        rotor: RotorState::Driven,
        start_speed: speed,
        tolerance: Tolerance { flux: 1e-13 },
        ..still
    };
    let here = current_of_a(&turning, [Leg::Low; 3], 2000)?;
    let claim = "current that a turning rotor drives through shorted terminals";
    Ok(Witness::closed(claim, [known, here], 1e-8 * known.abs(), "A"))
}

pub(super) fn all() -> Result<Vec<Witness>, WitnessError> {
    Ok(vec![open_phase()?, shorted_turns()?, turning_rotor()?])
}
