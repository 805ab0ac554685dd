//! The controls of the page: every key of a scenario, with the data of its schema and of its checks.

use serde::Serialize;
use standstill_scenario::{Key, Values, keys};

/// A key as the page shows it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Control {
    pub key: &'static str,
    about: &'static str,
    kind: &'static str,
    unit: &'static str,
    share: bool,
    /// The numbers that it may have, in words.
    range: Option<&'static str>,
    choices: Vec<(&'static str, &'static str)>,
}

/// Returns all of them but the motor's own, which differ from motor to motor, and texts.
pub(crate) fn controls() -> Vec<Control> {
    keys().filter_map(control).collect()
}

fn control(key: &Key) -> Option<Control> {
    let (kind, unit, share, choices) = match key.values() {
        Values::Number { unit, share } => ("number", unit, share, Vec::new()),
        Values::Choice(choices) => ("choice", "", false, choices),
        // The page switches all checks on or off; a list is for files.
        Values::Flag | Values::List(_) => ("flag", "", false, Vec::new()),
        Values::Whole => ("whole", "", false, Vec::new()),
        Values::Text => return None,
    };
    Some(Control { key: key.path, about: key.about, kind, unit, share, range: key.allowed(), choices })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_controls_have_units_ranges_and_names() {
        let controls = controls();
        let of = |key: &str| controls.iter().find(|control| control.key == key).expect("a control");
        assert_eq!(of("sensors.noise").range, Some("zero or more"));
        assert_eq!(of("sensors.gain_error").range, Some("a share from 0 to 1"));
        assert!(of("inverter.ripple_frequency").range.expect("a range").starts_with("from 0.1 Hz"));
        assert_eq!(of("detector.pulse").range, Some("from 1 µs to 10 ms"));
        assert_eq!(of("rotor.angle").range, Some("from -360 deg to 360 deg, electrical"));
        assert_eq!((of("sensors.noise").unit, of("sensors.noise").kind), ("A", "number"));
        assert!(of("errors").choices.iter().any(|(name, _)| *name == "field"));
        let stated = controls.iter().filter(|control| control.kind == "number" && control.range.is_some());
        assert!(stated.count() > 40, "{controls:#?}");
    }
}
