//! B-splines on any axis: values and derivatives, by the recursion of Cox and de Boor.

use nalgebra::DMatrix;

/// Highest degree.
const DEGREE: usize = 5;

/// Functions that differ from zero at one point, with their first and second derivatives.
pub(super) struct Local {
    /// Index of the first.
    pub(super) first: usize,
    /// Derivatives of order 0, 1, 2.
    pub(super) values: [Vec<f64>; 3],
}

/// As many spline functions as there are sites, of degree 5, or less where there are fewer sites.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Basis {
    degree: usize,
    knots: Vec<f64>,
}

impl Basis {
    /// The knots are the sites but for two next to each end, so that functions and sites are equally many.
    pub(super) fn on(sites: &[f64]) -> Self {
        let degree = DEGREE.min(sites.len() - 1);
        let inner = sites.len() - degree - 1;
        let skipped = (sites.len() - inner) / 2;
        let (low, high) = (sites[0], sites[sites.len() - 1]);
        let mut knots = vec![low; degree + 1];
        knots.extend_from_slice(&sites[skipped..skipped + inner]);
        knots.extend(vec![high; degree + 1]);
        Self { degree, knots }
    }

    fn count(&self) -> usize {
        self.knots.len() - self.degree - 1
    }

    /// At x, outside of the sites by the polynomial of the last span.
    pub(super) fn at(&self, x: f64) -> Local {
        let last = self.count() - 1;
        let span = (self.knots.partition_point(|knot| *knot <= x).max(1) - 1).clamp(self.degree, last);
        let values = [0, 1, 2].map(|order| self.derivative(span, x, order, self.degree));
        Local { first: span - self.degree, values }
    }

    /// Derivatives of the functions of this degree that differ from zero in a span.
    fn derivative(&self, span: usize, x: f64, order: usize, degree: usize) -> Vec<f64> {
        if degree == 0 {
            return vec![if order == 0 { 1.0 } else { 0.0 }];
        }
        let lower = self.derivative(span, x, order.saturating_sub(1), degree - 1);
        let t = &self.knots;
        (0..=degree)
            .map(|k| {
                let i = span + k - degree;
                // Function i is made of functions i and i + 1 of one degree less.
                let left = if k > 0 { lower[k - 1] / (t[i + degree] - t[i]) } else { 0.0 };
                let right = if k < degree { lower[k] / (t[i + degree + 1] - t[i + 1]) } else { 0.0 };
                if order == 0 {
                    left * (x - t[i]) + right * (t[i + degree + 1] - x)
                } else {
                    degree as f64 * (left - right)
                }
            })
            .collect()
    }

    /// Each function's derivative of an order at each site: rows are sites.
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
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_splines_reproduce_polynomials_and_their_derivatives() {
        for count in [3, 4, 5, 6, 7, 12, 31] {
            let sites: Vec<f64> = (0..count).map(|k| f64::from(k) + 0.3 * f64::from(k % 3)).collect();
            let basis = Basis::on(&sites);
            assert_eq!(basis.count(), sites.len());
            let degree = i32::try_from(basis.degree).expect("small");
            let x0 = sites[sites.len() / 2];
            let values = sites.iter().map(|x| ((x - x0) / 3.0).powi(degree));
            let right = nalgebra::DVector::from_iterator(sites.len(), values);
            let c = basis.matrix(&sites, 0).lu().solve(&right).expect("regular");
            for step in 0..50 {
                let x = sites[0] + (sites[sites.len() - 1] - sites[0]) * f64::from(step) / 49.0;
                let local = basis.at(x);
                let sum = |order: usize| -> f64 {
                    local.values[order].iter().enumerate().map(|(k, v)| v * c[local.first + k]).sum()
                };
                let z = (x - x0) / 3.0;
                let n = f64::from(degree);
                let size = 1.0 + z.abs().powi(degree);
                assert!((sum(0) - z.powi(degree)).abs() < 1e-9 * size, "{count} {x}");
                assert!((sum(1) - n / 3.0 * z.powi(degree - 1)).abs() < 1e-9 * size, "{count} {x}");
                let second = n * (n - 1.0) / 9.0 * z.powi(degree - 2);
                assert!((sum(2) - second).abs() < 1e-8 * size, "{count} {x}");
            }
        }
    }
}
