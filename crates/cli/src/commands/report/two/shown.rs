//! Two runs as a figure and as a page.

use standstill_report::figure::{Axis, Figure, Layer, Panel, Style};
use standstill_report::page::{Block, Chart, Page, Section, Table, TableColumn, Tone};

use super::{CASES, Common, Row};

/// Above the rms error of both, then the difference, below what went wrong.
pub fn figure(rows: &[Row], points: &[Common], names: &[String; 2], conditions: &str) -> Figure {
    /// More names than this would stand on one another.
    const NAMED: usize = 6;
    let names = [format!("A: {}", names[0]), format!("B: {}", names[1])];
    let rms: Vec<&Row> = rows.iter().filter(|row| row.is_rms()).collect();
    let single = points.len() == 1;
    let x = || match points {
        [one] => Axis::categories("", [one.name.clone()]),
        few if few.len() <= NAMED => Axis::categories("", few.iter().map(|point| point.name.clone())),
        _ => Axis::new("point, in the order of the table").whole(),
    };
    let both = |panel: Panel, rows: &[&Row]| {
        let at = |shift: f64, of: fn(&Row) -> [f64; 3]| {
            let bar = move |(place, row): (usize, &&Row)| {
                let [value, low, high] = of(row).map(|x| row.factor() * x);
                (place as f64 + shift, value, low, high)
            };
            // What is no number has no bar.
            let known = |row: &&Row| of(row).iter().all(|x| x.is_finite());
            rows.iter().enumerate().filter(|(_, row)| known(row)).map(bar).collect::<Vec<_>>()
        };
        panel
            .with(Layer::error_bars(&names[0], Style::Blue, at(-0.08, |row| [row.a, row.a_low, row.a_high])))
            .with(Layer::error_bars(
                &names[1],
                Style::Vermilion,
                at(0.08, |row| [row.b, row.b_low, row.b_high]),
            ))
    };
    let upper = both(Panel::new(x(), Axis::new("rms error (°)")), &rms);
    let bar = |(place, row): (usize, &&Row)| {
        (place as f64, row.difference, row.difference_low, row.difference_high)
    };
    let apart = Panel::new(x(), Axis::new("B less A (°)"))
        .with(Layer::error_bars(
            "difference with 95 % interval",
            Style::Black,
            rms.iter().enumerate().filter(|(_, row)| row.difference_high.is_finite()).map(bar),
        ))
        .with(Layer::level("", 0.0));
    // A panel without a number says nothing; one there must be.
    let mut panels = Vec::new();
    if !single || rms.iter().any(|row| row.a.is_finite() || row.b.is_finite()) {
        panels.push(upper);
    }
    if rms.iter().any(|row| row.difference_high.is_finite()) {
        panels.push(apart);
    }
    if single {
        let rest: Vec<&Row> = rows.iter().filter(|row| CASES.contains(&row.measure)).collect();
        let panel = Panel::new(Axis::categories("", CASES.map(str::to_owned)), Axis::new("starts (%)"));
        panels.push(both(panel, &rest));
    } else {
        for case in CASES {
            let rest: Vec<&Row> = rows.iter().filter(|row| row.measure == case).collect();
            // What never happens needs no picture.
            if rest.iter().any(|row| row.a > 0.0 || row.b > 0.0) {
                panels.push(both(Panel::new(x(), Axis::new(format!("{case} (%)"))), &rest));
            }
        }
    }
    // Of five panels at most.
    #[allow(clippy::cast_possible_truncation)]
    let height = 120 + 230 * panels.len() as u32;
    let title = "Two runs compared, with 95 % intervals".to_owned();
    Figure { title, subtitle: Some(conditions.to_owned()), width: 860, height, panels }
}

pub fn page(
    about: &[String],
    (tone, headline): (Tone, String),
    notes: Vec<String>,
    rows: &[Row],
    settings: Vec<[String; 3]>,
    figure: &Figure,
) -> Page {
    let results = Table {
        caption: "Both runs and their difference, with 95 % intervals".to_owned(),
        columns: ["point", "measure", "A", "B", "B less A", ""].map(TableColumn::text).into(),
        rows: rows.iter().map(Row::cells).collect(),
    };
    let differ = Table {
        caption: "Settings that differ; – is what the error set, or what suits the motor, makes of it"
            .to_owned(),
        columns: ["setting", "A", "B"].map(TableColumn::text).into(),
        rows: settings.into_iter().map(Vec::from).collect(),
    };
    let differ = if differ.rows.is_empty() {
        Block::Text("No setting differs.".to_owned())
    } else {
        Block::Table(differ)
    };
    let chart = Chart {
        id: "chart-comparison".to_owned(),
        figure: figure.clone(),
        caption: "Error bars are 95 % intervals. A difference is seen where its bar does not cross zero."
            .to_owned(),
    };
    let section = |title: &str, blocks: Vec<Block>| Section { title: title.to_owned(), blocks };
    let verdict = Block::Verdict { tone, headline, details: notes };
    Page {
        title: "Two runs compared".to_owned(),
        subtitle: about.join(" · "),
        sections: vec![
            section("Answer", vec![verdict, Block::Table(results)]),
            section("Figure", vec![Block::Chart(chart)]),
            section("Settings", vec![differ]),
        ],
        footer: format!("Standstill {}", env!("CARGO_PKG_VERSION")),
    }
}
