//! A measure of two runs at a point.

use standstill_campaign::Estimate;

use crate::answer::Record;

/// Name of the rms error in degrees.
pub const RMS: &str = "rms";
/// Name of the 95th percentile of the error in degrees. All measures except this one, [`RMS`] and `TRIALS` are shares.
pub const P95: &str = "p95";

/// Name of the number of trials, the only measure that is a count.
const TRIALS: &str = "trials";

/// The values of one measure in both runs, at one sweep point.
#[derive(Debug)]
pub struct Compared {
    pub point: String,
    pub measure: &'static str,
    /// Values of run A and of run B.
    pub of: [Estimate; 2],
    /// Difference, B minus A.
    pub apart: Estimate,
    /// Number of pairs of trials that were compared. None if the runs have independent random numbers.
    pub pairs: Option<u64>,
}

impl Compared {
    pub fn new(
        point: &str,
        measure: &'static str,
        of: [Estimate; 2],
        apart: Estimate,
        pairs: Option<u64>,
    ) -> Self {
        Self { point: point.to_owned(), measure, of, apart, pairs }
    }

    /// Makes the row that contains the numbers of trials at a point. `counts` is the number in each run, and `pairs` the number of compared
    /// pairs.
    pub fn trials(point: &str, counts: [u64; 2], pairs: Option<u64>) -> Self {
        let count = |n: u64| Estimate { value: n as f64, ..Estimate::UNKNOWN };
        Self::new(point, TRIALS, counts.map(count), Estimate::UNKNOWN, pairs)
    }

    /// Returns the row for JSON and CSV.
    pub fn record(&self) -> Record {
        Record::default()
            .with("point", &self.point)
            .with("measure", self.measure)
            .estimate("a", "", Some(self.of[0]))
            .estimate("b", "", Some(self.of[1]))
            .estimate("difference", "", Some(self.apart))
            .with("pairs", self.pairs)
    }

    /// Returns the factor that converts the measure's value to degrees or per cent.
    pub fn factor(&self) -> f64 {
        if self.is_angle() { 1.0 } else { 100.0 }
    }

    fn is_angle(&self) -> bool {
        [RMS, P95].contains(&self.measure)
    }

    pub fn is_rms(&self) -> bool {
        self.measure == RMS
    }

    pub fn cells(&self) -> Vec<String> {
        if self.measure == TRIALS {
            let pairs = self.pairs.map_or_else(|| "unpaired".to_owned(), |pairs| format!("{pairs} pairs"));
            let [a, b] = self.of.map(|count| count.value.to_string());
            return vec![self.point.clone(), TRIALS.to_owned(), a, b, pairs, String::new()];
        }
        let interval = |of: Estimate| of.times(self.factor()).to_string();
        vec![
            self.point.clone(),
            format!("{} {}", self.measure, if self.is_angle() { "°" } else { "%" }),
            interval(self.of[0]),
            interval(self.of[1]),
            interval(self.apart),
            // Short words, so that the row fits the width of a terminal.
            self.verdict().replace("no difference shown", "unsure"),
        ]
    }

    /// Returns words that state which run has the larger value. They do not state which run is better, because this depends on all measures
    /// of a point.
    pub fn verdict(&self) -> &'static str {
        if self.apart.low.is_nan() || self.apart.high.is_nan() {
            return "cannot be compared";
        }
        match (self.apart.low > 0.0, self.apart.high < 0.0) {
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
    use crate::answer::Records;

    #[test]
    fn regress_what_is_no_number_is_printed_as_none_anywhere() {
        let nan = Estimate { value: f64::NAN, low: f64::NAN, high: f64::NAN };
        let one = Estimate { value: 1.25, low: f64::NAN, high: f64::NAN };
        let row = Compared::new("all starts", RMS, [nan, one], nan, Some(0));
        let csv = Records(vec![row.record()]).csv().expect("written");
        let csv = String::from_utf8(csv).expect("text");
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
            let row = Compared::new("all starts", RMS, rms.map(one), one(rms[1] - rms[0]), None);
            let point = Common {
                name: "all starts".to_owned(),
                places: [0, 0],
                counts: [300, 300],
                summaries: [a, b],
                pairs: None,
            };
            let (_, headline_text) = headline(&[row], &[point]);
            assert!(headline_text.contains(said), "{said}: {headline_text}");
        }
    }
}
