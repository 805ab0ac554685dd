//! Entries of a study of faults: which modes, in which sizes, and when they begin.

use standstill_detect::Method;
use standstill_interface::choice;
use standstill_quantity::significant;
use standstill_scenario::{Document, FaultMode, FileError, Origin, Plan, Scenario};
use toml::Value;

use super::CHECKS;

/// Time in s for which a contact is open in an entry that begins [`Begins::Briefly`].
const INSTANT: f64 = 50e-6;

choice! {
    /// When a fault of a study begins.
    pub enum Begins {
        /// Before the detection.
        Before = "before",
        /// During the detection, at an instant that each trial draws; it stays.
        During = "during",
        /// During the detection, for 50 µs.
        Briefly = "50 us",
    }
}

/// One entry of a study of faults. It has no fault, one fault, or two faults that a drive has at once.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// One or two failure modes. Empty for the drive without a fault.
    pub modes: Vec<FaultMode>,
    /// When the faults begin.
    pub begins: Begins,
    /// Keys that put the faults into a scenario, such as `faults.0.mode`, with their values.
    pub keys: Vec<(String, Value)>,
}

impl Entry {
    /// Makes the entry of the drive without a fault.
    pub fn whole() -> Self {
        Self { modes: Vec::new(), begins: Begins::Before, keys: Vec::new() }
    }

    /// Returns the failure mode if the entry has exactly one fault, else none.
    pub fn single(&self) -> Option<FaultMode> {
        if let [mode] = self.modes[..] { Some(mode) } else { None }
    }

    /// Returns the failure mode if the entry has exactly one fault and this fault begins before the detection, else none. Failure rates
    /// apply only to such entries.
    pub fn weighed(&self) -> Option<FaultMode> {
        self.single().filter(|_| self.begins == Begins::Before)
    }

    /// Returns the names of the failure modes, joined by ` + `. None for the drive without a fault.
    pub fn name(&self) -> Option<String> {
        let names: Vec<&str> = self.modes.iter().map(|mode| mode.name()).collect();
        (!names.is_empty()).then(|| names.join(" + "))
    }

    /// Makes the entry of two faults with their typical sizes. `before` is the number of faults that the scenario already has.
    pub fn pair(modes: [FaultMode; 2], scenario: &Scenario<Method<f64>>, before: usize) -> Self {
        let [mut first, second] = [0, 1].map(|k| Self::usual(modes[k], scenario, before + k));
        first.modes.extend(second.modes);
        first.keys.extend(second.keys);
        first
    }

    /// Makes the entry of a fault with its typical size. `before` is the number of faults that the scenario already has.
    pub fn usual(mode: FaultMode, scenario: &Scenario<Method<f64>>, before: usize) -> Self {
        let key = |name: &str| format!("faults.{before}.{name}");
        let mut keys = vec![(key("mode"), Value::from(mode.name()))];
        if let Some(size) = mode.size() {
            let [low, high] = (size.typical)(scenario);
            let value = |number: f64| Value::Float(significant(number, 3));
            let size = if mode.is_fixed() || low == high {
                value(high)
            } else {
                Value::Array(vec![value(low), value(high)])
            };
            keys.push((key("magnitude"), size));
        }
        for (name, further) in mode.further() {
            let both = (further.size.typical)(scenario).map(|number| Value::Float(significant(number, 3)));
            keys.push((key(name), Value::Array(both.to_vec())));
        }
        Self { modes: vec![mode], begins: Begins::Before, keys }
    }

    /// Returns the entry with these keys added. A key that the entry already has is replaced.
    ///
    /// ```
    /// use std::path::Path;
    /// use standstill_analysis::faults::Entry;
    /// use standstill_scenario::{Document, FaultMode, Plan};
    ///
    /// let plan = Plan::new(Document::parse(Path::new("s.toml"), "motor = \"paper-5k5\"")?)?;
    /// let weak = Entry::usual(FaultMode::ContactResistance, &plan.scenario(0)?, 0);
    /// let keys = [("faults.0.magnitude", "2 ohm"), ("faults.0.onset", "1 ms")];
    /// let own = weak.with(keys.map(|(key, value)| (key.to_owned(), value.into())));
    /// let words = ["faults.0.mode=contact-resistance", "faults.0.magnitude=2 ohm", "faults.0.onset=1 ms"];
    /// assert_eq!(own.arguments(), words);
    /// # Ok::<(), standstill_scenario::FileError>(())
    /// ```
    #[must_use]
    pub fn with(mut self, keys: impl IntoIterator<Item = (String, Value)>) -> Self {
        for (key, value) in keys {
            match self.keys.iter_mut().find(|(own, _)| *own == key) {
                Some((_, of)) => *of = value,
                None => self.keys.push((key, value)),
            }
        }
        self
    }

    /// Iterates over the times at which a fault of this mode begins in a study. Every fault begins before the detection. If the mode allows
    /// it, the fault also begins during the detection. An open phase also begins during the detection for only 50 µs.
    pub fn ways(mode: FaultMode) -> impl Iterator<Item = Begins> {
        Begins::ALL.into_iter().filter(move |begins| match begins {
            Begins::Before => true,
            Begins::During => mode.may_begin(),
            Begins::Briefly => mode == FaultMode::PhaseOpen,
        })
    }

    /// Returns a copy of the entry with further keys. If the fault begins during the detection, they let each trial draw its onset between
    /// 0 and `duration`. `duration` is the duration of a detection in s.
    ///
    /// ```
    /// use std::path::Path;
    /// use standstill_analysis::faults::{Begins, Entry};
    /// use standstill_scenario::{Document, FaultMode, Plan};
    ///
    /// let plan = Plan::new(Document::parse(Path::new("s.toml"), "motor = \"paper-5k5\"")?)?;
    /// let open = Entry::usual(FaultMode::PhaseOpen, &plan.scenario(0)?, 0);
    /// let briefly = Entry { begins: Begins::Briefly, ..open };
    /// let words = briefly.over(9.4e-3).arguments();
    /// assert_eq!(words, ["faults.0.mode=phase-open", "faults.0.onset=[0.0, 0.0094]", "faults.0.lasts=0.00005"]);
    /// # Ok::<(), standstill_scenario::FileError>(())
    /// ```
    #[must_use]
    pub fn over(&self, duration: f64) -> Self {
        let mut entry = self.clone();
        let Some((fault, _)) = self.keys.first().and_then(|(key, _)| key.rsplit_once('.')) else {
            return entry;
        };
        if self.begins != Begins::Before {
            let onset = [0.0, significant(duration, 3)].map(Value::Float);
            entry.keys.push((format!("{fault}.onset"), Value::Array(onset.to_vec())));
        }
        if self.begins == Begins::Briefly {
            entry.keys.push((format!("{fault}.lasts"), Value::Float(INSTANT)));
        }
        entry
    }

    /// Returns the command-line arguments that put the fault into a scenario.
    pub fn arguments(&self) -> Vec<String> {
        let text = |value: &Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        self.keys.iter().map(|(key, value)| format!("{key}={}", text(value))).collect()
    }

    /// Makes two plans of a document with the fault. The first plan keeps the method's checks as they are, the second switches them off.
    /// There is no second plan for a method without checks.
    ///
    /// # Errors
    /// The scenario is invalid with the fault, or without the checks.
    pub fn plans(&self, plan: &Plan, document: &Document) -> Result<(Plan, Option<Plan>), FileError> {
        let mut broken = document.clone();
        for (key, value) in &self.keys {
            broken.set_value(key, value.clone(), Origin::Option("--mode"))?;
        }
        let mut unchecked = broken.clone();
        let broken = plan.changed(broken)?;
        // A library, a class of Python and methods without checks have no such key.
        if broken.scenario(0)?.value(CHECKS).is_none() {
            return Ok((broken, None));
        }
        unchecked.set_value(CHECKS, Value::Boolean(false), Origin::Option("--mode"))?;
        Ok((broken, Some(plan.changed(unchecked)?)))
    }
}
