//! Markov chains of one level of subset simulation.

use standstill_campaign::in_parallel;
use standstill_sim::{Draws, Purpose, Streams, Strip, Tape};

use super::moves::{Kind, Spread, Widths, Work, propose};
use super::population::{Population, State};
use super::{Settings, System, Watch};
use crate::Halt;

/// Parameters that all chains of a level have in common.
pub(super) struct Level<'a> {
    settings: &'a Settings,
    run: u32,
    number: u32,
    threshold: f64,
    widths: &'a Widths,
    /// Spreads among the seeds with odd numbers, for even chains, and among those with even numbers, for odd chains.
    spreads: [Spread; 2],
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
        let spreads = [1, 0].map(|from| {
            let mut others: Vec<_> =
                seeds.iter().skip(from).step_by(2).map(|seed| seed.tape.clone()).collect();
            Spread::of(others.iter_mut())
        });
        Self { settings, run, number, threshold, widths, spreads }
    }

    /// Returns the spread that scales the steps of this chain: that of the half of the seeds without the chain's own.
    fn spread_for(&self, chain: usize) -> &Spread {
        &self.spreads[chain % 2]
    }

    /// Walks a chain from each seed. Returns all states of the level, including the seeds.
    pub fn walk<S: System>(
        &self,
        system: &S,
        seeds: Vec<State>,
        watch: &dyn Watch,
    ) -> Result<(Population, Work), Halt<S::Error>> {
        // Two parts for each thread, each large enough to fill the lanes of a simulation. The result does not depend on
        // the parts.
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
        let walked = in_parallel(parts, &|(first, states)| self.walk_part(system, first, states, watch))?;
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

    /// Walks some of the chains side by side in this thread; the first of them has index `first`.
    fn walk_part<S: System>(
        &self,
        system: &S,
        first: usize,
        mut states: Vec<State>,
        watch: &dyn Watch,
    ) -> Result<(Population, Work), Halt<S::Error>> {
        let mut population = Population::new(self.settings.seeds());
        let mut work = Work::default();
        let key = |place, step| Settings::key(self.run, self.number, first + place, step);
        let seed = self.settings.seed;
        let moves = |place| Streams::new(seed, key(place, 0)).open_named(Purpose::Design, "moves");
        let mut moves: Vec<Draws> = (0..states.len()).map(moves).collect();
        let mut tapes: Vec<Tape> = states.iter().map(|state| state.tape.clone()).collect();
        for position in 0..self.settings.chain {
            if position > 0 {
                for (turn, kind) in (0..).zip(Kind::TURNS) {
                    if watch.stopped() {
                        return Err(Halt::Stopped);
                    }
                    let mut moved = false;
                    for (place, (state, tape)) in states.iter_mut().zip(&mut tapes).enumerate() {
                        copy(&mut state.tape, tape);
                        // Draws that the trial reads beyond the tape's end are new.
                        tape.grow_from(seed, key(place, 3 * position + turn));
                        moved |= propose(
                            tape,
                            kind,
                            self.widths,
                            self.spread_for(first + place),
                            &mut moves[place],
                        );
                    }
                    // Without draws of this kind, as in a trial without noise, the state is unchanged.
                    if moved {
                        self.step(system, &mut states, &mut tapes, kind, &mut work)?;
                        watch.did(tapes.len() as u64);
                    }
                }
            }
            for (place, state) in states.iter().enumerate() {
                population.add(first + place, key(place, 3 * position), state);
            }
        }
        Ok((population, work))
    }

    /// Moves each state to its proposed tape, if that tape is in the level.
    fn step<S: System>(
        &self,
        system: &S,
        states: &mut [State],
        tapes: &mut [Tape],
        kind: Kind,
        work: &mut Work,
    ) -> Result<(), Halt<S::Error>> {
        let values = system.values(tapes)?;
        work.tried[kind as usize] += tapes.len() as u64;
        for ((state, tape), value) in states.iter_mut().zip(tapes).zip(values) {
            if value >= self.threshold {
                std::mem::swap(&mut state.tape, tape);
                state.value = value;
                work.taken[kind as usize] += 1;
            }
        }
        Ok(())
    }
}

/// Copies the draws of one tape into another, and reuses the target's memory.
fn copy(from: &mut Tape, to: &mut Tape) {
    let alike = |(one, other): (&Strip, &Strip)| one.purpose == other.purpose && one.name == other.name;
    let (source, target) = (from.strips(), to.strips());
    if source.len() == target.len() && source.iter().zip(target.iter()).all(alike) {
        for (source, target) in source.iter().zip(target) {
            target.normals.clone_from(&source.normals);
            target.read = source.read;
        }
    } else {
        to.clone_from(from);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_a_seed_has_no_part_in_the_steps_of_its_own_chain() {
        let (settings, widths) = (Settings::default(), Widths::default());
        let spreads = |far: usize| {
            let seed = |k: usize| {
                let tape = Tape::new(1, k as u64);
                let more = if k == far { 9.0 } else { 0.0 };
                let value = Streams::taped(&tape).open(Purpose::CurrentGain).normal();
                let mut tape = tape;
                tape.strips()[0].normals[0] = value + more;
                State { value, tape, ancestor: 0 }
            };
            let seeds: Vec<State> = (0..40).map(seed).collect();
            Level::new(&settings, 0, 1, 0.0, &widths, &seeds)
        };
        let none = spreads(99);
        for far in [4, 5] {
            let level = spreads(far);
            assert_eq!(level.spread_for(far), none.spread_for(far));
            assert_ne!(level.spread_for(far + 1), none.spread_for(far + 1));
        }
    }
}
