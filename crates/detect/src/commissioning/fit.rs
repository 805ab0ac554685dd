//! Least-squares fit over all positions; the angle of each position is a separate unknown, which is eliminated.

use standstill_interface::{Angle, Real};

use super::model::{Model, Reading, UNKNOWNS, at};
use crate::parts::complex::{Complex, Turning};

/// Measurement at one position: Z, in the model's unit, and the pole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Position<T> {
    pub(super) z: Complex<T>,
    /// Angle of the north pole, with an error below 90°; none if unknown.
    pub(super) north: Option<Angle<T>>,
}

/// Selection of the unknowns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Extent {
    /// Whether P is an unknown.
    pub(super) saturation: bool,
}

type Vector<T> = [T; UNKNOWNS];

/// Normal equations at one model.
pub(super) struct Normal<T> {
    /// Information matrix JᵀJ after elimination of the angles. Its inverse is the covariance for unit noise.
    matrix: [Vector<T>; UNKNOWNS],
    right: Vector<T>,
    /// Sum of squares.
    pub(super) cost: T,
}

/// Cholesky factor G of a positive definite matrix `G Gᵀ`.
pub(super) struct Factor<T>([Vector<T>; UNKNOWNS]);

impl Extent {
    fn learns(self, unknown: usize) -> bool {
        unknown != at::SATURATION || self.saturation
    }

    /// Returns the number of unknowns in addition to the angles. One of a position's two equations determines its
    /// angle.
    pub(super) fn unknowns(self) -> usize {
        if self.saturation { UNKNOWNS } else { UNKNOWNS - 1 }
    }

    /// Returns the values with zeros for unknowns that are not learnt.
    pub(super) fn only<T: Real>(self, mut values: Vector<T>) -> Vector<T> {
        for (unknown, value) in values.iter_mut().enumerate() {
            if !self.learns(unknown) {
                *value = T::zero();
            }
        }
        values
    }
}

/// Finds the angle at which the model comes nearest to the measurement, and the model's value there.
fn nearest<T: Real>(model: &Model<T>, position: &Position<T>) -> Reading<T> {
    let (mut angle, _) = model.angle(position.z, position.north);
    let mut reading = model.at(angle);
    // At this angle the model lies in the measured direction from c. Harmonics distort the circle, so the nearest point
    // lies beside it.
    for _ in 0..3 {
        let t = reading.over_angle;
        angle = angle + t.dot(position.z - reading.z) / t.dot(t);
        reading = model.at(angle);
    }
    reading
}

impl<T: Real> Normal<T> {
    pub(super) fn of(model: &Model<T>, positions: &[Position<T>], extent: Extent) -> Self {
        let zero = T::zero();
        let mut normal = Self { matrix: [[zero; UNKNOWNS]; UNKNOWNS], right: [zero; UNKNOWNS], cost: zero };
        for position in positions {
            let reading = nearest(model, position);
            let t = reading.over_angle;
            // The component normal to the model's path over the angle: one equation that does not contain the angle.
            let normal_to = t.quarter_turn().scale(T::one() / t.length());
            let rest = normal_to.dot(position.z - reading.z);
            let slopes = extent.only(reading.over_unknowns.map(|column| normal_to.dot(column)));
            for (row, a) in slopes.into_iter().enumerate() {
                for (column, b) in slopes.into_iter().enumerate() {
                    normal.matrix[row][column] = normal.matrix[row][column] + a * b;
                }
                normal.right[row] = normal.right[row] + a * rest;
            }
            normal.cost = normal.cost + rest * rest;
        }
        for unknown in (0..UNKNOWNS).filter(|unknown| !extent.learns(*unknown)) {
            normal.matrix[unknown][unknown] = T::one();
        }
        normal
    }

    /// Returns the Cholesky factor, with `damping` added as a share of each diagonal element; `None` if a direction has
    /// no information.
    pub(super) fn factor(&self, damping: T) -> Option<Factor<T>> {
        let mut g = self.matrix;
        for row in 0..UNKNOWNS {
            for column in 0..row {
                let known = (0..column).fold(T::zero(), |sum, k| sum + g[row][k] * g[column][k]);
                g[row][column] = (self.matrix[row][column] - known) / g[column][column];
            }
            let whole = self.matrix[row][row] * (T::one() + damping);
            let rest = whole - (0..row).fold(T::zero(), |sum, k| sum + g[row][k] * g[row][k]);
            if rest.is_nan() || rest <= whole * T::epsilon() * T::of(8.0) {
                return None;
            }
            g[row][row] = rest.sqrt();
        }
        Some(Factor(g))
    }
}

impl<T: Real> Factor<T> {
    /// Returns G⁻¹ b.
    fn forwards(&self, b: &Vector<T>) -> Vector<T> {
        let mut x = *b;
        for row in 0..UNKNOWNS {
            let known = (0..row).fold(T::zero(), |sum, k| sum + self.0[row][k] * x[k]);
            x[row] = (x[row] - known) / self.0[row][row];
        }
        x
    }

    fn solve(&self, b: &Vector<T>) -> Vector<T> {
        let mut x = self.forwards(b);
        for row in (0..UNKNOWNS).rev() {
            let known = (row + 1..UNKNOWNS).fold(T::zero(), |sum, k| sum + self.0[k][row] * x[k]);
            x[row] = (x[row] - known) / self.0[row][row];
        }
        x
    }

    /// Returns the standard deviation of `weights · unknowns` for unit noise.
    pub(super) fn deviation(&self, weights: &Vector<T>) -> T {
        self.forwards(weights).iter().fold(T::zero(), |sum, part| sum + *part * *part).sqrt()
    }

    /// Returns the standard deviation of one unknown for unit noise.
    pub(super) fn deviation_of(&self, unknown: usize) -> T {
        let mut weights = [T::zero(); UNKNOWNS];
        weights[unknown] = T::one();
        self.deviation(&weights)
    }
}

/// Minimises the sum of squares by Gauss–Newton steps with Levenberg's damping. `None` if no minimum was found.
pub(super) fn minimise<T: Real>(
    start: Model<T>,
    positions: &[Position<T>],
    extent: Extent,
) -> Option<(Model<T>, Normal<T>)> {
    let mut model = start;
    let mut normal = Normal::of(&model, positions, extent);
    let mut damping = T::zero();
    for _ in 0..ITERATIONS {
        let step = normal.factor(damping)?.solve(&normal.right);
        let moved = model.moved(&step);
        let next = Normal::of(&moved, positions, extent);
        let length = step.iter().fold(T::zero(), |most, part| most.max(part.abs()));
        // Smaller steps change the cost, a sum of squares, by less than its rounding error.
        let small = length <= T::epsilon().sqrt() * T::of(0.01);
        if small || next.cost <= normal.cost * T::of(1.0 + 1e-3) {
            (model, normal, damping) = (moved, next, damping * T::of(0.1));
        } else {
            damping = (damping * T::of(10.0)).max(T::of(1e-3));
        }
        if small {
            return normal.cost.is_finite().then_some((model, normal));
        }
    }
    None
}

/// Largest number of steps; five are usual.
const ITERATIONS: usize = 60;
