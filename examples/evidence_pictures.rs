//! Two pictures of the manual: errors and wrong poles of a rotor that turns (`docs/realism.md`), and faults of all methods (`docs/faults.md`).
//!
//! Run with `cargo run --release --example evidence_pictures`; writes `docs/pictures/speed.svg`, and `docs/pictures/faults.svg` of the tables
//! in `docs/notes/faults-methods.md`.

use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;

use standstill_report::figure::{Axis, Figure, Layer, Panel, Style};
use standstill_scenario::{Document, Plan, Record, Verdict};

/// Speeds of the rotor in rpm.
const SPEEDS: [f64; 9] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 400.0];
/// Starts at each speed.
const STARTS: u64 = 100;
/// Pole pairs of `paper-5k5`.
const POLE_PAIRS: f64 = 4.0;

/// Methods in two panels, with the styles of their lines.
const PANELS: [(&str, &[(&str, Style)]); 2] = [
    (
        "line pulses, vectors and injections",
        &[
            ("line-inductance", Style::Blue),
            ("line-inductance-fast", Style::Vermilion),
            ("subdivision", Style::Green),
            ("hfi-rotating", Style::Purple),
            ("hfi-pulsating", Style::Orange),
        ],
    ),
    (
        "short pulses",
        &[
            ("open-terminal", Style::Blue),
            ("six-pulse", Style::Black),
            ("bipolar", Style::Green),
            ("maximum-likelihood", Style::Purple),
            ("maximum-likelihood-adaptive", Style::Orange),
        ],
    ),
];

/// Starts of a method without checks at a speed in rpm.
fn starts(method: &str, rpm: f64) -> Result<Vec<Record>, Box<dyn Error>> {
    let text = format!(
        "motor = \"paper-5k5\"\nerrors = \"default\"\nrotor = {{ state = \"driven\", speed = \"{rpm} rpm\" }}\n\
         sensors = {{ terminals = true, timer = \"0.32 us\" }}\ndetector = {{ method = \"{method}\", checks = false }}\n"
    );
    let scenario = Plan::new(Document::parse(Path::new("picture"), &text)?)?.scenario(0)?;
    Ok((0..STARTS).map(|trial| scenario.trial(trial)).collect::<Result<_, _>>()?)
}

/// Errors over the speed: points are measured, lines are the speed times the age that the method states. Below, the share of wrong poles.
fn speed() -> Result<Figure, Box<dyn Error>> {
    let axis = || Axis::new("speed of the rotor (rpm)").range(1.0, 400.0).log10();
    let mut wrong = Panel::new(axis(), Axis::new("wrong poles (% of all starts)")).titled("wrong poles");
    let mut panels = Vec::new();
    for (title, methods) in PANELS {
        let errors = Axis::new("rms error of the axis at the end (°)").range(0.03, 90.0).log10();
        let mut panel = Panel::new(axis(), errors).titled(title);
        for (method, style) in methods {
            let (mut measured, mut named, mut age) = (Vec::new(), Vec::new(), None);
            for rpm in SPEEDS {
                let all = starts(method, rpm)?;
                let errors: Vec<f64> = all.iter().filter_map(Record::axis_error_deg).collect();
                if errors.len() >= 5 {
                    let square = errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64;
                    measured.push((rpm, square.sqrt()));
                }
                let ages: Vec<f64> = all.iter().filter_map(Record::age_s).collect();
                if !ages.is_empty() {
                    age.get_or_insert(ages.iter().sum::<f64>() / ages.len() as f64);
                }
                let found = all.iter().filter(|record| record.verdict() == Verdict::Found);
                let count = found.filter(|record| record.pole_correct() == Some(false)).count();
                named.push((rpm, 100.0 * count as f64 / STARTS as f64));
                println!("{method} {rpm} rpm: {} axes, {count} wrong poles", errors.len());
            }
            // 360° p/60 a second and rpm. Beyond 45° an axis is as far off as any.
            let late = age.unwrap_or(f64::NAN) * 6.0 * POLE_PAIRS;
            let closed = SPEEDS.map(|rpm| (rpm, late * rpm)).into_iter().filter(|(_, error)| *error < 45.0);
            panel = panel
                .with(Layer::Points { label: Some((*method).to_owned()), points: measured, style: *style })
                .with(Layer::Line { label: None, points: closed.collect(), style: *style });
            if named.iter().any(|(_, share)| *share > 0.0) {
                wrong = wrong.with(Layer::Line {
                    label: Some((*method).to_owned()),
                    points: named,
                    style: *style,
                });
            }
        }
        panels.push(panel);
    }
    panels.push(wrong);
    Ok(Figure {
        title: "A rotor that turns: errors and wrong poles over the speed".to_owned(),
        subtitle: Some(
            "paper-5k5, default errors, no checks; points: measured, lines: speed times the stated age"
                .to_owned(),
        ),
        width: 760,
        height: 1100,
        panels,
    })
}

/// A table of methods and faults: for each fault and method the largest share in per cent over the motors.
#[derive(Default)]
struct Matrix {
    methods: Vec<String>,
    faults: Vec<String>,
    wrong: BTreeMap<(usize, usize), f64>,
    dangerous: BTreeMap<(usize, usize), f64>,
}

impl Matrix {
    /// Reads the tables of all motors.
    fn read(page: &str) -> Self {
        let mut matrix = Self::default();
        let rows = page.lines().filter(|line| line.starts_with("| "));
        for line in rows {
            let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
            if cells[0] == "fault" {
                matrix.methods = cells[1..].iter().map(|name| (*name).to_owned()).collect();
                continue;
            }
            let shares =
                |cell: &str| cell.split(" · ").map(|share| share.parse().ok()).collect::<Option<Vec<f64>>>();
            if !cells[1..].iter().any(|cell| shares(cell).is_some_and(|of| of.len() == 3)) {
                continue;
            }
            let name = cells[0].replace('`', "");
            let row = matrix.faults.iter().position(|known| *known == name).unwrap_or_else(|| {
                matrix.faults.push(name);
                matrix.faults.len() - 1
            });
            for (column, cell) in cells[1..].iter().enumerate() {
                if let Some([wrong, beyond, _]) = shares(cell).as_deref() {
                    for (to, share) in [(&mut matrix.wrong, *wrong), (&mut matrix.dangerous, wrong + beyond)]
                    {
                        let most = to.entry((row, column)).or_insert(0.0);
                        *most = most.max(share);
                    }
                }
            }
        }
        matrix
    }

    fn panel(&self, of: &BTreeMap<(usize, usize), f64>, label: &str) -> Panel {
        let (rows, columns) = (self.faults.len(), self.methods.len());
        let edges = |count: usize| (0..=count).map(|at| at as f64 - 0.5).collect();
        // The first fault is at the top.
        let names: Vec<String> = self.faults.iter().rev().cloned().collect();
        let value =
            |row: usize, column: usize| of.get(&(rows - 1 - row, column)).copied().unwrap_or(f64::NAN);
        let values = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
        Panel::new(Axis::categories("", self.methods.iter().cloned()), Axis::categories("", names))
            .titled(label)
            .with(Layer::Heat {
                x_edges: edges(columns),
                y_edges: edges(rows),
                values: values.map(|(row, column)| value(row, column)).collect(),
                colour: Axis::new("% of the starts").range(0.5, 100.0).log10(),
                blank: "not run, or the method has no such part".to_owned(),
                texts: Vec::new(),
            })
    }
}

fn faults() -> Result<Figure, Box<dyn Error>> {
    let matrix = Matrix::read(&std::fs::read_to_string(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/docs/notes/faults-methods.md"
    ))?);
    let dangerous = matrix.panel(&matrix.dangerous, "wrong pole, or more than 2° off");
    let wrong = matrix.panel(&matrix.wrong, "wrong pole");
    Ok(Figure {
        title: "Faults of all methods".to_owned(),
        subtitle: Some("the largest share of three motors, 300 starts each".to_owned()),
        width: 900,
        height: 1500,
        panels: vec![wrong, dangerous],
    })
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = Path::new("docs/pictures");
    std::fs::create_dir_all(folder)?;
    std::fs::create_dir_all(folder)?;
    for (name, figure) in [("faults", faults()?), ("speed", speed()?)] {
        std::fs::write(folder.join(format!("{name}.svg")), figure.svg()?)?;
        if let Ok(png) = std::env::var("PNG") {
            std::fs::write(Path::new(&png).join(format!("{name}.png")), figure.png()?)?;
        }
        println!("{}", folder.join(format!("{name}.svg")).display());
    }
    Ok(())
}
