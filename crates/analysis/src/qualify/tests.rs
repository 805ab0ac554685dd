mod honest;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;

use standstill_campaign::Estimate;

use super::rare::Rare;
use super::*;
use crate::faults::records;
use crate::{Alarm, Estimator, Event, Odds};

const HEAD: &str = "rotor.state = \"free\"\ndetector.method = \"bipolar\"\n";

/// A plan with its document.
fn scenario(text: &str) -> (Plan, Document) {
    let document = Document::parse(Path::new("s.toml"), text).expect("TOML");
    (Plan::new(document.clone()).expect("a plan"), document)
}

/// A requirement as text.
fn requirement(id: &str, limit: &str, more: &str) -> String {
    format!("[[requirement]]\nid = \"{id}\"\ntext = \"…\"\nlimit = \"{limit}\"\n{more}\n")
}

fn made(scenario_text: &str, requirements: &str) -> Qualification {
    let (plan, document) = scenario(scenario_text);
    let requirements = Requirements::parse(Path::new("r.toml"), requirements).expect("requirements");
    Qualification::new(requirements, &plan, &document).expect("cases")
}

/// The verdicts, in the order of the list.
fn judged(qualification: &mut Qualification, watch: &dyn Watch) -> Vec<Verdict> {
    qualification.judge(watch, &|_| true, |_, _| {}).expect("runs");
    (0..qualification.requirements.list.len()).map(|number| qualification.verdict(number)).collect()
}

fn never() -> AtomicBool {
    AtomicBool::new(false)
}

#[test]
fn law_requirements_are_passed_failed_and_not_shown_and_share_one_error() {
    let list = format!(
        "odds = \"off\"\ntrials = 1500\n{}{}{}{}",
        requirement("A", "p95 <= 3 deg", ""),
        requirement("B", "p50 <= 0.001 deg", ""),
        requirement("C", "P(wrong_pole) <= 1e-6", ""),
        requirement(
            "D",
            "P(undetermined) <= 20 %",
            "errors = [\"none\", \"default\"]\nmotors = [\"paper-5k5\", \"gearless-hoist\"]"
        ),
    );
    let mut found = made(HEAD, &list);
    // Five cases: the scenario itself, whose trials judge A, B and C, and the four cases of D, which set keys.
    assert_eq!((found.cases.len(), found.count()), (5, 3 + 1 + 4));
    assert!(
        found
            .cases
            .iter()
            .flat_map(|case| &case.claims)
            .all(|claim| (claim.alpha - 0.05 / 8.0).abs() < 1e-15)
    );
    let verdicts = judged(&mut found, &never());
    assert_eq!(verdicts, [Verdict::Passed, Verdict::Failed, Verdict::NotShown, Verdict::Passed]);
    let claim = |number| found.claims(number).next().expect("a claim").1;
    assert!(claim(0).trials < 1500 && claim(1).trials < 1500, "decided early");
    assert_eq!(claim(2).trials, 1500);
    let needed = claim(2).trials_needed().expect("no wrong pole was seen");
    assert!((5_000_000..20_000_000).contains(&needed), "{needed}");
    // Each interval lies on the side of its limit that the verdict states.
    let [_, low, high] = claim(0).interval();
    assert!(low >= 0.0 && high <= 0.05);
    let [value, low, _] = claim(1).interval();
    assert!(low > 0.5 && value >= low);
    assert!(claim(1).seen.worst.is_some_and(|(trial, _)| trial < 64));
}

#[test]
fn law_a_requirement_alone_is_judged_as_in_the_list() {
    let list = format!(
        "odds = \"off\"\n{}{}",
        requirement("A", "p95 <= 0.3 deg", "trials = 100"),
        requirement("B", "P(|e| > 1 deg) <= 5 %", "trials = 700"),
    );
    let mut all = made(HEAD, &list);
    judged(&mut all, &never());
    let mut alone = made(HEAD, &list);
    alone.judge(&never(), &|number| number == 1, |_, _| {}).expect("runs");
    let claim = |of: &Qualification| of.claims(1).next().expect("a claim").1.clone();
    assert_eq!(claim(&all), claim(&alone));
}

/// promise: silence-passes-nothing
#[test]
fn law_nothing_is_passed_by_failing_to_answer() {
    // At 50 rpm the induced voltage leaves all poles undetermined: none is wrong.
    let turning = "rotor = { state = \"driven\", speed = \"50 rpm\" }\ndetector.method = \"bipolar\"\n";
    let limits = [
        "P(wrong_pole) <= 20 %",
        "P(moved > 360000 deg) <= 20 %",
        "rms <= 40 deg",
        "p50 <= 30 deg",
        "p50_at_instant <= 30 deg",
        "moved <= 3600 deg",
        "P(|e| > 90 deg) <= 40 %",
        "P(failed) <= 40 %",
        "time <= 1 s",
        "current <= 100 rated",
    ];
    let list: String = limits.iter().map(|limit| requirement(limit, limit, "")).collect();
    let mut found = made(turning, &format!("odds = \"off\"\ntrials = 700\n{list}"));
    for (limit, verdict) in limits.iter().zip(judged(&mut found, &never())) {
        assert_eq!(verdict, Verdict::Failed, "{limit}");
    }
    // The event of the first requirement never happens; its guard fails.
    let claims: Vec<_> = found.claims(0).map(|(_, claim)| (claim.guards, claim.plain)).collect();
    assert_eq!(claims, [(false, Verdict::Passed), (true, Verdict::Failed)]);
}

#[test]
fn law_a_fault_that_is_detected_passes_by_its_detection() {
    let list = format!(
        "odds = \"off\"\ntrials = 400\n{}{}{}",
        requirement("A", "faults.current-dead: coverage >= 90 %", ""),
        requirement("B", "faults.phase-open: P(wrong_pole) <= 10 %", ""),
        requirement("C", "faults.terminals-swapped: P(wrong_pole) <= 10 %", ""),
    );
    let mut found = made(HEAD, &list);
    let verdicts = judged(&mut found, &never());
    // A dead sensor is dangerous without the checks and noticed with them; exchanged wires are another motor.
    assert_eq!(verdicts, [Verdict::Passed, Verdict::Passed, Verdict::Failed]);
    let covered = found.claims(0).next().expect("a claim").1;
    assert!(covered.seen.of > 0 && covered.seen.of <= covered.trials && covered.seen.cases == 0);
    assert_eq!(found.cases[0].options(), ["faults.0.mode=current-dead"]);
}

/// A watch that stores the results that it receives, and stops after this number of trials.
#[derive(Default)]
struct Keeping {
    kept: Mutex<BTreeMap<String, Vec<u8>>>,
    trials: Mutex<u64>,
    most: Option<u64>,
}

impl Watch for Keeping {
    fn stopped(&self) -> bool {
        self.most.is_some_and(|most| *self.trials.lock().expect("alone") >= most)
    }

    fn did(&self, trials: u64) {
        *self.trials.lock().expect("alone") += trials;
    }

    fn recall(&self, key: &str) -> Option<Vec<u8>> {
        self.kept.lock().expect("alone").get(key).cloned()
    }

    fn keep(&self, key: &str, bytes: &[u8]) {
        self.kept.lock().expect("alone").insert(key.to_owned(), bytes.to_vec());
    }
}

/// promise: questions-resume
#[test]
fn law_an_interrupted_qualification_goes_on_where_it_was() {
    let list = format!("odds = \"off\"\ntrials = 600\n{}", requirement("A", "rms <= 0.5 deg", ""));
    let mut whole = made(HEAD, &list);
    judged(&mut whole, &never());
    let stopped = Keeping { most: Some(300), ..Keeping::default() };
    let mut first = made(HEAD, &list);
    assert_eq!(first.judge(&stopped, &|_| true, |_, _| {}), Err(Halt::Stopped));
    let kept = stopped.kept.into_inner().expect("alone");
    assert!(!kept.is_empty());
    let on = Keeping { kept: Mutex::new(kept.clone()), ..Keeping::default() };
    let mut second = made(HEAD, &list);
    judged(&mut second, &on);
    assert_eq!(second.cases[0].claims, whole.cases[0].claims);
    assert!(on.kept.into_inner().expect("alone").len() > kept.len());
}

/// Makes odds in which every run found this probability.
fn odds(value: f64, alarms: Vec<Alarm>) -> Odds {
    Odds {
        estimator: Estimator::Subset,
        probability: Estimate { value, low: value / 1.5, high: value * 1.5 },
        widened: false,
        trials: 1000,
        plain: 100,
        levels: 6,
        runs: Vec::new(),
        alarms,
        remarks: Vec::new(),
        failures: Vec::new(),
    }
}

/// promise: alarms-pass-nothing
#[test]
fn law_odds_with_an_alarm_show_nothing_and_their_interval_has_the_claims_confidence() {
    let of = |value, alarms, most| Rare::of(Event::WrongPole, &odds(value, alarms), most, 0.002, Vec::new());
    // t of seven degrees of freedom is 2.3646 at 5 % and 4.785 at 0.2 %: the interval is 1.5^2.0236 wide on each side.
    let passed = of(1e-7, Vec::new(), 1e-6);
    assert!((passed.ends[1] / 1e-7 - 1.5_f64.powf(4.7853 / 2.3646)).abs() < 1e-3, "{:?}", passed.ends);
    assert_eq!(passed.verdict, Verdict::Passed);
    assert_eq!(of(1e-7, Vec::new(), 1.6e-7).verdict, Verdict::NotShown, "within 1.5, beyond 2.27");
    assert_eq!(of(1e-7, Vec::new(), 1e-8).verdict, Verdict::Failed);
    for alarm in [Alarm::TooRare { level: 1e-16, at_most: 1.2e-16 }, Alarm::Flat, Alarm::Ancestors(2)] {
        for most in [1e-6, 1e-8] {
            let found = of(1e-7, vec![alarm.clone()], most);
            assert_eq!((found.verdict, found.alarms.len()), (Verdict::NotShown, 1));
        }
    }
}

#[test]
fn regress_mistakes_in_a_list_are_named_by_line() {
    let wrong = |text: &str| Requirements::parse(Path::new("r.toml"), text).expect_err(text).to_string();
    let list = |more: &str| format!("{}{}", requirement("A", "rms <= 1 deg", ""), more);
    for (text, parts) in [
        (String::new(), &["r.toml", "`requirement`", "found 0 requirements", "[[requirement]]"][..]),
        (
            list("[[requirement]]\nid = \"A\"\ntext = \"…\"\nlimit = \"rms <= 1 deg\""),
            &["line 7", "requirement[1].id", "`A`", "requirement 1"],
        ),
        (
            list("[[requirement]]\nid = \"B\"\ntext = \"…\"\nlimt = \"rms <= 1 deg\""),
            &["line 9", "requirement[1].limt", "did you mean `limit`"],
        ),
        (
            list(&requirement("B", "rms < 1 deg", "")),
            &["line 9", "requirement[1].limit", "`rms < 1 deg`", "needed a measure"],
        ),
        (
            list(&requirement("B", "rms <= 1 deg", "trials = 3")),
            &["line 10", "requirement[1].trials", "found 3", "from 64 to"],
        ),
        (
            list(&requirement("B", "rms <= 1 deg", "motors = []")),
            &["line 10", "requirement[1].motors", "an empty list"],
        ),
        (
            list(&requirement("B", "rms <= 1 deg", "over.\"sensors.noise\" = \"1 mA\"")),
            &["line 10", "requirement[1].over.sensors.noise", "a list of its values"],
        ),
        (
            list(&requirement("B", "rms <= 1 deg", "over.seed = [1, 2]")),
            &["line 10", "requirement[1].over.seed", "a key of the run itself"],
        ),
        (
            format!("confidence = \"100 %\"\n{}", list("")),
            &["line 1", "`confidence`", "found 1", "below 100 %"],
        ),
        (
            list("[[requirement]]\nid = \"B\"\ntext = \" \"\nlimit = \"rms <= 1 deg\""),
            &["line 8", "requirement[1].text", "the requirement in words"],
        ),
        (
            format!("odds = \"quik\"\n{}", list("")),
            &["line 1", "`odds`", "`quik`", "off, quick, normal, high"],
        ),
    ] {
        let message = wrong(&text);
        assert!(parts.iter().all(|part| message.contains(part)), "{message}\n{parts:?}");
    }
}

#[test]
fn regress_what_the_scenario_cannot_have_is_named_by_the_requirements_line() {
    let (plan, document) = scenario(HEAD);
    let wrong = |text: String| {
        let list = Requirements::parse(Path::new("r.toml"), &text).expect("a list");
        Qualification::new(list, &plan, &document).expect_err("no case").to_string()
    };
    for (limit, more, parts) in [
        (
            "rms <= 1 deg",
            "motors = [\"paper-5k6\"]",
            &["r.toml: line 5", "requirement[0].motors", "paper-5k6"][..],
        ),
        ("rms <= 1 deg", "errors = [\"defualt\"]", &["line 5", "requirement[0].errors", "default"]),
        (
            "rms <= 1 deg",
            "over.\"sensors.noize\" = [1]",
            &["line 5", "requirement[0].over", "sensors.noize", "did you mean"],
        ),
        (
            "rms <= 1 deg",
            "temperatures = [\"9000 °C\"]",
            &["line 5", "requirement[0].temperatures", "rotor.winding_temperature"],
        ),
        ("right_sector >= 99 %", "", &["line 4", "requirement[0].limit", "bipolar", "sectors"]),
        (
            "P(wrong_pole) <= 1 %",
            "motors = [\"reluctance-6k7\"]",
            &["line 4", "requirement[0].limit", "no magnet", "motor=reluctance-6k7", "P(|e| > 5 deg)"],
        ),
        (
            "rms <= 1 deg",
            "over.\"sensors.arrangement\" = [\"three-in-line\", \"none\"]",
            &[
                "r.toml: line 4",
                "requirement[0].limit",
                "requirement A",
                "sensors.arrangement=none",
                "detector.method",
            ],
        ),
        (
            "faults.currents-swapped: P(wrong_pole) <= 1 %",
            "over.\"sensors.arrangement\" = [\"three-in-line\", \"dc-link-shunt\"]",
            &["r.toml: line 4", "currents-swapped", "sensors.arrangement=dc-link-shunt"],
        ),
        (
            "faults.link-capacitor-aged: P(wrong_pole) <= 1 %",
            "",
            &["line 4", "requirement[0].limit", "link-capacitor-aged", "inverter.capacitance"],
        ),
    ] {
        let message = wrong(requirement("A", limit, more));
        assert!(parts.iter().all(|part| message.contains(part)), "{message}\n{parts:?}");
    }
}

#[test]
fn law_odds_decide_what_trials_leave_open_case_by_case_and_resume_to_the_same() {
    // The peak current that 59 of 60 starts do not exceed. A locked rotor, which computes less.
    let head = "detector.method = \"bipolar\"\n";
    let (plan, _) = scenario(head);
    let one = plan.scenario(0).expect("a scenario");
    let mut currents: Vec<f64> =
        records(&plan, &one, 0..1500).expect("runs").iter().map(|record| record.run.peak_current).collect();
    currents.sort_by(f64::total_cmp);
    let limit = currents[1475];
    let list = format!(
        "odds = \"quick\"\ntrials = 64\n{}",
        requirement(
            "I",
            &format!("P(current > {limit} A) <= 2 %"),
            "over.\"inverter.dead_time\" = [\"2 us\", \"2.1 us\"]"
        ),
    );
    let mut found = made(head, &list);
    let watch = Keeping::default();
    judged(&mut found, &watch);
    let claims: Vec<&Claim> = found.cases.iter().flat_map(|case| &case.claims).collect();
    assert_eq!(claims.len(), 4);
    assert!(claims.iter().all(|claim| claim.guards == claim.rare.is_none()), "guards are judged by trials");
    let shares: Vec<f64> =
        claims.iter().filter_map(|claim| Some(claim.rare.as_ref()?.probability.value)).collect();
    // Another dead time changes the peak current.
    assert!((shares[0] * 60.0 - 1.0).abs() < 0.5 && (shares[1] / shares[0] - 1.0).abs() > 0.1, "{shares:?}");
    let mut again = made(head, &list);
    judged(&mut again, &watch);
    assert_eq!(again.cases.iter().flat_map(|case| &case.claims).collect::<Vec<_>>(), claims);
}

/// Keys of the limit's fault give it a size and an onset of its own; it stays the same fault.
#[test]
fn law_the_fault_of_a_limit_may_have_its_own_size_and_onset() {
    let over = "over.\"faults.0.magnitude\" = [\"1 ohm\", \"3 ohm\"]\nover.\"faults.0.onset\" = [[\"1 ms\", \"2 ms\"]]";
    let limit = "faults.contact-resistance: coverage >= 99 %";
    let found = made(HEAD, &requirement("A", limit, over));
    for (case, ohms) in found.cases.iter().zip([1.0, 3.0]) {
        for plan in [Some(case.plan()), case.without.as_ref()] {
            let faults = plan.expect("has checks").scenario(0).expect("a scenario").faults;
            assert_eq!((faults.len(), faults[0].mode), (1, FaultMode::ContactResistance));
            assert_eq!((faults[0].size, faults[0].onset), ([ohms; 2], [1e-3, 2e-3]));
        }
        // On the command line the mode stands before its size, and each key once.
        let options = case.options();
        assert_eq!((options.len(), options[0].as_str()), (3, "faults.0.mode=contact-resistance"));
    }
    assert_eq!(found.cases.len(), 2);
    // With a fault of the scenario, the one of the limit is the second.
    let head = format!("{HEAD}[[faults]]\nmode = \"current-gain\"\nmagnitude = 1.1\n");
    let found = made(&head, &requirement("A", limit, "over.\"faults.1.magnitude\" = [\"1 ohm\"]"));
    let faults = found.cases[0].plan().scenario(0).expect("a scenario").faults;
    assert_eq!(faults.iter().map(|fault| fault.size[0]).collect::<Vec<_>>(), [1.1, 1.0]);
    for (over, words) in [
        ("over.\"faults.0.mode\" = [\"phase-open\"]", "a mode beside the one of the limit"),
        ("over.\"faults.0.magnitude\" = [\"1 V\"]", "a resistance from 0 to 10 kΩ"),
        ("over.\"faults.0.onse\" = [\"1 ms\"]", "onset"),
    ] {
        let (plan, document) = scenario(HEAD);
        let list = Requirements::parse(Path::new("r.toml"), &requirement("A", limit, over));
        let error = list.and_then(|list| Qualification::new(list, &plan, &document)).expect_err(over);
        let error = error.to_string();
        assert!(error.starts_with("r.toml: line 5:") && error.contains(words), "{error}");
    }
}
