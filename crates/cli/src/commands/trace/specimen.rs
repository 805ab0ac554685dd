//! The trial that a trace shows, and the values that it drew.

use std::fmt::Write as _;

use serde_json::{Map, Value, json};
use standstill_scenario::{Plan, Single, written};
use standstill_sim::{Case, RotorState};

/// Returns a line that names the trial. For a scenario with sweep axes, the line also contains the sweep point and its values.
pub fn heading(plan: &Plan, single: &Single) -> String {
    let values: Vec<String> = plan.points()[single.point]
        .values
        .iter()
        .map(|(key, value)| format!("{key} = {}", written(value)))
        .collect();
    let point = if values.is_empty() {
        String::new()
    } else {
        format!(" at point {} (of 0 to {}): {}", single.point, plan.points().len() - 1, values.join(", "))
    };
    format!("trial {}{point}\n", single.trial)
}

/// Returns the index of a sweep point and the values of the sweep axes as JSON. The values are written as in the scenario.
pub fn point_json(plan: &Plan, point: usize) -> Value {
    let values = plan.points()[point].values.iter();
    let values: Map<String, Value> = values.map(|(key, value)| (key.clone(), json!(value))).collect();
    json!({ "number": point, "values": values })
}

/// Returns the random values of a trial as JSON. Angles are in degrees, all other values in SI units.
pub fn json(case: &Case<'_>, drawn: &[(String, toml::Value)]) -> Value {
    let Case { inverter, sensors, .. } = case;
    let tolerances: Map<String, Value> =
        drawn.iter().map(|(key, value)| (key.clone(), json!(value))).collect();
    let play = match case.rotor {
        RotorState::Braked(play) => Some([play.below, play.above].map(f64::to_degrees)),
        RotorState::Locked | RotorState::Free | RotorState::Driven => None,
    };
    // Errors of sensors that the drive does not have are left out.
    let (currents, terminals) = (sensors.settings.arrangement.sensors(), sensors.settings.terminal);
    let (comparators, timer) = (sensors.settings.comparator.count(), sensors.settings.comparator.timer > 0.0);
    json!({
        "start_angle_deg": case.start_angle.to_degrees().rem_euclid(360.0),
        "play_below_and_above_deg": play,
        "current_gain": sensors.gain[..currents],
        "current_offset_A": sensors.offset[..currents],
        "dc_link_gain": sensors.dc_link_gain,
        "dc_link_offset_V": sensors.dc_link_offset,
        "terminal_gain": terminals.map(|_| sensors.terminal_gain),
        "terminal_offset_V": terminals.map(|_| sensors.terminal_offset),
        "comparator_offset_A": sensors.comparator.offset[..comparators],
        "comparator_delay_s": sensors.comparator.delay[..comparators],
        "timer_tick_s": timer.then_some(sensors.comparator.tick),
        "timer_phase": timer.then_some(sensors.comparator.phase),
        "resolver_error_deg": sensors.resolver_error.to_degrees(),
        "turn_on_delay_s": inverter.gates.map(|gate| gate.turn_on_delay.seconds()),
        "turn_off_delay_s": inverter.gates.map(|gate| gate.turn_off_delay.seconds()),
        "ripple_phase_deg": inverter.link.ripple_phase.to_degrees(),
        "tolerances": tolerances,
    })
}

/// Returns the random values of a trial as text.
pub fn text(single: &Single) -> String {
    let lines = single.in_words();
    let width = lines.iter().map(|(name, _)| name.len()).max().unwrap_or_default();
    let mut text = "drawn for this trial:\n".to_owned();
    for (name, value) in lines {
        let _ = writeln!(text, "  {name:<width$}  {value}");
    }
    text
}
