//! Answers, and the headers that all of them have.

use std::io::{self, Write};

use crate::error::LabError;

/// Content security policy of the lab's own pages: run its own scripts and talk to it.
const OWN: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; \
                   base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Content security policy of a report's page, which has all in itself: nothing with this server.
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

    /// Makes the reply from the bench's answer.
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

/// Returns the lines above an answer. A connection has one: nothing waits for another behind it.
fn head(code: u16, kind: &str, policy: &str, length: &str) -> String {
    let mut head = format!(
        "HTTP/1.1 {code} \r\nConnection: close\r\n{length}\r\nContent-Type: {kind}\r\nContent-Security-Policy: {policy}\r\n"
    );
    for (name, value) in COMMON {
        head.extend([name, ": ", value, "\r\n"]);
    }
    head + "\r\n"
}

/// Sends an answer.
pub(super) fn respond(out: &mut impl Write, reply: &Reply) -> io::Result<()> {
    let Reply { code, kind, policy, body } = reply;
    let head = head(*code, kind, policy, &format!("Content-Length: {}", body.len()));
    out.write_all(&[head.as_bytes(), body].concat())
}

/// Begins an answer whose length nobody knows yet.
pub(super) fn begin(out: &mut impl Write) -> io::Result<()> {
    out.write_all(head(200, "application/octet-stream", OWN, "Transfer-Encoding: chunked").as_bytes())
}
