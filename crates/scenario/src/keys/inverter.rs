//! The keys of the inverter and its DC link.

use standstill_inverter::{DeviceKind, OpenLeg};
use standstill_quantity::Quantity;
use standstill_quantity::unit::{Farad, Hertz, Ohm, Second, Share, Volt};
use standstill_sim::Purpose;

use super::{NOT_NEGATIVE, Range, TIME, Usual, number, table};
use crate::named::Named;

/// Longest time in s that a detection may take. A sag that begins later would have no effect.
const LONGEST: f64 = 20.0;

/// Range of a share of the DC-link voltage.
const OF_VOLTAGE: Range =
    Range::new(0.0, 1.0, "a share from 0 to 1", "a rectifier's link is never below 0 V");

const DROP: Range =
    Range::new(0.0, 100.0, "from 0 to 100 V", "stacks for medium voltage drop some ten volts");

const SLOWEST_RIPPLE: &str = "from 0.1 Hz to 100 kHz: a rectifier's ripple has some hundred hertz, and a trial follows each of its periods";

table! {
    /// The inverter and its DC link.
    pub struct InverterTable = "inverter" of scenario {
        /// Voltage of the DC link. Default: the nominal one of the motor's data sheet.
        dc_link: Quantity<Volt> [scenario.drive.link.voltage] {
            range: Some(Range::new(1e-3, 1e6, "at least 1 mV, at most 1 MV", "a device alone drops a thousand times the least; links that carry power over land have less than the most")),
            usual: Some((5.0, Usual::NominalLink)), example: "\"550 V\"",
        };
        /// Amplitude of the DC link's ripple, a share of its voltage.
        ripple: Quantity<Share> [scenario.drive.link.ripple] {
            range: Some(OF_VOLTAGE), usual: Some((0.5, Usual::Whole)), draws: Some((Purpose::Ripple, 0..2)), example: "\"1 %\"",
        };
        /// Frequency of the DC link's ripple.
        ripple_frequency: Quantity<Hertz> [scenario.drive.link.ripple_frequency] {
            range: Some(Range::new(0.1, 1e5, SLOWEST_RIPPLE, "a trial follows each period")), example: "\"300 Hz\"",
        };
        /// Capacitance of the DC link; 0: none, the link has the source's voltage at any current.
        capacitance: Quantity<Farad> {
            range: Some(Range::new(0.0, 1e3, "from 0 to 1000 F", "a bank of supercapacitors has less")),
            get: |scenario| Some(number(scenario.drive.link.storage.map_or(0.0, |storage| storage.capacitance))),
            example: "\"500 uF\"",
        };
        /// Resistance through which the source feeds the capacitor.
        source_resistance: Quantity<Ohm> {
            range: Some(Range::new(1e-6, 1e6, "from 1 µΩ to 1 MΩ", "a busbar has more, and a larger one feeds nothing")),
            get: |scenario| scenario.drive.link.storage.map(|storage| number(storage.source_resistance)),
            example: "\"0.2 Ω\"",
        };
        /// Depth of a sag of the source, a share of the voltage: a smooth trough, deepest in its middle. 0: none.
        sag_depth: Quantity<Share> {
            range: Some(OF_VOLTAGE),
            get: |scenario| Some(number(scenario.drive.link.sag.map_or(0.0, |sag| sag.depth))),
            example: "\"20 %\"",
        };
        /// Start of the sag, after the start of the detection. Default: 0.
        sag_start: Quantity<Second> {
            range: Some(Range::new(0.0, LONGEST, "from 0 to 20 s", "no detection takes longer than 20 s by itself")),
            get: |scenario| Some(number(scenario.drive.link.sag.map_or(0.0, |sag| sag.start))),
            example: "\"2 ms\"",
        };
        /// Duration of the sag.
        sag_duration: Quantity<Second> {
            range: Some(Range::new(1e-6, LONGEST, "from 1 µs to 20 s", "no detection takes longer than 20 s by itself")),
            get: |scenario| scenario.drive.link.sag.map(|sag| number(sag.duration)),
            example: "\"10 ms\"",
        };
        /// Dead time.
        dead_time: Quantity<Second> [scenario.drive.dead_time] {
            range: Some(TIME), usual: Some((0.2, Usual::Carrier)), example: "\"2 us\"",
        };
        /// Standard deviation of the legs' switching delays.
        delay_mismatch: Quantity<Second> [scenario.drive.delay_mismatch] {
            range: Some(NOT_NEGATIVE), usual: Some((0.1, Usual::Carrier)), draws: Some((Purpose::GateDelay, 0..6)),
            example: "\"20 ns\"",
        };
        /// Frequency of the PWM carrier.
        carrier: Quantity<Hertz> {
            range: Some(Range::new(10.0, 1e6, "from 10 Hz to 1 MHz", "thyristors switch faster, gallium nitride slower")),
            get: |scenario| Some(number(1.0 / scenario.drive.carrier_period.seconds())),
            example: "\"10 kHz\"",
        };
        /// Kind of the switches. Default: MOSFETs if the motor's nominal DC-link voltage is at most 60 V, else IGBTs.
        devices: Named<DeviceKind> {
            get: |scenario| Some(scenario.drive.bridge.devices.kind.name().into()),
            example: "\"igbt\"",
        };
        /// Resistance of a MOSFET's channel, which conducts both ways while its gate is on.
        channel_resistance: Quantity<Ohm> [scenario.drive.bridge.devices.switch_resistance] {
            range: Some(NOT_NEGATIVE), usual: Some((0.2, Usual::LinkByDrop)),
            applies: |scenario| scenario.drive.bridge.devices.kind == DeviceKind::Mosfet,
            example: "\"5 mΩ\"",
        };
        /// Voltage across a conducting IGBT at no current.
        switch_drop: Quantity<Volt> [scenario.drive.bridge.devices.switch_drop] {
            range: Some(DROP), usual: Some((0.2, Usual::Link)),
            applies: |scenario| scenario.drive.bridge.devices.kind == DeviceKind::Igbt,
            example: "\"1 V\"",
        };
        /// Slope of the voltage across a conducting IGBT over its current.
        switch_resistance: Quantity<Ohm> [scenario.drive.bridge.devices.switch_resistance] {
            range: Some(NOT_NEGATIVE), usual: Some((0.2, Usual::LinkByDrop)),
            applies: |scenario| scenario.drive.bridge.devices.kind == DeviceKind::Igbt,
            example: "\"20 mΩ\"",
        };
        /// Voltage across a conducting diode at no current.
        diode_drop: Quantity<Volt> [scenario.drive.bridge.devices.diode_drop] {
            range: Some(DROP), usual: Some((0.2, Usual::Link)), example: "\"0.9 V\"",
        };
        /// Slope of the voltage across a conducting diode over its current.
        diode_resistance: Quantity<Ohm> [scenario.drive.bridge.devices.diode_resistance] {
            range: Some(NOT_NEGATIVE), usual: Some((0.2, Usual::LinkByDrop)), example: "\"15 mΩ\"",
        };
        /// Capacitance of each terminal to the negative rail, of switches and cable: a leg in which no device conducts charges it and
        /// rings with the winding. 0: none.
        terminal_capacitance: Quantity<Farad> {
            range: Some(Range::new(0.0, 1e-8, "0, or from 0.1 nF to 10 nF", "less rings too fast, more takes charges beyond this model").or_from(1e-10)),
            get: |scenario| Some(number(scenario.drive.bridge.terminal_capacitance)),
            example: "\"0 nF\"",
        };
        /// Resistance of the winding, one phase against the two others, at the frequency of the ringing with the terminals' capacitance: eddy
        /// currents in sheets and conductors make it far larger than for direct current. An LCR meter reads it in series with the inductance.
        terminal_resistance: Quantity<Ohm> {
            range: Some(NOT_NEGATIVE),
            get: |scenario| Some(number(scenario.drive.bridge.terminal_resistance)),
            applies: |scenario| scenario.drive.bridge.terminal_capacitance > 0.0,
            example: "\"1 kΩ\"",
        };
        /// Behaviour of a leg with both switches off. If terminals have a capacitance, its diodes conduct in every error set.
        open_leg: Named<OpenLeg> {
            get: |scenario| Some(scenario.drive.bridge.open_leg.name().into()),
            example: "\"diodes\"",
        };
    }
}
