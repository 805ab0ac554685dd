//! Reliability problems that others compare methods by: limit-state functions g of the TNO black-box challenge and three more, as
//! openturns/otbenchmark (commit b2b6d0a) lists them; the event is g < 0.
//!
//! The probabilities are those of `tests/cross/reliability/references.py`, to the digits given: closed forms and quadratures. They lie
//! within the errors of the list's own reference values.

use std::f64::consts::{PI, SQRT_2};

use standstill_numeric::{erfc, exp, ln, sin_cos};
use standstill_odds::Function;

/// A problem: its number, its probability, how many standard normals it takes, and −g of them.
#[derive(Clone, Copy, Debug)]
pub struct Problem {
    pub name: &'static str,
    pub probability: f64,
    draws: usize,
    beyond: fn(&[f64]) -> f64,
}

impl Problem {
    pub fn system(&self) -> Function<fn(&[f64]) -> f64> {
        Function::new(self.draws, self.beyond)
    }
}

const fn of(name: &'static str, probability: f64, draws: usize, beyond: fn(&[f64]) -> f64) -> Problem {
    Problem { name, probability, draws, beyond }
}

pub const PROBLEMS: [Problem; 26] = [
    of("RP8", 7.894e-4, 6, rp8),
    of("RP14", 7.727e-4, 5, rp14),
    of("RP22", 4.207_306e-3, 2, |x| (x[0] + x[1]) / SQRT_2 - 2.5 - 0.1 * square(x[0] - x[1])),
    of("RP24", 2.859_946e-3, 2, rp24),
    of("RP25", 4.148_566e-5, 2, |x| (8.0 * x[1] - 16.0 - square(x[0])).min(16.0 * x[0] - x[1] - 32.0)),
    of("RP28", 1.453_295e-7, 2, |x| 146.14 - (78_064.0 + 11_710.0 * x[0]) * (0.0104 + 0.00156 * x[1])),
    of("RP31", 3.226_681e-3, 2, |x| x[1] - 2.0 - 256.0 * square(square(x[0]))),
    of("RP33", 2.575_598e-3, 3, |x| (x[0] + x[1] + x[2] - 3.0 * 3.0_f64.sqrt()).max(x[2] - 3.0)),
    of("RP35", 3.478_946e-3, 2, rp35),
    of("RP38", 8.051e-3, 7, rp38),
    of("RP53", 3.132_049e-2, 2, rp53),
    // Twenty exponential times.
    of("RP54", 9.906_031e-4, 20, |x| 8.951 + x.iter().map(|z| ln(upper_tail(*z))).sum::<f64>()),
    of("RP55", 5.600_144e-1, 2, rp55),
    of("RP57", 2.823_751e-2, 2, rp57),
    of("RP60", 4.483_970e-2, 5, rp60),
    of("RP63", 3.769_436e-4, 100, |x| x[0] + 4.5 - 0.1 * x[1..].iter().map(|x| x * x).sum::<f64>()),
    of("RP75", 9.819_299e-3, 2, |x| x[0] * x[1] - 3.0),
    of("RP77", 2.690_844e-7, 3, rp77),
    of("RP89", 5.471_281e-3, 2, |x| (square(x[0]) + x[1] - 8.0).max(x[0] / 5.0 + x[1] - 6.0)),
    of("RP91", 7.002_537e-4, 5, rp91),
    of("RP107", 2.866_516e-7, 10, |x| x.iter().sum::<f64>() - 5.0 * 10.0_f64.sqrt()),
    of("RP110", 3.195_788e-5, 2, rp110),
    of("RP111", 8.035_086e-7, 2, |x| (x[0] * x[1]).abs() - 12.5),
    of("branches", 2.222_795e-3, 2, four_branches),
    of("R-S", 7.864_960e-2, 2, |x| x[1] - x[0] - 2.0),
    of("beam", 2.919_820e-2, 2, |x| (75_000.0 + 5000.0 * x[1]) / (100.0 * PI) - lognormal(300.0, 30.0, x[0])),
];

fn square(x: f64) -> f64 {
    x * x
}

fn upper_tail(z: f64) -> f64 {
    0.5 * erfc(z / SQRT_2)
}

/// A lognormal quantity of this mean and standard deviation.
fn lognormal(mean: f64, deviation: f64, z: f64) -> f64 {
    let variance = ln(1.0 + square(deviation / mean));
    exp(ln(mean) - variance / 2.0 + variance.sqrt() * z)
}

/// Normal quantities of these means and standard deviations.
fn normals<const N: usize>(of: [(f64, f64); N], z: &[f64]) -> [f64; N] {
    std::array::from_fn(|k| of[k].0 + of[k].1 * z[k])
}

/// A plastic collapse mechanism of a one-bay frame.
fn rp8(z: &[f64]) -> f64 {
    let joint = |k: usize| lognormal(120.0, 12.0, z[k]);
    let loads = 5.0 * lognormal(50.0, 10.0, z[4]) + 5.0 * lognormal(40.0, 8.0, z[5]);
    loads - joint(0) - 2.0 * joint(1) - 2.0 * joint(2) - joint(3)
}

/// A shaft: uniform strength, Gumbel force.
fn rp14(z: &[f64]) -> f64 {
    const EULER: f64 = 0.577_215_664_901_532_9;
    let strength = 70.0 + 10.0 * upper_tail(-z[0]);
    let [diameter, arm, moment] =
        normals([(39.0, 0.1), (400.0, 0.1), (250_000.0, 35_000.0)], &[z[1], z[3], z[4]]);
    let scale = 350.0 * 6.0_f64.sqrt() / PI;
    let force = 1500.0 - scale * (EULER + ln(-ln(upper_tail(-z[2]))));
    let stress =
        32.0 / (PI * diameter * square(diameter)) * (square(force * arm) / 16.0 + square(moment)).sqrt();
    stress - strength
}

fn rp24(z: &[f64]) -> f64 {
    let [x, y] = normals([(10.0, 3.0); 2], z);
    0.2357 * (x - y) - 2.5 - 0.00463 * square(square(x + y - 20.0))
}

fn rp35(x: &[f64]) -> f64 {
    let first = x[1] - 2.0 - exp(-0.1 * square(x[0])) - square(square(0.2 * x[0]));
    first.max(x[0] * x[1] - 4.5)
}

/// Seven normals of a tenth each.
fn rp38(z: &[f64]) -> f64 {
    let mean = [350.0, 50.8, 3.81, 173.0, 9.38, 33.1, 0.036];
    let [a, b, c, d, e, f, g] = normals(mean.map(|mean| (mean, 0.1 * mean)), z);
    let above = square(d) - 4.0 * e * f * square(g) + d * (f + 4.0 * e + 2.0 * f * g);
    a * b * square(b) / (2.0 * c * square(c)) * above / (d * e * (d + f + 2.0 * f * g)) - 155_900.0
}

fn rp53(z: &[f64]) -> f64 {
    let [x, y] = normals([(1.5, 1.0), (2.5, 1.0)], z);
    (square(x) + 4.0) * (y - 1.0) / 20.0 - 2.0 - sin_cos(2.5 * x).0
}

fn rp55(z: &[f64]) -> f64 {
    let d = 2.0 * (upper_tail(-z[0]) - upper_tail(-z[1]));
    (d.abs() / SQRT_2 - 0.2 - 0.6 * square(square(d))).max(d.abs() - 5.0 / SQRT_2 + 2.2)
}

fn rp57(x: &[f64]) -> f64 {
    let both = (square(x[0]) - x[1] * square(x[1]) - 3.0).min(x[0] + 8.0 * x[1] - 2.0);
    both.max(4.0 - square(x[0] + 3.0) - square(x[1] + 3.0))
}

/// A network of five elements with lognormal strengths and load.
fn rp60(z: &[f64]) -> f64 {
    let of = [(2200.0, 220.0), (2100.0, 210.0), (2300.0, 230.0), (2000.0, 200.0), (1200.0, 480.0)];
    let [a, b, c, d, load]: [f64; 5] = std::array::from_fn(|k| lognormal(of[k].0, of[k].1, z[k]));
    let whole = (d - load).max((b - load).min(c - load));
    let half = (b.min(c).min(d)) - load / 2.0;
    load - a.min(load + half.max(whole))
}

fn rp77(z: &[f64]) -> f64 {
    let [a, b, c] = normals([(10.0, 0.5), (0.0, 1.0), (4.0, 1.0)], z);
    if c <= 5.0 { b + c - a } else { b - c }
}

fn rp91(z: &[f64]) -> f64 {
    let of = [(0.07433, 0.005), (0.1, 0.01), (13.0, 60.0), (4751.0, 48.0), (-684.0, 11.0)];
    let [capacity, b, c, d, e] = normals(of, z);
    let first = 0.847 + 0.96 * b + 0.986 * c - 0.216 * d + 0.077 * b * b + 0.11 * c * c + 7.0 / 378.0 * d * d
        - c * b
        - 0.106 * b * d
        - 0.11 * c * d;
    let second = 84_000.0 * capacity / (c * c + d * d - c * d + 3.0 * e * e).sqrt() - 1.0;
    let third = 84_000.0 * capacity / d.abs() - 1.0;
    -first.min(second).min(third)
}

/// Two parts; what leads to the likely one steps down only shortly before it.
fn rp110(x: &[f64]) -> f64 {
    let first = if x[0] <= 3.5 { 0.85 - 0.1 * x[0] } else { 4.0 - x[0] };
    let second = if x[1] <= 2.0 { 2.3 - x[1] } else { 0.5 - 0.1 * x[1] };
    -first.min(second)
}

fn four_branches(x: &[f64]) -> f64 {
    let (sum, difference) = ((x[0] + x[1]) / SQRT_2, (x[0] - x[1]).abs());
    (sum.abs() - 3.0 - 0.1 * square(difference)).max(difference - 7.0 / SQRT_2)
}
