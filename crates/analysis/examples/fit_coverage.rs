//! Do the intervals of `standstill fit` hold? Pulses of ngspice (a linear motor) and SciPy (a saturated core), read by a
//! scope of eight bits with other noise each time: how often the truth is inside of the 95 % interval.
//!
//! ```sh
//! cargo run --release -p standstill-analysis --example fit_coverage [SEEDS] [NOISE IN STEPS]…
//! ```

#[path = "../tests/scope/mod.rs"]
mod scope;

use rayon::prelude::*;
use scope::{Pulses, Scope, beside};

fn main() {
    let mut arguments = std::env::args().skip(1);
    let seeds: u64 = arguments.next().and_then(|text| text.parse().ok()).unwrap_or(200);
    let noises: Vec<f64> = arguments.filter_map(|text| text.parse().ok()).collect();
    let noises = if noises.is_empty() { vec![0.5] } else { noises };
    for noise in noises {
        table("ngspice, linear", &scope::ngspice(), Scope { noise, ..Scope::of(2.5) }, seeds);
        table("SciPy, saturated", &scope::scipy(), Scope { noise, ..Scope::of(8.0) }, seeds);
    }
}

fn table(title: &str, pulses: &Pulses, scope: Scope, seeds: u64) {
    let start = |seed| scope::start(Some(scope::like_it()), seed);
    let fits: Vec<_> =
        (0..seeds).into_par_iter().map(|seed| pulses.found(&scope, seed, &start(seed))).collect();
    println!("{title}: {seeds} seeds, noise {} steps", scope.noise);
    println!("  {:20} {:>12} {:>12} {:>12} {:>10}  told", "", "truth", "mean", "half width", "inside");
    for estimate in &fits[0].parameters {
        let Some(truth) = pulses.truth_of(&estimate.name, &scope) else { continue };
        let (mut inside, mut told, mut sum, mut width) = (0_u32, 0_u32, 0.0, 0.0);
        for fit in &fits {
            let found = fit.parameters.iter().find(|one| one.name == estimate.name);
            let Some((found, [low, high])) = found.and_then(|one| Some((one, one.interval?))) else {
                continue;
            };
            if !found.identified {
                continue;
            }
            let value =
                beside(found.value, truth, found.unit, if fit.pole.identified { 360.0 } else { 180.0 });
            let half = (high - low) / 2.0;
            told += 1;
            inside += u32::from((value - truth).abs() <= half);
            (sum, width) = (sum + value, width + half);
        }
        let n = f64::from(told.max(1));
        println!(
            "  {:20} {truth:12.6e} {:12.6e} {:12.2e} {:>8.1} %  {told}",
            estimate.name,
            sum / n,
            width / n,
            100.0 * f64::from(inside) / n
        );
    }
    let mean = |value: fn(&standstill_analysis::fit::Fit) -> f64| {
        fits.iter().map(value).sum::<f64>() / fits.len() as f64
    };
    println!(
        "  residual {:.4} A, expected {:.4} A, intervals widened by {:.2}; poles named in {} of {seeds}\n",
        mean(|fit| fit.residual_rms),
        mean(|fit| fit.expected_rms),
        mean(|fit| fit.widened),
        fits.iter().filter(|fit| fit.pole.identified).count()
    );
}
