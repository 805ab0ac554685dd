//! Starts under one set of conditions, and their results.

use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;

use standstill_campaign::{Campaign, CampaignError, Statistics, Summary};
use standstill_detect::{Method, PolarityRule};
use standstill_numeric::whole;
use standstill_scenario::{Record, Rotor, Scenario, Verdict};

use super::work::{Allowance, of_start};
use super::{Demands, SuitabilityError};
use crate::event::evidence;

/// Results of starts with the rotor in one state.
#[derive(Clone, Debug)]
pub(super) struct Starts {
    pub rotor: Rotor,
    pub summary: Summary,
    /// Reasons of failed starts, with the number of starts for each reason. Starts with an undetermined pole are not
    /// included.
    pub failures: BTreeMap<String, u64>,
    /// Number of starts that end because the rotor turns or moves.
    pub turning: u64,
    /// Signed errors in degrees of each start with an axis: of its angle (none without an angle), and of its axis. The error of a sector
    /// counts from the sector's border.
    misses: Vec<(Option<f64>, f64)>,
    /// Time of the longest detection in s.
    pub longest_s: f64,
    /// Pole evidence of each start with an axis, sorted, relative to the evidence that a decision needs; positive for
    /// the true pole. A start with 1 or more finds the right pole, a start with −1 or less the wrong one.
    pub evidence: Vec<f64>,
    /// Distribution of the evidence over starts.
    pub spread: Spread,
    /// Work done for these starts.
    pub work: u64,
}

/// Reason why starts were not run to their end.
pub(super) enum Stopped {
    /// No work is left.
    Spent,
    /// The trials could not be run.
    Failed(SuitabilityError),
}

impl From<CampaignError> for Stopped {
    fn from(error: CampaignError) -> Self {
        Self::Failed(error.into())
    }
}

/// Distribution of a method's pole evidence over starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Spread {
    /// Approximately normal: only the errors of drive and sensors change the evidence from start to start.
    Normal,
    /// The evidence depends on the rotor angle more than on errors, and its lower tail is short. This holds for methods
    /// with six directions and for floating terminals, which respond more to a pole nearer to one of their directions.
    OverAngles,
    /// The method continues until its evidence suffices, so that the evidence is just enough for any motor.
    JustEnough,
}

impl Spread {
    /// Returns the distribution of a method's pole evidence.
    pub fn of(mut method: Method<f64>) -> Self {
        let sequential =
            method.polarity_mut().is_some_and(|of| matches!(of.rule, PolarityRule::Sequential(_)));
        match method {
            _ if sequential || method.is_adaptive() => Self::JustEnough,
            Method::OpenTerminal(_) | Method::SixPulse(_) => Self::OverAngles,
            _ => Self::Normal,
        }
    }

    /// Returns true if the distribution in few starts does not show how rare wrong poles are, so that wrong poles must be counted in many
    /// starts.
    pub fn is_counted(self) -> bool {
        self != Self::Normal
    }
}

impl Starts {
    /// Runs this number of starts of a scenario; stops if no work is left.
    pub fn of(
        scenario: &Scenario<Method<f64>>,
        rotor: Rotor,
        trials: u64,
        allowance: &Allowance,
    ) -> Result<Self, Stopped> {
        let (mut statistics, before) = (Statistics::default(), allowance.done());
        let (mut failures, mut evidence, mut longest_s) = (BTreeMap::new(), Vec::new(), 0.0_f64);
        let (mut turning, mut misses) = (0, Vec::new());
        let campaign = Campaign { scenario, trials, threads: None };
        campaign.run(&AtomicBool::new(false), |record| {
            statistics.add(record);
            longest_s = longest_s.max(record.run.duration.seconds());
            if let (Verdict::Failed | Verdict::Error, Some(reason)) = (record.verdict(), record.reason_name())
            {
                *failures.entry(reason).or_insert(0) += 1;
            }
            evidence.extend(towards_north(record));
            turning += u64::from(record.rotor_turns());
            misses.extend(record.axis_miss_deg().map(|axis| (record.miss_deg(), axis)));
            if allowance.spend(of_start(&record.run.work, &scenario.drive.bridge)) {
                Ok(())
            } else {
                Err(Stopped::Spent)
            }
        })?;
        evidence.sort_by(f64::total_cmp);
        let spread = Spread::of(scenario.detector);
        let work = allowance.done() - before;
        Ok(Self {
            rotor,
            summary: statistics.summary(),
            failures,
            turning,
            misses,
            longest_s,
            evidence,
            spread,
            work,
        })
    }

    /// Returns the number of starts without an angle: given up, or not simulated to the end.
    pub fn failed(&self) -> u64 {
        self.summary.failed + self.summary.errors
    }

    /// Returns a number of starts as a share of all starts.
    pub fn share(&self, starts: u64) -> f64 {
        starts as f64 / self.summary.trials as f64
    }

    /// Returns the number of starts with an answer whose error exceeds `most_deg` degrees. If poles are not judged (`has_pole` is false),
    /// an axis alone is an answer.
    pub fn wrong(&self, most_deg: f64, has_pole: bool) -> u64 {
        let misses =
            self.misses.iter().filter_map(|(angle, axis)| if has_pole { *angle } else { Some(*axis) });
        misses.filter(|miss| miss.abs() > most_deg).count() as u64
    }

    /// Lists the reasons of failed starts in words, the most frequent first, with their counts.
    fn failures_in_words(&self) -> String {
        let mut reasons: Vec<(&String, &u64)> = self.failures.iter().collect();
        reasons.sort_by_key(|(_, count)| std::cmp::Reverse(**count));
        if let [(reason, _)] = reasons[..] {
            return reason.clone();
        }
        let counted: Vec<String> =
            reasons.iter().map(|(reason, count)| format!("{reason} in {count}")).collect();
        counted.join(", ")
    }

    /// Returns the first percentile of the pole evidence, relative to the evidence that a decision needs. From few starts it is estimated
    /// by mean and standard deviation. If the evidence depends on the angle, it is estimated from the lower tail as `q5 − 0.70 (q25 − q5)`,
    /// the first percentile of a normal distribution with this 5th and 25th percentile. This estimate is at most as far below the lowest
    /// start as the lowest start is below the 5th percentile.
    pub fn least_evidence(&self) -> f64 {
        let n = self.evidence.len() as f64;
        if n < 2.0 {
            return 0.0;
        }
        match self.spread {
            Spread::JustEnough => {
                let undetermined = self.summary.undetermined as f64 / self.summary.trials as f64;
                if undetermined == 0.0 { COMFORTABLE } else { 1.0 - undetermined }
            }
            Spread::OverAngles => {
                let [lowest, q5, q25] = [0.0, 0.05, 0.25].map(|share| self.quantile(share));
                // The evidence has a lower bound over the angles, which a normal distribution does not have.
                (q5 - 0.70 * (q25 - q5)).max(lowest - (q5 - lowest))
            }
            Spread::Normal => {
                let (mean, deviation) = self.moments();
                mean - 2.326 * deviation * (1.0 + 1.0 / n.sqrt())
            }
        }
    }

    /// Returns a quantile of the evidence, interpolated between two starts. There must be at least one start.
    fn quantile(&self, share: f64) -> f64 {
        let place = share * (self.evidence.len() - 1) as f64;
        let below: usize = whole(place);
        let [low, high] = [below, self.evidence.len().min(below + 2) - 1].map(|k| self.evidence[k]);
        low + (high - low) * (place - below as f64)
    }

    /// Returns mean and standard deviation of the evidence. The deviation is at least that of the starts below the mean.
    fn moments(&self) -> (f64, f64) {
        let n = self.evidence.len() as f64;
        let mean = self.evidence.iter().sum::<f64>() / n;
        let square = |value: &f64| (value - mean) * (value - mean);
        let all = self.evidence.iter().map(square).sum::<f64>() / (n - 1.0);
        let below: Vec<f64> = self.evidence.iter().filter(|value| **value < mean).map(square).collect();
        let lower = below.iter().sum::<f64>() / (below.len() as f64).max(1.0);
        (mean, all.max(lower).sqrt())
    }

    /// Returns an upper bound of the share of wrong poles. It is found by counting, or, if the evidence is normally
    /// distributed, from the number of standard deviations between its mean and a wrong pole. Mean and deviation are
    /// taken at their 95 % bounds. The deviation is widened if the lowest start contradicts a normal tail.
    pub fn wrong_poles_at_most(&self) -> f64 {
        let counted =
            standstill_campaign::binomial_interval(self.summary.wrong_poles, self.summary.trials).high;
        let n = self.evidence.len() as f64;
        if self.spread.is_counted() || self.summary.wrong_poles > 0 || n < 100.0 {
            return counted;
        }
        let (mean, deviation) = self.moments();
        let lowest = self.evidence.first().copied().unwrap_or(0.0);
        // The least of n normal numbers is about √(2 ln n) deviations below the mean; two more are allowed.
        let expected = (2.0 * standstill_numeric::ln(n)).sqrt() + 2.0;
        let deviation = deviation.max((mean - lowest) / expected);
        let mean = mean - 1.645 * deviation / n.sqrt();
        let away = (mean + 1.0) / (deviation * (1.0 + 1.645 / (2.0 * n).sqrt()));
        if away <= 1.0 {
            return counted;
        }
        // An upper bound of the normal distribution's tail.
        let tail = standstill_numeric::exp(-0.5 * away * away) / (away * std::f64::consts::TAU.sqrt());
        tail.min(counted)
    }

    /// Returns the demands that these starts do not meet, each with its figures.
    fn objections(&self, demands: &Demands, most_current: f64, has_pole: bool) -> Vec<Objection> {
        let mut objections = Vec::new();
        let mut object = |about: &'static str, excess: f64, before: String, after: String| {
            objections.push(Objection { about, excess, before, rotor: self.rotor, after });
        };
        let summary = &self.summary;
        let all = summary.trials as f64;
        let [failed, undetermined] = [self.failed(), summary.undetermined];
        let is_answered = failed as f64 <= demands.without_angle * all;
        if !is_answered {
            let why = format!(": {}", self.failures_in_words());
            object("answers", failed as f64, format!("{failed} of {all} without an angle"), why);
        }
        // If many starts have no axis, the error of the others shows nothing.
        if is_answered && summary.p95_deg.value > demands.error_deg {
            let beyond = if summary.sectors.is_some() { " beyond their sectors" } else { "" };
            let p95 = summary.p95_deg;
            let before = format!("95 of 100 errors within {}°{beyond}", p95.alone());
            object("error", p95.value, before, format!(", where {}° are demanded", demands.error_deg));
        }
        if has_pole && summary.wrong_poles > 0 {
            let wrong = summary.wrong_poles;
            object("wrong poles", wrong as f64, format!("{wrong} wrong poles in {all}"), String::new());
        }
        if has_pole && undetermined as f64 > demands.without_angle * all {
            let before = format!("pole undetermined in {undetermined} of {all}");
            object("undetermined", undetermined as f64, before, String::new());
        }
        if self.rotor == Rotor::Free && summary.max_moved_deg > demands.movement_deg {
            let before = format!("a free rotor moves by {:.2}°", summary.max_moved_deg);
            let after = format!(" where {}° are allowed", demands.movement_deg);
            object(MOVEMENT, summary.max_moved_deg, before, after);
        }
        let limited = |value: f64, most: f64, digits: usize, unit: &str| {
            let text = |value: f64| standstill_quantity::number(digits, value);
            (format!("{} {unit}", text(value)), format!(", where {} {unit} are allowed", text(most)))
        };
        if summary.peak_current_a > most_current {
            let (before, after) = limited(summary.peak_current_a, most_current, 2, "A");
            object("current", summary.peak_current_a, before, after);
        }
        if self.longest_s > demands.time_s {
            let (before, after) = limited(self.longest_s * 1e3, demands.time_s * 1e3, 0, "ms");
            object("time", self.longest_s, before, after);
        }
        objections
    }
}

/// Subject of an objection that applies only to a free rotor.
const MOVEMENT: &str = "movement";

/// A demand that starts do not meet.
struct Objection {
    /// Subject of the objection.
    about: &'static str,
    /// The value that misses the demand, by which objections with the same subject are compared.
    excess: f64,
    /// Text before the state of the rotor; `after` has the text after it.
    before: String,
    rotor: Rotor,
    after: String,
}

/// Returns the demands that starts in several states of the rotor do not meet, in words. A demand that is missed in several states has the
/// figures of the worst one.
pub(super) fn objections(
    starts: &[&Starts],
    demands: &Demands,
    most_current: f64,
    has_pole: bool,
) -> Vec<String> {
    let mut all: Vec<(Objection, String)> = Vec::new();
    for objection in starts.iter().flat_map(|of| of.objections(demands, most_current, has_pole)) {
        match all
            .iter_mut()
            .find(|(other, _)| other.about == objection.about && other.rotor != objection.rotor)
        {
            Some((worst, too)) => {
                let less = if objection.excess > worst.excess {
                    std::mem::replace(worst, objection)
                } else {
                    objection
                };
                *too = format!(" ({} too)", less.rotor.name());
            }
            None => all.push((objection, String::new())),
        }
    }
    let text = |(objection, too): (Objection, String)| {
        let Objection { about, before, rotor, after, .. } = objection;
        let rotor = if about == MOVEMENT { String::new() } else { format!(", rotor {}", rotor.name()) };
        format!("{before}{rotor}{too}{after}")
    };
    all.into_iter().map(text).collect()
}

/// Evidence, reached by 99 of 100 starts, above which more evidence gains nothing: 1.3 times what a decision needs.
pub(super) const COMFORTABLE: f64 = 1.3;

/// Returns the pole evidence of a start with an axis, relative to the evidence that a decision needs; positive for the
/// true pole, zero if no evidence would suffice.
fn towards_north(record: &Record) -> Option<f64> {
    let standstill_sim::Ended::Outcome(outcome) = record.run.ended else { return None };
    record.axis_deg()?;
    let (wrong, needed) = evidence(&outcome, record.run.end_angle)?;
    let share = -wrong / needed;
    // More than a hundred times the needed evidence counts as a hundred times.
    Some(if share.is_nan() { 0.0 } else { share.clamp(-100.0, 100.0) })
}
