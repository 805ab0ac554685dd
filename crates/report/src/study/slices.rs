//! Choice of a sweep's points for a figure. Each mark is one point. Points of different settings are not averaged,
//! because the mean would depend on the choice of the points.

use super::place::text;
use super::{Coordinate, Study, StudyPoint};
use crate::figure::Style;

/// The largest number of curves in one panel.
pub(super) const MOST_CURVES: usize = 6;
/// Most panels that stand under each other for the values of one axis.
const MOST_PARTS: usize = 4;

/// Values of axes, by the axes' indices.
pub(super) type Values = Vec<(usize, Coordinate)>;

/// A curve of a panel.
#[derive(Clone, Debug)]
pub(super) struct Series {
    /// Empty for the only one.
    pub label: String,
    pub fixed: Values,
    pub style: Style,
    /// Shift within the space of a name, from −0.5 to 0.5.
    pub shift: f64,
}

/// The points that one panel shows.
#[derive(Clone, Debug)]
pub(super) struct Part {
    /// Empty for the only one.
    pub title: String,
    pub series: Vec<Series>,
}

/// The panels of a figure, and remarks on the points that it does not show.
#[derive(Clone, Debug)]
pub(super) struct Slices {
    pub parts: Vec<Part>,
    pub remarks: Vec<String>,
}

/// Chooses how the axes other than `over`, those of the figure, are shown. The first has a curve for each value if
/// `curves` is set, the next a panel for each value, and all others have the value of the study's best point. Of too
/// many numeric values some are shown, among them the first and the last; names are all shown.
pub(super) fn slices(study: &Study, over: &[usize], curves: bool) -> Slices {
    let mut others: Vec<usize> = study.varied().into_iter().filter(|axis| !over.contains(axis)).collect();
    // Names come first: they are what readers compare. Of numbers few values are easier to read.
    let is_number = |axis: usize| matches!(values(study, axis).first(), Some(Coordinate::Number(_)));
    others.sort_by_key(|&axis| (is_number(axis), values(study, axis).len()));
    let mut others = others.into_iter();
    let mut remarks = Vec::new();
    let curves = if curves { others.next() } else { None };
    let parts = others.next();
    let held: Vec<usize> = others.collect();
    let best = study.best.and_then(|best| study.points.get(best)).or(study.points.first());
    let value = |axis: &usize| Some((*axis, best?.coordinates.get(*axis)?.clone()));
    let fixed: Values = held.iter().filter_map(value).collect();
    if !fixed.is_empty() {
        remarks.push(format!("{}, as at the best point", said(study, &fixed)));
    }
    let mut groups = vec![vec![fixed.clone()]];
    if let Some(axis) = curves {
        let all = values(study, axis);
        let longer = |value: Coordinate| [&fixed[..], &[(axis, value)]].concat();
        groups = if is_number(axis) {
            vec![thinned(study, axis, all, MOST_CURVES, &mut remarks).into_iter().map(longer).collect()]
        } else {
            let each = all.len().div_ceil(all.len().div_ceil(MOST_CURVES).max(1)).max(1);
            all.chunks(each).map(|some| some.iter().cloned().map(longer).collect()).collect()
        };
    }
    let mut titles: Vec<Values> = vec![Vec::new()];
    if let Some(axis) = parts {
        let some = thinned(study, axis, values(study, axis), MOST_PARTS, &mut remarks);
        titles = some.into_iter().map(|value| vec![(axis, value)]).collect();
    }
    let part = |title: &Values, group: &Vec<Values>| {
        let one = |(index, fixed): (usize, &Values)| Series {
            label: curves.map_or_else(String::new, |axis| {
                let own: Values = fixed.iter().filter(|(known, _)| *known == axis).cloned().collect();
                said(study, &own)
            }),
            fixed: [&fixed[..], title].concat(),
            style: Style::nth(index),
            shift: 0.7 * ((index as f64 + 0.5) / group.len() as f64 - 0.5),
        };
        Part { title: said(study, title), series: group.iter().enumerate().map(one).collect() }
    };
    let parts =
        titles.iter().flat_map(|title| groups.iter().map(|group| part(title, group)).collect::<Vec<_>>());
    Slices { parts: parts.collect(), remarks }
}

/// Returns some of an axis's values in even steps, with the first and the last, and adds a remark about the choice.
fn thinned(
    study: &Study,
    axis: usize,
    all: Vec<Coordinate>,
    most: usize,
    remarks: &mut Vec<String>,
) -> Vec<Coordinate> {
    let count = all.len();
    if count <= most {
        return all;
    }
    remarks.push(format!("{most} of {count} values of {}", study.axes[axis].name()));
    (0..most).map(|k| all[(k * (count - 1) + (most - 1) / 2) / (most - 1)].clone()).collect()
}

/// Returns the values in words: names alone, numbers with the name and unit of their axis.
fn said(study: &Study, values: &Values) -> String {
    let one = |(axis, value): &(usize, Coordinate)| match value {
        Coordinate::Name(name) => name.clone(),
        Coordinate::Number(_) => {
            let axis = &study.axes[*axis];
            format!("{} = {} {}", axis.name(), text(value), axis.unit).trim_end().to_owned()
        }
    };
    values.iter().map(one).collect::<Vec<_>>().join(", ")
}

/// Returns the distinct values on an axis: numbers by size, then names in the order of their first appearance.
pub(super) fn values(study: &Study, axis: usize) -> Vec<Coordinate> {
    let mut numbers: Vec<f64> = Vec::new();
    let mut names: Vec<&String> = Vec::new();
    for point in &study.points {
        match point.coordinates.get(axis) {
            Some(Coordinate::Number(number)) if number.is_finite() => numbers.push(*number),
            Some(Coordinate::Name(name)) if !names.contains(&name) => names.push(name),
            _ => (),
        }
    }
    numbers.sort_by(f64::total_cmp);
    numbers.dedup();
    let names = names.into_iter().map(|name| Coordinate::Name(name.clone()));
    numbers.into_iter().map(Coordinate::Number).chain(names).collect()
}

/// Returns the points with these values.
pub(super) fn with<'a>(study: &'a Study, wanted: &Values) -> impl Iterator<Item = &'a StudyPoint> {
    let matches =
        |point: &&StudyPoint| wanted.iter().all(|(axis, value)| point.coordinates.get(*axis) == Some(value));
    study.points.iter().filter(matches)
}

/// Returns the point of each curve at each value of an axis; none if no such point was run.
pub(super) fn along<'a>(
    study: &'a Study,
    axis: usize,
    places: &[Coordinate],
    series: &[Series],
) -> Vec<Vec<Option<&'a StudyPoint>>> {
    let at = |series: &Series, value: &Coordinate| {
        with(study, &[&series.fixed[..], &[(axis, value.clone())]].concat()).next()
    };
    series.iter().map(|series| places.iter().map(|value| at(series, value)).collect()).collect()
}
