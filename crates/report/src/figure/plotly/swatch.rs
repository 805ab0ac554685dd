//! The keys of legends as SVG, in the custom properties that hold the colours.

use super::super::style::Style;
use super::Key;
use super::colour::{name, outline, slope};

/// A piece of line, a marker or a fill, in a box of 30 by 14.
pub(crate) fn swatch(key: Key) -> String {
    let colour = |style| format!("var(--{})", name(style));
    match key {
        Key::Line(style) => {
            let dashes: Vec<_> = style.dashes().iter().map(ToString::to_string).collect();
            format!(
                "<path d=\"M0 7H30\" fill=\"none\" style=\"stroke:{}\" stroke-width=\"2\" stroke-dasharray=\"{}\"/>",
                colour(style),
                dashes.join(" ")
            )
        }
        Key::Marker(style) => marker(style),
        Key::Bar(style) => {
            format!(
                "<path d=\"M15 0V14\" style=\"stroke:{}\" stroke-width=\"1.5\"/>{}",
                colour(style),
                marker(style)
            )
        }
        Key::Band(style) => {
            format!(
                "<rect width=\"30\" height=\"12\" y=\"1\" style=\"fill:{}\" opacity=\"0.3\"/>",
                colour(style)
            )
        }
        Key::UpperLimit(style) => {
            format!(
                "<path d=\"M10 1.5H20M15 1.5V9\" style=\"stroke:{0}\" stroke-width=\"1.5\"/>\
                 <path d=\"M11.4 7.5h7.2L15 13.5z\" style=\"fill:{0}\"/>",
                colour(style)
            )
        }
        Key::Blank => "<rect x=\".5\" y=\"1.5\" width=\"29\" height=\"11\" style=\"fill:var(--surface);\
             stroke:var(--frame)\"/><path d=\"M1 12l5-10M7 12l5-10M13 12l5-10M19 12l5-10M24 12l5-10\" fill=\"none\" \
             style=\"stroke:var(--no-value)\"/>"
            .to_owned(),
        Key::Fill(index) => {
            let ground = format!(
                "<rect x=\".5\" y=\"1.5\" width=\"29\" height=\"11\" style=\"fill:var(--fill-{index});\
                 stroke:var(--frame)\"/>"
            );
            let lines: String = match slope(index) {
                0 => String::new(),
                slope => (0..4)
                    .map(|i| 2 + 7 * i)
                    .map(|x| if slope > 0 { format!("M{x} 12l5-10") } else { format!("M{x} 2l5 10") })
                    .collect(),
            };
            format!("{ground}<path d=\"{lines}\" fill=\"none\" style=\"stroke:var(--hatch-{index})\"/>")
        }
    }
}

fn marker(style: Style) -> String {
    let (shape, filled) = outline(style);
    let paint = if filled { "fill" } else { "stroke" };
    let other = if filled { "" } else { " fill=\"none\" stroke-width=\"1.5\"" };
    format!("<path d=\"{shape}\" style=\"{paint}:var(--{})\"{other}/>", name(style))
}
