//! No reading, setting or nameplate makes a detector panic, run for ever or name an angle that is none.
#![allow(clippy::disallowed_methods, reason = "tests compare with the C library")]

mod drive;
mod random;
mod spoil;

use standstill_detect::{Decay, Method, MethodName, Settings, Signature};
use standstill_interface::{Detector, Fault, Nanos, Outcome, PoleEvidence, Real, Step};

use drive::Drive;
use random::{Random, nonsense, plausible};
use spoil::spoil;

/// Runs it for at most so many steps; whether it ended.
fn run<T: Real>(detector: &mut impl Detector<T>, drive: &mut Drive, steps: u32) -> bool {
    let mut readings = Vec::new();
    for _ in 0..steps {
        match detector.step(&readings) {
            Step::Drive(command) => {
                readings = drive.readings(&command);
                assert!(command.duration() <= Nanos(130_000_000_000), "{command:?}");
                assert!(command.sampling.last() <= Some(command.duration()), "{command:?}");
            }
            Step::Done(outcome) => {
                law_margin(&outcome);
                if let Outcome::Found { angle, findings } | Outcome::Axis { angle, findings, .. } = outcome {
                    assert!(angle.radians() >= T::zero() && angle.radians() < T::TAU(), "{outcome:?}");
                    assert!(findings.pole_error.is_none_or(|error| !error.is_nan()), "{outcome:?}");
                    let found = matches!(outcome, Outcome::Found { .. });
                    let speaks = |evidence: PoleEvidence<T>| {
                        evidence.is_enough() == found && !(found && evidence.deviations <= T::zero())
                    };
                    assert!(findings.pole_evidence.is_none_or(speaks), "{outcome:?}");
                }
                if let Outcome::Failed { fault, .. } = outcome {
                    assert!(!fault.to_string().is_empty());
                }
                return true;
            }
        }
    }
    false
}

/// The smallest margin is below zero where a check with a limit has fired, and nowhere else.
fn law_margin<T: Real>(outcome: &Outcome<T>) {
    let margin = outcome.findings().fault_margin;
    let ordinary = |value: T, limit: T| value.is_finite() && limit.is_finite() && limit > T::zero();
    let fired = match *outcome {
        Outcome::Found { .. } | Outcome::Axis { .. } => false,
        Outcome::Failed { fault, .. } => match fault {
            Fault::NoCurrent { peak: value, needed: limit }
            | Fault::NoSaliency { ratio: value, needed: limit }
            | Fault::RotorMoves { angle: value, allowed: limit }
            | Fault::RotorTurns { speed: value, allowed: limit, .. }
                if ordinary(value, limit) =>
            {
                true
            }
            Fault::CurrentPersists(_) => true,
            // Others have no limit, or more than one, or what was read is none of this world.
            _ => return,
        },
    };
    if fired {
        assert!(margin.is_some_and(|margin| margin <= T::zero()), "{outcome:?}");
    } else {
        assert!(margin.is_none_or(|margin| margin >= T::zero()), "{outcome:?}");
    }
}

fn feed_garbage<T: Real>()
where
    Method<T>: Settings<T>,
{
    for name in MethodName::ALL {
        let mut random = Random(0x1234_5678_9ABC_DEF1);
        let mut ended = 0;
        for trial in 0..120 {
            let mut plate = plausible::<T>(&mut random);
            plate.signature = random.of(&[Signature::Normal, Signature::Inverted, Signature::None]);
            let Ok(mut detector) = Method::suited(name, &plate).detector() else { continue };
            let nonsense = [0, 0, 1, 20, 300, 1000][trial % 6];
            let current = plate.rated_current.to_double() * random.of(&[0.2, 1.0, 3.0]);
            let mut drive = Drive { random: Random(random.next() | 1), nonsense, current };
            ended += u32::from(run(&mut detector, &mut drive, 4000));
        }
        assert!(ended > 60, "{name}: {ended}");
    }
}

#[test]
fn law_no_reading_makes_a_detector_panic() {
    feed_garbage::<f64>();
    feed_garbage::<f32>();
}

fn build_anything<T: Real>()
where
    Method<T>: Settings<T>,
{
    let mut random = Random(0x0DDB_1A5E_5BAD_5EED);
    let mut built = [0_u32; MethodName::ALL.len()];
    for trial in 0..12_000 {
        let method = trial % MethodName::ALL.len();
        let plate = nonsense::<T>(&mut random);
        let mut settings = Method::suited(MethodName::ALL[method], &plate);
        for _ in 0..random.below(3) {
            spoil(&mut settings, &mut random);
        }
        if random.one_in(4) {
            settings = settings.with_pulse(random.nanos()).unwrap_or(settings);
        }
        if let Ok(mut detector) = settings.detector() {
            built[method] += 1;
            let nonsense = random.of(&[0, 0, 3]);
            let current = random.of(&[1.0, 10.0, plate.rated_current.to_double()]);
            let mut drive = Drive { random: Random(random.next() | 1), nonsense, current };
            run(&mut detector, &mut drive, 300);
        }
    }
    assert!(built.iter().all(|count| *count > 150), "{built:?}");
}

#[test]
fn law_no_setting_makes_a_detector_panic() {
    build_anything::<f64>();
    build_anything::<f32>();
}

#[test]
fn law_settings_that_suit_a_motor_work() {
    let mut random = Random(77);
    for _ in 0..2000 {
        let plate = plausible::<f64>(&mut random);
        plate.check().expect("plausible");
        for name in MethodName::ALL {
            let settings = Method::suited(name, &plate);
            assert!(settings.detector().is_ok(), "{name}: {:?}, {plate:?}", settings.detector().err());
            assert!(Method::suited(name, &plate.cast::<f32>()).detector().is_ok(), "{name} {plate:?}");
        }
    }
}

#[test]
fn law_each_name_is_its_method() {
    let plate = plausible::<f64>(&mut Random(5));
    for name in MethodName::ALL {
        let settings = Method::suited(name, &plate);
        let is = match (name, settings) {
            (MethodName::LineInductance, Method::LineInductance(s)) => s.decay == Decay::Slow,
            (MethodName::LineInductanceFast, Method::LineInductance(s)) => s.decay == Decay::Fast,
            (MethodName::MaximumLikelihood, Method::MaximumLikelihood(s)) => s.adaptive.is_none(),
            (MethodName::MaximumLikelihoodAdaptive, Method::MaximumLikelihood(s)) => s.adaptive.is_some(),
            (MethodName::Subdivision, Method::Subdivision(_))
            | (MethodName::HfiRotating, Method::HfiRotating(_))
            | (MethodName::HfiPulsating, Method::HfiPulsating(_))
            | (MethodName::DcAlignment, Method::DcAlignment(_))
            | (MethodName::Bipolar, Method::Bipolar(_))
            | (MethodName::OpenTerminal, Method::OpenTerminal(_))
            | (MethodName::SixPulse, Method::SixPulse(_)) => true,
            _ => false,
        };
        assert!(is, "{name}");
        assert_eq!(settings.turns_rotor(), name == MethodName::DcAlignment);
        assert_eq!(settings.has_line_pulses(), settings.with_pulse(Nanos::from_micros(200)).is_some());
    }
}
