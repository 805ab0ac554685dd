//! A smooth curve through errors over the angle, by least squares of a Fourier series. It is used if there are too few
//! errors for narrow bins.

use std::f64::consts::TAU;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Highest order of a series, that of an error with a period of 30°.
const HIGHEST: usize = 12;
/// Errors for each of a series' coefficients at least.
const PER_COEFFICIENT: usize = 8;
/// Errors further from the curve than so many times the residuals' standard deviation, estimated by their median, are outliers:
/// they do not bend it.
const OUTLYING: f64 = 6.0;
/// Ratio of the standard deviation of a normal distribution to the median of its magnitude.
const DEVIATIONS: f64 = 1.4826;
/// Pivot of the normal equations over the first one below which they are singular.
const LEAST_PIVOT: f64 = 1e-9;

/// A Fourier series Σ a_k cos kθ + b_k sin kθ for k from 0 to its order, with the factors of its normal equations.
#[derive(Clone, Debug)]
pub struct Series {
    /// k of its last term.
    pub order: usize,
    coefficients: DVector<f64>,
    /// Cholesky factor of the normal equations.
    factor: Cholesky<f64, Dyn>,
    /// Σ r² x xᵀ over the points' residuals r and rows x.
    scatter: DMatrix<f64>,
}

impl Series {
    /// Fits points `(angle in degrees, error)` with the highest order that their number and the largest gap between their
    /// angles allow; none if there are too few points.
    pub fn of(points: &[(f64, f64)]) -> Option<Self> {
        let mut angles: Vec<f64> = points.iter().map(|(angle, _)| angle.rem_euclid(360.0)).collect();
        angles.sort_by(f64::total_cmp);
        let around = angles.first()? + 360.0 - angles.last()?;
        let gap = angles.windows(2).map(|pair| pair[1] - pair[0]).fold(around, f64::max);
        let fits =
            |order: &usize| points.len() >= PER_COEFFICIENT * (2 * order + 1) && gap <= 180.0 / *order as f64;
        // Angles that repeat may leave the highest orders open.
        (1..=HIGHEST).rev().filter(fits).find_map(|order| Self::without_outliers(order, points))
    }

    /// Fits this order to the points that are not far apart from the curve.
    fn without_outliers(order: usize, points: &[(f64, f64)]) -> Option<Self> {
        let mut used = points.to_vec();
        let mut series = Self::to(order, &used)?;
        for _ in 0..3 {
            let mut apart: Vec<f64> = points.iter().map(|point| series.residual(*point).abs()).collect();
            apart.sort_by(f64::total_cmp);
            let most = OUTLYING * DEVIATIONS * apart[apart.len() / 2];
            let kept: Vec<_> = points.iter().copied().filter(|p| series.residual(*p).abs() <= most).collect();
            if kept.len() == used.len() {
                break;
            }
            used = kept;
            series = Self::to(order, &used)?;
        }
        Some(series)
    }

    /// Fits a series of this order to all points; none if the equations are singular.
    fn to(order: usize, points: &[(f64, f64)]) -> Option<Self> {
        let size = 2 * order + 1;
        let (mut normal, mut right) = (DMatrix::zeros(size, size), DVector::zeros(size));
        for (angle, error) in points {
            let row = terms(order, *angle);
            normal.ger(1.0, &row, &row, 1.0);
            right.axpy(*error, &row, 1.0);
        }
        let factor = Cholesky::new(normal)?;
        let pivots = factor.l_dirty().diagonal();
        if pivots.iter().any(|pivot| pivot * pivot <= LEAST_PIVOT * pivots[0] * pivots[0]) {
            return None;
        }
        let mut series =
            Self { order, coefficients: factor.solve(&right), factor, scatter: DMatrix::zeros(size, size) };
        for point in points {
            let row = terms(order, point.0);
            // A point draws the curve towards itself: its residual is as much too small.
            let own = row.dot(&series.factor.solve(&row));
            let off = series.residual(*point) / (1.0 - own).max(1e-3);
            series.scatter.ger(off * off, &row, &row, 1.0);
        }
        Some(series)
    }

    /// Returns the curve at an angle in degrees.
    pub fn at(&self, angle: f64) -> f64 {
        terms(self.order, angle).dot(&self.coefficients)
    }

    /// Returns half of its 95 % interval there.
    pub fn half_width(&self, angle: f64) -> f64 {
        // How far errors scatter depends on the angle: (XᵀX)⁻¹ Xᵀ diag(r²) X (XᵀX)⁻¹ between two rows (White 1980, with MacKinnon's
        // and White's correction HC3, doi:10.1016/0304-4076(85)90158-7).
        let weights = self.factor.solve(&terms(self.order, angle));
        let square = weights.dot(&(&self.scatter * &weights));
        1.96 * square.max(0.0).sqrt()
    }

    /// Returns the distance of a point above the series.
    pub fn residual(&self, (angle, error): (f64, f64)) -> f64 {
        error - self.at(angle)
    }
}

/// Returns the terms 1, cos θ, sin θ, cos 2θ, …
fn terms(order: usize, angle: f64) -> DVector<f64> {
    let theta = angle / 360.0 * TAU;
    let waves = (1..=order).flat_map(|k| [(k as f64 * theta).cos(), (k as f64 * theta).sin()]);
    DVector::from_iterator(2 * order + 1, std::iter::once(1.0).chain(waves))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Even, but in no order that a harmonic has.
    fn angle(k: u32) -> f64 {
        360.0 * (f64::from(k) * 0.618_033_988_749).fract()
    }

    fn noise(k: u32) -> f64 {
        // Twelve uniform numbers make a normal one; theirs are of SplitMix64.
        let uniform = |j: u64| {
            let mut word = (12 * u64::from(k) + j + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            word = (word ^ (word >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            word = (word ^ (word >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((word ^ (word >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(uniform).sum::<f64>() - 6.0
    }

    #[test]
    fn analytic_a_sixth_harmonic_keeps_its_size() {
        // From the fewest starts that support it on.
        for starts in [104, 300, 2000] {
            let points: Vec<(f64, f64)> =
                (0..starts).map(|k| (angle(k), 0.3 + (6.0 * angle(k)).to_radians().sin())).collect();
            let series = Series::of(&points).expect("a curve");
            assert!(series.order >= 6, "{starts}: {}", series.order);
            for k in 0..72 {
                let truth = 0.3 + (30.0 * f64::from(k)).to_radians().sin();
                assert!((series.at(5.0 * f64::from(k)) - truth).abs() < 1e-9, "{starts}, {k}");
            }
        }
    }

    #[test]
    fn law_the_order_follows_from_the_number_of_starts_and_their_gaps() {
        let of = |starts: u32| {
            let points: Vec<(f64, f64)> = (0..starts).map(|k| (angle(k), noise(k))).collect();
            Series::of(&points).map(|series| series.order)
        };
        assert_eq!(
            [23, 24, 103, 104, 199, 200, 5000].map(of),
            [None, Some(1), Some(5), Some(6), Some(11), Some(12), Some(12)]
        );
        // Nothing between 300° and 360°: what repeats every 60° cannot be seen there.
        let gap: Vec<(f64, f64)> = (0..1000).map(|k| (angle(k) * 300.0 / 360.0, noise(k))).collect();
        assert_eq!(Series::of(&gap).map(|series| series.order), Some(2));
        assert!(Series::of(&[(40.0, 1.0); 500]).is_none());
    }

    #[test]
    fn law_its_interval_holds_the_truth_in_95_of_100_places() {
        let mut held = 0;
        for run in 0..40 {
            let points: Vec<(f64, f64)> = (0..250)
                .map(|k| (angle(k), (6.0 * angle(k)).to_radians().sin() + noise(1000 * run + k)))
                .collect();
            let series = Series::of(&points).expect("a curve");
            for place in 0..25 {
                let at = 14.4 * f64::from(place);
                let truth = (6.0 * at).to_radians().sin();
                held += u32::from((series.at(at) - truth).abs() <= series.half_width(at));
            }
        }
        assert!((930..=970).contains(&held), "{held} of 1,000");
    }

    /// Gains of sensors scatter the error as cos 2θ.
    #[test]
    fn law_its_interval_holds_the_truth_where_errors_scatter_by_the_angle() {
        let (mut held, mut widths) = ([0; 2], [0.0; 2]);
        for run in 0..150 {
            let error = |k| (2.0 * angle(k)).to_radians().cos() * noise(1000 * run + k);
            let points: Vec<(f64, f64)> = (0..400).map(|k| (angle(k), error(k))).collect();
            let series = Series::of(&points).expect("a curve");
            for (n, at) in [0.0, 45.0].into_iter().enumerate() {
                held[n] += u32::from(series.at(at).abs() <= series.half_width(at));
                widths[n] += series.half_width(at);
            }
        }
        assert!(held.iter().all(|held| (135..=149).contains(held)), "{held:?} of 150");
        assert!(widths[0] > 1.5 * widths[1], "{widths:?}");
    }

    #[test]
    fn law_angles_that_repeat_have_the_order_that_they_support() {
        let points: Vec<(f64, f64)> =
            (0..240).map(|k| (30.0 * f64::from(k % 12), noise(u32::try_from(k).unwrap_or(0)))).collect();
        assert_eq!(Series::of(&points).map(|series| series.order), Some(5));
    }

    #[test]
    fn law_outliers_do_not_bend_it() {
        let points = |outlier: f64| -> Vec<(f64, f64)> {
            (0..400).map(|k| (angle(k), if k % 50 == 0 { outlier } else { noise(k) })).collect()
        };
        let [with, far] = [60.0, 90.0].map(|outlier| Series::of(&points(outlier)).expect("a curve"));
        for k in 0..72 {
            let at = 5.0 * f64::from(k);
            assert!((with.at(at) - far.at(at)).abs() < 1e-9 && with.at(at).abs() < 1.0, "{}", with.at(at));
        }
    }
}
