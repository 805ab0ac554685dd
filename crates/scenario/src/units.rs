//! The unit of a key, as the schema has it.

use serde_json::Value;

use super::tables::ScenarioFile;

/// JSON Schema of scenario files.
///
/// Quantities have their SI unit as `x-unit`, and `x-share` tells shares from pure numbers.
pub fn schema() -> Value {
    let mut schema = schemars::schema_for!(ScenarioFile).to_value();
    schema["title"] = "Standstill scenario".into();
    schema
}

/// The SI unit of a key such as `sensors.noise`, or of a motor's such as `motor.winding.resistance`; empty for shares and
/// pure numbers, none if the key's values have no unit.
pub fn unit(key: &str) -> Option<String> {
    let schema = schema();
    let place = key.split('.').try_fold(&schema, |place, part| property(place, part, &schema))?;
    find(place, "x-unit", &schema).and_then(|unit| unit.as_str().map(str::to_owned))
}

/// Whether a key's values are shares, which people read in per cent.
pub fn is_share(key: &str) -> bool {
    let schema = schema();
    let place = key.split('.').try_fold(&schema, |place, part| property(place, part, &schema));
    place.and_then(|place| find(place, "x-share", &schema)).and_then(Value::as_bool).unwrap_or(false)
}

/// Whether a key's values are numbers; none if there is no such key.
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

/// What the values of a key are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Values {
    /// Numbers: the symbol of their SI unit, and whether they are shares, which people write in per cent.
    Number {
        /// Symbol of the unit; empty for shares and pure numbers.
        unit: String,
        /// Whether they are shares.
        share: bool,
    },
    /// One of these names; each with what it is, in a sentence.
    Choice(Vec<(String, String)>),
    /// Yes or no.
    Flag,
    /// Whole numbers.
    Whole,
}

/// A key of scenario files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeyOf {
    /// Its path, such as `sensors.noise`.
    pub key: String,
    /// What it is, in a sentence or two.
    pub about: String,
    /// What its values are.
    pub values: Values,
}

/// All keys but the motor's, whose data sheet says which it has, a foreign detector's library and what that is told, and those that say which points and trials there are
/// (`axes`, `design`, `tolerances`), in the order of the schema.
///
/// ```
/// use standstill_scenario::{Values, keys};
///
/// let noise = keys().into_iter().find(|of| of.key == "sensors.noise").expect("a key");
/// assert_eq!(noise.values, Values::Number { unit: "A".to_owned(), share: false });
/// ```
pub fn keys() -> Vec<KeyOf> {
    let schema = schema();
    let mut keys = Vec::new();
    for (name, place) in schema["properties"].as_object().into_iter().flatten() {
        if ["motor", "axes", "design", "tolerances"].contains(&name.as_str()) {
            continue;
        }
        match resolved(place, &schema).get("properties").and_then(Value::as_object) {
            Some(table) => keys.extend(
                table.iter().filter_map(|(key, place)| key_of(format!("{name}.{key}"), place, &schema)),
            ),
            None => keys.extend(key_of(name.clone(), place, &schema)),
        }
    }
    keys
}

fn key_of(key: String, place: &Value, root: &Value) -> Option<KeyOf> {
    let text = |of: &Value| of.as_str().unwrap_or_default().trim().to_owned();
    let is = |word: &str| {
        find(place, "type", root).is_some_and(|kind| match kind {
            Value::Array(kinds) => kinds.iter().any(|kind| kind == word),
            kind => kind == word,
        })
    };
    let values = if let Some(unit) = find(place, "x-unit", root) {
        let share = find(place, "x-share", root).and_then(Value::as_bool).unwrap_or(false);
        Values::Number { unit: text(unit), share }
    } else if let Some(names) = choices(place, root) {
        Values::Choice(names.iter().map(|one| (text(&one["const"]), text(&one["description"]))).collect())
    } else if is("boolean") {
        Values::Flag
    } else if is("integer") {
        Values::Whole
    } else {
        return None;
    };
    let about = place.get("description").or_else(|| find(place, "description", root)).map(text);
    Some(KeyOf { key, about: about.unwrap_or_default(), values })
}

/// The names of a choice, if a place is one.
fn choices<'a>(place: &'a Value, root: &'a Value) -> Option<&'a Vec<Value>> {
    let place = resolved(place, root);
    let own = place.get("oneOf").and_then(Value::as_array);
    own.filter(|all| all.iter().all(|one| one.get("const").is_some())).or_else(|| {
        place.get("anyOf").and_then(Value::as_array)?.iter().find_map(|place| choices(place, root))
    })
}

/// Where in a scenario a key of this name is, such as `sensors.noise` for `noise`.
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

/// What a schema says of a property, in whichever of its alternatives has it.
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

/// A word of a schema, in it or in one of its alternatives; of a number with its source, that of its value.
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
    fn law_every_key_of_the_schema_is_listed() {
        let keys = keys();
        let of = |key: &str| keys.iter().find(|of| of.key == key).map(|of| of.values.clone());
        assert_eq!(of("sensors.gain_error"), Some(Values::Number { unit: String::new(), share: true }));
        assert_eq!((of("trials"), of("seed")), (Some(Values::Whole), Some(Values::Whole)));
        assert_eq!(of("detector.compensation"), Some(Values::Flag));
        for (key, name) in
            [("errors", "harsh"), ("detector.method", "bipolar"), ("inverter.devices", "mosfet")]
        {
            let Some(Values::Choice(names)) = of(key) else { panic!("{key} is no choice") };
            assert!(
                names.iter().any(|(known, about)| known == name && !about.is_empty()),
                "{key}: {names:?}"
            );
        }
        // None is lost because its values are of another kind.
        let schema = schema();
        let tables = ["stop_at", "rotor", "inverter", "sensors", "detector"];
        for table in tables {
            let place = resolved(&schema["properties"][table], &schema);
            for key in place["properties"].as_object().expect("a table").keys() {
                let key = format!("{table}.{key}");
                // A file and what it is told: neither numbers nor choices.
                if ["detector.library", "detector.python", "detector.config"].contains(&key.as_str()) {
                    continue;
                }
                let known = keys.iter().find(|of| of.key == key);
                assert!(known.is_some_and(|of| !of.about.is_empty()), "{key}");
            }
        }
    }

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
