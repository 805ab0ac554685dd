//! Variables of the draws and of the rotor.

use std::f64::consts::TAU;

use standstill_detect::Method;
use standstill_scenario::{Document, Scenario, keys};

use super::{Kind, Role, SHARE, Variable, number, of_key};
use crate::model::Part;

pub(super) fn draws(part: Part, document: &Document, scenario: &Scenario<Method<f64>>) -> Vec<Variable> {
    let (whole, allowed) = ([0.0, f64::from(i32::MAX)], format!("a whole number from 0 to {}", i32::MAX));
    let seed = document.load().map_or(1, |file| file.seed);
    let about = match part {
        Part::Drive => {
            "Seed of all that is drawn: the specimen of drive and sensors, the angle, noise and jitter"
        }
        Part::Motor => {
            "Seed of all that is drawn: the angle, where in a brake's play the rotor stands, what its iron remembers"
        }
    };
    let seeds = Variable::new("seed", about, Kind::Integer, Role::Seed);
    let mut all = vec![seeds.start(seed as f64).limits(whole, &allowed)];
    let about = "Which trial of that seed, from 0 as in the trials' file";
    let trials = Variable::new("trial", about, Kind::Integer, Role::Trial);
    all.push(trials.start(0.0).limits(whole, &allowed));
    if part == Part::Drive {
        let about = "When the converters sample, as a share of the step";
        let at = Variable::new("sample_at", about, Kind::Real, Role::SampleAt);
        all.push(at.unit("").start(1.0).limits([0.0, 1.0], SHARE));
    }
    let about = "Whether the trial draws the angle at which the rotor stands at the start. It does not once rotor.angle has another value than its start";
    let draw = Variable::new("rotor.draw_angle", about, Kind::Boolean, Role::DrawAngle);
    all.push(draw.start(f64::from(u8::from(scenario.start_angle.is_none()))));
    let about = "Electrical angle of the rotor at the start. While rotor.draw_angle is true, it is the one that the trial draws";
    let angle = Variable::new("rotor.angle", about, Kind::Real, Role::Angle).unit("rad");
    // Where the rotor of trial 0 stands, a free one where cogging lets it: at most a little beyond a turn.
    let start = scenario.start_angle.unwrap_or_else(|| scenario.case(0).start_angle);
    let start = if start.abs() > TAU { start - TAU.copysign(start) } else { start };
    all.push(angle.start(start).limits([-TAU, TAU], TURN));
    all
}

/// Allowed angles, in words. An importer that counts in degrees meets it soon.
const TURN: &str = "from -6.2832 to 6.2832 rad, a turn either way: 1° is 0.017453 rad";

pub(super) fn of_rotor(document: &Document, scenario: &Scenario<Method<f64>>) -> Vec<Variable> {
    let mut all = Vec::new();
    for key in keys() {
        let start = match key.path {
            "rotor.load" => number(scenario.value(key.path)),
            // Without it the motor is as its data sheet says.
            "rotor.winding_temperature" | "rotor.magnet_temperature" => document
                .get(key.path)
                .and_then(|value| value.as_float().or(value.as_integer().map(|n| n as f64))),
            _ => None,
        };
        all.extend(start.and_then(|start| of_key(key, start)));
    }
    all
}
