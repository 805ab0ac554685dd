//! What a key comes to in a scenario, whether a file sets it or not: what error set, motor and method make of it.

use standstill_detect::{Kind, Method, Value as Setting, keys};
use standstill_interface::Nanos;
use standstill_inverter::{DeviceKind, Sag};
use standstill_quantity::rounded;
use standstill_sim::{Adc, RotorState};
use toml::Value;

use crate::rotor::Memory;
use crate::{Rotor, Scenario};

fn number(value: f64) -> Value {
    Value::Float(rounded(value, 0))
}

fn seconds(value: Nanos) -> Value {
    number(value.seconds())
}

/// Of a converter that there may be.
fn of(adc: Option<Adc>, part: impl Fn(Adc) -> f64) -> Value {
    number(adc.map_or(0.0, part))
}

impl Scenario<Method<f64>> {
    /// The value of a key of the tables `rotor`, `inverter`, `sensors` and `detector`: in the unit of the schema, which is
    /// that of SI, angles in degrees; a choice by its name. None of a key that this scenario has no such thing for, such as
    /// a setting of another method, and of what only the document knows.
    ///
    /// ```
    /// use standstill_scenario::{Document, Plan};
    ///
    /// let plan = Plan::new(Document::parse("s.toml".as_ref(), "detector.method = \"bipolar\"")?)?;
    /// let scenario = plan.scenario(0)?;
    /// assert_eq!(scenario.value("sensors.noise"), Some(0.01.into()));
    /// assert_eq!(scenario.value("inverter.devices"), Some("igbt".into()));
    /// assert_eq!(scenario.value("inverter.channel_resistance"), None);
    /// assert_eq!(scenario.value("detector.voltage"), None);
    /// # Ok::<(), standstill_scenario::FileError>(())
    /// ```
    pub fn value(&self, key: &str) -> Option<Value> {
        let (table, name) = key.split_once('.')?;
        match table {
            "rotor" => self.of_rotor(name),
            "inverter" => self.of_inverter(name),
            "sensors" => self.of_sensors(name),
            "detector" => self.of_detector(name),
            _ => None,
        }
    }

    fn of_rotor(&self, name: &str) -> Option<Value> {
        Some(match name {
            "state" => {
                let state = match self.rotor {
                    RotorState::Locked => Rotor::Locked,
                    RotorState::Free => Rotor::Free,
                    RotorState::Braked(_) => Rotor::Brake,
                };
                state.name().into()
            }
            "angle" => number(self.start_angle?.to_degrees()),
            "memory" if self.motor.magnetics.hysteresis().is_some() => {
                (if self.memory { Memory::Former } else { Memory::Virgin }).name().into()
            }
            "load" if self.rotor != RotorState::Locked => number(self.load_torque),
            _ => return None,
        })
    }

    fn of_inverter(&self, name: &str) -> Option<Value> {
        let drive = &self.drive;
        let (link, devices) = (&drive.link, &drive.bridge.devices);
        let is = |kind| devices.kind == kind;
        let sag = |part: fn(Sag) -> f64| number(link.sag.map_or(0.0, part));
        Some(match name {
            "dc_link" => number(link.voltage),
            "ripple" => number(link.ripple),
            "ripple_frequency" => number(link.ripple_frequency),
            "capacitance" => number(link.storage.map_or(0.0, |storage| storage.capacitance)),
            "source_resistance" => number(link.storage?.source_resistance),
            "sag_depth" => sag(|sag| sag.depth),
            "sag_start" => sag(|sag| sag.start),
            "sag_duration" => number(link.sag?.duration),
            "dead_time" => seconds(drive.dead_time),
            "delay_mismatch" => number(drive.delay_mismatch),
            "carrier" => number(1.0 / drive.carrier_period.seconds()),
            "devices" => devices.kind.name().into(),
            "channel_resistance" if is(DeviceKind::Mosfet) => number(devices.switch_resistance),
            "switch_drop" if is(DeviceKind::Igbt) => number(devices.switch_drop),
            "switch_resistance" if is(DeviceKind::Igbt) => number(devices.switch_resistance),
            "diode_drop" => number(devices.diode_drop),
            "diode_resistance" => number(devices.diode_resistance),
            "terminal_capacitance" => number(drive.bridge.terminal_capacitance),
            "terminal_resistance" if drive.bridge.terminal_capacitance > 0.0 => {
                number(drive.bridge.terminal_resistance)
            }
            "open_leg" => drive.bridge.open_leg.name().into(),
            _ => return None,
        })
    }

    fn of_sensors(&self, name: &str) -> Option<Value> {
        let sensors = &self.sensors;
        Some(match name {
            "arrangement" => sensors.arrangement.name().into(),
            "gain_error" => number(sensors.gain_error),
            "offset" => number(sensors.offset),
            "noise" => number(sensors.noise),
            "bandwidth" => number(sensors.bandwidth.unwrap_or(0.0)),
            "bandwidth_tolerance" => number(sensors.bandwidth_tolerance),
            "bandwidth_mismatch" => number(sensors.bandwidth_mismatch),
            "skew" => seconds(sensors.skew),
            "pick_up" => number(sensors.pick_up.map_or(0.0, |of| of.amplitude)),
            "pick_up_decay" => number(sensors.pick_up?.decay),
            "pick_up_frequency" => number(sensors.pick_up?.frequency),
            "range" => number(sensors.adc?.high),
            "bits" => of(sensors.adc, |adc| adc.bits.into()),
            "jitter" => seconds(sensors.jitter),
            "sample_delay" => seconds(sensors.sample_delay),
            "dc_link_gain_error" => number(sensors.dc_link.gain_error),
            "dc_link_offset" => number(sensors.dc_link.offset),
            "dc_link_noise" => number(sensors.dc_link.noise),
            "dc_link_range" => number(sensors.dc_link.adc?.high),
            "dc_link_bits" => of(sensors.dc_link.adc, |adc| adc.bits.into()),
            "resolver_error" => number(sensors.resolver.error.to_degrees()),
            _ => return None,
        })
    }

    fn of_detector(&self, name: &str) -> Option<Value> {
        if name == "time_limit" {
            return Some(seconds(self.time_limit));
        }
        let key = keys::ALL.into_iter().find(|key| key.name == name)?;
        let value = self.detector.get(key)?;
        Some(match (value, key.kind) {
            (Setting::Flag(flag), _) => Value::Boolean(flag),
            (Setting::Number(number), Kind::Number { .. } | Kind::Flag) => self::number(number),
        })
    }
}

#[cfg(test)]
mod tests {
    use crate::tests::scenario;
    use crate::units::schema;

    /// A value of a key other than what it has by itself, and what else must be set beside it.
    const OTHERS: &[(&str, &str, &str)] = &[
        ("rotor.state", "\"free\"", ""),
        ("rotor.angle", "43.5", ""),
        (
            "rotor.memory",
            "\"former\"",
            "motor = { base = \"paper-5k5\", hysteresis = { coercive_current = 0.08, depth = 0.05, cells = 3 } }",
        ),
        ("rotor.load", "0.5", "rotor.state = \"free\""),
        ("inverter.dc_link", "480.0", ""),
        ("inverter.ripple", "0.015", ""),
        ("inverter.ripple_frequency", "100.0", ""),
        ("inverter.capacitance", "1e-3", "inverter.source_resistance = 0.2"),
        ("inverter.source_resistance", "0.25", "inverter.capacitance = 1e-3"),
        ("inverter.sag_depth", "0.2", "inverter.sag_duration = 0.01"),
        ("inverter.sag_start", "0.002", "inverter.sag_depth = 0.2\ninverter.sag_duration = 0.01"),
        ("inverter.sag_duration", "0.015", "inverter.sag_depth = 0.2"),
        ("inverter.dead_time", "1e-6", ""),
        ("inverter.delay_mismatch", "2e-8", ""),
        ("inverter.carrier", "8000.0", ""),
        ("inverter.devices", "\"mosfet\"", ""),
        ("inverter.channel_resistance", "0.01", "inverter.devices = \"mosfet\""),
        ("inverter.switch_drop", "1.25", ""),
        ("inverter.switch_resistance", "0.02", ""),
        ("inverter.diode_drop", "0.75", ""),
        ("inverter.diode_resistance", "0.015", ""),
        ("inverter.open_leg", "\"open\"", ""),
        ("inverter.terminal_capacitance", "1e-9", ""),
        ("inverter.terminal_resistance", "500.0", "inverter.terminal_capacitance = 1e-9"),
        ("detector.rest", "1.2", "detector.method = \"bipolar\""),
        ("detector.time_limit", "2.5", ""),
        ("sensors.arrangement", "\"two-in-line\"", ""),
        ("sensors.gain_error", "0.02", ""),
        ("sensors.offset", "0.05", ""),
        ("sensors.noise", "0.03", ""),
        ("sensors.bandwidth", "150000.0", ""),
        ("sensors.bandwidth_tolerance", "0.1", ""),
        ("sensors.bandwidth_mismatch", "0.05", ""),
        ("sensors.skew", "1e-6", ""),
        ("sensors.pick_up", "0.25", ""),
        ("sensors.pick_up_decay", "1e-6", "sensors.pick_up = 0.2"),
        ("sensors.pick_up_frequency", "3e6", "sensors.pick_up = 0.2"),
        ("sensors.range", "30.0", ""),
        ("sensors.bits", "10.0", ""),
        ("sensors.jitter", "2e-7", ""),
        ("sensors.sample_delay", "1e-6", ""),
        ("sensors.dc_link_gain_error", "0.01", ""),
        ("sensors.dc_link_offset", "2.0", ""),
        ("sensors.dc_link_noise", "1.5", ""),
        ("sensors.dc_link_range", "900.0", ""),
        ("sensors.dc_link_bits", "14.0", ""),
        ("sensors.resolver_error", "0.5", ""),
        ("detector.pulse", "6e-5", ""),
        ("detector.rounds", "4.0", ""),
        ("detector.least_saliency", "0.07", ""),
        ("detector.pole_error", "0.002", "detector.method = \"bipolar\""),
        ("detector.vector_current", "7.0", ""),
        ("detector.gain_tolerance", "0.02", "detector.method = \"maximum-likelihood\""),
        ("detector.bandwidth", "250000.0", "detector.method = \"maximum-likelihood\""),
        ("detector.deviation", "0.23", "detector.method = \"maximum-likelihood-adaptive\""),
        ("detector.voltage", "23.0", "detector.method = \"hfi-rotating\""),
        ("detector.compensation", "false", "detector.method = \"hfi-rotating\""),
    ];

    #[test]
    fn law_what_a_file_sets_is_what_the_scenario_has() {
        for (key, value, beside) in OTHERS {
            let set = scenario(&format!("{beside}\n{key} = {value}"));
            let expected = format!("x = {value}").parse::<toml::Table>().expect("TOML").remove("x");
            assert_eq!(set.value(key), expected, "{key}");
            // The test could not fail if it had that value by itself.
            if ![
                "inverter.capacitance",
                "inverter.source_resistance",
                "inverter.sag_depth",
                "inverter.sag_duration",
            ]
            .contains(key)
            {
                assert_ne!(scenario(beside).value(key), expected, "{key}");
            }
        }
    }

    #[test]
    fn law_every_number_of_the_schema_is_known() {
        let schema = schema();
        // What only the document knows.
        let document = ["rotor.winding_temperature", "rotor.magnet_temperature", "detector.method"];
        let document = document.into_iter().chain([
            "detector.signature",
            "detector.polarity",
            "detector.dead_time",
            "detector.library",
            "detector.python",
            "detector.call_timeout",
            "detector.config",
        ]);
        let known: Vec<&str> = OTHERS.iter().map(|(key, ..)| *key).chain(document).collect();
        for name in ["rotor", "inverter", "sensors", "detector"] {
            let table = schema["properties"][name]["$ref"].as_str().expect("a table").trim_start_matches('#');
            let table = schema.pointer(table).expect("a table");
            let properties = table["properties"].as_object().expect("keys");
            for key in properties.keys() {
                let key = format!("{name}.{key}");
                assert!(known.contains(&key.as_str()), "{key}: what does it come to? See `effective.rs`");
            }
        }
    }
}
