//! The order of a run's rows: point by point, trial by trial.

use standstill_quantity::Quantity;

use super::identity::Identity;
use super::row::Row;
use crate::Statistics;
use standstill_scenario::StopTable;

/// Trials of a point before its intervals are looked at.
const FIRST_LOOK: u64 = 100;

/// Progress of a run. It depends only on the rows so far, whether they were just computed or read from a journal, so a
/// run that was interrupted continues as it would have done.
#[derive(Clone, Debug)]
pub struct Walk {
    trials: u64,
    stop_at: StopTable,
    /// Point and trial of the next row.
    next: (u64, u64),
    /// Point and trial of the first row beyond its share of the run.
    end: (u64, u64),
    /// Statistics of the point's rows so far, where the point may end early.
    statistics: Statistics,
}

impl Walk {
    /// Makes the progress at the beginning of a run, or of a shard of it.
    pub fn new(identity: &Identity) -> Self {
        let Identity { points, trials, stop_at, shard, .. } = identity;
        let range = if stop_at.is_empty() { shard.range(identity.rows()) } else { shard.range(*points) };
        let place = |number: u64| {
            if stop_at.is_empty() { (number / trials, number % trials) } else { (number, 0) }
        };
        Self {
            trials: *trials,
            stop_at: *stop_at,
            next: place(range.start),
            end: place(range.end),
            statistics: Statistics::default(),
        }
    }

    /// Returns the point and trial of the next row.
    pub(super) fn next(&self) -> (u64, u64) {
        self.next
    }

    /// Returns whether this row is one of the run, or the end behind its last one.
    pub(super) fn has(&self, next: (u64, u64)) -> bool {
        (self.next..=self.end).contains(&next) && next.1 < self.trials
    }

    /// Goes to this row; `current` are the statistics of its point so far.
    pub(super) fn go_to(&mut self, next: (u64, u64), current: Option<&Statistics>) {
        self.next = next;
        let going_on = current.filter(|_| next.1 > 0 && !self.stop_at.is_empty());
        self.statistics = going_on.cloned().unwrap_or_default();
    }

    /// Takes the first rows of the current point, which these statistics summarise; the walk must be at the point's
    /// beginning. Advances to the next point if these rows complete the point.
    pub(super) fn jump(&mut self, statistics: &Statistics) {
        let trials = statistics.trials();
        if trials == 0 {
            return;
        }
        self.next.1 = trials;
        let narrow = !self.stop_at.is_empty() && {
            self.statistics = statistics.clone();
            next_look(trials - 1) == trials && self.is_narrow()
        };
        if narrow || trials >= self.trials {
            self.next = (self.next.0 + 1, 0);
            self.statistics = Statistics::default();
        }
    }

    /// Returns whether all its rows are there.
    pub fn is_done(&self) -> bool {
        self.next >= self.end
    }

    /// Returns the largest possible number of rows left.
    pub fn left(&self) -> u64 {
        let number = |(point, trial): (u64, u64)| point.saturating_mul(self.trials).saturating_add(trial);
        number(self.end).saturating_sub(number(self.next))
    }

    /// Returns the point and trial of the next rows, at most `most` of them: as many as are certain.
    pub fn ahead(&self, most: u64) -> Vec<(usize, u64)> {
        let (point, trial) = self.next;
        let sure = if self.stop_at.is_empty() {
            self.left()
        } else {
            next_look(trial).min(self.trials).saturating_sub(trial).min(self.left())
        };
        let place = |k: u64| {
            let number = trial + k;
            (usize::try_from(point + number / self.trials).unwrap_or(usize::MAX), number % self.trials)
        };
        (0..sure.min(most)).map(place).collect()
    }

    /// Takes the next row; returns its point. None: it is not the next one.
    pub fn take(&mut self, row: &Row) -> Option<usize> {
        let (point, trial) = self.next;
        if self.is_done() || row.trial != trial {
            return None;
        }
        self.next.1 += 1;
        let narrow = !self.stop_at.is_empty() && {
            self.statistics.add_row(row);
            next_look(trial) == trial + 1 && self.is_narrow()
        };
        if narrow || self.next.1 == self.trials {
            self.next = (point + 1, 0);
            self.statistics = Statistics::default();
        }
        usize::try_from(point).ok()
    }

    /// Returns whether all intervals are as narrow as they must be.
    fn is_narrow(&self) -> bool {
        let StopTable { rms, wrong_poles } = self.stop_at;
        let narrow = |half: f64, most: Option<f64>| most.is_none_or(|most| half <= most);
        let [rms_now, wrong_now] = [self.statistics.rms(), self.statistics.wrong_pole_probability()];
        let half = |low: f64, high: f64| (high - low) / 2.0;
        narrow(half(rms_now.low, rms_now.high) / rms_now.value, rms.map(Quantity::value))
            && narrow(half(wrong_now.low, wrong_now.high), wrong_poles.map(Quantity::value))
    }
}

/// Returns the number of trials, above `trials`, after which the intervals are looked at next.
fn next_look(trials: u64) -> u64 {
    let mut look = FIRST_LOOK;
    while look <= trials {
        look += look.div_ceil(4);
    }
    look
}

#[cfg(test)]
pub(crate) mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::store::Shard;
    use standstill_scenario::Document;
    use standstill_scenario::Verdict;

    /// A row whose axis error is `error` degrees.
    pub(crate) fn row(trial: u64, error: f64) -> Row {
        Row {
            trial,
            true_angle_deg: trial as f64 * 0.1,
            start_angle_deg: 1.0 / 3.0,
            estimated_angle_deg: (!trial.is_multiple_of(3)).then_some(0.1 + trial as f64),
            error_deg: None,
            axis_deg: Some(7.0),
            axis_error_deg: Some(error),
            half_sector_deg: None,
            age_s: None,
            error_at_instant_deg: None,
            verdict: if trial.is_multiple_of(3) { Verdict::Undetermined } else { Verdict::Found },
            pole_correct: (!trial.is_multiple_of(3)).then_some(true),
            rotor_moved_deg: 0.0,
            duration_s: 1e-3,
            peak_current_a: 5.0,
            reason: if trial.is_multiple_of(3) { "so".to_owned() } else { String::new() },
            kind: String::new(),
        }
    }

    pub(crate) fn identity(stop_at: &str, shard: Shard) -> Identity {
        let text = format!("trials = 10_000\nstop_at = {stop_at}");
        let file = Document::parse("s.toml".as_ref(), &text).and_then(|document| document.load());
        let stop_at = file.expect("valid").stop_at;
        Identity {
            version: "1".to_owned(),
            numerics: 1,
            seed: 1,
            points: 5,
            trials: 10_000,
            stop_at,
            shard,
            scenario: text,
            pole_note: None,
            pole_is_open: false,
            map_note: None,
            motor_note: None,
            library_note: None,
            files: BTreeMap::new(),
        }
    }

    /// Walks to the end with errors of ±1° that a point's number makes one-sided; returns the trials of each point.
    fn trials(identity: &Identity) -> Vec<u64> {
        let mut walk = Walk::new(identity);
        let mut all = vec![0; 5];
        while !walk.is_done() {
            let ahead = walk.ahead(u64::MAX);
            assert!(!ahead.is_empty());
            for (point, trial) in ahead {
                // One error in `10 + point` is three times the others, which sets how wide the interval is.
                let error = if trial.is_multiple_of(10 + point as u64) { 3.0 } else { 1.0 };
                assert_eq!(walk.take(&row(trial, error)), Some(point));
                all[point] += 1;
            }
        }
        all
    }

    #[test]
    fn analytic_a_point_ends_where_its_interval_is_narrow() {
        // e² is 9 with the probability p, else 1: its variance is 64 p (1 − p), and half the interval of the rms is
        // 1.96 · 8 √(p (1 − p) / n) / (2 rms²) of the rms.
        let expected = |point: u64, share: f64| {
            let p = 1.0 / (10 + point) as f64;
            let square = 1.0 + 8.0 * p;
            p * (1.0 - p) * (1.96 * 8.0 / (2.0 * square * share)).powi(2)
        };
        let counted = trials(&identity("{ rms = \"3 %\" }", Shard::WHOLE));
        for (point, count) in counted.iter().enumerate() {
            let least = expected(point as u64, 0.03);
            assert!(
                *count as f64 >= 0.95 * least && (*count as f64) < 1.35 * least,
                "{point}: {count} {least}"
            );
            assert_eq!(next_look(count - 1), *count);
        }
        // A precision that no number of trials gives: all are done.
        assert_eq!(trials(&identity("{ rms = \"0.1 %\" }", Shard::WHOLE)), [10_000; 5]);
        // No wrong pole in n: the interval ends at 3.7 / n, and half of it is below 0.1 % from 1843 trials on.
        let counted = trials(&identity("{ wrong_poles = \"0.1 %\" }", Shard::WHOLE));
        assert!(counted.iter().all(|count| (1843..2310).contains(count)), "{counted:?}");
    }

    /// promise: early-ends-anywhere
    #[test]
    fn law_shards_that_end_early_are_the_whole() {
        let whole = trials(&identity("{ rms = \"3 %\" }", Shard::WHOLE));
        let mut sum = vec![0; 5];
        for index in 1..=3 {
            let part = trials(&identity("{ rms = \"3 %\" }", Shard { index, count: 3 }));
            sum.iter_mut().zip(part).for_each(|(sum, part)| *sum += part);
        }
        assert_eq!(sum, whole);
    }

    #[test]
    fn law_a_row_that_is_not_the_next_is_refused() {
        let mut walk = Walk::new(&identity("{}", Shard { index: 2, count: 3 }));
        assert_eq!((walk.ahead(2), walk.left()), (vec![(1, 6666), (1, 6667)], 16_667));
        assert_eq!(walk.take(&row(6667, 1.0)), None);
        assert_eq!(walk.take(&row(6666, 1.0)), Some(1));
    }
}
