//! Estimates the number of trials that would make an edge's interval narrow enough.

use standstill_numeric::{exp, ln, whole};
use standstill_quantity::{magnitude, rounded};

use super::{Look, Looks, Search, Side, forecast_trials};

impl Search {
    /// Estimates the number of trials with which the interval of the edge at `value` becomes as narrow as the search asks. None if no
    /// number of [`forecast_trials`] suffices.
    ///
    /// Each tried value forecasts, for more trials, the interval of the largest ratio of a measure to its limit. The interval of the edge
    /// ends where these forecasts, interpolated between the tried values, cross 1.
    pub(super) fn needed<E>(
        &self,
        looks: &Looks<'_, '_, E>,
        value: f64,
        side: Side,
        trials: u64,
    ) -> Option<u64> {
        let seen: Vec<(f64, &Look)> = looks
            .known
            .values()
            // Results of fewer trials count only if they are clear: where it matters, unclear ones were replaced.
            .filter(|(_, asked, look)| {
                *asked >= trials || look.as_ref().is_some_and(|look| look.clear.is_some())
            })
            .filter_map(|(place, _, look)| Some((self.at(*place), look.as_ref()?)))
            .collect();
        let mut inwards: Vec<_> = seen.iter().copied().filter(|(x, _)| is_within(*x, value, side)).collect();
        inwards.sort_by(|a, b| (a.0 - value).abs().total_cmp(&(b.0 - value).abs()));
        let mut outwards: Vec<_> =
            seen.iter().copied().filter(|(x, _)| !is_within(*x, value, side)).collect();
        outwards.sort_by(|a, b| (a.0 - value).abs().total_cmp(&(b.0 - value).abs()));
        let at = *inwards.first()?;
        outwards.insert(0, at);
        let enough = if self.whole { (self.width * value.abs()).max(1.0) } else { self.width * value.abs() };
        let mut before: Option<(f64, f64)> = None;
        for (k, trials_then) in forecast_trials().enumerate() {
            let inner = crossing(&inwards, |look| share(look, k, 1, trials_then), true);
            let outer = crossing(&outwards, |look| share(look, k, 0, trials_then), false);
            let width = match (inner, outer) {
                (Some(inner), Some(outer)) => (outer - inner).abs(),
                _ => f64::INFINITY,
            };
            let count = trials_then as f64;
            if width <= enough {
                let between = before.filter(|(_, wide)| wide.is_finite() && *wide > width);
                let found = between.map_or(count, |(count_before, wide)| {
                    let part = ln(wide / enough) / ln(wide / width);
                    exp(ln(count_before) + part * ln(count / count_before))
                });
                return two_digits(found.max(1.2 * trials as f64));
            }
            before = Some((count, width));
        }
        None
    }
}

/// Returns true if a value lies inside the stretch that ends at this edge.
fn is_within(x: f64, edge: f64, side: Side) -> bool {
    if side == Side::Largest { x <= edge } else { x >= edge }
}

/// Returns an end of the largest ratio's forecast interval after this number of trials. `end` is 0 for the lower end and 1 for the upper.
/// `number` is the index of the forecast. A result that is already clear stays clear.
fn share(look: &Look, number: usize, end: usize, trials: u64) -> f64 {
    match look.clear {
        Some(kept) if trials >= look.trials => {
            let share = look.forecast[number][end];
            if kept { share.min(1.0) } else { share.max(1.0 + 1e-9) }
        }
        _ => look.forecast[number][end],
    }
}

/// Returns the value at which a ratio first crosses 1 on the way through the results. If `falls` is true, the ratio crosses from above,
/// otherwise from below. The value is interpolated between two results. None if the ratio does not cross 1.
fn crossing(looks: &[(f64, &Look)], share: impl Fn(&Look) -> f64, falls: bool) -> Option<f64> {
    let beyond = |share: f64| (share <= 1.0) == falls;
    let number = looks.iter().position(|(_, look)| beyond(share(look)))?;
    let (x, to) = (looks[number].0, share(looks[number].1));
    let Some(before) = number.checked_sub(1) else { return Some(x) };
    let (from_x, from) = (looks[before].0, share(looks[before].1));
    let part = ln(from) / ln(from / to);
    // A ratio of zero or infinity cannot be interpolated: take the middle.
    let part = if part.is_finite() { part.clamp(0.0, 1.0) } else { 0.5 };
    Some(from_x + part * (x - from_x))
}

/// Rounds a number of trials up to two significant digits.
fn two_digits(trials: f64) -> Option<u64> {
    let last = magnitude(trials)? - 1;
    Some(whole(rounded(rounded(trials, -last).ceil(), last)))
}
