use super::*;
use crate::tune::{self, measured};

#[test]
fn law_limits_are_read_as_they_are_written() {
    for text in [
        "rms <= 1 deg",
        "P(|e| > 2 deg) <= 1 %, wrong_poles <= 0.5 %",
        "p95 <= 2 deg, p99 <= 3 deg, moved <= 0.1 deg, duration <= 0.02 s, peak_current <= 8 A",
        "unanswered <= 0.25 %",
    ] {
        assert_eq!(text.parse::<Limits>().expect("limits").to_string(), text);
    }
    // The names of earlier versions.
    for name in ["undetermined", "failed"] {
        let limits = format!("{name} <= 0.25 %").parse::<Limits>().expect("limits");
        assert_eq!(limits.to_string(), "unanswered <= 0.25 %");
    }
    assert_eq!("duration<=20 ms".parse::<Limits>().expect("limits").0[0].most, 0.02);
}

#[test]
fn law_limits_may_be_what_the_start_reaches() {
    let Subject(limits) = "moved <= start, rms<=1 deg".parse().expect("limits");
    assert_eq!(limits, [(Measure::Moved, None), (Measure::Rms, Some(1.0))]);
    assert_eq!(Subject(limits).to_string(), "moved <= start, rms <= 1 deg");
    assert!("moved < start".parse::<Subject>().is_err() && "start <= start".parse::<Subject>().is_err());
    for name in ["rms", "P(|e| > 2 deg)", "peak_current"] {
        assert_eq!(name.parse::<Measure>().expect("a measure").to_string(), name);
    }
    let message = "rmse".parse::<Measure>().expect_err("no measure").to_string();
    assert!(message.contains("`rmse`") && message.contains("duration"), "{message}");
}

#[test]
fn regress_what_is_no_limit_names_those_that_are() {
    let refused = |text: &str| text.parse::<Limits>().expect_err("no limit").to_string();
    for text in ["rmse <= 1 deg", "rms < 1", "P(e > 2 deg) <= 1 %", ""] {
        let message = refused(text);
        assert!(message.contains("wrong_poles") && message.contains("peak_current"), "{message}");
    }
    for (text, near) in [
        ("rmse <= 1 deg", "rms"),
        ("wrong-pole <= 1 %", "wrong_poles"),
        ("current <= 8 A", "peak_current"),
        ("P(e > 2 deg) <= 1 %", "P(|e| > X)"),
    ] {
        let message = refused(text);
        assert!(message.contains(&format!("did you mean `{near}`?")), "{message}");
    }
    assert!(!refused("luck <= 1").contains("did you mean"));
}

#[test]
fn regress_a_bound_has_its_unit() {
    for (text, found, needed) in [
        ("rms <= 1", "`1` without a unit", "such as `1 deg`"),
        ("moved <= 0.1", "`0.1` without a unit", "such as `1 deg`"),
        ("duration <= 20", "`20` without a unit", "such as `20 ms`"),
        ("peak_current <= 8", "`8` without a unit", "such as `8 A`"),
        ("P(|e| > 2) <= 1 %", "`2` without a unit", "such as `P(|e| > 2 deg)`"),
        ("P(|e| > 200 deg) <= 1 %", "`200 deg`", "less than 180 deg"),
        ("rms <= -1 deg", "`-1 deg`", "above 0 deg"),
        ("duration <= 3 A", "`3 A`", "a time above 0 s"),
    ] {
        let message = text.parse::<Limits>().expect_err("no limit").to_string();
        assert!(message.contains(&format!("found {found}, needed")) && message.contains(needed), "{message}");
        assert_eq!(text.parse::<Subject>().expect_err("no limit").to_string(), message);
    }
    assert_eq!("peak_current <= 800 mA".parse::<Limits>().expect("limits").0[0].most, 0.8);
    assert_eq!("wrong_poles <= 7 %".parse::<Limits>().expect("limits").to_string(), "wrong_poles <= 7 %");
}

#[test]
fn regress_a_comma_without_a_limit_is_told_in_words() {
    for text in ["rms <= 1 deg,", ", rms <= 1 deg", "rms <= 1 deg,, unanswered <= 5 %"] {
        let message = text.parse::<Limits>().expect_err("no limits").to_string();
        assert!(
            message.starts_with(&format!("`{text}` has a comma with no limit before or after it: needed"))
        );
        assert_eq!(text.parse::<Subject>().expect_err("no limits").to_string(), message);
    }
}

#[test]
fn regress_a_share_has_its_sign_and_is_at_most_all() {
    for name in ["wrong_poles", "unanswered", "P(|e| > 2 deg)"] {
        for bound in ["5", "0.05", "100.1 %", "inf %", "nan %", "0 %", "-1 %", "%"] {
            let text = format!("rms <= 1 deg, {name} <= {bound}");
            let message = text.parse::<Limits>().expect_err("no limit").to_string();
            let found = format!("`{name} <= {bound}` is no limit: found `{bound}`, needed a share");
            assert!(message.starts_with(&found) && message.ends_with("`5 %`"), "{message}");
            assert_eq!(text.parse::<Subject>().expect_err("no limit").to_string(), message);
        }
        let limits: Limits = format!("{name} <= 100 %").parse().expect("limits");
        assert_eq!(limits.0[0].most, 1.0);
        let Subject(limits) = format!("{name}<=5%").parse().expect("limits");
        assert_eq!(limits[0].1, Some(0.05));
    }
}

#[test]
fn analytic_quantiles_lie_between_order_statistics() {
    let values: Vec<f64> = (1..=1000).map(f64::from).collect();
    let estimate = quantile(&values, 0.95, 1000.0);
    assert_eq!(estimate.value, 950.0);
    assert!(
        (936.0..938.0).contains(&estimate.low) && (964.0..966.0).contains(&estimate.high),
        "{estimate:?}"
    );
    assert_eq!(quantile(&[1.0, 2.0], 0.99, 2.0).high, f64::INFINITY);
    // A quarter of the trials would leave an interval twice as wide: 4 (237.5 ± 1.96 √(250 · 0.95 · 0.05)) = 950 ± 27.
    let fewer = quantile(&values, 0.95, 250.0);
    assert_eq!(fewer.value, 950.0);
    assert!((918.0..928.0).contains(&fewer.low) && (972.0..984.0).contains(&fewer.high), "{fewer:?}");
}

#[test]
fn law_starts_without_an_answer_count_against_every_limit() {
    use std::path::Path;

    use standstill_scenario::{Document, Plan};
    use standstill_sim::Tape;

    let text = "rms <= 1 deg, p95 <= 1 deg, p99 <= 1 deg, P(|e| > 2 deg) <= 1 %, wrong_poles <= 1 %, unanswered <= 1 %, \
                moved <= 1 deg, duration <= 1 s, peak_current <= 100 A";
    let limits: Limits = text.parse().expect("limits");
    let record = |key: &str| {
        let text = format!("errors = \"none\"\ndetector.method = \"bipolar\"\n{key}\n");
        let plan = Plan::new(Document::parse(Path::new("test.toml"), &text).expect("TOML")).expect("a plan");
        let trials = crate::Trials::new(&plan).expect("a scenario");
        trials.records(&[Tape::new(1, 0)]).expect("runs").remove(0)
    };
    // A good start, one without an axis, one without a pole.
    let good = record("");
    for (key, verdict) in [
        ("detector.least_saliency = 0.9", Ending::Failed),
        ("detector.signature = \"none\"", Ending::Undetermined),
    ] {
        let bad = record(key);
        assert_eq!((good.verdict(), bad.verdict()), (Ending::Found, verdict));
        let mut tally = Tally::new(&limits);
        (0..300).for_each(|_| tally.add(&good));
        assert!(tune::verdict(&limits, &measured(&limits, &tally)).holds, "{:?}", tally.estimates());
        // One in four: beyond every quantile.
        (0..100).for_each(|_| tally.add(&bad));
        let [rms, p95, p99, beyond, wrong, unanswered, moved, duration, peak] =
            tally.estimates().try_into().expect("nine");
        assert!((rms.value - 45.0).abs() < 0.1, "{rms:?}");
        for quantile in [p95, p99, moved, duration, peak] {
            assert_eq!(quantile.value, f64::INFINITY);
        }
        for share in [beyond, wrong, unanswered] {
            assert_eq!(share.value, 0.25);
        }
    }
}

#[test]
fn analytic_so_many_trials_it_takes_to_see_that_limits_hold() {
    let least = |text: &str| text.parse::<Limits>().expect("limits").least_trials();
    // None in n leaves a share of up to 3.689/n: a share of 1/8100 with 90° makes an rms of 1°.
    assert_eq!(least("rms <= 1 deg"), 29_879);
    assert_eq!(least("wrong_poles <= 0.1 %, rms <= 5 deg"), 3688);
    assert_eq!(least("duration <= 20 ms"), 3);
}

#[test]
fn law_limits_hold_surely_at_the_bad_ends_and_possibly_at_the_good_ones() {
    let limits: Limits = "duration <= 20 ms".parse().expect("limits");
    // Durations in steps of 1 µs: the 99th percentile of 1,000 is the 990th, and lies between the 984th and the 998th.
    let holds = |from: f64| {
        let values = (0..1000).map(|k| from + 1e-6 * f64::from(k)).collect();
        let verdict = tune::verdict(&limits, &measured(&limits, &Tally::of(&limits, vec![values])));
        (verdict.possibly, verdict.holds, verdict.surely)
    };
    assert_eq!(holds(19.0e-3), (true, true, true));
    assert_eq!(holds(19.005e-3), (true, true, false));
    assert_eq!(holds(19.013e-3), (true, false, false));
    assert_eq!(holds(19.1e-3), (false, false, false));
}

#[test]
fn law_a_share_that_is_written_as_odds_are_is_named_with_its_sign() {
    let refused = |text: &str| text.parse::<Limits>().expect_err("no sign").to_string();
    assert!(refused("wrong_poles <= 1e-6").ends_with("such as `5 %`; 1e-6 is `0.0001 %`"));
    assert!(
        refused("wrong_poles <= 5").ends_with("such as `5 %`") && refused("rms <= 1").ends_with("`1 deg`")
    );
}
