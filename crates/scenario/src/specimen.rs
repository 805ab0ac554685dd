//! Describes the draws of a trial in words.

use std::f64::consts::TAU;

use standstill_quantity::{listed, si_value};
use standstill_sim::{Case, RotorState};
use toml::Value;

use crate::units::unit;

/// Returns the draws of a case and of its tolerances: names and values. Draws whose spread is zero are left out.
///
/// ```
/// use standstill_scenario::{Document, Plan, specimen};
///
/// let plan = Plan::new(Document::parse("s.toml".as_ref(), "errors = \"noise\"")?)?;
/// let single = plan.single(0, 7)?;
/// // Noise differs from sample to sample; the sensors themselves are exact here.
/// let words = specimen(&single.case(), &single.drawn);
/// assert_eq!(words.len(), 1);
/// assert_eq!(words[0].0, "rotor starts at");
/// # Ok::<(), standstill_scenario::FileError>(())
/// ```
pub fn specimen(case: &Case<'_>, drawn: &[(String, Value)]) -> Vec<(String, String)> {
    let Case { inverter, sensors, .. } = case;
    let settings = &sensors.settings;
    let three = |values: [f64; 3], unit: &str| format!("{} (phases a, b, c)", listed(&values, unit));
    let share = |gain: f64| format!("{:+.3} %", 100.0 * (gain - 1.0));
    let mut lines = vec![("rotor starts at", degrees(case.start_angle.rem_euclid(TAU)))];
    if let (Some(last), true) = (case.memory, case.motor.magnetics.hysteresis().is_some()) {
        lines.push(("iron last magnetised along", degrees(last.rem_euclid(TAU))));
    }
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
    lines.extend(case.faults.iter().map(|fault| ("fault", fault.to_string())));
    let lines = lines.into_iter().map(|(name, value)| (name.to_owned(), value));
    lines.chain(drawn.iter().map(|(key, value)| (key.clone(), readable(key, value)))).collect()
}

/// Returns a drawn value in digits that a person reads: the document has all of them.
fn readable(key: &str, value: &Value) -> String {
    let number = value.as_str().and_then(si_value);
    match (number, unit(key)) {
        (Some(number), Some(unit)) if !unit.is_empty() => listed(&[number], &unit),
        _ => written(value),
    }
}

/// Returns a value as text, a string without its quotes.
pub fn written(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

fn degrees(angle: f64) -> String {
    format!("{:.3}°", angle.to_degrees())
}
