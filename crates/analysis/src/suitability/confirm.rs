//! Confirmation: checks settings on starts that were not used to choose them.
//!
//! Settings are searched with one seed, sifted (tried on a few hundred starts) with a second and confirmed with a third, so that the
//! reported starts were not used in the choice. If a confirmation fails, the next settings are confirmed with another seed, and each
//! failure lowers the confidence. All bounds of one answer hold together with at least the remaining confidence (Bonferroni).

use serde::Serialize;
use standstill_quantity::count;
use standstill_scenario::Rotor;

use super::SuitabilityError;
use super::bench::{Bench, SEARCH, Setting};
use super::search::is_slow;
use super::starts::Starts;

/// Numbers of simulated motor starts of the first and the second trial, in each state of the rotor. The second trial is run if the first is
/// not clear. Each bound has a confidence of 97.5 %, so that both trials together are wrong in less than 5 of 100 cases.
const LOOKS: [u64; 2] = [500, 2000];
/// Number of starts that show a share of wrong poles of at most one in ten thousand if none of them has a wrong pole.
pub const COUNTED: u64 = 37_000;
/// Number of starts of the preliminary trial, which precedes the confirmation of settings.
const SIFTED: u64 = 300;
/// Number of starts that replaces [`SIFTED`] for continuous injection. Such a start takes a hundred times as long.
const SLOWLY_SIFTED: u64 = 24;

/// Number that is added to the scenario's seed for the preliminary trial.
const SIFTING: u64 = SEARCH + 1;
/// Number that is added to the scenario's seed for the first confirmation.
const CONFIRMATION: u64 = SIFTING + 1;

/// Results of the fresh starts that confirmed settings. The bounds of the error and of the shares hold with [`Confirmed::confidence`].
/// Movement and current are the largest values in these starts.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Confirmed {
    /// Number of starts, over all states of the rotor and all tried saturations.
    pub starts: u64,
    /// Seed of the starts.
    pub seed: u64,
    /// Confidence of the bounds. It is 0.95, minus 0.05 for each confirmation that failed before.
    pub confidence: f64,
    /// Upper bound of the 95th percentile of the axis error, in degrees.
    pub p95_at_most_deg: f64,
    /// Upper bound of the share of starts without an angle or without a pole.
    pub without_angle_at_most: f64,
    /// Number of starts with a wrong pole.
    pub wrong_poles: u64,
    /// Number of starts in which wrong poles were counted. None if the distribution of the pole evidence already shows how rare they are.
    pub counted: Option<u64>,
    /// Upper bound of the share of wrong poles. It is computed from the number of wrong poles if they were counted, else from the normal
    /// distribution of the pole evidence. None if poles are not judged.
    pub wrong_poles_at_most: Option<f64>,
    /// Largest movement of a rotor that is not locked, in electrical degrees.
    pub moved_deg: f64,
    /// Largest phase current in A.
    #[serde(rename = "peak_current_A")]
    pub peak_current_a: f64,
}

impl Confirmed {
    /// Adds the results of starts in one state of the rotor and with one saturation. `without` is the upper bound of the share of these
    /// starts that have no angle or no pole.
    fn add(&mut self, starts: &Starts, without: f64) {
        let summary = &starts.summary;
        let largest = |all: &mut f64, value: f64| *all = all.max(value);
        self.starts += summary.trials;
        self.wrong_poles += summary.wrong_poles;
        largest(&mut self.p95_at_most_deg, summary.p95_deg.high);
        largest(&mut self.without_angle_at_most, without);
        largest(&mut self.peak_current_a, summary.peak_current_a);
        largest(&mut self.moved_deg, summary.max_moved_deg);
        if starts.spread.is_counted() {
            self.counted = Some(self.counted.unwrap_or(0) + summary.trials);
        }
        // A count of wrong poles is a bound only after many starts.
        if let Some(most) = &mut self.wrong_poles_at_most
            && (!starts.spread.is_counted() || summary.trials >= COUNTED)
        {
            largest(most, starts.wrong_poles_at_most());
        }
    }
}

/// Further starts that would show whether settings meet the demands. They are proposed if all fresh starts met the demands but were too few
/// to show it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wanting {
    /// Number of starts.
    pub starts: u64,
    /// Seed of these starts. The search did not use it.
    pub seed: u64,
}

/// Settings that fresh starts did not confirm.
#[derive(Debug)]
pub(super) struct Refused {
    /// Descriptions of the demands that the starts do not meet.
    pub objections: Vec<String>,
    /// Further starts that would show whether the demands are met: see [`Candidate::wanting`](super::Candidate::wanting).
    pub wanting: Option<Wanting>,
    /// True if the fresh starts met all demands but were too few to show it.
    pub is_open: bool,
}

impl Refused {
    /// Makes a refusal for objections that further starts cannot remove.
    pub const fn because(objections: Vec<String>) -> Self {
        Self { objections, wanting: None, is_open: false }
    }
}

impl Bench<'_> {
    /// Runs the preliminary trial of settings. Returns descriptions of the demands that its starts do not meet.
    pub fn sifted(&self, setting: &Setting) -> Result<Vec<String>, SuitabilityError> {
        let trials = if is_slow(setting.method) { SLOWLY_SIFTED } else { SIFTED };
        for bench in self.ends() {
            let rotor = bench.last_rotor();
            let objections = match bench.starts(setting, rotor, SIFTING, trials)? {
                Ok(starts) => bench.objections(&[&starts]),
                Err(problem) => vec![problem],
            };
            if !objections.is_empty() {
                return Ok(bench.located(objections));
            }
        }
        Ok(Vec::new())
    }

    /// Tries to confirm settings on fresh starts. `failed` is the number of earlier confirmations that failed. The inner error has the
    /// reasons why these starts do not confirm the settings.
    pub fn confirm(
        &self,
        setting: &Setting,
        failed: u64,
    ) -> Result<Result<Confirmed, Refused>, SuitabilityError> {
        let mut confirmed = Confirmed {
            starts: 0,
            seed: self.scenario(setting, Rotor::Locked)?.seed.wrapping_add(CONFIRMATION + failed),
            confidence: 1.0 - 0.05 * (failed + 1) as f64,
            p95_at_most_deg: 0.0,
            without_angle_at_most: 0.0,
            wrong_poles: 0,
            counted: None,
            wrong_poles_at_most: self.has_pole.then_some(0.0),
            moved_deg: 0.0,
            peak_current_a: 0.0,
        };
        for bench in self.ends() {
            for rotor in &bench.rotors {
                match bench.held(setting, *rotor, CONFIRMATION + failed)? {
                    Ok(starts) => confirmed.add(&starts, bench.without_answer(&starts)),
                    Err(refused) => {
                        let objections = bench.located(refused.objections);
                        return Ok(Err(Refused { objections, ..refused }));
                    }
                }
            }
        }
        Ok(Ok(confirmed))
    }

    /// Returns the upper bound of the share of starts that have no angle or no pole.
    fn without_answer(&self, starts: &Starts) -> f64 {
        let poles = if self.has_pole { starts.summary.undetermined } else { 0 };
        standstill_campaign::binomial_interval(starts.failed() + poles, starts.summary.trials).high
    }

    /// Runs starts in one state of the rotor until they show that the demands are met or are not met. The inner error has the reasons why
    /// the settings are not confirmed.
    fn held(
        &self,
        setting: &Setting,
        rotor: Rotor,
        draws: u64,
    ) -> Result<Result<Starts, Refused>, SuitabilityError> {
        let [few, many] = LOOKS;
        let mut trials = few;
        loop {
            let starts = match self.starts(setting, rotor, draws, trials)? {
                Ok(starts) => starts,
                Err(problem) => return Ok(Err(Refused::because(vec![problem]))),
            };
            let mut objections = self.objections(&[&starts]);
            if objections.is_empty() && !self.margins(&[&starts]).leaves_room() {
                objections.push("the largest movement or current of fresh starts is at its limit".to_owned());
            }
            if !objections.is_empty() {
                return Ok(Err(Refused::because(objections)));
            }
            let (p95, without) = (starts.summary.p95_deg.high, self.without_answer(&starts));
            let wrong = if self.has_pole { starts.wrong_poles_at_most() } else { 0.0 };
            let answers = p95 <= self.demands.error_deg && without <= self.demands.without_angle;
            let counts = starts.spread.is_counted() && !is_slow(setting.method);
            // The less the core saturates, the harder it is to distinguish the poles. Counting wrong poles takes the most time, so they are
            // counted only at the least saturation and with the rotor in its last state.
            let elsewhere = counts && (rotor != self.last_rotor() || self.most_saturation.is_some());
            if answers && (wrong <= self.demands.wrong_poles || elsewhere) {
                return Ok(Ok(starts));
            }
            let can_count = answers && counts && trials < COUNTED;
            trials = match trials {
                _ if can_count && self.work.has(starts.work / trials * COUNTED) => COUNTED,
                _ if !can_count && trials == few => many,
                _ => {
                    let objection = if can_count {
                        format!(
                            "{} fresh starts hold, and the {} that show wrong poles to be rarer than {} % are more than this check may do",
                            count(trials),
                            count(COUNTED),
                            100.0 * self.demands.wrong_poles
                        )
                    } else {
                        format!(
                            "{} fresh starts leave room for a p95 of {p95:.2}° ({}° demanded), {:.2} % without an angle or a pole ({} % demanded), {:.3} % wrong poles ({} % demanded)",
                            count(trials),
                            self.demands.error_deg,
                            100.0 * without,
                            100.0 * self.demands.without_angle,
                            100.0 * wrong,
                            100.0 * self.demands.wrong_poles,
                        )
                    };
                    // With a range of saturation, these starts tried one of its ends.
                    let is_all = self.upper_end.is_none() && self.most_saturation.is_none();
                    let seed = self.scenario(setting, rotor)?.seed.wrapping_add(draws);
                    let wanting = (is_all && trials < COUNTED).then_some(Wanting { starts: COUNTED, seed });
                    return Ok(Err(Refused { objections: vec![objection], wanting, is_open: true }));
                }
            };
        }
    }
}
