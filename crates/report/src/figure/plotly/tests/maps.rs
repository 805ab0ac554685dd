//! Heat maps, upper limits and logarithmic axes.

use super::*;
use crate::figure::{AxisScale, cell_edges};

fn heat(x_edges: Vec<f64>, y_edges: Vec<f64>, values: Vec<f64>, colour: Axis) -> Layer {
    Layer::Heat { x_edges, y_edges, values, colour, blank: "not run".to_owned(), texts: Vec::new() }
}

/// The layout of a panel with logarithmic axes.
fn decades(layers: Vec<Layer>) -> (Vec<Value>, Value) {
    let empty = Panel::new(
        Axis::new("noise i_n (A)").log10().range(0.01, 10.0),
        Axis::new("error (°)").log10().range(1e-3, 1.0),
    );
    let (chart, value) = chart(&figure(vec![layers.into_iter().fold(empty, Panel::with)]));
    (chart.data, value)
}

#[test]
fn law_cells_are_between_their_edges_in_the_colours_of_the_drawn_figure() {
    let values = vec![1.0, 2.0, NONE, 5.0];
    let layer = heat(vec![0.0, 1.0, 3.0], vec![0.0, 2.0, 4.0], values, Axis::new("share (%)"));
    let (data, value) = drawn(vec![layer]);
    let map = &data[0];
    assert_eq!(map["type"], "heatmap");
    assert_eq!((&map["x"], &map["y"]), (&json!([0, 1, 3]), &json!([0, 2, 4])));
    assert_eq!(map["z"], json!([[1, 2], [null, 5]]));
    assert_eq!((&map["zmin"], &map["zmax"]), (&json!(1), &json!(5)));
    let stops = map["colorscale"].as_array().expect("a scale");
    assert_eq!((&stops[0], &stops[9]), (&json!([0, "#fee825"]), &json!([1, "#440154"])));
    assert_eq!(map["colorbar"]["title"]["text"], "share (%)");
    // Edges at 0, 1 and 3 are not half way between any centres, those at 0, 2 and 4 are.
    assert_eq!(map["meta"]["x"], json!(["0 to 1 ms", "1 to 3 ms"]));
    assert_eq!(map["meta"]["y"], json!(["1 A", "3 A"]));
    assert_eq!(map["meta"]["values"], json!([["1 %", "2 %"], ["not run", "5 %"]]));
    assert_eq!(value["layout"]["hovermode"], "closest");
    assert_eq!(value["layout"]["yaxis"]["showgrid"], false);
}

#[test]
fn law_cells_without_a_value_are_hatched_and_in_the_legend() {
    // Of the second row the last two have none, of the third all.
    let layer = heat(vec![0.0, 1.0, 2.0, 3.0], vec![0.0, 1.0, 2.0, 3.0], vec![1.0; 4], Axis::new("n"));
    let (chart, _) = chart(&figure(vec![panel(vec![layer])]));
    let blank = &chart.data[1];
    assert_eq!(blank["x"], json!([1, 3, 3, 1, 1, null, 0, 3, 3, 0, 0, null]));
    assert_eq!(blank["y"], json!([1, 1, 2, 2, 1, null, 2, 2, 3, 3, 2, null]));
    assert_eq!(blank["fillpattern"]["shape"], "/");
    assert_eq!(chart.legend[0].entries[0].keys, [Key::Blank]);
    assert_eq!(chart.legend[0].entries[0].label, "not run");
    assert_eq!(blank["legendgroup"], json!(group(0, &chart.legend[0].entries[0].label)));
    // An edge that is no number takes both of its cells away.
    let (data, _) =
        drawn(vec![heat(vec![0.0, NONE, 2.0, 3.0], vec![0.0, 1.0], vec![1.0; 3], Axis::new("n"))]);
    assert_eq!((&data[0]["x"], &data[0]["z"]), (&json!([0, 2, 3]), &json!([[null, 1]])));
}

#[test]
fn law_logarithmic_colours_tell_real_values() {
    let colour = Axis::new("wrong (%)").range(0.01, 10.0).log10();
    let (data, _) =
        drawn(vec![heat(vec![0.0, 1.0, 2.0, 3.0], vec![0.0, 1.0], vec![0.1, 0.0, 100.0], colour)]);
    // Zero has the colour of the lower end, and what is beyond the upper one that of it.
    assert_eq!(data[0]["z"], json!([[-1, -2, 2]]));
    assert_eq!((&data[0]["zmin"], &data[0]["zmax"]), (&json!(-2), &json!(1)));
    assert_eq!(data[0]["meta"]["values"], json!([["0.1 %", "0 %", "100 %"]]));
    let bar = &data[0]["colorbar"];
    let texts = bar["ticktext"].as_array().expect("texts");
    let at = texts.iter().position(|text| text == "0.1").expect("a tick at 0.1");
    assert_eq!(bar["tickvals"][at], -1);
}

#[test]
fn law_numbers_stand_in_the_middle_of_cells_in_readable_ink() {
    let layer = |count: usize| Layer::Heat {
        x_edges: (0..=count).map(|i| 0.01 * 10f64.powf(2.0 * i as f64 / count as f64)).collect(),
        y_edges: vec![0.1, 0.4],
        values: (0..count).map(|i| i as f64).collect(),
        colour: Axis::new("n"),
        blank: String::new(),
        texts: (0..count).map(|i| format!("{i}.0")).collect(),
    };
    let (data, _) = decades(vec![layer(2)]);
    assert_eq!(data[1]["mode"], "text");
    assert_eq!(
        (&data[1]["x"], &data[1]["y"]),
        (&json!([0.031_622_776_6, 0.316_227_766]), &json!([0.2, 0.2]))
    );
    assert_eq!(data[1]["text"], json!(["0.0", "1.0"]));
    assert_eq!(data[1]["textfont"]["color"], json!(["#1a1a1a", "#ffffff"]));
    assert_eq!(data[1]["meta"]["cells"][0], json!([0.01, 0.1, 0.1, 0.4]));
    assert_eq!(decades(vec![layer(101)]).0.len(), 1);
}

#[test]
fn law_cells_are_read_at_the_centres_they_were_made_from() {
    let read = |centres: &[f64], scale| {
        let x = Axis { scale, ..Axis::new("x (V)") };
        let layer = heat(cell_edges(centres, scale), vec![0.0, 1.0], vec![1.0; 3], Axis::new("n"));
        let (chart, _) = chart(&figure(vec![Panel::new(x, Axis::new("y")).with(layer)]));
        chart.data[0]["meta"]["x"].clone()
    };
    assert_eq!(read(&[1.0, 2.0, 3.5], AxisScale::Linear), json!(["1 V", "2 V", "3.5 V"]));
    assert_eq!(read(&[1e-3, 5e-3, 1e-2], AxisScale::Log10), json!(["0.001 V", "0.005 V", "0.01 V"]));
    assert_eq!(read(&[0.7], AxisScale::Linear), json!(["0.7 V"]));
}

#[test]
fn law_names_of_cells_are_read_out() {
    let names = |all: [&str; 2]| Axis::categories("", all.map(String::from));
    let edges = || vec![-0.5, 0.5, 1.5];
    let layer = heat(edges(), edges(), vec![1.0; 4], Axis::new("%{x} (°)"));
    let (chart, value) = chart(&figure(vec![Panel::new(names(["a", "<b>"]), names(["c", "d"])).with(layer)]));
    assert_eq!(chart.data[0]["meta"]["x"], json!(["a", "&lt;b&gt;"]));
    assert_eq!(
        chart.data[0]["hovertemplate"],
        "%{customdata[0]}<br>%{customdata[1]}<br>&#37;{x}: %{customdata[2]}<extra></extra>"
    );
    assert_eq!(value["layout"]["yaxis"]["ticktext"], json!(["c", "d"]));
}

#[test]
fn law_upper_limits_are_a_bar_that_is_read_out_and_an_arrow_below() {
    let points = vec![(0.1, 0.02), (1.0, 0.0)];
    let (data, _) =
        decades(vec![Layer::UpperLimits { label: Some("none".into()), points, style: Style::Green }]);
    assert_eq!(data.len(), 3);
    for trace in &data {
        assert_eq!((&trace["x"], &trace["y"]), (&json!([0.1, 1]), &json!([0.02, null])));
        assert_eq!(trace["legendgroup"], data[0]["legendgroup"]);
    }
    assert!(data[0]["hovertemplate"].as_str().expect("a template").contains("at most %{y:.5~g}°"));
    assert_eq!((&data[2]["marker"]["symbol"], &data[2]["hoverinfo"]), (&json!("arrow-down"), &json!("skip")));
    assert_eq!((&data[0]["marker"]["standoff"], &data[2]["marker"]["standoff"]), (&json!(0.0), &json!(13.0)));
}

#[test]
fn law_logarithmic_axes_have_the_logarithms_of_their_range() {
    let points = vec![(0.0, 0.5), (0.1, -1.0), (1.0, 0.5)];
    let (data, value) = decades(vec![
        Layer::Line { label: None, points, style: Style::Blue },
        Layer::VerticalRule { label: Some("v".into()), x: 0.1 },
        Layer::HorizontalRule { label: Some("h".into()), y: 0.0 },
    ]);
    assert_eq!((&data[0]["x"], &data[0]["y"]), (&json!([null, 0.1, 1]), &json!([0.5, null, 0.5])));
    let layout = &value["layout"];
    assert_eq!((&layout["xaxis"]["type"], &layout["xaxis"]["range"]), (&json!("log"), &json!([-2, 1])));
    assert_eq!(layout["yaxis"]["range"], json!([-3, 0]));
    assert_eq!(value["logs"], json!(["yaxis", "xaxis"]));
    // Plotly takes values for shapes and logarithms for annotations.
    let shapes: Vec<_> =
        layout["shapes"].as_array().into_iter().flatten().filter(|s| s["type"] == "line").collect();
    assert_eq!((shapes.len(), &shapes[0]["x0"]), (1, &json!(0.1)));
    let notes = layout["annotations"].as_array().expect("annotations");
    assert!(notes.iter().any(|note| note["text"] == "v" && note["x"] == -1));
    assert!(notes.iter().all(|note| note["text"] != "h"));
}

#[test]
fn law_bands_down_to_nothing_leave_the_panel_and_are_read_out() {
    let points = vec![(0.1, 0.0, 0.1), (1.0, 0.01, 0.1)];
    let (data, _) = decades(vec![Layer::Band { label: None, points, style: Style::Blue }]);
    assert_eq!((&data[0]["x"], &data[0]["y"][1]), (&json!([0.1, 1]), &json!(0.01)));
    assert!(data[0]["y"][0].as_f64().is_some_and(|y| y > 0.0 && y < 1e-20));
    assert_eq!(data[1]["customdata"], json!([[0, 0.1], [0.01, 0.1]]));
}
