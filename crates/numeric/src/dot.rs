//! Products of rows, with the same bits on every machine.

use super::Width;

/// Pairs of rows whose products [`dots`] computes side by side: one sum waits for its last addition, four keep a processor busy.
pub const ROWS: usize = 4;

/// Rows cut into fours, in pairs.
pub(crate) type Fours<'a> = [(&'a [[f64; 4]], &'a [[f64; 4]]); ROWS];

/// Returns the dot product of two rows of equal length. It is summed in four parts, whose order does not depend on the machine.
///
/// ```
/// assert_eq!(standstill_numeric::dot(&[1.0, 2.0, 3.0, 4.0, 5.0], &[1.0; 5]), 15.0);
/// ```
#[inline]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    finished([0.0; 4], a, b)
}

/// Returns [`dot`] of each pair. It uses registers of four numbers if the processor has them; the results are the same
/// to the last bit.
///
/// ```
/// use standstill_numeric::{dot, dots};
///
/// let rows: Vec<f64> = (0..20).map(|k| 0.1 * f64::from(k)).collect();
/// let pairs = [5, 6, 7, 8].map(|count| (&rows[..count], &rows[20 - count..]));
/// assert_eq!(dots(pairs), pairs.map(|(a, b)| dot(a, b)));
/// ```
pub fn dots(pairs: [(&[f64], &[f64]); ROWS]) -> [f64; ROWS] {
    dots_within(Width::widest(), pairs)
}

/// Returns the products with the instructions of this width at most.
fn dots_within(width: Width, pairs: [(&[f64], &[f64]); ROWS]) -> [f64; ROWS] {
    let common = pairs.iter().map(|(a, b)| a.len().min(b.len()) / 4).min().unwrap_or(0);
    let fours = pairs.map(|(a, b)| (&a.as_chunks().0[..common], &b.as_chunks().0[..common]));
    let sums = sums(width, fours);
    std::array::from_fn(|row| {
        let (a, b) = pairs[row];
        finished(sums[row], &a[4 * common..], &b[4 * common..])
    })
}

/// Returns the four parts of each pair's sum.
fn sums(width: Width, fours: Fours<'_>) -> [[f64; 4]; ROWS] {
    #[cfg(target_arch = "x86_64")]
    if width > Width::One
        && let Some(sums) = crate::lane::sums_of_products(fours)
    {
        return sums;
    }
    let _ = width;
    fours.map(|(a, b)| a.iter().zip(b).fold([0.0; 4], added))
}

/// Returns the sums with the products of four numbers more.
#[inline]
fn added(sums: [f64; 4], (a, b): (&[f64; 4], &[f64; 4])) -> [f64; 4] {
    [sums[0] + a[0] * b[0], sums[1] + a[1] * b[1], sums[2] + a[2] * b[2], sums[3] + a[3] * b[3]]
}

/// Returns the sum of these parts and of the products that are left.
#[inline]
fn finished(sums: [f64; 4], a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks(), b.as_chunks());
    let sums = a.iter().zip(b).fold(sums, added);
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(x, y)| x * y).sum();
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_products_side_by_side_have_the_bits_of_one_alone() {
        let numbers: Vec<f64> = (0..400).map(|k| f64::from(k * 37 % 101) / 7.0 - 6.9).collect();
        for count in [0, 1, 3, 4, 7, 16, 97] {
            let pairs = [0, 1, 2, 3]
                .map(|k| (&numbers[k..2 * k + count], &numbers[200 + 3 * k..200 + 4 * k + count]));
            let alone = pairs.map(|(a, b)| dot(a, b).to_bits());
            for width in Width::available() {
                let found = dots_within(width, pairs).map(f64::to_bits);
                assert_eq!(found, alone, "{count} numbers, {width:?}");
            }
        }
    }

    #[test]
    fn analytic_the_parts_of_a_sum_are_every_fourth_product() {
        // 2^53 + 1 rounds to 2^53: a one beside it is lost, one in another part is not, where both parts are joined first.
        let large = 9_007_199_254_740_992.0;
        let ones = [1.0; 8];
        assert_eq!(dot(&[large, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], &ones), large);
        assert_eq!(dot(&[large, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0], &ones), large + 2.0);
    }
}
