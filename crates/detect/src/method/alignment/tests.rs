extern crate std;
use std::vec::Vec;

use standstill_interface::{Detector, Leg};

use super::*;
use crate::nameplate::Place;
use crate::testing::Noise;

const SETTINGS: AlignmentSettings<f64> = AlignmentSettings {
    modulation: ModulationSettings {
        carrier_period: Nanos::from_micros(100),
        dead_time: Nanos::ZERO,
        drop: 0.0,
        inductance: 10e-3,
        fade: 0.01,
    },
    current: 7.0,
    resistance: 1.5,
    magnet_flux: 0.5,
    least_sweep: 0.6,
    checks: Checks::ALL,
    periods: 10,
    ramp: 20,
    hold: 100,
    settle: SettleSettings {
        wait: Nanos::from_micros(2000),
        threshold: 0.5,
        attempts: 5,
        place: Place::InLine,
    },
};

/// Returns the outcome for a magnet that sweeps this flux in Wb across the second pull, within 30 commands; `leak`:
/// constant current in A that unequal legs leave; `noise`: noise of the sensors in A rms.
fn outcome(settings: AlignmentSettings<f64>, swept: f64, leak: f64, noise: f64, seed: u64) -> Outcome<f64> {
    outcome_with(settings, swept, leak, noise, seed, |vector| vector)
}

/// Returns the outcome if the winding carries the current `flowing(i)` in place of the current i of a sound winding.
fn outcome_with(
    settings: AlignmentSettings<f64>,
    swept: f64,
    leak: f64,
    noise: f64,
    seed: u64,
    flowing: impl Fn(AlphaBeta<f64>) -> AlphaBeta<f64>,
) -> Outcome<f64> {
    let mut detector = Alignment::new(settings).expect("settings");
    let mut random = Noise::new(seed);
    let mut readings = Vec::new();
    let mut pulls = 0;
    loop {
        let command = match detector.step(&readings) {
            Step::Drive(command) => command,
            Step::Done(outcome) => return outcome,
        };
        let mut vector = AlphaBeta::new(0.0, 0.0);
        if let Leg::Duty(a) = command.stage.legs.0[0] {
            let number = pulls % (settings.ramp + settings.hold);
            let second = pulls >= settings.ramp + settings.hold;
            pulls += 1;
            // The command itself shows the direction: along 90° legs b and c differ, along 0° leg a.
            assert_eq!((a - 0.5).abs() > 1e-6, second, "{a}");
            let along =
                7.0 * (f64::from(number) + 1.0).min(f64::from(settings.ramp)) / f64::from(settings.ramp);
            let flux = if number < 30 { swept / (30.0 * 1e-3 * settings.resistance) } else { 0.0 };
            vector = if second { AlphaBeta::new(along, flux + leak) } else { AlphaBeta::new(-flux, along) };
        }
        let vector = flowing(vector);
        readings = (0..command.sampling.count)
            .map(|k| {
                let Abc(current) = vector.phases().map(|phase| phase + 0.05 + noise * random.gauss());
                Reading::measured(command.sampling.trigger(k), current, 540.0)
            })
            .collect();
    }
}

/// Returns the flux that swept across the winding and the least flux needed; none if there was an angle.
fn refused(outcome: &Outcome<f64>) -> Option<(f64, f64)> {
    match outcome {
        Outcome::Found { angle, .. } => {
            assert_eq!(angle.radians(), 0.0);
            None
        }
        Outcome::Failed { fault: Fault::DidNotFollow { swept, needed }, .. } => Some((*swept, *needed)),
        other => panic!("{other:?}"),
    }
}

#[test]
fn analytic_the_flux_swept_is_the_integral_of_the_current_across() {
    for leak in [0.0, 0.3, -0.3] {
        // A rotor that comes from either side.
        for swept in [0.5, -0.5, 0.31, 0.69] {
            assert_eq!(refused(&outcome(SETTINGS, swept, leak, 0.0, 1)), None, "{swept} {leak}");
        }
        // Half a command of the leak at the ends of the trapezoids.
        for swept in [0.0, 0.1, 0.29, 0.72, 1.5] {
            let (seen, needed) = refused(&outcome(SETTINGS, swept, leak, 0.0, 1)).expect("refused");
            assert!((seen - swept).abs() < 1e-3 && (needed - 0.3).abs() < 1e-12, "{seen} {swept}");
        }
    }
}

/// With the wire of one phase open, a voltage raises a current along the line of the two others alone, as large as the voltage's part
/// along that line. It flows at any angle of the rotor, also against the direction of the first pull.
#[test]
fn analytic_a_current_of_two_phases_is_no_pull() {
    for open in 0..3 {
        let third = f64::from(open) * std::f64::consts::TAU / 3.0 + std::f64::consts::FRAC_PI_2;
        let line = AlphaBeta::new(third.cos(), third.sin());
        let of_two = |vector: AlphaBeta<f64>| line * vector.dot(line);
        // A magnet that sweeps its whole flux, as that of a free rotor between the two directions does.
        let Outcome::Failed { fault: Fault::NoCurrent { peak, needed }, .. } =
            outcome_with(SETTINGS, 0.5, 0.0, 0.0, 1, of_two)
        else {
            panic!("phase {open} is open")
        };
        // Phases b and c are to carry √3/2 of 7 A in the first pull, phase a 7 A in the second.
        let ordered: f64 = if open == 0 { 7.0 } else { 7.0 * 0.75_f64.sqrt() };
        assert!((needed - ordered / 3.0).abs() < 1e-12 && peak < needed, "{open}: {peak} of {needed}");
    }
    // A third of the ordered current is enough, in any length.
    let with = |share: f64| outcome_with(SETTINGS, 0.5, 0.0, 0.0, 1, |vector| vector * share);
    assert_eq!(refused(&with(0.7)), None);
    assert!(matches!(with(0.3), Outcome::Failed { fault: Fault::NoCurrent { .. }, .. }));
}

#[test]
fn law_a_locked_rotor_is_given_no_angle_whatever_the_noise() {
    // A weak magnet: the noise of the sensors alone shows as much flux.
    let weak = AlignmentSettings { magnet_flux: 0.002, resistance: 5.0, ..SETTINGS };
    let mut seen = 0;
    for seed in 1..=400 {
        let (swept, needed) = refused(&outcome(weak, 0.0, 0.1, 0.03, seed)).expect("refused");
        assert!(needed > 0.6 * 0.002);
        seen += u32::from(swept > 0.6 * 0.002);
    }
    // By the magnet's flux alone most of them would have been.
    assert!(seen > 100, "{seen}");
    let none = AlignmentSettings { magnet_flux: 0.0, ..SETTINGS };
    assert!(refused(&outcome(none, 0.5, 0.0, 0.0, 1)).is_some());
}

#[test]
fn law_settings_that_cannot_work_are_refused() {
    assert!(SETTINGS.check().is_ok());
    let broken = [
        AlignmentSettings { current: 0.0, ..SETTINGS },
        AlignmentSettings { resistance: f64::NAN, ..SETTINGS },
        AlignmentSettings { magnet_flux: f64::INFINITY, ..SETTINGS },
        AlignmentSettings { least_sweep: 1.0, ..SETTINGS },
        AlignmentSettings { periods: 0, ..SETTINGS },
        AlignmentSettings { ramp: 0, ..SETTINGS },
        AlignmentSettings { ramp: 40_000, ..SETTINGS },
        AlignmentSettings { hold: 0, ..SETTINGS },
        AlignmentSettings { hold: 40_000, ..SETTINGS },
    ];
    assert!(broken.iter().all(|settings| settings.check().is_err()));
}
