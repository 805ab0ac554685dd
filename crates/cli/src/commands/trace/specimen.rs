//! Which trial a trace shows, and what was drawn for it.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use serde_json::{Map, Value, json};
use standstill_scenario::{Plan, Single};
use standstill_sim::{Case, RotorState};

use crate::units::listed;

/// The trial and the values of its point; nothing of a scenario without axes at its first trial.
pub fn heading(plan: &Plan, single: &Single) -> String {
    let values: Vec<String> = plan.points()[single.point]
        .values
        .iter()
        .map(|(key, value)| format!("{key} = {}", written(value)))
        .collect();
    let point = if values.is_empty() {
        String::new()
    } else {
        format!(" at point {} of {}: {}", single.point, plan.points().len(), values.join(", "))
    };
    format!("trial {}{point}\n", single.trial)
}

/// The number of a point and its values, as they are set.
pub fn point_json(plan: &Plan, point: usize) -> Value {
    let values = plan.points()[point].values.iter();
    let values: Map<String, Value> = values.map(|(key, value)| (key.clone(), json!(value))).collect();
    json!({ "number": point, "values": values })
}

/// What was drawn, in SI; angles in degrees.
pub fn json(case: &Case<'_>, drawn: &[(String, toml::Value)]) -> Value {
    let Case { inverter, sensors, .. } = case;
    let tolerances: Map<String, Value> =
        drawn.iter().map(|(key, value)| (key.clone(), json!(value))).collect();
    let play = match case.rotor {
        RotorState::Braked(play) => Some([play.below, play.above].map(f64::to_degrees)),
        RotorState::Locked | RotorState::Free => None,
    };
    json!({
        "start_angle_deg": case.start_angle.to_degrees().rem_euclid(360.0),
        "play_below_and_above_deg": play,
        "current_gain": sensors.gain,
        "current_offset_A": sensors.offset,
        "dc_link_gain": sensors.dc_link_gain,
        "dc_link_offset_V": sensors.dc_link_offset,
        "resolver_error_deg": sensors.resolver_error.to_degrees(),
        "turn_on_delay_s": inverter.gates.map(|gate| gate.turn_on_delay.seconds()),
        "turn_off_delay_s": inverter.gates.map(|gate| gate.turn_off_delay.seconds()),
        "ripple_phase_deg": inverter.link.ripple_phase.to_degrees(),
        "tolerances": tolerances,
    })
}

/// The same in words. Of what no trial draws, because its spread is zero, nothing is said.
pub fn text(case: &Case<'_>, drawn: &[(String, toml::Value)]) -> String {
    let Case { inverter, sensors, .. } = case;
    let settings = &sensors.settings;
    let three = |values: [f64; 3], unit: &str| format!("{} (phases a, b, c)", listed(&values, unit));
    let share = |gain: f64| format!("{:+.3} %", 100.0 * (gain - 1.0));
    let mut lines = vec![("rotor starts at", degrees(case.start_angle.rem_euclid(TAU)))];
    if let RotorState::Braked(play) = case.rotor {
        let (below, above) = (degrees(play.below), degrees(play.above));
        lines.push(("brake lets it turn", format!("{below} back and {above} forward")));
    }
    if settings.gain_error > 0.0 {
        let gains = sensors.gain.map(share).join(", ");
        lines.push(("current gains", format!("{gains} (phases a, b, c)")));
    }
    if settings.offset > 0.0 {
        lines.push(("current offsets", three(sensors.offset, "A")));
    }
    if settings.dc_link.gain_error > 0.0 {
        lines.push(("DC-link gain", share(sensors.dc_link_gain)));
    }
    if settings.dc_link.offset > 0.0 {
        lines.push(("DC-link offset", listed(&[sensors.dc_link_offset], "V")));
    }
    if inverter.gates.iter().any(|gate| gate.turn_on_delay.0 + gate.turn_off_delay.0 > 0) {
        lines.push(("switch-on delays", three(inverter.gates.map(|gate| gate.turn_on_delay.seconds()), "s")));
        lines.push((
            "switch-off delays",
            three(inverter.gates.map(|gate| gate.turn_off_delay.seconds()), "s"),
        ));
    }
    if inverter.link.ripple > 0.0 {
        lines.push(("ripple begins at", degrees(inverter.link.ripple_phase)));
    }
    if settings.resolver.error > 0.0 {
        lines.push((
            "resolver reads",
            format!("{:+.3}° beside the angle", sensors.resolver_error.to_degrees()),
        ));
    }
    let tolerances: Vec<(&str, String)> =
        drawn.iter().map(|(key, value)| (key.as_str(), written(value))).collect();
    lines.extend(tolerances);
    let width = lines.iter().map(|(name, _)| name.len()).max().unwrap_or_default();
    let mut text = "drawn for this trial:\n".to_owned();
    for (name, value) in lines {
        let _ = writeln!(text, "  {name:<width$}  {value}");
    }
    text
}

fn degrees(angle: f64) -> String {
    format!("{:.3}°", angle.to_degrees())
}

/// A value as a scenario has it, a text without its quotes.
fn written(value: &toml::Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}
