//! How fast is this machine, and what becomes of it?
//!
//! ```text
//!   multiplications and additions ─► right-hand sides ─► steps ─► detections ─► a campaign
//!            (its peak)               alone, in lanes             each method     1, 2 threads
//! ```
//! All in one run, by turns and each at its best: the ratios hold on a machine that is busy with something else. The
//! figures of docs/performance.md are from here.
//!
//! Run with `cargo run --release --example speed`.

use std::hint::black_box;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use multiversion::multiversion;
use standstill_campaign::{Campaign, CampaignError, ErrorSet, Scenario};
use standstill_detect::{Method, MethodName, SettingsError};
use standstill_inverter::{Conduction, DcLink};
use standstill_plant::{Motor, built_in};
use standstill_sim::{Ask, Bank, CORE, Flow, LANES, Motion, PLANE, RotorState};

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

/// The least time in ns that each of some tasks takes, one after the other and again, over `per` times what they do once:
/// at least `turns[0]` times, at most `turns[1]`, and not again after a second.
fn by_turns<const K: usize>(turns: [u32; 2], per: [f64; K], mut tasks: [&mut dyn FnMut(); K]) -> [f64; K] {
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

/// A line pulse on a motor at rest, on a link with ripple.
struct Kernels<'a> {
    flow: Flow<'a>,
    bank: Bank<'a>,
    state: [f64; PLANE],
}

impl<'a> Kernels<'a> {
    /// What one call of each function does alone: so many times.
    const CALLS: u32 = 2000;
    const TOLERANCE: [f64; CORE] = [1e-9; CORE];

    fn new(motor: &'a Motor, scenario: &'a Scenario<Method<f64>>) -> Self {
        let link: &DcLink = &scenario.drive.link;
        let mut flow = Flow::new(motor, &scenario.drive.bridge, link, Motion::Held);
        flow.turn(Motion::Held, 0.75);
        flow.conduct([Conduction::UpperSwitch, Conduction::LowerSwitch, Conduction::Blocked]);
        let rest = motor.open_circuit_flux(0.75);
        let state = [rest.alpha + 0.01, rest.beta];
        let mut kernels = Self { bank: Bank::new(motor, link, Self::TOLERANCE), flow, state };
        for lane in 0..LANES {
            kernels.bank.seat(lane, &kernels.flow.machine, &kernels.flow.limits);
        }
        kernels.steps_in_lanes();
        kernels
    }

    fn ask(&self) -> Ask<'_, PLANE> {
        let Flow { machine, limits, .. } = &self.flow;
        Ask { machine, limits, time: 1e-3, start: self.state, h: 2e-5 }
    }

    fn slopes_alone(&self) {
        let terminals = self.flow.machine.terminals();
        for _ in 0..Self::CALLS {
            let there = self.flow.machine.evaluate(&terminals, black_box(1e-3), black_box(&self.state));
            black_box(there.slope);
        }
    }

    fn slopes_in_lanes(&mut self) {
        for _ in 0..Self::CALLS {
            black_box(black_box(&mut self.bank).slopes::<PLANE>(false));
        }
    }

    fn steps_alone(&self) {
        for _ in 0..Self::CALLS {
            black_box(black_box(self.ask()).stride(&[1e-9; PLANE]));
        }
    }

    /// With all that a machine puts into its lane and takes out of it.
    fn steps_in_lanes(&mut self) {
        for _ in 0..Self::CALLS {
            for lane in 0..LANES {
                let Flow { machine, limits, .. } = &self.flow;
                let ask = Ask { machine, limits, time: 1e-3, start: black_box(self.state), h: 2e-5 };
                self.bank.put(lane, &ask);
            }
            black_box(&mut self.bank).step();
            for lane in 0..LANES {
                black_box(self.bank.take::<PLANE>(lane));
            }
        }
    }
}

/// What a trial computes, on average: right-hand sides, steps, segments, events, and how long it is in s.
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
    let scenario = |method, rotor| Scenario::of_method(method, motor.clone(), ErrorSet::Default, rotor, 1);
    let fast = scenario(MethodName::LineInductanceFast, RotorState::Locked);
    // Before anything else has had memory.
    let grown = [1000, 20_000, 200_000].map(|trials| {
        campaign(&fast, trials, None);
        (trials, memory())
    });

    let operations = 2.0 * 8.0 * CHAINS as f64 * f64::from(ROUNDS);
    let mut chains = [[1.0; 8]; CHAINS];
    let [operation] =
        by_turns([100, 1000], [operations], [&mut || peak(black_box(&mut chains), black_box(0.999))]);
    println!("peak: {:.0} multiplications and additions per ns, fused", 1.0 / operation);

    let (machine, mut of_slopes, mut of_steps) =
        (Kernels::new(&motor, &fast), Kernels::new(&motor, &fast), Kernels::new(&motor, &fast));
    let calls = f64::from(Kernels::CALLS);
    let lanes = calls * LANES as f64;
    let [slope, slope_in_lanes, step, step_in_lanes] = by_turns(
        [25, 200],
        [calls, lanes, calls, lanes],
        [
            &mut || machine.slopes_alone(),
            &mut || of_slopes.slopes_in_lanes(),
            &mut || machine.steps_alone(),
            &mut || of_steps.steps_in_lanes(),
        ],
    );
    println!("\n| ns for one machine | alone | in one of {LANES} lanes | ratio |\n|---|---|---|---|");
    println!("| right-hand side | {slope:.1} | {slope_in_lanes:.2} | {:.2} |", slope / slope_in_lanes);
    println!("| step, put and taken | {step:.0} | {step_in_lanes:.1} | {:.2} |", step / step_in_lanes);

    println!(
        "\n| default errors | right-hand sides | steps | segments | events | µs alone | µs in lanes | ratio | simulated s/s |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let free = [MethodName::LineInductanceFast, MethodName::HfiRotating, MethodName::MaximumLikelihood];
    for method in MethodName::ALL {
        // Enough that the last ones, which have empty lanes beside them, count little; of seconds of PWM, as many as lanes.
        let trials = if method == MethodName::DcAlignment { LANES as u64 } else { 64 };
        row(&scenario(method, RotorState::Locked), &format!("`{method}`, locked"), trials)?;
        if free.contains(&method) {
            row(&scenario(method, RotorState::Free), &format!("`{method}`, free"), trials)?;
        }
    }

    let [derivatives, steps, ..] = work(&fast, 1000)?;
    let trials = 20_000;
    // The lanes' own rate again, by turns with the campaign: a busy machine is as busy for both.
    let [one, two, slope_in_lanes, step_in_lanes] = by_turns(
        [7, 7],
        [trials as f64, trials as f64, lanes, lanes],
        [
            &mut || campaign(&fast, trials, Some(1)),
            &mut || campaign(&fast, trials, Some(2)),
            &mut || of_slopes.slopes_in_lanes(),
            &mut || of_steps.steps_in_lanes(),
        ],
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
    let share = |per_trial: f64, time: f64| 100.0 * per_trial * time / one;
    println!(
        "| right-hand sides against those of lanes alone | {:.0} % |",
        share(derivatives, slope_in_lanes)
    );
    println!("| steps against those of lanes alone | {:.0} % |", share(steps, step_in_lanes));

    for (trials, memory) in grown {
        if let Some(memory) = memory {
            println!("| memory after {trials} trials, kB | {memory} |");
        }
    }
    Ok(())
}
