//! Units of keys, found in the JSON schema.

use serde_json::Value;

use super::tables::ScenarioFile;

/// Returns the JSON Schema of scenario files.
///
/// Quantities have their SI unit as `x-unit`; `x-share` marks shares among dimensionless numbers.
pub fn schema() -> Value {
    let mut schema = schemars::schema_for!(ScenarioFile).to_value();
    schema["title"] = "Standstill scenario".into();
    schema
}

/// Returns the SI unit of a key such as `sensors.noise` or `motor.winding.resistance`; empty for shares and dimensionless
/// numbers, none if the key's values have no unit.
pub fn unit(key: &str) -> Option<String> {
    let schema = schema();
    let place = key.split('.').try_fold(&schema, |place, part| property(place, part, &schema))?;
    find(place, "x-unit", &schema).and_then(|unit| unit.as_str().map(str::to_owned))
}

/// Returns true if a key's values are shares, which people read in per cent.
pub fn is_share(key: &str) -> bool {
    let schema = schema();
    let place = key.split('.').try_fold(&schema, |place, part| property(place, part, &schema));
    place.and_then(|place| find(place, "x-share", &schema)).and_then(Value::as_bool).unwrap_or(false)
}

/// Returns true if a key's values are numbers; none if there is no such key.
pub fn has_numbers(key: &str) -> Option<bool> {
    let schema = schema();
    let place = key.split('.').try_fold(&schema, |place, part| property(place, part, &schema))?;
    let whole = || {
        find(place, "type", &schema).is_some_and(|kind| match kind {
            Value::Array(kinds) => kinds.iter().any(|kind| kind == "integer"),
            kind => kind == "integer",
        })
    };
    Some(find(place, "x-unit", &schema).is_some() || whole())
}

/// Returns the paths of all keys with this name in a scenario, such as `sensors.noise` for `noise`.
pub(super) fn places(name: &str) -> Vec<String> {
    let schema = schema();
    let tables = schema["properties"].as_object().into_iter().flatten();
    // A motor's keys are many, and alike those of the scenario.
    let tables = tables.map(|(table, _)| table.as_str()).filter(|table| *table != "motor");
    let own = schema["properties"].get(name).map(|_| name.to_owned());
    own.into_iter()
        .chain(tables.map(|table| format!("{table}.{name}")).filter(|key| has(key, &schema)))
        .collect()
}

fn has(key: &str, schema: &Value) -> bool {
    key.split('.').try_fold(schema, |place, part| property(place, part, schema)).is_some()
}

/// Returns the schema of a property, searched in all alternatives of `place`.
fn property<'a>(place: &'a Value, name: &str, root: &'a Value) -> Option<&'a Value> {
    let place = resolved(place, root);
    place.get("properties").and_then(|properties| properties.get(name)).or_else(|| {
        ["anyOf", "oneOf", "allOf"]
            .iter()
            .filter_map(|alternatives| place.get(alternatives)?.as_array())
            .flatten()
            .find_map(|alternative| property(alternative, name, root))
    })
}

/// Returns an entry of a schema, searched in all its alternatives. For a number with a source, takes the entry of its
/// value.
fn find<'a>(place: &'a Value, word: &str, root: &'a Value) -> Option<&'a Value> {
    let place = resolved(place, root);
    place.get(word).or_else(|| {
        let value = place.get("properties").and_then(|properties| properties.get("value"));
        let alternatives = ["anyOf", "oneOf", "allOf"].iter().filter_map(|name| place.get(name)?.as_array());
        value.into_iter().chain(alternatives.flatten()).find_map(|alternative| find(alternative, word, root))
    })
}

fn resolved<'a>(place: &'a Value, root: &'a Value) -> &'a Value {
    let reference =
        place.get("$ref").and_then(Value::as_str).and_then(|reference| reference.strip_prefix('#'));
    reference.and_then(|pointer| root.pointer(pointer)).unwrap_or(place)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_places_of_keys() {
        assert_eq!(places("noise"), ["sensors.noise"]);
        assert_eq!(places("dead_time"), ["detector.dead_time", "inverter.dead_time"]);
        assert_eq!(places("trials"), ["trials"]);
        assert_eq!(places("nothing"), [""; 0]);
    }

    #[test]
    fn analytic_units_of_keys() {
        for (key, expected) in [
            ("sensors.noise", Some("A")),
            ("inverter.dead_time", Some("s")),
            ("rotor.angle", Some("deg")),
            ("sensors.gain_error", Some("")),
            ("motor.winding.resistance", Some("Ω")),
            ("detector.method", None),
            ("sensors.noize", None),
        ] {
            assert_eq!(unit(key).as_deref(), expected, "{key}");
        }
        assert!(is_share("sensors.gain_error") && !is_share("sensors.bits") && !is_share("sensors.noise"));
    }
}
