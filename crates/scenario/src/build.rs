//! Builds the scenario, ready to run, from the tables of its file.

pub(crate) mod limits;
mod sensors;

use std::sync::Arc;

use standstill_detect::{ForeignSettings, Method, MethodName, Settings as _, Source};
use standstill_interface::{Dq, Nanos};
use standstill_inverter::{DeviceKind, Devices};
use standstill_numeric::Heading;
use standstill_plant::{Files, Motor, Temperature};
use standstill_quantity::unit::One;
use standstill_quantity::{Quantity, short};
use standstill_sim::{Adc, Arrangement, Case, RotorState, TerminalSensor};

use self::sensors::converter;
use super::document::FileError;
use super::keys::{DetectorTable, InverterTable, Table, check, unworkable};
use super::named::Named;
use super::rotor::Memory;
use super::tables::ScenarioFile;
use crate::errors::device_kind;
use crate::known::{nameplate, sources};
use crate::scenario::tolerance;
use crate::{DriveSettings, Given, Hosted, Scenario, faults};

impl ScenarioFile {
    /// Builds and checks the scenario. Relative paths in the file start at the folder of `files`.
    ///
    /// # Errors
    /// A value is invalid; the error names its key.
    pub fn scenario(&self, files: &Files) -> Result<Scenario<Method<f64>>, FileError> {
        self.scenario_of(&self.motor(files)?, files)
    }

    /// Returns the methods that work with the readings of this drive: currents, terminal voltages or captured times.
    pub fn served(&self) -> Vec<MethodName> {
        let arrangement = self.sensors.arrangement.map_or(Arrangement::ThreeInLine, |Named(place)| place);
        let timer = self.sensors.timer.is_some_and(|tick| tick.value() > 0.0);
        let there = sources(arrangement, self.sensors.terminals == Some(true), timer);
        let served = |method: &MethodName| Source::any_of(method.sources(), &there);
        MethodName::ALL.into_iter().filter(served).collect()
    }

    /// Builds the motor from its data sheet.
    pub(super) fn motor(&self, files: &Files) -> Result<Motor, FileError> {
        self.motor.sheet(files)?.motor().map_err(|error| self.motor.wrong(error))
    }

    /// Builds the scenario with a motor that was already built, and checks the scenario.
    pub(super) fn scenario_of(
        &self,
        motor: &Motor,
        files: &Files,
    ) -> Result<Scenario<Method<f64>>, FileError> {
        let scenario = self.assemble(motor, files)?;
        if self.detector.python.is_none() {
            check_sensors(self.detector.method(), &scenario)?;
            scenario.try_detector().map_err(|error| unworkable(&scenario, &error))?;
        }
        Ok(scenario)
    }

    /// Returns the temperatures of winding and magnets that the file sets.
    pub(super) fn temperature(&self) -> Temperature {
        Temperature {
            winding: self.rotor.winding_temperature.map(Quantity::value),
            magnet: self.rotor.magnet_temperature.map(Quantity::value),
        }
    }

    /// Builds the scenario with a motor that was already built. Does not check that the method can work with its settings.
    pub(super) fn assemble(&self, motor: &Motor, files: &Files) -> Result<Scenario<Method<f64>>, FileError> {
        check("trials", &Quantity::<One>::si(self.trials as f64))?;
        self.limit.iter().try_for_each(|limit| check("limit", limit))?;
        self.stop_at.check()?;
        self.rotor.check()?;
        self.inverter.check()?;
        self.sensors.check()?;
        self.detector.check()?;
        let kind = self.inverter.devices.map_or_else(|| device_kind(motor), |Named(kind)| kind);
        let drive = self.errors.0.drive(motor, kind);
        let mut scenario = Scenario {
            motor: motor
                .at_temperature(self.temperature())
                .map_err(|error| FileError::temperature(&error))?,
            rotor: self.rotor_state(motor)?,
            start_angle: self.rotor.angle.map(|angle| angle.value().to_radians()),
            load_torque: 0.0,
            start_speed: 0.0,
            acceleration: 0.0,
            memory: self.rotor.memory.is_some_and(|Named(memory)| memory == Memory::Former),
            drive,
            sensors: self.errors.0.sensors(motor.rated_current, drive.link.voltage),
            faults: Vec::new(),
            // A placeholder: the method's default settings depend on the drive, which is not complete yet.
            detector: Method::Foreign(ForeignSettings::new()),
            foreign: None,
            hosted: None,
            time_limit: Case::TIME_LIMIT,
            tolerance: tolerance(motor),
            seed: self.seed,
        };
        if scenario.memory {
            check_memory(&scenario.motor)?;
        }
        self.rotor.set(&mut scenario);
        if scenario.start_speed != 0.0 && !matches!(scenario.rotor, RotorState::Free | RotorState::Driven) {
            let found = "a speed of a rotor that is held";
            return Err(FileError::key("rotor.speed", found, "`rotor.state` \"free\" or \"driven\""));
        }
        if scenario.acceleration != 0.0 && scenario.rotor != RotorState::Driven {
            let found = if scenario.rotor == RotorState::Free {
                "an acceleration of a rotor that is free, which its torques accelerate"
            } else {
                "an acceleration of a rotor that is held"
            };
            return Err(FileError::key("rotor.acceleration", found, "`rotor.state` \"driven\""));
        }
        if scenario.load_torque != 0.0 && scenario.rotor == RotorState::Locked {
            let found = "a load on a locked rotor, which it cannot move";
            return Err(FileError::key("rotor.load", found, "`rotor.state` \"free\" or \"brake\""));
        }
        self.inverter.set(&mut scenario);
        self.inverter.apply_rules(&mut scenario.drive)?;
        self.inverter.apply_terminals(&mut scenario.drive.bridge, motor)?;
        let provider = self.detector.provider(self.hosted.as_ref())?;
        let library = self.detector.load_library(files)?;
        if let Some(library) = &library {
            DetectorTable::adopt_pwm(library, &mut scenario.drive, self.inverter.carrier.is_some())?;
        }
        check_channel(&scenario.drive.bridge.devices, motor.rated_current)?;
        let InverterTable { switch_resistance, channel_resistance, diode_resistance, .. } = &self.inverter;
        let switches = switch_resistance.is_some() || channel_resistance.is_some();
        limits::check(&scenario, [switches, diode_resistance.is_some()])?;
        scenario.sensors.terminal = self.dividers(motor, &scenario.drive)?;
        self.sensors.set(&mut scenario);
        self.sensors.apply_rules(self.errors.0, &mut scenario.sensors)?;
        check_load(&scenario, motor.rated_current)?;
        scenario.sensors.dc_link.adc = self.link_converter(motor, scenario.drive.link.voltage)?;
        scenario.faults = faults::settings(&self.faults, &scenario)?;
        scenario.motor = faults::demagnetise(&scenario.faults, scenario.motor)?;
        self.detector.set(&mut scenario);
        // The nameplate has the motor's values of the data sheet, not those at the set temperatures.
        let mut nameplate = nameplate(motor, &scenario.drive, &scenario.sensors);
        if let Some(Named(signature)) = self.detector.signature {
            (nameplate.signature, nameplate.pulse_signature) = (signature, signature);
        }
        faults::misinform(&scenario.faults, &mut nameplate);
        if let Some(dead_time) = self.detector.dead_time {
            nameplate.dead_time = Nanos::from_seconds(dead_time.value());
        }
        let maker = |library| self.detector.maker(library, &nameplate, &scenario.sensors);
        scenario.foreign = library.map(maker).transpose()?;
        if let Some(provider) = provider {
            let config = self.detector.config().map(|(key, value)| (key.clone(), value.clone())).collect();
            let given = Given { nameplate, sensors: scenario.sensors, config };
            scenario.hosted = Some(Hosted { provider: Arc::clone(provider), given: Arc::new(given) });
        } else if scenario.foreign.is_none() {
            scenario.detector = Method::suited(self.detector.method(), &nameplate);
            self.detector.apply(&mut scenario.detector, nameplate.polarity_difference)?;
        }
        Ok(scenario)
    }

    fn rotor_state(&self, motor: &Motor) -> Result<RotorState, FileError> {
        self.rotor.state().state(motor).ok_or_else(|| {
            let needed = "a motor whose data sheet has `rotor.brake_backlash`, or \"locked\"";
            FileError::key("rotor.state", "\"brake\"", needed)
        })
    }

    /// Returns the voltage dividers at the terminals of a drive. The error set gives their errors; the file may change the range and the
    /// number of bits of their A/D converter. Returns none if the drive does not read its terminals.
    fn dividers(&self, motor: &Motor, drive: &DriveSettings) -> Result<Option<TerminalSensor>, FileError> {
        let sensors = &self.sensors;
        if sensors.terminals != Some(true) {
            let mut of_dividers =
                sensors.set_values().filter(|(key, _)| key.path.starts_with("sensors.terminal_"));
            return of_dividers.next().map_or(Ok(None), |(key, value)| {
                let needed = "`sensors.terminals` = true beside it: without it the drive has no dividers at its terminals";
                Err(FileError::key(key.path, &value.readable(key.allowed().unwrap_or_default()), needed))
            });
        }
        let mut of = self.errors.0.dividers(motor.rated_current, drive);
        let range = sensors.terminal_range.map(|range| [0.0, range.value()]);
        of.adc = converter("sensors.terminal", of.adc, range, sensors.terminal_bits)?;
        Ok(Some(of))
    }

    /// Returns the A/D converter of the DC-link voltage sensor. `dc_link` is the voltage of the DC link in V. Returns none if neither the
    /// error set nor the file defines a converter.
    pub(super) fn link_converter(&self, motor: &Motor, dc_link: f64) -> Result<Option<Adc>, FileError> {
        let adc = self.errors.0.sensors(motor.rated_current, dc_link).dc_link.adc;
        let range = self.sensors.dc_link_range.map(|range| [0.0, range.value()]);
        converter("sensors.dc_link", adc, range, self.sensors.dc_link_bits)
    }
}

/// Checks that the drive has the readings that a method needs.
fn check_sensors(method: MethodName, scenario: &Scenario<Method<f64>>) -> Result<(), FileError> {
    if scenario.serves(&scenario.detector) {
        return Ok(());
    }
    let each = |sources: &[Source], of: fn(Source) -> &'static str| {
        sources.iter().map(|source| of(*source)).collect::<Vec<_>>().join(" or ")
    };
    let there = scenario.sources();
    // The readings that any settings of the method can use. If the drive has one of them: those that the chosen
    // settings use.
    let other_settings = Source::any_of(method.sources(), &there);
    let needs = if other_settings { scenario.detector.sources() } else { method.sources() };
    let has = if there.is_empty() {
        "neither currents nor voltages of its terminals".to_owned()
    } else {
        each(&there, Source::words)
    };
    let found =
        format!("\"{method}\", which reads {}, on a drive that reads {has}", each(needs, Source::words));
    let able =
        MethodName::ALL.iter().filter(|name| **name != method && Source::any_of(name.sources(), &there));
    let able: Vec<String> = able.map(|name| format!("\"{name}\"")).collect();
    let instead = if able.is_empty() { String::new() } else { format!(", or one of {}", able.join(", ")) };
    let timed = if other_settings && there.contains(&Source::CapturedTimes) {
        "`detector.timed` true, or "
    } else {
        ""
    };
    let needed = format!("{timed}{}{instead}", each(needs, Source::setting));
    Err(FileError::key("detector.method", &found, &needed))
}

/// Checks that the motor's iron has hysteresis. Also checks that the core model covers the coercive current in all directions, because
/// remanence acts on the core like a current of this size.
pub(super) fn check_memory(motor: &Motor) -> Result<(), FileError> {
    let circuit = &motor.magnetics;
    let Some(hysteresis) = circuit.hysteresis() else {
        let needed = "\"virgin\", or a motor whose data sheet has a `[hysteresis]`";
        return Err(FileError::key("rotor.memory", "\"former\"", needed));
    };
    // The directions include d and q, along which a map ends. A trial that leaves the map in another direction fails
    // with an error.
    let around = |parts: u8| {
        (0..parts).map(move |n| Heading::of(f64::from(n) * (std::f64::consts::TAU / f64::from(parts))))
    };
    let rotors = if circuit.harmonics().any() { 24 } else { 1 };
    for (last, rotor) in around(24).flat_map(|last| around(rotors).map(move |rotor| (last, rotor))) {
        let left = Dq::new(last.cos, last.sin) * -hysteresis.coercive_current;
        circuit.flux_at(left, rotor).map_err(|error| {
            let needed = format!("\"virgin\": the motor's core does not know all currents that its iron may be left with: {error}");
            FileError::key("rotor.memory", "\"former\"", &needed)
        })?;
    }
    Ok(())
}

/// Largest current at which the voltage drop of a MOSFET's channel is checked, as a multiple of the rated current. The current sensors clip
/// at this current.
const MOST_CURRENT: f64 = 2.5;

/// Checks that a MOSFET's channel drops less voltage than its body diode at currents up to [`MOST_CURRENT`]. The reason is that the
/// simulation does not model a diode that conducts in parallel to the channel.
pub(super) fn check_channel(devices: &Devices, rated_current: f64) -> Result<(), FileError> {
    let drop = devices.switch_resistance * MOST_CURRENT * rated_current;
    if devices.kind == DeviceKind::Igbt || drop <= devices.diode_drop {
        return Ok(());
    }
    let most = 1e3 * devices.diode_drop / (MOST_CURRENT * rated_current);
    let found = format!("{} mΩ", 1e3 * devices.switch_resistance);
    let needed = format!(
        "at most {most:.3} mΩ, or an `inverter.diode_drop` of at least {}: a channel that drops more than its body diode ({} V now) at {MOST_CURRENT} times the rated current shares it with the diode, which is not simulated",
        format_args!("{} V", short(1.001 * drop)),
        devices.diode_drop
    );
    Err(FileError::key("inverter.channel_resistance", &found, &needed))
}

/// Largest current through a divider, as a share of the rated current.
const MOST_LOAD: f64 = 1e-3;

/// Checks that the dividers draw a negligible current, because the equations of the winding neglect this current. If the terminals have a
/// capacitance, also checks that the terminal voltage oscillates in spite of the dividers, because overdamped terminals are not simulated.
fn check_load(scenario: &Scenario<Method<f64>>, rated_current: f64) -> Result<(), FileError> {
    let Some(load) = scenario.sensors.terminal.and_then(|of| of.resistance) else { return Ok(()) };
    let of_current = scenario.drive.link.voltage / (MOST_LOAD * rated_current);
    let of_ringing = super::terminals::slowest_impedance(&scenario.drive.bridge, &scenario.motor);
    let least = of_current.max(of_ringing);
    if load >= least {
        return Ok(());
    }
    let why = if of_ringing > of_current {
        "√(3 L/C) of winding and `inverter.terminal_capacitance`: a solution that does not ring is not simulated"
    } else {
        "through which the link drives a thousandth of the rated current: a divider's current is left out of the winding's"
    };
    let needed = format!("at least {least:.0} Ω, {why}");
    Err(FileError::key("sensors.terminal_load", &format!("{load} Ω"), &needed))
}

impl InverterTable {
    /// Checks the rules between the inverter's keys, and sets the numbers that depend on several keys.
    fn apply_rules(&self, drive: &mut DriveSettings) -> Result<(), FileError> {
        let is_mosfet = drive.bridge.devices.kind == DeviceKind::Mosfet;
        self.needs(
            &["inverter.switch_drop", "inverter.switch_resistance"],
            !is_mosfet,
            "`inverter.devices` \"igbt\", or `inverter.channel_resistance`: a MOSFET's channel is a resistance without threshold",
        )?;
        self.needs(
            &["inverter.channel_resistance"],
            is_mosfet,
            "`inverter.devices` \"mosfet\", or `inverter.switch_resistance`: an IGBT has no channel",
        )?;
        if let Some(carrier) = self.carrier {
            drive.carrier_period = Nanos::from_seconds(1.0 / carrier.value());
        }
        drive.link.storage = self.storage()?;
        drive.link.sag = self.sag()?;
        if let Some(Named(open_leg)) = self.open_leg {
            drive.bridge.open_leg = open_leg;
        }
        Ok(())
    }
}
