//! Odds of an event by its closed form, by subset simulation and by plain trials: `wrong-evidence` of the simulated motor with
//! noise alone, where two readings of a current decide.
//!
//! ```text
//!   cargo run --release -p standstill-analysis --features measure --example plain -- 10000000 [SEED]
//! ```

use std::error::Error;
use std::sync::atomic::AtomicBool;

use standstill_analysis::{Event, Trials, subset::Settings};
use standstill_campaign::binomial_interval;
use standstill_sim::Tape;

#[path = "../tests/answers/motor.rs"]
mod motor;

/// In A: the vectors' current; noises with which the event happens once in a billion starts, and once in some 1e5.
const CURRENT: f64 = 5.0;
const NOISES: [f64; 2] = [0.020, NOISE_SEEN];
const NOISE_SEEN: f64 = 0.028;
/// A seed that no run of `odds` had, where none is given.
const SEED: u64 = 2;
const AT_ONCE: usize = 100_000;

fn main() -> Result<(), Box<dyn Error>> {
    let argument = |n: usize| std::env::args().nth(n).and_then(|text| text.parse::<u64>().ok());
    let (trials, seed) = (argument(1).unwrap_or(100_000), argument(2).unwrap_or(SEED));
    let never = AtomicBool::new(false);
    let event = Event::WrongEvidence;
    for noise in NOISES {
        let plan = motor::noisy(CURRENT, noise, None);
        let of = Trials::new(&plan)?;
        let odds =
            of.odds(event, &Settings::default(), &never, |_| {}).map_err(|halt| format!("{halt:?}"))?;
        let (p, truth) = (odds.probability, motor::closed_form(CURRENT, noise, None));
        println!("noise {noise} A: closed form {truth:.3e}");
        println!("  odds   {:.3e} [{:.3e}, {:.3e}], {} trials", p.value, p.low, p.high, odds.trials);
        println!("  alarms {:?}", odds.alarms);
    }
    let plan = motor::noisy(CURRENT, NOISE_SEEN, None);
    let of = Trials::new(&plan)?;
    let mut hits = 0;
    for start in (0..trials).step_by(AT_ONCE) {
        let tapes = (start..trials.min(start + AT_ONCE as u64)).map(|trial| Tape::new(seed, trial)).collect();
        let records = of.all_records(tapes, &never).map_err(|halt| format!("{halt:?}"))?;
        hits += records.iter().filter(|record| event.value(record) > 0.0).count() as u64;
    }
    let p = binomial_interval(hits, trials);
    println!(
        "noise {NOISE_SEEN} A: {hits} of {trials} plain trials, {:.3e} [{:.3e}, {:.3e}]",
        p.value, p.low, p.high
    );
    Ok(())
}
