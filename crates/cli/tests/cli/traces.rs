//! The files of `trace`: what flows where, and of which trial they are.

use std::fs;
use std::path::Path;

use standstill_table::{Cell, Column, Kind, Reader};

use crate::{folder, standstill};

/// The largest sum of the phase currents in A, and how much of them no device carries at most.
fn currents(path: &Path) -> (f64, f64) {
    let reader = Reader::open(path).expect("a table");
    let names = ["i_a_A", "i_b_A", "i_c_A", "i_leg_a_A", "i_leg_b_A", "i_leg_c_A"];
    let (mut sum, mut charging) = (0.0_f64, 0.0_f64);
    let read = reader.values(&names.map(|name| Column::new(name, Kind::Number)), |row| {
        let number = |k: usize| if let Cell::Number(number) = row[k] { number } else { panic!("no number") };
        let [a, b, c, legs @ ..]: [f64; 6] = std::array::from_fn(number);
        sum = sum.max((a + b + c).abs());
        charging = [a, b, c].iter().zip(legs).fold(charging, |most, (i, leg)| most.max((i - leg).abs()));
    });
    read.expect("rows");
    (sum, charging)
}

#[test]
fn law_files_of_a_trace_have_both_currents_and_say_of_which_trial_they_are() {
    let folder = folder();
    let path = folder.path();
    for format in ["csv", "parquet", "npz", "mat"] {
        let of = ["--motor", "paper-5k5", "--method", "bipolar", "--errors", "field", "--trial", "3"];
        let output = standstill(&[&["trace", "--format", format, "--out", format][..], &of].concat(), path);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let result = fs::read_to_string(path.join(format).join("result.json")).expect("result.json");
        let result: serde_json::Value = serde_json::from_str(&result).expect("JSON");
        assert_eq!(result["version"], env!("CARGO_PKG_VERSION"));
        assert!(result["numerics"].is_u64());
        let of = [("version", &result["version"]), ("scenario", &result["scenario"]), ("trial", &"3".into())];
        for name in ["waveform", "events"] {
            let file = path.join(format).join(format!("{name}.{format}"));
            if ["csv", "parquet"].contains(&format) {
                let metadata = Reader::open(&file).expect("a table").metadata;
                for (key, value) in &of {
                    assert_eq!(
                        metadata.get(*key).map(String::as_str),
                        value.as_str(),
                        "{name}.{format}: {key}"
                    );
                }
                assert_eq!(metadata["numerics"], result["numerics"].to_string());
            } else {
                // Texts of four bytes or one a character: those of the metadata in their order.
                let bytes = fs::read(&file).expect("a file");
                let text: String =
                    bytes.iter().filter(|byte| **byte != 0).map(|byte| char::from(*byte)).collect();
                for part in ["\"version\":\"", "\"numerics\":\"", "\"scenario\":\"motor", "\"trial\":\"3\""] {
                    assert!(text.contains(part), "{name}.{format}: {part}");
                }
            }
        }
    }
    for format in ["csv", "parquet"] {
        let (sum, charging) = currents(&path.join(format).join(format!("waveform.{format}")));
        // Each is a whole number of nanoamperes.
        assert!(sum < 2e-9 && charging > 1.0, "{format}: {sum} A, {charging} A");
    }
}

/// A rotor that something turns at 10 rpm, by four pole pairs, has turned by ω times the age since the instant for which the angle holds. The
/// pulses of `bipolar` end 4.74 ms before its end in the mean.
#[test]
fn analytic_a_trace_has_the_error_at_the_instant_of_its_angle() {
    let folder = folder();
    let keys = [
        "rotor.state=driven",
        "rotor.speed=10 rpm",
        "errors=none",
        "detector.method=bipolar",
        "detector.checks=false",
    ];
    let mut words = vec!["trace"];
    words.extend(keys.iter().flat_map(|key| ["-s", *key]));
    let said = standstill(&[&words[..], &["--out", "t"]].concat(), folder.path());
    let said = String::from_utf8_lossy(&said.stdout).into_owned();
    let result = fs::read_to_string(folder.path().join("t/result.json")).expect("written");
    let result: serde_json::Value = serde_json::from_str(&result).expect("JSON");
    let number = |key: &str| result[key].as_f64().unwrap_or_else(|| panic!("{key}: {result}"));
    let [age, end, instant] = ["age_s", "error_deg", "error_at_instant_deg"].map(number);
    assert!((age / 4.74e-3 - 1.0).abs() < 0.08, "{age}");
    assert!((instant - end - 4.0 * 60.0 * age).abs() < 1e-6, "{instant} {end} {age}");
    let line = format!(
        "the angle holds {:.2} ms before the end of the detection: its error then {instant:+.3}°",
        age * 1e3
    );
    assert!(said.contains(&line), "{said}");
}
