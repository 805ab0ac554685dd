//! The probability of an event from several independent runs of subset simulation.

#[cfg(test)]
mod tests;

use std::fmt;

use standstill_campaign::{Estimate, binomial_interval, student};
use standstill_numeric::power;
use standstill_sim::Tape;

use crate::kept::{KeptRun, KeptTapes};
use crate::subset::{End, Run, Settings, run};
use crate::system::kept;
use crate::{Halt, System, Watch};

/// Independent runs of an answer.
pub const RUNS: u32 = 8;

/// The least share of what runs expect of themselves that their scatter is taken for. Of intervals of the scatter alone 93 to 95 of 100
/// hold the truth, for those miss it whose runs agree by chance; with this 95 to 97 do (docs/notes/odds-coverage.txt).
const LEAST: f64 = 0.8;

/// Plain trials where no order parameter leads to the event.
pub const PLAIN: u32 = 400_000;

/// Alarms that make an answer doubtful.
#[derive(Clone, Debug, PartialEq)]
pub enum Alarm {
    /// The runs disagree by more than each of them should err.
    Disagree {
        /// Coefficient of variation of the runs.
        found: f64,
        /// Their expected scatter.
        expected: f64,
    },
    /// Draws that nothing reads have a mean: few independent states were left.
    Unread(f64),
    /// The last level descends from so few of the first level's states in a run.
    Ancestors(u32),
    /// So many runs of all did not reach the event.
    Missed {
        /// How many.
        runs: usize,
        /// Of so many.
        of: usize,
    },
    /// Nothing says how far a start is from the event: what is given are the plain trials.
    Flat,
    /// All starts have the same distance from the event: what is given is the limit of the plain trials done until then.
    Constant,
    /// No run reached the event; they gave up where levels have this probability. That is no bound: a part that all of them
    /// miss may be likelier.
    TooRare(f64),
    /// So many simulations could not go on; they count as starts without the event.
    Errors(u64),
    /// So large a share of the faults are of kinds that no margin leads to.
    Unled(f64),
    /// An axis error near 90° makes any pole a wrong one: so large a share of the wrong poles are of that kind.
    WrongAxes(f64),
}

impl fmt::Display for Alarm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Disagree { found, expected } => write!(
                f,
                "the runs scatter by {:.0} % where they expect {:.0} % of themselves: the event may have parts that \
                 some runs miss",
                100.0 * found,
                100.0 * expected
            ),
            Self::Unread(mean) => write!(
                f,
                "draws that nothing reads have a mean of {mean:.2} standard deviations: few independent states are left"
            ),
            Self::Ancestors(count) => {
                write!(
                    f,
                    "all states of a run's last level descend from {count} of its first: its parts are few"
                )
            }
            Self::Missed { runs, of } => write!(f, "{runs} of {of} runs did not reach the event"),
            Self::Flat => write!(
                f,
                "nothing says how near a start is to the event, or that is clipped or coarsely quantised: these are plain \
                 trials"
            ),
            Self::Constant => write!(
                f,
                "all starts are equally far from the event, so nothing leads there: the bound is what the plain trials \
                 done until then carry"
            ),
            Self::TooRare(level) => write!(
                f,
                "not reached: the runs gave up at {level:.0e}, which bounds nothing; the bound is what their plain trials carry"
            ),
            Self::Errors(count) => {
                write!(f, "{count} simulations could not go on and count as starts without the event")
            }
            Self::Unled(share) => write!(
                f,
                "{:.0} % of the failed starts ended with a fault that no margin tells beforehand, as a clipped current: \
                 there may be more of them",
                100.0 * share
            ),
            Self::WrongAxes(share) => write!(
                f,
                "{:.0} % of the wrong poles have an axis error above 45°: it is the axis that is lost, not the pole",
                100.0 * share
            ),
        }
    }
}

/// Way to the answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// By subset simulation.
    Subset,
    /// By counting plain trials.
    Plain,
}

/// The odds of an event.
#[derive(Clone, Debug, PartialEq)]
pub struct Odds {
    /// Way to them.
    pub answer: Answer,
    /// The probability with its 95 % interval.
    pub probability: Estimate,
    /// True if the interval was widened, because an alarm rings: it is wider than one of 95 %, by how much is not known.
    pub widened: bool,
    /// Trials in all.
    pub trials: u64,
    /// Plain trials among them: those that are counted, or the first levels of all runs.
    pub plain: u64,
    /// Levels of the run that had most.
    pub levels: u32,
    /// Each run; none of plain trials.
    pub runs: Vec<Run>,
    /// Alarms.
    pub alarms: Vec<Alarm>,
    /// Findings like the alarms', each about so few of the event's starts that the answer holds.
    pub remarks: Vec<Alarm>,
    /// Tapes of the event with the weight of each. The weights sum to one, unless there are none.
    pub failures: Vec<(f64, Tape)>,
}

impl Odds {
    /// By `RUNS` runs of subset simulation, or plain trials where that does not lead to the event. `done` hears of each
    /// run that is finished.
    ///
    /// # Errors
    /// Those of the system; that it was stopped.
    pub fn of<S: System>(
        system: &S,
        settings: &Settings,
        watch: &dyn Watch,
        done: impl FnMut(&Run),
    ) -> Result<Self, Halt<S::Error>> {
        Self::of_event(system, "", settings, watch, done)
    }

    /// Odds of an event; `name` distinguishes it from others whose runs the watch may keep.
    pub(crate) fn of_event<S: System>(
        system: &S,
        name: &str,
        settings: &Settings,
        watch: &dyn Watch,
        mut done: impl FnMut(&Run),
    ) -> Result<Self, Halt<S::Error>> {
        let mut runs: Vec<Run> = Vec::new();
        for number in 0..RUNS {
            let key = format!("{name}: run {number} of {settings:?}");
            let mut fresh = None;
            let compute = || {
                let found = run(system, settings, number, watch)?;
                let keep = KeptRun::of(&found);
                fresh = Some(found);
                Ok::<_, Halt<S::Error>>(keep)
            };
            let found = kept(watch, &key, |kept: &KeptRun| kept.trials, compute)?;
            let found = match fresh.or_else(|| found.run(settings.seed)) {
                Some(found) => found,
                None => run(system, settings, number, watch)?,
            };
            done(&found);
            let flat = found.end == End::Flat;
            runs.push(found);
            // One that is stuck at its first level would be stuck every time.
            if flat && number == 0 && runs[0].levels == 1 {
                break;
            }
            if number == 0 && runs[0].end == End::Constant {
                return Ok(Self {
                    answer: Answer::Plain,
                    probability: binomial_interval(0, runs[0].trials),
                    widened: false,
                    trials: runs[0].trials,
                    plain: runs[0].trials,
                    levels: 1,
                    runs: Vec::new(),
                    alarms: vec![Alarm::Constant],
                    remarks: Vec::new(),
                    failures: Vec::new(),
                });
            }
        }
        if runs.iter().filter(|run| run.end == End::Flat).count() * 2 > runs.len() {
            let spent = runs.iter().map(|run| run.trials).sum::<u64>();
            let mut odds = plain(system, name, settings, watch)?;
            odds.trials += spent;
            return Ok(odds);
        }
        Ok(Self::of_runs(settings, runs))
    }

    /// Estimate by all runs: the mean of their probabilities m, and as its interval m·exp(± t s/(m √R)) with the
    /// standard deviation s of R runs and Student's t. Where runs agree more closely than `LEAST` times what they expect of
    /// themselves, that is by chance, and s is so much.
    pub fn of_runs(settings: &Settings, mut runs: Vec<Run>) -> Self {
        let all = runs.len();
        let probability_of = |run: &Run| if run.end == End::Reached { run.probability } else { 0.0 };
        let count = all as f64;
        let mean = runs.iter().map(probability_of).sum::<f64>() / count;
        let scatter =
            runs.iter().map(|run| power(probability_of(run) - mean, 2)).sum::<f64>() / (count - 1.0);
        let variation = if mean > 0.0 { scatter.sqrt() / mean } else { 0.0 };
        let reached: Vec<&Run> = runs.iter().filter(|run| run.end == End::Reached).collect();
        let judged = variation.max(LEAST * expected(&reached));
        let factor = standstill_numeric::exp(student(count - 1.0) * judged / count.sqrt());
        let mut probability = Estimate { value: mean, low: mean / factor, high: (mean * factor).min(1.0) };
        let mut alarms = Vec::new();
        let plain = all as u64 * u64::from(settings.states);
        if reached.is_empty() {
            // The level at which the chains gave up does not bound the probability. The first levels' trials do: they are independent.
            let hits = runs.iter().map(|run| u64::from(run.plain_hits)).sum();
            probability = binomial_interval(hits, plain);
            alarms.push(Alarm::TooRare(runs.iter().map(|run| run.probability).fold(0.0, f64::max)));
        } else if reached.iter().all(|run| run.levels == 1) {
            // Not rare: these are plain trials.
            let hits = reached.iter().map(|run| u64::from(run.plain_hits)).sum();
            probability = binomial_interval(hits, reached.len() as u64 * u64::from(settings.states));
        } else {
            alarms.extend(alarms_of(&reached, all, variation));
        }
        let levels = runs.iter().map(|run| run.levels).max().unwrap_or(0);
        let trials = runs.iter().map(|run| run.trials).sum();
        let mut failures = Vec::new();
        for run in &mut runs {
            let weight = probability_of(run) / (mean * count) / run.failures.len().max(1) as f64;
            failures.extend(std::mem::take(&mut run.failures).into_iter().map(|tape| (weight, tape)));
        }
        Self {
            answer: Answer::Subset,
            probability,
            widened: false,
            trials,
            plain,
            levels,
            runs,
            alarms,
            remarks: Vec::new(),
            failures,
        }
    }

    /// Widens the interval where what was found makes it doubtful. That of runs which agree is narrow because they do; where
    /// one may have missed a part of the event, or few independent states are left, it goes from the least run to the greatest,
    /// each with twice its own error, and from zero where one did not reach the event. Of failures that nothing leads to only
    /// the first levels' plain trials know how many there are.
    pub fn doubt(&mut self, settings: &Settings) {
        let parts = |alarm: &Alarm| {
            matches!(
                alarm,
                Alarm::Disagree { .. } | Alarm::Unread(_) | Alarm::Ancestors(_) | Alarm::Missed { .. }
            )
        };
        if self.answer == Answer::Plain || self.runs.is_empty() {
            return;
        }
        if self.alarms.iter().any(parts) {
            let reached = self.runs.iter().filter(|run| run.end == End::Reached);
            let ends = reached.map(|run| {
                let error = standstill_numeric::exp(2.0 * run.variation);
                [run.probability / error, run.probability * error]
            });
            let all = self.runs.iter().all(|run| run.end == End::Reached);
            let (mut low, mut high) = (if all { f64::INFINITY } else { 0.0 }, 0.0_f64);
            for [from, to] in ends {
                (low, high) = (low.min(from), high.max(to));
            }
            self.probability.low = self.probability.low.min(low);
            self.probability.high = self.probability.high.max(high.min(1.0));
            self.widened = true;
        }
        if self.alarms.iter().any(|alarm| matches!(alarm, Alarm::Unled(_))) {
            let hits = self.runs.iter().map(|run| u64::from(run.plain_hits)).sum();
            let plain = binomial_interval(hits, self.runs.len() as u64 * u64::from(settings.states));
            self.probability.high = self.probability.high.max(plain.high);
            self.widened = true;
        }
    }

    /// Reports a finding about this share of the event's starts: as an alarm above a tenth, as a remark above a hundredth.
    pub(crate) fn tell(&mut self, share: f64, what: fn(f64) -> Alarm) {
        const TOLD: f64 = 0.01;
        const DOUBTFUL: f64 = 0.1;
        if share > DOUBTFUL {
            self.alarms.push(what(share));
        } else if share > TOLD {
            self.remarks.push(what(share));
        }
    }
}

/// The coefficient of variation that runs expect of themselves; zero of none.
fn expected(runs: &[&Run]) -> f64 {
    (runs.iter().map(|run| power(run.variation, 2)).sum::<f64>() / runs.len().max(1) as f64).sqrt()
}

/// Alarms of runs that reached a rare event.
fn alarms_of(reached: &[&Run], all: usize, variation: f64) -> Vec<Alarm> {
    /// Seven degrees of freedom exceed 1.5 times their expectation twice in a hundred times, were it right. Up to [`SHALLOW`] levels runs
    /// scatter by 1.2 times it and rang in up to one of seven answers: there twice it, of which less than one in a hundred is chance
    /// (docs/notes/odds-coverage.txt). Further down parts of an event are missed, and of these the alarm must tell.
    const MORE: [f64; 2] = [2.0, 1.5];
    const SHALLOW: u32 = 5;
    /// The mean of eight independent states has a standard deviation of 0.35.
    const UNREAD: f64 = 0.35;
    const ANCESTORS: u32 = 5;
    let count = reached.len() as f64;
    let mut alarms = Vec::new();
    if reached.len() < all {
        alarms.push(Alarm::Missed { runs: all - reached.len(), of: all });
    }
    let expected = expected(reached);
    let shallow = reached.iter().all(|run| run.levels <= SHALLOW);
    if variation > MORE[usize::from(!shallow)] * expected {
        alarms.push(Alarm::Disagree { found: variation, expected });
    }
    let squares = reached.iter().flat_map(|run| run.unread).map(|mean| mean * mean).sum::<f64>();
    let unread = (squares / (count * reached[0].unread.len() as f64)).sqrt();
    if unread > UNREAD {
        alarms.push(Alarm::Unread(unread));
    }
    let ancestors = reached.iter().map(|run| run.ancestors).min().unwrap_or(u32::MAX);
    if ancestors < ANCESTORS {
        alarms.push(Alarm::Ancestors(ancestors));
    }
    alarms
}

/// Plain trials, counted.
fn plain<S: System>(
    system: &S,
    name: &str,
    settings: &Settings,
    watch: &dyn Watch,
) -> Result<Odds, Halt<S::Error>> {
    // The first level of one run with as many states.
    let all = Settings { states: PLAIN, chain: PLAIN / 400, ..*settings };
    let compute = || {
        let (hits, mut failures) = crate::subset::plain(system, &all, RUNS, watch)?;
        Ok::<_, Halt<S::Error>>((hits, KeptTapes::of(&mut failures)))
    };
    let key = format!("{name}: plain trials of {all:?}");
    let (hits, failures) = kept(watch, &key, |_| u64::from(PLAIN), compute)?;
    let failures = failures.tapes(settings.seed).unwrap_or_default();
    let weight = 1.0 / failures.len().max(1) as f64;
    Ok(Odds {
        answer: Answer::Plain,
        probability: binomial_interval(hits, u64::from(PLAIN)),
        widened: false,
        trials: u64::from(PLAIN),
        plain: u64::from(PLAIN),
        levels: 1,
        runs: Vec::new(),
        alarms: vec![Alarm::Flat],
        remarks: Vec::new(),
        failures: failures.into_iter().map(|tape| (weight, tape)).collect(),
    })
}
