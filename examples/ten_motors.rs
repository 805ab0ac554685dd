//! Motors from published sheets, from the sheet to a verdict and the next command, as the program prints them: what `check` recommends is tried on fresh
//! starts, divided among the states of the rotor and the ends of a range of saturation; where it says "not suited", an exhaustive search must
//! find nothing either; and the next command is carried out.
//!
//! ```text
//! cargo build --release --bin standstill && cargo run --release --example ten_motors
//!                                              one motor, few starts; then, after --,
//! 20000                                        all of examples/motors, three of the library, and some on weaker drives: docs/notes/ten-motors.md keeps this
//! 20000 weak                                   those on weaker drives alone
//! 20000 hub.toml                               sheets of your own
//! 2000 field quick                             another error set, another effort
//! ```

#[path = "ten_motors/grid.rs"]
mod grid;
#[path = "ten_motors/program.rs"]
mod program;

use std::path::{Path, PathBuf};

use grid::Grid;
use program::{Checked, Program};
use standstill_analysis::{Demands, Effort, Suited};
use standstill_campaign::{Campaign, Summary};
use standstill_interface::Choice;
use standstill_plant::Motor;
use standstill_scenario::{Document, ErrorSet, Origin};

type Error = Box<dyn std::error::Error>;

/// Seed of the fresh starts; settings were looked for and confirmed on others.
const SEED: u64 = 20_261_124;

/// Of the library those with published sheets.
const LIBRARY: [&str; 3] = ["pump-submersible", "drone-u8", "hub-hoverboard"];

/// Drives that do not suffice for motors of the ten.
const WEAK: [(&str, &[(&str, &str)]); 3] = [
    ("mid-drive-36v", &[("sensors.bits", "8"), ("sensors.range", "200 A")]),
    ("ipm-200kw", &[("inverter.dc_link", "6 V")]),
    ("reluctance-10a", &[("sensors.bits", "6"), ("sensors.range", "100 A")]),
];

/// A motor on a drive.
pub struct Case {
    sheet: PathBuf,
    /// What differs from the default drive.
    keys: Vec<(String, String)>,
    errors: ErrorSet,
}

impl Case {
    fn name(&self) -> String {
        let name = self.sheet.file_stem().unwrap_or_default().to_string_lossy();
        self.keys.iter().fold(name.into_owned(), |name, (key, value)| format!("{name}, {key} {value}"))
    }

    /// The scenario, without a method.
    fn document(&self) -> Result<Document, Error> {
        let text = format!("motor = \"{}\"\nerrors = \"{}\"\n", self.sheet.display(), self.errors.name());
        let mut document = Document::parse(Path::new("scenario"), &text)?;
        for (key, value) in &self.keys {
            document.set(key, value, Origin::CommandLine)?;
        }
        Ok(document)
    }
}

fn main() -> Result<(), Error> {
    let mut arguments = std::env::args().skip(1);
    let starts = arguments.next().map(|text| text.parse::<u64>()).transpose()?;
    let (mut errors, mut effort, mut sheets, mut weak) =
        (ErrorSet::Default, Effort::Normal, Vec::new(), false);
    for word in arguments {
        match (ErrorSet::named(&word), Effort::named(&word)) {
            (Some(set), _) => errors = set,
            (_, Some(asked)) => effort = asked,
            _ if word == "weak" => weak = true,
            _ => sheets.push(std::path::absolute(word)?),
        }
    }
    let plain = |sheet: PathBuf| Case { sheet, keys: Vec::new(), errors };
    let cases: Vec<Case> = match (sheets.is_empty(), starts) {
        (false, _) => sheets.into_iter().map(plain).collect(),
        (true, None) => vec![plain(
            published()?.into_iter().find(|sheet| sheet.ends_with("servo-2310.toml")).ok_or("servo")?,
        )],
        (true, Some(_)) if weak => on_weaker_drives(errors)?,
        (true, Some(_)) => published()?.into_iter().map(plain).chain(on_weaker_drives(errors)?).collect(),
    };
    let program = Program::beside()?;
    println!(
        "| motor | verdict | settings | p95 ° | wrong poles | undetermined | failed | moved ° | A of A | holds | next command | and then | processor s |"
    );
    println!("|{}", "---|".repeat(13));
    let mut all_hold = true;
    for case in &cases {
        let row = row(&program, case, effort, starts.unwrap_or(200))?;
        println!("| {} | {} |", case.name(), row.cells.join(" | "));
        all_hold &= row.holds;
    }
    if all_hold { Ok(()) } else { Err("what was said does not hold".into()) }
}

/// The published sheets: those of examples/motors and of the library.
fn published() -> Result<Vec<PathBuf>, Error> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut sheets = Vec::new();
    for file in std::fs::read_dir(root.join("examples/motors"))? {
        sheets.push(file?.path());
    }
    sheets.extend(LIBRARY.map(|name| root.join(format!("crates/plant/motors/{name}.toml"))));
    sheets.retain(|sheet| sheet.extension().is_some_and(|extension| extension == "toml"));
    sheets.sort();
    Ok(sheets)
}

/// Motors of the ten on drives that do not suffice for them.
fn on_weaker_drives(errors: ErrorSet) -> Result<Vec<Case>, Error> {
    let sheets = published()?;
    let case = |(name, keys): (&str, &[(&str, &str)])| {
        let sheet = sheets.iter().find(|sheet| sheet.file_stem().is_some_and(|stem| stem == name));
        let keys = keys.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
        Ok(Case { sheet: sheet.ok_or(name)?.clone(), keys, errors })
    };
    WEAK.into_iter().map(case).collect()
}

/// A row of the table, and whether what was said of the motor holds.
struct Row {
    cells: Vec<String>,
    holds: bool,
}

/// One motor, from its sheet to the next command.
fn row(program: &Program, case: &Case, effort: Effort, starts: u64) -> Result<Row, Error> {
    let checked = program.check(case, effort)?;
    let document = case.document()?;
    let (mut cells, kept) = match (checked.suited, &checked.recommended) {
        (Suited::Undecided, _) => {
            (vec![format!("{}; not tried: {}", checked.verdict, checked.untried.join("; "))], true)
        }
        (_, Some(keys)) => recommended(&checked, keys, document, starts)?,
        (_, None) => unsuited(&checked, &document, starts)?,
    };
    cells.resize(8, String::new());
    let (next, then) = program.go_on(&checked)?;
    let goes_on = then.is_some();
    let holds = kept && goes_on;
    let next = next.replace(
        &case.sheet.display().to_string(),
        &format!("{}.toml", case.sheet.file_stem().unwrap_or_default().display()),
    );
    cells.extend([
        holds.to_string(),
        format!("`{next}`"),
        then.unwrap_or_else(|| "fails".to_owned()),
        format!("{:.0}", checked.seconds),
    ]);
    Ok(Row { cells, holds })
}

/// Cells on a motor for which settings are recommended, after fresh starts with these; and whether they meet the demands.
fn recommended(
    checked: &Checked,
    keys: &[(String, String)],
    mut document: Document,
    starts: u64,
) -> Result<(Vec<String>, bool), Error> {
    for (key, value) in keys {
        document.set(key, value, Origin::CommandLine)?;
    }
    // Where a range of saturation is the condition, both of its ends.
    let mut ends = vec![document.clone()];
    if let Some(range) = checked.saturation {
        ends.clear();
        for end in range {
            let mut document = document.clone();
            document.set(
                "motor.nameplate.saturation",
                &format!("{} %", standstill_quantity::rounded(end, 2)),
                Origin::CommandLine,
            )?;
            ends.push(document);
        }
    }
    let starts = starts / (2 * ends.len() as u64);
    let mut all = Vec::new();
    for document in &ends {
        let motor = document.motor()?;
        for rotor in ["locked", "free"] {
            all.push(summary(document, &motor, rotor, starts)?);
        }
    }
    let has_poles = checked.judges_poles && document.motor()?.has_magnet();
    let demands = Demands::default();
    let largest = |of: fn(&Summary) -> f64| all.iter().map(of).fold(0.0, f64::max);
    let p95 = largest(|of| of.p95_deg.value);
    let peak = largest(|of| of.peak_current_a);
    let moved = largest(|of| if of.max_moved_deg.is_nan() { 0.0 } else { of.max_moved_deg });
    let undetermined = largest(|of| of.undetermined as f64 / of.trials as f64);
    let failed = largest(|of| (of.failed + of.errors) as f64 / of.trials as f64);
    let wrong: u64 = all.iter().map(|of| of.wrong_poles).sum();
    let all: u64 = all.iter().map(|of| of.trials).sum();
    let holds = p95 <= demands.error_deg
        && (!has_poles
            || wrong as f64 <= demands.wrong_poles * all as f64 && undetermined <= demands.without_angle)
        && failed <= demands.without_angle
        && moved <= demands.movement_deg
        && peak <= checked.most_current_a;
    let (wrong, undetermined) = if has_poles {
        (format!("{wrong} of {all}"), format!("{:.3} %", 100.0 * undetermined))
    } else {
        ("no poles".to_owned(), String::new())
    };
    let settings: Vec<String> = keys.iter().map(|(key, value)| value_of(key, value)).collect();
    let cells = vec![
        checked.verdict.clone(),
        settings.join(", "),
        format!("{p95:.2}"),
        wrong,
        undetermined,
        format!("{:.3} %", 100.0 * failed),
        format!("{moved:.3}"),
        format!("{peak:.3} of {:.3}", checked.most_current_a),
    ];
    Ok((cells, holds))
}

/// A key of the detector and its value in words: of the method the name alone.
fn value_of(key: &str, value: &str) -> String {
    match key.trim_start_matches("detector.") {
        "method" => value.to_owned(),
        key => format!("{key} {value}"),
    }
}

/// Cells on a motor that no settings suit, after an exhaustive search; and whether that found nothing either.
fn unsuited(checked: &Checked, document: &Document, starts: u64) -> Result<(Vec<String>, bool), Error> {
    let helps =
        if checked.helps.is_empty() { "nothing that was tried".to_owned() } else { checked.helps.join("; ") };
    let verdict = format!("{}; helps: {helps}", checked.verdict);
    let motor = document.motor()?;
    if checked.suited == Suited::Unknown {
        // Equation (1) has one inductance in each direction then: currents do not depend on the angle, whatever is ordered.
        let said = "no search: with L_d = L_q each direction has the same inductance, and no reading depends on the angle";
        let has_axis = (motor.winding.saliency / motor.winding.mean_inductance).abs() > 1e-3;
        return Ok((vec![verdict, said.to_owned()], !has_axis));
    }
    let demands = Demands::default();
    let found = Grid { document, motor: &motor, demands: &demands, starts }.search()?;
    let methods: Vec<&str> = found.methods.iter().map(|method| method.name()).collect();
    let nearest = found.nearest.map_or_else(String::new, |near| format!("; nearest: {}", near.said));
    let said =
        format!("{} settings of {}: {} suffice", found.tried, methods.join(", "), found.sufficing.len());
    let said = if found.sufficing.is_empty() {
        said + &nearest
    } else {
        format!("{said}: {}", found.sufficing.join("; "))
    };
    Ok((vec![verdict, said], found.sufficing.is_empty()))
}

/// What fresh starts of a document show.
fn summary(document: &Document, motor: &Motor, rotor: &str, starts: u64) -> Result<Summary, Error> {
    let mut document = document.clone();
    document.set("rotor.state", rotor, Origin::CommandLine)?;
    document.set("seed", &SEED.to_string(), Origin::CommandLine)?;
    let scenario = document.unchecked_scenario_of(motor)?;
    scenario.check()?;
    Ok(Campaign { scenario: &scenario, trials: starts, threads: None }.summary()?)
}
