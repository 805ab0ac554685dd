//! From the tables to a scenario.

use standstill_detect::{ForeignSettings, Method};
use standstill_interface::{Dq, Nanos};
use standstill_inverter::{DeviceKind, Devices};
use standstill_numeric::Heading;
use standstill_plant::{Files, Motor, Temperature};
use standstill_quantity::Quantity;
use standstill_sim::{Adc, Case, PickUp, RotorState, SensorSettings};

use super::detector::{DetectorTable, unworkable};
use super::document::FileError;
use super::named::Named;
use super::ranges::{checked, checked_bits, checked_time, in_range, start_angle};
use super::rotor::Memory;
use super::tables::{InverterTable, ScenarioFile, SensorsTable};
use crate::errors::{PICK_UP, device_kind};
use crate::scenario::{nameplate, tolerance};
use crate::{DriveSettings, Scenario};

impl ScenarioFile {
    /// The scenario. Paths in the file are from the folder of `files`.
    ///
    /// # Errors
    /// A value that cannot be, with its key.
    pub fn scenario(&self, files: &Files) -> Result<Scenario<Method<f64>>, FileError> {
        self.scenario_of(&self.motor(files)?, files)
    }

    /// The motor.
    pub(super) fn motor(&self, files: &Files) -> Result<Motor, FileError> {
        self.motor.sheet(files)?.motor().map_err(|error| self.motor.wrong(error))
    }

    /// The scenario, with a motor that is already there.
    pub(super) fn scenario_of(
        &self,
        motor: &Motor,
        files: &Files,
    ) -> Result<Scenario<Method<f64>>, FileError> {
        let scenario = self.assemble(motor, files)?;
        if self.detector.python.is_none() {
            scenario.try_detector().map_err(|error| unworkable(&scenario.detector, &error))?;
        }
        Ok(scenario)
    }

    /// The sensors beside this motor on a DC link of this many volts.
    pub(super) fn sensors_of(&self, motor: &Motor, dc_link: f64) -> Result<SensorSettings, FileError> {
        let mut sensors = self.errors.0.sensors(motor.rated_current, dc_link);
        self.sensors.apply(&mut sensors)?;
        Ok(sensors)
    }

    /// Temperatures of winding and magnets, where they are told.
    pub(super) fn temperature(&self) -> Temperature {
        Temperature {
            winding: self.rotor.winding_temperature.map(Quantity::value),
            magnet: self.rotor.magnet_temperature.map(Quantity::value),
        }
    }

    /// The same, also where the method's settings cannot work.
    pub(super) fn assemble(&self, motor: &Motor, files: &Files) -> Result<Scenario<Method<f64>>, FileError> {
        if self.trials == 0 {
            return Err(FileError::key("trials", "0", "at least 1"));
        }
        if let Some(limit) = self.limit {
            in_range("limit", limit, [0.0, 180.0], "from 0 to 180 degrees")?;
        }
        let precisions =
            [("stop_at.rms", self.stop_at.rms), ("stop_at.wrong_poles", self.stop_at.wrong_poles)];
        for (key, precision) in precisions {
            if let Some(precision) = precision {
                in_range(key, precision, [1e-6, 1.0], "from 1e-6 to 1, or 0.0001 % to 100 %")?;
            }
        }
        let errors = self.errors.0;
        let kind = self.inverter.devices.map_or_else(|| device_kind(motor), |Named(kind)| kind);
        let mut drive = errors.drive(motor, kind);
        self.inverter.apply(&mut drive)?;
        self.inverter.apply_terminals(&mut drive.bridge, motor)?;
        let hosted = self.detector.is_hosted()?;
        let library = self.detector.load_library(files)?;
        if let Some(library) = &library {
            DetectorTable::adopt_pwm(library, &mut drive, self.inverter.carrier.is_some())?;
        }
        check_channel(&drive.bridge.devices, motor.rated_current)?;
        let sensors = self.sensors_of(motor, drive.link.voltage)?;
        let hot = motor.at_temperature(self.temperature()).map_err(|error| FileError::temperature(&error))?;
        let rotor = self.rotor.state.0.state(motor).ok_or_else(|| {
            let needed = "a motor whose data sheet has `rotor.brake_backlash`, or \"locked\"";
            FileError::key("rotor.state", "\"brake\"", needed)
        })?;
        let memory = self.rotor.memory.is_some_and(|Named(memory)| memory == Memory::Former);
        if memory {
            check_memory(&hot)?;
        }
        let load_torque = self.rotor.load.map_or(0.0, Quantity::value);
        if load_torque != 0.0 && rotor == RotorState::Locked {
            return Err(FileError::key(
                "rotor.load",
                "a load on a locked rotor, which it cannot move",
                "`rotor.state` \"free\" or \"brake\"",
            ));
        }
        // The drive is told of the motor of the data sheet, whatever its temperature is.
        let mut nameplate = nameplate(motor, &drive, &sensors);
        if let Some(Named(signature)) = self.detector.signature {
            (nameplate.signature, nameplate.pulse_signature) = (signature, signature);
        }
        if let Some(dead_time) = self.detector.dead_time {
            let seconds = in_range("detector.dead_time", dead_time, [0.0, 1.0], "from 0 to 1 s")?;
            nameplate.dead_time = Nanos::from_seconds(seconds);
        }
        let time_limit = match self.detector.time_limit {
            Some(limit) => {
                let needed = "from 1 ms to 1000 s of simulated time";
                Nanos::from_seconds(in_range("detector.time_limit", limit, [1e-3, 1e3], needed)?)
            }
            None => Case::TIME_LIMIT,
        };
        self.detector.call_limit()?;
        let maker = |library| self.detector.maker(library, &nameplate, &sensors, time_limit);
        let foreign = library.map(maker).transpose()?;
        let mut detector = Method::Foreign(ForeignSettings::new());
        if foreign.is_none() && !hosted {
            detector = Method::suited(self.detector.method.0, &nameplate);
            self.detector.apply(&mut detector, nameplate.polarity_difference)?;
        }
        Ok(Scenario {
            motor: hot,
            rotor,
            start_angle: self.rotor.angle.map(start_angle).transpose()?,
            load_torque,
            memory,
            drive,
            sensors,
            detector,
            foreign,
            time_limit,
            tolerance: tolerance(motor),
            seed: self.seed,
        })
    }
}

/// Whether a motor's iron can remember former operation: without current it may then be anywhere within its coercive current.
pub(super) fn check_memory(motor: &Motor) -> Result<(), FileError> {
    let circuit = &motor.magnetics;
    let Some(hysteresis) = circuit.hysteresis() else {
        let needed = "\"virgin\", or a motor whose data sheet has a `[hysteresis]`";
        return Err(FileError::key("rotor.memory", "\"former\"", needed));
    };
    // Where a map ends along d or q is among these; a trial that finds an end between them fails, and says so.
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

/// Sets what the table has.
macro_rules! set {
    ($table:literal, $self:ident, $($key:ident => $to:expr, $with:expr;)*) => {
        $(if let Some(value) = $self.$key {
            $to = $with(concat!($table, ".", stringify!($key)), value)?;
        })*
    };
}

/// Beyond this current, as a multiple of the rated one, the sensors see nothing.
const MOST_CURRENT: f64 = 2.5;

/// A MOSFET's channel drops less than its body diode at all currents that matter: a diode that carries a share of the current
/// beside the channel is not modelled.
pub(super) fn check_channel(devices: &Devices, rated_current: f64) -> Result<(), FileError> {
    let drop = devices.switch_resistance * MOST_CURRENT * rated_current;
    if devices.kind == DeviceKind::Igbt || drop <= devices.diode_drop {
        return Ok(());
    }
    let most = 1e3 * devices.diode_drop / (MOST_CURRENT * rated_current);
    let found = format!("{} mΩ", 1e3 * devices.switch_resistance);
    let needed = format!(
        "at most {most:.3} mΩ, which drop as much as the body diode (`inverter.diode_drop`, {} V) at {MOST_CURRENT} times the rated current: a diode that conducts beside its channel is not simulated",
        devices.diode_drop
    );
    Err(FileError::key("inverter.channel_resistance", &found, &needed))
}

impl InverterTable {
    fn apply(&self, drive: &mut DriveSettings) -> Result<(), FileError> {
        let igbt = [
            ("inverter.switch_drop", self.switch_drop.map(|value| value.to_string())),
            ("inverter.switch_resistance", self.switch_resistance.map(|value| value.to_string())),
        ];
        for (key, value) in igbt {
            if let (Some(value), DeviceKind::Mosfet) = (value, drive.bridge.devices.kind) {
                let needed = "`inverter.devices` \"igbt\", or `inverter.channel_resistance`: a MOSFET's channel is a resistance without threshold";
                return Err(FileError::key(key, &value, needed));
            }
        }
        set!("inverter", self,
            dc_link => drive.link.voltage, checked;
            ripple => drive.link.ripple, checked;
            ripple_frequency => drive.link.ripple_frequency, checked;
            dead_time => drive.dead_time, checked_time;
            delay_mismatch => drive.delay_mismatch, checked;
            switch_drop => drive.bridge.devices.switch_drop, checked;
            switch_resistance => drive.bridge.devices.switch_resistance, checked;
            diode_drop => drive.bridge.devices.diode_drop, checked;
            diode_resistance => drive.bridge.devices.diode_resistance, checked;
        );
        if let Some(carrier) = self.carrier {
            let frequency = checked("inverter.carrier", carrier)?;
            drive.carrier_period = Nanos::from_seconds(1.0 / frequency);
        }
        let devices = &mut drive.bridge.devices;
        match (devices.kind, self.channel_resistance) {
            (DeviceKind::Mosfet, Some(value)) => {
                devices.switch_resistance = checked("inverter.channel_resistance", value)?;
            }
            (DeviceKind::Igbt, Some(value)) => {
                let needed =
                    "`inverter.devices` \"mosfet\", or `inverter.switch_resistance`: an IGBT has no channel";
                return Err(FileError::key("inverter.channel_resistance", &value.to_string(), needed));
            }
            (_, None) => {}
        }
        drive.link.storage = self.storage()?;
        drive.link.sag = self.sag()?;
        if let Some(Named(open_leg)) = self.open_leg {
            drive.bridge.open_leg = open_leg;
        }
        Ok(())
    }
}

impl SensorsTable {
    fn apply(&self, sensors: &mut SensorSettings) -> Result<(), FileError> {
        set!("sensors", self,
            gain_error => sensors.gain_error, checked;
            offset => sensors.offset, checked;
            noise => sensors.noise, checked;
            bandwidth_tolerance => sensors.bandwidth_tolerance, checked;
            bandwidth_mismatch => sensors.bandwidth_mismatch, checked;
            skew => sensors.skew, checked_time;
            jitter => sensors.jitter, checked_time;
            sample_delay => sensors.sample_delay, checked_time;
            dc_link_gain_error => sensors.dc_link.gain_error, checked;
            dc_link_offset => sensors.dc_link.offset, checked;
            dc_link_noise => sensors.dc_link.noise, checked;
        );
        if let Some(bandwidth) = self.bandwidth {
            let corner = checked("sensors.bandwidth", bandwidth)?;
            sensors.bandwidth = (corner > 0.0).then_some(corner);
        }
        sensors.pick_up = self.pick_up(sensors.pick_up)?;
        if let Some(error) = self.resolver_error {
            sensors.resolver.error = checked("sensors.resolver_error", error)?.to_radians();
        }
        if let Some(Named(arrangement)) = self.arrangement {
            sensors.arrangement = arrangement;
        }
        let range = self.range.map(|range| checked("sensors.range", range)).transpose()?;
        let bits = self.bits.map(|bits| checked_bits("sensors.bits", bits)).transpose()?;
        sensors.adc = converter("sensors", sensors.adc, range.map(|range| [-range, range]), bits)?;
        let range = self.dc_link_range.map(|range| checked("sensors.dc_link_range", range)).transpose()?;
        let bits = self.dc_link_bits.map(|bits| checked_bits("sensors.dc_link_bits", bits)).transpose()?;
        sensors.dc_link.adc =
            converter("sensors.dc_link", sensors.dc_link.adc, range.map(|range| [0.0, range]), bits)?;
        Ok(())
    }
}

impl SensorsTable {
    fn pick_up(&self, pick_up: Option<PickUp>) -> Result<Option<PickUp>, FileError> {
        let mut of = pick_up.unwrap_or(PICK_UP);
        set!("sensors", self, pick_up => of.amplitude, checked;);
        if let Some(decay) = self.pick_up_decay {
            of.decay = checked("sensors.pick_up_decay", decay)?;
        }
        if let Some(frequency) = self.pick_up_frequency {
            of.frequency = checked("sensors.pick_up_frequency", frequency)?;
        }
        let only = [
            ("sensors.pick_up_decay", self.pick_up_decay.map(|value| value.to_string())),
            ("sensors.pick_up_frequency", self.pick_up_frequency.map(|value| value.to_string())),
        ];
        for (key, value) in only {
            if let (Some(value), None, None) = (value, self.pick_up, pick_up) {
                let needed = "`sensors.pick_up` beside it, or `errors` \"field\": nothing is picked up here";
                return Err(FileError::key(key, &value, needed));
            }
        }
        Ok((of.amplitude > 0.0).then_some(of))
    }
}

/// A converter with what was changed; of one that was none, both must be told. Without bits it rounds nothing, and its range stays.
fn converter(
    key: &str,
    adc: Option<Adc>,
    range: Option<[f64; 2]>,
    bits: Option<u8>,
) -> Result<Option<Adc>, FileError> {
    match (adc, range, bits) {
        (None, None, None | Some(0)) => Ok(None),
        (None, Some([low, high]), Some(bits)) => Ok(Some(Adc { bits, low, high })),
        (None, ..) => {
            let needed = "range and bits, where the error set has no converter";
            Err(FileError::key(key, "one of range and bits", needed))
        }
        (Some(adc), range, bits) => {
            let [low, high] = range.unwrap_or([adc.low, adc.high]);
            Ok(Some(Adc { bits: bits.unwrap_or(adc.bits), low, high }))
        }
    }
}
