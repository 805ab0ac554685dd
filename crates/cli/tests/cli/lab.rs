//! `standstill lab`: its address, its end, and what it says to mistakes.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::process::{Command, Stdio};

use crate::{folder, mistake, standstill};

#[test]
fn law_the_lab_answers_at_its_address_and_ends_cleanly() {
    let folder = folder();
    std::fs::write(folder.path().join("s.toml"), "sensors.noise = \"30 mA\"").expect("written");
    let mut child = Command::new(env!("CARGO_BIN_EXE_standstill"))
        .args(["lab", "s.toml", "-s", "seed=5", "--no-browser"])
        .current_dir(folder.path())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut said = BufReader::new(child.stdout.take().expect("a pipe"));
    let mut line = String::new();
    said.read_line(&mut line).expect("a line");
    let address = line.split("http://").nth(1).expect("an address").trim().to_owned();
    let (host, path) = address.split_once('/').expect("a path");
    let mut stream = TcpStream::connect(host).expect("it listens");
    let body = r#"{"setting":{},"trial":7,"angle":43.5,"trials":500}"#;
    let request = format!(
        "POST /{path}api/setting HTTP/1.1\r\nHost: {host}\r\nContent-Length: {}\r\n\r\n{body}",
        body.len()
    );
    stream.write_all(request.as_bytes()).expect("sent");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("an answer");
    let json = answer.split_once("\r\n\r\n").expect("a body").1;
    let values: serde_json::Value = serde_json::from_str(json).expect("JSON");
    assert_eq!(values["values"]["sensors.noise"]["text"], "30 mA");
    // The command that the page shows gives the detection that the page shows.
    let command = values["trace"].as_str().expect("a text");
    assert_eq!(
        command,
        "standstill trace s.toml -s seed=5 --trial 7 --angle 43.5 --out standstill-out/trace"
    );
    let words: Vec<&str> = command.split(' ').skip(1).collect();
    assert!(standstill(&words, folder.path()).status.success());
    let result = std::fs::read(folder.path().join("standstill-out/trace/result.json")).expect("written");
    let result: serde_json::Value = serde_json::from_slice(&result).expect("JSON");
    let mut stream = TcpStream::connect(host).expect("it listens");
    let body = r#"{"setting":{},"trial":7,"angle":43.5}"#;
    let request = format!(
        "POST /{path}api/detection HTTP/1.1\r\nHost: {host}\r\nContent-Length: {}\r\n\r\n{body}",
        body.len()
    );
    stream.write_all(request.as_bytes()).expect("sent");
    let mut bytes = Vec::new();
    stream.read_to_end(&mut bytes).expect("an answer");
    let text = String::from_utf8_lossy(&bytes).into_owned();
    let error = result["error_deg"].as_f64().expect("a number");
    assert!(text.contains(&format!("\"error\":{error:?},")), "{error}");
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(killed.expect("kill").success());
    assert_eq!(child.wait().expect("it ends").code(), Some(0));
    let mut rest = String::new();
    said.read_to_string(&mut rest).expect("text");
    assert!(rest.ends_with("The lab has ended.\n"), "{rest}");
}

#[test]
fn law_a_lab_that_cannot_be_says_why() {
    let folder = folder();
    std::fs::write(folder.path().join("bad.toml"), "sensors.noise = \"-1 A\"").expect("written");
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("bound").port().to_string();
    for (arguments, word) in [
        (&["lab", "--port", &port, "--no-browser"][..], "needed: a port that is free"),
        (&["lab", "--port", "0"], "--port"),
        (&["lab", "--port", "70000"], "--port"),
        (&["lab", "missing.toml", "--no-browser"], "cannot read missing.toml"),
        (&["lab", "bad.toml", "--no-browser"], "bad.toml: line 1: `sensors.noise`: found -1 A"),
        (&["lab", "-s", "sensors.noize=1", "--no-browser"], "did you mean `noise`"),
    ] {
        let message = mistake(arguments, folder.path());
        assert!(message.contains(word), "{arguments:?}: {message}");
    }
}
