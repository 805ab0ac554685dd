//! `standstill odds`.

use std::fs;

use super::answers::{SCENARIO, answer, has, number};
use super::{folder, names};

/// One question, asked of one thread without files and of three with them.
#[test]
fn law_odds_are_those_of_plain_trials_on_any_number_of_threads_and_draw_a_typical_start() {
    let folder = folder();
    fs::write(folder.path().join("s.toml"), SCENARIO).expect("written");
    let arguments = ["odds", "s.toml", "--event", "|e| > 1 deg", "--effort", "quick", "--json"];
    let one = answer(&[&arguments[..], &["--threads", "1"]].concat(), 0, folder.path());
    assert_eq!(names(folder.path()), ["s.toml"], "with --json no files");
    has(&one, &["event", "probability", "low", "high", "trials", "levels"]);
    let (low, high) = (number(&one, "low"), number(&one, "high"));
    assert!(low < 0.24 && 0.22 < high && high - low < 0.04, "{low} to {high}");
    assert_eq!((&one["event"], &one["levels"]), (&"|e| > 1 deg".into(), &1.into()));
    let share = one["share_of"].as_str().expect("a text");
    assert!(
        share.contains("of all starts") && share.contains("whose axis is off by more than 1°"),
        "{share}"
    );
    assert_eq!(number(&one, "trials"), 8_000.0);
    let found = answer(&[&arguments[..], &["--threads", "3", "--out", "k"]].concat(), 0, folder.path());
    assert_eq!(one, found);
    let read = |name: &str| fs::read(folder.path().join("k").join(name)).expect("a file");
    let text = |name: &str| String::from_utf8(read(name)).expect("text");
    let png = read("typical.png");
    assert!(png.starts_with(b"\x89PNG\r\n\x1a\n") && png.len() > 20_000, "{} bytes", png.len());
    // The waveforms of one detection, whose error is beyond the bound and is that of the likeliest range.
    let figure = text("typical.svg");
    for part in ["a typical start with |e| &gt; 1 deg", "as it was found", "out of the DC link"] {
        assert!(figure.contains(part), "{part}");
    }
    let page = text("odds.html");
    let said = page.split("the start nearest to its means: ").nth(1).expect("a caption");
    let error = said.split("error ").nth(1).and_then(|rest| rest.split('°').next()).expect("an error");
    let error: f64 = error.parse().expect("a number");
    assert!(error.abs() > 1.0, "{error}");
    let likeliest = &found["sectors"][0];
    assert_eq!(likeliest["positive_error"], error > 0.0, "{likeliest}");
    let title = figure.split("rotor at ").nth(1).and_then(|rest| rest.split('°').next()).expect("an angle");
    let angle: f64 = title.parse::<f64>().expect("a number").rem_euclid(180.0);
    let [from, to] = [0, 1].map(|end| likeliest["angles_deg"][end].as_f64().expect("degrees"));
    assert!(from - 0.1 <= angle && angle <= to + 0.1, "{angle} of {likeliest}");
}
