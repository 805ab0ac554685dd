//! Sobol' indices of functions that others compare methods by, as openturns/otbenchmark (commit b2b6d0a) defines them: closed forms of
//! all but the borehole, whose indices are those of `tests/cross/sensitivity/borehole.py`.

use std::f64::consts::{PI, TAU};

use rayon::prelude::*;
use standstill_analysis::sobol::{Shares, Tuple};
use standstill_numeric::erfc;
use standstill_sim::{Draws, Purpose, Streams};

/// A function of independent quantities.
struct Function {
    name: &'static str,
    /// Draws its quantities.
    draw: fn(&mut Draws<'_>) -> Vec<f64>,
    /// Its value less its mean.
    of: fn(&[f64]) -> f64,
    first: Vec<f64>,
    total: Vec<f64>,
}

fn uniform(draws: &mut Draws<'_>, low: f64, high: f64) -> f64 {
    // By the normal, as draws of a specimen are.
    low + (high - low) * 0.5 * erfc(-draws.normal() / 2.0_f64.sqrt())
}

const A: [f64; 3] = [0.0, 9.0, 99.0];
const SLOPES: [f64; 3] = [1.0, 2.0, 3.0];
const MEANS: [f64; 3] = [1.0, -1.5, 2.0];

fn functions() -> Vec<Function> {
    // Ishigami with a = 7, b = 0.1.
    let (a, b) = (7.0, 0.1);
    let (fourth, eighth) = (PI.powi(4), PI.powi(8));
    let (one, two, three) =
        (0.5 * (1.0 + b * fourth / 5.0).powi(2), a * a / 8.0, 8.0 / 225.0 * b * b * eighth);
    let all = one + two + three;
    let ishigami = Function {
        name: "Ishigami",
        draw: |draws| (0..3).map(|_| uniform(draws, -PI, PI)).collect(),
        of: |x| x[0].sin() * (1.0 + 0.1 * x[2].powi(4)) + 7.0 * x[1].sin().powi(2) - 3.5,
        first: vec![one / all, two / all, 0.0],
        total: vec![(one + three) / all, two / all, three / all],
    };
    // Sobol's g: each factor has a mean of 1.
    let each = A.map(|a| 1.0 / 3.0 / (1.0 + a) / (1.0 + a));
    let whole = each.iter().map(|v| 1.0 + v).product::<f64>() - 1.0;
    let g = Function {
        name: "G",
        draw: |draws| (0..3).map(|_| uniform(draws, 0.0, 1.0)).collect(),
        of: |x| x.iter().zip(A).map(|(x, a)| ((4.0 * x - 2.0).abs() + a) / (1.0 + a)).product::<f64>() - 1.0,
        first: each.map(|v| v / whole).to_vec(),
        total: each.map(|v| v / (1.0 + v) * (1.0 + whole) / whole).to_vec(),
    };
    let squares: f64 = SLOPES.iter().map(|a| a * a).sum();
    let sum = Function {
        name: "sum of normals",
        draw: |draws| (0..3).map(|_| draws.normal()).collect(),
        of: |x| x.iter().zip(SLOPES).map(|(x, a)| a * x).sum(),
        first: SLOPES.map(|a| a * a / squares).to_vec(),
        total: SLOPES.map(|a| a * a / squares).to_vec(),
    };
    // Each of a standard deviation of 1.
    let variance =
        MEANS.iter().map(|m| m * m + 1.0).product::<f64>() - MEANS.iter().map(|m| m * m).product::<f64>();
    let others = |of: &dyn Fn(f64) -> f64| {
        let without = |k: usize| MEANS.iter().enumerate().filter(move |(j, _)| *j != k).map(|(_, m)| of(*m));
        (0..3).map(|k| without(k).product::<f64>() / variance).collect()
    };
    let product = Function {
        name: "product of normals",
        draw: |draws| MEANS.iter().map(|mean| mean + draws.normal()).collect(),
        of: |x| x.iter().product::<f64>() - MEANS.iter().product::<f64>(),
        first: others(&|m| m * m),
        total: others(&|m| m * m + 1.0),
    };
    let borehole = Function {
        name: "borehole",
        draw: |draws| {
            let radius = 0.1 + 0.016_181_2 * draws.normal();
            let influence = (7.71 + 1.0056 * draws.normal()).exp();
            let ranges = [
                (63_070.0, 115_600.0),
                (990.0, 1110.0),
                (63.1, 116.0),
                (700.0, 820.0),
                (1120.0, 1680.0),
                (9855.0, 12_045.0),
            ];
            let rest = ranges.map(|(low, high)| uniform(draws, low, high));
            [radius, influence].into_iter().chain(rest).collect()
        },
        of: |x| {
            let [radius, influence, upper, head, lower, other, length, conductivity] = x else {
                return f64::NAN;
            };
            let ln = (influence / radius).ln();
            let lost = 1.0 + 2.0 * length * upper / (ln * radius * radius * conductivity) + upper / lower;
            TAU * upper * (head - other) / (ln * lost) - BOREHOLE_MEAN
        },
        first: BOREHOLE[0].to_vec(),
        total: BOREHOLE[1].to_vec(),
    };
    vec![ishigami, g, sum, product, borehole]
}

const BOREHOLE_MEAN: f64 = 73.738_94;
/// First-order and total indices.
const BOREHOLE: [[f64; 8]; 2] = [
    [0.663_73, 0.0, 0.0, 0.094_88, 0.000_01, 0.094_88, 0.090_64, 0.021_93],
    [0.694_14, 0.0, 0.0, 0.106_12, 0.000_01, 0.106_12, 0.102_78, 0.025_13],
];

/// Pairs of samples, as `budget` makes them, one after the other.
fn tuples(of: &Function, seed: u64, pairs: u64) -> Vec<Tuple> {
    let pair = |pair| {
        let draw =
            |sample: u64| (of.draw)(&mut Streams::new(seed, sample << 40 | pair).open(Purpose::Design));
        let (a, b) = (draw(0), draw(1));
        let mixed = (0..a.len()).map(|k| {
            let mut mixed = a.clone();
            mixed[k] = b[k];
            (of.of)(&mixed)
        });
        Tuple { a: (of.of)(&a), b: (of.of)(&b), mixed: mixed.collect() }
    };
    (0..pairs).map(pair).collect()
}

#[test]
fn analytic_indices_of_known_functions_lie_in_their_intervals() {
    let (seeds, pairs) = (50, 1000);
    for function in functions() {
        let sources = function.first.len();
        let shares: Vec<Shares> = (1..=seeds)
            .into_par_iter()
            .map(|seed| Shares::of(&tuples(&function, seed, pairs), sources))
            .collect();
        let (mut held, mut count, mut squares) = (0, 0, 0.0);
        for share in &shares {
            let found = share.first.iter().chain(&share.total);
            for (estimate, truth) in found.zip(function.first.iter().chain(&function.total)) {
                // An index of zero that no pair shows has no width.
                let [low, high] = [estimate.low - 1e-4, estimate.high + 1e-4];
                held += u32::from(low <= *truth && *truth <= high);
                count += 1;
                squares += (estimate.value - truth).powi(2);
            }
        }
        let (share, rms) = (f64::from(held) / f64::from(count), (squares / f64::from(count)).sqrt());
        println!(
            "{}: {held} of {count} intervals hold, rms error {rms:.4} with {pairs} pairs",
            function.name
        );
        // 95 of 100; the indices of one sample are not independent, so the count scatters as that of a third of them.
        let least = 0.95 - 3.0 * (0.95 * 0.05 / (f64::from(count) / 3.0)).sqrt();
        assert!(share >= least, "{}: {held} of {count}", function.name);
        // Without bias: the mean over all seeds.
        for k in 0..sources {
            let mean = shares.iter().map(|share| share.first[k].value).sum::<f64>() / shares.len() as f64;
            let truth = function.first[k];
            assert!((mean - truth).abs() < 0.03, "{}, {k}: {mean} where {truth} is right", function.name);
            let mean = shares.iter().map(|share| share.total[k].value).sum::<f64>() / shares.len() as f64;
            let truth = function.total[k];
            assert!((mean - truth).abs() < 0.02, "{}, {k}: {mean} where {truth} is right", function.name);
        }
    }
}
