//! Describes the draws of a trial in words.

use std::f64::consts::TAU;

use standstill_quantity::{listed, si_value};
use standstill_sim::{Case, RotorState, Sensors};
use toml::Value;

use crate::units::unit;

/// Returns the names and the values of all draws of a case and of its tolerances. Draws with a standard deviation of zero are left out.
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
    let mut lines = vec![("rotor starts at", degrees(case.start_angle.rem_euclid(TAU)))];
    if let (Some(last), true) = (case.memory, case.motor.magnetics.hysteresis().is_some()) {
        lines.push(("iron last magnetised along", degrees(last.rem_euclid(TAU))));
    }
    if let RotorState::Braked(play) = case.rotor {
        let (below, above) = (degrees(play.below), degrees(play.above));
        lines.push(("brake lets it turn", format!("{below} back and {above} forward")));
    }
    lines.extend(of_currents(sensors));
    if settings.dc_link.gain_error > 0.0 {
        lines.push(("DC-link gain", share(sensors.dc_link_gain)));
    }
    if settings.dc_link.offset > 0.0 {
        lines.push(("DC-link offset", listed(&[sensors.dc_link_offset], "V")));
    }
    lines.extend(of_terminals(sensors));
    lines.extend(of_comparators(sensors));
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

/// Returns the draws of the current sensors, for as many sensors as the drive has.
fn of_currents(sensors: &Sensors) -> Vec<(&'static str, String)> {
    let settings = &sensors.settings;
    let count = settings.arrangement.sensors();
    let of = match count {
        0 => return Vec::new(),
        1 => "the shunt in the DC link",
        2 => "phases a, b",
        _ => "phases a, b, c",
    };
    let mut lines = Vec::new();
    if settings.gain_error > 0.0 {
        let gains: Vec<_> = sensors.gain[..count].iter().copied().map(share).collect();
        lines.push(("current gains", format!("{} ({of})", gains.join(", "))));
    }
    if settings.offset > 0.0 {
        lines.push(("current offsets", format!("{} ({of})", listed(&sensors.offset[..count], "A"))));
    }
    lines
}

/// Returns the draws of the dividers at the terminals.
fn of_terminals(sensors: &Sensors) -> Vec<(&'static str, String)> {
    let Some(of) = &sensors.settings.terminal else { return Vec::new() };
    let mut lines = Vec::new();
    if of.gain_error > 0.0 {
        let gains = sensors.terminal_gain.map(share).join(", ");
        lines.push(("divider gains", format!("{gains} (phases a, b, c)")));
    }
    if of.offset > 0.0 {
        lines.push(("divider offsets", three(sensors.terminal_offset, "V")));
    }
    lines
}

/// Returns the draws of comparators and timer.
fn of_comparators(sensors: &Sensors) -> Vec<(&'static str, String)> {
    let (of, drawn) = (&sensors.settings.comparator, &sensors.comparator);
    let each = |values: &[f64], unit: &str| match of.count() {
        1 => listed(&values[..1], unit),
        count => format!("{} (into phases a, b, c, out of a, b, c)", listed(&values[..count], unit)),
    };
    let mut lines = Vec::new();
    if of.count() == 0 {
        return lines;
    }
    if of.offset > 0.0 {
        lines.push(("comparator offsets", each(&drawn.offset, "A")));
    }
    if of.delay_spread > 0.0 {
        lines.push(("comparator delays", each(&drawn.delay, "s")));
    }
    if of.timer > 0.0 {
        if of.timer_error > 0.0 {
            lines.push((
                "timer's tick",
                format!("{} of {}", share(drawn.tick / of.timer), listed(&[of.timer], "s")),
            ));
        }
        lines.push(("timer stands at", format!("{:+.3} of a tick when a pulse begins", drawn.phase)));
    }
    lines
}

/// Formats the values of three phases.
fn three(values: [f64; 3], unit: &str) -> String {
    format!("{} (phases a, b, c)", listed(&values, unit))
}

/// Formats the relative error of a gain in per cent.
fn share(gain: f64) -> String {
    format!("{:+.3} %", 100.0 * (gain - 1.0))
}

/// Formats a drawn value with few digits, so that it is easy to read. The document contains all digits.
fn readable(key: &str, value: &Value) -> String {
    let number = value.as_str().and_then(si_value);
    match (number, unit(key)) {
        (Some(number), Some(unit)) if !unit.is_empty() => listed(&[number], &unit),
        _ => written(value),
    }
}

/// Returns a value as text. Strings have no quotes.
pub fn written(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

fn degrees(angle: f64) -> String {
    format!("{:.3}°", angle.to_degrees())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::plan;

    /// The names and values of the draws of a trial of this file.
    fn words(text: &str) -> Vec<(String, String)> {
        let single = plan(text).single(0, 7).expect("valid");
        specimen(&single.case(), &single.drawn)
    }

    /// A wrong data sheet is no part of the case that is simulated.
    #[test]
    fn law_each_failure_mode_of_a_trial_is_named() {
        let of = |text: &str| plan(text).single(0, 7).expect("valid").in_words();
        let mode = |name: &str| ("failure mode".to_owned(), name.to_owned());
        assert!(of("[[faults]]\nmode = \"sheet-signature\"").contains(&mode("sheet-signature")));
        let weak = "[[faults]]\nmode = \"magnet-weak\"\nmagnitude = \"20 %\"";
        assert!(of(weak).contains(&mode("magnet-weak, magnitude 0.2")));
        assert!(!of("").iter().any(|(name, _)| name == "failure mode"));
    }

    #[test]
    fn law_what_a_drive_has_is_drawn_for_it_and_nothing_else() {
        let named = |text: &str, name: &str| {
            words(text).into_iter().find(|(of, _)| of == name).map(|(_, value)| value)
        };
        let gains = |arrangement: &str| {
            let text = format!(
                "sensors.arrangement = \"{arrangement}\"\nsensors.terminals = true\ndetector.method = \"open-terminal\""
            );
            (named(&text, "current gains"), named(&text, "current offsets"))
        };
        assert_eq!(gains("none"), (None, None));
        for (arrangement, count) in [("dc-link-shunt", 1), ("two-in-line", 2), ("three-in-line", 3)] {
            let (gains, offsets) = gains(arrangement);
            let [gains, offsets] = [gains, offsets].map(|of| of.expect("drawn"));
            assert_eq!(
                (gains.matches('%').count(), offsets.matches('A').count()),
                (count, 1),
                "{gains} {offsets}"
            );
        }
        let dividers = "sensors.terminals = true\nsensors.terminal_offset = 0.3";
        assert!(named(dividers, "divider gains").is_some_and(|gains| gains.matches('%').count() == 3));
        assert!(named(dividers, "divider offsets").is_some() && named("", "divider gains").is_none());
    }

    #[test]
    fn law_draws_of_comparators_and_timer_are_those_of_the_case() {
        let own = "sensors.timer = 1e-6\nsensors.timer_error = 0.003\nsensors.comparators = \"per-leg\"\nsensors.comparator_offset = 0.04\nsensors.comparator_delay_spread = 2e-8";
        let of = |text: &str| {
            let lines = words(text);
            ["comparator offsets", "comparator delays", "timer's tick", "timer stands at"].map(|name| {
                lines.iter().find(|(of, _)| of == name).map(|(_, value)| value.clone()).unwrap_or_default()
            })
        };
        let single = plan(own).single(0, 7).expect("valid");
        let drawn = single.case().sensors.comparator;
        let [offsets, delays, tick, phase] = of(own);
        assert_eq!(offsets, format!("{} (into phases a, b, c, out of a, b, c)", listed(&drawn.offset, "A")));
        assert_eq!(offsets.split(',').count(), 11);
        assert!(delays.starts_with(&listed(&drawn.delay, "s")), "{delays}");
        assert!(tick.starts_with(&share(drawn.tick / 1e-6)) && tick != share(1.0), "{tick}");
        assert_eq!(phase, format!("{:+.3} of a tick when a pulse begins", drawn.phase));
        let common = own.replace("per-leg", "common");
        assert_eq!(of(&common)[0], listed(&drawn.offset[..1], "A"));
        assert_eq!(of("").concat(), "");
    }
}
