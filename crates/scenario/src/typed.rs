//! Tolerances that set a number of a scenario, without reading its document anew for each trial.
//!
//! A setter is used where it makes, on a few draws at each point, the very scenario that the document makes, and for values
//! between the least and the largest that the document was tried with.

use standstill_detect::Method;
use standstill_quantity::si_value;
use standstill_sim::Streams;
use toml::Value;

use crate::tolerances::Drawn;
use crate::{FileError, Scenario};

type Set = fn(&mut Scenario<Method<f64>>, f64);

/// What keys set, in SI.
const SETTERS: &[(&str, Set)] = &[
    ("motor.winding.resistance", |s, x| s.motor.resistance = x),
    ("rotor.load", |s, x| s.load_torque = x),
    ("sensors.noise", |s, x| s.sensors.noise = x),
    ("sensors.gain_error", |s, x| s.sensors.gain_error = x),
    ("sensors.offset", |s, x| s.sensors.offset = x),
    ("sensors.bandwidth", |s, x| s.sensors.bandwidth = Some(x)),
    ("inverter.switch_drop", |s, x| s.drive.bridge.devices.switch_drop = x),
    ("inverter.switch_resistance", |s, x| s.drive.bridge.devices.switch_resistance = x),
    ("inverter.channel_resistance", |s, x| s.drive.bridge.devices.switch_resistance = x),
    ("inverter.diode_drop", |s, x| s.drive.bridge.devices.diode_drop = x),
    ("inverter.diode_resistance", |s, x| s.drive.bridge.devices.diode_resistance = x),
];

/// A setter for each tolerance.
#[derive(Clone, Debug)]
pub(super) struct Typed {
    setters: Vec<Set>,
    /// The least and the largest number that the document was tried with.
    tried: Vec<[f64; 2]>,
}

impl Typed {
    /// For these tolerances, if each has a setter.
    pub(super) fn new(tolerances: &[Drawn], tried: Vec<[f64; 2]>) -> Option<Self> {
        let setter = |drawn: &Drawn| SETTERS.iter().find(|(key, _)| *key == drawn.key()).map(|(_, set)| *set);
        let setters = tolerances.iter().map(setter).collect::<Option<Vec<_>>>()?;
        Some(Self { setters, tried })
    }

    /// A scenario with what these streams draw; none where the document must say whether it can be.
    pub(super) fn drawn(
        &self,
        tolerances: &[Drawn],
        told: &Scenario<Method<f64>>,
        streams: Streams,
    ) -> Option<Scenario<Method<f64>>> {
        let mut scenario = told.clone();
        for ((drawn, set), [low, high]) in tolerances.iter().zip(&self.setters).zip(&self.tried) {
            let number = drawn.number(streams);
            if !(*low..=*high).contains(&number) {
                return None;
            }
            // By the text that a document would have, which has the same bits.
            let value = match drawn.value(number) {
                Value::String(text) => si_value(&text)?,
                Value::Float(value) => value,
                Value::Integer(value) => value as f64,
                _ => return None,
            };
            set(&mut scenario, value);
        }
        Some(scenario)
    }

    /// Whether it makes what the document makes, `told` being the scenario at a point.
    pub(super) fn agrees(
        &self,
        tolerances: &[Drawn],
        told: &Scenario<Method<f64>>,
        document: impl Fn(Streams) -> Result<Scenario<Method<f64>>, FileError>,
    ) -> bool {
        (0..TRIED).all(|trial| {
            let streams = Streams::new(told.seed, trial);
            let drawn = self.drawn(tolerances, told, streams);
            drawn.is_none_or(|drawn| document(streams).is_ok_and(|expected| expected == drawn))
        })
    }
}

/// Draws on which a setter is compared with the document, at each point.
const TRIED: u64 = 4;

#[cfg(test)]
mod tests {
    use standstill_sim::{Purpose, Tape};

    use crate::tests::plan;

    #[test]
    fn law_a_setter_makes_the_scenario_that_the_document_makes() {
        let text = |tolerances: &str| {
            format!("[axes]\nerrors = [\"default\", \"field\"]\n[tolerances]\n{tolerances}")
        };
        let typed = plan(&text(
            "\"motor.winding.resistance\" = { normal = \"5 %\" }\n\"sensors.noise\" = { uniform = \"30 %\", mean = \"10 mA\" }\n\
             \"inverter.diode_drop\" = { normal = \"0.1 V\", mean = \"1 V\" }\n\"sensors.bandwidth\" = { uniform = \"10 kHz\", mean = \"150 kHz\" }",
        ));
        assert!(typed.typed.is_some());
        let mut document = typed.clone();
        document.typed = None;
        for point in [0, 1] {
            let told = typed.scenario(point).expect("valid");
            let drawn = |plan: &crate::Plan, trial| plan.drawn(point, Some(&told), trial).expect("valid");
            for trial in 0..300 {
                assert_eq!(drawn(&typed, trial), drawn(&document, trial));
            }
            assert_ne!(drawn(&typed, 0), drawn(&typed, 1));
            assert_ne!(drawn(&typed, 0), told);
        }
        // Values beyond those that were tried are for the document to judge: a winding has no negative resistance.
        let wide = plan("trials = 3\n[tolerances]\n\"motor.winding.resistance\" = { normal = \"40 %\" }");
        assert!(wide.typed.is_some());
        let told = wide.scenario(0).expect("valid");
        let mut tape = Tape::new(told.seed, 0);
        wide.scenario_taped(0, &told, &tape).expect("tried");
        tape.normals_named(Purpose::Tolerance, "motor.winding.resistance")[0] = -4.0;
        let refused = wide.scenario_taped(0, &told, &tape).expect_err("negative").to_string();
        assert!(refused.contains("winding.resistance"), "{refused}");
        // Where a winding is hot, or a key has no setter, the document says what follows.
        let hot = "[rotor]\nwinding_temperature = \"90 °C\"\n[tolerances]\n\"motor.winding.resistance\" = { normal = \"5 %\" }";
        assert!(plan(hot).typed.is_none());
        assert!(plan(&text("\"motor.rotor.inertia\" = { normal = \"5 %\" }")).typed.is_none());
    }
}
