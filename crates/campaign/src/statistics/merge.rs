//! Statistics of parts, put together: the same bits as those of all trials at once.

use super::Statistics;
use super::sum::Sum;

impl Statistics {
    /// Adds the trials of another.
    ///
    /// ```
    /// use standstill_campaign::Statistics;
    /// use standstill_campaign::store::Row;
    /// # let row = |trial: u64| Row { trial, true_angle_deg: 1.0, start_angle_deg: 1.0, estimated_angle_deg: None,
    /// #     error_deg: None, axis_deg: Some(1.0), axis_error_deg: Some(0.1 * trial as f64 - 3.0),
    /// #     half_sector_deg: None, age_s: None, error_at_instant_deg: None, verdict: standstill_scenario::Verdict::Undetermined, pole_correct: None, rotor_moved_deg: 0.0,
    /// #     duration_s: 1e-3 / 3.0, peak_current_a: 5.0, reason: String::new(), kind: "so".to_owned() };
    /// let of = |trials: std::ops::Range<u64>| {
    ///     let mut statistics = Statistics::default();
    ///     trials.for_each(|trial| statistics.add_row(&row(trial)));
    ///     statistics
    /// };
    /// let mut parts = of(70..100);
    /// parts.merge(&of(0..70));
    /// // As text, because figures of which there are none are no numbers.
    /// assert_eq!(format!("{:?}", parts.summary()), format!("{:?}", of(0..100).summary()));
    /// ```
    pub fn merge(&mut self, other: &Self) {
        self.trials += other.trials;
        self.undetermined += other.undetermined;
        self.failed += other.failed;
        self.errors_of_simulation += other.errors_of_simulation;
        for (reason, count) in &other.reasons {
            *self.reasons.entry(reason.clone()).or_default() += count;
        }
        self.wrong_poles += other.wrong_poles;
        self.beyond_limit += other.beyond_limit;
        self.moved = self.moved.max(other.moved);
        self.peak_current = self.peak_current.max(other.peak_current);
        self.duration.merge(&other.duration);
        for (sum, other) in self.powers.iter_mut().zip(&other.powers) {
            sum.merge(other);
        }
        self.magnitudes.merge(&other.magnitudes);
        if let Some(other) = &other.sectors {
            self.sectors.get_or_insert_default().merge(other);
        }
    }
    /// Returns whether these can be the statistics of trials, as those of a damaged file need not be: counts are parts of the
    /// trials, numbers are finite.
    pub(crate) fn is_sound(&self) -> bool {
        let without = [self.undetermined, self.failed, self.errors_of_simulation];
        let without = without.into_iter().try_fold(0, u64::checked_add);
        let found = without.and_then(|without| self.trials.checked_sub(without));
        let reasons = self.reasons.values().copied().try_fold(0, u64::checked_add);
        let counted = self.wrong_poles.max(self.magnitudes.count()) <= self.trials
            && found.is_some_and(|found| self.beyond_limit <= found)
            && reasons.is_some_and(|reasons| reasons <= self.trials);
        let sectors = self.sectors.is_none_or(|sectors| sectors.is_sound(self.trials));
        let finite = [self.limit_deg, self.moved, self.peak_current].iter().all(|number| number.is_finite());
        counted
            && sectors
            && finite
            && self.magnitudes.is_sound()
            && self.powers.iter().chain([&self.duration]).all(Sum::is_sound)
    }
}
