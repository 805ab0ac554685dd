//! Up to which value something holds, from judgements that are uncertain.
//!
//! ```text
//!   scan the range ─► where does it hold? ─► one edge: halve ─► the value; where it surely holds, and where possibly ─► interval
//!                     everywhere, nowhere,                          └── too wide: more trials, again
//!                     in several stretches
//! ```

use std::collections::BTreeMap;

/// A judgement at one value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Verdict {
    /// Whether it holds, as far as the trials tell.
    pub holds: bool,
    /// Whether it holds at the bad ends of all intervals.
    pub surely: bool,
    /// Whether it holds at the good ends.
    pub possibly: bool,
}

/// What is looked at, and how closely.
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
    /// How wide the interval may be, as a share of the value.
    pub width: f64,
    /// Whether values are whole numbers.
    pub whole: bool,
}

/// Which end of a stretch was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// It holds below: the largest value counts.
    Largest,
    /// It holds above: the smallest value counts.
    Smallest,
}

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub enum Found {
    /// At no value of the scan.
    Nowhere,
    /// At every value of the scan.
    Everywhere,
    /// Up to an edge, or from one on.
    Edge(Edge),
}

/// The edge of a stretch where it holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Edge {
    /// Which end of the stretch.
    pub side: Side,
    /// The last value with which it holds.
    pub value: f64,
    /// 95 % interval.
    pub interval: (f64, f64),
    /// Whether that is as narrow as it should be.
    pub narrow: bool,
    /// Stretches of the scan where it holds, from and to; one where it is monotone.
    pub stretches: Vec<(f64, f64)>,
    /// Trials at each of the last values.
    pub trials: u64,
}

impl Edge {
    /// Whether it holds on one side of the edge and nowhere on the other.
    pub fn is_monotone(&self, search: &Search) -> bool {
        let (low, high) = search.range;
        matches!(self.stretches.as_slice(), [(from, to)] if *from <= low || *to >= high)
    }
}

/// Judges a value by so many trials; none where the value cannot be.
pub type Judge<'a, E> = &'a mut dyn FnMut(f64, u64) -> Result<Option<Verdict>, E>;

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

    /// The values of its scan, each once.
    pub fn values(&self) -> Vec<f64> {
        let place = |k: usize| k as f64 / (self.points - 1) as f64;
        let mut values: Vec<f64> = (0..self.points).map(|k| self.at(place(k))).collect();
        values.dedup();
        values
    }

    /// Looks for the edge.
    ///
    /// # Errors
    /// Those of the judge.
    pub fn find<E>(&self, judge: Judge<'_, E>) -> Result<Found, E> {
        let mut scan: Vec<(f64, Verdict)> = Vec::new();
        for k in 0..self.points {
            let place = k as f64 / (self.points - 1) as f64;
            if scan.last().is_some_and(|(last, _)| self.at(*last) == self.at(place)) {
                continue;
            }
            // Values that cannot be end the range.
            scan.extend(judge(self.at(place), self.trials)?.map(|verdict| (place, verdict)));
        }
        let holding = scan.iter().filter(|(_, verdict)| verdict.holds).count();
        if holding == 0 {
            return Ok(Found::Nowhere);
        }
        if holding == scan.len() {
            return Ok(Found::Everywhere);
        }
        let side = if scan[0].1.holds { Side::Largest } else { Side::Smallest };
        // From the end where it holds, up to the first value where it does not; from inside where it holds at neither end.
        if side == Side::Smallest {
            scan.reverse();
        }
        let begin = scan.iter().position(|(_, verdict)| verdict.holds).unwrap_or(0);
        let end = scan[begin..].iter().position(|(_, verdict)| !verdict.holds).map(|off| begin + off);
        let Some(end) = end else { return Ok(Found::Everywhere) };
        let mut stretches: Vec<(f64, f64)> = Vec::new();
        for part in scan.chunk_by(|a, b| a.1.holds == b.1.holds).filter(|part| part[0].1.holds) {
            let ends = [part[0].0, part[part.len() - 1].0].map(|place| self.at(place));
            stretches.push((ends[0].min(ends[1]), ends[0].max(ends[1])));
        }
        stretches.sort_by(|a, b| a.0.total_cmp(&b.0));
        let places: Vec<f64> = scan.iter().map(|(place, _)| *place).collect();
        self.edge(&places, end, side, stretches, judge).map(Found::Edge)
    }

    /// The edge between a place of the scan where it holds and the next, with trials enough.
    fn edge<E>(
        &self,
        places: &[f64],
        end: usize,
        side: Side,
        stretches: Vec<(f64, f64)>,
        judge: Judge<'_, E>,
    ) -> Result<Edge, E> {
        let mut trials = self.trials;
        loop {
            let mut known: BTreeMap<u64, Verdict> = BTreeMap::new();
            let mut look = |place: f64| -> Result<Verdict, E> {
                let value = self.at(place);
                if let Some(verdict) = known.get(&value.to_bits()) {
                    return Ok(*verdict);
                }
                let none = Verdict { holds: false, surely: false, possibly: false };
                let verdict = judge(value, trials)?.unwrap_or(none);
                known.insert(value.to_bits(), verdict);
                Ok(verdict)
            };
            let [middle, _] = self.turn(places, end, &mut |place| Ok(look(place)?.holds))?;
            // So few trials cannot show it at any value.
            let inner = if trials < self.sure_from {
                places[0]
            } else {
                self.turn(places, end, &mut |place| Ok(look(place)?.surely))?[0]
            };
            // Up to where it was seen not to hold: what lies between was not looked at.
            let [last, next] = self.turn(places, end, &mut |place| Ok(look(place)?.possibly))?;
            let outer = if self.whole { last } else { next };
            let value = self.at(middle);
            let ends = [inner, outer].map(|place| self.at(place));
            let interval = (ends[0].min(ends[1]).min(value), ends[0].max(ends[1]).max(value));
            let width = (interval.1 - interval.0) / value.abs();
            // Whole numbers cannot be told more closely than to one.
            let narrow = width <= self.width || (self.whole && interval.1 - interval.0 <= 1.0);
            if narrow || trials >= self.most {
                return Ok(Edge { side, value, interval, narrow, stretches, trials });
            }
            // An interval narrows with the root of the trials.
            let excess = width / self.width;
            let more = (1.3 * excess * excess).clamp(2.0, 20.0);
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some millions")]
            let next = (trials as f64 * more) as u64;
            trials = next.min(self.most);
        }
    }

    /// Finds where a condition ceases to hold, searching from the place of this number: the last place that was seen to fulfil it, and
    /// the next one that was seen not to. Both are the scan's end if the condition does not change before it.
    fn turn<E>(
        &self,
        places: &[f64],
        end: usize,
        is_true: &mut dyn FnMut(f64) -> Result<bool, E>,
    ) -> Result<[f64; 2], E> {
        // Outwards while it is still true, inwards until it is.
        let mut outside = end;
        while is_true(places[outside])? {
            outside += 1;
            if outside == places.len() {
                return Ok([places[places.len() - 1]; 2]);
            }
        }
        let mut inside = outside;
        loop {
            if inside == 0 {
                return Ok([places[0]; 2]);
            }
            inside -= 1;
            if is_true(places[inside])? {
                break;
            }
            outside = inside;
        }
        let (mut good, mut bad) = (places[inside], places[outside]);
        for _ in 0..60 {
            let middle = (good + bad) / 2.0;
            let [low, at, high] = [good, middle, bad].map(|place| self.at(place));
            if at == low || at == high || (high - low).abs() < 0.1 * self.width * at.abs() {
                break;
            }
            if is_true(middle)? {
                good = middle;
            } else {
                bad = middle;
            }
        }
        Ok([good, bad])
    }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;

    const SEARCH: Search = Search {
        range: (0.01, 100.0),
        points: 17,
        trials: 1000,
        most: 1_000_000,
        sure_from: 0,
        width: 0.05,
        whole: false,
    };

    /// Judges f(value) ≤ 1 with an interval of ± 3/√trials.
    fn judged(search: &Search, f: impl Fn(f64) -> f64) -> Found {
        let mut judge = |value: f64, trials: u64| {
            let half = 3.0 / (trials as f64).sqrt();
            let verdict = |x: f64| x <= 1.0;
            let y = f(value);
            let verdict =
                Verdict { holds: verdict(y), surely: verdict(y + half), possibly: verdict(y - half) };
            Ok::<_, Infallible>(Some(verdict))
        };
        let Ok(found) = search.find(&mut judge);
        found
    }

    fn edge(found: Found) -> Edge {
        let Found::Edge(edge) = found else { panic!("{found:?}") };
        edge
    }

    #[test]
    fn analytic_the_largest_and_the_smallest_value_are_found() {
        let up = edge(judged(&SEARCH, |value| value / 3.0));
        assert_eq!(up.side, Side::Largest);
        assert!((up.value / 3.0 - 1.0).abs() < 0.01 && up.is_monotone(&SEARCH));
        assert!(up.interval.0 <= 3.0 && 3.0 <= up.interval.1 && up.narrow, "{up:?}");
        assert!(up.interval.1 - up.interval.0 <= 0.05 * up.value && up.trials > SEARCH.trials);
        let down = edge(judged(&SEARCH, |value| 3.0 / value));
        assert_eq!(down.side, Side::Smallest);
        assert!((down.value / 3.0 - 1.0).abs() < 0.01 && down.interval.0 <= 3.0 && 3.0 <= down.interval.1);
    }

    #[test]
    fn law_an_interval_holds_an_edge_that_is_known_for_certain() {
        // Without any doubt in the judgements the edge lies between the last value that held and the next that did not.
        for (side, at) in [(Side::Largest, 3.0), (Side::Smallest, 0.3)] {
            let holds = |value: f64| if side == Side::Largest { value <= at } else { value >= at };
            let mut judge = |value: f64, _: u64| {
                let holds = holds(value);
                Ok::<_, Infallible>(Some(Verdict { holds, surely: holds, possibly: holds }))
            };
            let Ok(found) = SEARCH.find(&mut judge);
            let edge = edge(found);
            assert!(holds(edge.value) && edge.side == side);
            assert!(edge.interval.0 <= at && at <= edge.interval.1, "{edge:?}");
        }
    }

    #[test]
    fn law_what_is_not_monotone_says_so() {
        // Holds from 0.1 to 1 and from 10 on, in decades.
        let waves =
            edge(judged(
                &SEARCH,
                |value| if (0.1..1.0).contains(&value) || value > 10.0 { 0.0 } else { 2.0 },
            ));
        assert_eq!(waves.stretches.len(), 2);
        assert!(!waves.is_monotone(&SEARCH));
        let inside = edge(judged(&SEARCH, |value| if (0.1..1.0).contains(&value) { 0.0 } else { 2.0 }));
        assert!(!inside.is_monotone(&SEARCH) && inside.stretches.len() == 1);
    }

    #[test]
    fn law_everywhere_and_nowhere_are_answers() {
        assert_eq!(judged(&SEARCH, |_| 0.5), Found::Everywhere);
        assert_eq!(judged(&SEARCH, |_| 2.0), Found::Nowhere);
    }

    #[test]
    fn law_too_few_trials_are_said() {
        let few = Search { most: 1000, ..SEARCH };
        let edge = edge(judged(&few, |value| value / 3.0));
        assert!(!edge.narrow && edge.interval.0 < 2.9 && edge.interval.1 > 3.1, "{edge:?}");
    }

    #[test]
    fn law_what_too_few_trials_cannot_show_is_not_looked_for() {
        let blind = Search { most: 5000, sure_from: 6000, ..SEARCH };
        let edge = edge(judged(&blind, |value| value / 3.0));
        assert!(!edge.narrow && edge.interval.0 == 0.01 && (edge.value / 3.0 - 1.0).abs() < 0.01, "{edge:?}");
    }

    #[test]
    fn analytic_whole_numbers_stay_whole() {
        let whole = Search { range: (1.0, 24.0), whole: true, ..SEARCH };
        let edge = edge(judged(&whole, |value| 7.5 / value));
        assert_eq!((edge.value, edge.side), (8.0, Side::Smallest));
    }
}
