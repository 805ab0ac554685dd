//! Importance sampling by a mixture.

use std::convert::Infallible;
use std::sync::atomic::AtomicBool;

use standstill_sim::Draws;

use super::*;
use crate::Function;
use crate::subset::Effort;

static NEVER: AtomicBool = AtomicBool::new(false);

fn quick() -> Settings {
    Settings::of(Effort::Quick, 3)
}

/// States of these draws, of run 0 and 1 by turns.
fn states(
    count: usize,
    purpose: Purpose,
    draw: impl Fn(usize, &mut Draws) -> Vec<f64>,
) -> Vec<(usize, Tape)> {
    let state = |k: usize| {
        let mut tape = Tape::new(7, k as u64);
        let mut draws = Streams::new(11, k as u64).open(Purpose::Design);
        *tape.normals(purpose) = draw(k, &mut draws);
        (k % 2, tape)
    };
    (0..count).map(state).collect()
}

/// Two parts, at three deviations along the one draw and minus three along the other.
fn apart(k: usize, draws: &mut Draws) -> Vec<f64> {
    let [x, y] = [draws.normal() / 2.0, draws.normal() / 2.0];
    if k < 30 { vec![x + 3.0, y] } else { vec![x, y - 3.0] }
}

fn sampled<F: Fn(&[f64]) -> f64 + Sync>(system: &Function<F>, states: Vec<(usize, Tape)>) -> Sampled {
    sample(system, &quick(), states, 2.0, 200.0, &NEVER)
        .unwrap_or_else(|_: Halt<Infallible>| panic!("no trial fails"))
}

#[test]
fn analytic_weights_have_a_mean_of_one_wherever_the_parts_lie() {
    // φ/q has the mean ∫ φ = 1 over draws of q: the probability of an event that always happens.
    let always = sampled(&Function::new(2, |_| 1.0), states(200, Purpose::CurrentGain, apart));
    let error = always.variation();
    assert!(always.effective() > 200.0, "{}", always.effective());
    assert!((always.probability() - 1.0).abs() < 4.0 * error, "{} ± {error}", always.probability());
    // x and y have the same distribution, so the event x > y has a probability of a half.
    let half = sampled(&Function::new(2, |z| z[0] - z[1]), states(200, Purpose::CurrentGain, apart));
    assert!((half.probability() - 0.5).abs() < 4.0 * 0.5 * half.variation(), "{}", half.probability());
    let shares: f64 = half.failures.iter().map(|(share, _)| share).sum();
    assert!((shares - 1.0).abs() < 1e-12 && half.failures.len() > 100, "{shares}");
    // Resampled: the event x > y has the mean 1/√π of x, with a deviation of 0.83 of a state.
    let of = |(share, tape): &(f64, Tape)| share * tape.clone().normals(Purpose::CurrentGain)[0];
    let mean: f64 = half.failures.iter().map(of).sum();
    let expected = 1.0 / std::f64::consts::PI.sqrt();
    assert!((mean - expected).abs() < 4.0 * 0.83 * half.variation(), "{mean} where {expected} is right");
}

#[test]
fn law_parts_are_told_by_direction_and_each_has_its_own_runs() {
    let mut of = states(200, Purpose::CurrentGain, apart);
    let both = Mixture::of(&mut of, 2.0).expect("states");
    assert_eq!((both.parts.len(), &both.lone[..]), (2, &[false; 2][..]));
    let [first, second] = [0, 1].map(|part| both.parts[part].clone());
    for (found, expected) in [(first[0], 3.0), (first[1], 0.0), (second[0], 0.0), (second[1], -3.0)] {
        assert!((found[0] - expected).abs() < 0.5 && (0.4..1.0).contains(&found[1]), "{found:?}");
    }
    for (run, _) in of.iter_mut().take(30) {
        *run = 5;
    }
    assert_eq!(Mixture::of(&mut of, 2.0).expect("states").lone, [true, false]);
    // A chain of the search is a finder beside the run, and alone it is one.
    of[3].0 = SEARCHED + 2;
    assert_eq!(Mixture::of(&mut of, 2.0).expect("states").lone, [false, false]);
    for (run, _) in of.iter_mut().take(30) {
        *run = SEARCHED + 2;
    }
    assert_eq!(Mixture::of(&mut of, 2.0).expect("states").lone, [true, false]);
}

#[test]
fn law_of_hundreds_of_draws_only_those_away_from_chance_move() {
    let moved = |at: usize| {
        let mut of = states(400, Purpose::CurrentNoise, |_, draws| {
            (0..300).map(|k| draws.normal() + if k == at { 0.6 } else { 0.0 }).collect()
        });
        Mixture::of(&mut of, 1.0).expect("states")
    };
    let mixture = moved(7);
    assert_eq!((mixture.parts.len(), mixture.layout.len()), (1, 8), "the rest is left to the tape");
    assert!(mixture.parts[0][..7].iter().all(|draw| *draw == [0.0, 1.0]), "{:?}", mixture.parts[0]);
    assert!((mixture.parts[0][7][0] - 0.6).abs() < 0.2);
    // A hundred draws, each a little narrower than chance could tell: all have one deviation.
    let narrow = |_: usize, draws: &mut Draws| (0..100).map(|_| 0.95 * draws.normal()).collect::<Vec<f64>>();
    let mixture = Mixture::of(&mut states(400, Purpose::CurrentGain, narrow), 1.0).expect("states");
    let deviations: Vec<f64> = mixture.parts[0].iter().map(|[_, deviation]| *deviation).collect();
    assert!(deviations.iter().all(|one| *one == deviations[0]), "{deviations:?}");
    assert!((deviations[0] - 0.95).abs() < 0.02, "{}", deviations[0]);
    // A hundred draws, each shifted by what one alone could not tell.
    let shifted = |_: usize, draws: &mut Draws| (0..100).map(|_| 0.08 + draws.normal()).collect::<Vec<f64>>();
    let mixture = Mixture::of(&mut states(400, Purpose::CurrentGain, shifted), 1.0).expect("states");
    let mean = mixture.parts[0].iter().map(|[mean, _]| mean).sum::<f64>() / 100.0;
    // Means of 0.08 with a variance of 1/400, which is chance.
    let expected = 0.08 * (1.0 - 0.0025 / (0.0064 + 0.0025));
    assert!((mean - expected).abs() < 0.015, "{mean} where {expected} is right");
}

#[test]
fn law_twenty_draws_of_a_specimen_are_searched_and_twenty_one_are_not() {
    let trials = |count: usize| {
        let of = states(100, Purpose::CurrentGain, |_, draws| (0..count).map(|_| draws.normal()).collect());
        let found = sampled(&Function::new(count, |_| 1.0), of);
        found.trials - found.failures.len() as u64
    };
    // One start that shows the draws, eight times a thousand of the mixture; two thousand of twice the spread, and twenty
    // chains of sixty steps.
    assert_eq!(trials(21), 1 + 8000);
    assert_eq!(trials(20), 1 + 8000 + 2000 + 20 * 60);
    // Draws of samples are not counted.
    let of = states(100, Purpose::CurrentNoise, |_, draws| (0..30).map(|_| draws.normal()).collect());
    let found = sampled(&Function::new(30, |_| 1.0).of_samples(), of);
    assert_eq!(found.trials - found.failures.len() as u64, 1 + 8000);
}

#[test]
fn law_a_mixture_that_misses_the_event_ends_early_and_nothing_is_no_answer() {
    let never = sampled(&Function::new(2, |_| -1.0), states(200, Purpose::CurrentGain, apart));
    assert_eq!((never.trials, never.effective(), never.failures.len()), (1 + 2000 + 1000, 0.0, 0));
    let none = sampled(&Function::new(2, |_| -1.0), Vec::new());
    assert_eq!((none.trials, none.parts), (1 + 2000, 0));
}
