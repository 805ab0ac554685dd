//! Values of one current of a grid, in order.

pub(super) fn one_sided(axis: &[f64]) -> bool {
    axis[0] == 0.0 || axis[axis.len() - 1] == 0.0
}

/// Returns the distinct values in ascending order; values that differ by rounding only count as one.
pub(super) fn distinct(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    let span = sorted.last().unwrap_or(&0.0) - sorted.first().unwrap_or(&0.0);
    let close = 1e-6 * span;
    sorted.dedup_by(|next, kept| *next - *kept <= close);
    // A zero that rounding has moved is still where no current flows.
    for value in &mut sorted {
        if value.abs() <= close {
            *value = 0.0;
        }
    }
    sorted
}

pub(super) fn nearest(axis: &[f64], value: f64) -> usize {
    let after = axis.partition_point(|x| *x < value).min(axis.len() - 1);
    if after > 0 && value - axis[after - 1] < axis[after] - value { after - 1 } else { after }
}

/// Returns the cell that contains zero, and where in it.
pub(super) fn bracket(axis: &[f64]) -> (usize, f64) {
    let after = axis.partition_point(|x| *x <= 0.0).clamp(1, axis.len() - 1);
    (after - 1, -axis[after - 1] / (axis[after] - axis[after - 1]))
}
