//! The figures and pages of reports, awkward cases included, drawn from made-up data:
//! `gallery FOLDER [MOTOR [WIDTH]]` writes `page.html`, and every figure as SVG and PNG, this many pixels wide. The name of the motor may
//! be anything, such as `"</script><script>alert(1)</script>"`.

mod charts;
mod noise;
mod studies;

use noise::noise;
use standstill_report::page::{Block, Column, Page, Section, Table, Tone};
use standstill_report::study::figures;
use std::path::Path;

const SCENARIO: &str = r#"# Which tolerances of drive and motor still give the right pole?
[motor]
name = "paper-5k5"

[method]
name = "maximum-likelihood"
pulse = "80 us"        # the paper's

[sweep]
design = "sobol"
points = 1000

[sweep.axes]
"errors.dead_time" = { from = "0.5 us", to = "4 us" }
"drive.link_voltage" = { from = "480 V", to = "620 V" }
"#;

/// A long table, with empty cells.
fn points() -> Table {
    let mut random = noise(3);
    let row = |index: u32| {
        let (dead, link) = (0.5 + 3.5 * random(), 480.0 + 140.0 * random());
        let rms = 0.1 + 0.034 * (dead - 0.5f64).powi(2) + 0.03 * random();
        let outcome = if rms > 0.5 { "too large" } else { "found" };
        let outcome = if index.is_multiple_of(211) { "wrong pole" } else { outcome };
        let rms = if index.is_multiple_of(333) { String::new() } else { format!("{rms:.3}") };
        let bias = format!("{:.3}", 0.02 - 0.05 * random());
        vec![index.to_string(), format!("{dead:.2}"), format!("{link:.0}"), rms, bias, outcome.to_owned()]
    };
    Table::new([
        Column::number("point"),
        Column::number("dead time t_d").unit("µs"),
        Column::number("link U_dc").unit("V"),
        Column::number("rms error").unit("°"),
        Column::number("bias").unit("°"),
        Column::word("outcome"),
    ])
    .captioned("Points of the sweep")
    .rows((1..=1000).map(row))
}

fn requirements() -> Table {
    let row = |cells: [&str; 4]| cells.map(str::to_owned).to_vec();
    Table::new([
        Column::word("requirement"),
        Column::number("limit"),
        Column::number("found"),
        Column::word("met"),
    ])
    .captioned("Requirements")
    .rows([
        row(["rms error of the axis (°)", "0.5", "0.31", "yes"]),
        row(["wrong poles (%)", "1.0", "0.4", "yes"]),
        row(["rotor moves (°)", "0.10", "0.13", "no"]),
    ])
}

fn verdict(tone: Tone, headline: &str, details: &[&str]) -> Block {
    let details = details.iter().map(|detail| (*detail).to_owned()).collect();
    Block::Verdict { tone, headline: headline.to_owned(), details }
}

fn page(motor: &str) -> Page {
    let section = |title: &str, blocks: Vec<Block>| Section::new(title, blocks);
    let facts = [
        ("Motor", format!("{motor}, 5.5 kW, 4 pole pairs")),
        ("Inductances L_d, L_q", "9.2 mH, 12.6 mH".to_owned()),
        ("Drive", "540 V link, IGBT, 2 µs dead time".to_owned()),
        ("Sensors", "12 bit, ±25 A, 20 kHz".to_owned()),
    ];
    let how = "The error is that of the axis, estimate minus truth. A wrong pole is counted by itself and not as an \
               error of 180°.\n\nDrag to zoom, double-click to see everything again; a click on a series hides it.";
    Page {
        title: format!("Sweep of tolerances, motor {motor}"),
        subtitle: "1,000 points, 200,000 detections by maximum likelihood, rotor free".into(),
        sections: vec![
            section(
                "Verdict",
                vec![
                    verdict(
                        Tone::Good,
                        "The method finds the pole within every tolerance of the drive.",
                        &[
                            "0.4 % wrong poles, 95 % interval 0.1 % to 1.0 %; accepted are 1.0 %.",
                            "The rms error stays below 0.5° up to a dead time t_d of 3.6 µs.",
                        ],
                    ),
                    verdict(Tone::Warning, "A free rotor moves 0.13°, more than the 0.10° asked for.", &[]),
                    verdict(
                        Tone::Bad,
                        "5 of 1,000 points could not be simulated.",
                        &["Their currents leave the flux map at i_d < −22 A."],
                    ),
                    verdict(Tone::Neutral, "The sweep was interrupted once and resumed.", &[]),
                    Block::Table(requirements()),
                ],
            ),
            section(
                "Conditions",
                vec![
                    Block::Facts(facts.map(|(name, value)| (name.to_owned(), value)).to_vec()),
                    Block::Code { caption: "scenario.toml".into(), text: SCENARIO.into() },
                ],
            ),
            section(
                "Figures",
                [Block::Text(how.into())]
                    .into_iter()
                    .chain(charts::all(motor).into_iter().map(Block::Chart))
                    .collect(),
            ),
            section("Points", vec![Block::Table(points())]),
        ],
        footer: "Written by Standstill 0.1.0. The same scenario and seed give the same page.".into(),
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().ok_or("usage: gallery FOLDER [MOTOR [WIDTH]]")?;
    let motor = arguments.next().unwrap_or_else(|| "paper-5k5".to_owned());
    let width = arguments.next().map(|text| text.parse::<u32>()).transpose()?;
    std::fs::create_dir_all(&folder)?;
    let html = page(&motor).html()?;
    // Room for two more such sweeps in a mail of 10 MB.
    assert!(html.len() < 3_300_000, "{} bytes", html.len());
    std::fs::write(Path::new(&folder).join("page.html"), html)?;
    let charts = charts::all(&motor).into_iter().map(|chart| (chart.id, chart.figure));
    let studies = studies::all().into_iter().flat_map(|(study, of)| {
        figures(&of).into_iter().map(move |(name, figure)| (format!("{study}-{name}"), figure))
    });
    for (name, mut figure) in charts.chain(studies) {
        figure.width = width.unwrap_or(figure.width);
        std::fs::write(Path::new(&folder).join(format!("{name}.svg")), figure.svg()?)?;
        std::fs::write(Path::new(&folder).join(format!("{name}.png")), figure.png()?)?;
        println!("{name}");
    }
    Ok(())
}
