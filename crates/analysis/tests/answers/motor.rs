//! The two-vector test on the simulated motor, with noise alone.

use std::path::Path;

use standstill_analysis::Trials;
use standstill_numeric::erfc;
use standstill_scenario::{Document, Plan};
use standstill_sim::{Ended, Tape};

/// Standard deviations of the noise by which a draw is moved for its derivative.
const STEP: f64 = 0.5;

/// A plan of these lines.
pub fn plan(text: &str) -> Plan {
    let document = Document::parse(Path::new("test.toml"), text).expect("TOML");
    Plan::new(document).expect("a plan")
}

/// The paper's method with vectors of this current in A, at angles of all directions or one, with noise of this many A.
pub fn noisy(current: f64, noise: f64, angle: Option<f64>) -> Plan {
    let angle = angle.map_or_else(String::new, |angle| format!("rotor.angle = {angle}\n"));
    plan(&format!(
        "motor = \"paper-5k5\"\nerrors = \"noise\"\n{angle}sensors.noise = {noise}\n\
         [detector]\nmethod = \"line-inductance-fast\"\npolarity = \"two-vectors\"\nvector_current = {current}\n"
    ))
}

/// The probability that two readings order the poles wrongly, to first order in the noise: Q(Δ/|g|), where Δ is the difference of the
/// currents i_d without noise and g its derivatives by all readings' noise. Mean over 47 angles all round, or that of one, in degrees.
///
/// The two readings alone make |g| = √(4/3) σ, as each i_d of three sensors has √(2/3) of a reading's noise; the offset that is taken from
/// both, a mean of twelve waits, makes g² larger by a sixth. What was read of the lines before adds 0.5 %: the vectors' voltage follows from the inductance that they gave, and Δ grows with its square.
pub fn closed_form(current: f64, noise: f64, angle: Option<f64>) -> f64 {
    let angles =
        angle.map_or_else(|| (0..47).map(|k| 360.0 / 47.0 * f64::from(k)).collect(), |angle| vec![angle]);
    let wrong = |angle: &f64| {
        let (margin, deviation) = first_order(current, noise, *angle);
        0.5 * erfc(margin / deviation / 2.0_f64.sqrt())
    };
    angles.iter().map(wrong).sum::<f64>() / angles.len() as f64
}

/// The difference of the two currents without noise, and its standard deviation by the derivatives, in A.
pub fn first_order(current: f64, noise: f64, angle: f64) -> (f64, f64) {
    let plan = noisy(current, noise, Some(angle));
    let trials = Trials::new(&plan).expect("a scenario");
    let margins = |tapes: &[Tape]| -> Vec<f64> {
        let margin = |record: &standstill_scenario::Record| {
            let Ended::Outcome(outcome) = record.run.ended else { panic!("it runs") };
            let polarity = outcome.findings().polarity.expect("two vectors");
            polarity.along - polarity.against
        };
        trials.records(tapes).expect("trials").iter().map(margin).collect()
    };
    // One trial fills the tape with all the draws that it reads. Then all of them are set to zero: no noise.
    let mut quiet = Tape::new(1, 0);
    margins(std::slice::from_ref(&quiet));
    let count = |tape: &mut Tape| tape.strips().iter().map(|strip| strip.normals.len()).collect::<Vec<_>>();
    quiet.strips().iter_mut().for_each(|strip| strip.normals.fill(0.0));
    let counts = count(&mut quiet);
    let without = margins(std::slice::from_ref(&quiet))[0];
    assert_eq!(count(&mut quiet), counts, "it reads the same without noise");
    let draws =
        counts.iter().enumerate().flat_map(|(strip, count)| (0..*count).map(move |draw| (strip, draw)));
    let shifted = draws.map(|(strip, draw)| {
        let mut tape = quiet.clone();
        tape.strips()[strip].normals[draw] = STEP;
        tape
    });
    let shifted = margins(&shifted.collect::<Vec<_>>());
    let slopes = shifted.iter().map(|margin| (margin - without) / STEP);
    let squares: f64 = slopes.map(|slope| slope * slope).sum();
    (without.abs(), squares.sqrt())
}
