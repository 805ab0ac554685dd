//! Values of outputs.

use standstill_interface::Reading;
use standstill_interface::abi::sensed_code;

use crate::rig::Rig;
use crate::variables::{Sampled, Truth};

/// Value of a reading; before the first step, that of the drive at rest.
pub(crate) fn sampled(reading: &Reading<f64>, of: Sampled) -> f64 {
    match of {
        Sampled::Current(k) => reading.current.0[k],
        Sampled::Sensed(k) => sensed_code(reading.sensed.0[k]).into(),
        Sampled::Count(k) => reading.counts.current.0[k].into(),
        Sampled::Link => reading.dc_link,
        Sampled::LinkCount => reading.counts.dc_link.into(),
        Sampled::LinkClipped => f64::from(u8::from(reading.dc_link_clipped)),
        Sampled::LinkCurrent => reading.link_current,
        Sampled::LinkCurrentSensed => sensed_code(reading.link_sensed).into(),
        Sampled::LinkCurrentCount => reading.counts.link_current.into(),
        Sampled::Terminal(k) => reading.terminal.0[k],
        Sampled::TerminalSensed(k) => sensed_code(reading.terminal_sensed.0[k]).into(),
        Sampled::TerminalCount(k) => reading.counts.terminal.0[k].into(),
    }
}

/// True values, without sensors.
pub(crate) fn truth(rig: &Rig, of: Truth) -> f64 {
    let now = rig.now();
    match of {
        Truth::Current(k) => now.current[k],
        Truth::Potential(k) => now.potential[k],
        Truth::Link => now.dc_link,
        Truth::Angle => now.angle,
        Truth::Speed => now.speed,
        Truth::Torque => now.torque,
        Truth::LinkCurrent => now.link_current(),
    }
}
