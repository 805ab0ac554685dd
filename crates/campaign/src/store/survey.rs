//! The shards of a run that exist, and the progress of each.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Serialize;
use standstill_interface::choice;

use super::identity::{Identity, Shard};
use super::journal::{Journal, JournalError};
use super::shards::{Gathered, ShardsError, head, journals, standing};

choice! {
    /// Progress of a shard.
    #[derive(Serialize)]
    #[serde(rename_all = "lowercase")]
    pub enum State {
        /// All its trials are in its journal.
        Done = "done",
        /// A process is at work on it.
        Running = "running",
        /// Some of its trials are there, and nobody is at work.
        Begun = "begun",
        /// The shard has no journal.
        Missing = "missing",
        /// The journal has a wrong block, which `--resume` computes again, or an unreadable header.
        Damaged = "damaged",
    }
}

/// The state of one shard.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Surveyed {
    /// Index of the shard, from 1.
    pub index: u64,
    /// Progress of the shard.
    pub state: State,
    /// Path of its journal; none if there is none.
    pub journal: Option<PathBuf>,
    /// Largest possible number of missing trials; none if unknown.
    pub left: Option<u64>,
}

/// All shards of a run.
#[derive(Clone, Debug)]
pub struct Survey {
    /// The run.
    pub identity: Identity,
    /// All shards, in order.
    pub shards: Vec<Surveyed>,
}

/// Most shards that a run may have; a damaged head could claim any number.
const MOST: u64 = 1_000_000;

impl Survey {
    /// Surveys all shards of the run whose journals are in these folders, including shards that have no journal there.
    ///
    /// # Errors
    /// A folder without a journal, journals of several runs, none that can be read.
    pub fn of(folders: &[PathBuf]) -> Result<Self, ShardsError> {
        let mut gathered = Gathered::default();
        let mut unreadable: Vec<(PathBuf, JournalError)> = Vec::new();
        for path in journals(folders)? {
            match head(&path) {
                Ok(identity) => gathered.add(path, identity)?,
                Err(error) => unreadable.push((path, error)),
            }
        }
        let Some((_, identity)) = gathered.run else {
            let first = unreadable.into_iter().next().map(|(_, error)| ShardsError::Journal(error));
            return Err(
                first.unwrap_or_else(|| ShardsError::None(folders.first().cloned().unwrap_or_default()))
            );
        };
        let mut found: BTreeMap<u64, Surveyed> = BTreeMap::new();
        for (index, (path, shard)) in gathered.shards {
            let mut surveyed = surveyed(index, path)?;
            if shard.trials < identity.trials {
                // It was not extended yet, as others were.
                let rows = |of: &Identity| {
                    let range = shard.shard.range(of.rows());
                    range.end - range.start
                };
                let more = rows(&identity).saturating_sub(rows(&shard));
                surveyed.left = surveyed.left.map(|left| left + more);
                if surveyed.state == State::Done {
                    surveyed.state = State::Begun;
                }
            }
            found.insert(index, surveyed);
        }
        let count = identity.shard.count.min(MOST);
        for (path, error) in unreadable {
            // Its name is all there is.
            let index = (1..=count).find(|index| {
                path.file_name()
                    .is_some_and(|name| name == Shard { index: *index, count }.file_name().as_str())
            });
            let index = index.filter(|index| !found.contains_key(index)).ok_or(error)?;
            found.insert(index, Surveyed { index, state: State::Damaged, journal: Some(path), left: None });
        }
        let missing = |index| Surveyed { index, state: State::Missing, journal: None, left: None };
        let shards = (1..=count).map(|index| found.remove(&index).unwrap_or_else(|| missing(index)));
        Ok(Self { shards: shards.collect(), identity: identity.whole() })
    }

    /// Returns whether all shards are done.
    pub fn is_done(&self) -> bool {
        self.shards.iter().all(|shard| shard.state == State::Done)
    }

    /// Returns the indices to submit again, as Slurm takes them, such as `3,7-9`; empty if there are none.
    pub fn again(&self) -> String {
        let again = self.shards.iter().filter(|shard| !matches!(shard.state, State::Done | State::Running));
        let mut ranges: Vec<(u64, u64)> = Vec::new();
        for index in again.map(|shard| shard.index) {
            match ranges.last_mut() {
                Some((_, last)) if *last + 1 == index => *last = index,
                _ => ranges.push((index, index)),
            }
        }
        let text = ranges.iter().map(|&(first, last)| match last - first {
            0 => first.to_string(),
            1 => format!("{first},{last}"),
            _ => format!("{first}-{last}"),
        });
        text.collect::<Vec<_>>().join(",")
    }
}

/// Determines the progress of a shard from its journal.
fn surveyed(index: u64, path: PathBuf) -> Result<Surveyed, JournalError> {
    let (done, left, damaged) = standing(&path)?;
    let state = match (done, damaged) {
        (true, _) => State::Done,
        _ if Journal::is_busy(&path) => State::Running,
        (_, true) => State::Damaged,
        _ => State::Begun,
    };
    Ok(Surveyed { index, state, journal: Some(path), left: Some(left) })
}

#[cfg(test)]
mod tests {
    use super::super::journal::Keep as _;
    use super::super::walk::tests::{identity as of, row};
    use super::*;

    #[test]
    fn regress_shards_that_were_not_extended_yet_are_begun_and_merge_says_what_to_run() {
        let root = tempfile::tempdir().expect("a folder");
        for (index, trials) in [(1, 10_000), (2, 12_000), (3, 10_000)] {
            let numerics = crate::NUMERICS;
            let shard = Identity { numerics, trials, ..of("{}", Shard { index, count: 3 }) };
            let mut journal =
                Journal::create(&root.path().join(shard.shard.file_name()), &shard).expect("writable");
            let rows: Vec<_> =
                journal.walk().ahead(u64::MAX).iter().map(|(_, trial)| row(*trial, 1.0)).collect();
            rows.chunks(100).for_each(|block| journal.append(block).expect("written"));
        }
        let folders = [root.path().to_owned()];
        let survey = Survey::of(&folders).expect("one run");
        let states: Vec<_> = survey.shards.iter().map(|shard| (shard.state, shard.left)).collect();
        let points = survey.identity.points;
        let rows = |trials: u64| points * trials * 3 / 3 - points * trials * 2 / 3;
        assert_eq!(states[1], (State::Done, Some(0)));
        assert_eq!(states[2], (State::Begun, Some(rows(12_000) - rows(10_000))));
        assert_eq!((survey.again().as_str(), survey.identity.trials), ("1,3", 12_000));
        let message = super::super::Shards::collect(&folders).expect_err("not extended").to_string();
        assert!(message.contains("of 10000 trials, others of 12000"), "{message}");
        assert!(message.contains("--trials 12000 --resume"), "{message}");
    }

    #[test]
    fn law_each_state_is_told_and_what_is_left_can_be_submitted_again() {
        let root = tempfile::tempdir().expect("a folder");
        let shard = |index| of("{}", Shard { index, count: 12 });
        let path = |index| root.path().join(Shard { index, count: 12 }.file_name());
        let write = |index: u64, most: usize| {
            let mut journal = Journal::create(&path(index), &shard(index)).expect("writable");
            let rows: Vec<_> =
                journal.walk().ahead(u64::MAX).iter().map(|(_, trial)| row(*trial, 1.0)).collect();
            for block in rows[..most.min(rows.len())].chunks(100) {
                journal.append(block).expect("written");
            }
            journal
        };
        for index in [1, 2, 4, 5, 6, 10, 12] {
            write(index, usize::MAX);
        }
        write(3, 250);
        // 7 has a block that is wrong, 8 no head, 9 is being written, 11 is missing.
        write(7, 400);
        let mut bytes = std::fs::read(path(7)).expect("there");
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        std::fs::write(path(7), bytes).expect("writable");
        std::fs::write(path(8), "nothing").expect("writable");
        let busy = write(9, 100);
        let survey = Survey::of(&[root.path().to_owned()]).expect("one run");
        let states: Vec<State> = survey.shards.iter().map(|shard| shard.state).collect();
        let (d, b, x) = (State::Done, State::Begun, State::Damaged);
        assert_eq!(states, [d, d, b, d, d, d, x, x, State::Running, d, State::Missing, d]);
        assert_eq!(survey.shards[2].left, Some(50_000 * 3 / 12 - 50_000 * 2 / 12 - 250));
        assert_eq!((survey.again().as_str(), survey.is_done()), ("3,7,8,11", false));
        drop(busy);
        for index in [3, 7, 8, 9, 11] {
            write(index, usize::MAX);
        }
        let survey = Survey::of(&[root.path().to_owned()]).expect("one run");
        assert_eq!((survey.again().as_str(), survey.is_done()), ("", true));
        let none = Survey {
            shards: (2..6).map(|index| Surveyed { index, state: b, journal: None, left: None }).collect(),
            ..survey
        };
        assert_eq!(none.again(), "2-5");
    }
}
