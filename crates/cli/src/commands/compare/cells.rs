//! The cells of `compare`: one scenario for each method under each set of conditions.

use std::path::Path;

use standstill_detect::{Method, MethodName};
use standstill_interface::Choice;
use standstill_plant::Motor;
use standstill_scenario::{Document, ErrorSet, FileError, Origin, Rotor, Scenario};
use toml::Value;

use crate::arguments::Compare;
use crate::error::Error;
use crate::scenario::{self, Shipped, Shorthands};
use crate::shell::values::each_once;

/// Keys that name a detector of the user's own: a library, a class of Python.
const OWN: [&str; 2] = ["detector.library", "detector.python"];

/// A row of the comparison before its trials have run: method, conditions and number of trials.
pub struct Cell {
    /// Name of the method or of the detector of the user's own.
    pub method: String,
    pub rotor: Rotor,
    pub errors: ErrorSet,
    pub trials: u64,
    pub scenario: Scenario<Method<f64>>,
}

/// Returns the keys that the options for motor, load, temperatures and seed set. Other commands accept these keys, too.
pub fn conditions(options: &Compare) -> Shorthands {
    Shorthands::default()
        .with("--motor", "motor", options.motor.clone())
        .load(options.load)
        .temperatures(options.temperature)
        .seed(options.seed)
}

/// Makes the scenario document that all cells have in common.
fn document(options: &Compare) -> Result<Document, Error> {
    let pulse = options.pulse.map(|pulse| format!("{pulse} µs"));
    let shorthands = conditions(options)
        .with("--polarity", "detector.polarity", options.polarity.map(Choice::name))
        .with("--signature", "detector.signature", options.signature.map(Choice::name))
        .with("--pulse", "detector.pulse", pulse)
        .with("--uncompensated", "detector.compensation", options.uncompensated.then_some(false))
        .trials(options.trials);
    scenario::document(&options.source, Shipped::Empty, shorthands)
}

/// A comparison before its trials have run: scenario document, motor, seed, and the cells (rows) to run.
pub struct Comparison {
    document: Document,
    pub motor: Motor,
    pub seed: u64,
    pub cells: Vec<Cell>,
    /// Methods that are left out, each with a given setting that the method does not have.
    pub left_out: Vec<(MethodName, String)>,
}

impl Comparison {
    pub fn new(options: &Compare) -> Result<Self, Error> {
        let document = document(options)?;
        let file = document.load_single()?;
        let (motor, seed, cells, left_out) = (document.motor()?, file.seed, Vec::new(), Vec::new());
        let mut comparison = Self { document, motor, seed, cells, left_out };
        // Conditions that the scenario sets hold for all methods. The scenario's default method does not matter.
        let is_set = |key: &str| comparison.document.get(key).is_some();
        let rotors = match &options.rotor[..] {
            [] if is_set("rotor.state") => vec![file.rotor.state()],
            [] => vec![Rotor::Locked, Rotor::Free],
            given => each_once(given.iter().copied()),
        };
        let errors = match &options.errors[..] {
            [] if is_set("errors") => vec![file.errors.0],
            [] => vec![ErrorSet::Default, ErrorSet::Harsh],
            given => each_once(given.iter().copied()),
        };
        let one = comparison.document.origin("detector.method").map(|_| vec![file.detector.method()]);
        let asked =
            if options.method.is_empty() { one } else { Some(each_once(options.method.iter().copied())) };
        let trials = is_set("trials").then_some(file.trials);
        // A detector of the user's own is compared with all methods, or with the methods that the user names.
        let own = OWN.iter().any(|key| is_set(key));
        let own_name = file.detector.name().to_owned();
        // Methods whose sensors this drive has.
        let served = file.served();
        let methods = asked.as_deref().unwrap_or(&served).iter().map(|method| Some(*method));
        for method in own.then_some(None).into_iter().chain(methods) {
            for &rotor in &rotors {
                for &errors in &errors {
                    // A load has no effect on a locked rotor. Beside other rotors it is left out for the locked one; if all rotors are
                    // locked, it is reported as a mistake.
                    let load = rotor != Rotor::Locked || rotors == [Rotor::Locked];
                    match comparison.scenario(method, rotor, errors, load) {
                        Ok(scenario) => {
                            let usual = if method == Some(MethodName::DcAlignment) { 20 } else { 500 };
                            let trials = trials.unwrap_or(usual);
                            let name = |method: MethodName| method.name().to_owned();
                            let method = method.map_or_else(|| own_name.clone(), name);
                            comparison.cells.push(Cell { method, rotor, errors, trials, scenario });
                        }
                        // A method that lacks one of the settings is left out. If the user named the method, the setting is reported as a
                        // mistake.
                        Err(error) => match (method, error.foreign_setting_in_words()) {
                            (Some(_), Some(_)) if asked.is_some() => return Err(comparison.no_use(method)),
                            (Some(method), Some(setting)) => comparison.leave_out(method, setting),
                            _ => return Err(error.into()),
                        },
                    }
                }
            }
        }
        if comparison.cells.is_empty() { Err(comparison.no_use(None)) } else { Ok(comparison) }
    }

    /// Adds a method to the list of methods that are left out, unless the list already contains it.
    fn leave_out(&mut self, method: MethodName, setting: String) {
        if self.left_out.last().is_none_or(|(last, _)| *last != method) {
            self.left_out.push((method, setting));
        }
    }

    fn scenario(
        &self,
        method: Option<MethodName>,
        rotor: Rotor,
        errors: ErrorSet,
        load: bool,
    ) -> Result<Scenario<Method<f64>>, FileError> {
        let mut document = self.document.clone();
        let method = method.map(|method| ("--method", "detector.method", method.name()));
        if method.is_some() {
            // Keys that only a detector of the user's own has.
            for key in OWN {
                document.remove(key);
            }
            document.remove("detector.config");
        }
        let conditions = [("--rotor", "rotor.state", rotor.name()), ("--errors", "errors", errors.name())];
        for (option, key, name) in method.into_iter().chain(conditions) {
            // A key that the scenario itself has keeps its origin.
            if document.get(key).and_then(Value::as_str) != Some(name) {
                document.set_value(key, name.into(), Origin::Option(option))?;
            }
        }
        if !load {
            document.remove("rotor.load");
        }
        document.scenario_of(&self.motor)
    }

    /// Returns the methods that have this setting and accept the given value.
    fn concerned(&self, key: &str, value: &Value) -> Vec<MethodName> {
        let has = |method: &MethodName| {
            let mut document = Document::parse(Path::new("scenario"), "")?;
            document.set("detector.method", method.name(), Origin::CommandLine)?;
            document.set_value(key, value.clone(), Origin::CommandLine)?;
            document.scenario_of(&self.motor)
        };
        let has = |method: &MethodName| !has(method).is_err_and(|error| error.is_foreign_setting());
        MethodName::ALL.into_iter().filter(has).collect()
    }

    /// Returns the error for a setting that `method` does not have. If `method` is `None`, returns the error for several settings that no
    /// single method has.
    fn no_use(&self, method: Option<MethodName>) -> Error {
        let table = self.document.get("detector").and_then(Value::as_table);
        let keys = table.into_iter().flatten().map(|(key, value)| (format!("detector.{key}"), value));
        let given: Vec<(String, Vec<MethodName>)> = keys
            .filter(|(key, _)| {
                !["detector.method", "detector.library", "detector.config"].contains(&key.as_str())
            })
            .map(|(key, value)| {
                let concerned = self.concerned(&key, value);
                let name = match self.document.origin(&key) {
                    Some(Origin::Option(option)) => option.to_owned(),
                    _ => format!("`{key}`"),
                };
                (name, concerned)
            })
            .filter(|(_, concerned)| concerned.len() < MethodName::ALL.len())
            .collect();
        let needless =
            given.iter().find(|(_, concerned)| method.is_some_and(|name| !concerned.contains(&name)));
        Error::Arguments(if let (Some(method), Some((given, concerned))) = (method, needless) {
            format!(
                "{given}: found with --method {method}, which has no use for it; allowed: {}",
                listed(concerned)
            )
        } else {
            let names: Vec<&str> = given.iter().map(|(name, _)| name.as_str()).collect();
            let each: Vec<String> =
                given.iter().map(|(name, concerned)| format!("{name}: {}", listed(concerned))).collect();
            format!(
                "{}: found together, but no method has a use for all of them; allowed: {}",
                names.join(", "),
                each.join("; ")
            )
        })
    }
}

fn listed(methods: &[MethodName]) -> String {
    methods.iter().map(|method| method.name()).collect::<Vec<_>>().join(", ")
}
