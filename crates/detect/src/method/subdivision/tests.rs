extern crate std;
use std::vec::Vec;

use standstill_interface::{Detector, Leg, Outcome, Step};

use super::*;
use crate::checks::Checks;
use crate::nameplate::Place;
use crate::parts::polarity::{PolarityRule, SequentialSettings, Signature};

fn settings(saliency: SaliencySign, halvings: u8) -> SubdivisionSettings<f64> {
    SubdivisionSettings {
        vector: PolaritySettings {
            carrier_period: Nanos::from_micros(100),
            periods: 10,
            current: 7.0,
            resistance: 0.0,
            dead_time: Nanos::ZERO,
            least_current: 0.1,
            least_margin: 0.01,
            uneven: 0.0,
            signature: Signature::Normal,
            rule: PolarityRule::Sequential(SequentialSettings::new(0.1)),
            place: Place::InLine,
            checks: Checks::ALL,
            least_share: 0.5,
            both_ways: 0.3,
            lost: 0.0,
            magnet_flux: 0.5,
            q_axis_inductance: 18e-3,
            window: Nanos::ZERO,
        },
        d_axis_inductance: 10e-3,
        halvings,
        saliency,
        least_saliency: 0.02,
        gain_tolerance: 0.005,
        settle: SettleSettings {
            wait: Nanos::from_micros(10_000),
            threshold: 0.2,
            attempts: 3,
            place: Place::InLine,
        },
    }
}

/// Returns the outcome on a motor with the response `1 + salient cos 2(φ − θ) + pole cos(φ − θ)`, and the directions in
/// degrees of the vectors.
fn detect(
    settings: SubdivisionSettings<f64>,
    degrees: f64,
    salient: f64,
    pole: f64,
) -> (Outcome<f64>, Vec<f64>) {
    let mut detector = Subdivision::new(settings).expect("settings");
    let (mut readings, mut directions) = (Vec::new(), Vec::new());
    loop {
        let command = match detector.step(&readings) {
            Step::Drive(command) => command,
            Step::Done(outcome) => return (outcome, directions),
        };
        let duties = command.stage.legs.map(|leg| if let Leg::Duty(duty) = leg { duty } else { 0.0 });
        let vector = duties.clarke();
        let mut current = AlphaBeta::new(0.0, 0.0);
        if vector.norm() > 0.0 {
            let angle = vector.beta.atan2(vector.alpha);
            directions.push(Angle::from_radians(angle).degrees());
            let off = angle - degrees.to_radians();
            let answer = 1.0 + salient * (2.0 * off).cos() + pole * off.cos();
            current = vector * (5.0 * answer / vector.norm());
        }
        readings = (0..command.sampling.count)
            .map(|k| Reading::measured(command.sampling.trigger(k), current.phases().0, 540.0))
            .collect();
    }
}

#[test]
fn analytic_the_search_ends_within_its_last_step_everywhere() {
    for (saliency, salient) in [(SaliencySign::Negative, 0.25), (SaliencySign::Positive, -0.25)] {
        for halvings in [0, 1, 4, 10, 20] {
            let step = 30.0 / f64::from(1_u32 << halvings);
            for k in 0..72 {
                let degrees = 5.0 * f64::from(k) + 1.3;
                let (outcome, _) = detect(settings(saliency, halvings), degrees, salient, 0.05);
                let Outcome::Found { angle, .. } = outcome else { panic!("{degrees}: {outcome:?}") };
                let off = angle.difference(Angle::from_degrees(degrees)).to_degrees().abs();
                // What saturation pulls towards it is on the axis.
                assert!(off <= step / 2.0 + 1e-3, "{saliency:?} {halvings} {degrees}: {off}");
            }
        }
    }
}

#[test]
fn analytic_vectors_go_around_and_then_to_both_sides_of_the_best() {
    let (_, directions) = detect(settings(SaliencySign::Negative, 3), 2.0, 0.25, 0.05);
    let expected: [f64; 18] = [
        0.0, 30.0, 60.0, 90.0, 120.0, 150.0, 180.0, 210.0, 240.0, 270.0, 300.0, 330.0, 15.0, 345.0, 7.5,
        352.5, 3.75, 356.25,
    ];
    for (direction, expected) in directions.iter().zip(expected) {
        let off = Angle::from_degrees(*direction).difference(Angle::from_degrees(expected)).to_degrees();
        assert!(off.abs() < 1e-6, "{directions:?}");
    }
}

#[test]
fn law_without_saliency_there_is_no_axis() {
    for (salient, needed) in [(0.0, true), (0.019, true), (0.021, false)] {
        let (outcome, _) = detect(settings(SaliencySign::Negative, 4), 40.0, salient, 0.3);
        let refused = matches!(outcome, Outcome::Failed { fault: Fault::NoSaliency { .. }, .. });
        assert_eq!(refused, needed, "{outcome:?}");
    }
    assert!(settings(SaliencySign::Negative, 20).check().is_ok());
    assert!(settings(SaliencySign::Negative, 21).check().is_err());
    let none = SubdivisionSettings { d_axis_inductance: f64::NAN, ..settings(SaliencySign::Negative, 1) };
    assert!(none.check().is_err());
}
