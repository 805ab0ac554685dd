//! Reports of finished runs: one file that says what was run, and none of trials that do not belong together.

use std::fs;

use super::campaigns::{SWEEP, files, scenario, succeed};
use super::{folder, mistake, names};

#[test]
fn law_a_report_is_one_file_that_says_what_was_run() {
    let folder = folder();
    let path = folder.path();
    scenario(path, SWEEP);
    for format in ["csv", "parquet"] {
        succeed(&["run", "s.toml", "--trials", "60", "--format", format, "--out", format], path);
        let text = succeed(&["report", format], path);
        assert!(
            text.contains("at any of 4 points")
                && text.contains("Worst point: ")
                && text.contains("answered rightly"),
            "{text}"
        );
        let report = path.join(format).join("report");
        let made = names(&report);
        for name in ["report.html", "sweep_sensors.noise.png", "heat_sensors.noise_errors.png"] {
            assert!(made.iter().any(|made| made == name), "{name} in {made:?}");
        }
        let page = fs::read_to_string(report.join("report.html")).expect("readable");
        for part in
            ["bipolar", "standstill run scenario.toml", "errors&quot; = [", "sensors.noise", "Verdict"]
        {
            assert!(page.contains(part), "{part}");
        }
    }
    // Both formats hold the same trials; the printed command alone differs.
    let pictures = |format: &str| {
        let mut files = files(&path.join(format).join("report"));
        files.remove("report.html");
        files
    };
    assert_eq!(pictures("csv"), pictures("parquet"));

    assert!(mistake(&["report", "nowhere"], path).contains("nowhere: found no such folder"));
    fs::remove_file(path.join("parquet/trials.parquet")).expect("there");
    assert!(mistake(&["report", "parquet"], path).contains("no trials"));
    succeed(&["run", "s.toml", "--trials", "60", "--seed", "2", "--out", "other"], path);
    let write = |out: &str, trials: &str| super::changed::write_with_its_digest(&path.join(out), trials);
    let other = fs::read_to_string(path.join("other/trials.csv")).expect("readable");
    write("csv", &other);
    assert!(mistake(&["report", "csv"], path).contains("another seed"));
    let short: Vec<&str> = other.lines().take(100).collect();
    write("other", &short.join("\n"));
    assert!(mistake(&["report", "other"], path).contains("99 trials instead of 240"));
}
