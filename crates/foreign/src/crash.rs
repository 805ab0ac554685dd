//! Messages of the program before a crash of a foreign library ends it: which library, in which trial. A worker process writes
//! no message; its parent knows the reason from its exit code or signal. That holds for a call that takes too long, too.
#![allow(
    unsafe_code,
    reason = "signal handlers are registered and write to standard error by system calls alone"
)]

use std::cell::Cell;
use std::sync::atomic::{AtomicBool, AtomicPtr, AtomicU64, Ordering};
use std::sync::{Mutex, Once, OnceLock, PoisonError};
use std::time::{Duration, Instant};
use std::{fmt, ptr};

/// Purpose of a call into a library.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moment {
    /// To be loaded.
    Load,
    /// Before the first trial, to see whether a detector can be made.
    Check,
    /// In this trial.
    Trial(u64),
}

impl Moment {
    const fn number(self) -> u64 {
        match self {
            Self::Load => u64::MAX,
            Self::Check => u64::MAX - 1,
            Self::Trial(trial) => trial,
        }
    }
}

/// The library that a thread is in and when it was called, so that the message about a crash can name them.
#[derive(Clone, Copy, Debug)]
pub struct Site {
    /// The library as messages have it.
    library: &'static String,
    moment: Moment,
}

impl Site {
    /// Makes the site of a call into a library at this moment.
    pub fn new(library: &'static String, moment: Moment) -> Self {
        Self { library, moment }
    }
}

impl fmt::Display for Site {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.moment {
            Moment::Trial(trial) => write!(f, "{} in trial {trial}", self.library),
            Moment::Load | Moment::Check => write!(f, "{} before the first trial", self.library),
        }
    }
}

/// The present call of a thread, as signal handlers and other threads see it.
#[derive(Debug)]
struct Place {
    /// The library that it is in; null if it is in none.
    library: AtomicPtr<String>,
    moment: AtomicU64,
    /// Calls so far.
    calls: AtomicU64,
}

/// The places of all threads that ever were in a library.
static PLACES: Mutex<Vec<&'static Place>> = Mutex::new(Vec::new());

thread_local! {
    /// Without destructor, so that a signal handler may read it.
    static HERE: Cell<Option<&'static Place>> = const { Cell::new(None) };
}

#[cold]
fn new_place() -> &'static Place {
    let place = Place { library: AtomicPtr::default(), moment: AtomicU64::new(0), calls: AtomicU64::new(0) };
    let place: &'static Place = Box::leak(Box::new(place));
    PLACES.lock().unwrap_or_else(PoisonError::into_inner).push(place);
    HERE.set(Some(place));
    place
}

/// Marks this thread as inside a library, from [`enter`] to [`Inside::leave`]; a crash in between is attributed to the
/// detection. If a C++ exception unwinds through it, the process ends, because such exceptions may not pass through
/// this program.
#[must_use]
pub struct Inside(&'static Place);

/// Marks this thread as inside a library, see [`Inside`].
#[inline]
pub fn enter(site: Site) -> Inside {
    if ISOLATED.load(Ordering::Relaxed) {
        BEGAN.store(now(), Ordering::Relaxed);
    }
    let place = HERE.get().unwrap_or_else(new_place);
    place.calls.store(place.calls.load(Ordering::Relaxed) + 1, Ordering::Relaxed);
    place.moment.store(site.moment.number(), Ordering::Relaxed);
    place.library.store(ptr::from_ref(site.library).cast_mut(), Ordering::Relaxed);
    Inside(place)
}

impl Inside {
    /// Ends the mark of [`enter`].
    #[inline]
    pub fn leave(self) {
        self.0.library.store(ptr::null_mut(), Ordering::Relaxed);
        BEGAN.store(0, Ordering::Relaxed);
        std::mem::forget(self);
    }
}

impl Drop for Inside {
    #[cold]
    fn drop(&mut self) {
        if ISOLATED.load(Ordering::Relaxed) {
            // SAFETY: the program ends here, as its parent expects.
            unsafe { libc::_exit(THREW) };
        }
        tell(self.0, &[" let a C++ exception out of its function, where nobody catches it\n"]);
        // SAFETY: the program ends here; what the signal means has been said.
        unsafe {
            libc::signal(libc::SIGABRT, libc::SIG_DFL);
            libc::abort();
        }
    }
}

/// Returns the library whose call has not returned for so long, and when that is, if there is one.
pub fn hanging(limit: Duration) -> Option<String> {
    let all = || PLACES.lock().unwrap_or_else(PoisonError::into_inner).clone();
    let count = |place: &Place| place.calls.load(Ordering::Relaxed);
    let before: Vec<(&Place, u64)> = all().into_iter().map(|place| (place, count(place))).collect();
    std::thread::sleep(limit);
    before.into_iter().filter(|(place, calls)| count(place) == *calls).find_map(|(place, _)| {
        let (name, mut digits) = (name_of(place)?, [0; 20]);
        let [when, number] = when(place, &mut digits);
        Some(format!("the detector {name}{when}{number} has not returned from a call for {limit:?}"))
    })
}

fn name_of(place: &Place) -> Option<&'static str> {
    let library = place.library.load(Ordering::Relaxed);
    // SAFETY: null, or the name of a library, which is kept for the rest of the program.
    unsafe { library.as_ref() }.map(String::as_str)
}

fn when<'a>(place: &Place, digits: &'a mut [u8; 20]) -> [&'a str; 2] {
    match place.moment.load(Ordering::Relaxed) {
        u64::MAX => [", while it was loaded,", ""],
        number if number == Moment::Check.number() => [", while a first detector of it was tried,", ""],
        trial => [" in trial ", decimal(trial, digits)],
    }
}

/// Writes whose crash it is, without asking for memory: a signal handler may.
fn tell(place: &Place, end: &[&str]) {
    let mut digits = [0; 20];
    let [before, number] = when(place, &mut digits);
    let begin = ["\nstandstill: the detector ", name_of(place).unwrap_or("?"), before, number];
    write(begin.iter().chain(end));
}

/// Returns a number's digits.
fn decimal(mut number: u64, digits: &mut [u8; 20]) -> &str {
    let mut first = digits.len();
    loop {
        first -= 1;
        digits[first] = b"0123456789"[usize::try_from(number % 10).unwrap_or(0)];
        number /= 10;
        if number == 0 {
            return std::str::from_utf8(&digits[first..]).unwrap_or("?");
        }
    }
}

/// Whether this is a worker process.
static ISOLATED: AtomicBool = AtomicBool::new(false);

/// Start of the current call, in ns of the program's own clock; 0: no call.
static BEGAN: AtomicU64 = AtomicU64::new(0);

/// Ns since the first call of this, from 1.
fn now() -> u64 {
    static START: OnceLock<Instant> = OnceLock::new();
    u64::try_from(START.get_or_init(Instant::now).elapsed().as_nanos()).unwrap_or(u64::MAX).saturating_add(1)
}

/// The code with which a worker ends whose library called `exit`.
const CALLED_EXIT: i32 = 98;

/// The code with which a worker ends whose library let an exception out.
const THREW: i32 = 96;

/// The code with which a worker ends whose library did not return in time.
const TOO_LONG: i32 = 97;

/// Makes this program a worker: a library that crashes, or calls `exit`, or does not return from a call within `limit`, ends
/// it without a word, and so does the end of whoever writes to its standard input, also in the middle of a call. A worker
/// runs one detection at a time.
pub fn isolate(limit: Duration) {
    ISOLATED.store(true, Ordering::Relaxed);
    let limit = u64::try_from(limit.as_nanos()).unwrap_or(u64::MAX);
    let pause = libc::c_int::try_from((limit / 4_000_000).clamp(1, 20)).unwrap_or(20);
    let (ready, is_ready) = std::sync::mpsc::channel();
    let watch = move || {
        now();
        let _ = ready.send(());
        loop {
            let mut parent = libc::pollfd { fd: libc::STDIN_FILENO, events: 0, revents: 0 };
            // SAFETY: one struct, for up to so many milliseconds.
            unsafe { libc::poll(&raw mut parent, 1, pause) };
            if parent.revents & (libc::POLLHUP | libc::POLLERR) != 0 {
                // SAFETY: the program ends here: nobody is left to answer to.
                unsafe { libc::_exit(0) };
            }
            let began = BEGAN.load(Ordering::Relaxed);
            if began != 0 && now().saturating_sub(began) > limit {
                // SAFETY: the program ends here, as its parent expects.
                unsafe { libc::_exit(TOO_LONG) };
            }
        }
    };
    std::thread::spawn(watch);
    // What a thread needs to begin it may not get while a library is being loaded, which may never end.
    let _ = is_ready.recv();
}

/// Describes why a worker ended, by its exit code or signal.
pub fn ending(code: Option<i32>, signal: Option<i32>) -> String {
    let known = |number| SIGNALS.iter().find(|(known, _)| Some(*known) == number);
    match (code, signal) {
        (Some(TOO_LONG), _) => "a call took longer than detector.call_timeout".to_owned(),
        (Some(THREW), _) => "the library let a C++ exception out of its function".to_owned(),
        (Some(CALLED_EXIT), _) => "the library called exit()".to_owned(),
        (Some(code), _) => format!("its process ended with code {code}"),
        (None, signal) => match known(signal) {
            Some((_, name)) => format!("the library crashed: {name}"),
            None => format!("its process was ended by signal {}", signal.unwrap_or(0)),
        },
    }
}

/// Signals that end a program because of an error in its code.
const SIGNALS: [(libc::c_int, &str); 5] = [
    (libc::SIGSEGV, "SIGSEGV, memory that is not its own"),
    (libc::SIGBUS, "SIGBUS, memory that is not there"),
    (libc::SIGFPE, "SIGFPE, such as a division of whole numbers by zero"),
    (libc::SIGILL, "SIGILL, no instruction"),
    (libc::SIGABRT, "SIGABRT, such as abort(), a failed assert() or an exception that nobody catches"),
];

/// Largest number of threads that may be inside of libraries at once.
const AT_EXIT: usize = 1024;

/// Installs the signal handlers that report crashes, once per program.
pub fn watch() {
    static WATCH: Once = Once::new();
    WATCH.call_once(|| {
        for (signal, _) in SIGNALS {
            // SAFETY: a zeroed sigaction is one without flags and mask; the handler is one that signals allow.
            unsafe {
                let mut action: libc::sigaction = std::mem::zeroed();
                action.sa_sigaction = on_signal as *const () as libc::sighandler_t;
                // On the stack that threads have for the overflow of their own.
                action.sa_flags = libc::SA_ONSTACK;
                libc::sigaction(signal, &raw const action, ptr::null_mut());
            }
        }
        // Threads may call exit() at the same time: each takes what is registered one by one, and the last one ends the program
        // with its library's code.
        for _ in 0..AT_EXIT {
            // SAFETY: a function without arguments.
            unsafe { libc::atexit(on_exit) };
        }
    });
}

/// Writes these at once, so that lines of several threads do not mix.
fn write<'a>(texts: impl Iterator<Item = &'a &'a str>) {
    let mut line = [0_u8; 1024];
    let mut length = 0;
    for byte in texts.flat_map(|text| text.bytes()).take(line.len()) {
        line[length] = byte;
        length += 1;
    }
    // SAFETY: so many bytes from there; nothing can be done where standard error takes none.
    unsafe { libc::write(libc::STDERR_FILENO, line.as_ptr().cast(), length) };
}

/// Returns the place of this thread; none if it is not in a library.
fn here() -> Option<&'static Place> {
    HERE.get().filter(|place| !place.library.load(Ordering::Relaxed).is_null())
}

/// Lets only the first of several threads pass that crash or call `exit()` at the same time. That thread ends the
/// program; the others wait.
fn first() {
    static TELLS: AtomicBool = AtomicBool::new(false);
    while TELLS.swap(true, Ordering::Relaxed) {
        // SAFETY: waits for a signal.
        unsafe { libc::pause() };
    }
}

extern "C" fn on_signal(signal: libc::c_int) {
    first();
    if let Some(place) = here()
        && !ISOLATED.load(Ordering::Relaxed)
    {
        let name = SIGNALS.iter().find(|(known, _)| *known == signal).map_or("a signal", |(_, name)| name);
        tell(place, &[" crashed: ", name, "\n"]);
    }
    // SAFETY: without the handler the signal ends the program as it would have; sent to this thread itself.
    unsafe {
        libc::signal(signal, libc::SIG_DFL);
        libc::raise(signal);
    }
}

extern "C" fn on_exit() {
    if let Some(place) = here() {
        first();
        if ISOLATED.load(Ordering::Relaxed) {
            // SAFETY: the program ends here, as its parent expects.
            unsafe { libc::_exit(CALLED_EXIT) };
        }
        tell(place, &[" called exit(), which ends the whole program\n"]);
        // SAFETY: the program ends here; results are not written, as their command is in the middle of its work.
        unsafe { libc::_exit(1) };
    }
}
