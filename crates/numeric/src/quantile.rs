//! Position of a quantile in sorted values.

use crate::whole;

/// Returns the index of the quantile `share` among `count` sorted values: the smallest value such that at least this
/// share of the values are not larger. None if there are no values.
///
/// ```
/// use standstill_numeric::rank;
///
/// // Of a hundred values 95 are not above the 95th.
/// assert_eq!((rank(0.95, 100), rank(0.5, 3), rank(0.0, 7), rank(1.0, 7)), (Some(94), Some(1), Some(0), Some(6)));
/// assert_eq!(rank(0.5, 0), None);
/// ```
pub fn rank(share: f64, count: u64) -> Option<u64> {
    let last = count.checked_sub(1)?;
    let among = share * count as f64;
    // 0.07 · 100 is 7.000000000000001: what arithmetic rounds makes no other value.
    let least = (among - 1e-12 * among).ceil().max(1.0);
    Some((whole::<u64>(least) - 1).min(last))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_at_least_the_share_does_not_exceed_the_quantile_and_less_of_any_value_before() {
        for count in 1..400_u64 {
            for percent in 1..100_u64 {
                let place = rank(percent as f64 / 100.0, count).expect("there");
                // In whole numbers: (place + 1)/count ≥ percent/100, and place/count is not.
                assert!(
                    (place + 1) * 100 >= percent * count && place * 100 < percent * count,
                    "{percent} {count}"
                );
            }
        }
    }
}
