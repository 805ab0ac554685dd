extern crate std;
use std::vec::Vec;

mod checks;
mod evidence;
mod turned;

use standstill_interface::{AlphaBeta, Leg, Nanos, Sampling, Sensed};

use super::sequential::{tail, tail_beyond};
use super::*;
use crate::checks::Checks;
use crate::nameplate::Place;
use crate::parts::settle::SettleSettings;
use crate::testing::Noise;

const CURRENT: f64 = 10.0;

fn settings(sequential: SequentialSettings<f64>) -> PolaritySettings<f64> {
    PolaritySettings {
        carrier_period: Nanos::from_micros(100),
        periods: 1,
        current: CURRENT,
        resistance: 0.0,
        dead_time: Nanos::ZERO,
        least_current: 0.1,
        least_margin: 0.0,
        uneven: 0.0,
        signature: Signature::Normal,
        rule: PolarityRule::Sequential(sequential),
        place: Place::InLine,
        checks: Checks::ALL,
        least_share: 0.5,
        both_ways: 0.6,
        lost: 0.0,
        magnet_flux: 0.1,
        q_axis_inductance: 1e-3,
        window: Nanos::ZERO,
    }
}

/// A motor whose currents differ by this share between the poles, with sensors of this noise in A, and so much scatter of
/// the differences beside it; `drift` is the relative growth of the current from one vector to the next.
struct Motor {
    noise: Noise,
    effect: f64,
    sensor: f64,
    scatter: f64,
    drift: f64,
    /// Current across the axis that both directions of a vector raise alike, as a share of theirs.
    across: f64,
    offset: [f64; 3],
    /// Time since the axis was measured.
    since: Nanos,
    vectors: u32,
}

impl Motor {
    fn of(seed: u64, effect: f64, sensor: f64, scatter: f64) -> Self {
        Self {
            noise: Noise::new(seed),
            effect,
            sensor,
            scatter,
            drift: 0.0,
            across: 0.0,
            offset: [0.0; 3],
            since: Nanos::ZERO,
            vectors: 0,
        }
    }

    fn readings(&mut self, test: &PolarityTest<f64>, command: &Command<f64>) -> Vec<Reading<f64>> {
        let mut vector = AlphaBeta::new(0.0, 0.0);
        if test.state == State::Pushing {
            let side = if test.against() { -0.5 } else { 0.5 };
            // Of a difference of two, each has half of the variance.
            let scatter = self.scatter * core::f64::consts::FRAC_1_SQRT_2 * self.noise.gauss();
            let current = 1.0 + side * self.effect + self.drift * f64::from(self.vectors) + scatter;
            let (sin, cos) = test.direction().radians().sin_cos();
            let across = self.across * if test.against() { -1.0 } else { 1.0 };
            vector = AlphaBeta::new(cos * current - sin * across, sin * current + cos * across) * CURRENT;
            self.vectors += 1;
        }
        (0..command.sampling.count)
            .map(|k| {
                Reading::measured(
                    command.sampling.trigger(k),
                    core::array::from_fn(|phase| {
                        vector.phases().0[phase] + self.offset[phase] + self.sensor * self.noise.gauss()
                    }),
                    540.0,
                )
            })
            .collect()
    }

    fn decide(&mut self, settings: PolaritySettings<f64>) -> (Pole<f64>, PolarityTest<f64>) {
        self.shorted(settings, |_| {}).expect("current")
    }

    /// Decides with readings of the shorted terminals that are changed.
    fn shorted(
        &mut self,
        settings: PolaritySettings<f64>,
        change: impl Fn(&mut Reading<f64>),
    ) -> Result<(Pole<f64>, PolarityTest<f64>), Fault<f64>> {
        let settle = SettleSettings { wait: Nanos(1000), threshold: 5.0, attempts: 3, place: Place::InLine };
        let axis = Angle::from_degrees(50.0);
        let mut test = PolarityTest::new(settings, Settler::new(settle, true), (axis, self.since), 1e-3);
        let mut command = test.begin();
        loop {
            let mut readings = self.readings(&test, &command);
            if test.state == State::Shorted {
                readings.iter_mut().for_each(&change);
            }
            match test.step(&readings)? {
                PolarityStep::Drive(next) => command = next,
                PolarityStep::Decided(pole) => return Ok((pole, test)),
            }
        }
    }
}

/// A magnet of 0.1 Wb drives `ω · 0.1 Wb · 1 ms / 1 mH` through terminals that are shorted for longer than a vector: 20 A at 200 rad/s. Sensors that end at 15 A show at least that.
#[test]
fn regress_a_short_beyond_the_sensors_range_tells_a_rotor_that_turns() {
    let shorted = |current: [f64; 3], clipped: &[Phase]| {
        let change = |reading: &mut Reading<f64>| {
            reading.current = Abc(current);
            for phase in clipped {
                reading.sensed[*phase] = Sensed::Clipped;
            }
        };
        Motor::of(1, 0.05, 1e-3, 0.0).shorted(settings(LOOSE), change).map(|(pole, _)| pole.undetermined)
    };
    let turning = |current, clipped: &[Phase]| match shorted(current, clipped) {
        Err(Fault::RotorTurns { speed, .. }) => speed,
        other => panic!("{current:?}, {clipped:?}: {other:?}"),
    };
    let speed = turning([20.0, -10.0, -10.0], &[]);
    assert!((speed / 200.0 - 1.0).abs() < 0.01, "{speed}");
    for clipped in [&[Phase::A][..], &[Phase::B, Phase::A]] {
        let speed = turning([15.0, -10.0, -10.0], clipped);
        assert!((100.0..200.0).contains(&speed), "{speed}");
    }
    // Clipped without a current, it says nothing of the rotor; what is no number says nothing at all.
    assert_eq!(shorted([0.0; 3], &[]), Ok(None));
    assert_eq!(shorted([0.0; 3], &[Phase::C, Phase::B]), Err(Fault::Clipped(Phase::B)));
    assert_eq!(shorted([f64::NAN, 0.0, 0.0], &[Phase::A]), Err(Fault::Clipped(Phase::A)));
}

const LOOSE: SequentialSettings<f64> =
    SequentialSettings { error: 0.02, effect: 0.02, floor: 1e-4, most_pairs: 40 };

fn rates(effect: f64, sensor: f64, scatter: f64, sequential: SequentialSettings<f64>) -> (f64, f64, f64) {
    let trials = 8_000;
    let (mut wrong, mut open, mut pairs) = (0, 0, 0);
    for trial in 0..trials {
        let (pole, test) = Motor::of(trial + 1, effect, sensor, scatter).decide(settings(sequential));
        pairs += u32::from(test.pairs());
        if pole.undetermined.is_some() {
            open += 1;
        } else if pole.angle != test.axis {
            wrong += 1;
        }
    }
    let share = |count: u32| f64::from(count) / trials as f64;
    (share(wrong), share(open), share(pairs))
}

#[test]
fn law_the_error_probability_stated_is_not_exceeded() {
    // Noise of the sensors small and large, and a scatter of the currents that no sensor shows.
    for (sensor, scatter) in [(0.05, 0.0), (0.2, 0.0), (0.4, 0.0), (0.01, 0.03), (1e-3, 0.05)] {
        let (wrong, open, pairs) = rates(0.02, sensor, scatter, LOOSE);
        assert!(wrong <= 0.02, "{sensor} {scatter}: {wrong} wrong, {open} open, {pairs} pairs");
        assert!(open < 0.7, "{sensor} {scatter}: {open} open");
    }
    // The motor answers less than the setting says: the tail keeps a pole from being named too often.
    let (wrong, _, _) = rates(0.002, 0.2, 0.0, LOOSE);
    assert!(wrong <= 0.04, "{wrong}");
}

#[test]
fn law_without_an_effect_the_pole_stays_open() {
    let named = |scatter: f64| {
        let usual = settings(SequentialSettings::new(0.1));
        let poles = (0..2000).map(|trial| Motor::of(trial + 1, 0.0, 0.05, scatter).decide(usual));
        poles.filter(|(pole, test)| pole.undetermined.is_none() || pole.angle != test.axis).count()
    };
    assert_eq!(named(0.0), 0);
    // What no sensor shows is known from a few pairs alone, too few for one in a million.
    assert!(named(0.02) <= 40, "{}", named(0.02));
}

#[test]
fn analytic_the_order_abba_cancels_a_linear_drift() {
    let mut motor = Motor { drift: 1e-3, ..Motor::of(1, 0.05, 0.0, 0.0) };
    let sequential = SequentialSettings { floor: 1e-9, most_pairs: 4, ..LOOSE };
    let (pole, test) = motor.decide(settings(sequential));
    assert_eq!((test.pairs(), pole.undetermined), (4, None));
    // Without it the mean would be wrong by the drift from one vector to the next.
    let (mean, _, _) = test.differences();
    assert!((mean * 1.0035 - 0.05).abs() < 1e-6, "{mean}");
    let polarity = pole.polarity.expect("measured");
    assert!((polarity.along - polarity.against - 0.05 * CURRENT).abs() < 1e-9);
}

#[test]
fn law_vectors_go_along_against_against_along() {
    let mut test = Motor::of(1, 0.05, 0.0, 0.0).decide(settings(LOOSE)).1;
    let order: Vec<bool> = (0..8)
        .map(|k| {
            test.vectors = k;
            test.against()
        })
        .collect();
    assert_eq!(order, [false, true, true, false, false, true, true, false]);
}

#[test]
fn analytic_the_test_stops_where_walds_rule_and_the_tail_say() {
    let wald = SequentialSettings { error: 1e-6_f64, effect: 0.02, floor: 0.003, most_pairs: 8 };
    let bound = ((1.0 - 1e-6_f64) / 1e-6).ln();
    // 2 Δ₀ |S̄| / v = ln((1 − α)/α), the tail far below.
    let variance = 2.0 * 0.02 * 0.5 / bound;
    assert!((wald.error_of(-0.5, variance) / 1e-6 - 1.0).abs() < 1e-9);
    // S̄²/v = 2 ln(1/(2α)), Wald's far below.
    let tail = SequentialSettings { effect: 1.0, ..wald };
    let variance = 0.5 * 0.5 / (2.0 * (0.5e6_f64).ln());
    assert!((tail.error_of(0.5, variance) / 1e-6 - 1.0).abs() < 1e-9);
    // With v = σ²/n + floor²: two pairs without scatter, of sensors without noise, just below and above.
    for (floor, pairs) in [(0.999, 4), (1.001, 8)] {
        let floor = floor * 0.05 / (2.0 * (0.5e6_f64).ln()).sqrt();
        let sequential = SequentialSettings { effect: 1.0, floor, most_pairs: 8, error: 1e-6 };
        let test = Motor::of(1, 0.05, 1e-7, 0.0).decide(settings(sequential)).1;
        assert!(test.pairs() <= pairs && (test.pairs() == 8) == (pairs == 8), "{}", test.pairs());
    }
    // One pair is never enough.
    assert!(Motor::of(1, 0.5, 1e-9, 0.0).decide(settings(LOOSE)).1.pairs() >= 2);
}

#[test]
fn analytic_the_noise_of_a_difference_is_that_of_four_direct_currents() {
    let sequential = SequentialSettings { error: 1e-30, floor: 1e-6, most_pairs: 255, effect: 1e-3 };
    let mut squares = 0.0;
    for trial in 0..20 {
        let (_, test) = Motor::of(trial + 1, 0.0, 0.02, 0.0).decide(settings(sequential));
        assert_eq!(test.pairs(), 255);
        let n = f64::from(test.pairs());
        let (mean, _, least) = test.differences();
        squares += (test.squares - n * mean * mean) / (n - 1.0) / least / 20.0;
    }
    assert!((squares - 1.0).abs() < 0.1, "{squares}");
}

#[test]
fn law_the_signature_says_which_pole_a_larger_current_means() {
    for (signature, effect, along) in [
        (Signature::Normal, 0.1, true),
        (Signature::Normal, -0.1, false),
        (Signature::Inverted, 0.1, false),
        (Signature::Inverted, -0.1, true),
    ] {
        for rule in [PolarityRule::Sequential(LOOSE), PolarityRule::TwoVectors] {
            let settings = PolaritySettings { signature, rule, ..settings(LOOSE) };
            let (pole, test) = Motor::of(1, effect, 1e-3, 0.0).decide(settings);
            assert_eq!(pole.undetermined, None);
            assert_eq!(pole.angle == test.axis, along, "{signature:?} {effect}");
            let pointer = Pointer { direction: AlphaBeta::new(effect, 0.0), deviation: 0.01 };
            let axis = Angle::from_radians(0.1);
            let pole = pointer.read(axis, signature, 1e-6);
            assert_eq!((pole.undetermined, pole.angle == axis), (None, along));
        }
    }
    let none = PolaritySettings { signature: Signature::None, ..settings(LOOSE) };
    let (pole, test) = Motor::of(1, 0.1, 1e-3, 0.0).decide(none);
    assert_eq!((pole.undetermined, test.vectors), (Some(Undetermined::NoSignature), 0));
}

#[test]
fn analytic_two_vectors_need_four_deviations_of_their_difference() {
    let two = PolaritySettings { rule: PolarityRule::TwoVectors, ..settings(LOOSE) };
    assert!((two.needed_margin(0.3) - 4.0 * (4.0 / 3.0_f64).sqrt() * 0.3).abs() < 1e-12);
    let two = PolaritySettings { least_margin: 0.5, ..two };
    for (effect, named) in [(0.051, true), (0.049, false)] {
        let (pole, _) = Motor::of(1, effect, 1e-6, 0.0).decide(two);
        assert_eq!(pole.undetermined.is_none(), named, "{pole:?}");
    }
}

#[test]
fn law_a_pointer_decides_by_what_lies_on_the_axis() {
    let axis = Angle::from_degrees(30.0_f64);
    let read = |degrees: f64, length: f64, deviation: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let pointer = Pointer { direction: AlphaBeta::new(cos, sin) * length, deviation };
        pointer.read(axis, Signature::Normal, 1e-6)
    };
    assert_eq!((read(30.0, 1.0, 0.1).undetermined, read(30.0, 1.0, 0.1).angle), (None, axis));
    assert_eq!((read(210.0, 1.0, 0.1).undetermined, read(210.0, 1.0, 0.1).angle), (None, axis.opposite()));
    // z = 5 leaves exp(−12.5)/2 = 1.9e-6, 5.3 leaves 4e-7.
    assert!(matches!(read(30.0, 5.0, 1.0).undetermined, Some(Undetermined::NotDecided { .. })));
    assert_eq!(read(30.0, 5.3, 1.0).undetermined, None);
    // 60° off the axis, half of it is on it.
    assert!(matches!(read(90.0, 1.0, 0.01).undetermined, Some(Undetermined::OffAxis { .. })));
    assert!(matches!(read(290.0, 1.0, 0.01).undetermined, Some(Undetermined::OffAxis { .. })));
    assert_eq!(read(70.0, 1.0, 0.01).undetermined, None);
    assert!(read(30.0, f64::NAN, 0.01).undetermined.is_some() && read(30.0, 0.0, 0.0).undetermined.is_some());
}

#[test]
fn law_the_tail_is_bounded_from_above() {
    for (z, tail_of_normal) in [(0.0_f64, 0.5), (1.0, 0.158_655), (3.0, 1.349_898e-3), (5.0, 2.866_516e-7)] {
        let bound = tail(z * z);
        assert!(bound >= tail_of_normal && bound < 15.0 * tail_of_normal, "{z}: {bound}");
    }
}

#[test]
fn analytic_a_vector_has_the_voltage_that_its_current_needs_and_its_dead_time_back() {
    let settings =
        PolaritySettings { resistance: 2.0, periods: 10, dead_time: Nanos(2000), ..settings(LOOSE) };
    // 10 A through 5 mH in 1 ms, and half of them on average through 2 Ω.
    assert!((settings.amplitude(5e-3) - 60.0).abs() < 1e-9);
    let command = settings.command(Angle::from_degrees(0.0), 60.0, 600.0);
    let duties =
        command.stage.legs.0.map(|leg| if let Leg::Duty(duty) = leg { duty } else { panic!("no PWM") });
    // 2 µs of 100 µs are lost against the current.
    for (duty, expected) in duties.into_iter().zip([0.5 + 0.1 + 0.02, 0.5 - 0.05 - 0.02, 0.5 - 0.05 - 0.02]) {
        assert!((duty - expected).abs() < 1e-12, "{duties:?}");
    }
    assert_eq!((command.sampling.count, command.sampling.last()), (10, Some(command.duration())));
    let two = PolaritySettings { rule: PolarityRule::TwoVectors, ..settings };
    let command = two.command(Angle::from_degrees(90.0), 60.0, 600.0);
    assert_eq!(command.sampling, Sampling::once(Nanos(1_000_000)));
    // Leg a without voltage has no direction of its current.
    assert!(matches!(command.stage.legs.0[0], Leg::Duty(duty) if (duty - 0.5).abs() < 1e-12));
}

#[test]
fn law_offsets_of_the_sensors_name_no_pole() {
    let mut motor = Motor::of(1, 0.0, 1e-4, 0.0);
    motor.offset = [0.4, -0.2, 0.1];
    let (pole, test) = motor.decide(settings(SequentialSettings { floor: 1e-3, ..LOOSE }));
    let (mean, _, _) = test.differences();
    assert!(mean.abs() < 1e-4 && pole.undetermined.is_some(), "{mean} {pole:?}");
}

#[test]
fn law_settings_that_cannot_work_are_refused() {
    let good = settings(LOOSE);
    assert!(good.check().is_ok());
    let rule = |sequential| PolaritySettings { rule: PolarityRule::Sequential(sequential), ..good };
    let broken = [
        PolaritySettings { carrier_period: Nanos::ZERO, ..good },
        PolaritySettings { periods: 0, ..good },
        PolaritySettings { carrier_period: Nanos(10_000_000_000), periods: 7, ..good },
        PolaritySettings { current: f64::INFINITY, ..good },
        PolaritySettings { resistance: f64::NAN, ..good },
        PolaritySettings { dead_time: Nanos::from_micros(25), ..good },
        PolaritySettings { least_current: 0.0, ..good },
        PolaritySettings { least_margin: f64::INFINITY, ..good },
        rule(SequentialSettings { error: 0.5, ..LOOSE }),
        rule(SequentialSettings { error: 1e-40, ..LOOSE }),
        rule(SequentialSettings { effect: f64::NAN, ..LOOSE }),
        rule(SequentialSettings { floor: 0.0, ..LOOSE }),
        rule(SequentialSettings { most_pairs: 1, ..LOOSE }),
    ];
    assert!(broken.iter().all(|settings| settings.check().is_err()));
}

#[test]
fn analytic_the_mean_of_n_pairs_has_an_nth_of_their_variance() {
    let sequential = SequentialSettings { error: 1e-30, floor: 1e-3, most_pairs: 8, effect: 1.0 };
    let (pole, test) = Motor::of(1, 0.02, 0.2, 0.0).decide(settings(sequential));
    let (mean, variance, _) = test.differences();
    let expected = (-mean * mean / (variance / 8.0 + 1e-6) / 2.0).exp() / 2.0;
    assert!((pole.error.expect("known") / expected - 1.0).abs() < 1e-9);
}
