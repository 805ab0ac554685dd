//! Many at a time, slow ones, and files that are no files.

use std::io::Write as _;
use std::net::TcpStream;
use std::path::Path;

use serde_json::json;
use standstill_lab::{Bench, Given};
use standstill_scenario::Document;

use crate::{Running, setting};

fn served(lab: &Running) -> bool {
    let asked = json!({ "setting": setting(&[]), "trial": 3, "angle": null, "trials": 10 });
    lab.post("setting", &asked).code == 200
}

#[test]
fn regress_slow_clients_take_no_place_from_others() {
    let lab = Running::new(None);
    let (host, _) = lab.place();
    // More than are read or answered at a time; none of them ever ends its request, and the oldest are ended.
    let mut slow: Vec<TcpStream> = (0..300).map(|_| TcpStream::connect(&host).expect("it listens")).collect();
    for stream in &mut slow {
        let _ = stream.write_all(b"GET / HTTP/1.1\r\nX-Slow: ");
    }
    for _ in 0..5 {
        for stream in &mut slow {
            let _ = stream.write_all(b"a");
        }
        assert!(served(&lab));
    }
}

/// A grid of 3,000 × 3,000 points took 2.8 GB before it was looked at, and could not be given up.
#[test]
fn law_a_scenario_of_the_lab_has_as_many_points_as_it_can_keep_ready() {
    let lab = Running::new(None);
    let axis = |points: u32| format!("{{ from = 0, to = 1, points = {points} }}");
    let asked = |points: u32| {
        let keys = [("axes.sensors.noise", axis(points)), ("axes.sensors.offset", axis(points))];
        let keys: Vec<(&str, &str)> = keys.iter().map(|(key, value)| (*key, value.as_str())).collect();
        lab.post("setting", &json!({ "setting": setting(&keys), "trial": 3, "angle": null, "trials": 10 }))
    };
    for (points, said) in [(3000, "at most 1000000"), (101, "at most 10000")] {
        let begun = std::time::Instant::now();
        let answer = asked(points);
        assert_eq!(answer.code, 422, "{}", answer.text());
        assert!(answer.text().contains(said) && answer.text().contains("axes"), "{}", answer.text());
        assert!(begun.elapsed().as_secs() < 5, "it is counted, not made");
    }
}

#[test]
fn regress_what_panics_gives_its_place_back() {
    let root = tempfile::tempdir().expect("a folder");
    for name in ["panics", "run"] {
        std::fs::create_dir(root.path().join(name)).expect("made");
    }
    let lab = Running::new(Some(root.path()));
    let (host, own) = lab.place();
    for _ in 0..70 {
        let mut stream = TcpStream::connect(&host).expect("it listens");
        let text = format!("GET {own}report/panics HTTP/1.1\r\nHost: {host}\r\n\r\n");
        stream.write_all(text.as_bytes()).expect("sent");
        // The thread that panics closes the connection.
        let _ = std::io::copy(&mut stream, &mut std::io::sink());
    }
    assert!(served(&lab));
    assert_eq!(lab.get("report/run").code, 200);
}

#[cfg(unix)]
#[test]
fn regress_links_and_pipes_are_no_results() {
    use std::os::unix::fs::symlink;

    let root = tempfile::tempdir().expect("a folder");
    let inside = root.path().join("lab");
    for name in ["linked", "piped", "run"] {
        std::fs::create_dir_all(inside.join(name)).expect("made");
    }
    std::fs::write(root.path().join("trials.csv"), "secret").expect("written");
    std::fs::write(inside.join("linked/summary.json"), "{}").expect("written");
    symlink(root.path().join("trials.csv"), inside.join("linked/trials.csv")).expect("made");
    for name in ["piped/summary.json", "run/run.journal"] {
        let made = std::process::Command::new("mkfifo").arg(inside.join(name)).status().expect("mkfifo");
        assert!(made.success());
    }
    let lab = Running::new(Some(&inside));
    for name in ["linked", "piped"] {
        let answer = lab.get(&format!("report/{name}"));
        assert_eq!(answer.code, 404, "{name}");
        assert!(answer.text().contains("no plain files"), "{}", answer.text());
    }
    assert_eq!(lab.get("report/run").code, 200, "nothing there is nothing wrong");
    // A journal that is a pipe is none: the page of progress comes at once.
    let progress = lab.post("progress", &json!({ "path": "run" }));
    assert_eq!((progress.code, progress.json()["journals"].as_array().map(Vec::len)), (200, Some(0)));
}

/// A lab that opens with more points would refuse each change of a setting.
#[test]
fn law_a_lab_opens_with_no_more_points_than_it_keeps_ready() {
    let open = |points: u32| {
        let text = format!("axes.\"sensors.noise\" = {{ from = 0, to = 1, points = {points} }}");
        let document = Document::parse(Path::new("s.toml"), &text).expect("TOML");
        Bench::new(Given { document, ..Given::nothing().expect("a scenario") }, None).map(|_| ())
    };
    open(100).expect("few enough");
    let said = open(10_001).expect_err("too many").to_string();
    assert!(said.contains("found 10001 points") && said.contains("at most 10000 in the lab"), "{said}");
}
