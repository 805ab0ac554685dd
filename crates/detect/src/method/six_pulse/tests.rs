#![allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "times are small and positive")]

use core::f64::consts::TAU;

use standstill_interface::{Capture, Outcome, Sensed, Undetermined};

use super::*;
use crate::nameplate::{Comparing, Nameplate, Sensing};
use crate::parts::lines::SaliencySign;
use crate::testing::{Noise, PLATE};

extern crate std;
use std::vec::Vec;

/// A motor as the method models it: y = Y (1 + p cos(θ − φ) + m cos 2(θ − φ)), with a timer and comparators.
struct Motor {
    /// North pole in rad.
    angle: f64,
    /// 1/Y in s.
    time: f64,
    pole: f64,
    saliency: f64,
    /// Standard deviations: of relative y of each pulse, of each direction.
    noise: f64,
    own: [f64; 6],
    tick: f64,
    delay: f64,
    dc_link: f64,
    /// Noise of the link's sensor, relative.
    link_noise: f64,
    /// Share by which the link falls from one pulse to the next, which the sensors show, and share by which y falls,
    /// which they do not show.
    sag: f64,
    drift: f64,
    draws: Noise,
}

impl Motor {
    fn at(degrees: f64) -> Self {
        Self {
            angle: degrees.to_radians(),
            time: 150e-6,
            pole: 0.06,
            saliency: 0.25,
            noise: 0.0,
            own: [0.0; 6],
            tick: 1e-9,
            delay: 0.0,
            dc_link: 540.0,
            link_noise: 0.0,
            sag: 0.0,
            drift: 0.0,
            draws: Noise::new(1),
        }
    }

    /// Readings of a pulse, the n-th of all.
    fn readings(&mut self, command: &Command<f64>, n: usize) -> Vec<Reading<f64>> {
        let legs = command.stage.legs;
        let high = Phase::ALL.into_iter().filter(|phase| legs[*phase] == Leg::High);
        let vector: AlphaBeta<f64> = high
            .map(|phase| {
                let (sin, cos) = (TAU / 3.0 * f64::from(phase as u8)).sin_cos();
                AlphaBeta::new(cos, sin)
            })
            .fold(AlphaBeta::new(0.0, 0.0), |sum, one| sum + one);
        let off = self.angle - vector.beta.atan2(vector.alpha);
        let number = ((vector.beta.atan2(vector.alpha) / (TAU / 6.0)).round().rem_euclid(6.0)) as usize;
        let n = n as f64;
        let y = (1.0 + self.pole * off.cos() + self.saliency * (2.0 * off).cos())
            * (1.0 + self.own[number] + self.noise * self.draws.gauss())
            * (1.0 - self.sag * n)
            * (1.0 - self.drift * n);
        let link = self.dc_link * (1.0 - self.sag * n);
        if command.threshold.is_some() {
            let time = self.time / y + self.delay + 2e-6;
            let link = link * (1.0 + self.link_noise * self.draws.gauss());
            let mut reading = Reading::measured(Nanos::ZERO, [0.0; 3], link);
            reading.capture =
                Some(Capture { ticks: (time / self.tick).floor() as u32, comparator: Phase::A });
            return [reading].into();
        }
        // In the direction of the vector all current flows through the leg that stands alone.
        let current = 7.0 * y;
        let alone = Phase::ALL
            .into_iter()
            .find(|phase| Phase::ALL.into_iter().all(|other| other == *phase || legs[other] != legs[*phase]));
        let alone = alone.expect("one leg stands alone");
        let sign = if legs[alone] == Leg::High { 1.0 } else { -1.0 };
        let mut currents = [-sign * current / 2.0; 3];
        currents[alone as usize] = sign * current;
        let offsets = [0.05, -0.1, 0.03];
        let read = |currents: [f64; 3]| core::array::from_fn(|k| currents[k] + offsets[k]);
        [
            Reading::measured(Nanos::ZERO, read(currents), link),
            Reading::measured(Nanos::ZERO, read([0.0; 3]), link),
        ]
        .into()
    }

    fn detect(&mut self, settings: SixPulseSettings<f64>) -> Outcome<f64> {
        use standstill_interface::Detector as _;
        let mut detector = SixPulse::new(settings).expect("settings that work");
        let mut readings = Vec::new();
        for n in 0.. {
            match detector.step(&readings) {
                Step::Drive(command) => readings = self.readings(&command, n),
                Step::Done(outcome) => return outcome,
            }
        }
        unreachable!()
    }
}

fn with_timer(tick: f64) -> Nameplate<f64> {
    let comparator = Comparing { tick, ..Comparing::default() };
    Nameplate { sensing: Sensing { comparator, ..PLATE.sensing }, ..PLATE }
}

fn timed(tick: f64) -> SixPulseSettings<f64> {
    SixPulseSettings::suited(&with_timer(tick))
}

fn found(outcome: &Outcome<f64>) -> f64 {
    let Outcome::Found { angle, .. } = outcome else { panic!("{outcome:?}") };
    angle.degrees()
}

fn off(found: f64, degrees: f64) -> f64 {
    (found - degrees + 180.0).rem_euclid(360.0) - 180.0
}

#[test]
fn law_gains_make_as_much_of_both_harmonics_as_stated() {
    // Shunts below the legs see the vectors whose lone leg is low; those of the other direction are derived.
    let settings = SixPulseSettings { timed: false, gain_tolerance: 1.0, ..timed(1e-9) };
    for derived in [Derived::None, Derived::One(Phase::B), Derived::Several] {
        let mut draws = Noise::new(5);
        let trials = 20_000;
        let (mut first, mut second) = (0.0, 0.0);
        for _ in 0..trials {
            let gains = [(); 3].map(|()| draws.gauss());
            let others = |phase: usize| (gains[(phase + 1) % 3] + gains[(phase + 2) % 3]) / 2.0;
            let sums = [1, 2].map(|harmonic| {
                (0..VECTORS).fold(AlphaBeta::new(0.0, 0.0), |sum, number| {
                    let phase = alone(number).0;
                    let gain = match derived {
                        Derived::One(missing) if missing == phase => others(phase as usize),
                        Derived::Several if alone(number).1 => others(phase as usize),
                        _ => gains[phase as usize],
                    };
                    sum + direction::<f64>(number, harmonic) * (gain / 3.0)
                })
            });
            first += sums[0].dot(sums[0]) / 2.0 / f64::from(trials);
            second += sums[1].dot(sums[1]) / 2.0 / f64::from(trials);
        }
        let [stated, of_pole] = settings.of_gains(derived);
        assert!((second / stated - 1.0).abs() < 0.03, "{derived:?}: {second} {stated}");
        assert!((first - of_pole).abs() <= 0.03 * of_pole + 1e-12, "{derived:?}: {first} {of_pole}");
    }
    assert_eq!(timed(1e-9).of_gains(Derived::None), [0.0, 0.0]);
}

#[test]
fn analytic_the_harmonics_give_axis_and_pole() {
    for degrees in (0..72).map(|n| f64::from(n) * 5.0 + 1.0) {
        let outcome = Motor { delay: 400e-9, ..Motor::at(degrees) }.detect(SixPulseSettings {
            sensing: Sensing {
                comparator: Comparing { tick: 1e-9, delay: 400e-9, ..Comparing::default() },
                ..PLATE.sensing
            },
            ..timed(1e-9)
        });
        assert!(off(found(&outcome), degrees).abs() < 0.01, "{degrees}: {outcome:?}");
        // Without a timer, from currents.
        let outcome = Motor::at(degrees).detect(SixPulseSettings::suited(&PLATE));
        assert!(off(found(&outcome), degrees).abs() < 1e-9, "{degrees}: {outcome:?}");
        // L_d > L_q: the axis is where the current is smallest.
        let outcome = Motor { saliency: -0.25, ..Motor::at(degrees) }
            .detect(SixPulseSettings { saliency: SaliencySign::Positive, ..timed(1e-9) });
        assert!(off(found(&outcome), degrees).abs() < 0.01, "{degrees}: {outcome:?}");
    }
}

#[test]
fn law_what_all_times_have_in_common_costs_little() {
    // A clock that is 1 % off, half a microsecond of delay that nobody knows, a link that falls as its sensor says.
    let outcome = Motor { tick: 1.01e-9, delay: 0.5e-6, sag: 0.01, ..Motor::at(77.0) }.detect(timed(1e-9));
    assert!(off(found(&outcome), 77.0).abs() < 0.2, "{outcome:?}");
}

#[test]
fn law_a_second_round_backwards_takes_out_what_drifts_evenly() {
    let drifting = || Motor { drift: 0.002, ..Motor::at(40.0) };
    let once = off(found(&drifting().detect(timed(1e-9))), 40.0).abs();
    let twice = off(found(&drifting().detect(SixPulseSettings { rounds: 2, ..timed(1e-9) })), 40.0).abs();
    assert!(twice < 0.02 && once > 5.0 * twice, "{once} {twice}");
}

#[test]
fn law_evidence_is_in_standard_deviations() {
    // The evidence of a motor without a difference of its poles is standard normal, for each kind of error.
    let plates = [
        (Comparing { tick: 3e-6, noise: 0.07, ..Comparing::default() }, 0.01, 0.0, 0.0),
        (Comparing { tick: 1e-9, noise: 0.07, ..Comparing::default() }, 0.01, 0.0, 0.0),
        (Comparing { tick: 1e-9, own: true, offset: 0.07, ..Comparing::default() }, 0.0, 0.01, 0.0),
        (Comparing { tick: 1e-9, ..Comparing::default() }, 0.0, 0.0, 0.01),
    ];
    for (comparator, noise, own, link) in plates {
        let sensing = Sensing { comparator, link_noise: link * 540.0, ..PLATE.sensing };
        let plate = Nameplate { sensing, dead_time: Nanos(1), ..PLATE };
        let settings = SixPulseSettings { dead_time: Nanos(2000), ..SixPulseSettings::suited(&plate) };
        let mut draws = Noise::new(9);
        let trials = 2000;
        let mut squares = 0.0;
        let mut axes = 0.0;
        for _ in 0..trials {
            let degrees = 360.0 * draws.uniform();
            let own = core::array::from_fn(|_| own * draws.gauss());
            let draws = Noise::new((draws.uniform() * 1e9) as u64);
            let mut motor = Motor {
                pole: 0.0,
                noise,
                own,
                tick: comparator.tick,
                draws,
                link_noise: link,
                ..Motor::at(degrees)
            };
            let outcome = motor.detect(settings);
            let evidence = outcome.evidence_for(Angle::from_degrees(degrees)).expect("evidence");
            squares += evidence * evidence;
            let Outcome::Axis { angle, findings, .. } = outcome else { continue };
            let twice = off(2.0 * angle.degrees(), 2.0 * degrees).to_radians() / 2.0;
            axes += (twice / findings.angle_deviation.expect("an axis")).powi(2);
        }
        let rms = [squares, axes].map(|sum| (sum / f64::from(trials)).sqrt());
        // A residual beyond two of its deviations makes the stated deviation larger.
        assert!(rms.iter().all(|rms| (0.85..1.08).contains(rms)), "{comparator:?}: {rms:?}");
    }
}

#[test]
fn law_a_pole_that_is_not_certain_stays_open() {
    let motor = || Motor { pole: 0.004, ..Motor::at(200.0) };
    let open = Motor { tick: 2.56e-6, ..motor() }.detect(timed(2.56e-6));
    assert!(matches!(open, Outcome::Axis { reason: Undetermined::NotDecided { .. }, .. }), "{open:?}");
    let certain = SixPulseSettings { dead_time: Nanos(2000), ..timed(1e-8) };
    assert!(off(found(&Motor { tick: 1e-8, ..motor() }.detect(certain)), 200.0).abs() < 0.2);
}

#[test]
fn analytic_a_sector_is_its_middle() {
    for (width, degrees, middle) in
        [(60.0, 89.0, 60.0), (60.0, 91.0, 120.0), (30.0, 104.0, 90.0), (30.0, 106.0, 120.0)]
    {
        let settings = SixPulseSettings { sector: Angle::from_degrees(width), ..timed(1e-9) };
        let outcome = Motor::at(degrees).detect(settings);
        assert!((found(&outcome) - middle).abs() < 1e-9);
        assert!((outcome.findings().half_sector.expect("a sector").to_degrees() - width / 2.0).abs() < 1e-9);
    }
}

#[test]
fn law_each_order_gives_every_direction_once_a_round_and_the_same_answer() {
    let rounds = |pairs: bool| SixPulseSettings { pairs, rounds: 2, ..timed(1e-9) };
    let order = |pairs: bool| -> Vec<usize> {
        let detector = SixPulse::new(rounds(pairs)).expect("settings that work");
        (0..2 * VECTORS).map(|pulse| detector.vector(pulse)).collect()
    };
    assert_eq!(order(false), [0, 1, 2, 3, 4, 5, 5, 4, 3, 2, 1, 0]);
    assert_eq!(order(true), [0, 3, 1, 4, 2, 5, 5, 2, 4, 1, 3, 0]);
    for degrees in [3.0, 77.0, 200.0, 311.0] {
        let [circle, pairs] = [false, true].map(|pairs| found(&Motor::at(degrees).detect(rounds(pairs))));
        assert!(off(circle, pairs).abs() < 1e-9, "{circle} {pairs}");
    }
}

#[test]
fn law_settings_that_cannot_work_are_refused() {
    let good = timed(1e-6);
    assert!(SixPulse::new(good).is_ok());
    let no_timer = SixPulseSettings { sensing: PLATE.sensing, ..good };
    assert_eq!(SixPulse::new(no_timer).expect_err("no timer").setting, "timed");
    for bad in [
        SixPulseSettings { threshold: 0.0, ..good },
        SixPulseSettings { pause: 0.0, ..good },
        SixPulseSettings { rounds: 0, ..good },
        SixPulseSettings { sector: Angle::from_degrees(45.0), ..good },
        SixPulseSettings { pole_error: 0.7, ..good },
        SixPulseSettings { longest: Nanos(1), ..good },
        SixPulseSettings { rounds: 1, ..SixPulseSettings::suited(&PLATE) },
    ] {
        assert!(SixPulse::new(bad).is_err(), "{bad:?}");
    }
}

#[test]
fn law_readings_that_say_nothing_end_it() {
    use standstill_interface::Detector as _;
    let step = |settings: SixPulseSettings<f64>, readings: &[Reading<f64>]| {
        let mut detector = SixPulse::new(settings).expect("settings that work");
        let Step::Drive(_) = detector.step(&[]) else { panic!("a pulse") };
        match detector.step(readings) {
            Step::Done(Outcome::Failed { fault, .. }) => fault,
            other => panic!("{other:?}"),
        }
    };
    let reading = Reading::measured(Nanos::ZERO, [0.1, 0.0, -0.1], 540.0);
    // No trip; a trip at once; a wrong number of readings.
    assert!(matches!(step(timed(1e-6), &[reading]), Fault::NoCurrent { .. }));
    let early = Reading { capture: Some(Capture { ticks: 2, comparator: Phase::A }), ..reading };
    assert!(matches!(step(timed(1e-6), &[early]), Fault::TrippedEarly { .. }));
    assert_eq!(step(timed(1e-6), &[]), Fault::UnexpectedReadings);
    let sampled = SixPulseSettings::suited(&PLATE);
    assert!(matches!(step(sampled, &[reading, reading]), Fault::NoCurrent { .. }));
    let left = Reading::measured(Nanos::ZERO, [3.0, 0.0, -3.0], 540.0);
    assert!(matches!(step(sampled, &[left, left]), Fault::CurrentPersists(_)));
    let hidden = Reading { sensed: Abc([Sensed::Hidden; 3]), ..reading };
    assert_eq!(step(sampled, &[hidden, reading]), Fault::Hidden(Phase::A));
}
