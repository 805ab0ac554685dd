//! The lab from outside: what its page asks, and what nobody may.

mod convert;
mod crowds;
mod hostile;
mod modules;

use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use serde_json::{Value, json};
use standstill_campaign::store::{Journal, Rows, Shard, Sweep};
use standstill_lab::{Bench, CloudRequest, Filling, Folder, Given, Server, Setting};
use standstill_scenario::{Document, Plan};

/// A lab that is running, and ends with its test.
struct Running(Arc<Server>);

impl Drop for Running {
    fn drop(&mut self) {
        self.0.stop();
    }
}

struct Answer {
    code: u16,
    head: String,
    body: Vec<u8>,
}

impl Answer {
    fn json(&self) -> Value {
        serde_json::from_slice(&self.body).expect("JSON")
    }

    fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }
}

fn bench(folder: Option<&Path>) -> Bench {
    let folder = folder.map(|path| Folder::open(path).expect("a folder"));
    Bench::new(Given::nothing().expect("a scenario"), folder).expect("it runs")
}

impl Running {
    fn new(folder: Option<&Path>) -> Self {
        let report = Box::new(|path: &Path, _: &Path| {
            assert!(!path.ends_with("panics"), "a report that panics");
            Ok(format!("<p>report of {}</p>", path.display()))
        });
        let server = Server::bind(0, bench(folder), report).expect("a port");
        let serving = Arc::clone(&server);
        std::thread::spawn(move || serving.serve());
        Self(server)
    }

    /// Host with its port, and the path of the page.
    fn place(&self) -> (String, String) {
        let address = self.0.address();
        let (host, path) = address.trim_start_matches("http://").split_once('/').expect("a path");
        (host.to_owned(), format!("/{path}"))
    }

    /// What comes back for these lines and this body.
    fn raw(&self, lines: &str, body: &str) -> Answer {
        let mut stream = TcpStream::connect(self.place().0).expect("it listens");
        let text = format!("{lines}Content-Length: {}\r\nConnection: close\r\n\r\n{body}", body.len());
        stream.write_all(text.as_bytes()).expect("sent");
        let mut bytes = Vec::new();
        stream.read_to_end(&mut bytes).expect("an answer");
        let end = bytes.windows(4).position(|four| four == b"\r\n\r\n").expect("a head") + 4;
        let head = String::from_utf8_lossy(&bytes[..end]).into_owned();
        let code = head.split(' ').nth(1).and_then(|code| code.parse().ok()).expect("a code");
        let body = if head.contains("chunked") { unchunked(&bytes[end..]) } else { bytes[end..].to_vec() };
        Answer { code, head, body }
    }

    fn get(&self, path: &str) -> Answer {
        let (host, own) = self.place();
        self.raw(&format!("GET {own}{path} HTTP/1.1\r\nHost: {host}\r\n"), "")
    }

    fn post(&self, name: &str, body: &Value) -> Answer {
        let (host, own) = self.place();
        let origin = format!("http://{host}");
        let lines = format!("POST {own}api/{name} HTTP/1.1\r\nHost: {host}\r\nOrigin: {origin}\r\n");
        self.raw(&lines, &body.to_string())
    }
}

fn unchunked(mut bytes: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    while let Some(end) = bytes.windows(2).position(|two| two == b"\r\n") {
        let size = std::str::from_utf8(&bytes[..end])
            .ok()
            .and_then(|size| usize::from_str_radix(size.trim(), 16).ok());
        let size = size.expect("a size");
        if size == 0 {
            return out;
        }
        out.extend(&bytes[end + 2..end + 2 + size]);
        bytes = &bytes[end + 4 + size..];
    }
    panic!("no last chunk");
}

/// Kind and bytes of each frame.
fn frames(mut bytes: &[u8]) -> Vec<(u32, Vec<u8>)> {
    let mut frames = Vec::new();
    let word =
        |bytes: &[u8], at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
    while !bytes.is_empty() {
        let (length, kind) = (word(bytes, 0) as usize, word(bytes, 4));
        frames.push((kind, bytes[8..8 + length].to_vec()));
        bytes = &bytes[8 + length..];
    }
    frames
}

fn setting(keys: &[(&str, &str)]) -> Value {
    let set: serde_json::Map<String, Value> =
        keys.iter().map(|(key, value)| ((*key).to_owned(), json!(value))).collect();
    json!({ "scenario": "", "point": 0, "set": set })
}

/// The header of a detection.
fn header(bytes: &[u8]) -> Value {
    let length = u32::from_le_bytes(bytes[..4].try_into().expect("four bytes")) as usize;
    serde_json::from_slice(&bytes[4..4 + length]).expect("JSON")
}

#[test]
fn regress_a_detection_has_all_doubts_about_its_scenario() {
    let set = setting(&[("sensors.noise", "20 A"), ("rotor.state", "driven")]);
    let body = json!({ "setting": set, "trial": 0, "angle": null }).to_string();
    let found = header(&bench(None).answer("detection", &body).expect("a detection"));
    let [noise, standing] = [0, 1].map(|k| found["doubts"][k].as_str().expect("a doubt"));
    assert!(
        noise.starts_with("sensors.noise is 20 A") && standing.contains("at 0 rpm"),
        "{noise} {standing}"
    );
}

#[test]
fn law_what_the_page_shows_is_what_run_and_trace_compute() {
    let bench = bench(None);
    let document = || {
        Document::parse(Path::new("s.toml"), "detector.method = \"bipolar\"\nsensors.noise = \"15 mA\"")
            .expect("TOML")
    };
    let plan = Plan::new(document()).expect("valid");
    let scenario = plan.scenario(0).expect("valid");
    let expected = scenario.trial(5).expect("runs");
    let set = setting(&[("detector.method", "bipolar"), ("sensors.noise", "15 mA")]);
    let ask = |angle: Value| {
        let body = json!({ "setting": set, "trial": 5, "angle": angle }).to_string();
        bench.answer("detection", &body).expect("a detection")
    };
    let bytes = ask(Value::Null);
    let found = header(&bytes);
    assert_eq!(found["error"].as_f64(), expected.error_deg());
    assert_eq!(found["duration"].as_f64(), Some(expected.run.duration.seconds()));
    // The bytes are all there: times and columns of rows and samples, and three modes.
    let number = |name: &str| usize::try_from(found[name].as_u64().expect("a number")).expect("small");
    let length = u32::from_le_bytes(bytes[..4].try_into().expect("four")) as usize;
    assert_eq!((4 + length) % 8, 0);
    assert_eq!(bytes.len(), 4 + length + number("rows") * (8 + 11 * 4 + 3) + number("samples") * (8 + 8 * 4));
    assert!(number("samples") > 5 && number("rows") > 100);
    // Readings are off by noise, offset, gain and half a step, not by the current itself.
    let at = 4
        + length
        + 8 * number("rows")
        + 8 * number("samples")
        + 44 * number("rows")
        + 4 * 4 * number("samples");
    let errors: Vec<f32> = bytes[at..at + 12 * number("samples")]
        .chunks(4)
        .map(|four| f32::from_le_bytes(four.try_into().expect("four")))
        .collect();
    let rms = (errors.iter().map(|error| f64::from(error * error)).sum::<f64>() / errors.len() as f64).sqrt();
    assert!((0.01..0.08).contains(&rms), "{rms}");
    // At another angle it is the same drive with the same noise.
    let turned = header(&ask(json!(100.0)));
    assert_eq!(turned["start_angle"].as_f64().map(f64::round), Some(100.0));
    assert_eq!(turned["specimen"][1], found["specimen"][1]);
    assert_ne!(turned["estimate"], found["estimate"]);
    // The cloud is the campaign, whatever else is going on.
    let request: CloudRequest =
        serde_json::from_value(json!({ "setting": set, "trials": 300, "slot": "a" })).expect("a request");
    let mut bytes = Vec::new();
    let mut frames_seen = 0;
    bench
        .cloud(&request, &AtomicBool::new(false), &mut |frame| {
            bytes.extend_from_slice(frame);
            frames_seen += 1;
            true
        })
        .expect("runs");
    let frames = frames(&bytes);
    let points: Vec<u8> =
        frames.iter().filter(|(kind, _)| *kind == 1).flat_map(|(_, bytes)| bytes.clone()).collect();
    assert_eq!(points.len(), 300 * 16);
    assert!(frames_seen > 1, "it comes in pieces");
    let error = f32::from_le_bytes(points[5 * 16 + 8..5 * 16 + 12].try_into().expect("four"));
    assert!((f64::from(error) - expected.axis_error_deg().expect("an axis")).abs() < 1e-6);
    let summary: Value =
        serde_json::from_slice(&frames.iter().rfind(|(kind, _)| *kind == 0).expect("statistics").1)
            .expect("JSON");
    assert_eq!(summary["summary"]["trials"], 300);
    let mut statistics = standstill_campaign::Statistics::default();
    for trial in 0..300 {
        statistics.add_row(&standstill_campaign::store::Row::from(&scenario.trial(trial).expect("runs")));
    }
    let rms = summary["summary"]["rms_deg"]["value"].as_f64().expect("a number");
    assert!((rms - statistics.rms().value).abs() < 1e-12);
    // Step by step in one thread, as a browser without a server does it, it is the same cloud.
    let mut filling = Filling::new(&bench, &request).expect("valid");
    let mut stepped = Vec::new();
    while let Some(frames) = filling.step(&bench).expect("runs") {
        stepped.extend(
            self::frames(&frames).into_iter().filter(|(kind, _)| *kind == 1).flat_map(|(_, bytes)| bytes),
        );
    }
    assert_eq!(stepped, points);
}

#[test]
fn law_a_new_cloud_takes_the_place_of_the_one_before_and_two_pages_have_each_their_own() {
    let lab = Running::new(None);
    let (host, own) = lab.place();
    let begin = |slot: &str, trials: u64| {
        let body = json!({ "setting": setting(&[]), "trials": trials, "slot": slot }).to_string();
        let mut stream = TcpStream::connect(&host).expect("it listens");
        let text = format!(
            "POST {own}api/cloud HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\nContent-Length: {}\r\n\r\n{body}",
            body.len()
        );
        stream.write_all(text.as_bytes()).expect("sent");
        let mut first = [0; 2000];
        stream.read_exact(&mut first).expect("it begins");
        (stream, first.len())
    };
    let (mut long, begun) = begin("tab 1 a", 1_000_000);
    // Another page, meanwhile.
    let other = lab.post("cloud", &json!({ "setting": setting(&[]), "trials": 64, "slot": "tab 2 a" }));
    let points = frames(&other.body)
        .iter()
        .filter(|(kind, _)| *kind == 1)
        .map(|(_, bytes)| bytes.len())
        .sum::<usize>();
    assert_eq!(points, 64 * 16);
    // The same page turns a knob: the first cloud ends long before its million trials.
    let next = lab.post("cloud", &json!({ "setting": setting(&[]), "trials": 64, "slot": "tab 1 a" }));
    assert_eq!(next.code, 200);
    let mut rest = Vec::new();
    long.read_to_end(&mut rest).expect("it ends");
    assert!(rest.len() + begun < 8_000_000, "{} bytes", rest.len());
    assert!(rest.ends_with(b"0\r\n\r\n"));
}

/// promise: lab-disturbs-no-run
#[test]
fn law_a_running_campaign_is_watched_and_not_disturbed() {
    let root = tempfile::tempdir().expect("a folder");
    let text = "trials = 400\ndetector.method = \"bipolar\"";
    let plan = Plan::new(Document::parse(Path::new("s.toml"), text).expect("TOML")).expect("valid");
    let sweep = Sweep { plan: &plan, shard: Shard::WHOLE, threads: Some(1) };
    let run = root.path().join("night");
    std::fs::create_dir(&run).expect("made");
    let path = run.join("run.journal");
    let mut journal = Journal::create(&path, &sweep.identity().expect("TOML")).expect("writable");
    let lab = Running::new(Some(root.path()));
    let entries = lab.post("folder", &Value::Null).json();
    assert_eq!(entries["entries"][0]["path"], "night");
    let progress = || lab.post("progress", &json!({ "path": "night" })).json();
    assert_eq!(
        (progress()["journals"][0]["done"].as_u64(), progress()["journals"][0]["all"].as_u64()),
        (Some(0), Some(400))
    );
    let mut seen = Vec::new();
    sweep
        .run(&mut journal, &AtomicBool::new(false), |_| {
            seen.push(progress()["journals"][0]["done"].as_u64().expect("a number"));
        })
        .expect("nobody stands in its way");
    assert!(seen.len() > 2 && seen.is_sorted() && seen.first() < seen.last(), "{seen:?}");
    let last = progress();
    let of = &last["journals"][0];
    assert_eq!((of["done"].as_u64(), of["finished"].as_bool()), (Some(400), Some(true)));
    // What it says is what the journal says.
    let mut statistics = standstill_campaign::Statistics::default();
    let mut rows = Rows::open(&path).expect("a journal");
    while let Some(block) = rows.block().expect("readable") {
        for (_, row) in &block {
            statistics.add_row(row);
        }
    }
    assert_eq!(of["summary"]["rms_deg"]["value"].as_f64(), Some(statistics.rms().value));
    // Another run in its place is read from its beginning.
    drop(journal);
    drop(Journal::create(&path, &sweep.identity().expect("TOML")).expect("writable"));
    assert_eq!(progress()["journals"][0]["done"], 0);
}

#[test]
fn regress_of_a_sweep_that_runs_no_figure_is_of_all_points_together() {
    let root = tempfile::tempdir().expect("a folder");
    let text =
        "trials = 5\ndetector.method = \"bipolar\"\n[axes]\n\"sensors.noise\" = [\"1 mA\", \"100 mA\"]";
    let plan = Plan::new(Document::parse(Path::new("s.toml"), text).expect("TOML")).expect("valid");
    let sweep = Sweep { plan: &plan, shard: Shard::WHOLE, threads: Some(1) };
    let path = root.path().join("run.journal");
    let mut journal = Journal::create(&path, &sweep.identity().expect("TOML")).expect("writable");
    sweep.run(&mut journal, &AtomicBool::new(false), |_| {}).expect("nobody stands in its way");
    let lab = Running::new(Some(root.path()));
    let of = &lab.post("progress", &json!({ "path": "." })).json()["journals"][0];
    assert_eq!((&of["done"], &of["points"], &of["point"]), (&json!(10), &json!(2), &json!(1)));
    assert!(of["summary"].is_null() && of["in_words"].is_null(), "{of}");
}

#[test]
fn law_every_key_has_a_control_and_what_a_method_does_not_have_is_not_there() {
    let bench = bench(None);
    let start: Value =
        serde_json::from_slice(&bench.answer("start", "null").expect("a start")).expect("JSON");
    let controls = start["controls"].as_array().expect("a list");
    assert!(controls.len() > 60, "{}", controls.len());
    let values = |keys: &[(&str, &str)]| -> Value {
        let body = json!({ "setting": setting(keys), "trial": 0, "angle": null, "trials": 1000 }).to_string();
        serde_json::from_slice(&bench.answer("setting", &body).expect("valid")).expect("JSON")
    };
    let plain = values(&[]);
    for control in controls {
        assert!(plain["values"].get(control["key"].as_str().expect("a key")).is_some(), "{control}");
    }
    let there = |values: &Value, key: &str| values["values"][key]["there"].as_bool().expect("known");
    assert!(there(&plain, "detector.pulse") && !there(&plain, "detector.voltage"));
    let injection = values(&[("detector.method", "hfi-rotating")]);
    assert!(there(&injection, "detector.voltage") && !there(&injection, "detector.pulse"));
    assert!(!there(&plain, "inverter.channel_resistance"));
    assert!(there(&values(&[("inverter.devices", "mosfet")]), "inverter.channel_resistance"));
    // What is set has beside it what it would be by itself.
    let noisy = values(&[("sensors.noise", "35 mA"), ("errors", "harsh")]);
    let noise = &noisy["values"]["sensors.noise"];
    assert_eq!((noise["text"].as_str(), noise["default"].as_str()), (Some("35 mA"), Some("20 mA")));
    let toml = noisy["toml"].as_str().expect("a text");
    let plan = Plan::new(Document::parse(Path::new("s.toml"), toml).expect("TOML")).expect("valid");
    assert_eq!(plan.scenario(0).expect("valid").sensors.noise, 0.035);
    assert_eq!(plan.file().trials, 1000);
    assert!(
        noisy["trace"]
            .as_str()
            .expect("a text")
            .contains("-s errors=harsh -s 'sensors.noise=35 mA' --trial 0")
    );
    // One motor's numbers are not another's.
    let motor = values(&[("motor", "pm-reluctance"), ("motor.winding.resistance", "2 Ω")]);
    let entry = motor["sheet"]
        .as_array()
        .expect("a list")
        .iter()
        .find(|entry| entry["key"] == "motor.winding.resistance");
    assert_eq!(entry.expect("there")["text"], "2 Ω");
    // Settings differ if any part of them does.
    assert_ne!(Setting::default().name(), Setting { point: 1, ..Setting::default() }.name());
}

#[test]
fn law_what_suits_a_motor_is_looked_for_once_whatever_its_detector() {
    use std::sync::atomic::{AtomicUsize, Ordering};
    let asked = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&asked);
    let find = move |document: &Document| -> Result<standstill_lab::Advice, String> {
        counted.fetch_add(1, Ordering::SeqCst);
        assert_eq!(document.get("detector.method"), None, "it is asked for a detector");
        let keys = [("detector.method".to_owned(), "bipolar".to_owned())].into_iter().collect();
        Ok(standstill_lab::Advice { keys: Some(keys), text: "so and so".to_owned() })
    };
    let advised = bench(None).advised(Box::new(find));
    let ask = |set: &str| {
        let answer =
            advised.answer("advice", &format!(r#"{{"setting":{{"set":{set}}}}}"#)).expect("an answer");
        serde_json::from_slice::<Value>(&answer).expect("JSON")
    };
    let known = json!({ "keys": { "detector.method": "bipolar" }, "text": "so and so" });
    for set in ["{}", r#"{"detector.method":"subdivision"}"#, r#"{"detector.pulse":"90 us"}"#] {
        assert_eq!(ask(set), known);
    }
    assert_eq!(asked.load(Ordering::SeqCst), 1, "the same motor and drive");
    ask(r#"{"errors":"harsh"}"#);
    assert_eq!(asked.load(Ordering::SeqCst), 2, "another drive");
    // Nonsense is refused as anywhere, and a lab that has nobody to ask says so.
    assert!(advised.answer("advice", r#"{"setting":{"set":{"sensors.nois":"1"}}}"#).is_err());
    assert!(bench(None).answer("advice", r#"{"setting":{}}"#).is_err());
}
