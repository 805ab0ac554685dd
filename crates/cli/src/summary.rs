//! Statistics as text and tables.

mod points;

use standstill_analysis::Demands;
use standstill_campaign::{Estimate, Sectors, Summary, binomial_interval};
use standstill_quantity::{at_most, magnitude, number as rounded};
pub use standstill_quantity::{count, fixed};
use standstill_report::page::{Block, Column, Section, Table, Tone};

use crate::results::SummaryFile;

/// Formats a number with `digits` decimals. Returns a dash for not-a-number.
pub fn number(value: f64, digits: usize) -> String {
    if value.is_nan() { "–".to_owned() } else { format!("{value:.digits$}") }
}

/// Formats a probability in per cent with its interval.
fn percent(probability: &Estimate) -> String {
    probability.times(100.0).to_string()
}

/// Returns the number of decimals for a share in per cent. The share's interval must support all decimals, and one start more or less must
/// change the last decimal or a digit before it.
fn share_decimals(of: &Estimate, starts: u64) -> usize {
    let one = magnitude(100.0 / starts as f64).map_or(0, |m| usize::try_from(-m).unwrap_or(0));
    one.min(of.times(100.0).decimals())
}

/// Formats the probability of counted events in per cent. For a count of zero, formats the upper limit of the probability.
pub fn share(count: u64, probability: &Estimate) -> String {
    let Estimate { value, high, .. } = *probability;
    if count == 0 {
        format!("0 (< {} %)", at_most(high))
    } else {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count of starts")]
        let decimals = share_decimals(probability, (count as f64 / value).round() as u64);
        format!("{count} ({:.decimals$} %)", 100.0 * value)
    }
}

/// Formats a share of a number of starts in per cent, with the digits that this number supports.
pub fn share_of(share: f64, starts: u64) -> String {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count of starts")]
    let count = ((share * starts as f64).round().max(0.0) as u64).min(starts);
    let decimals = share_decimals(&binomial_interval(count, starts), starts);
    format!("{:.decimals$}", 100.0 * share)
}

/// Returns the share of right answers. A right answer has an angle and the right pole.
pub fn right(s: &Summary) -> f64 {
    s.found.saturating_sub(s.wrong_poles) as f64 / s.trials as f64
}

/// Returns the share of correct starts. A correct start has the right answer. If `open` is true, poles are not judged, and each start with
/// an axis is correct.
pub fn good(s: &Summary, open: bool) -> f64 {
    if open { s.axes as f64 / s.trials as f64 } else { right(s) }
}

/// Formats the share of correct starts in per cent, with its interval.
pub fn good_interval(s: &Summary, open: bool) -> String {
    let count = if open { s.axes } else { s.found.saturating_sub(s.wrong_poles) };
    let known = binomial_interval(count, s.trials);
    let decimals = share_decimals(&known, s.trials);
    let [value, low, high] = [known.value, known.low, known.high].map(|share| fixed(100.0 * share, decimals));
    format!("{value} [{low}, {high}]")
}

/// Returns the column title for the share of correct starts. `open` is true if poles are not judged.
pub const fn good_heading(open: bool) -> &'static str {
    if open { "axis" } else { "right" }
}

/// Share of starts without a right answer above which a point counts as failing, however small its error.
pub const FAILING: f64 = Demands::DEFAULT.without_angle;

/// Share of right answers above which texts omit the share, because nearly all starts have the right answer.
pub const GOOD: f64 = 0.999;

/// Order of the sweep points from best to worst.
#[derive(Clone, Copy, Debug)]
pub struct Ranking {
    /// True if only axes are judged, not poles.
    open: bool,
    /// True if answers are sectors at some points and angles at other points. The error beyond a sector and the error of an angle cannot be
    /// compared.
    mixed: bool,
}

impl Ranking {
    /// Returns the order for points with these summaries. `open` is true if poles are not judged.
    pub fn of<'a>(summaries: impl Iterator<Item = &'a Summary> + Clone, open: bool) -> Self {
        let with_axes = summaries.filter(|s| s.axes > 0);
        let sectors = with_axes.clone().filter(|s| s.sectors.is_some()).count();
        Self { open, mixed: sectors > 0 && sectors < with_axes.count() }
    }

    /// Compares two points in several stages. The first stage compares the share of correct starts, rounded to a tenth of a per cent so
    /// that chance hardly changes it. If all answers are angles or all are sectors, the second stage compares the rms error. If both kinds
    /// occur, the second stage compares the share of answers with an error above the limit, rounded likewise. The error of a sector is
    /// measured from its border. If these shares are equal, angles come before sectors, because they are more precise. The last stage is
    /// then the rms error.
    pub fn compare(self, a: &Summary, b: &Summary) -> std::cmp::Ordering {
        let tenths = |share: f64| (1000.0 * share).round();
        let missed = |s: &Summary| tenths(1.0 - good(s, self.open));
        let known = |value: f64| if value.is_nan() { f64::INFINITY } else { value };
        let off = |s: &Summary| if self.mixed { known(tenths(s.beyond_limit.value)) } else { 0.0 };
        let in_sectors = |s: &Summary| self.mixed && s.sectors.is_some();
        missed(a)
            .total_cmp(&missed(b))
            .then(off(a).total_cmp(&off(b)))
            .then(in_sectors(a).cmp(&in_sectors(b)))
            .then(known(a.rms_deg.value).total_cmp(&known(b.rms_deg.value)))
    }

    /// Describes the stages of the comparison in words. `limit_deg` is the limit of the error in degrees.
    pub fn in_words(self, limit_deg: f64) -> String {
        let did = if self.open { "with an axis" } else { "answered rightly" };
        if self.mixed {
            format!(
                "by the share of starts {did}, then by that off by more than {limit_deg}°, of sectors beyond the border, then angles \
                 before sectors, then by the rms error, of sectors beyond the border"
            )
        } else {
            format!("by the share of starts {did}, then by the rms error")
        }
    }
}

/// Returns the results of a run: the statistics, or for a sweep the table of points, and the reasons of starts without an answer. For a
/// sweep, a terminal does not show the reasons.
pub fn sections(summary: &SummaryFile) -> Vec<Section> {
    let open = summary.run.pole_is_open;
    // Statistics over all points of a sweep would depend on how the axes were chosen: there are none.
    let (table, is_whole) = match summary.whole() {
        Some(whole) => (figures(whole, open), true),
        None => (points::table(&summary.points, open), false),
    };
    let mut sections = vec![Section::new("Results", [Block::Table(table)])];
    if summary.each().any(|s| !s.reasons.is_empty()) {
        let reasons = Section::new("Reasons", [Block::Table(points::reasons(summary))]);
        sections.push(if is_whole { reasons } else { reasons.aside() });
    }
    sections
}

/// Returns the table of a run's statistics with their intervals, one per line. Wrong poles are included only if poles
/// are judged.
pub fn figures(s: &Summary, open: bool) -> Table {
    let trials = if s.trials == 1 { "trial" } else { "trials" };
    let share = |count: u64, of: &Estimate| format!("{count}, probability {} %", percent(of));
    let largest = || {
        let least = at_most(s.beyond_max.high);
        format!("{}°, exceeded by at most {least} % (97.5 % sure)", number(s.max_deg, 3))
    };
    // Without a start that named a pole, nothing is known of wrong poles.
    let (tone, wrong) = match s.found {
        _ if open => (Tone::Neutral, "not judged".to_owned()),
        0 => (Tone::Neutral, "none named".to_owned()),
        _ if s.wrong_poles > 0 => (Tone::Bad, share(s.wrong_poles, &s.wrong_pole_probability)),
        _ => (Tone::Good, share(0, &s.wrong_pole_probability)),
    };
    let line = |name: &str, value: String| (Tone::Neutral, vec![name.to_owned(), value]);
    let of = if s.sectors.is_some() { " beyond the sector" } else { "" };
    let beyond = format!("angle off by > {}°{of}", s.limit_deg);
    let errors = (s.errors > 0).then(|| line("simulation errors", s.errors.to_string()));
    let lines = [
        line("rms axis error", format!("{}° over {} axes{of}", s.rms_deg, count(s.axes))),
        line("mean axis error", format!("{}°", s.bias_deg)),
        line("median", format!("{}°", s.p50_deg)),
        line("95th percentile", format!("{}°", s.p95_deg)),
        line("99th percentile", format!("{}°", s.p99_deg)),
        line("largest", if s.axes == 0 { "–".to_owned() } else { largest() }),
        line(&beyond, format!("{} % of {} with an angle", percent(&s.beyond_limit), count(s.found))),
        (tone, vec!["wrong poles".to_owned(), wrong]),
        line("pole undetermined", share(s.undetermined, &s.undetermined_probability)),
        line("failed", share(s.failed, &s.failed_probability)),
        line("rotor moved at most", format!("{:.2}° electrical", s.max_moved_deg)),
        line("detection takes", format!("{} ms on average", rounded(1, s.mean_duration_s * 1e3))),
        line("largest current", format!("{} A", rounded(2, s.peak_current_a))),
    ];
    Table::new([Column::word(""), Column::word("").judged()])
        .captioned(format!("Monte Carlo: {} {trials}, [95 % intervals]", count(s.trials)))
        .judged(
            lines
                .into_iter()
                .chain(
                    s.sectors
                        .into_iter()
                        .filter(|of| of.named > 0)
                        .flat_map(|of| sector_lines(&of, s.limit_deg)),
                )
                .chain(errors),
        )
}

/// Returns table lines on answers that are sectors. Each line counts one position of the rotor relative to the named sector. A rotor in the
/// next sector, but within the limit of the border, counts as right, because both sectors have nearly equal readings near the border.
fn sector_lines(of: &Sectors, limit_deg: f64) -> [(Tone, Vec<String>); 4] {
    let counted = |count: u64| share(count, &binomial_interval(count, of.named));
    let width = 2.0 * of.half_width_deg;
    let line = |tone: Tone, name: String, count: u64| (tone, vec![name, counted(count)]);
    let bad = |count: u64| if count > 0 { Tone::Bad } else { Tone::Neutral };
    [
        line(Tone::Neutral, format!("right sector of {width:.0}°, of {} named", of.named), of.right),
        line(Tone::Neutral, format!("next sector, border within {limit_deg}°"), of.at_border),
        line(bad(of.next), "next sector, further from its border".to_owned(), of.next),
        line(bad(of.further), "sector further away".to_owned(), of.further),
    ]
}

/// Returns a sentence with the shares of right and wrong answers, for answers that are sectors.
pub fn sectors_in_words(of: &Sectors, limit_deg: f64) -> String {
    let percent = |count: u64| percent(&binomial_interval(count, of.named));
    format!(
        "of {} starts that name a sector of {:.0}°: {} % right, {} % the next one with its border within {limit_deg}°, {} % the next one otherwise, {} % further away",
        of.named,
        2.0 * of.half_width_deg,
        percent(of.right),
        percent(of.at_border),
        percent(of.next),
        percent(of.further)
    )
}

/// Returns the number of decimals of a value that the ends of its interval support.
pub fn decimals_of([value, low, high]: [f64; 3]) -> usize {
    Estimate { value, low, high }.decimals()
}

#[cfg(test)]
mod tests {
    use std::cmp::Ordering;

    use super::*;
    use crate::shell::table::Print as _;

    #[test]
    fn law_points_that_answer_are_better_than_points_that_do_not() {
        use standstill_campaign::Statistics;
        let of = |found: u64, rms: f64| {
            let mut s = Statistics::default().summary();
            (s.trials, s.found, s.rms_deg.value) = (1000, found, rms);
            s
        };
        let rank = |a: &Summary, b: &Summary| Ranking::of([a, b].into_iter(), false).compare(a, b);
        assert_eq!(rank(&of(1000, 2.0), &of(700, 0.1)), Ordering::Less);
        assert_eq!(rank(&of(1000, 2.0), &of(1000, 0.1)), Ordering::Greater);
        assert_eq!(rank(&of(0, f64::NAN), &of(0, 90.0)), Ordering::Greater);
        assert!(right(&of(700, 0.1)) < GOOD && 1.0 - right(&of(700, 0.1)) > FAILING);
    }

    #[test]
    fn regress_sectors_and_angles_are_ranked_by_what_each_of_them_must_do() {
        use standstill_campaign::Statistics;
        let of = |found: u64, in_sectors: bool, rms: f64, beyond: f64| {
            let mut s = Statistics::default().summary();
            (s.trials, s.found, s.axes, s.rms_deg.value) = (1000, found, 1000, rms);
            s.beyond_limit = Estimate { value: beyond, low: beyond, high: beyond };
            s.sectors = in_sectors.then(Sectors::default);
            s
        };
        // An rms of 0.8° of angles is no worse than one of 0.1° beyond sectors of 60°: both meet the limit.
        let (angle, sector) = (of(1000, false, 0.8, 0.0), of(1000, true, 0.1, 0.0));
        // Worse are angles that are often beyond the limit, and wrong sectors; still worse is a point with fewer right
        // answers.
        let (poor, wrong, silent) =
            (of(1000, false, 4.0, 0.3), of(1000, true, 0.4, 0.01), of(700, false, 0.5, 0.0));
        let mut points = [&silent, &poor, &wrong, &sector, &angle];
        let ranking = Ranking::of(points.into_iter(), false);
        points.sort_by(|a, b| ranking.compare(a, b));
        let rms = points.map(|point| point.rms_deg.value);
        assert_eq!(rms, [&angle, &sector, &wrong, &poor, &silent].map(|point| point.rms_deg.value));
        assert!(ranking.in_words(2.0).contains("angles before sectors"));
        // If all answers are of one kind, the rms error decides.
        let ranking = Ranking::of([&angle, &poor].into_iter(), false);
        assert_eq!(ranking.compare(&of(1000, false, 0.8, 0.9), &poor), Ordering::Less);
        assert_eq!(ranking.in_words(2.0), "by the share of starts answered rightly, then by the rms error");
    }

    #[test]
    fn law_answers_in_sectors_are_counted_in_lines_of_their_own() {
        use standstill_campaign::Statistics;
        let mut s = Statistics::default().summary();
        let lines = |s: &Summary| figures(s, false).within(120, false);
        assert!(!lines(&s).contains("sector"));
        (s.trials, s.found) = (1000, 1000);
        let sectors =
            Sectors { half_width_deg: 30.0, named: 1000, right: 990, at_border: 7, next: 3, further: 0 };
        s.sectors = Some(sectors);
        let text = lines(&s);
        for line in ["right sector of 60°", "990 (99.0 %)", "border within 2°", "beyond the sector"] {
            assert!(text.contains(line), "{line} in\n{text}");
        }
        let said = sectors_in_words(&sectors, 2.0);
        assert!(
            said.starts_with("of 1000 starts that name a sector of 60°: 99.0")
                && said.contains("0.3 [0.1, 0.9] % the next one otherwise"),
            "{said}"
        );
    }

    #[test]
    fn regress_a_zero_count_prints_its_upper_limit_however_small() {
        // 1 − 0.025^(1/n): 3.7 / n.
        assert_eq!(percent(&binomial_interval(0, 10_000)), "0.000 [0.000, 0.037]");
        assert_eq!(percent(&binomial_interval(0, 1_000_000)), "0.00000 [0.00000, 0.00037]");
        assert_eq!(share(0, &binomial_interval(0, 1_000_000)), "0 (< 0.00037 %)");
        // Of four starts one is 25 %; the interval reaches from 7 to 93 %.
        assert_eq!(share(2, &binomial_interval(2, 4)), "2 (50 %)");
        assert_eq!(share(25, &binomial_interval(25, 2000)), "25 (1.2 %)");
        assert_eq!((share_of(1.0, 100), share_of(0.9985, 2000)), ("100".to_owned(), "99.85".to_owned()));
        assert_eq!((share_of(0.37, 100), share_of(0.5, 1_000_000)), ("37".to_owned(), "50.00".to_owned()));
        assert_eq!(share(300, &binomial_interval(300, 300)), "300 (100.0 %)");
    }
}
