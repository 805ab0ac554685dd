//! Server of the lab at an address of this machine.
//!
//! It listens on 127.0.0.1 only. The path of the address begins with a token of 128 random bits, and requests without
//! it get no answer. The served files are compiled in, so no path of a request names a file.

mod guard;
mod http;
mod pages;
mod reply;

use std::collections::{HashMap, VecDeque};
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use thiserror::Error;

use self::guard::Guard;
use self::reply::{Reply, respond};
use crate::bench::{Bench, lock};
use crate::cloud::CloudRequest;
use crate::error::LabError;

/// Makes the page of a finished run in a folder, from files below the lab's folder alone, which comes second.
pub type Report = Box<dyn Fn(&Path, &Path) -> Result<String, String> + Send + Sync>;

/// Requests that are answered at the same time; further ones are asked to come back. Only those with the token count.
const MOST_REQUESTS: usize = 64;

/// Connections whose requests are being read: whoever sends slowly takes no place from requests that are answered. A further one ends the
/// one that has been read for the longest time. Nobody needs a token to be read, and a page's request takes milliseconds.
const MOST_READERS: usize = 128;

/// Most clouds that are remembered so that new ones take their places.
const MOST_SLOTS: usize = 1000;

/// A server that cannot be.
#[derive(Debug, Error)]
pub enum ServerError {
    /// The port is not available.
    #[error("{}", refused(*.0, .1))]
    Port(u16, String),
    /// The operating system gave no random numbers.
    #[error("no random numbers for the token of the address: {0}")]
    Random(String),
}

fn refused(port: u16, error: &str) -> String {
    match port {
        0 => format!("no port of 127.0.0.1 is free: {error}"),
        _ => format!(
            "cannot listen on 127.0.0.1:{port}: {error}; needed: a port that is free, or none, for any"
        ),
    }
}

/// The server.
pub struct Server {
    listener: TcpListener,
    guard: Guard,
    bench: Bench,
    report: Report,
    /// Clouds that are being computed, by the slots of their pages.
    clouds: Mutex<HashMap<String, Arc<AtomicBool>>>,
    /// The connections whose requests are being read, from the oldest on, each with its number.
    readers: Mutex<VecDeque<(u64, TcpStream)>>,
    connections: AtomicU64,
    requests: AtomicUsize,
    stopped: AtomicBool,
}

/// One of a limited number of places. It is released when it is dropped, even after a panic.
struct Place<'a>(&'a AtomicUsize);

impl<'a> Place<'a> {
    fn among(taken: &'a AtomicUsize, most: usize) -> Option<Self> {
        let place = Self(taken);
        (taken.fetch_add(1, Ordering::SeqCst) < most).then_some(place)
    }
}

impl Drop for Place<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::SeqCst);
    }
}

/// A connection whose request is being read. It is one no longer when this is dropped.
struct Reading<'a> {
    server: &'a Server,
    number: u64,
}

impl Drop for Reading<'_> {
    fn drop(&mut self) {
        lock(&self.server.readers).retain(|(number, _)| *number != self.number);
    }
}

impl Server {
    /// Listens on a port, 0 for any that is free.
    ///
    /// # Errors
    /// A port that somebody else has.
    pub fn bind(port: u16, bench: Bench, report: Report) -> Result<Arc<Self>, ServerError> {
        let refused = |error: std::io::Error| ServerError::Port(port, error.to_string());
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(refused)?;
        let port = listener.local_addr().map_err(refused)?.port();
        let mut token = [0; 16];
        getrandom::fill(&mut token).map_err(|error| ServerError::Random(error.to_string()))?;
        let token = format!("{:032x}", u128::from_be_bytes(token));
        Ok(Arc::new(Self {
            listener,
            guard: Guard { port, token },
            bench,
            report,
            clouds: Mutex::default(),
            readers: Mutex::default(),
            connections: AtomicU64::new(0),
            requests: AtomicUsize::new(0),
            stopped: AtomicBool::new(false),
        }))
    }

    /// Address for a browser.
    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}/{}/", self.guard.port, self.guard.token)
    }

    /// Answers until [`Server::stop`]: a thread a connection, and a request a connection.
    pub fn serve(self: &Arc<Self>) {
        for stream in self.listener.incoming() {
            if self.stopped.load(Ordering::SeqCst) {
                return;
            }
            let Ok(mut stream) = stream else { continue };
            let server = Arc::clone(self);
            // Whoever asked may be gone. Without a thread the connection is closed, which its other end sees.
            let _ = std::thread::Builder::new().spawn(move || drop(server.answer(&mut stream)));
        }
    }

    /// Ends [`Server::serve`] and all running computations.
    pub fn stop(&self) {
        self.stopped.store(true, Ordering::SeqCst);
        lock(&self.clouds).values().for_each(|stop| stop.store(true, Ordering::SeqCst));
        // It waits for a connection: this one.
        let _ = TcpStream::connect((Ipv4Addr::LOCALHOST, self.guard.port));
    }

    fn answer(&self, stream: &mut TcpStream) -> std::io::Result<()> {
        let busy = || Reply::text(503, "too many requests at a time");
        let reading = self.reading(stream)?;
        let request = match http::read(stream)? {
            Ok(request) => request,
            Err((code, text)) => return respond(stream, &Reply::text(code, text)),
        };
        drop(reading);
        let path = match self.guard.path(&request) {
            Ok(path) => path,
            Err(refusal) => return respond(stream, &Reply::text(403, refusal)),
        };
        let Some(_place) = Place::among(&self.requests, MOST_REQUESTS) else {
            return respond(stream, &busy());
        };
        let reply = match (request.method.as_str(), path.strip_prefix("api/")) {
            ("GET", None) => self.page(&path),
            ("POST", Some("cloud")) => match serde_json::from_str(&request.body) {
                Ok(wanted) => return self.cloud(stream, &wanted),
                Err(error) => Reply::of(Err(LabError::request(error))),
            },
            ("POST", Some(name)) => Reply::of(self.bench.answer(name, &request.body)),
            _ => Reply::text(405, "not a request of the lab"),
        };
        respond(stream, &reply)
    }

    /// Takes a place among the connections that are read; ends the oldest of them if there is none.
    fn reading(&self, stream: &TcpStream) -> std::io::Result<Reading<'_>> {
        let own = stream.try_clone()?;
        let number = self.connections.fetch_add(1, Ordering::SeqCst);
        let mut readers = lock(&self.readers);
        if readers.len() >= MOST_READERS
            && let Some((_, oldest)) = readers.pop_front()
        {
            // It may be gone.
            let _ = oldest.shutdown(Shutdown::Both);
        }
        readers.push_back((number, own));
        Ok(Reading { server: self, number })
    }

    /// Returns a file of the page, or the report of a run.
    fn page(&self, path: &str) -> Reply {
        if let Some(name) = path.strip_prefix("report/") {
            let Some(folder) = self.bench.folder() else { return Reply::text(404, "the lab has no folder") };
            let name = guard::decoded(name);
            return match folder.run(&name).map(|path| (self.report)(&path, folder.path())) {
                Ok(Ok(html)) => Reply::report(html),
                Ok(Err(error)) => Reply::text(422, &error),
                Err(error) => Reply::text(404, &error.to_string()),
            };
        }
        match pages::find(path) {
            Some((kind, text)) => Reply::asset(kind, text),
            None => Reply::text(404, "the lab has no such page"),
        }
    }

    /// Returns a cloud, in pieces as they come.
    fn cloud(&self, stream: &mut TcpStream, wanted: &CloudRequest) -> std::io::Result<()> {
        let stop = self.replaced(&wanted.slot);
        reply::begin(stream)?;
        let mut write = |bytes: &[u8]| http::chunk(stream, bytes).is_ok();
        if let Err(error) = self.bench.cloud(wanted, &stop, &mut write) {
            let text = serde_json::to_vec(&error).unwrap_or_default();
            let length = u32::try_from(text.len()).unwrap_or(0);
            write(&[&length.to_le_bytes(), &2_u32.to_le_bytes(), &text[..]].concat());
        }
        // A chunk of nothing is the last.
        http::chunk(stream, b"")
    }

    /// Stops the cloud that had this slot; the flag that stops the new one.
    fn replaced(&self, slot: &str) -> Arc<AtomicBool> {
        let stop = Arc::new(AtomicBool::new(self.stopped.load(Ordering::SeqCst)));
        let mut clouds = lock(&self.clouds);
        if clouds.len() >= MOST_SLOTS {
            clouds.retain(|_, stop| Arc::strong_count(stop) > 1);
        }
        if let Some(old) = clouds.insert(slot.to_owned(), Arc::clone(&stop)) {
            old.store(true, Ordering::SeqCst);
        }
        stop
    }
}
