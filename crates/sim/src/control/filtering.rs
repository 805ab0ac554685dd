//! The sensors' filters over a step.

use standstill_inverter::Modes;
use standstill_numeric::Wide;

use super::run::Control;
use crate::lanes::bank::Bank;
use crate::sensing::Rings;

/// Currents in A and link voltage in V at one time.
pub(super) type Point = ([f64; 3], f64);

impl<'a> Control<'a> {
    /// What of the phases' currents oscillates within the step just accepted faster than four points of it can tell.
    pub(super) fn rings<V: Wide>(&self, bank: &Bank<'a, V>, modes: Modes) -> [Option<Rings>; 2] {
        let Some(floating) = &bank.tried.floating else { return [None; 2] };
        let lane = self.lane;
        [0, 1].map(|m: usize| {
            let of = floating.ringing.oscillation(lane, m)?;
            let to = &floating.ringing.modes.to[m];
            let share: [f64; 3] = std::array::from_fn(|k| {
                let axis = &bank.machine.legs.axes[k];
                axis.x.get(lane) * to.x.get(lane) + axis.y.get(lane) * to.y.get(lane)
            });
            Some(Rings { of, share: self.case.sensors.settings.seen(share, modes) })
        })
    }

    /// The filters follow `h` seconds, of which these are the beginning, one third, two thirds and the end.
    pub(super) fn filter(&mut self, h: f64, modes: Modes, points: [Point; 4], rings: [Option<Rings>; 2]) {
        if h <= 0.0 {
            return;
        }
        let settings = self.case.sensors.settings;
        if let Some(filters) = &mut self.filters {
            let mut seen = points.map(|(current, _)| settings.seen(current, modes));
            for ring in rings.iter().flatten() {
                for (n, seen) in seen.iter_mut().enumerate() {
                    let at = ring.at(n as f64 / 3.0);
                    for k in 0..3 {
                        seen[k] -= ring.share[k] * at;
                    }
                }
            }
            for (k, filter) in filters.iter_mut().enumerate() {
                filter.advance(h, seen.map(|current| current[k]));
                for ring in rings.iter().flatten() {
                    filter.ring(h, &ring.of, ring.share[k]);
                }
            }
        }
        if let Some(filter) = &mut self.link_filter {
            filter.advance(h, points.map(|(_, link)| link));
        }
    }
}
