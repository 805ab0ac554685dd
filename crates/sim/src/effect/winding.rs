//! The winding within a step: its flux is the voltage's integral, which is exact, less a quadrature of the drop R i.

use standstill_numeric::{Symmetric, Wide};

use super::link::LinkStep;
use super::{Begin, Looked, Span};
use crate::physics::machine::Change;
use crate::physics::plane::Plane;
use crate::step::error::{Accuracy, error};
use crate::step::two_derivative::{Here, Tried};

/// The winding over a step.
#[derive(Clone, Copy)]
pub struct WindingStep<V> {
    /// The flux in Wb at the end, were there no drop.
    known: Plane<V>,
    /// The predicted flux in Wb at the end, with blocked legs' currents at zero, and the current in A there.
    pub predicted: [Plane<V>; 2],
}

impl<V: Wide> WindingStep<V> {
    /// Writes the predicted flux at the end into `there`.
    #[inline(always)]
    pub fn predict(begin: &Begin<'_, '_, V>, link: &LinkStep<V>, there: &mut Here<V>) -> Self {
        let Begin { h, legs, here, change, .. } = *begin;
        let (terminals, flux) = (&legs.terminals, here.state.flux);
        let known = flux + terminals.rail * link.area + terminals.offset * h;
        let drop = (here.at.current * h + change.current * (h * (h * 0.5))).through(terminals.resistance);
        // The voltage that holds the blocked leg's current, as it was at the beginning.
        let holding = terminals.blocked * (change.blocked_potential * (2.0 / 3.0) * h);
        there.state.flux = Plane::choose(legs.idle, flux + change.flux * h, known - drop + holding);
        Self { known, predicted: [there.state.flux, here.at.current] }
    }

    /// The flux in Wb that the prediction misses.
    #[inline(always)]
    pub fn missing(
        &self,
        begin: &Begin<'_, '_, V>,
        looked: &Looked<V>,
        change: &Change<V>,
        there: &Here<V>,
        link: &LinkStep<V>,
    ) -> Plane<V> {
        let Begin { h, legs, here, change: first, .. } = *begin;
        let (half, twelfth, terminals) = (h * 0.5, h * h * (1.0 / 12.0), &legs.terminals);
        let predicted = self.predicted[0];
        let drop = (here.at.current + there.at.current) * half + (first.current - change.current) * twelfth;
        let missing =
            self.known + terminals.rail * link.more - drop.through(terminals.resistance) - predicted;
        if !looked.any_idle {
            return missing;
        }
        let through = here.state.flux + (first.flux + change.flux) * half - predicted;
        Plane::choose(legs.idle, through, missing)
    }

    /// Adds the missing flux in Wb, with its feedback by the drop across a resistance in Ω.
    #[inline(always)]
    pub fn correct(
        begin: &Begin<'_, '_, V>,
        looked: &Looked<V>,
        missing: Plane<V>,
        resistance: Symmetric<V>,
        there: &mut Here<V>,
    ) {
        let legs = begin.legs;
        let missing = looked.held(legs, missing);
        let feedback = missing.through(looked.gamma).through(resistance) * (begin.h * 0.5);
        let missing = Plane::choose(legs.idle, missing, looked.held(legs, missing - feedback));
        there.state.flux = there.state.flux + missing;
        there.at.current = there.at.current + missing.through(looked.gamma);
    }

    /// Its share of the step's error, relative to the tolerance; the core was evaluated `off` in Wb from the end.
    #[inline(always)]
    pub fn error(
        begin: &Begin<'_, '_, V>,
        change: &Change<V>,
        there: &Here<V>,
        off: Plane<V>,
        accuracy: &Accuracy<V>,
    ) -> V {
        let resistance = &begin.legs.terminals.resistance;
        error(accuracy, begin.h, resistance, begin.here, there, [begin.change, change], off)
    }
}

/// The flux in Wb within a step, where the integral of the link's voltage up to there is `area` in V·s.
#[inline(always)]
pub fn flux_within<V: Wide>(span: &Span<'_, '_, V>, area: V) -> Plane<V> {
    let Span { from, step, share, .. } = *span;
    let Tried { h, legs, end: to, change: [first, last], .. } = step;
    let (h, terminals) = (*h, &legs.terminals);
    let of = |value: [V; 2], rise: [V; 2]| span.cubic(value, rise).area(share) * h;
    let charge = Plane::new(
        of([from.at.current.x, to.at.current.x], [first.current.x, last.current.x]),
        of([from.at.current.y, to.at.current.y], [first.current.y, last.current.y]),
    );
    let potential =
        first.blocked_potential + (last.blocked_potential - first.blocked_potential) * share * 0.5;
    let driven = from.state.flux + terminals.rail * area + terminals.offset * (h * share)
        - charge.through(terminals.resistance)
        + terminals.blocked * (potential * (2.0 / 3.0) * h * share);
    let [x, y] = span.flux();
    Plane::choose(legs.idle, Plane::new(x.at(share), y.at(share)), driven)
}
