//! The stretches of a scan in which the limits hold: one, several, or one between two neighbouring values of the scan.

use std::ops::Range;

use super::{Look, Looks, Search, View};

/// Largest number of bisections between two neighbouring values of a scan that break different limits.
const HALVINGS: u32 = 8;

/// Largest number of trials at a value when the search decides whether two stretches are one, as a multiple of the scan's number of trials.
const CLOSER: u64 = 16;

/// Returns the stretches of a scan in which the limits hold, as ranges of indices.
pub(super) fn of(scan: &[(f64, bool)]) -> Vec<Range<usize>> {
    let mut found: Vec<Range<usize>> = Vec::new();
    for (k, (_, holds)) in scan.iter().enumerate() {
        match found.last_mut() {
            Some(last) if *holds && last.end == k => last.end = k + 1,
            _ if *holds => found.push(k..k + 1),
            _ => (),
        }
    }
    found
}

impl Search {
    /// Finds a position at which the limits hold, between two neighbouring values of the scan that break different limits. For example, a
    /// short pulse is too noisy and a long pulse moves the rotor, but a pulse of a length between them may keep both limits.
    pub(super) fn between<E>(
        &self,
        looks: &mut Looks<'_, '_, E>,
        scan: &[(f64, bool)],
    ) -> Result<Option<f64>, E> {
        let mut broken = Vec::new();
        for (place, _) in scan {
            broken.push(looks.at(*place, self.trials)?.map(Look::broken).unwrap_or_default());
        }
        let differ = |a: &[usize], b: &[usize]| a.iter().all(|limit| !b.contains(limit));
        for k in 1..scan.len() {
            if !differ(&broken[k - 1], &broken[k]) {
                continue;
            }
            let (mut low, mut high) = (scan[k - 1].0, scan[k].0);
            for _ in 0..HALVINGS {
                let middle = (low + high) / 2.0;
                let Some(look) = looks.at(middle, self.trials)? else { break };
                if look.holds(View::Likely) {
                    return Ok(Some(middle));
                }
                let there = look.broken();
                if differ(&there, &broken[k]) {
                    low = middle;
                } else if differ(&there, &broken[k - 1]) {
                    high = middle;
                } else {
                    break;
                }
            }
        }
        Ok(None)
    }

    /// Runs more trials at every value to decide which of several stretches are real. Stretches are joined unless the limits surely fail
    /// somewhere between them. A stretch is dropped if the limits surely hold nowhere in it. If no stretch remains, the widest one is kept.
    pub(super) fn settle<E>(&self, looks: &mut Looks<'_, '_, E>, scan: &mut [(f64, bool)]) -> Result<(), E> {
        if of(scan).len() < 2 {
            return Ok(());
        }
        let trials = (self.trials * CLOSER).max(self.sure_from + self.sure_from / 2).min(self.most);
        let mut sure = vec![(false, false); scan.len()];
        for ((place, holds), sure) in scan.iter_mut().zip(&mut sure) {
            if let Some(look) = looks.at(*place, trials)? {
                *holds = look.holds(View::Likely);
                *sure = (look.holds(View::Bad), !look.holds(View::Good));
            }
        }
        // Join two stretches unless the limits surely fail at a value between them.
        let stretches = of(scan);
        for pair in stretches.windows(2) {
            let gap = pair[0].end..pair[1].start;
            if !gap.clone().any(|k| sure[k].1) {
                gap.for_each(|k| scan[k].1 = true);
            }
        }
        // Drop uncertain stretches; if all are uncertain, keep the widest.
        let stretches = of(scan);
        let is_sure = |part: &Range<usize>| part.clone().any(|k| sure[k].0);
        let widest = stretches.iter().rev().max_by_key(|part| part.len()).cloned();
        let any = stretches.iter().any(is_sure);
        for part in stretches {
            let remains = if any { is_sure(&part) } else { Some(&part) == widest.as_ref() };
            if !remains {
                part.for_each(|k| scan[k].1 = false);
            }
        }
        Ok(())
    }
}
