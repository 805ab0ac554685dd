//! The search: settings that were tried, and the choice of the next ones.
//!
//! The optimiser is COBYLA (M. J. D. Powell, "A direct search optimization method that models the objective and
//! constraint functions by linear interpolation", 1994, doi:10.1007/978-94-015-8330-5_4) of the crate `cobyla`: it
//! needs no derivatives, has constraints, and its simplices are wide at first, so that the noise remaining with common
//! random numbers does not mislead it. It does not support integers: settings are rounded, and afterwards each integer
//! is moved by 1 as long as that helps, while the other keys are searched anew.

use std::cell::RefCell;
use std::collections::HashMap;

use cobyla::{Func, RhoBeg, StopTols, minimize};

use super::{Goal, Measured, Range, Score, View};

/// Tried settings with their results.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    /// Values of the keys in SI, in the order of the ranges.
    pub values: Vec<f64>,
    /// Number of trials.
    pub trials: u64,
    /// Estimates of the measures. None if the values are invalid.
    pub measured: Option<Measured>,
}

/// Function that measures settings. Its arguments are the values of the keys and the number of trials. It returns none if the values are
/// invalid.
pub type Taker<'a, E> = &'a mut dyn FnMut(&[f64], u64) -> Result<Option<Measured>, E>;

/// State of a search, with all settings tried so far.
pub struct Search<'a, E> {
    ranges: &'a [Range],
    take: Taker<'a, E>,
    /// All tried settings. Settings that were tried with different numbers of trials have an entry for each number.
    pub looks: Vec<Look>,
    known: HashMap<(Vec<u64>, u64), usize>,
}

/// Parameters of a descent, which is a search that moves from given settings to better ones.
#[derive(Clone, Copy, Debug)]
pub struct Descent<'a> {
    /// Measure to be minimised, and limits to be kept.
    pub goal: &'a Goal,
    /// Number of trials per setting.
    pub trials: u64,
    /// Value of the confidence intervals that is compared with the limits.
    pub view: View,
    /// Initial size of the trust region, as a share of the ranges.
    pub width: f64,
    /// Number of evaluations per key whose value the descent varies.
    pub often: usize,
}

impl<'a, E> Search<'a, E> {
    /// Makes a search without results.
    pub fn new(ranges: &'a [Range], take: Taker<'a, E>) -> Self {
        Self { ranges, take, looks: Vec::new(), known: HashMap::new() }
    }

    /// Measures settings unless they were measured before with this number of trials. Returns their index in [`Self::looks`].
    ///
    /// # Errors
    /// Errors of the function that measures settings.
    pub fn look(&mut self, values: &[f64], trials: u64) -> Result<usize, E> {
        let place = (values.iter().map(|value| value.to_bits()).collect(), trials);
        if let Some(number) = self.known.get(&place) {
            return Ok(*number);
        }
        let measured = (self.take)(values, trials)?;
        self.looks.push(Look { values: values.to_vec(), trials, measured });
        self.known.insert(place, self.looks.len() - 1);
        Ok(self.looks.len() - 1)
    }

    /// Returns the score of settings. They are measured if they were not measured before.
    fn score(&mut self, values: &[f64], how: &Descent<'_>) -> Result<Score, E> {
        let number = self.look(values, how.trials)?;
        Ok(how.goal.score(self.looks[number].measured.as_ref(), how.view))
    }

    /// Searches for better values of the keys with the indices `free`. Returns the values of all keys. They are no worse than the initial
    /// values `from`.
    fn move_free(&mut self, from: &[f64], free: &[usize], how: &Descent<'_>) -> Result<Vec<f64>, E> {
        let began = self.looks.len();
        let mut best = (self.score(from, how)?, from.to_vec());
        if free.is_empty() {
            return Ok(best.1);
        }
        let ranges = self.ranges;
        let values = |places: &[f64]| {
            let mut values = from.to_vec();
            for (key, place) in free.iter().zip(places) {
                values[*key] = ranges[*key].at(*place);
            }
            values
        };
        let first: Vec<f64> = free.iter().map(|key| ranges[*key].place(from[*key])).collect();
        let state = RefCell::new((&mut *self, None));
        let view = |places: &[f64]| {
            let (search, failed) = &mut *state.borrow_mut();
            // After an error nothing more is measured; the optimiser then ends at its largest number of evaluations.
            let number = if failed.is_some() { None } else { Some(search.look(&values(places), how.trials)) };
            let measured = match number {
                Some(Ok(number)) => search.looks[number].measured.as_ref(),
                Some(Err(error)) => {
                    *failed = Some(error);
                    None
                }
                None => None,
            };
            how.goal.view(measured, how.view)
        };
        // All constraints have one type, because the crate tells functions apart by their types.
        let objective = |places: &[f64], (): &mut ()| view(places).0;
        let left = |limit: usize| move |places: &[f64], (): &mut ()| view(places).1[limit];
        let lefts: Vec<_> = (0..how.goal.limits.0.len()).map(left).collect();
        let limits: Vec<&dyn Func<()>> = lefts.iter().map(|left| left as &dyn Func<()>).collect();
        let ends = StopTols { xtol_abs: vec![0.02 * how.width; free.len()], ..StopTols::default() };
        let bounds = vec![(0.0, 1.0); free.len()];
        // The result is not used: it is the last point that the optimiser accepted. The best of all points counts, and all are stored.
        let _ = minimize::<&dyn Func<()>, &dyn Func<()>, ()>(
            &objective,
            &first,
            &bounds,
            &limits,
            (),
            how.often * free.len() + 3,
            RhoBeg::All(how.width),
            Some(ends),
        );
        let (_, failed) = state.into_inner();
        if let Some(error) = failed {
            return Err(error);
        }
        for look in self.looks[began..].iter().filter(|look| look.trials == how.trials) {
            let score = how.goal.score(look.measured.as_ref(), how.view);
            if score.beats(&best.0) {
                best = (score, look.values.clone());
            }
        }
        Ok(best.1)
    }

    /// Searches for better values of all keys together. Values of keys that take whole numbers are rounded. Returns the best values, which
    /// are no worse than `from`.
    ///
    /// # Errors
    /// Errors of the function that measures settings.
    pub fn wide(&mut self, from: &[f64], how: &Descent<'_>) -> Result<Vec<f64>, E> {
        let all: Vec<usize> = (0..self.ranges.len()).collect();
        self.move_free(from, &all, how)
    }

    /// Changes each whole number by 1 in both directions as long as that helps. The other keys are searched anew after each change. Returns
    /// the best values, which are no worse than `from`.
    ///
    /// # Errors
    /// Errors of the function that measures settings.
    pub fn close(&mut self, from: &[f64], how: &Descent<'_>) -> Result<Vec<f64>, E> {
        let ranges = self.ranges;
        let free: Vec<usize> = (0..ranges.len()).filter(|key| !ranges[*key].whole).collect();
        let mut best = self.move_free(from, &free, how)?;
        let steps =
            (0..ranges.len()).filter(|key| ranges[*key].whole).flat_map(|key| [(key, 1.0), (key, -1.0)]);
        let steps: Vec<(usize, f64)> = steps.collect();
        let (mut next, mut missed) = (0, 0);
        while missed < steps.len() {
            let (key, by) = steps[next % steps.len()];
            let mut there = best.clone();
            there[key] = (there[key] + by).clamp(ranges[key].low, ranges[key].high);
            let moved = there != best && {
                let there = self.move_free(&there, &free, how)?;
                let better = self.score(&there, how)?.beats(&self.score(&best, how)?);
                if better {
                    best = there;
                }
                better
            };
            // A step that helped is tried again.
            if moved {
                missed = 0;
            } else {
                (next, missed) = (next + 1, missed + 1);
            }
        }
        Ok(best)
    }
}
