//! Files that a command leaves behind after a kill, on a full disk, or when somebody removes its folder.
//!
//! A library that stands before the C library (`broken/calls.c`) lets the k-th call end otherwise: with a kill, or with an error.

mod cases;
mod disks;
mod kills;
mod moments;
mod signals;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;

use tempfile::TempDir;

use self::cases::{CASES, Case};
use crate::firmware::root;

/// All kinds of calls that `calls.c` counts.
const ALL: &str = "write,open,rename,unlink,rmdir,mkdir,sync,truncate,close";

/// The library of `calls.c`.
fn library() -> &'static Path {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    BUILT.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
        let [new, path] =
            [format!("calls-{}.so", std::process::id()), "calls.so".to_owned()].map(|name| folder.join(name));
        let source = root().join("crates/cli/tests/cli/broken/calls.c");
        let built = Command::new("cc")
            .args(["-O1", "-shared", "-fPIC", "-Wall", "-Wextra", "-Werror", "-o"])
            .args([&new, &source])
            .arg("-ldl")
            .output()
            .expect("a C compiler");
        assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
        // Another process of these tests may be using the one that is there.
        fs::rename(&new, &path).expect("renamed");
        path
    })
}

/// The files below a folder by their paths, and folders with a slash behind them.
type Tree = BTreeMap<String, Vec<u8>>;

fn tree(folder: &Path) -> Tree {
    let mut all = Tree::new();
    let mut open = vec![(folder.to_owned(), String::new())];
    while let Some((at, before)) = open.pop() {
        for entry in fs::read_dir(at).into_iter().flatten().flatten() {
            let name = format!("{before}{}", entry.file_name().to_string_lossy());
            if entry.path().is_dir() {
                all.insert(format!("{name}/"), Vec::new());
                open.push((entry.path(), name + "/"));
            } else {
                all.insert(name, fs::read(entry.path()).expect("readable"));
            }
        }
    }
    all
}

/// A folder or file of a process that was killed: its name begins with the process's number.
fn unfinished(name: &str) -> bool {
    let number = name.split('/').next().and_then(|first| first.strip_prefix(".standstill-"));
    number.is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()))
}

/// A folder with all that the commands read.
struct Bench {
    folder: TempDir,
}

/// A command, what it begins with, and what it ends with where nothing happens.
struct Ready {
    words: Vec<&'static str>,
    /// The command that a user types after a kill.
    again: Vec<&'static str>,
    before: Option<Tree>,
    after: Tree,
    /// Exit code of the command, and whether a second time is refused.
    code: i32,
    once: bool,
    /// Kinds of all calls, one after the other.
    calls: Vec<String>,
}

impl Ready {
    /// Number of calls of these kinds.
    fn calls(&self, kinds: &str) -> u64 {
        let counts = |kind: &&String| kinds.split(',').any(|of| of == kind.as_str());
        self.calls.iter().filter(counts).count() as u64
    }
}

impl Bench {
    fn new() -> Self {
        let bench = Self { folder: crate::folder() };
        let at = bench.folder.path();
        let texts = [
            ("s.toml", "trials = 40\n[detector]\nmethod = \"bipolar\"\n"),
            ("l.toml", crate::answers::SCENARIO),
            (
                "r.toml",
                "trials = 100\nodds = \"off\"\n[[requirement]]\nid = \"A\"\ntext = \"t\"\nlimit = \"rms <= 6 deg\"\n",
            ),
        ];
        for (name, text) in texts {
            fs::write(at.join(name), text).expect("written");
        }
        fs::copy(root().join("examples/traces/six_vectors.csv"), at.join("t.csv")).expect("copied");
        fs::create_dir(at.join("tmp")).expect("made");
        for (seed, end) in [("1", ""), ("2", "-2")] {
            let (shards, done) = (format!("shards{end}"), format!("done{end}"));
            for shard in ["1/2", "2/2"] {
                bench.well(&["run", "s.toml", "--seed", seed, "--shard", shard, "--out", &shards]);
            }
            bench.well(&["run", "s.toml", "--seed", seed, "--out", &done]);
        }
        bench
    }

    fn out(&self) -> PathBuf {
        self.folder.path().join("o")
    }

    /// A command in this folder, with its caches and temporary files there, too.
    fn command(&self, words: &[&str], faults: &[(&str, &str)]) -> Command {
        let at = self.folder.path();
        let mut command = Command::new(env!("CARGO_BIN_EXE_standstill"));
        command
            .args(words)
            .current_dir(at)
            .env("XDG_CACHE_HOME", at.join("cache"))
            .env("TMPDIR", at.join("tmp"));
        command.stdin(Stdio::null());
        if !faults.is_empty() {
            command.env("LD_PRELOAD", library()).envs(faults.iter().copied());
        }
        command
    }

    fn run(&self, words: &[&str], faults: &[(&str, &str)]) -> Output {
        let output = self.command(words, faults).output().expect("it starts");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(!said.contains("panicked"), "{words:?} {faults:?}: {said}");
        output
    }

    /// Runs a command that must answer; returns its exit code.
    fn well(&self, words: &[&str]) -> i32 {
        let output = self.run(words, &[]);
        let code = output.status.code().unwrap_or(-1);
        // A question may be answered with no.
        assert!([0, 1, 3].contains(&code), "{words:?}: {}", String::from_utf8_lossy(&output.stderr));
        code
    }

    /// Makes the output folder what it was; none: it is not there.
    fn restore(&self, before: Option<&Tree>) {
        let _ = fs::remove_dir_all(self.out());
        let _ = fs::remove_dir_all(self.folder.path().join("cache"));
        let Some(before) = before else { return };
        fs::create_dir(self.out()).expect("made");
        for (name, content) in before {
            let path = self.out().join(name);
            if name.ends_with('/') {
                fs::create_dir_all(path).expect("made");
            } else {
                fs::create_dir_all(path.parent().expect("a folder")).expect("made");
                fs::write(path, content).expect("written");
            }
        }
    }

    /// Runs a case as it should go, and counts its calls; `replaces`: in a folder that has the answer to another question.
    fn ready(&self, case: &Case, replaces: bool) -> Ready {
        let mut words = case.words.to_vec();
        let mut before = case.is_single().then(Tree::new);
        if replaces {
            let other = case.other.expect("another question");
            self.restore(before.as_ref());
            if other[0] == words[0] {
                self.well(other);
            } else {
                self.well(&[&words, other].concat());
            }
            before = Some(tree(&self.out()));
            words.push("--force");
        }
        self.restore(before.as_ref());
        let count = self.folder.path().join("count");
        let _ = fs::remove_file(&count);
        let faults = [("FAULT_CALLS", ALL), ("FAULT_COUNT", count.to_str().expect("text"))];
        let output = self.run(&words, &faults);
        let code = output.status.code().unwrap_or(-1);
        assert!([0, 1, 3].contains(&code), "{words:?}: {}", String::from_utf8_lossy(&output.stderr));
        let calls = fs::read_to_string(count).unwrap_or_default().lines().map(str::to_owned).collect();
        let mut again = words.clone();
        if case.resumes && !replaces {
            again.push("--resume");
        }
        Ready { words, again, before, after: tree(&self.out()), code, once: case.is_once(), calls }
    }

    /// Checks the files after a command ended badly: each is the old one or the new one, and the next try makes all whole.
    fn looked_at(&self, ready: &Ready, of: &str) {
        let found = tree(&self.out());
        let none = Tree::new();
        let before = ready.before.as_ref().unwrap_or(&none);
        for (name, content) in &found {
            let in_the_making = unfinished(name) || name.ends_with(".journal") || name.ends_with('/');
            let whole = [before, &ready.after].iter().any(|tree| tree.get(name) == Some(content));
            assert!(in_the_making || whole, "{of}: {name} is neither the old one nor the new one");
        }
        // A journal in the way is thrown away by --force, as it says.
        let kept = |name: &&String| ready.after.contains_key(*name) && !name.ends_with(".journal");
        for name in before.keys().filter(kept) {
            assert!(found.contains_key(name), "{of}: {name} is gone");
        }
        let output = self.run(&ready.again, &[]);
        let said = String::from_utf8_lossy(&output.stderr);
        let is_there = ready.once && found.keys().any(|name| ready.after.contains_key(name));
        let code = if is_there { 2 } else { ready.code };
        assert_eq!(output.status.code(), Some(code), "{of}, then {:?}: {said}", ready.again);
        let mut now = tree(&self.out());
        // How often a journal of statistics was written is not what it says.
        let statistics = |tree: &Tree| tree.get("run.statistics").cloned();
        if let Some(after) = statistics(&ready.after).filter(|_| now.contains_key("run.statistics")) {
            now.insert("run.statistics".to_owned(), after);
        }
        let names = |tree: &Tree| tree.keys().cloned().collect::<Vec<_>>();
        assert_eq!(names(&now), names(&ready.after), "{of}, then {:?}", ready.again);
        for (name, content) in &now {
            assert!(ready.after.get(name) == Some(content), "{of}, then {:?}: {name} differs", ready.again);
        }
        for place in ["cache", "tmp"] {
            let left: Vec<String> = tree(&self.folder.path().join(place)).into_keys().collect();
            let last = |name: &String| unfinished(name.rsplit('/').next().unwrap_or_default());
            assert!(!left.iter().any(last), "{of}: {place} has {left:?}");
        }
    }
}

/// Numbers that look random, and repeat themselves.
struct Random(u64);

impl Random {
    /// A whole number from 1 to `most`.
    fn up_to(&mut self, most: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        1 + (self.0 >> 33) % most.max(1)
    }
}
