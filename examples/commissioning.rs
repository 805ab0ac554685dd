//! Can a drive learn the errors of its own line inductances, without a position sensor, from a few starts?
//!
//! A 4θ harmonic of the winding, a phase that differs and current sensors of unequal gain turn the axis that the three
//! line inductances tell, and no repetition at the same position shows it. Each start stands somewhere else, though, and
//! the lines of several unknown positions fit together in one way only.
//!
//! One specimen of the drive after the other learns from 16 random positions, or more if those lie too close to each
//! other, then is tried at 300 others.
//!
//! Run with `cargo run --release --example commissioning`.

use std::error::Error;
use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use standstill_campaign::{ErrorSet, Scenario, Specimen};
use standstill_detect::{
    Commissioning, CommissioningError, CommissioningSettings, Correction, Decay, Learnt, LineInductance,
};
use standstill_interface::{Abc, Angle};
use standstill_plant::{Harmonics, Motor, built_in};
use standstill_sim::{Ended, NoProbe, RotorState, run};

/// One start: where the rotor is, what the lines were, where its pole was found.
struct Start {
    truth: f64,
    lines: Abc<f64>,
    north: Option<Angle<f64>>,
}

/// A drive and all its starts so far.
struct Drive<'a> {
    scenario: &'a Scenario,
    specimen: u64,
    starts: u64,
    angles: ChaCha8Rng,
}

impl Drive<'_> {
    fn start(&mut self, pulses: u8) -> Result<Start, Box<dyn Error>> {
        self.starts += 1;
        let truth = self.angles.random_range(0.0..TAU);
        // The same drive with the same sensors, other noise.
        let specimen = Specimen { drive: self.specimen, noise: 1_000 * (self.specimen + 1) + self.starts };
        let case = self.scenario.case_at(truth, specimen);
        let mut settings = self.scenario.detector;
        settings.pulses = pulses;
        let run = run(&case, &mut LineInductance::new(settings)?, false, &mut NoProbe);
        let Ended::Outcome(outcome) = run.ended else { return Err("a run ended early".into()) };
        let lines = outcome.findings().line_inductance.ok_or("a start without lines")?;
        Ok(Start { truth, lines, north: run.found().map(Angle::from_radians) })
    }

    /// From 16 starts, or as many more as are needed.
    fn learn(&mut self, pulses: u8, poles: bool) -> Result<Learnt<f64>, Box<dyn Error>> {
        let saliency = self.scenario.detector.saliency;
        let settings =
            CommissioningSettings { least_positions: 16, ..CommissioningSettings::usual(saliency) };
        let mut commissioning = Commissioning::new(settings)?;
        loop {
            let start = self.start(pulses)?;
            commissioning.add(start.lines, start.north.filter(|_| poles))?;
            match commissioning.learn() {
                Err(CommissioningError::TooFew { .. } | CommissioningError::TooClose { .. }) => {}
                other => return Ok(other?),
            }
        }
    }
}

/// rms errors of the axis in degrees: before, after, after with the poles. Then the standard deviations that were stated
/// with the last: of the correction, and of one of the readings that it was learnt from.
fn row(scenario: &Scenario, specimens: u64, pulses: u8) -> Result<[f64; 5], Box<dyn Error>> {
    let mut squares = [0.0; 5];
    let trials = 300;
    for specimen in 0..specimens {
        let angles = ChaCha8Rng::seed_from_u64(specimen);
        let mut drive = Drive { scenario, specimen, starts: 0, angles };
        let blind = drive.learn(pulses, false)?;
        let sighted = drive.learn(pulses, true)?;
        squares[3] += sighted.deviations.axis.to_degrees().powi(2);
        squares[4] += (sighted.residual / sighted.saliency / 2.0).to_degrees().powi(2);
        for _ in 0..trials {
            let start = drive.start(scenario.detector.pulses)?;
            let error = |correction: &Correction<f64>, north| {
                let found = correction.apply(start.lines, scenario.detector.saliency, north);
                let off = 2.0 * (found.axis.radians() - start.truth);
                Angle::from_radians(off).difference(Angle::from_radians(0.0)).to_degrees() / 2.0
            };
            let errors = [
                error(&Correction::none(), None),
                error(&blind.correction, None),
                error(&sighted.correction, start.north),
            ];
            for (sum, error) in squares.iter_mut().zip(errors) {
                *sum += error.powi(2) / f64::from(trials);
            }
        }
    }
    Ok(squares.map(|sum| (sum / specimens as f64).sqrt()))
}

fn main() -> Result<(), Box<dyn Error>> {
    let motor = built_in("paper-5k5").ok_or("no such motor")?;
    let fourth = 0.03 * motor.winding.saliency;
    let asymmetry = 0.01 * motor.winding.mean_inductance;
    println!("L_4 = 3 % of L_B, phase a larger by 1 % of L_A");
    println!("                             rms error of the axis (°)    stated deviation (°)");
    println!("                             before   after  with poles   learnt  of a reading");
    let mut both = [0.0; 5];
    for (label, errors, specimens, pulses) in [
        ("default drive, 30 pulses a line to learn from", ErrorSet::Default, 4, 30),
        ("default drive", ErrorSet::Default, 4, 3),
        ("exact drive", ErrorSet::None, 1, 3),
    ] {
        println!("{label}");
        for (name, inductance_4, asymmetry) in [
            ("neither", 0.0, 0.0),
            ("harmonic", fourth, 0.0),
            ("asymmetry", 0.0, asymmetry),
            ("both", fourth, asymmetry),
        ] {
            let harmonics = Harmonics { inductance_4, asymmetry, ..Harmonics::default() };
            let magnetics = motor.magnetics.clone().with_harmonics(harmonics);
            let motor = Motor { magnetics, ..motor.clone() };
            let scenario = Scenario::paper(motor, errors, Decay::Fast, RotorState::Locked, 1);
            let found = row(&scenario, specimens, pulses)?;
            let [before, after, poles, learnt, reading] = found;
            println!("  {name:24} {before:8.3} {after:7.3} {poles:11.3} {learnt:8.3} {reading:13.3}");
            if errors == ErrorSet::Default && pulses == 3 {
                both = found;
            }
        }
    }
    println!(
        "\nYes: with both, from {:.2}° to {:.2}° where detections tell the pole, of which {:.2}° is the noise of the\n\
         single reading that is corrected. Saturation moves the lines with the pole: without it that part stays, and\n\
         is in the way of the others. What an exact drive keeps is that a pulse's current differs from line to line.",
        both[0], both[2], both[4]
    );
    Ok(())
}
