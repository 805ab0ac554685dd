//! A detector of one's own in 60 lines: six voltage vectors, axis and pole from the harmonics of the response.
//!
//! A pulse along φ raises a current `I0 + I1 cos(φ − θ) + I2 cos 2(φ − θ)` in its own direction: I2 from saliency
//! (L_d < L_q answers with more current along d), I1 from saturation (more along north than along south). Six
//! vectors, 60° apart, are enough to tell the two harmonics apart.
//!
//! Run with `cargo run --release --example own_detector`.
#![allow(clippy::disallowed_methods, reason = "an example may differ in its last digits")]

use std::f64::consts::TAU;

use standstill_campaign::Statistics;
use standstill_detect::Decay;
use standstill_interface::{
    Abc, Angle, Command, Detector, Findings, Leg, Nanos, Outcome, Reading, Sampling, Stage, Step,
};
use standstill_plant::built_in;
use standstill_scenario::{ErrorSet, Scenario};
use standstill_sim::RotorState;

/// Switching states of the vectors at 0°, 60°, … 300°.
const VECTORS: [[Leg<f64>; 3]; 6] = {
    const H: Leg<f64> = Leg::High;
    const L: Leg<f64> = Leg::Low;
    [[H, L, L], [H, H, L], [L, H, L], [L, H, H], [L, L, H], [H, L, H]]
};

#[derive(Default)]
struct SixVectors {
    /// Current in A along each vector, per volt of the link.
    response: [f64; 6],
    /// Vectors ordered so far.
    ordered: usize,
}

impl Detector<f64> for SixVectors {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        if let Some(reading) = readings.first() {
            let k = self.ordered - 1;
            let direction = Angle::from_radians(TAU / 6.0 * k as f64);
            self.response[k] = reading.current.clarke().park(direction).d / reading.dc_link;
        }
        if let Some(legs) = VECTORS.get(self.ordered) {
            self.ordered += 1;
            let pulse = Nanos::from_micros(200);
            let stage = Stage { legs: Abc(*legs), duration: pulse };
            let rest = Stage::off(Nanos::from_micros(1000));
            return Step::Drive(Command::sequence(stage, rest, Sampling::once(pulse)));
        }
        let harmonic = |n: f64| {
            self.response.iter().enumerate().fold((0.0, 0.0), |(cos, sin), (k, response)| {
                let phase = n * TAU / 6.0 * k as f64;
                (cos + response * phase.cos(), sin + response * phase.sin())
            })
        };
        let (first, second) = (harmonic(1.0), harmonic(2.0));
        let axis = Angle::from_radians(second.1.atan2(second.0) / 2.0);
        let along = first.0 * axis.radians().cos() + first.1 * axis.radians().sin();
        let angle = if along > 0.0 { axis } else { axis.opposite() };
        Step::Done(Outcome::Found { angle, findings: Findings::default() })
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let motor = built_in("paper-5k5").ok_or("no such motor")?;
    for (errors, rotor) in [
        (ErrorSet::None, RotorState::Locked),
        (ErrorSet::Default, RotorState::Locked),
        (ErrorSet::Default, RotorState::Free),
        (ErrorSet::Harsh, RotorState::Locked),
    ] {
        let scenario = Scenario::paper(motor.clone(), errors, Decay::Fast, rotor, 1);
        let mut statistics = Statistics::default();
        for trial in 0..1000 {
            statistics.add(&scenario.trial_with(trial, &mut SixVectors::default()));
        }
        let s = statistics.summary();
        println!(
            "{:8} {rotor:?}: rms {:.2}°, wrong poles {} of {}, rotor moved at most {:.2}°, {:.1} ms",
            errors.name(),
            s.rms_deg.value,
            s.wrong_poles,
            s.trials,
            s.max_moved_deg,
            s.mean_duration_s * 1e3
        );
    }
    Ok(())
}
