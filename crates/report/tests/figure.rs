//! Figures as files: what is in them, and what must not upset them.

use standstill_report::figure::{Axis, Figure, FigureError, Lane, Layer, Panel, Style, Ticks};

fn figure(panels: Vec<Panel>) -> Figure {
    Figure {
        title: "Currents & <angles>".into(),
        subtitle: Some("20 kHz".into()),
        width: 600,
        height: 400,
        panels,
    }
}

fn line(points: Vec<(f64, f64)>) -> Layer {
    Layer::Line { label: Some("median".into()), points, style: Style::Blue }
}

fn panel() -> Panel {
    Panel::new(Axis::new("time (ms)").range(0.0, 1.0), Axis::new("current (A)").range(-1.0, 1.0))
}

/// Every kind of layer.
fn everything() -> Figure {
    let wave = |i: i32| (f64::from(i) / 1000.0, (f64::from(i) / 50.0).sin());
    let curve = panel()
        .with(Layer::Band {
            label: Some("spread".into()),
            points: (0..1000).map(wave).map(|(x, y)| (x, y - 0.1, y + 0.1)).collect(),
            style: Style::Orange,
        })
        .with(line((0..1000).map(wave).collect()))
        .with(Layer::Steps {
            label: None,
            points: (0..9).map(|i| wave(100 * i)).collect(),
            style: Style::Green,
        })
        .with(Layer::Points {
            label: Some("all".into()),
            points: (0..900).map(wave).collect(),
            style: Style::Black,
        })
        .with(Layer::ErrorBars { label: None, points: vec![(0.5, 0.0, -0.5, 0.5)], style: Style::Purple })
        .with(Layer::HorizontalRule { label: Some("limit".into()), y: 0.5 })
        .with(Layer::VerticalRule { label: Some("instant".into()), x: 0.4 });
    let lanes =
        vec![Lane { label: "leg a".into(), spans: vec![(0.0, 0.4, 0), (0.4, 1.0, 1), (0.2, 0.3, 99)] }];
    let modes = panel().with(Layer::Lanes { lanes, categories: vec!["switch".into(), "diode".into()] });
    figure(vec![curve, modes])
}

/// Width, height and the bytes of red, green and blue.
fn decode(file: &[u8]) -> (u32, u32, Vec<[u8; 3]>) {
    let mut reader = png::Decoder::new(std::io::Cursor::new(file)).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    assert_eq!((info.color_type, info.bit_depth), (png::ColorType::Rgba, png::BitDepth::Eight));
    let pixels = bytes.as_chunks::<4>().0;
    assert!(pixels.iter().all(|pixel| pixel[3] == 255), "nothing is transparent");
    (info.width, info.height, pixels.iter().map(|[red, green, blue, _]| [*red, *green, *blue]).collect())
}

/// Tags closed in the order of their opening, and no ampersand without an entity.
fn assert_well_formed(svg: &str) {
    let mut open = Vec::new();
    for tag in svg.split('<').skip(1) {
        let (tag, text) = tag.split_once('>').expect("a tag ends");
        assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
        for entity in text.split('&').skip(1) {
            assert!(["lt;", "gt;", "amp;", "quot;", "apos;"].iter().any(|e| entity.starts_with(e)), "{text}");
        }
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name));
        } else if !tag.ends_with('/') {
            open.push(tag.split(' ').next().unwrap());
        }
    }
    assert!(open.is_empty(), "{open:?}");
}

#[test]
fn law_an_svg_has_the_size_and_the_texts_of_its_figure() {
    let svg = everything().svg().unwrap();
    assert_well_formed(&svg);
    assert!(svg.contains("width=\"600\" height=\"400\" viewBox=\"0 0 600 400\""));
    let texts = ["Currents &amp; &lt;angles&gt;", "20 kHz", "time (ms)", "current (A)", "median", "spread"];
    for text in texts.into_iter().chain(["limit", "instant", "leg a", "switch", "diode", "−1", "0.4"]) {
        assert!(svg.contains(&format!(">{text}</text>")), "{text}");
    }
}

#[test]
fn law_a_png_has_twice_the_size_and_its_line_where_it_belongs() {
    let picture = figure(vec![panel().with(line(vec![(0.0, 0.0), (1.0, 0.0)]))]).png().unwrap();
    let (width, height, pixels) = decode(&picture);
    assert_eq!((width, height), (1200, 800));
    // Along any column inside the panel, the line is the only blue, half way between the ends of the axis.
    let blue = |y: &usize| matches!(pixels[*y * 1200 + 700], [0..60, _, 120..=255]);
    let rows: Vec<usize> = (0..800).filter(blue).collect();
    assert!((2..=4).contains(&rows.len()), "{rows:?}");
    assert!(rows[rows.len() - 1] - rows[0] < 4 && (300..500).contains(&rows[0]), "{rows:?}");
}

#[test]
fn law_a_spike_among_many_points_is_seen() {
    let mut points: Vec<_> = (0..30_000).map(|i| (f64::from(i) / 30_000.0, -0.9)).collect();
    points[15_001].1 = 0.9;
    let svg = figure(vec![panel().with(line(points))]).svg().unwrap();
    let paths = svg.lines().filter(|line| line.starts_with("<path"));
    let list = paths.filter_map(|line| line.split(" d=\"M").nth(1)).max_by_key(|list| list.len()).unwrap();
    let list = list.trim_end_matches("\"/>");
    let heights = || list.split(['L', 'M']).map(|p| p.split_once(' ').unwrap().1.parse::<f64>().unwrap());
    let (top, bottom) = (heights().fold(f64::MAX, f64::min), heights().fold(f64::MIN, f64::max));
    assert!(bottom - top > 150.0, "from {top} to {bottom}");
    assert!(svg.len() < 200_000);
}

#[test]
fn law_a_line_that_leaves_its_panel_ends_at_the_frame_and_not_along_it() {
    let svg = figure(vec![panel().with(line(vec![(0.0, 0.0), (1.0, 10.0)]))]).svg().unwrap();
    let of = |look: &str| -> Vec<f64> {
        let path = svg.lines().find(|line| line.contains(look)).unwrap().split(" d=\"M").nth(1).unwrap();
        path.trim_end_matches("\"/>").split(['L', ' ']).map(|length| length.parse().unwrap()).collect()
    };
    let (frame, line) = (of("stroke=\"#707070\""), of("stroke=\"#0072b2\" stroke-width=\"1.5\""));
    assert!((line[2] - frame[0] - 0.1 * (frame[2] - frame[0])).abs() < 0.2, "{line:?} in {frame:?}");
    assert!((line[3] - frame[1]).abs() < 0.2, "{line:?} in {frame:?}");
}

#[test]
fn law_twenty_thousand_points_keep_the_svg_small() {
    let points = (0..20_000).map(|i| (f64::from(i) / 2e4, (f64::from(i) * 0.618).fract())).collect();
    let layer = Layer::Points { label: None, points, style: Style::Blue };
    let svg = figure(vec![panel().with(layer)]).svg().unwrap();
    assert!((300_000..2_000_000).contains(&svg.len()), "{}", svg.len());
}

#[test]
fn law_equal_figures_give_equal_files() {
    assert_eq!(everything().svg(), everything().svg());
    assert_eq!(everything().png(), everything().png());
}

#[test]
fn law_no_data_is_said() {
    for layers in [vec![], vec![line(vec![])], vec![line(vec![(f64::NAN, 1.0)])]] {
        let empty = figure(vec![Panel { layers, ..Panel::new(Axis::new("x"), Axis::new("y")) }]);
        assert!(empty.svg().unwrap().contains("no data"));
        empty.png().unwrap();
    }
    assert!(!everything().svg().unwrap().contains("no data"));
    assert_well_formed(&figure(vec![]).svg().unwrap());
}

#[test]
fn law_awkward_data_are_drawn() {
    let awkward = [
        vec![(0.0, 1.0)],
        vec![(0.0, 0.0), (1.0, 0.0)],
        vec![(5.0, 3.3), (5.0, 3.3)],
        vec![(0.0, 1.0), (1.0, f64::NAN), (2.0, f64::INFINITY), (3.0, 2.0)],
        vec![(0.0, -1e300), (1.0, 1e300)],
        vec![(1e15, 1e-30), (1e15 + 1.0, 2e-30)],
        vec![(f64::MIN, f64::MIN), (f64::MAX, f64::MAX)],
    ];
    for points in awkward {
        let bars = points.iter().map(|&(x, y)| (x, y, y - 1.0, f64::NAN)).collect();
        let band = points.iter().map(|&(x, y)| (x, y, y)).collect();
        let spans = points.iter().map(|&(x, y)| (x, y, 0)).collect();
        let of = |layer: Layer| Panel::new(Axis::new("x"), Axis::new("y")).with(layer);
        for layer in [
            line(points.clone()),
            Layer::Line { label: None, points: points.clone(), style: Style::Purple },
            Layer::Steps { label: None, points: points.clone(), style: Style::Black },
            Layer::Points { label: None, points: points.clone(), style: Style::Green },
            Layer::ErrorBars { label: None, points: bars, style: Style::Orange },
            Layer::Band { label: None, points: band, style: Style::Blue },
            Layer::Lanes { lanes: vec![Lane { label: "a".into(), spans }], categories: vec!["on".into()] },
        ] {
            let drawn = figure(vec![of(layer)]);
            assert_well_formed(&drawn.svg().unwrap());
            drawn.png().unwrap();
        }
    }
    let strange = |range, ticks| Axis { range: Some(range), ticks, ..Axis::new("") };
    for axis in [
        strange((1.0, 1.0), Ticks::Auto),
        strange((f64::NAN, 1.0), Ticks::Step(0.0)),
        strange((360.0, 0.0), Ticks::Step(1e-9)),
        strange((0.0, 1.0), Ticks::Named(vec![(0.5, String::new()), (f64::NAN, "never".into())])),
    ] {
        let drawn = figure(vec![Panel::new(axis.clone(), axis).with(line(vec![(0.0, 0.0), (1.0, 1.0)]))]);
        assert_well_formed(&drawn.svg().unwrap());
    }
}

#[test]
fn law_sizes_have_limits() {
    let small = Figure { width: 200, height: 200, ..everything() };
    let (width, height, _) = decode(&small.png().unwrap());
    assert_eq!((width, height), (400, 400));
    let flat = Figure { height: 0, ..figure(vec![]) };
    assert_eq!(flat.png(), Err(FigureError::Size { width: 600, height: 0 }));
}

/// An interval without an upper end has a whisker that leaves the panel, and no cap there; without a number it has none.
#[test]
fn regress_whiskers_of_open_intervals_are_drawn() {
    let strokes = |high: f64| {
        let bars = vec![(0.0, 1.0, 0.5, high), (1.0, 1.2, 1.0, 2.0)];
        let bars = Layer::ErrorBars { label: None, points: bars, style: Style::Black };
        let y = Axis::new("y").range(0.0, 3.0);
        let svg = figure(vec![Panel::new(Axis::new("x").range(-1.0, 2.0), y).with(bars)]).svg().unwrap();
        // Each stroke begins with a move.
        svg.matches('M').count()
    };
    let [closed, open, none] = [1.5, f64::INFINITY, f64::NAN].map(strokes);
    assert_eq!([closed - none, open - none], [3, 2], "a stem and two caps, or one");
}
