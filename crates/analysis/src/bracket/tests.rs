//! The search on functions whose edges are known.

mod outcomes;

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

/// Makes the look of measures, as ratios to their limits, with intervals of ± 3/√trials.
fn look(measures: &[f64], trials: u64) -> Look {
    let half = |trials: f64| 3.0 / trials.sqrt();
    let worst = measures.iter().copied().fold(0.0, f64::max);
    let quarter = half(trials as f64 / 4.0);
    let share = |y: &f64| {
        let half = half(trials as f64);
        Estimate { value: *y, low: y - half, high: y + half }
    };
    Look {
        trials,
        shares: measures.iter().map(share).collect(),
        answered: measures.to_vec(),
        forecast: forecast_trials().map(|n| [worst - half(n as f64), worst + half(n as f64)]).collect(),
        clear: if worst - quarter > 1.0 { Some(false) } else { (worst + quarter <= 1.0).then_some(true) },
    }
}

fn judged_by(search: &Search, f: impl Fn(f64) -> Vec<f64>) -> (Found, Vec<(f64, u64)>) {
    let mut asked = Vec::new();
    let mut judge = |value: f64, trials: u64| {
        asked.push((value, trials));
        Ok::<_, Infallible>(Some(look(&f(value), trials)))
    };
    let Ok(found) = search.find(&mut judge);
    (found, asked)
}

fn judged(search: &Search, f: impl Fn(f64) -> f64) -> Found {
    judged_by(search, |value| vec![f(value)]).0
}

fn stretch(found: Found) -> Stretch {
    let Found::Stretch(stretch) = found else { panic!("{found:?}") };
    stretch
}

fn edge(found: Found) -> Edge {
    let mut stretch = stretch(found);
    assert!(stretch.edges.len() == 1 && stretch.is_one(), "{stretch:?}");
    stretch.edges.remove(0)
}

fn ends(edge: &Edge) -> [f64; 2] {
    edge.interval.map(|end| end.expect("closed"))
}

#[test]
fn analytic_the_largest_and_the_smallest_value_are_found() {
    let up = edge(judged(&SEARCH, |value| value / 3.0));
    assert_eq!(up.side, Side::Largest);
    assert!((up.value / 3.0 - 1.0).abs() < 0.01, "{up:?}");
    let [low, high] = ends(&up);
    assert!(low <= 3.0 && 3.0 <= high && up.narrow, "{up:?}");
    assert!(high - low <= 0.05 * up.value && up.trials > SEARCH.trials);
    let down = edge(judged(&SEARCH, |value| 3.0 / value));
    assert_eq!(down.side, Side::Smallest);
    let [low, high] = ends(&down);
    assert!((down.value / 3.0 - 1.0).abs() < 0.01 && low <= 3.0 && 3.0 <= high);
}

#[test]
fn law_an_interval_holds_an_edge_that_is_known_for_certain() {
    // Without any doubt in the judgements the edge lies between the last value that holds and the next one that does not.
    for (side, at) in [(Side::Largest, 3.0), (Side::Smallest, 0.3)] {
        let holds = |value: f64| if side == Side::Largest { value <= at } else { value >= at };
        let edge = edge(judged(&SEARCH, |value| if holds(value) { 0.0 } else { 1e9 }));
        assert!(holds(edge.value) && edge.side == side);
        let [low, high] = ends(&edge);
        assert!(low <= at && at <= high, "{edge:?}");
    }
}

#[test]
fn analytic_what_holds_between_two_values_has_both_edges_and_what_binds_at_each() {
    // Small values break the first limit, large ones the second; the stretch between is wide, or narrower than a step of the scan.
    for (low, high) in [(0.5, 8.0), (0.6, 0.7), (1.02, 1.3)] {
        let (found, _) = judged_by(&SEARCH, |value| vec![low / value, value / high]);
        let found = stretch(found);
        assert!(found.is_one(), "{found:?}");
        for (edge, (truth, limit)) in found.edges.iter().zip([(low, 0), (high, 1)]) {
            let [from, to] = ends(edge);
            assert!(from <= truth && truth <= to && to - from <= 0.05 * truth, "{edge:?}");
            assert!((edge.value / truth - 1.0).abs() < 0.01 && edge.narrow, "{edge:?}");
            assert_eq!(edge.bound, Bound::Limits(vec![limit]));
        }
        assert_eq!(
            found.edges.iter().map(|edge| edge.side).collect::<Vec<_>>(),
            [Side::Smallest, Side::Largest]
        );
    }
    // If one limit holds nowhere, there is no stretch between the values that keep the other.
    assert_eq!(judged_by(&SEARCH, |value| vec![2.0 / value, value]).0, Found::Nowhere);
}

#[test]
fn law_what_binds_may_be_starts_without_an_answer_or_that_a_value_cannot_be() {
    let mut judge = |value: f64, trials: u64| {
        let known = look(&[value / 10.0], trials);
        let lost = Look { answered: vec![value / 10.0], ..look(&[f64::INFINITY], trials) };
        Ok::<_, Infallible>(Some(if value > 1.1 { lost } else { known }))
    };
    let Ok(found) = SEARCH.find(&mut judge);
    assert_eq!(edge(found).bound, Bound::Unanswered);
    // If the second of two neighbouring values is invalid, no edge was seen between them.
    let mut judge =
        |value: f64, trials: u64| Ok::<_, Infallible>((value < 1.1).then(|| look(&[value / 10.0], trials)));
    let Ok(found) = SEARCH.find(&mut judge);
    assert_eq!(found, Found::Everywhere);
}

#[test]
fn law_what_is_not_one_stretch_says_so_where_that_is_sure() {
    // Holds from 0.1 to 1 and from 10 on, in decades.
    let waves = |value: f64| if (0.1..1.0).contains(&value) || value > 10.0 { 0.0 } else { 2.0 };
    assert_eq!(stretch(judged(&SEARCH, waves)).all.len(), 2);
    let inside = stretch(judged(&SEARCH, |value| if (0.1..1.0).contains(&value) { 0.0 } else { 2.0 }));
    assert!(inside.is_one() && inside.edges.len() == 2);
    // A ripple of a hundredth is less than what 16,000 trials tell: 0.024.
    let ripple = |value: f64| value / 3.0 * if (2.0..4.0).contains(&value) { 3.0 / value } else { 1.0 };
    for sign in [-0.01, 0.01] {
        let rippled = |value: f64| ripple(value) + sign * (40.0 * value).cos();
        assert!(stretch(judged(&SEARCH, rippled)).is_one(), "{sign}");
    }
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
    let [low, high] = ends(&edge);
    assert!(!edge.narrow && low < 2.9 && high > 3.1, "{edge:?}");
}

#[test]
fn regress_an_end_that_nothing_shows_is_open() {
    // So few trials cannot show that it holds at any value.
    let blind = Search { most: 5000, sure_from: 6000, ..SEARCH };
    let edge_of = |search: &Search, f: fn(f64) -> f64| edge(judged(search, f));
    let blind = edge_of(&blind, |value| value / 3.0);
    assert!(!blind.narrow && blind.interval[0].is_none() && (blind.value / 3.0 - 1.0).abs() < 0.01);
    // Beyond 3 the measure stays a hundredth above its limit, which 1,000 trials do not tell.
    let plateau = edge_of(&Search { most: 1000, ..SEARCH }, |value| if value > 3.0 { 1.01 } else { 0.1 });
    assert!(plateau.interval[0].is_some() && plateau.interval[1].is_none(), "{plateau:?}");
}

#[test]
fn analytic_whole_numbers_stay_whole() {
    let whole = Search { range: (1.0, 24.0), whole: true, ..SEARCH };
    let edge = edge(judged(&whole, |value| 7.5 / value));
    assert_eq!((edge.value, edge.side), (8.0, Side::Smallest));
}

#[test]
fn analytic_the_trials_that_are_needed_are_those_with_which_the_interval_is_narrow() {
    // Of a measure (x/3)^k known to 3/√n the value is known to ± 3 · 3/(k √n): 5 % wide with n = (6/(0.05 k))².
    for (power, most) in [(1.0, 1000), (2.0, 1000), (0.5, 4000)] {
        let few = Search { most, ..SEARCH };
        let edge = edge(judged(&few, |value: f64| (value / 3.0).powf(power)));
        let truth = (6.0 / (0.05 * power)).powi(2);
        let needed = edge.needed.expect("a value") as f64;
        assert!((0.8..1.25).contains(&(needed / truth)), "{needed} where {truth} are needed");
    }
}

#[test]
fn law_a_look_is_no_longer_than_it_must_be_and_no_value_is_looked_at_twice() {
    let (found, asked) = judged_by(&SEARCH, |value| vec![value / 3.0]);
    let last = edge(found).trials;
    // Only three ends take the most trials, each in a few looks; by bisection alone they would take some twenty.
    let closest = asked.iter().filter(|(_, trials)| *trials == last).count();
    assert!((6..=14).contains(&closest), "{closest} of {asked:?}");
    let mut once: Vec<(u64, u64)> = asked.iter().map(|(value, trials)| (value.to_bits(), *trials)).collect();
    once.sort_unstable();
    once.dedup();
    assert_eq!(once.len(), asked.len());
    // Far from the edges the trials of the scan suffice.
    assert!(asked.iter().all(|(value, trials)| *trials == 1000 || (1.0..9.0).contains(value)), "{asked:?}");
}

#[test]
fn law_trials_that_a_forecast_calls_vain_are_bounded() {
    // Beyond 3 the measure stays so close to its limit that no number of trials tells: 3/√n is 0.003 with the most.
    let plateau = |value: f64| vec![if value > 3.0 { 1.0001 } else { 0.1 }];
    let (found, asked) = judged_by(&SEARCH, plateau);
    let edge = edge(found);
    assert!(!edge.narrow && edge.interval[1].is_none(), "{edge:?}");
    assert!(edge.needed.is_none_or(|needed| needed > SEARCH.most), "{edge:?}");
    // The last look at each value has the most trials.
    let of_values: BTreeMap<u64, u64> =
        asked.iter().map(|(value, trials)| (value.to_bits(), *trials)).collect();
    let all: u64 = of_values.values().sum();
    // An attempt may take more values than the one before, so the bound holds within a half.
    assert!(all < 6 * SEARCH.most, "{all} trials at {} values", of_values.len());
    // If the largest number of trials makes the interval narrow, the bound does not apply.
    let (found, asked) = judged_by(&SEARCH, |value| vec![(value / 3.0).powf(0.15)]);
    assert!(self::edge(found).narrow && asked.iter().any(|(_, trials)| *trials > SEARCH.most / 2));
}
