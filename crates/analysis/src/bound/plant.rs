//! Plants with one changed parameter, for difference quotients of the readings.

use standstill_interface::{Command, Dq, Nanos};
use standstill_inverter::Inverter;
use standstill_plant::Motor;
use standstill_sim::{Case, RunError, Sensors};

use super::information::Sensitivity;
use super::replay::{CHANNELS, Sample, TERMINAL, TIME, replay};

/// Parameters of motor and diodes that may be unknown besides the angle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unknown {
    /// Mean inductance L_A of a phase. It is varied by an inductance in series that is equal along d and q.
    MeanInductance,
    /// Amplitude L_B with which a phase's inductance varies over the angle. It is varied by an inductance in series that is added along d
    /// and subtracted along q.
    Saliency,
    /// Resistance R of all three phases.
    Resistance,
    /// Threshold voltage V_D of all diodes.
    DiodeDrop,
}

impl Unknown {
    /// All unknown parameters.
    pub const ALL: [Self; 4] = [Self::MeanInductance, Self::Saliency, Self::Resistance, Self::DiodeDrop];

    /// Returns true for the inductances L_A and L_B.
    pub const fn is_inductance(self) -> bool {
        matches!(self, Self::MeanInductance | Self::Saliency)
    }
}

/// A parameter of the plant that may affect the readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Parameter {
    /// Initial rotor angle θ in rad.
    Angle,
    /// Parameter of the motor or the diodes, in SI units.
    Motor(Unknown),
    /// Relative change of the DC-link voltage.
    Link,
    /// Turn-on delay in s of the leg with this index.
    TurnOn(usize),
    /// Turn-off delay in s of the leg with this index.
    TurnOff(usize),
    /// Offset in A of the comparator with this number.
    Comparator(usize),
}

/// Factor by which the steps of the difference quotients are multiplied if times are captured. The simulation locates these times only to
/// some picoseconds.
const OF_TIMES: f64 = 20.0;

/// Numerical error in s of a captured time in the simulation.
const TIME_ERROR: f64 = 0.2e-9;
/// Numerical error of a terminal's voltage in the simulation, as a share of the DC-link voltage.
const VOLTAGE_ERROR: f64 = 1e-9;

/// Step of the difference quotient for a comparator's offset, as a share of the highest threshold.
const OF_THRESHOLD: f64 = 1e-2;

/// Returns the highest threshold of the commands in A; none if no command has a threshold.
fn highest(commands: &[Command<f64>]) -> Option<f64> {
    commands.iter().filter_map(|command| command.threshold).reduce(f64::max)
}

/// The parts of a plant that a changed parameter may affect.
struct Changed {
    motor: Motor,
    inverter: Inverter,
    sensors: Sensors,
    start_angle: f64,
}

impl Parameter {
    /// Returns the parameter's nominal value and the step of the difference quotient. The nominal value is infinite if the parameter may
    /// become negative. The step is large against the integrator's error and small against the effect of the third derivative.
    fn step(self, case: &Case, commands: &[Command<f64>]) -> (f64, f64) {
        let Case { motor, inverter, .. } = case;
        let threshold = highest(commands);
        let times = if threshold.is_some() { OF_TIMES } else { 1.0 };
        let least_inductance = motor.magnetics.inductance().smaller_eigenvalue();
        let voltage = inverter.link.voltage;
        match self {
            Self::Angle | Self::Link => (f64::INFINITY, times * 1e-4),
            Self::Motor(Unknown::MeanInductance | Unknown::Saliency) => {
                (f64::INFINITY, times * 1e-4 * least_inductance)
            }
            Self::Motor(Unknown::Resistance) => {
                let nominal = motor.resistance;
                (nominal, times * 2e-3 * nominal.max(0.01 * voltage / motor.rated_current))
            }
            // A small step: over tens of millivolts the readings are far from linear, because diodes of idle legs begin to conduct earlier
            // or later.
            Self::Motor(Unknown::DiodeDrop) => (inverter.bridge.devices.diode_drop, times * 1e-5 * voltage),
            Self::TurnOn(leg) => delay_step(inverter.gates[leg].turn_on_delay),
            Self::TurnOff(leg) => delay_step(inverter.gates[leg].turn_off_delay),
            Self::Comparator(_) => (f64::INFINITY, OF_THRESHOLD * threshold.unwrap_or(1.0)),
        }
    }

    fn apply(self, case: &Case, change: f64) -> Changed {
        let mut motor = case.motor.clone();
        let mut inverter = case.inverter.clone();
        let mut sensors = case.sensors;
        let mut start_angle = case.start_angle;
        // L_d = 3/2 (L_A + L_B) and L_q = 3/2 (L_A − L_B).
        let inductance = 1.5 * change;
        let delay = |from: Nanos| {
            let by = Nanos::from_seconds(change.abs());
            if change < 0.0 { from - by } else { from + by }
        };
        match self {
            Self::Angle => start_angle += change,
            Self::Motor(Unknown::MeanInductance) => {
                motor.magnetics = motor.magnetics.with_series_inductance(Dq::new(inductance, inductance));
            }
            Self::Motor(Unknown::Saliency) => {
                motor.magnetics = motor.magnetics.with_series_inductance(Dq::new(inductance, -inductance));
            }
            Self::Motor(Unknown::Resistance) => motor.resistance += change,
            Self::Motor(Unknown::DiodeDrop) => inverter.bridge.devices.diode_drop += change,
            Self::Link => inverter.link.voltage *= 1.0 + change,
            Self::TurnOn(leg) => {
                inverter.gates[leg].turn_on_delay = delay(inverter.gates[leg].turn_on_delay);
            }
            Self::TurnOff(leg) => {
                inverter.gates[leg].turn_off_delay = delay(inverter.gates[leg].turn_off_delay);
            }
            Self::Comparator(number) => sensors.comparator.offset[number] += change,
        }
        Changed { motor, inverter, sensors, start_angle }
    }

    /// Computes the derivatives of all values of each sample by the parameter. It uses central differences, or one-sided second-order
    /// differences if the parameter would become negative. The default step is multiplied by `scale`.
    pub fn column(self, case: &Case, commands: &[Command<f64>], scale: f64) -> Result<Sensitivity, RunError> {
        let (nominal, step) = self.step(case, commands);
        let step = match self {
            Self::TurnOn(_) | Self::TurnOff(_) => (step * scale * 1e9).round().max(1.0) * 1e-9,
            _ => step * scale,
        };
        let points: &[(f64, f64)] = if nominal >= step {
            &[(1.0, 0.5), (-1.0, -0.5)]
        } else {
            &[(0.0, -1.5), (1.0, 2.0), (2.0, -0.5)]
        };
        let mut slope: Vec<Sample> = Vec::new();
        for (at, weight) in points {
            let changed = self.apply(case, at * step);
            let case = Case {
                motor: &changed.motor,
                inverter: changed.inverter,
                sensors: changed.sensors,
                start_angle: changed.start_angle,
                ..case.clone()
            };
            let value = replay(&case, commands)?.value;
            slope.resize(value.len(), [0.0; CHANNELS]);
            for (sum, value) in slope.iter_mut().zip(&value) {
                for (sum, value) in sum.iter_mut().zip(value) {
                    *sum += weight * value / step;
                }
            }
        }
        // The integrator's errors may add up to a hundred tolerances in a detection.
        let current = 100.0 * case.tolerance.flux / case.motor.magnetics.inductance().smaller_eigenvalue();
        let mut error = [current; CHANNELS];
        error[TERMINAL..TIME].fill(VOLTAGE_ERROR * case.inverter.link.voltage);
        error[TIME] = TIME_ERROR;
        Ok(Sensitivity { slope, error: error.map(|error| error / step) })
    }
}

/// Returns a delay in s and the step of its difference quotient in s. The step is 5 ns, or the whole delay if it is shorter.
fn delay_step(delay: Nanos) -> (f64, f64) {
    let delay = delay.seconds();
    (delay, 5e-9_f64.min(delay))
}
