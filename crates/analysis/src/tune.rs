//! Tunes settings: makes a measure as small as possible while limits hold.
//!
//! ```text
//!   several starts ─► wide descents, few trials ─► the best three: close descents, more trials ─► the best eight
//!                                       seed s                                                        │ seed s + 1: which
//!   start and best, both on seed s + 2 ◄─────────────────────────────────────────────────────────────┘
//! ```
//! Within each stage all settings use the same random numbers. Settings found with these random numbers suit them slightly better than
//! others, so the choice among the last settings uses new random numbers, and so do the printed figures.

mod compare;
mod front;
mod goal;
mod search;
mod space;

#[cfg(test)]
mod tests;

use std::cell::RefCell;
use std::collections::HashMap;

use standstill_campaign::Estimate;
use standstill_numeric::whole;
use standstill_scenario::{Document, FileError};

pub use compare::{Unseen, paired, unseen};
pub use goal::{Goal, Measured, Score, View};
pub use search::{Descent, Look, Search, Taker};
pub use space::Range;

use crate::bracket::Verdict;
use crate::limit::{Limit, Limits, Measure, Tally};
use crate::require::Bench;
use crate::{Halt, Watch};

/// Measures that are reported for all settings.
const ALWAYS_REPORTED: [Measure; 6] = [
    Measure::Rms,
    Measure::WrongPoles,
    Measure::Unanswered,
    Measure::Moved,
    Measure::Duration,
    Measure::PeakCurrent,
];

/// Effort of the search, as numbers of initial settings and of trials.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort {
    /// Number of initial settings from which the search starts. One of them is the scenario's own.
    pub starts: usize,
    /// Number of trials per setting in the wide descents.
    pub coarse: u64,
    /// Number of trials per setting in the close descents.
    pub fine: u64,
    /// Number of trials per setting in the final choice, and for the printed results.
    pub last: u64,
}

impl Effort {
    /// Returns the effort with at least `last` trials for the final choice. There are more if the limit of a share needs them: n trials
    /// without an occurrence show only that the share is below 3.7/n.
    pub fn new(last: u64, limits: &Limits) -> Self {
        let shares = limits.0.iter().filter(|limit| limit.measure.unit().is_none());
        let least = shares.map(|limit| limit.most).fold(1.0, f64::min);
        let needed: u64 = whole((NEEDED / least).min(200_000.0));
        let last = last.max(2 * needed);
        Self { starts: 6, coarse: (last / 40).max(200), fine: Self::fine(last).max(needed), last }
    }
}

/// Smallest product of the number of trials and the limit of a share with which trials can show that the limit holds.
const NEEDED: f64 = 4.5;

impl Effort {
    /// Returns the number of trials per setting in the close descents.
    fn fine(last: u64) -> u64 {
        // With fewer trials, the upper end of a 99th percentile's interval is unknown.
        (last / 8).max(600)
    }

    /// Returns the smallest limit of a share that the trials of a close descent can show to hold. `last` is the number of trials in the
    /// final choice.
    pub fn least_share(last: u64) -> f64 {
        NEEDED / Self::fine(last) as f64
    }
}

/// Task of the search: the scenario, the keys with their ranges, and the goal.
#[derive(Debug)]
pub struct Question<'a> {
    /// The scenario whose keys are tuned.
    pub document: &'a Document,
    /// Keys that are tuned, with the ranges of their values.
    pub ranges: Vec<Range>,
    /// Measure to be minimised, and limits to be kept.
    pub goal: Goal,
    /// Measures that must not exceed their value at the initial settings (`moved <= start`). They are compared trial by trial, because a
    /// paired difference has a far narrower interval.
    pub relative: Vec<Measure>,
    /// Measure on the second axis of the Pareto front. The first axis is the minimised measure.
    pub against: Measure,
    /// Effort of the search.
    pub effort: Effort,
    /// Seed of the search. The final choice uses the next seed, and the printed results use the seed after that.
    pub seed: u64,
}

/// Settings and their measures.
#[derive(Clone, Debug, PartialEq)]
pub struct Judged {
    /// Values of the keys in SI, in the order of [`Question::ranges`].
    pub values: Vec<f64>,
    /// Estimates of all measures that are computed.
    pub measured: Measured,
}

/// Result of the search.
#[derive(Clone, Debug, PartialEq)]
pub struct Tuned {
    /// The scenario's own settings. The value of a key that the scenario does not set is NaN.
    pub start: Judged,
    /// The best settings. They are measured on the same trials as the scenario's own settings.
    pub best: Judged,
    /// Measures of the best settings minus those of the scenario's own settings. The intervals are those of paired trials with common
    /// random numbers.
    pub differences: Measured,
    /// Verdict on whether the best settings keep the limits.
    pub limits: Verdict,
    /// Settings on the Pareto front, sorted by the second measure. No other settings are better than these in both measures. Empty if the
    /// best settings certainly break a limit.
    pub front: Vec<Judged>,
    /// All settings that were tried.
    pub looks: Vec<Look>,
}

impl Tuned {
    /// Returns true if the best settings may keep the limits. If false, the best settings are those that break the limits least.
    pub fn is_found(&self) -> bool {
        self.limits.possibly
    }

    /// Returns the possible effect of starts without an answer that did not occur in the trials, on the difference of the rms errors. None
    /// if this effect could not reverse the sign of the difference.
    pub fn unseen(&self) -> Option<Unseen> {
        left_out(&self.start.measured, &self.best.measured, &self.differences)
    }

    /// Returns true if the best settings have a smaller minimised measure than the scenario's own settings in the trials.
    pub fn seems_better(&self, goal: &Goal) -> bool {
        self.is_found() && self.differences.get(goal.minimise).high < 0.0
    }

    /// Returns true if the best settings certainly have a smaller minimised measure than the scenario's own settings. Starts without an
    /// answer that did not occur in the trials are taken into account: see [`Self::unseen`].
    pub fn surely_better(&self, goal: &Goal) -> bool {
        self.seems_better(goal) && (goal.minimise != Measure::Rms || self.unseen().is_none())
    }
}

/// Computes [`Tuned::unseen`].
fn left_out(start: &Measured, best: &Measured, differences: &Measured) -> Option<Unseen> {
    unseen(&start.get(Measure::Rms), &best.get(Measure::Rms), &differences.get(Measure::Unanswered))
}

/// Number of settings that pass from the wide to the close descents.
const WIDE_KEPT: usize = 3;
/// Number of settings that pass from the close descents to the final choice.
const CLOSE_KEPT: usize = 8;

/// Number of evaluations per key in a wide descent.
const OFTEN_WIDE: usize = 16;
/// Number of evaluations per key in a close descent.
const OFTEN_CLOSE: usize = 10;

impl Question<'_> {
    /// Returns all measures that are computed. Each is the measure of a limit of infinity, which always holds.
    pub fn taken(&self) -> Limits {
        let wanted = self.goal.limits.0.iter().map(|limit| limit.measure);
        let mut measures: Vec<Measure> = Vec::new();
        for measure in [self.goal.minimise, self.against].into_iter().chain(wanted).chain(ALWAYS_REPORTED) {
            if !measures.contains(&measure) {
                measures.push(measure);
            }
        }
        Limits(measures.into_iter().map(|measure| Limit { measure, most: f64::INFINITY }).collect())
    }

    fn keys(&self) -> Vec<(String, bool)> {
        self.ranges.iter().map(|range| (range.key.clone(), range.whole)).collect()
    }

    /// Searches for the best settings. `hear` receives messages about the progress.
    ///
    /// # Errors
    /// A trial cannot be run, or the computation was interrupted.
    pub fn tune(&self, watch: &dyn Watch, hear: &mut dyn FnMut(String)) -> Result<Tuned, Halt<FileError>> {
        let taken = self.taken();
        let bench = Bench { document: self.document, limits: &taken, keys: self.keys() };
        // The search alone needs the distance of starts without an answer from an answer.
        let with_distance = taken.and(Measure::Distance);
        let searched = Bench { limits: &with_distance, keys: self.keys(), ..bench };
        let own = Bench { document: self.document, limits: &taken, keys: Vec::new() };
        let nominal: Vec<f64> =
            (0..self.ranges.len()).map(|key| bench.nominal(key).unwrap_or(f64::NAN)).collect();
        let Effort { coarse, fine, last, .. } = self.effort;
        let seed = |more: u64| self.seed.wrapping_add(more);
        let starts = Starts { own: &own, known: RefCell::default() };
        let mut take = |values: &[f64], trials: u64| {
            let Some(tally) = searched.tally(values, seed(0), trials, watch)? else { return Ok(None) };
            let start = starts.at(seed(0), trials, watch)?;
            Ok::<_, Halt<FileError>>(Some(self.related(seen(&with_distance, &tally), &start)))
        };
        let mut search = Search::new(&self.ranges, &mut take);
        let wide =
            Descent { goal: &self.goal, trials: coarse, view: View::Likely, width: 0.25, often: OFTEN_WIDE };
        let mut ends: Vec<(Score, Vec<f64>)> = Vec::new();
        for (number, from) in self.starts(&nominal).iter().enumerate() {
            hear(format!("start {} of {}", number + 1, self.effort.starts));
            let end = search.wide(from, &wide)?;
            let look = search.look(&end, coarse)?;
            let score = self.goal.score(search.looks[look].measured.as_ref(), View::Likely);
            ends.push((score, end));
        }
        sort(&mut ends);
        let close = Descent { trials: fine, view: View::Sure, width: 0.06, often: OFTEN_CLOSE, ..wide };
        for (number, (_, end)) in ends.iter().take(WIDE_KEPT).enumerate() {
            hear(format!("close look {} of {}", number + 1, WIDE_KEPT.min(ends.len())));
            search.close(end, &close)?;
        }
        let mut final_ones: Vec<(Score, Vec<f64>)> = search
            .looks
            .iter()
            .filter(|look| look.trials == fine)
            .map(|look| (self.goal.score(look.measured.as_ref(), View::Sure), look.values.clone()))
            .collect();
        sort(&mut final_ones);
        final_ones.truncate(CLOSE_KEPT);
        hear("choice".to_owned());
        let chosen = self.choose(&bench, &starts, final_ones, watch)?;
        hear("front".to_owned());
        let along = front::along(self, &mut search, &chosen)?;
        let looks = search.looks;
        hear("start and best on fresh trials".to_owned());
        let of_start = own.tally(&[], seed(2), last, watch)?.ok_or(Halt::Stopped)?;
        let of_best = bench.tally(&chosen, seed(2), last, watch)?.ok_or(Halt::Stopped)?;
        let alike = nominal == chosen;
        let differences = Measured(paired(&taken, [&of_start, &of_best], alike, self.seed));
        let best = Judged { values: chosen, measured: measured(&taken, &of_best) };
        // Start, best and front have the same seed and number of trials, so that all are compared on the same random numbers.
        let points = front::judged(&bench, &taken, along, seed(2), last, watch)?;
        let mut front: Vec<Judged> = points.into_iter().chain([best.clone()]).collect();
        let start = Judged { values: nominal, measured: measured(&taken, &of_start) };
        let limits = self.kept(&start.measured, &best.measured, &differences);
        // Settings that surely break a limit are not on the front.
        let absolute = self.absolute();
        front.retain(|judged| limits.possibly && verdict(&absolute, &judged.measured).possibly);
        front::keep(&mut front, self);
        Ok(Tuned { start, best, differences, limits, front, looks })
    }

    /// Returns the measures as the search compares them. If a measure must not exceed its value at the scenario's own settings, the ratio
    /// of both values on the same trials, times the limit of the measure, replaces it.
    fn related(&self, mut measured: Measured, start: &Measured) -> Measured {
        for (measure, estimate) in
            measured.0.iter_mut().filter(|(measure, _)| self.relative.contains(measure))
        {
            let (own, of_start) = (estimate.value, start.get(*measure).value);
            let limit = self.goal.limits.0.iter().find(|limit| limit.measure == *measure);
            let share = if own == of_start { 1.0 } else { own / of_start };
            // If the initial value is zero there is no ratio: settings at zero keep the limit, all others break it.
            let value = match limit {
                Some(_) if share.is_infinite() => f64::INFINITY,
                Some(limit) => limit.most * share,
                None => own,
            };
            *estimate = Estimate { value, low: value, high: value };
        }
        measured
    }

    /// Returns the limits of those measures that are not compared with their value at the scenario's own settings.
    pub fn absolute(&self) -> Limits {
        let absolute = self.goal.limits.0.iter().filter(|limit| !self.relative.contains(&limit.measure));
        Limits(absolute.copied().collect())
    }

    /// Returns the verdict on the limits. Measures that must not exceed their value at the scenario's own settings are judged by the paired
    /// differences.
    fn kept(&self, start: &Measured, best: &Measured, differences: &Measured) -> Verdict {
        let of_best = verdict(&self.absolute(), best);
        let no_worse = |of: fn(&Estimate) -> f64| {
            self.relative.iter().all(|measure| of(&differences.get(*measure)) <= 0.0)
        };
        let may_turn = self.relative.contains(&Measure::Rms) && left_out(start, best, differences).is_some();
        Verdict {
            holds: of_best.holds && no_worse(|e| e.value),
            surely: of_best.surely && no_worse(|e| e.high) && !may_turn,
            possibly: of_best.possibly && no_worse(|e| e.low),
        }
    }

    /// Returns the settings from which the search starts: the scenario's own, and points of a Sobol sequence. `nominal` has the scenario's
    /// values of the keys.
    fn starts(&self, nominal: &[f64]) -> Vec<Vec<f64>> {
        let own = self.ranges.iter().zip(nominal).map(|(range, value)| {
            let place = if value.is_nan() { 0.5 } else { range.place(*value) };
            range.at(place)
        });
        let mut starts = vec![own.collect::<Vec<f64>>()];
        for number in 0..u32::try_from(self.effort.starts.saturating_sub(1)).unwrap_or(0) {
            let place = |(dimension, range): (u32, &Range)| {
                range.at(f64::from(sobol_burley::sample(number, dimension, 1)))
            };
            starts.push((0..).zip(&self.ranges).map(place).collect());
        }
        starts
    }

    /// Chooses the best of the remaining settings with new random numbers. Settings that are certainly worse in the first quarter of the
    /// trials are dropped.
    fn choose(
        &self,
        bench: &Bench<'_>,
        starts: &Starts<'_>,
        settings: Vec<(Score, Vec<f64>)>,
        watch: &dyn Watch,
    ) -> Result<Vec<f64>, Halt<FileError>> {
        let mut left: Vec<Judged> = settings
            .into_iter()
            .map(|(_, values)| Judged { values, measured: Measured(Vec::new()) })
            .collect();
        for trials in [self.effort.last / 4, self.effort.last] {
            for judged in &mut left {
                let seed = self.seed.wrapping_add(1);
                if let Some(tally) = bench.tally(&judged.values, seed, trials, watch)? {
                    let start = starts.at(seed, trials, watch)?;
                    judged.measured = self.related(seen(bench.limits, &tally), &start);
                }
            }
            let possible = |judged: &Judged| verdict(&self.goal.limits, &judged.measured).possibly;
            if left.iter().any(possible) {
                left.retain(possible);
            }
            let best = left.iter().map(|judged| judged.measured.get(self.goal.minimise).high);
            let best = best.fold(f64::INFINITY, f64::min);
            left.retain(|judged| judged.measured.get(self.goal.minimise).low <= best);
        }
        let mut scored: Vec<(Score, Vec<f64>)> = left
            .into_iter()
            .map(|judged| (self.goal.score(Some(&judged.measured), View::Sure), judged.values))
            .collect();
        sort(&mut scored);
        scored.into_iter().next().map(|(_, values)| values).ok_or(Halt::Stopped)
    }
}

/// Measures of the scenario's own settings. They are computed once for each seed and number of trials.
struct Starts<'a> {
    own: &'a Bench<'a>,
    known: RefCell<HashMap<(u64, u64), Measured>>,
}

impl Starts<'_> {
    fn at(&self, seed: u64, trials: u64, watch: &dyn Watch) -> Result<Measured, Halt<FileError>> {
        if let Some(known) = self.known.borrow().get(&(seed, trials)) {
            return Ok(known.clone());
        }
        let tally = self.own.tally(&[], seed, trials, watch)?.ok_or(Halt::Stopped)?;
        let found = seen(self.own.limits, &tally);
        self.known.borrow_mut().insert((seed, trials), found.clone());
        Ok(found)
    }
}

/// Returns the measures of a tally with their 95 % intervals.
pub(crate) fn measured(taken: &Limits, tally: &Tally) -> Measured {
    Measured(taken.0.iter().map(|limit| limit.measure).zip(tally.estimates()).collect())
}

/// Returns the measures of a tally as the search compares them.
fn seen(taken: &Limits, tally: &Tally) -> Measured {
    Measured(taken.0.iter().map(|limit| limit.measure).zip(tally.seen()).collect())
}

/// Returns the verdict on the limits. It states whether the limits hold according to the point estimates, whether they certainly hold, and
/// whether they possibly hold.
pub fn verdict(limits: &Limits, measured: &Measured) -> Verdict {
    let all = |of: fn(&Estimate) -> f64| {
        limits.0.iter().all(|limit| of(&measured.get(limit.measure)) <= limit.most)
    };
    Verdict { holds: all(|e| e.value), surely: all(|e| e.high), possibly: all(|e| e.low) }
}

/// Sorts settings by their score, the best first.
fn sort(scored: &mut [(Score, Vec<f64>)]) {
    scored.sort_by(|(a, _), (b, _)| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
}
