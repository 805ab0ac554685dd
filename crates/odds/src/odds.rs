//! Computes the probability of an event from several independent runs of subset simulation.

mod sampled;
#[cfg(test)]
mod tests;

use serde::Serialize;
use serde::de::DeserializeOwned;
use standstill_campaign::{Estimate, binomial_interval, student};
use standstill_numeric::power;
use standstill_sim::Tape;

use crate::alarm::Alarm;
use crate::subset::{End, Run, Settings, run};
use crate::system::kept;
use crate::{Halt, System, Watch};

/// Number of independent runs of subset simulation per answer.
pub const RUNS: u32 = 8;

/// Number of the estimator, raised with every change of moves, thresholds or estimates, so that an answer never
/// combines runs of different estimators. The number of the numerics covers simulations alone.
const ESTIMATOR: u32 = 4;

/// Least ratio of the scatter between runs to the scatter that their own estimates predict; for the interval, a smaller
/// scatter is raised to it. Without it, runs that agree by chance give intervals that are too narrow: 93 to 95 of 100
/// contained the true value, with it 95 to 97 (counted with estimator 2, levels alone).
const LEAST: f64 = 0.8;

/// Number of runs after which, if none of them reached the event, the others do only their plain trials (unless one of
/// those has the event). Three runs bound the event's probability by their last levels well enough: Student's quantile
/// is 4.3 for three runs, 12.7 for two.
pub const GIVEN_UP: usize = 3;

/// Method by which the answer was computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Estimator {
    /// By subset simulation.
    Subset,
    /// By importance sampling with a mixture of normal distributions at the states in the event that subset simulation
    /// found.
    Mixture {
        /// Number of normal distributions.
        parts: u32,
        /// Number of the mixture's draws with the event that would tell as much if all had the same weight.
        effective: u32,
        /// Whether draws of twice the spread searched parts of the event that the runs miss.
        searched: bool,
    },
    /// By counting plain trials.
    Plain,
}

/// Probability of an event with its 95 % interval, and its computation.
#[derive(Clone, Debug, PartialEq)]
pub struct Odds {
    /// Method by which the probability was computed.
    pub estimator: Estimator,
    /// The probability with its 95 % interval.
    pub probability: Estimate,
    /// True if the interval was widened because of an alarm: its confidence is above 95 % by an unknown amount.
    pub widened: bool,
    /// Number of trials in all.
    pub trials: u64,
    /// Number of plain trials among them: all for [`Estimator::Plain`], else those of the first levels of all runs.
    pub plain: u64,
    /// Number of levels of the run that had most.
    pub levels: u32,
    /// Runs of subset simulation; empty for plain trials.
    pub runs: Vec<Run>,
    /// Findings that make the answer doubtful.
    pub alarms: Vec<Alarm>,
    /// Findings of the same kinds that concern too few of the event's starts to make the answer doubtful.
    pub remarks: Vec<Alarm>,
    /// Starts with the event, each as its weight and its tape, the record of its draws. The weights sum to one unless
    /// there are none.
    pub failures: Vec<(f64, Tape)>,
}

impl Odds {
    /// Computes the probability by [`RUNS`] runs of subset simulation, or by plain trials if no order parameter leads
    /// to the event. `done` is called with each finished run.
    ///
    /// # Errors
    /// Errors of the system; an interruption.
    pub fn of<S: System>(
        system: &S,
        settings: &Settings,
        watch: &dyn Watch,
        done: impl FnMut(&Run),
    ) -> Result<Self, Halt<S::Error>> {
        Self::of_event(system, "", settings, watch, done)
    }

    /// Computes the probability of an event. `name`: name of the event, by which the watch tells stored runs of several
    /// events apart.
    ///
    /// # Errors
    /// Errors of the system; an interruption.
    pub fn of_event<S: System>(
        system: &S,
        name: &str,
        settings: &Settings,
        watch: &dyn Watch,
        done: impl FnMut(&Run),
    ) -> Result<Self, Halt<S::Error>> {
        let mut counting = Counting { system, watch, lost: 0 };
        let mut odds = Self::counted(&mut counting, name, settings, done)?;
        if counting.lost > 0 {
            odds.alarms.push(Alarm::Errors(counting.lost));
        }
        Ok(odds)
    }

    fn counted<S: System>(
        counting: &mut Counting<'_, S>,
        name: &str,
        settings: &Settings,
        mut done: impl FnMut(&Run),
    ) -> Result<Self, Halt<S::Error>> {
        let (system, watch) = (counting.system, counting.watch);
        let (mut runs, mut beside): (Vec<Run>, u64) = (Vec::new(), 0);
        for number in 0..RUNS {
            let key = format!("{name}: run {number} of estimator {ESTIMATOR} with tapes of {settings:?}");
            let compute = || run(system, settings, number, watch);
            let found = counting.kept(&key, |run: &Run| run.trials, compute)?;
            done(&found);
            let flat = found.end == End::Flat;
            runs.push(found);
            // A run that is flat at its first level would be flat again with other random numbers.
            if flat && number == 0 && runs[0].levels == 1 {
                break;
            }
            if number == 0 && runs[0].end == End::Constant {
                return Ok(Self::of_plain(0, runs[0].trials, Alarm::Constant, Vec::new()));
            }
            if runs.len() == GIVEN_UP && runs.iter().all(|run| run.end == End::TooRare) {
                let (hits, trials) = others(counting, name, settings)?;
                if hits == 0 {
                    let numbers = sampled::numbers_of(&runs);
                    let odds = Self::of_runs(settings, runs).beside(trials);
                    return odds.sampled(counting, name, settings, &numbers);
                }
                // The event occurs in plain trials although no order parameter leads to it: the other runs begin from
                // such trials.
                beside = trials;
            }
        }
        if runs.iter().filter(|run| run.end == End::Flat).count() * 2 > runs.len() {
            let spent = runs.iter().map(|run| run.trials).sum::<u64>();
            let mut odds = plain(counting, name, settings)?;
            odds.trials += spent;
            return Ok(odds);
        }
        let numbers = sampled::numbers_of(&runs);
        let mut odds = Self::of_runs(settings, runs);
        odds.trials += beside;
        odds.sampled(counting, name, settings, &numbers)
    }

    /// Makes the odds from the number of plain trials and the number of those with the event, `hits`.
    fn of_plain(hits: u64, trials: u64, alarm: Alarm, failures: Vec<(f64, Tape)>) -> Self {
        Self {
            estimator: Estimator::Plain,
            probability: binomial_interval(hits, trials),
            widened: false,
            trials,
            plain: trials,
            levels: 1,
            runs: Vec::new(),
            alarms: vec![alarm],
            remarks: Vec::new(),
            failures,
        }
    }

    /// Computes the odds from all runs: the mean m of their probabilities, with the interval m·exp(± t s/(m √R)), where
    /// s is the standard deviation of the R runs and t the quantile of Student's distribution. If s is less than
    /// `LEAST` times the standard deviation that the runs estimate of themselves, it is raised to that value.
    pub fn of_runs(settings: &Settings, mut runs: Vec<Run>) -> Self {
        let all = runs.len();
        let probability_of = |run: &Run| if run.end == End::Reached { run.probability } else { 0.0 };
        let count = all as f64;
        let mean = runs.iter().map(probability_of).sum::<f64>() / count;
        let scatter =
            runs.iter().map(|run| power(probability_of(run) - mean, 2)).sum::<f64>() / (count - 1.0);
        let variation = if mean > 0.0 { scatter.sqrt() / mean } else { 0.0 };
        let reached: Vec<&Run> = runs.iter().filter(|run| run.end == End::Reached).collect();
        let judged = variation.max(LEAST * expected(&reached));
        let factor = standstill_numeric::exp(student(count - 1.0) * judged / count.sqrt());
        let mut probability = Estimate { value: mean, low: mean / factor, high: (mean * factor).min(1.0) };
        let mut alarms = Vec::new();
        let plain = all as u64 * u64::from(settings.states);
        if reached.is_empty() {
            // The level at which the chains gave up does not bound the probability. The first levels' trials do: they
            // are independent.
            let hits = runs.iter().map(|run| u64::from(run.plain_hits)).sum();
            probability = binomial_interval(hits, plain);
            let levels = runs.iter().map(|run| run.probability);
            let mean = levels.clone().sum::<f64>() / count;
            let scatter = levels.clone().map(|level| power(level - mean, 2)).sum::<f64>() / (count - 1.0);
            let all: Vec<&Run> = runs.iter().collect();
            let judged = (scatter.sqrt() / mean).max(LEAST * expected(&all));
            let at_most = mean * standstill_numeric::exp(student(count - 1.0) * judged / count.sqrt());
            alarms.push(Alarm::TooRare { level: levels.fold(0.0, f64::max), at_most });
        } else if reached.iter().all(|run| run.levels == 1) {
            // The event is not rare: the runs consist of plain trials.
            let hits = reached.iter().map(|run| u64::from(run.plain_hits)).sum();
            probability = binomial_interval(hits, reached.len() as u64 * u64::from(settings.states));
        } else {
            alarms.extend(alarms_of(&reached, all, variation));
        }
        let levels = runs.iter().map(|run| run.levels).max().unwrap_or(0);
        let trials = runs.iter().map(|run| run.trials).sum();
        let mut failures = Vec::new();
        for run in &mut runs {
            let weight = probability_of(run) / (mean * count) / run.failures.len().max(1) as f64;
            failures.extend(std::mem::take(&mut run.failures).into_iter().map(|tape| (weight, tape)));
        }
        Self {
            estimator: Estimator::Subset,
            probability,
            widened: false,
            trials,
            plain,
            levels,
            runs,
            alarms,
            remarks: Vec::new(),
            failures,
        }
    }

    /// Adds further plain trials, none of them with the event, to the bound of an event that no run reached.
    fn beside(mut self, trials: u64) -> Self {
        let hits = self.runs.iter().map(|run| u64::from(run.plain_hits)).sum();
        self.plain += trials;
        self.trials += trials;
        self.probability = binomial_interval(hits, self.plain);
        self
    }

    /// Widens the interval if alarms make it doubtful. If runs may have missed a part of the event, or few independent
    /// states are left, the interval reaches from the smallest probability of a run to the largest, each with twice its own
    /// standard error, and from zero if a run did not reach the event. If the event contains faults that no margin announces,
    /// its upper end is at least that of the first levels' plain trials.
    pub fn doubt(&mut self) {
        if self.estimator == Estimator::Plain || self.runs.is_empty() {
            return;
        }
        let parts = |alarm: &Alarm| alarm.is_of_runs() && !matches!(alarm, Alarm::TooRare { .. });
        if self.alarms.iter().any(parts) {
            let reached = self.runs.iter().filter(|run| run.end == End::Reached);
            let ends = reached.map(|run| {
                let error = standstill_numeric::exp(2.0 * run.variation);
                [run.probability / error, run.probability * error]
            });
            let all = self.runs.iter().all(|run| run.end == End::Reached);
            let (mut low, mut high) = (if all { f64::INFINITY } else { 0.0 }, 0.0_f64);
            for [from, to] in ends {
                (low, high) = (low.min(from), high.max(to));
            }
            self.probability.low = self.probability.low.min(low);
            self.probability.high = self.probability.high.max(high.min(1.0));
            self.widened = true;
        }
        if self.alarms.iter().any(|alarm| matches!(alarm, Alarm::Unled(_))) {
            let hits = self.runs.iter().map(|run| u64::from(run.plain_hits)).sum();
            let plain = binomial_interval(hits, self.plain);
            self.probability.high = self.probability.high.max(plain.high);
            self.widened = true;
        }
    }

    /// Reports a finding that concerns this share of the event's starts: as an alarm above a tenth, as a remark above a
    /// hundredth.
    pub fn tell(&mut self, share: f64, what: fn(f64) -> Alarm) {
        const REMARKED: f64 = 0.01;
        const DOUBTFUL: f64 = 0.1;
        if share > DOUBTFUL {
            self.alarms.push(what(share));
        } else if share > REMARKED {
            self.remarks.push(what(share));
        }
    }
}

/// Returns the rms of the coefficients of variation that the runs estimate of themselves; zero without runs.
fn expected(runs: &[&Run]) -> f64 {
    (runs.iter().map(|run| power(run.variation, 2)).sum::<f64>() / runs.len().max(1) as f64).sqrt()
}

/// Returns the alarms of runs that reached a rare event.
fn alarms_of(reached: &[&Run], all: usize, variation: f64) -> Vec<Alarm> {
    /// Largest allowed ratio of observed to expected scatter, for runs of up to [`SHALLOW`] levels and for deeper ones.
    /// By chance, 2 answers of 100 exceed 1.5 (seven degrees of freedom). Shallow runs scatter by 1.2 times the
    /// expectation, so that 1.5 raised an alarm in up to one of seven answers; fewer than 1 in 100 exceed 2 by chance.
    /// In deeper runs a larger scatter shows that runs miss parts of an event.
    const MORE: [f64; 2] = [2.0, 1.5];
    const SHALLOW: u32 = 5;
    /// Limit of the sentinel draws' rms mean: the standard deviation of the mean of eight independent states.
    const UNREAD: f64 = 0.35;
    const ANCESTORS: u32 = 5;
    let count = reached.len() as f64;
    let mut alarms = Vec::new();
    if reached.len() < all {
        alarms.push(Alarm::Missed { runs: all - reached.len(), of: all });
    }
    let expected = expected(reached);
    let shallow = reached.iter().all(|run| run.levels <= SHALLOW);
    if variation > MORE[usize::from(!shallow)] * expected {
        alarms.push(Alarm::Disagree { found: variation, expected });
    }
    let squares = reached.iter().flat_map(|run| run.unread).map(|mean| mean * mean).sum::<f64>();
    let unread = (squares / (count * reached[0].unread.len() as f64)).sqrt();
    if unread > UNREAD {
        alarms.push(Alarm::Unread(unread));
    }
    let ancestors = reached.iter().map(|run| run.ancestors).min().unwrap_or(u32::MAX);
    if ancestors < ANCESTORS {
        alarms.push(Alarm::Ancestors(ancestors));
    }
    alarms
}

/// A system with the number of its trials that could not be carried out, including those of stored results.
struct Counting<'a, S> {
    system: &'a S,
    watch: &'a dyn Watch,
    lost: u64,
}

impl<S: System> Counting<'_, S> {
    /// Returns the result under this key, stored or computed, and counts the trials that could not be carried out in
    /// it.
    fn kept<T: Serialize + DeserializeOwned>(
        &mut self,
        key: &str,
        trials: impl FnOnce(&T) -> u64,
        compute: impl FnOnce() -> Result<T, Halt<S::Error>>,
    ) -> Result<T, Halt<S::Error>> {
        let system = self.system;
        let counted = || {
            let before = system.lost();
            let found = compute()?;
            Ok::<_, Halt<S::Error>>((found, system.lost() - before))
        };
        let (found, lost) = kept(self.watch, key, |(found, _)| trials(found), counted)?;
        self.lost += lost;
        Ok(found)
    }
}

/// Does the plain trials (first levels) of the runs that were not started. Returns the number of trials with the event,
/// and the number of all.
fn others<S: System>(
    counting: &mut Counting<'_, S>,
    name: &str,
    settings: &Settings,
) -> Result<(u64, u64), Halt<S::Error>> {
    let (system, watch) = (counting.system, counting.watch);
    let each = u64::from(settings.states);
    let (mut hits, mut trials) = (0, 0);
    for number in (0..RUNS).skip(GIVEN_UP) {
        let key = format!("{name}: plain trials of run {number} of {settings:?}");
        let compute = || Ok(crate::subset::plain(system, settings, number, watch)?.0);
        hits += counting.kept(&key, |_| each, compute)?;
        trials += each;
    }
    Ok((hits, trials))
}

/// Computes the odds by counting plain trials.
fn plain<S: System>(
    counting: &mut Counting<'_, S>,
    name: &str,
    settings: &Settings,
) -> Result<Odds, Halt<S::Error>> {
    let (system, watch) = (counting.system, counting.watch);
    // Equal to the first level of one run with this many states.
    let count = settings.counted();
    let all = Settings { states: count, chain: count / 400, ..*settings };
    let key = format!("{name}: plain trials with tapes of {all:?}");
    let compute = || crate::subset::plain(system, &all, RUNS, watch);
    let (hits, failures) = counting.kept(&key, |_: &(u64, Vec<Tape>)| u64::from(count), compute)?;
    let weight = 1.0 / failures.len().max(1) as f64;
    let failures = failures.into_iter().map(|tape| (weight, tape)).collect();
    Ok(Odds::of_plain(hits, u64::from(count), Alarm::Flat, failures))
}
