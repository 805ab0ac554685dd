//! Symmetric positive definite systems whose matrix has a band.

use standstill_numeric::{ROWS, dot, dots};

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

    /// Adds the products of a factor with each of these to the elements in row i from column j on, up to the diagonal at most. A count
    /// that is known when this is compiled needs no loop.
    #[inline]
    pub(super) fn add_run<const RUN: usize>(
        &mut self,
        i: usize,
        j: usize,
        factor: f64,
        factors: &[f64; RUN],
    ) {
        let index = self.index(i, j);
        if let Some(elements) = self.rows[index..].first_chunk_mut::<RUN>() {
            *elements = std::array::from_fn(|k| elements[k] + factor * factors[k]);
        }
    }

    /// Adds `factor` times `factors` to the elements of row i from column j on.
    #[inline]
    pub(super) fn add_products(&mut self, i: usize, j: usize, factor: f64, factors: &[f64]) {
        let index = self.index(i, j);
        for (element, other) in self.rows[index..index + factors.len()].iter_mut().zip(factors) {
            *element += factor * other;
        }
    }

    /// Returns the element in row i and column j ≤ i within the band.
    fn get(&self, i: usize, j: usize) -> f64 {
        self.rows[self.index(i, j)]
    }

    /// Returns the sum with `share` times another matrix of the same band.
    pub(super) fn plus(&self, other: &Self, share: f64) -> Self {
        let rows = self.rows.iter().zip(&other.rows).map(|(one, other)| one + share * other).collect();
        Self { rows, ..*self }
    }

    /// Returns the sum of the diagonal.
    pub(super) fn trace(&self) -> f64 {
        (0..self.count).map(|i| self.get(i, i)).sum()
    }

    /// Returns the Cholesky factor; none if the matrix is not positive definite.
    pub(super) fn factor(mut self) -> Option<Factor> {
        factor_rows(&mut self).then_some(Factor(self))
    }

    /// Returns the first column of the band in row i.
    const fn first(&self, i: usize) -> usize {
        i.saturating_sub(self.width)
    }

    /// Returns the row's elements from column `from` up to column `to`.
    #[inline(always)]
    fn part(&self, i: usize, from: usize, to: usize) -> &[f64] {
        let index = self.index(i, from);
        &self.rows[index..index + to - from]
    }

    /// Computes the element (i, j) of a Cholesky factor: subtracts `products` of the elements already factored and
    /// divides by the pivot. Returns false if the pivot is not positive.
    #[inline(always)]
    fn reduce(&mut self, i: usize, j: usize, products: f64) -> bool {
        let index = self.index(i, j);
        let left = self.rows[index] - products;
        if i == j {
            self.rows[index] = left.sqrt();
            return left > 0.0;
        }
        self.rows[index] = left / self.get(j, j);
        true
    }
}

/// Replaces the matrix by its Cholesky factor; false if it is not positive definite.
fn factor_rows(matrix: &mut Banded) -> bool {
    for top in (0..matrix.count).step_by(ROWS) {
        let end = (top + ROWS).min(matrix.count);
        // Left of the block, its rows do not depend on each other.
        for j in matrix.first(top)..top {
            if end - top == ROWS && matrix.first(end - 1) <= j {
                let pair = |k: usize| {
                    let (i, from) = (top + k, matrix.first(top + k));
                    (matrix.part(i, from, j), matrix.part(j, from, j))
                };
                for (k, products) in dots([0, 1, 2, 3].map(pair)).into_iter().enumerate() {
                    matrix.reduce(top + k, j, products);
                }
            } else {
                for i in top..end {
                    let from = matrix.first(i);
                    if from <= j {
                        let products = dot(matrix.part(i, from, j), matrix.part(j, from, j));
                        matrix.reduce(i, j, products);
                    }
                }
            }
        }
        for i in top..end {
            let from = matrix.first(i);
            for j in top.max(from)..=i {
                let products = dot(matrix.part(i, from, j), matrix.part(j, from, j));
                if !matrix.reduce(i, j, products) {
                    return false;
                }
            }
        }
    }
    true
}

/// L with `L Lᵀ` the matrix.
#[derive(Clone)]
pub(super) struct Factor(Banded);

impl Factor {
    /// Returns `L⁻¹ right`, by forward substitution.
    pub(super) fn forwards(&self, mut right: Vec<f64>) -> Vec<f64> {
        let l = &self.0;
        for i in 0..l.count {
            let first = i.saturating_sub(l.width);
            let row = l.index(i, first);
            right[i] = (right[i] - dot(&l.rows[row..row + i - first], &right[first..i])) / l.get(i, i);
        }
        right
    }

    /// Returns the solution of the system with this right side.
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

    /// Returns the trace of the inverse's product with a matrix of the same band, which needs the inverse within the
    /// band only. It is computed from its last row up (Erisman and Tinney 1975, doi 10.1145/360680.360704).
    pub(super) fn trace_of_inverse_times(&self, other: &Banded) -> f64 {
        trace_of_inverse_times(&self.0, other)
    }
}

/// Computes [`Factor::trace_of_inverse_times`].
fn trace_of_inverse_times(l: &Banded, other: &Banded) -> f64 {
    let (count, width) = (l.count, l.width);
    // Row i has the inverse's elements (i, i − width) to (i, i + width), so that sums run along rows.
    let wide = 2 * width + 1;
    let mut inverse = vec![0.0; count * wide];
    let (mut column, mut found) = (vec![0.0; width], vec![0.0; width + 1]);
    let mut trace = 0.0;
    for j in (0..count).rev() {
        let most = width.min(count - 1 - j);
        let below = &mut column[..most];
        for (k, below) in below.iter_mut().enumerate() {
            *below = l.get(j + 1 + k, j);
        }
        let (below, pivot) = (&*below, l.get(j, j));
        // The elements of the inverse in row j + far from column j + 1 on, which is right of what column j adds to that row.
        let row = |inverse: &[f64], far: usize| {
            let from = (j + far) * wide + width + 1 - far;
            dot(below, &inverse[from..from + most])
        };
        let mut rows = found[1..=most].chunks_exact_mut(ROWS);
        let mut far = 1;
        for products in &mut rows {
            let pair = |k: usize| {
                let from = (j + far + k) * wide + width + 1 - far - k;
                (below, &inverse[from..from + most])
            };
            products.copy_from_slice(&dots([0, 1, 2, 3].map(pair)));
            far += ROWS;
        }
        for products in rows.into_remainder() {
            *products = row(&inverse, far);
            far += 1;
        }
        for far in (0..=most).rev() {
            let i = j + far;
            // That of column j itself has what the others of this column are.
            let (first, products) =
                if far == 0 { (1.0 / pivot, row(&inverse, 0)) } else { (0.0, found[far]) };
            let z = (first - products) / pivot;
            inverse[j * wide + width + far] = z;
            inverse[i * wide + width - far] = z;
            trace += z * other.get(i, j) * if far == 0 { 1.0 } else { 2.0 };
        }
    }
    trace
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;

    #[test]
    fn law_rows_side_by_side_have_the_bits_of_one_after_the_other() {
        for (count, width) in [(3, 1), (40, 3), (61, 17), (64, 63), (90, 38)] {
            let mut banded = Banded::new(count, width);
            for i in 0..count {
                for j in i.saturating_sub(width)..=i {
                    let small = ((i * 37 + j * 11) % 23) as f64 / 7.0 - 1.5;
                    banded.add(i, j, if i == j { 4.0 * width as f64 } else { small });
                }
            }
            let mut plain = banded.clone();
            for i in 0..count {
                for j in plain.first(i)..=i {
                    let from = plain.first(i);
                    let products = dot(plain.part(i, from, j), plain.part(j, from, j));
                    assert!(plain.reduce(i, j, products));
                }
            }
            let bits = |rows: &[f64]| rows.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
            let factor = banded.factor().expect("positive definite");
            assert_eq!(bits(&factor.0.rows), bits(&plain.rows), "{count} {width}");
        }
    }

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
