//! An exhaustive search: every method, on a fine grid of its pulses, rounds, thresholds, voltages and polarity vectors.
//!
//! What is certain shortens it, what is likely does not. Current and movement grow with the pulse, so a longer one need not be tried where
//! a shorter one broke the limit by far. Settings are dropped after few starts only if these contradict the demands: counts by their bound of 99.9 %, the
//! error by its 95 % interval. Axis and pole are found one after the other by methods with polarity vectors, so vectors are tried where the axis was found.

use standstill_analysis::{CANDIDATES, Demands};
use standstill_campaign::{Campaign, Summary};
use standstill_detect::{MethodName, Signature};
use standstill_plant::Motor;
use standstill_scenario::{Document, Origin, Rotor};

use crate::{Error, SEED};

/// What the grid showed.
#[derive(Default)]
pub struct Searched {
    /// Number of settings that could be set up and were tried.
    pub tried: usize,
    /// Methods of which there was any such setting.
    pub methods: Vec<MethodName>,
    /// Settings that met all demands on the fresh starts, in words.
    pub sufficing: Vec<String>,
    /// The settings that passed most stages, with what they then missed.
    pub nearest: Option<Near>,
}

/// Settings that missed a demand.
pub struct Near {
    /// Stage at which they were dropped.
    stage: usize,
    /// The miss: measured value over demanded one.
    by: f64,
    /// In words.
    pub said: String,
}

/// Numbers of starts of the stages, before the fresh ones.
const STAGES: [u64; 3] = [8, 64, 300];
/// Ratio of neighbouring pulse lengths, and of voltages.
const FINENESS: f64 = 1.1;
/// Numbers of rounds.
const ROUNDS: [u32; 13] = [1, 2, 3, 4, 6, 8, 12, 16, 24, 40, 64, 120, 255];
/// Currents of polarity vectors, and thresholds, as shares of the largest allowed current.
const CURRENTS: [f64; 11] = [0.99, 0.97, 0.94, 0.9, 0.85, 0.78, 0.7, 0.6, 0.45, 0.3, 0.15];
/// Excess of current or movement beyond which stronger pulses are not tried.
const FAR: f64 = 1.5;

/// A method with keys of the detector.
type Keys = Vec<(&'static str, String)>;

/// The conditions of a search.
pub struct Grid<'a> {
    /// The scenario, without a method.
    pub document: &'a Document,
    /// Its motor.
    pub motor: &'a Motor,
    /// What a start must meet.
    pub demands: &'a Demands,
    /// Number of fresh starts of what passes all stages, half of them in each state of the rotor.
    pub starts: u64,
}

/// How far settings came.
enum Fate {
    /// They cannot be set up.
    None,
    /// They missed a demand; `is_strong`: by far too much current or movement. `has_axis`: the axis alone met its demand.
    Missed {
        stage: usize,
        by: f64,
        what: String,
        is_strong: bool,
        has_axis: bool,
    },
    Suffices,
}

/// A demand, with the measured value over the demanded one, which is above 1 if it is missed.
struct Miss {
    of: &'static str,
    by: f64,
    said: String,
}

impl Grid<'_> {
    /// Tries all candidates of `check`, and of these all settings of the grid.
    pub fn search(&self) -> Result<Searched, Error> {
        let mut all = Searched::default();
        for method in CANDIDATES {
            let before = all.tried;
            for signature in self.signatures(method) {
                let plain: Keys =
                    signature.map(|of| ("signature", of.name().to_owned())).into_iter().collect();
                self.of_method(method, &plain, &mut all)?;
            }
            if all.tried > before {
                all.methods.push(method);
            }
        }
        Ok(all)
    }

    /// The signatures of the poles that are tried: the default, or both where the sheet gives none.
    fn signatures(&self, method: MethodName) -> Vec<Option<Signature>> {
        let document = self.with(method, &Vec::new());
        let Some(scenario) = document.and_then(|document| document.unchecked_scenario_of(self.motor).ok())
        else {
            return Vec::new();
        };
        if self.motor.has_magnet() && scenario.nameplate().pulse_signature == Signature::None {
            vec![Some(Signature::Normal), Some(Signature::Inverted)]
        } else {
            vec![None]
        }
    }

    fn of_method(&self, method: MethodName, plain: &Keys, all: &mut Searched) -> Result<(), Error> {
        let strengths: [(&'static str, Vec<String>); 3] = [
            ("pulse", geometric(1.0, 10e3).map(|value| format!("{value:.1} us")).collect()),
            ("threshold", CURRENTS.iter().rev().map(|share| self.amperes(*share)).collect()),
            ("voltage", geometric(0.01, 0.7).map(|share| self.volts(share)).collect()),
        ];
        let (mut has_strength, mut with_axis) = (false, Vec::new());
        for (key, values) in strengths {
            if !self.has_key(method, key, &values[0]) {
                continue;
            }
            has_strength = true;
            let mut strong = 0;
            for value in values {
                let mut is_strong = false;
                for rounds in self.rounds(method) {
                    let mut keys = plain.clone();
                    keys.push((key, value.clone()));
                    keys.extend(rounds.map(|rounds| ("rounds", rounds.to_string())));
                    let fate = self.tried(method, &keys, all)?;
                    if let Fate::Missed { is_strong: too_strong, .. } = fate {
                        is_strong |= too_strong;
                    }
                    if matches!(fate, Fate::Suffices | Fate::Missed { has_axis: true, .. }) {
                        with_axis.push(keys);
                    }
                }
                // One more length, in case that few rounds drew less by chance.
                strong = if is_strong { strong + 1 } else { 0 };
                if strong > 2 {
                    break;
                }
            }
        }
        if !has_strength
            && let Fate::Suffices | Fate::Missed { has_axis: true, .. } = self.tried(method, plain, all)?
        {
            with_axis.push(plain.clone());
        }
        if self.has_key(method, "vector_current", &self.amperes(0.5)) {
            for axis in with_axis {
                for share in CURRENTS {
                    for polarity in [None, Some("sequential")] {
                        let mut keys = axis.clone();
                        keys.push(("vector_current", self.amperes(share)));
                        keys.extend(polarity.map(|polarity| ("polarity", polarity.to_owned())));
                        self.tried(method, &keys, all)?;
                    }
                }
            }
        }
        Ok(())
    }

    /// Numbers of rounds that are tried: the method's own, or all if it has the key.
    fn rounds(&self, method: MethodName) -> Vec<Option<u32>> {
        let has_rounds = self.has_key(method, "rounds", "3");
        if has_rounds { ROUNDS.map(Some).to_vec() } else { vec![None] }
    }

    fn amperes(&self, share: f64) -> String {
        format!("{:.4e} A", share * self.most_current())
    }

    fn volts(&self, share: f64) -> String {
        let scenario = self.document.unchecked_scenario_of(self.motor);
        format!("{:.4e} V", share * scenario.map_or(self.motor.rated_current, |of| of.nameplate().dc_link))
    }

    /// Largest allowed phase current in A.
    pub fn most_current(&self) -> f64 {
        self.demands.current_a.unwrap_or(self.motor.rated_current)
    }

    /// The document with a method and its keys; none if the method has no such key.
    fn with(&self, method: MethodName, keys: &Keys) -> Option<Document> {
        let mut document = self.document.clone();
        document.set("detector.method", method.name(), Origin::CommandLine).ok()?;
        for (key, value) in keys {
            document.set(&format!("detector.{key}"), value, Origin::CommandLine).ok()?;
        }
        Some(document)
    }

    fn has_key(&self, method: MethodName, key: &'static str, value: &str) -> bool {
        let document = self.with(method, &vec![(key, value.to_owned())]);
        document.is_some_and(|document| document.unchecked_scenario_of(self.motor).is_ok())
    }

    /// Tries settings, stage by stage.
    fn tried(&self, method: MethodName, keys: &Keys, all: &mut Searched) -> Result<Fate, Error> {
        let Some(document) = self.with(method, keys) else { return Ok(Fate::None) };
        for (stage, starts) in STAGES.into_iter().enumerate() {
            for rotor in [Rotor::Free, Rotor::Locked] {
                let Some(summary) = summary(&document, self.motor, rotor, 1, starts)? else {
                    return Ok(Fate::None);
                };
                if stage == 0 && rotor == Rotor::Free {
                    all.tried += 1;
                }
                if let Some(fate) = self.missed(&summary, stage, true) {
                    all.hear(method, keys, &fate);
                    return Ok(fate);
                }
            }
        }
        for rotor in [Rotor::Free, Rotor::Locked] {
            let Some(summary) = summary(&document, self.motor, rotor, SEED, self.starts / 2)? else {
                return Ok(Fate::None);
            };
            if let Some(fate) = self.missed(&summary, STAGES.len(), false) {
                all.hear(method, keys, &fate);
                return Ok(fate);
            }
        }
        all.sufficing.push(said(method, keys));
        Ok(Fate::Suffices)
    }

    /// The demand that starts miss the most; `surely`: so that this is no chance of few starts.
    fn missed(&self, summary: &Summary, stage: usize, surely: bool) -> Option<Fate> {
        let misses = self.misses(summary, surely);
        let of = |name: &str| misses.iter().any(|miss| miss.of == name);
        let has_axis = !(of("error") || of("answers") || of("current") || of("movement"));
        let is_strong = misses.iter().any(|miss| ["current", "movement"].contains(&miss.of) && miss.by > FAR);
        let worst = misses.into_iter().max_by(|a, b| a.by.total_cmp(&b.by))?;
        Some(Fate::Missed { stage, by: worst.by, what: worst.said, is_strong, has_axis })
    }

    fn misses(&self, summary: &Summary, surely: bool) -> Vec<Miss> {
        let demands = self.demands;
        let all = summary.trials as f64;
        let has_poles = self.motor.has_magnet() && !self.motor.pole_knowledge().is_open();
        let mut misses = Vec::new();
        let mut look = |of: &'static str, measured: f64, lower: f64, most: f64, unit: &str| {
            // No number is no answer: what has no axis in any start has no error.
            if (if surely { lower } else { measured }) > most {
                misses.push(Miss {
                    of,
                    by: measured / most,
                    said: format!("{of} {measured:.3} of {most:.3}{unit}"),
                });
            }
        };
        let p95 = summary.p95_deg;
        look("error", p95.value, p95.low, demands.error_deg, "°");
        let share = |count: u64| (100.0 * count as f64 / all, 100.0 * surely_at_least(count, summary.trials));
        let (measured, least) = share(summary.failed + summary.errors);
        look("answers", measured, least, 100.0 * demands.without_angle, " % without");
        if has_poles {
            let (measured, least) = share(summary.undetermined);
            look("poles", measured, least, 100.0 * demands.without_angle, " % undetermined");
            let (measured, least) = share(summary.wrong_poles);
            look("wrong poles", measured, least, 100.0 * demands.wrong_poles, " %");
        }
        look("current", summary.peak_current_a, summary.peak_current_a, self.most_current(), " A");
        let moved = if summary.max_moved_deg.is_nan() { 0.0 } else { summary.max_moved_deg };
        look("movement", moved, moved, demands.movement_deg, "°");
        look("time", summary.mean_duration_s, summary.mean_duration_s, demands.time_s, " s");
        misses
    }
}

impl Searched {
    fn hear(&mut self, method: MethodName, keys: &Keys, fate: &Fate) {
        let Fate::Missed { stage, by, what, .. } = fate else { return };
        let is_nearer = self
            .nearest
            .as_ref()
            .is_none_or(|near| *stage > near.stage || *stage == near.stage && *by < near.by);
        if is_nearer {
            self.nearest =
                Some(Near { stage: *stage, by: *by, said: format!("{}: {what}", said(method, keys)) });
        }
    }
}

/// Share that is exceeded by so many counts of so many starts, except once in a thousand times: the lower Clopper–Pearson bound.
fn surely_at_least(count: u64, of: u64) -> f64 {
    // By bisection of the probability that as many or more are counted, which grows with the share.
    let reached = |share: f64| -> f64 {
        let (mut term, mut below) =
            (standstill_numeric::exp(of as f64 * standstill_numeric::ln(1.0 - share)), 0.0);
        for k in 0..count {
            below += term;
            term *= (of - k) as f64 / (k + 1) as f64 * share / (1.0 - share);
        }
        1.0 - below
    };
    let (mut low, mut high) = (0.0, count as f64 / of as f64);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if reached(middle) > 1e-3 { high = middle } else { low = middle }
    }
    low
}

/// Values from one to another, each larger by [`FINENESS`].
fn geometric(from: f64, to: f64) -> impl Iterator<Item = f64> {
    std::iter::successors(Some(from), |value| Some(value * FINENESS)).take_while(move |value| *value <= to)
}

/// A method and its keys in words.
fn said(method: MethodName, keys: &Keys) -> String {
    keys.iter().fold(method.name().to_owned(), |said, (key, value)| format!("{said} {key} {value}"))
}

/// What starts show; none if the settings cannot be set up.
fn summary(
    document: &Document,
    motor: &Motor,
    rotor: Rotor,
    seed: u64,
    trials: u64,
) -> Result<Option<Summary>, Error> {
    let mut document = document.clone();
    document.set("rotor.state", rotor.name(), Origin::CommandLine)?;
    document.set("seed", &seed.to_string(), Origin::CommandLine)?;
    let Ok(scenario) = document.unchecked_scenario_of(motor) else { return Ok(None) };
    if scenario.check().is_err() {
        return Ok(None);
    }
    Ok(Campaign { scenario: &scenario, trials, threads: None }.summary().ok())
}
