//! Answers, and the headers that all of them have.

use std::io::{self, Write};

use tiny_http::{Header, Request, Response};

use crate::error::LabError;

/// What the lab's own pages may do: run its own scripts and talk to it.
const OWN: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; \
                   base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// What the page of a report may do, which has all in itself: nothing with this server.
const REPORT: &str = "sandbox allow-scripts allow-downloads allow-modals; default-src 'none'; script-src 'unsafe-inline'; \
                      style-src 'unsafe-inline'; img-src data: blob:; font-src data:; base-uri 'none'; form-action 'none'; \
                      frame-ancestors 'none'";

/// Headers of every answer.
const COMMON: [(&str, &str); 5] = [
    ("Cache-Control", "no-store"),
    ("X-Content-Type-Options", "nosniff"),
    ("Referrer-Policy", "no-referrer"),
    ("Cross-Origin-Resource-Policy", "same-origin"),
    ("Cross-Origin-Opener-Policy", "same-origin"),
];

/// An answer that is whole.
pub(super) struct Reply {
    code: u16,
    kind: &'static str,
    policy: &'static str,
    body: Vec<u8>,
}

impl Reply {
    pub fn text(code: u16, text: &str) -> Self {
        Self { code, kind: "text/plain; charset=utf-8", policy: OWN, body: format!("{text}\n").into_bytes() }
    }

    pub fn asset(kind: &'static str, text: &str) -> Self {
        Self { code: 200, kind, policy: OWN, body: text.as_bytes().to_vec() }
    }

    pub fn report(html: String) -> Self {
        Self { code: 200, kind: "text/html; charset=utf-8", policy: REPORT, body: html.into_bytes() }
    }

    /// What the bench answers.
    pub fn of(answer: Result<Vec<u8>, LabError>) -> Self {
        match answer {
            Ok(body) => Self { code: 200, kind: "application/octet-stream", policy: OWN, body },
            Err(error) => {
                let body = serde_json::to_vec(&error).unwrap_or_default();
                Self { code: 422, kind: "application/json", policy: OWN, body }
            }
        }
    }
}

fn headers(kind: &str, policy: &str) -> Vec<(&'static str, String)> {
    let common = COMMON.into_iter().map(|(name, value)| (name, value.to_owned()));
    let own = [("Content-Type", kind.to_owned()), ("Content-Security-Policy", policy.to_owned())];
    common.chain(own).collect()
}

/// Sends an answer.
pub(super) fn respond(request: Request, reply: Reply) -> io::Result<()> {
    let Reply { code, kind, policy, body } = reply;
    let headers = headers(kind, policy);
    let headers = headers.iter().filter_map(|(name, value)| Header::from_bytes(name.as_bytes(), value.as_bytes()).ok());
    let length = body.len();
    request.respond(Response::new(code.into(), headers.collect(), body.as_slice(), Some(length), None))
}

/// Sends a piece of an answer whose length nobody knows yet, at once; an empty one is its beginning.
pub(super) fn chunk(out: &mut dyn Write, bytes: &[u8]) -> io::Result<()> {
    if bytes.is_empty() {
        let mut head = "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n".to_owned();
        for (name, value) in headers("application/octet-stream", OWN) {
            head += &format!("{name}: {value}\r\n");
        }
        out.write_all(format!("{head}\r\n").as_bytes())?;
    } else {
        out.write_all(format!("{:x}\r\n", bytes.len()).as_bytes())?;
        out.write_all(bytes)?;
        out.write_all(b"\r\n")?;
    }
    out.flush()
}
