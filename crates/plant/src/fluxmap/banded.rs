//! Symmetric positive definite systems whose matrix has a band.

/// A symmetric matrix with a band, its lower half row by row: element (i, j) for `i − width ≤ j ≤ i`.
#[derive(Clone)]
pub(super) struct Banded {
    count: usize,
    width: usize,
    rows: Vec<f64>,
}

impl Banded {
    pub(super) fn new(count: usize, width: usize) -> Self {
        Self { count, width, rows: vec![0.0; count * (width + 1)] }
    }

    fn index(&self, i: usize, j: usize) -> usize {
        i * (self.width + 1) + self.width + j - i
    }

    /// Adds to the element in row i and column j ≤ i.
    pub(super) fn add(&mut self, i: usize, j: usize, value: f64) {
        let index = self.index(i, j);
        self.rows[index] += value;
    }

    /// Adds the products of a factor with each of these to the elements in row i from column j on, up to the diagonal at most.
    #[inline]
    pub(super) fn add_products(&mut self, i: usize, j: usize, factor: f64, factors: &[f64]) {
        let index = self.index(i, j);
        for (element, other) in self.rows[index..index + factors.len()].iter_mut().zip(factors) {
            *element += factor * other;
        }
    }

    /// The element in row i and column j ≤ i within the band.
    fn get(&self, i: usize, j: usize) -> f64 {
        self.rows[self.index(i, j)]
    }

    /// Its sum with `share` of another one of the same band.
    pub(super) fn plus(&self, other: &Self, share: f64) -> Self {
        let rows = self.rows.iter().zip(&other.rows).map(|(one, other)| one + share * other).collect();
        Self { rows, ..*self }
    }

    /// Sum of the diagonal.
    pub(super) fn trace(&self) -> f64 {
        (0..self.count).map(|i| self.get(i, i)).sum()
    }

    /// Its Cholesky factor; none if it is not positive definite.
    pub(super) fn factor(mut self) -> Option<Factor> {
        for i in 0..self.count {
            let first = i.saturating_sub(self.width);
            for j in first..=i {
                let from = first.max(j.saturating_sub(self.width));
                let (row_i, row_j) = (self.index(i, from), self.index(j, from));
                let dot = dot(&self.rows[row_i..row_i + j - from], &self.rows[row_j..row_j + j - from]);
                let index = self.index(i, j);
                let left = self.rows[index] - dot;
                if i == j {
                    if left.is_nan() || left <= 0.0 {
                        return None;
                    }
                    self.rows[index] = left.sqrt();
                } else {
                    self.rows[index] = left / self.get(j, j);
                }
            }
        }
        Some(Factor(self))
    }
}

/// Sums in four parts, whose order does not depend on the machine.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (a_fours, b_fours) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = a_fours.remainder().iter().zip(b_fours.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in a_fours.zip(b_fours) {
        for (sum, (x, y)) in sums.iter_mut().zip(x.iter().zip(y)) {
            *sum += x * y;
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// L with `L Lᵀ` the matrix.
#[derive(Clone)]
pub(super) struct Factor(Banded);

impl Factor {
    /// `L⁻¹ right`.
    pub(super) fn forwards(&self, mut right: Vec<f64>) -> Vec<f64> {
        let l = &self.0;
        for i in 0..l.count {
            let first = i.saturating_sub(l.width);
            let row = l.index(i, first);
            right[i] = (right[i] - dot(&l.rows[row..row + i - first], &right[first..i])) / l.get(i, i);
        }
        right
    }

    /// The solution of the system with this right side.
    pub(super) fn solve(&self, right: Vec<f64>) -> Vec<f64> {
        let (l, mut right) = (&self.0, self.forwards(right));
        for i in (0..l.count).rev() {
            right[i] /= l.get(i, i);
            let (first, value) = (i.saturating_sub(l.width), right[i]);
            let row = l.index(i, first);
            for (right, factor) in right[first..i].iter_mut().zip(&l.rows[row..]) {
                *right -= factor * value;
            }
        }
        right
    }

    /// Trace of the inverse's product with a matrix of the same band, which needs the inverse within the band only. It is
    /// computed from its last row up (Erisman and Tinney 1975, doi 10.1145/360680.360704).
    pub(super) fn trace_of_inverse_times(&self, other: &Banded) -> f64 {
        let l = &self.0;
        let (count, width) = (l.count, l.width);
        // Row i has the inverse's elements (i, i − width) to (i, i + width), so that sums run along rows.
        let wide = 2 * width + 1;
        let mut inverse = vec![0.0; count * wide];
        let mut column = vec![0.0; width];
        let mut trace = 0.0;
        for j in (0..count).rev() {
            let most = width.min(count - 1 - j);
            let below = &mut column[..most];
            for (k, below) in below.iter_mut().enumerate() {
                *below = l.get(j + 1 + k, j);
            }
            let pivot = l.get(j, j);
            for far in (0..=most).rev() {
                let i = j + far;
                let from = i * wide + width + j + 1 - i;
                let first = if far == 0 { 1.0 / pivot } else { 0.0 };
                let z = (first - dot(below, &inverse[from..from + most])) / pivot;
                inverse[j * wide + width + far] = z;
                inverse[i * wide + width - far] = z;
                trace += z * other.get(i, j) * if far == 0 { 1.0 } else { 2.0 };
            }
        }
        trace
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;

    #[test]
    fn analytic_a_band_is_solved_and_inverted_as_a_full_matrix_is() {
        for (count, width) in [(1, 0), (5, 1), (30, 7), (9, 8)] {
            let (mut banded, mut other) = (Banded::new(count, width), Banded::new(count, width));
            let (mut full, mut second) = (DMatrix::zeros(count, count), DMatrix::zeros(count, count));
            for i in 0..count {
                for j in i.saturating_sub(width)..=i {
                    let value =
                        if i == j { 3.0 + width as f64 } else { 1.0 / (2.0 + (i * 3 + j) as f64) - 0.3 };
                    let more = ((i * 7 + j * 3) % 5) as f64;
                    banded.add(i, j, value);
                    other.add(i, j, more);
                    (full[(i, j)], full[(j, i)]) = (value, value);
                    (second[(i, j)], second[(j, i)]) = (more, more);
                }
            }
            assert!((banded.trace() - full.trace()).abs() < 1e-12);
            let sum = banded.plus(&other, 0.01).factor().expect("positive definite");
            let right = DVector::from_fn(count, |k, _| 1.0 + k as f64);
            let inverse = (&full + 0.01 * &second).try_inverse().expect("regular");
            let got = DVector::from_vec(sum.solve(right.as_slice().to_vec()));
            assert!((got - &inverse * right).norm() < 1e-10, "{count} {width}");
            let trace = sum.trace_of_inverse_times(&other);
            assert!((trace - (inverse * second).trace()).abs() < 1e-10, "{count} {width}: {trace}");
            assert!(banded.plus(&banded, -2.0).factor().is_none());
        }
    }
}
