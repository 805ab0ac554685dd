//! Finds an edge of the stretch in which the limits hold.

use super::{Look, Looks, Search, Side, View};

/// Largest number of trials at all values together, as a multiple of the largest number at one value, while a forecast says that the latter
/// would not make the interval narrow. On a plateau no number does, and each attempt judges some ten values.
const IN_VAIN: u64 = 4;

/// Least number of values of the next attempt for which trials must be left: one attempt can find all its values known already.
const LEAST_VALUES: u64 = 8;

/// An edge of a stretch of values. The limits hold inside the stretch, but not beyond the edge.
#[derive(Clone, Debug, PartialEq)]
pub struct Edge {
    /// End of the stretch at which the edge lies.
    pub side: Side,
    /// Outermost tried value at which the limits hold: the largest one for [`Side::Largest`], the smallest one for [`Side::Smallest`]. In the
    /// key's SI unit.
    pub value: f64,
    /// Lower and upper end of the edge's 95 % interval. The end inside the stretch is `None` if the limits surely hold at no tried value.
    /// The end outside the stretch is `None` if the limits surely fail at no tried value.
    pub interval: [Option<f64>; 2],
    /// True if the interval is as narrow as requested.
    pub narrow: bool,
    /// Number of trials at each of the values that were tried last.
    pub trials: u64,
    /// Approximate number of trials that would make the interval as narrow as requested. None if the interval is narrow already, or if no
    /// forecast number of trials would suffice.
    pub needed: Option<u64>,
    /// Reason why the limits do not hold beyond the edge.
    pub bound: Bound,
}

/// Reason why the limits do not hold beyond an edge.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Bound {
    /// Measures exceed the limits with these indices.
    Limits(Vec<usize>),
    /// Starts without an answer break the limits. The starts with an answer alone would keep them.
    Unanswered,
    /// Values beyond the edge are invalid.
    Refused,
}

/// Positions between which a condition ceases to hold: the last position at which it holds, and the next position, at which it does not.
#[derive(Clone, Copy, Debug)]
struct Turn {
    last: Option<f64>,
    next: Option<f64>,
}

impl Bound {
    fn of(look: Option<&Look>) -> Self {
        let Some(look) = look else { return Self::Refused };
        let broken = look.broken();
        if !broken.is_empty() && broken.iter().all(|k| look.answered[*k] <= 1.0) {
            Self::Unanswered
        } else {
            Self::Limits(broken)
        }
    }
}

impl Search {
    /// Finds the edge between two neighbouring positions. At the first position the limits hold. At the second, which has the index `end`,
    /// they do not. The number of trials is increased until the edge's interval is narrow enough. `places` are ordered from inside the
    /// stretch outwards. None if more trials contradict the scan: the limits hold up to the last position, or at none.
    pub(super) fn edge<E>(
        &self,
        looks: &mut Looks<'_, '_, E>,
        places: &[f64],
        end: usize,
        side: Side,
    ) -> Result<Option<Edge>, E> {
        let mut trials = self.trials;
        loop {
            let before = looks.judged;
            let middle = self.turn(looks, places, end, trials, View::Likely)?;
            let (Some(last), Some(beyond)) = (middle.last, middle.next) else { return Ok(None) };
            let value = self.at(last);
            let foreseen = self.needed(looks, value, side, trials);
            if foreseen.is_some_and(|needed| needed > 2 * trials)
                && let Some(next) = self.more(looks, trials, foreseen, looks.judged - before)
            {
                trials = next;
                continue;
            }
            let inner = if self.may_be_sure(looks, &places[..end], trials)? {
                self.turn(looks, places, end, trials, View::Bad)?.last
            } else {
                None
            };
            // The outer end is a value at which the limits surely fail: values before it were not tried.
            let outer = self.turn(looks, places, end, trials, View::Good)?;
            let outer = if self.whole { outer.next.and(outer.last) } else { outer.next };
            let [inner, outer] = [inner, outer].map(|place| place.map(|place| self.at(place)));
            let interval = match side {
                Side::Largest => [inner.map(|x| x.min(value)), outer.map(|x| x.max(value))],
                Side::Smallest => [outer.map(|x| x.min(value)), inner.map(|x| x.max(value))],
            };
            let narrow = match interval {
                // Whole numbers have no closer neighbours than one.
                [Some(low), Some(high)] => {
                    high - low <= self.width * value.abs() || (self.whole && high - low <= 1.0)
                }
                _ => false,
            };
            let needed = if narrow { None } else { self.needed(looks, value, side, trials) };
            let next = if narrow { None } else { self.more(looks, trials, needed, looks.judged - before) };
            let Some(next) = next else {
                let bound = Bound::of(looks.at(beyond, trials)?);
                return Ok(Some(Edge { side, value, interval, narrow, trials, needed, bound }));
            };
            trials = next;
        }
    }

    /// Returns the number of trials of the next attempt, after an attempt that judged this number of values. `needed` is a forecast of the
    /// number of trials that suffices. None if the edge stays as it is: each value has as many trials as it may have, or the forecast says
    /// that these would not suffice and all values together have had their share.
    fn more<E>(
        &self,
        looks: &Looks<'_, '_, E>,
        trials: u64,
        needed: Option<u64>,
        values: u64,
    ) -> Option<u64> {
        if trials >= self.most {
            return None;
        }
        // A forecast from few trials is a guess, so the next number is limited to sixty times the present one.
        let most = trials.saturating_mul(60);
        let next = needed.map_or(trials * 4, |needed| needed + needed / 10).clamp(2 * trials, most);
        let next = next.max(self.sure_from.saturating_mul(2).min(most)).min(self.most);
        let suffices = needed.is_some_and(|needed| needed <= self.most);
        if suffices || trials < self.sure_from {
            return Some(next);
        }
        let left = self.most.saturating_mul(IN_VAIN).saturating_sub(looks.trials);
        let next = next.min(left / values.max(LEAST_VALUES));
        (next >= 2 * trials).then_some(next)
    }

    /// Returns true if this number of trials shows that the limits surely hold at the most favourable of these positions.
    fn may_be_sure<E>(&self, looks: &mut Looks<'_, '_, E>, places: &[f64], trials: u64) -> Result<bool, E> {
        if trials < self.sure_from {
            return Ok(false);
        }
        let mut best = None;
        for place in places {
            let Some(look) = looks.at(*place, self.trials)? else { continue };
            let high = if look.clear == Some(true) { 0.0 } else { look.foreseen(trials) };
            if best.is_none_or(|(least, _)| high < least) {
                best = Some((high, *place));
            }
        }
        let Some((_, place)) = best else { return Ok(false) };
        Ok(looks.at(place, trials)?.is_some_and(|look| look.holds(View::Bad)))
    }

    /// Finds the position at which the limits, judged by `view`, cease to hold. The search begins at the position with index `end`.
    fn turn<E>(
        &self,
        looks: &mut Looks<'_, '_, E>,
        places: &[f64],
        end: usize,
        trials: u64,
        view: View,
    ) -> Result<Turn, E> {
        // The margin is the logarithm of the largest ratio: up to zero where the limits hold.
        let mut look = |place: f64| -> Result<(bool, f64), E> {
            let look = looks.at(place, trials)?;
            Ok(look.map_or((false, f64::INFINITY), |look| {
                (look.holds(view), standstill_numeric::ln(look.worst(view)))
            }))
        };
        // Go outwards while the condition still holds, then inwards until it holds.
        let mut outside = end;
        let mut bad = loop {
            let Some(place) = places.get(outside) else {
                return Ok(Turn { last: places.last().copied(), next: None });
            };
            let (holds, margin) = look(*place)?;
            if !holds {
                break (*place, margin);
            }
            outside += 1;
        };
        let mut good = loop {
            let Some(inside) = outside.checked_sub(1) else {
                return Ok(Turn { last: None, next: places.first().copied() });
            };
            outside = inside;
            let (holds, margin) = look(places[inside])?;
            if holds {
                break (places[inside], margin);
            }
            bad = (places[inside], margin);
        };
        // Steps that shortened the bracket by less than half.
        let mut slow = 0;
        for _ in 0..60 {
            let [near, far] = [good, bad].map(|(place, _)| self.at(place));
            let (gap, close) = ((far - near).abs(), 0.1 * self.width * near.abs());
            let middle = (good.0 + bad.0) / 2.0;
            let at = self.at(middle);
            if at == near || at == far || gap < close {
                break;
            }
            let apart = bad.0 - good.0;
            let guess = (slow < 2 && !self.whole).then(|| guess(good, bad, apart * close / gap)).flatten();
            let place = guess.unwrap_or(middle);
            let (holds, margin) = look(place)?;
            if holds {
                good = (place, margin);
            } else {
                bad = (place, margin);
            }
            let is_slow = guess.is_some() && (bad.0 - good.0).abs() > 0.5 * apart.abs();
            slow = if is_slow { slow + 1 } else { 0 };
        }
        Ok(Turn { last: Some(good.0), next: Some(bad.0) })
    }
}

/// Estimates the position at which a ratio is 1, by linear interpolation of the ratio's logarithm between two positions. The estimate is
/// shifted towards the farther position, so that the next result is likely to leave a short bracket. A bracket of length `close` is short
/// enough.
fn guess(good: (f64, f64), bad: (f64, f64), close: f64) -> Option<f64> {
    let crossing = -good.1 / (bad.1 - good.1);
    if !(0.0..=1.0).contains(&crossing) || !(bad.1 - good.1).is_finite() || bad.1 == good.1 {
        return None;
    }
    let apart = bad.0 - good.0;
    let aside = if crossing < 0.5 { 0.4 * close } else { -0.4 * close };
    // The ends of the bracket were tried already.
    let [least, most] = [0.4 * close / apart, 1.0 - 0.4 * close / apart];
    let at = (crossing + aside / apart).clamp(least.min(0.5), most.max(0.5));
    Some(good.0 + at * apart)
}
