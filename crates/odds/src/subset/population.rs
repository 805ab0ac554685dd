//! States of one level: the values of all states, and the tapes of those that are used further.

use std::cmp::Ordering;
use std::collections::BTreeMap;

use standstill_numeric::whole;
use standstill_sim::{Purpose, Streams, Tape};

/// A state of a chain: the tape with its draws, and the value of the order parameter.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub value: f64,
    pub tape: Tape,
    /// Index of the state in the first level from which this state descends.
    pub ancestor: u32,
}

/// Rank of a state: by its value, and by a random number (`lot`) among equal values.
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

/// The `room` states of highest rank. The draws of all states of a level may take gigabytes; only a tenth of the states
/// is kept.
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

/// The states of a level, or of a part of a level.
#[derive(Debug)]
pub(super) struct Population {
    seeds: usize,
    /// Values by chain, in the order of each chain's states.
    values: BTreeMap<usize, Vec<f64>>,
    /// Number of states in the event by their ancestor in the first level.
    hits_of: BTreeMap<u32, u32>,
    nearest: Best,
    /// A random sample of the states in the event.
    failures: Best,
}

/// Threshold between a level and the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cut {
    /// Least value of the states of the next level.
    pub threshold: f64,
    /// Share of the states that have at least this value.
    pub share: f64,
    /// Square of the share's coefficient of variation.
    pub variance: f64,
}

/// Returns a pseudo-random number for a key (SplitMix64).
fn lot(key: u64) -> u64 {
    let mut x = key.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

impl Population {
    pub fn new(seeds: usize) -> Self {
        Self {
            seeds,
            values: BTreeMap::new(),
            hits_of: BTreeMap::new(),
            nearest: Best::new(seeds),
            failures: Best::new(seeds),
        }
    }

    /// Adds the next state of a chain. `key` determines the state's rank among equal values.
    pub fn add(&mut self, chain: usize, key: u64, state: &State) {
        let rank = Rank { value: state.value, lot: lot(key) };
        self.values.entry(chain).or_default().push(state.value);
        if self.nearest.wants(rank) {
            self.nearest.add(rank, state.clone());
        }
        if state.value > 0.0 {
            *self.hits_of.entry(state.ancestor).or_default() += 1;
        }
        let by_lot = Rank { value: 0.0, ..rank };
        if state.value > 0.0 && self.failures.wants(by_lot) {
            self.failures.add(by_lot, state.clone());
        }
    }

    /// Returns, for each of these shares of the states, the value that this share reaches or exceeds, and the exact
    /// share of states that do.
    pub fn quantiles(&self, shares: impl Iterator<Item = f64>) -> Vec<(f64, f64)> {
        let mut all: Vec<f64> = self.values.values().flatten().copied().collect();
        all.sort_by(|a, b| b.total_cmp(a));
        let count = all.len() as f64;
        let at = |share: f64| {
            // A level has thousands of states: the index is exact.
            let value = *all.get(whole::<usize>((share * count).ceil().max(1.0)) - 1)?;
            // All states of an equal value are included.
            let reached = all.partition_point(|other| other.total_cmp(&value).is_ge());
            value.is_finite().then_some((value, reached as f64 / count))
        };
        shares.filter_map(at).collect()
    }

    /// Joins the parts of a level.
    pub fn gathered(seeds: usize, parts: Vec<Self>) -> Self {
        let mut whole = Self::new(seeds);
        for part in parts {
            whole.values.extend(part.values);
            for (ancestor, hits) in part.hits_of {
                *whole.hits_of.entry(ancestor).or_default() += hits;
            }
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

    /// Returns the number of states in the event.
    pub fn hits(&self) -> usize {
        self.count(|value| value > 0.0)
    }

    /// Returns the square of the coefficient of variation of a run that ends with this level, estimated by descent:
    /// each of the `first` independent states of the first level has a number of descendants in the event, and the
    /// run's probability is proportional to the mean of these numbers. Unlike the levels' own variances, this estimate
    /// includes that chains of later levels descend from the same states.
    pub fn variance_by_descent(&self, first: u32) -> f64 {
        let (mut sum, mut squares) = (0.0, 0.0);
        for hits in self.hits_of.values().map(|hits| f64::from(*hits)) {
            (sum, squares) = (sum + hits, squares + hits * hits);
        }
        let first = f64::from(first);
        (squares / (sum * sum) - 1.0 / first).max(0.0) * first / (first - 1.0)
    }

    /// Returns true if all values are equal, finite and outside of the event.
    pub fn is_constant(&self) -> bool {
        let mut values = self.values.values().flatten();
        let first = values.next().copied().unwrap_or(f64::NAN);
        first.is_finite() && first <= 0.0 && values.all(|value| *value == first)
    }

    /// Returns the threshold of the next level, or that of the event if this level is the `last`. None if the values do
    /// not lead to the event: more than half of the states have at least the threshold, or it is −∞.
    ///
    /// The next level lies strictly beyond the k-th best state, which sets it: this state, and states equal to it, are
    /// no seeds and do not count. For n independent states, with U the probability beyond the k-th, E[(k − 1)/(n U)] =
    /// 1, and the k − 1 states are draws of the level. The estimate k/n is too large by 1/(n U), and with the k-th
    /// state as a seed a chain would begin at the level's edge (Bréhier et al. 2016, doi:10.1214/16-AAP1185). If many
    /// states have the threshold's value (a quantity with few values), the level includes them.
    pub fn cut(&self, last: bool) -> Option<Cut> {
        let total = self.count(|_| true);
        let threshold = if last {
            0.0_f64.next_up()
        } else {
            let edge = self.nearest.states.first_key_value().map(|(rank, _)| rank.value)?;
            let is_plateau = 2 * self.count(|value| value > edge) < self.seeds;
            if is_plateau || edge == f64::NEG_INFINITY { edge } else { edge.next_up() }
        };
        let inside = |value: f64| value >= threshold;
        let share = self.count(inside) as f64 / total as f64;
        if !last && (threshold == f64::NEG_INFINITY || share > 0.5) {
            return None;
        }
        let variance = (1.0 - share) / (share * total as f64) * (1.0 + self.correlation(inside, share));
        Some(Cut { threshold, share, variance })
    }

    /// Returns the factor γ: correlation within chains raises the variance by 1 + γ (Au and Beck 2001, equations 26 to
    /// 29).
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

    /// Returns the seeds of the next level. If more states have the threshold's value than seeds are needed, seeds are
    /// drawn at random, in proportion to the numbers of states above and at the threshold.
    pub fn into_seeds(self, cut: &Cut, keys: Streams) -> Vec<State> {
        let above = self.count(|value| value > cut.threshold);
        let at = self.count(|value| value >= cut.threshold) - above;
        let within = self.nearest.states.into_values().filter(|state| state.value >= cut.threshold);
        let (tied, mut seeds): (Vec<State>, Vec<State>) =
            within.partition(|state| state.value <= cut.threshold);
        // A chain that stays in place makes a few equal states, any of which may go on.
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

#[cfg(test)]
mod tests {
    use super::*;

    fn of_values(seeds: usize, values: impl IntoIterator<Item = f64>) -> Population {
        let mut population = Population::new(seeds);
        for (chain, value) in values.into_iter().enumerate() {
            population.add(chain, chain as u64, &State { value, tape: Tape::new(1, 1), ancestor: 0 });
        }
        population
    }

    #[test]
    fn law_the_state_that_sets_a_level_is_no_seed_of_it() {
        let seeds = |values: Vec<f64>| {
            let population = of_values(10, values);
            let cut = population.cut(false).expect("leads on");
            let mut seeds: Vec<f64> =
                population.into_seeds(&cut, Streams::new(1, 1)).iter().map(|state| state.value).collect();
            seeds.sort_by(f64::total_cmp);
            (cut.share, seeds)
        };
        let distinct = || (1..=100).map(|k| f64::from(k) - 1000.0);
        assert_eq!(seeds(distinct().collect()), (0.09, (92..=100).map(|k| f64::from(k) - 1000.0).collect()));
        // A chain stayed at the edge: none of its equal states counts.
        let stayed = distinct().map(|value| if (-911.0..=-907.0).contains(&value) { -909.0 } else { value });
        assert_eq!(seeds(stayed.collect()), (0.07, (94..=100).map(|k| f64::from(k) - 1000.0).collect()));
        // A quantity with few values: thirty states at the edge and four beyond it are all in the level.
        let few = (0..100).map(|k| [-3.0, -2.0, -1.0][usize::from(k >= 66) + usize::from(k >= 96)]);
        let (share, seeds) = seeds(few.collect());
        assert_eq!((share, seeds.len()), (0.34, 10));
        assert!(seeds.iter().all(|value| *value >= -2.0) && seeds.contains(&-2.0), "{seeds:?}");
        // If most states have one value, those beyond it form a level if they are at least half as many as the seeds.
        let most = |equal| of_values(10, (0..100).map(|k| if k < equal { -1.5 } else { -1.0 })).cut(false);
        assert_eq!((most(93).map(|cut| cut.share), most(97)), (Some(0.07), None));
        // If the distance from the event is unknown for most states, there is no next level.
        assert_eq!(
            of_values(10, (0..100).map(|k| if k < 93 { f64::NEG_INFINITY } else { -1.0 })).cut(false),
            None
        );
    }

    #[test]
    fn analytic_a_levels_share_is_that_of_all_starts_on_average() {
        // Of 100 states 9 lie beyond the tenth, and U is the probability beyond it: E[0.09/U] = 1 with a deviation of
        // 0.35, but E[0.1/U] = 1.11.
        let ratio = |k: u64| {
            let mut draws = Streams::new(k, 1).open(Purpose::Design);
            let cut = of_values(10, (0..100).map(|_| draws.uniform() - 1.0)).cut(false).expect("leads on");
            cut.share / -cut.threshold
        };
        let mean = (1..=4000).map(ratio).sum::<f64>() / 4000.0;
        assert!((mean - 1.0).abs() < 0.02, "{mean}");
    }

    #[test]
    fn analytic_variance_by_descent_is_that_of_each_first_states_descendants() {
        let level = |ancestors: &[u32]| {
            let parts = ancestors.iter().enumerate().map(|(chain, ancestor)| {
                let mut part = Population::new(10);
                for value in [1.0, -1.0] {
                    part.add(
                        chain,
                        chain as u64,
                        &State { value, tape: Tape::new(1, 1), ancestor: *ancestor },
                    );
                }
                part
            });
            Population::gathered(10, parts.collect())
        };
        // Hits of a first level are independent: (1 − p)/(p (n − 1)) for 4 of 100.
        let plain = level(&[3, 5, 7, 9]).variance_by_descent(100);
        assert!((plain / (0.96 / 0.04 / 99.0) - 1.0).abs() < 1e-12, "{plain}");
        // Three of four descend from one state: counts of 3, 1 and 98 zeros, with mean 0.04 and Σ x² = 10.
        let common = level(&[3, 3, 3, 9]).variance_by_descent(100);
        let variance = (10.0 - 100.0 * 0.04 * 0.04) / 99.0;
        assert!((common / (variance / 100.0 / (0.04 * 0.04)) - 1.0).abs() < 1e-12, "{common}");
    }
}
