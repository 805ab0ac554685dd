//! Statistics in words.

use std::fmt::Write as _;

use standstill_campaign::{Estimate, Summary, binomial_interval};
use standstill_quantity::{magnitude, number as rounded};
use standstill_report::page::Tone;

use crate::terminal::{painted, paragraph};

/// A number with so many decimals; a dash for what is none.
pub fn number(value: f64, digits: usize) -> String {
    if value.is_nan() { "–".to_owned() } else { format!("{value:.digits$}") }
}

/// A value with its interval; a dash alone for what is not known.
pub fn interval(estimate: &Estimate, factor: f64, digits: usize) -> String {
    let Estimate { value, low, high } = *estimate;
    if [value, low, high].iter().all(|x| x.is_nan()) {
        return number(value, digits);
    }
    let [value, low, high] = [value, low, high].map(|x| number(x * factor, digits));
    format!("{value} [{low}, {high}]")
}

/// An angle in degrees with its interval, in as many digits as that is narrow.
pub fn angle(estimate: &Estimate) -> String {
    interval(estimate, 1.0, digits(0.01 * (estimate.high - estimate.low) / 2.0).max(3))
}

/// A probability in per cent with its interval, in as many digits as its upper end needs: of a zero count, that is what is
/// known.
fn percent(probability: &Estimate) -> String {
    interval(probability, 100.0, digits(probability.high).max(3))
}

/// Decimals for two significant digits of a share in per cent.
pub fn digits(share: f64) -> usize {
    magnitude(100.0 * share).map_or(2, |magnitude| usize::try_from(1 - magnitude).unwrap_or(0).max(2))
}

/// Decimals of a value for people, who read its error off the last digit: two digits of half its interval's width where they begin
/// with less than 3.55, else one (Particle Data Group, Review of Particle Physics, introduction, 5.3). Of what has no interval, or
/// one without width, three digits of its own.
pub fn sure_decimals(all: [f64; 3]) -> usize {
    let half = (all[2] - all[1]).abs() / 2.0;
    let most = decimals_of(all);
    // It begins with less than 3.55 where dividing by that loses a place.
    if magnitude(half / 3.55) < magnitude(half) || half == 0.0 || half.is_nan() {
        most
    } else {
        most.saturating_sub(1)
    }
}

/// Decimals of a share of so many starts in per cent: no more than its interval has, and none that one start more or less would not
/// change.
fn share_decimals(of: &Estimate, starts: u64) -> usize {
    let one = magnitude(100.0 / starts as f64).map_or(0, |m| usize::try_from(-m).unwrap_or(0));
    one.min(sure_decimals([of.value, of.low, of.high].map(|share| 100.0 * share)))
}

/// A count among others, as a probability in per cent; of none, what it is at most.
pub fn share(count: u64, probability: &Estimate) -> String {
    let Estimate { value, high, .. } = *probability;
    if count == 0 {
        format!("0 (< {:.*} %)", digits(high), 100.0 * high)
    } else {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count of starts")]
        let decimals = share_decimals(probability, (count as f64 / value).round() as u64);
        format!("{count} ({:.decimals$} %)", 100.0 * value)
    }
}

/// A share of so many starts in per cent, in no more digits than that many tell.
pub fn share_of(share: f64, starts: u64) -> String {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count of starts")]
    let count = ((share * starts as f64).round().max(0.0) as u64).min(starts);
    let decimals = share_decimals(&binomial_interval(count, starts), starts);
    format!("{:.decimals$}", 100.0 * share)
}

/// The share of starts that were answered rightly in per cent, with its interval.
pub fn right_interval(s: &Summary) -> String {
    let known = binomial_interval(s.found.saturating_sub(s.wrong_poles), s.trials);
    let decimals = share_decimals(&known, s.trials);
    let [value, low, high] = [known.value, known.low, known.high].map(|share| fixed(100.0 * share, decimals));
    format!("{value} [{low}, {high}]")
}

/// A value in no more digits than its interval has, without it; a dash for what is not known.
pub fn sure(e: &Estimate) -> String {
    if e.value.is_nan() {
        "–".to_owned()
    } else if e.low.is_nan() || e.high.is_nan() {
        // Too few for an interval: too few for a third digit.
        standstill_report::figure::rounded(e.value, 2)
    } else {
        fixed(e.value, sure_decimals([e.value, e.low, e.high]))
    }
}

/// The same with the interval, where there is one.
pub fn bracketed(e: &Estimate) -> String {
    if [e.value, e.low, e.high].iter().any(|x| x.is_nan()) {
        return sure(e);
    }
    let decimals = sure_decimals([e.value, e.low, e.high]);
    format!("{} [{}, {}]", sure(e), fixed(e.low, decimals), fixed(e.high, decimals))
}

/// The share of starts that were answered rightly: an angle, and the right pole.
pub fn right(s: &Summary) -> f64 {
    s.found.saturating_sub(s.wrong_poles) as f64 / s.trials as f64
}

/// More starts than this that are not answered rightly make a point no good, whatever its error.
pub const FAILING: f64 = 0.01;

/// Fewer right answers than this are worth a warning.
pub const GOOD: f64 = 0.999;

/// Which of two points is better: by the share of right answers, to a tenth of a per cent, which chance hardly changes;
/// then by the rms error.
pub fn rank(a: &Summary, b: &Summary) -> std::cmp::Ordering {
    let missed = |s: &Summary| (1000.0 * (1.0 - right(s))).round();
    let rms = |s: &Summary| if s.rms_deg.value.is_nan() { f64::INFINITY } else { s.rms_deg.value };
    missed(a).total_cmp(&missed(b)).then(rms(a).total_cmp(&rms(b)))
}

/// Every figure with its interval, a line each.
pub fn text(s: &Summary) -> String {
    let trials = if s.trials == 1 { "trial" } else { "trials" };
    let mut text = format!("Monte Carlo: {} {trials}, [95 % intervals]\n", s.trials);
    let share = |count: u64, of: &Estimate| format!("{count}, probability {} %", percent(of));
    let largest = format!(
        "{}°, exceeded by at most {:.2} % (97.5 % sure)",
        number(s.max_deg, 3),
        // Rounded up: a bound must not look smaller than it is.
        (1e4 * s.beyond_max.high).ceil() / 100.0
    );
    let beyond = format!("P(|e| > {}°)", s.limit_deg);
    let poles = if s.wrong_poles > 0 { Tone::Bad } else { Tone::Good };
    let mut lines = vec![
        ("rms axis error", format!("{}° over {} axes", angle(&s.rms_deg), s.axes)),
        ("mean axis error", format!("{}°", angle(&s.bias_deg))),
        ("median", format!("{}°", angle(&s.p50_deg))),
        ("95th percentile", format!("{}°", angle(&s.p95_deg))),
        ("99th percentile", format!("{}°", angle(&s.p99_deg))),
        ("largest", if s.axes == 0 { "–".to_owned() } else { largest }),
        (
            beyond.as_str(),
            format!(
                "{} % of {} found",
                interval(&s.beyond_limit, 100.0, digits(s.beyond_limit.high)),
                s.found
            ),
        ),
        ("wrong poles", painted(poles, &share(s.wrong_poles, &s.wrong_pole_probability))),
        ("pole undetermined", share(s.undetermined, &s.undetermined_probability)),
        ("failed", share(s.failed, &s.failed_probability)),
        ("rotor moved at most", format!("{:.2}° electrical", s.max_moved_deg)),
        ("detection takes", format!("{} ms on average", rounded(1, s.mean_duration_s * 1e3))),
        ("largest current", format!("{} A", rounded(2, s.peak_current_a))),
    ];
    if s.errors > 0 {
        lines.push(("simulation errors", s.errors.to_string()));
    }
    for (name, value) in lines {
        let _ = writeln!(text, "  {name:<20} {value}");
    }
    for (reason, times) in &s.reasons {
        let probability = percent(&times.probability);
        let said = format!("{} times, probability {probability} %: {reason}", times.count);
        text += &paragraph("    ", &said);
    }
    text
}

/// Decimals of a value with the ends of its interval: two digits of half the interval's width. Of what has no interval, or one
/// without width, three digits of its own.
pub fn decimals_of([value, low, high]: [f64; 3]) -> usize {
    let half = (high - low).abs() / 2.0;
    let least = if half > 0.0 && half.is_finite() { half } else { 0.01 * value.abs() };
    standstill_quantity::magnitude(least).map_or(0, |m| usize::try_from(1 - m).unwrap_or(0)).min(9)
}

/// A value and the ends of its interval with [`decimals_of`] them, what is no number empty. There is no minus zero.
pub fn with_interval(all: [f64; 3]) -> [String; 3] {
    let decimals = decimals_of(all);
    all.map(|x| if x.is_nan() { String::new() } else { fixed(x, decimals) })
}

/// A number with so many decimals, without a sign where only zeros are left.
pub fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| "0.".contains(c)) => rest.to_owned(),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_points_that_answer_are_better_than_points_that_do_not() {
        use standstill_campaign::Statistics;
        let of = |found: u64, rms: f64| {
            let mut s = Statistics::default().summary();
            (s.trials, s.found, s.rms_deg.value) = (1000, found, rms);
            s
        };
        assert_eq!(rank(&of(1000, 2.0), &of(700, 0.1)), std::cmp::Ordering::Less);
        assert_eq!(rank(&of(1000, 2.0), &of(1000, 0.1)), std::cmp::Ordering::Greater);
        assert_eq!(rank(&of(0, f64::NAN), &of(0, 90.0)), std::cmp::Ordering::Greater);
        assert!(right(&of(700, 0.1)) < GOOD && 1.0 - right(&of(700, 0.1)) > FAILING);
    }

    #[test]
    fn regress_a_zero_count_prints_its_upper_limit_however_small() {
        // 1 − 0.025^(1/n): 3.7 / n.
        assert_eq!(percent(&binomial_interval(0, 10_000)), "0.000 [0.000, 0.037]");
        assert_eq!(percent(&binomial_interval(0, 1_000_000)), "0.00000 [0.00000, 0.00037]");
        assert_eq!(share(0, &binomial_interval(0, 1_000_000)), "0 (< 0.00037 %)");
        assert_eq!(
            angle(&Estimate { value: 0.15, low: 0.149_95, high: 0.150_05 }),
            "0.150000 [0.149950, 0.150050]"
        );
        // Of four starts one is 25 %, and the interval reaches from 7 to 93 %.
        assert_eq!(share(2, &binomial_interval(2, 4)), "2 (50 %)");
        assert_eq!(share(25, &binomial_interval(25, 2000)), "25 (1.2 %)");
        assert_eq!((share_of(1.0, 100), share_of(0.9985, 2000)), ("100".to_owned(), "99.85".to_owned()));
        assert_eq!((share_of(0.37, 100), share_of(0.5, 1_000_000)), ("37".to_owned(), "50.00".to_owned()));
        assert_eq!(share(300, &binomial_interval(300, 300)), "300 (100.0 %)");
        let e = |value, low, high| bracketed(&Estimate { value, low, high });
        assert_eq!(e(0.751_7, 0.661, 0.889), "0.75 [0.66, 0.89]");
        assert_eq!(
            (e(f64::NAN, f64::NAN, f64::NAN), e(1.25, f64::NAN, f64::NAN)),
            ("–".into(), "1.2".into())
        );
    }

    #[test]
    fn law_no_digits_beyond_the_interval_and_no_minus_zero() {
        assert_eq!(with_interval([3.621_74, 3.514, 3.733]), ["3.62", "3.51", "3.73"]);
        assert_eq!(with_interval([0.838_12, 0.8371, 0.8392]), ["0.8381", "0.8371", "0.8392"]);
        assert_eq!(with_interval([-0.004, -0.4, 0.4]), ["0.00", "-0.40", "0.40"]);
        assert_eq!(with_interval([0.0, 0.0, 0.0737]), ["0.000", "0.000", "0.074"]);
        assert_eq!(
            (fixed(-0.04, 1), fixed(-0.06, 1), fixed(0.0, 0)),
            ("0.0".into(), "-0.1".into(), "0".into())
        );
    }
}
