//! Lanes as horizontal bars.

use super::super::Lane;
use super::super::style::fill;
use super::markup::{markup, quantity, template};
use super::traces::{Place, X_DIGITS};
use super::{Chart, number, numbers};
use serde_json::{Value, json};

type Span = (f64, f64, usize);

/// Adds a trace for each category in each lane. If all values at one x are read out together, adds a further trace for
/// each lane that only names its state, because bars would be read out at their ends.
pub(super) fn add(chart: &mut Chart, place: &Place, lanes: &[Lane], categories: &[String]) {
    for (index, lane) in lanes.iter().enumerate() {
        let middle = (lanes.len() - index) as f64 - 0.5;
        // Written so that a NaN is skipped.
        let shown = |(from, to, category): &&Span| {
            from < to && (to - from).is_finite() && *category < categories.len()
        };
        let ends = |&(from, to, category): &Span| (place.x_end(from), place.x_end(to), category);
        let spans: Vec<_> = lane.spans.iter().filter(shown).map(ends).collect();
        for (category, label) in categories.iter().enumerate() {
            let spans: Vec<_> = spans.iter().filter(|span| span.2 == category).copied().collect();
            if !spans.is_empty() {
                let trace = bars(place, lane, &spans, category, middle);
                place.push(chart, Some(label), trace);
            }
        }
        if place.unified && !spans.is_empty() {
            let mut trace = reading(lane, spans, categories, middle);
            trace["xaxis"] = json!(place.x);
            trace["yaxis"] = json!(place.y);
            chart.data.push(trace);
        }
    }
}

fn bars(place: &Place, lane: &Lane, spans: &[Span], category: usize, middle: f64) -> Value {
    let mut trace = json!({
        "type": "bar",
        "orientation": "h",
        "base": numbers(spans.iter().map(|span| span.0)),
        "x": numbers(spans.iter().map(|span| span.1 - span.0)),
        "y": numbers(spans.iter().map(|_| middle)),
        "width": 0.72,
        "marker": marker(category),
        "showlegend": false,
    });
    if place.unified {
        trace["hoverinfo"] = json!("skip");
        return trace;
    }
    let (name, unit) = quantity(&place.panel.x.label);
    let (name, unit) = (template(name), template(&unit));
    trace["customdata"] = spans.iter().map(|span| json!([number(span.0), number(span.1)])).collect();
    trace["hovertemplate"] = json!(format!(
        "{}: %{{fullData.name}}<br>{name}: %{{customdata[0]{X_DIGITS}}}{unit} to \
         %{{customdata[1]{X_DIGITS}}}{unit}<extra></extra>",
        template(&lane.label)
    ));
    trace
}

/// Returns an invisible staircase along the middle of a lane.
fn reading(lane: &Lane, mut spans: Vec<Span>, categories: &[String], middle: f64) -> Value {
    spans.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut x, mut y, mut text) = (Vec::new(), Vec::new(), Vec::new());
    for (index, &(from, to, category)) in spans.iter().enumerate() {
        x.push(number(from));
        y.push(json!(middle));
        text.push(markup(&categories[category]));
        if spans.get(index + 1).is_none_or(|next| next.0 > to) {
            // Blank until the next span.
            x.push(number(to));
            y.push(Value::Null);
            text.push(String::new());
        }
    }
    json!({
        "type": "scatter",
        "mode": "lines",
        "line": {"shape": "hv", "width": 0, "color": "rgba(0,0,0,0)"},
        "x": x,
        "y": y,
        "text": text,
        "hovertemplate": format!("{}: %{{text}}<extra></extra>", template(&lane.label)),
        "showlegend": false,
    })
}

/// Returns a bar's marker in the manner of a category.
fn marker(category: usize) -> Value {
    let look = fill(category);
    let mut marker = json!({"color": look.ground.css(), "line": {"width": 0}});
    if look.slope != 0.0 {
        marker["pattern"] = json!({
            "shape": if look.slope > 0.0 { "\\" } else { "/" }, "size": 6, "solidity": 0.2,
            "fgcolor": look.line.css(), "bgcolor": look.ground.css(),
        });
    }
    marker
}
