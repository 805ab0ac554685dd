//! Limits that a qualification must not pass, and starts that count for a claim.

use super::*;

/// At 83 % of all angles the middle of a sector of ±30° is more than 5° away from the rotor, and no start shows this: the error beyond the
/// sector is small.
#[test]
fn law_a_limit_of_the_angle_never_passes_where_answers_are_sectors() {
    let sectors = "sensors = { timer = \"0.32 us\", comparators = \"per-leg\" }\ndetector = { method = \"six-pulse\", sector = \"60 deg\" }\n";
    let (plan, document) = scenario(&format!("motor = \"pm-reluctance\"\n{sectors}"));
    let cases = |limit: &str| {
        let list = Requirements::parse(Path::new("r.toml"), &requirement("A", limit, "")).expect("a list");
        Qualification::new(list, &plan, &document)
    };
    for limit in [
        "P(|e| > 5 deg) <= 5 %",
        "rms <= 10 deg",
        "p95 <= 3 deg",
        "faults.current-gain: P(|e| > 5 deg) <= 5 %",
    ] {
        let message = cases(limit).err().map(|error| error.to_string()).unwrap_or_default();
        for part in ["r.toml: line 4", "six-pulse", "±30°", "`right_sector >= 99 %`"] {
            assert!(message.contains(part), "{limit}: {part}: {message}");
        }
    }
    assert!(cases("right_sector >= 90 %").is_ok() && cases("P(wrong_pole) <= 1 %").is_ok());
    // A library may name sectors: the error that counts is that of the angle, not the part beyond the sector.
    let one = plan.scenario(0).expect("a scenario");
    let all = records(&plan, &one, 0..60).expect("runs");
    let found: Vec<_> = all.iter().filter(|record| record.half_sector_deg().is_some()).collect();
    let off = |bad: Bad| found.iter().filter(|record| bad.happened(record, 1.0)).count();
    let share = off(Bad::Axis(5.0)) as f64 / found.len() as f64;
    // 5/6 of the angles, and three standard deviations of sixty.
    assert!(found.len() > 40 && (share - 5.0 / 6.0).abs() < 0.15, "{share}");
    assert!(off(Bad::Angle(5.0)) >= off(Bad::Axis(5.0)));
}

/// At 5 rpm a rotor with four pole pairs turns by 0.12° in each millisecond, so that the angle of a start of 5 ms is half a degree old at
/// its end, and right at its instant. If the detector states no instant, the limit at the instant is not met.
#[test]
fn law_a_rotor_that_turns_is_judged_at_the_instant_that_the_detector_states() {
    let turning = "rotor = { state = \"driven\", speed = \"5 rpm\" }\ndetector.method = \"bipolar\"\n";
    let list = ["p95 <= 0.4 deg", "p95_at_instant <= 0.4 deg"].map(|limit| requirement(limit, limit, ""));
    let mut found = made(turning, &format!("odds = \"off\"\ntrials = 1000\n{}", list.concat()));
    assert_eq!(judged(&mut found, &never()), [Verdict::Failed, Verdict::Passed]);
    let (plan, _) = scenario(turning);
    let mut record = plan.scenario(0).expect("a scenario").trial(0).expect("a start");
    let [end, instant] = [record.axis_error_deg(), record.axis_error_at_instant_deg()].map(Option::unwrap);
    let bad = Bad::AxisAtInstant(0.5 * (end.abs() + instant.abs()));
    assert!(end.abs() > instant.abs() && !bad.happened(&record, 1.0), "{end} {instant}");
    record.run.instant_angle = None;
    assert!(bad.happened(&record, 1.0) && Bad::AxisAtInstant(89.0).happened(&record, 1.0));
}

#[test]
fn law_plain_trials_of_odds_that_reach_nothing_are_counted_with_the_others() {
    let list = format!("odds = \"off\"\ntrials = 64\n{}", requirement("A", "P(wrong_pole) <= 1e-3", ""));
    let mut found = made(HEAD, &list);
    judged(&mut found, &never());
    let mut claim = found.cases[0].claims[0].clone();
    assert_eq!((claim.verdict(), claim.counts()), (Verdict::NotShown, [0, 64]));
    let alpha = claim.alpha;
    let rare = |plain: u64, alarms: Vec<Alarm>| {
        let odds = Odds { plain, ..odds(0.0, alarms) };
        Some(Rare::of(Event::WrongPole, &odds, 1e-3, alpha, Vec::new()))
    };
    let too_rare = || vec![Alarm::TooRare { level: 1e-16, at_most: 1.2e-16 }];
    // The number that the test needs by itself, less the 64.
    let needed = sequential::Share { most: 1e-3, alpha: claim.alpha }.trials_needed(0.0).expect("none seen");
    let cases = [(needed, too_rare(), Verdict::Passed), (needed / 2, too_rare(), Verdict::NotShown)];
    let lost = (needed, [too_rare(), vec![Alarm::Errors(1)]].concat(), Verdict::NotShown);
    let made: Vec<_> = cases
        .into_iter()
        .chain([lost])
        .map(|(plain, alarms, verdict)| (rare(plain, alarms), verdict))
        .collect();
    for (rare, verdict) in made {
        claim.rare = rare;
        assert_eq!(claim.verdict(), verdict, "{:?}", claim.counts());
        assert!((claim.interval()[2] <= 1e-3) == (verdict == Verdict::Passed));
    }
}

/// A motor whose starts have no answer fails by that alone; no probability of a rare event can mend it.
#[test]
fn law_odds_are_left_out_where_the_requirement_has_failed() {
    let turning = "rotor = { state = \"driven\", speed = \"50 rpm\" }\ndetector.method = \"bipolar\"\n";
    let list = format!("odds = \"quick\"\ntrials = 64\n{}", requirement("A", "P(wrong_pole) <= 1e-6", ""));
    let mut found = made(turning, &list);
    assert_eq!(judged(&mut found, &never()), [Verdict::Failed]);
    assert!(found.cases[0].claims.iter().all(|claim| claim.rare.is_none()));
}
