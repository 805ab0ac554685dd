//! Importance sampling after the last level: the event's probability by draws of a mixture of normal distributions that
//! lie where the runs' states in the event lie.
//!
//! ```text
//!   states of all runs in the event ┐
//!   draws of twice the spread that   ├─► parts by direction ─► mean and deviation of each draw ─► p = mean of 1(event) φ/q
//!   have the event, walked within it ┘
//! ```
//! φ is the density of the standard normals, q that of the mixture, in which all parts have one weight: how many states a
//! run has in a part is what misleads where levels do. The estimate has no bias wherever the parts lie, provided that q
//! misses nothing of the event; that its weights are few and large shows in the effective number of draws (Σw)²/Σw².
//! Chains' states as the centre of importance sampling: Au and Beck 1999; mixtures of normals: Kurtz and Song 2013
//! (both in Structural Safety).
//!
//! In hundreds of dimensions a proposal that moves draws by what is chance multiplies weights until one has all. With
//! more than [`FEW`] draws, only those move by themselves that are away from a standard normal beyond chance; the others
//! have one common deviation, and means shrunk by the part of them that chance explains.

mod normals;
#[cfg(test)]
mod tests;

use std::ops::Range;

use serde::{Deserialize, Serialize};
use standstill_campaign::in_parallel;
use standstill_sim::{Purpose, Streams, Tape};

use crate::subset::{Settings, of_samples};
use crate::{Halt, System, Watch};
use normals::{Layout, Mixture};

/// Most parts of a mixture.
const PARTS: usize = 8;

/// Number of draws up to which each has a mean and a deviation of its own, and is tried with twice its spread.
const FEW: usize = 20;

/// Factor of the deviations of few draws: a proposal narrower than the event has rare large weights.
const WIDER: f64 = 1.2;

/// Runs of the keys of draws with twice the spread, and of the mixture's draws.
const WIDE: u32 = 16;
const MIXED: u32 = 17;

/// Number in place of that of a run, from which on those of chains count that begin with a draw of twice the spread.
const SEARCHED: usize = crate::RUNS as usize;

/// Result of importance sampling.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Sampled {
    /// Number of trials in all.
    pub trials: u64,
    /// Number of parts; zero without any state in the event.
    pub parts: u32,
    /// Number of draws of the mixture.
    draws: u64,
    /// Sums of the weights of the draws in the event, and of their squares.
    sums: [f64; 2],
    /// Sum of the weights in parts that one run alone has found, or one chain of the search.
    lone: f64,
    /// Whether draws of twice the spread searched the event: too many draws cannot be searched.
    pub searched: bool,
    /// Draws in the event, each with its share of the probability. Resampled by their weights.
    pub failures: Vec<(f64, Tape)>,
}

impl Sampled {
    /// Makes a result of `hits` equal weights, of which those of `lone` lie in parts of one run.
    #[cfg(test)]
    pub fn of_equal(probability: f64, draws: u32, hits: u32, lone: u32) -> Self {
        let weight = probability * f64::from(draws) / f64::from(hits);
        let sums = [weight * f64::from(hits), weight * weight * f64::from(hits)];
        let lone = weight * f64::from(lone);
        Self { parts: 2, draws: draws.into(), sums, lone, searched: true, ..Self::default() }
    }

    /// Returns the probability.
    pub fn probability(&self) -> f64 {
        self.sums[0] / self.draws.max(1) as f64
    }

    /// Returns the number of equal weights that would have the same variance (Kish): (Σw)²/Σw².
    pub fn effective(&self) -> f64 {
        if self.sums[1] > 0.0 { self.sums[0] * self.sums[0] / self.sums[1] } else { 0.0 }
    }

    /// Returns the share of the probability in parts that one run alone has found: others as rare may be found by none.
    pub fn lone(&self) -> f64 {
        self.lone / self.sums[0]
    }

    /// Returns the probability's coefficient of variation.
    pub fn variation(&self) -> f64 {
        (1.0 / self.effective() - 1.0 / self.draws as f64).max(0.0).sqrt()
    }
}

/// Samples the event by a mixture of its states, each with the number of its run. `alike`: number of these states that
/// count as one independent state. Ends after an eighth of the draws if that promises fewer than half of `least`
/// effective ones.
///
/// # Errors
/// Errors of the system; an interruption.
pub(crate) fn sample<S: System>(
    system: &S,
    settings: &Settings,
    mut states: Vec<(usize, Tape)>,
    alike: f64,
    least: f64,
    watch: &dyn Watch,
) -> Result<Sampled, Halt<S::Error>> {
    let work = Work { system, settings, watch };
    let mut sampled = Sampled::default();
    sampled.searched = work.search(&mut states, &mut sampled.trials)?;
    let Some(mixture) = Mixture::of(&mut states, alike) else { return Ok(sampled) };
    drop(states);
    sampled.parts = u32::try_from(mixture.parts.len()).unwrap_or(u32::MAX);
    let mut weights: Vec<(usize, f64)> = Vec::new();
    let each = settings.states as usize;
    for part in 0..crate::RUNS as usize {
        let hits = work.values(&mixture, MIXED, part * each..(part + 1) * each, &mut sampled.trials)?;
        sampled.draws += each as u64;
        for number in hits {
            let (_, weight, part) = mixture.draw(settings, MIXED, number);
            sampled.lone += if mixture.lone[part] { weight } else { 0.0 };
            sampled.sums = [sampled.sums[0] + weight, sampled.sums[1] + weight * weight];
            weights.push((number, weight));
        }
        if part == 0 && sampled.effective() * f64::from(2 * crate::RUNS) < least {
            return Ok(sampled);
        }
    }
    // Resampled at equal distances of the cumulated weights.
    let count = crate::RUNS as usize * settings.seeds();
    let (mut cumulated, mut taken) = (0.0, 0);
    for (number, weight) in weights {
        cumulated += weight / sampled.sums[0] * count as f64;
        let before = taken;
        while (taken as f64) + 0.5 < cumulated && taken < count {
            taken += 1;
        }
        if taken > before {
            sampled
                .failures
                .push(((taken - before) as f64 / count as f64, mixture.draw(settings, MIXED, number).0));
        }
    }
    // Simulating a trial extends its tape by the draws that the mixture does not have.
    let failures = std::mem::take(&mut sampled.failures);
    let parts = failures.chunks(AT_ONCE).map(<[_]>::to_vec).collect();
    let read = in_parallel(parts, &|part: Vec<(f64, Tape)>| {
        let (shares, tapes): (Vec<f64>, Vec<Tape>) = part.into_iter().unzip();
        system.values(&tapes)?;
        watch.did(tapes.len() as u64);
        Ok::<_, Halt<S::Error>>(shares.into_iter().zip(tapes).collect::<Vec<_>>())
    })?;
    sampled.failures = read.into_iter().flatten().collect();
    sampled.trials += sampled.failures.len() as u64;
    Ok(sampled)
}

/// Number of trials that a thread runs at a time.
const AT_ONCE: usize = 200;

struct Work<'a, S> {
    system: &'a S,
    settings: &'a Settings,
    watch: &'a dyn Watch,
}

impl<S: System> Work<'_, S> {
    /// Returns the numbers of the draws of a mixture that have the event, of these.
    fn values(
        &self,
        mixture: &Mixture,
        run: u32,
        numbers: Range<usize>,
        trials: &mut u64,
    ) -> Result<Vec<usize>, Halt<S::Error>> {
        *trials += numbers.len() as u64;
        let end = numbers.end;
        let parts = numbers.step_by(AT_ONCE).map(|first| first..end.min(first + AT_ONCE)).collect();
        let hits = in_parallel(parts, &|part: Range<usize>| {
            if self.watch.stopped() {
                return Err(Halt::Stopped);
            }
            let tapes: Vec<Tape> =
                part.clone().map(|number| mixture.draw(self.settings, run, number).0).collect();
            let values = self.system.values(&tapes)?;
            self.watch.did(tapes.len() as u64);
            let hits = part.zip(values).filter(|(_, value)| *value > 0.0);
            Ok::<_, Halt<S::Error>>(hits.map(|(number, _)| number).collect::<Vec<_>>())
        })?;
        Ok(hits.into_iter().flatten().collect())
    }

    /// Searches parts of the event off the way of the levels, by a quarter as many draws as the mixture has, with twice
    /// the spread of the specimen's draws. Chains of steps within the event lead those that have it to where the event is
    /// likely. Adds their states. Returns false without a search if there are too many draws for one.
    fn search(&self, states: &mut Vec<(usize, Tape)>, trials: &mut u64) -> Result<bool, Halt<S::Error>> {
        const CHAINS: usize = 20;
        const STEPS: u32 = 60;
        const STEP: f64 = 0.6;
        // One start shows which draws there are where no run has reached the event.
        let probe = [Tape::new(self.settings.seed, Settings::key(WIDE, 3, 0, 0))];
        self.system.values(&probe)?;
        *trials += 1;
        let tapes = states.iter_mut().map(|(_, tape)| tape);
        let layout = Layout::of(probe.clone().iter_mut().chain(tapes), |purpose| !of_samples(purpose));
        let count = layout.len();
        if count == 0 || count > FEW {
            return Ok(false);
        }
        let wide = Mixture { layout, parts: vec![vec![[0.0, 2.0]; count]], lone: vec![false] };
        let numbers = 0..2 * self.settings.states as usize;
        let hits = self.values(&wide, WIDE, numbers, trials)?.into_iter().take(CHAINS);
        let mut now: Vec<Tape> = hits.map(|number| wide.draw(self.settings, WIDE, number).0).collect();
        let key = |level, chain, step| Settings::key(WIDE, level, chain, step);
        let moves =
            |chain| Streams::new(self.settings.seed, key(1, chain, 0)).open_named(Purpose::Design, "moves");
        let mut moves: Vec<_> = (0..now.len()).map(moves).collect();
        for step in 0..STEPS {
            if self.watch.stopped() {
                return Err(Halt::Stopped);
            }
            let mut next = now.clone();
            for (chain, (tape, moves)) in next.iter_mut().zip(&mut moves).enumerate() {
                tape.grow_from(self.settings.seed, key(2, chain, step));
                for strip in tape.strips() {
                    strip.step(STEP, &[], moves);
                }
            }
            let values = self.system.values(&next)?;
            self.watch.did(next.len() as u64);
            *trials += next.len() as u64;
            for ((now, next), value) in now.iter_mut().zip(next).zip(values) {
                if value > 0.0 {
                    *now = next;
                }
            }
            if step >= STEPS / 2 && step % 3 == 0 {
                states.extend(now.iter().cloned().enumerate().map(|(chain, tape)| (SEARCHED + chain, tape)));
            }
        }
        Ok(true)
    }
}
