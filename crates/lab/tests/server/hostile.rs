//! What nobody may.

use std::io::Write as _;
use std::net::TcpStream;

use serde_json::json;

use crate::{Running, frames, setting};

/// promise: lab-answers-its-page-alone
#[test]
fn law_nobody_without_the_address_gets_an_answer() {
    let lab = Running::new(None);
    let (host, own) = lab.place();
    assert_eq!(lab.get("").code, 200);
    let token = own.trim_matches('/');
    assert!(token.len() == 32 && token.bytes().all(|byte| byte.is_ascii_hexdigit()));
    let port = host.rsplit(':').next().expect("a port");
    for (path, headers) in [
        ("/".to_owned(), format!("Host: {host}\r\n")),
        ("/index.html".to_owned(), format!("Host: {host}\r\n")),
        (format!("/{}/", "0".repeat(32)), format!("Host: {host}\r\n")),
        (format!("/x/..{own}"), format!("Host: {host}\r\n")),
        (own.clone(), String::new()),
        (own.clone(), "Host: evil.example\r\n".to_owned()),
        (own.clone(), format!("Host: evil.example:{port}\r\n")),
        (own.clone(), format!("Host: {host}\r\nHost: {host}\r\n")),
        (own.clone(), format!("Host: {host}\r\nOrigin: http://evil.example\r\n")),
        (own.clone(), format!("Host: {host}\r\nOrigin: null\r\n")),
        (own.clone(), format!("Host: {host}\r\nSec-Fetch-Site: cross-site\r\n")),
    ] {
        let answer = lab.raw(&format!("GET {path} HTTP/1.1\r\n{headers}"), "");
        assert_eq!(answer.code, 403, "{path} {headers}");
        assert!(!answer.text().contains(token) && !answer.head.contains(token));
    }
    for name in ["setting", "detection", "cloud", "start"] {
        let lines =
            format!("POST {own}api/{name} HTTP/1.1\r\nHost: {host}\r\nOrigin: http://evil.example\r\n");
        assert_eq!(lab.raw(&lines, "{}").code, 403, "{name}");
    }
    // Two labs have two tokens.
    assert_ne!(Running::new(None).place().1, own);
}

/// promise: lab-loads-nothing
#[test]
fn law_the_page_loads_nothing_from_elsewhere_and_says_so() {
    let lab = Running::new(None);
    let page = lab.get("");
    for header in [
        "default-src 'none'",
        "script-src 'self'",
        "frame-ancestors 'none'",
        "nosniff",
        "no-referrer",
        "no-store",
    ] {
        assert!(page.head.contains(header), "{header}: {}", page.head);
    }
    // Whatever a file of the page names is there, and has a kind.
    let mut files = vec![String::new()];
    let mut at = 0;
    while at < files.len() {
        let answer = lab.get(&files[at]);
        assert_eq!(answer.code, 200, "{}", files[at]);
        let text = answer.text();
        let outside: Vec<&str> = text
            .split("http")
            .skip(1)
            .filter(|rest| rest.starts_with("://") || rest.starts_with("s://"))
            .collect();
        assert!(
            outside.iter().all(|rest| rest.starts_with("://www.w3.org/2000/svg")),
            "{}: {outside:?}",
            files[at]
        );
        for quote in ["src=\"", "href=\"", "from './"] {
            for rest in text.split(quote).skip(1) {
                let name = rest.split(['"', '\'']).next().expect("a name").to_owned();
                if !name.starts_with('#') && !files.contains(&name) {
                    files.push(name);
                }
            }
        }
        at += 1;
    }
    assert!(files.len() >= 14, "{files:?}");
}

/// promise: lab-stays-in-its-folder
#[test]
fn law_no_path_leads_out_of_the_folder() {
    let root = tempfile::tempdir().expect("a folder");
    let inside = root.path().join("lab");
    std::fs::create_dir_all(inside.join("run")).expect("made");
    std::fs::write(root.path().join("secret.toml"), "seed = 4242").expect("written");
    std::fs::write(root.path().join("sheet.toml"), "name = \"secret-motor\"").expect("written");
    std::fs::write(inside.join("own.toml"), "seed = 7").expect("written");
    #[cfg(unix)]
    std::os::unix::fs::symlink(root.path().join("secret.toml"), inside.join("link.toml")).expect("made");
    let lab = Running::new(Some(&inside));
    let of = |scenario: &str| json!({ "setting": { "scenario": scenario }, "trial": 0, "angle": null, "trials": 10 });
    let own = lab.post("setting", &of("own.toml"));
    assert_eq!((own.code, own.json()["values"]["seed"]["value"].as_i64()), (200, Some(7)));
    let secret = root.path().join("secret.toml").display().to_string();
    for name in [
        "../secret.toml",
        "run/../../secret.toml",
        secret.as_str(),
        "link.toml",
        "./../secret.toml",
        "..",
        "/etc/passwd",
    ] {
        let answer = lab.post("setting", &of(name));
        assert_eq!(answer.code, 422, "{name}: {}", answer.text());
        assert!(!answer.text().contains("4242"), "{name}");
        for path in
            [format!("report/{name}"), format!("report/{}", name.replace('.', "%2e").replace('/', "%2F"))]
        {
            assert_eq!(lab.get(&path).code, 404, "{path}");
        }
        assert_eq!(lab.post("progress", &json!({ "path": name })).code, 422, "{name}");
    }
    for path in ["../Cargo.toml", "..%2fCargo.toml", "page/../lab.css", "%2e%2e/x"] {
        assert_eq!(lab.get(path).code, 404, "{path}");
    }
    // Nor through what a scenario may name.
    let sheet = root.path().join("sheet.toml").display().to_string();
    for (key, value) in [
        ("motor", sheet.as_str()),
        ("motor", "../sheet.toml"),
        ("motor.base", "../sheet.toml"),
        ("motor.map.file", "/etc/passwd"),
    ] {
        let asked = json!({ "setting": setting(&[(key, value)]), "trial": 0, "angle": null, "trials": 10 });
        let answer = lab.post("setting", &asked);
        assert_eq!(answer.code, 422, "{key} {value}");
        let text = answer.text();
        assert!(!text.contains("secret-motor") && !text.contains("missing field"), "{text}");
    }
    // A library is a program: no link and no file of the folder has one run.
    std::fs::write(inside.join("library.toml"), "detector.library = \"evil.so\"").expect("written");
    assert!(lab.post("setting", &of("library.toml")).text().contains("is started with its scenario"));
    for (key, value) in [
        ("detector.library", "evil.so"),
        ("detector", "{ library = \"evil.so\" }"),
        ("axes.detector.library", "[\"evil.so\"]"),
        ("tolerances.detector.library", "{ mean = \"3 lib.so\", uniform = \"0 lib.so\" }"),
        ("axes", "{ \"detector.library\" = [\"evil.so\"] }"),
    ] {
        let asked = json!({ "setting": setting(&[(key, value)]), "trial": 0, "angle": null, "trials": 10 });
        assert!(lab.post("setting", &asked).text().contains("is started with its scenario"), "{key}");
    }
    let report = lab.get("report/run");
    assert!(report.code == 200 && report.head.contains("sandbox") && report.text().contains("report of"));
    // Without a folder there are no files at all.
    let lab = Running::new(None);
    assert_eq!(lab.get("report/run").code, 404);
    assert_eq!(lab.post("setting", &of("own.toml")).code, 422);
    let asked =
        json!({ "setting": setting(&[("motor", sheet.as_str())]), "trial": 0, "angle": null, "trials": 10 });
    assert_eq!(lab.post("setting", &asked).code, 422);
}

#[test]
fn law_bad_input_is_refused_in_words_and_harms_nobody() {
    let lab = Running::new(None);
    let asked =
        |keys: &[(&str, &str)]| json!({ "setting": setting(keys), "trial": 3, "angle": null, "trials": 10 });
    for (key, value, word) in [
        ("sensors.noise", "-1 A", "zero or more"),
        ("sensors.noise", "20 mV", "not a finite number in A"),
        ("sensors.noize", "1", "did you mean `noise`"),
        ("detector.voltage", "20 V", "a method that has such a setting"),
        ("motor", "nonsense", "a built-in motor"),
        ("errors", "bad", "unknown"),
        ("", "1", "not a key"),
        ("inverter.capacitance", "1 mF", "source_resistance"),
    ] {
        let answer = lab.post("setting", &asked(&[(key, value)]));
        assert_eq!(answer.code, 422, "{key}");
        let error = answer.json();
        assert!(error["message"].as_str().expect("words").contains(word), "{key}: {error}");
        if ["sensors.noise", "detector.voltage"].contains(&key) {
            assert_eq!(error["key"], key);
        }
    }
    let long = "x".repeat(300_000);
    for (name, body, code) in [
        ("setting", json!({}), 422),
        ("setting", json!({ "setting": {}, "trial": -1, "angle": null, "trials": 1 }), 422),
        ("detection", json!({ "setting": { "point": 5 }, "trial": 0, "angle": null }), 422),
        ("detection", json!({ "setting": { "surprise": 5 }, "trial": 0, "angle": null }), 422),
        ("nothing", json!({}), 422),
        ("cloud", json!([]), 422),
        ("setting", json!(long), 413),
    ] {
        assert_eq!(
            lab.post(name, &body).code,
            code,
            "{name} {}",
            &body.to_string()[..body.to_string().len().min(80)]
        );
    }
    let (host, own) = lab.place();
    assert_eq!(lab.raw(&format!("DELETE {own} HTTP/1.1\r\nHost: {host}\r\n"), "").code, 405);
    assert_eq!(lab.raw(&format!("GET {own}api/start HTTP/1.1\r\nHost: {host}\r\n"), "").code, 405);
    // A cloud that cannot be says so in its stream.
    let cloud = lab
        .post("cloud", &json!({ "setting": setting(&[("sensors.noise", "-1")]), "trials": 10, "slot": "x" }));
    let frames = frames(&cloud.body);
    assert!(
        frames.len() == 1
            && frames[0].0 == 2
            && String::from_utf8_lossy(&frames[0].1).contains("sensors.noise")
    );
    // Half a request does not keep others from theirs.
    let mut half = TcpStream::connect(&host).expect("it listens");
    half.write_all(b"POST /").expect("sent");
    assert_eq!(lab.post("setting", &asked(&[])).code, 200);
}
