//! What every method says for the pole that it names or leaves open, in closed loop.
#![allow(clippy::disallowed_methods, reason = "tests compare with the C library")]

use standstill_detect::{
    Method, MethodName, Nameplate, PolarityRule, SequentialSettings, Settings, Signature,
};
use standstill_interface::{Angle, Outcome, PoleEvidence};
use standstill_inverter::OpenLeg;
use standstill_plant::built_in;
use standstill_scenario::{ErrorSet, Scenario, Specimen};
use standstill_sim::{Ended, NoProbe, RotorState, run};

fn scenario(method: MethodName, motor: &str, errors: ErrorSet) -> Scenario<Method<f64>> {
    let motor = built_in(motor).expect("built in");
    Scenario::of_method(method, motor, errors, RotorState::Locked, 1)
}

/// How trials end on a rotor held at an angle of its own, or at 50° with the noise alone drawn anew; and where its north is.
fn outcomes(
    scenario: &Scenario<Method<f64>>,
    trials: u64,
    noise_alone: bool,
) -> Vec<(Outcome<f64>, Angle<f64>)> {
    let of = |trial| {
        let specimen = Specimen { drive: 0, noise: trial };
        let case = if noise_alone { scenario.case_at(0.9, specimen) } else { scenario.case(trial) };
        let mut detector = scenario.detector.detector().expect("settings");
        let run = run(&case, &mut detector, false, &mut NoProbe);
        let Ended::Outcome(outcome) = run.ended else { panic!("{:?}", run.ended) };
        (outcome, Angle::from_radians(run.end_angle))
    };
    (0..trials).map(of).collect()
}

/// How many trials, of methods that take milliseconds or seconds.
fn few(method: MethodName) -> u64 {
    match method {
        MethodName::LineInductance | MethodName::Subdivision => 4,
        MethodName::HfiRotating | MethodName::HfiPulsating => 2,
        MethodName::DcAlignment => 0,
        _ => 30,
    }
}

#[test]
fn law_a_pole_is_named_exactly_where_its_evidence_is_enough() {
    let (mut found, mut open) = (0, 0);
    for motor in ["paper-5k5", "pm-reluctance", "surface-magnet"] {
        for method in MethodName::ALL {
            for errors in [ErrorSet::Default, ErrorSet::Harsh] {
                let scenario = scenario(method, motor, errors);
                for (outcome, north) in outcomes(&scenario, few(method), false) {
                    if matches!(outcome, Outcome::Failed { .. }) {
                        assert_eq!(outcome.evidence_for(north), None);
                        continue;
                    }
                    let PoleEvidence { deviations, needed } =
                        outcome.findings().pole_evidence.expect("a signature");
                    let named = matches!(outcome, Outcome::Found { .. });
                    assert_eq!(deviations.abs() >= needed, named, "{motor} {method}: {outcome:?}");
                    let towards = outcome.evidence_for(north).expect("a signature");
                    assert!(!named || (towards > 0.0 && deviations > 0.0), "{motor} {method}: {outcome:?}");
                    found += u32::from(named);
                    open += u32::from(!named);
                }
            }
        }
    }
    assert!(found > 300 && open > 10, "{found} {open}");
}

#[test]
fn law_evidence_tells_a_wrong_signature_and_is_none_without_one() {
    for method in MethodName::ALL.into_iter().filter(|method| few(*method) > 0) {
        let configured = |signature| {
            let motor = built_in("paper-5k5").expect("built in");
            let mut scenario = Scenario::of_method(method, motor, ErrorSet::Default, RotorState::Locked, 1);
            let drive = Nameplate { signature, pulse_signature: signature, ..scenario.nameplate() };
            scenario.detector = Method::suited(method, &drive);
            outcomes(&scenario, 2, false)
        };
        let evidence = |(outcome, north): &(Outcome<f64>, Angle<f64>)| outcome.evidence_for(*north);
        for (right, wrong) in configured(Signature::Normal).iter().zip(&configured(Signature::Inverted)) {
            let (right, wrong) =
                (evidence(right).expect("a signature"), evidence(wrong).expect("a signature"));
            assert!(right > 0.0 && (right + wrong).abs() < 1e-9 * right, "{method}: {right} {wrong}");
        }
        assert!(configured(Signature::None).iter().all(|none| evidence(none).is_none()), "{method}");
    }
    // An alignment turns the rotor to a known angle: its readings say that it followed, not which pole came.
    let aligned = Scenario::of_method(
        MethodName::DcAlignment,
        built_in("paper-5k5").expect("built in"),
        ErrorSet::None,
        RotorState::Free,
        1,
    );
    let (outcome, north) = outcomes(&aligned, 1, false)[0];
    assert!(matches!(outcome, Outcome::Found { .. }) && outcome.evidence_for(north).is_none(), "{outcome:?}");
}

#[test]
fn law_noise_alone_scatters_the_evidence_by_about_one_deviation() {
    // The readings from which a method knows its noise: three phases of eleven waits or more; 18 pulses in six groups;
    // samples without number.
    for (method, sequential, known_from) in [
        (MethodName::LineInductanceFast, false, 33.0),
        (MethodName::LineInductanceFast, true, 39.0),
        (MethodName::Bipolar, false, 12.0),
        (MethodName::MaximumLikelihood, false, f64::INFINITY),
    ] {
        let mut scenario = scenario(method, "paper-5k5", ErrorSet::Noise);
        if sequential {
            let rule = PolarityRule::Sequential(SequentialSettings::new(0.1));
            scenario.detector.polarity_mut().expect("a polarity test").rule = rule;
        }
        let all: Vec<f64> = outcomes(&scenario, 200, true)
            .iter()
            .map(|(outcome, north)| outcome.evidence_for(*north).expect("a signature"))
            .collect();
        assert!(all.iter().all(|evidence| *evidence > 0.0), "{method}: {all:?}");
        let n = all.len() as f64;
        let mean = all.iter().sum::<f64>() / n;
        let deviation = (all.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / n).sqrt();
        // One for the evidence, and what an estimate of the noise from so few readings makes of its mean.
        let expected = (1.0 + mean * mean / (2.0 * known_from)).sqrt();
        assert!((0.6..1.25).contains(&(deviation / expected)), "{method}: {mean} {deviation} {expected}");
    }
}

/// What maximum likelihood sees of the poles where terminals ring, and why some stay open: medians as shares of the inductance.
#[test]
fn regress_ringing_leaves_few_poles_open() {
    let trials = 100;
    println!(
        "terminals  difference  deviation by residuals, by least deviation  open  open without the latter"
    );
    for (nano, most_open) in [(0.0, 0), (0.3, 0), (1.0, 35)] {
        let mut scenario = scenario(MethodName::MaximumLikelihood, "paper-5k5", ErrorSet::Default);
        let (winding, capacitance) = (&built_in("paper-5k5").expect("built in").winding, nano * 1e-9);
        let inductance = (winding.d_axis_inductance() + winding.q_axis_inductance()) / 2.0;
        if capacitance > 0.0 {
            let bridge = &mut scenario.drive.bridge;
            (bridge.terminal_capacitance, bridge.open_leg) = (capacitance, OpenLeg::Diodes);
            bridge.terminal_resistance = (1.5 * inductance / capacitance).sqrt() / 5.0;
        }
        let Method::MaximumLikelihood(settings) = &scenario.detector else { panic!("as asked") };
        // Of each component of a sum over three lines.
        let floor = settings.pulses.pole_floor * 1.5_f64.sqrt();
        let errors = |scenario: &Scenario<Method<f64>>| -> Vec<[f64; 2]> {
            let error = |(outcome, north): &(Outcome<f64>, Angle<f64>)| {
                let needed = outcome.findings().pole_evidence.expect("a signature").needed;
                [outcome.evidence_for(*north).expect("a signature"), needed]
            };
            outcomes(scenario, trials, false).iter().map(error).collect()
        };
        let with = errors(&scenario);
        if let Method::MaximumLikelihood(settings) = &mut scenario.detector {
            settings.pulses.pole_floor = 1e-9;
        }
        let without = errors(&scenario);
        assert!(with.iter().all(|[evidence, needed]| evidence > &-needed), "a wrong pole: {with:?}");
        let middle = |of: &dyn Fn(f64, f64) -> f64| {
            let mut all: Vec<f64> = with.iter().zip(&without).map(|([a, _], [b, _])| of(*a, *b)).collect();
            all.sort_by(f64::total_cmp);
            all[all.len() / 2]
        };
        // 1/evidence² is the sum of the squares of what is wrong over the square of the difference.
        let difference = |with: f64, without: f64| floor / (with.powi(-2) - without.powi(-2)).sqrt();
        let seen = middle(&difference);
        let residual = middle(&|with, without| difference(with, without) / without);
        let open = |of: &[[f64; 2]]| of.iter().filter(|[evidence, needed]| evidence < needed).count();
        println!(
            "{nano:6.1} nF {:10.2} % {:10.2} %, {:.2} % {:10} {:10} of {trials}",
            100.0 * seen,
            100.0 * residual,
            100.0 * floor,
            open(&with),
            open(&without)
        );
        assert!(open(&with) <= most_open, "{nano} nF: {} of {trials} poles stay open", open(&with));
    }
}
