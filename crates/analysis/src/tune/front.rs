//! The Pareto front of two measures.

use standstill_scenario::FileError;

use super::{Descent, Goal, Judged, Look, Question, Search, View, measured};
use crate::limit::{Limit, Limits};
use crate::require::Bench;
use crate::{Halt, Watch};

/// Number of bounds on the second measure. For each of them, the first measure is minimised with the second below the bound.
const VALUES: usize = 6;

/// Largest number of points that are selected from the Pareto front.
const MOST: usize = 14;

/// Returns settings along the Pareto front, according to the trials of the search. For one bound after the other, the first measure is
/// minimised with the second below the bound (ε-constraint method of V. Chankong and Y. Y. Haimes, "Multiobjective Decision Making", 1983).
pub(super) fn along<E>(
    question: &Question<'_>,
    search: &mut Search<'_, E>,
    best: &[f64],
) -> Result<Vec<Vec<f64>>, E> {
    let trials = question.effort.coarse;
    search.look(best, trials)?;
    let ends = usable(question, &search.looks, trials);
    let second = |look: &Look| look.measured.as_ref().map_or(f64::NAN, |m| m.get(question.against).value);
    let (low, high) = ends
        .iter()
        .map(second)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    for number in 1..=VALUES {
        let most = low + (high - low) * number as f64 / (VALUES + 1) as f64;
        if !(most > low && most < high) {
            break;
        }
        let mut limits = question.goal.limits.0.clone();
        limits.push(Limit { measure: question.against, most });
        let goal = Goal { minimise: question.goal.minimise, limits: Limits(limits) };
        let nearest = usable(question, &search.looks, trials)
            .into_iter()
            .filter(|look| second(look) <= most)
            .min_by(|a, b| merit(question, a).total_cmp(&merit(question, b)));
        let Some(from) = nearest.map(|look| look.values) else { continue };
        let how = Descent { goal: &goal, trials, view: View::Likely, width: 0.12, often: 8 };
        search.wide(&from, &how)?;
    }
    let mut all = usable(question, &search.looks, trials);
    all.sort_by(|a, b| second(a).total_cmp(&second(b)));
    let mut least = f64::INFINITY;
    all.retain(|look| {
        let merit = merit(question, look);
        let better = merit < least;
        least = least.min(merit);
        better
    });
    let count = all.len();
    let places = (0..count.min(MOST)).map(|k| k * count.saturating_sub(1) / (count.min(MOST) - 1).max(1));
    Ok(places.map(|k| all[k].values.clone()).collect())
}

fn merit(question: &Question<'_>, look: &Look) -> f64 {
    look.measured.as_ref().map_or(f64::INFINITY, |m| m.get(question.goal.minimise).value)
}

/// Returns the settings that keep the limits in their results with this number of trials.
fn usable(question: &Question<'_>, looks: &[Look], trials: u64) -> Vec<Look> {
    let keeps = |look: &&Look| {
        let score = question.goal.score(look.measured.as_ref(), View::Likely);
        look.trials == trials && score.broken == 0.0 && score.merit.is_finite()
    };
    looks.iter().filter(keeps).cloned().collect()
}

/// Measures settings on trials with a seed that the search has not used.
pub(super) fn judged(
    bench: &Bench<'_>,
    taken: &Limits,
    settings: Vec<Vec<f64>>,
    seed: u64,
    trials: u64,
    watch: &dyn Watch,
) -> Result<Vec<Judged>, Halt<FileError>> {
    let mut all = Vec::new();
    for values in settings {
        if let Some(tally) = bench.tally(&values, seed, trials, watch)? {
            all.push(Judged { values, measured: measured(taken, &tally) });
        }
    }
    Ok(all)
}

/// Keeps only the settings on the Pareto front and sorts them by the second measure. No other settings are better than these in both
/// measures.
pub(super) fn keep(points: &mut Vec<Judged>, question: &Question<'_>) {
    let of = |judged: &Judged| {
        [question.goal.minimise, question.against].map(|measure| judged.measured.get(measure).value)
    };
    let all: Vec<[f64; 2]> = points.iter().map(of).collect();
    points.retain(|judged| {
        let [a, b] = of(judged);
        !all.iter().any(|[x, y]| (*x <= a && *y < b) || (*x < a && *y <= b))
    });
    points.sort_by(|a, b| of(a)[1].total_cmp(&of(b)[1]));
}
