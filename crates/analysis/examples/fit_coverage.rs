//! Do the intervals of `standstill fit` hold? Pulses of ngspice (a linear motor) and SciPy (a saturated core), read by a
//! scope of eight bits with other noise each time: how often the truth is inside of the 95 % interval. The scope's samples are
//! as far apart as the drive's timer counts, so that all edges lie alike between two samples (drive); or they follow a clock of its
//! own, with each seed another one, so that edges lie anywhere (own); or the edges lie at four places between samples (pattern).
//! Each seed also draws the motor that the fit begins with, within the tolerances that a fit assumes: an interval contains what the readings
//! do not tell, so it can hold in 95 % only if that varies from seed to seed. docs/fit-coverage.txt has the tables.
//! Printed are the mean and the standard deviation of the estimates' errors beside the mean half width of the intervals, and how many
//! truths lie below and above theirs.
//!
//! ```sh
//! cargo run --release -p standstill-analysis --example fit_coverage SEEDS NOISE_IN_STEPS [ngspice|SciPy] [own|drive|pattern]
//! ```

#[path = "../tests/scope/mod.rs"]
mod scope;

use rayon::prelude::*;
use scope::{Pulses, Scope, beside};

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |k: usize| arguments.get(k).and_then(|text| text.parse::<f64>().ok());
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count")]
    let seeds = number(0).unwrap_or(200.0) as u64;
    let noise = number(1).unwrap_or(0.5);
    let asked = |words: &[&str], word: &str| {
        arguments.iter().any(|text| text == word) || !arguments.iter().any(|text| words.contains(&&text[..]))
    };
    for (name, range) in [("ngspice", 2.5), ("SciPy", 8.0)] {
        for beat in ["own", "drive", "pattern"] {
            if asked(&["ngspice", "SciPy"], name) && asked(&["own", "drive", "pattern"], beat) {
                let pulses = if name == "ngspice" { scope::ngspice() } else { scope::scipy() };
                let scope = |seed| Scope { noise, interval: interval(beat, seed), ..Scope::of(range) };
                table(&format!("{name}, {beat}"), &pulses, scope, seeds);
            }
        }
    }
}

/// Between two samples in s. A clock of its own: 1.00 to 1.08 µs, steps of the golden section from seed to seed.
fn interval(beat: &str, seed: u64) -> f64 {
    match beat {
        "drive" => scope::DRIVES_BEAT,
        "pattern" => scope::FOUR_PLACES,
        _ => 1e-6 * (1.0 + 0.08 * (0.618_033_988_75 * (seed + 1) as f64).fract()),
    }
}

fn table(title: &str, pulses: &Pulses, scope: impl Fn(u64) -> Scope + Sync, seeds: u64) {
    let fits: Vec<_> = (0..seeds)
        .into_par_iter()
        .map(|seed| pulses.found(&scope(seed), seed, &pulses.start(seed)))
        .collect();
    println!("{title}: {seeds} seeds, noise {} steps", scope(0).noise);
    println!(
        "  {:18} {:>13} {:>10} {:>9} {:>10} {:>9} {:>6} {:>6}  told",
        "", "truth", "bias", "deviation", "half width", "inside", "below", "above"
    );
    for estimate in &fits[0].parameters {
        let Some(truth) = pulses.truth_of(estimate, &scope(0)) else { continue };
        let mut seen = Seen::default();
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
            let turned = value - found.value;
            seen.add(value - truth, [low + turned - truth, high + turned - truth]);
        }
        seen.print(&estimate.name, truth);
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

/// Estimates of one parameter, beside its truth.
#[derive(Default)]
struct Seen {
    told: u32,
    /// Truths below and above the interval.
    beyond: [u32; 2],
    sum: f64,
    squares: f64,
    width: f64,
}

impl Seen {
    fn add(&mut self, off: f64, [low, high]: [f64; 2]) {
        self.told += 1;
        self.beyond[0] += u32::from(0.0 < low);
        self.beyond[1] += u32::from(0.0 > high);
        (self.sum, self.squares) = (self.sum + off, self.squares + off * off);
        self.width += (high - low) / 2.0;
    }

    fn print(&self, name: &str, truth: f64) {
        if self.told == 0 {
            println!("  {name:18} {truth:13.6e} {:>66}  0", "");
            return;
        }
        let n = f64::from(self.told);
        let bias = self.sum / n;
        let deviation = (self.squares / n - bias * bias).max(0.0).sqrt();
        let [below, above] = self.beyond;
        println!(
            "  {name:18} {truth:13.6e} {bias:10.1e} {deviation:9.1e} {:10.1e} {:7.1} % {below:6} {above:6}  {}",
            self.width / n,
            100.0 * f64::from(self.told - below - above) / n,
            self.told
        );
    }
}
