//! Units of keys, found in the JSON schema.

use serde_json::Value;

use super::keys::{Range, keys};
use super::tables::ScenarioFile;

/// Returns the JSON Schema of scenario files.
///
/// `x-unit` is the SI unit of a quantity, `x-share` marks shares among dimensionless numbers, and `x-range` describes
/// the range of a key in words. `minimum` and `maximum` limit the plain numbers of a key, so that editors mark a value
/// that is not allowed.
pub fn schema() -> Value {
    let mut schema = unlimited();
    for (path, range) in keys().filter_map(|key| Some((key.path, key.range.as_ref()?))) {
        if let Some(place) = pointer(path, &schema).and_then(|pointer| schema.pointer_mut(&pointer)) {
            place["x-range"] = range.needed.into();
            limit(place, range);
        }
    }
    schema
}

/// Returns the schema without ranges. This schema suffices to find paths and units.
fn unlimited() -> Value {
    let mut schema = schemars::schema_for!(ScenarioFile).to_value();
    schema["title"] = "Standstill scenario".into();
    schema
}

/// Returns the JSON pointer to a key's place in the schema.
fn pointer(path: &str, schema: &Value) -> Option<String> {
    path.split('.').try_fold(String::new(), |table, name| {
        let of = schema.pointer(&table)?.get("$ref").and_then(Value::as_str);
        let table = of.map_or(table.as_str(), |of| of.trim_start_matches('#'));
        let place = format!("{table}/properties/{name}");
        schema.pointer(&place).map(|_| place)
    })
}

/// Writes a range into the schema at `place`, as `minimum`, `maximum` and further entries. If `place` has alternatives, writes the range
/// into the alternatives that are numbers.
fn limit(place: &mut Value, range: &Range) {
    let number = |kind: &Value| kind == "number" || kind == "integer";
    let is_number = place.get("type").is_some_and(|kind| match kind {
        Value::Array(kinds) => kinds.iter().any(number),
        kind => number(kind),
    });
    if is_number {
        if range.low == f64::MIN_POSITIVE {
            place["exclusiveMinimum"] = 0.into();
        } else {
            place["minimum"] = range.low.into();
        }
        place["maximum"] = range.high.into();
        if range.whole {
            place["multipleOf"] = 1.into();
        }
        if let Some(gap) = range.gap() {
            place["anyOf"] = serde_json::json!([{ "const": 0 }, { "minimum": gap }]);
        }
        return;
    }
    for alternatives in ["anyOf", "oneOf"] {
        for of in place.get_mut(alternatives).and_then(Value::as_array_mut).into_iter().flatten() {
            limit(of, range);
        }
    }
}

/// Returns an entry of a key's schema, such as `x-unit`. All alternatives of the key are searched.
fn entry(key: &str, word: &str) -> Option<Value> {
    let schema = unlimited();
    let place = key.split('.').try_fold(&schema, |place, part| property(place, part, &schema))?;
    find(place, word, &schema).cloned()
}

/// Returns the SI unit of a key such as `sensors.noise` or `motor.winding.resistance`. The text is empty for shares and dimensionless
/// numbers. Returns none if the key's values have no unit.
pub fn unit(key: &str) -> Option<String> {
    entry(key, "x-unit")?.as_str().map(str::to_owned)
}

/// Returns true if a key's values are shares, which are usually shown in per cent.
pub fn is_share(key: &str) -> bool {
    entry(key, "x-share") == Some(Value::Bool(true))
}

/// Returns true if a key's values are numbers. Returns none if there is no such key.
pub fn has_numbers(key: &str) -> Option<bool> {
    let is_whole = |kind| match kind {
        Value::Array(kinds) => kinds.iter().any(|kind| kind == "integer"),
        kind => kind == "integer",
    };
    has(key, &unlimited()).then(|| entry(key, "x-unit").is_some() || entry(key, "type").is_some_and(is_whole))
}

/// Returns the paths of all keys with this name in a scenario, without the keys of the motor. For example, the name `noise` gives
/// `sensors.noise`.
pub(super) fn places(name: &str) -> Vec<String> {
    let schema = unlimited();
    let tables = schema["properties"].as_object().into_iter().flatten();
    // Keys of the motor are left out: they are many, and some have the same names as keys of the scenario.
    let tables = tables.map(|(table, _)| table.as_str()).filter(|table| *table != "motor");
    let own = schema["properties"].get(name).map(|_| name.to_owned());
    own.into_iter()
        .chain(tables.map(|table| format!("{table}.{name}")).filter(|key| has(key, &schema)))
        .collect()
}

/// Returns the paths of all keys and tables with this name in a motor's tables. For example, the name `inertia` gives
/// `motor.rotor.inertia`.
pub(super) fn motor_places(name: &str) -> Vec<String> {
    let schema = unlimited();
    let mut tables = Vec::new();
    gather(&schema["properties"]["motor"], &schema, &mut tables);
    let own = tables.contains(&name.to_owned()).then(|| format!("motor.{name}"));
    let within = tables.iter().map(|table| format!("motor.{table}.{name}"));
    own.into_iter().chain(within.filter(|key| has(key, &schema))).collect()
}

/// Adds the names of all properties of `place` and of all its alternatives to `names`.
fn gather(place: &Value, root: &Value, names: &mut Vec<String>) {
    let place = resolved(place, root);
    names.extend(
        place.get("properties").and_then(Value::as_object).into_iter().flat_map(|all| all.keys().cloned()),
    );
    alternatives(place).for_each(|of| gather(of, root, names));
}

fn has(key: &str, schema: &Value) -> bool {
    key.split('.').try_fold(schema, |place, part| property(place, part, schema)).is_some()
}

/// Returns the schema of a property. All alternatives of `place` are searched.
fn property<'a>(place: &'a Value, name: &str, root: &'a Value) -> Option<&'a Value> {
    let place = resolved(place, root);
    let own = place.get("properties").and_then(|properties| properties.get(name));
    own.or_else(|| alternatives(place).find_map(|alternative| property(alternative, name, root)))
}

/// Returns an entry of a schema. All alternatives of the schema are searched. For a number with a source, returns the entry of the number's
/// value.
fn find<'a>(place: &'a Value, word: &str, root: &'a Value) -> Option<&'a Value> {
    let place = resolved(place, root);
    place.get(word).or_else(|| {
        let value = place.get("properties").and_then(|properties| properties.get("value"));
        value.into_iter().chain(alternatives(place)).find_map(|alternative| find(alternative, word, root))
    })
}

fn alternatives(place: &Value) -> impl Iterator<Item = &Value> {
    ["anyOf", "oneOf", "allOf"].iter().filter_map(|name| place.get(name)?.as_array()).flatten()
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
        assert_eq!(motor_places("winding"), ["motor.winding"]);
        assert!(
            motor_places("inertia").contains(&"motor.rotor.inertia".to_owned()),
            "{:?}",
            motor_places("inertia")
        );
        assert_eq!(motor_places("noise"), [""; 0]);
    }

    /// Returns true if a schema allows a plain number. Only those entries of the schema are checked that occur in this program's schemas of
    /// numbers.
    fn allows(place: &Value, number: f64) -> bool {
        let limit = |word: &str| place.get(word).and_then(Value::as_f64);
        let kinds = match &place["type"] {
            Value::Array(kinds) => kinds.clone(),
            Value::Null => Vec::new(),
            kind => vec![kind.clone()],
        };
        let is_kind = kinds.is_empty() || kinds.iter().any(|kind| kind == "number" || kind == "integer");
        let any = |word: &str| {
            place
                .get(word)
                .and_then(Value::as_array)
                .is_none_or(|all| all.iter().any(|of| allows(of, number)))
        };
        is_kind
            && limit("minimum").is_none_or(|least| number >= least)
            && limit("exclusiveMinimum").is_none_or(|least| number > least)
            && limit("maximum").is_none_or(|most| number <= most)
            && limit("multipleOf").is_none_or(|of| number % of == 0.0)
            && limit("const").is_none_or(|only| number == only)
            && any("anyOf")
            && any("oneOf")
    }

    /// The schema allows exactly the plain numbers that the program allows. The numbers tested are the ends of each range, numbers beyond
    /// the ends, and numbers within the gap above zero.
    #[test]
    fn law_the_schema_has_the_range_of_each_key() {
        let schema = schema();
        let (mut limited, mut gaps) = (0, 0);
        for (path, range) in keys().filter_map(|key| Some((key.path, key.range.as_ref()?))) {
            let place = pointer(path, &schema).and_then(|pointer| schema.pointer(&pointer));
            let place = place.unwrap_or_else(|| panic!("{path} is not in the schema"));
            assert_eq!(place["x-range"], range.needed, "{path}");
            let beyond = 1e-9 * (range.high - range.low).min(range.high.abs());
            let gap = range.gap();
            let tried = [0.0, 1.0, 1.5, -1.0, range.low, range.high, range.low - beyond, range.high + beyond];
            for number in tried.into_iter().chain(gap.map(|gap| gap / 2.0)).chain(gap) {
                assert_eq!(allows(place, number), range.contains(number), "{path}: {number}");
            }
            limited += 1;
            gaps += usize::from(gap.is_some());
        }
        assert!(limited > 60 && gaps > 0, "{limited} {gaps}");
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
