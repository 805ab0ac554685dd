//! Methods that find the position of a synchronous motor's rotor at standstill.
//!
//! Each is a [`standstill_interface::Detector`]: a state machine without allocation, input or output, in `f32`
//! or `f64`, that runs in firmware as it does in the simulator. "The paper" is Chen Cheng and Tao Ze'an 2019
//! (article 1673-6540(2019)06-0102-04).
#![no_std]

mod line_inductance;
mod lines;
mod polarity;
mod settings;
mod settle;

pub use line_inductance::{LineInductance, LineInductanceSettings};
pub use lines::{Interval, Saliency, SaliencySign, line_impedance};
pub use polarity::PolaritySettings;
pub use settings::{Decay, SettingsError};
pub use settle::SettleSettings;
