//! Whether settings hold on starts that nobody chose them by.
//!
//! Settings are found on one seed, sifted on a second and confirmed on a third, so that the starts that are reported had no part in the
//! choice. Where a confirmation fails, the next settings are confirmed on a seed of their own, and each failure costs confidence: all
//! bounds of one answer hold together with at least what is left (Bonferroni).

use standstill_scenario::Rotor;

use super::SuitabilityError;
use super::bench::{Bench, SEARCH, Setting};
use super::search::is_slow;
use super::starts::Starts;

/// Starts of each look in each state of the rotor: as many as it takes, and no more. Each bound is one of 97.5 %, so that both
/// looks together are wrong in less than 5 of 100 cases.
const LOOKS: [u64; 2] = [500, 2000];
/// Starts after which none with a wrong pole says that there are at most one in ten thousand.
const COUNTED: u64 = 37_000;
/// Starts by which settings are sifted, and those of an injection, which takes a hundred times as long.
const SIFTED: u64 = 300;
const SLOWLY_SIFTED: u64 = 24;

/// Seeds after that of the search.
const SIFTING: u64 = SEARCH + 1;
const CONFIRMATION: u64 = SIFTING + 1;

/// Results of fresh starts. The bounds of error and of starts without an answer have [`Confirmed::confidence`] each, for these settings;
/// movement and current are the largest of these starts.
#[derive(Clone, Debug, PartialEq)]
pub struct Confirmed {
    /// Starts in all: in each state of the rotor, with each saturation that was tried.
    pub starts: u64,
    /// Their seed.
    pub seed: u64,
    /// 0.95, less what settings that failed their confirmation cost.
    pub confidence: f64,
    /// 95 of 100 errors are within so many degrees at most.
    pub p95_at_most_deg: f64,
    /// At most this share ends without an angle or without a pole.
    pub without_angle_at_most: f64,
    /// Starts with a wrong pole.
    pub wrong_poles: u64,
    /// Starts in which they were counted where the evidence does not tell how rare they are; none where it does.
    pub counted: Option<u64>,
    /// At most this share has one: by their number where they were counted, else by the distance of the pole evidence, if that is
    /// normally distributed. None where poles are not judged.
    pub wrong_poles_at_most: Option<f64>,
    /// The furthest that a free rotor moved, in electrical degrees.
    pub moved_deg: f64,
    /// The largest current in A.
    pub peak_current_a: f64,
}

impl Confirmed {
    /// Adds starts under one condition.
    fn add(&mut self, starts: &Starts, without: f64) {
        let summary = &starts.summary;
        let largest = |all: &mut f64, value: f64| *all = all.max(value);
        self.starts += summary.trials;
        self.wrong_poles += summary.wrong_poles;
        largest(&mut self.p95_at_most_deg, summary.p95_deg.high);
        largest(&mut self.without_angle_at_most, without);
        largest(&mut self.peak_current_a, summary.peak_current_a);
        if starts.rotor == Rotor::Free {
            largest(&mut self.moved_deg, summary.max_moved_deg);
        }
        if starts.stops_when_content {
            self.counted = Some(self.counted.unwrap_or(0) + summary.trials);
        }
        // Where poles are counted, only the count of many starts is a bound.
        if let Some(most) = &mut self.wrong_poles_at_most
            && (!starts.stops_when_content || summary.trials >= COUNTED)
        {
            largest(most, starts.wrong_poles_at_most());
        }
    }
}

impl Bench<'_> {
    /// What speaks against settings before they are confirmed.
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

    /// Tries settings on fresh starts; what speaks against them where they do not hold. `failed` others did not hold before.
    pub fn confirm(
        &self,
        setting: &Setting,
        failed: u64,
    ) -> Result<Result<Confirmed, Vec<String>>, SuitabilityError> {
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
                    Err(objections) => return Ok(Err(bench.located(objections))),
                }
            }
        }
        Ok(Ok(confirmed))
    }

    /// At most this share of starts ends without an angle or a pole.
    fn without_answer(&self, starts: &Starts) -> f64 {
        let poles = if self.has_pole { starts.summary.undetermined } else { 0 };
        standstill_campaign::binomial_interval(starts.failed() + poles, starts.summary.trials).high
    }

    /// As many starts in one state of the rotor as it takes to say that the demands are met; what speaks against that.
    fn held(
        &self,
        setting: &Setting,
        rotor: Rotor,
        draws: u64,
    ) -> Result<Result<Starts, Vec<String>>, SuitabilityError> {
        let [few, many] = LOOKS;
        let mut trials = few;
        loop {
            let starts = match self.starts(setting, rotor, draws, trials)? {
                Ok(starts) => starts,
                Err(problem) => return Ok(Err(vec![problem])),
            };
            let mut objections = self.objections(&[&starts]);
            if objections.is_empty() && !self.margins(&[&starts]).leaves_room() {
                objections.push("the largest movement or current of fresh starts is at its limit".to_owned());
            }
            if !objections.is_empty() {
                return Ok(Err(objections));
            }
            let (p95, without) = (starts.summary.p95_deg.high, self.without_answer(&starts));
            let wrong = if self.has_pole { starts.wrong_poles_at_most() } else { 0.0 };
            let answers = p95 <= self.demands.error_deg && without <= self.demands.without_angle;
            let counts = starts.stops_when_content && !is_slow(setting.method);
            let in_another_state = counts && rotor != self.last_rotor();
            if answers && (wrong <= self.demands.wrong_poles || in_another_state) {
                return Ok(Ok(starts));
            }
            trials = match trials {
                _ if answers && counts && trials < COUNTED => COUNTED,
                _ if trials == few => many,
                _ => {
                    return Ok(Err(vec![format!(
                        "{trials} fresh starts leave room for a p95 of {p95:.2}° ({}° demanded), {:.2} % without an angle or a pole ({} % demanded), {:.3} % wrong poles ({} % demanded)",
                        self.demands.error_deg,
                        100.0 * without,
                        100.0 * self.demands.without_angle,
                        100.0 * wrong,
                        100.0 * self.demands.wrong_poles,
                    )]));
                }
            };
        }
    }
}
