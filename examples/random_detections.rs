//! Random detections: valid scenarios drawn from seeds, over all methods, motors, sensors, errors, faults and keys, run
//! through the engine until as many as asked have ended. Each must end with an outcome or a named error.
//!
//! ```text
//! cargo run --release --example random_detections -- [N] [--seed FIRST] [--threads T] [--keep FILE]
//! cargo run --release --example random_detections -- --only SEED [--short]
//! ```
//! `--keep` appends the counts of each block of seeds to a file, from which an interrupted run goes on. `--only` runs
//! one seed and prints its scenario file. `--short` ends each detection after 10 ms, as the test of the suite does.

#[path = "../tests/suite/random_detections/mod.rs"]
mod random_detections;

use std::fs::OpenOptions;
use std::io::{IsTerminal as _, Write as _, stderr};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use random_detections::{Depth, Tally, drawn, run_seed};

const DEPTH: Depth = Depth { longest: 0.15, trials: 4, balance: 20, referee: 50, nonsense: 10 };

/// Longest simulated time in s of the test that is run with each change.
const SHORT: f64 = 0.01;

/// Longest simulated time in s of nine seeds in ten: injections alone take longer, and a hundred times as many steps.
const USUAL: f64 = 0.03;

/// What is run of a seed.
fn depth(seed: u64, asked: Depth) -> Depth {
    let longest = if seed.is_multiple_of(10) { asked.longest } else { asked.longest.min(USUAL) };
    Depth { longest, ..asked }
}

/// Seeds of a block, after which counts are kept.
const BLOCK: u64 = 250;

/// Longest time on the clock for a seed: four trials of four million steps each take 40 s of a processor, on a busy machine ten
/// times as much.
const LONGEST: Duration = Duration::from_secs(600);

struct Asked {
    detections: u64,
    first: u64,
    threads: usize,
    keep: Option<String>,
    only: Option<u64>,
    depth: Depth,
}

fn asked() -> Result<Asked, String> {
    let mut asked = Asked { detections: 300, first: 0, threads: 1, keep: None, only: None, depth: DEPTH };
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut next =
            || arguments.next().ok_or(format!("{argument}: found nothing, needed a value after it"));
        let number = |text: String| {
            text.parse::<u64>().map_err(|_| format!("{argument}: found {text}, needed a whole number"))
        };
        match argument.as_str() {
            "--seed" => asked.first = number(next()?)?,
            "--threads" => asked.threads = usize::try_from(number(next()?)?).unwrap_or(1).clamp(1, 64),
            "--short" => asked.depth.longest = SHORT,
            "--keep" => asked.keep = Some(next()?),
            "--only" => asked.only = Some(number(next()?)?),
            _ => asked.detections = number(argument.clone())?,
        }
    }
    Ok(asked)
}

impl Tally {
    /// Adds another tally.
    pub fn add(&mut self, other: &Self) {
        self.counts_mut().into_iter().zip(other.counts()).for_each(|(sum, (_, count))| *sum += count);
    }

    /// Returns the counts of a block of seeds as a line of a file.
    pub fn line(&self, first: u64) -> String {
        let counts = self.counts().map(|(name, count)| format!("{name} {count}"));
        format!("from {first}: {}\n", counts.join(", "))
    }

    /// Reads a line that [`Self::line`] wrote; none if it is another line.
    pub fn of_line(line: &str, first: u64) -> Option<Self> {
        let counts = line.strip_prefix(&format!("from {first}: "))?;
        let (mut tally, names) = (Self::default(), Self::default().counts());
        let counts: Vec<&str> = counts.split(", ").collect();
        if counts.len() != names.len() {
            return None;
        }
        for ((read, text), (name, _)) in tally.counts_mut().into_iter().zip(counts).zip(names) {
            *read = text.strip_prefix(name)?.trim().parse().ok()?;
        }
        Some(tally)
    }
}

/// Runs one seed and prints its scenario file. `--short` ends each detection after 10 ms, as the test of the suite does.
fn only(seed: u64, depth: Depth) -> Result<(), String> {
    use rand::SeedableRng as _;
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    if let Ok(drawn) = drawn(seed, depth.longest, &mut rng, &mut Tally::default()) {
        println!("{}", drawn.text);
        let ended = drawn.scenario.trials(0..DEPTH.trials, |record| {
            let (run, reason) = (&record.run, record.reason());
            let verdict = record.verdict();
            println!(
                "# trial {}: {verdict:?} at {} s, {:?} {reason}",
                record.trial,
                run.duration.seconds(),
                run.work
            );
        });
        ended.map_err(|error| format!("{error:?}"))?;
    }
    let mut tally = Tally::default();
    // Everything is looked at, whatever the seed.
    let depth = Depth { balance: 1, referee: 1, nonsense: 5, ..depth };
    run_seed(seed, depth, &mut tally).map_err(|surprise| surprise.to_string())?;
    println!("# {tally:?}");
    Ok(())
}

/// Reads the counts that an earlier run kept: how many blocks, and their sum.
fn earlier(asked: &Asked) -> Result<(u64, Tally), String> {
    let (mut blocks, mut sum) = (0, Tally::default());
    let Some(file) = &asked.keep else { return Ok((0, sum)) };
    let Ok(mut text) = std::fs::read_to_string(file) else { return Ok((0, sum)) };
    let whole = text.rfind('\n').map_or(0, |end| end + 1);
    if whole < text.len() {
        // The line that an interruption cut: its block is run again.
        text.truncate(whole);
        std::fs::write(file, &text).map_err(|error| format!("{file}: {error}"))?;
    }
    for (number, line) in text.lines().enumerate() {
        let Some(tally) = Tally::of_line(line, asked.first + blocks * BLOCK) else {
            let needed = "counts of the seeds that follow: another file for another --seed";
            return Err(format!("{file}: line {}: found {line:?}, needed {needed}", number + 1));
        };
        blocks += 1;
        sum.add(&tally);
    }
    Ok((blocks, sum))
}

fn main() -> Result<(), String> {
    let asked = asked()?;
    if let Some(seed) = asked.only {
        return only(seed, depth(seed, asked.depth));
    }
    let (blocks, sum) = earlier(&asked)?;
    let (next, done) = (AtomicU64::new(blocks), Mutex::new((blocks, sum, Vec::new())));
    let begun: Vec<Mutex<Option<(u64, Instant)>>> = (0..asked.threads).map(|_| Mutex::new(None)).collect();
    let working = AtomicUsize::new(asked.threads);
    let wanted = asked.detections.div_ceil(BLOCK * DEPTH.trials);
    std::panic::set_hook(Box::new(|_| ()));
    std::thread::scope(|scope| {
        for begun in &begun {
            let (next, done, working, asked) = (&next, &done, &working, &asked);
            scope.spawn(move || {
                loop {
                    let block = next.fetch_add(1, Ordering::Relaxed);
                    if block >= wanted {
                        break;
                    }
                    let mut tally = Tally::default();
                    for seed in asked.first + block * BLOCK..asked.first + (block + 1) * BLOCK {
                        *begun.lock().expect("no panic") = Some((seed, Instant::now()));
                        if let Err(surprise) = run_seed(seed, depth(seed, asked.depth), &mut tally) {
                            println!("{surprise}\n");
                            tally.surprises += 1;
                        }
                    }
                    keep(asked, &mut done.lock().expect("no panic"), block, tally);
                }
                working.fetch_sub(1, Ordering::Relaxed);
            });
        }
        while working.load(Ordering::Relaxed) > 0 {
            std::thread::sleep(Duration::from_millis(200));
            for slow in begun.iter().filter_map(|begun| *begun.lock().expect("no panic")) {
                if slow.1.elapsed() > LONGEST && working.load(Ordering::Relaxed) > 0 {
                    println!("seed {}: not done within {} s", slow.0, LONGEST.as_secs());
                    std::process::exit(1);
                }
            }
        }
    });
    let (_, sum, _) = done.into_inner().expect("no panic");
    println!("{} detections from seed {}", sum.detections(), asked.first);
    for (name, count) in sum.counts() {
        println!("  {count:>10} {name}");
    }
    if sum.surprises == 0 {
        return Ok(());
    }
    let again = "a line of the kept file with surprises begins with the first of its 250 seeds: --seed FIRST 1000 runs them again";
    Err(format!("{} surprises, printed as they were found; {again}", sum.surprises))
}

/// Adds the counts of a block and keeps those of all blocks that have no gap before them.
fn keep(asked: &Asked, done: &mut (u64, Tally, Vec<(u64, Tally)>), block: u64, tally: Tally) {
    let (kept, sum, waiting) = done;
    waiting.push((block, tally));
    while let Some(at) = waiting.iter().position(|(block, _)| block == kept) {
        let (_, tally) = waiting.swap_remove(at);
        if let Some(file) = &asked.keep {
            let line = tally.line(asked.first + *kept * BLOCK);
            let written = OpenOptions::new().create(true).append(true).open(file);
            if let Err(error) = written.and_then(|mut file| file.write_all(line.as_bytes())) {
                println!("{file}: {error}");
            }
        }
        sum.add(&tally);
        *kept += 1;
    }
    if stderr().is_terminal() {
        eprint!("\r{} of {} detections", sum.detections(), asked.detections);
    }
}
