//! Whether settings hold on starts that nobody chose them by.

use standstill_detect::MethodName;
use standstill_scenario::Rotor;

use super::SuitabilityError;
use super::bench::{Bench, Setting};
use super::search::is_slow;
use super::starts::Starts;

/// Starts of each look in each state of the rotor: as many as it takes, and no more. Each bound is one of 97.5 %, so that both
/// looks together are wrong in less than 5 of 100 cases.
const LOOKS: [u64; 2] = [500, 4000];
/// Starts after which none with a wrong pole says that there are at most one in ten thousand.
const COUNTED: u64 = 37_000;

/// What fresh starts showed of settings: demands hold with 95 % confidence each.
#[derive(Clone, Debug, PartialEq)]
pub struct Confirmed {
    /// Starts in each state of the rotor.
    pub starts: u64,
    /// Their seed.
    pub seed: u64,
    /// 95 of 100 errors are within so many degrees at most.
    pub p95_at_most_deg: f64,
    /// At most this share ends without an angle or without a pole.
    pub without_angle_at_most: f64,
    /// Starts with a wrong pole.
    pub wrong_poles: u64,
    /// Starts in which they were counted where the evidence does not tell how rare they are; none where it does.
    pub counted: Option<u64>,
    /// At most this share has one, by their number and by how far the pole evidence of all starts is from it. None where poles are
    /// not judged.
    pub wrong_poles_at_most: Option<f64>,
    /// The furthest that a free rotor moved, in electrical degrees.
    pub moved_deg: f64,
    /// The largest current in A.
    pub peak_current_a: f64,
}

impl Bench<'_> {
    /// Tries settings on fresh starts; what speaks against them where they do not hold.
    pub fn confirm(&self, setting: &Setting) -> Result<Result<Confirmed, Vec<String>>, SuitabilityError> {
        let mut undecided = Vec::new();
        for trials in LOOKS {
            let mut of_states = Vec::new();
            for rotor in &self.rotors {
                match self.starts(setting, *rotor, true, trials)? {
                    Ok(starts) => of_states.push(starts),
                    Err(problem) => return Ok(Err(vec![problem])),
                }
            }
            let all: Vec<&Starts> = of_states.iter().collect();
            let mut objections = self.objections(&all);
            if objections.is_empty() && !self.margins(&all).leaves_room() {
                objections.push("the largest movement or current of fresh starts is at its limit".to_owned());
            }
            if !objections.is_empty() {
                return Ok(Err(objections));
            }
            let mut confirmed = self.summed_up(setting, &all, trials)?;
            let wrong = confirmed.wrong_poles_at_most.unwrap_or(0.0);
            let holds = confirmed.p95_at_most_deg <= self.demands.error_deg
                && confirmed.without_angle_at_most <= self.demands.without_angle;
            let long = is_slow(setting.method) || setting.method == MethodName::MaximumLikelihoodAdaptive;
            if holds && wrong > self.demands.wrong_poles && !long {
                self.count_wrong_poles(setting, &mut confirmed)?;
            }
            // Of a method that takes long, what was counted is said and must do.
            let counted = long && confirmed.wrong_poles == 0;
            if holds && (counted || confirmed.wrong_poles_at_most.unwrap_or(0.0) <= self.demands.wrong_poles)
            {
                return Ok(Ok(confirmed));
            }
            undecided = vec![format!(
                "in {trials} fresh starts 95 of 100 errors are within {:.2}°, at most {:.2} % end without a pole, at most {:.3} % with a wrong one",
                confirmed.p95_at_most_deg,
                100.0 * confirmed.without_angle_at_most,
                100.0 * confirmed.wrong_poles_at_most.unwrap_or(0.0),
            )];
        }
        Ok(Err(undecided))
    }

    fn summed_up(
        &self,
        setting: &Setting,
        all: &[&Starts],
        trials: u64,
    ) -> Result<Confirmed, SuitabilityError> {
        let most = |of: &dyn Fn(&Starts) -> f64| all.iter().map(|starts| of(starts)).fold(0.0, f64::max);
        let without = |starts: &Starts| {
            let poles = if self.has_pole { starts.summary.undetermined } else { 0 };
            standstill_campaign::binomial_interval(starts.failed() + poles, starts.summary.trials).high
        };
        Ok(Confirmed {
            starts: trials,
            seed: self.scenario(setting, Rotor::Locked, true)?.seed,
            p95_at_most_deg: most(&|starts| starts.summary.p95_deg.high),
            without_angle_at_most: most(&without),
            counted: all.iter().any(|starts| starts.stops_when_content).then_some(trials * all.len() as u64),
            wrong_poles: all.iter().map(|starts| starts.summary.wrong_poles).sum(),
            wrong_poles_at_most: self.has_pole.then(|| most(&Starts::wrong_poles_at_most)),
            moved_deg: most(&|starts| {
                if starts.rotor == Rotor::Free { starts.summary.max_moved_deg } else { 0.0 }
            }),
            peak_current_a: most(&|starts| starts.summary.peak_current_a),
        })
    }

    /// Counts wrong poles where the evidence does not tell how rare they are.
    fn count_wrong_poles(
        &self,
        setting: &Setting,
        confirmed: &mut Confirmed,
    ) -> Result<(), SuitabilityError> {
        let rotor = self.rotors.last().copied().unwrap_or(Rotor::Locked);
        if let Ok(starts) = self.starts(setting, rotor, true, COUNTED)? {
            confirmed.wrong_poles += starts.summary.wrong_poles;
            confirmed.counted = Some(COUNTED);
            confirmed.wrong_poles_at_most = Some(starts.wrong_poles_at_most());
            confirmed.moved_deg = confirmed.moved_deg.max(starts.summary.max_moved_deg);
            confirmed.peak_current_a = confirmed.peak_current_a.max(starts.summary.peak_current_a);
        }
        Ok(())
    }
}
