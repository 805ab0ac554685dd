//! The machines within a step.

use standstill_numeric::Wide;

use super::two_derivative::{Here, Tried};
use crate::effect::play::Cells;
use crate::effect::winding::flux_within;
use crate::effect::{Effect, Looked, Span, terminals};
use crate::physics::machine::Machine;

impl<V: Wide> Tried<V> {
    /// The machines at a share of the step that began at `begin` with these play cells, as exactly as at its end: the flux from the
    /// voltage and the integral of the currents' cubic, the currents from the core there.
    #[inline(always)]
    pub fn within(
        &self,
        machine: &Machine<V>,
        begin: &Here<V>,
        cells: Option<&Cells<V>>,
        share: V,
    ) -> Here<V> {
        let span = Span { machine, from: begin, step: self, share };
        let time = begin.time + (self.end.time - begin.time) * share;
        let mut there = Here { time, ..*begin };
        machine.rotors.as_ref().within(&span, &mut there);
        machine.links.within(&span, &mut there);
        let area = machine.links.area_within(&span, &there);
        there.state.flux = flux_within(&span, area);
        if let Some(floating) = &self.floating {
            terminals::within(&span, &floating.ringing, area, &mut there);
        }
        machine.circuits.eddies().within(&span, &mut there);
        let along = self.change[0].flux * (self.h * share);
        let iron = some!(cells, cells => cells.iron(&cells.away_at(there.state.flux, Some(along))));
        there.at = machine.operating(&there.state, iron.as_ref());
        let looked = Looked::at(&there, iron, &self.legs);
        looked.settle(&self.legs, &mut there);
        if let Some(rotors) = &machine.rotors {
            rotors.follow(&looked, [looked.flux, looked.current], &mut there);
        }
        if self.floating.is_some() {
            terminals::clamp(machine, &self.legs, &mut there);
        }
        there
    }
}
