mod drives;
mod fresh;
mod judged;
mod turning;

use std::path::Path;
use std::sync::LazyLock;

use standstill_sim::{Purpose, Streams};

use super::condition::rounded_up;
use super::*;

/// A motor whose pole needs more current than pulses of half the rated current reach: 7 pole pairs, 48 V, 60 A.
fn sheet(saturation: &str, keys: &[(&str, &str)]) -> Document {
    let text = format!(
        "[motor.nameplate]\npole_pairs = 7\nresistance = \"21 mΩ\"\nL_d = \"16 uH\"\nL_q = \"20 uH\"\nmagnet_flux = \"5.2 mWb\"\nrated_current = \"60 A\"\ndc_link = \"48 V\"\n{saturation}\n"
    );
    let mut document = Document::parse(Path::new("scenario"), &text).expect("TOML");
    for (key, value) in keys {
        document.set(key, value, Origin::CommandLine).expect("a key");
    }
    document
}

fn found(document: &Document) -> Suitability {
    Suitability::of(document, &Demands::default(), Effort::Normal, |_| {})
        .unwrap_or_else(|error| panic!("{error}"))
}

/// A limit of work that no check reaches.
const fn unbounded() -> Allowance {
    Allowance::new(u64::MAX)
}

const BIPOLAR: (&str, &str) = ("detector.method", "bipolar");

/// The document of a motor that saturates by 5 %, with the method `bipolar`, and the verdict, which takes seconds.
static SUITED: LazyLock<(Document, Suitability)> = LazyLock::new(|| {
    let document = sheet("saturation = \"5 %\"", &[BIPOLAR]);
    let suitability = found(&document);
    (document, suitability)
});

/// Demands that leave this motor too little current for its pole.
fn weak() -> Demands {
    Demands { current_a: Some(20.0), ..Demands::default() }
}

/// The verdict with the demands of [`weak`].
static WEAK: LazyLock<Suitability> = LazyLock::new(|| {
    let document = sheet("saturation = \"5 %\"", &[BIPOLAR]);
    Suitability::of(&document, &weak(), Effort::Normal, |_| {}).unwrap_or_else(|error| panic!("{error}"))
});

#[test]
fn regress_a_motor_that_a_longer_pulse_suits_is_suited() {
    let (document, suitability) = &*SUITED;
    let (candidate, fresh) = suitability.recommended().zip(suitability.confirmed()).expect("suited");
    assert_eq!((suitability.suited(), &suitability.advice), (Suited::Yes, &Vec::new()));
    // The pulse is longer than the default 20 µs and within rated current, and the current is the binding demand.
    let (key, pulse) = &candidate.setting.keys[0];
    let length: f64 = pulse.trim_end_matches(" us").parse().expect("a number");
    assert!(*key == "pulse" && (28.0..=42.0).contains(&length), "{pulse}");
    assert!(fresh.peak_current_a <= 60.0 && fresh.moved_deg <= 1.0, "{fresh:?}");
    assert!(fresh.p95_at_most_deg < 1.0 && fresh.without_angle_at_most <= 0.01, "{fresh:?}");
    assert!(fresh.wrong_poles == 0 && fresh.wrong_poles_at_most.is_some_and(|most| most < 1e-6), "{fresh:?}");
    assert_eq!(candidate.binding, Some(Demand::Current));
    // The document that goes on has these settings.
    let further = suitability.document(document).expect("keys").expect("recommended");
    assert_eq!(further.get("detector.pulse").and_then(|value| value.as_str()), Some(pulse.as_str()));
    // With a third of the current no settings are found, and more current helps.
    let weak = &*WEAK;
    assert_eq!(weak.suited(), Suited::No);
    assert!(weak.candidates[0].free.peak_current_a <= 20.0, "{:?}", weak.candidates[0]);
    let helps = |of: &Advice| of.helps.is_some();
    let current = |of: &Advice| of.demands.and_then(|demands| demands.current_a);
    assert!(weak.advice.iter().any(|of| helps(of) && current(of) == Some(40.0)), "{:?}", weak.advice);
    // Rated current is tried if less was allowed.
    assert!(weak.advice.iter().any(|of| helps(of) && current(of) == Some(60.0)), "{:?}", weak.advice);
    let bits = weak.advice.iter().find(|of| of.keys == [("sensors.bits", "16".to_owned())]);
    assert!(bits.is_some_and(|of| !helps(of)), "{:?}", weak.advice);
}

/// 2.2 kW, 6 pole pairs, 560 V: at 20 µs its pole stays open, and `bipolar` fell behind other methods.
#[test]
fn regress_a_machine_of_two_kilowatts_is_suited_by_pulses_both_ways() {
    let text = "[motor.nameplate]\npole_pairs = 6\nresistance = \"1.1 Ω\"\nL_d = \"18 mH\"\nL_q = \"33 mH\"\nmagnet_flux = \"0.16 Wb\"\nrated_current = \"4.9 A\"\ndc_link = \"560 V\"\nsaturation = \"6 %\"\n";
    let mut document = Document::parse(Path::new("scenario"), text).expect("TOML");
    document.set(BIPOLAR.0, BIPOLAR.1, Origin::CommandLine).expect("a key");
    let suitability = found(&document);
    let (candidate, fresh) = suitability.recommended().zip(suitability.confirmed()).expect("suited");
    assert_eq!((suitability.suited(), candidate.method()), (Suited::Yes, MethodName::Bipolar));
    assert!(fresh.p95_at_most_deg <= 0.5 && fresh.wrong_poles == 0, "{fresh:?}");
    assert!(fresh.peak_current_a <= 4.9 && fresh.moved_deg <= 1.0, "{fresh:?}");
}

/// Work is counted, so this is not a matter of the machine: a check that may do a part of what it takes does that part, finds what it
/// finds, never says "not suited" of what it has not tried, and names what is left.
/// promise: check-is-bounded
#[test]
fn law_a_check_does_no_more_than_it_may_and_names_what_it_left_out() {
    let (document, suited) = &*SUITED;
    for (demands, whole, expected) in
        [(Demands::default(), suited, Suited::Yes), (weak(), &*WEAK, Suited::No)]
    {
        let within = |most: u64| within(document, &demands, most);
        assert_eq!((whole.suited(), &whole.untried), (expected, &Vec::new()), "{whole:?}");
        assert!(whole.work < most_work(Effort::Normal), "{}", whole.work);
        let mut before = 0;
        for part in [1000, 6] {
            let most = whole.work / part;
            let found = within(most);
            assert_eq!(said(&found), said(&within(most)));
            // Starts that have begun are completed, eight side by side: some thousand evaluations each by default, 60,000 with 24 rounds.
            let begun = if part > 30 { 20_000 } else { 8 * 60_000 };
            assert!(found.work >= before && found.work < most + begun, "{} of {most}", found.work);
            before = found.work;
            assert!(matches!(found.suited(), Suited::Undecided) || found.suited() == expected, "{found:?}");
            let is_open = found.suited() == Suited::Undecided;
            assert_eq!(found.is_undecided, is_open);
            assert!(!(is_open && found.untried.is_empty()) && (part < 30 || is_open), "{found:?}");
            // The recommendation holds as if everything had been tried.
            if let Some(fresh) = found.confirmed() {
                assert!(fresh.peak_current_a <= 60.0 && fresh.without_angle_at_most <= 0.01, "{fresh:?}");
            }
        }
    }
}

fn within(document: &Document, demands: &Demands, most: u64) -> Suitability {
    Suitability::within(document, demands, most, &mut |_| {}).unwrap_or_else(|error| panic!("{error}"))
}

/// Figures of a rotor state that is not judged are NaN.
fn said(of: &Suitability) -> String {
    format!("{:?} {:?} {:?}", of.candidates, of.recommended, of.untried)
}

#[test]
#[ignore = "a verdict more; parts of one run by default: scripts/test-all.sh long"]
fn law_as_much_work_as_is_usual_finds_what_any_work_finds() {
    let (document, usual) = &*SUITED;
    let any = within(document, &Demands::default(), u64::MAX);
    assert_eq!((said(usual), usual.work), (said(&any), any.work));
}

/// A step with terminals' capacitances solves two oscillators, too.
#[test]
fn law_an_evaluation_with_terminals_counts_as_four() {
    let work = standstill_sim::Work { derivatives: 100, steps: 90, segments: 21, events: 9 };
    let document = drive(&[]);
    let motor = document.motor().expect("a motor");
    let mut bridge = document.scenario_of(&motor).expect("a scenario").drive.bridge;
    assert_eq!((bridge.terminal_capacitance, work::of_start(&work, &bridge)), (0.0, 110));
    bridge.terminal_capacitance = 1e-9;
    assert_eq!(work::of_start(&work, &bridge), 410);
}

/// Both states of the rotor object to the same thing: it is said once, with the figures of the worse.
#[test]
fn regress_an_objection_of_both_states_of_the_rotor_is_one() {
    let document = sheet("saturation = \"5 %\"", &[BIPOLAR]);
    let motor = document.motor().expect("a motor");
    let demands = Demands { current_a: Some(10.0), error_deg: 1e-6, ..Demands::default() };
    let work = unbounded();
    let bench = Bench::new(&document, &motor, &demands, &work);
    let of = |rotor| {
        let setting = Setting::plain(MethodName::Bipolar).with("pulse", "30 us");
        bench.starts(&setting, rotor, 0, 16).expect("runs").expect("set up")
    };
    let [locked, mut free] = [of(Rotor::Locked), of(Rotor::Free)];
    let alone = bench.objections(&[&locked]);
    assert!(alone.iter().all(|objection| objection.contains("rotor locked,")), "{alone:?}");
    free.summary.peak_current_a = locked.summary.peak_current_a + 1.0;
    free.summary.p95_deg.value = 0.5 * locked.summary.p95_deg.value;
    let said = bench.objections(&[&locked, &free]);
    let about =
        |subject: &str| said.iter().find(|objection| objection.contains(subject)).expect("an objection");
    assert_eq!(alone.len(), said.len(), "{said:?}");
    assert!(about(" A,").contains("rotor free (locked too), where 10.00 A are allowed"), "{said:?}");
    assert!(about("95 of 100").contains("rotor locked (free too), where 0.000001° are demanded"), "{said:?}");
    // Starts that could not be simulated to their end have no angle, and a detection may take too long.
    free.summary.errors = 5;
    free.longest_s = 2.0 * demands.time_s;
    let late = bench.objections(&[&free]);
    assert!(late.iter().any(|of| of.starts_with("5 of 16 without an angle, rotor free")), "{late:?}");
    assert!(late.iter().any(|of| of.contains(" ms, rotor free, where ")), "{late:?}");
    (free.summary.errors, free.longest_s) = (0, 0.0);
    // Only a free rotor's movement counts.
    free.summary.max_moved_deg = 3.0;
    let moved = bench.objections(&[&locked, &free]);
    assert!(moved.contains(&"a free rotor moves by 3.00° where 1° are allowed".to_owned()), "{moved:?}");
}

#[test]
fn law_demands_are_relaxed_by_what_the_margins_say_and_then_hold() {
    // If the user gives the settings, no settings are searched.
    let given = [BIPOLAR, ("rotor.state", "free"), ("detector.rounds", "3"), ("detector.pulse", "34 us")];
    let document = sheet("saturation = \"5 %\"", &given);
    let demands = Demands { movement_deg: 0.002, ..Demands::default() };
    let weak = Suitability::of(&document, &demands, Effort::Normal, |_| {})
        .unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(weak.suited(), Suited::No);
    let relaxed = weak.advice.iter().find_map(|of| of.demands.filter(|_| of.helps.is_some()));
    let relaxed = relaxed.unwrap_or_else(|| panic!("{:?}", weak.advice));
    assert!(relaxed.movement_deg > 0.002 && relaxed.movement_deg < 0.1, "{relaxed:?}");
    let demands = Demands { movement_deg: relaxed.movement_deg, ..demands };
    assert_eq!(relaxed, demands);
    let again = Suitability::of(&document, &demands, Effort::Normal, |_| {})
        .unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(again.suited(), Suited::Yes, "{again:?}");
}

#[test]
fn regress_each_count_has_its_own_reason() {
    // In some starts the saliency is just below the required one; the others have pulses too short for the pole.
    let keys = [BIPOLAR, ("detector.pulse", "20 us"), ("detector.least_saliency", "11 %")];
    let document = sheet("saturation = \"5 %\"", &keys);
    let motor = document.motor().expect("a motor");
    let demands = Demands::default();
    let work = unbounded();
    let bench = Bench::new(&document, &motor, &demands, &work);
    let setting = Setting::plain(MethodName::Bipolar);
    let starts = bench.starts(&setting, Rotor::Free, bench::SEARCH, 200).expect("runs").expect("set up");
    let (failed, undetermined) = (starts.failed(), starts.summary.undetermined);
    assert!(failed > 2 && undetermined > failed, "{failed} {undetermined}");
    assert_eq!(starts.failures.values().sum::<u64>(), failed);
    let objections = bench.objections(&[&starts]);
    assert!(
        objections[0].starts_with(&format!("{failed} of 200 without an angle, rotor free: no saliency")),
        "{objections:?}"
    );
    assert!(
        objections.contains(&format!("pole undetermined in {undetermined} of 200, rotor free")),
        "{objections:?}"
    );
}

#[test]
fn law_a_sheet_without_saturation_is_suited_from_some_saturation_on() {
    let document = sheet("", &[BIPOLAR]);
    let mut steps = 0;
    let suitability = Suitability::within(&document, &Demands::default(), u64::MAX, &mut |progress| {
        steps += usize::from(matches!(progress, Progress::Saturation(_)));
    });
    let suitability = suitability.unwrap_or_else(|error| panic!("{error}"));
    // With evidence in proportion to the saturation the smallest one is predicted: bisection of 0.5 to 15 % to ends 8 % apart takes eight
    // steps.
    assert!((2..=6).contains(&steps), "{steps}");
    let Some(Condition::Saturation { least, most, minus_d }) = suitability.condition else {
        panic!("{suitability:?}")
    };
    assert_eq!(suitability.untried, [""; 0]);
    // With less work than a search takes, settings that suffice on few starts are confirmed first, with a little more saturation.
    let hurried = Suitability::within(&document, &Demands::default(), suitability.work / 5 * 3, &mut |_| {});
    let hurried = hurried.unwrap_or_else(|error| panic!("{error}"));
    let Some(Condition::Saturation { least: more, .. }) = hurried.condition else { panic!("{hurried:?}") };
    assert!((1.05..1.5).contains(&(more / least)), "{more} {least}");
    assert!(hurried.untried.iter().any(|part| part.contains("saturation of less than")), "{hurried:?}");
    assert!(hurried.work < suitability.work / 5 * 3 + 20_000, "{}", hurried.work);
    // The recommended pulses keep the current at both ends: with the most saturation they draw the most.
    let candidate = suitability.recommended().expect("recommended");
    let fresh = suitability.confirmed().expect("confirmed");
    let at_the_most = sheet(&format!("saturation = \"{} %\"", 100.0 * most), &[BIPOLAR]);
    let motor = at_the_most.motor().expect("a motor");
    let demands = Demands::default();
    let work = unbounded();
    let strained = Bench::new(&at_the_most, &motor, &demands, &work);
    let starts = strained.starts(&candidate.setting, Rotor::Free, 100, 400).expect("runs").expect("set up");
    assert_eq!(strained.objections(&[&starts]), [""; 0]);
    assert!(starts.summary.peak_current_a > 1.01 * candidate.free.peak_current_a, "{starts:?}");
    assert!(fresh.peak_current_a > 1.01 * candidate.free.peak_current_a, "{fresh:?}");
    assert_eq!((suitability.suited(), suitability.pole_is_open()), (Suited::If, false));
    assert!((0.01..0.05).contains(&least) && (-0.05..0.0).contains(&minus_d), "{least} {minus_d}");
    let further = suitability.document(&document).expect("keys").expect("recommended");
    assert!(further.motor().expect("a motor").saturation_is_known());
    // Half of this saturation is not enough, whatever the settings.
    let half = format!("saturation = \"{} %\"", standstill_quantity::rounded(least / 2.0, 2));
    let demands = Demands::default();
    let document = sheet(&half, &[BIPOLAR]);
    let motor = document.motor().expect("a motor");
    let work = unbounded();
    let bench = Bench::new(&document, &motor, &demands, &work);
    let looks = bench.search(MethodName::Bipolar).expect("runs").looks;
    assert!(!looks.is_empty() && looks.iter().all(|look| !look.margins.is_kept()), "{looks:?}");
}

#[test]
fn analytic_shares_are_rounded_up_to_two_digits() {
    assert_eq!([0.0312, 0.031, 0.1, 0.0999].map(rounded_up), [0.032, 0.031, 0.1, 0.1]);
}

/// A drive with these sensors on the paper's motor.
fn drive(keys: &[(&str, &str)]) -> Document {
    let mut document = Document::parse(Path::new("scenario"), "motor = \"paper-5k5\"").expect("TOML");
    for (key, value) in keys {
        document.set(key, value, Origin::CommandLine).expect("a key");
    }
    document
}

const NO_CURRENTS: (&str, &str) = ("sensors.arrangement", "none");
const TERMINALS: (&str, &str) = ("sensors.terminals", "true");
const TIMER: (&str, &str) = ("sensors.timer", "0.32 us");
