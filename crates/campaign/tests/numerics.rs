//! What the program computes, to the last bit, and the number under which it is known.
//!
//! A change of any result fails here until the number is raised. Then
//! `NUMERICS=raise cargo test -p standstill-campaign --test numerics` appends the line that belongs in
//! `src/numerics.txt`.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use standstill_campaign::NUMERICS;
use standstill_campaign::store::{Journal, Row, Rows, Shard, Sweep};
use standstill_detect::MethodName;
use standstill_plant::{built_in, built_in_names};
use standstill_scenario::{Document, Plan};

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/src/numerics.txt");

/// Beside methods on motors: what else the numbers of a trial come from.
const OTHERS: [(&str, &str); 6] = [
    (
        "map",
        "errors = \"harsh\"\n[motor]\nbase = \"motor.toml\"\n[axes]\n\"rotor.state\" = [\"locked\", \"free\"]",
    ),
    (
        "tolerances",
        "errors = \"harsh\"\nrotor = { state = \"free\", load = \"0.01 N m\" }\n[tolerances]\n\"motor.winding.resistance\" = { normal = \"5 %\" }\n\"sensors.noise\" = { uniform = \"4 mA\", mean = \"10 mA\" }",
    ),
    (
        "warm",
        "motor = \"gearless-hoist\"\nrotor = { winding_temperature = \"120 °C\", magnet_temperature = \"90 °C\" }\n[inverter]\nripple = \"3 %\"\nripple_frequency = \"300 Hz\"\nopen_leg = \"open\"",
    ),
    (
        "sensors",
        "[axes]\n\"sensors.arrangement\" = [\"two-in-line\", \"low-side-shunts\"]\n\"sensors.bandwidth\" = [\"20 kHz\"]\n\"inverter.dead_time\" = [\"4 us\"]",
    ),
    (
        "field",
        "errors = \"field\"\n[axes]\nmotor = [\"paper-5k5\", \"outrunner\"]\n\"inverter.terminal_capacitance\" = [\"0 F\", \"0.3 nF\"]\n\"detector.method\" = [\"line-inductance\", \"bipolar\"]",
    ),
    (
        "ringing",
        "[inverter]\nterminal_capacitance = \"0.3 nF\"\n[axes]\nmotor = [\"paper-5k5\", \"outrunner\"]\n\"detector.method\" = [\"line-inductance-fast\", \"bipolar\"]",
    ),
];

/// Effects that no other kept run contains, each with the digest of its rows. A digest that changes is a change of results: it asks
/// for the next number, too (see [`OTHERS`]).
const EFFECTS: [(&str, &str, &str); 6] = [
    (
        "source resistance",
        "[inverter]\ncapacitance = \"100 uF\"\nsource_resistance = \"2 Ω\"\n[axes]\n\"rotor.state\" = [\"locked\", \"free\"]",
        "30021f0f",
    ),
    (
        "sag",
        "detector.method = \"bipolar\"\n[inverter]\nsag_depth = \"20 %\"\nsag_start = \"0.5 ms\"\nsag_duration = \"3 ms\"\n[axes]\n\"rotor.state\" = [\"locked\", \"free\"]",
        "258080c6",
    ),
    (
        "hysteresis",
        "motor = { base = \"paper-5k5\", hysteresis = { coercive_current = 0.08, depth = \"5 %\", cells = 3 } }\ndetector.method = \"bipolar\"\n[axes]\n\"rotor.memory\" = [\"virgin\", \"former\"]\n\"rotor.state\" = [\"locked\", \"free\"]",
        "798f88ad",
    ),
    (
        "hysteresis, ringing terminals and a link that gives way",
        "motor = { base = \"outrunner\", hysteresis = { coercive_current = 0.5, depth = \"5 %\", cells = 2 } }\ndetector.method = \"bipolar\"\nrotor.state = \"free\"\n[inverter]\nterminal_capacitance = \"0.3 nF\"\ncapacitance = \"100 uF\"\nsource_resistance = \"0.1 Ω\"",
        "96d39ca1",
    ),
    (
        "terminals",
        "sensors.terminals = true\ndetector.method = \"open-terminal\"\n[axes]\nerrors = [\"default\", \"field\"]\nmotor = [\"paper-5k5\", \"cross-saturation\"]",
        "a3e86f6d",
    ),
    (
        "six pulses, timed with common and own comparators",
        "errors = \"field\"\ndetector.method = \"six-pulse\"\n[sensors]\ntimer = \"0.32 us\"\n[axes]\nmotor = [\"paper-5k5\", \"outrunner\"]\n\"sensors.comparators\" = [\"common\", \"per-leg\"]\n\"rotor.state\" = [\"locked\", \"free\"]",
        "87a5f053",
    ),
];

/// Motors of the library that digests are of: one that is added behind them changes no result.
const MOTORS: usize = 12;

/// Each method on the motors, each of these with other errors and another state of the rotor.
fn method(name: MethodName) -> Vec<String> {
    let shift = MethodName::ALL.iter().position(|method| *method == name).unwrap_or_default();
    // Seconds of pulse-width modulation: on some motors, once.
    let long = [MethodName::DcAlignment, MethodName::HfiRotating].contains(&name);
    let scenario = |(k, motor): (usize, &str)| {
        let errors = ["none", "noise", "default", "harsh"][(k + shift) % 4];
        let brake = built_in(motor).is_some_and(|motor| motor.rotor.backlash > 0.0);
        let rotor = ["locked", "free", if brake { "brake" } else { "free" }][(k + shift / 2) % 3];
        let trials = if long { 1 } else { 2 };
        format!(
            "motor = \"{motor}\"\nerrors = \"{errors}\"\nrotor.state = \"{rotor}\"\ndetector.method = \"{name}\"\ntrials = {trials}\n"
        )
    };
    built_in_names().take(MOTORS).enumerate().filter(|(k, _)| !long || k % 3 == 0).map(scenario).collect()
}

/// A data sheet with a map, beside the scenarios.
fn write_motor(folder: &Path) {
    let mut map = String::from("i_d_A,i_q_A,psi_d_Wb,psi_q_Wb\n");
    for d in -12..=12 {
        for q in -12..=12 {
            let (d, q) = (f64::from(d), f64::from(q));
            let psi_d = 0.45 + 0.0106 * d - 2e-5 * d * d - 5e-5 * q * q;
            let psi_q = 0.0169 * q - 1e-4 * d * q;
            let _ = writeln!(map, "{d},{q},{psi_d:.9},{psi_q:.9}");
        }
    }
    std::fs::write(folder.join("map.csv"), map).expect("written");
    let sheet = standstill_plant::DataSheet::built_in_text("paper-5k5").expect("built in");
    let (head, rest) = sheet.split_once("[saturation]").expect("a table");
    let rotor = &rest[rest.find("[rotor]").expect("a table")..];
    let line = "file = { value = \"map.csv\", source = \"given\", reason = \"computed\" }";
    std::fs::write(folder.join("motor.toml"), format!("{head}[map]\n{line}\n{rotor}")).expect("written");
}

/// The rows of a run, as they are stored.
fn rows(folder: &Path, scenario: &str) -> Vec<Row> {
    let document = Document::parse(&folder.join("s.toml"), scenario).expect("TOML");
    let plan = Plan::new(document).unwrap_or_else(|error| panic!("{scenario}: {error}"));
    let sweep = Sweep { plan: &plan, shard: Shard::WHOLE, threads: None };
    let path = folder.join("run.journal");
    let mut journal = Journal::create(&path, &sweep.identity().expect("TOML")).expect("writable");
    assert!(sweep.run(&mut journal, &AtomicBool::new(false), |_| {}).expect("runs"));
    let mut rows = Rows::open(&path).expect("a journal");
    std::iter::from_fn(|| rows.block().expect("readable")).flatten().map(|(_, row)| row).collect()
}

/// The digest of every bit of these rows.
fn digest(name: &str, rows: &Vec<Row>) -> String {
    // Digests of trials that are alike, or without angles, would tell nothing.
    assert!(rows.windows(2).all(|pair| pair[0] != pair[1]), "{name}: {rows:?}");
    assert!(rows.iter().any(|row| row.axis_error_deg.is_some()), "{name}: {rows:?}");
    format!("{:08x}", crc32fast::hash(&postcard::to_stdvec(rows).expect("serialisable")))
}

/// The digest of each method's rows, then of the others'.
fn digests() -> Vec<(String, String)> {
    let folder = tempfile::tempdir().expect("a folder");
    write_motor(folder.path());
    // Methods that came later, with sensors of their own, are among the effects.
    let later = |name: &MethodName| [MethodName::OpenTerminal, MethodName::SixPulse].contains(name);
    let methods =
        MethodName::ALL.into_iter().filter(|name| !later(name)).map(|name| (name.to_string(), method(name)));
    let others = OTHERS.map(|(name, text)| (name.to_owned(), vec![format!("trials = 4\n{text}")]));
    let mut digests = Vec::new();
    for (name, scenarios) in methods.chain(others) {
        let rows: Vec<Row> = scenarios.iter().flat_map(|text| rows(folder.path(), text)).collect();
        let digest = digest(&name, &rows);
        digests.push((name, digest));
    }
    digests
}

#[test]
fn golden_effects_keep_their_bits() {
    let folder = tempfile::tempdir().expect("a folder");
    let of = |text: &str| rows(folder.path(), &format!("trials = 4\n{text}"));
    let found = EFFECTS.map(|(name, text, _)| (name, digest(name, &of(text))));
    let kept = EFFECTS.map(|(name, _, digest)| (name, digest.to_owned()));
    assert_eq!(found, kept);
    // Without its table each of them gives other rows.
    let plain = digest("plain", &of("[axes]\n\"rotor.state\" = [\"locked\", \"free\"]"));
    assert!(found.iter().all(|(_, digest)| *digest != plain));
}

#[test]
fn golden_results_change_only_with_the_number_of_the_numerics() {
    let text = std::fs::read_to_string(FILE).expect("readable");
    let lines: Vec<(u32, Vec<&str>)> = text
        .lines()
        .map(|line| {
            let (number, digests) = line.split_once(' ').expect("a number and digests");
            (number.parse().expect("a number"), digests.split(' ').collect())
        })
        .collect();
    for (k, (number, digests)) in lines.iter().enumerate() {
        assert_eq!(usize::try_from(*number), Ok(k + 1), "each number is the next one: only append lines");
        assert!(lines[..k].iter().all(|(_, others)| others != digests), "{number} is an earlier line again");
    }
    let found = digests();
    let known = lines.last().map_or(&[][..], |(_, digests)| digests);
    let changed: Vec<&str> = found
        .iter()
        .enumerate()
        .filter(|(k, (_, digest))| known.get(*k).is_none_or(|known| known != digest))
        .map(|(_, (name, _))| name.as_str())
        .collect();
    if changed.is_empty() && known.len() == found.len() {
        assert_eq!(usize::try_from(NUMERICS), Ok(lines.len()));
        return;
    }
    let all: Vec<&str> = found.iter().map(|(_, digest)| digest.as_str()).collect();
    let line = format!("{} {}", lines.len() + 1, all.join(" "));
    if std::env::var("NUMERICS").is_ok_and(|word| word == "raise") {
        let mut file = std::fs::OpenOptions::new().append(true).open(FILE).expect("writable");
        writeln!(file, "{line}").expect("written");
        println!("appended to {FILE}: {line}");
        return;
    }
    panic!(
        "the results of {} are no longer those of numerics {}. If that is meant, append this line to {FILE}, so that no \
         interrupted run goes on with other numbers (NUMERICS=raise does it):\n{line}",
        changed.join(", "),
        lines.len(),
    );
}
