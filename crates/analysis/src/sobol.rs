//! Sobol' indices of a mean square error by the pick-freeze method.
//!
//! Two samples A and B of the draws share the quantity that is held common (here the rotor's angle). For each source there is a
//! third sample: A with the draws of that source from B. With the error e, and all means over the draws:
//!
//! ```text
//!   mean square                     E e²                    = E (e_A² + e_B²)/2
//!   common: the method's own bias   E_θ[E(e|θ)²]            = E e_A e_B
//!   first order of source i         E_θ[Var E(e|θ,u_i)]     = E e_B (e_ABi − e_A)      (Saltelli 2010)
//!   total of source i               E_θ[E Var(e|θ,u_≠i)]    = E (e_A − e_ABi)²/2       (Jansen 1999)
//! ```
//! Saltelli et al. 2010, doi:10.1016/j.cpc.2009.09.018. The mean square less first orders and common part is the sources'
//! interaction. Intervals are those of ratios of means, linearised.

use standstill_campaign::{Estimate, student};
use standstill_numeric::power;

/// Errors of two simulated motor starts, A and B, at the same rotor angle, and of the mixed starts. Mixed start i has the random draws of
/// source i from B and all others from A.
#[derive(Clone, Debug, PartialEq)]
pub struct Tuple {
    /// Error e_A of the start in sample A.
    pub a: f64,
    /// Error e_B of the start in sample B.
    pub b: f64,
    /// Errors e_ABi of the mixed starts, one per source.
    pub mixed: Vec<f64>,
}

/// Shares of the mean square, each with its 95 % interval.
#[derive(Clone, Debug, PartialEq)]
pub struct Shares {
    /// The mean square error, in the square of the errors' unit.
    pub mean_square: Estimate,
    /// Share of the method's own error: the part of the error that is the same for all random draws at a rotor angle.
    pub common: Estimate,
    /// First-order index of each source.
    pub first: Vec<Estimate>,
    /// Total index of each source.
    pub total: Vec<Estimate>,
    /// Share of the part of the error that the sources cause only together, by interaction.
    pub interaction: Estimate,
}

impl Tuple {
    fn square(&self) -> f64 {
        (self.a * self.a + self.b * self.b) / 2.0
    }

    fn common(&self) -> f64 {
        self.a * self.b
    }

    /// Returns the term e_B (e_ABi − e_A) of a source's first-order index. Subtracting e_A makes the estimate less noisy than e_B e_ABi
    /// alone. The same term with A and B exchanged would add information, but it is not computed.
    fn first(&self, source: usize) -> f64 {
        self.b * (self.mixed[source] - self.a)
    }

    fn total(&self, source: usize) -> f64 {
        power(self.a - self.mixed[source], 2) / 2.0
    }

    fn interaction(&self) -> f64 {
        let first: f64 = (0..self.mixed.len()).map(|source| self.first(source)).sum();
        self.square() - self.common() - first
    }
}

impl Shares {
    /// Computes the shares from independent tuples. `sources` is the number of sources, and so of mixed errors in a tuple.
    pub fn of(tuples: &[Tuple], sources: usize) -> Self {
        let ratio =
            |of: &dyn Fn(&Tuple) -> f64| ratio(tuples.iter().map(|tuple| (of(tuple), tuple.square())));
        Self {
            mean_square: self::ratio(tuples.iter().map(|tuple| (tuple.square(), 1.0))),
            common: ratio(&Tuple::common),
            first: (0..sources).map(|source| ratio(&|tuple| tuple.first(source))).collect(),
            total: (0..sources).map(|source| ratio(&|tuple| tuple.total(source))).collect(),
            interaction: ratio(&Tuple::interaction),
        }
    }
}

/// Parts of the mean square error, in the square of the errors' unit. The estimate of a part that is nearly zero may be negative.
#[derive(Clone, Debug, PartialEq)]
pub struct Squares {
    /// Mean square of the whole error.
    pub all: Estimate,
    /// Mean square of the method's own error: the part of the error that is the same for all random draws at a rotor angle.
    pub common: Estimate,
    /// Mean square of the whole error minus the mean square of the method's own error.
    pub rest: Estimate,
    /// Mean square of each source by itself (first order).
    pub first: Vec<Estimate>,
}

impl Squares {
    /// Computes the mean squares from independent tuples. `sources` is the number of sources, and so of mixed errors in a tuple.
    pub fn of(tuples: &[Tuple], sources: usize) -> Self {
        let mean = |of: &dyn Fn(&Tuple) -> f64| ratio(tuples.iter().map(|tuple| (of(tuple), 1.0)));
        Self {
            all: mean(&Tuple::square),
            common: mean(&Tuple::common),
            rest: mean(&|tuple| tuple.square() - tuple.common()),
            first: (0..sources).map(|source| mean(&|tuple| tuple.first(source))).collect(),
        }
    }
}

/// Returns the ratio of two means with its 95 % interval: the mean of the pairs' first numbers divided by the mean of their second numbers.
/// NaN for fewer than two pairs.
pub fn ratio(pairs: impl Iterator<Item = (f64, f64)> + Clone) -> Estimate {
    let (mut count, mut above, mut below) = (0.0, 0.0, 0.0);
    for (x, y) in pairs.clone() {
        (count, above, below) = (count + 1.0, above + x, below + y);
    }
    let value = above / below;
    let squares: f64 = pairs.map(|(x, y)| power(x - value * y, 2)).sum();
    if count < 2.0 {
        return Estimate { value: f64::NAN, low: f64::NAN, high: f64::NAN };
    }
    let half = student(count - 1.0) * squares.sqrt() / below;
    Estimate { value, low: value - half, high: value + half }
}

#[cfg(test)]
mod tests {
    use standstill_sim::{Purpose, Streams};

    use super::*;

    /// Makes tuples with the error e = m cos θ + a x cos θ + b y + c x z, whose shares have closed forms.
    fn tuples(seed: u64, [m, a, b, c]: [f64; 4]) -> Vec<Tuple> {
        let error =
            |angle: f64, [x, y, z]: [f64; 3]| m * angle.cos() + a * x * angle.cos() + b * y + c * x * z;
        (0..20_000)
            .map(|trial| {
                let mut draws = Streams::new(seed, trial).open(Purpose::Design);
                let angle = draws.angle();
                let mut three = || [draws.normal(), draws.normal(), draws.normal()];
                let [u, v] = [three(), three()];
                let mixed = (0..3).map(|source| {
                    let mut w = u;
                    w[source] = v[source];
                    error(angle, w)
                });
                Tuple { a: error(angle, u), b: error(angle, v), mixed: mixed.collect() }
            })
            .collect()
    }

    #[test]
    fn analytic_shares_of_a_polynomial_lie_in_their_intervals() {
        let [m, a, b, c] = [1.0, 2.0, 1.5, 0.7];
        let square = m * m / 2.0 + a * a / 2.0 + b * b + c * c;
        let truth = [m * m / 2.0, a * a / 2.0, b * b, 0.0, c * c].map(|part| part / square);
        let mut held = 0;
        for seed in 1..=20 {
            let shares = Shares::of(&tuples(seed, [m, a, b, c]), 3);
            let [x, y, z] = [0, 1, 2].map(|source| shares.first[source]);
            let found = [shares.common, x, y, z, shares.interaction];
            held += found.iter().zip(truth).filter(|(e, truth)| e.low <= *truth && *truth <= e.high).count();
            let sum: f64 = found.iter().map(|estimate| estimate.value).sum();
            assert!((sum - 1.0).abs() < 1e-9, "the parts are the whole: {sum}");
            assert!((shares.mean_square.value / square - 1.0).abs() < 0.05);
            let totals = [a * a / 2.0 + c * c, b * b, c * c].map(|part| part / square);
            for (total, truth) in shares.total.iter().zip(totals) {
                assert!((total.value - truth).abs() < 0.02, "{total:?} where {truth} is right");
            }
        }
        // 95 of 100, and 88 or fewer in one of 200 cases.
        assert!(held >= 88, "{held} of 100 intervals hold");
    }

    #[test]
    fn analytic_mean_squares_lie_in_their_intervals_and_are_not_cut_at_zero() {
        let [m, a, b, c] = [1.0, 2.0, 1.5, 0.7];
        let (mut held, mut below) = (0, 0);
        for seed in 1..=20 {
            let squares = Squares::of(&tuples(seed, [m, a, b, c])[..500], 3);
            let found = [squares.all, squares.common, squares.first[0], squares.first[1], squares.first[2]];
            let all = m * m / 2.0 + a * a / 2.0 + b * b + c * c;
            let truth = [all, m * m / 2.0, a * a / 2.0, b * b, 0.0];
            held += found.iter().zip(truth).filter(|(e, truth)| e.low <= *truth && *truth <= e.high).count();
            // The third source alone has no effect.
            below += u32::from(squares.first[2].value < 0.0);
        }
        assert!(held >= 88, "{held} of 100 intervals hold");
        assert!((4..=16).contains(&below), "{below} of 20");
    }

    #[test]
    fn law_what_cancels_over_all_angles_has_its_share_at_each() {
        // A gain that turns the axis by cos 2θ: over all angles it averages to nothing.
        let shares = Shares::of(&tuples(3, [0.0, 1.0, 0.0, 0.0]), 3);
        assert!((shares.first[0].value - 1.0).abs() < 0.05);
        assert!(shares.interaction.value.abs() < 0.05);
    }
}
