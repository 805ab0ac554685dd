//! Warnings on values that can be simulated but are probably mistakes, one line each, printed before the first trial.

use standstill_detect::Method;
use standstill_scenario::{Scenario, doubts};

use crate::shell::host;
use crate::shell::terminal::tell;

/// Prints a warning on standard error for each implausible value of a scenario. Prints nothing in a host program.
pub fn warn(scenario: &Scenario<Method<f64>>) {
    if host::current().is_none() {
        for doubt in doubts::of(scenario) {
            tell(&format!("warning: {doubt}"));
        }
    }
}

/// Prints a warning if the rotor is driven at 0 rpm without acceleration. Do not call this function for a sweep, because its speed may
/// begin at 0.
pub fn warn_standing(scenario: &Scenario<Method<f64>>) {
    if let Some(doubt) = doubts::standing(scenario).filter(|_| host::current().is_none()) {
        tell(&format!("warning: {doubt}"));
    }
}
