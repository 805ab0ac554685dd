//! From which value on, and up to which one, something holds, from judgements that are uncertain.
//!
//! ```text
//!   scan the range ─► where does it hold? ─► each end of the stretch: ─► the value; where it surely holds, and where possibly ─► interval
//!                     everywhere, nowhere,    draw it in                     └── too wide: more trials, again
//!                     in several stretches
//! ```

mod edge;
mod needed;
mod stretches;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use standstill_campaign::Estimate;

pub use edge::{Bound, Edge};

/// A judgement at one value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Verdict {
    /// True if the limits hold by the estimates themselves.
    pub holds: bool,
    /// True if they hold at the bad ends of all intervals.
    pub surely: bool,
    /// True if they hold at the good ends.
    pub possibly: bool,
}

/// The result of the trials at one value.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    /// The number of trials: fewer than asked for where the result was clear before.
    pub trials: u64,
    /// Each measure divided by its limit, with its 95 % interval. A limit is kept up to 1.
    pub shares: Vec<Estimate>,
    /// Judgement of the starts with an answer alone.
    pub answered: Vec<f64>,
    /// Between which shares the worst measure would be known by [`forecast_trials`].
    pub forecast: Vec<[f64; 2]>,
    /// The limits surely hold, or surely do not: further trials change nothing.
    pub clear: Option<bool>,
}

/// Trials of the forecasts: powers of two times this.
const FORECAST_FROM: u64 = 500;
/// Number of trials.
const FORECASTS: u32 = 21;

/// Numbers of trials for which a look tells what it would be.
pub fn forecast_trials() -> impl Iterator<Item = u64> {
    (0..FORECASTS).map(|k| FORECAST_FROM << k)
}

/// The end of an interval that counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum View {
    Likely,
    Bad,
    Good,
}

impl Look {
    /// The worst of the shares.
    fn worst(&self, view: View) -> f64 {
        let of = |share: &Estimate| match view {
            View::Likely => share.value,
            View::Bad => share.high,
            View::Good => share.low,
        };
        self.shares.iter().map(of).fold(0.0, f64::max)
    }

    /// True if the limits hold at one end of the intervals.
    fn holds(&self, view: View) -> bool {
        self.clear.unwrap_or_else(|| self.worst(view) <= 1.0)
    }

    /// True if the value keeps the limits: likely, surely, possibly.
    pub fn verdict(&self) -> Verdict {
        Verdict {
            holds: self.holds(View::Likely),
            surely: self.holds(View::Bad),
            possibly: self.holds(View::Good),
        }
    }

    /// Up to which share the worst measure would be known by so many trials.
    fn foreseen(&self, trials: u64) -> f64 {
        let number = forecast_trials().take_while(|then| *then <= trials).count().saturating_sub(1);
        self.forecast[number][1]
    }

    /// The limits that it breaks, by their numbers.
    fn broken(&self) -> Vec<usize> {
        (0..self.shares.len()).filter(|k| self.shares[*k].value > 1.0).collect()
    }
}

/// Range and precision of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Search {
    /// Smallest and largest value; both above zero for ratios, else the steps are differences.
    pub range: (f64, f64),
    /// Values of the scan.
    pub points: usize,
    /// Trials at each value of the scan.
    pub trials: u64,
    /// Trials at a value beyond which no closer look is taken.
    pub most: u64,
    /// Trials from which on it can be seen to hold surely.
    pub sure_from: u64,
    /// Largest width of the interval, as a share of the value.
    pub width: f64,
    /// True for whole numbers.
    pub whole: bool,
}

/// An end of a stretch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// It holds below: the largest value counts.
    Largest,
    /// It holds above: the smallest value counts.
    Smallest,
}

/// Result of a search.
#[derive(Clone, Debug, PartialEq)]
pub enum Found {
    /// At no value that was looked at.
    Nowhere,
    /// At every value that was looked at.
    Everywhere,
    /// Up to an edge, from one on, or between two.
    Stretch(Stretch),
}

/// A stretch of values where it holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretch {
    /// Its ends, the smaller value first; without the one that is the range's.
    pub edges: Vec<Edge>,
    /// All stretches of the scan where it holds, from and to: more than one only where what lies between is surely not so.
    pub all: Vec<(f64, f64)>,
}

impl Stretch {
    /// The end at the largest value, or else the other.
    pub fn last(&self) -> Option<&Edge> {
        self.edges.last()
    }

    /// True if the limits hold in one stretch.
    pub fn is_one(&self) -> bool {
        self.all.len() <= 1
    }
}

/// Looks at a value by at most so many trials; none where the value cannot be.
pub type Judge<'a, E> = &'a mut dyn FnMut(f64, u64) -> Result<Option<Look>, E>;

/// The looks that were taken, of each value the one with most trials.
struct Looks<'a, 'b, E> {
    search: &'a Search,
    judge: Judge<'b, E>,
    known: BTreeMap<u64, (f64, u64, Option<Look>)>,
}

impl<E> Looks<'_, '_, E> {
    /// With so many trials, or fewer where they make it clear.
    fn at(&mut self, place: f64, trials: u64) -> Result<Option<&Look>, E> {
        let value = self.search.at(place);
        let known = self.known.get(&value.to_bits()).is_some_and(|(_, asked, look)| {
            *asked >= trials || look.as_ref().is_none_or(|look| look.clear.is_some())
        });
        if !known {
            let look = (self.judge)(value, trials)?;
            self.known.insert(value.to_bits(), (place, trials, look));
        }
        Ok(self.known.get(&value.to_bits()).and_then(|(.., look)| look.as_ref()))
    }
}

impl Search {
    /// A value of the range by its place from 0 to 1.
    fn at(&self, place: f64) -> f64 {
        let (low, high) = self.range;
        let value = if low > 0.0 {
            low * standstill_numeric::exp(place * standstill_numeric::ln(high / low))
        } else {
            low + place * (high - low)
        };
        if self.whole { value.round() } else { value }
    }

    /// The places of its scan, each value once.
    fn places(&self) -> Vec<f64> {
        let place = |k: usize| k as f64 / (self.points - 1) as f64;
        let mut places: Vec<f64> = (0..self.points).map(place).collect();
        places.dedup_by(|a, b| self.at(*a) == self.at(*b));
        places
    }

    /// The values of its scan, each once.
    pub fn values(&self) -> Vec<f64> {
        self.places().into_iter().map(|place| self.at(place)).collect()
    }

    /// Looks for the edges.
    ///
    /// # Errors
    /// Those of the judge.
    pub fn find<E>(&self, judge: Judge<'_, E>) -> Result<Found, E> {
        let mut looks = Looks { search: self, judge, known: BTreeMap::new() };
        let mut scan: Vec<(f64, bool)> = Vec::new();
        for place in self.places() {
            // Values that cannot be end the range.
            scan.extend(looks.at(place, self.trials)?.map(|look| (place, look.holds(View::Likely))));
        }
        if scan.iter().all(|(_, holds)| !holds) {
            let Some(between) = self.between(&mut looks, &scan)? else { return Ok(Found::Nowhere) };
            scan.push((between, true));
            scan.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        if scan.iter().all(|(_, holds)| *holds) {
            return Ok(Found::Everywhere);
        }
        self.settle(&mut looks, &mut scan)?;
        let stretches = stretches::of(&scan);
        let count = scan.len();
        // A stretch that begins or ends with the range is chosen first, otherwise the widest.
        let first = stretches.iter().find(|part| part.start == 0);
        let last = stretches.iter().find(|part| part.end == count);
        let widest = || stretches.iter().rev().max_by_key(|part| part.len());
        let Some(chosen) = first.or(last).or_else(widest).cloned() else { return Ok(Found::Everywhere) };
        let places: Vec<f64> = scan.iter().map(|(place, _)| *place).collect();
        let mut edges = Vec::new();
        if chosen.start > 0 {
            let mut backwards: Vec<f64> = places[..chosen.end].to_vec();
            backwards.reverse();
            edges.extend(self.edge(&mut looks, &backwards, chosen.len(), Side::Smallest)?);
        }
        if chosen.end < count {
            edges.extend(self.edge(&mut looks, &places[chosen.start..], chosen.len(), Side::Largest)?);
        }
        if edges.is_empty() {
            return Ok(Found::Everywhere);
        }
        let ends =
            |part: &std::ops::Range<usize>| (self.at(places[part.start]), self.at(places[part.end - 1]));
        Ok(Found::Stretch(Stretch { edges, all: stretches.iter().map(ends).collect() }))
    }
}
