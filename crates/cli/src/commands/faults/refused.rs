//! Checks of the options of `faults` before the first trial.

use standstill_analysis::faults::{Begins, Entry};
use standstill_scenario::{FaultMode, Plan};
use standstill_sim::MOST_FAULTS;

use super::rates::Rates;
use crate::arguments::Faults as Options;
use crate::error::Error;

/// A fault that the drive cannot have, with the reason.
pub struct Left {
    pub mode: FaultMode,
    pub reason: String,
}

/// Checks that there is something to study. At least one fault is needed, or two faults if `--pairs` is given. If there are rates, one
/// fault must have a rate above zero. `left` has the faults that the drive cannot have.
pub fn are_studied(
    options: &Options,
    entries: &[Entry],
    left: &[Left],
    rates: Option<&Rates>,
) -> Result<(), Error> {
    let mut single: Vec<FaultMode> = entries.iter().filter_map(Entry::single).collect();
    single.dedup();
    let lacking = left.iter().map(|left| format!("{} (it needs {})", left.mode.name(), left.reason));
    let lacking = lacking.collect::<Vec<_>>().join(", ");
    if single.is_empty() && left.is_empty() {
        let begins: Vec<&str> = options.begins.iter().map(|begins| begins.name()).collect();
        let modes: Vec<&str> = options.mode.iter().map(|mode| mode.name()).collect();
        return Err(Error::Arguments(format!(
            "--begins: found {} with {}, which begins otherwise, needed {} or none",
            begins.join(", "),
            modes.join(", "),
            Begins::Before.name()
        )));
    }
    if single.is_empty() {
        return Err(Error::Arguments(format!(
            "--mode: found {lacking}, which this drive cannot have, needed at least one that it can"
        )));
    }
    if let ([mode], true) = (&single[..], options.pairs) {
        let cannot =
            if left.is_empty() { String::new() } else { format!(", beside {lacking}, which it cannot have") };
        return Err(Error::Arguments(format!(
            "--pairs: found {} alone of the faults that this drive can have{cannot}, needed two",
            mode.name()
        )));
    }
    if options.pairs && !entries.iter().any(|entry| entry.weighed().is_some()) {
        let begins: Vec<&str> = options.begins.iter().map(|begins| begins.name()).collect();
        return Err(Error::Arguments(format!(
            "--pairs: found --begins {}, needed {}, too: a pair is of faults that are there before the detection",
            begins.join(", "),
            Begins::Before.name()
        )));
    }
    let Some(rates) = rates else { return Ok(()) };
    if single.iter().any(|mode| rates.of(Some(*mode)).is_some_and(|rate| rate > 0.0)) {
        return Ok(());
    }
    Err(Error::Arguments(format!(
        "--rates: found no rate above zero of a mode that is studied, needed one of {}",
        single.iter().map(|mode| mode.name()).collect::<Vec<_>>().join(", ")
    )))
}

/// Checks that the scenario can take the faults to study in addition to its own faults.
pub fn has_room(options: &Options, plan: &Plan) -> Result<(), Error> {
    let own = &plan.file().faults;
    let (more, asked) = if options.pairs { (2, "two more by --pairs") } else { (1, "one more") };
    if own.len() + more <= MOST_FAULTS {
        return Ok(());
    }
    let keys: Vec<String> = own
        .iter()
        .enumerate()
        .map(|(k, fault)| format!("faults.{k}.mode = {}", fault.mode.0.name()))
        .collect();
    let without =
        if options.pairs && own.len() < MOST_FAULTS { "; without --pairs one more has room" } else { "" };
    Err(Error::Arguments(format!(
        "faults: found {} of the scenario ({}) and {asked}, needed {MOST_FAULTS} at most: take out {}{without}",
        own.len(),
        keys.join(", "),
        own.len() + more - MOST_FAULTS
    )))
}
