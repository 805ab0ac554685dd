//! The data that a drive has for its detector: the nameplate from the data sheets of motor, inverter and sensors, and
//! the kinds of readings.

use std::f64::consts::TAU;

use standstill_detect::{Comparing, Dividers, Nameplate, Place, Sensing, Signature, Source};
use standstill_interface::{Dq, Nanos};
use standstill_numeric::{Heading, sin_cos};
use standstill_plant::{Motor, NoConvergence, PolarityPoint};
use standstill_sim::{Arrangement, Comparators, SensorSettings, VoltageSensor};

use crate::DriveSettings;

/// Smallest relative difference between the currents of the two poles on which a polarity test may rely. It is several times the error with
/// which the sensors compare two pulses.
const LEAST_DIFFERENCE: f64 = 0.005;

/// Returns which pole draws more current, and the relative difference between the currents of the two poles. `current` is the current in A
/// at which the poles are compared. The signature is [`Signature::None`] if the difference is at most 0.5 %, which is too little for a
/// polarity test. Returns `None` if the flux map ends below this current.
///
/// ```
/// use standstill_detect::Signature;
/// use standstill_scenario::pole_signature;
///
/// let motor = standstill_plant::built_in("paper-5k5").expect("built in");
/// let (signature, difference) = pole_signature(&motor, motor.rated_current).expect("no map");
/// assert!(signature == Signature::Normal && (0.01..0.2).contains(&difference), "{difference}");
/// ```
pub fn pole_signature(motor: &Motor, current: f64) -> Option<(Signature, f64)> {
    let point: Result<PolarityPoint, NoConvergence> = PolarityPoint::of(&motor.magnetics, current);
    let difference = point.ok()?.difference();
    let signature = match motor.magnet_flux {
        0.0 => Signature::None,
        _ if difference > LEAST_DIFFERENCE => Signature::Normal,
        _ if difference < -LEAST_DIFFERENCE => Signature::Inverted,
        _ => Signature::None,
    };
    Some((signature, difference))
}

/// Returns the ratio of two changes: the change of 1/L_q to the change of 1/L_d, both between a d-axis current of +`current` and of
/// −`current` in A. Zero if 1/L_d does not change, or if the flux map does not reach these currents.
fn cross_saturation(motor: &Motor, current: f64) -> f64 {
    let at = |current: f64| {
        let flux = motor.magnetics.flux_at(Dq::new(current, 0.0), Heading::ZERO).ok()?;
        Some(motor.magnetics.state(flux, Heading::ZERO).inverse_inductance)
    };
    let (Some(along), Some(against)) = (at(current), at(-current)) else { return 0.0 };
    let [d, q] = [along.xx - against.xx, along.yy - against.yy];
    if d.abs() > 1e-6 * along.xx { q / d } else { 0.0 }
}

/// Returns the duration of a voltage pulse between two terminals after which the current has reached the rated current. The rotor angle is
/// the one at which the pulse is shortest. The duration is limited to 10 ms.
fn rated_pulse(motor: &Motor, dc_link: f64) -> Nanos {
    // A current i through two terminals is a space vector of length 2/√3 i, a voltage U between them one of U/√3.
    let current = 2.0 / 3.0_f64.sqrt() * motor.rated_current;
    let rest = motor.magnetics.rest(Heading::ZERO);
    let least = (0..32_u8)
        .filter_map(|step| {
            let (sin, cos) = sin_cos(TAU * f64::from(step) / 32.0);
            // Beyond the end of a flux map the flux is unknown.
            let flux = motor.magnetics.flux_at(Dq::new(cos, sin) * current, Heading::ZERO).ok()?;
            Some((flux - rest).norm())
        })
        .fold(f64::INFINITY, f64::min);
    let longest = Nanos::from_micros(10_000);
    if least.is_finite() {
        Nanos::from_seconds(3.0_f64.sqrt() * least / dc_link).min(longest)
    } else {
        longest
    }
}

/// Returns the kinds of readings of a drive with this arrangement of current sensors. `terminals` is true if the drive has voltage dividers
/// at its terminals. `timer` is true if a timer captures the times at which the comparators trip.
pub(crate) fn sources(arrangement: Arrangement, terminals: bool, timer: bool) -> Vec<Source> {
    let currents = match arrangement {
        Arrangement::ThreeInLine | Arrangement::TwoInLine | Arrangement::LowSideShunts => {
            Some(Source::PhaseCurrents)
        }
        Arrangement::DcLinkShunt => Some(Source::LinkCurrent),
        Arrangement::None => None,
    };
    let others = [terminals.then_some(Source::Terminals), timer.then_some(Source::CapturedTimes)];
    currents.into_iter().chain(others.into_iter().flatten()).collect()
}

/// Returns the noise of a sample of the DC-link voltage in V rms. The quantization noise of the converter is included.
fn link_noise(of: &VoltageSensor) -> f64 {
    let rounding = of.adc.filter(|adc| adc.rounds()).map_or(0.0, |adc| adc.step() / 12.0_f64.sqrt());
    standstill_numeric::hypot(of.noise, rounding)
}

/// Returns the nameplate: the data of motor, inverter and sensors that the drive knows from data sheets.
pub(crate) fn nameplate(motor: &Motor, drive: &DriveSettings, sensors: &SensorSettings) -> Nameplate<f64> {
    let devices = drive.bridge.devices;
    let place = match sensors.arrangement {
        Arrangement::LowSideShunts => Place::BelowLegs,
        Arrangement::DcLinkShunt => Place::InLink,
        Arrangement::ThreeInLine | Arrangement::TwoInLine | Arrangement::None => Place::InLine,
    };
    // One channel reads all phases: gains and filters cannot differ, and no phase is converted later than another.
    let one_shunt = place == Place::InLink;
    // The polarity test goes 2 % beyond the rated current; a map may not cover that.
    let [(signature_at_rated, polarity_difference), (pulse_signature, _)] = [1.0, 0.5]
        .map(|share| pole_signature(motor, share * motor.rated_current).unwrap_or((Signature::None, 0.0)));
    Nameplate {
        rated_current: motor.rated_current,
        resistance: motor.resistance,
        d_axis_inductance: motor.winding.d_axis_inductance(),
        q_axis_inductance: motor.winding.q_axis_inductance(),
        magnet_flux: motor.magnet_flux,
        signature: signature_at_rated,
        pulse_signature,
        polarity_difference,
        cross_saturation: cross_saturation(motor, 0.5 * motor.rated_current),
        rated_pulse: rated_pulse(motor, drive.link.voltage),
        gain_tolerance: if one_shunt { 0.0 } else { sensors.gain_error },
        sensing: Sensing {
            bandwidth: sensors.bandwidth,
            bandwidth_mismatch: if one_shunt { 0.0 } else { sensors.bandwidth_mismatch },
            skew: if one_shunt { Nanos::ZERO } else { sensors.skew },
            averaged: sensors.averaged(),
            pick_up: sensors.pick_up.map_or([0.0; 2], |of| [of.amplitude, of.decay]),
            place,
            link_noise: link_noise(&sensors.dc_link) / f64::from(sensors.oversampling.max(1)).sqrt(),
            settle: if sensors.settle > Nanos::ZERO { drive.dead_time + sensors.settle } else { Nanos::ZERO },
            comparator: Comparing {
                tick: sensors.comparator.timer,
                delay: sensors.comparator.delay,
                own: sensors.comparator.arrangement == Comparators::PerLeg,
                offset: sensors.comparator.offset,
                delay_spread: sensors.comparator.delay_spread,
                noise: sensors.comparator.noise,
                blanking: sensors.comparator.blanking.seconds(),
                highest: sensors.comparator.highest(),
                clock_error: sensors.comparator.timer_error,
            },
        },
        dividers: sensors.terminal.map_or_else(Dividers::default, |of| Dividers {
            gain_tolerance: of.gain_error,
            offset: of.offset,
            bandwidth: of.bandwidth,
        }),
        dc_link: drive.link.voltage,
        dead_time: drive.dead_time,
        delay_mismatch: drive.delay_mismatch,
        carrier_period: drive.carrier_period,
        switch_drop: [devices.switch_drop, devices.switch_resistance],
        diode_drop: [devices.diode_drop, devices.diode_resistance],
        reverse_drop: devices.reverse(),
    }
}
