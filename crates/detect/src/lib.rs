//! Methods that find the position of a synchronous motor's rotor at standstill.
//!
//! Each is a [`standstill_interface::Detector`]: a state machine without allocation, input or output, in `f32`
//! or `f64`, that runs in firmware as it does in the simulator. "The paper" is Chen Cheng and Tao Ze'an 2019
//! (article 1673-6540(2019)06-0102-04).
#![no_std]
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the C library"))]

mod alignment;
mod bipolar;
mod commissioning;
mod injection;
mod likelihood;
mod line_inductance;
mod lines;
mod maximum_likelihood;
mod method;
mod modulation;
mod nameplate;
mod polarity;
mod pulsating;
mod rotating;
mod settings;
mod settle;
mod subdivision;
#[cfg(test)]
mod testing;
mod train;

pub use alignment::{Alignment, AlignmentSettings};
pub use bipolar::{Bipolar, BipolarSettings};
pub use commissioning::{
    Commissioning, CommissioningError, CommissioningSettings, Correction, Deviations, Learnt,
};
pub use injection::InjectionSettings;
pub use line_inductance::{LineInductance, LineInductanceSettings};
pub use lines::{Interval, Saliency, SaliencySign, line_impedance};
pub use maximum_likelihood::{Adaptive, MOST_SAMPLES, MaximumLikelihood, MaximumLikelihoodSettings};
pub use method::{AnyDetector, Method, MethodName};
pub use modulation::ModulationSettings;
pub use nameplate::Nameplate;
pub use polarity::{PolarityRule, PolaritySettings, Pole, SequentialSettings, Signature};
pub use pulsating::{PulsatingInjection, PulsatingInjectionSettings};
pub use rotating::{RotatingInjection, RotatingInjectionSettings};
pub use settings::{Decay, Settings, SettingsError};
pub use settle::SettleSettings;
pub use subdivision::{Subdivision, SubdivisionSettings};
pub use train::PulseTrainSettings;
