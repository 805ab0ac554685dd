//! Rare events of a qualification: subset simulation where plain trials do not decide.

use standstill_campaign::{Estimate, student_beyond};
use standstill_numeric::{exp, ln};
use standstill_scenario::FileError;

use super::{Case, Requirements, Verdict};
use crate::subset::{Effort, Settings};
use crate::{Alarm, Anatomy, Estimator, Event, Halt, Odds, RUNS, Sector, Trials, Watch};

/// Result of subset simulation for a claim, as `standstill odds` computes it. The interval of the probability is estimated from the scatter
/// between the runs. Unlike the intervals of plain trials, it has no guaranteed coverage.
#[derive(Clone, Debug, PartialEq)]
pub struct Rare {
    /// The event whose probability is limited.
    pub event: Event,
    /// Probability of the event, with the 95 % interval of `standstill odds`.
    pub probability: Estimate,
    /// Lower and upper end of the probability's interval at the claim's own probability of error, which may differ from the 5 % of
    /// `probability`.
    pub ends: [f64; 2],
    /// Number of trials.
    pub trials: u64,
    /// Warnings of the subset simulation. With any warning the verdict is [`Verdict::NotShown`].
    pub alarms: Vec<String>,
    /// Conditions that trigger the event. Each entry is a sector of rotor angles in which the event happens, with the random draws of the
    /// errors that lead to the event in this sector.
    pub triggers: Vec<Sector>,
    /// Verdict on the claim according to this probability.
    pub verdict: Verdict,
    /// Number of plain trials in which the event happened, and number of all plain trials. They count like the claim's own trials. None if
    /// the subset simulation reached the event, or if some trials could not be simulated.
    pub plain: Option<[u64; 2]>,
}

impl Rare {
    /// Judges a claim by the probability of its event from subset simulation (`odds`). `most` is the largest allowed probability, and
    /// `alpha` is the allowed probability of a wrong verdict. If the subset simulation has a warning, the verdict is [`Verdict::NotShown`].
    pub fn of(event: Event, odds: &Odds, most: f64, alpha: f64, triggers: Vec<Sector>) -> Self {
        let Estimate { value, low, high } = odds.probability;
        let freedom = match odds.estimator {
            Estimator::Mixture { effective, .. } => f64::from(effective) - 1.0,
            Estimator::Subset | Estimator::Plain => f64::from(RUNS - 1),
        };
        let wider = student_beyond(freedom, alpha) / student_beyond(freedom, 0.05);
        let end =
            |end: f64| if end > 0.0 && value > 0.0 { value * exp(wider * ln(end / value)) } else { end };
        let ends = [end(low), end(high).min(1.0)];
        let alarms: Vec<String> = odds.alarms.iter().map(ToString::to_string).collect();
        let verdict = match () {
            () if !alarms.is_empty() => Verdict::NotShown,
            () if ends[1] <= most => Verdict::Passed,
            () if ends[0] > most => Verdict::Failed,
            () => Verdict::NotShown,
        };
        // Every plain trial is counted, whatever the runs found, so the count is not biased by a selection.
        let gave_up = odds.alarms.iter().any(|alarm| matches!(alarm, Alarm::TooRare { .. }));
        let whole = !odds.alarms.iter().any(|alarm| matches!(alarm, Alarm::Errors(_)));
        let hits = odds.runs.iter().map(|run| u64::from(run.plain_hits)).sum();
        let plain = (gave_up && whole).then_some([hits, odds.plain]);
        let probability = odds.probability;
        Self { event, probability, ends, trials: odds.trials, alarms, triggers, verdict, plain }
    }
}

/// Observer that stores the results of each case under separate keys, so that cases do not read each other's results.
struct Within<'a> {
    watch: &'a dyn Watch,
    case: String,
}

impl Watch for Within<'_> {
    fn stopped(&self) -> bool {
        self.watch.stopped()
    }

    fn did(&self, trials: u64) {
        self.watch.did(trials);
    }

    fn came_to(&self, level: u32, probability: f64) {
        self.watch.came_to(level, probability);
    }

    fn recall(&self, key: &str) -> Option<Vec<u8>> {
        self.watch.recall(&format!("{}: {key}", self.case))
    }

    fn keep(&self, key: &str, bytes: &[u8]) {
        self.watch.keep(&format!("{}: {key}", self.case), bytes);
    }
}

/// Runs subset simulation for those claims of a case that plain trials left undecided. Claims about the same event share one simulation.
pub(super) fn decide(
    case: &mut Case,
    requirements: &Requirements,
    effort: Effort,
    watch: &dyn Watch,
    is_asked: &dyn Fn(usize) -> bool,
) -> Result<(), Halt<FileError>> {
    let mut known: Vec<(Event, Odds, Vec<Sector>)> = Vec::new();
    let watch = Within { watch, case: case.options().join(" ") };
    for number in 0..case.claims.len() {
        let claim = &case.claims[number];
        let event = requirements.list[claim.requirement].demand.event(case.rated);
        let open = claim.plain == Verdict::NotShown && claim.open.is_none() && !claim.guards;
        let Some(event) = event.filter(|_| open && is_asked(claim.requirement)) else { continue };
        let asked = known.iter().position(|(of, ..)| *of == event);
        let place = asked.unwrap_or(known.len());
        if asked.is_none() {
            let trials = Trials::new(&case.plan)?;
            let settings = Settings::of(effort, case.plan.file().seed);
            let odds = trials.odds(event, &settings, &watch, |_| {})?;
            let anatomy = Anatomy::of(&trials, event, &odds.failures, &watch)?;
            known.push((event, odds, anatomy.sectors));
        }
        let (_, odds, sectors) = &known[place];
        let (most, alpha) = (claim.limit(), claim.alpha);
        case.claims[number].rare = Some(Rare::of(event, odds, most, alpha, sectors.clone()));
    }
    Ok(())
}
