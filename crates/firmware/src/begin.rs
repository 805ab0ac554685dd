//! From a name, data sheets and settings to a detector.

use core::fmt;

use standstill_detect::{
    AnyDetector, Dividers, Kind, Method, MethodName, Nameplate, Sensing, Settings as _, SettingsError,
    Signature, Source, Value, keys,
};
use standstill_interface::Nanos;
use standstill_interface::abi::Plate;

/// Why there is no detector.
#[derive(Debug)]
pub enum Refused<'a> {
    /// A method of this name.
    Method(&'a str),
    /// A key that the method does not have.
    Key(&'a str),
    /// A value of a key, which needs such.
    Value(&'a str, &'static str),
    /// The method's refusal.
    Settings(SettingsError),
}

impl fmt::Display for Refused<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Method(name) => write!(f, "no method \"{name}\""),
            Self::Key(key) => write!(f, "no setting `{key}` of this method"),
            Self::Value(key, needed) => write!(f, "setting `{key}` must be {needed}"),
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

/// Nameplate data from the C struct.
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
            pick_up: plate.pick_up,
            // A shunt in the DC link has no place in this interface; neither a command with a threshold nor a captured time goes through this interface.
            ..Sensing::default()
        },
        dividers: Dividers::default(),
        dc_link: plate.dc_link,
        dead_time: Nanos(plate.dead_time_ns),
        carrier_period: Nanos(plate.period_ns),
        switch_drop: plate.switch_drop,
        diode_drop: plate.diode_drop,
        reverse_drop: plate.reverse_drop,
    }
}

/// A detector of a method with these settings.
pub fn detector<'a>(
    name: &'a str,
    plate: &Plate,
    settings: impl Iterator<Item = (&'a str, f64)>,
) -> Result<AnyDetector<f32>, Refused<'a>> {
    let method = MethodName::ALL.iter().find(|method| method.name() == name).ok_or(Refused::Method(name))?;
    let plate = nameplate(plate);
    plate.check().map_err(Refused::Settings)?;
    let mut method = Method::<f32>::suited(*method, &plate);
    // A program hands over the currents of phases alone.
    if !method.sources().contains(&Source::PhaseCurrents) {
        return Err(Refused::Method(name));
    }
    for (name, number) in settings {
        let key = keys::ALL.iter().find(|key| key.name == name).ok_or(Refused::Key(name))?;
        let value = match key.kind {
            Kind::Flag => Value::Flag(number != 0.0),
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
    method.detector().map_err(Refused::Settings)
}
