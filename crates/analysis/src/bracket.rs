//! Finds the values of a key with which limits hold. Whether they hold at one value is judged from trials, and so is uncertain.
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

/// Verdict on whether all limits hold at one value of the searched quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Verdict {
    /// True if all limits hold with the measures at their point estimates.
    pub holds: bool,
    /// True if all limits hold with the measures at the unfavourable ends of their confidence intervals.
    pub surely: bool,
    /// True if all limits hold with the measures at the favourable ends of their confidence intervals.
    pub possibly: bool,
}

/// Result of the trials at one value of the searched quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    /// Number of trials. It is smaller than requested if the result was clear earlier.
    pub trials: u64,
    /// Ratio of each measure to its limit, with the ratio's 95 % interval. A limit holds if the ratio is at most 1.
    pub shares: Vec<Estimate>,
    /// Ratio of each measure to its limit, computed only from the simulated motor starts that gave an answer.
    pub answered: Vec<f64>,
    /// Forecasts of the largest ratio: the lower and upper end of its 95 % interval after each number of trials in [`forecast_trials`].
    pub forecast: Vec<[f64; 2]>,
    /// True if the limits surely hold, and false if they surely fail; further trials would not change this result. None if the result is
    /// not clear yet.
    pub clear: Option<bool>,
}

/// Smallest number of trials of the forecasts. Each further number is twice the number before it.
const FORECAST_FROM: u64 = 500;
/// Number of forecasts.
const FORECASTS: u32 = 21;

/// Iterates over the numbers of trials for which a [`Look`] forecasts its confidence interval. They are 500 times the powers of two.
pub fn forecast_trials() -> impl Iterator<Item = u64> {
    (0..FORECASTS).map(|k| FORECAST_FROM << k)
}

/// Selects the value of a measure by which its limit is judged: the point estimate, or an end of the confidence interval.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum View {
    /// The point estimate.
    Likely,
    /// The upper end of the interval, which is unfavourable.
    Bad,
    /// The lower end of the interval, which is favourable.
    Good,
}

impl Look {
    /// Returns the largest ratio of a measure to its limit, with each ratio at the value that `view` selects.
    fn worst(&self, view: View) -> f64 {
        let of = |share: &Estimate| match view {
            View::Likely => share.value,
            View::Bad => share.high,
            View::Good => share.low,
        };
        self.shares.iter().map(of).fold(0.0, f64::max)
    }

    /// Returns true if all limits hold, with each measure at the value that `view` selects. If the result was clear early, returns that
    /// result.
    fn holds(&self, view: View) -> bool {
        self.clear.unwrap_or_else(|| self.worst(view) <= 1.0)
    }

    /// Returns the verdict on whether the limits hold.
    pub fn verdict(&self) -> Verdict {
        Verdict {
            holds: self.holds(View::Likely),
            surely: self.holds(View::Bad),
            possibly: self.holds(View::Good),
        }
    }

    /// Returns the forecast for this number of trials: the upper end of the largest ratio's confidence interval.
    fn foreseen(&self, trials: u64) -> f64 {
        let number = forecast_trials().take_while(|then| *then <= trials).count().saturating_sub(1);
        self.forecast[number][1]
    }

    /// Returns the indices of the limits whose measures exceed them.
    fn broken(&self) -> Vec<usize> {
        (0..self.shares.len()).filter(|k| self.shares[*k].value > 1.0).collect()
    }
}

/// Range and precision of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Search {
    /// Smallest and largest value. If both are above zero, neighbouring values that are tried have the same ratio. Otherwise they have the
    /// same difference.
    pub range: (f64, f64),
    /// Number of values in the scan. These values are tried first, and are spread over the whole range.
    pub points: usize,
    /// Number of trials at each value of the scan. Values near an edge get more trials later.
    pub trials: u64,
    /// Largest number of trials at one value. If a forecast says that these do not make an edge's interval narrow, trials are added only
    /// up to four times this number at all values together.
    pub most: u64,
    /// Least number of trials with which the limits can be shown to hold surely.
    pub sure_from: u64,
    /// Largest accepted width of an edge's 95 % interval, as a share of the edge's value.
    pub width: f64,
    /// True if only whole numbers are allowed.
    pub whole: bool,
}

/// End of a stretch of values at which an edge lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The limits hold below the edge, so the edge is the largest value of the stretch.
    Largest,
    /// The limits hold above the edge, so the edge is the smallest value of the stretch.
    Smallest,
}

/// Result of a search.
#[derive(Clone, Debug, PartialEq)]
pub enum Found {
    /// The limits hold at none of the tried values.
    Nowhere,
    /// The limits hold at all tried values.
    Everywhere,
    /// The limits hold in a part of the range, which ends at one or two edges.
    Stretch(Stretch),
}

/// A stretch of neighbouring values at which the limits hold.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretch {
    /// Edges of the stretch, the edge with the smaller value first. If the stretch reaches an end of the range, that end is not an edge.
    pub edges: Vec<Edge>,
    /// First and last value of each stretch of the scan in which the limits hold. There are several stretches only if the limits surely
    /// fail between them.
    pub all: Vec<(f64, f64)>,
}

impl Stretch {
    /// Returns the edge with the larger value.
    pub fn last(&self) -> Option<&Edge> {
        self.edges.last()
    }

    /// Returns true if the limits hold in one stretch only.
    pub fn is_one(&self) -> bool {
        self.all.len() <= 1
    }
}

/// Function that runs at most the given number of trials at a value, and returns their result. It returns none if the value is invalid.
pub type Judge<'a, E> = &'a mut dyn FnMut(f64, u64) -> Result<Option<Look>, E>;

/// All results so far. Each value has the result with the most trials.
struct Looks<'a, 'b, E> {
    search: &'a Search,
    judge: Judge<'b, E>,
    /// The looks at each value, by the value's bits: position in the range, number of trials requested, and result. An invalid
    /// value has no result.
    known: BTreeMap<u64, (f64, u64, Option<Look>)>,
    /// Number of calls of `judge`.
    judged: u64,
    /// Number of trials at all values together.
    trials: u64,
}

impl<E> Looks<'_, '_, E> {
    /// Returns the result at a position in the range with this number of trials, or with fewer trials if the result is clear. None if the
    /// value at this position is invalid.
    fn at(&mut self, place: f64, trials: u64) -> Result<Option<&Look>, E> {
        let value = self.search.at(place);
        let known = self.known.get(&value.to_bits()).is_some_and(|(_, asked, look)| {
            *asked >= trials || look.as_ref().is_none_or(|look| look.clear.is_some())
        });
        if !known {
            let look = (self.judge)(value, trials)?;
            // Trials of an earlier look are a part of those of a later one.
            let of = |look: Option<&Look>| look.map_or(0, |look| look.trials);
            let before = self.known.get(&value.to_bits()).and_then(|(.., look)| look.as_ref());
            self.trials += of(look.as_ref()).saturating_sub(of(before));
            self.judged += 1;
            self.known.insert(value.to_bits(), (place, trials, look));
        }
        Ok(self.known.get(&value.to_bits()).and_then(|(.., look)| look.as_ref()))
    }

    /// Returns true if the limits hold at a position, by the result with at least this number of trials.
    fn holds(&mut self, place: f64, trials: u64) -> Result<bool, E> {
        Ok(self.at(place, trials)?.is_some_and(|look| look.holds(View::Likely)))
    }
}

/// Returns the value at a position in a range. Position 0 is the low end and 1 the high end. Equal steps of the position multiply the value
/// by equal factors if the range is positive; otherwise they add equal differences.
pub(crate) fn between((low, high): (f64, f64), place: f64) -> f64 {
    if low > 0.0 {
        low * standstill_numeric::exp(place * standstill_numeric::ln(high / low))
    } else {
        low + place * (high - low)
    }
}

impl Search {
    /// Returns the value at a position in the range. Position 0 is the smallest value and 1 the largest.
    fn at(&self, place: f64) -> f64 {
        let value = between(self.range, place);
        if self.whole { value.round() } else { value }
    }

    /// Returns the positions of the scan. Positions that have the same value as the position before them are left out.
    fn places(&self) -> Vec<f64> {
        let place = |k: usize| k as f64 / (self.points - 1) as f64;
        let mut places: Vec<f64> = (0..self.points).map(place).collect();
        places.dedup_by(|a, b| self.at(*a) == self.at(*b));
        places
    }

    /// Returns the values of the scan, each once.
    pub fn values(&self) -> Vec<f64> {
        self.places().into_iter().map(|place| self.at(place)).collect()
    }

    /// Searches the range for the edges of the stretch in which the limits hold.
    ///
    /// # Errors
    /// Errors of `judge`.
    pub fn find<E>(&self, judge: Judge<'_, E>) -> Result<Found, E> {
        let mut looks = Looks { search: self, judge, known: BTreeMap::new(), judged: 0, trials: 0 };
        let mut scan: Vec<(f64, bool)> = Vec::new();
        for place in self.places() {
            // Invalid values are left out of the scan.
            scan.extend(looks.at(place, self.trials)?.map(|look| (place, look.holds(View::Likely))));
        }
        if scan.iter().all(|(_, holds)| !holds) {
            let Some(between) = self.between(&mut looks, &scan)? else { return Ok(Found::Nowhere) };
            scan.push((between, true));
            scan.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        self.settle(&mut looks, &mut scan)?;
        loop {
            if scan.iter().all(|(_, holds)| *holds) {
                // Values at which more trials may show that the limits hold after all.
                for (place, holds) in &mut scan {
                    if !looks.holds(*place, self.trials)? {
                        *holds = looks.holds(*place, self.most)?;
                    }
                }
            }
            if scan.iter().all(|(_, holds)| *holds) {
                return Ok(Found::Everywhere);
            }
            let Some(stretch) = self.drawn_in(&mut looks, &scan)? else {
                // More trials contradict the scan. Each time there are results with more trials, so this ends.
                for (place, holds) in &mut scan {
                    *holds = looks.holds(*place, self.trials)?;
                }
                if scan.iter().all(|(_, holds)| !holds) {
                    return Ok(Found::Nowhere);
                }
                self.settle(&mut looks, &mut scan)?;
                continue;
            };
            return Ok(Found::Stretch(stretch));
        }
    }

    /// Finds the edges of a stretch of the scan in which the limits hold. None if the results of more trials, which are now known,
    /// contradict the scan.
    fn drawn_in<E>(&self, looks: &mut Looks<'_, '_, E>, scan: &[(f64, bool)]) -> Result<Option<Stretch>, E> {
        let stretches = stretches::of(scan);
        let count = scan.len();
        // A stretch that begins or ends with the range is chosen first, otherwise the widest.
        let first = stretches.iter().find(|part| part.start == 0);
        let last = stretches.iter().find(|part| part.end == count);
        let widest = || stretches.iter().rev().max_by_key(|part| part.len());
        let Some(chosen) = first.or(last).or_else(widest).cloned() else { return Ok(None) };
        let places: Vec<f64> = scan.iter().map(|(place, _)| *place).collect();
        let mut edges = Vec::new();
        if chosen.start > 0 {
            let mut backwards: Vec<f64> = places[..chosen.end].to_vec();
            backwards.reverse();
            let Some(edge) = self.edge(looks, &backwards, chosen.len(), Side::Smallest)? else {
                return Ok(None);
            };
            edges.push(edge);
        }
        if chosen.end < count {
            let outwards = &places[chosen.start..];
            let Some(edge) = self.edge(looks, outwards, chosen.len(), Side::Largest)? else {
                return Ok(None);
            };
            edges.push(edge);
        }
        // At an end without an edge, where the range ends, the limits must still hold.
        for end in [chosen.start, chosen.end - 1] {
            if (end == 0 || end + 1 == count) && !looks.holds(places[end], self.trials)? {
                return Ok(None);
            }
        }
        if !edges.is_sorted_by(|a, b| a.value <= b.value) {
            return Ok(None);
        }
        let ends =
            |part: &std::ops::Range<usize>| (self.at(places[part.start]), self.at(places[part.end - 1]));
        Ok(Some(Stretch { edges, all: stretches.iter().map(ends).collect() }))
    }
}
