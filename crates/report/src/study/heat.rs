//! Errors over two axes.

use super::place::place;
use super::slices::{Part, Slices, slices, with};
use super::{Caption, Study, StudyPoint};
use crate::figure::{Axis, Figure, Layer, Panel};

/// Colours are logarithmic above this ratio of the largest and the least error.
const WIDE: f64 = 30.0;

/// Returns heat maps of the rms error over two axes of the study, with one colour scale; other axes are shown as
/// [`slices`] describes. Cells in which more than 1 % of starts have no right answer are hatched. Very unevenly spaced
/// numbers are set at equal distances, like names.
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
    let panel = |(part, found): (&Part, &Vec<Option<&StudyPoint>>)| {
        let value = |point: Option<&StudyPoint>| match point {
            Some(point) if !point.fails() => point.rms_deg.value,
            _ => f64::NAN,
        };
        let text = |point: Option<&StudyPoint>| match point {
            Some(point) if !point.fails() => point.rms_deg.alone(),
            _ => String::new(),
        };
        let failing = found.iter().flatten().any(|point| point.fails());
        let missing =
            found.iter().any(|point| !point.is_some_and(|p| p.fails() || p.rms_deg.value.is_finite()));
        let blank = match (failing, missing) {
            (true, true) => format!("{}, or not run", study.no_answer()),
            (true, false) => study.no_answer().to_owned(),
            (false, _) => "not run".to_owned(),
        };
        Panel::new(columns.axis.clone(), rows.axis.clone()).titled(&part.title).with(Layer::Heat {
            x_edges: columns.edges.clone(),
            y_edges: rows.edges.clone(),
            values: found.iter().copied().map(value).collect(),
            colour: colour.clone(),
            blank,
            texts: found.iter().copied().map(text).collect(),
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
