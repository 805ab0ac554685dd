//! Stumpff's functions c_k(x) = Σ (−x)^j / (k + 2j)!, sum over j from 0. With them the response of an oscillator to a power
//! of time is written.

use standstill_numeric::{PER_FACTORIAL, Wide, eight, sin_cos};

/// Argument up to which the series is summed; beyond it the functions follow from sine and cosine.
const SUMMED: f64 = 1.0;

/// Returns c_k for arguments up to [`SUMMED`], where the truncation error is below rounding.
#[inline(always)]
fn series<V: Wide>(x: V, x2: V, x4: V, k: usize) -> V {
    let c = PER_FACTORIAL;
    let even = [c[k], -c[k + 2], c[k + 4], -c[k + 6], c[k + 8], -c[k + 10], c[k + 12], -c[k + 14]];
    eight(x, x2, x4, even)
}

/// Returns c₀ to c₅ for non-negative arguments: squares of angles in rad.
#[inline(always)]
pub fn stumpff<V: Wide>(x: V) -> [V; 6] {
    let x2 = x * x;
    let x4 = x2 * x2;
    let (c4, c5) = (series(x, x2, x4, 4), series(x, x2, x4, 5));
    let (c2, c3) = (V::of(0.5) - x * c4, V::of(1.0 / 6.0) - x * c5);
    let mut all = [V::of(1.0) - x * c2, V::of(1.0) - x * c3, c2, c3, c4, c5];
    let far = x.above(V::of(SUMMED));
    if V::any(far) {
        let one = V::of(1.0);
        let angle = x.sqrt();
        let (sin, cos) = sin_cos(angle);
        let (c0, c1) = (cos, sin / angle);
        let (c2, c3) = ((one - c0) / x, (one - c1) / x);
        let (c4, c5) = ((V::of(0.5) - c2) / x, (V::of(1.0 / 6.0) - c3) / x);
        let closed = [c0, c1, c2, c3, c4, c5];
        for k in 0..6_usize {
            all[k] = V::choose(far, closed[k], all[k]);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_stumpffs_functions() {
        for n in 0..4000 {
            let angle = f64::from(n) * 0.01;
            let x = angle * angle;
            let c = stumpff(x);
            assert!((c[0] - angle.cos()).abs() < 1e-14, "{x}");
            assert!((c[1] * angle - angle.sin()).abs() < 1e-13, "{x}");
            // c_k = 1/k! − x c_(k+2).
            for (k, factorial) in [1.0, 1.0, 2.0, 6.0].into_iter().enumerate() {
                assert!((c[k] + x * c[k + 2] - 1.0 / factorial).abs() < 1e-14, "{x} {k}");
            }
            // The sums and the closed forms meet.
            let sum: f64 = (0..30)
                .fold((1.0 / 24.0, 0.0), |(term, sum), j| {
                    let j = f64::from(j);
                    (-term * x / ((5.0 + 2.0 * j) * (6.0 + 2.0 * j)), sum + term)
                })
                .1;
            assert!(x > 4.0 || (c[4] - sum).abs() < 1e-15, "{x}: {} {sum}", c[4]);
        }
    }
}
