//! Pages of `report` where starts fail.

use std::fs;
use std::path::Path;

use super::{folder, names, standstill};

/// What a command says, as one line.
fn said(arguments: &[&str], at: &Path) -> String {
    let output = standstill(arguments, at);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).split_whitespace().collect::<Vec<_>>().join(" ")
}

const SCENARIO: &str = "errors = \"default\"\ndetector.method = \"bipolar\"\ntrials = 30\n";

/// The words of a page, without its scripts, their data, and the coordinates of its drawings.
fn shown(page: &str) -> String {
    let body = page.split("<body").nth(1).expect("a body");
    without(&without(body, "script"), "svg")
}

/// A page without elements of this name.
fn without(page: &str, name: &str) -> String {
    let end = format!("</{name}>");
    let begin = format!("<{name}");
    let parts = page.split(&begin).enumerate();
    parts
        .map(|(k, part)| if k == 0 { part } else { part.split_once(&end).map_or("", |(_, after)| after) })
        .collect()
}

/// Thirty starts do not rule out much.
const GOOD: &str = "Not shown by so few starts: wrong poles: none in 30 starts, at most 12 % (0.01 % allowed), 0 % without an answer, at most 12 % (1 % allowed), 95 of 100 within ";

/// So much noise that the ADC clips: no start finds an angle.
const CLIPPED: [&str; 2] = ["-s", "sensors.noise=25 A"];

#[test]
fn regress_a_page_without_answers_says_so_first_and_nothing_of_poles() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("s.toml"), SCENARIO).expect("written");
    let run = |out: &str, more: &[&str]| said(&[&["run", "s.toml", "--out", out], more].concat(), at);
    run("none", &CLIPPED);
    run("good", &[]);
    // A figure of an earlier report would be taken for this one's.
    fs::create_dir(at.join("none/report")).expect("made");
    fs::write(at.join("none/report/distribution.svg"), "old").expect("written");
    let text = said(&["report", "none"], at);
    let page = fs::read_to_string(at.join("none/report/report.html")).expect("the page");
    let none = "30 of 30 starts failed (current clipped by the ADC); not met: 100 % without an answer (1 % allowed); no axis";
    assert!(text.split_whitespace().collect::<Vec<_>>().join(" ").starts_with(none), "{text}");
    assert_eq!(names(&at.join("none/report")), ["report.html"]);
    assert!(
        shown(&page).contains("class=\"verdict bad\"") && page.contains("Why starts were not answered"),
        "{page}"
    );
    for text in [&text, &shown(&page)] {
        for never in ["NaN", "wrong pole:", "No wrong pole", "wrong pole in", ">Figures<"] {
            assert!(!text.contains(never), "{never} in {text}");
        }
    }
    // A run that answers reads as before.
    assert!(said(&["report", "good"], at).starts_with(GOOD), "{GOOD}");

    let text = said(&["report", "good", "none", "--out", "both"], at);
    assert!(
        text.contains("Answered rightly: 100 % at A, 0 % at B; B is worse: it answers less; rms 0.")
            && text.contains("no axis at B")
    );
    let page = fs::read_to_string(at.join("both/comparison.html")).expect("the page");
    assert!(shown(&page).contains("class=\"verdict warning\""), "{page}");
    let rows = fs::read_to_string(at.join("both/comparison.csv")).expect("the table");
    let wrong: Vec<&str> = rows.lines().nth(4).expect("wrong poles").split(',').collect();
    assert_eq!((wrong[1], &wrong[5..11]), ("wrong poles", &[""; 6][..]), "{rows}");
    // Of rms, 95th percentile and wrong poles.
    assert_eq!(text.matches("cannot be compared").count(), 3, "{text}");
}

#[test]
fn regress_a_page_of_a_sweep_pools_no_shares_over_what_was_varied_on_purpose() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("s.toml"), SCENARIO).expect("written");
    let vary = "sensors.noise=5 mA,10 mA,25 A";
    said(&["sweep", "s.toml", "--vary", vary, "--out", "sweep"], at);
    let text = said(&["report", "sweep"], at);
    let first = "0 % to 100 % answered rightly, by point; no wrong pole at the 2 of 3 points that name one; best point 0.";
    assert!(text.starts_with(first), "{text}");
    assert!(
        text.contains("Worst point: 0 % right, no start found an axis, at sensors.noise = 25 A"),
        "{text}"
    );
    assert!(text.contains("Starts without an answer: 0 % to 100 %, by point"), "{text}");
    // 2 of 3 starts: the share of all together.
    let page = fs::read_to_string(at.join("sweep/report/report.html")).expect("the page");
    let shown = shown(&page);
    for never in ["67 %", "66.7", "33 %", "33.3", "NaN", "–°"] {
        assert!(!text.contains(never) && !shown.contains(never), "{never} in {text}");
    }
    assert!(shown.contains("class=\"verdict bad\""), "{shown}");
    // The reason stands at its point, where it has no chance to be pooled.
    // Its title is read out, too.
    let table = shown.split("Why starts were not answered").nth(2).expect("the table");
    let cells = table.split("</table>").next().expect("its end");
    assert!(cells.contains("sensors.noise") && cells.contains(">25<") && cells.contains(">100 ["), "{cells}");
}
