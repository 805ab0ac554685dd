//! Every detector in single precision, as a firmware would hold it.
//!
//! This builds only while no crate below it needs more than `core`: with the standard library there would be two panic
//! handlers, with `alloc` an allocator would be missing. Building is the test; nothing runs it.
#![no_std]

use core::panic::PanicInfo;

use standstill_detect::{
    AnyDetector, Commissioning, CommissioningError, CommissioningSettings, Learnt, Method, MethodName,
    Nameplate, Settings, SettingsError,
};
use standstill_interface::{Abc, Angle, Detector, Reading, Step};

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    loop {}
}

/// A detector of any method, set up for a motor and drive.
///
/// # Errors
/// A setting with which the method cannot work.
pub fn detector(method: MethodName, drive: &Nameplate<f32>) -> Result<AnyDetector<f32>, SettingsError> {
    Method::suited(method, drive).detector()
}

/// What the drive does next, given what its sensors said.
pub fn step(detector: &mut AnyDetector<f32>, readings: &[Reading<f32>]) -> Step<f32> {
    detector.step(readings)
}

/// A correction from line inductances at several positions.
///
/// # Errors
/// Nothing that can be learnt.
pub fn learn(
    settings: CommissioningSettings<f32>,
    starts: &[(Abc<f32>, Option<Angle<f32>>)],
) -> Result<Learnt<f32>, CommissioningError<f32>> {
    let mut commissioning = Commissioning::new(settings).map_err(|_| CommissioningError::NoConvergence)?;
    for (lines, north) in starts {
        commissioning.add(*lines, *north)?;
    }
    commissioning.learn()
}
