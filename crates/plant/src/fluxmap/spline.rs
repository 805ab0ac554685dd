//! B-splines of degree 4 on any axis: values and derivatives, by the recursion of Cox and de Boor.
//!
//! A co-energy is made of one function more per axis than the map has points. Its slope is then the cubic spline through
//! as many points as there are, with knots at the points ("not a knot" at the second and the last but one). With as
//! many functions as points the slope would have one function too few to follow its data: it rings from point to point.

use nalgebra::DMatrix;

/// Degree of the co-energy; its slope, the flux, is a cubic.
pub(super) const DEGREE: usize = 4;

/// Functions that differ from zero at one point.
pub(super) const WIDTH: usize = DEGREE + 1;

/// Least number of sites: the cubic of the slope and one knot.
pub(super) const LEAST_SITES: usize = WIDTH;

/// Nodes (in units of half a span from its middle) and weights of Gauss and Legendre, exact up to degree 9.
const GAUSS: [(f64, f64); 5] = [
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.906_179_845_938_664, 0.236_926_885_056_189_08),
    (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
];

/// Functions that differ from zero at one point, with their derivatives.
#[derive(Clone, Copy, Debug)]
pub(super) struct Local {
    /// Index of the first.
    pub(super) first: usize,
    /// Derivatives of order 0 to 3.
    pub(super) values: [[f64; WIDTH]; 4],
}

/// Spline functions over sites, one more than sites.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Basis {
    knots: Vec<f64>,
}

impl Basis {
    /// Makes the basis for at least [`LEAST_SITES`] sites. The knots are all sites except the second and the last but
    /// one.
    pub(super) fn on(sites: &[f64]) -> Self {
        let (low, high) = (sites[0], sites[sites.len() - 1]);
        let mut knots = vec![low; WIDTH];
        knots.extend_from_slice(&sites[2..sites.len() - 2]);
        knots.extend([high; WIDTH]);
        Self { knots }
    }

    pub(super) fn count(&self) -> usize {
        self.knots.len() - WIDTH
    }

    /// Evaluates the functions at x. Outside of the sites, the polynomial of the last span continues.
    pub(super) fn at(&self, x: f64) -> Local {
        let last = self.count() - 1;
        let span = (self.knots.partition_point(|knot| *knot <= x).max(1) - 1).clamp(DEGREE, last);
        let values = [0, 1, 2, 3].map(|order| self.derivative(span, x, order, DEGREE));
        Local { first: span - DEGREE, values }
    }

    /// Derivatives of the functions of this degree that differ from zero in a span.
    fn derivative(&self, span: usize, x: f64, order: usize, degree: usize) -> [f64; WIDTH] {
        let mut values = [0.0; WIDTH];
        if degree == 0 {
            values[0] = if order == 0 { 1.0 } else { 0.0 };
            return values;
        }
        let lower = self.derivative(span, x, order.saturating_sub(1), degree - 1);
        let t = &self.knots;
        for (k, value) in values.iter_mut().enumerate().take(degree + 1) {
            let i = span + k - degree;
            // Function i is made of functions i and i + 1 of one degree less.
            let left = if k > 0 { lower[k - 1] / (t[i + degree] - t[i]) } else { 0.0 };
            let right = if k < degree { lower[k] / (t[i + degree + 1] - t[i + 1]) } else { 0.0 };
            *value = if order == 0 {
                left * (x - t[i]) + right * (t[i + degree + 1] - x)
            } else {
                degree as f64 * (left - right)
            };
        }
        values
    }

    /// Returns each function's derivative of an order at each site: rows are sites.
    pub(super) fn matrix(&self, sites: &[f64], order: usize) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(sites.len(), self.count());
        for (row, x) in sites.iter().enumerate() {
            let local = self.at(*x);
            for (k, value) in local.values[order].iter().enumerate() {
                matrix[(row, local.first + k)] = *value;
            }
        }
        matrix
    }

    /// Integrals over the axis of products of two functions' derivatives of an order.
    pub(super) fn gram(&self, order: usize) -> DMatrix<f64> {
        let mut gram = DMatrix::zeros(self.count(), self.count());
        for span in self.knots.windows(2).filter(|span| span[1] > span[0]) {
            let (middle, half) = ((span[0] + span[1]) / 2.0, (span[1] - span[0]) / 2.0);
            for (node, weight) in GAUSS {
                let local = self.at(middle + half * node);
                let values = local.values[order];
                for (a, left) in values.iter().enumerate() {
                    for (b, right) in values.iter().enumerate() {
                        gram[(local.first + a, local.first + b)] += weight * half * left * right;
                    }
                }
            }
        }
        gram
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_splines_reproduce_polynomials_and_their_derivatives() {
        for count in [5, 6, 7, 12, 31] {
            let sites: Vec<f64> = (0..count).map(|k| f64::from(k) + 0.3 * f64::from(k % 3)).collect();
            let basis = Basis::on(&sites);
            assert_eq!(basis.count(), sites.len() + 1);
            let x0 = sites[sites.len() / 2];
            // Values at the sites and one slope are as many conditions as functions.
            let mut rows = basis.matrix(&sites, 0).insert_row(0, 0.0);
            rows.set_row(0, &basis.matrix(&sites[..1], 1).row(0));
            let z = |x: f64| (x - x0) / 3.0;
            let mut right = vec![4.0 / 3.0 * z(sites[0]).powi(3)];
            right.extend(sites.iter().map(|x| z(*x).powi(4)));
            let c = rows.lu().solve(&nalgebra::DVector::from_vec(right)).expect("regular");
            for step in 0..50 {
                let x = sites[0] + (sites[sites.len() - 1] - sites[0]) * f64::from(step) / 49.0;
                let local = basis.at(x);
                let sum = |order: usize| -> f64 {
                    local.values[order].iter().enumerate().map(|(k, v)| v * c[local.first + k]).sum()
                };
                let z = z(x);
                let size = 1.0 + z.powi(4);
                assert!((sum(0) - z.powi(4)).abs() < 1e-9 * size, "{count} {x}");
                assert!((sum(1) - 4.0 / 3.0 * z.powi(3)).abs() < 1e-9 * size, "{count} {x}");
                assert!((sum(2) - 12.0 / 9.0 * z * z).abs() < 1e-8 * size, "{count} {x}");
                assert!((sum(3) - 24.0 / 27.0 * z).abs() < 1e-8 * size, "{count} {x}");
            }
            // ∫ (24 z/27)² over the axis.
            let ends = [sites[0], sites[sites.len() - 1]].map(|x| z(x).powi(3));
            let exact = (24.0_f64 / 27.0).powi(2) * (ends[1] - ends[0]);
            let got = (c.transpose() * basis.gram(3) * &c)[(0, 0)];
            assert!((got / exact - 1.0).abs() < 1e-6, "{count}: {got} {exact}");
        }
    }
}
