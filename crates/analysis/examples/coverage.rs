//! Do the intervals of `odds` hold the truth in 95 of 100 answers?
//!
//! ```text
//!   cargo run --release -p standstill-analysis --example coverage -- 1000
//! ```
//! A two-vector test in Gaussian noise has the closed form Q(Δ/(√2 σ)). Each answer is eight runs; its seed is its number.

use std::convert::Infallible;
use std::sync::atomic::AtomicBool;

use rayon::prelude::*;
use standstill_analysis::{Halt, Odds, subset::Settings};

#[path = "../tests/systems/mod.rs"]
mod systems;

fn main() -> Result<(), Halt<Infallible>> {
    let answers: u64 = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(50);
    println!("{answers} answers each, seeds 1 to {answers}");
    println!("truth    held  below  above  within 1.5  mean/truth  width  alarms  trials an answer");
    for truth in [1e-3, 1e-6, 1e-9] {
        let system = systems::TwoVectors::of(truth);
        let answer = |seed| {
            let settings = Settings { seed, ..Settings::default() };
            let odds = Odds::of(&system, &settings, &AtomicBool::new(false), |_| {})?;
            // Thousands of answers with all their tapes would fill the memory.
            Ok(Odds { failures: Vec::new(), ..odds })
        };
        let all =
            (1..=answers).into_par_iter().map(answer).collect::<Result<Vec<Odds>, Halt<Infallible>>>()?;
        let count = |of: &dyn Fn(&Odds) -> bool| all.iter().filter(|odds| of(odds)).count();
        let mean = |of: &dyn Fn(&Odds) -> f64| all.iter().map(of).sum::<f64>() / answers as f64;
        println!(
            "{truth:.0e}  {:>5}  {:>5}  {:>5}  {:>10}  {:>10.4}  {:>5.3}  {:>6}  {:>9.0}",
            count(&|odds| odds.probability.low <= truth && truth <= odds.probability.high),
            count(&|odds| odds.probability.high < truth),
            count(&|odds| odds.probability.low > truth),
            count(&|odds| (2.0 / 3.0..=1.5).contains(&(odds.probability.value / truth))),
            mean(&|odds| odds.probability.value / truth),
            mean(&|odds| odds.probability.high / odds.probability.value),
            count(&|odds| !odds.alarms.is_empty()),
            mean(&|odds| odds.trials as f64),
        );
    }
    Ok(())
}
