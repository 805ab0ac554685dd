//! The stretches of a scan in which the limits hold: one, several, or one between two values of it.

use std::ops::Range;

use super::{Look, Looks, Search, View};

/// Largest number of bisections between two neighbouring values of a scan that break different limits.
const HALVINGS: u32 = 8;

/// Largest multiple of the scan's trials by which an evaluation decides whether two stretches are one.
const CLOSER: u64 = 16;

/// The stretches where it holds, by numbers of the scan.
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
    /// A place where it holds, between two of the scan of which one breaks other limits than the other: too short a pulse is
    /// noisy, too long a one moves the rotor, and what keeps both may lie between.
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

    /// Of several stretches those remain that are surely apart: between them it surely does not hold, and in each it surely
    /// does at one value. All that decides that is looked at more closely, with the same number of trials.
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
        // What may hold parts no stretches.
        let stretches = of(scan);
        for pair in stretches.windows(2) {
            let gap = pair[0].end..pair[1].start;
            if !gap.clone().any(|k| sure[k].1) {
                gap.for_each(|k| scan[k].1 = true);
            }
        }
        // What may not hold is none, unless all are so; then the widest is.
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
