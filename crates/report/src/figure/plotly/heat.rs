//! Heat maps: coloured cells with a colour bar, and hatched areas for cells without a value.

use super::super::axis::Axis;
use super::super::colour::{colour, ink_on, stops};
use super::super::heat::{MOST_NUMBERS, range};
use super::super::number::digits;
use super::super::style::{FRAME, GRID, HATCH, WHITE};
use super::super::text::wrap;
use super::super::{AxisScale, Ticks, ticks};
use super::markup::{markup, quantity, template};
use super::traces::{Place, nearest};
use super::{Chart, number, numbers};
use serde_json::{Value, json};

/// Number of digits in read-outs.
const DIGITS: i32 = 5;

/// A cell's value, and how it is written.
type Cell<'a> = (f64, &'a str);

/// The columns or the rows of a heat map.
struct Cells {
    /// Edges, all finite; edges that a logarithmic axis cannot show are far below the range.
    edges: Vec<f64>,
    /// Index of the layer's row or column for each pair of edges; none if an edge in between is not a number.
    index: Vec<Option<usize>>,
    /// Text read out for each pair.
    texts: Vec<String>,
}

impl Cells {
    fn new(edges: &[f64], axis: &Axis, end: impl Fn(f64) -> f64) -> Self {
        let known: Vec<_> = edges.iter().enumerate().filter(|(_, edge)| edge.is_finite()).collect();
        let index = known.windows(2).map(|pair| (pair[1].0 == pair[0].0 + 1).then_some(pair[0].0)).collect();
        let values: Vec<f64> = known.iter().map(|(_, edge)| **edge).collect();
        Self { edges: values.iter().copied().map(end).collect(), index, texts: texts(&values, axis) }
    }
}

/// Returns the text for each pair of edges: a name, a centre, or else both edges.
fn texts(edges: &[f64], axis: &Axis) -> Vec<String> {
    let middle = |pair: &[f64]| 0.5 * (pair[0] + pair[1]);
    if matches!(axis.ticks, Ticks::Named(_)) {
        return edges.windows(2).map(|pair| nearest(axis, middle(pair))).collect();
    }
    let unit = markup(&quantity(&axis.label).1);
    let text = |value: f64| digits(value, DIGITS);
    match centres(edges, axis.scale) {
        Some(centres) => centres.iter().map(|centre| format!("{}{unit}", text(*centre))).collect(),
        None => {
            edges.windows(2).map(|pair| format!("{} to {}{unit}", text(pair[0]), text(pair[1]))).collect()
        }
    }
}

/// Returns the centres of which [`super::super::cell_edges`] makes these edges, if there are such.
fn centres(edges: &[f64], scale: AxisScale) -> Option<Vec<f64>> {
    let places: Vec<f64> = edges.iter().map(|edge| scale.even(*edge)).collect();
    let middle = |pair: &[f64]| 0.5 * (pair[0] + pair[1]);
    let mut centre = middle(places.get(..2)?);
    let mut found = vec![centre];
    for edge in &places[1..places.len() - 1] {
        centre = 2.0 * edge - centre;
        found.push(centre);
    }
    let cells = || places.windows(2).zip(&found);
    let inside = cells().all(|(pair, centre)| pair[0] < *centre && *centre < pair[1]);
    // The last cell is symmetric, as the first is.
    let symmetric =
        |(pair, centre): (&[f64], &f64)| (middle(pair) - centre).abs() < 1e-6 * (pair[1] - pair[0]);
    let fits = inside && cells().next_back().is_some_and(symmetric);
    fits.then(|| found.into_iter().map(|place| scale.value(place)).collect())
}

pub(super) fn add(
    chart: &mut Chart,
    place: &Place,
    (x_edges, y_edges): (&[f64], &[f64]),
    (values, said, blank): (&[f64], &[String], &str),
    axis: &Axis,
) {
    let columns = Cells::new(x_edges, &place.panel.x, |edge| place.x_end(edge));
    let rows = Cells::new(y_edges, &place.panel.y, |edge| place.y_end(edge));
    if columns.index.is_empty() || rows.index.is_empty() {
        return;
    }
    let per_row = x_edges.len() - 1;
    let value = |row: Option<usize>, column: Option<usize>| {
        row.zip(column)
            .and_then(|(row, column)| values.get(row * per_row + column))
            .copied()
            .unwrap_or(f64::NAN)
    };
    let text = |row: Option<usize>, column: Option<usize>| {
        let text = row.zip(column).and_then(|(row, column)| said.get(row * per_row + column));
        text.map_or("", String::as_str)
    };
    let cells: Vec<Vec<Cell<'_>>> = rows
        .index
        .iter()
        .map(|row| {
            let cell = |column: &Option<usize>| (value(*row, *column), text(*row, *column));
            columns.index.iter().map(cell).collect()
        })
        .collect();

    let (low, high) = range(values, axis);
    let [zmin, zmax] = [low, high].map(|end| axis.scale.even(end));
    let z = |value: f64| if axis.scale.has(value) || value.is_nan() { axis.scale.even(value) } else { zmin };
    let ground = |value: f64| colour((z(value) - zmin) / (zmax - zmin));
    let scale: Value = stops().map(|(share, stop)| json!([number(share), stop.hex()])).collect();
    let (of_x, of_y) = (quantity(&place.panel.x.label).0, quantity(&place.panel.y.label).0);
    let (name, unit) = quantity(&axis.label);
    let unit = markup(&unit);
    let read = |&(value, text): &Cell<'_>| match (value.is_finite(), text) {
        (false, _) => markup(blank),
        (true, "") => format!("{}{unit}", digits(value, DIGITS)),
        (true, text) => format!("{}{unit}", markup(text)),
    };
    let line = |name: &str, index| match name {
        "" => format!("%{{customdata[{index}]}}"),
        name => format!("{}: %{{customdata[{index}]}}", template(name)),
    };
    let trace = json!({
        "type": "heatmap",
        "xaxis": place.x,
        "yaxis": place.y,
        "x": numbers(columns.edges.iter().copied()),
        "y": numbers(rows.edges.iter().copied()),
        "z": each(&cells, |cell| number(if cell.0.is_finite() { z(cell.0) } else { f64::NAN })),
        "zmin": number(zmin),
        "zmax": number(zmax),
        "colorscale": scale,
        "showscale": values.iter().any(|value| axis.scale.has(*value)),
        "colorbar": colour_bar(axis, (low, high), place),
        "showlegend": false,
        // Scripts make the read-outs of the cells of these parts.
        "meta": {"x": columns.texts, "y": rows.texts, "values": each(&cells, |cell| json!(read(cell)))},
        "hovertemplate": format!(
            "{}<br>{}<br>{}<extra></extra>",
            line(of_x, 0),
            line(of_y, 1),
            line(name, 2)
        ),
    });
    chart.data.push(trace);
    blanks(chart, place, &columns, &rows, &cells, blank);
    if cells.iter().map(Vec::len).sum::<usize>() <= MOST_NUMBERS {
        written(chart, place, &columns, &rows, &cells, |value| ink_on(ground(value)).hex());
    }
}

/// Adds the texts of the values in cells, as a trace of texts. Texts that Plotly's heat map writes itself have one
/// colour, are off centre on logarithmic axes and shrink. Scripts hide the texts if one does not fit its cell.
fn written(
    chart: &mut Chart,
    place: &Place,
    columns: &Cells,
    rows: &Cells,
    cells: &[Vec<Cell<'_>>],
    ink: impl Fn(f64) -> String,
) {
    let middle =
        |scale: AxisScale, pair: &[f64]| scale.value(0.5 * (scale.even(pair[0]) + scale.even(pair[1])));
    let (mut x, mut y, mut text, mut inks, mut areas) = (vec![], vec![], vec![], vec![], vec![]);
    for (tall, values) in rows.edges.windows(2).zip(cells) {
        let there = |(_, (value, said)): &(_, &Cell<'_>)| value.is_finite() && !said.is_empty();
        for (wide, (value, said)) in columns.edges.windows(2).zip(values).filter(there) {
            x.push(middle(place.panel.x.scale, wide));
            y.push(middle(place.panel.y.scale, tall));
            text.push(*said);
            inks.push(ink(*value));
            areas.push(numbers([wide[0], wide[1], tall[0], tall[1]].into_iter()));
        }
    }
    if !text.is_empty() {
        chart.data.push(json!({
            "type": "scatter",
            "mode": "text",
            "x": numbers(x.into_iter()),
            "y": numbers(y.into_iter()),
            "text": text,
            "textfont": {"size": 12, "color": inks},
            "meta": {"cells": areas},
            "hoverinfo": "skip",
            "showlegend": false,
            "xaxis": place.x,
            "yaxis": place.y,
        }));
    }
}

/// Returns a value for each cell, row by row.
fn each(cells: &[Vec<Cell<'_>>], of: impl Fn(&Cell<'_>) -> Value) -> Value {
    cells.iter().map(|row| row.iter().map(&of).collect::<Value>()).collect()
}

fn colour_bar(axis: &Axis, range: (f64, f64), place: &Place) -> Value {
    let (bottom, top, height) = place.tall;
    let ticks = ticks::vertical(axis, range, height, 120.0);
    let text = |text: &str| text.lines().map(markup).collect::<Vec<_>>().join("<br>");
    let label: Vec<_> = wrap(&axis.label, 14.0, height).iter().map(|line| markup(line)).collect();
    json!({
        "x": 1,
        "xpad": 12,
        "y": 0.5 * (bottom + top),
        "ypad": 0,
        "len": top - bottom,
        "thickness": 16,
        "outlinecolor": FRAME.css(),
        "outlinewidth": 1,
        "ticks": "outside",
        "ticklen": 4,
        "tickcolor": FRAME.css(),
        "tickfont": {"size": 12},
        "tickmode": "array",
        "tickvals": numbers(ticks.iter().map(|tick| axis.scale.even(tick.at))),
        "ticktext": ticks.iter().map(|tick| text(&tick.text)).collect::<Value>(),
        "title": {"text": label.join("<br>"), "side": "right", "font": {"size": 13}},
    })
}

/// Adds hatched rectangles for cells without a value, one for each contiguous part of a row, because heat maps of
/// Plotly have no hatching.
fn blanks(
    chart: &mut Chart,
    place: &Place,
    columns: &Cells,
    rows: &Cells,
    cells: &[Vec<Cell<'_>>],
    meaning: &str,
) {
    let mut areas = Vec::new();
    for (row, values) in cells.iter().enumerate() {
        let mut start = 0;
        for run in values.chunk_by(|a, b| a.0.is_finite() == b.0.is_finite()) {
            let end = start + run.len();
            if !run[0].0.is_finite() {
                areas.push([columns.edges[start], columns.edges[end], rows.edges[row], rows.edges[row + 1]]);
            }
            start = end;
        }
    }
    hatched(chart, place, &areas, Some(meaning), &WHITE.css());
}

/// Adds hatched rectangles, given by left, right, bottom and top, on this background.
pub(super) fn hatched(
    chart: &mut Chart,
    place: &Place,
    areas: &[[f64; 4]],
    meaning: Option<&str>,
    ground: &str,
) {
    if areas.is_empty() {
        return;
    }
    let (mut x, mut y) = (Vec::new(), Vec::new());
    for [left, right, bottom, top] in areas.iter().map(|area| area.map(number)) {
        x.extend([&left, &right, &right, &left, &left, &Value::Null].map(Value::clone));
        y.extend([&bottom, &bottom, &top, &top, &bottom, &Value::Null].map(Value::clone));
    }
    let trace = json!({
        "type": "scatter",
        "mode": "lines",
        "x": x,
        "y": y,
        "line": {"color": GRID.css(), "width": 0.5},
        "fill": "toself",
        "fillcolor": ground,
        "fillpattern": {"shape": "/", "size": 6, "solidity": 0.15, "fgcolor": HATCH.css(), "bgcolor": ground},
        "hoverinfo": "skip",
        "showlegend": false,
    });
    place.push(chart, meaning, trace);
}
