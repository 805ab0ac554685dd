//! Motors from published sheets, from the sheet to a verdict: what `check` recommends is tried on fresh starts, divided among the
//! states of the rotor and the ends of a range of saturation, and where it says "not suited", all pulses and rounds of a fine grid are tried too.
//!
//! ```text
//! cargo run --release --example ten_motors                     one motor, few starts
//! cargo run --release --example ten_motors -- 20000            all of examples/motors and three of the library; docs/notes/ten-motors.md keeps this
//! cargo run --release --example ten_motors -- 20000 hub.toml   sheets of your own
//! cargo run --release --example ten_motors -- 2000 field quick another error set, another effort
//! ```

use std::path::{Path, PathBuf};

use standstill_analysis::{Condition, Demands, Effort, Suitability, Suited};
use standstill_campaign::{Campaign, Summary};
use standstill_interface::Choice;
use standstill_scenario::{Document, ErrorSet, Origin};

type Error = Box<dyn std::error::Error>;

/// Seed of the fresh starts; settings were looked for and confirmed on others.
const SEED: &str = "20261124";

fn main() -> Result<(), Error> {
    let mut arguments = std::env::args().skip(1);
    let starts = arguments.next().map(|text| text.parse::<u64>()).transpose()?;
    let (mut asked, mut sheets) = (Asked::default(), Vec::new());
    for word in arguments {
        match (ErrorSet::named(&word), Effort::named(&word)) {
            (Some(errors), _) => asked.errors = errors,
            (_, Some(effort)) => asked.effort = effort,
            _ => sheets.push(PathBuf::from(word)),
        }
    }
    if sheets.is_empty() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        for file in std::fs::read_dir(root.join("examples/motors"))? {
            sheets.push(file?.path());
        }
        // Those that the library has.
        let library = ["pump-submersible", "drone-u8", "hub-hoverboard"];
        sheets.extend(library.map(|name| root.join(format!("crates/plant/motors/{name}.toml"))));
        sheets.retain(|sheet| sheet.extension().is_some_and(|extension| extension == "toml"));
        sheets.sort();
        if starts.is_none() {
            sheets.retain(|sheet| sheet.ends_with("servo-2310.toml"));
        }
    }
    println!(
        "| motor | verdict | settings | p95 ° | wrong poles | undetermined | failed | moved ° | A of A | holds | processor s |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    let mut all_hold = true;
    for sheet in &sheets {
        all_hold &= judged(sheet, asked, starts.unwrap_or(200))?;
    }
    if all_hold { Ok(()) } else { Err("what was said does not hold".into()) }
}

/// Errors of drive and sensors, and the work of a check.
#[derive(Clone, Copy, Default)]
struct Asked {
    errors: ErrorSet,
    effort: Effort,
}

/// One motor: a row of the table.
fn judged(sheet: &Path, asked: Asked, starts: u64) -> Result<bool, Error> {
    let text = format!("motor = \"{}\"\nerrors = \"{}\"\n", sheet.display(), asked.errors.name());
    let document = Document::parse(Path::new("scenario"), &text)?;
    let demands = Demands::default();
    let began = processor_seconds();
    let found = Suitability::of(&document, &demands, asked.effort, |_| {})?;
    let seconds = processor_seconds() - began;
    let name = sheet.file_stem().unwrap_or_default().to_string_lossy();
    let verdict = match (&found.condition, found.suited()) {
        (Some(Condition::Saturation { least, most, .. }), _) => {
            format!("suited if saturation is {:.2} to {:.0} %", 100.0 * least, 100.0 * most)
        }
        (_, Suited::No | Suited::Undecided | Suited::Unknown) => found.suited().name().to_owned(),
        (Some(Condition::Pole), _) => "axis only".to_owned(),
        (None, _) => "suited".to_owned(),
    };
    if found.suited() == Suited::Undecided {
        let untried = found.untried.join("; ");
        println!("| {name} | {verdict}; not tried: {untried} | | | | | | | | | {seconds:.0} |");
        return Ok(true);
    }
    let Some(recommended) = found.document(&document)? else {
        let (tried, suffice) = exhaustive(&document, &demands, starts.min(200))?;
        let helps: Vec<String> =
            found.advice.iter().filter(|of| of.helps.is_some()).map(|of| of.change.clone()).collect();
        let helps = if helps.is_empty() { "nothing that was tried".to_owned() } else { helps.join("; ") };
        println!(
            "| {name} | {verdict}; helps: {helps} | {tried} of a grid: {suffice} suffice | | | | | | | {} | {seconds:.0} |",
            suffice == 0
        );
        return Ok(suffice == 0);
    };
    let candidate = found.recommended().ok_or("recommended")?;
    let keys: Vec<String> =
        candidate.setting.keys.iter().map(|(key, value)| format!("{key} {value}")).collect();
    // Where a range of saturation is the condition, both of its ends.
    let mut ends = vec![recommended.clone()];
    if let Some(Condition::Saturation { most, .. }) = found.condition {
        let mut end = recommended;
        end.set("motor.nameplate.saturation", &format!("{} %", 100.0 * most), Origin::CommandLine)?;
        ends.push(end);
    }
    let starts = starts / (2 * ends.len() as u64);
    let mut all = Vec::new();
    for document in &ends {
        for rotor in ["locked", "free"] {
            all.push(summary(document, rotor, starts)?);
        }
    }
    let largest = |of: fn(&Summary) -> f64| all.iter().map(of).fold(0.0, f64::max);
    let p95 = largest(|of| of.p95_deg.value);
    let peak = largest(|of| of.peak_current_a);
    let moved = largest(|of| if of.max_moved_deg.is_nan() { 0.0 } else { of.max_moved_deg });
    let undetermined = largest(|of| of.undetermined as f64 / of.trials as f64);
    let failed = largest(|of| (of.failed + of.errors) as f64 / of.trials as f64);
    let wrong: u64 = all.iter().map(|of| of.wrong_poles).sum();
    let all: u64 = all.iter().map(|of| of.trials).sum();
    let poles = found.has_magnet && !found.pole_is_open();
    let holds = p95 <= demands.error_deg
        && (!poles
            || wrong as f64 <= demands.wrong_poles * all as f64 && undetermined <= demands.without_angle)
        && failed <= demands.without_angle
        && moved <= demands.movement_deg
        && peak <= found.most_current_a;
    let of_poles = if poles {
        format!("{wrong} of {all} | {:.3} %", 100.0 * undetermined)
    } else {
        "no poles |".to_owned()
    };
    println!(
        "| {name} | {verdict} | {} {} | {p95:.2} | {of_poles} | {:.3} % | {:.3} | {:.3} of {:.3} | {holds} | {seconds:.0} |",
        candidate.method(),
        keys.join(", "),
        100.0 * failed,
        moved,
        peak,
        found.most_current_a,
    );
    Ok(holds)
}

/// Processor time of this process so far in s, on Linux: fields 14 and 15 of `/proc/self/stat`, in hundredths.
fn processor_seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = text.rsplit(')').next().unwrap_or_default().split_whitespace().skip(11).take(2);
    fields.filter_map(|field| field.parse::<f64>().ok()).sum::<f64>() / 100.0
}

/// What starts of a document showed.
fn summary(document: &Document, rotor: &str, starts: u64) -> Result<Summary, Error> {
    let mut document = document.clone();
    document.set("rotor.state", rotor, Origin::CommandLine)?;
    document.set("seed", SEED, Origin::CommandLine)?;
    let scenario = document.unchecked_scenario_of(&document.motor()?)?;
    scenario.check()?;
    Ok(Campaign { scenario: &scenario, trials: starts, threads: None }.summary()?)
}

/// Methods, pulses and rounds of the grid for motors that are said not to be suited: how many there are, and how many suffice.
fn exhaustive(document: &Document, demands: &Demands, starts: u64) -> Result<(usize, usize), Error> {
    let motor = document.motor()?;
    let (mut tried, mut suffice) = (0, 0);
    let lengths: Vec<f64> =
        (0..36).map(|step| 2e-6 * standstill_numeric::exp(0.25 * f64::from(step))).collect();
    for method in ["bipolar", "maximum-likelihood", "line-inductance-fast"] {
        for pulse in lengths.iter().filter(|pulse| **pulse <= 10e-3) {
            for rounds in [2, 3, 5, 8, 14, 24, 40] {
                let mut document = document.clone();
                document.set("detector.method", method, Origin::CommandLine)?;
                document.set("detector.pulse", &format!("{:.3} us", 1e6 * pulse), Origin::CommandLine)?;
                document.set("detector.rounds", &rounds.to_string(), Origin::CommandLine)?;
                // First the current alone: beyond what is allowed nothing needs to be tried.
                let Ok(few) = summary(&document, "free", 8) else { continue };
                tried += 1;
                if few.peak_current_a > motor.rated_current
                    || few.failed > 4
                    || few.max_moved_deg > demands.movement_deg
                {
                    continue;
                }
                let all = summary(&document, "free", starts)?;
                let without = (all.undetermined + all.failed + all.errors) as f64;
                let holds = all.p95_deg.value <= demands.error_deg
                    && all.wrong_poles == 0
                    && without <= demands.without_angle * starts as f64
                    && all.max_moved_deg <= demands.movement_deg
                    && all.peak_current_a <= motor.rated_current;
                suffice += usize::from(holds);
            }
        }
    }
    Ok((tried, suffice))
}
