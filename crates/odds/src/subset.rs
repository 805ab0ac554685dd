//! Subset simulation: the probability of a rare event as a product of probabilities that are not rare.
//!
//! ```text
//!   4,000 draws of the prior ─► the 399 nearest the event ─► chains of 10 states that stay as near ─► the 399 nearest …
//!        P(level 1) ≈ 0.1              P(level 2 | level 1) ≈ 0.1                        until 400 are in it
//! ```
//! Au and Beck 2001 (doi:10.1016/S0266-8920(01)00019-4), with the moves of Cotter et al. 2013 (doi:10.1214/13-STS421), which
//! preserve the standard normal distribution in any dimension. Three moves make one state: of all draws, of those of
//! the specimen (gains, offsets, delays, the angle), and of those of each sample (noise, jitter).
//!
//! The step length of each of the specimen's draws is in proportion to the draw's spread among the seeds; chains of
//! even number use the spread among the odd seeds, and vice versa. If a seed's own draws were part of that spread, the
//! answer would be up to 5 % too small; because seeds of both halves have common ancestors, a bias of about 1.5 % is
//! left with 1,000 states and of 4 % with 400 (docs/notes/witnesses.md). Step lengths are adapted between levels and
//! fixed within a level, so that each chain has one transition kernel, which leaves the conditional distribution
//! invariant.
//!
//! Every random number has a key (run, level, chain, step), so that the answer does not depend on the number of
//! threads.

mod chains;
mod moves;
mod population;

use serde::{Deserialize, Serialize};
use standstill_campaign::in_parallel;
use standstill_interface::choice;
use standstill_sim::{Purpose, Streams, Tape};

use crate::{Halt, System, Watch};
use chains::Level;
use moves::Widths;
pub use moves::{SAMPLED, of_samples};
use population::{Population, State};

/// Shares of the plain trials at which the curve has points, so that its part at high probabilities is drawn too.
const PLAIN: [f64; 9] = [0.9, 0.7, 0.5, 0.3, 0.2, 0.1, 0.05, 0.02, 0.01];

/// Purpose of the sentinel draws, which no trial reads (see [`Run::unread`]). Next to it, their number per tape.
pub(crate) const UNREAD: Purpose = Purpose::Design;
const UNREAD_DRAWS: usize = 8;

choice! {
    /// Effort spent on an answer.
    #[derive(Default)]
    pub enum Effort {
        /// 1,000 states per level, down to 1e-9: a quarter of the trials of `Normal`, with an interval twice as wide.
        /// Parts of the event at other angles are lost sooner.
        Quick = "quick",
        /// 4,000 states per level, down to 1e-12: suits trials of simulated motors.
        Normal = "normal" default,
        /// 16,000 states per level, down to 1e-15: four times the trials of `Normal`, with an interval half as wide.
        High = "high",
    }
}

impl Effort {
    /// Returns the next higher effort; none if there is none.
    pub const fn deeper(self) -> Option<Self> {
        match self {
            Self::Quick => Some(Self::Normal),
            Self::Normal => Some(Self::High),
            Self::High => None,
        }
    }

    /// Returns the number of states of a level.
    pub const fn states(self) -> u32 {
        match self {
            Self::Quick => 1000,
            Self::Normal => 4000,
            Self::High => 16_000,
        }
    }

    /// Returns the probability below which a run gives up. It bounds the work if the event is never reached.
    pub const fn least(self) -> f64 {
        match self {
            Self::Quick => 1e-9,
            Self::Normal => 1e-12,
            Self::High => 1e-15,
        }
    }
}

/// Settings of a run of subset simulation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Number of states of a level.
    pub states: u32,
    /// Length of a chain in states: one of `chain` states is a seed of the next level.
    pub chain: u32,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Probability below which a run gives up. For this purpose each level's share counts as at least a tenth.
    pub least: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self::of(Effort::default(), 1)
    }
}

impl Settings {
    /// Returns the settings of an effort.
    ///
    /// ```
    /// use standstill_odds::subset::{Effort, Settings};
    ///
    /// let quick = Settings::of(Effort::Quick, 7);
    /// assert_eq!((quick.states, quick.least, quick.seed), (1000, 1e-9, 7));
    /// // Where nothing leads to the event, it is counted in a hundred times as many plain trials.
    /// assert_eq!(quick.counted(), 100_000);
    /// ```
    pub const fn of(effort: Effort, seed: u64) -> Self {
        Self { states: effort.states(), chain: 10, seed, least: effort.least() }
    }

    /// Returns the number of plain trials by which an event is counted if no order parameter leads to it.
    pub const fn counted(&self) -> u32 {
        100 * self.states
    }

    /// Returns about how many trials importance sampling takes after the last level: as many for each run as a level has
    /// states, and a quarter more that search for parts off the way.
    ///
    /// ```
    /// use standstill_odds::subset::{Effort, Settings};
    ///
    /// assert_eq!(Settings::of(Effort::Quick, 7).sampled(), 10_000);
    /// ```
    pub fn sampled(&self) -> u64 {
        u64::from(crate::RUNS + 2) * u64::from(self.states)
    }

    /// Returns the number of seeds of a level.
    pub(crate) fn seeds(&self) -> usize {
        (self.states / self.chain) as usize
    }

    /// Returns the number of the random stream of one step. The highest bit separates these streams from those of plain
    /// trials with the same seed.
    pub(crate) fn key(run: u32, level: u32, chain: usize, step: u32) -> u64 {
        let [run, level, step] = [run, level, step].map(u64::from);
        1 << 63 | run << 56 | level << 48 | (chain as u64) << 16 | step
    }
}

choice! {
    /// Reason why a run ended.
    #[derive(Serialize, Deserialize)]
    pub enum End {
        /// The event was reached: its states are at least as many as the seeds of a level, a tenth.
        Reached = "reached",
        /// The order parameter does not lead to the event: too many states share one value, for example because the
        /// quantity is clipped or coarsely quantised, or the distance from the event is unknown.
        Flat = "flat",
        /// The probability of the levels fell below [`Settings::least`] before the event was reached.
        TooRare = "too rare",
        /// All plain trials have the same finite value, such as the movement of a locked rotor: no direction leads to
        /// the event.
        Constant = "constant",
    }
}

/// Result of one run of subset simulation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Reason why the run ended.
    pub end: End,
    /// Probability of the event; for a run that did not reach it, the probability of the last level.
    pub probability: f64,
    /// Coefficient of variation of the probability as the run estimates it: the larger of two estimates, one from the
    /// correlations within chains (Au and Beck, equation 28), which ignores that chains of later levels descend from
    /// the same states, and one from how unequally the states in the event descend from those of the first level (Lee
    /// and Whiteley 2018, doi:10.1093/biomet/asy028, for chains of one length).
    pub variation: f64,
    /// Number of levels, including the first one of plain trials.
    pub levels: u32,
    /// Points (value of the order parameter, probability of this value or more): some quantiles of the plain trials,
    /// then the threshold of each level.
    pub curve: Vec<(f64, f64)>,
    /// Number of trials.
    pub trials: u64,
    /// Share of moves that were accepted, over all levels.
    pub acceptance: f64,
    /// Number of states of the first level from which the last level's seeds descend.
    pub ancestors: u32,
    /// Means of the sentinel draws, which no trial reads, over the last level's states in the event. They are zero except for
    /// chance: means far from zero show that few independent states are left.
    pub unread: [f64; UNREAD_DRAWS],
    /// A random sample of the last level's states in the event, at most as many as a level has seeds.
    pub failures: Vec<Tape>,
    /// Number of states of the first level in the event.
    pub plain_hits: u32,
}

/// Estimates `P(value > 0)` by one run of subset simulation. Runs with different `number` are independent.
///
/// # Errors
/// Errors of the system; an interruption.
pub fn run<S: System>(
    system: &S,
    settings: &Settings,
    number: u32,
    watch: &dyn Watch,
) -> Result<Run, Halt<S::Error>> {
    let seeds = settings.seeds();
    let mut population = first_level(system, settings, number, watch)?;
    let mut run = Run {
        end: End::Reached,
        probability: 1.0,
        variation: 0.0,
        levels: 0,
        curve: Vec::new(),
        trials: u64::from(settings.states),
        acceptance: 0.0,
        ancestors: settings.states,
        unread: [0.0; UNREAD_DRAWS],
        failures: Vec::new(),
        plain_hits: u32::try_from(population.hits()).unwrap_or(u32::MAX),
    };
    let mut widths = Widths::default();
    let (mut taken, mut tried) = (0, 0);
    let mut squares = 0.0;
    // Product of the levels' shares, each counted as at least a tenth: a run gives up after nine, twelve or fifteen
    // levels.
    let mut depth = 1.0;
    loop {
        run.levels += 1;
        if run.levels == 1 && population.is_constant() {
            run.end = End::Constant;
            break;
        }
        let reached = population.hits() >= seeds;
        let Some(cut) = population.cut(reached) else {
            run.end = End::Flat;
            break;
        };
        run.probability *= cut.share;
        depth *= cut.share.max(1.0 / f64::from(settings.chain));
        squares += cut.variance;
        if run.levels == 1 {
            let rarer = |share| reached || share > cut.share;
            run.curve = population.quantiles(PLAIN.into_iter().filter(|share| rarer(*share)));
        }
        run.curve.push((cut.threshold, run.probability));
        if reached {
            break;
        }
        watch.came_to(run.levels, run.probability);
        if depth < settings.least {
            run.end = End::TooRare;
            break;
        }
        let keys = Streams::new(settings.seed, Settings::key(number, run.levels, 0xffff_ffff, 0));
        let states = population.into_seeds(&cut, keys);
        run.ancestors = ancestors(&states);
        let level = Level::new(settings, number, run.levels, cut.threshold, &widths, &states);
        let (next, work) = level.walk(system, states, watch)?;
        widths.learn(&work);
        (taken, tried) = (taken + work.taken.iter().sum::<u64>(), tried + work.tried.iter().sum::<u64>());
        population = next;
    }
    run.curve.sort_by(|a, b| b.1.total_cmp(&a.1));
    run.variation = squares.sqrt();
    run.trials += tried;
    run.acceptance = taken as f64 / tried.max(1) as f64;
    if run.end == End::Reached {
        run.variation = run.variation.max(population.variance_by_descent(settings.states).sqrt());
        run.failures = population.into_failures();
        run.unread = unread(&mut run.failures);
    }
    Ok(run)
}

/// Runs the plain trials of the first level.
fn first_level<S: System>(
    system: &S,
    settings: &Settings,
    number: u32,
    watch: &dyn Watch,
) -> Result<Population, Halt<S::Error>> {
    const AT_ONCE: usize = 200;
    let starts: Vec<usize> = (0..settings.states as usize).step_by(AT_ONCE).collect();
    let parts = in_parallel(starts, &|start| {
        let end = (start + AT_ONCE).min(settings.states as usize);
        if watch.stopped() {
            return Err(Halt::Stopped);
        }
        let tape = |chain| {
            let tape = Tape::new(settings.seed, Settings::key(number, 0, chain, 0));
            let mut draws = Streams::taped(&tape).open(UNREAD);
            draws.normals(&mut [0.0; UNREAD_DRAWS]);
            tape
        };
        let tapes: Vec<Tape> = (start..end).map(tape).collect();
        let values = system.values(&tapes)?;
        watch.did((end - start) as u64);
        let mut part = Population::new(settings.seeds());
        for ((chain, tape), value) in (start..end).zip(tapes).zip(values) {
            let ancestor = u32::try_from(chain).unwrap_or(u32::MAX);
            part.add(chain, Settings::key(number, 0, chain, 0), &State { value, tape, ancestor });
        }
        Ok(part)
    })?;
    Ok(Population::gathered(settings.seeds(), parts))
}

/// Does plain trials with the draws of a run's first level. Returns the number of states in the event, and the tapes of
/// some of them.
///
/// # Errors
/// Errors of the system; an interruption.
pub fn plain<S: System>(
    system: &S,
    settings: &Settings,
    number: u32,
    watch: &dyn Watch,
) -> Result<(u64, Vec<Tape>), Halt<S::Error>> {
    let population = first_level(system, settings, number, watch)?;
    Ok((population.hits() as u64, population.into_failures()))
}

fn ancestors(states: &[State]) -> u32 {
    let mut all: Vec<u32> = states.iter().map(|state| state.ancestor).collect();
    all.sort_unstable();
    all.dedup();
    u32::try_from(all.len()).unwrap_or(u32::MAX)
}

fn unread(failures: &mut [Tape]) -> [f64; UNREAD_DRAWS] {
    let mut means = [0.0; UNREAD_DRAWS];
    let count = failures.len() as f64;
    for tape in failures {
        for (mean, draw) in means.iter_mut().zip(tape.normals(UNREAD)) {
            *mean += *draw / count;
        }
    }
    means
}
