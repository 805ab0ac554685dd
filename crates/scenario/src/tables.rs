//! The tables of a scenario file. What is left out is as the error set has it, or as the method suits the motor.

use std::fmt::Write as _;

use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use standstill_inverter::{DeviceKind, OpenLeg};
use standstill_quantity::Quantity;
use standstill_quantity::unit::{
    Ampere, Celsius, Degree, Farad, Hertz, NewtonMetre, Ohm, One, Second, Share, Volt,
};
use standstill_sim::Arrangement;
use toml::Value;

use super::axes::{AxisSpec, DesignTable, Point, points};
use super::detector::DetectorTable;
use super::document::FileError;
use super::motor::MotorSpec;
use super::named::Named;
use super::rotor::Memory;
use super::tolerances::Tolerance;
use crate::{ErrorSet, Rotor};

/// A scenario: motor, drive, sensors, rotor, detector, how many trials.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScenarioFile {
    /// A built-in motor's name, the path of a data sheet (.toml), or a table: a data sheet in place, or what differs from
    /// the motor that its key `base` names.
    #[serde(default)]
    pub motor: MotorSpec,
    /// How good drive and sensors are, as far as the tables below do not say otherwise.
    #[serde(default)]
    pub errors: Named<ErrorSet>,
    /// How many trials, or how many at each point of the axes.
    #[serde(default = "trials")]
    pub trials: u64,
    /// Seed of all random numbers.
    #[serde(default = "seed", with = "super::seed")]
    #[schemars(with = "super::seed::SeedSchema")]
    pub seed: u64,
    /// How narrow the intervals must be for a point to end before all its trials are done.
    #[serde(default, skip_serializing_if = "is_default")]
    pub stop_at: StopTable,
    /// The angle error whose exceedance is counted, wrong poles included. Without it, 2°.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limit: Option<Quantity<Degree>>,
    /// The rotor and what pulls at it.
    #[serde(default, skip_serializing_if = "is_default")]
    pub rotor: RotorTable,
    /// The inverter and its DC link.
    #[serde(default, skip_serializing_if = "is_default")]
    pub inverter: InverterTable,
    /// The sensors.
    #[serde(default, skip_serializing_if = "is_default")]
    pub sensors: SensorsTable,
    /// The method and its settings.
    #[serde(default)]
    pub detector: DetectorTable,
    /// Keys that are varied, such as `"sensors.noise"`.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub axes: IndexMap<String, AxisSpec>,
    /// Which points of the axes are run.
    #[serde(default, skip_serializing_if = "is_default")]
    pub design: DesignTable,
    /// Keys whose value each trial draws.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub tolerances: IndexMap<String, Tolerance>,
}

fn is_default<T: Default + PartialEq>(table: &T) -> bool {
    *table == T::default()
}

const fn trials() -> u64 {
    1000
}

const fn seed() -> u64 {
    1
}

/// How narrow the 95 % intervals must be for a point to end; all that are given count. They are looked at when 100
/// trials are done, and again each time a quarter more are, so that a run ends with the same trial on any machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct StopTable {
    /// Half the interval of the rms error, as a share of the rms error.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rms: Option<Quantity<Share>>,
    /// Half the interval of the probability of a wrong pole.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wrong_poles: Option<Quantity<Share>>,
}

impl StopTable {
    /// Whether nothing is asked for.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// The rotor and what pulls at it.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RotorTable {
    /// Whether it can move.
    pub state: Named<Rotor>,
    /// Electrical angle at the start, the same in all trials. Without it each trial draws its own, uniformly.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle: Option<Quantity<Degree>>,
    /// Torque that a load exerts against forward motion, also at standstill.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub load: Option<Quantity<NewtonMetre>>,
    /// What the stator's iron remembers at the start, of a motor whose data sheet has a `[hysteresis]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory: Option<Named<Memory>>,
    /// Temperature of the winding. The drive is not told.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub winding_temperature: Option<Quantity<Celsius>>,
    /// Temperature of the magnets. The drive is not told.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub magnet_temperature: Option<Quantity<Celsius>>,
}

/// The inverter and its DC link.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct InverterTable {
    /// Voltage of the DC link. Without it, the motor's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dc_link: Option<Quantity<Volt>>,
    /// Amplitude of the DC link's ripple, a share of its voltage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ripple: Option<Quantity<Share>>,
    /// Frequency of the DC link's ripple.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ripple_frequency: Option<Quantity<Hertz>>,
    /// Capacitor of the DC link; 0: none, the link has the source's voltage whatever flows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub capacitance: Option<Quantity<Farad>>,
    /// Resistance through which the source feeds the capacitor.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source_resistance: Option<Quantity<Ohm>>,
    /// Depth of a sag of the source, a share of the voltage: a smooth trough, deepest in its middle. 0: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sag_depth: Option<Quantity<Share>>,
    /// When the sag begins, after the start of the detection. Without it, at once.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sag_start: Option<Quantity<Second>>,
    /// How long the sag lasts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sag_duration: Option<Quantity<Second>>,
    /// Dead time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dead_time: Option<Quantity<Second>>,
    /// Standard deviation of the legs' switching delays.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub delay_mismatch: Option<Quantity<Second>>,
    /// Frequency of the PWM carrier.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub carrier: Option<Quantity<Hertz>>,
    /// What the switches are. Without it, MOSFETs where the motor's DC link is at most 60 V, else IGBTs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub devices: Option<Named<DeviceKind>>,
    /// Resistance of a MOSFET's channel, which conducts both ways while its gate is on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub channel_resistance: Option<Quantity<Ohm>>,
    /// Voltage across a conducting IGBT.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub switch_drop: Option<Quantity<Volt>>,
    /// Slope of the voltage across a conducting IGBT over its current.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub switch_resistance: Option<Quantity<Ohm>>,
    /// Voltage across a conducting diode.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub diode_drop: Option<Quantity<Volt>>,
    /// Slope of the voltage across a conducting diode over its current.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub diode_resistance: Option<Quantity<Ohm>>,
    /// Capacitance of each terminal to the negative rail, of switches and cable: a leg in which no device conducts charges it and
    /// rings with the winding. 0: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub terminal_capacitance: Option<Quantity<Farad>>,
    /// Resistance of the winding, one phase against the two others, to what rings with the terminals' capacitance: eddy currents in sheets and
    /// conductors make it far larger than for direct current. An LCR meter reads it in series with the inductance, at the frequency
    /// of the ringing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub terminal_resistance: Option<Quantity<Ohm>>,
    /// What a leg with both switches off does. Where terminals have a capacitance its diodes conduct, in every error set.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub open_leg: Option<Named<OpenLeg>>,
}

/// The sensors. Deviations are those between specimens, of which each trial draws one.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SensorsTable {
    /// Where the current sensors sit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arrangement: Option<Named<Arrangement>>,
    /// Standard deviation of each phase's gain.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gain_error: Option<Quantity<Share>>,
    /// Standard deviation of each phase's offset.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub offset: Option<Quantity<Ampere>>,
    /// Noise of each sample, rms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise: Option<Quantity<Ampere>>,
    /// Nominal corner frequency of the current sensors' first-order filters, which the drive knows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bandwidth: Option<Quantity<Hertz>>,
    /// By how much, either way and uniformly, a specimen's corner frequencies are off in common.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bandwidth_tolerance: Option<Quantity<Share>>,
    /// By how much, either way and uniformly, each phase's corner frequency is off beside what all are off in common.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bandwidth_mismatch: Option<Quantity<Share>>,
    /// How much later than phase a the converter takes phase b, and phase c than phase b.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skew: Option<Quantity<Second>>,
    /// Amplitude of what an edge of a leg's potential adds to all readings of current.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pick_up: Option<Quantity<Ampere>>,
    /// Time constant with which decays what an edge adds to the readings.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pick_up_decay: Option<Quantity<Second>>,
    /// Frequency with which rings what an edge adds to the readings.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pick_up_frequency: Option<Quantity<Hertz>>,
    /// Range of the current converters, either way.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range: Option<Quantity<Ampere>>,
    /// Bits of the current converters; 0: nothing is rounded, the range stays.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bits: Option<Quantity<One>>,
    /// A trigger is off by up to this much, uniformly, either way.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jitter: Option<Quantity<Second>>,
    /// All triggers are late by this much.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sample_delay: Option<Quantity<Second>>,
    /// Standard deviation of the DC-link sensor's gain.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dc_link_gain_error: Option<Quantity<Share>>,
    /// Standard deviation of the DC-link sensor's offset.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dc_link_offset: Option<Quantity<Volt>>,
    /// Noise of the DC-link sensor's samples, rms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dc_link_noise: Option<Quantity<Volt>>,
    /// Range of the DC link's converter, from zero.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dc_link_range: Option<Quantity<Volt>>,
    /// Bits of the DC link's converter; 0: nothing is rounded, the range stays.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dc_link_bits: Option<Quantity<One>>,
    /// Standard deviation of the resolver that stands for "measured angle" in traces.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resolver_error: Option<Quantity<Degree>>,
}

impl ScenarioFile {
    /// As a file would say it. Axes stay in their order, which is that of the points: tables of their own would be moved
    /// behind plain values.
    ///
    /// # Errors
    /// Values that TOML does not have.
    pub fn text(&self) -> Result<String, FileError> {
        let wrong =
            |error: toml::ser::Error| FileError::key("scenario", &error.to_string(), "values that TOML has");
        let mut table = Self { axes: IndexMap::new(), ..self.clone() };
        table.detector.library_is_an_axis = self.axes.contains_key("detector.library");
        // By way of values: what is derived for the tables is then compiled for them, and not for each way in which TOML writes a table.
        let mut text = toml::to_string(&Value::try_from(table).map_err(wrong)?).map_err(wrong)?;
        if !self.axes.is_empty() {
            text += "\n[axes]\n";
        }
        for (key, axis) in &self.axes {
            let [key, axis] = [Value::try_from(key).map_err(wrong)?, Value::try_from(axis).map_err(wrong)?];
            let _ = writeln!(text, "{key} = {axis}");
        }
        Ok(text)
    }

    /// The points of its axes.
    ///
    /// # Errors
    /// Axes or a design that make none.
    pub fn points(&self) -> Result<Vec<Point>, FileError> {
        let axes: Vec<_> = self.axes.iter().map(|(key, spec)| (key.clone(), spec.clone())).collect();
        points(&axes, self.design, self.seed)
    }
}
