//! `standstill odds`.

use std::fs;

use super::answers::{SCENARIO, answer, has, number};
use super::{folder, names};

#[test]
fn law_odds_of_what_is_not_rare_are_those_of_plain_trials_on_any_number_of_threads() {
    let folder = folder();
    fs::write(folder.path().join("s.toml"), SCENARIO).expect("written");
    let arguments = ["odds", "s.toml", "--event", "|e| > 1 deg", "--json"];
    let one = answer(&[&arguments[..], &["--threads", "1"]].concat(), 0, folder.path());
    assert_eq!(one, answer(&[&arguments[..], &["--threads", "3"]].concat(), 0, folder.path()));
    has(&one, &["event", "probability", "low", "high", "trials", "levels"]);
    let (low, high) = (number(&one, "low"), number(&one, "high"));
    assert!(low < 0.24 && 0.22 < high && high - low < 0.02, "{low} to {high}");
    assert_eq!((&one["event"], &one["levels"]), (&"|e| > 1 deg".into(), &1.into()));
    assert_eq!(number(&one, "trials"), 32_000.0);
    assert_eq!(names(folder.path()), ["s.toml"], "with --json no files");
}
