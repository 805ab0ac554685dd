//! Points taken together.

use super::{Coordinate, Interval, Study, StudyPoint};

/// What several points say together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pooled {
    /// Trials in all.
    pub trials: u64,
    /// Root mean square in degrees.
    ///
    /// The mean square is that of the points, each counting alike however many trials it has. Points share their random
    /// numbers, so their errors may go together: half widths are added, not their squares. The half width of a point is
    /// that from its estimate to its upper end, because the lower end stops at zero.
    pub rms_deg: Interval,
    /// 95th percentile in degrees. It does not follow from those of several points and is then unknown.
    pub p95_deg: Interval,
    /// Trials with the wrong pole.
    pub wrong_poles: u64,
    /// Trials with an axis but no pole.
    pub undetermined: u64,
    /// Trials without an angle.
    pub failed: u64,
    /// Probability of a wrong pole among all trials, with the interval of as many trials as a point has: points share their random
    /// numbers.
    pub wrong_pole: Interval,
    /// Probability of an axis without pole.
    pub undetermined_probability: Interval,
    /// Probability of no angle.
    pub failed_probability: Interval,
}

impl Pooled {
    /// Trials that named a pole.
    pub(super) fn named(&self) -> u64 {
        self.trials.saturating_sub(self.undetermined + self.failed)
    }
}

/// Takes points together; no points give no trials and unknown values.
pub fn pool(study: &Study, points: &[&StudyPoint]) -> Pooled {
    let sum = |count: fn(&StudyPoint) -> u64| points.iter().map(|point| count(point)).sum::<u64>();
    let trials = sum(|point| point.trials);
    let (wrong_poles, undetermined, failed) =
        (sum(|p| p.wrong_poles), sum(|p| p.undetermined), sum(|p| p.failed));
    let of = |count| match (trials, points.len()) {
        (0, _) => Interval::UNKNOWN,
        (_, many) => (study.binomial)(count, trials, many as u64),
    };
    let with_axes: Vec<&&StudyPoint> = points.iter().filter(|point| point.axes > 0).collect();
    Pooled {
        trials,
        rms_deg: rms(&with_axes),
        p95_deg: if let [one] = with_axes[..] { one.p95_deg } else { Interval::UNKNOWN },
        wrong_poles,
        undetermined,
        failed,
        wrong_pole: of(wrong_poles),
        undetermined_probability: of(undetermined),
        failed_probability: of(failed),
    }
}

fn rms(points: &[&&StudyPoint]) -> Interval {
    if let [one] = points {
        return one.rms_deg;
    }
    let (mut square, mut half) = (0.0, 0.0);
    for point in points {
        let share = 1.0 / points.len() as f64;
        let own = point.rms_deg.value.powi(2);
        square += share * own;
        half += share * (point.rms_deg.high.powi(2) - own);
    }
    if points.is_empty() {
        return Interval::UNKNOWN;
    }
    // `max` would make a number of what is none.
    let low = if half.is_nan() { half } else { (square - half).max(0.0).sqrt() };
    Interval { value: square.sqrt(), low, high: (square + half).sqrt() }
}

/// The distinct values on an axis: numbers by size, then names in the order of their first appearance.
pub(super) fn values(study: &Study, axis: usize) -> Vec<Coordinate> {
    let mut numbers: Vec<f64> = Vec::new();
    let mut names: Vec<&String> = Vec::new();
    for point in &study.points {
        match point.coordinates.get(axis) {
            Some(Coordinate::Number(number)) if number.is_finite() => numbers.push(*number),
            Some(Coordinate::Name(name)) if !names.contains(&name) => names.push(name),
            _ => (),
        }
    }
    numbers.sort_by(f64::total_cmp);
    numbers.dedup();
    let names = names.into_iter().map(|name| Coordinate::Name(name.clone()));
    numbers.into_iter().map(Coordinate::Number).chain(names).collect()
}

/// The points with these values.
pub(super) fn at<'a>(study: &'a Study, wanted: &[(usize, &Coordinate)]) -> Vec<&'a StudyPoint> {
    let matches =
        |point: &&StudyPoint| wanted.iter().all(|(axis, value)| point.coordinates.get(*axis) == Some(value));
    study.points.iter().filter(matches).collect()
}
