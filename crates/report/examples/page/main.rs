//! Writes a page with made-up data of every kind to the path given as first argument. The second is the name of the
//! motor, which may be anything: `page out.html "</script><script>alert(1)</script>"`.

mod charts;
mod maps;

use standstill_report::page::{Block, Page, Section, Table, TableColumn, Tone};
use std::time::Instant;

const SCENARIO: &str = r#"# Which tolerances of drive and motor still give the right pole?
[motor]
name = "paper-5k5"

[method]
name = "maximum-likelihood"
pulse = "80 us"        # the paper's

[errors]
set = "harsh"
current_gain = { uniform = [-0.02, 0.02] }

[rotor]
state = "free"

[sweep]
design = "sobol"
points = 1000
seed = 20260114

[sweep.axes]
"errors.dead_time" = { from = "0.5 us", to = "4 us" }
"drive.link_voltage" = { from = "480 V", to = "620 V" }
"winding.temperature" = { from = "-20 degC", to = "120 degC" }
"#;

fn points() -> Table {
    let mut random = charts::noise(3);
    let mut rows = Vec::new();
    for index in 1..=1000 {
        let (dead, link, warm) = (0.5 + 3.5 * random(), 480.0 + 140.0 * random(), -20.0 + 140.0 * random());
        let rms = 0.1 + 0.034 * (dead - 0.5f64).powi(2) + 0.03 * random();
        let outcome = if index % 211 == 0 {
            "wrong pole"
        } else if rms > 0.5 {
            "too large"
        } else {
            "found"
        };
        let rms = if index % 333 == 0 { String::new() } else { format!("{rms:.3}") };
        rows.push(vec![
            index.to_string(),
            format!("{dead:.2}"),
            format!("{link:.0}"),
            format!("{warm:.1}"),
            rms,
            format!("{:.3}", 0.02 - 0.05 * random()),
            format!("{:.2}", 9.0 + 1.5 * random()),
            format!("{:.1}", 11.0 + 2.0 * random()),
            outcome.to_owned(),
        ]);
    }
    Table {
        caption: "Points of the sweep".into(),
        columns: vec![
            TableColumn::number("point", ""),
            TableColumn::number("dead time t_d", "µs"),
            TableColumn::number("link U_dc", "V"),
            TableColumn::number("winding", "°C"),
            TableColumn::number("rms error", "°"),
            TableColumn::number("bias", "°"),
            TableColumn::number("duration", "ms"),
            TableColumn::number("peak current", "A"),
            TableColumn::text("outcome"),
        ],
        rows,
    }
}

fn requirements() -> Table {
    let row = |cells: [&str; 4]| cells.map(str::to_owned).to_vec();
    Table {
        caption: "Requirements".into(),
        columns: vec![
            TableColumn::text("requirement"),
            TableColumn::number("limit", ""),
            TableColumn::number("found", ""),
            TableColumn::text("met"),
        ],
        rows: vec![
            row(["rms error of the axis (°)", "0.5", "0.31", "yes"]),
            row(["wrong poles (%)", "1.0", "0.4", "yes"]),
            row(["duration (ms)", "12", "10.5", "yes"]),
            row(["rotor moves (°)", "0.10", "0.13", "no"]),
        ],
    }
}

fn facts(motor: &str) -> Block {
    let motor = format!("{motor}, 5.5 kW, 4 pole pairs");
    let facts = [
        ("Motor", motor.as_str()),
        ("Inductances L_d, L_q", "9.2 mH, 12.6 mH"),
        ("Drive", "540 V link, IGBT, 2 µs dead time"),
        ("Sensors", "12 bit, ±25 A, 20 kHz"),
        ("Method", "maximum-likelihood"),
        ("Errors", "harsh"),
        ("Trials per point", "200"),
        ("Seed", "20260114"),
        ("Version", "Standstill 0.1.0"),
        ("Scenario", "m_1.toml, crc32 9f3a70c1"),
    ];
    Block::Facts(facts.map(|(name, value)| (name.to_owned(), value.to_owned())).to_vec())
}

fn page(motor: &str) -> Page {
    let section = |title: &str, blocks| Section { title: title.to_owned(), blocks };
    Page {
        title: format!("Sweep of tolerances, motor {motor}"),
        subtitle: "1,000 points, 200,000 detections by maximum likelihood, rotor free".into(),
        sections: vec![
            section(
                "Verdict",
                vec![
                    Block::Verdict {
                        tone: Tone::Good,
                        headline: "The method finds the pole within every tolerance of the drive.".into(),
                        details: vec![
                            "0.4 % wrong poles, 95 % interval 0.1 % to 1.0 %; accepted are 1.0 %.".into(),
                            "The rms error stays below 0.5° up to a dead time t_d of 3.6 µs.".into(),
                        ],
                    },
                    Block::Verdict {
                        tone: Tone::Warning,
                        headline: "A free rotor moves 0.13°, more than the 0.10° asked for.".into(),
                        details: vec![],
                    },
                    Block::Verdict {
                        tone: Tone::Bad,
                        headline: "5 of 1,000 points could not be simulated.".into(),
                        details: vec!["Their currents leave the flux map at i_d < −22 A.".into()],
                    },
                    Block::Verdict {
                        tone: Tone::Neutral,
                        headline: "The sweep was interrupted once and resumed.".into(),
                        details: vec![],
                    },
                    Block::Table(requirements()),
                ],
            ),
            section("Conditions", vec![facts(motor), Block::Code { caption: "scenario.toml".into(), text: SCENARIO.into() }]),
            section(
                "Error",
                vec![
                    Block::Text(
                        "The error is that of the axis, estimate minus truth. A wrong pole is counted by itself and \
                         not as an error of 180°.\n\nDrag to zoom, double-click to see everything again; a click on \
                         a series hides it."
                            .into(),
                    ),
                    Block::Chart(charts::scatter()),
                    Block::Chart(charts::influences()),
                    Block::Chart(charts::methods(motor)),
                ],
            ),
            section("Waveforms", vec![Block::Chart(charts::waveform()), Block::Chart(charts::polarity())]),
            section(
                "Two at a time",
                vec![
                    Block::Chart(maps::grid()),
                    Block::Chart(maps::methods()),
                    Block::Chart(maps::noise()),
                    Block::Chart(maps::decay()),
                ],
            ),
            section("Points", vec![Block::Chart(charts::convergence()), Block::Table(points())]),
        ],
        footer: "Written by Standstill 0.1.0. The same scenario and seed give the same page.".into(),
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or("usage: page FILE [MOTOR]")?;
    let motor = arguments.next().unwrap_or_else(|| "paper-5k5".to_owned());
    let start = Instant::now();
    let html = page(&motor).html()?;
    println!("{} kB in {:.0?}", html.len() / 1000, start.elapsed());
    // Room for two more such sweeps in a mail of 10 MB.
    assert!(html.len() < 3_300_000, "{} bytes", html.len());
    std::fs::write(path, html)?;
    Ok(())
}
