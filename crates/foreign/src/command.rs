//! Commands of a library, as the bench has them.

use standstill_interface::{Abc, Command, Fault, Leg, Nanos, Sampling, Stage};

use crate::detector::broken;
use crate::guard::Guard;
use standstill_interface::abi::{self, Drive};

const PHASES: [char; 3] = ['a', 'b', 'c'];

/// Returns a duty of a phase, if it is one.
pub fn duty(phase: usize, duty: f32) -> Result<f64, Fault<f64>> {
    if (0.0..=1.0).contains(&duty) {
        Ok(f64::from(duty))
    } else {
        Err(broken(&format!("duty {duty} of phase {}, not from 0 to 1", PHASES[phase])))
    }
}

/// Returns a leg's state that there is not.
pub fn no_leg(phase: usize, leg: u8) -> Fault<f64> {
    broken(&format!("leg {} is asked for state {leg}, which is none of enum sts_leg", PHASES[phase]))
}

fn stage(from: &abi::Stage) -> Result<Stage<f64>, Fault<f64>> {
    let mut legs = [Leg::Off; 3];
    for (k, leg) in legs.iter_mut().enumerate() {
        let edge = Nanos(from.edge_ns[k].into());
        if [abi::RISE, abi::FALL].contains(&from.leg[k]) && edge.0 > from.duration_ns {
            let text = format!(
                "leg {} is to switch at {} ns of a stage of {} ns",
                PHASES[k], edge.0, from.duration_ns
            );
            return Err(broken(&text));
        }
        *leg = match from.leg[k] {
            abi::OFF => Leg::Off,
            abi::LOW => Leg::Low,
            abi::HIGH => Leg::High,
            abi::DUTY => Leg::Duty(duty(k, from.duty[k])?),
            abi::RISE => Leg::Rise(edge),
            abi::FALL => Leg::Fall(edge),
            other => return Err(no_leg(k, other)),
        };
    }
    Ok(Stage { legs: Abc(legs), duration: Nanos(from.duration_ns) })
}

/// Returns a command as the bench carries it out on this drive.
pub fn command(from: &abi::Command, drive: &Drive) -> Result<Command<f64>, Fault<f64>> {
    let then = match from.stages {
        1 => None,
        2 => Some(stage(&from.stage[1])?),
        other => return Err(broken(&format!("a command of {other} stages, not of 1 or 2"))),
    };
    let sampling =
        Sampling { first: Nanos(from.first_ns), interval: Nanos(from.interval_ns), count: from.samples };
    let threshold = threshold(from.until, drive)?;
    let command = Command { stage: stage(&from.stage[0])?, then, sampling, threshold };
    Guard::possible(&command).map_err(|wrong| broken(&wrong))?;
    Ok(command)
}

/// Returns the threshold of a command, if it has one.
fn threshold(until: f32, drive: &Drive) -> Result<Option<f64>, Fault<f64>> {
    let highest = drive.threshold_highest;
    match until {
        0.0 => Ok(None),
        _ if drive.timer_tick == 0.0 => Err(broken(&format!(
            "a command until {until} A on a drive without a timer behind comparators: `sensors.timer`"
        ))),
        until if highest > 0.0 && until > highest => Err(broken(&format!(
            "a command until {until} A, more than the {highest} A up to which the drive sets thresholds: `sensors.threshold_range`"
        ))),
        until => Ok(Some(f64::from(until))),
    }
}
