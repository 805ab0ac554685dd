//! How fast is this machine, and what becomes of it?
//!
//! ```text
//!   multiplications and additions ─► detections, alone and side by side ─► a campaign
//!            (its peak)                        each method                  1, 2 threads
//! ```
//! All in one run, by turns and each at its best: the ratios hold on a machine that is busy with something else. The
//! figures of docs/notes/performance.md are from here.
//!
//! Run with `cargo run --release --example speed`. `-- quick` takes each time once and a twentieth of the trials: whether it runs, and no
//! measurement.

use std::hint::black_box;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use multiversion::multiversion;
use standstill_campaign::{Campaign, CampaignError};
use standstill_detect::{Method, MethodName, SettingsError};
use standstill_plant::built_in;
use standstill_scenario::{Document, ErrorSet, Plan, Scenario};
use standstill_sim::RotorState;

/// Multiplications with addition that do not wait for each other: as many chains as a processor can have under way.
const CHAINS: usize = 12;
const ROUNDS: u32 = 1000;

#[multiversion(targets("x86_64+avx512f+avx512vl+avx2+fma", "x86_64+avx2+fma"))]
fn peak(chains: &mut [[f64; 8]; CHAINS], factor: f64) {
    let mut all = *chains;
    for _ in 0..ROUNDS {
        for value in all.as_flattened_mut() {
            *value = value.mul_add(factor, 1e-9);
        }
    }
    *chains = all;
}

/// Whether everything is to be tried, and nothing measured.
fn quick() -> bool {
    std::env::args().any(|argument| argument == "quick")
}

/// The least time in ns that each of some tasks takes, one after the other and again, over `per` times what they do once:
/// at least `turns[0]` times, at most `turns[1]`, and not again after a second.
fn by_turns<const K: usize>(turns: [u32; 2], per: [f64; K], mut tasks: [&mut dyn FnMut(); K]) -> [f64; K] {
    let turns = if quick() { [1, 1] } else { turns };
    let mut best = [f64::INFINITY; K];
    let start = Instant::now();
    for turn in 0..turns[1] {
        if turn >= turns[0] && start.elapsed().as_secs_f64() > 1.0 {
            break;
        }
        for (best, task) in best.iter_mut().zip(&mut tasks) {
            let begin = Instant::now();
            task();
            *best = best.min(begin.elapsed().as_secs_f64());
        }
    }
    std::array::from_fn(|k| best[k] * 1e9 / per[k])
}

/// What a trial computes, on average: evaluations of the core, steps, segments, events, and how long it is in s.
fn work(scenario: &Scenario<Method<f64>>, trials: u64) -> Result<[f64; 5], SettingsError> {
    let mut sums = [0.0; 5];
    scenario.trials(0..trials, |record| {
        let work = record.run.work;
        let counts = [work.derivatives, work.steps, work.segments, work.events].map(|count| count as f64);
        for (sum, count) in sums.iter_mut().zip(counts) {
            *sum += count;
        }
        sums[4] += record.run.duration.seconds();
    })?;
    Ok(sums.map(|sum| sum / trials as f64))
}

/// Trials of a method alone and in lanes, as a row of a table.
fn row(scenario: &Scenario<Method<f64>>, label: &str, trials: u64) -> Result<(), SettingsError> {
    let [derivatives, steps, segments, events, duration] = work(scenario, trials)?;
    let [alone, in_lanes] = by_turns(
        [2, 25],
        [trials as f64; 2],
        [
            &mut || {
                for trial in 0..trials {
                    black_box(scenario.trial(trial).is_ok());
                }
            },
            &mut || {
                black_box(scenario.trials(0..trials, |record| _ = black_box(record)).is_ok());
            },
        ],
    );
    println!(
        "| {label} | {derivatives:.0} | {steps:.0} | {segments:.0} | {events:.0} | {:.1} | {:.1} | {:.2} | {:.1} |",
        alone * 1e-3,
        in_lanes * 1e-3,
        alone / in_lanes,
        duration / (in_lanes * 1e-9)
    );
    Ok(())
}

/// The map of a motor, whose algebraic core it was sampled from.
const MAPPED: &str = r#"
[motor]
name = "mapped"
rating = { current = "8.8 A", dc_link = "550 V" }
winding = { pole_pairs = 2, resistance = "0.63 Ω" }
map.file = "maps/both_sides.csv"
rotor = { inertia = "0.015 kg m²", stiction = "0.2 N m", coulomb = "0.2 N m", viscous = "0 N m s" }
"#;

/// How fast trials of the second scenario of each pair are against those of the first, in lanes, as rows of a table.
fn ratios() -> Result<(), Box<dyn std::error::Error>> {
    let file = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/speed.toml"));
    let paper = "motor = \"paper-5k5\"\n";
    let drawn = format!(
        "{paper}[tolerances]\n\"motor.winding.resistance\" = {{ normal = \"5 %\", truncated = 3 }}\n"
    );
    let inductances = format!(
        "{paper}[tolerances]\n\"motor.winding.mean_inductance\" = {{ normal = \"0.3 %\", truncated = 3 }}\n\
         \"motor.winding.saliency\" = {{ normal = \"0.3 %\", truncated = 3 }}\n"
    );
    let pairs = [
        ("a free rotor against a locked one", [paper.to_owned(), format!("{paper}rotor.state = \"free\"\n")]),
        (
            "a flux map against the core behind it",
            ["motor = \"pm-reluctance\"\n".to_owned(), MAPPED.to_owned()],
        ),
        ("a motor drawn by each trial against a fixed one", [paper.to_owned(), drawn]),
        ("the same of its two inductances", [paper.to_owned(), inductances]),
    ];
    println!(
        "\n| detections per time | `line-inductance-fast` | `bipolar` | `maximum-likelihood` |\n|---|---|---|---|"
    );
    for (label, texts) in pairs {
        print!("| {label} |");
        for method in [MethodName::LineInductanceFast, MethodName::Bipolar, MethodName::MaximumLikelihood] {
            let plan = |text: &String| {
                Plan::new(Document::parse(file, &format!("detector.method = \"{method}\"\n{text}"))?)
            };
            let plans = [plan(&texts[0])?, plan(&texts[1])?];
            let scenarios = [plans[0].scenario(0)?, plans[1].scenario(0)?];
            let trials = |k: usize| {
                let done =
                    plans[k].trials(0, &scenarios[k], &mut (0..512), &mut |record| _ = black_box(record));
                assert!(done.is_ok(), "trials that run");
            };
            let [first, second] = by_turns([5, 25], [1.0; 2], [&mut || trials(0), &mut || trials(1)]);
            print!(" {:.2} |", first / second);
        }
        println!();
    }
    Ok(())
}

fn campaign(scenario: &Scenario<Method<f64>>, trials: u64, threads: Option<usize>) {
    let campaign = Campaign { scenario, trials, threads };
    let done = campaign.run(&AtomicBool::new(false), |record| {
        black_box(record);
        Ok::<(), CampaignError>(())
    });
    assert!(done.is_ok_and(|done| done == trials), "a campaign that runs");
}

/// The most memory in kB that this process has had, where the system says so.
fn memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    status.lines().find_map(|line| line.strip_prefix("VmHWM:")?.split_whitespace().next()?.parse().ok())
}

/// Processor time in s that all threads of this process have had, where the system says so.
fn processor_time() -> Option<f64> {
    // In hundredths of a second; what comes before may contain blanks.
    let status = std::fs::read_to_string("/proc/self/stat").ok()?;
    let mut ticks = status.rsplit_once(')')?.1.split_whitespace().skip(11);
    let mut next = || ticks.next()?.parse::<u32>().ok();
    Some(f64::from(next()? + next()?) * 0.01)
}

/// Processors that two threads had, and their work per time on them against that of one thread: on a machine that has no
/// second core to spare, the ratio of the rates says nothing.
fn processors(scenario: &Scenario<Method<f64>>, trials: u64) -> Option<(f64, f64)> {
    let measure = |threads| {
        let (begin, before) = (Instant::now(), processor_time()?);
        campaign(scenario, trials, Some(threads));
        Some((processor_time()? - before, begin.elapsed().as_secs_f64()))
    };
    let (mut least, mut share): ([f64; 2], f64) = ([f64::INFINITY; 2], 0.0);
    for _ in 0..3 {
        let ((one, _), (two, elapsed)) = (measure(1)?, measure(2)?);
        least = [least[0].min(one), least[1].min(two)];
        share = share.max(two / elapsed);
    }
    Some((share, least[0] / least[1]))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let motor = built_in("paper-5k5").ok_or("no such motor")?;
    let scenario = |method, errors, rotor| Scenario::of_method(method, motor.clone(), errors, rotor, 1);
    let fast = scenario(MethodName::LineInductanceFast, ErrorSet::Default, RotorState::Locked);
    // Before anything else has had memory.
    let part = if quick() { 20 } else { 1 };
    let grown = [1000, 20_000, 200_000].map(|trials| trials / part).map(|trials| {
        campaign(&fast, trials, None);
        (trials, memory())
    });

    let operations = 2.0 * 8.0 * CHAINS as f64 * f64::from(ROUNDS);
    let mut chains = [[1.0; 8]; CHAINS];
    let [operation] =
        by_turns([100, 1000], [operations], [&mut || peak(black_box(&mut chains), black_box(0.999))]);
    println!("peak: {:.0} multiplications and additions per ns, fused", 1.0 / operation);

    println!(
        "\n| default errors or `field` | evaluations of the core | steps | segments | events | µs alone | µs in lanes | ratio | simulated s/s |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let free = [MethodName::LineInductanceFast, MethodName::HfiRotating, MethodName::MaximumLikelihood];
    for method in MethodName::ALL {
        // Enough that the last ones, which have empty lanes beside them, count little; of seconds of PWM, as many as lanes.
        let trials = if method == MethodName::DcAlignment { 8 } else { 64 };
        row(
            &scenario(method, ErrorSet::Default, RotorState::Locked),
            &format!("`{method}`, locked"),
            trials,
        )?;
        // Seconds of PWM with ringing terminals would take longer than all the rest.
        if method != MethodName::DcAlignment {
            row(&scenario(method, ErrorSet::Field, RotorState::Locked), &format!("`{method}`, `field`"), 24)?;
        }
        if free.contains(&method) {
            row(
                &scenario(method, ErrorSet::Default, RotorState::Free),
                &format!("`{method}`, free"),
                trials,
            )?;
        }
    }

    ratios()?;

    let trials = 20_000 / part;
    let [one, two] = by_turns(
        [7, 7],
        [trials as f64; 2],
        [&mut || campaign(&fast, trials, Some(1)), &mut || campaign(&fast, trials, Some(2))],
    );
    let name = MethodName::LineInductanceFast;
    println!("\n| campaign of `{name}`, {trials} trials | |\n|---|---|");
    println!("| detections/s on one thread | {:.0} |", 1e9 / one);
    println!("| detections/s on two threads | {:.0} |", 1e9 / two);
    println!("| two threads against one | {:.2} |", one / two);
    if let Some((processors, efficiency)) = processors(&fast, trials) {
        println!("| processors that two threads had at most | {processors:.2} |");
        println!("| detections per processor's second, two threads against one | {efficiency:.2} |");
    }
    for (trials, memory) in grown {
        if let Some(memory) = memory {
            println!("| memory after {trials} trials, kB | {memory} |");
        }
    }
    Ok(())
}
