//! Tables of finished runs that somebody or something has changed since.

use std::fs;
use std::path::Path;
use std::process::Output;

use standstill_campaign::store::{Identity, Journal};

use crate::{folder, mistake, standstill};

const SCENARIO: &str = "trials = 30\n[detector]\nmethod = \"bipolar\"\n";

fn succeed(arguments: &[&str], folder: &Path) -> Output {
    let output = standstill(arguments, folder);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

/// Puts a table in place of a run's, as if the run had written it.
pub fn write_with_its_digest(folder: &Path, trials: &str) {
    fs::write(folder.join("trials.csv"), trials).expect("written");
    let summary = folder.join("summary.json");
    let mut json: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(&summary).expect("there")).expect("JSON");
    json["tables"]["trials.csv"] = standstill_files::Digest::of(trials.as_bytes()).to_string().into();
    // The summary's own is that of its text without white space.
    json.as_object_mut().expect("a table").remove("digest");
    let text = json.to_string();
    let squeezed: String = text.chars().filter(|c| !c.is_ascii_whitespace()).collect();
    let digest = standstill_files::Digest::of(squeezed.as_bytes());
    let rest = text.strip_suffix('}').expect("a table");
    fs::write(summary, format!("{rest},\"digest\":\"{digest}\"}}")).expect("written");
}

/// promise: changed-tables-refused
#[test]
fn law_a_table_with_any_bit_flipped_is_refused_by_all_that_read_it() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SCENARIO).expect("written");
    for format in ["csv", "parquet"] {
        succeed(&["run", "s.toml", "--format", format, "--force", "--out", "r"], path);
        let table = path.join(format!("r/trials.{format}"));
        let [whole, summary] =
            [&table, &path.join("r/summary.json")].map(|path| fs::read(path).expect("there"));
        let longer = ["run", "s.toml", "--trials", "40", "--format", format, "--resume", "--out", "r"];
        let again = ["run", "s.toml", "--format", format, "--resume", "--out", "r"];
        let refused = |arguments: &[&str], what: &str| {
            let message = mistake(arguments, path);
            for part in [&format!("trials.{format}: found "), "not what the run wrote", "--force --out r"] {
                assert!(message.contains(part), "{what}: {part} in {message}");
            }
            assert_eq!(fs::read(path.join("r/summary.json")).expect("there"), summary, "{what}");
        };
        for flip in 0..40 {
            // All over the file, each bit of a byte in turn.
            let (place, bit) = (whole.len() * flip / 40, flip % 8);
            let mut changed = whole.clone();
            changed[place] ^= 1 << bit;
            fs::write(&table, changed).expect("written");
            let what = format!("bit {bit} of byte {place}");
            refused(&longer, &what);
            if flip % 10 == 3 {
                refused(&again, &what);
                refused(&["report", "r"], &what);
                refused(&["report", "r", "r"], &what);
                refused(&["explain", "r", "--worst", "1"], &what);
            }
        }
        fs::write(&table, &whole[..whole.len() - 1]).expect("written");
        refused(&longer, "cut");
        // The way out that the message names; then all is as it was.
        succeed(&["run", "s.toml", "--format", format, "--force", "--out", "r"], path);
        assert_eq!(fs::read(&table).expect("there"), whole);
        succeed(&longer, path);
    }
}

/// promise: changed-tables-refused
#[test]
fn regress_a_summary_with_any_digit_changed_is_refused_by_all_that_read_it() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SCENARIO).expect("written");
    succeed(&["run", "s.toml", "--out", "r"], path);
    let summary = path.join("r/summary.json");
    let whole = fs::read(&summary).expect("there");
    let digits: Vec<usize> = (0..whole.len()).filter(|place| whole[*place].is_ascii_digit()).collect();
    let longer = ["run", "s.toml", "--trials", "40", "--resume", "--out", "r"];
    let again = ["run", "s.toml", "--resume", "--out", "r"];
    for flip in 0..40 {
        // All over the file, each digit by another one.
        let place = digits[digits.len() * flip / 40];
        let mut changed = whole.clone();
        changed[place] = if changed[place] == b'9' { b'0' } else { changed[place] + 1 };
        fs::write(&summary, changed).expect("written");
        let all =
            [&["report", "r"][..], &longer, &again, &["report", "r", "r"], &["explain", "r", "--worst", "1"]];
        for arguments in &all[..if flip % 10 == 3 { 5 } else { 1 }] {
            let message = mistake(arguments, path);
            for part in ["r/summary.json: found ", "did not write", "--force --out r"] {
                assert!(message.contains(part), "{arguments:?}, byte {place}: {part} in {message}");
            }
        }
    }
    // Laid out anew it is still the run's.
    let text = String::from_utf8(whole.clone()).expect("text");
    fs::write(&summary, text.replace('\n', " ").replace("  ", "")).expect("written");
    succeed(&["report", "r"], path);
    // The way out that the message names.
    fs::write(&summary, text.replacen("\"trials\": 30", "\"trials\": 31", 1)).expect("written");
    succeed(&["run", "s.toml", "--force", "--out", "r"], path);
    assert_eq!(fs::read(&summary).expect("there"), whole);
}

#[test]
fn regress_a_run_that_ended_between_its_table_and_its_summary_goes_on() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SCENARIO).expect("written");
    let longer = ["run", "s.toml", "--trials", "40", "--out"];
    succeed(&["run", "s.toml", "--out", "r"], path);
    succeed(&[&longer[..], &["whole"]].concat(), path);
    // The table of the longer run is in place, and its journal is there; the summary is that of the shorter one.
    let text = fs::read_to_string(path.join("whole/summary.json")).expect("there");
    let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let identity: Identity = serde_json::from_value(json["run"].clone()).expect("what was run");
    drop(Journal::create(&path.join("r/run.journal"), &identity).expect("a journal"));
    fs::copy(path.join("whole/trials.csv"), path.join("r/trials.csv")).expect("copied");
    assert!(mistake(&["report", "r"], path).contains("with --resume: the journal has its trials"));
    succeed(&[&longer[..], &["r", "--resume"]].concat(), path);
    for file in ["trials.csv", "summary.json"] {
        let [resumed, whole] = ["r", "whole"].map(|out| fs::read(path.join(out).join(file)).expect("there"));
        assert_eq!(resumed, whole, "{file}");
    }
}

#[test]
fn law_a_folder_without_digests_is_read_with_a_word_about_it() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SCENARIO).expect("written");
    succeed(&["run", "s.toml", "--out", "r"], path);
    let summary = path.join("r/summary.json");
    let text = fs::read_to_string(&summary).expect("there");
    let mut json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let json = json.as_object_mut().expect("a table");
    json.remove("digest").expect("the summary's own");
    let tables = json.remove("tables").expect("digests");
    assert!(tables["trials.csv"].as_str().is_some_and(|digest| digest.contains("bytes, CRC-32")), "{tables}");
    let older = serde_json::to_string(json).expect("JSON");
    fs::write(&summary, &older).expect("written");
    for arguments in
        [&["report", "r", "--json"][..], &["run", "s.toml", "--trials", "31", "--resume", "--out", "r"]]
    {
        let output = succeed(arguments, path);
        let said = String::from_utf8_lossy(&output.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(said.contains("trials.csv: summary.json beside it") && said.contains("no digest"), "{said}");
    }
    // Extended by this version, it has them.
    assert!(fs::read_to_string(&summary).expect("there").contains("\"trials.csv\": \""));
    assert!(succeed(&["report", "r", "--json"], path).stderr.is_empty());
}

#[test]
fn law_merged_tables_have_the_digests_of_the_whole_run() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SCENARIO).expect("written");
    succeed(&["run", "s.toml", "--out", "whole"], path);
    for shard in ["1/2", "2/2"] {
        succeed(&["run", "s.toml", "--shard", shard, "--out", "shards"], path);
    }
    succeed(&["merge", "shards", "--out", "merged"], path);
    let of = |folder: &str, file: &str| fs::read(path.join(folder).join(file)).expect("there");
    for file in ["trials.csv", "summary.json"] {
        assert_eq!(of("whole", file), of("merged", file));
    }
    // A table that was changed is not what is put together: it is replaced by the trials of the shards.
    fs::write(path.join("merged/trials.csv"), "trial\n1\n").expect("written");
    assert!(mistake(&["report", "merged"], path).contains("not what the run wrote"));
    succeed(&["merge", "shards", "--out", "merged"], path);
    assert_eq!(of("merged", "trials.csv"), of("whole", "trials.csv"));
}

#[test]
fn law_a_value_for_the_key_of_an_axis_is_refused() {
    let folder = folder();
    let path = folder.path();
    fs::write(
        path.join("s.toml"),
        format!("{SCENARIO}[axes]\n\"inverter.dead_time\" = [\"1 us\", \"2 us\"]\n"),
    )
    .expect("written");
    let of_motor = ["--vary", "motor=paper-5k5,outrunner", "-s", "motor.winding.resistance=1 ohm"];
    for (command, set) in [
        ("run", &["-s", "inverter.dead_time=3 us"][..]),
        ("run", &["-s", "inverter={ dead_time = \"3 us\" }"]),
        ("sweep", &["-s", "inverter.dead_time=3 us"]),
        ("sweep", &["-s", "sensors.noise=1 mA", "--vary", "sensors.noise=0:2 mA:2"]),
        ("sweep", &of_motor),
        ("sweep", &["--seed", "3", "--vary", "seed=1,2"]),
        ("trace", &["-s", "inverter.dead_time=3 us"]),
    ] {
        let message = mistake(&[&[command, "s.toml", "--out", "x"], set].concat(), path);
        for part in ["is an axis of the scenario", "[VALUE]", "axes={}"] {
            assert!(message.contains(part), "{command} {set:?}: {message}");
        }
        assert!(!path.join("x").exists());
    }
    // What the message says works, and so do keys beside the axis.
    for set in [
        &["-s", "axes.inverter.dead_time=[\"3 us\"]"][..],
        &["-s", "axes={}", "-s", "inverter.dead_time=3 us"],
        &["-s", "inverter.carrier=8000"],
    ] {
        succeed(&[&["run", "s.toml", "--trials", "2", "--force", "--out", "y"], set].concat(), path);
    }
}
