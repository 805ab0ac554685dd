//! Setup of a detector from a name, data sheets and settings.

use core::fmt;

use standstill_detect::{
    AnyDetector, Checks, Comparing, Dividers, Kind, Method, MethodName, Nameplate, Place, Sensing,
    Settings as _, SettingsError, Signature, Source, Value, keys,
};
use standstill_interface::Nanos;
use standstill_interface::abi::{self, Plate};

/// Reason why a detector cannot be made.
#[derive(Debug)]
pub enum Refused<'a> {
    /// A method of this name.
    Method(&'a str),
    /// A key that the method does not have.
    Key(&'a str),
    /// A value of a key, which needs such.
    Value(&'a str, &'static str),
    /// The value of a key for checks is invalid, of a method that has these.
    Checks(&'a str, Checks),
    /// The method reads none of the quantities that the drive measures.
    Readings(&'a str),
    /// The method's refusal.
    Settings(SettingsError),
}

impl fmt::Display for Refused<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Method(name) => write!(f, "no method \"{name}\""),
            Self::Key(key) => write!(f, "no setting `{key}` of this method"),
            Self::Value(key, needed) => write!(f, "setting `{key}` must be {needed}"),
            Self::Checks(key, has) => {
                write!(f, "setting `{key}` must be 0 for none, 1 for all, or ")?;
                f.write_str(if has.iter().count() > 1 { "a sum of " } else { "" })?;
                for (number, check) in has.iter().enumerate() {
                    let comma = if number == 0 { "" } else { ", " };
                    write!(f, "{comma}{} for {}", Checks::of([check]).number(), check.name())?;
                }
                Ok(())
            }
            Self::Readings(name) => write!(f, "\"{name}\" reads none of what sts_plate.readings has"),
            Self::Settings(error) => error.fmt(f),
        }
    }
}

fn signature(stronger: i32) -> Signature {
    match stronger {
        0 => Signature::None,
        north if north > 0 => Signature::Normal,
        _ => Signature::Inverted,
    }
}

/// Returns whether the drive has readings of this kind; one that names none has the currents of the phases.
fn has(plate: &Plate, source: Source) -> bool {
    let bit = match source {
        Source::PhaseCurrents => abi::PHASE_CURRENTS,
        Source::LinkCurrent => abi::LINK_CURRENT,
        Source::Terminals => abi::TERMINALS,
        Source::CapturedTimes => abi::CAPTURES,
    };
    let kinds = plate.readings & !abi::BELOW_LEGS;
    let readings = if kinds == 0 { abi::PHASE_CURRENTS } else { kinds };
    readings & bit != 0
}

/// Returns the arrangement of the current sensors.
fn place(plate: &Plate) -> Place {
    if has(plate, Source::LinkCurrent) {
        Place::InLink
    } else if plate.readings & abi::BELOW_LEGS != 0 {
        Place::BelowLegs
    } else {
        Place::InLine
    }
}

/// Converts nameplate data from the C struct.
fn nameplate(plate: &Plate) -> Nameplate<f32> {
    Nameplate {
        rated_current: plate.rated_current,
        resistance: plate.resistance,
        d_axis_inductance: plate.ld,
        q_axis_inductance: plate.lq,
        magnet_flux: plate.flux,
        signature: signature(plate.stronger_pole),
        pulse_signature: signature(plate.stronger_pole_half),
        polarity_difference: plate.pole_difference,
        cross_saturation: 0.0,
        rated_pulse: Nanos(plate.rated_pulse_ns),
        gain_tolerance: plate.gain_tolerance,
        sensing: Sensing {
            bandwidth: Some(plate.sensor_bandwidth).filter(|corner| *corner != 0.0),
            bandwidth_mismatch: plate.bandwidth_mismatch,
            skew: Nanos(plate.skew_ns),
            averaged: Nanos(plate.averaged_ns),
            link_noise: plate.link_noise,
            pick_up: plate.pick_up,
            place: place(plate),
            settle: Nanos(plate.settle_ns),
            comparator: Comparing {
                tick: if has(plate, Source::CapturedTimes) { plate.timer_tick } else { 0.0 },
                delay: plate.comparator_delay,
                own: plate.comparators > 1,
                offset: plate.comparator_offset,
                delay_spread: plate.comparator_delay_spread,
                noise: plate.comparator_noise,
                blanking: plate.comparator_blanking,
                highest: plate.threshold_highest,
                clock_error: plate.timer_error,
            },
        },
        dividers: Dividers {
            gain_tolerance: plate.divider_tolerance,
            offset: plate.divider_offset,
            bandwidth: Some(plate.divider_bandwidth).filter(|corner| *corner != 0.0),
        },
        dc_link: plate.dc_link,
        dead_time: Nanos(plate.dead_time_ns),
        delay_mismatch: plate.delay_mismatch,
        carrier_period: Nanos(plate.period_ns),
        switch_drop: plate.switch_drop,
        diode_drop: plate.diode_drop,
        reverse_drop: plate.reverse_drop,
    }
}

/// Returns a detector of a method with these settings.
pub fn detector<'a>(
    name: &'a str,
    plate: &Plate,
    settings: impl Iterator<Item = (&'a str, f64)>,
) -> Result<AnyDetector<f32>, Refused<'a>> {
    let method = MethodName::ALL.iter().find(|method| method.name() == name).ok_or(Refused::Method(name))?;
    let knows = nameplate(plate);
    knows.check().map_err(Refused::Settings)?;
    let checked = method.checks();
    let mut method = Method::<f32>::suited(*method, &knows);
    for (name, number) in settings {
        let key = keys::ALL.iter().find(|key| key.name == name).ok_or(Refused::Key(name))?;
        let value = match key.kind {
            Kind::Flag => Value::Flag(number != 0.0),
            Kind::Checks => {
                let checks = Checks::numbered(number);
                // The sum of all checks stands for all that the method has, as 1 does.
                let is_there = |checks: &Checks| *checks == Checks::ALL || checks.beyond(checked).is_none();
                Value::Checks(checks.filter(is_there).ok_or(Refused::Checks(name, checked))?)
            }
            Kind::Number { range: [low, high], needed, .. } => {
                if !(low..=high).contains(&number) {
                    return Err(Refused::Value(name, needed));
                }
                Value::Number(number)
            }
        };
        if !method.set(key, value) {
            return Err(Refused::Key(name));
        }
    }
    // A setting may change what is read.
    if !method.sources().iter().any(|source| has(plate, *source)) {
        return Err(Refused::Readings(name));
    }
    method.detector().map_err(Refused::Settings)
}
