//! Tries a method on a rotor that turns at constant speed. The results are the speed up to which the errors are within the demand, the
//! speed from which on the method notices that the rotor turns, and the speeds at which wrong answers go unnoticed.

use serde::Serialize;
use standstill_detect::{Check, Checks, Method, Settings as _, Value, keys};
use standstill_scenario::{Rotor, Scenario};
use standstill_sim::RotorState;

use super::bench::{Bench, SEARCH, Setting};
use super::starts::{Starts, Stopped};
use super::{Candidate, SuitabilityError};

/// Results of simulated motor starts in which the shaft turns at constant speed. All speeds are in rpm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TurningSpeeds {
    /// True if the method's check for a turning rotor is switched on and can work. It works only if the motor has a magnet.
    pub is_checked: bool,
    /// Speed from which on at least 95 of 100 starts end because the method notices that the rotor turns or moves. None if at all tried
    /// speeds fewer do.
    pub notices_rpm: Option<f64>,
    /// Speed up to which 95 of 100 axis errors are within the demand, in both directions of rotation and with the check for a turning rotor
    /// switched off. None if they are within the demand at all tried speeds.
    pub within_rpm: Option<f64>,
    /// Largest 95th percentile in degrees of the axis errors at the instants for which the angles hold, at the tried speeds up to
    /// `within_rpm`. None if the method does not state the instants, or if no start has an axis.
    pub at_instant_deg: Option<f64>,
    /// True if no start has an axis at the next tried speed above `within_rpm`. Then no error exceeds the demand at that speed either.
    pub is_silent: bool,
    /// Range of speeds in which wrong answers go unnoticed. With the method's own checks and in at least one direction of rotation, more
    /// than 5 of 100 starts have an answer whose error exceeds the demand. The answer is the angle, or the axis if poles are not judged.
    /// `None` if this happens at no tried speed. The upper end is `None` if it happens up to the highest tried speed.
    pub unnoticed_rpm: Option<(f64, Option<f64>)>,
    /// Smallest share of starts with an axis at the tried speeds up to `within_rpm`, with the check for a turning rotor switched off. The
    /// limit `within_rpm` considers only the starts with an axis.
    pub answered: f64,
    /// Highest speed that was tried.
    pub highest_rpm: f64,
    /// Number of starts at each speed, half of them in each direction.
    pub starts: u64,
}

impl TurningSpeeds {
    /// Returns true if wrong answers go unnoticed at no tried speed.
    pub fn notices_in_time(&self) -> bool {
        self.unnoticed_rpm.is_none()
    }
}

/// Number of simulated motor starts at each speed in each direction of rotation.
const EACH_WAY: u64 = 32;
/// Smallest share of starts in which the method must notice that the rotor turns. It is also the smallest share of errors that must be
/// within the demand.
const NOTICED: f64 = 0.95;
/// Highest tried speed, as a multiple of the speed at which the rotor turns by the demanded error during a detection. The angle that a
/// method finds is on average that in the middle of the detection, so the error exceeds the demand at about twice that speed.
const HIGHEST: f64 = 32.0;
/// Number of times that the highest tried speed is halved to obtain the lowest.
const HALVINGS: u32 = 10;
/// Number of bisections of a range of speeds. They narrow its ratio from 2 to 2^(1/8), which is 9 %.
const STEPS: u32 = 3;

impl Bench<'_> {
    /// Runs starts of a candidate while the shaft turns. None if no judged rotor may turn, if the method itself turns the rotor, or if no
    /// work is left.
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
        let demanded = self.demands.error_deg;
        let turns = demanded / (360.0 * f64::from(self.motor.pole_pairs));
        let highest_rpm = HIGHEST * 60.0 * turns / seconds;
        let checks = match scenario.detector.get(&keys::CHECKS) {
            Some(Value::Checks(checks)) => checks,
            _ => Checks::NONE,
        };
        let mut own = Course { bench: self, scenario: scenario.clone(), seen: Vec::new() };
        let noticed = |starts: &Starts| starts.share(starts.turning) >= NOTICED;
        let notices = edge(highest_rpm, &mut |rpm| own.both_ways(rpm, noticed))?;
        let notices_rpm = notices.map(|[_, noticed]| noticed);
        // Without a magnet no voltage is induced that shows that the rotor turns.
        let is_checked = self.motor.has_magnet() && checks.has(Check::Turning);
        let mut unchecked = Course { bench: self, scenario, seen: Vec::new() };
        if is_checked {
            unchecked.scenario.detector.set(&keys::CHECKS, Value::Checks(checks.without(Check::Turning)));
        } else {
            unchecked.seen.clone_from(&own.seen);
        }
        // False if no start has an axis, because the percentile is not a number then.
        let is_within = |starts: &Starts| starts.summary.p95_deg.value <= demanded;
        let exceeds =
            edge(highest_rpm, &mut |rpm| unchecked.both_ways(rpm, is_within).map(|within| !within))?;
        let is_silent = exceeds.is_some_and(|[_, high]| {
            unchecked.seen.iter().any(|(rpm, starts)| rpm.abs() == high && starts.summary.axes == 0)
        });
        let within_rpm = exceeds.map(|[low, _]| low);
        let is_right = |starts: &Starts| starts.share(starts.wrong(demanded, self.has_pole)) <= 1.0 - NOTICED;
        let unnoticed_rpm = match exceeds {
            Some(exceeds) => {
                unnoticed(exceeds, notices_rpm.unwrap_or(f64::INFINITY), highest_rpm, &mut |rpm| {
                    own.both_ways(rpm, is_right).map(|right| !right)
                })?
            }
            None => None,
        };
        let within: Vec<&Starts> = unchecked
            .seen
            .iter()
            .filter(|(rpm, _)| within_rpm.is_none_or(|within| rpm.abs() <= within))
            .map(|(_, starts)| starts)
            .collect();
        let at_instant_deg = within.iter().filter_map(|starts| starts.p95_at_instant_deg()).reduce(f64::max);
        let answered = within.iter().map(|starts| starts.share(starts.summary.axes)).fold(1.0, f64::min);
        Ok(TurningSpeeds {
            is_checked,
            notices_rpm,
            within_rpm,
            at_instant_deg,
            is_silent,
            unnoticed_rpm,
            answered,
            highest_rpm,
            starts: 2 * EACH_WAY,
        })
    }
}

/// Returns the range of speeds in rpm in which wrong answers go unnoticed. `misleads` runs starts at a speed and returns true if they do.
/// `exceeds` has the last speed at which the errors are within the demand, and the next tried speed. `notices` is the speed from which on
/// the method notices that the rotor turns. The range begins at the last tried speed without unnoticed wrong answers. It ends at the next
/// tried speed without them, or at `notices`.
fn unnoticed(
    exceeds: [f64; 2],
    notices: f64,
    highest: f64,
    misleads: &mut Shows<'_>,
) -> Result<Option<(f64, Option<f64>)>, Stopped> {
    let [mut low, mut rpm] = exceeds;
    let mut from = None;
    while rpm < notices && rpm <= highest {
        match (misleads(rpm)?, from) {
            (true, None) => from = Some(low),
            (false, Some(from)) => return Ok(Some((from, Some(rpm)))),
            _ => {}
        }
        low = rpm;
        rpm *= std::f64::consts::SQRT_2;
    }
    Ok(from.map(|from| (from, (notices <= highest).then_some(notices))))
}

/// Function that runs starts at a speed in rpm and returns true if they show the effect that is searched for.
type Shows<'a> = dyn FnMut(f64) -> Result<bool, Stopped> + 'a;

/// Starts of one scenario at all tried speeds.
struct Course<'a> {
    bench: &'a Bench<'a>,
    scenario: Scenario<Method<f64>>,
    /// Tried speeds in rpm, each with its starts. The sign is the direction of rotation.
    seen: Vec<(f64, Starts)>,
}

impl Course<'_> {
    /// Returns true if the starts at this speed satisfy `shows` in both directions of rotation. The starts are run if they were not run
    /// before.
    fn both_ways(&mut self, rpm: f64, shows: impl Fn(&Starts) -> bool) -> Result<bool, Stopped> {
        for rpm in [rpm, -rpm] {
            let known = self.seen.iter().find(|(known, _)| *known == rpm).map(|(_, starts)| shows(starts));
            let shown = if let Some(shown) = known {
                shown
            } else {
                self.scenario.start_speed = rpm;
                let starts = Starts::of(&self.scenario, Rotor::Driven, EACH_WAY, self.bench.work)?;
                let shown = shows(&starts);
                self.seen.push((rpm, starts));
                shown
            };
            if !shown {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

/// Returns the first tried speeds in ascending order. Each is twice the one before.
fn doublings(highest: f64) -> impl Iterator<Item = f64> {
    (0..=HALVINGS).rev().map(move |halvings| highest / f64::from(1_u32 << halvings))
}

/// Returns two speeds in rpm that differ by 9 %. The effect shows at the higher one and not at the lower one. None if it shows at none of
/// the first tried speeds.
fn edge(highest: f64, shows: &mut Shows<'_>) -> Result<Option<[f64; 2]>, Stopped> {
    for found in doublings(highest) {
        if !shows(found)? {
            continue;
        }
        let (mut low, mut high) = (found / 2.0, found);
        for _ in 0..STEPS {
            let middle = (low * high).sqrt();
            if shows(middle)? { high = middle } else { low = middle }
        }
        return Ok(Some([low, high]));
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(highest: f64, shows: impl Fn(f64) -> bool) -> [f64; 2] {
        match edge(highest, &mut |rpm| Ok(shows(rpm))) {
            Ok(Some(edge)) => edge,
            _ => panic!("an edge"),
        }
    }

    #[test]
    fn law_wrong_answers_go_unnoticed_until_the_rotor_is_noticed_or_there_are_none() {
        let between = |notices: f64, shows: &dyn Fn(f64) -> bool| {
            let found = unnoticed([9.2, 10.0], notices, 100.0, &mut |rpm| Ok(shows(rpm)));
            found.unwrap_or_else(|_| panic!("shown"))
        };
        assert_eq!(between(f64::INFINITY, &|_| false), None);
        assert_eq!(between(9.0, &|_| true), None);
        // A narrow range of speeds counts, too.
        assert_eq!(between(11.0, &|_| true), Some((9.2, Some(11.0))));
        assert_eq!(between(f64::INFINITY, &|_| true), Some((9.2, None)));
        let (from, until) = between(90.0, &|rpm| (13.0..25.0).contains(&rpm)).expect("some");
        assert!(from == 10.0 && (until.expect("an end") / 28.28 - 1.0).abs() < 1e-3, "{from} {until:?}");
    }

    #[test]
    fn law_an_edge_lies_between_two_speeds_that_are_9_percent_apart() {
        for at in [0.2, 1.0, 3.3, 47.0, 99.0] {
            let [low, high] = found(100.0, |rpm| rpm >= at);
            assert!(low < at && at <= high && high / low < 1.0906, "{at}: {low} to {high}");
        }
        assert!(matches!(edge(100.0, &mut |_| Ok(false)), Ok(None)));
    }
}
