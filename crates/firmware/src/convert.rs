//! Readings, commands and outcomes in the types of the headers.

use standstill_interface::abi::{self, Answer};
use standstill_interface::{Abc, Command, Counts, Fault, Leg, Nanos, Outcome, Reading, Sensed, Stage};

/// A reading without any measured quantity.
pub const NO_READING: Reading<f32> = Reading {
    at: Nanos::ZERO,
    current: Abc([0.0; 3]),
    sensed: Abc([Sensed::Hidden; 3]),
    dc_link: 0.0,
    dc_link_clipped: false,
    counts: Counts::NONE,
    link_current: 0.0,
    link_sensed: Sensed::Hidden,
    terminal: Abc([0.0; 3]),
    terminal_sensed: Abc([Sensed::Hidden; 3]),
    capture: None,
};

fn stage(of: &Stage<f32>) -> abi::Stage {
    let mut stage = abi::Stage { duration_ns: of.duration.0, ..abi::Stage::default() };
    // An edge lies within its stage, which is shorter than 4 s.
    let edge = |at: Nanos| u32::try_from(at.0).unwrap_or(u32::MAX);
    for (k, leg) in of.legs.0.iter().enumerate() {
        (stage.leg[k], stage.duty[k], stage.edge_ns[k]) = match *leg {
            Leg::Off => (abi::OFF, 0.0, 0),
            Leg::Low => (abi::LOW, 0.0, 0),
            Leg::High => (abi::HIGH, 0.0, 0),
            Leg::Duty(duty) => (abi::DUTY, duty, 0),
            Leg::Rise(at) => (abi::RISE, 0.0, edge(at)),
            Leg::Fall(at) => (abi::FALL, 0.0, edge(at)),
        };
    }
    stage
}

/// Returns a command for the drive.
pub fn command(of: &Command<f32>) -> abi::Command {
    abi::Command {
        stage: [stage(&of.stage), of.then.as_ref().map(stage).unwrap_or_default()],
        stages: 1 + u32::from(of.then.is_some()),
        samples: of.sampling.count,
        first_ns: of.sampling.first.0,
        interval_ns: of.sampling.interval.0,
        until: of.threshold.unwrap_or(0.0),
        ..abi::Command::default()
    }
}

/// Converts the outcome of a detection to status and result.
pub fn outcome(of: &Outcome<f32>) -> (i32, Answer) {
    let findings = of.findings();
    let mut answer = Answer {
        angle_deviation: findings.angle_deviation.unwrap_or(Answer::UNSET),
        pole_evidence: findings.pole_evidence.map_or(Answer::UNSET, |evidence| evidence.deviations),
        age: findings.age.unwrap_or(Answer::UNSET),
        pole_needed: findings.pole_evidence.map_or(Answer::UNSET, |evidence| evidence.needed),
        ..Answer::NONE
    };
    let status = match of {
        Outcome::Found { angle, .. } => {
            answer.angle = angle.radians();
            abi::FOUND
        }
        Outcome::Axis { angle, reason, .. } => {
            answer.angle = angle.radians();
            answer.reason = abi::axis_reason(reason);
            abi::AXIS
        }
        Outcome::Failed { fault, .. } => {
            answer.reason = abi::failure_reason(fault);
            abi::FAILED
        }
    };
    (status, answer)
}

/// Returns the answer to a call that was not expected.
pub fn unexpected() -> (i32, Answer) {
    (abi::FAILED, Answer { reason: abi::failure_reason::<f32>(&Fault::UnexpectedReadings), ..Answer::NONE })
}
