//! Requests of the lab's page: what it asks in JSON, and whole connections.

use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use standstill_lab::{Bench, Given, Server};

use crate::text;

fn bench() -> Bench {
    Bench::new(Given::nothing().expect("a scenario"), None).expect("a lab")
}

/// A question in JSON, behind a line with its name, has an answer in JSON or bytes, or is refused with a reason.
pub fn question(bytes: &[u8]) {
    static BENCH: OnceLock<Bench> = OnceLock::new();
    let Some((name, body)) = text(bytes).and_then(|text| text.split_once('\n')) else { return };
    match BENCH.get_or_init(bench).answer(name, body) {
        Ok(answer) if name == "detection" => assert!(answer.len() > 8),
        Ok(answer) => {
            let value: serde_json::Value = serde_json::from_slice(&answer).expect("JSON");
            assert!(!value.is_null());
        }
        Err(error) => assert!(error.to_string().len() > 5, "{error}"),
    }
}

/// True once a thread of the server has panicked, which the connection alone would not show.
static PANICKED: AtomicBool = AtomicBool::new(false);

/// Returns port and token of a server that runs as long as the program.
fn server() -> &'static (u16, String) {
    static SERVER: OnceLock<(u16, String)> = OnceLock::new();
    SERVER.get_or_init(|| {
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            PANICKED.store(true, Ordering::SeqCst);
            before(panic);
        }));
        let report = Box::new(|_: &_, _: &_| Err("no report here".to_owned()));
        let server = Server::bind(0, bench(), report).expect("a port");
        let address = server.address();
        std::thread::spawn(move || server.serve());
        let mut parts = address.trim_start_matches("http://127.0.0.1:").split('/');
        let port = parts.next().and_then(|port| port.parse().ok()).expect("a port");
        (port, parts.next().expect("a token").to_owned())
    })
}

/// Bytes of an answer that are looked at: a cloud sends pieces until nobody listens.
const LOOKED_AT: usize = 4096;

/// Bytes of a connection, in which PORT and TOKEN stand for the server's own, get one answer of HTTP, or none where the
/// connection ends within the request.
pub fn http(bytes: &[u8]) {
    let (port, token) = server();
    let replaced =
        replaced(&replaced(bytes, b"TOKEN", token.as_bytes()), b"PORT", port.to_string().as_bytes());
    let mut stream = TcpStream::connect(("127.0.0.1", *port)).expect("a connection");
    stream.set_read_timeout(Some(Duration::from_secs(5))).expect("a limit");
    // The server may end the connection before it has all.
    let _ = stream.write_all(&replaced).and_then(|()| stream.shutdown(Shutdown::Write));
    let mut answer = Vec::new();
    let mut piece = [0; LOOKED_AT];
    while answer.len() < LOOKED_AT {
        match stream.read(&mut piece) {
            Ok(0) => break,
            Ok(count) => answer.extend_from_slice(&piece[..count]),
            // libFuzzer's clock is a signal.
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
            Err(error) if error.kind() == std::io::ErrorKind::ConnectionReset => break,
            Err(error) => panic!("no answer: {error}"),
        }
    }
    assert!(!PANICKED.load(Ordering::SeqCst), "a thread of the server panicked");
    if !answer.is_empty() {
        let line = String::from_utf8_lossy(answer.split(|byte| *byte == b'\r').next().unwrap_or_default());
        let code = line.strip_prefix("HTTP/1.1 ").and_then(|rest| rest.get(..3)?.parse::<u16>().ok());
        let known = [200, 400, 403, 404, 405, 411, 413, 422, 431, 503];
        assert!(code.is_some_and(|code| known.contains(&code)), "{line:?}");
    }
}

fn replaced(bytes: &[u8], word: &[u8], by: &[u8]) -> Vec<u8> {
    let mut all = Vec::new();
    let mut rest = bytes;
    while let Some((first, behind)) = rest.split_first() {
        if let Some(behind) = rest.strip_prefix(word) {
            all.extend_from_slice(by);
            rest = behind;
        } else {
            all.push(*first);
            rest = behind;
        }
    }
    all
}
