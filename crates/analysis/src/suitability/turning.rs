//! Speeds of a rotor that turns: from which on a method notices it, and from which on its error is larger than demanded.

use serde::Serialize;
use standstill_detect::{Check, Checks, Method, Settings as _, Value, keys};
use standstill_scenario::{Rotor, Scenario};
use standstill_sim::RotorState;

use super::bench::{Bench, SEARCH, Setting};
use super::starts::{Starts, Stopped};
use super::{Candidate, SuitabilityError};

/// Speeds of the shaft, in rpm, that matter to a start of a rotor that turns.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TurningSpeeds {
    /// True if the method looks whether the rotor turns.
    pub is_checked: bool,
    /// Speed from which on 95 of 100 starts say that the rotor turns; none if fewer do up to the highest speed, or if the method does not
    /// look.
    pub notices_rpm: Option<f64>,
    /// Speed from which on the 95th percentile of the error exceeds what is demanded or no start has an angle, where the method does not
    /// look; none if neither is so up to the highest speed.
    pub exceeds_rpm: Option<f64>,
    /// True if no start has an angle from `exceeds_rpm` on, so that there is no error either.
    pub is_silent: bool,
    /// Smallest share of starts with an angle at a speed up to `exceeds_rpm`, where the method does not look; without that speed, at any speed
    /// that was tried. The percentile is of the starts that have one.
    pub answered: f64,
    /// Highest speed that was tried.
    pub highest_rpm: f64,
    /// Number of starts at each speed, half of them in each direction.
    pub starts: u64,
}

impl TurningSpeeds {
    /// Returns true if the method notices a rotor that turns, or has no answer, before its error exceeds what is demanded.
    pub fn notices_in_time(&self) -> bool {
        match (self.notices_rpm, self.exceeds_rpm) {
            (Some(notices), Some(exceeds)) => self.is_silent || notices <= exceeds,
            (None, Some(_)) => self.is_silent,
            (_, None) => true,
        }
    }
}

/// Number of starts in each direction.
const EACH_WAY: u64 = 32;
/// Share of starts that must say that the rotor turns.
const NOTICED: f64 = 0.95;
/// Highest speed that is tried, as a multiple of that at which the rotor turns by the demanded error within a detection. On average a method
/// sees the angle in the middle of its detection, so its error exceeds the demand at about twice that speed.
const HIGHEST: f64 = 32.0;
/// Number of halvings of that speed down to the first that is tried.
const HALVINGS: u32 = 10;
/// Number of steps in which an edge is narrowed from a factor of two: to one of 2^(1/8), which is 9 %.
const STEPS: u32 = 3;

impl Bench<'_> {
    /// Measures the speeds of a candidate. None where no state of the rotor that is judged lets it turn, where the method turns it itself, and
    /// where no work is left.
    pub fn turning(&self, candidate: &Candidate) -> Result<Option<TurningSpeeds>, SuitabilityError> {
        let may_turn = self.rotors.iter().any(|rotor| matches!(rotor, Rotor::Free | Rotor::Driven));
        let seconds = candidate.free.mean_duration_s.max(candidate.locked.mean_duration_s);
        if !may_turn || candidate.settings.turns_rotor() || seconds <= 0.0 {
            return Ok(None);
        }
        match self.speeds(&candidate.setting, seconds) {
            Ok(speeds) => Ok(Some(speeds)),
            Err(Stopped::Spent) => Ok(None),
            Err(Stopped::Failed(error)) => Err(error),
        }
    }

    fn speeds(&self, setting: &Setting, seconds: f64) -> Result<TurningSpeeds, Stopped> {
        let failed = |error| Stopped::Failed(SuitabilityError::File(error));
        let mut scenario = self.scenario(setting, Rotor::Locked).map_err(failed)?;
        scenario.rotor = RotorState::Driven;
        scenario.seed = scenario.seed.wrapping_add(SEARCH);
        let turns = self.demands.error_deg / (360.0 * f64::from(self.motor.pole_pairs));
        let highest_rpm = HIGHEST * 60.0 * turns / seconds;
        let checks = match scenario.detector.get(&keys::CHECKS) {
            Some(Value::Checks(checks)) => checks,
            _ => Checks::NONE,
        };
        // Without a magnet nothing is induced that shows it.
        let is_checked = self.motor.has_magnet() && checks.has(Check::Turning);
        let notices_rpm = if is_checked {
            self.least(&scenario, highest_rpm, &mut |_, starts| {
                starts.turning as f64 >= NOTICED * starts.summary.trials as f64
            })?
        } else {
            None
        };
        scenario.detector.set(&keys::CHECKS, Value::Checks(checks.without(Check::Turning)));
        let (mut shares, mut silent) = (Vec::new(), Vec::new());
        let exceeds_rpm = self.least(&scenario, highest_rpm, &mut |rpm, starts| {
            let trials = starts.summary.trials;
            shares.push((rpm.abs(), (trials - starts.failed()) as f64 / trials as f64));
            let p95 = starts.summary.p95_deg.value;
            if p95.is_nan() {
                silent.push(rpm.abs());
            }
            p95.is_nan() || p95 > self.demands.error_deg
        })?;
        let is_silent = exceeds_rpm.is_some_and(|exceeds| silent.contains(&exceeds));
        shares.retain(|(rpm, _)| exceeds_rpm.is_none_or(|exceeds| *rpm <= exceeds));
        let answered = shares.iter().map(|(_, share)| *share).fold(1.0, f64::min);
        Ok(TurningSpeeds {
            is_checked,
            notices_rpm,
            exceeds_rpm,
            is_silent,
            answered,
            highest_rpm,
            starts: 2 * EACH_WAY,
        })
    }

    /// Returns the least speed in rpm at which starts in both directions show something, within 9 %; none if they do not up to the highest.
    fn least(
        &self,
        scenario: &Scenario<Method<f64>>,
        highest: f64,
        shows: &mut dyn FnMut(f64, &Starts) -> bool,
    ) -> Result<Option<f64>, Stopped> {
        let mut scenario = scenario.clone();
        let mut at = |rpm: f64| -> Result<bool, Stopped> {
            for rpm in [rpm, -rpm] {
                scenario.start_speed = rpm;
                if !shows(rpm, &Starts::of(&scenario, Rotor::Driven, EACH_WAY, self.work)?) {
                    return Ok(false);
                }
            }
            Ok(true)
        };
        let mut high = highest / f64::from(1_u32 << HALVINGS);
        while !at(high)? {
            if high >= highest {
                return Ok(None);
            }
            high *= 2.0;
        }
        let mut low = high / 2.0;
        for _ in 0..STEPS {
            let middle = (low * high).sqrt();
            if at(middle)? { high = middle } else { low = middle }
        }
        Ok(Some(high))
    }
}
