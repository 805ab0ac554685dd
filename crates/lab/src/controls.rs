//! The controls of the page: every key of a scenario, with what the schema and its checks say of it.

use serde::Serialize;
use standstill_detect::{Kind, keys as methods};
use standstill_plant::Motor;
use standstill_scenario::{Document, FileError, KeyOf, Origin, Values, keys};

use crate::error::LabError;

/// A key as the page shows it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Control {
    pub key: String,
    about: String,
    kind: &'static str,
    unit: String,
    share: bool,
    /// What values may be, in words; none where any number may.
    range: Option<String>,
    choices: Vec<(String, String)>,
}

/// All of them but the motor's own, which differ from motor to motor.
pub(crate) fn controls(document: &Document) -> Result<Vec<Control>, LabError> {
    let motor = document.motor()?;
    Ok(keys().into_iter().map(|of| control(of, document, &motor)).collect())
}

fn control(of: KeyOf, document: &Document, motor: &Motor) -> Control {
    let KeyOf { key, about, values } = of;
    let range = range(&key, &values, document, motor);
    let (kind, unit, share, choices) = match values {
        Values::Number { unit, share } => ("number", unit, share, Vec::new()),
        Values::Choice(choices) => ("choice", String::new(), false, choices),
        Values::Flag => ("flag", String::new(), false, Vec::new()),
        Values::Whole => ("whole", String::new(), false, Vec::new()),
    };
    Control { key, about, kind, unit, share, range, choices }
}

/// What the check of a key says that it needs: told of a number that no key can have.
fn range(key: &str, values: &Values, document: &Document, motor: &Motor) -> Option<String> {
    let name = key.strip_prefix("detector.").unwrap_or_default();
    if let Some(key) = methods::ALL.into_iter().find(|key| key.name == name) {
        return match key.kind {
            Kind::Number { needed, .. } => Some(needed.to_owned()),
            Kind::Flag => None,
        };
    }
    if !matches!(values, Values::Number { .. }) {
        return None;
    }
    let mut document = document.clone();
    document.set(key, "-1e300", Origin::CommandLine).ok()?;
    match document.scenario_of(motor) {
        Err(FileError::Key { key: found, message, .. }) if found == key => {
            let needed = message.split_once("needed ")?.1;
            // What depends on another key is told when it is so.
            (!needed.contains('`')).then(|| needed.to_owned())
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn law_controls_have_units_ranges_and_names() {
        let document = Document::parse(Path::new("s.toml"), "").expect("TOML");
        let controls = controls(&document).expect("a motor");
        let of = |key: &str| controls.iter().find(|control| control.key == key).expect("a control");
        assert_eq!(of("sensors.noise").range.as_deref(), Some("zero or more"));
        assert_eq!(of("sensors.gain_error").range.as_deref(), Some("a share from 0 to 1"));
        assert!(
            of("inverter.ripple_frequency").range.as_deref().expect("a range").starts_with("from 0.1 Hz")
        );
        assert_eq!(of("detector.pulse").range.as_deref(), Some("from 1 µs to 10 ms"));
        assert_eq!(of("rotor.angle").range.as_deref(), Some("from -360 deg to 360 deg, electrical"));
        assert_eq!((of("sensors.noise").unit.as_str(), of("sensors.noise").kind), ("A", "number"));
        assert!(of("errors").choices.iter().any(|(name, _)| name == "field"));
        let stated = controls.iter().filter(|control| control.kind == "number" && control.range.is_some());
        assert!(stated.count() > 40, "{controls:#?}");
    }
}
