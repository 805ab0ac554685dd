//! The chains of one level.

use rayon::prelude::*;
use standstill_sim::{Purpose, Streams};

use super::moves::{Kind, Spread, Widths, Work, propose};
use super::population::{Population, State};
use super::{Settings, System, Watch};
use crate::Halt;

/// What all chains of a level have in common.
pub(super) struct Level<'a> {
    settings: &'a Settings,
    run: u32,
    number: u32,
    threshold: f64,
    widths: &'a Widths,
    spread: Spread,
}

impl<'a> Level<'a> {
    pub fn new(
        settings: &'a Settings,
        run: u32,
        number: u32,
        threshold: f64,
        widths: &'a Widths,
        seeds: &[State],
    ) -> Self {
        let mut tapes: Vec<_> = seeds.iter().map(|seed| seed.tape.clone()).collect();
        let spread = Spread::of(tapes.iter_mut());
        Self { settings, run, number, threshold, widths, spread }
    }

    /// Walks from each seed; returns all states, those of the seeds among them.
    pub fn walk<S: System>(
        &self,
        system: &S,
        seeds: Vec<State>,
        watch: &dyn Watch,
    ) -> Result<(Population, Work), Halt<S::Error>> {
        // Two parts for each thread, and enough in each to fill the lanes of a simulation. What they are does not show.
        let part = seeds.len().div_ceil(2 * rayon::current_num_threads()).max(16);
        let mut parts: Vec<(usize, Vec<State>)> = Vec::new();
        for (chain, seed) in seeds.into_iter().enumerate() {
            if chain % part == 0 {
                parts.push((chain, Vec::new()));
            }
            if let Some((_, states)) = parts.last_mut() {
                states.push(seed);
            }
        }
        let walked = parts.into_par_iter().map(|(first, states)| self.walk_part(system, first, states, watch));
        let walked = walked.collect::<Result<Vec<_>, _>>()?;
        let mut work = Work::default();
        let mut populations = Vec::new();
        for (population, part) in walked {
            for kind in 0..Kind::TURNS.len() {
                work.tried[kind] += part.tried[kind];
                work.taken[kind] += part.taken[kind];
            }
            populations.push(population);
        }
        Ok((Population::gathered(self.settings.seeds(), populations), work))
    }

    /// Chains side by side in this thread, the first of which has this number.
    fn walk_part<S: System>(
        &self,
        system: &S,
        first: usize,
        mut states: Vec<State>,
        watch: &dyn Watch,
    ) -> Result<(Population, Work), Halt<S::Error>> {
        let mut population = Population::new(self.settings.seeds());
        let mut work = Work::default();
        let key = |chain: usize, step| Settings::key(self.run, self.number, chain, step);
        for position in 0..self.settings.chain {
            if position > 0 {
                for (turn, kind) in (0..).zip(Kind::TURNS) {
                    if watch.stopped() {
                        return Err(Halt::Stopped);
                    }
                    let step = 3 * position + turn;
                    let key = |place| key(first + place, step);
                    self.step(system, &mut states, kind, key, &mut work, watch)?;
                }
            }
            for (place, state) in states.iter().enumerate() {
                population.add(first + place, key(first + place, 3 * position), state);
            }
        }
        Ok((population, work))
    }

    /// One move of each state.
    fn step<S: System>(
        &self,
        system: &S,
        states: &mut [State],
        kind: Kind,
        key: impl Fn(usize) -> u64,
        work: &mut Work,
        watch: &dyn Watch,
    ) -> Result<(), Halt<S::Error>> {
        let mut places = Vec::with_capacity(states.len());
        let mut tapes = Vec::with_capacity(states.len());
        for (place, state) in states.iter().enumerate() {
            let mut tape = state.tape.clone();
            // What it needs beyond its end is new.
            tape.grow_from(self.settings.seed, key(place));
            let mut draws =
                Streams::new(self.settings.seed, key(place)).open_named(Purpose::Design, "moves");
            if propose(&mut tape, kind, self.widths, &self.spread, &mut draws) {
                places.push(place);
                tapes.push(tape);
            }
        }
        let values = system.values(&tapes)?;
        watch.did(tapes.len() as u64);
        work.tried[kind as usize] += tapes.len() as u64;
        for ((place, tape), value) in places.into_iter().zip(tapes).zip(values) {
            if value >= self.threshold {
                let ancestor = states[place].ancestor;
                states[place] = State { value, tape, ancestor };
                work.taken[kind as usize] += 1;
            }
        }
        Ok(())
    }
}
