//! Student's distribution.

use standstill_numeric::{beta, power};

/// Returns Student's factor of a 95 % interval with this many degrees of freedom: 1.96 for many, NaN for none.
///
/// ```
/// use standstill_campaign::student;
///
/// // Two degrees of freedom ask for more than twice the width of many.
/// assert!((student(2.0) - 4.303).abs() < 1e-3 && (student(1e9) - 1.960).abs() < 1e-3);
/// ```
pub fn student(freedom: f64) -> f64 {
    if freedom > 300.0 {
        // Abramowitz and Stegun, 26.7.5: from here on right to nine digits.
        let z: f64 = 1.959_963_984_540_054;
        let [z3, z5, z7] = [3, 5, 7].map(|exponent| power(z, exponent));
        let terms = [
            (z3 + z) / 4.0,
            (5.0 * z5 + 16.0 * z3 + 3.0 * z) / 96.0,
            (3.0 * z7 + 19.0 * z5 + 17.0 * z3 - 15.0 * z) / 384.0,
        ];
        return z + (terms[0] + (terms[1] + terms[2] / freedom) / freedom) / freedom;
    }
    student_beyond(freedom, 0.05)
}

/// Returns Student's factor of an interval that misses with the probability `misses`, half of it on each side, with
/// this many degrees of freedom, which must be some hundreds at most.
///
/// ```
/// use standstill_campaign::{student, student_beyond};
///
/// assert_eq!(student_beyond(7.0, 0.05), student(7.0));
/// // Tabulated: t(0.995) of seven.
/// assert!((student_beyond(7.0, 0.01) - 3.4995).abs() < 1e-4);
/// ```
pub fn student_beyond(freedom: f64, misses: f64) -> f64 {
    if freedom.is_nan() || freedom <= 0.0 {
        return f64::NAN;
    }
    // P(|t| > T) = I_x(f/2, 1/2) with x = f/(f + T²) grows with x (Abramowitz and Stegun, 26.7.1 and 26.5.27).
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..1100 {
        let middle = low + (high - low) / 2.0;
        if middle <= low || middle >= high {
            break;
        }
        if beta(freedom / 2.0, 0.5, middle) < misses {
            low = middle;
        } else {
            high = middle;
        }
    }
    (freedom * (1.0 - high) / high).sqrt()
}

#[cfg(test)]
mod tests {
    use statrs::distribution::{ContinuousCDF, StudentsT};

    use super::*;

    #[test]
    fn analytic_students_factor() {
        // Tabulated: t(0.975) of 1, 10, 30, 120 and infinitely many degrees of freedom.
        for (freedom, expected) in [(1.0, 12.706), (10.0, 2.228), (30.0, 2.042), (120.0, 1.980), (1e7, 1.960)]
        {
            assert!((student(freedom) - expected).abs() < 6e-4, "{freedom}: {}", student(freedom));
        }
        // The tangent of 0.475 π, and √(2 · 0.95² / (1 − 0.95²)).
        assert!((student(1.0) / (0.475 * std::f64::consts::PI).tan() - 1.0).abs() < 1e-12);
        assert!((student(2.0) / (2.0 * 0.9025 / 0.0975_f64).sqrt() - 1.0).abs() < 1e-12);
        assert!((student(300.0) - student(300.0 + 1e-6)).abs() < 1e-8, "no step where the expansion begins");
        assert!(student(0.0).is_nan() && student(-0.5).is_nan() && student(f64::NAN).is_nan());
    }

    #[test]
    fn cross_students_factor_is_that_of_statrs() {
        // Beyond some thousand degrees of freedom its series ends before it has converged.
        for tenths in 3..4000_u32 {
            let freedom = f64::from(tenths) / 10.0;
            let reference = StudentsT::new(0.0, 1.0, freedom).expect("valid").inverse_cdf(0.975);
            assert!((student(freedom) / reference - 1.0).abs() < 1e-8, "{freedom}: {reference}");
        }
    }
}
