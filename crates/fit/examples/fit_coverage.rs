//! Do the intervals of `standstill fit` hold? Pulses of ngspice (a linear motor), of SciPy (a saturated core) and of a bridge of MOSFETs on
//! 12 V (`tests/scope/mosfet.rs`), read by a scope with other noise each time: how often the truth is inside of the 95 % interval.
//!
//! The first two are read with eight bits. The scope's samples are as far apart as the drive's timer counts, so that all edges lie alike
//! between two samples (drive); or they follow a clock of its own, with each seed another one, so that edges lie anywhere (own); or the
//! edges lie at four places between samples (pattern). With MOSFETs each seed draws motor and drive: a linear core; one of the fit's own
//! law; one of another law, with cross-saturation (steep, and mild with a sixth of it; lower and higher with other powers); the fit's law behind probes of 20 kHz (probe), or by one shunt in the DC
//! link (shunt); with eight bits or twelve.
//! Each seed also draws what the fit begins with, within the tolerances that a fit assumes: an interval contains what the readings
//! do not tell, so it can hold in 95 % only if that varies from seed to seed. docs/notes/fit-coverage.txt has the tables.
//! Printed are the mean and the standard deviation of the estimates' errors beside the mean half width of the intervals, and how many
//! truths lie below and above theirs.
//!
//! ```sh
//! cargo run --release -p standstill-fit --features measure --example fit_coverage SEEDS NOISE_IN_STEPS [ngspice|SciPy] [own|drive|pattern]
//! cargo run --release -p standstill-fit --features measure --example fit_coverage SEEDS NOISE_IN_STEPS linear|law|steep|mild|lower|higher|probe|shunt [12bits]
//! ```

#[allow(dead_code, reason = "the tests use the rest")]
#[path = "../tests/scope/mod.rs"]
mod scope;

use rayon::prelude::*;
use scope::mosfet::{Bench, Iron, drive, six_vectors};
use scope::{Pulses, Scope, beside};
use standstill_fit::record::Record;
use standstill_fit::{Fit, FitError, Start, fit};

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |k: usize| arguments.get(k).and_then(|text| text.parse::<f64>().ok());
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count")]
    let seeds = number(0).unwrap_or(200.0) as u64;
    let noise = number(1).unwrap_or(0.5);
    let asked_for = |word: &str| arguments.iter().any(|text| text == word);
    for (name, iron, lag) in [
        ("linear", Iron::Linear, 0.0),
        ("law", Iron::Series([0.05, 0.02, 0.02]), 0.0),
        ("steep", Iron::Steep([0.003, 3.0, 6.0]), 0.0),
        ("mild", Iron::Steep([0.0005, 3.0, 6.0]), 0.0),
        ("lower", Iron::Steep([0.018, 3.0, 3.0]), 0.0),
        ("higher", Iron::Steep([1.8e-5, 3.0, 10.0]), 0.0),
        ("probe", Iron::Series([0.05, 0.02, 0.02]), 8e-6),
        ("shunt", Iron::Series([0.05, 0.02, 0.02]), 0.0),
    ] {
        if asked_for(name) {
            let codes = if asked_for("12bits") { 2048.0 } else { 128.0 };
            table(&format!("MOSFETs on 12 V, {name}, {codes} codes"), seeds, |seed| {
                let bench = Bench::drawn(seed, iron);
                let pulses = bench.pulses(&six_vectors(bench.pulse(), 2.5 * bench.pulse()));
                let interval = 0.5 * interval("own", seed);
                let shunt = name == "shunt";
                let scope = Scope { noise, interval, codes, lag, shunt, delay: 0.3e-6, ..Scope::of(32.0) };
                (pulses, scope, drive(&bench, seed))
            });
            return;
        }
    }
    let asked = |words: &[&str], word: &str| {
        arguments.iter().any(|text| text == word) || !arguments.iter().any(|text| words.contains(&&text[..]))
    };
    for (name, range) in [("ngspice", 2.5), ("SciPy", 8.0)] {
        for beat in ["own", "drive", "pattern"] {
            if asked(&["ngspice", "SciPy"], name) && asked(&["own", "drive", "pattern"], beat) {
                let pulses = if name == "ngspice" { scope::ngspice() } else { scope::scipy() };
                table(&format!("{name}, {beat}"), seeds, |seed| {
                    let scope = Scope { noise, interval: interval(beat, seed), ..Scope::of(range) };
                    (pulses.clone(), scope, pulses.start(seed))
                });
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

fn table(title: &str, seeds: u64, case: impl Fn(u64) -> (Pulses, Scope, Start) + Sync) {
    let one = |seed: u64| {
        let (pulses, scope, start) = case(seed);
        let record = Record::parse("pulses.csv", &pulses.text(&scope, seed)).expect("a record");
        (fit(&[record], &start, &|| false), pulses, scope)
    };
    let all: Vec<(Result<Fit, FitError>, Pulses, Scope)> = (0..seeds).into_par_iter().map(one).collect();
    println!("{title}: {seeds} seeds, noise {} steps", all[0].2.noise);
    for (seed, (result, ..)) in all.iter().enumerate() {
        match result {
            Err(error) => println!("  seed {seed}: {error}"),
            Ok(fit) if !fit.converged || !fit.describes() => {
                println!("  seed {seed}: converged {}, widened by {:.2}", fit.converged, fit.widened);
            }
            Ok(_) => {}
        }
    }
    println!(
        "  {:22} {:>10} {:>9} {:>10} {:>9} {:>6} {:>6}  identified",
        "", "bias", "deviation", "half width", "inside", "below", "above"
    );
    let fits: Vec<(&Fit, &Pulses, &Scope, usize)> = all
        .iter()
        .enumerate()
        .filter_map(|(seed, (fit, pulses, scope))| Some((fit.as_ref().ok()?, pulses, scope, seed)))
        .collect();
    let mut names: Vec<&str> = Vec::new();
    for name in fits.iter().flat_map(|(fit, ..)| fit.parameters.iter().map(|one| &one.name[..])) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    for name in names {
        let mut seen = Seen::default();
        for (fit, pulses, scope, seed) in fits.iter().filter(|(fit, ..)| fit.converged && fit.describes()) {
            let Some(found) = fit.parameters.iter().find(|one| one.name == name && one.identified) else {
                continue;
            };
            let Some((truth, [low, high])) = pulses.truth_of(found, scope).zip(found.interval) else {
                continue;
            };
            let turn = if fit.pole.identified { 360.0 } else { 180.0 };
            let value = beside(found.value, truth, found.unit, turn);
            let turned = value - found.value;
            seen.add(value - truth, [low + turned - truth, high + turned - truth]);
            let off = (value - truth) / ((high - low) / 2.0);
            if off.abs() > 2.0 {
                println!("  seed {seed}: {name} is off by {off:.1} half widths");
            }
        }
        seen.print(name);
    }
    let mean =
        |value: fn(&Fit) -> f64| fits.iter().map(|(fit, ..)| value(fit)).sum::<f64>() / fits.len() as f64;
    println!(
        "  residual {:.4} A, expected {:.4} A, intervals widened by {:.2}; poles named in {} of {seeds}\n",
        mean(|fit| fit.residual_rms),
        mean(|fit| fit.expected_rms),
        mean(|fit| fit.widened),
        fits.iter().filter(|(fit, ..)| fit.pole.identified).count()
    );
}

/// Estimates of one parameter, beside its truth.
#[derive(Default)]
struct Seen {
    identified: u32,
    /// Truths below and above the interval.
    beyond: [u32; 2],
    sum: f64,
    squares: f64,
    width: f64,
}

impl Seen {
    fn add(&mut self, off: f64, [low, high]: [f64; 2]) {
        self.identified += 1;
        self.beyond[0] += u32::from(0.0 < low);
        self.beyond[1] += u32::from(0.0 > high);
        (self.sum, self.squares) = (self.sum + off, self.squares + off * off);
        self.width += (high - low) / 2.0;
    }

    fn print(&self, name: &str) {
        if self.identified == 0 {
            return;
        }
        let n = f64::from(self.identified);
        let bias = self.sum / n;
        let deviation = (self.squares / n - bias * bias).max(0.0).sqrt();
        let [below, above] = self.beyond;
        println!(
            "  {name:22} {bias:10.1e} {deviation:9.1e} {:10.1e} {:7.1} % {below:6} {above:6}  {}",
            self.width / n,
            100.0 * f64::from(self.identified - below - above) / n,
            self.identified
        );
    }
}
