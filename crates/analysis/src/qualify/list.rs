//! A list of requirements: the file that it is read from, and the cases in which each requirement is judged.

use std::path::Path;

use serde::Deserialize;
use standstill_interface::Choice as _;
use standstill_plant::Source;
use standstill_quantity::unit::Share;
use standstill_quantity::{Quantity, rounded};
use standstill_scenario::{Document, FileError, Origin, Plan};
use toml::{Table, Value};

use super::demand::{Bad, Demand, LimitedMeasure};
use super::{Case, is_of_fault, texts, trials};
use crate::Demands;
use crate::faults::{Allowed, Entry};
use crate::subset::Effort;

/// The keys of a file of requirements, as its TOML text has them.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileTable {
    confidence: Option<Quantity<Share>>,
    trials: Option<u64>,
    unanswered: Option<Quantity<Share>>,
    odds: Option<String>,
    #[serde(default)]
    requirement: Vec<RequirementTable>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RequirementTable {
    id: String,
    text: String,
    limit: String,
    trials: Option<u64>,
    motors: Option<Vec<Value>>,
    errors: Option<Vec<Value>>,
    temperatures: Option<Vec<Value>>,
    #[serde(default)]
    over: Table,
}

/// A requirement on the simulated motor starts, as the file states it.
#[derive(Clone, Debug, PartialEq)]
pub struct Requirement {
    /// Identifier of the requirement, unique in the list.
    pub id: String,
    /// Text of the requirement in words.
    pub text: String,
    /// Text of the limit, as written in the file.
    pub limit: String,
    /// The limit that the text `limit` states.
    pub demand: Demand,
    /// Largest number of trials in each case.
    pub trials: u64,
    /// Conditions over which the requirement is judged. Each entry of the file has its name, the keys of the scenario that it sets, and the
    /// values of these keys.
    over: Vec<(String, Vec<String>, Vec<Value>)>,
}

/// A list of requirements that share one probability of error.
#[derive(Clone, Debug)]
pub struct Requirements {
    /// Probability that no verdict of the list is wrong.
    pub confidence: f64,
    /// Largest share of starts without an answer. With a larger share, a claim on the probability of an event cannot pass.
    pub unanswered: f64,
    /// Effort of the subset simulations, which decide if plain trials do not. None for no subset simulations.
    pub odds: Option<Effort>,
    /// The requirements in the order of the file.
    pub list: Vec<Requirement>,
    document: Document,
}

const CONFIDENCE: f64 = 0.95;
const TRIALS: u64 = 100_000;
/// Smallest number of trials in one case to which a requirement may be limited.
pub(super) const FEWEST: u64 = 64;
/// Largest number of trials in one case that a requirement may have. It is limited because contributions to an rms are kept in memory.
pub const MOST_TRIALS: u64 = 10_000_000;
/// Largest number of requirements in a list.
const MOST_REQUIREMENTS: usize = 1000;
/// Largest number of cases of one requirement.
const MOST_CASES: usize = 1000;

/// Shorthand for motors. It has the name in the file, and the key of the scenario that is set.
const MOTORS: (&str, &[&str]) = ("motors", &["motor"]);
/// Shorthand for sets of errors. It has the name in the file, and the key of the scenario that is set.
const ERRORS: (&str, &[&str]) = ("errors", &["errors"]);
/// Shorthand for temperatures. It has the name in the file, and the keys for the winding and the magnets that are set.
const TEMPERATURES: (&str, &[&str]) =
    ("temperatures", &["rotor.winding_temperature", "rotor.magnet_temperature"]);

impl Requirements {
    /// Reads a file of requirements.
    ///
    /// # Errors
    /// The file cannot be read, or a key or value is invalid. The error names the line of the key or value.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        Self::of(Document::read(path)?)
    }

    /// Parses requirements from the text of a file. Messages name the file `path`.
    ///
    /// # Errors
    /// A key or value is invalid. The error names the line of the key or value.
    pub fn parse(path: &Path, text: &str) -> Result<Self, FileError> {
        Self::of(Document::parse(path, text)?)
    }

    fn of(document: Document) -> Result<Self, FileError> {
        let file: FileTable = document.read_as()?;
        let within = |key: &str, given: Option<Quantity<Share>>, usual: f64, needed: &str| {
            let value = given.map_or(usual, Quantity::value);
            let refused = || document.refuse(key, &format!("{value}"), needed);
            if value > 0.0 && value < 1.0 { Ok(value) } else { Err(refused()) }
        };
        let confidence =
            within("confidence", file.confidence, CONFIDENCE, "a share such as \"95 %\", below 100 %")?;
        let usual = Demands::DEFAULT.without_angle;
        let unanswered = within(
            "unanswered",
            file.unanswered,
            usual,
            "a share such as \"1 %\", above 0 % and below 100 %",
        )?;
        let odds = match file.odds.as_deref() {
            None => Some(Effort::default()),
            Some("off") => None,
            Some(name) => Some(Effort::named(name).ok_or_else(|| {
                document.refuse("odds", &format!("`{name}`"), &format!("off, {}", Effort::NAMES.join(", ")))
            })?),
        };
        let trials = trials(&document, "trials", file.trials)?.unwrap_or(TRIALS);
        let found = file.requirement.len();
        if found == 0 || found > MOST_REQUIREMENTS {
            let needed = format!("1 to {MOST_REQUIREMENTS}, each below a line [[requirement]]");
            return Err(document.refuse("requirement", &format!("{found} requirements"), &needed));
        }
        let mut list: Vec<Requirement> = Vec::new();
        for (number, table) in file.requirement.into_iter().enumerate() {
            if let Some(first) = list.iter().position(|before| before.id == table.id) {
                let found = format!("`{}`, which requirement {} has", table.id, first + 1);
                return Err(document.refuse(
                    &key(number, "id"),
                    &found,
                    "an id that no other requirement has",
                ));
            }
            list.push(Requirement::of(&document, number, table, trials)?);
        }
        Ok(Self { confidence, unanswered, odds, list, document })
    }

    /// Makes the cases of all requirements for a scenario. Each case is made only once, and has the claims of all requirements on it.
    ///
    /// # Errors
    /// The values make no valid scenario, or a limit does not apply to the method or the drive. The error names the line of the
    /// requirement.
    pub(super) fn cases(&self, plan: &Plan, document: &Document) -> Result<Vec<Case>, FileError> {
        let mut cases: Vec<Case> = Vec::new();
        for (number, requirement) in self.list.iter().enumerate() {
            for settings in requirement.combinations() {
                let known = cases.iter().position(|case| case.is(&settings, requirement.demand.fault));
                let place = known.unwrap_or(cases.len());
                if known.is_none() {
                    cases.push(self.case(plan, document, number, settings)?);
                }
                self.check(number, &cases[place])?;
                cases[place].claim(number, requirement, self.unanswered);
            }
        }
        let claims: usize = cases.iter().map(|case| case.claims.len()).sum();
        let alpha = (1.0 - self.confidence) / claims as f64;
        for claim in cases.iter_mut().flat_map(|case| &mut case.claims) {
            claim.alpha = alpha;
        }
        Ok(cases)
    }

    /// Makes the case with these settings and with the fault of the requirement that has the index `number`.
    fn case(
        &self,
        plan: &Plan,
        document: &Document,
        number: usize,
        settings: Vec<(String, Value)>,
    ) -> Result<Case, FileError> {
        let requirement = &self.list[number];
        let place = |error: FileError| self.under(number, &settings, error);
        let mut document = document.clone();
        let before = plan.file().faults.len();
        let of_limit = |key: &str| requirement.demand.fault.is_some() && is_of_fault(key, before);
        if settings.iter().any(|(key, _)| of_limit(key) && key.split('.').next_back() == Some("mode")) {
            let at = key(number, &format!("over.faults.{before}.mode"));
            let needed = "a size or an onset of that fault";
            return Err(self.document.refuse(&at, "a mode beside the one of the limit", needed));
        }
        for (key, value) in settings.iter().filter(|(key, _)| !of_limit(key)) {
            document.set_value(key, value.clone(), Origin::Option("a requirement")).map_err(place)?;
        }
        let mut plan = plan.changed(document.clone()).map_err(place)?;
        let (mut without, mut entry) = (None, None);
        if let Some(mode) = requirement.demand.fault {
            let scenario = plan.scenario(0).map_err(place)?;
            if let Some(needed) = mode.lacks_usual(&scenario) {
                let found =
                    format!("the fault {}, which this drive{} cannot have", mode.name(), with(&settings));
                return Err(self.document.refuse(&key(number, "limit"), &found, needed));
            }
            let own = settings.iter().filter(|(key, _)| of_limit(key)).cloned();
            let fault = Entry::usual(mode, &scenario, before).with(own);
            (plan, without) = fault.plans(&plan, &document).map_err(place)?;
            entry = Some(fault);
        }
        let assumed = document.data_sheet().map_err(place)?.entries();
        let assumed = assumed.into_iter().filter(|entry| entry.source == Source::Assumed).collect();
        let scenario = plan.scenario(0).map_err(place)?;
        let allowed = Allowed::of(plan.file(), &scenario);
        let rated = scenario.motor.rated_current;
        let motor = scenario.motor.name.clone();
        Ok(Case { settings, fault: entry, plan, without, rated, allowed, motor, assumed, claims: Vec::new() })
    }

    /// Checks that a requirement's limit applies to a case.
    fn check(&self, number: usize, case: &Case) -> Result<(), FileError> {
        let refuse =
            |found: String, needed: &str| Err(self.document.refuse(&key(number, "limit"), &found, needed));
        let method = case.plan.file().detector.name();
        let scenario = case.plan.scenario(0)?;
        let is_foreign = scenario.foreign.is_some();
        let half = scenario.detector.half_sector().filter(|_| !is_foreign);
        let place = with(&case.settings);
        match (self.list[number].demand.what, half) {
            (LimitedMeasure::Coverage(_), _) if case.without.is_none() => refuse(
                format!("a coverage of {method}, which has no checks that could be switched off{place}"),
                "a method with `detector.checks`, such as bipolar, or `P(wrong_pole)` with the fault",
            ),
            (LimitedMeasure::Share { bad: Bad::WrongSector, .. }, None) if !is_foreign => refuse(
                format!("right_sector of {method}, whose answers are angles{place}"),
                "a limit of `|e|`, or a method that names sectors",
            ),
            (
                LimitedMeasure::Rms(_)
                | LimitedMeasure::Share { bad: Bad::Angle(_) | Bad::Axis(_) | Bad::AxisAtInstant(_), .. },
                Some(half),
            ) => refuse(
                format!(
                    "an angle of {method}, which names sectors of ±{}°{place}",
                    rounded(half.degrees(), 0)
                ),
                "`right_sector >= 99 %`, or a method whose answers are angles",
            ),
            (LimitedMeasure::Share { bad: Bad::WrongPole, .. }, _) if !scenario.motor.has_magnet() => refuse(
                format!("wrong_pole of {}, which has no magnet and so no poles{place}", scenario.motor.name),
                "a limit of its axis, such as `P(|e| > 5 deg) <= 1 %`",
            ),
            _ => Ok(()),
        }
    }

    /// Relates an error in a case to a line of its requirement. This is the line of the condition that sets the wrong key. If keys do not
    /// fit each other, it is the line of the limit, and the message names the conditions.
    fn under(&self, number: usize, settings: &[(String, Value)], error: FileError) -> FileError {
        let FileError::Key { key: wrong, .. } = &error else {
            return self.document.locate(FileError::Key {
                place: String::new(),
                key: key(number, "id"),
                message: error.to_string(),
            });
        };
        if settings.is_empty() {
            return error;
        }
        // A place in a list is written `faults[0]` in an error, and `faults.0` in a key.
        let wrong = &wrong.replace('[', ".").replace(']', "");
        let of =
            |key: &str| settings.iter().any(|(set, _)| key == set || key.starts_with(&format!("{set}.")));
        let mut over = self.list[number].over.iter();
        let (at, message) = match over.find(|(_, keys, _)| keys.contains(wrong)) {
            Some((name, ..)) => (name.as_str(), error.to_string()),
            None if of(wrong) => ("over", error.to_string()),
            None => (
                "limit",
                format!("requirement {} is judged{}; {error}", self.list[number].id, with(settings)),
            ),
        };
        self.document.locate(FileError::Key { place: String::new(), key: key(number, at), message })
    }
}

/// Returns the settings of a case as a phrase, such as ` with motor=paper-5k5`; empty without settings.
fn with(settings: &[(String, Value)]) -> String {
    if settings.is_empty() {
        return String::new();
    }
    format!(" with {}", texts(settings).join(", "))
}

/// Returns the path of a key of requirement `number` in the file.
fn key(number: usize, name: &str) -> String {
    format!("requirement[{number}].{name}")
}

impl Requirement {
    fn of(
        document: &Document,
        number: usize,
        table: RequirementTable,
        usual: u64,
    ) -> Result<Self, FileError> {
        let refuse =
            |name: &str, found: &str, needed: &str| document.refuse(&key(number, name), found, needed);
        if table.id.trim().is_empty() || table.id.chars().any(char::is_control) {
            return Err(refuse("id", &format!("{:?}", table.id), "a name in a line, such as \"START-1\""));
        }
        if table.text.trim().is_empty() {
            let needed = "the requirement in words, for the page to sign";
            return Err(refuse("text", &format!("{:?}", table.text), needed));
        }
        let demand = Demand::parse(&table.limit)
            .map_err(|(found, needed)| refuse("limit", &format!("{found} in `{}`", table.limit), &needed))?;
        let mut over = Vec::new();
        for ((name, keys), values) in
            [(MOTORS, table.motors), (ERRORS, table.errors), (TEMPERATURES, table.temperatures)]
        {
            if let Some(values) = values {
                over.push((name.to_owned(), keys.iter().map(|key| (*key).to_owned()).collect(), values));
            }
        }
        for (name, value) in table.over {
            let at = format!("over.{name}");
            let Value::Array(values) = value else {
                return Err(refuse(
                    &at,
                    &value.to_string(),
                    "a list of its values, such as [\"locked\", \"free\"]",
                ));
            };
            if ["seed", "trials", "limit", "stop_at", "axes", "tolerances", "design"]
                .iter()
                .any(|of| name.split('.').next() == Some(of))
            {
                return Err(refuse(
                    &at,
                    "a key of the run itself",
                    "a key of the motor, the drive, the rotor or the detector",
                ));
            }
            over.push((at, vec![name], values));
        }
        if let Some((name, ..)) = over.iter().find(|(.., values)| values.is_empty()) {
            return Err(refuse(name, "an empty list", "at least one value"));
        }
        let cases: usize = over.iter().map(|(.., values)| values.len()).fold(1, usize::saturating_mul);
        if cases > MOST_CASES {
            return Err(refuse(
                "limit",
                &format!("{cases} combinations of what it is judged over"),
                &format!("at most {MOST_CASES}"),
            ));
        }
        let trials = trials(document, &key(number, "trials"), table.trials)?.unwrap_or(usual);
        Ok(Self { id: table.id, text: table.text, limit: table.limit, demand, trials, over })
    }

    /// Returns all combinations of the values of the requirement's conditions, each as keys of the scenario with values.
    fn combinations(&self) -> Vec<Vec<(String, Value)>> {
        let mut all: Vec<Vec<(String, Value)>> = vec![Vec::new()];
        for (_, keys, values) in &self.over {
            let with = |settings: &Vec<(String, Value)>, value: &Value| {
                let set = keys.iter().map(|key| (key.clone(), value.clone()));
                settings.iter().cloned().chain(set).collect()
            };
            all = all
                .iter()
                .flat_map(|settings| values.iter().map(move |value| with(settings, value)))
                .collect();
        }
        all
    }
}
