//! Candidates: each method with its best settings, and the choice of the recommended one.

use standstill_campaign::Statistics;
use standstill_detect::MethodName;
use standstill_scenario::Rotor;

use super::bench::{Bench, SEARCH, Setting};
use super::search::{Found, is_slow};
use super::starts::{Spread, Starts};
use super::{Candidate, Confirmed, Progress, SuitabilityError};

/// Number of starts of a candidate in each state of the rotor.
const TRIALS: u64 = 200;
/// Number of starts of a candidate with continuous injection, which takes a hundred times as long.
const FEW_TRIALS: u64 = 24;
/// Largest number of settings of a method that are tried on fresh starts.
const TRIED: usize = 3;

impl Bench<'_> {
    /// Makes the candidate of a method from the best settings that were found.
    pub fn candidate(&self, method: MethodName, found: &Found) -> Result<Candidate, SuitabilityError> {
        let setting = found.looks.first().map_or_else(|| Setting::plain(method), |look| look.setting.clone());
        let settings = self.scenario(&setting, Rotor::Locked)?.detector;
        let trials = if is_slow(method) { FEW_TRIALS } else { TRIALS };
        let (mut states, mut objections) = (Vec::new(), Vec::new());
        for rotor in &self.rotors {
            match self.starts(&setting, *rotor, SEARCH, trials)? {
                Ok(starts) => states.push(starts),
                Err(problem) => objections = vec![problem],
            }
        }
        let all: Vec<&Starts> = states.iter().collect();
        objections.extend(self.objections(&all));
        let margins = (!all.is_empty()).then(|| self.margins(&all));
        let of = |wanted: bool| {
            let state = states.iter().find(|starts| (starts.rotor == Rotor::Locked) == wanted);
            state.map_or_else(|| Statistics::default().summary(), |starts| starts.summary.clone())
        };
        let binding = if objections.is_empty() {
            margins.map(|margins| margins.binding().0)
        } else {
            // What is strong enough for the pole breaks another demand; or nothing is.
            let strong = found.looks.iter().find(|look| look.margins.pole.is_none_or(|pole| pole >= 1.0));
            strong.map_or(found.stop, |look| Some(look.margins.binding().0))
        };
        let looks = found.looks.len();
        Ok(Candidate {
            setting,
            settings,
            locked: of(true),
            free: of(false),
            objections,
            margins,
            binding,
            looks,
        })
    }

    /// Returns the best candidate whose settings hold on fresh starts.
    pub fn recommended(
        &self,
        candidates: &mut [Candidate],
        found: &[Found],
        hear: &mut dyn FnMut(Progress<'_>),
    ) -> Result<Option<(usize, Confirmed)>, SuitabilityError> {
        let mut order: Vec<usize> = (0..candidates.len()).collect();
        order.retain(|number| candidates[*number].objections.is_empty());
        // Those whose wrong poles show in few starts first, and injections last.
        let effort = |candidate: &Candidate| {
            (is_slow(candidate.method()), Spread::of(candidate.settings).is_counted())
        };
        order.sort_by(|a, b| {
            let (a, b) = (&candidates[*a], &candidates[*b]);
            effort(a).cmp(&effort(b)).then(b.margin().total_cmp(&a.margin()))
        });
        let mut failed = 0;
        for number in order {
            // The best is tried even if the few starts of its look were not quite enough.
            let mut looks = found[number].looks.iter().enumerate();
            let looks =
                looks.by_ref().filter(|(rank, look)| *rank == 0 || look.margins.is_kept()).take(TRIED);
            for (rank, look) in looks {
                hear(Progress::Confirming(&look.setting));
                let mut objections = self.sifted(&look.setting)?;
                if objections.is_empty() {
                    match self.confirm(&look.setting, failed)? {
                        Ok(confirmed) => {
                            if rank > 0 {
                                let one = Found { looks: vec![look.clone()], stop: found[number].stop };
                                candidates[number] = self.candidate(look.setting.method, &one)?;
                            }
                            return Ok(Some((number, confirmed)));
                        }
                        Err(why) => objections = why,
                    }
                    failed += 1;
                }
                if rank == 0 {
                    candidates[number].objections = objections;
                }
            }
        }
        Ok(None)
    }
}
