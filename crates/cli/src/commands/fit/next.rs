//! Sentences of a fit on currents outside the measured range and on slow probes, and the next steps.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use standstill_analysis::fit::{Fit, MISFIT, Pulse};
use standstill_quantity::unit::{Ampere, Hertz, Second};
use standstill_quantity::{Quantity, number};

use crate::arguments::Fit as Options;
use crate::shell::terminal::paragraph;

/// Names of the rotor's axes.
const AXES: [&str; 3] = ["+d", "−d", "q"];

/// Rounds a value to `digits` significant digits.
fn rounded(value: f64, digits: i32) -> f64 {
    let scale = format!("{value:.0$e}", usize::try_from(digits - 1).unwrap_or(0));
    scale.parse().unwrap_or(value)
}

fn amperes(value: f64) -> String {
    Quantity::<Ampere>::si(rounded(value, 2)).to_string()
}

/// Returns the sentence on the currents up to which saturation is measured, and on the saturation stated beyond them.
pub(super) fn saturation(fit: &Fit) -> Option<String> {
    let beyond = fit.extrapolated();
    if beyond.is_empty() {
        return None;
    }
    let reached: Vec<String> =
        AXES.iter().zip(fit.reached).map(|(axis, i)| format!("{} along {axis}", amperes(i))).collect();
    let axes: Vec<&str> = beyond.iter().map(|k| AXES[*k]).collect();
    let mut text = format!(
        "The pulses reached {}; saturation is stated at {}. Along {} the data sheet's number is not measured there",
        reached.join(", "),
        amperes(fit.current),
        axes.join(" and ")
    );
    text += if fit.falls.is_some() { " but assumed, as it says." } else { " and left out." };
    Some(text)
}

/// Returns the sentence on slow probes.
pub(super) fn probe(fit: &Fit) -> Option<String> {
    let lag = fit.parameters.iter().find(|estimate| estimate.name == "probe_lag")?.value;
    Some(format!(
        "The currents lag as behind probes of {} bandwidth (first order, {}): the simulation has them so. A probe of ten times that bandwidth makes delay, dead time and drops exact.",
        Quantity::<Hertz>::si(rounded(1.0 / (TAU * lag), 2)),
        Quantity::<Second>::si(rounded(lag, 2))
    ))
}

fn pulse(fit: &Fit, axis: usize, Pulse { legs, duration, current }: Pulse) -> String {
    format!(
        "record a pulse with legs {}, {} long, which drives {} along {}{}",
        legs.join(","),
        Quantity::<Second>::si(rounded(duration, 2)),
        amperes(current),
        AXES[axis],
        if axis < 2 && !fit.pole.identified { ", or the other way" } else { "" }
    )
}

/// Returns the next steps: the last lines of the text.
pub(super) fn steps(fit: &Fit, options: &Options) -> String {
    let traces: Vec<String> = options.traces.iter().map(|path| path.display().to_string()).collect();
    let mut again = format!("standstill fit {}", traces.join(" "));
    if let Some(motor) = &options.motor {
        let _ = write!(again, " --motor {motor}");
    }
    let mut text = String::from("\nNext:\n");
    let mut add = |sentence: &str| text += &paragraph("  – ", sentence);
    if fit.widened >= MISFIT || !fit.converged {
        add(&format!(
            "Look at {} before anything else; then {again} with what is known of the drive: -s inverter.dead_time=…, -s inverter.diode_drop=…, -s inverter.devices=…",
            options.out.join("fit.png").display()
        ));
        return text;
    }
    let pulses: Vec<String> = fit
        .extrapolated()
        .into_iter()
        .filter_map(|axis| Some(pulse(fit, axis, fit.pulse_along(axis)?)))
        .collect();
    if !pulses.is_empty() {
        add(&format!("For saturation: {}; then {again} MORE.csv --out ANOTHER", pulses.join("; ")));
    }
    if !options.set.iter().any(|(key, _)| super::SWITCH_KEYS.contains(&key.as_str())) {
        let switch = fit.plant.devices.switch_resistance;
        add(&format!(
            "For the resistance: measure it between two terminals (half of that), or state the switches' from their data sheet (here {} mΩ, a guess): -s {}",
            number(2, 1e3 * switch),
            if fit.plant.devices.switch_drop > 0.0 { super::SWITCH_KEYS[0] } else { super::SWITCH_KEYS[1] }
        ));
    }
    let sheet = options.out.join("motor.toml");
    add(&format!(
        "Write magnet_flux, pole_pairs, rated_current and inertia of the motor into {0}, then: standstill check {0}",
        sheet.display()
    ));
    text
}
