//! Starts under one set of conditions, and their results.

use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;

use standstill_campaign::{Campaign, CampaignError, Statistics, Summary, quantile_ranks};
use standstill_detect::{Method, PolarityRule};
use standstill_numeric::whole;
use standstill_scenario::{Record, Rotor, Scenario, Verdict};

use super::work::{Allowance, of_start};
use super::{Demands, SuitabilityError};
use crate::event::evidence;

/// Results of simulated motor starts with the rotor in one state.
#[derive(Clone, Debug)]
pub(super) struct Starts {
    pub rotor: Rotor,
    pub summary: Summary,
    /// Reasons why starts ended without an angle, with the number of starts for each reason. Starts that found the axis but not the pole
    /// are not included.
    pub failures: BTreeMap<String, u64>,
    /// Number of starts that ended because the method noticed that the rotor turns or moves.
    pub turning: u64,
    /// Errors in degrees, with sign, of each start with an axis: the error of the angle (none if the pole stayed open) and the error of
    /// the axis. If the method names a sector, errors are measured from its border.
    misses: Vec<(Option<f64>, f64)>,
    /// Magnitudes in degrees of the axis errors at the instants for which the angles hold, of the starts that state them.
    at_instant: Vec<f64>,
    /// Time of the longest detection in s.
    pub longest_s: f64,
    /// Pole evidence of each start with an axis, in units of the evidence that a decision needs, in ascending order. It is positive for the
    /// true pole. A start with 1 or more finds the true pole, and a start with −1 or less the wrong one.
    pub evidence: Vec<f64>,
    /// Distribution of the pole evidence over the starts.
    pub spread: Spread,
    /// Work of these starts.
    pub work: u64,
}

/// Reason why not all starts were run.
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
    /// The evidence depends on the rotor angle more than on the errors, and its distribution ends shortly below the mean. This is so for
    /// methods with six directions and for methods with floating terminals, because they respond more to a pole that is nearer to one of
    /// their directions.
    OverAngles,
    /// The method continues until its evidence suffices. The evidence is then just enough, whatever the motor.
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

    /// Returns true if the evidence of few starts does not show how rare wrong poles are. Wrong poles must then be counted in many starts.
    pub fn is_counted(self) -> bool {
        self != Self::Normal
    }
}

impl Starts {
    /// Runs `trials` starts of a scenario. Ends with an error if the allowed work is used up.
    pub fn of(
        scenario: &Scenario<Method<f64>>,
        rotor: Rotor,
        trials: u64,
        allowance: &Allowance,
    ) -> Result<Self, Stopped> {
        let (mut statistics, before) = (Statistics::default(), allowance.done());
        let (mut failures, mut evidence, mut longest_s) = (BTreeMap::new(), Vec::new(), 0.0_f64);
        let (mut turning, mut misses, mut at_instant) = (0, Vec::new(), Vec::new());
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
            at_instant.extend(record.axis_miss_at_instant_deg().map(f64::abs));
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
            at_instant,
            longest_s,
            evidence,
            spread,
            work,
        })
    }

    /// Returns the number of starts without an angle. The method gave up in these starts, or the simulation could not continue.
    pub fn failed(&self) -> u64 {
        self.summary.failed + self.summary.errors
    }

    /// Returns the number `starts` as a share of all starts.
    pub fn share(&self, starts: u64) -> f64 {
        starts as f64 / self.summary.trials as f64
    }

    /// Returns the number of starts with an answer whose error exceeds `most_deg` degrees. If `has_pole` is false, poles are not judged,
    /// and an axis counts as an answer.
    pub fn wrong(&self, most_deg: f64, has_pole: bool) -> u64 {
        let misses =
            self.misses.iter().filter_map(|(angle, axis)| if has_pole { *angle } else { Some(*axis) });
        misses.filter(|miss| miss.abs() > most_deg).count() as u64
    }

    /// Returns the 95th percentile in degrees of the axis errors at the instants for which the angles hold. None if no start states one.
    pub fn p95_at_instant_deg(&self) -> Option<f64> {
        if self.at_instant.is_empty() {
            return None;
        }
        let mut errors = self.at_instant.clone();
        errors.sort_by(f64::total_cmp);
        let [rank, ..] = quantile_ranks(0.95, errors.len() as u64);
        errors.get(usize::try_from(rank?).ok()?).copied()
    }

    /// Lists the reasons why starts ended without an angle, with the number of starts for each reason, the most frequent first.
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

    /// Returns the first percentile of the pole evidence, in units of the evidence that a decision needs. If the evidence is normally
    /// distributed, it is computed from mean and standard deviation. If the evidence depends on the angle, it is `q5 − 0.70 (q25 − q5)`,
    /// with the 5th and the 25th percentile: the first percentile of a normal distribution that has these two. This value is then at most
    /// as far below the lowest start as the lowest start is below the 5th percentile.
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

    /// Returns the quantile `share` of the evidence, interpolated between two starts. There must be at least one start with an axis.
    fn quantile(&self, share: f64) -> f64 {
        let place = share * (self.evidence.len() - 1) as f64;
        let below: usize = whole(place);
        let [low, high] = [below, self.evidence.len().min(below + 2) - 1].map(|k| self.evidence[k]);
        low + (high - low) * (place - below as f64)
    }

    /// Returns mean and standard deviation of the evidence. If the starts below the mean deviate more from it than all starts, their
    /// deviation is returned.
    fn moments(&self) -> (f64, f64) {
        let n = self.evidence.len() as f64;
        let mean = self.evidence.iter().sum::<f64>() / n;
        let square = |value: &f64| (value - mean) * (value - mean);
        let all = self.evidence.iter().map(square).sum::<f64>() / (n - 1.0);
        let below: Vec<f64> = self.evidence.iter().filter(|value| **value < mean).map(square).collect();
        let lower = below.iter().sum::<f64>() / (below.len() as f64).max(1.0);
        (mean, all.max(lower).sqrt())
    }

    /// Returns an upper bound of the share of wrong poles. If the evidence is normally distributed, the bound is the probability that it is
    /// −1 or less, with mean and standard deviation at their 95 % bounds. The deviation is enlarged if the lowest start contradicts a
    /// normal distribution. If the evidence is not normally distributed, the bound follows from the number of wrong poles.
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

    /// Returns the demands that these starts do not meet, with the values that miss them.
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

/// Subject of the objection to the movement, which applies only to a free rotor.
const MOVEMENT: &str = "movement";

/// Description of a demand that starts do not meet.
struct Objection {
    /// Subject of the objection.
    about: &'static str,
    /// The value that misses the demand. Objections with the same subject are compared by it; the largest value is the worst.
    excess: f64,
    /// Text before the name of the rotor's state. The text after the name is `after`.
    before: String,
    rotor: Rotor,
    after: String,
}

/// Returns descriptions of the demands that starts in several states of the rotor do not meet. If a demand is missed in several states, the
/// description has the values of the worst state.
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

/// Pole evidence of 99 of 100 starts that is ample, in units of the evidence that a decision needs. More evidence gains nothing.
pub(super) const COMFORTABLE: f64 = 1.3;

/// Returns the pole evidence of a start, in units of the evidence that a decision needs. It is positive for the true pole, and zero if no
/// evidence would suffice. None if the start has no axis.
fn towards_north(record: &Record) -> Option<f64> {
    let standstill_sim::Ended::Outcome(outcome) = record.run.ended else { return None };
    record.axis_deg()?;
    let (wrong, needed) = evidence(&outcome, record.run.end_angle)?;
    let share = -wrong / needed;
    // More than a hundred times the needed evidence counts as a hundred times.
    Some(if share.is_nan() { 0.0 } else { share.clamp(-100.0, 100.0) })
}
