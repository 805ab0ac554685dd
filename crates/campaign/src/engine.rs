//! Running trials on all cores, block by block.
//!
//! ```text
//!   block of trials ─► threads, each with its lanes ─► records, in order
//!                      (the next trial goes to the lane that is free first)
//! ```
//! The one engine of all campaigns, with points or without, into memory or into a journal.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Instant;

use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

use crate::pace::Pace;
use standstill_scenario::{Record, TrialError};

/// Trials that can be run, at one point or several.
pub(crate) trait Trials: Sync {
    /// Common data of all trials at a point.
    type Point: Send + Sync;
    /// Why a point or a trial cannot be run.
    type Error: Send;

    /// Returns a point, ready to run trials at it.
    fn point(&self, number: usize) -> Result<Self::Point, Self::Error>;

    /// Runs trials in this thread until all are done or one cannot be run; trials that have begun are completed. `done`
    /// receives each record, in any order.
    fn run(
        &self,
        point: &Self::Point,
        number: usize,
        trials: &mut dyn Iterator<Item = u64>,
        done: &mut dyn FnMut(Record),
    ) -> Result<(), TrialError<Self::Error>>;
}

/// Threads with the trials that they run.
pub(crate) struct Engine<'a, T: Trials> {
    trials: &'a T,
    pool: ThreadPool,
    pace: Pace,
    /// The points that the last block touched; their neighbours come next.
    points: BTreeMap<usize, T::Point>,
}

/// Trials of one point that follow each other.
struct Group {
    point: usize,
    trials: Range<u64>,
    /// Place of the first in its block.
    place: usize,
    /// The trial that is begun next.
    next: AtomicU64,
}

/// Returns the groups of a block.
fn groups(block: &[(usize, u64)]) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for (place, &(point, trial)) in block.iter().enumerate() {
        match groups.last_mut() {
            Some(last) if last.point == point && last.trials.end == trial => last.trials.end += 1,
            _ => groups.push(Group { point, trials: trial..trial + 1, place, next: AtomicU64::new(trial) }),
        }
    }
    groups
}

impl Group {
    /// Returns the next trial, if there is one and nobody has asked to stop.
    fn take(&self, stop: &AtomicBool) -> Option<u64> {
        if stop.load(Ordering::Relaxed) {
            return None;
        }
        Some(self.next.fetch_add(1, Ordering::Relaxed)).filter(|trial| *trial < self.trials.end)
    }

    /// Returns the place of a trial in the block.
    fn place_of(&self, trial: u64) -> usize {
        self.place + usize::try_from(trial - self.trials.start).unwrap_or(usize::MAX)
    }
}

/// One thread's part of a block: records with their positions, and the point where it had to stop.
struct Part<E> {
    records: Vec<(usize, Record)>,
    failed: Option<(usize, E)>,
}

impl<'a, T: Trials> Engine<'a, T> {
    /// Makes an engine with this number of threads; none: as many as there are cores. The records do not depend on it.
    pub(crate) fn new(trials: &'a T, threads: Option<usize>) -> Result<Self, ThreadPoolBuildError> {
        let pool = ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0)).build()?;
        let pace = Pace::new(pool.current_num_threads());
        Ok(Self { trials, pool, pace, points: BTreeMap::new() })
    }

    /// Returns the number of trials that the next block should have.
    pub(crate) fn size(&self) -> u64 {
        self.pace.size()
    }

    /// Runs the trials of a block, each given by its point and its number. Returns the records of the first ones, in
    /// order: all of them, or those before the first that was not begun because `stop` was set, or those before the
    /// first that cannot be run, together with its error. Which trial that is does not depend on the number of threads.
    pub(crate) fn block(
        &mut self,
        block: &[(usize, u64)],
        stop: &AtomicBool,
    ) -> (Vec<Record>, Result<(), T::Error>) {
        let begun = Instant::now();
        let groups = groups(block);
        if let Err(error) = self.prepare(&groups) {
            return (Vec::new(), Err(error));
        }
        let (trials, points) = (self.trials, &self.points);
        let parts = self.pool.broadcast(|thread| {
            // Threads begin at different groups, so that each has one of its own while there are enough.
            let first = groups.len() * thread.index() / thread.num_threads();
            let (before, from) = groups.split_at(first);
            run(trials, points, from.iter().chain(before), stop)
        });
        let mut records = vec![None; block.len()];
        let mut failed: Option<(usize, T::Error)> = None;
        for part in parts {
            for (place, record) in part.records {
                records[place] = Some(record);
            }
            if let Some((place, error)) = part.failed
                && failed.as_ref().is_none_or(|(first, _)| place < *first)
            {
                failed = Some((place, error));
            }
        }
        let records: Vec<Record> = records.into_iter().map_while(|record| record).collect();
        self.pace = self.pace.after(begun);
        // The first thread walks from the first group on, so all before the first failure is there unless it was stopped.
        let failed = failed.filter(|(place, _)| *place == records.len());
        (records, failed.map_or(Ok(()), |(_, error)| Err(error)))
    }

    /// Makes the points of these groups ready.
    fn prepare(&mut self, groups: &[Group]) -> Result<(), T::Error> {
        // Points follow each other.
        let first = groups.first().map_or(0, |group| group.point);
        self.points.retain(|known, _| *known >= first);
        for number in groups.iter().map(|group| group.point) {
            if let Entry::Vacant(place) = self.points.entry(number) {
                place.insert(self.trials.point(number)?);
            }
        }
        Ok(())
    }
}

/// Carries out the work of one thread: group by group, as many trials of each group as other threads leave.
fn run<'g, T: Trials>(
    trials: &T,
    points: &BTreeMap<usize, T::Point>,
    groups: impl Iterator<Item = &'g Group>,
    stop: &AtomicBool,
) -> Part<T::Error> {
    let mut part = Part { records: Vec::new(), failed: None };
    for group in groups {
        let Some(point) = points.get(&group.point) else { continue };
        let mut take = std::iter::from_fn(|| group.take(stop));
        let mut done = |record: Record| part.records.push((group.place_of(record.trial), record));
        if let Err(TrialError { trial, error }) = trials.run(point, group.point, &mut take, &mut done) {
            part.failed = Some((group.place_of(trial), error));
            break;
        }
    }
    part
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicUsize;
    use std::time::Duration;

    use standstill_detect::Decay;
    use standstill_plant::built_in;
    use standstill_sim::RotorState;

    use super::*;
    use standstill_scenario::{ErrorSet, Scenario};

    /// Trials that are all the same record but for their numbers; some cannot be run.
    struct Fake {
        record: Record,
        fail: Vec<(usize, u64)>,
        threads: usize,
        waiting: AtomicUsize,
    }

    impl Trials for Fake {
        type Point = ();
        type Error = (usize, u64);

        fn point(&self, _: usize) -> Result<(), Self::Error> {
            Ok(())
        }

        fn run(
            &self,
            (): &(),
            number: usize,
            trials: &mut dyn Iterator<Item = u64>,
            done: &mut dyn FnMut(Record),
        ) -> Result<(), TrialError<Self::Error>> {
            for trial in trials {
                // Each thread waits with its first trial for the others to have one too.
                let begun = Instant::now();
                self.waiting.fetch_add(1, Ordering::Relaxed);
                while self.waiting.load(Ordering::Relaxed) < self.threads {
                    assert!(begun.elapsed() < Duration::from_secs(60), "a thread without work");
                    std::thread::yield_now();
                }
                if self.fail.contains(&(number, trial)) {
                    return Err(TrialError { trial, error: (number, trial) });
                }
                done(Record { trial, ..self.record });
            }
            Ok(())
        }
    }

    #[test]
    fn law_a_block_ends_with_the_first_trial_that_cannot_be_run_on_any_number_of_threads() {
        let motor = built_in("paper-5k5").expect("built in");
        let paper = Scenario::paper(motor, ErrorSet::Default, Decay::Fast, RotorState::Locked, 1);
        let record = paper.trial(0).expect("settings");
        // The end of one point, two whole ones, the beginning of a fourth.
        let all: Vec<(usize, u64)> = (50..210).map(|k| (k / 60, k as u64 % 60)).collect();
        let never = AtomicBool::new(false);
        for threads in [1, 2, 5] {
            let fails = [vec![], vec![(2, 7)], vec![(3, 4), (1, 59), (2, 0)], vec![(0, 50), (3, 29)]];
            for fail in fails {
                let fake = Fake { record, fail, threads, waiting: AtomicUsize::new(0) };
                let mut engine = Engine::new(&fake, Some(threads)).expect("threads");
                let (records, outcome) = engine.block(&all, &never);
                let first = all.iter().position(|place| fake.fail.contains(place)).unwrap_or(all.len());
                assert_eq!(outcome.err(), all.get(first).copied());
                let trials: Vec<u64> = records.iter().map(|record| record.trial).collect();
                let expected: Vec<u64> = all[..first].iter().map(|(_, trial)| *trial).collect();
                assert_eq!(trials, expected, "{threads} threads, {:?}", fake.fail);
            }
            // Fewer trials than points, and nothing at all.
            let fake = Fake { record, fail: Vec::new(), threads: 0, waiting: AtomicUsize::new(0) };
            let mut engine = Engine::new(&fake, Some(threads)).expect("threads");
            for some in [&[(4, 9), (5, 0), (6, 0)][..], &[]] {
                assert_eq!(engine.block(some, &never).0.len(), some.len());
            }
            assert!(engine.block(&all, &AtomicBool::new(true)).0.is_empty(), "stopped before it began");
        }
    }
}
