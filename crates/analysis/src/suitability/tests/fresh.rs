//! Fresh starts, and the order in which a check says what it knows.

use super::super::bench::Look;
use super::super::condition::{Tried, with_range};
use super::super::starts::Spread;
use super::*;

#[test]
fn law_what_is_confirmed_was_seen_by_no_search() {
    let document = sheet("saturation = \"5 %\"", &[BIPOLAR]);
    let motor = document.motor().expect("a motor");
    let (demands, work) = (Demands::default(), unbounded());
    let bench = Bench::new(&document, &motor, &demands, &work);
    let setting = Setting::plain(MethodName::Bipolar).with("pulse", "30 us");
    let seed = bench.scenario(&setting, Rotor::Locked).expect("a scenario").seed;
    let starts = |draws, trials| {
        [Rotor::Locked, Rotor::Free]
            .map(|rotor| bench.starts(&setting, rotor, draws, trials).expect("runs").expect("set up").summary)
    };
    let peak = |of: &[standstill_campaign::Summary; 2]| of[0].peak_current_a.max(of[1].peak_current_a);
    let mut peaks = vec![peak(&starts(0, 500)), peak(&starts(1, 500))];
    for failed in [0, 1, 2] {
        let fresh = bench.confirm(&setting, failed).expect("runs").expect("holds");
        // The reported seed is that of the starts, and no other attempt used it: neither the search, nor the sifting, nor an attempt
        // before.
        let seen = starts(fresh.seed - seed, 500);
        assert_eq!((fresh.starts, fresh.peak_current_a), (1000, peak(&seen)), "{fresh:?}");
        assert!(!peaks.contains(&peak(&seen)), "{peaks:?} {fresh:?}");
        peaks.push(peak(&seen));
        assert_eq!(fresh.p95_at_most_deg, seen[0].p95_deg.high.max(seen[1].p95_deg.high));
        assert_eq!(fresh.moved_deg, seen[1].max_moved_deg);
        // Each earlier attempt takes 5 % of the confidence.
        assert!((fresh.confidence - (0.95 - 0.05 * failed as f64)).abs() < 1e-12, "{fresh:?}");
    }
    // A demand within the interval is not shown, however many starts keep it.
    let [few, many] = [500, 2000].map(|trials| starts(2, trials).map(|of| of.p95_deg));
    let value = few.iter().chain(&many).map(|p95| p95.value).fold(0.0, f64::max);
    let high = many.iter().map(|p95| p95.high).fold(0.0, f64::max);
    assert!(value < high, "{few:?} {many:?}");
    let strict = Demands { error_deg: 0.5 * (value + high), ..demands };
    let bench = Bench::new(&document, &motor, &strict, &work);
    let why = bench.confirm(&setting, 0).expect("runs").expect_err("not shown").objections.join("; ");
    assert!(why.contains("2000 fresh starts leave room for a p95"), "{why}");
}

/// `check` reports its findings on each method before it confirms one, and recommends one of these methods.
#[test]
fn law_a_check_says_of_each_method_what_it_found_before_it_confirms_one() {
    let text = "motor = \"paper-5k5\"\nerrors = \"default\"\n[detector]\npulse = \"200 us\"\nrounds = 3\n";
    let document = Document::parse(Path::new("scenario"), text).expect("TOML");
    let (mut found, mut confirming) = (Vec::new(), None);
    let suitability =
        Suitability::of(&document, &Demands::default(), Effort::Quick, |progress| match progress {
            Progress::Found(candidate) => found.push((candidate.method(), candidate.objections.clone())),
            Progress::Confirming(_) => confirming = confirming.or(Some(found.len())),
            _ => {}
        })
        .unwrap_or_else(|error| panic!("{error}"));
    let all: Vec<MethodName> = suitability.candidates.iter().map(Candidate::method).collect();
    assert!(all.len() > 1 && confirming == Some(all.len()), "{confirming:?} {found:?}");
    assert!(all.iter().all(|method| found.iter().any(|(of, _)| of == method)), "{all:?} {found:?}");
    let recommended = suitability.recommended().expect("suited");
    let (best, others): (Vec<_>, Vec<_>) =
        suitability.candidates.iter().partition(|of| of.method() == recommended.method());
    assert!(best[0].objections.is_empty() && found.contains(&(best[0].method(), Vec::new())), "{found:?}");
    // No other method without objections has a larger margin.
    for other in others.iter().filter(|of| of.objections.is_empty()) {
        let counted = |of: &Candidate| Spread::of(of.settings).is_counted();
        assert!(counted(other) || other.margin() <= recommended.margin(), "{suitability:?}");
    }
}

/// Settings that few starts object to are not confirmed on many: each confirmation takes a part of the error probability.
#[test]
fn law_settings_with_an_objection_are_not_confirmed() {
    let weak = Demands { current_a: Some(20.0), ..Demands::default() };
    let (mut confirmed, mut changed) = (0, false);
    let document = sheet("saturation = \"5 %\"", &[BIPOLAR]);
    let suitability = Suitability::of(&document, &weak, Effort::Quick, |progress| match progress {
        Progress::Change(_) => changed = true,
        Progress::Confirming(_) if !changed => confirmed += 1,
        _ => {}
    })
    .unwrap_or_else(|error| panic!("{error}"));
    assert!(!suitability.candidates[0].objections.is_empty() && changed, "{suitability:?}");
    assert_eq!(confirmed, 0);
}

/// The current of a pulse grows with the saturation, so settings for a range of saturation must suffice at both of its ends.
#[test]
fn law_settings_of_a_range_of_saturation_suffice_at_both_ends() {
    let document = sheet("", &[BIPOLAR]);
    let setting = Setting::plain(MethodName::Bipolar).with("pulse", "30 us");
    let work = unbounded();
    let peak = |share| {
        with_range(&document, &Demands::default(), &work, [share; 2], |bench| {
            let starts = bench.starts(&setting, Rotor::Free, 0, 64)?.expect("set up");
            Ok(starts.summary.peak_current_a)
        })
    };
    let [least, most] = [0.05, 0.15].map(|share| peak(share).expect("runs").expect("a key"));
    assert!(most > 1.02 * least, "{least} {most}");
    let suffices = |range: [f64; 2], current_a| {
        let demands = Demands { current_a: Some(current_a), ..Demands::default() };
        let found = with_range(&document, &demands, &work, range, |bench| {
            bench.answers(&mut [Tried::new(setting.clone())], range[0])
        });
        found.expect("runs").expect("a key").sufficing.is_some()
    };
    let between = 0.5 * (least + most);
    assert!(suffices([0.05, 0.05], between) && suffices([0.05, 0.15], 60.0));
    assert!(!suffices([0.05, 0.15], between));
}

/// Fresh starts that are too few to show a demand leave it open; those that miss one do not.
#[test]
fn law_too_few_starts_refute_nothing() {
    let (document, found) = &*SUITED;
    let setting = &found.recommended().expect("suited").setting;
    let motor = document.motor().expect("a motor");
    let refused = |demands: Demands| {
        let work = unbounded();
        let bench = Bench::new(document, &motor, &demands, &work);
        match bench.confirm(setting, 0) {
            Ok(Err(refused)) => refused,
            _ => panic!("refused"),
        }
    };
    // None in 2,000 is at most 1.8 in a thousand.
    let open = refused(Demands { without_angle: 1e-3, ..Demands::default() });
    assert!(open.is_open && open.objections[0].contains("leave room"), "{open:?}");
    // More starts than a check runs show it.
    assert_eq!(open.wanting.map(|of| of.starts), Some(37_000));
    let missed = refused(Demands { error_deg: 1e-3, ..Demands::default() });
    assert!(!missed.is_open && missed.objections[0].contains("are demanded"), "{missed:?}");
    assert_eq!(missed.wanting, None);
}

/// At most three settings are tried on fresh starts, and the first that these confirm is taken.
#[test]
fn law_the_first_settings_that_fresh_starts_confirm_are_taken() {
    let (document, found) = &*SUITED;
    let motor = document.motor().expect("a motor");
    let (demands, work) = (Demands::default(), unbounded());
    let bench = Bench::new(document, &motor, &demands, &work);
    let look = |setting: Setting| bench.look(setting, 16).expect("runs").expect("can be set up");
    let good = look(found.recommended().expect("suited").setting.clone());
    let weak = look(good.setting.with("pulse", "20 us"));
    let settled = |looks: &[&Look]| {
        let mut failed = 0;
        let looks = looks.iter().copied().enumerate();
        let (place, judged) = bench.settled(looks, &mut failed, &mut |_| {}).expect("runs");
        (place, judged.err().map(|refused| refused.objections))
    };
    assert_eq!(settled(&[&good, &weak]), (0, None));
    assert_eq!(settled(&[&weak, &weak, &good]), (2, None));
    let (place, why) = settled(&[&weak, &weak, &weak, &good]);
    assert!(place == 0 && why.is_some_and(|why| !why.is_empty()));
}
