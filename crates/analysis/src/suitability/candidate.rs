//! Candidates: the methods that are tried, each with its best settings, and the choice of the recommended method.

use standstill_campaign::{Statistics, Summary};
use standstill_detect::{Method, MethodName, Source};
use standstill_plant::Motor;
use standstill_quantity::count;
use standstill_scenario::{Document, Rotor};

use super::bench::{Bench, Look, SEARCH, SPENT, Setting};
use super::confirm::{COUNTED, Refused, Wanting};
use super::margins::{Demand, Margins};
use super::search::{Found, SEARCHED, is_slow};
use super::starts::{Spread, Starts};
use super::work::Allowance;
use super::{Confirmed, Demands, Progress, SuitabilityError};

/// Methods that are tried if the drive measures the quantities that they need. They need no separate test bench and take a fraction of a
/// second. The method with six pulses is tried only if a timer measures times: with sampled currents, it measures less than `bipolar` does
/// with as many pulses.
pub const CANDIDATES: [MethodName; 7] = [
    MethodName::MaximumLikelihood,
    MethodName::MaximumLikelihoodAdaptive,
    MethodName::Bipolar,
    MethodName::LineInductanceFast,
    MethodName::HfiRotating,
    MethodName::OpenTerminal,
    MethodName::SixPulse,
];

/// A method with the best settings that were found for it.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// The method with the keys that the search has set.
    pub setting: Setting,
    /// All settings of the method for this motor, including those with default values.
    pub settings: Method<f64>,
    /// Results with a locked rotor. They contain no starts if a locked rotor is not judged.
    pub locked: Summary,
    /// Results with a free rotor, or with the rotor in the only judged state. They contain no starts if this state is `locked`.
    pub free: Summary,
    /// Reasons why the method does not suit the motor; empty if it does.
    pub objections: Vec<String>,
    /// Further starts that would show whether the demands are met. None unless the fresh starts of this check met all demands but were too
    /// few to show it.
    pub wanting: Option<Wanting>,
    /// Margins by which the demands are met. None if the method cannot be set up.
    pub margins: Option<Margins>,
    /// The demand that decides the verdict. If the method suits the motor: the demand with the smallest margin. If it does not: the demand
    /// that rules out stronger pulses. None if the DC-link voltage or the longest pulse limits the current instead.
    pub binding: Option<Demand>,
    /// Key of the detector with which the user set the current, so that no larger current was tried. None if the search chose the current.
    pub given: Option<&'static str>,
    /// Number of settings that were tried.
    pub looks: usize,
}

impl Candidate {
    /// Returns the candidate's method.
    pub const fn method(&self) -> MethodName {
        self.setting.method
    }

    /// Returns true if all starts with these settings were run. False if some were left out because no work was left.
    pub fn is_judged(&self) -> bool {
        !self.objections.iter().any(|objection| objection.starts_with(SPENT))
    }

    /// Returns the reason why the candidate is tried on fresh starts later than candidates with smaller margins. None without such a
    /// reason.
    pub fn why_late(&self) -> Option<String> {
        match self.lateness() {
            [true, _] => Some("its starts take a hundred times as long".to_owned()),
            [_, true] => Some(format!("its wrong poles must be counted in {} starts", count(COUNTED))),
            _ => None,
        }
    }

    /// Returns two flags that order the candidates for the trial on fresh starts, false first. The first is true if the method takes a
    /// hundred times as long as others. The second is true if wrong poles must be counted in many starts.
    fn lateness(&self) -> [bool; 2] {
        [is_slow(self.method()), Spread::of(self.settings).is_counted()]
    }

    /// Returns the smaller of the margins of error and movement. The demands are just met at 1. The result is 0 if the method cannot be set
    /// up or no start has an angle.
    pub fn margin(&self) -> f64 {
        self.margins.map_or(0.0, |margins| margins.spare())
    }
}

/// A method that is not a candidate because it does not have a setting of the detector that the scenario sets.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LeftOut {
    /// The method.
    pub method: MethodName,
    /// Name of the missing key. If the method has the key but lacks a check in the key's list, the check and the key.
    pub lacks: String,
}

/// Number of simulated motor starts of a candidate in each state of the rotor.
const TRIALS: u64 = 200;
/// Number of starts that replaces [`TRIALS`] for methods with continuous injection. Such a start takes a hundred times as long.
const FEW_TRIALS: u64 = 24;
/// Approximate number of starts that it takes to search two methods and to confirm the best one.
const OF_A_JUDGEMENT: u64 = 8000;
/// Largest number of settings of a method that are tried on fresh starts.
const TRIED: usize = 3;
/// Share of a method's work that the search of settings may use. The rest is for the starts of the best settings.
const LOOKS: f64 = 0.8;

/// Returns the candidate methods of a document, and the methods that are left out.
pub(super) fn methods(
    document: &Document,
    motor: &Motor,
    demands: &Demands,
    work: &Allowance,
) -> Result<(Vec<MethodName>, Vec<LeftOut>), SuitabilityError> {
    let only = |document: &Document| Ok((vec![document.load()?.detector.method()], Vec::new()));
    if document.origin("detector.method").is_some() {
        return only(document);
    }
    let bench = Bench::new(document, motor, demands, work);
    let (mut methods, mut left_out, mut unsuitable) = (Vec::new(), Vec::<LeftOut>::new(), None);
    let mut sources = Vec::new();
    for method in CANDIDATES {
        for rotor in &bench.rotors {
            match bench.scenario(&Setting::plain(method), *rotor) {
                Err(error) => match error.foreign_setting_in_words() {
                    Some(lacks) => {
                        if left_out.last().is_none_or(|last| last.method != method) {
                            left_out.push(LeftOut { method, lacks });
                        }
                        unsuitable = Some(error);
                    }
                    None => return Err(error.into()),
                },
                Ok(_) if methods.last() == Some(&method) => {}
                Ok(scenario) => {
                    sources = scenario.sources();
                    if is_tried(method, &sources) {
                        methods.push(method);
                    }
                }
            }
        }
    }
    // Even without the scenario's setting, methods whose readings the drive lacks are no candidates.
    left_out.retain(|of| is_tried(of.method, &sources));
    match unsuitable {
        Some(error) if methods.is_empty() => Err(error.into()),
        _ if methods.is_empty() => {
            // For a drive without readings, the error of the document's method says what the method needs.
            document.scenario_of(motor)?;
            only(document)
        }
        _ => Ok((methods, left_out)),
    }
}

/// Returns true if a method is a candidate on a drive that has the sources of readings `there`.
fn is_tried(method: MethodName, there: &[Source]) -> bool {
    let needed = match method {
        MethodName::SixPulse => &[Source::CapturedTimes],
        other => other.sources(),
    };
    Source::any_of(needed, there)
}

impl Bench<'_> {
    /// Searches settings of each method. Each method may use an equal share of the remaining work, and methods with long detections come
    /// last. Methods that used up their share are described in `untried`.
    pub fn searched(
        &self,
        methods: &[MethodName],
        untried: &mut Vec<String>,
        hear: &mut dyn FnMut(Progress<'_>),
    ) -> Result<(Vec<Candidate>, Vec<Found>), SuitabilityError> {
        let mut order: Vec<usize> = (0..methods.len()).collect();
        order.sort_by_key(|number| is_slow(methods[*number]));
        let mut all = Vec::new();
        for (done, number) in order.into_iter().enumerate() {
            let method = methods[number];
            hear(Progress::Method(method));
            let share = 1.0 / (methods.len() - done) as f64;
            let (answer, cut) = self.work.within(share, || {
                let (found, cut) = self.work.within(LOOKS, || self.search(method));
                let found = found?;
                Ok::<_, SuitabilityError>((self.candidate(method, &found)?, found, cut))
            });
            let (candidate, found, looks_cut) = answer?;
            if cut || looks_cut {
                untried.push(format!("more settings of {method}"));
            }
            hear(Progress::Found(&candidate));
            all.push((number, candidate, found));
        }
        all.sort_by_key(|(number, ..)| *number);
        Ok(all.into_iter().map(|(_, candidate, found)| (candidate, found)).unzip())
    }

    /// Returns true if it may take more work than is left to search and confirm settings whose starts take as long as those of `setting`.
    pub fn is_dear(&self, setting: &Setting) -> Result<bool, SuitabilityError> {
        let starts = self.starts(setting, self.last_rotor(), SEARCH, FEW_TRIALS)?;
        Ok(starts.is_ok_and(|starts| starts.work / FEW_TRIALS * OF_A_JUDGEMENT > self.work.left()))
    }

    /// Tries to confirm settings before others are searched. None if fresh starts do not confirm them.
    pub fn confirmed_first(
        &self,
        setting: &Setting,
        hear: &mut dyn FnMut(Progress<'_>),
    ) -> Result<Option<(Candidate, Found, Confirmed)>, SuitabilityError> {
        hear(Progress::Method(setting.method));
        let Some(look) = self.look(setting.clone(), FEW_TRIALS)? else { return Ok(None) };
        let found = vec![Found { looks: vec![look], stop: Some(Demand::Current) }];
        let mut candidates = vec![self.candidate(setting.method, &found[0])?];
        let recommended = self.recommended(&mut candidates, &found, hear)?;
        let all = candidates.pop().zip(found.into_iter().next());
        Ok(recommended.zip(all).map(|((_, confirmed), (candidate, looks))| {
            hear(Progress::Found(&candidate));
            (candidate, looks, confirmed)
        }))
    }

    /// Makes the candidate of a method from the best settings found.
    pub fn candidate(&self, method: MethodName, found: &Found) -> Result<Candidate, SuitabilityError> {
        let setting = found.looks.first().map_or_else(|| Setting::plain(method), |look| look.setting.clone());
        let settings = self.scenario(&setting, Rotor::Locked)?.detector;
        let trials = if is_slow(method) { FEW_TRIALS } else { TRIALS };
        let (mut states, mut objections) = (Vec::new(), Vec::new());
        for rotor in &self.rotors {
            match self.starts(&setting, *rotor, SEARCH, trials)? {
                Ok(starts) => states.push(starts),
                Err(problem) => objections = vec![problem],
            }
        }
        let all: Vec<&Starts> = states.iter().collect();
        objections.extend(self.objections(&all));
        let margins = (!all.is_empty()).then(|| self.margins(&all));
        let of = |wanted: bool| {
            let state = states.iter().find(|starts| (starts.rotor == Rotor::Locked) == wanted);
            state.map_or_else(|| Statistics::default().summary(), |starts| starts.summary.clone())
        };
        let binding = if objections.is_empty() {
            margins.map(|margins| margins.binding().0)
        } else {
            // Settings that are strong enough for the pole break another demand. If none are, a demand forbids stronger ones.
            let strong = found.looks.iter().find(|look| look.margins.pole.is_none_or(|pole| pole >= 1.0));
            strong.map_or(found.stop, |look| Some(look.margins.binding().0))
        };
        let looks = found.looks.len();
        Ok(Candidate {
            setting,
            settings,
            locked: of(true),
            free: of(false),
            objections,
            wanting: None,
            margins,
            binding,
            given: SEARCHED[..3].iter().copied().find(|key| self.is_set(key)),
            looks,
        })
    }

    /// Returns the index of the best candidate whose settings fresh starts confirm, with the results of these starts.
    pub fn recommended(
        &self,
        candidates: &mut [Candidate],
        found: &[Found],
        hear: &mut dyn FnMut(Progress<'_>),
    ) -> Result<Option<(usize, Confirmed)>, SuitabilityError> {
        let mut order: Vec<usize> = (0..candidates.len()).collect();
        order.retain(|number| candidates[*number].objections.is_empty());
        order.sort_by(|a, b| {
            let (a, b) = (&candidates[*a], &candidates[*b]);
            a.lateness().cmp(&b.lateness()).then(b.margin().total_cmp(&a.margin()))
        });
        let mut failed = 0;
        for number in order {
            // The best settings are tried even if the few starts of their look were not quite enough.
            let looks = found[number].looks.iter().enumerate();
            let looks = looks.filter(|(rank, look)| *rank == 0 || look.margins.is_kept());
            let (place, judged) = self.settled(looks, &mut failed, hear)?;
            if place > 0 {
                let one = Found { looks: vec![found[number].looks[place].clone()], stop: found[number].stop };
                candidates[number] = self.candidate(candidates[number].method(), &one)?;
            }
            let candidate = &mut candidates[number];
            match judged {
                Ok(confirmed) => {
                    self.take_upper_end(candidate)?;
                    return Ok(Some((number, confirmed)));
                }
                Err(refused) => {
                    (candidate.objections, candidate.wanting) = (refused.objections, refused.wanting);
                }
            }
        }
        Ok(None)
    }

    /// Runs fresh starts of the first settings in `looks` (at most [`TRIED`]) until one is confirmed, and returns its index and results.
    /// If none is, returns the index and the refusal of the first settings that more starts may still confirm, or else of the first
    /// settings. `failed` counts the settings that were not confirmed.
    pub fn settled<'a>(
        &self,
        looks: impl Iterator<Item = (usize, &'a Look)>,
        failed: &mut u64,
        hear: &mut dyn FnMut(Progress<'_>),
    ) -> Result<(usize, Result<Confirmed, Refused>), SuitabilityError> {
        let mut kept: Option<(usize, Refused)> = None;
        for (place, Look { setting, .. }) in looks.take(TRIED) {
            hear(Progress::Confirming(setting));
            let mut refused = Refused::because(self.sifted(setting)?);
            if refused.objections.is_empty() {
                match self.confirm(setting, *failed)? {
                    Ok(confirmed) => return Ok((place, Ok(confirmed))),
                    Err(why) => refused = why,
                }
                *failed += 1;
            }
            if kept.as_ref().is_none_or(|(_, kept)| refused.is_open && !kept.is_open) {
                kept = Some((place, refused));
            }
        }
        let (place, refused) = kept.unwrap_or_else(|| (0, Refused::because(Vec::new())));
        Ok((place, Err(refused)))
    }

    /// Lowers the margins of a confirmed candidate to the margins at the upper end of the range of saturation. Without a range, nothing
    /// changes.
    fn take_upper_end(&self, candidate: &mut Candidate) -> Result<(), SuitabilityError> {
        let (Some(end), Some(margins)) = (self.upper_end, candidate.margins) else { return Ok(()) };
        let trials = if is_slow(candidate.method()) { FEW_TRIALS } else { TRIALS };
        let mut states = Vec::new();
        for rotor in &end.rotors {
            states.extend(end.starts(&candidate.setting, *rotor, SEARCH, trials)?);
        }
        if !states.is_empty() {
            let least = margins.least(&end.margins(&states.iter().collect::<Vec<_>>()));
            (candidate.margins, candidate.binding) = (Some(least), Some(least.binding().0));
        }
        Ok(())
    }
}
