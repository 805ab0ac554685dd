//! The states of one level: all values, and of the states themselves those that are needed further on.

use std::cmp::Ordering;
use std::collections::BTreeMap;

use standstill_sim::{Purpose, Streams, Tape};

/// A state of a chain.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub value: f64,
    pub tape: Tape,
    /// The state of the first level from which it descends.
    pub ancestor: u32,
}

/// Rank of a state: by its value, among equal ones by lot.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Rank {
    value: f64,
    lot: u64,
}

impl Eq for Rank {}

impl PartialOrd for Rank {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Rank {
    fn cmp(&self, other: &Self) -> Ordering {
        self.value.total_cmp(&other.value).then(self.lot.cmp(&other.lot))
    }
}

/// At most so many states, those of highest rank. A level of a long method has gigabytes of draws; a tenth of them is
/// kept.
#[derive(Debug)]
struct Best {
    room: usize,
    states: BTreeMap<Rank, State>,
}

impl Best {
    fn new(room: usize) -> Self {
        Self { room, states: BTreeMap::new() }
    }

    fn wants(&self, rank: Rank) -> bool {
        self.states.len() < self.room || self.states.first_key_value().is_none_or(|(least, _)| rank > *least)
    }

    fn add(&mut self, rank: Rank, state: State) {
        if self.wants(rank) {
            self.states.insert(rank, state);
            if self.states.len() > self.room {
                self.states.pop_first();
            }
        }
    }
}

/// The states of a level, or of a part of it.
#[derive(Debug)]
pub(super) struct Population {
    seeds: usize,
    /// Values by chain, each in the order of its states.
    values: BTreeMap<usize, Vec<f64>>,
    nearest: Best,
    /// Of those in the event, a sample.
    failures: Best,
}

/// Threshold between a level and the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cut {
    /// Values from here on are of the next level.
    pub threshold: f64,
    /// The share of them.
    pub share: f64,
    /// The square of its coefficient of variation.
    pub variance: f64,
}

/// Splitmix: a number without a pattern for each key.
fn lot(key: u64) -> u64 {
    let mut x = key.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

impl Population {
    pub fn new(seeds: usize) -> Self {
        Self { seeds, values: BTreeMap::new(), nearest: Best::new(seeds), failures: Best::new(seeds) }
    }

    /// The next state of a chain. Its key decides among equals.
    pub fn add(&mut self, chain: usize, key: u64, state: &State) {
        let rank = Rank { value: state.value, lot: lot(key) };
        self.values.entry(chain).or_default().push(state.value);
        if self.nearest.wants(rank) {
            self.nearest.add(rank, state.clone());
        }
        let by_lot = Rank { value: 0.0, ..rank };
        if state.value > 0.0 && self.failures.wants(by_lot) {
            self.failures.add(by_lot, state.clone());
        }
    }

    /// Values which these shares of the states reach or exceed, each with the share that does.
    pub fn quantiles(&self, shares: impl Iterator<Item = f64>) -> Vec<(f64, f64)> {
        let mut all: Vec<f64> = self.values.values().flatten().copied().collect();
        all.sort_by(|a, b| b.total_cmp(a));
        let count = all.len() as f64;
        let at = |share: f64| {
            // Of thousands of states.
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a count")]
            let value = *all.get((share * count).ceil().max(1.0) as usize - 1)?;
            // Of equal values all are there.
            let reached = all.partition_point(|other| other.total_cmp(&value).is_ge());
            value.is_finite().then_some((value, reached as f64 / count))
        };
        shares.filter_map(at).collect()
    }

    /// The parts of a level together.
    pub fn gathered(seeds: usize, parts: Vec<Self>) -> Self {
        let mut whole = Self::new(seeds);
        for part in parts {
            whole.values.extend(part.values);
            for (rank, state) in part.nearest.states {
                whole.nearest.add(rank, state);
            }
            for (rank, state) in part.failures.states {
                whole.failures.add(rank, state);
            }
        }
        whole
    }

    fn count(&self, inside: impl Fn(f64) -> bool) -> usize {
        self.values.values().flatten().filter(|value| inside(**value)).count()
    }

    /// States in the event.
    pub fn hits(&self) -> usize {
        self.count(|value| value > 0.0)
    }

    /// True if all values are equal, finite and outside of the event.
    pub fn is_constant(&self) -> bool {
        let mut values = self.values.values().flatten();
        let first = values.next().copied().unwrap_or(f64::NAN);
        first.is_finite() && first <= 0.0 && values.all(|value| *value == first)
    }

    /// Threshold of the next level, or, at the last one, of the event. None where the values lead nowhere: more than half of
    /// the states have the same one.
    pub fn cut(&self, last: bool) -> Option<Cut> {
        let total = self.count(|_| true);
        let threshold = if last {
            // The smallest number above zero.
            f64::from_bits(1)
        } else {
            self.nearest.states.first_key_value().map(|(rank, _)| rank.value)?
        };
        let inside = |value: f64| value >= threshold;
        let share = self.count(inside) as f64 / total as f64;
        if !last && (threshold == f64::NEG_INFINITY || share > 0.5) {
            return None;
        }
        let variance = (1.0 - share) / (share * total as f64) * (1.0 + self.correlation(inside, share));
        Some(Cut { threshold, share, variance })
    }

    /// By how much the states of a chain say less than independent ones would (Au and Beck 2001, equations 26 to 29).
    fn correlation(&self, inside: impl Fn(f64) -> bool, share: f64) -> f64 {
        let length = self.values.values().map(Vec::len).max().unwrap_or(1);
        let at_rest = share * (1.0 - share);
        if length < 2 || at_rest <= 0.0 {
            return 0.0;
        }
        let lag = |lag: usize| {
            let pairs = self.values.values().flat_map(|chain| chain.iter().zip(chain.iter().skip(lag)));
            let (mut both, mut count) = (0_u32, 0_u32);
            for (one, other) in pairs {
                both += u32::from(inside(*one) && inside(*other));
                count += 1;
            }
            let alike = f64::from(both) / f64::from(count.max(1)) - share * share;
            2.0 * (1.0 - lag as f64 / length as f64) * alike / at_rest
        };
        (1..length).map(lag).sum::<f64>().max(0.0)
    }

    /// The seeds of the next level. Where several states share the threshold's value, as many of them as are their due.
    pub fn into_seeds(self, cut: &Cut, keys: Streams) -> Vec<State> {
        let above = self.count(|value| value > cut.threshold);
        let at = self.count(|value| value >= cut.threshold) - above;
        let (tied, mut seeds): (Vec<State>, Vec<State>) =
            self.nearest.states.into_values().partition(|state| state.value <= cut.threshold);
        // A chain that stays where it is makes a few equal states: which of them go on does not matter.
        if above + at <= self.seeds + self.seeds / 20 {
            seeds.extend(tied);
            return seeds;
        }
        let mut draws = keys.open_named(Purpose::Design, "seeds");
        let mut pick = |from: &[State]| {
            let last = from.len() as u64 - 1;
            from[usize::try_from(draws.integer(last)).unwrap_or(0)].clone()
        };
        let due = if seeds.is_empty() { 0 } else { (self.seeds * above).div_ceil(above + at) };
        let mut chosen: Vec<State> = (0..due).map(|_| pick(&seeds)).collect();
        chosen.extend((due..self.seeds).map(|_| pick(&tied)));
        chosen
    }

    pub fn into_failures(self) -> Vec<Tape> {
        self.failures.states.into_values().map(|state| state.tape).collect()
    }
}
