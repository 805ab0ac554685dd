//! The bench on which settings are tried: motor, drive and sensors from a document, and the demands.

use standstill_campaign::CampaignError;
use standstill_detect::{Method, MethodName};
use standstill_plant::Motor;
use standstill_scenario::{Document, FileError, Origin, Rotor, Scenario};
use standstill_sim::Arrangement;

use super::candidate::CANDIDATES;
use super::margins::Margins;
use super::starts::{self, Starts, Stopped};
use super::work::Allowance;
use super::{Demands, SuitabilityError};

/// A detection method with its settings. The settings are keys of `[detector]` with their values, as in a scenario file.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// The method.
    pub method: MethodName,
    /// Keys that are set, with their values. All other keys have the default value for the motor.
    pub keys: Vec<(&'static str, String)>,
}

impl Setting {
    /// Returns the method with its default settings for the motor.
    pub(super) const fn plain(method: MethodName) -> Self {
        Self { method, keys: Vec::new() }
    }

    /// Returns these settings with one key set.
    #[must_use]
    pub(super) fn with(&self, key: &'static str, value: &str) -> Self {
        let mut keys: Vec<_> = self.keys.iter().filter(|(other, _)| *other != key).cloned().collect();
        keys.push((key, value.to_owned()));
        Self { method: self.method, keys }
    }

    /// Returns the method and the settings as pairs of a key's path in a scenario and its value.
    pub fn in_scenario(&self) -> Vec<(String, String)> {
        let method = ("detector.method".to_owned(), self.method.name().to_owned());
        let others = self.keys.iter().map(|(key, value)| (format!("detector.{key}"), value.clone()));
        std::iter::once(method).chain(others).collect()
    }

    /// Writes the method and the settings into a document.
    ///
    /// # Errors
    /// A key cannot be set.
    pub fn set_in(&self, document: &mut Document) -> Result<(), FileError> {
        document.set("detector.method", self.method.name(), Origin::CommandLine)?;
        for (key, value) in &self.keys {
            document.set_value(&format!("detector.{key}"), toml_value(value), Origin::CommandLine)?;
        }
        Ok(())
    }
}

/// Converts a text to a TOML value: a whole number becomes an integer, all else a string.
fn toml_value(text: &str) -> toml::Value {
    text.parse::<i64>().map_or_else(|_| text.into(), toml::Value::Integer)
}

/// Settings that were tried on some simulated motor starts, with the margins by which these starts meet the demands.
#[derive(Clone, Debug)]
pub(super) struct Look {
    pub setting: Setting,
    pub margins: Margins,
}

/// Conditions under which settings are tried: a document, its motor, the demands and the allowed work.
pub(super) struct Bench<'a> {
    pub document: &'a Document,
    pub motor: &'a Motor,
    pub demands: &'a Demands,
    /// Budget of the work.
    pub work: &'a Allowance,
    /// Largest allowed phase current in A.
    pub most_current: f64,
    /// Largest current in A that the current sensors read, if it limits the allowed current.
    pub read_up_to: Option<f64>,
    /// States of the rotor in which settings are judged.
    pub rotors: Vec<Rotor>,
    /// True if the pole is judged besides the axis.
    pub has_pole: bool,
    /// Saturation of this bench's motor, as the share by which L_d falls at rated current. It is set only if this bench is the upper end of
    /// a range of saturation.
    pub most_saturation: Option<f64>,
    /// The bench at the upper end of the range of saturation, if this bench is the lower end. None without a range.
    pub upper_end: Option<&'a Bench<'a>>,
}

/// Text that replaces the result of settings whose starts were not run because the allowed work was used up.
pub(super) const SPENT: &str = "not tried, as this check may do no more work for it";

/// Largest allowed current as a share of the largest current that the sensors read. A reading at the end of the range may be a larger current.
pub(super) const READ: f64 = 0.98;

/// Number that is added to the scenario's seed for the starts of the search. Later stages add larger numbers. The seed itself is left for the
/// run that `check` prints, which must not repeat the starts that chose its settings.
pub(super) const SEARCH: u64 = 1;
const _: () = assert!(SEARCH > 0, "the run that check prints repeats the search");

impl<'a> Bench<'a> {
    /// Makes the bench of a document. If an override sets the state of the rotor, only this state is judged.
    pub fn new(document: &'a Document, motor: &'a Motor, demands: &'a Demands, work: &'a Allowance) -> Self {
        let state =
            document.origin("rotor.state").and_then(|_| document.load().ok()).map(|file| file.rotor.state());
        let allowed = demands.current_a.unwrap_or(motor.rated_current);
        let mut bench = Self {
            document,
            motor,
            demands,
            work,
            most_current: allowed,
            read_up_to: None,
            rotors: state.map_or(vec![Rotor::Locked, Rotor::Free], |state| vec![state]),
            has_pole: motor.has_magnet() && !motor.pole_knowledge().is_open(),
            most_saturation: None,
            upper_end: None,
        };
        bench.read_up_to = bench.range().filter(|range| READ * range < allowed);
        bench.most_current = bench.read_up_to.map_or(allowed, |range| READ * range);
        bench
    }
}

impl Bench<'_> {
    /// Returns the largest current in A that the current sensors read. None if their range has no end, or if comparators measure currents
    /// beside them or alone.
    fn range(&self) -> Option<f64> {
        let of = |method: &MethodName| self.scenario(&Setting::plain(*method), Rotor::Locked).ok();
        let sensors = CANDIDATES.iter().find_map(of)?.sensors;
        let reads = sensors.arrangement != Arrangement::None && sensors.comparator.timer == 0.0;
        sensors.adc.filter(|_| reads).map(|adc| adc.high)
    }

    /// Returns true if the user set this key of the detector. The search does not change its value then.
    pub fn is_set(&self, key: &str) -> bool {
        self.document.get(&format!("detector.{key}")).is_some()
    }

    /// Iterates over the benches at both ends of the range of saturation. Without a range, over this bench alone.
    pub fn ends(&self) -> impl Iterator<Item = &Self> {
        std::iter::once(self).chain(self.upper_end)
    }

    /// Returns the bench with the largest saturation. On this bench the same settings draw the most current.
    pub fn strained(&self) -> &Self {
        self.upper_end.unwrap_or(self)
    }

    /// Adds the saturation of this bench to the texts of objections if this bench is the upper end of a range of saturation.
    pub fn located(&self, mut objections: Vec<String>) -> Vec<String> {
        if let Some(share) = self.most_saturation {
            let with = format!(", with a saturation of {} %", standstill_quantity::rounded(share, 2));
            for objection in &mut objections {
                *objection += &with;
            }
        }
        objections
    }

    /// Returns the last judged state of the rotor. It is `free` if both states are judged.
    pub fn last_rotor(&self) -> Rotor {
        self.rotors.last().copied().unwrap_or(Rotor::Locked)
    }

    /// Returns the scenario with these settings and this state of the rotor. The scenario is not checked.
    pub fn scenario(&self, setting: &Setting, rotor: Rotor) -> Result<Scenario<Method<f64>>, FileError> {
        let mut document = self.document.clone();
        setting.set_in(&mut document)?;
        document.set("rotor.state", rotor.name(), Origin::CommandLine)?;
        // A driven rotor is not judged: its acceleration does not apply to a locked or a free one.
        document.remove("rotor.acceleration");
        if rotor == Rotor::Locked {
            // A locked rotor has no speed, and no load moves it.
            document.remove("rotor.load");
            document.remove("rotor.speed");
        }
        document.unchecked_scenario_of(self.motor)
    }

    /// Runs `trials` simulated motor starts with these settings. `draws` is added to the scenario's seed. The inner error states that the
    /// settings cannot be set up, or that no work is left.
    pub fn starts(
        &self,
        setting: &Setting,
        rotor: Rotor,
        draws: u64,
        trials: u64,
    ) -> Result<Result<Starts, String>, SuitabilityError> {
        if !self.work.has(0) {
            return Ok(Err(SPENT.to_owned()));
        }
        let mut scenario = self.scenario(setting, rotor)?;
        scenario.seed = scenario.seed.wrapping_add(draws);
        if let Err(error) = scenario.check() {
            return Ok(Err(format!("it cannot be set up: {error}")));
        }
        match Starts::of(&scenario, rotor, trials, self.work) {
            Ok(starts) => Ok(Ok(starts)),
            Err(Stopped::Spent) => Ok(Err(SPENT.to_owned())),
            Err(Stopped::Failed(SuitabilityError::Campaign(CampaignError::Settings(error)))) => {
                Ok(Err(format!("it cannot be set up: {error}")))
            }
            Err(Stopped::Failed(error)) => Err(error),
        }
    }

    /// Tries settings on `trials` simulated motor starts, with the rotor in the last judged state. None if the settings cannot be set up,
    /// or if no work is left.
    pub fn look(&self, setting: Setting, trials: u64) -> Result<Option<Look>, SuitabilityError> {
        let Ok(starts) = self.starts(&setting, self.last_rotor(), SEARCH, trials)? else { return Ok(None) };
        let margins = self.margins(&[&starts]);
        Ok(Some(Look { setting, margins }))
    }

    /// Returns the margins by which these starts meet the demands.
    pub fn margins(&self, starts: &[&Starts]) -> Margins {
        Margins::of(starts, self.demands, self.most_current, self.has_pole)
    }

    /// Returns descriptions of the demands that these starts do not meet.
    pub fn objections(&self, starts: &[&Starts]) -> Vec<String> {
        starts::objections(starts, self.demands, self.most_current, self.has_pole)
    }
}
