//! Do the intervals of `odds` hold the truth in 95 of 100 answers?
//!
//! ```text
//!   cargo run --release -p standstill-odds --features measure --example coverage -- 1000          all three probabilities
//!   cargo run --release -p standstill-odds --features measure --example coverage -- 1000 1e-9     one of them
//!   cargo run --release -p standstill-odds --features measure --example coverage -- 200 hidden    an event of which runs miss a part
//!   cargo run --release -p standstill-odds --features measure --example coverage -- 200 RP91      a problem of tests/systems/reliability.rs
//!   cargo run --release -p standstill-odds --features measure --example coverage -- 200 RP91 quick
//!   cargo run --release -p standstill-odds --features measure --example coverage -- 100 problems quick      all of them, a line each
//! ```
//! A two-vector test in Gaussian noise has the closed form Q(Δ/(√2 σ)). Each answer is eight runs; its seed is its number. A
//! line is printed after every twenty answers, and counts all so far. The last column is the exact 95 % interval (Clopper and
//! Pearson) of the share of intervals that hold the truth. Those are the intervals of the runs' own spread. Of the answers that
//! ring an alarm the two columns after it count how many of these hold it, and how many as the alarm widens them.

use std::convert::Infallible;
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;

use rayon::prelude::*;
use standstill_campaign::{Estimate, binomial_interval};
use standstill_interface::Choice;
use standstill_odds::subset::{Effort, Settings};
use standstill_odds::{Estimator, Halt, Odds, System};

#[path = "../tests/systems/reliability.rs"]
mod reliability;
#[path = "../tests/systems/mod.rs"]
mod systems;

/// Answers between two lines.
const LINE: u64 = 20;

/// Counts over all answers so far: how many intervals hold the truth, miss it below or above, and how many values are near it.
#[derive(Default)]
struct Counts {
    answers: u64,
    held: u64,
    below: u64,
    above: u64,
    near: u64,
    alarms: u64,
    /// Among the answers that ring an alarm, how many intervals hold the truth: the interval of the runs' own spread, and the widened one.
    alarmed: [u64; 2],
    /// Answers that are those of importance sampling, and the sum of their effective draws.
    mixtures: [u64; 2],
    /// Sums of value over truth, of upper end over value, of trials.
    sums: [f64; 3],
}

impl Counts {
    fn add(&mut self, odds: &mut Odds, truth: f64) {
        let p = odds.probability;
        let holds = |p: Estimate| u64::from(p.low <= truth && truth <= p.high);
        self.answers += 1;
        self.held += holds(p);
        self.below += u64::from(p.high < truth);
        self.above += u64::from(p.low > truth);
        self.near += u64::from((2.0 / 3.0..=1.5).contains(&(p.value / truth)));
        if let Estimator::Mixture { effective, .. } = odds.estimator {
            self.mixtures = [self.mixtures[0] + 1, self.mixtures[1] + u64::from(effective)];
        }
        if !odds.alarms.is_empty() {
            odds.doubt();
            self.alarms += 1;
            self.alarmed[0] += holds(p);
            self.alarmed[1] += holds(odds.probability);
        }
        for (sum, x) in self.sums.iter_mut().zip([p.value / truth, p.high / p.value, odds.trials as f64]) {
            *sum += x;
        }
    }

    fn say(&self, truth: f64) {
        let Self { answers, held, below, above, near, alarms, alarmed, mixtures, sums } = self;
        let [mean, width, trials] = sums.map(|sum| sum / *answers as f64);
        let share = binomial_interval(*held, *answers);
        println!(
            "{truth:.0e}  {answers:>7}  {held:>5}  {below:>5}  {above:>5}  {near:>10}  {mean:>10.4}  {width:>5.3}  {alarms:>6}  {:>4}  {:>7}  {trials:>16.0}  {:>8}  {:.1} % [{:.1}, {:.1}]",
            alarmed[0],
            alarmed[1],
            mixtures[0],
            100.0 * share.value,
            100.0 * share.low,
            100.0 * share.high,
        );
    }
}

fn main() -> Result<ExitCode, Halt<Infallible>> {
    let mut arguments = std::env::args().skip(1);
    let answers: u64 = arguments.next().and_then(|text| text.parse().ok()).unwrap_or(50);
    let only = arguments.next();
    let effort = arguments.next().and_then(|name| Effort::named(&name)).unwrap_or_default();
    if only.as_deref() == Some("problems") {
        return table(answers, effort);
    }
    println!("{answers} answers each, seeds 1 to {answers}");
    println!(
        "truth  answers   held  below  above  within 1.5  mean/truth  width  alarms  held  widened  trials an answer  mixtures  held, with interval"
    );
    if only.as_deref() == Some("hidden") {
        count(&systems::Hidden, systems::Hidden::probability(), answers, effort)?;
        return Ok(ExitCode::SUCCESS);
    }
    if let Some(problem) = reliability::PROBLEMS.iter().find(|problem| Some(problem.name) == only.as_deref())
    {
        count(&problem.system(), problem.probability, answers, effort)?;
        return Ok(ExitCode::SUCCESS);
    }
    let truth: Option<f64> = only.and_then(|text| text.parse().ok());
    for truth in truth.map_or_else(|| vec![1e-3, 1e-6, 1e-9], |truth| vec![truth]) {
        count(&systems::TwoVectors::of(truth), truth, answers, effort)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Prints a line for each reliability problem, whose seeds no other has: problems with as many draws would have the same first levels.
/// Fails if fewer intervals hold than 95 of 100 less four standard deviations: of 2,600 fewer than 2,426.
fn table(answers: u64, effort: Effort) -> Result<ExitCode, Halt<Infallible>> {
    let step = answers.max(1000);
    println!(
        "{answers} answers each, seeds 1 to {answers} of the first problem, from {} of the second, and so on",
        step + 1
    );
    println!(
        "problem   truth      held  widened  alarms  mean/truth  rms error %  width  trials an answer  mixtures  effective draws"
    );
    let mut all = Counts::default();
    for (index, problem) in (0..).zip(&reliability::PROBLEMS) {
        let first = step * index;
        let (system, truth) = (problem.system(), problem.probability);
        let mut counts = Counts::default();
        let mut squares = 0.0;
        let odds = (1..=answers).into_par_iter().map(|seed| answer(&system, effort, first + seed));
        for mut odds in odds.collect::<Result<Vec<Odds>, Halt<Infallible>>>()? {
            squares += (odds.probability.value / truth - 1.0) * (odds.probability.value / truth - 1.0);
            counts.add(&mut odds, truth);
        }
        let [mean, width, trials] = counts.sums.map(|sum| sum / answers as f64);
        let widened = counts.held - counts.alarmed[0] + counts.alarmed[1];
        println!(
            "{:<8}  {truth:.3e}  {:>4}  {widened:>7}  {:>6}  {mean:>10.3}  {:>11.1}  {width:>5.3}  {trials:>16.0}  {:>8}  {:>15}",
            problem.name,
            counts.held,
            counts.alarms,
            100.0 * (squares / answers as f64).sqrt(),
            counts.mixtures[0],
            counts.mixtures[1] / counts.mixtures[0].max(1),
        );
        all.answers += answers;
        all.held += counts.held;
        all.alarms += counts.alarms;
        all.alarmed[1] += widened;
    }
    println!(
        "all: {} of {} hold, {} as alarms widen them; {} alarms",
        all.held, all.answers, all.alarmed[1], all.alarms
    );
    let count = all.answers as f64;
    if all.held as f64 >= 0.95 * count - 4.0 * (0.95 * 0.05 * count).sqrt() {
        return Ok(ExitCode::SUCCESS);
    }
    eprintln!("too few intervals hold: look first at the problems with the fewest");
    Ok(ExitCode::FAILURE)
}

/// One answer, whose seed is its number.
fn answer<S: System<Error = Infallible>>(
    system: &S,
    effort: Effort,
    seed: u64,
) -> Result<Odds, Halt<Infallible>> {
    let odds = Odds::of(system, &Settings::of(effort, seed), &AtomicBool::new(false), |_| {})?;
    // Thousands of answers with all their tapes would fill the memory.
    Ok(Odds { failures: Vec::new(), ..odds })
}

/// Prints counts of so many answers for this system, whose event has this probability.
fn count<S: System<Error = Infallible> + Sync>(
    system: &S,
    truth: f64,
    answers: u64,
    effort: Effort,
) -> Result<(), Halt<Infallible>> {
    let mut counts = Counts::default();
    while counts.answers < answers {
        let (first, last) = (counts.answers + 1, answers.min(counts.answers + LINE));
        let some = (first..=last)
            .into_par_iter()
            .map(|seed| answer(system, effort, seed))
            .collect::<Result<Vec<Odds>, Halt<Infallible>>>()?;
        for mut odds in some {
            counts.add(&mut odds, truth);
        }
        counts.say(truth);
    }
    Ok(())
}
