//! Random valid scenarios through the one engine: each detection ends with an outcome, or with a named error.
//!
//! A seed gives a scenario file ([`draw`]), whose first trials are run side by side as in a campaign. What must not
//! happen is a surprise ([`Surprise`]): it has the seed, and the scenario.

mod ask;
pub mod draw;
pub mod look;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use standstill_detect::Method;
use standstill_plant::Motor;
use standstill_scenario::{Document, FileError, Record, Scenario, Verdict};

/// How detections of random scenarios ended.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Scenarios that were drawn.
    pub scenarios: u64,
    /// Drawn texts that were refused with the name of a key; a part of each was drawn anew or left out.
    pub refused: u64,
    /// Detections that ended with axis and pole, with an axis, without an angle, and with a named error of the run.
    pub found: u64,
    pub undetermined: u64,
    pub failed: u64,
    pub errors: u64,
    /// Runs of detectors that ask for nonsense.
    pub nonsense: u64,
    /// Runs whose energies were looked at, and runs that the referee repeated.
    pub balanced: u64,
    pub refereed: u64,
    /// What must not happen.
    pub surprises: u64,
}

impl Tally {
    /// Returns the number of detections.
    pub fn detections(&self) -> u64 {
        self.found + self.undetermined + self.failed + self.errors
    }

    /// Returns all counts, each with its name.
    pub fn counts(&self) -> [(&'static str, u64); 10] {
        let names = [
            "scenarios",
            "refused",
            "found",
            "undetermined",
            "failed",
            "errors",
            "nonsense",
            "balanced",
            "refereed",
            "surprises",
        ];
        let counts = self.clone().counts_mut().map(|count| *count);
        std::array::from_fn(|k| (names[k], counts[k]))
    }

    /// Returns the places of all counts, in the order of [`Self::counts`].
    pub const fn counts_mut(&mut self) -> [&mut u64; 10] {
        [
            &mut self.scenarios,
            &mut self.refused,
            &mut self.found,
            &mut self.undetermined,
            &mut self.failed,
            &mut self.errors,
            &mut self.nonsense,
            &mut self.balanced,
            &mut self.refereed,
            &mut self.surprises,
        ]
    }
}

/// What must not happen, with all that repeats it.
#[derive(Clone, Debug)]
pub struct Surprise {
    /// The seed that gives the scenario.
    pub seed: u64,
    /// What happened.
    pub what: String,
    /// The scenario file; empty if none was drawn.
    pub text: String,
}

impl std::fmt::Display for Surprise {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { seed, what, text } = self;
        write!(
            f,
            "seed {seed}: {what}\ncargo run --release --example random_detections -- --only {seed}\n{text}"
        )
    }
}

/// A scenario that was drawn.
pub struct Drawn {
    pub text: String,
    pub scenario: Scenario<Method<f64>>,
}

/// Parses the lines of a scenario file, whose paths are relative to the repository.
pub fn document(lines: &[String]) -> Result<Document, FileError> {
    let file = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/random.toml"));
    Document::parse(file, &lines.join("\n"))
}

/// Returns what a refusal of a valid-looking file lacks; none if it names the key, what was found and what is needed.
fn unnamed(error: &FileError) -> Option<String> {
    match error {
        FileError::Key { key, message, .. } if !key.is_empty() && !message.is_empty() => None,
        FileError::Motor(_) => None,
        other => Some(format!("refused without a key: {other:?}")),
    }
}

/// Draws the scenario of a seed, whose detections take at most `longest` in s: the first text that is not refused. Counts refusals.
pub fn drawn(seed: u64, longest: f64, rng: &mut ChaCha8Rng, tally: &mut Tally) -> Result<Drawn, Surprise> {
    let surprise = |what: String, lines: &[String]| Surprise { seed, what, text: lines.join("\n") };
    let mut refused = |error: &FileError, lines: &[String]| {
        tally.refused += 1;
        unnamed(error).map_or(Ok(()), |what| Err(surprise(what, lines)))
    };
    let (motor, mut lines, nominal) = loop {
        let lines = draw::base(rng, seed);
        let made = document(&lines).and_then(|document| {
            let motor = document.motor()?;
            let nominal = document.scenario_of(&motor)?;
            Ok((motor, nominal))
        });
        match made {
            Ok((motor, nominal)) => break (motor, lines, nominal),
            Err(error) => refused(&error, &lines)?,
        }
    };
    lines.push(draw::time_limit(rng, nominal.drive.carrier_period.seconds(), longest));
    let plain = lines.len();
    let mut further = draw::some_keys(rng, &nominal, &lines);
    further.extend(draw::faults(rng, &nominal));
    lines.append(&mut further);
    loop {
        let made: Result<_, FileError> = document(&lines).and_then(|document| {
            let own = lines.iter().any(|line| line.contains("temperature"));
            let motor: Motor = if own { document.motor()? } else { motor.clone() };
            document.scenario_of(&motor)
        });
        match made {
            Ok(scenario) => return Ok(Drawn { text: lines.join("\n"), scenario }),
            Err(error) => refused(&error, &lines)?,
        }
        // One of the keys that were drawn, whichever it was.
        if lines.len() == plain {
            return Err(surprise("refused a time limit".to_owned(), &lines));
        }
        let out = rng.random_range(plain..lines.len());
        lines.remove(out);
    }
}

/// How many detections of each scenario are run, and of which scenarios more is asked.
#[derive(Clone, Copy, Debug)]
pub struct Depth {
    /// Longest simulated time in s of a detection.
    pub longest: f64,
    /// Detections of each scenario.
    pub trials: u64,
    /// Each scenario of this many is run with a ledger of its energies.
    pub balance: u64,
    /// Each scenario of this many is repeated by the referee, if it is short.
    pub referee: u64,
    /// Each scenario of this many gets a detector that asks for nonsense.
    pub nonsense: u64,
}

/// Draws and runs the scenario of a seed; adds how its detections ended.
pub fn run_seed(seed: u64, depth: Depth, tally: &mut Tally) -> Result<(), Surprise> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut text = String::new();
    let result = catch_unwind(AssertUnwindSafe(|| {
        tally.scenarios += 1;
        let drawn = drawn(seed, depth.longest, &mut rng, tally)?;
        text.clone_from(&drawn.text);
        let surprise = |what: String| Surprise { seed, what, text: drawn.text.clone() };
        let mut records: Vec<Record> = Vec::new();
        let ran = drawn.scenario.trials(0..depth.trials, |record| records.push(record));
        ran.map_err(|error| surprise(format!("a checked detector cannot be made: {error:?}")))?;
        for record in &records {
            look::over(record).map_err(surprise)?;
            let count = match record.verdict() {
                Verdict::Found => &mut tally.found,
                Verdict::Undetermined => &mut tally.undetermined,
                Verdict::Failed => &mut tally.failed,
                Verdict::Error => &mut tally.errors,
            };
            *count += 1;
        }
        if records.len() as u64 != depth.trials {
            return Err(surprise(format!("{} of {} detections ended", records.len(), depth.trials)));
        }
        if seed.is_multiple_of(depth.balance) {
            look::balances(&drawn.scenario).map_err(surprise)?;
            tally.balanced += 1;
        }
        if seed.is_multiple_of(depth.referee)
            && look::agrees_with_referee(&drawn.scenario).map_err(surprise)?
        {
            tally.refereed += 1;
        }
        if seed.is_multiple_of(depth.nonsense) {
            let record = drawn.scenario.trial_with(0, &mut ask::Nonsense::new(&mut rng));
            look::over(&record).map_err(|what| surprise(format!("nonsense: {what}")))?;
            tally.nonsense += 1;
        }
        Ok(())
    }));
    result.unwrap_or_else(|panic| {
        let words = panic.downcast_ref::<String>().map(String::as_str);
        let words = words.or_else(|| panic.downcast_ref::<&str>().copied());
        Err(Surprise { seed, what: format!("panic: {}", words.unwrap_or("without words")), text })
    })
}
