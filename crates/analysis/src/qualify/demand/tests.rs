use super::*;

fn read(text: &str) -> Result<Demand, Refused> {
    Demand::parse(text)
}

#[test]
fn law_limits_are_read_as_what_counts_against_a_start() {
    let share = |bad, or_unanswered, most| LimitedMeasure::Share { bad, or_unanswered, most };
    let one = |text: &str| read(text).expect(text).what;
    assert_eq!(one("rms <= 1 deg"), LimitedMeasure::Rms(1.0));
    assert_eq!(one("p95 ≤ 3°"), share(Bad::Axis(3.0), true, 0.05));
    assert_eq!(one("p95_at_instant <= 1 deg"), share(Bad::AxisAtInstant(1.0), true, 0.05));
    let LimitedMeasure::Share { most, .. } = one("p99.9 <= 3 deg") else { panic!("a percentile") };
    assert!((most - 1e-3).abs() < 1e-15);
    assert_eq!(one("P(wrong_pole) <= 1e-6"), share(Bad::WrongPole, false, 1e-6));
    // An undetermined pole is no answer, whatever the reason.
    for name in ["undetermined", "failed", "unanswered"] {
        assert_eq!(one(&format!("P({name}) <= 1 %")), share(Bad::Unanswered, false, 0.01));
    }
    assert_eq!(one("P(|e| > 5 deg)<=0.1 %"), share(Bad::Angle(5.0), true, 1e-3));
    assert_eq!(one("P(moved > 2 deg) <= 1e-4"), share(Bad::Moved(2.0), false, 1e-4));
    assert_eq!(one("moved <= 2 deg"), share(Bad::Moved(2.0), true, 0.01));
    assert_eq!(one("current <= 1.2 rated"), share(Bad::Current(Current::OfRated(1.2)), true, 0.01));
    assert_eq!(one("current <= 800 mA"), share(Bad::Current(Current::Amperes(0.8)), true, 0.01));
    assert_eq!(one("time <= 20 ms"), share(Bad::Time(0.02), true, 0.01));
    let LimitedMeasure::Share { bad: Bad::WrongSector, most, .. } = one("right_sector >= 99 %") else {
        panic!("a sector")
    };
    assert!((most - 0.01).abs() < 1e-15);
    let covered = read("faults.phase-open: coverage >= 99 %").expect("a limit");
    assert_eq!((covered.fault, covered.what), (Some(FaultMode::PhaseOpen), LimitedMeasure::Coverage(0.99)));
    let wrong = read("faults.phase-open: P(wrong_pole) <= 0.1 %").expect("a limit");
    // With a fault, no answer is right; without a fault, giving no answers does not meet a demand.
    assert!(!wrong.is_guarded() && read("P(wrong_pole) <= 0.1 %").expect("a limit").is_guarded());
    assert!(!read("P(undetermined) <= 1 %").expect("a limit").is_guarded());
    for limit in ["P(|e| > 5 deg) <= 0.1 %", "moved <= 2 deg", "time <= 20 ms", "p95 <= 3 deg"] {
        let of = |text: String| {
            matches!(read(&text).expect(&text).what, LimitedMeasure::Share { or_unanswered: true, .. })
        };
        assert!(of(limit.to_owned()) && !of(format!("faults.phase-open: {limit}")), "{limit}");
    }
    let sector = read("faults.current-gain: right_sector >= 99 %").expect("a limit").what;
    assert!(matches!(sector, LimitedMeasure::Share { or_unanswered: true, .. }));
}

#[test]
fn law_what_counts_is_said_in_the_units_of_its_limit() {
    for (text, said) in [
        ("time <= 5 ms", "time > 5 ms"),
        ("current <= 1.2 rated", "current > 1.2 times rated"),
        ("P(|e| > 5 deg) <= 1 %", "|e| > 5°"),
        ("right_sector >= 99 %", "wrong sector"),
    ] {
        let LimitedMeasure::Share { bad, .. } = read(text).expect(text).what else { panic!("{text}") };
        assert_eq!(bad.to_string(), said);
    }
}

#[test]
fn regress_what_is_no_limit_is_named_with_what_is() {
    for (text, found, needed) in [
        ("curent <= 1 A", "`curent` (did you mean `current`?)", "p95"),
        ("rms < 1 deg", "`rms < 1 deg`", "`<=`"),
        ("rms <= 1", "`1` without a unit", "90 deg"),
        ("rms <= 100 deg", "`100 deg`", "90 deg"),
        ("rms >= 1 deg", "`rms >= 1 deg`", "`<=` after rms"),
        ("right_sector <= 99 %", "`right_sector <= 99 %`", "`>=` after right_sector"),
        ("p100 <= 1 deg", "`p100`", "p95"),
        ("p100_at_instant <= 1 deg", "`p100_at_instant`", "p95"),
        ("p95_at_instnt <= 1 deg", "did you mean `p95_at_instant`", "p95"),
        (
            "faults.switch-shorted: p95 <= 1 deg",
            "`switch-shorted`",
            "`switch-shorted` is not simulated: it shorts",
        ),
        ("P(wrong_pole) <= 0", "`0`", "above 0 and below 1"),
        ("P(wrong_pole) <= 3e-16", "`3e-16`", "at least 1e-12"),
        ("faults.phase-open: rms <= 1 deg", "rms", "no answer is the right answer"),
        ("faults.phase-open: P(failed) <= 1 %", "`P(failed) <= 1 %`", "no answer is the right answer"),
        ("P(wrong_pole) <= 100 %", "`100 %`", "above 0 and below 1"),
        ("P(wrongpole) <= 1 %", "did you mean `wrong_pole`", "undetermined"),
        ("P(speed > 3) <= 1 %", "`speed`", "`moved > 2 deg`"),
        ("current <= -1 rated", "`-1 rated`", "1.2 rated"),
        ("time <= 3 A", "`3 A`", "20 ms"),
        ("coverage >= 99 %", "`coverage >= 99 %`", "faults.phase-open"),
        ("faults.phase_open: coverage >= 99 %", "did you mean `phase-open`", "contact-resistance"),
        ("faults.phase-open coverage >= 99 %", "coverage", "a colon"),
    ] {
        let (what, allowed) = read(text).expect_err(text);
        assert!(what.contains(found) && allowed.contains(needed), "{text}: {what} / {allowed}");
    }
}
