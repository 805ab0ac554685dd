//! Drives with few sensors, and methods of sectors.

use super::*;

#[test]
fn law_only_methods_whose_readings_the_drive_has_are_tried() {
    use MethodName::{OpenTerminal, SixPulse};
    let tried = |keys: &[(&str, &str)]| {
        let document = drive(keys);
        let motor = document.motor().expect("a motor");
        candidate::methods(&document, &motor, &Demands::default(), &unbounded())
    };
    let both = |keys: &[(&str, &str)]| tried(keys).unwrap_or_else(|error| panic!("{error}"));
    let names = |keys: &[(&str, &str)]| both(keys).0;
    assert_eq!(names(&[]), CANDIDATES[..5]);
    assert_eq!(names(&[TERMINALS, TIMER]), CANDIDATES);
    let one_shunt = [("sensors.arrangement", "dc-link-shunt")];
    // Injections through windows of shifted edges.
    assert_eq!(names(&one_shunt), CANDIDATES[..5]);
    assert_eq!(names(&[NO_CURRENTS, TERMINALS]), [OpenTerminal]);
    assert_eq!(names(&[NO_CURRENTS, TIMER]), [SixPulse]);
    let message = tried(&[NO_CURRENTS]).expect_err("nothing is read").to_string();
    assert!(message.contains("neither currents nor voltages") && message.contains("needed"), "{message}");
    // The methods that lack a check are named, and no others.
    for (more, last) in [(None, 5), (Some(TERMINALS), 6)] {
        let keys: Vec<_> = more.into_iter().chain([("detector.checks", "[\"contact\"]")]).collect();
        let (candidates, left_out) = both(&keys);
        let left: Vec<MethodName> = left_out.iter().map(|of| of.method).collect();
        let others: Vec<MethodName> =
            CANDIDATES[..last].iter().copied().filter(|of| *of != MethodName::Bipolar).collect();
        assert_eq!((candidates, left), (vec![MethodName::Bipolar], others));
    }
    // The only method that this drive serves does not have the key.
    let refused = tried(&[NO_CURRENTS, TIMER, ("detector.pulse", "100 us")]).expect_err("no pulse");
    assert!(refused.to_string().contains("detector.pulse"), "{refused}");
}

/// Few starts, so wrong poles are not counted in many: what is tried here is the way from sensors to settings that run.
#[test]
fn law_what_is_recommended_runs_on_a_drive_without_current_sensors() {
    let demands = Demands { wrong_poles: 0.02, ..Demands::default() };
    for (method, sensor, key) in
        [(MethodName::OpenTerminal, TERMINALS, "pulse"), (MethodName::SixPulse, TIMER, "threshold")]
    {
        let document = drive(&[NO_CURRENTS, sensor]);
        let suitability = Suitability::of(&document, &demands, Effort::Normal, |_| {})
            .unwrap_or_else(|error| panic!("{error}"));
        let candidate = suitability.recommended().unwrap_or_else(|| panic!("{suitability:?}"));
        assert_eq!(candidate.method(), method);
        assert!(candidate.setting.keys.iter().any(|(set, _)| *set == key), "{:?}", candidate.setting);
        let fresh = suitability.confirmed().expect("confirmed");
        assert!(fresh.peak_current_a <= 8.0 && fresh.p95_at_most_deg < 1.0, "{fresh:?}");
        // The readings that the drive has bound the error, too.
        let limit = suitability.limit.map(|limit| limit.scheme_deg);
        assert!(limit.is_none_or(|limit| limit > 0.0 && limit < fresh.p95_at_most_deg), "{limit:?}");
        assert!(fresh.counted == Some(fresh.starts) && fresh.wrong_poles == 0, "{fresh:?}");
        let further = suitability.document(&document).expect("keys").expect("recommended");
        let motor = further.motor().expect("a motor");
        let scenario = further.scenario_of(&motor).unwrap_or_else(|error| panic!("{error}"));
        let right = (0..40).filter(|trial| {
            scenario.trial(1000 + trial).is_ok_and(|record| record.pole_correct() == Some(true))
        });
        assert!(right.count() >= 39);
    }
}

#[test]
fn law_the_least_evidence_of_a_normal_distribution_is_its_first_percentile() {
    let document = drive(&[NO_CURRENTS, TERMINALS]);
    let motor = document.motor().expect("a motor");
    let demands = Demands::default();
    let work = unbounded();
    let bench = Bench::new(&document, &motor, &demands, &work);
    let setting = Setting::plain(MethodName::OpenTerminal);
    let mut starts = bench.starts(&setting, Rotor::Locked, 0, 16).expect("runs").expect("set up");
    assert_eq!(starts.spread, starts::Spread::OverAngles);
    let mut draws = Streams::new(1, 0).open(Purpose::CurrentNoise);
    starts.evidence = (0..40_000).map(|_| 3.0 + 0.5 * draws.normal()).collect();
    starts.evidence.sort_by(f64::total_cmp);
    assert!((starts.least_evidence() - (3.0 - 0.5 * 2.326)).abs() < 0.02, "{}", starts.least_evidence());
    // Normally distributed evidence, eight deviations from a wrong pole, shows how rare wrong poles are; after the first wrong pole they
    // are counted.
    starts.spread = starts::Spread::Normal;
    (starts.summary.trials, starts.summary.wrong_poles) = (40_000, 0);
    assert!(starts.wrong_poles_at_most() < 1e-12, "{}", starts.wrong_poles_at_most());
    starts.summary.wrong_poles = 1;
    let counted = standstill_campaign::binomial_interval(1, 40_000).high;
    assert_eq!(starts.wrong_poles_at_most(), counted);
    // Evidence with a lower bound over the angles, as between two of six directions: the estimate stays near this bound.
    starts.spread = starts::Spread::OverAngles;
    starts.evidence =
        (0..200).map(|k| 2.3 + 4.0 * standstill_numeric::sin(f64::from(k) * 0.5 / 200.0)).collect();
    let least = starts.least_evidence();
    assert!(2.15 < least && least < 2.35, "{least}");
}

/// The middle of a sector is up to 30° from the rotor, six times what an angle may be: a sector is judged by what is beyond it.
#[test]
fn law_a_sector_is_judged_by_its_own_demand() {
    let sector = [NO_CURRENTS, TIMER, ("detector.method", "six-pulse"), ("detector.sector", "60 deg")];
    let document = drive(&sector);
    let motor = document.motor().expect("a motor");
    let demands = Demands::default();
    let work = unbounded();
    let bench = Bench::new(&document, &motor, &demands, &work);
    let setting = Setting::plain(MethodName::SixPulse).with("threshold", "6 A");
    let starts = bench.starts(&setting, Rotor::Locked, bench::SEARCH, 200).expect("runs").expect("set up");
    let sectors = starts.summary.sectors.expect("sectors");
    assert!(sectors.half_width_deg == 30.0 && sectors.named > 190 && sectors.further == 0, "{sectors:?}");
    assert!(sectors.right + sectors.at_border == sectors.named && sectors.right > 190, "{sectors:?}");
    // An angle of this method is off by some 0.1°, so a rotor may be that far beyond the border of its sector.
    let margins = bench.margins(&[&starts]);
    assert!(starts.summary.max_deg < 1.0 && margins.error > 5.0, "{margins:?}");
    let said = bench.objections(&[&starts]);
    assert!(!said.iter().any(|objection| objection.contains("errors within")), "{said:?}");
    // The records behind it are up to 30° from the middle, and no event of 1° beyond it.
    let scenario = bench.scenario(&setting, Rotor::Locked).expect("a scenario");
    let records: Vec<_> = (0..40).map(|trial| scenario.trial(trial).expect("settings")).collect();
    let errors = records.iter().filter_map(standstill_scenario::Record::axis_error_deg);
    assert!(errors.map(f64::abs).fold(0.0, f64::max) > 25.0);
    for record in records.iter().filter(|record| record.axis_error_deg().is_some()) {
        let error = record.axis_error_deg().expect("an axis").abs();
        let towards = crate::Event::Error(1.0).value(record);
        assert!((towards - (error - 31.0)).abs() < 1e-9 && towards < 0.0, "{error} {towards}");
        let limits: crate::limit::Limits = "p95 <= 1 deg".parse().expect("a limit");
        let mut tally = crate::limit::Tally::new(&limits);
        tally.add(record);
        let found = record.pole_correct().is_some();
        assert!(!found || tally.values()[0][0] == (error - 30.0).max(0.0), "{error}");
    }
}

/// Iron that saturates by 0.6 % at rated current: the poles' currents differ by 0.4 % there, and by several times that at three times the current.
#[test]
fn regress_poles_that_differ_only_beyond_rated_current_are_told_apart_there() {
    let keys = [("detector.method", "bipolar"), ("detector.rounds", "8"), ("sensors.range", "250 A")];
    let document = sheet("saturation = \"0.6 %\"", &keys);
    let at = |current| {
        let demands = Demands { current_a: Some(current), ..Demands::default() };
        let found = Suitability::of(&document, &demands, Effort::Quick, |_| {});
        found.unwrap_or_else(|error| panic!("{error}"))
    };
    let strong = at(180.0);
    let (signature, difference) = strong.strongest.expect("no map");
    assert!(signature == Signature::Normal && difference > 0.01, "{difference}");
    let candidate = strong.recommended().unwrap_or_else(|| panic!("{strong:?}"));
    assert!(candidate.setting.keys.contains(&("signature", "normal".to_owned())), "{:?}", candidate.setting);
    assert!(strong.confirmed().is_some_and(|of| of.wrong_poles == 0 && of.peak_current_a > 100.0));
    // With less, more current is among what is tried, for the poles are not alike.
    let weak = at(60.0);
    assert!(weak.alike_up_to_a.is_none() && weak.suited() != Suited::Yes, "{weak:?}");
    let more = |of: &Advice| of.change == "3 times the current, 180 A (if the magnets bear it)";
    assert!(
        weak.advice.iter().any(more) || weak.untried.iter().any(|of| of.starts_with("3 times")),
        "{weak:?}"
    );
    // If no such current distinguishes the poles, there is no such advice.
    let none = sheet("saturation = \"0 %\"", &keys);
    let none = Suitability::of(&none, &Demands::default(), Effort::Quick, |_| {}).expect("a check");
    assert!(none.alike_up_to_a == Some(180.0) && none.advice.is_empty(), "{none:?}");
}

/// Settings that hold, and lack but the starts that show how rare wrong poles are, call for those starts, not for another sensor.
#[test]
fn regress_a_lack_of_starts_is_no_reason_for_another_sensor() {
    let document = drive(&[NO_CURRENTS, TIMER]);
    let found = Suitability::of(&document, &Demands::default(), Effort::Quick, |_| {}).expect("a check");
    let open = found.open().unwrap_or_else(|| panic!("{found:?}"));
    let seed = document.load().expect("a scenario").seed;
    let wanting = open.wanting.expect("starts");
    assert_eq!((found.suited(), wanting.starts), (Suited::Undecided, 37_000));
    assert!(wanting.seed > seed + 1, "{wanting:?}: not those of the search and the sifting");
    assert!(open.objections[0].contains("fresh starts hold"), "{:?}", open.objections);
    assert!(found.alternatives.is_empty() && found.advice.is_empty(), "{found:?}");
}

/// Vectors follow an axis: where an injection is too weak to find one, a stronger one shows the current that they can have.
#[test]
fn regress_an_injection_too_weak_for_an_axis_is_no_limit_of_the_vectors() {
    let hub = "[motor.nameplate]\npole_pairs = 23\nresistance_line_to_line = \"130 mΩ\"\nL_line_to_line_min = \"0.24 mH\"\nL_line_to_line_max = \"0.29 mH\"\nKv = \"9.5 rpm/V\"\nrated_current_rms = \"15 A\"\ndc_link = \"48 V\"\nsaturation = \"4 %\"\n";
    let document = Document::parse(Path::new("hub.toml"), hub).expect("TOML");
    let motor = document.motor().expect("a motor");
    let (demands, work) = (Demands::default(), unbounded());
    let bench = Bench::new(&document, &motor, &demands, &work);
    let plain = Setting::plain(MethodName::HfiRotating);
    let starts = bench.starts(&plain, Rotor::Locked, bench::SEARCH, 12).expect("runs");
    assert!(starts.is_ok_and(|starts| 2 * starts.failed() > 12));
    let found = bench.search(MethodName::HfiRotating).expect("runs");
    let best = &found.looks[0];
    // Four fifths of the current at least; without an axis it was a third.
    assert!(best.margins.current < 1.25, "{best:?}");
    assert!(best.setting.keys.iter().any(|(key, _)| *key == "voltage"), "{best:?}");
    assert!(found.stop.is_some(), "the link of 48 V drives more");
}

/// If the given pulse is too short to tell the poles, `check` advises another pulse and no other sensor.
#[test]
fn regress_a_given_pulse_is_left_to_the_search_before_anything_is_bought() {
    let document = sheet("saturation = \"5 %\"", &[BIPOLAR, ("detector.pulse", "12 us")]);
    let found = found(&document);
    assert_eq!(found.suited(), Suited::No, "{found:?}");
    assert_eq!(found.candidates[0].given, Some("pulse"));
    let [advice] = &found.advice[..] else { panic!("{:?}", found.advice) };
    assert_eq!((&advice.frees[..], &advice.keys[..]), (&["pulse"][..], &[][..]));
    let pulse = advice.helps.as_ref().and_then(|of| of.keys.iter().find(|(key, _)| *key == "pulse"));
    assert!(pulse.is_some(), "{advice:?}");
}
