//! Many detections: points that are sent while the page is open, together with statistics.
//!
//! A frame has a length (u32), a kind (u32) and this number of bytes. Kind 0 has statistics in JSON, kind 1 points of
//! 16 bytes each: trial (u32), true angle and axis error in degrees (f32, NaN without an axis), flags (u32: verdict in
//! two bits, then a bit for a wrong pole). All numbers are little-endian.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use serde::Deserialize;
use serde_json::json;
use standstill_campaign::store::{Row, SweepError};
use standstill_campaign::{Apart, Glance, Statistics, binomial_interval, paired_difference, paired_rms};
use standstill_quantity::Quantity;
use standstill_scenario::{Record, Verdict};

use crate::bench::{Bench, Ready, lock};
use crate::error::LabError;
use crate::in_words::{change, in_words};
use crate::setting::Setting;

/// The first trials of a scenario.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CloudRequest {
    /// The scenario.
    pub setting: Setting,
    /// Number of trials.
    pub trials: u64,
    /// Name of one of the page's clouds; a new cloud replaces the previous one of the same name.
    pub slot: String,
}

/// Two scenarios with finished clouds, which are compared trial by trial: both have the same random numbers.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pair {
    /// First scenario.
    pub a: Setting,
    /// The other.
    pub b: Setting,
}

/// Results of a trial that comparisons need.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Kept {
    axis_error: Option<f64>,
    wrong: bool,
    /// Whether it named an angle with its pole.
    answered: bool,
}

/// Clouds that are kept to be compared.
const KEPT: usize = 8;

/// Largest number of trials of a cloud; for more, there is `standstill run`.
const MOST: u64 = 1_000_000;

/// Interval at which statistics are sent.
const OFTEN: Duration = Duration::from_millis(120);

/// The last clouds, by the names of their settings.
pub(crate) type Clouds = Vec<(String, Arc<Vec<Kept>>)>;

/// A cloud that is being filled.
pub struct Filling {
    ready: Arc<Ready>,
    name: String,
    trials: u64,
    statistics: Statistics,
    kept: Vec<Kept>,
}

/// Trials of a step of [`Filling::step`].
const STEP: u64 = 256;

impl Filling {
    /// Prepares a cloud without trials yet.
    ///
    /// # Errors
    /// A scenario that cannot be run, and a number of trials that no page asks for.
    pub fn new(bench: &Bench, request: &CloudRequest) -> Result<Self, LabError> {
        if !(1..=MOST).contains(&request.trials) {
            return Err(LabError::request(format!("{} trials; needed: 1 to {MOST}", request.trials)));
        }
        let ready = bench.ready(&request.setting)?;
        let limit = ready.plan.file().limit.map_or(Statistics::LIMIT_DEG, Quantity::value);
        Ok(Self {
            ready,
            name: request.setting.name(),
            trials: request.trials,
            statistics: Statistics::with_limit(limit),
            kept: Vec::new(),
        })
    }

    /// Takes the next records; their points as a frame.
    fn add(&mut self, records: &[Record]) -> Vec<u8> {
        for record in records {
            self.statistics.add_row(&Row::from(record));
            let wrong = record.pole_correct() == Some(false);
            let answered = record.verdict() == Verdict::Found;
            self.kept.push(Kept { axis_error: record.axis_error_deg(), wrong, answered });
        }
        points(records)
    }

    fn is_done(&self) -> bool {
        self.kept.len() as u64 >= self.trials
    }

    /// Returns the statistics of the trials so far as a frame.
    fn summary(&self) -> Vec<u8> {
        let summary = self.statistics.summary();
        let text = json!({ "in_words": in_words(&summary), "summary": summary, "all": self.trials });
        frame(0, text.to_string().as_bytes())
    }

    /// Returns the next trials in this thread; their frames, and none once all are there.
    ///
    /// # Errors
    /// A trial that cannot be run.
    pub fn step(&mut self, bench: &Bench) -> Result<Option<Vec<u8>>, LabError> {
        let next = self.kept.len() as u64;
        if self.is_done() {
            return Ok(None);
        }
        let ready = Arc::clone(&self.ready);
        let mut records = Vec::new();
        let mut trials = next..self.trials.min(next + STEP);
        let run =
            ready.plan.trials(ready.point, &ready.scenario, &mut trials, &mut |record| records.push(record));
        run.map_err(|of| LabError::from(of.error))?;
        records.sort_unstable_by_key(|record| record.trial);
        let mut frames = self.add(&records);
        if next.is_multiple_of(8 * STEP) || self.is_done() {
            frames.extend(self.summary());
        }
        if self.is_done() {
            self.keep(bench);
        }
        Ok(Some(frames))
    }

    /// Remembers it, so that it can be compared.
    fn keep(&mut self, bench: &Bench) {
        let mut clouds = lock(&bench.clouds);
        clouds.retain(|(known, _)| *known != self.name);
        if clouds.len() >= KEPT {
            clouds.remove(0);
        }
        clouds.push((self.name.clone(), Arc::new(self.kept.clone())));
    }
}

/// Returns all of it, on all cores.
pub(crate) fn run(
    bench: &Bench,
    request: &CloudRequest,
    stop: &AtomicBool,
    sink: &mut dyn FnMut(&[u8]) -> bool,
) -> Result<(), LabError> {
    let mut filling = Filling::new(bench, request)?;
    let ready = Arc::clone(&filling.ready);
    let glance = Glance { plan: &ready.plan, point: ready.point, trials: 0..request.trials, threads: None };
    let mut sent = None;
    let done = glance.run(stop, |records| {
        let mut frames = filling.add(records);
        if sent.is_none_or(|at: Instant| at.elapsed() >= OFTEN) || filling.is_done() {
            sent = Some(Instant::now());
            frames.extend(filling.summary());
        }
        sink(&frames)
    });
    let done = done.map_err(|error| match error {
        SweepError::File(error) => error.into(),
        error => LabError::of(error),
    })?;
    if done {
        filling.keep(bench);
    }
    Ok(())
}

fn frame(kind: u32, bytes: &[u8]) -> Vec<u8> {
    let length = u32::try_from(bytes.len()).unwrap_or(0);
    [&length.to_le_bytes(), &kind.to_le_bytes(), bytes].concat()
}

/// Encodes the points in single precision: a picture needs no more than seven digits.
#[expect(clippy::cast_possible_truncation, reason = "what is drawn; trials are below a million")]
fn points(records: &[Record]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(16 * records.len());
    for record in records {
        let verdict = record.verdict() as u32;
        let wrong = u32::from(record.pole_correct() == Some(false));
        bytes.extend((record.trial as u32).to_le_bytes());
        bytes.extend((record.true_angle_deg() as f32).to_le_bytes());
        bytes.extend(record.axis_error_deg().map_or(f32::NAN, |error| error as f32).to_le_bytes());
        bytes.extend((verdict | (wrong << 2)).to_le_bytes());
    }
    frame(1, &bytes)
}

/// Returns the differences of B from A, with their intervals.
pub(crate) fn pair(bench: &Bench, request: &Pair) -> serde_json::Value {
    let find = |setting: &Setting| {
        let clouds = lock(&bench.clouds);
        clouds.iter().find(|(known, _)| *known == setting.name()).map(|(_, kept)| Arc::clone(kept))
    };
    let (Some(a), Some(b)) = (find(&request.a), find(&request.b)) else {
        return json!({ "trials": 0 });
    };
    compared(&a, &b)
}

fn compared(a: &[Kept], b: &[Kept]) -> serde_json::Value {
    let trials = a.len().min(b.len());
    let pairs = || a.iter().zip(b);
    let axes: Vec<(f64, f64)> = pairs().filter_map(|(a, b)| Some((a.axis_error?, b.axis_error?))).collect();
    let only = |of: fn(&Kept) -> bool, not: fn(&Kept) -> bool| {
        [pairs().filter(|(a, b)| of(a) && not(b)).count(), pairs().filter(|(a, b)| of(b) && not(a)).count()]
    };
    let wrong = only(|kept| kept.wrong, |kept| !kept.wrong);
    let lost = only(|kept| kept.axis_error.is_none(), |kept| kept.axis_error.is_some());
    // Of those in which they differ, how many are B's: one half if there is no difference.
    let share = binomial_interval(wrong[1] as u64, (wrong[0] + wrong[1]) as u64);
    let counts = BTreeMap::from([("a", wrong[0]), ("b", wrong[1])]);
    let unanswered = only(|kept| !kept.answered, |kept| kept.answered);
    let rms = paired_rms(&axes);
    let more = |counts: [usize; 2]| paired_difference(counts.map(|count| count as u64), trials as u64);
    let apart = Apart { wrong: more(wrong), unanswered: more(unanswered), error: rms };
    json!({ "trials": trials, "axes": axes.len(), "rms": rms, "in_words": change(rms), "wrong": counts, "share": share,
        "without_axis": BTreeMap::from([("a", lost[0]), ("b", lost[1])]), "verdict": apart.in_words() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(errors: &[f64]) -> Vec<Kept> {
        errors.iter().map(|error| Kept { axis_error: Some(*error), wrong: false, answered: true }).collect()
    }

    #[test]
    fn analytic_what_is_the_same_in_both_tells_nothing_and_what_differs_is_known_well() {
        let errors: Vec<f64> = (0..2000).map(|k| (f64::from(k) * 0.7).sin()).collect();
        let same = compared(&kept(&errors), &kept(&errors));
        assert_eq!((same["rms"]["value"].as_f64(), same["rms"]["high"].as_f64()), (Some(0.0), Some(0.0)));
        // All errors 1 % larger: so is their rms, √½, and by how much is known a hundred times better than the rms itself.
        let larger: Vec<f64> = errors.iter().map(|error| 1.01 * error).collect();
        let rms = &compared(&kept(&errors), &kept(&larger))["rms"];
        let [value, low, high] = ["value", "low", "high"].map(|name| rms[name].as_f64().expect("a number"));
        assert!((value - 0.01 * 0.5_f64.sqrt()).abs() < 1e-5, "{value}");
        assert!(low > 0.0 && high - value < 2e-4, "{low} {high}");
    }

    #[test]
    fn law_intervals_of_a_difference_cover_it_as_often_as_they_say() {
        // Errors of A and B share a part, as common random numbers make them; Marsaglia's xorshift draws them.
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        let mut uniform = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut normal = || (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
        let truth = 1.25_f64.sqrt() - 1.04_f64.sqrt();
        let covered = (0..2000).filter(|_| {
            let axes: Vec<(f64, f64)> = (0..200)
                .map(|_| {
                    let common = normal();
                    (common + 0.2 * normal(), common + 0.5 * normal())
                })
                .collect();
            let found = paired_rms(&axes);
            found.low <= truth && truth <= found.high
        });
        let covered = covered.count() as f64 / 20.0;
        assert!((93.0..97.0).contains(&covered), "{covered}");
    }

    #[test]
    fn analytic_wrong_poles_are_compared_pair_by_pair() {
        let mut a = kept(&[0.1; 10]);
        let mut b = a.clone();
        (a[0].wrong, b[0].wrong, b[1].wrong, b[2].wrong) = (true, true, true, true);
        b[3].axis_error = None;
        let compared = compared(&a, &b);
        assert_eq!((compared["wrong"]["a"].as_u64(), compared["wrong"]["b"].as_u64()), (Some(0), Some(2)));
        assert_eq!(compared["verdict"], "no difference shown");
        assert_eq!((compared["without_axis"]["b"].as_u64(), compared["axes"].as_u64()), (Some(1), Some(9)));
    }

    #[test]
    fn regress_what_leaves_starts_without_a_pole_is_not_better_for_being_exact() {
        let errors: Vec<f64> = (0..300).map(|k| (f64::from(k) * 0.7).sin()).collect();
        let a = kept(&errors);
        let mut b = kept(&errors.iter().map(|error| 0.5 * error).collect::<Vec<_>>());
        assert_eq!(compared(&a, &b)["verdict"], "B is better: it is more exact");
        b.iter_mut().step_by(3).for_each(|kept| kept.answered = false);
        assert_eq!(compared(&a, &b)["verdict"], "B answers less, is more exact where both find the axis");
    }
}
