//! How fast is this machine, and what becomes of it?
//!
//! ```text
//!   multiplications and additions ─► right-hand sides ─► steps ─► detections ─► a campaign
//!            (its peak)               alone, in lanes             each method     1, 2 threads
//! ```
//! All in one run, by turns and each at its best: the ratios hold on a machine that is busy with something else. The
//! seconds of docs/performance.md are from here.
//!
//! Run with `cargo run --release --example speed`.

use std::hint::black_box;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use multiversion::multiversion;
use standstill_campaign::{Campaign, CampaignError, ErrorSet, Scenario};
use standstill_detect::MethodName;
use standstill_inverter::Conduction;
use standstill_plant::{Motor, Pack, built_in};
use standstill_sim::{
    Flow, LANES, Lanes, Machine, Motion, PLANE, RotorState, Work, slopes_of_lanes, step, step_of_lanes,
};

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

/// The least time in ns that each of some tasks takes, one after the other and again, over `per` times what they do once.
fn by_turns<const K: usize>(per: [f64; K], tasks: [&mut dyn FnMut(); K]) -> [f64; K] {
    let mut best = [f64::INFINITY; K];
    let mut tasks = tasks;
    for _ in 0..25 {
        for (best, task) in best.iter_mut().zip(&mut tasks) {
            let begin = Instant::now();
            task();
            *best = best.min(begin.elapsed().as_secs_f64());
        }
    }
    std::array::from_fn(|k| best[k] * 1e9 / per[k])
}

struct Kernels {
    /// Right-hand side alone and per lane, step alone and per lane, in ns.
    times: [f64; 4],
}

/// A line pulse on a motor at rest, on a link with ripple.
fn kernels(motor: &Motor) -> Kernels {
    const CALLS: u32 = 2000;
    let drive = ErrorSet::Default.drive(motor.rated_current, 550.0);
    let mut flow = Flow::new(motor, &drive.bridge, &drive.link, Motion::Held);
    flow.turn(Motion::Held, 0.75);
    flow.conduct([Conduction::UpperSwitch, Conduction::LowerSwitch, Conduction::Blocked]);
    let rest = motor.open_circuit_flux(0.75);
    let (state, slope): ([f64; PLANE], _) = ([rest.alpha + 0.01, rest.beta], [100.0, -20.0]);
    let machines = Machine::side_by_side(&[flow.machine; LANES]);
    let wide = |y: [f64; PLANE]| y.map(|value| Pack([value; LANES]));
    let (wide_state, wide_slope) = (wide(state), wide(slope));
    let (time, h): (Lanes, Lanes) = (Pack([1e-3; LANES]), Pack([2e-5; LANES]));
    let tolerance = [1e-9; PLANE];
    let calls = f64::from(CALLS);
    let lanes = calls * LANES as f64;
    let times = by_turns(
        [calls, lanes, calls, lanes],
        [
            &mut || {
                for _ in 0..CALLS {
                    black_box(flow.derivative(black_box(1e-3), black_box(&state)));
                }
            },
            &mut || {
                let mut slope = wide_slope;
                for _ in 0..CALLS {
                    slopes_of_lanes(
                        black_box(&machines),
                        &time,
                        black_box(&wide_state),
                        black_box(&mut slope),
                    );
                }
            },
            &mut || {
                for _ in 0..CALLS {
                    black_box(step(
                        &flow.machine,
                        black_box(1e-3),
                        &state,
                        black_box(&slope),
                        2e-5,
                        &tolerance,
                    ));
                }
            },
            &mut || {
                for _ in 0..CALLS {
                    black_box(step_of_lanes(
                        black_box(&machines),
                        &time,
                        &wide_state,
                        black_box(&wide_slope),
                        &h,
                        &tolerance,
                    ));
                }
            },
        ],
    );
    Kernels { times }
}

/// What a trial of each method computes, on average.
fn work(scenario: &Scenario<standstill_detect::Method<f64>>, trials: u64) -> Result<[f64; 4], String> {
    let mut all = Work::default();
    for trial in 0..trials {
        let work = scenario.trial(trial).map_err(|error| error.to_string())?.run.work;
        all.derivatives += work.derivatives;
        all.steps += work.steps;
        all.segments += work.segments;
        all.events += work.events;
    }
    Ok([all.derivatives, all.steps, all.segments, all.events].map(|sum| sum as f64 / trials as f64))
}

/// The most memory in kB that this process has had, where the system says so.
fn memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    status.lines().find_map(|line| line.strip_prefix("VmHWM:")?.split_whitespace().next()?.parse().ok())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let motor = built_in("paper-5k5").ok_or("no such motor")?;

    let operations = 2.0 * 8.0 * CHAINS as f64 * f64::from(ROUNDS);
    let mut chains = [[1.0; 8]; CHAINS];
    let [operation] = by_turns([operations], [&mut || peak(black_box(&mut chains), black_box(0.999))]);
    println!("peak: {:.0} multiplications and additions per ns, fused", 1.0 / operation);

    let Kernels { times: [slope, slope_in_lanes, step, step_in_lanes] } = kernels(&motor);
    println!(
        "right-hand side: {slope:.1} ns alone, {slope_in_lanes:.2} ns in one of {LANES} lanes, ratio {:.1}",
        slope / slope_in_lanes
    );
    println!(
        "step with end, middle and error: {step:.0} ns alone, {step_in_lanes:.0} ns in a lane, ratio {:.1}",
        step / step_in_lanes
    );

    println!(
        "\n{:28}{:>12}{:>9}{:>10}{:>9}{:>12}{:>10}",
        "default errors, locked", "right-hand", "steps", "segments", "events", "µs", "ns per"
    );
    println!("{:28}{:>12}{:>9}{:>10}{:>9}{:>12}{:>10}", "", "sides", "", "", "", "", "r.-h. side");
    for method in MethodName::ALL {
        // Seconds of PWM: its right-hand sides are those of the injections.
        if method == MethodName::DcAlignment {
            continue;
        }
        let scenario = Scenario::of_method(method, motor.clone(), ErrorSet::Default, RotorState::Locked, 1);
        let trials = if method.name().starts_with("hfi") { 1 } else { 10 };
        let [derivatives, steps, segments, events] = work(&scenario, trials)?;
        let [time] = by_turns(
            [trials as f64 * 1e3],
            [&mut || {
                for trial in 0..trials {
                    black_box(scenario.trial(black_box(trial)).is_ok());
                }
            }],
        );
        println!(
            "{:28}{derivatives:>12.0}{steps:>9.0}{segments:>10.0}{events:>9.0}{time:>12.1}{:>10.0}",
            method.name(),
            time * 1e3 / derivatives
        );
    }

    let method = MethodName::LineInductanceFast;
    let scenario = Scenario::of_method(method, motor, ErrorSet::Default, RotorState::Locked, 1);
    let [derivatives, ..] = work(&scenario, 100)?;
    let trials = 800;
    let run = |threads: usize| {
        let campaign = Campaign { scenario: &scenario, trials, threads: Some(threads) };
        black_box(campaign.run(&AtomicBool::new(false), |_| Ok::<(), CampaignError>(())).is_ok());
    };
    let [one, two] = by_turns([trials as f64; 2], [&mut || run(1), &mut || run(2)]);
    println!(
        "\n{}: {:.0} detections/s on one thread, {:.0} on two, ratio {:.2}",
        method.name(),
        1e9 / one,
        1e9 / two,
        one / two
    );
    println!(
        "right-hand sides within a campaign: {:.0} % of the rate alone, {:.0} % of that in lanes",
        100.0 * derivatives * slope / one,
        100.0 * derivatives * slope_in_lanes / one
    );

    let long = |trials: u64| {
        let campaign = Campaign { scenario: &scenario, trials, threads: None };
        black_box(campaign.run(&AtomicBool::new(false), |_| Ok::<(), CampaignError>(())).is_ok());
        memory()
    };
    if let (Some(before), Some(after)) = (long(1000), long(20_000)) {
        println!("memory: {before} kB after 1,000 trials, {after} kB after 20,000");
    }
    Ok(())
}
