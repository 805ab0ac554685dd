//! Dense output: the machines within a step.

use standstill_numeric::Wide;

use super::two_derivative::Here;
use crate::effect::winding::flux_within;
use crate::effect::{Effect, Looked, Span, terminals};

impl<V: Wide> Span<'_, '_, V> {
    /// Returns the states of the machines at this time within the step. They are as exact as at the end of the step. The flux comes from
    /// the integrals of the voltage and of the cubics of the currents. The currents come from the core at this flux.
    #[inline(always)]
    pub fn there(&self) -> Here<V> {
        let Span { machine, branch, from, step, share } = *self;
        let time = from.time + (step.end.time - from.time) * share;
        let mut there = Here { time, ..*from };
        machine.rotors.as_ref().within(self, &mut there);
        machine.links.within(self, &mut there);
        let area = machine.links.area_within(self, &there);
        there.state.flux = flux_within(self, area);
        let short = machine.shorted.as_ref();
        if let Some(short) = short {
            there.state.flux = there.state.flux + short.pulled_within(self);
        }
        if let Some(floating) = &step.floating {
            terminals::within(self, &floating.ringing, area, &mut there);
        }
        machine.circuits.eddies().within(self, &mut there);
        short.within(self, &mut there);
        let along = step.change[0].flux * (step.h * share);
        let point = some!(branch, branch => branch.at(there.state.flux, Some(along)));
        there.at = machine.operating(&there.state, point.as_ref(), short);
        let looked = Looked::at(&there, point, short, &step.legs);
        looked.settle(&step.legs, &mut there);
        if let Some(rotors) = &machine.rotors {
            rotors.follow(&looked, [looked.flux, looked.current], &mut there);
        }
        if step.floating.is_some() {
            terminals::clamp(machine, &step.legs, &mut there);
        }
        there
    }
}
