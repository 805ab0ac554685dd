//! What a detector from a library hands over: its commands, readings by way of C, and the library's own file.

use standstill_fmu::Binary;
use standstill_foreign::{Guard, command as carried_out, exported};
use standstill_interface::abi::{self, Drive, Sample, Stage};
use standstill_interface::{Leg, Nanos};

use crate::Fields;

fn stage(from: &mut Fields) -> Stage {
    Stage {
        leg: from.next(),
        reserved: from.byte(),
        duty: std::array::from_fn(|_| from.float()),
        edge_ns: std::array::from_fn(|_| from.word()),
        reserved_too: from.word(),
        duration_ns: from.long(),
    }
}

/// A command of a library is one that the bench can carry out, or is refused with a reason.
pub fn command(bytes: &[u8]) {
    let mut from = Fields(bytes);
    let given = abi::Command {
        size: from.word(),
        stages: from.word(),
        stage: [stage(&mut from), stage(&mut from)],
        samples: from.word(),
        until: from.float(),
        first_ns: from.long(),
        interval_ns: from.long(),
    };
    let [timer_tick, threshold_highest] = [from.float(), from.float()].map(|value| value.abs().min(1e6));
    // SAFETY: numbers alone, of which each may be zero; an address of 0 is none.
    #[allow(unsafe_code)]
    let drive = Drive { timer_tick, threshold_highest, ..unsafe { std::mem::zeroed() } };
    match carried_out(&given, &drive) {
        Err(fault) => assert!(fault.to_string().len() > 10, "{fault}"),
        Ok(command) => {
            let all = command.then.iter().chain([&command.stage]);
            let mut total = 0_u128;
            for stage in all {
                total += u128::from(stage.duration.0);
                for leg in &stage.legs.0 {
                    match leg {
                        Leg::Duty(duty) => assert!((0.0..=1.0).contains(duty), "{command:?}"),
                        Leg::Rise(edge) | Leg::Fall(edge) => assert!(*edge <= stage.duration, "{command:?}"),
                        Leg::Off | Leg::Low | Leg::High => {}
                    }
                }
            }
            assert!(total > 0);
            let last = command.sampling.last().unwrap_or(Nanos::ZERO);
            assert!(u128::from(last.0) <= total, "{command:?}");
            assert!(command.threshold.is_none_or(|amps| amps.is_finite() && amps > 0.0), "{command:?}");
            assert_eq!(Guard::possible(&command), Ok(()));
        }
    }
}

/// A sample as C has it is a reading, and the sample of that reading is the sample, but for codes that there are not.
pub fn readings(bytes: &[u8]) {
    let mut from = Fields(bytes);
    let sample = Sample {
        time_ns: from.long(),
        current: std::array::from_fn(|_| from.float()),
        dc_link: from.float(),
        current_count: std::array::from_fn(|_| from.word()),
        dc_link_count: from.word(),
        sensed: from.next(),
        dc_link_clipped: from.byte(),
        half: from.byte(),
        link_sensed: from.byte(),
        captured: from.byte(),
        comparator: from.byte(),
        link_current: from.float(),
        link_current_count: from.word(),
        terminal: std::array::from_fn(|_| from.float()),
        terminal_count: std::array::from_fn(|_| from.word()),
        terminal_sensed: from.next(),
        reserved: from.byte(),
        capture_ticks: from.word(),
    };
    let once = Sample::of(&sample.reading(), Nanos::ZERO, sample.half);
    let twice = Sample::of(&once.reading(), Nanos::ZERO, once.half);
    // Not-a-number is unlike itself: the texts are compared.
    assert_eq!(format!("{once:?}"), format!("{twice:?}"));
    assert_eq!(once.time_ns, sample.time_ns);
    assert_eq!(once.current.map(f32::to_bits), sample.current.map(f32::to_bits));
    assert_eq!(once.current_count, sample.current_count);
    assert_eq!(once.terminal_count, sample.terminal_count);
    assert!(once.sensed.iter().zip(sample.sensed).all(|(out, given)| *out == given.min(3)));
}

/// The file of a library has names of functions, or is refused with a reason; so is that of an FMU.
pub fn library(bytes: &[u8]) {
    if let Err(error) = exported(bytes) {
        assert!(error.len() > 10, "{error}");
    }
    match Binary::of(bytes.to_vec()) {
        Err(error) => assert!(error.len() > 10, "{error}"),
        Ok(binary) => assert!(binary.machine().contains('-')),
    }
}
