//! Whether settings hold on starts that nobody chose them by.

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

/// Results of fresh starts. The bounds of error and of starts without an answer have 95 % confidence each, for these settings; movement
/// and current are the largest of these starts.
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
    /// At most this share has one: by their number where they were counted, else by the distance of the pole evidence, if that is
    /// normally distributed. None where poles are not judged.
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
            let to_count = holds && wrong > self.demands.wrong_poles && !is_slow(setting.method);
            if to_count && let Some(objections) = self.count_wrong_poles(setting, &mut confirmed)? {
                return Ok(Err(objections));
            }
            if holds && confirmed.wrong_poles_at_most.unwrap_or(0.0) <= self.demands.wrong_poles {
                return Ok(Ok(confirmed));
            }
            undecided = vec![format!(
                "{trials} fresh starts leave room for a p95 of {:.2}° ({}° demanded), {:.2} % without an angle or a pole ({} % demanded), {:.3} % wrong poles ({} % demanded)",
                confirmed.p95_at_most_deg,
                self.demands.error_deg,
                100.0 * confirmed.without_angle_at_most,
                100.0 * self.demands.without_angle,
                100.0 * confirmed.wrong_poles_at_most.unwrap_or(0.0),
                100.0 * self.demands.wrong_poles,
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

    /// Counts wrong poles where the evidence does not tell how rare they are; what these starts speak against.
    fn count_wrong_poles(
        &self,
        setting: &Setting,
        confirmed: &mut Confirmed,
    ) -> Result<Option<Vec<String>>, SuitabilityError> {
        let rotor = self.rotors.last().copied().unwrap_or(Rotor::Locked);
        let starts = match self.starts(setting, rotor, true, COUNTED)? {
            Ok(starts) => starts,
            Err(problem) => return Ok(Some(vec![problem])),
        };
        confirmed.wrong_poles += starts.summary.wrong_poles;
        confirmed.counted = Some(COUNTED);
        let most = starts.wrong_poles_at_most();
        confirmed.wrong_poles_at_most = Some(most);
        if rotor == Rotor::Free {
            confirmed.moved_deg = confirmed.moved_deg.max(starts.summary.max_moved_deg);
        }
        confirmed.peak_current_a = confirmed.peak_current_a.max(starts.summary.peak_current_a);
        let mut objections = self.objections(&[&starts]);
        if objections.is_empty() && most > self.demands.wrong_poles {
            objections.push(format!(
                "{} wrong poles in {COUNTED} fresh starts, where {} % are allowed",
                starts.summary.wrong_poles,
                100.0 * self.demands.wrong_poles
            ));
        }
        if confirmed.moved_deg > self.demands.movement_deg || confirmed.peak_current_a > self.most_current {
            objections.push(format!(
                "of {COUNTED} fresh starts the largest movement is {:.2}° and the largest current {:.4} A",
                confirmed.moved_deg, confirmed.peak_current_a
            ));
        }
        Ok((!objections.is_empty()).then_some(objections))
    }
}
