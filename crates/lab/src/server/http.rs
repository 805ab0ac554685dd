//! Requests: one a connection, whole before it is looked at, and none that is larger or slower than a page's.

use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// Most bytes of a request's head.
const MOST_HEAD: usize = 32 << 10;

/// Most bytes of a request's body.
const MOST_BODY: usize = 256 << 10;

/// Most headers.
const MOST_HEADERS: usize = 64;

/// Time limit for the transfer of a whole request, in any number of pieces.
const PATIENCE: Duration = Duration::from_secs(10);

/// Time limit for the transfer of each piece of an answer.
const SENDING: Duration = Duration::from_secs(20);

/// A request.
#[derive(Debug)]
pub(super) struct Request {
    pub method: String,
    /// The text behind the method.
    pub target: String,
    headers: Vec<(String, String)>,
    pub body: String,
}

/// Refusal of a request: code and message.
pub(super) type Refusal = (u16, &'static str);

impl Request {
    /// Returns the value of a header; empty for a header that occurs twice, which may be an attack.
    pub fn header(&self, name: &str) -> Option<&str> {
        let mut all = self.headers.iter().filter(|(known, _)| known.eq_ignore_ascii_case(name));
        let (_, first) = all.next()?;
        Some(if all.next().is_some() { "" } else { first })
    }
}

/// Returns the request of a connection.
///
/// # Errors
/// Those of the connection; the inner error is the refusal of an invalid request.
pub(super) fn read(stream: &mut TcpStream) -> io::Result<Result<Request, Refusal>> {
    stream.set_write_timeout(Some(SENDING))?;
    stream.set_nodelay(true)?;
    read_from(&mut Timed { stream, until: Instant::now() + PATIENCE })
}

/// A connection that is read until a certain time.
struct Timed<'a> {
    stream: &'a TcpStream,
    until: Instant,
}

impl Read for Timed<'_> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        let left = self.until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(io::ErrorKind::TimedOut.into());
        }
        self.stream.set_read_timeout(Some(left))?;
        self.stream.read(to)
    }
}

fn read_from(stream: &mut impl Read) -> io::Result<Result<Request, Refusal>> {
    let mut bytes = Vec::new();
    let (mut request, begin) = loop {
        match head(&bytes) {
            Err(refusal) => return Ok(Err(refusal)),
            Ok(Some(found)) => break found,
            Ok(None) if bytes.len() > MOST_HEAD => return Ok(Err((431, "too many headers"))),
            Ok(None) => more(stream, &mut bytes)?,
        }
    };
    if request.header("Transfer-Encoding").is_some() {
        return Ok(Err((411, "a request says how long it is")));
    }
    let length = match request.header("Content-Length").map(str::parse::<usize>) {
        None => 0,
        Some(Ok(length)) => length,
        Some(Err(_)) => return Ok(Err((400, "no length"))),
    };
    if length > MOST_BODY {
        // Whoever is still sending does not hear the answer.
        io::copy(
            &mut stream.take((length - (bytes.len() - begin).min(length)).min(16 << 20) as u64),
            &mut io::sink(),
        )?;
        return Ok(Err((413, "too long")));
    }
    while bytes.len() < begin + length {
        more(stream, &mut bytes)?;
    }
    match String::from_utf8(bytes[begin..begin + length].to_vec()) {
        Ok(body) => request.body = body,
        Err(_) => return Ok(Err((400, "not a text"))),
    }
    Ok(Ok(request))
}

fn more(stream: &mut impl Read, bytes: &mut Vec<u8>) -> io::Result<()> {
    let mut part = [0; 8192];
    match stream.read(&mut part)? {
        0 => Err(io::ErrorKind::UnexpectedEof.into()),
        count => {
            bytes.extend_from_slice(&part[..count]);
            Ok(())
        }
    }
}

/// Returns the head of a request and where its body begins; none if more must come.
fn head(bytes: &[u8]) -> Result<Option<(Request, usize)>, Refusal> {
    let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
    let mut parsed = httparse::Request::new(&mut headers);
    let end = match parsed.parse(bytes) {
        Ok(httparse::Status::Complete(end)) => end,
        Ok(httparse::Status::Partial) => return Ok(None),
        Err(httparse::Error::TooManyHeaders) => return Err((431, "too many headers")),
        Err(_) => return Err((400, "not a request")),
    };
    let header =
        |of: &httparse::Header<'_>| (of.name.to_owned(), String::from_utf8_lossy(of.value).into_owned());
    let request = Request {
        method: parsed.method.unwrap_or_default().to_owned(),
        target: parsed.path.unwrap_or_default().to_owned(),
        headers: parsed.headers.iter().map(header).collect(),
        body: String::new(),
    };
    Ok(Some((request, end)))
}

/// Sends a piece of an answer at once.
pub(super) fn chunk(out: &mut impl Write, bytes: &[u8]) -> io::Result<()> {
    out.write_all(&[format!("{:x}\r\n", bytes.len()).as_bytes(), bytes, b"\r\n"].concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_a_request_has_its_time_however_often_something_comes() {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
        let mut slow = TcpStream::connect(listener.local_addr().expect("an address")).expect("it listens");
        let (stream, _) = listener.accept().expect("a connection");
        // A byte every 20 ms, for as long as somebody listens.
        let sender = std::thread::spawn(move || {
            while slow.write_all(b"A").is_ok() {
                std::thread::sleep(Duration::from_millis(20));
            }
        });
        let begun = Instant::now();
        let result = read_from(&mut Timed { stream: &stream, until: begun + Duration::from_millis(200) });
        assert!(result.is_err() && begun.elapsed() >= Duration::from_millis(200));
        drop(stream);
        sender.join().expect("it ends");
    }

    #[test]
    fn analytic_a_request_is_read_however_it_is_cut() {
        struct Slow<'a>(&'a [u8], usize);
        impl Read for Slow<'_> {
            fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
                let count = self.1.min(self.0.len()).min(to.len());
                to[..count].copy_from_slice(&self.0[..count]);
                self.0 = &self.0[count..];
                Ok(count)
            }
        }
        let text = b"POST /x/api HTTP/1.1\r\nHost: h\r\nX-A: 1\r\nx-a: 2\r\nContent-Length: 4\r\n\r\nbody";
        for cut in 1..text.len() {
            let request = read_from(&mut Slow(text, cut)).expect("there").expect("a request");
            assert_eq!(
                (request.method.as_str(), request.target.as_str(), request.body.as_str()),
                ("POST", "/x/api", "body")
            );
            assert_eq!(
                (request.header("host"), request.header("x-a"), request.header("y")),
                (Some("h"), Some(""), None)
            );
        }
        let refused =
            |text: &str| read_from(&mut text.as_bytes()).map(|answer| answer.err().map(|(code, _)| code));
        assert_eq!(refused("nonsense\r\n\r\n").expect("read"), Some(400));
        assert_eq!(refused("GET / HTTP/1.1\r\nContent-Length: x\r\n\r\n").expect("read"), Some(400));
        assert_eq!(refused("GET / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n").expect("read"), Some(411));
        assert_eq!(
            refused(&format!("GET / HTTP/1.1\r\n{}\r\n", "A: b\r\n".repeat(100))).expect("read"),
            Some(431)
        );
        assert_eq!(
            refused(&format!("GET / HTTP/1.1\r\nA: {}", "b".repeat(MOST_HEAD))).expect("read"),
            Some(431)
        );
        assert_eq!(
            refused(&format!("GET / HTTP/1.1\r\nContent-Length: 300000\r\n\r\n{}", "b".repeat(300_000)))
                .expect("read"),
            Some(413)
        );
        assert!(refused("GET / HTTP/1.1\r\nContent-Length: 9\r\n\r\nbody").is_err(), "it is not whole");
    }
}
