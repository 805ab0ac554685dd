//! Statistics as people read them: in the digits that their intervals support.

use serde_json::{Value, json};
use standstill_campaign::{Estimate, Summary};
use standstill_quantity::{at_most, count};

/// Replaces hyphens by true minus signs.
fn typeset(text: &str) -> String {
    text.replace('-', "−")
}

/// Returns a value in this unit with its interval.
fn interval(of: Estimate, unit: &str) -> String {
    if of.value.is_nan() {
        return "–".to_owned();
    }
    let text = of.to_string();
    let (value, ends) = text.split_once(' ').unwrap_or((&text, ""));
    typeset(format!("{value}{unit} {ends}").trim_end())
}

/// Returns a count with its probability; for a count of zero, with the upper limit of the probability.
fn odds(cases: u64, of: Estimate) -> String {
    if cases == 0 {
        format!("0, below {} %", at_most(of.high))
    } else {
        format!("{}: {}", count(cases), interval(of.times(100.0), " %"))
    }
}

/// Texts of a summary, by the quantity.
pub(crate) fn in_words(s: &Summary) -> Value {
    json!({
        "trials": count(s.trials),
        "rms": interval(s.rms_deg, "°"),
        "bias": interval(s.bias_deg, "°"),
        "p95": interval(s.p95_deg, "°"),
        "wrong": odds(s.wrong_poles, s.wrong_pole_probability),
        "undetermined": odds(s.undetermined, s.undetermined_probability),
        "failed": odds(s.failed, s.failed_probability),
        "beyond": interval(s.beyond_limit.times(100.0), " %"),
    })
}

/// Returns a change in words, with its sign.
pub(crate) fn change(of: Estimate) -> String {
    let sign = if of.value > 0.0 { "+" } else { "" };
    format!("{sign}{}", interval(of, "°"))
}

#[cfg(test)]
mod tests {
    use standstill_campaign::{Statistics, binomial_interval};

    use super::*;

    #[test]
    fn regress_what_the_page_says_has_no_digits_beyond_the_interval() {
        let estimate = |value, low, high| Estimate { value, low, high };
        let mut s = Statistics::default().summary();
        (s.rms_deg, s.bias_deg) = (estimate(0.751_7, 0.661, 0.889), estimate(-0.012_34, -0.04, 0.015));
        (s.trials, s.wrong_poles, s.wrong_pole_probability) = (20_000, 3, binomial_interval(3, 2000));
        s.failed_probability = binomial_interval(0, 10_000);
        let in_words = in_words(&s);
        assert_eq!(in_words["trials"], "20,000");
        assert_eq!(in_words["rms"], "0.75° [0.66, 0.89]");
        assert_eq!(in_words["bias"], "−0.012° [−0.040, 0.015]");
        assert_eq!(in_words["wrong"], "3: 0.15 % [0.03, 0.44]");
        assert_eq!((&in_words["failed"], &in_words["p95"]), (&json!("0, below 0.037 %"), &json!("–")));
        assert_eq!(change(estimate(0.1234, 0.1, 0.15)), "+0.123° [0.100, 0.150]");
    }
}
