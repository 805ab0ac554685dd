//! What two runs have of a measure at a point.

use serde::{Serialize, Serializer};
use standstill_campaign::Estimate;

/// The measures in degrees; the others are shares.
pub const RMS: &str = "rms";
pub const P95: &str = "p95";

/// How many there are.
const TRIALS: &str = "trials";

/// A number; one that could not be computed leaves its field empty.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "as serde calls it")]
fn known<S: Serializer>(value: &f64, to: S) -> Result<S::Ok, S::Error> {
    value.is_finite().then_some(*value).serialize(to)
}

/// A line of the answer: a measure at a point.
#[derive(Debug, Serialize)]
pub struct Row {
    pub point: String,
    pub measure: &'static str,
    #[serde(serialize_with = "known")]
    pub a: f64,
    #[serde(serialize_with = "known")]
    pub a_low: f64,
    #[serde(serialize_with = "known")]
    pub a_high: f64,
    #[serde(serialize_with = "known")]
    pub b: f64,
    #[serde(serialize_with = "known")]
    pub b_low: f64,
    #[serde(serialize_with = "known")]
    pub b_high: f64,
    #[serde(serialize_with = "known")]
    pub difference: f64,
    #[serde(serialize_with = "known")]
    pub difference_low: f64,
    #[serde(serialize_with = "known")]
    pub difference_high: f64,
    /// Trials compared one by one; none where the runs have their own random numbers.
    pub pairs: Option<u64>,
}

impl Row {
    pub fn new(
        point: &str,
        measure: &'static str,
        [a, b]: [Estimate; 2],
        apart: Estimate,
        pairs: Option<u64>,
    ) -> Self {
        Self {
            point: point.to_owned(),
            measure,
            a: a.value,
            a_low: a.low,
            a_high: a.high,
            b: b.value,
            b_low: b.low,
            b_high: b.high,
            difference: apart.value,
            difference_low: apart.low,
            difference_high: apart.high,
            pairs,
        }
    }

    /// How many trials each run has at a point, and how many of them are compared one by one.
    pub fn trials(point: &str, [a, b]: [u64; 2], pairs: Option<u64>) -> Self {
        let count = |n: u64| Estimate { value: n as f64, low: f64::NAN, high: f64::NAN };
        let none = Estimate { value: f64::NAN, low: f64::NAN, high: f64::NAN };
        Self::new(point, TRIALS, [count(a), count(b)], none, pairs)
    }

    /// In degrees or per cent.
    pub fn factor(&self) -> f64 {
        if self.is_angle() { 1.0 } else { 100.0 }
    }

    fn is_angle(&self) -> bool {
        [RMS, P95].contains(&self.measure)
    }

    /// What B has more than A.
    pub fn apart(&self) -> Estimate {
        Estimate { value: self.difference, low: self.difference_low, high: self.difference_high }
    }

    pub fn is_rms(&self) -> bool {
        self.measure == RMS
    }

    pub fn cells(&self) -> Vec<String> {
        if self.measure == TRIALS {
            let pairs = self.pairs.map_or_else(|| "unpaired".to_owned(), |pairs| format!("{pairs} pairs"));
            let [a, b] = [self.a, self.b].map(|count| count.to_string());
            return vec![self.point.clone(), TRIALS.to_owned(), a, b, pairs, String::new()];
        }
        let interval =
            |value: f64, low: f64, high: f64| Estimate { value, low, high }.times(self.factor()).to_string();
        vec![
            self.point.clone(),
            format!("{} {}", self.measure, if self.is_angle() { "°" } else { "%" }),
            interval(self.a, self.a_low, self.a_high),
            interval(self.b, self.b_low, self.b_high),
            interval(self.difference, self.difference_low, self.difference_high),
            // In few words, for a terminal's width.
            self.verdict().replace("no difference shown", "unsure"),
        ]
    }

    /// Which is larger; which is better, all measures of a point say together.
    pub fn verdict(&self) -> &'static str {
        if self.difference_low.is_nan() || self.difference_high.is_nan() {
            return "cannot be compared";
        }
        match (self.difference_low > 0.0, self.difference_high < 0.0) {
            (true, _) => "B larger",
            (_, true) => "B smaller",
            _ => "no difference shown",
        }
    }
}

#[cfg(test)]
mod tests {
    use standstill_campaign::{Statistics, Summary};
    use standstill_report::page::Tone;

    use super::super::Common;
    use super::super::judged::headline;
    use super::*;
    use crate::columns;

    #[test]
    fn regress_what_is_no_number_is_printed_as_none_anywhere() {
        let nan = Estimate { value: f64::NAN, low: f64::NAN, high: f64::NAN };
        let one = Estimate { value: 1.25, low: f64::NAN, high: f64::NAN };
        let row = Row::new("all starts", RMS, [nan, one], nan, Some(0));
        let csv = String::from_utf8(columns::csv([&row]).expect("written")).expect("text");
        assert_eq!(csv.lines().nth(1), Some("all starts,rms,,,,1.25,,,,,,0"));
        assert_eq!(row.cells()[2..], ["–", "1.2", "–", "cannot be compared"]);
        let mut none = Statistics::default().summary();
        (none.trials, none.failed) = (8, 8);
        let one = Summary { found: 6, failed: 2, ..none.clone() };
        let point = Common {
            name: "all starts".to_owned(),
            places: [0, 0],
            counts: [8, 8],
            summaries: [none, one],
            pairs: None,
        };
        let (tone, said) = headline(&[row], &[point]);
        assert_eq!(tone, Tone::Warning);
        let expected = "Answered rightly: 0 % at A, 75 % at B; B is better: it answers more; no axis at A, rms 1.2° at B";
        assert_eq!(said, expected);
    }

    #[test]
    fn regress_a_run_that_leaves_starts_without_a_pole_is_not_better_for_being_exact() {
        let none = Statistics::default().summary();
        let of = |found: u64, wrong_poles: u64, undetermined: u64| Summary {
            trials: 300,
            found,
            wrong_poles,
            undetermined,
            ..none.clone()
        };
        let one = |value: f64| Estimate { value, low: value - 0.1, high: value + 0.1 };
        for (a, b, rms, said) in [
            (
                of(300, 0, 0),
                of(100, 0, 200),
                [1.0, 0.4],
                "B answers less, is more exact where both find the axis; rms",
            ),
            (of(300, 30, 0), of(300, 0, 0), [1.0, 1.0], "B is better: it names fewer wrong poles; rms"),
            (of(300, 0, 0), of(300, 30, 0), [1.0, 0.4], "B names more wrong poles, is more exact; rms"),
            (of(300, 0, 0), of(300, 0, 0), [1.0, 1.4], "B is worse: it is less exact; rms"),
            (of(300, 0, 0), of(299, 1, 1), [1.0, 1.0], "no difference shown; rms"),
        ] {
            let row = Row::new("all starts", RMS, rms.map(one), one(rms[1] - rms[0]), None);
            let point = Common {
                name: "all starts".to_owned(),
                places: [0, 0],
                counts: [300, 300],
                summaries: [a, b],
                pairs: None,
            };
            let (_, told) = headline(&[row], &[point]);
            assert!(told.contains(said), "{said}: {told}");
        }
    }
}
