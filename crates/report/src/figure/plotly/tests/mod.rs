mod maps;

use super::*;
use crate::figure::legend::Key;
use crate::figure::{Lane, Style};

fn figure(panels: Vec<Panel>) -> Figure {
    Figure { title: "t".into(), subtitle: None, width: 900, height: 480, panels }
}

fn panel(layers: Vec<Layer>) -> Panel {
    let empty = Panel::new(Axis::new("time t (ms)").range(0.0, 4.0), Axis::new("current i_a (A)"));
    layers.into_iter().fold(empty, Panel::with)
}

/// The traces and the whole description of one panel.
fn drawn(layers: Vec<Layer>) -> (Vec<Value>, Value) {
    let (chart, value) = chart(&figure(vec![panel(layers)]));
    (chart.data, value)
}

const NONE: f64 = f64::NAN;

#[test]
fn law_lines_break_at_gaps() {
    let points = vec![(0.0, 1.0), (1.0, NONE), (2.0, 3.25), (3.0, f64::INFINITY), (NONE, 1.0)];
    let (data, _) = drawn(vec![Layer::Line { label: Some("i_a".into()), points, style: Style::Vermilion }]);
    assert_eq!(data[0]["x"], json!([0, 1, 2, 3, null]));
    assert_eq!(data[0]["y"], json!([1, null, 3.25, null, 1]));
    assert_eq!(data[0]["mode"], "lines");
    assert_eq!(data[0]["line"]["dash"], "7px,3px");
    assert_eq!(data[0]["line"]["color"], "rgb(213,94,0)");
    assert_eq!(data[0]["connectgaps"], false);
    assert_eq!(data[0]["name"], "i<sub>a</sub>");
    // Values between two gaps are seen as points.
    assert_eq!((&data[1]["mode"], &data[1]["x"]), (&json!("markers"), &json!([0, 2])));
    assert_eq!(data[1]["legendgroup"], data[0]["legendgroup"]);
}

#[test]
fn law_steps_hold_until_the_next_point() {
    let points = vec![(0.0, 1.0), (1.0, 2.0)];
    let (data, value) = drawn(vec![Layer::Steps { label: None, points, style: Style::Blue }]);
    assert_eq!(data[0]["line"]["shape"], "hv");
    assert_eq!(data[0]["line"]["dash"], "solid");
    assert_eq!(value["layout"]["hovermode"], "x unified");
    // Without a label there is no name to read out.
    assert_eq!(data[0]["hovertemplate"], "%{y:.5~g} A<extra></extra>");
}

/// A trace of seconds has a million points; a page of them all would have a hundred megabytes.
#[test]
fn law_long_lines_keep_their_ends_extremes_and_gaps_in_few_points() {
    let spike = |i: u32| match i {
        123_456 => 9.0,
        123_457 => -9.0,
        200_000 => NONE,
        i => f64::from(i % 7),
    };
    let points = |count: u32| (0..count).map(|i| (4.0 * f64::from(i) / f64::from(count), spike(i))).collect();
    let of = |count| drawn(vec![Layer::Line { label: None, points: points(count), style: Style::Blue }]).0;
    let values = |data: &[Value], name: &str| -> Vec<Option<f64>> {
        data[0][name].as_array().expect("numbers").iter().map(Value::as_f64).collect()
    };
    assert_eq!(values(&of(20_000), "y").len(), 20_000);
    let long = of(300_000);
    let (x, y) = (values(&long, "x"), values(&long, "y"));
    assert!((10_000..=20_004).contains(&x.len()), "{}", x.len());
    assert!(x.is_sorted() && x[0] == Some(0.0) && *x.last().expect("points") > Some(3.9999));
    assert!(y.contains(&Some(9.0)) && y.contains(&Some(-9.0)) && y.contains(&None));
}

#[test]
fn law_many_points_are_small_and_translucent() {
    let points = |count: u32| (0..count).map(|i| (f64::from(i), 0.5)).collect::<Vec<_>>();
    let of = |count, style| drawn(vec![Layer::Points { label: None, points: points(count), style }]).0;
    let (few, many) = (of(3, Style::Green), of(4000, Style::Green));
    assert_eq!((&few[0]["type"], &few[0]["mode"]), (&json!("scatter"), &json!("markers")));
    assert_eq!(few[0]["marker"]["symbol"], "diamond-open");
    assert_eq!(many[0]["marker"]["symbol"], "circle");
    assert!(many[0]["marker"]["opacity"].as_f64() < Some(0.5));
    assert_eq!(many[0]["x"].as_array().map(Vec::len), Some(4000));
}

#[test]
fn law_bands_are_pairs_of_edges_without_gaps() {
    let points = vec![(0.0, 1.0, 2.0), (1.0, 1.5, 2.5), (2.0, NONE, 3.0), (3.0, 2.0, 4.0), (4.0, 2.0, 5.0)];
    let (data, _) = drawn(vec![Layer::Band { label: Some("b".into()), points, style: Style::Orange }]);
    assert_eq!(data.len(), 4);
    assert_eq!((&data[0]["y"], &data[1]["y"]), (&json!([1, 1.5]), &json!([2, 2.5])));
    assert_eq!((&data[2]["y"], &data[3]["y"]), (&json!([2, 2]), &json!([4, 5])));
    for pair in data.chunks(2) {
        assert_eq!((&pair[0]["fill"], &pair[0]["hoverinfo"]), (&Value::Null, &json!("skip")));
        assert_eq!(
            (&pair[1]["fill"], &pair[1]["fillcolor"]),
            (&json!("tonexty"), &json!("rgba(230,159,0,0.25)"))
        );
        assert_eq!(pair[1]["customdata"][1], json!([pair[0]["y"][1], pair[1]["y"][1]]));
    }
}

#[test]
fn law_error_bars_are_lengths_from_their_value() {
    let points = vec![(1.0, 5.0, 4.0, 7.5), (2.0, 6.0, NONE, NONE)];
    let (data, value) = drawn(vec![Layer::ErrorBars { label: None, points, style: Style::Black }]);
    assert_eq!(data[0]["error_y"]["symmetric"], false);
    assert_eq!(data[0]["error_y"]["array"], json!([2.5, null]));
    assert_eq!(data[0]["error_y"]["arrayminus"], json!([1, null]));
    assert_eq!(data[0]["customdata"], json!([[4, 7.5], [null, null]]));
    assert_eq!(data[0]["marker"]["symbol"], "x-thin-open");
    assert_eq!(value["layout"]["hovermode"], "closest");
}

/// An interval that is open upwards leaves the panel at its top, drawn and on the page.
#[test]
fn regress_an_interval_without_an_end_is_not_drawn_as_one_without_its_upper_half() {
    let points = vec![(1.0, 5.0, 4.0, f64::INFINITY), (2.0, 6.0, 5.5, 7.0)];
    let (data, value) = drawn(vec![Layer::ErrorBars { label: None, points, style: Style::Black }]);
    let top = value["layout"]["yaxis"]["range"][1].as_f64().expect("a range");
    let lengths = &data[0]["error_y"]["array"];
    assert!(lengths[0].as_f64().is_some_and(|length| 5.0 + length > 2.0 * top), "{lengths} {top}");
    assert_eq!(lengths[1], 1.0);
}

#[test]
fn law_rules_cross_their_panel() {
    let (data, value) = drawn(vec![
        Layer::HorizontalRule { label: Some("limit i_d".into()), y: 2.0 },
        Layer::VerticalRule { label: Some("<b>".into()), x: 3.0 },
        Layer::HorizontalRule { label: None, y: NONE },
    ]);
    assert!(data.is_empty());
    let shapes = value["layout"]["shapes"].as_array().expect("shapes");
    let lines: Vec<_> = shapes.iter().filter(|shape| shape["type"] == "line").collect();
    assert_eq!(lines.len(), 2);
    assert_eq!(
        (&lines[0]["y0"], &lines[0]["yref"], &lines[0]["xref"]),
        (&json!(2.0), &json!("y"), &json!("x domain"))
    );
    assert_eq!(
        (&lines[1]["x0"], &lines[1]["xref"], &lines[1]["yref"]),
        (&json!(3.0), &json!("x"), &json!("y domain"))
    );
    let notes = value["layout"]["annotations"].as_array().expect("annotations");
    assert!(notes.iter().any(|note| note["text"] == "limit i<sub>d</sub>"));
    assert!(notes.iter().any(|note| note["text"] == "&lt;b&gt;"));
    assert!(notes.iter().any(|note| note["text"] == "no data"));
}

#[test]
fn law_lanes_are_bars_and_tell_their_state() {
    let lane = |label: &str, spans: Vec<_>| Lane { label: label.into(), spans };
    let lanes = vec![
        lane("leg a", vec![(0.0, 1.0, 0), (1.0, 2.5, 1), (3.0, 4.0, 0), (2.0, 1.0, 0), (0.0, 1.0, 9)]),
        lane("leg b", vec![(0.5, 2.0, 1)]),
    ];
    let categories = vec!["on".to_owned(), "off".to_owned(), "never".to_owned()];
    let layer = Layer::Lanes { lanes, categories };
    let (chart, value) = chart(&figure(vec![panel(vec![layer.clone()])]));
    let bars: Vec<_> = chart.data.iter().filter(|trace| trace["type"] == "bar").collect();
    assert_eq!(bars.len(), 3);
    assert_eq!((&bars[0]["base"], &bars[0]["x"]), (&json!([0, 3]), &json!([1, 1])));
    assert_eq!((&bars[0]["y"], &bars[2]["y"]), (&json!([1.5, 1.5]), &json!([0.5])));
    assert_eq!(bars[1]["marker"]["pattern"]["shape"], "/");
    let hover: Vec<_> = chart.data.iter().filter(|trace| trace["type"] == "scatter").collect();
    assert_eq!(hover[0]["x"], json!([0, 1, 2.5, 3, 4]));
    assert_eq!(hover[0]["y"], json!([1.5, 1.5, null, 1.5, null]));
    assert_eq!(hover[0]["text"], json!(["on", "off", "", "on", ""]));
    assert_eq!(value["layout"]["yaxis"]["tickvals"], json!([1.5, 0.5]));
    assert_eq!(value["layout"]["yaxis"]["ticktext"], json!(["leg a", "leg b"]));
    assert_eq!(value["layout"]["yaxis"]["range"], json!([0, 2]));
    assert_eq!(chart.legend[0].entries.len(), 3);

    // Beside points, which are read one by one, so are bars.
    let points = Layer::Points { label: None, points: vec![(1.0, 1.0)], style: Style::Blue };
    let (data, _) = drawn(vec![layer, points]);
    assert!(data[0]["hovertemplate"].as_str().expect("a template").starts_with("leg a: "));
    assert_eq!(data[0]["customdata"], json!([[0, 1], [3, 4]]));
}

#[test]
fn law_panels_share_equal_axes_and_do_not_overlap() {
    let line = |style| Layer::Line { label: Some("i_a".into()), points: vec![(0.0, 0.0), (4.0, 1.0)], style };
    let other =
        Panel { x: Axis::new("angle (°)").range(0.0, 360.0).step(60.0), ..panel(vec![line(Style::Green)]) };
    let (chart, value) =
        chart(&figure(vec![panel(vec![line(Style::Blue)]), panel(vec![line(Style::Black)]), other]));
    let axes: Vec<_> =
        chart.data.iter().map(|trace| (trace["xaxis"].clone(), trace["yaxis"].clone())).collect();
    assert_eq!(axes, [("x", "y"), ("x", "y2"), ("x2", "y3")].map(|(x, y)| (json!(x), json!(y))));
    let layout = &value["layout"];
    assert_eq!((&layout["xaxis"]["anchor"], &layout["xaxis2"]["anchor"]), (&json!("y2"), &json!("y3")));
    assert_eq!(layout["xaxis"]["range"], json!([0, 4]));
    assert_eq!(value["steps"], json!({"xaxis2": 60.0}));
    let mut top = 1.0;
    for name in ["yaxis", "yaxis2", "yaxis3"] {
        let domain: Vec<_> =
            [0, 1].iter().map(|i| layout[name]["domain"][i].as_f64().expect("a share")).collect();
        assert!(domain[1] <= top && domain[0] >= 0.0 && domain[0] < domain[1], "{name}: {domain:?}");
        top = domain[0];
    }
    // Each panel is switched by itself, and has a name of its own.
    assert_ne!(chart.data[0]["legendgroup"], chart.data[1]["legendgroup"]);
    assert_eq!(chart.legend[2].title, "current i_a over angle");
}

#[test]
fn law_layers_of_one_label_are_one_entry() {
    let points = || vec![(0.0, 0.0), (1.0, 1.0)];
    let label = || Some("samples".to_owned());
    let layers = vec![
        Layer::Line { label: label(), points: points(), style: Style::Blue },
        Layer::Points { label: label(), points: points(), style: Style::Blue },
        Layer::Line { label: None, points: points(), style: Style::Black },
    ];
    let (chart, _) = chart(&figure(vec![panel(layers)]));
    assert_eq!(chart.legend[0].entries.len(), 1);
    assert_eq!(chart.legend[0].entries[0].keys, [Key::Line(Style::Blue), Key::Marker(Style::Blue)]);
    assert_eq!(chart.data[2]["legendgroup"], Value::Null);
}

#[test]
fn law_names_on_an_axis_are_read_out() {
    let names = ["a", "<b>"].iter().enumerate().map(|(i, name)| (i as f64, (*name).to_owned())).collect();
    let x = Axis { ticks: Ticks::Named(names), ..Axis::new("").range(-0.5, 1.5) };
    let bars = Layer::ErrorBars { label: None, points: vec![(1.1, 1.0, 0.5, 2.0)], style: Style::Blue };
    let (chart, value) = chart(&figure(vec![Panel::new(x, Axis::new("%{x} (°)")).with(bars)]));
    assert_eq!(chart.data[0]["text"], json!(["&lt;b&gt;"]));
    assert_eq!(value["layout"]["xaxis"]["ticktext"], json!(["a", "&lt;b&gt;"]));
    // What looks like a place for data in a label is text.
    assert!(chart.data[0]["hovertemplate"].as_str().expect("a template").contains("&#37;{x}: %{y"));
}

#[test]
fn analytic_numbers_have_nine_digits() {
    assert_eq!(number(1.0 / 3.0).to_string(), "0.333333333");
    assert_eq!(number(-2.0).to_string(), "-2");
    assert_eq!(number(1e300).to_string(), "1e+300");
    assert_eq!(number(-0.0).to_string(), "0");
    assert_eq!(number(f64::NEG_INFINITY), Value::Null);
}
