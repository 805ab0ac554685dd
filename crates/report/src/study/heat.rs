//! Errors over two axes.

use super::place::place;
use super::slices::{Part, Slices, slices, with};
use super::{Caption, Interval, NO_ANSWER, Study, StudyPoint};
use crate::figure::{Axis, Figure, Layer, Panel};

/// Colours are logarithmic above this ratio of the largest and the least error.
const WIDE: f64 = 30.0;
/// Fewest and most digits of the numbers in cells.
const DIGITS: (i32, i32) = (2, 3);

/// Rms error over two axes of the study as heat maps in one scale of colours, other axes as [`slices`] says. Cells in which more
/// than 1 % of starts have no right answer are hatched. Numbers in very uneven distances are set evenly, as names are.
pub(super) fn heat(caption: &Caption, study: &Study, x: usize, y: usize) -> Figure {
    let (columns, rows) = (place(study, x, true), place(study, y, true));
    let Slices { parts, mut remarks } = slices(study, &[x, y], false);
    let cells = |part: &Part| -> Vec<Option<&StudyPoint>> {
        let fixed = &part.series[0].fixed;
        let at = |row, column| {
            with(study, &[&fixed[..], &[(x, Clone::clone(column)), (y, Clone::clone(row))]].concat()).next()
        };
        rows.values.iter().flat_map(|row| columns.values.iter().map(move |column| at(row, column))).collect()
    };
    let found: Vec<Vec<Option<&StudyPoint>>> = parts.iter().map(cells).collect();
    let answered: Vec<&StudyPoint> =
        found.iter().flatten().flatten().copied().filter(|point| !point.fails()).collect();
    let errors = answered.iter().map(|point| point.rms_deg.value).filter(|rms| *rms > 0.0 && rms.is_finite());
    let (low, high) = errors.fold((f64::INFINITY, 0.0f64), |(low, high), rms| (low.min(rms), high.max(rms)));
    let mut colour = Axis::new("rms error of the axis (°)");
    if high > WIDE * low {
        colour = colour.log10();
    }
    if high > low {
        colour = colour.range(low, high);
    }
    let digits = digits(answered.iter().map(|point| point.rms_deg));
    let panel = |(part, found): (&Part, &Vec<Option<&StudyPoint>>)| {
        let value = |point: Option<&StudyPoint>| match point {
            Some(point) if !point.fails() => point.rms_deg.value,
            _ => f64::NAN,
        };
        let failing = found.iter().flatten().any(|point| point.fails());
        let missing =
            found.iter().any(|point| !point.is_some_and(|p| p.fails() || p.rms_deg.value.is_finite()));
        let blank = match (failing, missing) {
            (true, true) => format!("{NO_ANSWER}, or not run"),
            (true, false) => NO_ANSWER.to_owned(),
            (false, _) => "not run".to_owned(),
        };
        Panel::new(columns.axis.clone(), rows.axis.clone()).titled(&part.title).with(Layer::Heat {
            x_edges: columns.edges.clone(),
            y_edges: rows.edges.clone(),
            values: found.iter().copied().map(value).collect(),
            colour: colour.clone(),
            blank,
            digits,
        })
    };
    let panels: Vec<Panel> = parts.iter().zip(&found).map(panel).collect();
    // Rows of names need no more than two lines each; a large grid is nearly as high as wide.
    let one = (220 + 34 * u32::try_from(rows.values.len()).unwrap_or(u32::MAX).min(12)).max(380);
    let more = one - if panels.len() > 1 { 120 } else { 0 };
    // Many names stand upright.
    let names = if columns.named && columns.values.len() > 6 { 130 } else { 0 };
    let height = one + names + more * (u32::try_from(panels.len()).unwrap_or(1) - 1);
    if answered.is_empty() && found.iter().flatten().flatten().any(|point| point.fails()) {
        remarks.push("every cell hatched: at none are 99 % of starts answered rightly".to_owned());
    }
    caption.figure(&remarks, height.min(4000), panels)
}

/// So many significant digits that even of the least certain error none is beyond two of half its interval's width.
fn digits(errors: impl Iterator<Item = Interval>) -> usize {
    let (fewest, most) = DIGITS;
    let of = |error: Interval| {
        let places = [error.value, (error.high - error.low) / 2.0].map(|x| x.log10().floor());
        // Of what has no interval nothing is known.
        #[expect(clippy::cast_possible_truncation, reason = "a few digits")]
        if places.iter().all(|place| place.is_finite()) { (places[0] - places[1]) as i32 + 2 } else { fewest }
    };
    let least = errors.map(of).min().unwrap_or(most);
    usize::try_from(least.clamp(fewest, most)).unwrap_or(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_cells_have_no_digits_beyond_their_intervals() {
        let of = |value: f64, half: f64| Interval { value, low: value - half, high: value + half };
        assert_eq!(digits([of(0.752, 0.023), of(1.41, 0.05)].into_iter()), 3);
        assert_eq!(digits([of(0.752, 0.12), of(1.41, 0.05)].into_iter()), 2);
        assert_eq!(digits([of(0.752, 0.000_01)].into_iter()), 3);
        assert_eq!(digits([of(0.752, f64::NAN)].into_iter()), 2);
    }
}
