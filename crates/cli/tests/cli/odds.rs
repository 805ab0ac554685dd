//! `standstill odds`.

use std::fs;

use super::answers::{SCENARIO, answer, has, number};
use super::{folder, names, standstill};

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

/// Where a quarter of the starts fails without an axis, `run` counts errors among the starts with an angle and `odds` among all. The rows of
/// `run` give both shares, which are far apart, and each says of which starts it is.
#[test]
fn law_a_share_says_whether_it_is_of_starts_with_an_angle_or_of_all() {
    let folder = folder();
    let path = folder.path();
    let scenario = "motor = \"gimbal\"\nerrors = \"field\"\nseed = 4\nlimit = \"3 deg\"\n\
                    detector.method = \"line-inductance-fast\"\n";
    fs::write(path.join("s.toml"), scenario).expect("written");
    let output = standstill(&["run", "s.toml", "--trials", "2000", "--out", "r"], path);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut rows = csv::Reader::from_path(path.join("r/trials.csv")).expect("rows");
    let place = |names: &csv::StringRecord, name: &str| names.iter().position(|n| n == name).expect(name);
    let names = rows.headers().expect("names").clone();
    let [outcome, error, axis] = ["outcome", "error_deg", "axis_error_deg"].map(|name| place(&names, name));
    let (mut found, mut beyond, mut axes_beyond) = (0_u32, 0_u32, 0_u32);
    for row in rows.records() {
        let row = row.expect("a row");
        let off = |at: usize| row[at].parse::<f64>().is_ok_and(|degrees| degrees.abs() > 3.0);
        found += u32::from(&row[outcome] == "found");
        beyond += u32::from(off(error));
        axes_beyond += u32::from(off(axis));
    }
    assert!((1_300..1_700).contains(&found) && beyond > 300, "{found} {beyond}");
    let printed = String::from_utf8(output.stdout).expect("text");
    let line = printed.lines().find(|line| line.contains("angle off by > 3°")).expect("a line");
    assert!(line.contains(&format!("of {found} with an angle")), "{line}");
    let summary = fs::read_to_string(path.join("r/summary.json")).expect("a summary");
    let summary: serde_json::Value = serde_json::from_str(&summary).expect("JSON");
    let share = number(&summary["summary"]["beyond_limit"], "value");
    assert!((share - f64::from(beyond) / f64::from(found)).abs() < 1e-12, "{share}");
    let asked = ["odds", "s.toml", "--event", "|e| > 3 deg", "--effort", "quick", "--json"];
    let odds = answer(&asked, 0, path);
    let of_all = f64::from(axes_beyond) / 2000.0;
    // Four standard deviations of the 2,000 starts to either side of the interval.
    let four = 4.0 * (of_all * (1.0 - of_all) / 2000.0).sqrt();
    let (low, high) = (number(&odds, "low"), number(&odds, "high"));
    let holds = |share: f64| low - four < share && share < high + four;
    assert!(holds(of_all) && !holds(share), "{of_all} {share}: {low} to {high}");
    let text = odds["share_of"].as_str().expect("a text");
    assert!(text.starts_with("of all starts"), "{text}");
}

/// A rotor that is held does not move: there is nothing to compute.
#[test]
fn regress_an_event_that_cannot_happen_is_refused() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SCENARIO).expect("written");
    let message = super::mistake(&["odds", "s.toml", "--event", "moved > 1 deg"], path);
    for part in ["moved > 1 deg", "a rotor that is held", "rotor.state=free"] {
        assert!(message.contains(part), "{part}: {message}");
    }
}

/// Pulses that are too short to tell the poles: hardly a start names one, so a wrong one is as rare as can be, and that is no merit.
#[test]
fn regress_the_odds_of_starts_without_an_answer_say_so() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), "motor = \"outrunner\"\ndetector.method = \"bipolar\"\n")
        .expect("written");
    let ask = |more: &[&str]| {
        let asked = ["odds", "s.toml", "--event", "wrong-pole", "--effort", "quick", "--force"];
        let output = standstill(&[&asked[..], more].concat(), path);
        (output.status.code(), String::from_utf8(output.stdout).expect("text"))
    };
    let plain = |path: &std::path::Path| {
        let json = fs::read_to_string(path.join("standstill-out/s-odds/odds.json")).expect("an answer");
        let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
        (json["probability"].clone(), json["plain_starts"].clone())
    };
    let (code, text) = ask(&["-s", "detector.pulse=4us"]);
    assert_eq!(code, Some(3), "{text}");
    assert!(
        text.contains("wrong-pole: nothing to be said, for none of 1000 plain starts has an answer: "),
        "{text}"
    );
    assert!(
        text.contains("What next:\n  whether other settings answer\n    standstill check s.toml\n"),
        "{text}"
    );
    let (probability, starts) = plain(path);
    assert!(probability.is_null() && starts["with_angle"] == 0 && starts["starts"] == 1000, "{starts}");
    // Of a part of the starts the number stands beside their share, on the page too.
    let (code, text) = ask(&["-s", "detector.pulse=13us"]);
    let (probability, starts) = plain(path);
    let without = 1000 - starts["with_angle"].as_u64().expect("a count");
    assert!(code == Some(0) && probability.is_f64() && (20..980).contains(&without), "{without}: {text}");
    let headline = text.lines().find(|line| line.starts_with("wrong-pole: ")).expect("a headline");
    let beside = format!("; {without} of 1000 plain starts have no answer");
    assert!(headline.ends_with(&beside), "{headline}");
    let page = fs::read_to_string(path.join("standstill-out/s-odds/odds.html")).expect("a page");
    assert!(page.contains(&beside) && page.contains("standstill check s.toml"));
    // The plain starts are those of `run`.
    let run = ["run", "s.toml", "--trials", "1000", "-s", "detector.pulse=13us", "--json"];
    let run: serde_json::Value = serde_json::from_slice(&standstill(&run, path).stdout).expect("JSON");
    assert_eq!(run["summary"]["found"], starts["with_angle"]);
    // Where all answer, that is said as well.
    let (_, text) = ask(&[]);
    assert!(text.contains("\n  each of 1000 plain starts has an answer\n"), "{text}");
}
