//! The error sets: errors of drive and sensors, from ideal to harsh.

use standstill_interface::{Nanos, choice};
use standstill_inverter::{Bridge, DcLink, DeviceKind, Devices, GateTiming, Inverter, OpenLeg};
use standstill_plant::Motor;
use standstill_sim::{
    Adc, ComparatorSettings, PickUp, Purpose, Resolver, SensorSettings, Streams, TerminalSensor,
    VoltageSensor,
};

use super::terminals::damp;

/// Nominal DC-link voltage in V of the paper's drive.
const DC_LINK: f64 = 550.0;

/// Returns the nominal DC-link voltage in V of this motor's drive. If the data sheet does not state this voltage, returns the voltage of
/// the paper's drive.
pub(crate) fn dc_link(motor: &Motor) -> f64 {
    motor.dc_link.unwrap_or(DC_LINK)
}

/// Default pick-up. Pick-up is the ringing of current readings after a switching edge. The default has a decay time constant and a
/// frequency, but zero amplitude. Usual time constants are 0.3 to 1 µs, usual frequencies 3 to 10 MHz.
pub(crate) const PICK_UP: PickUp = PickUp { amplitude: 0.0, decay: 0.5e-6, frequency: 5e6 };

/// Capacitance in F of each terminal in the error set `field`: two switches and a metre of cable.
const TERMINAL_CAPACITANCE: f64 = 0.3e-9;

/// Highest nominal DC-link voltage in V at which a drive has MOSFETs. It is the highest voltage that is safe to touch. Up to this voltage,
/// drives usually have MOSFETs for 80 to 100 V with a few milliohms.
const MOSFET_LINK: f64 = 60.0;

/// Returns the usual kind of switches for this motor's nominal DC-link voltage. A 550 V drive that is run at 48 V keeps
/// its IGBTs.
pub(crate) fn device_kind(motor: &Motor) -> DeviceKind {
    if dc_link(motor) <= MOSFET_LINK { DeviceKind::Mosfet } else { DeviceKind::Igbt }
}

/// Returns the switches and diodes of a real drive for this rated current in A. The differential resistances are scaled so that the voltage
/// drop at rated current is the same in every drive.
fn devices(kind: DeviceKind, rated_current: f64) -> Devices {
    let slope = 8.0 / rated_current;
    match kind {
        DeviceKind::Igbt => Devices {
            kind,
            switch_drop: 0.9,
            switch_resistance: 50e-3 * slope,
            diode_drop: 1.0,
            diode_resistance: 30e-3 * slope,
        },
        // 0.1 V across the channel at rated current; the threshold of a silicon body diode.
        DeviceKind::Mosfet => Devices {
            kind,
            switch_drop: 0.0,
            switch_resistance: 12.5e-3 * slope,
            diode_drop: 0.8,
            diode_resistance: 10e-3 * slope,
        },
    }
}

choice! {
    /// Set of errors of drive and sensors.
    #[derive(Default)]
    pub enum ErrorSet {
        /// Ideal switches without dead time, idle legs without current, exact sensors. The remaining error is that of
        /// the method itself, due to saturation.
        None = "none",
        /// Like `none`, but with white noise in the current readings, 20 mA rms for 8 A of rated current: the case of
        /// the Cramér–Rao limit.
        Noise = "noise",
        /// A good industrial drive.
        Default = "default" default,
        /// A poor industrial drive.
        Harsh = "harsh",
        /// Like `default`, but with capacitance at the terminals, and with current sensors that have a limited
        /// bandwidth, convert the phases one after the other, and pick up switching edges.
        Field = "field",
    }
}

/// Settings of a type of inverter, from which each trial draws one specimen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveSettings {
    /// Characteristics of switches and diodes.
    pub bridge: Bridge,
    /// Dead time of the gate signals.
    pub dead_time: Nanos,
    /// Standard deviation in s of the legs' switching delays. The mean of the delays is three times this value.
    pub delay_mismatch: f64,
    /// The DC link. Each trial draws the phase of its ripple.
    pub link: DcLink,
    /// Period of the PWM carrier.
    pub carrier_period: Nanos,
}

impl DriveSettings {
    /// Draws one specimen of the inverter.
    pub fn draw(&self, streams: Streams) -> Inverter {
        let [mut delays, mut ripple] = streams.open_together([Purpose::GateDelay, Purpose::Ripple]);
        let gates = std::array::from_fn(|_| {
            let mut delay = || Nanos::from_seconds(self.delay_mismatch * (3.0 + delays.normal()).max(0.0));
            GateTiming { turn_off_delay: delay(), turn_on_delay: delay(), dead_time: self.dead_time }
        });
        let link = DcLink { ripple_phase: ripple.angle(), ..self.link };
        Inverter { bridge: self.bridge, gates, link, carrier_period: self.carrier_period }
    }
}

impl ErrorSet {
    /// Returns the settings of the drive for this motor, at its nominal DC-link voltage, with this kind of switches.
    pub fn drive(self, motor: &Motor, kind: DeviceKind) -> DriveSettings {
        let ideal = DriveSettings {
            bridge: Bridge {
                devices: Devices { kind, ..Devices::default() },
                open_leg: OpenLeg::Open,
                ..Bridge::default()
            },
            dead_time: Nanos::ZERO,
            delay_mismatch: 0.0,
            link: DcLink::stiff(dc_link(motor)),
            carrier_period: Nanos::from_micros(100),
        };
        let (delay_mismatch, ripple) = match self {
            Self::None | Self::Noise => return ideal,
            Self::Default | Self::Field => (50e-9, 0.002),
            Self::Harsh => (100e-9, 0.01),
        };
        let mut bridge = Bridge {
            devices: devices(kind, motor.rated_current),
            open_leg: OpenLeg::Diodes,
            terminal_capacitance: if self == Self::Field { TERMINAL_CAPACITANCE } else { 0.0 },
            ..Bridge::default()
        };
        damp(&mut bridge, motor);
        DriveSettings {
            bridge,
            dead_time: Nanos::from_micros(2),
            delay_mismatch,
            link: DcLink { ripple, ..ideal.link },
            ..ideal
        }
    }

    /// Returns the settling time that a drive assumes for the amplifier of its DC-link shunt. In the error set `field` the settling time is
    /// ten time constants of the amplifier.
    pub(crate) const fn settle(self) -> Nanos {
        match self {
            Self::None | Self::Noise => Nanos::ZERO,
            Self::Default | Self::Harsh => Nanos::from_micros(3),
            Self::Field => Nanos::from_micros(8),
        }
    }

    /// Returns the settings of a drive's sensors for this rated current in A and this DC-link voltage in V. The
    /// sensors' ranges are 2.5 times the current and 1.8 times the voltage, and their errors scale with current and
    /// voltage.
    pub fn sensors(self, rated_current: f64, dc_link: f64) -> SensorSettings {
        let scale = rated_current / 8.0;
        let default = SensorSettings {
            gain_error: 0.005,
            offset: 20e-3 * scale,
            noise: 10e-3 * scale,
            adc: Some(Adc { bits: 12, low: -20.0 * scale, high: 20.0 * scale }),
            jitter: Nanos(100),
            dc_link: VoltageSensor {
                gain_error: 0.001,
                adc: Some(Adc { bits: 12, low: 0.0, high: 1000.0 * (dc_link / DC_LINK) }),
                ..VoltageSensor::default()
            },
            resolver: Resolver { error: 0.2_f64.to_radians() },
            // Comparators of a microcontroller with an RC oscillator, on a shunt with 0.1 V at rated current. Timer and
            // trip stay off: only a scenario's own keys turn them on.
            comparator: ComparatorSettings {
                timer_error: 0.003,
                offset: 40e-3 * scale,
                delay: 100e-9,
                delay_spread: 10e-9,
                noise: 10e-3 * scale,
                blanking: Nanos(1000),
                bits: 10,
                range: 20.0 * scale,
                ..SensorSettings::IDEAL.comparator
            },
            ..SensorSettings::IDEAL
        };
        match self {
            Self::None => SensorSettings::IDEAL,
            Self::Noise => SensorSettings { noise: 20e-3 * scale, ..SensorSettings::IDEAL },
            Self::Default => default,
            Self::Harsh => SensorSettings {
                gain_error: 0.01,
                offset: 50e-3 * scale,
                noise: 20e-3 * scale,
                jitter: Nanos(1000),
                resolver: Resolver { error: 0.5_f64.to_radians() },
                comparator: ComparatorSettings {
                    timer_error: 0.01,
                    offset: 100e-3 * scale,
                    delay: 300e-9,
                    delay_spread: 50e-9,
                    noise: 20e-3 * scale,
                    bits: 8,
                    ..default.comparator
                },
                ..default
            },
            // A Hall or shunt sensor with an amplifier, one converter behind a multiplexer, and pick-up of a hundredth
            // of the converter's range.
            Self::Field => SensorSettings {
                bandwidth: Some(200e3),
                bandwidth_tolerance: 0.2,
                bandwidth_mismatch: 0.03,
                skew: Nanos(500),
                pick_up: Some(PickUp { amplitude: 0.2 * scale, ..PICK_UP }),
                comparator: ComparatorSettings {
                    offset: 80e-3 * scale,
                    delay: 200e-9,
                    delay_spread: 20e-9,
                    blanking: Nanos(2000),
                    ..default.comparator
                },
                ..default
            },
        }
    }

    /// Returns the voltage dividers at the terminals of a drive with this rated current in A. The range of a divider is 1.8 times the
    /// DC-link voltage. At the DC-link voltage a divider draws 0.55 mA, or half a thousandth of the rated current if that is less. A
    /// divider at a terminal with a capacitance draws no current unless `sensors.terminal_load` is set.
    pub fn dividers(self, rated_current: f64, drive: &DriveSettings) -> TerminalSensor {
        let dc_link = drive.link.voltage;
        let scale = dc_link / DC_LINK;
        let loads = drive.bridge.terminal_capacitance == 0.0;
        let default = TerminalSensor {
            gain_error: 0.005,
            // One code of the converter.
            offset: 0.25 * scale,
            noise: 0.5 * scale,
            bandwidth: None,
            adc: Some(Adc { bits: 12, low: 0.0, high: 1000.0 * scale }),
            resistance: loads.then(|| dc_link / 0.55e-3_f64.min(0.5e-3 * rated_current)),
        };
        match self {
            Self::None => TerminalSensor::IDEAL,
            Self::Noise => TerminalSensor { noise: default.noise, ..TerminalSensor::IDEAL },
            Self::Default => default,
            Self::Harsh => TerminalSensor {
                gain_error: 0.01,
                offset: 2.0 * default.offset,
                noise: 2.0 * default.noise,
                ..default
            },
            Self::Field => TerminalSensor { bandwidth: Some(100e3), ..default },
        }
    }
}
