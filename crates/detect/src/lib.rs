//! Methods that find the position of a synchronous motor's rotor at standstill.
//!
//! Each method is a [`standstill_interface::Detector`]: a state machine without allocation, input or output, in `f32`
//! or `f64`, that runs in firmware as it does in the simulator. "The paper" is Chen Cheng and Tao Ze'an 2019 (article
//! 1673-6540(2019)06-0102-04).
#![no_std]
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the C library"))]

mod checks;
mod commissioning;
pub mod keys;
mod method;
mod nameplate;
mod parts;
mod settings;
#[cfg(test)]
mod testing;

pub use checks::{Check, Checks};
pub use commissioning::{
    Commissioning, CommissioningError, CommissioningSettings, Correction, Deviations, Learnt,
};
pub use keys::{Key, Keyed, Kind, Setting, Value};
pub use method::{
    Adaptive, Alignment, AlignmentSettings, AnyDetector, Bipolar, BipolarSettings, LineInductance,
    LineInductanceSettings, MaximumLikelihood, MaximumLikelihoodSettings, Method, MethodName, OpenTerminal,
    OpenTerminalSettings, PulsatingInjection, PulsatingInjectionSettings, RotatingInjection,
    RotatingInjectionSettings, SixPulse, SixPulseSettings, Subdivision, SubdivisionSettings,
};
pub use nameplate::{Comparing, Dividers, Nameplate, Place, Sensing, longest_dead_time};
pub use parts::both_ways::BothWaysSettings;
pub use parts::injection::{InjectionMethod, InjectionSettings};
pub use parts::lines::{Interval, Saliency, SaliencySign, line_impedance};
pub use parts::modulation::ModulationSettings;
pub use parts::polarity::{PolarityRule, PolaritySettings, Pole, SequentialSettings, Signature};
pub use parts::settle::SettleSettings;
pub use parts::train::PulseTrainSettings;
pub use settings::{Decay, Settings, SettingsError, Source};

// Items for the other crates of this workspace.
#[doc(hidden)]
pub use keys::Lines;
#[doc(hidden)]
pub use method::{Foreign, ForeignSettings, MOST_SAMPLES};

/// Runs the examples of the README as doctests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
