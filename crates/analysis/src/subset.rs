//! Subset simulation: the probability of a rare event as a product of probabilities that are not rare.
//!
//! ```text
//!   4,000 draws of the prior ─► the 400 nearest the event ─► chains of 10 states that stay as near ─► the 400 nearest …
//!        P(level 1) = 0.1              P(level 2 | level 1) = 0.1                        until 400 are in it
//! ```
//! Au and Beck 2001 (doi:10.1016/S0266-8920(01)00019-4), with the moves of Cotter et al. 2013 (doi:10.1214/13-STS421), which
//! keep the standard normals whatever their number. Three moves make one state: of all draws, of those of the specimen
//! (gains, offsets, delays, the angle), and of those of each sample (noise, jitter). Steps of the specimen's draws have the
//! proportions of these draws' spread among the seeds; how long steps are is learnt from level to level and fixed within one,
//! so that within a level each chain has one kernel, which leaves the conditional distribution as it is.
//!
//! Every number has a key: run, level, chain, step. So the answer does not depend on threads.

mod chains;
mod moves;
mod population;

use rayon::prelude::*;
use standstill_interface::choice;
use standstill_sim::{Purpose, Streams, Tape};

use crate::{Halt, System, Watch};
use chains::Level;
use moves::Widths;
pub(crate) use moves::of_samples;
use population::{Population, State};

/// Shares of the plain trials at whose ends their values are kept: what is likely is a curve too.
const PLAIN: [f64; 9] = [0.9, 0.7, 0.5, 0.3, 0.2, 0.1, 0.05, 0.02, 0.01];

/// What no trial draws, see [`Run::unread`], and how many of it a tape has.
const UNREAD: Purpose = Purpose::Design;
const UNREAD_DRAWS: usize = 8;

choice! {
    /// Cost of an answer: states of a level.
    #[derive(Default)]
    pub enum Effort {
        /// 1,000 states: a quarter of the trials, for an interval twice as wide; parts at other angles are lost sooner.
        Quick = "quick",
        /// 4,000 states: what a trial of simulated motors needs.
        Normal = "normal" default,
        /// 16,000 states: four times the trials, for an interval half as wide.
        High = "high",
    }
}

impl Effort {
    /// States of a level.
    ///
    /// ```
    /// use standstill_analysis::subset::{Effort, Settings};
    ///
    /// assert_eq!(Settings::default().states, Effort::default().states());
    /// ```
    pub const fn states(self) -> u32 {
        match self {
            Self::Quick => 1000,
            Self::Normal => 4000,
            Self::High => 16_000,
        }
    }
}

/// Settings of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// States of a level.
    pub states: u32,
    /// One in so many of them is a seed of the next level.
    pub chain: u32,
    /// Key of all random numbers.
    pub seed: u64,
    /// Probability below which a run gives up.
    pub least: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { states: Effort::Normal.states(), chain: 10, seed: 1, least: 1e-15 }
    }
}

impl Settings {
    /// Seeds of a level.
    fn seeds(&self) -> usize {
        (self.states / self.chain) as usize
    }

    /// The number of the draws of one step: whoever has run, level, chain and step has the same draws. The highest bit
    /// keeps them apart from those of plain trials of the same seed.
    fn key(run: u32, level: u32, chain: usize, step: u32) -> u64 {
        let [run, level, step] = [run, level, step].map(u64::from);
        1 << 63 | run << 56 | level << 48 | (chain as u64) << 16 | step
    }
}

/// End of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// A tenth of a level's states or more is in the event.
    Reached,
    /// The values do not lead there: too many states share one value, as of a quantity that is clipped or coarsely
    /// quantised, or where nothing says how far the event is.
    Flat,
    /// The event is rarer than [`Settings::least`].
    TooRare,
    /// All plain trials have the same finite value, as the movement of a locked rotor: there is nothing to follow.
    Constant,
}

/// Result of one run.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Its end.
    pub end: End,
    /// The event's probability. Of a run that did not reach it: that of the nearest level.
    pub probability: f64,
    /// Its coefficient of variation as the run itself judges it from the chains' correlations (Au and Beck, equation 28).
    pub variation: f64,
    /// Levels, the first one of plain trials included.
    pub levels: u32,
    /// A value and P(value or more): of the plain trials some quantiles, then where each level ends.
    pub curve: Vec<(f64, f64)>,
    /// Trials.
    pub trials: u64,
    /// The share of moves that were taken, over all levels.
    pub acceptance: f64,
    /// States of the first level from which the last level's seeds descend.
    pub ancestors: u32,
    /// Means, over the last level's states in the event, of draws that nothing reads. They are zero but for chance: where
    /// they are far from it, few independent states are left.
    pub unread: [f64; UNREAD_DRAWS],
    /// Of the last level's states in the event some, at most as many as a level has seeds, each with the same chance.
    pub failures: Vec<Tape>,
    /// Of the first level: states in the event.
    pub plain_hits: u32,
}

/// One run of subset simulation of `P(value > 0)`; runs of different numbers are independent.
///
/// # Errors
/// Those of the system; that it was stopped.
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
        if run.probability < settings.least {
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
        run.failures = population.into_failures();
        run.unread = unread(&mut run.failures);
    }
    Ok(run)
}

/// The states of plain trials.
fn first_level<S: System>(
    system: &S,
    settings: &Settings,
    number: u32,
    watch: &dyn Watch,
) -> Result<Population, Halt<S::Error>> {
    const AT_ONCE: usize = 200;
    let starts: Vec<usize> = (0..settings.states as usize).step_by(AT_ONCE).collect();
    let parts = starts.into_par_iter().map(|start| {
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
    });
    Ok(Population::gathered(settings.seeds(), parts.collect::<Result<Vec<_>, _>>()?))
}

/// Plain trials with the draws of this run's first level: how many are in the event, and some of them.
///
/// # Errors
/// Those of the system; that it was stopped.
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
