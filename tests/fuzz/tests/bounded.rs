//! Every input of the corpus, and a fixed number of seeded changes of each, through the functions that libFuzzer calls.
//!
//! `FUZZ_ROUNDS=100 FUZZ_TARGET=npz cargo test -p standstill-fuzz --test bounded` makes a hundred times as many changes, of one
//! target alone; `FUZZ_SEED` gives others.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use standstill_fuzz::{TARGETS, Target};

/// What an input of some kilobytes may take at most, in a build without optimisation on a busy machine.
const MOST_TIME: Duration = Duration::from_secs(5);
const MOST_BYTES: u64 = 1 << 30;

/// Length of changed inputs.
const LONGEST: usize = 64 << 10;

/// Changed inputs of a target, by the time that one takes.
fn rounds(name: &str) -> usize {
    match name {
        "fmu_calls" | "fmu_state" => 5,
        "scenario" | "fmu_resources" | "question" | "http" => 60,
        "mat" | "parquet" => 100,
        "sheet" | "npz" | "table_csv" | "journal" | "notes" | "tally" => 300,
        _ => 1000,
    }
}

fn inputs(name: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(name);
    let files = std::fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut all: Vec<_> = files
        .map(|file| file.expect("a file").path())
        .map(|path| (path.clone(), std::fs::read(path).expect("a file")))
        .collect();
    all.sort();
    assert!(!all.is_empty(), "{}: no inputs", folder.display());
    all
}

/// Numbers at which lengths, signs and exponents turn over.
const EDGES: [u64; 10] =
    [0, 1, 0x7f, 0xff, 0x7fff, 0xffff, 0x7fff_ffff, 0xffff_ffff, 0x7ff0_0000_0000_0000, u64::MAX];

/// A change of one input, with pieces of another.
fn changed(bytes: &[u8], other: &[u8], random: &mut ChaCha8Rng) -> Vec<u8> {
    let mut all = bytes.to_vec();
    for _ in 0..random.random_range(1..=4) {
        let at = random.random_range(0..=all.len());
        let end = (at + random.random_range(1..=16)).min(all.len());
        match random.random_range(0..8) {
            0 => all.truncate(at),
            1 if at < all.len() => all[at] ^= 1 << random.random_range(0..8),
            2 if at < all.len() => all[at] = random.random(),
            // A length or a number, in any of its widths.
            3 | 4 => {
                let edge = EDGES[random.random_range(0..EDGES.len())];
                let edge = edge.wrapping_add_signed(random.random_range(-1..=1)).to_le_bytes();
                let width = [1, 2, 4, 8][random.random_range(0..4)].min(all.len() - at);
                all[at..at + width].copy_from_slice(&edge[..width]);
            }
            5 => drop(all.drain(at..end)),
            6 => {
                let piece = all[at..end].to_vec();
                all.splice(at..at, piece.repeat(random.random_range(1..=20)));
            }
            _ if !other.is_empty() => {
                let from = random.random_range(0..other.len());
                let to = (from + random.random_range(1..=64)).min(other.len());
                all.splice(at..end, other[from..to].iter().copied());
            }
            _ => {}
        }
    }
    all.truncate(LONGEST);
    all
}

/// Runs one input within the limits; an input that breaks a law is kept, and its place is named.
fn run(target: Target, of: &Path, bytes: &[u8]) -> Result<(), String> {
    let begin = Instant::now();
    let mut panicked = None;
    let info = allocation_counter::measure(|| {
        panicked = catch_unwind(AssertUnwindSafe(|| (target.run)(bytes))).err();
    });
    let took = begin.elapsed();
    let wrong = match panicked {
        Some(panic) => {
            let said = panic.downcast_ref::<String>().map(String::as_str);
            Some(said.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("a panic").to_owned())
        }
        None if took > MOST_TIME => Some(format!("{took:?}")),
        None if info.bytes_max > MOST_BYTES => Some(format!("{} bytes of memory", info.bytes_max)),
        None => return Ok(()),
    };
    let kept =
        std::env::temp_dir().join(format!("standstill-fuzz-{}-{:08x}", target.name, crc32fast::hash(bytes)));
    std::fs::write(&kept, bytes).expect("a file");
    let (name, of, wrong) = (target.name, of.display(), wrong.unwrap_or_default());
    Err(format!("{name}: {wrong}; the input, changed from {of}, is {}", kept.display()))
}

/// promise: any-bytes-end-in-a-value-or-an-error
#[test]
fn law_any_bytes_end_in_a_value_or_an_error() {
    let number = |name: &str, usual: u64| {
        std::env::var(name).map_or(usual, |text| text.parse().unwrap_or_else(|_| panic!("{name}: {text}")))
    };
    let (times, seed) = (number("FUZZ_ROUNDS", 1), number("FUZZ_SEED", 1));
    let only = std::env::var("FUZZ_TARGET").ok();
    let mut wrong = Vec::new();
    for target in TARGETS.iter().filter(|target| only.as_ref().is_none_or(|only| only == target.name)) {
        let (all, begin) = (inputs(target.name), Instant::now());
        wrong.extend(all.iter().filter_map(|(path, bytes)| run(*target, path, bytes).err()));
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let count = rounds(target.name) * usize::try_from(times).expect("few");
        for _ in 0..count {
            let [(path, one), (_, other)] = [(); 2].map(|()| &all[random.random_range(0..all.len())]);
            wrong.extend(run(*target, path, &changed(one, other, &mut random)).err());
            if wrong.len() > 20 {
                break;
            }
        }
        println!("{}: {} inputs, {count} changed, {:.2?}", target.name, all.len(), begin.elapsed());
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Each folder of the corpus belongs to a target, and all of it is small.
#[test]
fn law_the_corpus_is_small_and_of_targets_alone() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus");
    for folder in std::fs::read_dir(corpus).expect("a folder") {
        let name = folder.expect("a folder").file_name().into_string().expect("a name");
        assert!(standstill_fuzz::target(&name).is_some(), "corpus/{name}: no target has this name");
    }
    let bytes: usize =
        TARGETS.iter().flat_map(|target| inputs(target.name)).map(|(_, bytes)| bytes.len()).sum();
    assert!(bytes <= 300 << 10, "{bytes} bytes");
}
