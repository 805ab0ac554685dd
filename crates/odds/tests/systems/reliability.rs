//! Reliability problems that others compare methods by: limit-state functions g of the TNO black-box challenge as
//! openturns/otbenchmark lists them by number; the event is g < 0.
//!
//! The probabilities are those of quadratures of ours, to the digits given; they agree with the listed ones to theirs.

use std::convert::Infallible;

use standstill_odds::System;
use standstill_sim::{Purpose, Streams, Tape};

/// A problem: its number, its probability, how many standard normals it takes, and −g of them.
#[derive(Clone, Copy, Debug)]
pub struct Problem {
    pub name: &'static str,
    pub probability: f64,
    draws: usize,
    beyond: fn(&[f64]) -> f64,
}

/// Parabola, product, quartic valley, two branches, a hundred draws of which 99 hold back, and an ellipse under load.
pub const PROBLEMS: [Problem; 6] = [
    Problem {
        name: "RP22",
        probability: 4.207_305e-3,
        draws: 2,
        beyond: |x| (x[0] + x[1]) / std::f64::consts::SQRT_2 - 2.5 - 0.1 * (x[0] - x[1]) * (x[0] - x[1]),
    },
    Problem {
        name: "RP31",
        probability: 3.226_681e-3,
        draws: 2,
        beyond: |x| x[1] - 2.0 - 256.0 * x[0] * x[0] * x[0] * x[0],
    },
    Problem { name: "RP35", probability: RP35, draws: 2, beyond: rp35 },
    Problem { name: "RP63", probability: RP63, draws: 100, beyond: rp63 },
    Problem { name: "RP75", probability: 9.819_299e-3, draws: 2, beyond: |x| x[0] * x[1] - 3.0 },
    Problem { name: "RP91", probability: RP91, draws: 5, beyond: rp91 },
];

const RP35: f64 = 3.478_946e-3;
const RP63: f64 = 3.769_436e-4;
const RP91: f64 = 7.002_535e-4;

fn rp35(x: &[f64]) -> f64 {
    let (square, fifth) = (x[0] * x[0], 0.2 * x[0]);
    let first = x[1] - 2.0 - standstill_numeric::exp(-0.1 * square) - fifth * fifth * fifth * fifth;
    first.max(x[0] * x[1] - 4.5)
}

fn rp63(x: &[f64]) -> f64 {
    x[0] + 4.5 - 0.1 * x[1..].iter().map(|x| x * x).sum::<f64>()
}

fn rp91(z: &[f64]) -> f64 {
    let of = [(0.07433, 0.005), (0.1, 0.01), (13.0, 60.0), (4751.0, 48.0), (-684.0, 11.0)];
    let x: [f64; 5] = std::array::from_fn(|k| of[k].0 + of[k].1 * z[k]);
    let [capacity, b, c, d, e] = x;
    let first = 0.847 + 0.96 * b + 0.986 * c - 0.216 * d + 0.077 * b * b + 0.11 * c * c + 7.0 / 378.0 * d * d
        - c * b
        - 0.106 * b * d
        - 0.11 * c * d;
    let second = 84_000.0 * capacity / (c * c + d * d - c * d + 3.0 * e * e).sqrt() - 1.0;
    let third = 84_000.0 * capacity / d.abs() - 1.0;
    -first.min(second).min(third)
}

impl System for Problem {
    type Error = Infallible;

    fn values(&self, tapes: &[Tape]) -> Result<Vec<f64>, Infallible> {
        let value = |tape| {
            let mut draws = Streams::taped(tape).open(Purpose::CurrentGain);
            let x: Vec<f64> = (0..self.draws).map(|_| draws.normal()).collect();
            (self.beyond)(&x)
        };
        Ok(tapes.iter().map(value).collect())
    }
}
