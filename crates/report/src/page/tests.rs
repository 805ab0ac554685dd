use super::*;
use crate::figure::{Axis, Layer, Panel, Style};

const EVIL: &str = "</script><script>alert(1)</script><!-- \" ' & %{x} <img src=x onerror=alert(1)>";

fn figure(text: &str) -> Figure {
    let label = || Some(text.to_owned());
    let lanes = vec![crate::figure::Lane { label: text.into(), spans: vec![(0.0, 1.0, 0)] }];
    let panel = Panel::new(Axis::new(text), Axis::new(text))
        .with(Layer::Line { label: label(), points: vec![(0.0, 1.0), (1.0, f64::NAN)], style: Style::Blue })
        .with(Layer::HorizontalRule { label: label(), y: 1.0 })
        .with(Layer::VerticalRule { label: label(), x: 0.5 });
    let states = Panel::new(Axis::new(text), Axis::new(text))
        .with(Layer::Lanes { lanes, categories: vec![text.to_owned()] });
    Figure { title: text.into(), subtitle: label(), width: 600, height: 400, panels: vec![panel, states] }
}

/// A page with a text in every place that takes one.
fn page(text: &str) -> Page {
    let own = || text.to_owned();
    let columns = [Column::word(text), Column::number(text).unit(text)];
    let table = Table::new(columns).captioned(text).rows(vec![vec![own(), own()]; 21]);
    let blocks = vec![
        Block::Verdict { tone: Tone::Bad, headline: own(), details: vec![own()] },
        Block::Text(own()),
        Block::List(vec![own()]),
        Block::Code { caption: own(), text: own() },
        Block::Facts(vec![(own(), own())]),
        Block::Table(table),
        Block::Chart(Chart { id: "one".into(), figure: figure(text), caption: own() }),
    ];
    let section = Section::new(text, blocks);
    let empty = Section::new(text, []);
    Page { title: own(), subtitle: own(), sections: vec![section, empty], footer: own() }
}

/// The document without the parts that are the same in every page.
fn own_parts(html: &str) -> String {
    html.replace(include_str!("../../assets/plotly-cartesian.min.js"), "")
        .replace(include_str!("page.js"), "")
        .replace(include_str!("page.css"), "")
}

#[test]
fn law_every_text_is_shown_as_it_is() {
    let evil = own_parts(&page(EVIL).html().expect("a page"));
    let plain = own_parts(&page("plain").html().expect("a page"));
    // Texts add no elements, neither in HTML nor in the embedded JSON.
    for tag in ["<script", "</script", "<img", "<!--", "alert(1)<"] {
        assert_eq!(evil.matches(tag).count(), plain.matches(tag).count(), "{tag}");
    }
    assert!(evil.contains("&lt;/script&gt;&lt;script&gt;alert(1)"));
    assert!(evil.contains(r"\u0026lt;/script\u0026gt;"));
}

#[test]
fn law_embedded_data_can_be_read_back() {
    let html = page(EVIL).html().expect("a page");
    let (_, rest) = html.split_once("<script class=\"data\" type=\"application/json\">").expect("data");
    let (data, _) = rest.split_once("</script>").expect("its end");
    assert!(!data.contains(['<', '>', '&']));
    let value: serde_json::Value = serde_json::from_str(data).expect("JSON");
    assert_eq!(value["data"][0]["y"], serde_json::json!([1, null]));
    let name = value["data"][0]["name"].as_str().expect("a name");
    assert!(name.starts_with("&lt;/script&gt;") && !name.contains('<'));
}

#[test]
fn law_equal_pages_have_equal_bytes() {
    assert_eq!(page("a").html(), page("a").html());
    assert_ne!(page("a").html(), page("b").html());
}

#[test]
fn law_a_page_needs_no_network() {
    let html = page("plain").html().expect("a page");
    for attribute in ["src=", "href=", "srcset=", "action=", "poster="] {
        for (at, _) in own_parts(&html).match_indices(&format!(" {attribute}")) {
            let own = own_parts(&html);
            let value = own[at + 1 + attribute.len()..].trim_start_matches('"');
            assert!(value.starts_with('#'), "{attribute}{}", &value[..value.len().min(40)]);
        }
    }
    let own = own_parts(&html);
    assert!(!own.contains("<link") && !own.contains("<iframe") && !own.contains("<base"));
    for style in [include_str!("page.css"), &own] {
        assert!(!style.contains("@import"));
        assert_eq!(style.matches("url(").count(), style.matches("url(data:").count());
    }
    for script in [include_str!("page.js"), include_str!("../../assets/plotly-cartesian.min.js")] {
        let lower = script.to_ascii_lowercase();
        // Either would end or change the element that a script is in.
        assert!(!lower.contains("</script") && !lower.contains("<!--") && !lower.contains("@import"));
    }
    assert!(html.contains("default-src 'none'"));
}

#[test]
fn law_pages_without_charts_are_small() {
    let page = Page {
        title: "t".into(),
        sections: vec![Section::new("s", [Block::Text("x".into())])],
        ..Page::default()
    };
    let html = page.html().expect("a page");
    assert!(html.len() < 40_000, "{} bytes", html.len());
    assert!(!html.contains("class=\"contents\""));
}

#[test]
fn law_indices_are_below_the_line_in_labels_only() {
    let html = own_parts(&page("i_a").html().expect("a page"));
    assert!(html.contains("<h1>i<sub>a</sub></h1>"));
    assert!(html.contains("<dt>i<sub>a</sub></dt><dd>i_a</dd>"));
    assert!(html.contains("<td>i_a</td>"));
    assert!(html.contains("<title>i_a</title>"));
}

#[test]
fn law_mistakes_are_named() {
    let chart = |id: &str| Block::Chart(Chart { id: id.into(), figure: figure("x"), caption: String::new() });
    let with =
        |blocks: Vec<Block>| Page { sections: vec![Section::new("s", blocks)], ..Page::default() }.html();
    for id in ["", "a b", "a\"", "section-1", "content"] {
        assert_eq!(with(vec![chart(id)]), Err(PageError::Id(id.into())));
    }
    assert_eq!(with(vec![chart("a"), chart("a")]), Err(PageError::Id("a".into())));
    let table = Table::new([Column::word("a")]).captioned("t").rows([vec![]]);
    let cells = PageError::Cells { table: "t".into(), row: 0, found: 0, columns: 1 };
    assert_eq!(with(vec![Block::Table(table)]), Err(cells));
    let mut large = figure("x");
    large.width = 5000;
    let large = Chart { id: "a".into(), figure: large, caption: String::new() };
    assert!(matches!(with(vec![Block::Chart(large)]), Err(PageError::Figure { .. })));
}

#[test]
fn regress_the_bundle_is_the_one_that_the_readme_names() {
    let readme = include_str!("../../assets/README.md");
    let bundle = include_str!("../../assets/plotly-cartesian.min.js");
    let version =
        bundle.split_once("(cartesian - minified) v").and_then(|(_, rest)| rest.split_whitespace().next());
    assert!(readme.contains(&format!("`plotly.js-cartesian-dist-min` {},", version.expect("a version"))));
}
