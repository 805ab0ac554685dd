//! Errors over two axes.

use super::place::place;
use super::{Caption, NO_ANSWER, Study};
use crate::figure::{Axis, Figure, Layer, Panel};

/// Colours are logarithmic above this ratio of the largest and the least error.
const WIDE: f64 = 30.0;

/// Rms error over two axes of the study as a heat map, pooled over all others. Numbers in very uneven distances are set
/// evenly, as names are.
pub(super) fn heat(caption: &Caption, study: &Study, x: usize, y: usize) -> Figure {
    let (columns, rows) = (place(study, x, true), place(study, y, true));
    let (mut failing, mut missing) = (false, false);
    let mut values = Vec::with_capacity(columns.values.len() * rows.values.len());
    for row in &rows.values {
        for column in &columns.values {
            let wanted = [(x, column), (y, row)];
            let answers = study.answers(&wanted);
            let value = if answers { study.at(&wanted).rms_deg.value } else { f64::NAN };
            failing |= !answers;
            missing |= answers && !value.is_finite();
            values.push(value);
        }
    }
    let positive = values.iter().copied().filter(|value| *value > 0.0 && value.is_finite());
    let (low, high) =
        positive.fold((f64::INFINITY, 0.0f64), |(low, high), value| (low.min(value), high.max(value)));
    let colour = Axis::new("rms error of the axis (°)");
    // Rows of names need no more than two lines each; a large grid is nearly as high as wide.
    let height = (220 + 34 * u32::try_from(rows.values.len()).unwrap_or(u32::MAX).min(12)).max(380);
    // Many names stand upright.
    let height = height + if columns.named && columns.values.len() > 6 { 130 } else { 0 };
    let none = !missing && !values.iter().any(|value| value.is_finite());
    let blank = match (failing, missing) {
        (true, true) => format!("{NO_ANSWER}, or not run"),
        (true, false) => NO_ANSWER.to_owned(),
        (false, _) => "not run".to_owned(),
    };
    let cells = Panel::new(columns.axis, rows.axis).with(Layer::Heat {
        x_edges: columns.edges,
        y_edges: rows.edges,
        values,
        colour: if high > WIDE * low { colour.log10() } else { colour },
        blank,
        numbers: true,
    });
    let mut remarks = study.remark_on_others(&[x, y]);
    if none {
        remarks.push("every cell hatched: at none are 99 % of starts answered rightly".to_owned());
    }
    caption.figure(&remarks, height, vec![cells])
}
