//! Texts of drawn figures: none is cut off, and none lies on another, however narrow the figure is.

#[path = "../../examples/gallery/charts.rs"]
mod charts;
#[path = "../../examples/gallery/noise.rs"]
mod noise;
#[path = "../../examples/gallery/studies.rs"]
mod studies;

use noise::noise;

use super::Figure;
use crate::study::figures;

/// Every figure of the gallery, as wide as a page on a desk, a column and a phone.
#[test]
fn law_no_text_of_a_figure_is_cut_off_or_lies_on_another() {
    let charts = charts::all("paper-5k5").into_iter().map(|chart| (chart.id, chart.figure));
    let studies = studies::all().into_iter().flat_map(|(study, of)| {
        figures(&of).into_iter().map(move |(name, figure)| (format!("{study}-{name}"), figure))
    });
    let mut found = Vec::new();
    for (name, figure) in charts.chain(studies) {
        for width in [390, 600, 900] {
            let figure = Figure { width, ..figure.clone() };
            let faults = figure.faulty_labels().expect("a figure");
            found.extend(faults.into_iter().map(|fault| format!("{name} at {width}: {fault}")));
        }
    }
    assert!(found.is_empty(), "{} faults:\n{}", found.len(), found.join("\n"));
}
