//! The HTML of a page.

use super::{Block, Chart, Kind, Page, PageError, Section, Table, Tone};
use crate::figure::plotly::{self, Entry, Legend, markup, palette};
use crate::figure::{Figure, Layer};
use maud::{DOCTYPE, Markup, PreEscaped, html};
use serde_json::{Value, json};
use std::fmt::Write;

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");
#[cfg(feature = "interactive")]
pub(super) const PLOTLY: &str = include_str!("../../assets/plotly-cartesian.min.js");
#[cfg(not(feature = "interactive"))]
pub(super) const PLOTLY: &str = "";

/// Content security policy: nothing may be fetched. Plotly needs neither `eval` nor workers.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; \
                      img-src data: blob:; base-uri 'none'; form-action 'none'";

/// Applied before anything is shown, so that no page flashes in the wrong colours.
const EARLY: &str = "try{const t=localStorage.getItem('standstill-theme');\
    if(t==='light'||t==='dark')document.documentElement.dataset.theme=t}catch{}";

/// More rows than this get a box to filter them.
const FEW_ROWS: usize = 20;

pub(super) fn page(page: &Page) -> Result<String, PageError> {
    let mut sections = Vec::new();
    for (index, section) in page.sections.iter().enumerate() {
        sections.push(render_section(index, section)?);
    }
    let has_charts = page.sections.iter().flat_map(|s| &s.blocks).any(|b| matches!(b, Block::Chart(_)));
    let document = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(POLICY);
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                meta name="referrer" content="no-referrer";
                title { (page.title) }
                style { (PreEscaped(colours())) (PreEscaped(STYLE)) }
                script { (PreEscaped(EARLY)) }
            }
            body {
                a.skip href="#content" { "Skip to the content" }
                header.top {
                    div {
                        h1 { (rich(&page.title)) }
                        @if !page.subtitle.is_empty() { p.subtitle { (rich(&page.subtitle)) } }
                    }
                    button #theme type="button" hidden { "Dark" }
                }
                div.columns {
                    @if page.sections.len() > 1 { (contents(page)) }
                    main #content { @for section in &sections { (section) } }
                }
                @if !page.footer.is_empty() { footer { (rich(&page.footer)) } }
                @if has_charts && !PLOTLY.is_empty() {
                    script #palette type="application/json" { (PreEscaped(embedded(&translations()))) }
                    script { (PreEscaped(PLOTLY)) }
                }
                script { (PreEscaped(SCRIPT)) }
            }
        }
    };
    Ok(document.into_string())
}

/// Returns a text with the indices of symbols below the line.
fn rich(text: &str) -> PreEscaped<String> {
    PreEscaped(markup(text))
}

/// Returns JSON that is safe in a script element, which ends at the first `</script` and changes its rules after
/// `<!--`.
fn embedded(value: &Value) -> String {
    let mut text = String::new();
    for c in value.to_string().chars() {
        match c {
            '<' | '>' | '&' | '\u{2028}' | '\u{2029}' => {
                let _ = write!(text, "\\u{:04x}", u32::from(c));
            }
            _ => text.push(c),
        }
    }
    text
}

/// Returns the colours of the figures as custom properties, for both grounds.
fn colours() -> String {
    let list = |dark: bool| -> String {
        let one = |shade: &plotly::Shade| {
            format!("--{}:{};", shade.name, if dark { shade.dark } else { shade.light }.css())
        };
        palette().iter().map(one).collect()
    };
    // Paper is light whatever was chosen for the screen.
    format!(
        ":root{{{light}}}\
         @media screen and (prefers-color-scheme:dark){{:root:not([data-theme=light]){{{dark}}}}}\
         @media screen{{:root[data-theme=dark]{{{dark}}}}}\n",
        light = list(false),
        dark = list(true)
    )
}

/// Returns the map from colours on light background to those on dark background, without opacity.
fn translations() -> Value {
    let triple = |colour: String| colour.trim_start_matches("rgb(").trim_end_matches(')').to_owned();
    palette().iter().map(|shade| (triple(shade.light.css()), json!(triple(shade.dark.css())))).collect()
}

fn contents(page: &Page) -> Markup {
    html! {
        nav.contents aria-label="Contents" {
            ol {
                @for (index, section) in page.sections.iter().enumerate() {
                    li { a href={ "#section-" (index + 1) } { (rich(&section.title)) } }
                }
            }
        }
    }
}

fn render_section(index: usize, section: &Section) -> Result<Markup, PageError> {
    let mut blocks = Vec::new();
    for block in &section.blocks {
        blocks.push(render_block(block)?);
    }
    let id = format!("section-{}", index + 1);
    Ok(html! {
        section aria-labelledby=(id) {
            h2 id=(id) { (rich(&section.title)) }
            @for block in &blocks { (block) }
        }
    })
}

fn render_block(block: &Block) -> Result<Markup, PageError> {
    Ok(match block {
        Block::Verdict { tone, headline, details } => verdict(*tone, headline, details),
        Block::Text(text) => html! {
            @for paragraph in text.split("\n\n").map(str::trim).filter(|p| !p.is_empty()) {
                p.prose { (rich(paragraph)) }
            }
        },
        Block::List(sentences) => html! {
            ul.prose { @for sentence in sentences { li { (rich(sentence)) } } }
        },
        Block::Code { caption, text } => html! {
            figure.code {
                figcaption {
                    span { (rich(caption)) }
                    button.copy type="button" hidden aria-label={ "Copy " (caption) } { "Copy" }
                }
                pre tabindex="0" { code { (text) } }
            }
        },
        Block::Facts(facts) => html! {
            dl.facts {
                @for (name, value) in facts { div { dt { (rich(name)) } dd { (value) } } }
            }
        },
        Block::Table(content) => table(content),
        Block::Chart(content) => chart(content)?,
    })
}

fn verdict(tone: Tone, headline: &str, details: &[String]) -> Markup {
    let (class, mark, word) = match tone {
        Tone::Good => ("good", "✓", "Good"),
        Tone::Warning => ("warning", "!", "Caution"),
        Tone::Bad => ("bad", "✕", "Bad"),
        Tone::Neutral => ("neutral", "i", "Note"),
    };
    html! {
        div class={ "verdict " (class) } {
            span.mark aria-hidden="true" { (mark) }
            div {
                p.headline { span.word { (word) } " " (rich(headline)) }
                @if !details.is_empty() {
                    ul { @for detail in details { li { (rich(detail)) } } }
                }
            }
        }
    }
}

fn table(table: &Table) -> Markup {
    let class = |index: usize| (table.columns[index].kind == Kind::Number).then_some("number");
    html! {
        div.table {
            @if table.rows.len() > FEW_ROWS {
                div.filter hidden {
                    label { span { "Filter" } input type="search" autocomplete="off" spellcheck="false"; }
                    span.count role="status" { (table.rows.len()) " rows" }
                }
            }
            div.scroll tabindex="0" role="region" aria-label={ "Table: " (table.caption) } {
                table {
                    @if !table.caption.is_empty() { caption { (rich(&table.caption)) } }
                    thead {
                        tr {
                            @for (index, column) in table.columns.iter().enumerate() {
                                th scope="col" class=[class(index)] {
                                    span.name { (rich(&column.name)) }
                                    @if !column.unit.is_empty() { " " span.unit { (column.unit) } }
                                }
                            }
                        }
                    }
                    tbody {
                        @for (_, row) in &table.rows {
                            tr { @for (index, cell) in row.iter().enumerate() { td class=[class(index)] { (cell) } } }
                        }
                    }
                }
            }
        }
    }
}

fn chart(chart: &Chart) -> Result<Markup, PageError> {
    let figure = &chart.figure;
    // Both are texts of the page; drawn as well, they would be read twice.
    let untitled = Figure { title: String::new(), subtitle: None, ..figure.clone() };
    let picture = untitled.svg().map_err(|why| PageError::Figure { id: chart.id.clone(), why })?;
    let legends = plotly::legends(figure);
    let summary = summary(figure, &legends);
    // Decided when this is compiled: what no page shows is not linked either.
    let live = if PLOTLY.is_empty() { None } else { Some(live(figure, &legends, &summary)) };
    Ok(html! {
        figure.chart id=(chart.id) {
            @if !figure.title.is_empty() { h3 { (rich(&figure.title)) } }
            @if let Some(subtitle) = &figure.subtitle { p.subtitle { (rich(subtitle)) } }
            div.drawn role="img" aria-label=(summary) { (PreEscaped(picture)) }
            @if let Some(live) = &live { (live) }
            @if !chart.caption.is_empty() { figcaption { (rich(&chart.caption)) } }
        }
    })
}

/// Returns the interactive chart in place of the drawing.
fn live(figure: &Figure, legends: &[Legend], summary: &str) -> Markup {
    let (_, data) = plotly::chart(figure);
    html! {
        div.live hidden {
            @if !legends.is_empty() { (legend(legends)) }
            div.plot role="group" aria-label={ "Interactive: " (summary) } {}
        }
        script.data type="application/json" { (PreEscaped(embedded(&data))) }
    }
}

/// Returns the chart in words, for those who do not see it.
fn summary(figure: &Figure, legend: &[Legend]) -> String {
    let mut text =
        if figure.title.is_empty() { "Chart".to_owned() } else { format!("Chart: {}", figure.title) };
    for (index, panel) in figure.panels.iter().enumerate() {
        let cells = panel.layers.iter().find_map(|layer| match layer {
            Layer::Heat { colour, .. } => Some(&colour.label),
            _ => None,
        });
        let _ = match cells {
            Some(label) => write!(text, ". {label} over {} and {}", panel.x.label, panel.y.label),
            None => write!(text, ". {} over {}", panel.y.label, panel.x.label),
        };
        let entries = legend.iter().filter(|legend| legend.panel == index).flat_map(|legend| &legend.entries);
        let labels: Vec<_> = entries.map(|entry| entry.label.as_str()).collect();
        if !labels.is_empty() {
            let _ = write!(text, ": {}", labels.join(", "));
        }
    }
    text
}

fn legend(panels: &[Legend]) -> Markup {
    html! {
        div.legend {
            @for panel in panels {
                div role="group" aria-label={ "Series of " (panel.title) } {
                    @if panels.len() > 1 { span.of { (rich(&panel.title)) } }
                    @for entry in &panel.entries { (legend_entry(panel.panel, entry)) }
                }
            }
        }
    }
}

fn legend_entry(panel: usize, entry: &Entry) -> Markup {
    html! {
        button.key type="button" aria-pressed="true" data-group=(plotly::group(panel, &entry.label))
            title="Click to hide or show, double-click to show alone" {
            span.swatch aria-hidden="true" { (PreEscaped(swatch(entry))) }
            span { (rich(&entry.label)) }
        }
    }
}

/// Returns the keys of an entry in the custom properties that hold the colours.
fn swatch(entry: &Entry) -> String {
    palette().iter().fold(plotly::swatch(&entry.keys), |svg, shade| {
        ["fill", "stroke"].into_iter().fold(svg, |svg, paint| {
            let fixed = format!("{paint}=\"{}\"", shade.light.hex());
            svg.replace(&fixed, &format!("style=\"{paint}:var(--{})\"", shade.name))
        })
    })
}
