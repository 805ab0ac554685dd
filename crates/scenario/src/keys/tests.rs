use standstill_quantity::rounded;
use standstill_sim::Purpose;
use toml::Value;

use super::*;
use crate::tests::{document, error, scenario, scenario_of};
use crate::units::schema;

/// Keys that need other keys, with these keys.
const BESIDE: &[(&str, &str)] = &[
    (
        "rotor.memory",
        "motor = { base = \"paper-5k5\", hysteresis = { coercive_current = 0.08, depth = 0.05, cells = 3 } }",
    ),
    ("rotor.load", "rotor.state = \"free\""),
    ("rotor.speed", "rotor.state = \"driven\""),
    ("rotor.acceleration", "rotor.state = \"driven\""),
    ("inverter.capacitance", "inverter.source_resistance = 0.2"),
    ("inverter.source_resistance", "inverter.capacitance = 1e-3"),
    ("inverter.sag_depth", "inverter.sag_duration = 0.01"),
    ("inverter.sag_start", "inverter.sag_depth = 0.2\ninverter.sag_duration = 0.01"),
    ("inverter.sag_duration", "inverter.sag_depth = 0.2"),
    ("inverter.channel_resistance", "inverter.devices = \"mosfet\""),
    ("inverter.terminal_resistance", "inverter.terminal_capacitance = 1e-9"),
    ("sensors.pick_up_decay", "sensors.pick_up = 0.2"),
    ("sensors.pick_up_frequency", "sensors.pick_up = 0.2"),
    ("sensors.settle", "sensors.arrangement = \"low-side-shunts\""),
    ("sensors.slew", "sensors.arrangement = \"low-side-shunts\""),
    ("sensors.terminal_gain_error", "sensors.terminals = true"),
    ("sensors.terminal_offset", "sensors.terminals = true"),
    ("sensors.terminal_noise", "sensors.terminals = true"),
    ("sensors.terminal_bandwidth", "sensors.terminals = true"),
    ("sensors.terminal_range", "sensors.terminals = true"),
    ("sensors.terminal_bits", "sensors.terminals = true"),
    ("sensors.terminal_load", "sensors.terminals = true"),
    ("sensors.conversion", "sensors.oversampling = 4"),
    ("sensors.comparators", "sensors.timer = 1e-6"),
    ("sensors.comparator_offset", "sensors.timer = 1e-6"),
    ("sensors.comparator_delay", "sensors.timer = 1e-6"),
    ("sensors.comparator_delay_spread", "sensors.timer = 1e-6"),
    ("sensors.comparator_noise", "sensors.timer = 1e-6"),
    ("sensors.comparator_bandwidth", "sensors.timer = 1e-6\nsensors.comparator_noise = 0.01"),
    ("sensors.blanking", "sensors.timer = 1e-6"),
    ("sensors.timer_error", "sensors.timer = 1e-6"),
    ("sensors.threshold_bits", "sensors.timer = 1e-6"),
    ("sensors.threshold_range", "sensors.timer = 1e-6\nsensors.threshold_bits = 8"),
    ("detector.threshold", "detector.method = \"six-pulse\""),
    ("detector.timed", "sensors.timer = 1e-6\ndetector.method = \"six-pulse\"\ndetector.rounds = 2"),
    ("detector.checks", "detector.method = \"bipolar\""),
    ("detector.rest", "detector.method = \"bipolar\""),
    ("detector.pause", "sensors.timer = 1e-6\ndetector.method = \"six-pulse\""),
    ("detector.pairs", "sensors.timer = 1e-6\ndetector.method = \"six-pulse\""),
    ("detector.pole_error", "detector.method = \"bipolar\""),
    ("detector.gain_tolerance", "detector.method = \"maximum-likelihood\""),
    ("detector.bandwidth", "detector.method = \"maximum-likelihood\""),
    ("detector.deviation", "detector.method = \"maximum-likelihood-adaptive\""),
    ("detector.voltage", "detector.method = \"hfi-rotating\""),
    ("detector.window", "sensors.arrangement = \"dc-link-shunt\"\ndetector.method = \"hfi-rotating\""),
    ("detector.compensation", "detector.method = \"hfi-rotating\""),
    ("detector.comparison", "sensors.terminals = true\ndetector.method = \"open-terminal\""),
];

/// Keys whose values only the document has: a scenario has only numbers derived from them.
const OF_THE_DOCUMENT: &[&str] = &[
    "rotor.winding_temperature",
    "rotor.magnet_temperature",
    "detector.method",
    "detector.signature",
    "detector.polarity",
    "detector.dead_time",
    "detector.library",
    "detector.python",
    "detector.call_timeout",
    "detector.config",
    // It allows only three numbers, which `tests/six_pulse.rs` tests.
    "detector.sector",
];

fn beside(key: &str) -> &'static str {
    BESIDE.iter().find(|(of, _)| *of == key).map_or("", |(_, beside)| beside)
}

/// Returns a value other than that of the example: four fifths of a number, which are whole nanoseconds for all times;
/// rounded up for keys with whole numbers.
fn other(key: &Key, now: Option<&Value>) -> Value {
    match key.values() {
        Values::Number { .. } | Values::Whole => {
            let example: toml::Table = format!("x = {}", key.example).parse().expect("TOML");
            let example = match &example["x"] {
                Value::String(text) => standstill_quantity::si_value(text).expect("a quantity"),
                value => value.as_integer().expect("a number") as f64,
            };
            let whole = key.range.is_some_and(|range| range.whole);
            // A number whose example is zero is zero in all scenarios.
            let other = if example == 0.0 { 1e-9 } else { rounded(example * 0.8, 0) };
            number(if whole { other.ceil() } else { other })
        }
        Values::Choice(names) => {
            // A leg that is open has no example in which terminals have a capacitance.
            let name = names
                .iter()
                .map(|(name, _)| Value::from(*name))
                .find(|name| Some(name) != now && name.as_str() != Some("brake"));
            name.expect("two choices")
        }
        Values::Flag => Value::Boolean(now != Some(&Value::Boolean(true))),
        Values::List(names) => Value::Array(vec![names[0].0.into()]),
        Values::Text => panic!("{}: a text", key.path),
    }
}

#[test]
fn law_the_number_that_a_file_sets_is_that_of_the_scenario() {
    for key in keys().filter(|key| key.path.contains('.') && !key.path.starts_with("stop_at")) {
        if OF_THE_DOCUMENT.contains(&key.path) {
            continue;
        }
        // Some keys are allowed only in pairs, such as a resistance and the capacitor that it feeds.
        let without = beside(key.path);
        let alone = scenario_of(&document(without)).unwrap_or_else(|_| scenario(""));
        let now = alone.value(key.path);
        let other = other(key, now.as_ref());
        let set = scenario(&format!("{}\n{} = {other}", beside(key.path), key.path));
        assert_eq!(set.value(key.path), Some(other.clone()), "{}", key.path);
        // The test could not fail if the scenario had this value without the key.
        assert_ne!(now, Some(other), "{}", key.path);
    }
}

#[test]
fn law_every_key_of_the_schema_has_an_entry_with_a_range_and_a_reason() {
    let schema = schema();
    let sentence =
        |place: &serde_json::Value| place["description"].as_str().map(|text| text.trim().to_owned());
    for (name, place) in schema["properties"].as_object().expect("keys") {
        if ["motor", "axes", "design", "tolerances", "faults"].contains(&name.as_str()) {
            continue;
        }
        let table = place["$ref"].as_str().and_then(|place| schema.pointer(place.trim_start_matches('#')));
        let Some(table) = table.and_then(|table| table["properties"].as_object()) else {
            let entry = key(name).unwrap_or_else(|| panic!("`{name}` has no entry"));
            assert_eq!(sentence(place).as_deref(), Some(entry.about), "{name}");
            continue;
        };
        for (below, place) in table {
            let entry = key(&format!("{name}.{below}")).unwrap_or_else(|| panic!("`{below}` has no entry"));
            // Lines of the source are joined by a line break in the schema, and by a blank in the entry.
            let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
            assert_eq!(sentence(place).map(|text| words(&text)), Some(words(entry.about)), "{}", entry.path);
        }
    }
    for key in keys() {
        let number = matches!(key.values(), Values::Number { .. });
        assert!(!number || key.range.is_some(), "{} has no range", key.path);
        assert!(
            key.range.is_none_or(|range| range.low < range.high && !range.reason.is_empty()),
            "{}",
            key.path
        );
    }
}

#[test]
fn law_a_number_beyond_its_range_is_refused_with_the_range() {
    for key in keys().filter(|key| key.path != "trials") {
        let Some(range) = &key.range else { continue };
        for value in [range.low - 1.0, range.high * 2.0 + 1.0] {
            let message = error(&format!("{}\n{} = {value:e}", beside(key.path), key.path));
            assert!(message.contains(key.path) && message.contains(range.needed), "{}: {message}", key.path);
            assert!(
                range.high != LARGEST || value < LARGEST || message.contains("at most 1e12"),
                "{}: {message}",
                key.path
            );
        }
    }
}

#[test]
fn law_a_key_of_a_part_that_is_not_there_has_no_value() {
    let pair = |text: &str| {
        let scenario = scenario(text);
        ["inverter.channel_resistance", "inverter.switch_drop"].map(|path| scenario.value(path).is_some())
    };
    assert_eq!(pair("inverter.devices = \"igbt\""), [false, true]);
    assert_eq!(pair("inverter.devices = \"mosfet\""), [true, false]);
}

#[test]
fn law_the_ends_of_a_range_are_allowed() {
    for path in ["rotor.angle", "rotor.winding_temperature", "rotor.magnet_temperature"] {
        let Range { low, high, .. } = key(path).and_then(|key| key.range).expect("a range");
        for end in [low, high] {
            scenario(&format!("{path} = {end}"));
        }
    }
}

#[test]
fn regress_a_held_rotor_is_the_same_file_whether_it_says_so_or_not() {
    let text = |text: &str| document(text).load().expect("valid").text().expect("TOML");
    assert_eq!(text(""), text("rotor.state = \"locked\""));
    assert_eq!(text("rotor.angle = 10"), text("rotor.angle = 10\nrotor.state = \"locked\""));
    assert_ne!(text(""), text("rotor.state = \"free\""));
}

#[test]
fn regress_values_are_found_in_the_unit_in_which_ranges_are_written() {
    for (value, said) in [("20 nF", "found 20 nF"), ("0.05 nF", "found 50 pF"), ("47 uF", "found 47 µF")] {
        let message = error(&format!("[inverter]\nterminal_capacitance = \"{value}\""));
        assert!(message.contains(said) && message.contains("from 0.1 nF to 10 nF"), "{message}");
    }
}

table! {
    /// A table with a key that exists only in this test.
    pub struct Extra = "extra" of scenario {
        /// Asymmetry of the ripple.
        asymmetry: Quantity<Share> [scenario.drive.link.ripple] {
            range: Some(SHARE), draws: Some((Purpose::Ripple, 0..1)), example: "\"3 %\"",
        };
    }
}

/// A key is one entry and the field that the entry sets.
#[test]
fn law_a_new_key_is_read_checked_described_set_and_found_by_its_entry_alone() {
    let extra: Extra = toml::from_str("asymmetry = \"3 %\"").expect("a share");
    assert!(toml::from_str::<Extra>("asymetry = 1").is_err());
    let entry = &Extra::KEYS[0];
    assert_eq!((entry.path, entry.about), ("extra.asymmetry", "Asymmetry of the ripple."));
    assert_eq!(entry.values(), Values::Number { unit: "", share: true });
    let schema = schemars::schema_for!(Extra).to_value();
    assert_eq!(schema["properties"]["asymmetry"]["description"], entry.about);
    assert!(entry.is_drawn(&scenario("")));
    let mut set = scenario("");
    assert_eq!((entry.get)(&set), Some(number(0.002)));
    extra.set(&mut set);
    assert_eq!((entry.get)(&set), Some(number(0.03)));
    assert_eq!(set, scenario("inverter.ripple = 0.03"));
    let wrong: Extra = toml::from_str("asymmetry = 3").expect("a share");
    let message = wrong.check().expect_err("beyond").to_string();
    assert!(message.contains("`extra.asymmetry`: found 3, needed a share from 0 to 1"), "{message}");
}
