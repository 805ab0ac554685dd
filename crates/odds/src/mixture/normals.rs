//! Mixtures of normal distributions, fitted to states in the event.

use std::collections::BTreeSet;

use standstill_numeric::{exp, ln};
use standstill_sim::{Purpose, Streams, Tape};

use super::{FEW, PARTS, WIDER};
use crate::subset::{Settings, UNREAD, of_samples};

/// Strips of draws, each with its length.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Layout(Vec<(Purpose, String, usize)>);

impl Layout {
    /// Lists all draws of these purposes that any of the tapes has, without the sentinels.
    pub fn of<'t>(tapes: impl Iterator<Item = &'t mut Tape>, takes: impl Fn(Purpose) -> bool) -> Self {
        let mut strips: Vec<(Purpose, String, usize)> = Vec::new();
        for strip in tapes.flat_map(Tape::strips) {
            if strip.purpose == UNREAD || !takes(strip.purpose) {
                continue;
            }
            let known =
                strips.iter_mut().find(|(purpose, name, _)| *purpose == strip.purpose && *name == strip.name);
            match known {
                Some((.., length)) => *length = strip.normals.len().max(*length),
                None => strips.push((strip.purpose, strip.name.clone(), strip.normals.len())),
            }
        }
        Self(strips)
    }

    pub fn len(&self) -> usize {
        self.0.iter().map(|(.., length)| length).sum()
    }

    /// Returns the draws of a tape in the order of the layout; those that it does not have are not numbers.
    fn draws(&self, tape: &mut Tape) -> Vec<f64> {
        let mut draws = Vec::with_capacity(self.len());
        for (purpose, name, length) in &self.0 {
            let strips = tape.strips();
            let found = strips.iter().find(|strip| strip.purpose == *purpose && strip.name == *name);
            let normals = found.map_or(&[][..], |strip| &strip.normals);
            draws.extend_from_slice(&normals[..normals.len().min(*length)]);
            draws.resize(draws.len() + length.saturating_sub(normals.len()), f64::NAN);
        }
        draws
    }
}

/// A mixture of normal distributions of some draws, all with the same weight.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Mixture {
    pub layout: Layout,
    /// Mean and standard deviation of each draw, of each part.
    pub parts: Vec<Vec<[f64; 2]>>,
    /// Parts whose states are all of one run.
    pub lone: Vec<bool>,
}

impl Mixture {
    /// Fits a mixture to states in the event; none without states. `alike`: number of states that count as one
    /// independent state.
    pub fn of(states: &mut [(usize, Tape)], alike: f64) -> Option<Self> {
        let layout = Layout::of(states.iter_mut().map(|(_, tape)| tape), |_| true);
        let mut all = Moments::new(layout.len());
        for (_, tape) in states.iter_mut() {
            all.add(&layout.draws(tape));
        }
        // A draw that few states have is left alone.
        let common: Vec<bool> = all.0.iter().map(|[count, ..]| 2.0 * count > states.len() as f64).collect();
        // Directions are those of draws that are far out; of many, chance makes some.
        let many = common.iter().filter(|common| **common).count() > FEW;
        let chance = if many { 5.0 * (2.0 * alike / states.len() as f64).sqrt() } else { 0.0 };
        let far = |[count, _, squares]: [f64; 3]| squares / count > 1.0 + f64::max(0.5, chance);
        let far: Vec<usize> = (0..layout.len()).filter(|k| common[*k] && far(all.0[*k])).collect();
        let place = |(_, tape): &mut (usize, Tape)| {
            let draws = layout.draws(tape);
            far.iter().map(|k| if draws[*k].is_finite() { draws[*k] } else { 0.0 }).collect()
        };
        let places: Vec<Vec<f64>> = states.iter_mut().map(place).collect();
        let (member, count) = by_direction(&places);
        let mut moments = vec![Moments::new(layout.len()); count];
        let mut runs = vec![BTreeSet::new(); count];
        for ((run, tape), member) in states.iter_mut().zip(member) {
            moments[member].add(&layout.draws(tape));
            runs[member].insert(*run);
        }
        // A chain of the search counts as a run: what one draw of many found, others may have missed.
        let lone = runs.iter().map(|runs| runs.len() == 1).collect();
        let samples: Vec<bool> =
            layout.0.iter().flat_map(|(purpose, _, length)| vec![of_samples(*purpose); *length]).collect();
        let fit = |moments: &Moments| moments.fit(alike, &common, &far, &samples);
        let parts: Vec<Vec<[f64; 2]>> = moments.iter().map(fit).collect();
        (!states.is_empty()).then_some(Self { layout, parts, lone }.shortened())
    }

    /// Leaves the draws to the tape that no part moves, behind the last one of a strip that one does.
    fn shortened(self) -> Self {
        let (mut layout, mut parts) = (Vec::new(), vec![Vec::new(); self.parts.len()]);
        let mut from = 0;
        for (purpose, name, length) in self.layout.0 {
            let moved = |k: &usize| self.parts.iter().any(|part| part[from + k] != [0.0, 1.0]);
            let kept = (0..length).rev().find(moved).map_or(0, |last| last + 1);
            for (short, part) in parts.iter_mut().zip(&self.parts) {
                short.extend_from_slice(&part[from..from + kept]);
            }
            if kept > 0 {
                layout.push((purpose, name, kept));
            }
            from += length;
        }
        Self { layout: Layout(layout), parts, lone: self.lone }
    }

    /// Returns the draw of this number, its weight (the ratio of densities of the standard normals and the mixture), and
    /// the part that is densest there.
    pub fn draw(&self, settings: &Settings, run: u32, number: usize) -> (Tape, f64, usize) {
        let mut tape = Tape::new(settings.seed, Settings::key(run, 0, number, 0));
        let keys = Streams::new(settings.seed, Settings::key(run, 4, number, 0));
        let mut draws = keys.open_named(Purpose::Design, "mixture");
        let part = usize::try_from(draws.integer(self.parts.len() as u64 - 1)).unwrap_or(0);
        let z: Vec<f64> =
            self.parts[part].iter().map(|[mean, deviation]| mean + deviation * draws.normal()).collect();
        let mut rest = &z[..];
        for (purpose, name, length) in &self.layout.0 {
            let (some, more) = rest.split_at(*length);
            tape.normals_named(*purpose, name).extend_from_slice(some);
            rest = more;
        }
        let (weight, part) = self.weight(&z);
        (tape, weight, part)
    }

    fn weight(&self, z: &[f64]) -> (f64, usize) {
        let log = |part: &Vec<[f64; 2]>| {
            let one = |(z, [mean, deviation]): (&f64, &[f64; 2])| {
                let y = (z - mean) / deviation;
                (z * z - y * y) / 2.0 - ln(*deviation)
            };
            z.iter().zip(part).map(one).sum::<f64>()
        };
        let logs: Vec<f64> = self.parts.iter().map(log).collect();
        let densest = largest(logs.iter().copied());
        let sum = logs.iter().map(|log| exp(log - logs[densest])).sum::<f64>();
        (exp(-logs[densest]) * self.parts.len() as f64 / sum, densest)
    }
}

/// Returns the place of the largest of these numbers.
fn largest(numbers: impl Iterator<Item = f64>) -> usize {
    let best = numbers.enumerate().max_by(|(_, one), (_, other)| one.total_cmp(other));
    best.map_or(0, |(place, _)| place)
}

/// Sorts states into parts by their directions from the centre: each to the part with the nearest mean direction, or to a
/// new one if none is within 45°. Returns the part of each state, and the number of parts.
fn by_direction(places: &[Vec<f64>]) -> (Vec<usize>, usize) {
    const NEAR: f64 = 0.7;
    if places.first().is_none_or(Vec::is_empty) {
        return (vec![0; places.len()], 1);
    }
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let nearest = |sums: &[Vec<f64>], x: &[f64]| {
        let cosine = |sum: &Vec<f64>| dot(sum, x) / (dot(sum, sum) * dot(x, x)).sqrt();
        let cosines: Vec<f64> = sums.iter().map(cosine).collect();
        let part = largest(cosines.iter().copied());
        (part, cosines.get(part).copied().unwrap_or(0.0))
    };
    let mut sums: Vec<Vec<f64>> = Vec::new();
    let add = |sum: &mut Vec<f64>, x: &[f64]| sum.iter_mut().zip(x).for_each(|(sum, x)| *sum += x);
    for x in places {
        let (part, cosine) = nearest(&sums, x);
        if sums.is_empty() || (cosine < NEAR && sums.len() < PARTS) {
            sums.push(x.clone());
        } else {
            add(&mut sums[part], x);
        }
    }
    // Once more, by the parts' directions as they are with all states.
    let member: Vec<usize> = places.iter().map(|x| nearest(&sums, x).0).collect();
    let mut numbers: Vec<usize> = member.clone();
    numbers.sort_unstable();
    numbers.dedup();
    let number = |part| numbers.binary_search(part).unwrap_or(0);
    (member.iter().map(number).collect(), numbers.len())
}

/// Number, sum and sum of squares of each draw.
#[derive(Clone, Debug, PartialEq)]
struct Moments(Vec<[f64; 3]>);

impl Moments {
    fn new(count: usize) -> Self {
        Self(vec![[0.0; 3]; count])
    }

    fn add(&mut self, draws: &[f64]) {
        for (sum, x) in self.0.iter_mut().zip(draws).filter(|(_, x)| x.is_finite()) {
            *sum = [sum[0] + 1.0, sum[1] + x, sum[2] + x * x];
        }
    }

    /// Returns mean and standard deviation of each draw in a part.
    fn fit(&self, alike: f64, common: &[bool], far: &[usize], samples: &[bool]) -> Vec<[f64; 2]> {
        /// Least standard deviation.
        const LEAST: f64 = 0.2;
        /// Bound of chance in standard deviations.
        const CHANCE: f64 = 4.0;
        let few = common.iter().filter(|common| **common).count() <= FEW;
        let mut fitted = vec![[0.0, 1.0]; self.0.len()];
        let (mut alone, mut rest) = (Vec::new(), [Vec::new(), Vec::new()]);
        for k in (0..self.0.len()).filter(|k| common[*k] && self.0[*k][0] > 0.0) {
            let [count, sum, squares] = self.0[k];
            let (mean, independent) = (sum / count, (count / alike).max(1.0));
            let variance = (squares / count - mean * mean).max(0.0);
            fitted[k] = [mean, variance];
            let chance = CHANCE / independent.sqrt();
            if few
                || far.contains(&k)
                || mean.abs() > chance
                || (variance - 1.0).abs() > chance * 2.0_f64.sqrt()
            {
                alone.push((k, independent));
            } else {
                rest[usize::from(samples[k])].push((k, independent));
            }
        }
        let wider = if alone.len() <= FEW { WIDER } else { 1.0 };
        for (k, independent) in alone {
            // Shrunk towards the variance before the event was known, as one state more would.
            let variance = (independent * fitted[k][1] + 1.0) / (independent + 1.0);
            fitted[k][1] = (wider * variance.sqrt()).max(LEAST);
        }
        for rest in rest {
            let count = rest.len() as f64;
            let mean_of = |of: &dyn Fn(usize) -> f64| rest.iter().map(|(k, _)| of(*k)).sum::<f64>() / count;
            let independent = rest.iter().map(|(_, n)| n).sum::<f64>() / count;
            let squares = mean_of(&|k| fitted[k][0] * fitted[k][0]);
            let explained = 1.0 / (independent * squares);
            let kept = if explained < 2.0 / 3.0 { 1.0 - explained } else { 0.0 };
            let variance = mean_of(&|k| fitted[k][1]) + (1.0 - kept) * squares;
            let clear = (variance - 1.0).abs() > CHANCE * (2.0 / (independent * count)).sqrt();
            let deviation = if clear { variance.sqrt().max(LEAST) } else { 1.0 };
            for (k, _) in &rest {
                fitted[*k] = [kept * fitted[*k][0], deviation];
            }
        }
        fitted
    }
}
