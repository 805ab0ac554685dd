//! `standstill fit --predict`: traces that the fit has not seen.

use std::fs;
use std::path::Path;

use serde_json::Value;

use super::{folder, mistake, names, standstill};

/// Writes the shipped trace of six pulses as two files: four pulses, and two.
fn halves(at: &Path) {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/traces/six_vectors.csv");
    let text = fs::read_to_string(path).expect("a trace");
    let (header, rows) = text.split_once('\n').expect("a header");
    let rows: Vec<&str> = rows.lines().collect();
    let off = |row: &str| row.ends_with("off,off,off");
    let begins = |k: &usize| off(rows[*k - 1]) && !off(rows[*k]);
    let fifth = (1..rows.len()).filter(begins).nth(4).expect("six pulses");
    // Half of the rest belongs to the pulse that comes.
    let (before, after) = rows.split_at(fifth - 20);
    for (name, rows) in [("seen.csv", before), ("unseen.csv", after)] {
        fs::write(at.join(name), format!("{header}\n{}\n", rows.join("\n"))).expect("written");
    }
}

#[test]
fn law_a_fit_says_how_far_it_is_from_traces_that_it_has_not_seen() {
    let folder = folder();
    let at = folder.path();
    halves(at);
    let fit = ["fit", "seen.csv", "--motor", "paper-5k5", "--predict", "unseen.csv", "--out", "f"];
    let output = standstill(&fit, at);
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{text} {}", String::from_utf8_lossy(&output.stderr));
    let files = [
        "fit.csv",
        "fit.html",
        "fit.json",
        "fit.png",
        "fit.svg",
        "motor.toml",
        "prediction.png",
        "prediction.svg",
    ];
    assert_eq!(names(&at.join("f")), files);
    for said in ["those of the fit", "unseen.csv", "Traces that the fit has not seen differ by at most"] {
        assert!(text.contains(said), "{said}: {text}");
    }
    let json: Value =
        serde_json::from_str(&fs::read_to_string(at.join("f/fit.json")).expect("written")).expect("JSON");
    let share = |of: &Value| {
        let [residual, current] =
            ["residual_rms_A", "current_rms_A"].map(|key| of[key].as_f64().expect("a number"));
        residual / current
    };
    let (own, unseen) = (share(&json), share(&json["predictions"][0]));
    assert!(own > 0.0 && unseen > 0.3 * own && unseen < 1.3 * own, "{own} {unseen}");
    // The same trace with another angle than it has.
    let seen = fs::read_to_string(at.join("seen.csv")).expect("written");
    let with = |text: &str, angle: &str| {
        let line =
            |(k, line): (usize, &str)| format!("{line},{}\n", if k == 0 { "angle_deg" } else { angle });
        text.lines().enumerate().map(line).collect::<String>()
    };
    let unseen = fs::read_to_string(at.join("unseen.csv")).expect("written");
    fs::write(at.join("at_40.csv"), with(&seen, "40")).expect("written");
    fs::write(at.join("at_70.csv"), with(&unseen, "70")).expect("written");
    let output =
        standstill(&["fit", "at_40.csv", "--motor", "paper-5k5", "--predict", "at_70.csv", "--out", "g"], at);
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("What the fit found does NOT hold for at_70.csv"), "{text}");
    assert!(
        text.contains("North is where angle_deg states it, and a current along the magnet saturates"),
        "{text}"
    );
    for (arguments, said) in [
        (&["fit", "seen.csv", "--predict", "seen.csv"][..], "seen.csv: found the same file twice"),
        (&["fit", "seen.csv", "at_40.csv"], "seen.csv: found no column angle_deg, which other files have"),
        (&["fit", "at_40.csv", "--predict", "unseen.csv"], "unseen.csv: found no column angle_deg"),
        (&["fit", "seen.csv", "--predict", "none.csv"], "cannot read none.csv"),
    ] {
        let message = mistake(arguments, at);
        assert!(message.contains(said), "{message}");
    }
    assert!(!at.join("standstill-out").exists());
}
